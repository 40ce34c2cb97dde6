"""Titles of boxes: in the same place of all boxes of a picture, that in which the fewest lines cross them.

In: boxes in user units, what is in the way. Out: a Heading for each box, or None where there is no room for any. A
title that has no room in the place of the others stands elsewhere, in or beside its box, in several lines where that
helps: none is cut. Boxes of one name and size, as instances of a module have them, are alike, and so are the instances
themselves; elsewhere their titles stand in the same place or in its mirror image. Of the boxes that compute the same
all say it or none does: one that alone does not would seem to compute something else.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import BOX_WEIGHT, INSTANCE_WEIGHT, LINE, TITLE_INSET, TITLE_SIZE
from neurovis_spec.layout.model import Point
from neurovis_spec.scene import texts
from neurovis_spec.scene.boxes import Box
from neurovis_spec.scene.model import Text, Theme
from neurovis_spec.scene.obstacles import Obstacles

#: where nothing else helps a name gets as small as the last
_SIZE, _SMALLER = TITLE_SIZE, (10.0, 9.0)
#: how wide a title in lines is at most, of its box's width
_SHARES = (1.5, 1.0, 0.7, 0.5, 0.35)
#: in how many lines a title is at most, unless there is no room for whole words
_LINES = 3
#: instances are more than boxes
_WEIGHTS = {"box": BOX_WEIGHT, "instance": INSTANCE_WEIGHT}
#: more in the way than this, and there is no title
_TOO_MUCH = 10_000
#: how bad it is to stand in a frame that does not hold the box: worse than lines
_FOREIGN = 2_000
#: how much worse than the line of a frame it is to cover a connection
_CROSSED = 4


@dataclass(frozen=True, slots=True)
class Heading:
    """A title, as it is called and in its lines."""

    words: str
    lines: tuple[Text, ...]


@dataclass(frozen=True, slots=True)
class Titled:
    """A box to be titled: its frame, the room in which the title may stand, and the frames that do not hold the box, in
    which it would be taken for theirs."""

    box: Box
    rect: Rect
    room: Rect
    foreign: tuple[Rect, ...] = ()

    @property
    def computes(self) -> str:
        """What the title says besides the name."""
        return self.box.title.removeprefix(self.box.name)


def in_one_place(
    boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme, kept: Sequence[Rect] = ()
) -> dict[int, Heading]:
    """The titles, by number of their boxes, of one size and in the one place that has room for the most of them; of
    several that in which they cover least, rather within the frames and not too small. One that has no room there is in
    the mirror image of the place, as in the other half of a picture. None is on what is ``kept`` for others."""
    around = [obstacles.near(_grown(item)) for item in boxes]
    same: dict[str, list[int]] = {}
    for index, item in enumerate(boxes):
        same.setdefault(item.computes, []).append(index)
    best: tuple[int, int, dict[int, _Title]] = 0, 0, {}
    for closer, (size, inset, gap) in enumerate(_INSIDE):
        for row, slid in _PLACES:
            each, slot = _CLOSER * closer + (_BEYOND if row in _OUTSIDE else 0), _Slot(row, inset, gap, slid)
            found: dict[int, _Title] = {}
            less = 0
            for computes, members in same.items():
                taken = [*kept, *(title.taken for title in found.values())]
                some = {i: (boxes[i], around[i]) for i in members}
                worded = _in_slot(some, False, size, slot, taken)
                if computes:
                    short = _in_slot(some, True, size, slot, taken)
                    cost = _LESS * len(short)
                    (missing, hits), (fewer, lower) = _worth(worded), _worth(short)
                    if 0 < len(worded) < len(members) or (fewer, lower + cost) < (missing, hits):
                        worded, less = short, less + cost
                found.update(worded)
            missing, hits = _worth(found)
            best = min(best, (missing, hits + less + each * len(found), found), key=lambda worth: worth[:2])
    drawn = {i: _drawn(boxes[i], title, title.hits, obstacles, theme) for i, title in best[2].items()}
    return {i: heading for i, heading in drawn.items() if heading is not None}


def _in_slot(
    boxes: Mapping[int, tuple[Titled, Obstacles]], short: bool, size: float, slot: _Slot, kept: Sequence[Rect]
) -> dict[int, _Title]:
    """The titles that have room in this place of their boxes, or in its mirror image; ``short``, the names alone."""
    found: dict[int, _Title] = {}
    for i, (item, around) in boxes.items():
        taken = [*kept, *(title.taken for title in found.values())]
        said = _said(words := item.box.name if short else item.box.title, (words,), size, item.box.kind)
        for title in _at(item, said, slot, around, taken, _TOO_MUCH):
            if title.hits < _TOO_MUCH and title.taken[2] + slot.inset < item.rect[2] + 1.01:
                found[i] = title
                break
    return found


def elsewhere(
    boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme, unsaid: Collection[str] = ()
) -> list[Heading | None]:
    """Titles that have no room in one place, in the order of the boxes: inside, then just outside; the name alone where
    the whole of a title that says the same finds no room or is ``unsaid``. Where no place is free for all that are
    alike, those that would cover something find their own."""
    before, told = len(obstacles.texts()), {"", *unsaid}
    while True:
        result = _elsewhere(boxes, obstacles, theme, told)
        less = {item.computes for one, item in zip(result, boxes, strict=True) if one and one.words != item.box.title}
        if less <= told:
            return result
        told |= less
        obstacles.keep_texts(before)


def _elsewhere(
    boxes: Sequence[Titled], obstacles: Obstacles, theme: Theme, unsaid: Collection[str]
) -> list[Heading | None]:
    result: list[Heading | None] = [None] * len(boxes)
    for members in _alike(boxes):
        reach = {i: _grown(boxes[i]) for i in members}
        near = {i: tuple(other for other in boxes[i].foreign if meet(reach[i], other)) for i in members}
        alike = {i: (replace(boxes[i], foreign=near[i]), obstacles.near(reach[i])) for i in members}
        wordings = _WORDINGS[any(boxes[i].computes in unsaid for i in members) :]
        found = _found(list(alike.values()), wordings)
        if found is None:
            continue
        for i, title in sorted(zip(members, found, strict=True), key=lambda each: each[1].hits > 0):
            hits = title.hits + _TOO_MUCH * obstacles.text_hits(title.taken)
            own = _found([alike[i]], wordings) if hits else None
            if own is not None and own[0].hits < hits:
                title, hits = own[0], own[0].hits
            result[i] = _drawn(boxes[i], title, hits, obstacles, theme)
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
class _Said:
    """What a title says, the lines of that, how large these are, and how wide."""

    words: str
    lines: tuple[str, ...]
    size: float
    width: float


def _said(words: str, lines: Sequence[str], size: float, kind: str) -> _Said:
    """What a title says at the head of a box of this kind."""
    return _Said(words, tuple(lines), size, max(texts.width(line, size, _WEIGHTS[kind]) for line in lines))


@dataclass(frozen=True, slots=True)
class _Wording:
    """What titles say: all or the name alone, how large, and how much of the box's width their lines may be (0: any);
    whether words may be ``broken`` for that."""

    whole: bool
    size: float
    share: float = 0.0
    broken: bool = False

    def of(self, item: Titled) -> _Said | None:
        """The lines; None where they would be too many, or parts of words."""
        weight = _WEIGHTS[item.box.kind]
        room, across = item.room[2] - item.room[0], item.rect[2] - item.rect[0]
        words = item.box.title if self.whole else item.box.name
        most = self.share * min(room, across) if self.share else room
        said = _said(words, texts.wrapped(words, self.size, most, weight), self.size, item.box.kind)
        if not self.share or self.broken:
            return said
        narrow = max(texts.width(part, self.size, weight) for _, part in texts.parts_of(words)) > most
        return None if narrow or len(said.lines) > _LINES else said


#: best first: all, the name, the name in small; in lines; in as many as it takes
_WORDINGS = (
    _Wording(True, _SIZE),
    *(_Wording(False, size) for size in (_SIZE, *_SMALLER)),
    *(_Wording(False, size, share) for size in (_SIZE, _SMALLER[-1]) for share in _SHARES),
    *(_Wording(False, _SMALLER[-1], share, broken=True) for share in _SHARES[:3]),
)


@dataclass(frozen=True, slots=True)
class _Title:
    """What a title says, where its first baseline begins, what it covers there, and whether it stands in the mirror
    image of its place."""

    said: _Said
    start: Point
    taken: Rect
    hits: int
    over: bool


def _worth(titles: Mapping[int, _Title]) -> tuple[int, int]:
    return -len(titles), sum(title.hits + _OVER * title.over for title in titles.values())


def _found(boxes: Sequence[tuple[Titled, Obstacles]], wordings: Sequence[_Wording]) -> list[_Title] | None:
    """Titles worded alike in the place that covers least; None where there is no place for all."""
    best: tuple[float, list[_Title] | None] = math.inf, None
    tried: set[tuple[_Said, ...]] = set()
    for wording in wordings:
        said = tuple(one for item, _ in boxes if (one := wording.of(item)) is not None)
        if len(said) < len(boxes) or said in tried:
            continue
        tried.add(said)
        for slot in _SLOTS:
            titles: list[_Title] = []
            hits = 0
            for (item, nearby), one in zip(boxes, said, strict=True):
                places = _at(item, one, slot, nearby, (), _FOREIGN)
                if not places or hits + min(place.hits for place in places) >= best[0]:
                    break
                titles.append(min(places, key=lambda place: place.hits))
                hits += titles[-1].hits
            if len(titles) == len(boxes):
                best = hits, titles
            if best[0] == 0:
                return best[1]
    return best[1]


def _drawn(item: Titled, title: _Title, hits: int, obstacles: Obstacles, theme: Theme) -> Heading | None:
    """The title where it has room; lines that cross it keep away from its letters."""
    if hits >= _TOO_MUCH:
        return None
    obstacles.add_text(title.taken)
    halo, weight, (x, y), size = theme.box_fill if hits else "", _WEIGHTS[item.box.kind], title.start, title.said.size
    lines = (
        Text((x, y + row * LINE * size), words, size, theme.muted, weight=weight, halo=halo)
        for row, words in enumerate(title.said.lines)
    )
    return Heading(title.said.words, tuple(lines))


@dataclass(frozen=True, slots=True)
class _Slot:
    """Where titles stand by their frames: the row (inside at the top and at the bottom, above, below), how far from the
    side, in units and in widths of the title, and from the line above or below; and how far from one corner to the
    other, from 0 to 1."""

    row: int
    inset: float
    gap: float
    slid: float = 0.0
    aside: float = 0.0


_GAP, _CLOSE, _BESIDE = 5.0, 5.0, -1.0
#: how large all titles are in one place, and how far from the sides of their frames
_INSIDE = ((_SIZE, TITLE_INSET, _GAP), *((size, _CLOSE, 3.0) for size in (_SIZE, *_SMALLER)))
_ROWS = 4
#: where titles stand in one place: in which row, and how far across their frames
_PLACES = tuple((row, slid) for row in range(_ROWS) for slid in (0.0, 1.0, 0.5))
_OUTSIDE = (2, 3)
#: what it costs a title to stand outside of its frame, or to be the name alone: less than a line that it covers; and to
#: be closer to it or smaller, by one step
_BEYOND, _LESS, _CLOSER = 10, 10, 1
#: what it costs a title to stand in the mirror image of the place: so much that only one that has no room there does
_OVER = 1_000
#: how far letters reach above and below their baseline, by their size
_HEIGHT, _DEPTH = 0.78, 0.22
#: elsewhere, from the best on: the corners, flush with the frame outside, along the rows, beside the frame, then close
#: to it in small steps from the edge, for what is narrow or crossed by many lines
_SLOTS = (
    *(_Slot(row, TITLE_INSET, _GAP) for row in range(_ROWS)),
    *(_Slot(row, 2.0, _GAP) for row in _OUTSIDE),
    *(_Slot(row, TITLE_INSET, _GAP, step / 12) for row in range(_ROWS) for step in range(1, 7)),
    *(_Slot(row, -8.0, _GAP, 0.0, _BESIDE) for row in (0, 1)),
    *(_Slot(row, _CLOSE, 3.0, step / 22) for row in (0, 1) for step in range(12)),
    *(_Slot(row, -_CLOSE, 3.0, step / 22, -0.5) for row in _OUTSIDE for step in range(12)),
)


def _at(
    item: Titled, said: _Said, slot: _Slot, obstacles: Obstacles, kept: Sequence[Rect], foreign: int
) -> list[_Title]:
    """A title in a slot and in its mirror image, as far as there is room; none along a row of a frame that is not as
    wide. What is ``kept`` is too much to cover, a ``foreign`` frame as much as is said."""
    (x0, y0, x1, y1), (low, top, high, bottom) = item.rect, item.room
    size, width, more = said.size, said.width, (len(said.lines) - 1) * LINE * said.size
    rise, drop = slot.gap + _HEIGHT * size, slot.gap + _DEPTH * size
    y = (y0 + rise, y1 - drop - more, y0 - drop - more, y1 + rise)[slot.row]
    inset = slot.inset + slot.aside * width
    left, right = x0 + inset, x1 - inset - width
    if (slot.slid and right < left) or y - _HEIGHT * size < top or y + more + _DEPTH * size > bottom:
        return []
    found: list[_Title] = []
    for over, start in ((False, left + slot.slid * (right - left)), (True, right - slot.slid * (right - left))):
        x = min(max(start, low), high - width)
        if x != start and slot.aside == _BESIDE:
            continue
        taken = (x - 1, y - _HEIGHT * size, x + width + 1, y + more + _DEPTH * size)
        hits = obstacles.hits(taken, _CROSSED) + _TOO_MUCH * sum(meet(taken, other) for other in kept)
        hits += foreign * sum(meet(taken, other) for other in item.foreign)
        found.append(_Title(said, (x, y), taken, hits, over))
    return found


def _grown(item: Titled) -> Rect:
    """Where a title of a box may be, and what is near it."""
    (x0, y0, x1, y1), width = item.rect, texts.width(item.box.title, _SIZE, _WEIGHTS[item.box.kind]) + 30
    return x0 - width, y0 - 60, x1 + width, y1 + 60


def outline(rect: Rect, step: float = 4.0) -> FloatArray:
    """Points on the line of a box, so far apart."""
    x0, y0, x1, y1 = rect
    across, down = np.arange(x0, x1, step), np.arange(y0, y1, step)
    return np.concatenate(
        [np.column_stack([across, np.full(len(across), y)]) for y in (y0, y1)]
        + [np.column_stack([np.full(len(down), x), down]) for x in (x0, x1)]
    )
