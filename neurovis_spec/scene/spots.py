"""Spots: where a label may stand beside its disc, and how well it is read there.

In: labels that are wanted; discs, lines, frames and texts in layout units; a scale. Out: for each label in each of its
wordings the Spots where it covers no disc and no text, best first. Which of them other labels leave free is the
business of ``beside``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import beside
from neurovis_spec.layout.model import Point

#: Between a label and the middle of a line that does not touch it, in page units.
_LINE = 2.5
#: Labels by which it is known how what they cover grows: of no width, of one size, of two lines.
_GROWING: Final = ((0.0, 1), (1.0, 1), (0.0, 2))
#: How far labels may reach beyond the discs at the rim, in page units; where more is asked for, so much and a share of
#: the width.
BEYOND, _ALWAYS, _SHARE = 20.0, 50.0, 0.3
#: The cosine of one and a half eighths of a turn.
_TOWARDS = 0.3827


@dataclass(frozen=True, slots=True)
class Slot:
    """A side of a disc: −1, 0 or 1 ``across`` (left, middle, right) and ``down`` (above, level, below)."""

    across: int
    down: int

    def text(self, radius: float, width: float, size: float, lines: int = 1) -> Rect:
        """What the letters cover, in so many lines, from the centre of the disc."""
        return beside(self.across, self.down, radius, width, size, lines)

    def claim(self, radius: float, width: float, size: float, lines: int = 1) -> Rect:
        """The same with a little air, and all between it and the disc."""
        x0, y0, x1, y1 = self.text(radius, width, size, lines)
        x0, y0, x1, y1 = x0 - 2, y0 - 1, x1 + 2, y1 + 1
        inner = radius if not (self.across and self.down) else 0.75 * radius
        if self.across:
            x0, x1 = (inner, x1) if self.across > 0 else (x0, -inner)
        if self.down:
            y0, y1 = (inner, y1) if self.down > 0 else (y0, -inner)
        return x0, y0, x1, y1

    def leads(self, way: Point) -> bool:
        """Whether it is, of the eight sides, one of the three that are most in this direction."""
        far = math.hypot(self.across, self.down) * math.hypot(*way)
        return self.across * way[0] + self.down * way[1] > _TOWARDS * far

    def mirrored(self, level: bool) -> Slot:
        """The side on the mirror image of the disc: top and bottom change places where signals run across."""
        return Slot(self.across, -self.down) if level else Slot(-self.across, self.down)


#: Where labels stand, the best side first; signals run down, or across.
_SIDES = tuple(Slot(*side) for side in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, -1), (-1, -1), (1, 1), (-1, 1)))
_LEVEL = (*_SIDES[2:4], *_SIDES[:2], *_SIDES[4:])


#: How wide a label is, in sizes, and how many lines it has.
Extent: TypeAlias = tuple[float, int]


@dataclass(frozen=True, slots=True)
class Wanted:
    """Neurons that have a label all or none, with mirrored sides; how wide the labels of all of them are, in sizes, and
    in how many lines, in each ``wording`` from the longest on; which wording is the ``usual`` one, which others give
    way to; the scale from which they stand on their discs."""

    members: tuple[int, ...]
    wordings: tuple[tuple[Extent, ...], ...]
    usual: int = 0
    until: float = np.inf
    #: where the layout kept room for them
    kept: tuple[Slot, ...] = ()
    #: those with the same number stand on one side as far as they can; −1 for none
    line: int = -1
    #: which way (across, down) is out of the ring on which it stands: names are not within
    outward: Point | None = None


@dataclass(frozen=True, slots=True)
class Field:
    """Discs, sample points of lines and of the ``borders`` of frames, and the extent, in layout units; how far labels
    are to reach beyond it, to either side, in page units; whether signals run across; what is ``taken`` (k, 4), in
    layout units."""

    places: FloatArray
    radii: FloatArray
    dots: FloatArray
    borders: FloatArray
    extent: Rect
    reach: float
    level: bool
    taken: FloatArray

    @property
    def sides(self) -> tuple[Slot, ...]:
        """Where labels stand, the best side first."""
        return _LEVEL if self.level else _SIDES


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """Sides on which labels may stand together, what each claims there (m, 4), and what is bad about it: how many are
    nearer to another disc than to their own, lie across the border of a frame, across a line; how much of lines they
    cover; whether it is not where the layout kept room."""

    sides: tuple[Slot, ...]
    claims: FloatArray
    misread: int
    borders: int
    lines: int
    dots: int
    elsewhere: bool

    @property
    def worth(self) -> tuple[int, int, int]:
        """Of one label: less is better."""
        return self.misread, self.borders, self.dots

    @property
    def weight(self) -> int:
        """Of several together: what the border of a frame runs through is twice as hard to read as what a line does,
        and what seems to be the name of another as hard again."""
        return 4 * self.misread + 2 * self.borders + self.lines


def beyond(extent: Rect, scale: float, wanted: float) -> float:
    """How far labels may reach beyond the extent on either side, at a scale: as far as wanted, but most of the picture
    is for the network."""
    return max(BEYOND, min(wanted, _ALWAYS + _SHARE * scale * (extent[2] - extent[0])))


class Spots:
    """The spots of labels at one scale after the other; ``size_of`` gives the size of a label beside a disc of this
    radius, both in page units: it grows no faster than the radius."""

    def __init__(self, wanted: Sequence[Wanted], field: Field, size_of: Callable[[float], float]) -> None:
        self._wanted, self._field, self._size_of = wanted, field, size_of
        self._order = np.argsort(field.places[:, 0], kind="stable")
        #: (2, n) across and down, from left to right
        self._places, self._radii = field.places[self._order].T.copy(), field.radii[self._order]
        self._largest = float(field.radii.max(initial=0.0))
        self._dots, self._borders = (
            np.ascontiguousarray(dots[np.argsort(dots[:, 0], kind="stable")].T) for dots in (field.dots, field.borders)
        )
        self._number = {slot: number for number, slot in enumerate(field.sides)}
        self._scale = 1.0
        self._known: dict[tuple[int, int], list[Spot]] = {}
        self._shapes: dict[float, tuple[FloatArray, FloatArray, FloatArray]] = {}

    def begin(self, scale: float) -> None:
        """Go on to a scale, in page units for a layout unit."""
        self._scale = scale
        self._known.clear()
        self._shapes.clear()

    def of(self, number: int, wording: int) -> list[Spot]:
        """The spots where a label covers no disc and no text in this wording, best first: where it seems to belong to
        no other disc, crosses the fewest borders of frames, of these those on the fewest lines, of these that for which
        the layout kept room, or the usual one."""
        known = self._known.get((number, wording))
        if known is None:
            known = self._known[number, wording] = self._found(number, wording)
        return known

    def claims(self, number: int, wording: int, sides: Sequence[Slot]) -> FloatArray:
        """What a label claims of the plane on these sides, (m, 4)."""
        one = self._wanted[number]
        return np.concatenate(
            [
                self._rects(index, extent, [self._number[slot]])[0]
                for index, extent, slot in zip(one.members, one.wordings[wording], sides, strict=True)
            ]
        )

    def _found(self, number: int, wording: int) -> list[Spot]:
        one = self._wanted[number]
        if wording + 1 < len(one.wordings) and not self.of(number, wording + 1):
            return []  # where there is no room for less there is none for more
        sides = [(slot, slot.mirrored(self._field.level))[: len(one.members)] for slot in self._field.sides]
        options = [one.kept, *(each for each in sides if each != one.kept)] if one.kept else sides
        if one.outward is not None:
            options = [each for each in options if each[0].leads(one.outward)]
        rects: list[tuple[FloatArray, FloatArray]] = []
        free = np.ones(len(options), np.bool_)
        for place, own in enumerate(zip(one.members, one.wordings[wording], strict=True)):
            claims, letters = self._rects(*own, [self._number[option[place]] for option in options])
            free &= self._free(claims, own[0])
            rects.append((claims, letters))
        if len(rects) > 1:
            pairs = zip(*(claims.tolist() for claims, _ in rects), strict=True)
            free &= np.array([not meet(*pair) for pair in pairs])
        chosen = np.flatnonzero(free)
        if not len(chosen):
            return []
        bad = np.zeros((4, len(chosen)), np.int64)
        for (claims, letters), index in zip(rects, one.members, strict=True):
            covered, crossed = (self._on(dots, claims[chosen]) for dots in (self._dots, self._borders))
            bad += np.stack([self._misread(letters[chosen], index), crossed > 0, covered > 0, covered])
        found: list[Spot] = []
        for option, (misread, borders, lines, dots) in zip(chosen.tolist(), bad.T.tolist(), strict=True):
            claims = np.array([some[option] for some, _ in rects])
            elsewhere = bool(one.kept) and options[option] != one.kept
            found.append(Spot(options[option], claims, misread, borders, lines, dots, elsewhere))
        return sorted(found, key=lambda spot: spot.worth)

    def _rects(self, index: int, extent: Extent, slots: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """What a label claims, and what its letters cover, on each of these sides, (k, 4)."""
        radius = float(self._field.radii[index])
        if radius not in self._shapes:  # both grow with the width and the lines of the label alone
            page, size = radius * self._scale, self._size_of(radius * self._scale)
            shapes = [
                [[outline(slot, page, wide, size, lines) for slot in self._field.sides] for wide, lines in _GROWING]
                for outline in (Slot.claim, Slot.text)
            ]
            none, wider, higher = np.array(shapes).transpose(1, 0, 2, 3) / self._scale
            self._shapes[radius] = none, size * (wider - none), higher - none
        none, each, line = self._shapes[radius]
        width, lines = extent
        claims, letters = (none + width * each + (lines - 1) * line)[:, slots] + np.tile(self._field.places[index], 2)
        return claims, letters

    def _free(self, claims: FloatArray, index: int) -> npt.NDArray[np.bool_]:
        """Which of the claims (k, 4) of a neuron's label cover nothing."""
        left, top, right, bottom = self._field.extent
        across = beyond(self._field.extent, self._scale, self._field.reach) / self._scale
        down = BEYOND / self._scale
        low, high = np.array([left - across, top - down]), np.array([right + across, bottom + down])
        free = np.asarray((claims[:, :2] >= low).all(axis=1) & (claims[:, 2:] <= high).all(axis=1))
        free &= ~met(self._field.taken, claims).any(axis=1)
        near, away = self._away(claims, 0.0)
        free &= ~((away < self._radii[near] - 1e-9) & (self._order[near] != index)).any(axis=1)
        return free

    def _misread(self, letters: FloatArray, index: int) -> npt.NDArray[np.bool_]:
        """Which of these letters (k, 4) are nearer to another disc than to their own."""
        x0, y0, x1, y1 = (letters - np.tile(self._field.places[index], 2)).T
        own = np.hypot(np.maximum(x0, -x1).clip(0.0), np.maximum(y0, -y1).clip(0.0)) - self._field.radii[index]
        near, away = self._away(letters, float(own.max(initial=0.0)))
        closer = (away - self._radii[near] < own[:, None] - 1e-9) & (self._order[near] != index)
        result: npt.NDArray[np.bool_] = closer.any(axis=1)
        return result

    def _away(self, rects: FloatArray, reach: float) -> tuple[slice, FloatArray]:
        """The discs, from left to right, that may reach as near as this to one of the rectangles (k, 4), and how far
        from each their centres are, (k, n)."""
        x0, y0, x1, y1 = rects.T[:, :, None]
        reach += self._largest
        first, last = np.searchsorted(self._places[0], (float(x0.min()) - reach, float(x1.max()) + reach))
        near = slice(int(first), int(last))
        x, y = self._places[:, near]
        away: FloatArray = np.hypot(np.maximum(x0 - x, x - x1).clip(0.0), np.maximum(y0 - y, y - y1).clip(0.0))
        return near, away

    def _on(self, dots: FloatArray, rects: FloatArray) -> npt.NDArray[np.int64]:
        """How many of these points (2, n), which are sorted, each of the rectangles (k, 4) touches."""
        air = _LINE / self._scale
        x0, y0, x1, y1 = rects.T[:, :, None] + np.array([-air, -air, air, air])[:, None, None]
        first, last = np.searchsorted(dots[0], (float(x0.min()), float(x1.max())))
        x, y = dots[:, int(first) : int(last)]
        found: npt.NDArray[np.int64] = ((x >= x0) & (x < x1) & (y > y0) & (y < y1)).sum(axis=1)
        return found


def met(claims: FloatArray, others: FloatArray) -> npt.NDArray[np.bool_]:
    """Which of the claims (k, 4) each of others (m, 4) meets, (m, k)."""
    left, top, right, bottom = claims.T
    x0, y0, x1, y1 = others.T[:, :, None]
    result: npt.NDArray[np.bool_] = (left < x1) & (right > x0) & (top < y1) & (bottom > y0)
    return result
