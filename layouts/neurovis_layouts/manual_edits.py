"""Manual edits: what somebody has moved by hand in a layout file.

In: a problem with an earlier layout (the file). Out: the neurons whose positions differ from where the file's routes
begin or end, with where they were before (of outermost instances only those that were moved as a whole); the routes
that can still be used; and the neurons that have to make room for what was moved.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AbstractSet

from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, distance, meet
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point, Route

#: Differences up to this are rounding.
_SLACK = 1e-6


def by_hand(problem: LayoutProblem) -> dict[int, Point]:
    """The neurons that were moved, with where they were. An instance of which only a part was moved is not among them:
    it contradicts its template, which a file cannot change."""
    memory = problem.memory
    if memory is None:
        return {}
    before: dict[int, Point] = {}
    for edge in problem.edges:
        route = memory.routes.get(edge.name)
        if route is not None:
            before.setdefault(edge.source, route[0])
            before.setdefault(edge.target, route[-1])
    now = {i: memory.positions[name] for i, name in enumerate(problem.neurons) if name in memory.positions}
    before = {i: point for i, point in before.items() if i in now}
    moved = {i: point for i, point in before.items() if distance(point, now[i]) > _SLACK}
    for own in _outermost(problem).values():
        known = own & before.keys()
        if moved.keys().isdisjoint(known):
            continue
        shifts = {(now[i][0] - before[i][0], now[i][1] - before[i][1]) for i in known}
        x, y = next(iter(shifts))
        rigid = all(abs(x - a) <= _SLACK and abs(y - b) <= _SLACK for a, b in shifts)
        for i in own:
            moved.pop(i, None)
            if rigid and i in now:
                moved[i] = now[i][0] - x, now[i][1] - y
    return {i: moved[i] for i in sorted(moved.keys() - problem.pins.keys())}


def moved_routes(problem: LayoutProblem, placed: Mapping[int, Point]) -> dict[int, Route]:
    """The earlier routes, by edge, whose two ends are where they were or were moved by the same amount; moved along."""
    found: dict[int, Route] = {}
    routes = {} if problem.memory is None else problem.memory.routes
    for number, edge in enumerate(problem.edges):
        route = routes.get(edge.name)
        if route is None or edge.source not in placed or edge.target not in placed:
            continue
        (x, y), (a, b) = placed[edge.source], placed[edge.target]
        dx, dy = x - route[0][0], y - route[0][1]
        if abs(a - route[-1][0] - dx) <= _SLACK and abs(b - route[-1][1] - dy) <= _SLACK:
            found[number] = tuple((p + dx, q + dy) for p, q in route) if dx or dy else route
    return found


def giving_way(
    problem: LayoutProblem,
    frames: Frames,
    placed: Mapping[int, Point],
    put: AbstractSet[int],
    routes: Mapping[int, Route],
) -> set[int]:
    """The neurons (with all others of their instances) that overlap a disc or a frame that was ``put`` by hand."""
    if not put:
        return set()
    rects = frames.rects(placed, routes)
    outer = _outermost(problem)
    framed = {i for own in outer.values() for i in own}
    firm: list[Rect] = [
        rect for number, own in outer.items() if not own.isdisjoint(put) and (rect := rects[number]) is not None
    ]
    discs = [placed[i] for i in sorted(put) if i in placed and i not in framed]
    found: set[int] = set()
    for number, own in outer.items():
        rect = rects[number]
        if rect is None or not own.isdisjoint(put) or not problem.pins.keys().isdisjoint(own):
            continue
        if any(meet(rect, other) for other in firm) or any(meet(rect, (*point, *point)) for point in discs):
            found |= own & placed.keys()
    for i, point in placed.items():
        if i in framed or i in put or i in problem.pins:
            continue
        if any(meet((*point, *point), other) for other in firm) or any(
            distance(point, other) < 2 * RADIUS for other in discs
        ):
            found.add(i)
    return found


def _outermost(problem: LayoutProblem) -> dict[int, frozenset[int]]:
    """The neurons of each outermost instance, by its number."""
    return {k: frozenset(module.members) for k, module in enumerate(problem.modules) if module.parent < 0}
