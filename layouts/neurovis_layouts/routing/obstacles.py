"""Neurons in the way: how close a route comes to centres that are not its own.

In: all centres. Out: clearances up to ``REACH``; what is farther off does not matter to a route; for many routes at
once which of them come too close to anything.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import pieces_of, points_in_turn
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
_CELL = 0.6
#: How far apart the points of a route are that are looked up.
_STEP = 0.2
_ROW = 1 << 31


class Obstacles:
    """Centres by cell; each is entered in every cell that it can reach, so that a look-up is one cell."""

    def __init__(self, centres: Sequence[Point]) -> None:
        at = np.array(centres, dtype=np.float64).reshape(-1, 2)
        low = np.floor((at - REACH) / _CELL).astype(np.int64)
        spans = np.floor((at + REACH) / _CELL).astype(np.int64) - low + 1
        counts = spans[:, 0] * spans[:, 1]
        index = np.repeat(np.arange(len(at), dtype=np.int64), counts)
        place = np.arange(len(index), dtype=np.int64) - np.repeat(np.cumsum(counts) - counts, counts)
        column, row = np.divmod(place, spans[index, 1])
        keys = (low[index, 0] + column) * _ROW + low[index, 1] + row
        order = np.argsort(keys, kind="stable")
        self._index, self._centres = index[order], at[index[order]]
        self._cells, self._starts, self._counts = np.unique(keys[order], return_index=True, return_counts=True)

    def clearance(self, route: Route, own: tuple[int, int]) -> float:
        """The least distance of the route to a foreign centre, at most ``REACH``."""
        return self.clearances([route], [own])[0]

    def crowded(self, routes: Sequence[Route], own: Sequence[tuple[int, int]], enough: float) -> list[bool]:
        """For each route whether its clearance is less than ``enough`` (at most ``REACH``)."""
        return [clearance < enough for clearance in self.clearances(routes, own)]

    def clearances(self, routes: Sequence[Route], own: Sequence[tuple[int, int]]) -> list[float]:
        """For each route the least distance to a centre that is none of its two ``own`` neurons', at most ``REACH``."""
        result = np.full(len(routes), REACH)
        if not len(routes) or not len(self._cells):
            return [REACH] * len(routes)
        ends = np.array(own, dtype=np.int64)
        for points, whose in points_in_turn(*pieces_of(routes), _STEP):
            self._lower(result, ends, points, whose)
        return [float(value) for value in result]

    def _lower(self, result: FloatArray, ends: IntArray, points: FloatArray, owner: IntArray) -> None:
        """Lower the clearances of routes to those of points (n, 2) on them; ``owner`` says whose the points are."""
        cell = np.floor(points / _CELL).astype(np.int64)
        key = cell[:, 0] * _ROW + cell[:, 1]
        place = np.minimum(np.searchsorted(self._cells, key), len(self._cells) - 1)
        near = np.flatnonzero(self._cells[place] == key)  # few: most of a drawing is not near a disc
        first, count = self._starts[place[near]], self._counts[place[near]]
        for step in range(int(count.max(initial=0))):
            some = step < count
            at, entry = near[some], first[some] + step
            route = owner[at]
            x, y = (points[at] - self._centres[entry]).T
            foreign = (self._index[entry] != ends[route, 0]) & (self._index[entry] != ends[route, 1])
            np.minimum.at(result, route[foreign], np.sqrt(x * x + y * y)[foreign])
