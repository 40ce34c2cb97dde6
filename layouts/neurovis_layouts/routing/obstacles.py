"""Neurons in the way: how close a route comes to centres that are not its own.

In: all centres. Out: clearances up to ``REACH``; what is farther off does not matter to a route; for many routes at
once which of them come too close to anything.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.layout.geometry import cubics
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
_CELL = 0.6
#: As ``sampled`` has it: how far apart, and how many on a piece.
_STEP, _FEWEST, _MOST = 0.2, 4, 400
_ROW = 1 << 31
#: Points looked up at once: so many stay in the processor's cache.
_AT_ONCE = 1 << 14


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
        pieces = [(i, piece) for i, route in enumerate(routes) for piece in cubics(route)]
        result = np.full(len(routes), REACH)
        if not pieces or not len(self._cells):
            return [REACH] * len(routes)
        owner = np.array([i for i, _ in pieces], dtype=np.int64)
        ends = np.array(own, dtype=np.int64)
        for points, whose in points_in_turn(np.array([piece for _, piece in pieces], dtype=np.float64), owner):
            self._lower(result, ends, points, whose)
        return [float(value) for value in result]

    def _lower(
        self,
        result: npt.NDArray[np.float64],
        ends: npt.NDArray[np.int64],
        points: npt.NDArray[np.float64],
        owner: npt.NDArray[np.int64],
    ) -> None:
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


def points_on(
    pieces: npt.NDArray[np.float64], owner: npt.NDArray[np.int64], apart: float = _STEP
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Points on cubic pieces (p, 4, 2), about ``apart``, without the first of each, and whose they are."""
    parts = _counts(pieces, apart)
    piece = np.repeat(np.arange(len(pieces), dtype=np.int64), parts)
    number = np.arange(len(piece), dtype=np.int64) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    t = number / parts[piece]
    s = 1 - t
    weights = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
    points = np.empty((len(t), 2))
    for axis in (0, 1):
        p, q, r, z = pieces[:, :, axis].T
        points[:, axis] = weights[0] * p[piece] + weights[1] * q[piece] + weights[2] * r[piece] + weights[3] * z[piece]
    return points, owner[piece]


def points_in_turn(
    pieces: npt.NDArray[np.float64], owner: npt.NDArray[np.int64], apart: float = _STEP
) -> Iterator[tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]]:
    """What ``points_on`` gives, of some pieces after the other: points of many long routes would fill the memory."""
    until = np.cumsum(_counts(pieces, apart))
    first = before = 0
    while first < len(pieces):
        last = max(first + 1, int(np.searchsorted(until, before + _AT_ONCE, side="right")))
        yield points_on(pieces[first:last], owner[first:last], apart)
        first, before = last, int(until[last - 1])


def _counts(pieces: npt.NDArray[np.float64], apart: float) -> npt.NDArray[np.int64]:
    """(p,) how many points there are on each piece."""
    steps = np.diff(pieces, axis=1)
    legs = np.sqrt(steps[:, :, 0] * steps[:, :, 0] + steps[:, :, 1] * steps[:, :, 1])
    length = legs[:, 0] + legs[:, 1] + legs[:, 2]
    counts: npt.NDArray[np.int64] = np.clip(np.ceil(length / apart), _FEWEST, _MOST).astype(np.int64)
    return counts
