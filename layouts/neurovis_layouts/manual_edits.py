"""Manual edits: what somebody has moved by hand in a layout file.

In: a problem with an earlier layout (the file). Out: the neurons whose positions differ from where the file's routes
begin or end, with where they were before (of outermost instances only those that were moved as a whole); the routes
that can still be used; and the neurons that have to make room for what was moved.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import replace

from neurovis_layouts.occupancy import Body, Occupancy, lone
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.model import Layout, LayoutProblem, Point, Route

#: Differences up to this are rounding.
_SLACK = 1e-6
#: What bodies are anchored at that stand where they are.
_HERE = (0.0, 0.0)


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


def carried(problem: LayoutProblem, layout: Layout, placed: Mapping[int, Point]) -> dict[int, Route]:
    """The routes of a layout, by edge, whose two ends are where they were or were moved by the same amount; moved
    along."""
    found: dict[int, Route] = {}
    for number, edge in enumerate(problem.edges):
        route = layout.routes.get(edge.name)
        if route is None or edge.source not in placed or edge.target not in placed:
            continue
        (x, y), (a, b) = placed[edge.source], placed[edge.target]
        dx, dy = x - route[0][0], y - route[0][1]
        if abs(a - route[-1][0] - dx) <= _SLACK and abs(b - route[-1][1] - dy) <= _SLACK:
            found[number] = tuple((p + dx, q + dy) for p, q in route) if dx or dy else route
    return found


def giving_way(
    problem: LayoutProblem, placed: Mapping[int, Point], put: AbstractSet[int], routes: Mapping[int, Route]
) -> set[int]:
    """The neurons (with all others of their instances) that overlap a disc or a frame that was ``put`` by hand."""
    if not put:
        return set()
    frames = Frames(replace(problem, boxes=()))
    rects, outer = frames.rects(placed, routes), _outermost(problem)
    framed = {i for own in outer.values() for i in own}
    bodies = [lone(i, point) for i, point in sorted(placed.items()) if i not in framed]
    for number, own in outer.items():
        if (rect := rects[number]) is not None:
            bodies.append(Body(tuple((i, placed[i]) for i in sorted(own & placed.keys())), number, rect))
    firm = Occupancy(frames)
    for body in bodies:
        if not put.isdisjoint(body.members):
            firm.enter((body,), _HERE)
    held = put | problem.pins.keys()
    return {
        i for body in bodies if held.isdisjoint(body.members) and not firm.fits((body,), _HERE) for i in body.members
    }


def _outermost(problem: LayoutProblem) -> dict[int, frozenset[int]]:
    """The neurons of each outermost instance, by its number."""
    return {k: frozenset(module.members) for k, module in enumerate(problem.modules) if module.parent < 0}
