"""Occupancy: what has its place, and the nearest free place for what has none.

In: frames, what is placed, and bodies (neurons that move together), each with the copies that follow from its place.
Out: the free place nearest to a wish: off all discs, its frame off those of others, nobody in a frame who does not
belong there, mirror images on their sides. All that is moved off something, by a pin or by an earlier layout, is moved
here; coordinates are those of the picture.

A place is sought around the wish in growing steps, first by the strictest rules (off the lines, with room between),
then, where no place near or far is free by these, by laxer ones, in the end only off other discs; and beyond all that
is drawn as the last resort.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain, takewhile
from types import MappingProxyType

from neurovis_layouts.alike import STAY, Move
from neurovis_spec.layout.frames import Frames, titled, untitled
from neurovis_spec.layout.geometry import Rect, bounds, distance, meet, padded, sampled, snap, united
from neurovis_spec.layout.model import RADIUS, Point, Route

#: Steps of the search and how many of them it goes: near first, then far, then beyond everything.
_REACHES = ((0.25, 4), (0.25, 16), (0.5, 32), (1.0, 64))
#: How far off the wish a place off all lines may be, how far off lines that is, and how far apart points on them are
#: looked at, of which there are so many at most.
_ASIDE, _OFF, _STEP, _MOST = 4.0, 0.5, 0.25, 50_000
#: How far off their wish more than two bodies are placed alike: looking for a place that all of them have farther off
#: takes their number times as long, and what is so far off is not seen to be alike.
_TOGETHER = 8.0
#: Sides of the cells in which centres and frames are looked up; a rectangle that covers more cells than this is near
#: everything.
_SMALL, _WIDE, _COUNTED = 1.0, 4.0, 4096
#: Discs that touch do not overlap, whatever rounding says.
_TOUCHING = 2 * RADIUS - 1e-9
#: The same, of coordinates that have been rounded to be written into a file.
_WRITTEN = 2 * RADIUS - 1e-6


@dataclass(frozen=True, slots=True)
class AxisSide:
    """The side of a mirror's axis, ``sign`` times the coordinate ``across``, that a neuron is on."""

    across: int
    axis: float
    sign: int


@dataclass(frozen=True, slots=True)
class Body:
    """Neurons that move together: offset by neuron from the anchor. ``frame`` (−1: none) is the number of the frame of
    which they are the neurons, ``rect`` where it is in relation to the anchor. ``move`` takes the first of its
    copies to this one."""

    offsets: tuple[tuple[int, Point], ...]
    frame: int = -1
    rect: Rect = (0.0, 0.0, 0.0, 0.0)
    move: Move = STAY

    @property
    def members(self) -> tuple[int, ...]:
        """Its neurons."""
        return tuple(neuron for neuron, _ in self.offsets)

    def spots(self, anchor: Point) -> Iterator[tuple[int, Point]]:
        """Where its neurons stand when the first copy's anchor is at ``anchor``."""
        for neuron, (dx, dy) in self.offsets:
            yield neuron, self.move.point((anchor[0] + dx, anchor[1] + dy))

    def framed(self, anchor: Point) -> Rect:
        """Where its frame is then; the title is on top in any case."""
        x0, y0, x1, y1 = untitled(self.rect)
        corners = [self.move.point((anchor[0] + x, anchor[1] + y)) for x, y in ((x0, y0), (x1, y1))]
        return titled(bounds(corners))


def lone(neuron: int, offset: Point = (0.0, 0.0)) -> Body:
    """A neuron that moves by itself."""
    return Body(((neuron, offset),))


@dataclass(frozen=True, slots=True)
class _Rules:
    """The distances that a free place keeps: ``clear`` between discs, ``margin`` from a neuron to a foreign frame,
    ``between`` two frames (only the first if not ``framed``); and whether it keeps off the lines that are drawn."""

    clear: float
    margin: float
    between: float
    framed: bool = True
    off_lines: bool = False


#: Off the lines and with ample room; with ample room; near others, so that a line passes between; however near; off
#: discs, whatever frame they are in.
_CLEAR = _Rules(0.75, 0.4, 0.5, off_lines=True)
_AMPLE = _Rules(0.75, 0.4, 0.5)
_NEAR = _Rules(_TOUCHING, RADIUS, 0.4)
_TIGHT = _Rules(_TOUCHING, 0.0, 0.0)
_DISCS = _Rules(0.75, 0.0, 0.0, framed=False)


@dataclass(frozen=True, slots=True)
class Wish:
    """Where bodies (one, and its copies) would like to stand, by the anchor of the first, and along which coordinates
    they may move off it. ``clear``: nothing else that has a wish is in the way there."""

    bodies: Sequence[Body]
    anchor: Point
    along: tuple[bool, bool] = (True, True)
    clear: bool = True


