"""From a uniform number to a count of the Poisson distribution, the same on every machine.

In: means, and uniform numbers in [0, 1). Out: counts. A mean takes one uniform number, which is used up by the
probabilities of the counts one after the other, from the most probable one outwards (the chop-down search from the
mode, Kemp and Kemp 1991, Journal of the Royal Statistical Society C 40:143-158). So that no count differs from one
platform to the next, the first probability and all others are computed from + − × ÷ and the square root alone, none of
them fused, and by the logarithm of ``box_muller``.
"""

from __future__ import annotations

import math

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray
from neurovis_spec.compiler.values import box_muller

#: the largest mean: its counts take some thousand operations each
LARGEST_MEAN = 1_000_000.0
#: the modes below which the first probability is a product, not Stirling's series
_FEW = 16
#: where both probabilities are below this the number is used up but for rounding: then the mode is the count
_NOTHING = 2.0**-70
_LN2_INVERSE = 1.4426950408889634
#: 1/n! from 1/13! to 1/2!, of exp in [−½ ln 2, ½ ln 2]
_EXP = tuple(1.0 / math.factorial(n) for n in range(13, 1, -1))
#: ln Γ(k + 1) − (k + ½) ln k + k − ½ ln 2π is (c0 + (c1 + (c2 + c3/k²)/k²)/k²)/k (Stirling)
_STIRLING = (1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0)


def is_mean(mean: float | FloatArray) -> BoolArray:
    """Whether a Poisson distribution has this mean: from 0 to the largest."""
    return np.asarray(np.greater_equal(mean, 0) & np.less_equal(mean, LARGEST_MEAN))


def counts(mean: float | FloatArray, uniform: FloatArray) -> FloatArray:
    """The count of each mean and uniform number, of the shape to which they broadcast; NaN where that is no mean.

    >>> counts(np.array([0.1, 3.0, 100.0, -1.0]), np.array([0.5, 0.999, 0.25, 0.5]))
    array([ 0., 10., 97., nan])
    """
    means = np.where(is_mean(mean), mean, 0.0)
    modes, begin = np.floor(means), _most_probable(means)
    shape = np.broadcast_shapes(means.shape, np.shape(uniform))
    left = np.broadcast_to(uniform, shape).ravel() - np.broadcast_to(begin, shape).ravel()
    result = np.broadcast_to(np.where(is_mean(mean), modes, np.nan), shape).flatten()
    where = np.flatnonzero((left >= 0) & ~np.isnan(result))
    rest, up, high = left[where], np.broadcast_to(begin, shape).ravel()[where], result[where]
    means, low, down = np.broadcast_to(means, shape).ravel()[where], high, up
    while len(where):
        high = high + 1.0
        up = up * (means / high)
        above = rest < up
        result[where[above]] = high[above]
        rest = rest - up
        down = down * (low / means)
        low = low - 1.0
        below = ~above & (rest < down)
        result[where[below]] = low[below]
        rest = rest - down
        on = ~above & ~below & (np.maximum(up, down) >= _NOTHING)
        where, means, rest = where[on], means[on], rest[on]
        up, down, high, low = up[on], down[on], high[on], low[on]
    return result.reshape(shape)


def _most_probable(mean: FloatArray) -> FloatArray:
    """The probability of the mode, ⌊mean⌋, of each mean: mean^k·exp(−mean)/k! of k below ``_FEW``, else as Loader has
    it, exp(−k·(e − ln(1 + e)) − Stirling's series of k)/√(2πk) with 1 + e = mean/k."""
    flat = mean.ravel()
    modes = np.floor(flat)
    few = modes < _FEW
    result = np.empty_like(flat)
    some, most = flat[few], modes[few]
    made = _exp(-some)
    for number in range(1, int(most.max(initial=0)) + 1):
        made = np.where(most >= number, made * (some / number), made)
    result[few] = made
    if not few.all():
        k = modes[~few]
        e = (flat[~few] - k) / k
        square = k * k
        series = _STIRLING[3] / square
        series = (series + _STIRLING[2]) / square
        series = (series + _STIRLING[1]) / square
        series = (series + _STIRLING[0]) / k
        apart = k * (e - box_muller.log(1.0 + e))
        result[~few] = _exp(-(apart + series)) / np.sqrt(math.tau * k)
    return result.reshape(mean.shape)


def _exp(x: FloatArray) -> FloatArray:
    """exp(x) for x from −17 to 0, within some 1e-16 of it."""
    whole = np.rint(x * _LN2_INVERSE)
    r = x - whole * box_muller.LN2_HIGH
    r = r - whole * box_muller.LN2_LOW
    total = _EXP[0] * r
    for coefficient in _EXP[1:]:
        total = (total + coefficient) * r
    return np.ldexp((total + 1.0) * r + 1.0, whole.astype(np.int32))


def constants() -> dict[str, str]:
    """The numbers above as C, by the names that the text of ``runtime.c_draws`` has for them."""
    lists = {"POISSON_EXP": _EXP, "POISSON_STIRLING": _STIRLING}
    texts = {f"{{{name}}}": f"{{{', '.join(map(repr, values))}}}" for name, values in lists.items()}
    return {
        "POISSON_EXP_COUNT": str(len(_EXP)),
        **texts,
        "POISSON_LARGEST": repr(LARGEST_MEAN),
        "POISSON_FEW": str(_FEW),
        "POISSON_NOTHING": repr(_NOTHING),
        "POISSON_LN2_INVERSE": repr(_LN2_INVERSE),
    }
