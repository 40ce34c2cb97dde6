"""Conflicts: what of an earlier layout, which somebody may have edited by hand, can stay.

In: a problem with an earlier layout, and a fresh one. Out: a place for each neuron that the earlier one knew or that is
pinned, and who has to leave it. What was moved by hand differs from where the file's routes begin or end; it
stays, and what it lies on then gives way. Where the earlier places break a symmetry of the spec, the symmetry wins:
neurons of an instance follow the first instance of the same make; of a mirrored pair the one that was not moved by hand
follows the other (else the second follows the first). Where the fresh layout is not symmetric either, nothing moves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from neurovis_layouts.alike import pairs_by_axis, reflection, twice_axis
from neurovis_layouts.frame import across_of
from neurovis_layouts.occupancy import Body, Occupancy, lone, overlapping
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.model import Layout, LayoutModule, LayoutProblem, Point, Route

#: Differences up to this are rounding.
_SLACK = 1e-6
#: What bodies are anchored at that stand where they are.
_HERE = (0.0, 0.0)
_SAME = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Earlier:
    """Where neurons were, or are to be: those that ``stay`` there, and others that are ``wanted`` there if there is
    room; and the routes, by edge, that can be used between these places."""

    where: Mapping[int, Point]
    stay: frozenset[int]
    wanted: frozenset[int]
    routes: Mapping[int, Route]

    def has(self, neurons: Iterable[int]) -> bool:
        """Whether all of these have a place."""
        return all(neuron in self.where for neuron in neurons)


def earlier(problem: LayoutProblem, fresh: Sequence[Point]) -> Earlier:
    """What the earlier layout of a problem says, and its pins, which go before that."""
    assert problem.memory is not None
    there, pins = problem.memory.positions, problem.pins
    known = {i: there[name] for i, name in enumerate(problem.neurons) if name in there}
    where, hand = {**known, **pins}, _by_hand(problem, known)
    wanted: set[int] = set()
    _follow_makes(problem, fresh, where, wanted, known)
    put = set(hand) - wanted
    _follow_mirrors(problem, fresh, where, wanted, hand, put)
    both = whole(problem, overlapping({i: where[i] for i in put}, pins)) & put
    put -= both
    wanted = (wanted | both) - put - pins.keys()
    where.update(pins)
    routes = carried(problem, problem.memory, where)
    newly = put | {i for i, point in pins.items() if known.get(i) != point}
    off = _giving_way(problem, where, newly, routes)
    # in a file edited by hand neurons may overlap others without a word of that in its routes
    off |= overlapping({i: where[i] for i in where.keys() - wanted - off - pins.keys()}, pins)
    wanted |= (whole(problem, off) & where.keys()) - pins.keys() - (put - off)
    return Earlier(where, frozenset(where.keys() - wanted), frozenset(wanted), routes)


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
        if _equal((a, b), (route[-1][0] + dx, route[-1][1] + dy)):
            found[number] = tuple((p + dx, q + dy) for p, q in route) if dx or dy else route
    return found


def _by_hand(problem: LayoutProblem, now: Mapping[int, Point]) -> dict[int, Point]:
    """The neurons that were moved, with where they were. An instance of which only a part was moved is not among them:
    it contradicts its template, which a file cannot change."""
    before: dict[int, Point] = {}
    for edge in problem.edges:
        route = problem.memory.routes.get(edge.name) if problem.memory else None
        if route is not None:
            before.setdefault(edge.source, route[0])
            before.setdefault(edge.target, route[-1])
    before = {i: point for i, point in before.items() if i in now}
    moved = {i: point for i, point in before.items() if distance(point, now[i]) > _SLACK}
    for own in _outermost(problem).values():
        known = own & before.keys()
        if moved.keys().isdisjoint(known):
            continue
        shifts = [(now[i][0] - before[i][0], now[i][1] - before[i][1]) for i in known]
        x, y = shifts[0]
        rigid = all(_equal(shift, (x, y)) for shift in shifts)
        moved = {i: point for i, point in moved.items() if i not in own}
        moved |= {i: (now[i][0] - x, now[i][1] - y) for i in own if rigid and i in now}
    return {i: moved[i] for i in sorted(moved.keys() - problem.pins.keys())}


def _follow_makes(
    problem: LayoutProblem,
    fresh: Sequence[Point],
    where: dict[int, Point],
    moved: set[int],
    known: Mapping[int, Point],
) -> None:
    across = across_of(problem.direction)
    mirrored, upside_down = ((-1.0, 1.0), (1.0, -1.0))[:: 1 if across == 0 else -1]
    makes: dict[str, list[LayoutModule]] = {}
    for module in problem.modules:
        makes.setdefault(module.template, []).append(module)
    for make in makes.values():
        # what is pinned may be bent by its pins
        make.sort(key=lambda module: not problem.pins.keys().isdisjoint(module.members))
        first = next((m for m in make if not where.keys().isdisjoint(m.members)), make[0])
        for other in make:
            pairs = [(a, b) for a, b in zip(first.members, other.members, strict=True) if a in where and b in where]
            if other is first or not any(_alike(pairs, fresh, flip) for flip in (_SAME, mirrored)):
                continue
            if any(_alike(pairs, where, flip) for flip in (_SAME, mirrored, upside_down)):
                continue
            pinned = whole(problem, other.members) & problem.pins.keys()
            if pinned and all(known.get(i) == problem.pins[i] for i in pinned):
                continue  # it was drawn around its pins
            flip, shift = _best_fit(pairs, where, (_SAME, mirrored), problem.pins)
            for a, b in pairs:
                where[b] = shift[0] + flip[0] * where[a][0], shift[1] + flip[1] * where[a][1]
            moved.update(whole(problem, [b for _, b in pairs]) & where.keys())


def _alike(pairs: Sequence[tuple[int, int]], where: Mapping[int, Point] | Sequence[Point], flip: Point) -> bool:
    """Whether the second of the pairs stand as the first do, but for a flip and a shift."""
    shifts = [_shift(where[a], where[b], flip) for a, b in pairs]
    return bool(shifts) and all(_equal(shift, shifts[0]) for shift in shifts)


def _shift(one: Point, other: Point, flip: Point) -> Point:
    return other[0] - flip[0] * one[0], other[1] - flip[1] * one[1]


def _best_fit(
    pairs: Sequence[tuple[int, int]], where: Mapping[int, Point], flips: Sequence[Point], pins: Mapping[int, Point]
) -> tuple[Point, Point]:
    """The flip and the shift by which most stay where they are; those that are pinned count above all."""
    best: list[tuple[int, Point, Point]] = []
    for flip in flips:
        votes: Counter[Point] = Counter()
        for a, b in pairs:
            votes[_shift(where[a], where[b], flip)] += len(pairs) + 1 if b in pins else 1
        shift, count = max(votes.items(), key=lambda vote: (vote[1], -abs(vote[0][0]), -abs(vote[0][1]), vote[0]))
        best.append((count, flip, shift))
    return max(best, key=lambda one: one[0])[1:]


def _follow_mirrors(
    problem: LayoutProblem,
    fresh: Sequence[Point],
    where: dict[int, Point],
    moved: set[int],
    hand: Mapping[int, Point],
    put: set[int],
) -> None:
    across = across_of(problem.direction)
    for mirrored in pairs_by_axis(problem):
        pairs = [(a, b) for a, b in mirrored if a in where and b in where]
        mirror = reflection(across, twice_axis(pairs, fresh, across))
        pairs = [(a, b) for a, b in pairs if _equal(mirror.point(fresh[a]), fresh[b])]
        if not pairs:
            continue
        # what was moved by hand does not take the axis along, unless all was
        firm = [(a, b) for a, b in pairs if a not in hand or b not in hand]
        mirror = reflection(across, twice_axis(firm or pairs, {**where, **hand} if firm else where, across))
        followed: list[int] = []
        for a, b in pairs:
            if _equal(mirror.point(where[a]), where[b]):
                continue
            leads = [(i in problem.pins, i in hand) for i in (a, b)]
            first, second = (b, a) if leads[1] > leads[0] else (a, b)
            where[second] = mirror.point(where[first])
            if first in put and second not in problem.pins:
                put.add(second)
            else:
                followed += (a, b)
        moved.update(whole(problem, followed) & where.keys())


def _equal(one: Point, other: Point) -> bool:
    return abs(one[0] - other[0]) <= _SLACK and abs(one[1] - other[1]) <= _SLACK


def whole(problem: LayoutProblem, neurons: Iterable[int]) -> set[int]:
    """These neurons with all others in the outermost instances around them, and the mirror images of all of them."""
    found = set(neurons)
    images = {n: mate for mirror in problem.mirrors for a, b in mirror.pairs for n, mate in ((a, b), (b, a))}
    found |= {images[n] for n in found if n in images}
    for own in _outermost(problem).values():
        if not found.isdisjoint(own):
            found |= own
    return found | {images[n] for n in found if n in images}


def _giving_way(
    problem: LayoutProblem, placed: Mapping[int, Point], put: set[int], routes: Mapping[int, Route]
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
