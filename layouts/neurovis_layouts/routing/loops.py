"""Self-loops: out of the disc and back, to the side where there is most room.

In: a centre, what is around it. Out: a route that leaves the centre and comes back to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from neurovis_layouts.routing.obstacles import REACH, Obstacles
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.model import Point, Route

_DIAGONAL = math.sqrt(0.5)
#: Sides first, then what lies along the direction, then diagonals: the order decides between equals.
_WAYS: tuple[Point, ...] = (
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, -1.0),
    (0.0, 1.0),
    (_DIAGONAL, -_DIAGONAL),
    (-_DIAGONAL, -_DIAGONAL),
    (_DIAGONAL, _DIAGONAL),
    (-_DIAGONAL, _DIAGONAL),
)
_ALONG = 0.15
_DIAGONALLY = 0.25
_CROWDED = 0.35
#: Length of the handles: three quarters of it is how far the loop reaches.
_HANDLES = (1.05, 0.74)


def loop(centre: Point, way: Point, handle: float, wide: float = 0.59) -> Route:
    """A loop towards ``way`` (a unit vector); the handles are ``handle`` long along it. It begins on its upper (else
    left) side, so that loops of a mirrored pair are mirror images."""
    (x, y), (ux, uy) = centre, way
    ax, ay = ux * handle, uy * handle
    bx, by = -uy * handle * wide, ux * handle * wide
    if (by, bx) < (0.0, 0.0):
        bx, by = -bx, -by
    return centre, (x + ax - bx, y + ay - by), (x + ax + bx, y + ay + by), centre


def best_loop(
    centre: Point, index: int, turn: int, near: Sequence[Point], tangents: Sequence[Point], obstacles: Obstacles
) -> Route:
    """The loop with most room. ``near`` are neighbours' centres, ``tangents`` unit vectors in which other edges leave
    or arrive; ``turn`` counts the loops that this neuron has already: each further one is drawn around the first."""
    ranked: list[tuple[float, int, Route]] = []
    for place, way in enumerate(_WAYS):
        crowd = _crowd(centre, way, near) + _traffic(way, tangents)
        crowd += _ALONG if place in (2, 3) else _DIAGONALLY if place > 3 else 0.0
        for smaller, handle in enumerate(_HANDLES):
            route = loop(centre, way, handle * (1 + 0.3 * turn), 0.59 + 0.1 * turn)
            clearance = obstacles.clearance(route, (index, index))
            missing = max(0.0, REACH - clearance)
            ranked.append((crowd + 8 * missing + 0.12 * smaller, place, route))
    return min(ranked, key=lambda item: (item[0], item[1]))[2]


def _crowd(centre: Point, way: Point, near: Sequence[Point]) -> float:
    total = 0.0
    for other in near:
        far = distance(centre, other)
        towards = ((other[0] - centre[0]) * way[0] + (other[1] - centre[1]) * way[1]) / far
        total += _CROWDED * max(0.0, towards) / (far * far)
    return total


def _traffic(way: Point, tangents: Sequence[Point]) -> float:
    """How many edges would run through the loop: those within some 35° of its way."""
    inside = [max(0.0, way[0] * x + way[1] * y - 0.82) for x, y in tangents]
    return min(1.5, 2.5 * sum(inside))