class Occupancy:
    """What is ``placed``, and the frames around it (``rects``, by number)."""

    def __init__(
        self,
        frames: Frames | None = None,
        placed: Mapping[int, Point] = MappingProxyType({}),
        rects: Sequence[Rect | None] = (),
        sides: Mapping[int, AxisSide] = MappingProxyType({}),
        routes: Iterable[Route] = (),
    ) -> None:
        self.placed: dict[int, Point] = {}
        self._frames, self._sides = frames, sides
        self._members = [] if frames is None else frames.members
        self._rects = list(rects) or [None] * len(self._members)
        self._discs, self._walls = _Cells(_SMALL), _Cells(_WIDE)
        self._bounds: Rect | None = None
        for neuron, point in placed.items():
            self._enter(neuron, point)
        for number, rect in enumerate(rects):
            if rect is not None:
                self._wall(number, rect)
        #: frames in which somebody foreign stands: they are not drawn
        self._open = {number for number, rect in enumerate(rects) if rect is not None and self._strangers(number, rect)}
        points = [point for route in routes for point in sampled(route, _STEP)]
        self._lines = _Cells(_SMALL)
        for number, point in enumerate(points if len(points) <= _MOST else ()):
            self._lines.add(number, (*point, *point))
        self._rules = (_CLEAR, _AMPLE, _TIGHT, _DISCS) if points else (_AMPLE, _TIGHT, _DISCS)

    def settle(self, wishes: Sequence[Wish]) -> list[int]:
        """Place bodies: those whose wish is free there, the others as near to it as possible. Returns the numbers of
        those that find no place."""
        stay = [wish.clear and self._free(wish.bodies, wish.anchor, _NEAR) for wish in wishes]
        for wish, stays in zip(wishes, stay, strict=True):
            if stays:
                self.enter(wish.bodies, wish.anchor)
        return [number for number, wish in enumerate(wishes) if not (stay[number] or self.put(wish))]

    def put(self, wish: Wish, stay: bool = False, in_row: bool = False) -> bool:
        """Place bodies as near to their wish as possible, with ``stay`` exactly there, if that is free, and say whether
        there is a place. They keep off the lines that are drawn, unless they continue a row (``in_row``)."""
        bodies = wish.bodies
        together = len(bodies) <= 2 or any(body.offsets[0][0] in self._sides for body in bodies)
        anchor = wish.anchor if stay and self.fits(bodies, wish.anchor) else self._found(wish, in_row, together)
        if anchor is None and len(bodies) > 1 and any(wish.along):
            placed = [self.put(replace(wish, bodies=(body,))) for body in bodies]
            return all(placed)
        if anchor is not None:
            self.enter(bodies, anchor)
        return anchor is not None

    def fits(self, bodies: Sequence[Body], anchor: Point, near: bool = False) -> bool:
        """Whether bodies can stand here, however near to others, or only ``near``, so that lines pass between."""
        return self._free(bodies, anchor, _NEAR if near else _TIGHT)

    @property
    def rects(self) -> Sequence[Rect | None]:
        """The frames as they are now, by number."""
        return self._rects

    def rect(self, number: int) -> Rect | None:
        """A frame as it is now; None for −1."""
        return self._rects[number] if number >= 0 else None

    def enter(self, bodies: Sequence[Body], anchor: Point) -> None:
        """Bodies have their place, whatever else is there."""
        for body in bodies:
            for number, rect in self._touched(body, anchor).items():
                before = self._rects[number]
                self._wall(number, rect if before is None else united([before, rect]))
        for body in bodies:
            for neuron, point in body.spots(anchor):
                self._enter(neuron, point)

    def _enter(self, neuron: int, point: Point) -> None:
        self.placed[neuron] = point
        self._discs.add(neuron, (*point, *point))
        self._bounds = united([(*point, *point), self._bounds or (*point, *point)])

    def _wall(self, number: int, rect: Rect) -> None:
        self._rects[number] = rect
        self._walls.add(number, rect)
        self._bounds = united([rect, self._bounds or rect])

    def _found(self, wish: Wish, in_row: bool, far: bool) -> Point | None:
        """The free place nearest to a wish; if not ``far``, only one with ample room near it."""
        beyond = list(self._beyond(wish)) if far else []
        for rules in self._rules if far else self._rules[:-2]:
            steps: Iterable[Point] = _steps(wish.along)
            if not far:
                steps = _upto(_TOGETHER, steps)
            if rules.off_lines:
                steps = () if in_row else _upto(_ASIDE, steps)
            places = ((wish.anchor[0] + x, wish.anchor[1] + y) for x, y in steps)
            for anchor in places if rules.off_lines else chain(places, (place for place, _ in beyond)):
                if self._free(wish.bodies, anchor, rules):
                    return anchor
        return self._outside(wish.bodies, *beyond[0]) if beyond else None

    def _outside(self, bodies: Sequence[Body], place: Point, way: Point) -> Point | None:
        """As far out from a place as is needed for the discs of all copies; these may stand on each other wherever they
        are."""
        (x, y), (dx, dy) = place, way
        x0, y0, x1, y1 = self._bounds or (x, y, x, y)
        points = ((x + step * dx, y + step * dy) for step in range(2 * math.ceil(x1 - x0 + y1 - y0) + 2))
        return next((point for point in points if self._free(bodies, point, _DISCS)), None)

    def _beyond(self, wish: Wish) -> Iterator[tuple[Point, Point]]:
        """Places beside everything, on the side of a mirror's axis that is the first body's, and behind everything;
        each with the way that leads farther out."""
        x0, y0, x1, y1 = wish.bodies[0].framed((0.0, 0.0))
        all_ = self._bounds or (0.0, 0.0, 0.0, 0.0)
        side = self._sides.get(wish.bodies[0].offsets[0][0])
        for across in (0, 1) if side is None else (side.across,):
            if not wish.along[across]:
                continue
            low, high, sign = all_[across], all_[across + 2], 1
            if side is not None:
                half = max(high - side.axis, side.axis - low)
                low, high, sign = side.axis - half, side.axis + half, side.sign
            ends = (x0, x1) if across == 0 else (y0, y1)
            line = snap(high + 1 - ends[0] if sign > 0 else low - 1 - ends[1])
            yield ((line, wish.anchor[1]), (sign, 0.0)) if across == 0 else ((wish.anchor[0], line), (0.0, sign))

    def _free(self, piece: Sequence[Body], anchor: Point, rules: _Rules) -> bool:
        """Whether all copies of a piece have room where they would stand."""
        inside = _Cells(_SMALL)
        points: list[tuple[int, Point]] = []
        for copy in piece:
            side = self._sides.get(copy.offsets[0][0])
            for neuron, point in copy.spots(anchor):
                if not self._discs.free(point, rules.clear) or not inside.free(point, rules.clear):
                    return False
                if rules.off_lines and copy.frame < 0 and not self._lines.free(point, _OFF):
                    return False
                if side is not None and (point[side.across] - side.axis) * side.sign <= 0:
                    return False
                side = None  # the others of an instance are where its first is
                points.append((neuron, point))
            for neuron, point in points[-len(copy.offsets) :]:
                inside.add(neuron, (*point, *point))
        if not rules.framed:
            return True
        return not any(self._enters(neuron, point, rules.margin) for neuron, point in points) and self._apart(
            self._grown(piece, anchor), points, rules
        )

    def _enters(self, neuron: int, point: Point, margin: float) -> bool:
        """Whether a neuron would stand in a foreign frame."""
        near = self._walls.near(padded((*point, *point), margin)) - self._open
        return any(neuron not in self._members[number] for number in near)

    def _grown(self, piece: Sequence[Body], anchor: Point) -> dict[int, Rect]:
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
            before, wider = self._rects[number], padded(rect, rules.margin)
            # who has been near the frame may be
            known = set() if before is None else self._strangers(number, padded(before, rules.margin))
            if not self._strangers(number, wider) <= known:
                return False
            if rules.off_lines and before is None and self._lines.near(wider):
                return False
            if any(n not in self._members[number] and meet((*p, *p), wider) for n, p in points):
                return False
            if not self._off_others(number, grown, rules):
                return False
        return True

    def _off_others(self, number: int, grown: Mapping[int, Rect], rules: _Rules) -> bool:
        """Whether a frame that is new or grows keeps off the others. Those that have been near each other may be; what
        lies on each other already does so no more than it did, or, where that cannot be helped, does."""
        rect, before = grown[number], self._rects[number]
        for other in (self._walls.near(padded(rect, rules.between)) | grown.keys()) - self._open - {number}:
            earlier = self._rects[other]
            theirs = grown.get(other) or earlier
            if theirs is None or not meet(rect, theirs, rules.between):
                continue
            if not self._members[number].isdisjoint(self._members[other]):
                continue
            if before is None or earlier is None or not meet(before, earlier, rules.between):
                return False
            shared = _shared(before, earlier)
            if _shared(rect, theirs) > shared and (rules.between or not shared):
                return False
        return True

    def _strangers(self, number: int, rect: Rect) -> set[int]:
        """The neurons in a rectangle that do not belong to this frame."""
        return self._discs.near(rect) - self._members[number]

    def _touched(self, copy: Body, anchor: Point) -> dict[int, Rect]:
        """The frames that hold neurons of a copy, and as much of each as these need."""
        frames, points = self._frames, list(copy.spots(anchor))
        if frames is None:
            return {}
        neuron, point = points[0]
        around = [n for n in reversed(frames.around.get(neuron, ())) if n < frames.instances]  # innermost first
        found: dict[int, Rect] = {}
        inner: Rect | None = None
        if copy.frame >= 0:
            inner = found[copy.frame] = copy.framed(anchor)
            around = around[around.index(copy.frame) + 1 :] if copy.frame in around else []
        for number in around:
            inner = found[number] = frames.single(number, point) if inner is None else frames.grown(number, inner)
        held = list(found.items())
        boxes = {n for i, _ in points for n in frames.around.get(i, ()) if n >= frames.instances} - {copy.frame}
        for box in sorted(boxes):
            own = frames.members[box]
            parts = [frames.single(box, p) for i, p in points if i in own]
            parts += [frames.grown(box, rect) for n, rect in held if frames.members[n] <= own]
            found[box] = united(parts)
        return found


