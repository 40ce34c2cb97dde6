"""Measures of pairs of neurons: cross-correlation (Eq. 12), mutual information (Eqs. 13, 14), co-activation (Fig. 6A).

In: activities. Out: a table with a row and a column for each of the neurons.

- *Cross-correlation*: E[x·y]. The paper prints p(x)·p(y) where the joint distribution p(x, y) must stand: the printed
  sum is E[x]·E[y], which does not see whether x and y come together.
- *Mutual information*, in bits: each neuron's range, from its lowest to its highest activity, is cut into equal bins;
  p(x) and p(x, y) are how often these occur.
- *Co-activation*: for how long two neurons are active at the same time. A neuron is active while its absolute activity
  is above a threshold.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.excerpt import Activities, Excerpt, excerpt
from neurovis_spec.runtime.named_array import Axis, NamedArray

#: What repeats is at least so alike a period later (1: the same).
_ALIKE = 0.5
#: A repetition nearly as good as the best one counts as one: twice the period is as good as the period.
_NEARLY = 0.95

#: A measure of pairs is of at most so many neurons: its tables have the square of it.
MOST_NEURONS = 400
MOST_BINS = 1000
#: As Fig. 6 has it.
THRESHOLD = 0.05


def period_of(activity: FloatArray) -> float | None:
    """After how many rows the activities (rows, neurons) repeat.

    >>> t = np.arange(1000)
    >>> round(period_of(np.stack([np.sin(t / 10), np.cos(t / 10)], axis=1)), 1)
    62.8
    >>> period_of(np.arange(100.0)[:, None]) is None
    True
    """
    rows = len(activity)
    if rows < 8:
        return None
    with np.errstate(all="ignore"):
        centred = activity - activity.mean(axis=0)
    if not np.isfinite(centred).all():
        return None
    scale = np.abs(centred).max(axis=0)
    alive = scale > 1e-12
    if not alive.any():
        return None
    alike = _autocorrelation(centred[:, alive] / scale[alive])
    begin = np.flatnonzero(alike < 0)
    if not len(begin):
        return None
    inner = np.arange(max(int(begin[0]), 1), len(alike) - 1)
    peaks = inner[(alike[inner] >= alike[inner - 1]) & (alike[inner] > alike[inner + 1])]
    peaks = peaks[alike[peaks] >= _ALIKE]
    if not len(peaks):
        return None
    first = int(peaks[alike[peaks] >= _NEARLY * alike[peaks].max()][0])
    period = _peak(alike, first)
    for later in range(2, int((len(alike) - 2) / period) + 1):  # each repetition tells the period more exactly
        near = round(later * period)
        around = np.arange(near - 2, min(near + 3, len(alike) - 1))
        best = int(around[np.argmax(alike[around])])
        if alike[best] < _ALIKE or best in (around[0], around[-1]):
            break
        period = _peak(alike, best) / later
    return period


def _autocorrelation(values: FloatArray) -> FloatArray:
    """How alike all columns together are to themselves so many rows later, up to half of the rows; 1 for the same."""
    rows = len(values)
    size = 1 << (2 * rows - 1).bit_length()
    product = np.zeros(size)
    for column in values.T:
        product += np.fft.irfft(np.abs(np.fft.rfft(column, size)) ** 2, size)
    squares = np.concatenate([[0.0], np.cumsum((values**2).sum(axis=1))])
    lags = np.arange(rows // 2 + 1)
    early, late = squares[rows - lags], squares[rows] - squares[lags]
    with np.errstate(all="ignore"):
        result: FloatArray = np.nan_to_num(product[lags] / np.sqrt(early * late))
    return result


def _peak(values: FloatArray, place: int) -> float:
    """The place of a peak between rows, by the parabola through it and its neighbours."""
    before, top, after = values[place - 1 : place + 2].tolist()
    bend = before - 2 * top + after
    return place + (0.5 * (before - after) / bend if bend < 0 else 0.0)


def cross_correlation(
    recording: Activities, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """Σ x·y·p(x, y) of each pair of neurons: the mean of the product of their activities, as Fig. 6B has it."""
    part = _excerpt(recording, of, start, stop)
    with np.errstate(all="ignore"):
        product = part.activity.T @ part.activity / len(part.step)
    return _table("cross-correlation", product, part.names)


def printed_correlation(
    recording: Activities, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """Σ x·y·p(x)·p(y), as Eq. 12 is printed: the product of the means, for all pairs of neurons that are alike one
    value."""
    part = _excerpt(recording, of, start, stop)
    with np.errstate(all="ignore"):
        means = part.activity.mean(axis=0)
        product = np.multiply.outer(means, means)
    return _table("cross-correlation as printed", product, part.names)


def mutual_information(
    recording: Activities,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    bins: int = 20,
) -> NamedArray:
    """I(X; Y) of each pair of neurons in bits; of a neuron with itself its entropy. NaN where an activity is no finite
    number."""
    count = arguments.integer("bins", bins, 2, MOST_BINS)
    part = _excerpt(recording, of, start, stop)
    numbers = [_binned(part.activity[:, column], count) for column in range(len(part.names))]
    result = np.full((len(numbers), len(numbers)), np.nan)
    for i, x in enumerate(numbers):
        for j, y in enumerate(numbers[: i + 1]):
            if x is not None and y is not None:
                result[i, j] = result[j, i] = _information(x, y, count)
    return _table("mutual information", result, part.names, "bits")


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


def awake(part: Excerpt, threshold: float) -> npt.NDArray[np.bool_]:
    """Which neurons are active in which rows: (rows, neurons)."""
    if not arguments.number("threshold", threshold) >= 0:
        raise ValueError(f"a threshold is at least 0, not {threshold}")
    with np.errstate(invalid="ignore"):
        result: npt.NDArray[np.bool_] = np.abs(part.activity) > threshold
    return result


def coactivation(
    recording: Activities,
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
    part = _excerpt(recording, of, start, stop)
    active = awake(part, threshold).astype(np.float64)
    seconds = active.T @ active * part.seconds
    if per == "total":
        return _table("co-activation in total", seconds, part.names, "s")
    steps = found_period(part) if period is None else arguments.number("period", period)
    if steps is None:
        raise RecordingError("the activities have no period: give one (in steps), or ask for the total (per='total')")
    if not steps > 0:
        raise ValueError(f"a period is above 0 steps, not {steps}")
    periods = len(part.step) * part.stride / steps
    return _table("co-activation a period", seconds / periods, part.names, "s")


def found_period(part: Excerpt) -> float | None:
    """The period of the activities in steps."""
    rows = period_of(part.activity)
    return None if rows is None else rows * part.stride


def _excerpt(
    recording: Activities, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> Excerpt:
    """The same for a measure of pairs. Raises RecordingError where there are too many neurons."""
    part = excerpt(recording, of, start, stop)
    if len(part.names) > MOST_NEURONS:
        many = f"{len(part.names):,} neurons are too many for a measure of pairs, which takes {MOST_NEURONS}"
        raise RecordingError(f"{many}: choose some (of='K', --of K)")
    return part


def _table(name: str, values: FloatArray, names: tuple[str, ...], unit: str = "") -> NamedArray:
    """A table with a row and a column for each of the same neurons."""
    return NamedArray(name, values, Axis("neuron", names), Axis("neuron", names), unit)
