"""Beside: which labels stand beside their discs, on which side, and in which wording.

In: labels by importance, the spots of each, the scale. Out: a Slot and a wording for each label that has room. A label
that is shown at a scale is shown at every larger one, and no shorter, unless a title takes its place there: the scales
from the smallest on are gone through in fixed steps, and at each of them labels find room among those that are there
already, which make way, or are cut. What a label claims, from its disc on, gets smaller in layout units from step to
step, so that those that are there stay free of each other (active ranges: Been, Daiches and Yap 2006). In the end names
that stand in one line take one side, and long ones the room that is left.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from neurovis_spec.scene.spots import Field, Slot, Spot, Spots, Wanted, met

#: The smallest scale (page units for a layout unit) at which there are labels, and the steps from it on.
_FIRST, _STEP = 6.0, 1.25
#: To stand on another side than the others of a line is as bad as to lie across the border of a frame.
_ASTRAY = 2
#: The first sides, those that are no corners: on these names of one line stand.
_STRAIGHT = 4
#: So many labels make way for another.
_MOST_MOVED = 2


def placed(
    wanted: Sequence[Wanted], field: Field, size_of: Callable[[float], float], scale: float
) -> dict[int, tuple[Slot, int]]:
    """The sides on which labels stand at this scale, and their wordings, by neuron. ``wanted`` are in the order of
    their importance; ``size_of`` gives the size of a label beside a disc of this radius, both in page units: it grows
    no faster than the radius."""
    search = _Search(wanted, field, size_of)
    at = _FIRST
    while at <= scale:
        search.begin(at)
        search.fill()
        at *= _STEP
    search.begin(scale)
    search.settle()
    return {
        index: (side, wording)
        for number, (wording, spot) in search.found.items()
        for index, side in zip(wanted[number].members, spot.sides, strict=True)
    }


class _Search:
    """Labels at one scale after the other; ``found`` are those that stand somewhere, by their numbers among those
    wanted: in which wording, and where."""

    def __init__(self, wanted: Sequence[Wanted], field: Field, size_of: Callable[[float], float]) -> None:
        self._wanted, self._field, self._spots = wanted, field, Spots(wanted, field, size_of)
        self._waiting: list[int] = []
        self.found: dict[int, tuple[int, Spot]] = {}
        #: what labels claim, two rows for each that is wanted; what is not claimed is beyond everything
        self._claims = np.full((2 * len(wanted), 4), np.inf)

    def begin(self, scale: float) -> None:
        """Go on to a larger scale, without the labels that stand on their discs from there on."""
        self._spots.begin(scale)
        self._waiting = [number for number, one in enumerate(self._wanted) if one.until > scale]
        for number in self.found.keys() - set(self._waiting):
            self._leave(number)
        for number, (wording, spot) in list(self.found.items()):
            self._put(number, wording, replace(spot, claims=self._spots.claims(number, wording, spot.sides)))

    def fill(self) -> None:
        """Find room for labels that have none, or are cut: among the others, else where one or two others make way,
        else for a part of the name."""
        for number in self._waiting:
            if self._missing(number):
                self._choose(number, self._wanted[number].usual)
        for number in self._waiting:
            any(self._choose(number, wording) or self._make_room(number, wording) for wording in self._missing(number))

    def settle(self) -> None:
        """Now that all are there: what stands in the room of others leaves it, each finds its best side, those of a
        line one side, and the rest of long names room."""
        for number, wording, spot in [self._stand(number) for number in sorted(self.found)]:
            same = self._same(number, wording, spot)
            if same is None:  # it reaches too far beyond the rim
                self._leave(number)
            else:
                self._put(number, wording, same)
        for number in self._waiting:
            one = self._wanted[number]
            if one.kept:
                self._choose(number, self.found[number][0] if number in self.found else one.usual)
        for number in sorted(self.found):
            self._choose(number, self.found[number][0])
        lines: dict[int, list[int]] = {}
        where = self._field.places.tolist()
        for number in sorted(self._waiting, key=lambda number: where[self._wanted[number].members[0]]):
            lines.setdefault(self._wanted[number].line, []).append(number)
        for line, numbers in lines.items():
            if line >= 0 and len(numbers) > 1:
                self._line_up(numbers)
        self.fill()
        for number in sorted(self.found):
            self._lengthen(number)

    def _missing(self, number: int) -> range:
        """The wordings in which a label would say more than it does, up to as much as is usual."""
        one = self._wanted[number]
        return range(one.usual, self.found[number][0] if number in self.found else len(one.wordings))

    def _same(self, number: int, wording: int, spot: Spot) -> Spot | None:
        """The spot on the same sides in another wording, or at another scale."""
        return next((one for one in self._spots.of(number, wording) if one.sides == spot.sides), None)

    def _free(self, spot: Spot) -> bool:
        """Whether no other label is there."""
        return not met(self._claims, spot.claims).any()

    def _put(self, number: int, wording: int, spot: Spot) -> None:
        self.found[number] = wording, spot
        self._claims[2 * number : 2 * number + len(spot.claims)] = spot.claims

    def _leave(self, number: int) -> None:
        self._claims[2 * number : 2 * number + 2] = np.inf
        self.found.pop(number, None)

    def _stand(self, number: int) -> tuple[int, int, Spot]:
        """A label, its wording and its spot, as ``_put`` takes them."""
        return number, *self.found[number]

    def _choose(self, number: int, wording: int) -> bool:
        """Put a label, in this wording, on its best free side, if there is one; else it stays as it is."""
        before = self._stand(number) if number in self.found else None
        self._leave(number)
        best = next((spot for spot in self._spots.of(number, wording) if self._free(spot)), None)
        if best is not None:
            self._put(number, wording, best)
        elif before is not None:
            self._put(*before)
        return best is not None

    def _make_room(self, number: int, wording: int) -> bool:
        """Put a label, in this wording, where it has room if others find another place, and these there."""
        for spot in self._spots.of(number, wording):
            others = set((np.flatnonzero(met(self._claims, spot.claims).any(axis=0)) // 2).tolist()) - {number}
            if len(others) > _MOST_MOVED:
                continue
            before = [self._stand(one) for one in sorted(others | ({number} & self.found.keys()))]
            for one, _, _ in before:
                self._leave(one)
            self._put(number, wording, spot)
            if all(self._choose(one, said) for one, said, _ in before if one != number):
                return True
            for one in (number, *others):
                self._leave(one)
            for stood in before:
                self._put(*stood)
        return False

    def _line_up(self, numbers: Sequence[int]) -> None:
        """Have names of one line stand on one side, or on one and the other by turns, those that find no room there
        where they can, if more of them find room then or they are easier to read than where they stand now."""
        before = {number: self.found[number] for number in numbers if number in self.found}
        best = self._together(numbers), before
        beside = self._field.sides[:_STRAIGHT]
        for turns in (*((side, side) for side in beside), beside[:2], beside[1::-1]):
            for number in numbers:
                self._leave(number)
            left = []
            for place, number in enumerate(numbers):
                wording = before[number][0] if number in before else self._wanted[number].usual
                side = turns[place % 2]
                spot = next((spot for spot in self._spots.of(number, wording) if spot.sides[0] == side), None)
                if spot is not None and self._free(spot):
                    self._put(number, wording, spot)
                else:
                    left.append((number, wording))
            for number, wording in left:
                self._choose(number, wording)
            if before.keys() <= self.found.keys():
                worth = self._together(numbers)
                if worth < best[0]:
                    best = worth, {number: self.found[number] for number in numbers if number in self.found}
        for number in numbers:
            self._leave(number)
        for number, stands in best[1].items():
            self._put(number, *stands)

    def _together(self, numbers: Sequence[int]) -> tuple[int, int, int, int, int]:
        """What is bad about where the names of a line stand: how many nowhere; how hard to read they are, also as they
        are not on the side on which most are; then how many are not, how much of lines they cover, and how many are not
        where the layout kept room for them."""
        spots = [self.found[number][1] for number in numbers if number in self.found]
        sides = Counter(spot.sides[0] for spot in spots for _ in spot.sides)
        astray = sides.total() - max(sides.values(), default=0)
        weight = sum(spot.weight for spot in spots) + _ASTRAY * astray
        covered, moved = sum(spot.dots for spot in spots), sum(spot.elsewhere for spot in spots)
        return len(numbers) - len(spots), weight, astray, covered, moved

    def _lengthen(self, number: int) -> None:
        """Say more of a name that is cut, on the side where it stands, if it lies on no more there."""
        _, wording, spot = stands = self._stand(number)
        self._leave(number)
        for longer in range(wording):
            same = self._same(number, longer, spot)
            if same is not None and same.worth <= spot.worth and self._free(same):
                stands = number, longer, same
                break
        self._put(*stands)
