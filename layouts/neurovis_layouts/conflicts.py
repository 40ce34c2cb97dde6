"""Conflicts: what of an earlier layout, which somebody may have edited by hand, is wanted where.

In: a problem with an earlier layout, a drawing of it as if there were none, and where pins hold what. Out: a place for
each neuron that the earlier one knew, and who of these is there for the first time. What was moved by hand differs from
where the file's routes begin or end; it stays, and what it lies on then gives way. Where the earlier places break a
symmetry of the spec, the symmetry wins: neurons of an instance follow the first instance of the same make; of a
mirrored pair the one that was not moved by hand follows the other (else the second follows the first).

A and B are mirror images about x = 0, and the file has A at (−1, 0) and B at (1, 0), with a route from (1, 0): nobody
was moved, and both stay. Had somebody written (3, 0) for B, its route would still begin at (1, 0): B was moved by hand,
and A follows it to (−3, 0); what stands there gives way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from neurovis_layouts.alike import Axis, Move, axis_of, mirror_images, move_of, pairs_by_axis, reflection, same
from neurovis_layouts.frame import across_of
from neurovis_layouts.occupancy import overlapping
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import RADIUS, Layout, LayoutModule, LayoutProblem, Point, Route

#: Discs that touch do not overlap, whatever rounding says.
_SLACK = 1e-6


@dataclass(frozen=True, slots=True)
class Earlier:
    """Where neurons are wanted. Those that are put there ``newly``, by hand or by a pin, stand there whatever it was
    that stood there; those that are ``lost`` only if there is room; all others where they were."""

    where: Mapping[int, Point]
    newly: frozenset[int]
    lost: frozenset[int] = frozenset()


class Memory:
    """What an earlier layout says of a problem's neurons; nothing where there is none."""

    def __init__(self, problem: LayoutProblem, fresh: Sequence[Point]) -> None:
        there = problem.memory.positions if problem.memory else {}
        self.known = {i: there[name] for i, name in enumerate(problem.neurons) if name in there}
        self._problem, self._fresh = problem, fresh
        #: the neurons of each outermost instance, by its number
        self.outer = {k: frozenset(module.members) for k, module in enumerate(problem.modules) if module.parent < 0}
        self._images = mirror_images(problem)
        self._hand = _by_hand(problem, self.known, self.outer.values())
        #: the axis of a scope, if a pair of it is known
        self.axes: dict[int, Axis] = {}
        known = self.known
        for scope, pairs in _outermost_first(problem):
            both = [(a, b) for a, b in pairs if a in known and b in known]
            # what was moved by hand does not take the axis along, unless all was
            firm = [(a, b) for a, b in both if a not in self._hand or b not in self._hand]
            if both:
                self.axes[scope] = axis_of(problem, scope, firm or both, {**known, **self._hand} if firm else known)
                known = {**known, **self._followed(scope, both)}

    def _followed(self, scope: int, pairs: Iterable[tuple[int, int]]) -> dict[int, Point]:
        """The images of what was moved by hand, where they are then."""
        mirror, found = self.axes[scope].mirror, dict[int, Point]()
        for pair in pairs:
            for one, other in (pair, pair[::-1]):
                if one in self._hand and other not in self._hand:
                    found[other] = mirror.point(self.known[one])
        return found

    def earlier(self, held: Mapping[int, Point], axes: Mapping[int, Axis]) -> Earlier:
        """Where neurons are wanted, with some ``held`` by pins, and the ``axes`` of scopes."""
        where = {**self.known, **held}
        changed = {i for i, point in held.items() if i not in self.known or not same(self.known[i], point)}
        for own in self.outer.values():  # it is drawn around its pins anew
            if not changed.isdisjoint(own):
                where = {i: point for i, point in where.items() if i in held or i not in own}
        lost = self._follow_makes(where, held)
        put = self._hand.keys() & where.keys() - held.keys() - lost
        lost |= self._follow_mirrors(where, put, held, axes)
        both = self.together(overlapping({i: where[i] for i in put}, held)) & put
        put -= both
        lost = (lost | both) - put
        on_top = overlapping({i: where[i] for i in where.keys() - held.keys() - lost}, held)
        lost |= self.together(on_top) - (put - on_top)
        return Earlier(where, frozenset(put | changed), frozenset(lost & where.keys() - held.keys()))

    def _follow_makes(self, where: dict[int, Point], held: Mapping[int, Point]) -> set[int]:
        """Instances that are drawn alike made alike; those that have to move. What is held may be bent by its pins."""
        makes: dict[str, list[LayoutModule]] = {}
        for module in self._problem.modules:
            if held.keys().isdisjoint(module.members) and not where.keys().isdisjoint(module.members):
                makes.setdefault(module.template, []).append(module)
        flips = (1.0, 1.0), reflection(across_of(self._problem.direction), 0.0).flip
        lost: set[int] = set()
        for first, *others in makes.values():
            for other in others:
                pairs = [(a, b) for a, b in zip(first.members, other.members, strict=True) if a in where and b in where]
                drawn, now = (move_of([(at[a], at[b]) for a, b in pairs]) for at in (self._fresh, where))
                if drawn is not None and now is None:
                    move = _nearest([(where[a], where[b]) for a, b in pairs], flips)
                    where.update({b: move.point(where[a]) for a, b in pairs})
                    lost |= self.together(b for _, b in pairs)
        return lost

    def _follow_mirrors(
        self, where: dict[int, Point], put: set[int], held: Mapping[int, Point], axes: Mapping[int, Axis]
    ) -> set[int]:
        """Mirror images made so; those that have to move. The image of what was ``put`` by hand is so, too."""
        followed, on_axis = set[int](), set[int]()
        bent = {i for own in self.outer.values() if not held.keys().isdisjoint(own) for i in own}
        for scope, pairs in _outermost_first(self._problem):
            if scope not in axes:
                continue
            mirror = axes[scope].mirror
            for a, b in pairs:
                if {a, b} & (bent | held.keys()):
                    continue
                if a in where and b in where and not same(mirror.point(where[a]), where[b]):
                    first, second = (b, a) if b in self._hand and a not in self._hand else (a, b)
                    where[second] = mirror.point(where[first])
                    if first in put:
                        put.add(second)
                    else:
                        followed |= {a, b}
                there = {i for i in (a, b) if i in where}
                on_axis |= {i for i in there if distance(where[i], mirror.point(where[i])) < 2 * RADIUS - _SLACK}
        on_axis = self.together(on_axis)  # their images would stand on them
        put -= on_axis
        return self.together(followed) | on_axis

    def together(self, neurons: Iterable[int]) -> set[int]:
        """These neurons with all others in the outermost instances around them, and the mirror images of all."""
        found = set(neurons)
        found |= {self._images[n] for n in found if n in self._images}
        for own in self.outer.values():
            if not found.isdisjoint(own):
                found |= own
        return found | {self._images[n] for n in found if n in self._images}


