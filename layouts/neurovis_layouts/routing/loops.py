"""Self-loops: out of the disc and back, to the side where there is most room.

In: edges, centres, the routes of other edges. Out: for each edge from a neuron to itself a route that leaves the centre
and comes back to it, clear of the other loops of the neuron: around them, or to another side.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_layouts.routing.obstacles import REACH, TOUCH, Barriers
from neurovis_layouts.routing.route_cost import ENTERING
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Cells, distance, pieces_of, points_on
from neurovis_spec.layout.model import LayoutEdge, Point, Route

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
#: How far around a neuron others count for where its loops have room, and how much.
_NEAR, _CROWDED = 3.0, 0.35
#: An edge within some 50° of a loop's way runs along one of its legs, which stand 30° to either side.
_LEGS = 0.64
#: Shapes, the first of equals wins: how long the handles are (three quarters of it is how far the loop reaches) and how
#: far apart for a unit; two that lie around those, and one that fits between.
_SHAPES = ((1.05, 0.59), (0.74, 0.59))
_FURTHER = (*_SHAPES, (1.3, 1.35), (0.98, 1.35), (0.9, 0.36), (1.75, 0.36))
#: How far loops of one neuron are apart where they can be seen, what it costs if they are not, and where that begins.
_APART, _TOGETHER, _SEEN = 0.14, 40.0, 0.36
_STEP = 0.05


def loop(centre: Point, way: Point, handle: float, wide: float) -> Route:
    """A loop towards ``way`` (a unit vector); the handles are ``handle`` long along it. It begins on its upper (else
    left) side, so that loops of a mirrored pair are mirror images."""
    (x, y), (ux, uy) = centre, way
    ax, ay = ux * handle, uy * handle
    bx, by = -uy * handle * wide, ux * handle * wide
    if (by, bx) < (0.0, 0.0):
        bx, by = -bx, -by
    return centre, (x + ax - bx, y + ay - by), (x + ax + bx, y + ay + by), centre


def loops(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    routes: Mapping[int, Route],
    barriers: Barriers,
    there: Mapping[int, Route],
) -> dict[int, Route]:
    """The loops of all edges that lead to where they come from, by index; those ``there`` stay. ``routes`` are those of
    the other edges, by index."""
    looping: dict[int, list[int]] = {}
    for i, edge in enumerate(edges):
        if edge.source == edge.target:
            looping.setdefault(edge.source, []).append(i)
    tangents = _tangents(edges, routes, list(looping))
    near = _neighbours(centres, list(looping))
    result: dict[int, Route] = {}
    for own, mine in looping.items():
        result.update({i: there[i] for i in mine if i in there})
        new, old = [i for i in mine if i not in result], [result[i] for i in mine if i in result]
        made = _beside(own, centres[own], near[own], tangents[own], barriers, old, len(new))
        result.update(zip(new, made, strict=True))
    return result


def _tangents(
    edges: Sequence[LayoutEdge], routes: Mapping[int, Route], neurons: Sequence[int]
) -> dict[int, list[Point]]:
    """The ways, unit vectors, in which routes leave these neurons and arrive at them."""
    found: dict[int, list[Point]] = {own: [] for own in neurons}
    for i, route in sorted(routes.items()):
        if edges[i].source in found:
            found[edges[i].source].append(_unit(route[0], route[1]))
        if edges[i].target in found:
            found[edges[i].target].append(_unit(route[-1], route[-2]))
    return found


def _neighbours(centres: Sequence[Point], neurons: Sequence[int]) -> dict[int, list[Point]]:
    """The centres of others near these neurons."""
    found: dict[int, list[Point]] = {own: [] for own in neurons}
    places, owns = np.array(centres, dtype=np.float64).reshape(-1, 2), np.array(neurons, dtype=np.int64)
    number, other, _ = Cells(places, _NEAR).near(places[owns])
    for own, neighbour in zip(owns[number].tolist(), other.tolist(), strict=True):
        if neighbour != own:
            found[own].append(centres[neighbour])
    return found


def _unit(origin: Point, towards: Point) -> Point:
    length = distance(origin, towards) or 1.0
    return (towards[0] - origin[0]) / length, (towards[1] - origin[1]) / length


def _beside(
    neuron: int,
    centre: Point,
    near: Sequence[Point],
    tangents: Sequence[Point],
    barriers: Barriers,
    there: Sequence[Route],
    count: int,
) -> list[Route]:
    """So many loops of one neuron beside those that are ``there``: each where there is most room, off those before it,
    and in no foreign frame, unless there is no room for such a one. ``near`` are neighbours' centres, ``tangents`` unit
    vectors in which other edges leave or arrive."""
    crowds = [_crowd(centre, way, near) + _traffic(way, tangents) + cost for way, cost in _WAYS]

    def tried(shapes: Sequence[tuple[float, float]]) -> tuple[list[Route], FloatArray]:
        """The loops of these shapes, way by way, and what they cost, but for being close to other loops."""
        routes = [loop(centre, way, *shape) for way, _ in _WAYS for shape in shapes]
        own = [(neuron, neuron)] * len(routes)
        clear, entering = (
            np.array(barriers.discs.clearances(routes, own)),
            np.array(barriers.frames.entered(routes, own)),
        )
        costs = np.repeat(crowds, len(shapes)) + np.tile(0.12 * np.arange(len(shapes)), len(crowds))
        costs += 8 * np.maximum(0.0, REACH - clear) + ENTERING * entering + ENTERING * (clear <= TOUCH)
        return routes, costs

    found: list[Route] = []
    if count and not there:
        routes, costs = tried(_SHAPES)
        found.append(routes[int(np.argmin(costs))])
    if len(found) < count:
        routes, costs = tried(_FURTHER)
        lines = list(map(_seen, routes))
        close, new = np.zeros(len(routes)), [*there, *found]
        while len(found) < count:
            for other in map(_seen, new):
                close = np.maximum(close, [_APART - _between(line, other) for line in lines])
            new = [routes[int(np.argmin(costs + _TOGETHER * close))]]
            found += new
    return found


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
