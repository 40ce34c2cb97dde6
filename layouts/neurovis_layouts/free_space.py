"""Free space: finds a place for something new among what has its place already.

In: frames, what is placed, and pieces, each with the copies that follow from its place. Out: the free place nearest to
a wish: off all discs, its frame off those of others, nobody foreign in any, mirror images on their sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, takewhile

from neurovis_layouts.pins import CentreCells
from neurovis_spec.layout.frames import Frames, titled, untitled
from neurovis_spec.layout.geometry import Rect, bounds, meet, padded, sampled, snap, united
from neurovis_spec.layout.model import RADIUS, Point, Route

#: Steps of the search and how many of them it goes: near first, then far, then beyond everything.
_REACHES = ((0.25, 4), (0.25, 16), (0.5, 32), (1.0, 64))
#: How far off the wish a place off all lines may be, how far off lines that is, and how far apart points on them are
#: looked at, of which there are so many at most.
_ASIDE, _OFF, _STEP, _MOST = 4.0, 0.5, 0.25, 50_000
_CELL = 4.0


@dataclass(frozen=True, slots=True)
class Side:
    """The side of a mirror's axis, ``sign`` times the coordinate ``across``, that a neuron is on."""

    across: int
    axis: float
    sign: int


@dataclass(frozen=True, slots=True)
class Copy:
    """A set of new neurons placed as a piece: offset by neuron from the anchor. ``instance`` (−1: none) is what they
    are the neurons of, ``rect`` its frame in relation to the anchor. ``flip`` says which coordinates are reflected
    where the first of its kind is not; ``origin`` is what anchors of the first are measured from."""

    offsets: tuple[tuple[int, Point], ...]
    instance: int = -1
    rect: Rect = (0.0, 0.0, 0.0, 0.0)
    flip: Point = (1.0, 1.0)
    origin: Point = (0.0, 0.0)

    @property
    def members(self) -> tuple[int, ...]:
        """Its neurons."""
        return tuple(neuron for neuron, _ in self.offsets)

    def spots(self, anchor: Point) -> Iterator[tuple[int, Point]]:
        """Where its neurons stand when the first copy's anchor is at ``anchor``."""
        for neuron, (dx, dy) in self.offsets:
            yield neuron, self._moved((anchor[0] + dx, anchor[1] + dy))

    def frame(self, anchor: Point) -> Rect:
        """Where its frame is then; the title is on top in any case."""
        x0, y0, x1, y1 = untitled(self.rect)
        corners = [self._moved((anchor[0] + x, anchor[1] + y)) for x, y in ((x0, y0), (x1, y1))]
        return titled(bounds(corners))

    def _moved(self, point: Point) -> Point:
        return self.origin[0] + self.flip[0] * point[0], self.origin[1] + self.flip[1] * point[1]


@dataclass(frozen=True, slots=True)
class _Rules:
    """The distances that a free place keeps: ``clear`` between discs, ``margin`` from a neuron to a foreign frame,
    ``between`` two frames (only the first if not ``framed``); and whether it keeps off the lines that are drawn."""

    clear: float
    margin: float
    between: float
    framed: bool = True
    off_lines: bool = False


_CLEAR = _Rules(0.75, 0.4, 0.5, off_lines=True)
_AMPLE = _Rules(0.75, 0.4, 0.5)
_TIGHT = _Rules(2 * RADIUS, 0.0, 0.0)
_DISCS = _Rules(0.75, 0.0, 0.0, framed=False)


def _aside(step: Point) -> bool:
    """Whether a step from a wish is one to which lines are worth keeping off."""
    return step[0] * step[0] + step[1] * step[1] <= _ASIDE * _ASIDE


