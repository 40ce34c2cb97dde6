"""Occupancy: the discs and frames that have places, so that nothing else is put onto or into them.

In: bodies (neurons, and frames with what is in them) and where they stand. Out: whether another may stand somewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from neurovis_layouts.pins import CentreCells
from neurovis_spec.layout.geometry import Rect, bounds, meet, shifted
from neurovis_spec.layout.model import RADIUS, LayoutRefusalError, Point

#: How far what gives way keeps off other discs, and frames off frames, so that lines find a way between them.
_CLEAR, _BETWEEN = 0.75, 0.4

#: Centres are this far apart at least, but for rounding in the last bit.
_DISCS = 2 * RADIUS - 1e-9


@dataclass(frozen=True, slots=True)
class Body:
    """Neurons that move together, by their offsets; the frame around them, if they have one; where they would like to
    stand; ``level`` are those that keep their place along the direction."""

    members: tuple[int, ...]
    offsets: tuple[Point, ...]
    frame: Rect | None
    wish: Point
    pinned: bool = False
    level: bool = False


def _holds(rect: Rect, point: Point, by: float) -> bool:
    return rect[0] - by < point[0] < rect[2] + by and rect[1] - by < point[1] < rect[3] + by


class Ground:
    """What has been put somewhere."""

    def __init__(self) -> None:
        self._cells = CentreCells()
        self._points: list[Point] = []
        self._frames: list[tuple[Rect, Rect, Body]] = []
        self._bodies: list[tuple[Body, Point]] = []

    def put(self, body: Body, place: Point) -> None:
        """Add a body at a place."""
        points = [(place[0] + dx, place[1] + dy) for dx, dy in body.offsets]
        for point in points:
            self._cells.add(point)
            self._points.append(point)
        self._bodies.append((body, place))
        if body.frame is not None:
            self._frames.append((shifted(body.frame, place), bounds(points), body))

    def takes(self, body: Body, place: Point, clear: float = _CLEAR) -> bool:
        """Whether a body may stand here."""
        if body.frame is None:
            point = (place[0] + body.offsets[0][0], place[1] + body.offsets[0][1])
            return self._cells.free(point, clear) and not any(_holds(f, point, RADIUS) for f, _, _ in self._frames)
        own = shifted(body.frame, place)
        if any(meet(own, frame, _BETWEEN) for frame, _, _ in self._frames):
            return False
        return not any(_holds(own, point, RADIUS) for point in self._points)

    def crowding(self, body: Body, place: Point) -> tuple[float, float]:
        """How deep a body at this place would overlap frames (and, if it is a frame, lone discs), in all; and the same
        with the distances that they should keep added."""
        points = [
            (x + other.offsets[0][0], y + other.offsets[0][1]) for other, (x, y) in self._bodies if not other.frame
        ]
        own = bounds([(place[0] + body.offsets[0][0], place[1] + body.offsets[0][1])])
        if body.frame is not None:
            own = shifted(body.frame, place)
        rects = [frame for frame, _, _ in self._frames]
        gap = RADIUS if body.frame is None else _BETWEEN
        pairs = [(rect, gap) for rect in rects]
        pairs += [((*point, *point), RADIUS) for point in points if body.frame is not None]
        met = math.fsum(max(0.0, _depth(own, rect)) for rect, _ in pairs)
        return met, math.fsum(max(0.0, by + _depth(own, rect)) for rect, by in pairs)

    def refuse(self, names: Sequence[str], body: Body) -> None:
        """Raise LayoutRefusalError where a pinned body would stand in the frame of another, or that in its own."""
        points = [(body.wish[0] + dx, body.wish[1] + dy) for dx, dy in body.offsets]
        own = bounds(points) if body.frame is not None else None
        for _, tight, other in self._frames:
            for member, point in zip(body.members, points, strict=True):
                if _holds(tight, point, _DISCS):
                    raise _within(names[member], names[other.members[0]])
            if own is not None and meet(own, tight, _DISCS):
                raise _within(names[body.members[0]], names[other.members[0]])
        if own is None:
            return
        for other, place in self._bodies:
            for member, (dx, dy) in zip(other.members, other.offsets, strict=True):
                if _holds(own, (place[0] + dx, place[1] + dy), _DISCS):
                    raise _within(names[member], names[body.members[0]])


def _depth(one: Rect, other: Rect) -> float:
    """How far one would have to move off the other, negative where they are apart."""
    return min(one[2] - other[0], other[2] - one[0], one[3] - other[1], other[3] - one[1])


def _within(name: str, mate: str) -> LayoutRefusalError:
    return LayoutRefusalError(
        "pin-in-frame",
        f"pins put '{name}' into the frame that '{mate}' is in; nothing foreign may stand there",
        "move one of the pins",
        (name, mate),
    )
