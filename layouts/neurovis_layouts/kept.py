"""Kept: a layout that remembers an earlier one.

In: a problem with an earlier layout, and a fresh layout of it. Out: the layout in which what was there stays where it
was, routes included; what is new, or runs into something new, is routed anew, alike where neurons are drawn alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_layouts.alike import Alike
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.memory import remembered
from neurovis_layouts.routing import route_all
from neurovis_layouts.routing.obstacles import TOUCH, Obstacles
from neurovis_spec.layout.model import Layout, LayoutProblem, Point, Route


def kept(problem: LayoutProblem, fresh: Layout) -> Layout:
    """The fresh layout as it is without memory; with it, what the earlier one knew exactly where it was."""
    memory = problem.memory
    if memory is None:
        return fresh
    centres = remembered(problem, [fresh.positions[name] for name in problem.neurons])
    routes = _old_routes(problem, memory, centres)
    new = [i for i in range(len(problem.edges)) if i not in routes]
    routes.update(_moved_routes(problem, fresh, centres, routes))
    rest = [i for i in range(len(problem.edges)) if i not in routes]
    flat = [from_picture(point, problem.direction) for point in centres]
    made = route_all([problem.edges[i] for i in rest], flat, {})
    for i, route in zip(rest, made, strict=True):
        routes[i] = tuple(to_picture(point, problem.direction) for point in route)
    _draw_alike(problem, centres, new, routes)
    return Layout(
        fresh.network,
        fresh.engine,
        dict(zip(problem.neurons, centres, strict=True)),
        {edge.name: routes[i] for i, edge in enumerate(problem.edges)},
    )


def _old_routes(problem: LayoutProblem, memory: Layout, centres: Sequence[Point]) -> dict[int, Route]:
    """Earlier routes that still lead from centre to centre and run over nobody who was not there."""
    new = [point for name, point in zip(problem.neurons, centres, strict=True) if memory.positions.get(name) != point]
    obstacles = Obstacles(new)
    routes: dict[int, Route] = {}
    for i, edge in enumerate(problem.edges):
        route = memory.routes.get(edge.name)
        if route is None or (route[0], route[-1]) != (centres[edge.source], centres[edge.target]):
            continue
        if not new or obstacles.clearance(route, (-1, -1)) >= TOUCH:
            routes[i] = route
    return routes


def _moved_routes(
    problem: LayoutProblem, fresh: Layout, centres: Sequence[Point], known: Mapping[int, Route]
) -> dict[int, Route]:
    """Fresh routes between neurons that went the same way together, such as those of a new instance."""
    obstacles = Obstacles(centres)
    routes: dict[int, Route] = {}
    for i, edge in enumerate(problem.edges):
        if i in known:
            continue
        ends = [(fresh.positions[problem.neurons[n]], centres[n]) for n in (edge.source, edge.target)]
        moves = {(b[0] - a[0], b[1] - a[1]) for a, b in ends}
        if len(moves) == 1:
            dx, dy = moves.pop()
            route = tuple((x + dx, y + dy) for x, y in fresh.routes[edge.name])
            if obstacles.clearance(route, (edge.source, edge.target)) >= TOUCH:
                routes[i] = route
    return routes


def _draw_alike(problem: LayoutProblem, centres: Sequence[Point], new: Sequence[int], routes: dict[int, Route]) -> None:
    """The routes found anew, those between neurons drawn alike copied from the first of them."""
    if not (problem.modules or problem.mirrors):
        return
    alike = Alike(problem, dict(enumerate(centres)))
    between: dict[tuple[int, int], list[int]] = {}
    for i, edge in enumerate(problem.edges):
        between.setdefault((edge.source, edge.target), []).append(i)
    open_ones = set(new)
    for i in new:
        if i not in open_ones:
            continue
        edge = problem.edges[i]
        place = between[edge.source, edge.target].index(i)
        targets = alike.of(edge.target)
        for source, move in alike.of(edge.source):
            for target in [mate for mate, other in targets if other == move]:
                others = between.get((source, target), [])
                if place < len(others) and others[place] in open_ones:
                    open_ones.discard(others[place])
                    routes[others[place]] = tuple(
                        (move.shift[0] + move.flip[0] * x, move.shift[1] + move.flip[1] * y) for x, y in routes[i]
                    )
