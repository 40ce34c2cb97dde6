"""The router: a route for every edge of a problem whose neurons have their places.

In: edges, centres in the engine's frame (x across, y along), what is planned and what is around. Out: routes in that
frame, by edge index. The stages: curves along the direction and bows; detours round what these run into; reflections of
mirror images; what is hard to follow drawn anew; loops.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from neurovis_layouts.routing.bows import FEW_TRIES, MANY_TRIES, BowSought, clear_bows
from neurovis_layouts.routing.curves import Waypoint, curves
from neurovis_layouts.routing.detours import detoured
from neurovis_layouts.routing.images import Images
from neurovis_layouts.routing.improve import MOST_IMPROVED, improved
from neurovis_layouts.routing.loops import loops
from neurovis_layouts.routing.obstacles import Barriers, Frame, Obstacles, Walls
from neurovis_layouts.routing.route_cost import Drawn
from neurovis_spec.layout.geometry import Rect, bounds, distance, united
from neurovis_spec.layout.model import LayoutEdge, Point, Route

__all__ = ["RoutePlan", "Surroundings", "Waypoint", "route_all"]

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


@dataclass(frozen=True, slots=True)
class RoutePlan:
    """What is known of routes before any is found, by edge index.

    Without ``waypoints`` every edge runs from anywhere to anywhere; with them, edges not in ``bowed`` run along the
    direction (through their waypoints, if they have any). ``begun`` are routes to begin with, not curves; those that
    are ``there`` stay as they are. Of ``images`` one route is the other's reflection. Those that are ``firm``, which
    cross nothing, are not drawn anew, but for arcs between images.
    """

    waypoints: Mapping[int, Sequence[Waypoint]] | None = None
    bowed: AbstractSet[int] = frozenset()
    begun: Mapping[int, Route] = field(default_factory=dict)
    there: Mapping[int, Route] = field(default_factory=dict)
    images: Images = field(default_factory=Images)
    firm: AbstractSet[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What else is drawn: ``frames``, none of which a route enters that has neither of its ends in it, if there is a
    way round; other routes (``drawn``). Nothing is gone round outside of ``within``."""

    frames: Sequence[Frame] = ()
    drawn: Sequence[Route] = ()
    within: Rect | None = None


def route_all(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    plan: RoutePlan = RoutePlan(),
    around: Surroundings = Surroundings(),
    careful: int = _MOST_CAREFULLY,
) -> list[Route]:
    """Routes by edge index, between ``centres`` by neuron index. With more than ``careful`` edges, discs in the way are
    not gone round."""
    walls = Walls(around.frames, len(centres))
    near = Barriers(Obstacles(centres), walls)
    barriers = near if len(edges) <= careful else Barriers(Obstacles(()), walls)
    routes = _tried(edges, centres, plan, barriers, around)
    images = _led(plan.images, routes, edges, centres, barriers)
    routes.update(images.kept(routes, edges, centres))
    routes.update((i, route) for i, route in plan.there.items() if i in routes)
    if len(edges) <= MOST_IMPROVED:
        # of two images one is drawn, and what is firm may still be an arc between images
        led = {image for i, image in images.of.items() if image != i}
        free = set(routes) - plan.there.keys() - led - {i for i in plan.firm if images.of.get(i) != i}
        if free:
            routes.update(improved(Drawn(edges, centres, routes, around.frames, around.drawn, images), free))
    looped = loops(edges, centres, routes, near, plan.there)
    routes.update(looped)
    routes.update(images.kept(looped, edges, centres))
    return [routes[i] for i in range(len(edges))]


def _tried(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    plan: RoutePlan,
    barriers: Barriers,
    around: Surroundings,
) -> dict[int, Route]:
    """Routes by edge index but for loops: curves along the direction and bows, and ways round what these run over."""
    routes: dict[int, Route] = dict(plan.begun)
    if plan.waypoints is not None:
        chosen = plan.bowed | routes.keys()
        along = [i for i, edge in enumerate(edges) if i not in chosen and _runs_along(edge, centres)]
        routes.update(curves(edges, centres, along, plan.waypoints))
    rest = [i for i, edge in enumerate(edges) if i not in routes and edge.source != edge.target]
    routes.update(_bows(edges, centres, rest, barriers.discs, around.within))
    ways = {i: [(way.x, way.y) for way in line] for i, line in (plan.waypoints or {}).items()}
    most = _MOST_AROUND if plan.waypoints is None else _MOST_AROUND_PLANNED
    detours = detoured(edges, centres, routes, barriers, ways, around.drawn, most)
    routes.update((i, way) for i, way in detours.items() if _inside(way, around.within))
    return routes


def _inside(route: Route, within: Rect | None) -> bool:
    return within is None or united([bounds(route), within]) == within


def _led(
    images: Images,
    routes: Mapping[int, Route],
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    barriers: Barriers,
) -> Images:
    """The same images, of which the second is drawn and the first is its reflection where that is the only way in which
    both are clear: not everything that is in the way has an image itself."""

    def in_the_way(images: Images) -> set[int]:
        found = images.kept(routes, edges, centres)
        ways, own = list(found.values()), [(edges[i].source, edges[i].target) for i in found]
        return {i for i, hit in zip(found, barriers.hit(ways, own), strict=True) if hit}

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
