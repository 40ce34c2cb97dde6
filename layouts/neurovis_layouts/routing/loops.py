"""Self-loops: out of the disc and back, to the side where there is most room.

In: a centre, what is around it. Out: a route that leaves the centre and comes back to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from neurovis_layouts.routing.obstacles import REACH, Obstacles
from neurovis_spec.layout.geometry import distance
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
#: What it costs to enter a foreign frame.
_ENTERING = 8.0
#: An edge within some 50° of a loop's way runs along one of its legs, which stand 30° to either side.
_LEGS = 0.64
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
    centre: Point,
    index: int,
    turn: int,
    near: Sequence[Point],
    tangents: Sequence[Point],
    obstacles: Obstacles,
    enters: Callable[[Route], bool] | None = None,
) -> Route:
    """The loop with most room. ``near`` are neighbours' centres, ``tangents`` unit vectors in which other edges leave
    or arrive; ``turn`` counts the loops that this neuron has already: each further one is drawn around the first.
    ``enters`` says whether a loop enters a foreign frame, if there are such."""
    ranked: list[tuple[float, int, Route]] = []
    for place, (way, cost) in enumerate(_WAYS):
        crowd = _crowd(centre, way, near) + _traffic(way, tangents) + cost
        for smaller, handle in enumerate(_HANDLES):
            route = loop(centre, way, handle * (1 + 0.3 * turn), 0.59 + 0.1 * turn)
            clearance = obstacles.clearance(route, (index, index))
            missing = max(0.0, REACH - clearance)
            entering = _ENTERING if enters is not None and enters(route) else 0.0
            ranked.append((crowd + 8 * missing + entering + 0.12 * smaller, place, route))
    return min(ranked, key=lambda item: (item[0], item[1]))[2]


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
