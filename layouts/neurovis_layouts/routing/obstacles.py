"""Neurons in the way: how close a route comes to centres that are not its own.

In: all centres. Out: clearances up to ``REACH``; what is farther off does not matter to a route; for many routes at
once which of them come too close to anything.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Cells, pieces_of, points_in_turn, squared_distances
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
#: How far apart the points of a route are that are looked up.
_STEP = 0.2


class Obstacles:
    """All centres, by cell."""

    def __init__(self, centres: Sequence[Point]) -> None:
        self._places: FloatArray = np.array(centres, dtype=np.float64).reshape(-1, 2)
        # where a line is closer than this to a centre, one of its points is closer than that
        self._cells = Cells(self._places, REACH + _STEP / 4)

    def clearance(self, route: Route, own: tuple[int, int]) -> float:
        """The least distance of the route to a foreign centre, at most ``REACH``."""
        return self.clearances([route], [own])[0]

    def run_over(self, routes: Sequence[Route], own: Sequence[tuple[int, int]]) -> list[bool]:
        """For each route whether it runs over a foreign disc."""
        return [clearance < TOUCH for clearance in self.clearances(routes, own)]

    def clearances(self, routes: Sequence[Route], own: Sequence[tuple[int, int]]) -> list[float]:
        """For each route the least distance to a centre that is none of its two ``own`` neurons', at most ``REACH``."""
        result = np.full(len(routes), REACH * REACH)
        ends = np.array(own, dtype=np.int64).reshape(-1, 2)
        for points, whose in points_in_turn(*pieces_of(routes), _STEP):
            point, centre, _ = self._cells.near(points)
            route = whose[point]
            foreign = (centre != ends[route, 0]) & (centre != ends[route, 1])
            point, centre, route = point[foreign], centre[foreign], route[foreign]
            # the line is as close as the nearer of the two steps that lead to and from a point
            for other in (np.maximum(point - 1, 0), np.minimum(point + 1, len(points) - 1)):
                other = np.where(whose[other] == route, other, point)
                squared = squared_distances(
                    *(self._places[centre] - points[point]).T, *(points[other] - points[point]).T
                )
                np.minimum.at(result, route, squared)
        return [float(value) for value in np.sqrt(result)]
