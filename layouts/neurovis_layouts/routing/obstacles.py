"""What is in the way of routes: the discs of other neurons, and foreign frames, which hold neither end of a route.

In: all centres (``Obstacles``), frames (``Walls``). Out, for many routes at once: how close each comes to a foreign
centre, up to ``REACH``, as what is farther off does not matter; which of them run over a disc or enter a foreign frame.
A route from neuron 0 to 1 may leave a frame that holds 0, and enter one that holds 1, but no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import Cells, Rect, pieces_of, points_in_turn, squared_distances
from neurovis_spec.layout.model import Point, Route

#: A route this far from a centre is clear of the disc and of its ring.
REACH = 0.45
#: Below this a route runs over a disc.
TOUCH = 0.3
#: How far apart the points of a route are that are looked up.
_STEP = 0.2
#: The neurons in a frame, and its rectangle.
Frame: TypeAlias = tuple[frozenset[int], Rect]
#: How far apart the points of a route are that must not lie in a foreign frame.
_FINELY = 0.1
#: So few rectangles are all compared with segments, wherever they are.
_FEW = 16


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


class Walls:
    """Frames: ``rects`` (f, 4), and ``inside`` (n, f), whether a neuron is in a frame."""

    def __init__(self, frames: Sequence[Frame], neurons: int) -> None:
        self.rects: FloatArray = np.array([rect for _, rect in frames], dtype=np.float64).reshape(-1, 4)
        self.inside: BoolArray = np.zeros((neurons, len(frames)), dtype=np.bool_)
        for number, (own, _) in enumerate(frames):
            self.inside[sorted(own), number] = True

    def foreign(self, source: int, target: int) -> BoolArray:
        """(f,) which frames hold neither end of a route."""
        found: BoolArray = ~(self.inside[source] | self.inside[target])
        return found

    def entered(self, routes: Sequence[Route], own: Sequence[tuple[int, int]]) -> list[bool]:
        """For each route, from the first of its ``own`` neurons to the second, whether it enters a foreign frame."""
        result = np.zeros(len(routes), dtype=np.bool_)
        if not len(routes) or not len(self.rects):
            return [False] * len(routes)
        ends = np.array(own, dtype=np.int64)
        for points, whose in points_in_turn(*pieces_of(routes), _FINELY):
            x, y = np.ascontiguousarray(points.T)
            low, high = points.min(axis=0), points.max(axis=0)
            near = np.flatnonzero(((self.rects[:, :2] < high) & (self.rects[:, 2:] > low)).all(axis=1))
            for number in near.tolist():
                x0, y0, x1, y1 = self.rects[number].tolist()
                within = whose[np.flatnonzero((x > x0) & (x < x1) & (y > y0) & (y < y1))]
                foreign = ~(self.inside[ends[within, 0], number] | self.inside[ends[within, 1], number])
                result[within[foreign]] = True
        return [bool(value) for value in result]


@dataclass(frozen=True, slots=True)
class Barriers:
    """What routes run into: discs, and frames."""

    discs: Obstacles
    frames: Walls

    def hit(self, routes: Sequence[Route], own: Sequence[tuple[int, int]]) -> list[bool]:
        """For each route, between its ``own`` neurons, whether it runs over a foreign disc or enters such a frame."""
        return [
            any(one) for one in zip(self.discs.run_over(routes, own), self.frames.entered(routes, own), strict=True)
        ]


def meet(a: FloatArray, b: FloatArray, rects: FloatArray) -> BoolArray:
    """(k, f) whether the segments from ``a`` (k, 2) to ``b`` (k, 2) enter rectangles (f, 4), borders apart."""
    entered: BoolArray = np.zeros((len(a), len(rects)), dtype=np.bool_)
    entered[meetings(a, b, rects)] = True
    return entered


def blocked(a: FloatArray, b: FloatArray, rects: FloatArray) -> BoolArray:
    """(k,) whether the segments from ``a`` (k, 2), or (1, 2) for all, to ``b`` (k, 2) enter any of the rectangles
    (f, 4)."""
    entered: BoolArray = np.zeros(len(b), dtype=np.bool_)
    if len(b) and len(rects) > _FEW:
        # segments that are close to each other are compared with what is near these alone
        low, high = np.minimum(a, b).min(axis=0), np.maximum(a, b).max(axis=0)
        rects = rects[((rects[:, :2] < high) & (rects[:, 2:] > low)).all(axis=1)]
    entered[meetings(a, b, rects)[0]] = True
    return entered


def meetings(a: FloatArray, b: FloatArray, rects: FloatArray) -> tuple[IntArray, IntArray]:
    """Which segment enters which rectangle."""
    # apart on no axis: across, along, and that square to the segment (separating axes)
    half, middle = (rects[:, 2:] - rects[:, :2]) / 2, (rects[:, 2:] + rects[:, :2]) / 2
    (ex, ey), (mx, my) = ((b - a) / 2).T, ((a + b) / 2).T
    wide, high = np.abs(ex), np.abs(ey)
    near = np.abs(mx[:, None] - middle[:, 0]) < half[:, 0] + wide[:, None]
    near &= np.abs(my[:, None] - middle[:, 1]) < half[:, 1] + high[:, None]
    # few are near on both axes: the third is checked for these alone
    k, f = np.nonzero(near)
    ex, ey, wide, high = ex[k], ey[k], wide[k], high[k]
    x, y = mx[k] - middle[f, 0], my[k] - middle[f, 1]
    entered = np.abs(x * ey - y * ex) <= half[f, 0] * high + half[f, 1] * wide
    return k[entered], f[entered]
