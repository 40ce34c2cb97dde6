"""Neurons in the way: how close a route comes to centres that are not its own.

In: all centres. Out: clearances up to ``REACH``; what is farther off does not matter to a route.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
_CELL = 0.6


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
