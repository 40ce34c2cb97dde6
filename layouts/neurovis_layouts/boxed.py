"""Boxed: every box drawn together, and nothing foreign in its frame.

In: where an engine that places neurons anywhere has put them. Out: places at which the frame of each box holds its
neurons alone, as far as pins allow: boxes are moved off each other as wholes, and who stands in a foreign frame leaves
it. So it is for boxes within boxes; boxes that share some of their neurons move as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_layouts.apart import apart
from neurovis_layouts.frame import turned
from neurovis_layouts.symmetry import Symmetry
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.frames import BOX_ACROSS, BOX_DOWN, BOX_FRAME, PAD, PAD_LABEL, TITLE
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.labels import BOX_WEIGHT, instance_titles, title_room
from neurovis_spec.layout.model import RADIUS, LayoutProblem

#: Half of what is free between two frames: one line of a title fits.
_GAP = TITLE / 2
#: More boxes than this nobody could tell apart.
_MOST_BOXES = 1000
#: Steps in which frames push each other off; after so many of them the whole grows a little with each.
_ROUNDS, _PATIENCE, _GROWTH = 400, 60, 1.02
#: So often at most neurons leave foreign frames and are then kept off each other, which may push some of them back; who
#: moves less than this has settled.
_TURNS, _SETTLED = 40, 0.01
#: From centres to the line of a box, and of an instance with its title.
_LINE: Rect = (-BOX_ACROSS, -BOX_DOWN, BOX_ACROSS, BOX_DOWN)
_INSTANCE: Rect = (-PAD, -PAD - TITLE, PAD, PAD)


@dataclass(frozen=True, slots=True)
class Box:
    """The neurons of a box or an instance, and the boxes within it; how far its line is from centres (4,), and how
    large it is for its title (2,), at least."""

    members: IntArray
    within: Sequence[Box]
    line: FloatArray
    title: FloatArray

    def rect(self, places: FloatArray, labels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The frame around neurons at these places: its upper left corner, and its lower right one."""
        own, beside = places[self.members], labels[self.members]
        low = (own + np.fmin(self.line[:2], beside[:, :2] - PAD_LABEL)).min(axis=0)
        high = (own + np.fmax(self.line[2:], beside[:, 2:] + PAD_LABEL)).max(axis=0)
        for inner in self.within:
            first, last = inner.rect(places, labels)
            low, high = np.minimum(low, first - BOX_FRAME), np.maximum(high, last + BOX_FRAME)
        more = np.maximum(self.title - (high - low), 0.0) / 2
        return low - more, high + more


@dataclass(frozen=True, slots=True)
class _Sizes:
    """How far discs are kept apart, and what ``labels`` cover around their centres (n, 4), NaN where there is none."""

    apart: float
    labels: FloatArray


def boxes_apart(
    problem: LayoutProblem,
    places: FloatArray,
    spacing: float,
    symmetry: Symmetry,
    labels: FloatArray | None = None,
) -> FloatArray:
    """The places (n, 2) of a problem's neurons, each box and instance by itself, discs ``spacing`` apart, and
    ``labels`` (``apart``) in the frames of their neurons. Pinned neurons stay, and mirror images are such all the
    time."""
    count = len(problem.neurons)
    boxes = framed(problem)
    if not boxes and labels is None:
        return places
    places = places.copy()
    pinned = np.zeros(count, dtype=np.bool_)
    pinned[list(problem.pins)] = True
    pinned |= pinned[symmetry.image]
    sizes = _Sizes(spacing, np.full((count, 4), np.nan) if labels is None else labels)
    _divided(places, Box(np.arange(count), boxes, np.zeros(4), np.zeros(2)), pinned, sizes, symmetry)
    return places


