"""Neurons in the way: how close a route comes to centres that are not its own.

In: all centres. Out: clearances up to ``REACH``; what is farther off does not matter to a route; for many routes at
once which of them come too close to anything.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.layout.geometry import cubics, distance, sampled
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
_CELL = 0.6
#: As ``sampled`` has it: how far apart, and how many on a piece.
_STEP, _FEWEST, _MOST = 0.2, 4, 400
_ROW = 1 << 31


class Obstacles:
    """Centres by cell; each is entered in every cell that it can reach, so that a look-up is one cell."""

    def __init__(self, centres: Sequence[Point]) -> None:
        self._cells: dict[tuple[int, int], list[tuple[int, Point]]] = {}
        for index, (x, y) in enumerate(centres):
            for column in range(math.floor((x - REACH) / _CELL), math.floor((x + REACH) / _CELL) + 1):
                for row in range(math.floor((y - REACH) / _CELL), math.floor((y + REACH) / _CELL) + 1):
                    self._cells.setdefault((column, row), []).append((index, (x, y)))

    def clearance(self, route: Route, own: tuple[int, int], enough: float = REACH) -> float:
        """The least distance of the route to a foreign centre, at most ``enough``."""
        least = enough
        cells, get = self._cells, self._cells.get
        if not cells:
            return least
        for point in sampled(route):
            for index, centre in get((math.floor(point[0] / _CELL), math.floor(point[1] / _CELL)), ()):
                if index not in own:
                    least = min(least, distance(point, centre))
        return least

    def crowded(self, routes: Sequence[Route], own: Sequence[tuple[int, int]], enough: float) -> list[bool]:
        """For each route whether its clearance is less than ``enough`` (at most ``REACH``), from the same points."""
        pieces = [(i, piece) for i, route in enumerate(routes) for piece in cubics(route)]
        result = np.zeros(len(routes), dtype=np.bool_)
        if not pieces or not self._cells:
            return [False] * len(routes)
        entries = sorted(
            (column * _ROW + row, index, centre)
            for (column, row), near in self._cells.items()
            for index, centre in near
        )
        keys = np.array([key for key, _, _ in entries], dtype=np.int64)
        index = np.array([i for _, i, _ in entries], dtype=np.int64)
        centres = np.array([centre for _, _, centre in entries], dtype=np.float64)
        owner = np.array([i for i, _ in pieces], dtype=np.int64)
        ends = np.array(own, dtype=np.int64)
        points, owner = points_on(np.array([piece for _, piece in pieces], dtype=np.float64), owner)
        cell = np.floor(points / _CELL).astype(np.int64)
        key = cell[:, 0] * _ROW + cell[:, 1]
        cells, starts, counts = np.unique(keys, return_index=True, return_counts=True)
        place = np.minimum(np.searchsorted(cells, key), len(cells) - 1)
        near = np.flatnonzero(cells[place] == key)  # few: most of a drawing is not near a disc
        first, count = starts[place[near]], counts[place[near]]
        for step in range(int(counts.max())):
            some = step < count
            at, entry = near[some], first[some] + step
            route = owner[at]
            x, y = (points[at] - centres[entry]).T
            foreign = (index[entry] != ends[route, 0]) & (index[entry] != ends[route, 1])
            result[route[foreign & (np.sqrt(x * x + y * y) < enough)]] = True
        return [bool(value) for value in result]


def points_on(
    pieces: npt.NDArray[np.float64], owner: npt.NDArray[np.int64], apart: float = _STEP
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Points on cubic pieces (p, 4, 2), about ``apart``, without the first of each, and whose they are."""
    steps = np.diff(pieces, axis=1)
    legs = np.sqrt(steps[:, :, 0] * steps[:, :, 0] + steps[:, :, 1] * steps[:, :, 1])
    length = legs[:, 0] + legs[:, 1] + legs[:, 2]
    parts = np.clip(np.ceil(length / apart), _FEWEST, _MOST).astype(np.int64)
    piece = np.repeat(np.arange(len(pieces), dtype=np.int64), parts)
    number = np.arange(len(piece), dtype=np.int64) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    t = (number / parts[piece])[:, None]
    s = 1 - t
    p = pieces[piece]
    points = s * s * s * p[:, 0] + 3 * s * s * t * p[:, 1] + 3 * s * t * t * p[:, 2] + t * t * t * p[:, 3]
    return points, owner[piece]
