"""Titles of boxes: in the same place of all boxes of a picture, that in which the fewest lines cross them.

In: boxes in user units, what is in the way. Out: a Text for each box, or None where there is no room for any. A title
that has no room in the place of the others stands elsewhere, in or beside its box. Boxes of one name and size, as
instances of a module have them, are alike, and so are the instances themselves; their titles are worded alike, and
elsewhere stand in the same place or in its mirror image.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import BOX_WEIGHT, INSTANCE_WEIGHT, TITLE_INSET, TITLE_SIZE
from neurovis_spec.layout.model import Point
from neurovis_spec.scene import texts
from neurovis_spec.scene.boxes import Box
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

#: where nothing else helps a name gets as small as the last
_SIZE, _SMALLER = TITLE_SIZE, (10.0, 9.0)
#: instances are more than boxes
_WEIGHTS = {"box": BOX_WEIGHT, "instance": INSTANCE_WEIGHT}
#: more in the way than this, and there is no title
_TOO_MUCH = 10_000
#: how bad it is to stand in a frame that does not hold the box: worse than lines
_FOREIGN = 2_000
#: how much worse than the line of a frame it is to cover a connection
_CROSSED = 4


@dataclass(frozen=True, slots=True)
class Titled:
    """A box to be titled: its frame, the room in which the title may stand, and the frames that do not hold the box, in
    which it would be taken for theirs."""

    box: Box
    rect: Rect
    room: Rect
    foreign: tuple[Rect, ...] = ()


def in_one_place(
    boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme, kept: Sequence[Rect] = ()
) -> dict[int, Text]:
    """The titles, by number of their boxes, of one size and in the one place that has room for the most of them; of
    several that in which they cover least, rather within the frames and not too small. None is on what is ``kept`` for
    others."""
    around = [obstacles.near(_grown(item, _WEIGHTS[item.box.kind])) for item in boxes]
    best: tuple[int, int, dict[int, _Title]] | None = None
    for closer, inside in enumerate(_INSIDE):
        for at in _PLACES:
            each = _CLOSER * closer + (_BEYOND if at[1] in _OUTSIDE else 0)
            found: dict[int, _Title] = {}
            for members in _alike(boxes):
                taken = [*kept, *(title.place.taken for title in found.values())]
                wordings: list[dict[int, _Title]] = []
                for whole in (True, False):
                    worded = {i: _in_place(boxes[i], whole, inside, at, around[i], taken) for i in members}
                    wordings.append({i: title for i, title in worded.items() if title is not None})
                chosen: dict[int, _Title] = min(wordings, key=_worth)
                found.update(chosen)
            missing, hits = _worth(found)
            if best is None or (missing, hits + each * len(found)) < best[:2]:
                best = missing, hits + each * len(found), found
    result: dict[int, Text] = {}
    for index, title in best[2].items() if best else ():
        text = _drawn(title, title.place.hits, _WEIGHTS[boxes[index].box.kind], obstacles, theme)
        if text is not None:
            result[index] = text
    return result


def elsewhere(boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme) -> list[Text | None]:
    """Titles that have no room in one place, in the order of the boxes: inside, then just outside; the name alone
    where the whole finds no room, or as much of the name as finds it."""
    result: list[Text | None] = [None] * len(boxes)
    for members in _alike(boxes):
        for index, text in zip(members, _together([boxes[i] for i in members], obstacles, theme), strict=True):
            result[index] = text
    return result


def _alike(boxes: Sequence[Titled]) -> list[list[int]]:
    """Boxes that are alike, by their places."""
    alike: dict[object, list[int]] = {}
    for index, item in enumerate(boxes):
        x0, y0, x1, y1 = item.rect
        name = item.box.name if item.box.kind == "box" else ""
        key = (item.box.kind, name, len(item.box.members), round(x1 - x0), round(y1 - y0))
        alike.setdefault(key, []).append(index)
    return list(alike.values())


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


@dataclass(frozen=True, slots=True)
class _Title:
    """What a title says, how large, and where."""

    text: str
    size: float
    place: _Place


def _worth(titles: Mapping[int, _Title]) -> tuple[int, int]:
    return -len(titles), sum(title.place.hits for title in titles.values())


def _in_place(
    item: Titled,
    whole: bool,
    inside: tuple[float, Point],
    at: tuple[float, int],
    obstacles: Obstacles,
    taken: Sequence[Rect],
) -> _Title | None:
    """A title in one of the places; None where a disc or a text is in the way, the frame is not as wide, or there is no
    room beyond it."""
    (size, inset), weight, (x0, y0, x1, y1) = inside, _WEIGHTS[item.box.kind], item.rect
    text = item.box.title if whole else item.box.name
    width = texts.width(text, size, weight)
    if width > x1 - x0 - 2 * inset[0] + 1e-6:
        return None
    x = x0 + inset[0] + at[0] * (x1 - x0 - 2 * inset[0] - width)
    y = _baseline(y0, y1, inset[1], size)[at[1]]
    rect = (x - 1, y - _HEIGHT * size, x + width + 1, y + _DEPTH * size)
    if rect[1] < item.room[1] or rect[3] > item.room[3]:
        return None
    hits = obstacles.hits(rect, _CROSSED)
    hits += _TOO_MUCH * sum(meet(rect, other) for other in (*taken, *item.foreign))
    return _Title(text, size, _Place((x, y), rect, hits)) if hits < _TOO_MUCH else None


def _baseline(top: float, bottom: float, gap: float, size: float) -> tuple[float, ...]:
    """The baseline of a title inside its frame at the top and at the bottom, above and below it."""
    rise, drop = gap + _HEIGHT * size, gap + _DEPTH * size
    return top + rise, bottom - drop, top - drop, bottom + rise


def _together(boxes: list[Titled], obstacles: Obstacles, theme: Theme) -> list[Text | None]:
    """The titles of boxes that are alike; where no place is free for all, those that would cover something find their
    own."""
    weight = _WEIGHTS[boxes[0].box.kind]
    reach = [_grown(item, weight) for item in boxes]
    around = [obstacles.near(rect) for rect in reach]
    boxes = [
        replace(item, foreign=tuple(other for other in item.foreign if meet(rect, other)))
        for item, rect in zip(boxes, reach, strict=True)
    ]
    found = _found(boxes, around, weight)
    if found is None:
        return [None] * len(boxes)
    result: list[Text | None] = [None] * len(boxes)
    for index, title in sorted(enumerate(found), key=lambda item: item[1].place.hits > 0):
        hits = title.place.hits + _TOO_MUCH * obstacles.text_hits(title.place.taken)
        own = _found([boxes[index]], [around[index]], weight) if hits else None
        if own is not None and own[0].place.hits < hits:
            title, hits = own[0], own[0].place.hits
        result[index] = _drawn(title, hits, weight, obstacles, theme)
    return result


def _found(boxes: Sequence[Titled], around: Sequence[Obstacles], weight: int) -> list[_Title] | None:
    """Titles worded alike in the place that covers least; None where there is no place for all."""
    best: tuple[int, list[_Title]] | None = None
    tried: set[tuple[float, tuple[str, ...]]] = set()
    for wording in _WORDINGS:
        said = tuple(wording.of(item, weight) for item in boxes)
        if not all(said) or (wording.size, said) in tried:
            continue
        tried.add((wording.size, said))
        widths = [texts.width(text, wording.size, weight) for text in said]
        for slot in range(_SLOTS):
            places: list[_Place] = []
            hits = 0
            for item, width, nearby in zip(boxes, widths, around, strict=True):
                place = _best(item, slot, width, wording.size, nearby)
                if place is None or (best is not None and hits + place.hits >= best[0]):
                    break
                places.append(place)
                hits += place.hits
            if len(places) == len(boxes):
                best = hits, [_Title(text, wording.size, at) for text, at in zip(said, places, strict=True)]
            if best is not None and best[0] == 0:
                return best[1]
    return None if best is None else best[1]


def _drawn(title: _Title, hits: int, weight: int, obstacles: Obstacles, theme: Theme) -> Text | None:
    """The title where it has room; lines that cross it keep away from its letters."""
    if hits >= _TOO_MUCH:
        return None
    obstacles.add_text(title.place.taken)
    halo = theme.box_fill if hits else ""
    return Text(title.place.start, title.text, title.size, theme.muted, weight=weight, halo=halo)


_CLOSE = 5.0
#: how large all titles are in one place, and how far from the sides of their frames
_INSIDE: tuple[tuple[float, Point], ...] = (
    (_SIZE, (TITLE_INSET, 5.0)),
    (_SIZE, (_CLOSE, 2.0)),
    *((size, (_CLOSE, 2.0)) for size in _SMALLER),
)
#: where titles stand in one place: how far across their frames, from 0 to 1, and in which of the rows ``_baseline`` has
_PLACES = tuple((across, row) for row in range(4) for across in (0.0, 1.0, 0.5))
_OUTSIDE = (2, 3)
#: what it costs a title to stand outside of its frame: less than a line that it covers; and to be closer to it or
#: smaller, by one step
_BEYOND, _CLOSER = 10, 1
#: how far letters reach above and below their baseline, by their size
_HEIGHT, _DEPTH = 0.78, 0.22
#: rows: inside at the top and at the bottom, above, below
_ROWS = 4
#: how far a title slides along a row, as shares of the way from one corner to the other
_SLIDES = (1, 2, 3, 4, 5, 6)
_FARTHER = _ROWS + 2 + _ROWS * len(_SLIDES) + 2
#: then ``_CLOSE`` to the frame, in steps from the edge, for what is narrow or crossed by many lines
_CLOSER_STEPS = 12
_SLOTS = _FARTHER + _ROWS * _CLOSER_STEPS


def _starts(rect: Rect, width: float, size: float, slot: int) -> tuple[Point, ...]:
    """Starts of the baseline in a place, and in its mirror image; slots count from the best on."""
    x0, y0, x1, y1 = rect
    if slot >= _FARTHER:
        row, place = divmod(slot - _FARTHER, _CLOSER_STEPS)
        y = (y0 + 3 + _HEIGHT * size, y1 - 3 - _DEPTH * size, y0 - 5, y1 + 3 + _HEIGHT * size)[row]
        inset = _CLOSE if row < 2 else -_CLOSE - 0.5 * width  # outside, beyond the corners
        left, right = x0 + inset, x1 - inset - width
        slid = 0.5 * (right - left) * place / (_CLOSER_STEPS - 1)
        return ((right - slid, y), (left + slid, y)) if right > left else ()
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
    beside = _FARTHER - 2 <= slot < _FARTHER
    for x, y in _starts(item.rect, width, size, slot):
        if beside and not x0 <= x <= x1 - width:
            continue
        x = min(max(x, x0), x1 - width)
        taken = (x - 2, y - size, x + width + 2, y + 0.3 * size)
        if slot >= _FARTHER:
            taken = (x - 1, y - _HEIGHT * size, x + width + 1, y + _DEPTH * size)
        if taken[1] < y0 or taken[3] > y1:
            continue
        hits = obstacles.hits(taken, _CROSSED)
        hits += _FOREIGN * sum(meet(taken, other) for other in item.foreign)
        if best is None or hits < best.hits:
            best = _Place((x, y), taken, hits)
    return best


def _grown(item: Titled, weight: int) -> Rect:
    """Where a title of a box may be, and what is near it."""
    (x0, y0, x1, y1), width = item.rect, texts.width(item.box.title, _SIZE, weight) + 30
    return x0 - width, y0 - 40, x1 + width, y1 + 40


def outline(rect: Rect, step: float = 4.0) -> FloatArray:
    """Points on the line of a box, so far apart."""
    x0, y0, x1, y1 = rect
    across, down = np.arange(x0, x1, step), np.arange(y0, y1, step)
    return np.concatenate(
        [np.column_stack([across, np.full(len(across), y)]) for y in (y0, y1)]
        + [np.column_stack([np.full(len(down), x), down]) for x in (x0, x1)]
    )
