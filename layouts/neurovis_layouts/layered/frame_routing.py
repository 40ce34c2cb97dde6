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
from neurovis_layouts.routing.arcs import Arcs, even
from neurovis_layouts.routing.channel_routing import channels
from neurovis_layouts.routing.corners import reflected, rounded
from neurovis_layouts.routing.ends import Key
from neurovis_layouts.routing.obstacles import REACH
from neurovis_layouts.routing.route_cost import Judge
from neurovis_layouts.routing.simplify_routes import MOST_EASED, eased, told_apart
from neurovis_spec.layout.geometry import Rect, bounds, distance, meet, snap
from neurovis_spec.layout.model import GRID, LayoutEdge, LayoutProblem, Point, Route

#: With more connections than this nobody can tell them apart.
_MOST = 1000


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
    # what has its waypoints from the plan crosses nothing, and what would be drawn anew beside it might
    firm: dict[int, list[Waypoint]] = {}
    lateral: dict[int, list[Waypoint]] = {}
    planned = _passing(problem, plan, rests)
    begun = _cut(problem, links, plan, rests, [rect for _, rect in labels])
    if frames:
        gates = {k: planned[i] for k, i in enumerate(links) if i in planned}
        firm = {k: gates[k] for k, i in enumerate(links) if k in gates and i in plan.firm and not rests.moved}
        lines = [*drawn, *(_through(rests.places, edges[k], line) for k, line in firm.items()), *begun.values()]
        free = {k: edge for k, edge in enumerate(edges) if k not in firm and k not in begun}
        ways, lateral = channels(free, rests.places, framed, gates, lines)
        ways.update(firm)
    else:
        ways = planned
    bowed = _bowed(edges, units)
    routes = route_all(
        edges,
        rests.places,
        ways,
        bowed,
        lateral,
        frames=framed,
        drawn=drawn,
        begun=begun,
        ease=not firm,
        improve=not pair,
    )
    found = {keys[i]: tuple(_snapped(route)) for i, route in zip(links, routes, strict=True)}
    if not pair:
        return found
    found = _reflected(found, rests, pair)
    if len(found) <= _MOST:
        found.update(_improved(found, edges, [keys[i] for i in links], rests, pair, framed, drawn, not firm))
    return found


def _improved(
    routes: Mapping[Key, Route],
    edges: Sequence[LayoutEdge],
    keys: Sequence[Key],
    rests: Settled,
    pair: Mapping[int, int],
    frames: Sequence[tuple[frozenset[int], Rect]],
    drawn: Sequence[Route],
    ease: bool,
) -> dict[Key, Route]:
    """Routes that are drawn better: those there and back between mirror images clear of obstacles and of each other
    (``Arcs``), others with fewer bends and apart from others, those of mirror images reflections of each other."""
    number = {key: i for i, key in enumerate(keys)}
    image: dict[int, int] = {}
    free: set[int] = set()
    for key, i in number.items():
        source, target, _ = key
        other = number.get(_image_of(key, rests, pair), -1)
        if source == target or other == i or pair.get(source) == target:
            continue
        if other >= 0:
            image[i] = other
        if other < 0 or i < other:
            free.add(i)
    here = {i: routes[key] for key, i in number.items() if key[0] != key[1]}
    loops = [routes[key] for key in keys if key[0] == key[1]]
    judge = Judge(edges, rests.places, here, frames, [*drawn, *loops], image, 2 * rests.axis)
    between: dict[tuple[int, ...], list[int]] = {}
    for key, i in sorted(number.items()):
        if pair.get(key[0]) == key[1] and (key[1], key[0], 0) in routes:
            between.setdefault(tuple(sorted(key[:2])), []).append(i)
    arcs = Arcs(judge, frames, pair) if between else None
    mended = {i for own in between.values() if arcs is not None and arcs.mend(own) for i in own}
    better = eased(judge, free) if ease and len(routes) <= MOST_EASED else {}
    better.update(told_apart(judge, free))
    return {keys[i]: tuple(_snapped(judge.routes[i])) for i in mended | better.keys()}