def framed(problem: LayoutProblem) -> list[Box]:
    """The boxes and instances of a problem, the outermost of those within others; none where there are too many."""
    titles = instance_titles((module.path, module.module) for module in problem.modules)
    given = [(m.members, _INSTANCE, title) for m, title in zip(problem.modules, titles, strict=True)]
    given += [(members, _LINE, title_room(name, BOX_WEIGHT)) for name, members in problem.boxes]
    level = problem.direction in ("right", "left")
    frames = [
        Box(
            np.array(sorted(members), dtype=np.int64),
            (),
            np.array(turned(line, problem.direction)),
            np.array((0.0, title) if level else (title, 0.0)),
        )
        for members, line, title in given
    ]
    return _within(_wholes(frames)) if len(frames) <= _MOST_BOXES else []


def _wholes(boxes: Sequence[Box]) -> list[Box]:
    """Boxes of which any two share nothing, or one holds the other, the largest first: those that share some of their
    neurons are one."""
    wholes: dict[frozenset[int], Box] = {}
    for box in boxes:
        whole, line, title = frozenset(box.members.tolist()), box.line, box.title
        while crossing := [
            one for one in wholes if one == whole or not (one.isdisjoint(whole) or one < whole or whole < one)
        ]:
            found = [wholes.pop(one) for one in crossing]
            whole = whole.union(*crossing)
            lines = np.array([line, *(one.line for one in found)])
            line = np.concatenate([lines[:, :2].min(axis=0), lines[:, 2:].max(axis=0)])
            title = np.max([title, *(one.title for one in found)], axis=0)
        if whole:
            wholes[whole] = Box(np.array(sorted(whole), dtype=np.int64), (), line, title)
    return [wholes[whole] for whole in sorted(wholes, key=lambda whole: (-len(whole), min(whole)))]


def _within(wholes: Sequence[Box]) -> list[Box]:
    """The outermost of these, each with those within it."""
    boxes: list[Box] = []
    rest = list(wholes)
    while rest:
        outer = rest[0]
        inside = [bool(np.isin(one.members, outer.members).all()) for one in rest]
        inner = [one for one, held in zip(rest[1:], inside[1:], strict=True) if held]
        boxes.append(replace(outer, within=_within(inner)))
        rest = [one for one, held in zip(rest, inside, strict=True) if not held]
    return boxes


def _divided(places: FloatArray, box: Box, pinned: BoolArray, sizes: _Sizes, symmetry: Symmetry) -> None:
    """Move the neurons of a box: its boxes off each other, who is in none of them out of them."""
    for number, inner in enumerate(box.within):
        own = inner.members
        if -1 < _image(box.within, inner, symmetry) < number and symmetry.paired[own].all():
            places[own] = places[symmetry.image[own]] * (-1.0, 1.0) + (2 * symmetry.axis, 0.0)
        else:
            _divided(places, inner, pinned, sizes, symmetry)
    own, still = box.members, pinned.copy()
    if box.within:
        centres, half, ways = _pushed(places, box, pinned, sizes.labels, symmetry)
        for inner, way in zip(box.within, ways, strict=True):
            places[inner.members] += way
        places[:] = symmetry.kept(places)
        still[np.concatenate([inner.members for inner in box.within])] = True
    free = own[~still[own]]
    inside = symmetry.within(own)
    covered = sizes.labels[free] + PAD_LABEL * np.array([-1, -1, 1, 1])
    bodies = np.concatenate([np.fmin(covered[:, :2], -RADIUS), np.fmax(covered[:, 2:], RADIUS)], axis=1)
    for turn in range(_TURNS if len(free) else 0):
        before = places[free]
        if box.within:
            places[free] = _outside(before, centres, half, bodies)
            places[:] = symmetry.kept(places)
        if turn and np.abs(places[free] - before).max() < _SETTLED:
            break
        places[own] = apart(
            places[own], sizes.apart, np.flatnonzero(still[own]), kept=inside.kept, labels=sizes.labels[own]
        )
        places[:] = symmetry.kept(places)