class Room:
    """What is placed, and the frames around it (``rects``, by number)."""

    def __init__(
        self,
        frames: Frames,
        placed: Mapping[int, Point],
        rects: Sequence[Rect | None],
        sides: Mapping[int, Side],
        routes: Iterable[Route] = (),
    ) -> None:
        self.placed = dict(placed)
        self._frames, self._rects, self._sides = frames, list(rects), sides
        self._cells, self._discs, self._walls = CentreCells(), _Field(), _Field()
        self._bounds: Rect | None = None
        for neuron, point in placed.items():
            self._enter(neuron, point)
        for number, rect in enumerate(rects):
            if rect is not None:
                self._wall(number, rect)
        #: frames in which somebody foreign stands: they are not drawn
        self._open = {
            number
            for number, rect in enumerate(rects)
            if rect is not None and next(self._strangers(number, rect), None) is not None
        }
        self._steps: list[Point] = []
        points = [point for route in routes for point in sampled(route, _STEP)]
        self._lines = CentreCells()
        for point in points if len(points) <= _MOST else ():
            self._lines.add(point)

    def put(self, piece: Sequence[Copy], wish: Point, stay: bool = False, in_row: bool = False) -> None:
        """Place a piece, all of its copies, as near to the wish as possible; with ``stay`` exactly there, if
        that is free. It keeps off the lines that are drawn, unless it continues a row (``in_row``)."""
        anchor = self._found(piece, wish, stay, in_row)
        for copy in piece:
            for number, rect in self._touched(copy, anchor).items():
                before = self._rects[number]
                self._wall(number, rect if before is None else united([before, rect]))
        for copy in piece:
            for neuron, point in copy.spots(anchor):
                self._enter(neuron, point)

    def _enter(self, neuron: int, point: Point) -> None:
        self.placed[neuron] = point
        self._cells.add(point)
        self._discs.add(neuron, (*point, *point))
        self._bounds = united([(*point, *point), self._bounds or (*point, *point)])

    def _wall(self, number: int, rect: Rect) -> None:
        self._rects[number] = rect
        self._walls.add(number, rect)
        self._bounds = united([rect, self._bounds or rect])

    def _found(self, piece: Sequence[Copy], wish: Point, stay: bool, in_row: bool) -> Point:
        if stay and self._free(piece, wish, _TIGHT):
            return wish
        near = [] if in_row else [(wish[0] + x, wish[1] + y) for x, y in takewhile(_aside, self._around())]
        beyond = list(self._beyond(piece[0], wish))
        for rules in (_CLEAR, _AMPLE, _TIGHT, _DISCS):
            around = ((wish[0] + x, wish[1] + y) for x, y in self._around())
            for anchor in near if rules.off_lines else chain(around, beyond):
                if self._free(piece, anchor, rules):
                    return anchor
        # copies that cannot all be free together stand as far out as is needed for their discs
        x, y = beyond[0]
        while not self._free(piece, (x, y), _DISCS):
            x, y = x + 1, y + 1
        return x, y

    def _around(self) -> Iterator[Point]:
        """Steps from a wish, the nearest first, sideways before along: fine ones near it, coarse ones far off."""
        if not self._steps:
            done = -1.0
            for step, reach in _REACHES:
                steps = range(-reach, reach + 1)
                far = (step * reach) ** 2
                ring = [(step * step * (i * i + 2 * j * j), abs(j), -i, -j) for i in steps for j in steps]
                self._steps += [(-i * step, -j * step) for r, _, i, j in sorted(ring) if done < r <= far]
                done = far
        return iter(self._steps)

    def _beyond(self, copy: Copy, wish: Point) -> Iterator[Point]:
        """Places beside everything, on the side of a mirror's axis that is the copy's, and behind everything."""
        x0, y0, x1, y1 = copy.frame((0.0, 0.0))
        all_ = self._bounds or (0.0, 0.0, 0.0, 0.0)
        side = self._sides.get(copy.offsets[0][0])
        for across in (0, 1) if side is None else (side.across,):
            low, high, sign = all_[across], all_[across + 2], 1
            if side is not None:
                half = max(high - side.axis, side.axis - low)
                low, high, sign = side.axis - half, side.axis + half, side.sign
            ends = (x0, x1) if across == 0 else (y0, y1)
            line = snap(high + 1 - ends[0] if sign > 0 else low - 1 - ends[1])
            yield (line, wish[1]) if across == 0 else (wish[0], line)

    def _free(self, piece: Sequence[Copy], anchor: Point, rules: _Rules) -> bool:
        """Whether all copies of a piece have room where they would stand."""
        inside = CentreCells()
        points: list[tuple[int, Point]] = []
        for copy in piece:
            side = self._sides.get(copy.offsets[0][0])
            for neuron, point in copy.spots(anchor):
                if not self._cells.free(point, rules.clear) or not inside.free(point, rules.clear):
                    return False
                if rules.off_lines and copy.instance < 0 and not self._lines.free(point, _OFF):
                    return False
                if side is not None and (point[side.across] - side.axis) * side.sign <= 0:
                    return False
                side = None  # the others of an instance are where its first is
                points.append((neuron, point))
            for _, point in points[-len(copy.offsets) :]:
                inside.add(point)
        if not rules.framed:
            return True
        return not any(self._enters(neuron, point, rules.margin) for neuron, point in points) and self._apart(
            self._grown(piece, anchor), points, rules
        )

    def _enters(self, neuron: int, point: Point, margin: float) -> bool:
        """Whether a neuron would stand in a foreign frame."""
        spot = padded((*point, *point), margin)
        return any(
            number not in self._open and neuron not in self._frames.members[number] and self._meets(number, spot)
            for number in self._walls.near(spot)
        )

    def _meets(self, number: int, rect: Rect, gap: float = 0.0) -> bool:
        own = self._rects[number]
        return own is not None and meet(own, rect, gap)

    def _grown(self, piece: Sequence[Copy], anchor: Point) -> dict[int, Rect]:
        """The frames that are new or grow, by number."""
        grown: dict[int, Rect] = {}
        for copy in piece:
            for number, rect in self._touched(copy, anchor).items():
                before = grown.get(number) or self._rects[number]
                if before is None or united([before, rect]) != before:
                    grown[number] = rect if before is None else united([before, rect])
        return grown

    def _apart(self, grown: Mapping[int, Rect], points: Sequence[tuple[int, Point]], rules: _Rules) -> bool:
        """Whether frames that are new or grow hold no foreign neuron, and keep off other frames."""
        for number, rect in grown.items():
            if number in self._open:
                continue
            wider = padded(rect, rules.margin)
            if next(self._strangers(number, wider), None) is not None:
                return False
            if any(n not in self._frames.members[number] and meet((*p, *p), wider) for n, p in points):
                return False
            others = (self._walls.near(padded(rect, rules.between)) | grown.keys()) - self._open - {number}
            for other in others:
                theirs = grown.get(other) or self._rects[other]
                if theirs is None or not meet(rect, theirs, rules.between) or self._frames.related(number, other):
                    continue
                # those that have been near each other may be, those that have met already cannot be helped
                before = self._rects[number]
                near = before is not None and self._meets(other, before, rules.between)
                if not near or (meet(rect, theirs) and not self._meets(other, before or rect)):
                    return False
        return True

    def _strangers(self, number: int, rect: Rect) -> Iterator[int]:
        """The neurons in a rectangle that do not belong to this frame."""
        for neuron in self._discs.near(rect):
            x, y = self.placed[neuron]
            if neuron not in self._frames.members[number] and meet((x, y, x, y), rect):
                yield neuron

    def _touched(self, copy: Copy, anchor: Point) -> dict[int, Rect]:
        """The frames that hold neurons of a copy, and as much of each as these need."""
        frames, points = self._frames, list(copy.spots(anchor))
        neuron, point = points[0]
        around = [n for n in reversed(frames.around.get(neuron, ())) if n < frames.instances]  # innermost first
        found: dict[int, Rect] = {}
        inner: Rect | None = None
        if copy.instance >= 0:
            inner = found[copy.instance] = copy.frame(anchor)
            around = around[around.index(copy.instance) + 1 :]
        for number in around:
            inner = found[number] = frames.single(number, point) if inner is None else frames.grown(number, inner)
        held = list(found.items())
        boxes = {n for i, _ in points for n in frames.around.get(i, ()) if n >= frames.instances}
        for box in sorted(boxes):
            own = frames.members[box]
            parts = [frames.single(box, p) for i, p in points if i in own]
            parts += [frames.grown(box, rect) for n, rect in held if frames.members[n] <= own]
            found[box] = united(parts)
        return found


class _Field:
    """Rectangles by cell, to look up what is near."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], set[int]] = {}

    def add(self, number: int, rect: Rect) -> None:
        """Add a rectangle."""
        for cell in _cells(rect):
            self._cells.setdefault(cell, set()).add(number)

    def near(self, rect: Rect) -> set[int]:
        """Those that share a cell with a rectangle."""
        return {number for cell in _cells(rect) for number in self._cells.get(cell, ())}


def _cells(rect: Rect) -> Iterator[tuple[int, int]]:
    x0, y0, x1, y1 = (math.floor(value / _CELL) for value in rect)
    for column in range(x0, x1 + 1):
        for row in range(y0, y1 + 1):
            yield column, row