def _shared(one: Rect, other: Rect) -> float:
    """The area that two rectangles have in common."""
    across, along = (min(one[k + 2], other[k + 2]) - max(one[k], other[k]) for k in (0, 1))
    return max(0.0, across) * max(0.0, along)


@cache
def _steps(along: tuple[bool, bool]) -> Sequence[Point]:
    """Steps from a wish, the nearest first, sideways before along: fine ones near it, coarse ones far off."""
    found: list[Point] = []
    done = -1.0
    for step, reach in _REACHES:
        steps = range(-reach, reach + 1)
        across, down = (steps if free else (0,) for free in along)
        far = (step * reach) ** 2
        ring = sorted((step * step * (i * i + 2 * j * j), abs(j), -i, -j) for i in across for j in down)
        found += [(-i * step, -j * step) for r, _, i, j in ring if done < r <= far]
        done = far
    return found


def _upto(far: float, steps: Iterable[Point]) -> Iterable[Point]:
    """The first of these steps, which are no longer than that."""
    return takewhile(lambda step: step[0] * step[0] + step[1] * step[1] <= far * far, steps)


def overlapping(where: Mapping[int, Point], pins: Mapping[int, Point]) -> set[int]:
    """The neurons that would stand on a pin, or on one before them that does not."""
    taken, found = _Cells(_SMALL), set[int]()
    for i, point in pins.items():
        taken.add(i, (*point, *point))
    for i, point in sorted(where.items()):
        if taken.free(point, _WRITTEN):
            taken.add(i, (*point, *point))
        else:
            found.add(i)
    return found


