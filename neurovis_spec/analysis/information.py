"""Mutual information (Eqs. 13 and 14): how much one neuron tells of another, in bits.

In: activities. Out: a table of pairs. Each neuron's range, from its lowest to its highest activity, is cut into equal
bins; p(x) and p(x, y) are how often these occur.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec import arguments
from neurovis_spec.analysis.excerpt import paired
from neurovis_spec.analysis.named import NamedArray, pairs
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.recording import Recording

MOST_BINS = 1000


def mutual_information(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    bins: int = 20,
) -> NamedArray:
    """I(X; Y) of each pair of neurons in bits; of a neuron with itself its entropy. NaN where an activity is no finite
    number."""
    count = arguments.integer("bins", bins, 2, MOST_BINS)
    part = paired(recording, of, start, stop)
    numbers = [_binned(part.activity[:, column], count) for column in range(len(part.names))]
    result = np.full((len(numbers), len(numbers)), np.nan)
    for i, x in enumerate(numbers):
        for j, y in enumerate(numbers[: i + 1]):
            if x is not None and y is not None:
                result[i, j] = result[j, i] = _information(x, y, count)
    return pairs("mutual information", result, part.names, "bits")


def _binned(values: FloatArray, bins: int) -> IntArray | None:
    """The bin of each value; None where one is no finite number."""
    if not np.isfinite(values).all():
        return None
    edges = np.histogram_bin_edges(values, bins)
    found: IntArray = np.clip(np.searchsorted(edges, values, "right") - 1, 0, bins - 1).astype(np.int64)
    return found


def _information(x: IntArray, y: IntArray, bins: int) -> float:
    joint = np.bincount(x * bins + y, minlength=bins * bins).reshape(bins, bins) / len(x)
    apart = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    occurs = joint > 0
    return max(0.0, float((joint[occurs] * np.log2(joint[occurs] / apart[occurs])).sum()))
