"""The router: a route for every edge of a problem whose neurons have their places.

In: the problem, centres in the engine's frame (x across, y along), waypoints. Out: routes in that frame, by edge index.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from neurovis_layouts.routing.bows import FEW_TRIES, MANY_TRIES, BowSought, clear_bows
from neurovis_layouts.routing.curves import Waypoint, curve
from neurovis_layouts.routing.detours import detoured
from neurovis_layouts.routing.images import Images
from neurovis_layouts.routing.improve import MOST_IMPROVED, improved
from neurovis_layouts.routing.loops import loops
from neurovis_layouts.routing.obstacles import Obstacles
from neurovis_layouts.routing.ports import Port, leanings
from neurovis_layouts.routing.route_cost import Drawn
from neurovis_layouts.routing.walls import Frame, Walls
from neurovis_spec.layout.geometry import Cells, Rect, bounds, distance, united
from neurovis_spec.layout.model import LayoutEdge, Point, Route

__all__ = ["Waypoint", "route_all"]

#: How far around a neuron others count for where its self-loop has room.
_NEAR = 3.0
#: With more edges than this nobody can follow one: discs in the way are not gone round.
_MOST_CAREFULLY = 4000
#: With more than this they do not go far out of their way, which would only move the crowd.
_MOST_AT_LENGTH = 1000
#: Nor where all of them together are longer than this by the heights tried.
_MOST_LENGTH = 250_000.0
#: Where more than this run over discs they stay, first where neurons stand anywhere, then where they were planned to
#: have room around them.
_MOST_AROUND, _MOST_AROUND_PLANNED = 60, 300
#: How far apart along the direction the ends of a connection are at least for a curve that runs along it.
_STEEP_ENOUGH = 0.75


def route_all(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    waypoints: Mapping[int, Sequence[Waypoint]] | None = None,
    bowed: AbstractSet[int] = frozenset(),
    careful: int = _MOST_CAREFULLY,
    frames: Sequence[Frame] = (),
    drawn: Sequence[Route] = (),
    there: Mapping[int, Route] | None = None,
    images: Images | None = None,
    within: Rect | None = None,
    begun: Mapping[int, Route] | None = None,
    planned: AbstractSet[int] = frozenset(),
) -> list[Route]:
    """Routes by edge index.

    Without ``waypoints`` every edge runs from anywhere to anywhere; with them, edges not in ``bowed`` run along the
    direction (through their waypoints, if they have any). With more than ``careful`` edges, discs in the way are not
    gone round. No route enters one of the ``frames`` that holds neither of its ends, if there is a way round. ``drawn``
    are other routes, which are there, as are those of these edges that are ``there``. Nothing that is in the way is
    gone round outside of ``within``. ``begun`` are routes to begin with, not curves; of those with ``images`` one is
    the other's reflection. Those that are ``planned``, which cross nothing, are not drawn anew, but for arcs between
    images.
    """
    near = Obstacles(centres)
    obstacles = near if len(edges) <= careful else Obstacles(())
    routes: dict[int, Route] = dict(begun or {})
    if waypoints is not None:
        chosen = bowed | routes.keys()
        along = [i for i, edge in enumerate(edges) if i not in chosen and _runs_along(edge, centres)]
        routes.update(_curves(edges, centres, along, waypoints))
    rest = [i for i, edge in enumerate(edges) if i not in routes and edge.source != edge.target]
    routes.update(_bows(edges, centres, rest, obstacles, within))
    walls = Walls(frames, len(centres))
    ways = {i: [(way.x, way.y) for way in line] for i, line in (waypoints or {}).items()}
    most = _MOST_AROUND if waypoints is None else _MOST_AROUND_PLANNED
    detours = detoured(edges, centres, routes, obstacles, walls, ways, drawn, most)
    routes.update((i, way) for i, way in detours.items() if within is None or united([bounds(way), within]) == within)
    images = _led(images or Images(), routes, edges, centres, obstacles, walls)
    routes.update(images.kept(routes, edges, centres))
    routes.update((i, route) for i, route in (there or {}).items() if i in routes)
    free = set(routes) - (there or {}).keys() - {image for i, image in images.of.items() if image != i}
    free -= {i for i in planned if images.of.get(i) != i}
    if free and len(edges) <= MOST_IMPROVED:
        routes.update(improved(Drawn(edges, centres, routes, frames, drawn, images), free))
    looped = _loops(edges, centres, routes, near, walls, there or {})
    routes.update(looped)
    routes.update(images.kept(looped, edges, centres))
    return [routes[i] for i in range(len(edges))]


def _led(
    images: Images,
    routes: Mapping[int, Route],
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    obstacles: Obstacles,
    walls: Walls,
) -> Images:
    """The same images, of which the second is drawn and the first is its reflection where that is the only way in which
    both are clear: not everything that is in the way has an image itself."""

    def in_the_way(images: Images) -> set[int]:
        found = images.kept(routes, edges, centres)
        ways, own = list(found.values()), [(edges[i].source, edges[i].target) for i in found]
        over, entered = obstacles.run_over(ways, own), walls.entered(ways, own)
        return {i for i, *unclear in zip(found, over, entered, strict=True) if any(unclear)}

    first = in_the_way(images)
    if not first:
        return images
    second = in_the_way(Images({image: i for i, image in images.of.items()}, images.twice))
    of = {}
    for pair in images.of.items():
        one, other = pair if first.isdisjoint(pair) or not second.isdisjoint(pair) else pair[::-1]
        of[one] = other
    return Images(of, images.twice)


def _runs_along(edge: LayoutEdge, centres: Sequence[Point]) -> bool:
    (ax, ay), (bx, by) = centres[edge.source], centres[edge.target]
    return abs(by - ay) >= max(_STEEP_ENOUGH, abs(bx - ax) / 40)


def _curves(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    chosen: Sequence[int],
    waypoints: Mapping[int, Sequence[Waypoint]],
) -> dict[int, Route]:
    """Curves along the direction, from port to port: these lean by disc and side."""
    sides: dict[tuple[int, bool], list[Port]] = {}
    for i in chosen:
        edge = edges[i]
        ways = [(way.x, way.y) for way in waypoints.get(i, ())]
        start, end = centres[edge.source], centres[edge.target]
        line = [start, *ways, end]
        backward = end[1] < start[1]
        for own, other, partner, at_source in (
            (start, line[1], edge.target, True),
            (end, line[-2], edge.source, False),
        ):
            below = other[1] > own[1]
            port = Port(other[0] - own[0], partner, backward, i, at_source, other[1] - own[1])
            sides.setdefault((edge.source if at_source else edge.target, below), []).append(port)
    lean: dict[tuple[int, bool], float] = {}
    for ports in sides.values():
        lean.update(leanings(ports))
    return {
        i: curve(
            centres[edges[i].source],
            centres[edges[i].target],
            waypoints.get(i, ()),
            (lean[i, True], lean[i, False]),
        )
        for i in chosen
    }


def _bows(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    chosen: Sequence[int],
    obstacles: Obstacles,
    within: Rect | None,
) -> dict[int, Route]:
    """Straight where alone and clear; both of a reciprocal pair bow to their own left; equal edges fan out."""
    between: dict[tuple[int, int], list[int]] = {}
    for i in chosen:
        between.setdefault((edges[i].source, edges[i].target), []).append(i)
    points = math.fsum(
        distance(centres[source], centres[target]) * len(equal) for (source, target), equal in between.items()
    )
    tries = MANY_TRIES if len(chosen) <= _MOST_AT_LENGTH else FEW_TRIES
    tries = min(tries, int(_MOST_LENGTH / max(points, 1.0)))
    routes: dict[int, Route] = {}
    reach = dict.fromkeys(between, (0.0, 0.0))
    for place in range(max((len(equal) for equal in between.values()), default=0)):
        # each further one outside those before it, wherever obstacles have sent these
        wishes = {
            ends: BowSought(
                centres[ends[0]],
                centres[ends[1]],
                ends,
                *_least(place, len(equal), ends, between, reach, centres),
            )
            for ends, equal in between.items()
            if place < len(equal)
        }
        for ends, (route, _, height) in zip(
            wishes, clear_bows(list(wishes.values()), obstacles, tries, within), strict=True
        ):
            routes[between[ends][place]] = route
            reach[ends] = min(reach[ends][0], height), max(reach[ends][1], height)
    return routes


def _least(
    place: int,
    count: int,
    ends: tuple[int, int],
    between: Mapping[tuple[int, int], object],
    reach: Mapping[tuple[int, int], tuple[float, float]],
    centres: Sequence[Point],
) -> tuple[float, bool]:
    """How high the bow of one of ``count`` equal edges is at least, and whether it must stay on that side; ``reach`` is
    how far those before it go to either side."""
    right, left = reach[ends]
    if ends[::-1] in between:
        return left + 0.3 if place else 0.13 + 0.035 * distance(centres[ends[0]], centres[ends[1]]), True
    odd = count % 2
    least = 0.0 if odd and place == 0 else left + 0.3 if (place + odd) % 2 == 0 else right - 0.3
    return least / 2 if not odd and place < 2 else least, count > 1


def _loops(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    routes: Mapping[int, Route],
    obstacles: Obstacles,
    walls: Walls,
    there: Mapping[int, Route],
) -> dict[int, Route]:
    looping: dict[int, list[int]] = {}
    for i, edge in enumerate(edges):
        if edge.source == edge.target:
            looping.setdefault(edge.source, []).append(i)
    tangents: dict[int, list[Point]] = {own: [] for own in looping}
    for i, route in sorted(routes.items()):
        if edges[i].source in tangents:
            tangents[edges[i].source].append(_unit(route[0], route[1]))
        if edges[i].target in tangents:
            tangents[edges[i].target].append(_unit(route[-1], route[-2]))
    near: dict[int, list[Point]] = {own: [] for own in tangents}
    places, owns = np.array(centres, dtype=np.float64).reshape(-1, 2), np.array(list(tangents), dtype=np.int64)
    number, other, _ = Cells(places, _NEAR).near(places[owns])
    for own, neighbour in zip(owns[number].tolist(), other.tolist(), strict=True):
        if neighbour != own:
            near[own].append(centres[neighbour])
    result: dict[int, Route] = {}
    for own, mine in looping.items():
        result.update({i: there[i] for i in mine if i in there})
        new, old = [i for i in mine if i not in result], [result[i] for i in mine if i in result]
        made = loops(centres[own], own, near[own], tangents[own], obstacles, walls, old, len(new))
        result.update(zip(new, made, strict=True))
    return result


def _unit(origin: Point, towards: Point) -> Point:
    length = distance(origin, towards) or 1.0
    return (towards[0] - origin[0]) / length, (towards[1] - origin[1]) / length
