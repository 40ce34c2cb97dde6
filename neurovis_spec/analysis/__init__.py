"""Analysis: what a run or a recording tells, in numbers: the measures of the NeuroVis paper, and their pictures.

In: a Recording, or a compiled network. Out: named arrays; with ``report``, a folder of tables, pictures and a page.
docs/measures.md lists all measures, with equations and sources.
"""

from __future__ import annotations

from neurovis_spec.analysis.firing import around, correlogram, firing, group_firing, intervals, rates
from neurovis_spec.analysis.gait import gait, stretches
from neurovis_spec.analysis.recorded import (
    awake_at_once,
    connection_matrix,
    cut,
    topography,
    traces,
    updates,
    weight_changes,
    weights,
)
from neurovis_spec.analysis.trials import importance, sensitivity
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.pairwise import coactivation, cross_correlation, mutual_information, printed_correlation

__all__ = [
    "Axis",
    "NamedArray",
    "around",
    "awake_at_once",
    "coactivation",
    "connection_matrix",
    "correlogram",
    "cross_correlation",
    "cut",
    "firing",
    "gait",
    "group_firing",
    "importance",
    "intervals",
    "mutual_information",
    "printed_correlation",
    "rates",
    "sensitivity",
    "stretches",
    "topography",
    "traces",
    "updates",
    "weight_changes",
    "weights",
]
