"""Self-loops: out of the disc and back, to the side where there is most room.

In: a centre, what is around it, the loops that it has. Out: a route that leaves the centre and comes back to it, clear
of those loops: around them, or to another side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.route_cost import ENTERING
from neurovis_layouts.routing.walls import Walls
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import distance, pieces_of, points_on
from neurovis_spec.layout.model import Point, Route

_DIAGONAL = math.sqrt(0.5)
#: Cosine and sine of an eighth of a half turn.
_FLAT, _STEEP = math.sqrt(0.5 + _DIAGONAL / 2), math.sqrt(0.5 - _DIAGONAL / 2)
#: Ways and what they cost: sides, sides tilted up or down, along the direction, diagonals; the first of equals wins.
_WAYS: tuple[tuple[Point, float], ...] = (
    ((1.0, 0.0), 0.0),
    ((-1.0, 0.0), 0.0),
    ((_FLAT, -_STEEP), 0.06),
    ((-_FLAT, -_STEEP), 0.06),
    ((_FLAT, _STEEP), 0.06),
    ((-_FLAT, _STEEP), 0.06),
    ((0.0, -1.0), 0.15),
    ((0.0, 1.0), 0.15),
    ((_DIAGONAL, -_DIAGONAL), 0.2),
    ((-_DIAGONAL, -_DIAGONAL), 0.2),
    ((_DIAGONAL, _DIAGONAL), 0.2),
    ((-_DIAGONAL, _DIAGONAL), 0.2),
)
_CROWDED = 0.35
#: An edge within some 50° of a loop's way runs along one of its legs, which stand 30° to either side.
_LEGS = 0.64
#: Shapes, the first of equals wins: how long the handles are (three quarters of it is how far the loop reaches) and how
#: far apart for a unit; two that lie around those, and one that fits between.
_SHAPES = ((1.05, 0.59), (0.74, 0.59))
_FURTHER = (*_SHAPES, (1.3, 1.35), (0.98, 1.35), (0.9, 0.36), (1.75, 0.36))
#: How far loops of one neuron are apart where they can be seen, what it costs if they are not, and where that begins.
_APART, _TOGETHER, _SEEN = 0.14, 40.0, 0.36
_STEP = 0.05


def loop(centre: Point, way: Point, handle: float, wide: float = 0.59) -> Route:
    """A loop towards ``way`` (a unit vector); the handles are ``handle`` long along it. It begins on its upper (else
    left) side, so that loops of a mirrored pair are mirror images."""
    (x, y), (ux, uy) = centre, way
    ax, ay = ux * handle, uy * handle
    bx, by = -uy * handle * wide, ux * handle * wide
    if (by, bx) < (0.0, 0.0):
        bx, by = -bx, -by
    return centre, (x + ax - bx, y + ay - by), (x + ax + bx, y + ay + by), centre


class Loops:
    """The loops of one neuron: each is chosen where there is most room, off those that are there already."""

    def __init__(
        self,
        centre: Point,
        index: int,
        near: Sequence[Point],
        tangents: Sequence[Point],
        obstacles: Obstacles,
        walls: Walls,
    ) -> None:
        """``near`` are neighbours' centres, ``tangents`` unit vectors in which other edges leave or arrive."""
        self._centre, self._own, self._obstacles, self._walls = centre, (index, index), obstacles, walls
        self._crowds = [_crowd(centre, way, near) + _traffic(way, tangents) + cost for way, cost in _WAYS]
        self._there: set[Route] = set()
        #: those that came since the last choice
        self._new: list[Route] = []
        #: the loops to choose from, their points that are seen, and how much too close each is to one that is there
        self._choice = self._tried(_SHAPES)
        self._lines: list[FloatArray] = []
        self._close: list[float] = [0.0] * len(self._choice)

    def add(self, route: Route) -> None:
        """Add a loop that is drawn already, to be kept clear of."""
        if route not in self._there:
            self._there.add(route)
            self._new.append(route)

    def best(self) -> Route:
        """The loop with most room; one that enters no foreign frame, unless there is no room for such a one."""
        self._look()
        found = self._least([False] * len(self._choice))
        if self._walls.entered([found], [self._own])[0]:
            routes = [tried.route for tried in self._choice]
            found = self._least(self._walls.entered(routes, [self._own] * len(routes)))
        return found

    def _look(self) -> None:
        """Compare what there is to choose from with the loops that are there since the last time."""
        if self._new and not self._lines:
            self._choice = self._tried(_FURTHER)
            self._lines = [_seen(tried.route) for tried in self._choice]
            self._close = [0.0] * len(self._choice)
        for other in map(_seen, self._new):
            self._close = [
                max(close, _APART - _between(line, other)) for line, close in zip(self._lines, self._close, strict=True)
            ]
        self._new.clear()

    def _least(self, entering: Sequence[bool]) -> Route:
        """The cheapest loop; of equals the first way, and of its shapes the first."""
        costs = [
            tried.crowd + (tried.nearing + ENTERING * enters + tried.over) + _TOGETHER * close
            for tried, enters, close in zip(self._choice, entering, self._close, strict=True)
        ]
        return self._choice[min(range(len(costs)), key=lambda number: (costs[number], number))].route

    def _tried(self, shapes: Sequence[tuple[float, float]]) -> list[_Tried]:
        """The loops of these shapes, way by way."""
        routes = [loop(self._centre, way, *shape) for way, _ in _WAYS for shape in shapes]
        clear = self._obstacles.clearances(routes, [self._own] * len(routes))
        return [
            _Tried(
                route,
                self._crowds[number // len(shapes)] + 0.12 * (number % len(shapes)),
                8 * max(0.0, REACH - clear[number]),
                ENTERING * (clear[number] <= TOUCH),
            )
            for number, route in enumerate(routes)
        ]


@dataclass(frozen=True, slots=True)
class _Tried:
    """A loop, what it costs for what it stands among, for being close to a disc and for running over one."""

    route: Route
    crowd: float
    nearing: float
    over: float


def _seen(route: Route) -> FloatArray:
    """(n, 2) points on a loop, outside its disc."""
    points, _ = points_on(*pieces_of([route]), _STEP)
    x, y = (points - np.array(route[0])).T
    seen: FloatArray = points[x * x + y * y > _SEEN * _SEEN]
    return seen


def _between(one: FloatArray, other: FloatArray) -> float:
    """How close two lines come, at most ``_APART``."""
    x, y = one[:, None, 0] - other[None, :, 0], one[:, None, 1] - other[None, :, 1]
    return min(_APART, math.sqrt(float((x * x + y * y).min())))


def _crowd(centre: Point, way: Point, near: Sequence[Point]) -> float:
    total = 0.0
    for other in near:
        far = distance(centre, other)
        towards = ((other[0] - centre[0]) * way[0] + (other[1] - centre[1]) * way[1]) / far
        total += _CROWDED * max(0.0, towards) / (far * far)
    return total


def _traffic(way: Point, tangents: Sequence[Point]) -> float:
    """How many edges would run through the loop or along its legs."""
    inside = [max(0.0, way[0] * x + way[1] * y - _LEGS) for x, y in tangents]
    return min(1.5, 2.0 * math.fsum(inside))
