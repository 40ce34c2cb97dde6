"""Incremental layout: keeps what an earlier layout placed, and adds what is new.

In: a problem with an earlier layout, and a fresh layout of it. Out: the layout in which what was there stays where it
was, routes included; what is new, or runs into something new, is routed anew, alike where neurons are drawn alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from neurovis_layouts.alike import Alike, Axis, Move, pairs_by_axis, same, twice_axis
from neurovis_layouts.conflicts import carried, routed_from
from neurovis_layouts.frame import from_picture, to_picture, turned
from neurovis_layouts.occupancy import overlapping
from neurovis_layouts.pins import with_origins
from neurovis_layouts.routing import RoutePlan, Surroundings, route_all
from neurovis_layouts.routing.ends import keys_of
from neurovis_layouts.routing.images import Images, images_of
from neurovis_layouts.routing.obstacles import Barriers, Frame, Obstacles, Walls
from neurovis_layouts.settling import Whole, settled
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import bounds, united
from neurovis_spec.layout.model import Layout, LayoutProblem, Point, Route, Side

#: With more new connections than this nobody can follow one: they do not go round frames.
_CAREFULLY = 1000
#: With more neurons than this what is pinned is off discs alone: to find room for many frames takes minutes.
_MOST_AROUND_PINS = 2000


def kept(problem: LayoutProblem, fresh: Layout, pins: Mapping[int, Point] | None = None, around: bool = True) -> Layout:
    """The fresh layout moved to pins and to where an earlier one has what it knows; itself where there is neither.

    ``pins`` are where what is pinned stands, instances included (as in the fresh layout, if they are not given). With
    ``around`` no frame of an instance lies on another then if that can be, and nobody stands in a frame who does not
    belong there; without, and without an earlier layout, what is pinned is off other discs alone.
    """
    drawn = [fresh.positions[name] for name in problem.neurons]
    own = [module.members for module in problem.modules if module.origin is not None]
    now = {m: drawn[m] for members in own for m in members} if pins is None else pins
    if problem.memory is None and not (problem.pins or now):
        return fresh
    if problem.memory is None and not (around and problem.modules and len(drawn) <= _MOST_AROUND_PINS):
        problem = replace(problem, modules=(), boxes=())
    memory = problem.memory or Layout(problem.network, fresh.engine, {}, {})
    problem, centres = _placed(problem, memory, fresh, own, now)
    sides = {**fresh.labels, **memory.labels}
    routes = _routed(problem, memory, fresh, _Ways(problem, centres, sides))
    return Layout(
        fresh.network,
        fresh.engine,
        dict(zip(problem.neurons, centres, strict=True)),
        {edge.name: routes[i] for i, edge in enumerate(problem.edges)},
        sides,
    )


def _placed(
    problem: LayoutProblem, memory: Layout, fresh: Layout, own: Sequence[Sequence[int]], now: Mapping[int, Point]
) -> tuple[LayoutProblem, Sequence[Point]]:
    """Where everything stands, and the problem with pins on all that is pinned, and with what instances have new as
    known. ``own`` are the instances whose origin is pinned, ``now`` is where what is pinned stands."""
    drawn = [fresh.positions[name] for name in problem.neurons]
    there = {i: fresh.routes[edge.name] for i, edge in enumerate(problem.edges)}
    frames = Frames(problem, memory.labels)
    rects = frames.rects(dict(enumerate(drawn)), there)
    wholes = [
        Whole(module.members, number, rects[number] or bounds(drawn), module.template)
        for number, module in enumerate(problem.modules)
        if module.members
    ]
    # instances whose origin is pinned are drawn as they were, with what their module has new as in their copies
    known = {i: memory.positions[name] for i, name in enumerate(problem.neurons) if name in memory.positions}
    free = [members for members in own if problem.pins.keys().isdisjoint(members)]
    if any(0 < len(known.keys() & members) < len(members) for members in free):
        known = dict(enumerate(settled(problem, frames, drawn, wholes).at))
        grown = {name: known[i] for i, name in enumerate(problem.neurons)}
        problem = replace(problem, memory=replace(memory, positions=grown))
    held = {**now, **with_origins(problem, {m: known[m] for members in free for m in members if m in known})}
    lost = overlapping({m: held[m] for m in held.keys() - problem.pins.keys()}, problem.pins)
    problem = replace(problem, pins={m: held[m] for m in sorted(held.keys() - lost)})
    return problem, settled(problem, frames, drawn, wholes).at


def _routed(problem: LayoutProblem, memory: Layout, fresh: Layout, ways: _Ways) -> dict[int, Route]:
    """The routes of all edges: as they were where that is still clear, else as in the fresh layout, else found anew."""
    centres = ways.centres
    routes = _old_routes(problem, memory, ways)
    new = [i for i in range(len(problem.edges)) if i not in routes]
    twins = _Twins(problem, centres) if problem.modules or problem.mirrors else None
    if twins is not None:
        ways.add_clear(twins.copied(new, routes), routes)
    # such as those within a new instance
    along = carried(problem, fresh, dict(enumerate(centres)))
    ways.add_clear({i: route for i, route in along.items() if i not in routes}, routes)
    ways.pair_up(routes)
    # what is within a frame first, since the frame is around it: others may then run into it that did not before
    within = [i for i in range(len(problem.edges)) if i not in routes and ways.within(i)]
    routes.update(_found(problem, ways, within, routes))
    outside = [i for i in sorted(routes) if not ways.within(i)]
    for i, entering in zip(outside, _entering(problem, memory, ways, outside, routes), strict=True):
        if entering:
            del routes[i]
    ways.pair_up(routes)
    new = sorted({*new, *(i for i in outside if i not in routes)})
    rest = [i for i in range(len(problem.edges)) if i not in routes]
    routes.update(_found(problem, ways, rest, routes))
    if twins is not None:
        ways.add_clear(twins.copied(new, routes), routes)
    return routes


class _Ways:
    """Where the neurons are and what is in the way between them."""

    def __init__(self, problem: LayoutProblem, centres: Sequence[Point], sides: Mapping[str, Side]) -> None:
        self.problem, self.centres = problem, centres
        self.frames = Frames(problem, sides)
        self._obstacles = Obstacles(centres)
        #: where the neurons are in the frame of an engine
        self.flat = [from_picture(point, problem.direction) for point in centres]
        pairs = pairs_by_axis(problem).get(-1, [])
        self._mirror = Axis(0, twice_axis(pairs, self.flat, 0)).mirror
        exact = [(a, b) for a, b in pairs if self._mirror.point(self.flat[a]) == self.flat[b]]
        self._pair = {a: b for one in exact for a, b in (one, one[::-1])}
        axis = self._mirror.shift[0] / 2
        #: which routes are reflections of others, in the frame of an engine, as far as neurons stand so
        self.images = images_of(keys_of(problem.edges), self.flat, self._pair, axis) if exact else Images()
        #: by edge its mirror image
        self.image = {a: b for one in self.images.of.items() for a, b in (one, one[::-1])}

    def within(self, edge: int) -> bool:
        """Whether an edge runs within an instance."""
        ends = self.problem.edges[edge]
        around = self.frames.around
        return not set(around.get(ends.source, ())).isdisjoint(around.get(ends.target, ()))

    def pair_up(self, routes: dict[int, Route]) -> None:
        """Take out routes whose mirror image has none, so that both are found as one: what is clear on one side of the
        axis may run into something on the other, such as a frame, whose title is on top on both."""
        for i in [i for i in routes if self.image.get(i, i) not in routes]:
            del routes[i]

    def walls(self, routes: Mapping[int, Route]) -> list[Frame]:
        """The frames as they are drawn with these routes; one that would hold a foreign neuron is not drawn."""
        rects = self.frames.rects(dict(enumerate(self.centres)), routes)
        found = [(own, rect) for own, rect in zip(self.frames.members, rects, strict=True) if rect is not None]
        centres = np.array(self.centres, dtype=np.float64).reshape(-1, 2)
        return [wall for wall in found if _closed(wall, centres)]

    def even_walls(self, routes: Mapping[int, Route]) -> list[Frame]:
        """The same in the frame of an engine, each as large as the reflection of its image, so that what is clear on
        one side of the axis is on the other: titles are on top on both."""
        walls = [(own, turned(rect, self.problem.direction)) for own, rect in self.walls(routes)]
        rects, flat = dict(walls), np.array(self.flat, dtype=np.float64).reshape(-1, 2)
        for number, (own, rect) in enumerate(walls if self._pair else ()):
            image = rects.get(frozenset(self._pair.get(m, m) for m in own))
            even = own, united([rect, self._mirror.rect(image)]) if image else rect
            if _closed(even, flat):
                walls[number] = even
        return walls

    def ends(self, chosen: Iterable[int]) -> list[tuple[int, int]]:
        """Between which neurons these edges are."""
        return [(self.problem.edges[i].source, self.problem.edges[i].target) for i in chosen]

    def unclear(self, found: Mapping[int, Route], routes: Mapping[int, Route]) -> set[int]:
        """Which of these routes, by edge, run over a disc or enter a foreign frame, and their mirror images."""
        lines, ends = list(found.values()), self.ends(found)
        barriers = Barriers(self._obstacles, Walls(self.walls({**routes, **found}), len(self.centres)))
        tried = zip(found, barriers.hit(lines, ends), strict=True)
        return {k for i, hit in tried if hit for k in (i, self.image.get(i, i))}

    def add_clear(self, found: Mapping[int, Route], routes: dict[int, Route]) -> None:
        """Add those of the found routes, by edge, that have a clear way, and whose mirror images have."""
        wrong = self.unclear(found, routes)
        routes.update({i: route for i, route in found.items() if i not in wrong})


def _closed(wall: Frame, centres: FloatArray) -> bool:
    """Whether of these neurons (n, 2) nobody stands in a frame who does not belong there."""
    own, (x0, y0, x1, y1) = wall
    x, y = centres.T
    return int(((x > x0) & (x < x1) & (y > y0) & (y < y1)).sum()) <= len(own)


def _found(problem: LayoutProblem, ways: _Ways, rest: Sequence[int], routes: Mapping[int, Route]) -> dict[int, Route]:
    """Routes found anew for these edges, beside those between the same neurons, which have theirs; mirror images are
    reflections of each other, but for those that have a clear way only if they are not."""
    if not rest:
        return {}

    def flat(point: Point) -> Point:
        return from_picture(point, problem.direction)

    ends = {frozenset((problem.edges[i].source, problem.edges[i].target)) for i in rest}
    shown = [i for i, e in enumerate(problem.edges) if frozenset((e.source, e.target)) in ends]
    walls = ways.even_walls(routes) if len(shown) <= _CAREFULLY else []
    edges, place = [problem.edges[i] for i in shown], {i: k for k, i in enumerate(shown)}
    others = [tuple(map(flat, routes[i])) for i in sorted(routes.keys() - set(shown))]
    there = {k: tuple(map(flat, routes[i])) for k, i in enumerate(shown) if i in routes}

    def found(even: AbstractSet[int]) -> dict[int, Route]:
        images = Images({place[a]: place[b] for a, b in ways.images.of.items() if {a, b} <= even}, ways.images.twice)
        plan = RoutePlan(waypoints={}, there=there, images=images)
        made = route_all(edges, ways.flat, plan, Surroundings(walls, others))
        new = (k for k in range(len(shown)) if k not in there)
        return {shown[k]: tuple(to_picture(point, problem.direction) for point in made[k]) for k in new}

    new = set(rest)
    made = found(new)
    wrong = ways.unclear(made, routes) if ways.image else set()
    if wrong.isdisjoint(ways.image):
        return made
    again = found(new - wrong)
    return again if len(ways.unclear(again, routes)) < len(wrong) else made


def _old_routes(problem: LayoutProblem, memory: Layout, ways: _Ways) -> dict[int, Route]:
    """Earlier routes, by edge, that can be kept: they still run from centre to centre, over no neuron that is new or
    was moved, and through no frame that is new or was drawn otherwise."""
    there = [memory.positions.get(name) == point for name, point in zip(problem.neurons, ways.centres, strict=True)]
    for neuron, before in routed_from(problem).items():
        there[neuron] &= same(before, ways.centres[neuron])
    routes: dict[int, Route] = {}
    for i, edge in enumerate(problem.edges):
        route = memory.routes.get(edge.name)
        if route is not None and (route[0], route[-1]) == (ways.centres[edge.source], ways.centres[edge.target]):
            routes[i] = route
    new = [k for k, known in enumerate(there) if not known]
    place = {neuron: k for k, neuron in enumerate(new)}
    over = Obstacles([ways.centres[k] for k in new]).run_over(
        list(routes.values()), [(place.get(a, -1), place.get(b, -1)) for a, b in ways.ends(routes)]
    )
    through = _entering(problem, memory, ways, routes, routes)
    return {i: routes[i] for i, a, b in zip(routes, over, through, strict=True) if not (a or b)}


def _entering(
    problem: LayoutProblem, memory: Layout, ways: _Ways, chosen: Iterable[int], routes: Mapping[int, Route]
) -> list[bool]:
    """For each of these edges whether its route runs through a frame that is not drawn as it was."""
    places = zip(problem.neurons, ways.centres, strict=True)
    known = {i: point for i, (name, point) in enumerate(places) if memory.positions.get(name) == point}
    old = {i: memory.routes[edge.name] for i, edge in enumerate(problem.edges) if edge.name in memory.routes}
    before = ways.frames.rects(known, old)
    changed = [wall for wall in ways.walls(routes) if wall[1] not in before]
    return Walls(changed, len(ways.centres)).entered([routes[i] for i in chosen], ways.ends(chosen))


class _Twins:
    """Which edges are drawn alike: those between neurons that are."""

    def __init__(self, problem: LayoutProblem, centres: Sequence[Point]) -> None:
        self._centres, self._edges, self._keys = centres, problem.edges, keys_of(problem.edges)
        self._number = {key: i for i, key in enumerate(self._keys)}
        self._alike = Alike(problem, dict(enumerate(centres)))

    def of(self, edge: int) -> dict[int, Move]:
        """The edges drawn like this one, itself first, each with the move from its route. Of two between the same
        neurons, there and back, the one is: both would be one line."""
        source, target, place = self._keys[edge]
        by_move: dict[Move, list[int]] = {}
        for mate, move in self._alike.of(target):
            by_move.setdefault(move, []).append(mate)
        found: dict[frozenset[int], tuple[int, Move]] = {}
        for mate, move in self._alike.of(source):
            for other in by_move.get(move, ()):
                twin, ends = self._number.get((mate, other, place)), frozenset((mate, other))
                # the one that is reflected less, whichever end was asked for first
                if twin is not None and (ends not in found or found[ends][1].flip < move.flip):
                    found[ends] = twin, move
        return dict(found.values())

    def copied(self, new: Sequence[int], routes: Mapping[int, Route]) -> dict[int, Route]:
        """Routes for new edges like those drawn alike: like an earlier one, such as within another instance of the
        make, else like the first that has been found. There and back are taken from the same side of a mirror, or both
        would bow to one side."""
        fresh, waiting = set(new), set(new)
        found: dict[int, Route] = {}
        for i in sorted(new, key=lambda i: (sorted(self._keys[i][:2]), self._keys[i])):
            if i not in waiting:
                continue
            alike = self.of(i)
            waiting -= alike.keys()
            lead = next((k for k in alike if k in routes and k not in fresh), i)
            if lead not in routes:
                continue
            back = alike[lead].inverse()
            for twin, move in alike.items():
                if twin in fresh and twin != lead:
                    inner, edge = back.then(move).route(routes[lead][1:-1]), self._edges[twin]
                    found[twin] = (self._centres[edge.source], *inner, self._centres[edge.target])
        return found
