"""Activities over time (Figs. 4B, D, E) and over the picture of the network (a topography map).

In: a Recording; for the map, the positions of a layout. Out: tables of activities, and of what each neuron is like.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_spec.analysis.excerpt import excerpt
from neurovis_spec.analysis.named import Axis, NamedArray
from neurovis_spec.runtime.recording import Recording

QUANTITIES = ("x", "y", "last", "mean", "rms", "lowest", "highest")


def traces(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """a[t] of each neuron, a row a step."""
    part = excerpt(recording, of, start, stop)
    steps = Axis("step", tuple(str(step) for step in part.step.tolist()))
    return NamedArray("traces", part.activity, steps, Axis("neuron", part.names))


def topography(
    recording: Recording,
    positions: Mapping[str, tuple[float, float]],
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
) -> NamedArray:
    """A row for each neuron: where it stands (``network.layout().positions``), its ``last`` activity, the ``mean``, the
    root mean square, the ``lowest`` and the ``highest``."""
    part = excerpt(recording, of, start, stop)
    own = part.activity
    with np.errstate(all="ignore"):
        summed = [own[-1], own.mean(axis=0), np.sqrt((own**2).mean(axis=0)), own.min(axis=0), own.max(axis=0)]
    nowhere = (float("nan"), float("nan"))
    at = np.array([positions.get(name, nowhere) for name in part.names]).reshape(-1, 2)
    values = np.column_stack([at, *summed])
    return NamedArray("topography", values, Axis("neuron", part.names), Axis("quantity", QUANTITIES))
