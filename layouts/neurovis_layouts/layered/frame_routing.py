"""Links: routes for the connections of one frame, but for those that are within a frame inside it.

In: places, frames, the plan's waypoints. Out: a route for each; those of mirror images are reflections of each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.pinning import Settled
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint, route_all
from neurovis_layouts.routing.bows import unhindered
from neurovis_layouts.routing.corners import smooth
from neurovis_layouts.routing.ends import Key
from neurovis_layouts.routing.images import images_of
from neurovis_layouts.routing.obstacles import REACH
from neurovis_spec.layout.geometry import Rect, bounds, distance, meet, snapped
from neurovis_spec.layout.model import GRID, LayoutEdge, LayoutProblem, Point, Route

#: How much of the corners of a line from band to band is cut off.
_CUT = 3.0


def linked(
    problem: LayoutProblem,
    links: Sequence[int],
    keys: Sequence[Key],
    plan: ComponentLayout,
    rests: Settled,
    units: Sequence[Unit],
    frames: Sequence[tuple[tuple[int, ...], Rect]],
    boxes: Sequence[tuple[tuple[int, ...], Rect]],
    labels: Sequence[tuple[tuple[int, ...], Rect]],
    pair: Mapping[int, int],
    drawn: Sequence[Route],
) -> dict[Key, Route]:
    """Routes of these edges by key; ``boxes`` are drawn, though nothing had to make room for them; to routes a label is
    the frame of its neuron; ``drawn`` are the routes within the frames."""
    edges = [problem.edges[i] for i in links]
    framed = [(frozenset(members), rect) for members, rect in (*frames, *boxes, *labels)]
    ways: dict[int, list[Waypoint]] = {}
    begun: dict[int, Route] = {}
    (dx, dy), places = rests.shift, rests.places
    for k, (i, edge) in enumerate(zip(links, edges, strict=True)):
        if not rests.moved.isdisjoint((edge.source, edge.target)):
            continue  # the plan has its ends elsewhere
        if i in plan.ways:
            passing = [Waypoint(way.x + dx, way.y + dy, way.half) for way in plan.ways[i]]
            ways[k] = passing if plan.places[edge.source][1] < plan.places[edge.target][1] else passing[::-1]
        if i in plan.cut:
            between = [(x + dx, y + dy) for x, y in plan.cut[i]]
            line = [places[edge.source], *between, places[edge.target]]
            begun[k] = _cut(line, places, [rect for _, rect in labels])
    # what has all waypoints that it needs from the plan keeps them
    firm = {k for k, i in enumerate(links) if i in plan.firm} if frames and not rests.moved else set()
    own = [keys[i] for i in links]
    routes = route_all(
        edges,
        places,
        ways,
        # between cells of a page, all ways are as good
        frozenset(unhindered(edges, places, frames=framed)) if problem.plan else _bowed(edges, units),
        frames=framed,
        drawn=drawn,
        begun=begun,
        images=images_of(own, places, pair, rests.axis),
        planned=firm,
    )
    return {key: snapped(route) for key, route in zip(own, routes, strict=True)}


def _cut(line: list[Point], places: Sequence[Point], labels: Sequence[Rect]) -> Route:
    """The route along a line from band to band; an end that has nothing between it and the street, and no label in the
    way, is left straight for that."""
    for _ in range(2):  # from either end
        aslant = _aslant(line)
        beside = any(_beside(place, line[0], line[2][0]) for place in places)
        if not beside and not any(meet(rect, bounds([line[0], aslant])) for rect in labels):
            line = [line[0], aslant, *line[3:]]
        line = line[::-1]
    apart = [a for a, b in pairwise(line) if distance(a, b) > GRID]
    return smooth([*apart, line[-1]], _CUT)


def _beside(place: Point, start: Point, street: float) -> bool:
    """Whether something stands between a neuron and the street."""
    low, high = sorted((start[0], street))
    return low < place[0] < high and abs(place[1] - start[1]) < 2 * REACH


def _aslant(line: Sequence[Point]) -> Point:
    """Where a line meets that through its third and fourth points by half a right angle, no farther on than halfway."""
    (x, y), turn, end = line[0], line[2], line[3]
    far = min(abs(turn[0] - x), abs(end[1] - y) / 2)
    return turn[0], y + (far if end[1] > y else -far)


def _bowed(edges: Sequence[LayoutEdge], units: Sequence[Unit]) -> frozenset[int]:
    """Edges within a block that is no frame."""
    block = {
        m: k for k, unit in enumerate(units) if unit.places is not None and unit.reach is None for m in unit.members
    }
    return frozenset(i for i, e in enumerate(edges) if e.source in block and block[e.source] == block.get(e.target))
