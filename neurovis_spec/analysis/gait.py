"""The gait diagram: when each of some neurons is active in a rhythm.

In: activities of a set of neurons (those that lift the legs, for example) and a threshold. Out: for each of them its
onset, duty factor, phase and period; the stretches for which it is active. The first neuron of the set is the one by
which phases go.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.excerpt import Excerpt, excerpt
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.pairwise import THRESHOLD
from neurovis_spec.runtime.recording import Recording

QUANTITIES = ("onset", "duty", "phase", "period", "times")


def above(part: Excerpt, threshold: float) -> npt.NDArray[np.bool_]:
    """Which neurons are above the threshold in which rows: (rows, neurons)."""
    level = arguments.number("threshold", threshold)
    with np.errstate(invalid="ignore"):
        result: npt.NDArray[np.bool_] = part.activity > level
    return result


def gait(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    threshold: float = THRESHOLD,
) -> NamedArray:
    """A row for each neuron: the step of its first ``onset`` (NaN where it has none), its ``duty``, the share of time
    for which it is active, its ``phase``, how far behind the first neuron's onset its own comes (0…1 of that one's
    period; the mean around the circle), its ``period`` in steps, and how many ``times`` it becomes active. What
    happens where steps are missing is not known: no onset, period or phase is taken from there."""
    part = excerpt(recording, of, start, stop)
    active, gaps = above(part, threshold), part.gaps
    begins = [_onsets(active[:, column], gaps) for column in range(len(part.names))]
    #: how many gaps are before each row
    before = np.concatenate([[0], np.cumsum(gaps)])
    values = np.full((len(part.names), len(QUANTITIES)), np.nan)
    for row, own in enumerate(begins):
        values[row, 1], values[row, 4] = active[:, row].mean(), len(own)
        if len(own):
            values[row, 0] = part.step[own[0]]
            values[row, 2] = _phase(own, begins[0], part.step, before)
        whole = np.diff(before[own]) == 0
        if whole.any():
            values[row, 3] = np.diff(part.step[own])[whole].mean()
    return NamedArray("gait", values, Axis("neuron", part.names), Axis("quantity", QUANTITIES))


def stretches(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    threshold: float = THRESHOLD,
) -> dict[str, list[tuple[int, int]]]:
    """For each neuron the stretches for which it is active: the first step, and the one after the last."""
    part = excerpt(recording, of, start, stop)
    active, gaps = above(part, threshold), part.gaps
    stride = round(part.stride)
    result = {}
    for column, name in enumerate(part.names):
        own = active[:, column]
        first = np.flatnonzero(own & np.append(True, ~own[:-1] | gaps))
        last = np.flatnonzero(own & np.append(~own[1:] | gaps, True))
        result[name] = list(zip(part.step[first].tolist(), (part.step[last] + stride).tolist(), strict=True))
    return result


def _onsets(active: npt.NDArray[np.bool_], gaps: npt.NDArray[np.bool_]) -> IntArray:
    """The rows in which a neuron becomes active."""
    found: IntArray = np.flatnonzero(active[1:] & ~active[:-1] & ~gaps) + 1
    return found


def _phase(own: IntArray, reference: IntArray, step: IntArray, before: IntArray) -> float:
    """The mean phase of onsets (rows) in the cycles that begin with those of a reference; ``before`` (rows,) are the
    gaps before each."""
    if len(reference) < 2:
        return float("nan")
    cycle = np.clip(np.searchsorted(reference, own, "right") - 1, 0, len(reference) - 2)
    begin, end = reference[cycle], reference[cycle + 1]
    whole = (before[begin] == before[end]) & (before[own] == before[begin])
    if not whole.any():
        return float("nan")
    shares: FloatArray = ((step[own] - step[begin]) / (step[end] - step[begin]))[whole]
    turn = np.exp(2j * np.pi * shares).mean()
    phase = float(np.angle(turn) / (2 * np.pi)) % 1.0
    return 0.0 if phase > 1 - 1e-9 else phase
