"""Beside: which labels stand beside their discs, and on which side.

In: labels by importance, discs and lines in layout units, the scale. Out: a Slot for each label that has room. A
label that is shown at a scale is shown at every larger one, on the same side, unless a title takes its place there:
the scales from the smallest on are gone through in fixed steps, and at each of them labels find room among those that
are there already. What a label claims, from its disc on, gets smaller in layout units from step to step, so that
those that are there stay free of each other (active ranges: Been, Daiches and Yap 2006).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import beside

#: The smallest scale (page units for a layout unit) at which there are labels, and the steps from it on.
_FIRST, _STEP = 6.0, 1.25
#: Between a label and the middle of a line that does not touch it, in page units.
_LINE = 2.5
#: How far labels may reach beyond the discs at the rim, in page units; where more is asked for, so much and a share of
#: the width.
BEYOND, _ALWAYS, _SHARE = 20.0, 50.0, 0.3


@dataclass(frozen=True, slots=True)
class Slot:
    """A side of a disc: −1, 0 or 1 ``across`` (left, middle, right) and ``down`` (above, level, below)."""

    across: int
    down: int

    def text(self, radius: float, width: float, size: float) -> Rect:
        """What the letters cover, from the centre of the disc."""
        return beside(self.across, self.down, radius, width, size)

    def claim(self, radius: float, width: float, size: float) -> Rect:
        """The same with a little air, and all between it and the disc."""
        x0, y0, x1, y1 = self.text(radius, width, size)
        x0, y0, x1, y1 = x0 - 2, y0 - 1, x1 + 2, y1 + 1
        inner = radius if not (self.across and self.down) else 0.75 * radius
        if self.across:
            x0, x1 = (inner, x1) if self.across > 0 else (x0, -inner)
        if self.down:
            y0, y1 = (inner, y1) if self.down > 0 else (y0, -inner)
        return x0, y0, x1, y1

    def mirrored(self, level: bool) -> Slot:
        """The side on the mirror image of the disc: top and bottom change places where signals run across."""
        return Slot(self.across, -self.down) if level else Slot(-self.across, self.down)


#: Where labels stand, the best side first; signals run down, or across.
_SIDES = tuple(Slot(*side) for side in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, -1), (-1, -1), (1, 1), (-1, 1)))
_LEVEL = (*_SIDES[2:4], *_SIDES[:2], *_SIDES[4:])


@dataclass(frozen=True, slots=True)
class Wanted:
    """Neurons that have a label all or none, with mirrored sides; ``widths`` of the labels, in sizes; the scale from
    which these stand on their discs."""

    members: tuple[int, ...]
    widths: tuple[float, ...]
    until: float = np.inf
    #: where the layout kept room for them
    kept: tuple[Slot, ...] = ()


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


def beyond(extent: Rect, scale: float, wanted: float) -> float:
    """How far labels may reach beyond the extent on either side, at a scale: as far as wanted, but most of the picture
    is for the network."""
    return max(BEYOND, min(wanted, _ALWAYS + _SHARE * scale * (extent[2] - extent[0])))


def placed(wanted: Sequence[Wanted], field: Field, size_of: Callable[[float], float], scale: float) -> dict[int, Slot]:
    """The sides on which labels stand at this scale, by neuron. ``wanted`` are in the order of their importance;
    ``size_of`` gives the size of a label beside a disc of this radius, both in page units: it grows no faster than
    the radius."""
    ground = _Ground(field)
    found: dict[int, tuple[Slot, float]] = {}
    at = _FIRST
    while at <= scale:
        ground.begin(at, size_of, _without(found, wanted, at))
        for one in wanted:
            if one.until > at and one.members[0] not in found:
                ground.choose(one, found)
        at *= _STEP
    ground.begin(scale, size_of, _without(found, wanted, scale))
    for one in wanted:  # what stands in the room of others leaves it
        if one.kept and one.until > scale:
            ground.choose(one, found)
    for one in wanted:  # now that all are there, each may find a better side
        if one.members[0] in found:
            ground.choose(one, found)
    return {index: slot for index, (slot, _) in found.items()}


def _without(
    found: dict[int, tuple[Slot, float]], wanted: Sequence[Wanted], scale: float
) -> dict[int, tuple[Slot, float]]:
    """Those found, without those that stand on their discs from this scale on."""
    for one in wanted:
        if one.until <= scale:
            for index in one.members:
                found.pop(index, None)
    return found


class _Ground:
    """Discs, lines and claims at one scale after the other; all in layout units."""

    def __init__(self, field: Field) -> None:
        self._field = field
        self._order = np.argsort(field.places[:, 0], kind="stable")
        self._places, self._radii = field.places[self._order], field.radii[self._order]
        self._largest = float(field.radii.max(initial=0.0))
        #: (2, n) across and down, from left to right
        self._dots, self._borders = (
            np.ascontiguousarray(dots[np.argsort(dots[:, 0], kind="stable")].T) for dots in (field.dots, field.borders)
        )
        self._xs = self._places[:, 0].copy()
        self._where, self._each = field.places.tolist(), field.radii.tolist()
        self._scale = 1.0
        self._size_of: Callable[[float], float] = float
        self._across = BEYOND
        #: what labels claim, a row a neuron; what is not claimed is beyond everything
        self._claims = np.full((len(field.places), 4), np.inf)

    def begin(self, scale: float, size_of: Callable[[float], float], found: dict[int, tuple[Slot, float]]) -> None:
        """Go on to a larger scale, at which these labels are there."""
        self._scale, self._size_of = scale, size_of
        self._across = beyond(self._field.extent, scale, self._field.reach)
        self._claims[:] = np.inf
        for index, (slot, width) in found.items():
            self._claims[index] = self.claim(index, width, slot)

    def choose(self, one: Wanted, found: dict[int, tuple[Slot, float]]) -> None:
        """Put the labels of these neurons on their best free side, if there is one."""
        members = list(one.members)
        before = self._claims[members].copy()
        self._claims[members] = np.inf
        sides = self._best(one)
        if sides is None:
            self._claims[members] = before
            return
        for index, width, side in zip(one.members, one.widths, sides, strict=False):
            found[index] = side, width
            self._claims[index] = self.claim(index, width, side)

    def claim(self, index: int, width: float, slot: Slot) -> Rect:
        """What a label claims of the plane."""
        radius = self._each[index] * self._scale
        size, (x, y) = self._size_of(radius), self._where[index]
        x0, y0, x1, y1 = (side / self._scale for side in slot.claim(radius, width * size, size))
        return x + x0, y + y0, x + x1, y + y1

    def _best(self, one: Wanted) -> tuple[Slot, ...] | None:
        """The free sides on which labels cross the fewest borders of frames, of these those on the fewest lines, of
        these that for which the layout kept room, or the best; None where none are free."""
        best: tuple[tuple[int, int], tuple[Slot, ...]] | None = None
        usual = _LEVEL if self._field.level else _SIDES
        mirrored = ((slot, slot.mirrored(self._field.level)) for slot in usual)
        for sides in (*((one.kept,) if one.kept else ()), *mirrored):
            if not self._may(one, sides):
                continue
            claims = self._all(one, sides)
            cost = (
                sum(self._on(self._borders, claim) > 0 for claim in claims),
                sum(self._on(self._dots, claim) for claim in claims),
            )
            if best is None or cost < best[0]:
                best = cost, sides
            if cost == (0, 0):
                break
        return None if best is None else best[1]

    def _all(self, one: Wanted, sides: Sequence[Slot]) -> list[Rect]:
        return [self.claim(*own) for own in zip(one.members, one.widths, sides, strict=False)]

    def _may(self, one: Wanted, sides: Sequence[Slot]) -> bool:
        """Whether labels may stand on these sides of their discs."""
        claims = self._all(one, sides)
        if not all(self._free(claim, index) for claim, index in zip(claims, one.members, strict=True)):
            return False
        return len(claims) < 2 or not meet(claims[0], claims[1])

    def _free(self, claim: Rect, index: int) -> bool:
        (x0, y0, x1, y1), (left, top, right, bottom) = claim, self._field.extent
        across, down = (reach / self._scale for reach in (self._across, BEYOND))
        if x0 < left - across or x1 > right + across or y0 < top - down or y1 > bottom + down:
            return False
        if _meeting(self._claims, claim) or _meeting(self._field.taken, claim):
            return False
        first, last = np.searchsorted(self._xs, (x0 - self._largest, x1 + self._largest))
        near = slice(int(first), int(last))
        x, y = self._places[near].T
        away = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0), np.maximum(np.maximum(y0 - y, y - y1), 0))
        hit = (away < self._radii[near] - 1e-9) & (self._order[near] != index)
        return not hit.any()

    def _on(self, dots: FloatArray, claim: Rect) -> int:
        """How many of these points (2, n), which are sorted, a label touches."""
        air = _LINE / self._scale
        x0, y0, x1, y1 = claim[0] - air, claim[1] - air, claim[2] + air, claim[3] + air
        first, last = np.searchsorted(dots[0], (x0, x1))
        heights = dots[1, int(first) : int(last)]
        return int(np.count_nonzero((heights > y0) & (heights < y1)))


def _meeting(claims: FloatArray, claim: Rect) -> bool:
    """Whether any of the claims (k, 4) meets another."""
    left, top, right, bottom = claims.T
    return bool(((left < claim[2]) & (right > claim[0]) & (top < claim[3]) & (bottom > claim[1])).any())
