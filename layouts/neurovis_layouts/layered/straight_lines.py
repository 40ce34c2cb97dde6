"""Straight lines: how often connections would cross each other, and run over discs, if they were straight.

In: places, and pairs of neurons. Out: counts, quick enough to compare many drawings by them before any route is drawn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_layouts.routing.obstacles import REACH
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import crossing, squared_distances

#: Of more lines than so many nothing is counted.
_MOST = 300


def unrelated(lines: Sequence[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    """Every two of these pairs of neurons that have none in common; none where they are too many to be followed."""
    one, other = np.triu_indices(len(lines) if len(lines) <= _MOST else 0, 1)
    ends = np.array(lines, dtype=np.int64).reshape(-1, 2)
    shared = (ends[one][:, :, None] == ends[other][:, None, :]).any(axis=(1, 2))
    return one[~shared], other[~shared]


def crossings(lines: FloatArray, one: IntArray, other: IntArray) -> int:
    """How many of these pairs of straight lines (n, 2, 2) cross."""
    (a, b), (c, d) = lines[one].transpose(1, 2, 0), lines[other].transpose(1, 2, 0)
    return int(crossing(a, b - a, c, d - c)[1].sum())


def run_over(lines: FloatArray, places: FloatArray) -> int:
    """How many discs at these places (k, 2) straight lines (n, 2, 2) run over, but for those at their ends."""
    if len(lines) > _MOST:
        return 0
    x, y = (places[None] - lines[:, None, 0]).transpose(2, 0, 1)
    dx, dy = (lines[:, 1] - lines[:, 0]).T[:, :, None]
    over = squared_distances(x, y, dx, dy) < REACH * REACH
    return int(over.sum()) - 2 * len(lines)
