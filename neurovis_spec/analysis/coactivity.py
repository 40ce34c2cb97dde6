"""Co-activation (Fig. 6A): for how long two neurons are active at the same time.

In: activities and a threshold. Out: seconds of each pair, a period or in total; how many neurons are active at a time.
A neuron is active while its absolute activity is above the threshold.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.analysis.excerpt import Excerpt, excerpt, paired
from neurovis_spec.analysis.named import Axis, NamedArray, pairs
from neurovis_spec.analysis.period import period_of
from neurovis_spec.runtime.recording import Recording, RecordingError

#: As Fig. 6 has it.
THRESHOLD = 0.05


def awake(part: Excerpt, threshold: float) -> npt.NDArray[np.bool_]:
    """Which neurons are active in which rows: (rows, neurons)."""
    if not arguments.number("threshold", threshold) >= 0:
        raise ValueError(f"a threshold is at least 0, not {threshold}")
    with np.errstate(invalid="ignore"):
        result: npt.NDArray[np.bool_] = np.abs(part.activity) > threshold
    return result


def coactivation(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    threshold: float = THRESHOLD,
    per: Literal["period", "total"] = "period",
    period: float | None = None,
) -> NamedArray:
    """The seconds for which each pair of neurons is active together, in a period or in total; of a neuron with itself
    those for which it is active. ``period`` is in steps, by default that of the activities. Raises RecordingError where
    these have none."""
    if per not in ("period", "total"):
        raise ValueError(f"'per' is 'period' or 'total', not {per!r}")
    part = paired(recording, of, start, stop)
    active = awake(part, threshold).astype(np.float64)
    seconds = active.T @ active * part.seconds
    if per == "total":
        return pairs("co-activation in total", seconds, part.names, "s")
    steps = found_period(part) if period is None else arguments.number("period", period)
    if steps is None:
        raise RecordingError("the activities have no period: give one (in steps), or ask for the total (per='total')")
    if not steps > 0:
        raise ValueError(f"a period is above 0 steps, not {steps}")
    periods = len(part.step) * part.stride / steps
    return pairs("co-activation a period", seconds / periods, part.names, "s")


def found_period(part: Excerpt) -> float | None:
    """The period of the activities in steps."""
    rows = period_of(part.activity)
    return None if rows is None else rows * part.stride


def awake_at_once(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    threshold: float = THRESHOLD,
) -> NamedArray:
    """For how many seconds so many of the neurons are active at once, and for what share of the time: a row for each
    number that occurs."""
    part = excerpt(recording, of, start, stop)
    counts = np.bincount(awake(part, threshold).sum(axis=1))
    there = np.flatnonzero(counts)
    rows = Axis("active at once", tuple(str(number) for number in there.tolist()))
    values = np.stack([counts[there] * part.seconds, counts[there] / len(part.step)], axis=1)
    return NamedArray("active at once", values, rows, Axis("quantity", ("seconds", "share")))
