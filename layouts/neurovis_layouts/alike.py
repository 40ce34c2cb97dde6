"""Alike: the neurons whose places follow from each other, as copies in other instances or as mirror images.

In: a problem and the places of some of its neurons. Out: for a neuron, its copies in other instances of the same make,
and its mirror image, each with the Move that takes its place to theirs. The moves are found from the neurons that have
places already.

Say ``l`` and ``r`` are instances of one module with the neurons A, B and C::

    l.A (0, 0)   l.B (1, 2)   l.C (2, 0)        r.A (9, 0)   r.B (8, 2)   r.C: new

A and B tell that r is l reflected and shifted (x becomes 9 − x), so r.C belongs at (7, 0): ``of`` of l.C gives l.C as
it is, and r.C with that move.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from neurovis_layouts.frame import across_of
from neurovis_spec.layout.geometry import Rect, bounds
from neurovis_spec.layout.model import LayoutModule, LayoutProblem, Point, Route

#: Differences up to this are rounding, such as that of pins that are not on the grid.
_SLACK = 1e-6


@dataclass(frozen=True, slots=True)
class Move:
    """A point p becomes shift + flip · p, coordinate by coordinate; a flip is 1 or −1."""

    flip: Point = (1.0, 1.0)
    shift: Point = (0.0, 0.0)

    def point(self, point: Point) -> Point:
        """A point moved."""
        return self.shift[0] + self.flip[0] * point[0], self.shift[1] + self.flip[1] * point[1]

    @property
    def mirrored(self) -> bool:
        """Whether it reflects across an upright axis."""
        return self.flip[0] < 0

    def route(self, route: Route) -> Route:
        """A route moved."""
        return tuple(map(self.point, route))

    def rect(self, rect: Rect) -> Rect:
        """A rectangle moved."""
        return bounds([self.point(rect[:2]), self.point(rect[2:])])

    def inverse(self) -> Move:
        """The move back."""
        (fx, fy), (x, y) = self.flip, self.shift
        return Move(self.flip, (-fx * x, -fy * y))

    def then(self, other: Move) -> Move:
        """This move, then the other."""
        return Move((self.flip[0] * other.flip[0], self.flip[1] * other.flip[1]), other.point(self.shift))


#: What does not move.
STAY = Move()


def shifted_by(shift: Point, flip: bool = False) -> Move:
    """The move by a shift, reflected across the upright axis at 0 before that if ``flip``."""
    return Move((-1.0 if flip else 1.0, 1.0), shift)


def reflection(across: int, twice: float) -> Move:
    """The reflection on an axis, ``twice`` where it stands."""
    return Move((-1.0, 1.0), (twice, 0.0)) if across == 0 else Move((1.0, -1.0), (0.0, twice))


@dataclass(frozen=True, slots=True)
class Axis:
    """The axis of a mirror: which coordinate is ``across`` it (0: x, it is upright), and ``twice`` where it stands."""

    across: int
    twice: float = 0.0

    @property
    def mirror(self) -> Move:
        """The reflection on it."""
        return reflection(self.across, self.twice)


def move_of(pairs: Sequence[tuple[Point, Point]]) -> Move | None:
    """The move that takes the first of each pair to the second; None where there is none.

    >>> move_of([((0.0, 0.0), (5.0, 1.0)), ((1.0, 2.0), (4.0, 3.0))])
    Move(flip=(-1.0, 1.0), shift=(5.0, 1.0))
    """
    if not pairs:
        return None
    (a, b), flips = pairs[0], [1.0, 1.0]
    for axis in (0, 1):
        steps = ((p[axis] - a[axis], q[axis] - b[axis]) for p, q in pairs if abs(p[axis] - a[axis]) > _SLACK)
        apart = next(steps, (0.0, 1.0))
        flips[axis] = -1.0 if abs(apart[0] + apart[1]) <= _SLACK else 1.0
    move = Move((flips[0], flips[1]), (b[0] - flips[0] * a[0], b[1] - flips[1] * a[1]))
    return move if all(same(move.point(p), q) for p, q in pairs) else None


def same(one: Point, other: Point) -> bool:
    """Whether two points differ by rounding alone."""
    return abs(one[0] - other[0]) <= _SLACK and abs(one[1] - other[1]) <= _SLACK


class Alike:
    """Looks up the counterparts of a neuron: those whose places follow from its place."""

    def __init__(
        self,
        problem: LayoutProblem,
        placed: Mapping[int, Point],
        axes: Mapping[int, Axis] = MappingProxyType({}),
    ) -> None:
        """``axes`` are those of scopes, as far as they are known; others are where they are among what is placed."""
        self._placed = placed
        self._makes: dict[str, list[LayoutModule]] = {}
        self._around: dict[int, list[tuple[LayoutModule, int]]] = {}
        for module in problem.modules:
            self._makes.setdefault(module.template, []).append(module)
            for place, neuron in enumerate(module.members):
                self._around.setdefault(neuron, []).append((module, place))
        #: about the axis of the whole, and about those of instances
        self._images: dict[int, list[tuple[int, Move]]] = {}
        for scope, pairs in pairs_by_axis(problem).items():
            there = [(a, b) for a, b in pairs if a in placed and b in placed]
            axis = axes.get(scope) or axis_of(problem, scope, there, placed)
            for a, b in pairs if there or scope in axes else ():
                self._images.setdefault(a, []).append((b, axis.mirror))
                self._images.setdefault(b, []).append((a, axis.mirror))

    def of(self, neuron: int) -> list[tuple[int, Move]]:
        """The neurons drawn like this one, itself first, each with the move from its place."""
        found: dict[int, Move] = {}
        waiting: list[tuple[int, str]] = []

        def reach(mate: int, move: Move, by: str) -> None:
            if mate not in found:
                found[mate] = move
                waiting.append((mate, by))
                # its images at once: instances too narrow to show whether they are reflected follow their images
                for image, mirror in self._images.get(mate, ()):
                    reach(image, move.then(mirror), "")

        reach(neuron, STAY, "")
        for one, by in waiting:
            for module, other, mate in self._mates(one, by):
                move = None if mate in found else self._move(module, other)
                if move is not None:
                    reach(mate, found[one].then(move), module.template)
        return list(found.items())

    def _mates(self, neuron: int, by: str) -> Iterator[tuple[LayoutModule, LayoutModule, int]]:
        """An instance around a neuron, another of its template, and the neuron that has the same place there; none of
        the template ``by``: all that are drawn like it have been found from where it was."""
        for module, place in self._around.get(neuron, ()):
            if module.template != by:
                yield from ((module, other, other.members[place]) for other in self._makes[module.template])

    def _move(self, one: LayoutModule, other: LayoutModule) -> Move | None:
        """What takes one instance to the other, where neurons of both are placed; None where they are not drawn
        alike."""
        return move_of(
            [
                (self._placed[a], self._placed[b])
                for a, b in zip(one.members, other.members, strict=True)
                if a in self._placed and b in self._placed
            ]
        )


def mirror_images(problem: LayoutProblem) -> dict[int, int]:
    """By neuron, its mirror image, about whatever axis."""
    return {a: b for mirror in problem.mirrors for pair in mirror.pairs for a, b in (pair, pair[::-1])}


def pairs_by_axis(problem: LayoutProblem) -> dict[int, list[tuple[int, int]]]:
    """The pairs of mirror images, those about one axis together, by its scope."""
    found: dict[int, list[tuple[int, int]]] = {}
    for mirror in problem.mirrors:
        found.setdefault(mirror.scope, []).extend(mirror.pairs)
    return found


def axis_of(
    problem: LayoutProblem, scope: int, pairs: Sequence[tuple[int, int]], where: Mapping[int, Point] | Sequence[Point]
) -> Axis:
    """The axis of a scope, by some of its pairs. That of the whole is along the direction. That of an instance is as
    most of the pairs stand, since a plan of the page may have turned the instance; where these do not say, along the
    direction, too."""
    across = across_of(problem.direction)
    steps = [(abs(where[a][0] - where[b][0]), abs(where[a][1] - where[b][1])) for a, b in pairs if scope >= 0]
    votes = [sum(step[side] > _SLACK >= step[1 - side] for step in steps) for side in (0, 1)]
    across = 1 - across if votes[1 - across] > votes[across] else across
    return Axis(across, twice_axis(pairs, where, across))


def twice_axis(pairs: Sequence[tuple[int, int]], where: Mapping[int, Point] | Sequence[Point], across: int) -> float:
    """Twice where the axis of these pairs stands: their median."""
    totals = sorted(where[a][across] + where[b][across] for a, b in pairs)
    return totals[len(totals) // 2] if totals else 0.0
