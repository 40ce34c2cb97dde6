"""Links: the connections between what stands in one frame, in no frame within it.

In: places, frames, the plan's waypoints. Out: a route for each; those of mirror images are reflections of each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from neurovis_layouts.layered.book import Key
from neurovis_layouts.layered.drawing import Rect
from neurovis_layouts.layered.settle import Settled
from neurovis_layouts.layered.sheet import Plan
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint, route_all
from neurovis_layouts.routing.channels import channels
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import LayoutEdge, LayoutProblem, Point, Route


def linked(
    problem: LayoutProblem,
    links: Sequence[int],
    keys: Sequence[Key],
    plan: Plan,
    rests: Settled,
    units: Sequence[Unit],
    frames: Sequence[tuple[tuple[int, ...], Rect]],
    boxes: Sequence[tuple[tuple[int, ...], Rect]],
    pair: Mapping[int, int],
    drawn: Iterable[Route],
) -> dict[Key, Route]:
    """Routes of these edges by key; ``boxes`` are drawn, though nothing had to make room for them; ``drawn`` are the
    routes within the frames."""
    edges = [problem.edges[i] for i in links]
    framed = [(frozenset(members), rect) for members, rect in (*frames, *boxes)]
    if frames:
        planned = _passing(problem, plan, rests)
        gates = {k: planned[i] for k, i in enumerate(links) if i in planned}
        ways, lateral = channels(dict(enumerate(edges)), rests.places, framed, gates, drawn)
        routes = route_all(edges, rests.places, ways, _bowed(edges, units), lateral, frames=framed)
    else:
        ways = _passing(problem, plan, rests)
        routes = route_all(edges, rests.places, ways, _bowed(edges, units), frames=framed)
    found = {keys[i]: tuple(_snapped(route)) for i, route in zip(links, routes, strict=True)}
    return _reflected(found, rests, pair) if pair else found


def _snapped(route: Route) -> list[Point]:
    return [route[0], *((snap(x), snap(y)) for x, y in route[1:-1]), route[-1]]


def _bowed(edges: Sequence[LayoutEdge], units: Sequence[Unit]) -> frozenset[int]:
    """Edges within a block that is no frame."""
    block = {
        m: k for k, unit in enumerate(units) if unit.places is not None and unit.reach is None for m in unit.members
    }
    return frozenset(i for i, e in enumerate(edges) if e.source in block and block[e.source] == block.get(e.target))


def _passing(problem: LayoutProblem, plan: Plan, rests: Settled) -> dict[int, list[Waypoint]]:
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
    """For every two routes that are mirror images the second as the reflection of the first."""
    twice = 2 * rests.axis
    result: dict[Key, Route] = {}
    for key, route in sorted(routes.items()):
        source, target, number = key
        image = _image(source, rests, pair), _image(target, rests, pair), number
        if pair.get(source) == target and (target, source, 0) in routes:
            ends = rests.places[source], rests.places[target]
            route = _swerving(routes[(*min(key, image)[:2], 0)], ends, rests.axis, number)
        if key in result or image == key or image not in routes:
            result.setdefault(key, route)
            continue
        ends = rests.places[image[0]], rests.places[image[1]]
        result[key] = route
        result[image] = (ends[0], *((twice - x, y) for x, y in route[1:-1]), ends[1])
    return result


def _image(neuron: int, rests: Settled, pair: Mapping[int, int]) -> int:
    """The mirror image of a neuron: itself on the axis, −1 where it has none."""
    return pair.get(neuron, neuron if rests.places[neuron][0] == rests.axis else -1)


def _swerving(route: Route, ends: tuple[Point, Point], axis: float, number: int) -> Route:
    """From a neuron to its mirror image, where another connection comes back: sunk by a little before the axis and
    raised behind it, so that the two cross on the axis, since they would share a line that is symmetric."""
    line = route[1:-1] if route[0] == ends[0] else route[-2:0:-1]
    mates = zip(line, line[::-1], strict=True)
    middle = [(snap(axis + (x - other) / 2), snap((y + height) / 2)) for (x, y), (other, height) in mates]
    far = abs(ends[1][0] - ends[0][0])
    sway = snap(max(0.14, min(0.4, 0.12 * far)) if len(middle) == 2 else 0.14) * (number + 1)
    swayed = [(x, y + (sway if 2 * i < len(middle) - 1 else -sway)) for i, (x, y) in enumerate(middle)]
    return ends[0], *swayed, ends[1]