class _Cells:
    """Rectangles, and points, by number in square cells of this width, to look up what is near."""

    def __init__(self, width: float) -> None:
        self._width = width
        self._rects: dict[int, Rect] = {}
        self._cells: dict[tuple[int, int], set[int]] = {}
        #: those that cover more cells than are worth counting
        self._large: set[int] = set()

    def add(self, number: int, rect: Rect) -> None:
        """Add a rectangle, or the same grown."""
        self._rects[number] = rect
        cells = self._covered(rect)
        if cells is None:
            self._large.add(number)
        for cell in cells or ():
            self._cells.setdefault(cell, set()).add(number)

    def near(self, rect: Rect) -> set[int]:
        """Those that share more than an edge with a rectangle."""
        return {number for number in self._about(rect) if meet(self._rects[number], rect)}

    def free(self, point: Point, clear: float) -> bool:
        """Whether no point is closer than ``clear``."""
        about = self._about(padded((*point, *point), clear))
        return all(distance(point, self._rects[number][:2]) >= clear for number in about)

    def _about(self, rect: Rect) -> Iterable[int]:
        """Those that share a cell with a rectangle, and perhaps more."""
        cells = self._covered(rect)
        if cells is None:
            return self._rects
        return self._large.union(*(self._cells[cell] for cell in cells if cell in self._cells))

    def _covered(self, rect: Rect) -> list[tuple[int, int]] | None:
        """The cells that a rectangle covers; None where these are too many."""
        x0, y0, x1, y1 = (math.floor(value / self._width) for value in rect)
        if (x1 - x0 + 1) * (y1 - y0 + 1) > _COUNTED:
            return None
        return [(column, row) for column in range(x0, x1 + 1) for row in range(y0, y1 + 1)]
