"""Where the cells of a plan of the page stand: as close as what they hold and the streets between them allow.

In: parts as drawn, and which rows and columns they span. Out: a move for each. Columns of the page are straight: all of
one stand beside all of the next. Rows keep their neurons in order, but a frame takes room only from what stands above
and below it: the rows beside a high one are no farther apart. What has room to spare stands in the middle of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np

from neurovis_layouts.alike import Move, shifted_by
from neurovis_layouts.layered.drawing import Piece, brought
from neurovis_layouts.layered.parts import Part
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Rect, bounds, padded, sampled, shifted, snap, united
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

#: From where to where something reaches along an axis, and from the first centre of a neuron to the last.
_Extent: TypeAlias = tuple[float, ...]
#: Single neurons are never closer, from centre to centre.
_LEAST = 0.65


@dataclass(frozen=True, slots=True)
class Slot:
    """A cell in the engine's frame: which columns across and which rows along it spans, and the parts in it; two parts
    in one line are mirror images of each other."""

    across: range
    along: range
    lines: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True)
class _Room:
    """What something takes up around a point at 0: all of it, and the centres of its neurons."""

    whole: Rect
    centres: Rect

    def shifted(self, by: Point) -> _Room:
        return _Room(shifted(self.whole, by), shifted(self.centres, by))


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """What a part takes up around its anchor, reflected across an upright axis if ``flip``, and its anchor then."""

    room: _Room
    anchor: Point
    flip: bool


def footprint(piece: Piece, flip: bool) -> Footprint:
    """The footprint of a part as drawn."""
    anchor = _anchor(piece)
    return Footprint(_room(piece, anchor, flip), shifted_by((0.0, 0.0), flip).point(anchor), flip)


class PlanPlaces:
    """The slots of a page, and where the ``parts`` in them stand; ``page`` is how many columns across and rows along
    there are. ``even``: 0 is the middle across, and what is as far from it on either side stands alike. The same
    footprints are stacked once, as a page is tried with most of its parts as they were."""

    def __init__(
        self, problem: LayoutProblem, slots: Sequence[Slot], parts: Sequence[Part], page: tuple[int, int], even: bool
    ) -> None:
        self._slots = slots
        self._street = max(problem.neuron_spacing, _LEAST)
        self._streets = _streets(problem, slots, parts, self._street)
        spans = [(slot.across, slot.along) for slot in slots]
        rows = 1 if problem.direction in ("down", "up") else 0
        self._axes = [
            _Axis(axis, spans, page[axis], self._streets, axis == rows, even and axis == 0) for axis in (0, 1)
        ]
        self._stacks: dict[tuple[Footprint, ...], _Stack] = {}

    def moves(self, footprints: Sequence[Footprint]) -> dict[int, Move]:
        """How the first of each line of parts is moved."""
        stacks = [self._stack(slot, footprints) for slot in self._slots]
        rooms = [stack.room for stack in stacks]
        across, along = (axis.middles(rooms) for axis in self._axes)
        moves: dict[int, Move] = {}
        for slot, stack in zip(self._slots, stacks, strict=True):
            for k, (dx, dy) in stack.shifts.items():
                mx, my = footprints[k].anchor
                x, y = across[slot.across] + dx - mx, along[slot.along] + dy - my
                moves[k] = shifted_by((snap(x) + 0.0, snap(y)), footprints[k].flip)
        return moves

    def _stack(self, slot: Slot, footprints: Sequence[Footprint]) -> _Stack:
        own = tuple(footprints[line[0]] for line in slot.lines)
        if own not in self._stacks:
            self._stacks[own] = _stacked(slot, own, self._street)
        return self._stacks[own]


def _streets(problem: LayoutProblem, slots: Sequence[Slot], parts: Sequence[Part], street: float) -> FloatArray:
    """How far apart every two cells are at least: as neurons in a rank, but as ranks where neither is a frame and one
    holds several neurons, so that it is seen what they hold, or something leads from the one to the other, so that its
    arrow is seen."""
    slot_of = {k: number for number, slot in enumerate(slots) for line in slot.lines for k in line}
    owner = {m: slot_of[k] for k, part in enumerate(parts) for m in part.members if not part.framed}
    wide, held = max(street, problem.rank_spacing), np.zeros(len(slots))
    for slot in owner.values():
        held[slot] += 1
    both = (held[:, None] > 0) & (held > 0)
    streets = np.where(both & (held[:, None] + held > 2), wide, street)
    for edge in problem.edges:
        one, other = owner.get(edge.source, -1), owner.get(edge.target, -1)
        if min(one, other) >= 0 and one != other:
            streets[one, other] = streets[other, one] = wide
    return streets


@dataclass(frozen=True, slots=True)
class _Stack:
    """The room that the parts in a slot take, and where the first of each line stands."""

    room: _Room
    shifts: Mapping[int, Point]


def _stacked(slot: Slot, footprints: Sequence[Footprint], street: float) -> _Stack:
    """The parts in a slot, one line behind the other; the footprints are those of the first of each line."""
    found: dict[int, Point] = {}
    rooms: list[_Room] = []
    end = 0.0
    for line, own in zip(slot.lines, footprints, strict=True):
        room, x = own.room, 0.0
        if len(line) > 1:
            x = -street / 2 - room.whole[2]
            room = room.shifted((x, 0.0))
            room = _Room(
                *(united([rect, (-rect[2], rect[1], -rect[0], rect[3])]) for rect in (room.whole, room.centres))
            )
        y = end - room.whole[1] if rooms else 0.0
        rooms.append(room.shifted((0.0, y)))
        found[line[0]] = x, y
        end = rooms[-1].whole[3] + street
    both = _Room(united(room.whole for room in rooms), united(room.centres for room in rooms))
    up = -(both.whole[1] + both.whole[3]) / 2 if len(rooms) > 1 else 0.0
    return _Stack(both.shifted((0.0, up)), {k: (x, y + up) for k, (x, y) in found.items()})


def _room(piece: Piece, anchor: Point, flip: bool) -> _Room:
    """What a part takes up around its anchor: its frame, or where none is drawn discs, labels and routes, from which
    others keep off as neurons do from each other, from centre to centre."""
    drawing = piece.drawing
    centres, whole = bounds(drawing.places), piece.rect
    if not piece.framed:
        drawn = [point for route in drawing.routes.values() for point in sampled(route)]
        rects = [padded(centres, RADIUS), *drawing.labels, *(rect for _, rect in (*drawing.frames, *drawing.boxes))]
        whole = padded(united([*rects, bounds(drawn)] if drawn else rects), -RADIUS)
    move = brought(anchor, (0.0, 0.0), flip)
    return _Room(move.rect(whole), move.rect(centres))


def _anchor(piece: Piece) -> Point:
    """The point of a part that stands in the middle of its cell: the middle of its frame, or of its neurons where no
    frame is drawn."""
    if piece.framed:
        return piece.middle
    x0, y0, x1, y1 = bounds(piece.drawing.places)
    return (x0 + x1) / 2 if piece.drawing.axis is None else piece.drawing.axis, (y0 + y1) / 2


class _Axis:
    """The rows or the columns of a page: the least distances between them are those at which nothing comes closer than
    a street; of ``rows`` that have no column in common only centres keep off each other."""

    def __init__(
        self,
        axis: int,
        spans: Sequence[tuple[range, range]],
        count: int,
        streets: FloatArray,
        rows: bool,
        even: bool,
    ) -> None:
        self._axis, self._even = axis, even
        self._spans = [span[axis] for span in spans]
        # what stands below all is in a row behind these
        self._count = max(count, *(span.stop for span in self._spans))
        self._street = float(streets[0, 0])
        start, stop = np.array([[(s.start, s.stop) for s in span] for span in spans]).T
        #: pairs of slots of which one is before the other, how far apart they are at least, and whether all of the one
        #: keeps off all of the other
        self._one, self._two = np.nonzero(stop[axis][:, None] <= start[axis])
        self._between = streets[self._one, self._two]
        beside = (start[1 - axis][:, None] < stop[1 - axis]) & (start[1 - axis] < stop[1 - axis][:, None])
        self._whole = beside[self._one, self._two] if rows else np.ones(len(self._one), np.bool_)
        self._own = list(dict.fromkeys(self._spans))
        number = np.array([self._own.index(span) for span in self._spans])
        self._cell = number[self._one] * len(self._own) + number[self._two]
        self._known = cache(self._middles)

    def middles(self, rooms: Sequence[_Room]) -> dict[range, float]:
        """Where the middle of each span is, with this room in each slot: the mean of where it is with all as low, and
        with all as high, as can be. What is turned or reflected often takes as much along an axis as it did."""
        a = self._axis
        return self._known(tuple((*room.whole[a::2], *room.centres[a::2]) for room in rooms))

    def _middles(self, extents: tuple[_Extent, ...]) -> dict[range, float]:
        line = _Line(self._count, self._even)
        for i in range(self._count - 1):
            line.apart(range(i, i + 1), range(i + 1, i + 2), self._street)
        for span, (low, high, _, _) in zip(self._spans, extents, strict=True):
            line.reaching(span, -low, high)
        for one, other, far in self._least(extents):
            line.apart(one, other, far)
        return line.middles()

    def _least(self, extents: tuple[_Extent, ...]) -> list[tuple[range, range, float]]:
        """How far apart two spans are at least of which one is before the other."""
        low, high, first, last = np.array(extents).T
        one, two = self._one, self._two
        far = np.where(self._whole, high[one] - low[two], last[one] - first[two])
        least = np.full(len(self._own) ** 2, -np.inf)
        np.maximum.at(least, self._cell, far + self._between)
        known = np.flatnonzero(least > -np.inf).tolist()
        return [(self._own[at // len(self._own)], self._own[at % len(self._own)], float(least[at])) for at in known]


class _Line:
    """Spans of so many rows or columns, how far what stands in each reaches before its middle and behind it, and how
    far apart two are at least; ``even``: they are their own mirror image."""

    def __init__(self, count: int, even: bool) -> None:
        self._count, self._even = count, even
        self._ends = {range(i, i + 1): (0.0, 0.0) for i in range(count)}
        self._least: dict[tuple[range, range], float] = {}

    def apart(self, one: range, other: range, far: float) -> None:
        """One span is before another, at least so far."""
        image = _image(other, self._count), _image(one, self._count)
        for pair in [(one, other), image] if self._even else [(one, other)]:
            self._least[pair] = max(self._least.get(pair, 0.0), far)

    def reaching(self, span: range, before: float, behind: float) -> None:
        """What stands in a span reaches so far."""
        image = _image(span, self._count), behind, before
        for own, low, high in [(span, before, behind), image] if self._even else [(span, before, behind)]:
            known = self._ends.get(own, (0.0, 0.0))
            self._ends[own] = max(known[0], low), max(known[1], high)
        if len(span) > 1:
            self.apart(span[:1], span, 0.0)
            self.apart(span, span[-1:], 0.0)

    def middles(self) -> dict[range, float]:
        """Where the middle of each span is."""
        low = _reached({span: before for span, (before, _) in self._ends.items()}, self._least)
        back = {(b, a): far for (a, b), far in self._least.items()}
        high = _reached({span: behind for span, (_, behind) in self._ends.items()}, back)
        middle = {span: (low[span] - high[span]) / 2 for span in self._ends}
        if not self._even:
            return middle
        return {span: (at - middle[_image(span, self._count)]) / 2 for span, at in middle.items()}


def _image(span: range, count: int) -> range:
    return range(count - span.stop, count - span.start)


def _reached(first: dict[range, float], least: dict[tuple[range, range], float]) -> dict[range, float]:
    """How far each span is from the beginning at least."""
    found = dict(first)
    for _ in found:
        before = dict(found)
        for (one, other), far in least.items():
            found[other] = max(found[other], found[one] + far)
        if found == before:
            break
    return found