def carried(problem: LayoutProblem, layout: Layout, placed: Mapping[int, Point]) -> dict[int, Route]:
    """The routes of a layout, by edge, whose two ends are where they were or were moved by the same amount; moved
    along."""
    found: dict[int, Route] = {}
    for number, edge in enumerate(problem.edges):
        route = layout.routes.get(edge.name)
        if route is None or edge.source not in placed or edge.target not in placed:
            continue
        (x, y), end = placed[edge.source], placed[edge.target]
        move = Move(shift=(x - route[0][0], y - route[0][1]))
        if same(end, move.point(route[-1])):
            found[number] = move.route(route) if any(move.shift) else route
    return found


def routed_from(problem: LayoutProblem) -> dict[int, Point]:
    """Where the routes of an earlier layout begin and end: where their neurons stood before somebody moved them."""
    before: dict[int, Point] = {}
    for edge in problem.edges:
        route = problem.memory.routes.get(edge.name) if problem.memory else None
        if route is not None:
            before.setdefault(edge.source, route[0])
            before.setdefault(edge.target, route[-1])
    return before


def _outermost_first(problem: LayoutProblem) -> list[tuple[int, list[tuple[int, int]]]]:
    """The pairs of mirror images by their scopes, those of the whole before those within instances."""
    return sorted(pairs_by_axis(problem).items())


def _by_hand(problem: LayoutProblem, now: Mapping[int, Point], outer: Iterable[frozenset[int]]) -> dict[int, Point]:
    """The neurons that were moved, with where they were. Of the instances that are ``outer``, those of which only a
    part was moved are not among them: they contradict their template, which a file cannot change."""
    before = {i: point for i, point in routed_from(problem).items() if i in now}
    moved = {i: point for i, point in before.items() if not same(point, now[i])}
    for own in outer:
        known = sorted(own & before.keys())
        if moved.keys().isdisjoint(known):
            continue
        moved = {i: point for i, point in moved.items() if i not in own}
        way = move_of([(now[i], before[i]) for i in known])
        if way is not None and way.flip == (1.0, 1.0):
            moved |= {i: way.point(now[i]) for i in own if i in now}
    return {i: moved[i] for i in sorted(moved.keys() - problem.pins.keys())}


def _nearest(pairs: Sequence[tuple[Point, Point]], flips: Iterable[Point]) -> Move:
    """The move, with one of these flips, by which most of the second of each pair stay where they are."""
    best: list[tuple[int, Move]] = []
    for flip in flips:
        turned = Move(flip)
        ends = ((turned.point(a), b) for a, b in pairs)
        votes = Counter((snap(b[0] - x), snap(b[1] - y)) for (x, y), b in ends)
        shift, count = max(votes.items(), key=lambda vote: (vote[1], -abs(vote[0][0]), -abs(vote[0][1]), vote[0]))
        best.append((count, Move(flip, shift)))
    return max(best, key=lambda one: one[0])[1]