def _pushed(
    places: FloatArray, box: Box, pinned: BoolArray, labels: FloatArray, symmetry: Symmetry
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where the frames of the boxes in a box are when no two overlap, nor the pins beside them, half of their sizes,
    and how far they have moved for that (k, 2 each). Those with pins stay; one that is its own mirror image moves along
    the axis, others as their images do."""
    alone = np.setdiff1d(box.members, np.concatenate([inner.members for inner in box.within]))
    posts = places[alone[pinned[alone]]]
    rects = [inner.rect(places, labels) for inner in box.within]
    low = np.array([*(low for low, _ in rects), *(posts - RADIUS)])
    high = np.array([*(high for _, high in rects), *(posts + RADIUS)])
    held = np.array([*(pinned[inner.members].any() for inner in box.within), *(True for _ in posts)])
    image = np.array([*(_image(box.within, inner, symmetry) for inner in box.within), *(-1 for _ in posts)])
    start, half = (low + high) / 2, (high - low) / 2
    centres, room = start, half + _GAP
    one, other = np.triu_indices(len(centres), 1)
    movable = ~(held[one] & held[other])
    one, other = one[movable], other[movable]
    # how much of a push each of two takes
    share = np.where(held[one], 0.0, np.where(held[other], 1.0, 0.5))
    on_axis = image == np.arange(len(centres))
    along = on_axis[one] & (on_axis[other] | held[other]) | held[one] & on_axis[other]
    for turn in range(_ROUNDS):
        way = centres[other] - centres[one]
        missing = room[one] + room[other] - np.abs(way)
        close = np.flatnonzero((missing > 1e-6).all(axis=1))
        if not len(close):
            break
        if turn >= _PATIENCE:
            middle = centres.mean(axis=0)
            centres = np.where(held[:, None], centres, middle + _GROWTH * (centres - middle))
        axis = np.where(along[close], 1, np.argmin(missing[close], axis=1))
        step = 0.5 * missing[close, axis] + 1e-3
        step *= np.where(way[close, axis] < 0, -1.0, 1.0)
        centres = centres.copy()
        np.add.at(centres, (other[close], axis), (1 - share[close]) * step)
        np.add.at(centres, (one[close], axis), -share[close] * step)
        theirs = centres[image] * (-1.0, 1.0) + (2 * symmetry.axis, 0.0)
        centres = np.where(((image >= 0) & ~held)[:, None], (centres + theirs) / 2, centres)
    count = len(box.within)
    return centres[:count], half[:count], (centres - start)[:count]


def _image(boxes: Sequence[Box], box: Box, symmetry: Symmetry) -> int:
    """Which of these boxes holds the images of one's neurons, −1 where that is none."""
    paired = box.members[symmetry.image[box.members] != box.members]
    images = set(symmetry.image[paired].tolist())
    return next((i for i, other in enumerate(boxes) if images and images <= set(other.members.tolist())), -1)


def _outside(points: FloatArray, centres: FloatArray, half: FloatArray, bodies: FloatArray) -> FloatArray:
    """Points whose ``bodies``, the rectangles around them, reach into a rectangle, put so that they touch the nearest
    of its sides; twice, as they may come into another."""
    middle = points + (bodies[:, :2] + bodies[:, 2:]) / 2
    points, own = middle.copy(), (bodies[:, 2:] - bodies[:, :2]) / 2
    for _ in range(2):
        for centre, frame in zip(centres, half, strict=True):
            way, reach = points - centre, frame + own
            inside = np.flatnonzero((np.abs(way) < reach).all(axis=1))
            if not len(inside):
                continue
            axis = np.argmin(reach[inside] - np.abs(way[inside]), axis=1)
            side = np.where(way[inside, axis] < 0, -1.0, 1.0)
            points[inside, axis] = centre[axis] + side * reach[inside, axis]
    return points - (bodies[:, :2] + bodies[:, 2:]) / 2
