"""Where the cells of a plan of the page stand: as close as what they hold and the streets between them allow.

In: parts as drawn, and which rows and columns they span. Out: a move for each. Columns of the page are straight: all of
one stand beside all of the next. Rows keep their neurons in order, but a frame takes room only from what stands above
and below it: the rows beside a high one are no farther apart. What has room to spare stands in the middle of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.alike import Move, shifted_by
from neurovis_layouts.layered.drawing import Piece, brought
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Rect, bounds, padded, sampled, shifted, snap, united
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

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


def placed(
    problem: LayoutProblem,
    slots: Sequence[Slot],
    page: tuple[int, int],
    pieces: Sequence[Piece],
    flips: Sequence[bool],
    even: bool,
) -> dict[int, Move]:
    """How the first of each line of parts is moved; ``page`` is how many columns across and rows along there are.
    ``even``: 0 is the middle across, and what is as far from it on either side stands alike."""
    street = max(problem.neuron_spacing, _LEAST)
    rooms: list[_Room] = []
    shifts: list[dict[int, Point]] = []
    for slot in slots:
        room, own = _stacked(slot, pieces, flips, street)
        rooms.append(room)
        shifts.append(own)
    spans = [(slot.across, slot.along) for slot in slots]
    streets = _streets(problem, slots, pieces, street)
    rows = 1 if problem.direction in ("down", "up") else 0
    at = [_axis(axis, spans, rooms, page[axis], streets, axis == rows, even and axis == 0) for axis in (0, 1)]
    moves: dict[int, Move] = {}
    for slot, own in zip(slots, shifts, strict=True):
        for k, (dx, dy) in own.items():
            mx, my = shifted_by((0.0, 0.0), flips[k]).point(_anchor(pieces[k]))
            x, y = at[0][slot.across] + dx - mx, at[1][slot.along] + dy - my
            moves[k] = shifted_by((snap(x) + 0.0, snap(y)), flips[k])
    return moves


def _streets(problem: LayoutProblem, slots: Sequence[Slot], pieces: Sequence[Piece], street: float) -> FloatArray:
    """How far apart every two cells are at least: as neurons in a rank, but as ranks where neither is a frame and one
    holds several neurons, so that it is seen what they hold, or something leads from the one to the other, so that its
    arrow is seen."""
    slot_of = {k: number for number, slot in enumerate(slots) for line in slot.lines for k in line}
    owner = {m: slot_of[k] for k, piece in enumerate(pieces) for m in piece.part.members if not piece.framed}
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


def _stacked(
    slot: Slot, pieces: Sequence[Piece], flips: Sequence[bool], street: float
) -> tuple[_Room, dict[int, Point]]:
    """The room that the parts in a slot take, one line behind the other, and where the first of each line stands."""
    found: dict[int, Point] = {}
    rooms: list[_Room] = []
    end = 0.0
    for line in slot.lines:
        room, x = _room(pieces[line[0]], flips[line[0]]), 0.0
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
    return both.shifted((0.0, up)), {k: (x, y + up) for k, (x, y) in found.items()}


def _room(piece: Piece, flip: bool) -> _Room:
    """What a part takes up around its anchor: its frame, or where none is drawn discs, labels and routes, from which
    others keep off as neurons do from each other, from centre to centre."""
    drawing = piece.drawing
    centres, whole = bounds(drawing.places), piece.rect
    if not piece.framed:
        drawn = [point for route in drawing.routes.values() for point in sampled(route)]
        rects = [padded(centres, RADIUS), *drawing.labels, *(rect for _, rect in (*drawing.frames, *drawing.boxes))]
        whole = padded(united([*rects, bounds(drawn)] if drawn else rects), -RADIUS)
    move = brought(_anchor(piece), (0.0, 0.0), flip)
    return _Room(move.rect(whole), move.rect(centres))


def _anchor(piece: Piece) -> Point:
    """The point of a part that stands in the middle of its cell: the middle of its frame, or of its neurons where no
    frame is drawn."""
    if piece.framed:
        return piece.middle
    x0, y0, x1, y1 = bounds(piece.drawing.places)
    return (x0 + x1) / 2 if piece.drawing.axis is None else piece.drawing.axis, (y0 + y1) / 2


def _axis(
    axis: int,
    spans: Sequence[tuple[range, range]],
    rooms: Sequence[_Room],
    count: int,
    streets: FloatArray,
    rows: bool,
    even: bool,
) -> dict[range, float]:
    """Where the middle of each span of rows or columns is: the mean of where it is with all as low, and with all as
    high, as can be. The least distances between them are those at which nothing comes closer than a street; of ``rows``
    that have no column in common only centres keep off each other."""
    count = max(count, *(span[axis].stop for span in spans))  # what stands below all is in a row behind these
    line = _Line(count, even)
    for i in range(count - 1):
        line.apart(range(i, i + 1), range(i + 1, i + 2), float(streets[0, 0]))
    for span, room in zip(spans, rooms, strict=True):
        line.reaching(span[axis], -room.whole[axis], room.whole[axis + 2])
    for (one, other), far in _least(axis, spans, rooms, streets, rows).items():
        line.apart(one, other, far)
    return line.middles()


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


def _least(
    axis: int, spans: Sequence[tuple[range, range]], rooms: Sequence[_Room], streets: FloatArray, rows: bool
) -> dict[tuple[range, range], float]:
    """How far apart two spans are at least of which one is before the other."""
    own = list(dict.fromkeys(span[axis] for span in spans))
    number = np.array([own.index(span[axis]) for span in spans])
    start, stop = np.array([[(s.start, s.stop) for s in span] for span in spans]).T
    (low, high), (first, last) = (
        np.array([(rect[axis], rect[axis + 2]) for rect in rects]).T
        for rects in ([room.whole for room in rooms], [room.centres for room in rooms])
    )
    far = high[:, None] - low
    if rows:
        other = 1 - axis
        beside = (start[other][:, None] < stop[other]) & (start[other] < stop[other][:, None])
        far = np.where(beside, far, last[:, None] - first)
    one, two = np.nonzero(stop[axis][:, None] <= start[axis])
    least = np.full((len(own), len(own)), -np.inf)
    np.maximum.at(least, (number[one], number[two]), (far + streets)[one, two])
    return {(own[a], own[b]): float(least[a, b]) for a, b in np.argwhere(least > -np.inf).tolist()}


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
