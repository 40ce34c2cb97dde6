"""Titles of boxes: where no line crosses them, and for boxes that are alike in the same place.

In: boxes in user units, what is in the way. Out: a Text for each box, or None where there is no room for any. Boxes of
one name and size, as instances of a module have them, are alike, and so are the instances themselves; their titles are
worded alike, and stand in the same place or in its mirror image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.scene import texts
from neurovis_spec.scene.boxes import Box
from neurovis_spec.scene.geometry import FloatArray, Point, Rect, overlap
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

#: where nothing else helps a name gets as small as the last
_SIZE, _SMALLER = 11.5, (10.0, 9.0)
#: instances are more than boxes
_WEIGHTS = {"box": 400, "instance": 600}
#: more in the way than this, and there is no title
_TOO_MUCH = 10_000
#: how bad it is to stand in a frame that does not hold the box: worse than lines
_FOREIGN = 2_000


@dataclass(frozen=True, slots=True)
class Titled:
    """A box to be titled: its frame, the room in which the title may stand, and the frames that do not hold the box, in
    which it would be taken for theirs."""

    box: Box
    rect: Rect
    room: Rect
    foreign: tuple[Rect, ...] = ()


def titles_of(boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme) -> list[Text | None]:
    """The titles, in the order of the boxes: first inside the corners, then just outside; the name alone where the
    whole finds no room, or as much of the name as finds it."""
    alike: dict[object, list[int]] = {}
    for index, item in enumerate(boxes):
        x0, y0, x1, y1 = item.rect
        name = item.box.name if item.box.kind == "box" else ""
        key = (item.box.kind, name, len(item.box.members), round(x1 - x0), round(y1 - y0))
        alike.setdefault(key, []).append(index)
    result: list[Text | None] = [None] * len(boxes)
    for members in alike.values():
        for index, text in zip(members, _together([boxes[i] for i in members], obstacles, theme), strict=True):
            result[index] = text
    return result


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a title of one box can stand, and what it would cover there."""

    start: Point
    taken: Rect
    hits: int


@dataclass(frozen=True, slots=True)
class _Wording:
    """What titles say: all or the name alone, how large, and how much of the box's width they may be (0: any)."""

    whole: bool
    size: float
    share: float = 0.0

    def of(self, item: Titled, weight: int) -> str:
        """The text; '' where it would be too short to mean anything."""
        room, across = item.room[2] - item.room[0], item.rect[2] - item.rect[0]
        words = item.box.title if self.whole else item.box.name
        text = texts.shorten(words, self.size, self.share * min(room, across) if self.share else room, weight)
        return text if len(text) > 3 or text == words else ""


#: best first: all, the name, the name in small, the beginning of the name
_WORDINGS = (
    _Wording(True, _SIZE),
    *(_Wording(False, size) for size in (_SIZE, *_SMALLER)),
    *(_Wording(False, _SIZE, share) for share in (1, 0.7, 0.5, 0.35)),
)


def _together(boxes: list[Titled], obstacles: Obstacles, theme: Theme) -> list[Text | None]:
    """The titles of boxes that are alike."""
    weight = _WEIGHTS[boxes[0].box.kind]
    around = [obstacles.near(_grown(item, weight)) for item in boxes]
    best: tuple[int, float, list[str], list[_Place]] | None = None
    for wording in _WORDINGS:
        said = [wording.of(item, weight) for item in boxes]
        widths = [texts.width(text, wording.size, weight) for text in said]
        for slot in range(_SLOTS) if all(said) else ():
            found = [
                _best(item, slot, width, wording.size, nearby)
                for item, width, nearby in zip(boxes, widths, around, strict=True)
            ]
            places = [place for place in found if place is not None]
            hits = sum(place.hits for place in places)
            if len(places) == len(boxes) and (best is None or hits < best[0]):
                best = (hits, wording.size, said, places)
            if best is not None and best[0] == 0:
                return _drawn(*best[1:], weight, obstacles, theme)
    return [None] * len(boxes) if best is None else _drawn(*best[1:], weight, obstacles, theme)


def _drawn(
    size: float, said: list[str], places: list[_Place], weight: int, obstacles: Obstacles, theme: Theme
) -> list[Text | None]:
    """The titles where they have room; lines that cross them keep away from their letters."""
    result: list[Text | None] = []
    for text, place in zip(said, places, strict=True):
        if place.hits < _TOO_MUCH:
            obstacles.add_text(place.taken)
            halo = theme.box_fill if place.hits else ""
            result.append(Text(place.start, text, size, theme.muted, weight=weight, halo=halo))
        else:
            result.append(None)
    return result


#: rows: inside at the top and at the bottom, above, below
_ROWS = 4
#: how far a title slides along a row, as shares of the way from one corner to the other
_SLIDES = (1, 2, 3, 4, 5, 6)
_SLOTS = _ROWS + 2 + _ROWS * len(_SLIDES) + 2


def _starts(rect: Rect, width: float, slot: int) -> tuple[Point, ...]:
    """Starts of the baseline in a place, and in its mirror image; slots count from the best on."""
    x0, y0, x1, y1 = rect
    rows = (y0 + 14, y1 - 6, y0 - 6, y1 + 15)
    left, right = x0 + 10, x1 - 10 - width
    if slot < _ROWS:  # the corners
        return ((left, rows[slot]), (right, rows[slot])) if right > left else ((left, rows[slot]),)
    slot -= _ROWS
    if slot < 2:  # flush with the frame, outside
        return (x0 + 2, rows[2 + slot]), (x1 - 2 - width, rows[2 + slot])
    slot -= 2
    if slot < _ROWS * len(_SLIDES):
        row, slide = divmod(slot, len(_SLIDES))
        step = (right - left) * _SLIDES[slide] / 12
        return ((left + step, rows[row]), (right - step, rows[row])) if right > left else ()
    y = (y0 + 13, y1 - 5)[slot - _ROWS * len(_SLIDES)]  # beside the frame
    return (x0 - 8 - width, y), (x1 + 8, y)


def _best(item: Titled, slot: int, width: float, size: float, obstacles: Obstacles) -> _Place | None:
    """The better of a place and its mirror image; None where neither lies in the room."""
    best: _Place | None = None
    x0, y0, x1, y1 = item.room
    beside = slot >= _SLOTS - 2
    for x, y in _starts(item.rect, width, slot):
        if beside and not x0 <= x <= x1 - width:
            continue
        x = min(max(x, x0), x1 - width)
        taken = (x - 2, y - size, x + width + 2, y + 0.3 * size)
        if taken[1] < y0 or taken[3] > y1:
            continue
        hits = obstacles.hits(taken) + _FOREIGN * sum(overlap(taken, other) for other in item.foreign)
        if best is None or hits < best.hits:
            best = _Place((x, y), taken, hits)
    return best


def _grown(item: Titled, weight: int) -> Rect:
    """Where a title of a box may be, and what is near it."""
    (x0, y0, x1, y1), width = item.rect, texts.width(item.box.title, _SIZE, weight) + 30
    return x0 - width, y0 - 40, x1 + width, y1 + 40


def outline(rect: Rect) -> FloatArray:
    """Points on the line of a box, in user units."""
    x0, y0, x1, y1 = rect
    across, down = np.arange(x0, x1, 4.0), np.arange(y0, y1, 4.0)
    return np.concatenate(
        [np.column_stack([across, np.full(len(across), y)]) for y in (y0, y1)]
        + [np.column_stack([np.full(len(down), x), down]) for x in (x0, x1)]
    )
