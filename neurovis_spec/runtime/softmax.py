"""The shares of groups in 1, number by number and as arrays: sums in the same order.

In: activities, and which of them are free, since nothing holds them. Out: the same, where those that are free share
what the others of their group leave of 1, each by exp(a). C does the same (``c_step.py``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.language.expressions.functions import FUNCTIONS


def shared(values: Sequence[float], free: Sequence[bool]) -> list[float]:
    """The activities of one group.

    >>> shared([0.0, 0.0, 0.5, 9.0], [True, True, False, False]), shared([1.0, 1.0], [True, True])
    ([0.0, 0.0, 0.5, 9.0], [0.5, 0.5])
    >>> shared([7.0, 7.0, 0.5], [True, True, False])
    [0.25, 0.25, 0.5]
    """
    exp, greatest, taken, total = FUNCTIONS["exp"].scalar, -math.inf, 0.0, 0.0
    for value, is_free in zip(values, free, strict=True):
        if not is_free:
            taken += value
        elif value > greatest:
            greatest = value
    result = list(values)
    for place, is_free in enumerate(free):
        if is_free:
            result[place] = exp(values[place] - greatest)
            total += result[place]
    rest = max(1.0 - taken, 0.0)
    return [value / total * rest if is_free else value for value, is_free in zip(result, free, strict=True)]


def share(values: FloatArray, free: BoolArray, starts: IntArray) -> FloatArray:
    """Those of all groups, which begin at ``starts``; the last of these is the end."""
    count = len(starts) - 1
    slots = np.repeat(np.arange(count), np.diff(starts))
    taken = np.bincount(slots[~free], values[~free], count)
    own, result = slots[free], np.array(values)
    greatest = np.full(count, -np.inf)
    np.maximum.at(greatest, own, values[free])
    powers = np.exp(values[free] - greatest[own])
    total = np.bincount(own, powers, count)
    result[free] = powers / total[own] * np.maximum(1.0 - taken, 0.0)[own]
    return result
