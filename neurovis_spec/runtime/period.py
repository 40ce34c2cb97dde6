"""The period of a rhythm, from the activities themselves.

In: activities at even steps. Out: the period in rows, by the autocorrelation of all neurons together; None where they
do not repeat.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray

#: What repeats is at least so alike a period later (1: the same).
_ALIKE = 0.5
#: A repetition nearly as good as the best one counts as one: twice the period is as good as the period.
_NEARLY = 0.95


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
