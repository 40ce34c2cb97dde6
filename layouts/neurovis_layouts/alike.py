"""Alike: the neurons whose places follow from each other, as copies in other instances or as mirror images.

In: a problem and the places of some of its neurons. Out: for a neuron, its copies in other instances of the same make,
and its mirror image, each with the move that takes its place to theirs. The moves are found from the neurons that have
places already.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from neurovis_layouts.frame import across_of
from neurovis_spec.layout.model import LayoutModule, LayoutProblem, Point


@dataclass(frozen=True, slots=True)
class Move:
    """A point p becomes shift + flip · p, coordinate by coordinate; a flip is 1 or −1."""

    flip: Point = (1.0, 1.0)
    shift: Point = (0.0, 0.0)

    def point(self, point: Point) -> Point:
        """A point moved."""
        return self.shift[0] + self.flip[0] * point[0], self.shift[1] + self.flip[1] * point[1]

    def inverse(self) -> Move:
        """The move back."""
        (fx, fy), (x, y) = self.flip, self.shift
        return Move(self.flip, (-fx * x, -fy * y))

    def then(self, other: Move) -> Move:
        """This move, then the other."""
        return Move((self.flip[0] * other.flip[0], self.flip[1] * other.flip[1]), other.point(self.shift))


#: What does not move.
STAY = Move()


def reflection(across: int, twice: float) -> Move:
    """The reflection on an axis, ``twice`` where it stands."""
    return Move((-1.0, 1.0), (twice, 0.0)) if across == 0 else Move((1.0, -1.0), (0.0, twice))


class Alike:
    """Looks up the counterparts of a neuron: those whose places follow from its place."""

    def __init__(self, problem: LayoutProblem, placed: Mapping[int, Point]) -> None:
        self._placed = placed
        self._makes: dict[str, list[LayoutModule]] = {}
        self._around: dict[int, list[tuple[LayoutModule, int]]] = {}
        for module in problem.modules:
            self._makes.setdefault(module.template, []).append(module)
            for place, neuron in enumerate(module.members):
                self._around.setdefault(neuron, []).append((module, place))
        self._images: dict[int, tuple[int, Move]] = {}
        across = across_of(problem.direction)
        for pairs in pairs_by_axis(problem):
            there = [(a, b) for a, b in pairs if a in placed and b in placed]
            move = reflection(across, twice_axis(there, placed, across))
            for a, b in pairs if there else ():
                self._images[a] = b, move
                self._images[b] = a, move

    def of(self, neuron: int) -> list[tuple[int, Move]]:
        """The neurons drawn like this one, itself first, each with the move from its place."""
        found: dict[int, Move] = {}
        waiting: list[tuple[int, str]] = []

        def add(mate: int, move: Move, by: str) -> None:
            found[mate] = move
            waiting.append((mate, by))

        def reach(mate: int, move: Move, by: str) -> None:
            add(mate, move, by)
            # its image at once: instances too narrow to show whether they are reflected follow their images
            image = self._images.get(mate)
            if image is not None and image[0] not in found:
                add(image[0], move.then(image[1]), "")

        reach(neuron, STAY, "")
        for one, by in waiting:
            for module, place in self._around.get(one, ()):
                if module.template == by:  # all that are drawn like it have been found from where it was
                    continue
                for other in self._makes[module.template]:
                    mate = other.members[place]
                    move = None if mate in found else self._move(module, other)
                    if move is not None:
                        reach(mate, found[one].then(move), module.template)
        return list(found.items())

    def image(self, module: LayoutModule) -> tuple[tuple[int, ...], Move] | None:
        """The mirror images of an instance's neurons, if all of them have one, and the move to them."""
        images = [self._images.get(neuron) for neuron in module.members]
        known = [image for image in images if image is not None]
        if not known or len(known) < len(images) or any(move != known[0][1] for _, move in known):
            return None
        mates = tuple(mate for mate, _ in known)
        return None if set(mates) & set(module.members) else (mates, known[0][1])

    def _move(self, one: LayoutModule, other: LayoutModule) -> Move | None:
        """What takes one instance to the other, where neurons of both are placed; None where they are not drawn
        alike."""
        pairs = [
            (self._placed[a], self._placed[b])
            for a, b in zip(one.members, other.members, strict=True)
            if a in self._placed and b in self._placed
        ]
        if not pairs:
            return None
        flips: list[float] = []
        for axis in (0, 1):
            first, image = pairs[0][0][axis], pairs[0][1][axis]
            apart = next(((a[axis] - first, b[axis] - image) for a, b in pairs if a[axis] != first), None)
            flips.append(-1.0 if apart is not None and apart[0] == -apart[1] else 1.0)
        (ax, ay), (bx, by) = pairs[0]
        move = Move((flips[0], flips[1]), (bx - flips[0] * ax, by - flips[1] * ay))
        return move if all(move.point(a) == b for a, b in pairs) else None


def pairs_by_axis(problem: LayoutProblem) -> list[list[tuple[int, int]]]:
    """The pairs of mirror images, those about one axis together."""
    found: dict[int, list[tuple[int, int]]] = {}
    for mirror in problem.mirrors:
        found.setdefault(mirror.scope, []).extend(mirror.pairs)
    return list(found.values())


def twice_axis(pairs: Sequence[tuple[int, int]], where: Mapping[int, Point] | Sequence[Point], across: int) -> float:
    """Twice where the axis of these pairs stands: their median."""
    totals = sorted(where[a][across] + where[b][across] for a, b in pairs)
    return totals[len(totals) // 2] if totals else 0.0