def _cut(
    problem: LayoutProblem, links: Sequence[int], plan: ComponentLayout, rests: Settled, labels: Sequence[Rect]
) -> dict[int, Route]:
    """The routes from band to band, of edges whose ends stand where the plan has them; an end that has nothing between
    it and the street, and no label in the way, is left straight for that."""
    found: dict[int, Route] = {}
    dx, dy = rests.shift
    for k, i in enumerate(links):
        own = problem.edges[i].source, problem.edges[i].target
        if i not in plan.cut or not rests.moved.isdisjoint(own):
            continue
        line = [rests.places[own[0]], *((x + dx, y + dy) for x, y in plan.cut[i]), rests.places[own[1]]]
        for _ in range(2):  # from either end
            aslant = _aslant(line)
            beside = any(_beside(place, line[0], line[2][0]) for place in rests.places)
            if not beside and not any(meet(rect, bounds([line[0], aslant])) for rect in labels):
                line = [line[0], aslant, *line[3:]]
            line.reverse()
        apart = [a for a, b in pairwise(line) if distance(a, b) > GRID]
        found[k] = rounded([*apart, line[-1]], lambda _: True)
    return found


def _beside(place: Point, start: Point, street: float) -> bool:
    """Whether something stands between a neuron and the street."""
    low, high = sorted((start[0], street))
    return low < place[0] < high and abs(place[1] - start[1]) < 2 * REACH


def _aslant(line: Sequence[Point]) -> Point:
    """Where a line meets that through its third and fourth points by half a right angle, no farther on than halfway."""
    (x, y), turn, end = line[0], line[2], line[3]
    far = min(abs(turn[0] - x), abs(end[1] - y) / 2)
    return turn[0], y + (far if end[1] > y else -far)


def _through(places: Sequence[Point], edge: LayoutEdge, line: Sequence[Waypoint]) -> Route:
    """A route straight from waypoint to waypoint."""
    stops = [places[edge.source], *((way.x, way.y) for way in line), places[edge.target]]
    return (stops[0], *(point for a, b in pairwise(stops) for point in (a, b, b)))


def _snapped(route: Route) -> list[Point]:
    return [route[0], *((snap(x), snap(y)) for x, y in route[1:-1]), route[-1]]


def _bowed(edges: Sequence[LayoutEdge], units: Sequence[Unit]) -> frozenset[int]:
    """Edges within a block that is no frame."""
    block = {
        m: k for k, unit in enumerate(units) if unit.places is not None and unit.reach is None for m in unit.members
    }
    return frozenset(i for i, e in enumerate(edges) if e.source in block and block[e.source] == block.get(e.target))


def _passing(problem: LayoutProblem, plan: ComponentLayout, rests: Settled) -> dict[int, list[Waypoint]]:
    """The plan's waypoints, of edges whose ends stand where the plan has them."""
    ways: dict[int, list[Waypoint]] = {}
    dx, dy = rests.shift
    for i, line in sorted(plan.ways.items()):
        edge = problem.edges[i]
        if edge.source not in rests.moved and edge.target not in rests.moved:
            passing = [Waypoint(way.x + dx, way.y + dy, way.half) for way in line]
            ways[i] = passing if plan.places[edge.source][1] < plan.places[edge.target][1] else passing[::-1]
    return ways


def _reflected(routes: dict[Key, Route], rests: Settled, pair: Mapping[int, int]) -> dict[Key, Route]:
    """For every two routes that are mirror images the second as the reflection of the first; of two neurons that are
    images of each other and drive each other, both ways as their own reflections, else they would share a line. There
    and back are taken from the same side: the sides that they bow to are exchanged on the other."""
    twice = 2 * rests.axis
    result: dict[Key, Route] = {}
    for key, route in sorted(routes.items(), key=lambda item: (sorted(item[0][:2]), item[0])):
        source, target, _ = key
        image = _image_of(key, rests, pair)
        if pair.get(source) == target and (target, source, 0) in routes:
            result[key] = even(route, twice)
        if key in result or image == key or image not in routes:
            result.setdefault(key, route)
            continue
        result[key] = route
        result[image] = reflected(route, twice, rests.places[image[0]], rests.places[image[1]])
    return result


def _image_of(key: Key, rests: Settled, pair: Mapping[int, int]) -> Key:
    """The key that the mirror image of a connection has, if there is one."""
    source, target, number = key
    return _image(source, rests, pair), _image(target, rests, pair), number


def _image(neuron: int, rests: Settled, pair: Mapping[int, int]) -> int:
    """The mirror image of a neuron: itself on the axis, −1 where it has none."""
    return pair.get(neuron, neuron if rests.places[neuron][0] == rests.axis else -1)
