"""Boxed: every box drawn together, and nothing foreign in its frame.

In: where an engine that places neurons anywhere has put them. Out: places at which the frame of each box holds its
neurons alone, as far as pins allow: what takes more room than its neurons need is drawn in, boxes are moved off each
other as wholes, and who stands in a foreign frame leaves it. So it is for boxes within boxes; boxes that share some of
their neurons move as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.apart import apart
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.frames import BOX_ACROSS, BOX_DOWN, TITLE
from neurovis_spec.layout.model import RADIUS, LayoutProblem

#: Half of what is free between two frames: one line of a title fits.
_GAP = TITLE / 2
#: Of a box with so many neurons, those farther out than this share of them, and so much more, are drawn in.
_MANY, _MOST, _MORE = 8, 0.8, 1.25
#: A neuron's share of a picture or a box, in square spacings, at most: discs have to stay in sight. And how long a box
#: is for each of its neurons, in spacings, at most.
ROOM, _LONG = 7.0, 1.5
#: More boxes than this nobody could tell apart.
_MOST_BOXES = 1000
#: Steps in which frames push each other off; after so many of them the whole grows a little with each.
_ROUNDS, _PATIENCE, _GROWTH = 400, 60, 1.02
#: So often at most neurons leave foreign frames and are then kept off each other, which may push some of them back.
_TURNS = 8
#: From centres to the line of a frame.
_LINE = np.array([BOX_ACROSS, BOX_DOWN])


@dataclass(frozen=True, slots=True)
class _Box:
    """The neurons of a box, and the boxes within it."""

    members: IntArray
    within: Sequence[_Box]


def boxes_apart(problem: LayoutProblem, places: FloatArray, spacing: float) -> FloatArray:
    """The places (n, 2) of a problem's neurons, each box by itself, discs ``spacing`` apart. Pinned neurons stay."""
    if not problem.boxes or len(problem.boxes) > _MOST_BOXES:
        return places
    count = len(problem.neurons)
    places = places.copy()
    pinned = np.zeros(count, dtype=np.bool_)
    pinned[list(problem.pins)] = True
    boxes = _within(_wholes([frozenset(members) for _, members in problem.boxes]))
    _divided(places, _Box(np.arange(count), boxes), pinned, spacing, problem.neuron_spacing)
    return places


def _wholes(boxes: Sequence[frozenset[int]]) -> list[frozenset[int]]:
    """Boxes of which any two share nothing, or one holds the other, the largest first: those that share some of their
    neurons are one."""
    wholes: list[frozenset[int]] = []
    for box in boxes:
        whole = box
        while crossing := [one for one in wholes if one & whole and not (one <= whole or whole <= one)]:
            wholes = [one for one in wholes if one not in crossing]
            whole = whole.union(*crossing)
        if whole and whole not in wholes:
            wholes.append(whole)
    return sorted(wholes, key=lambda whole: (-len(whole), min(whole)))


def _within(wholes: Sequence[frozenset[int]]) -> list[_Box]:
    """The outermost of these, each with those within it."""
    boxes: list[_Box] = []
    rest = list(wholes)
    while rest:
        outer, inner = rest[0], [one for one in rest[1:] if one <= rest[0]]
        boxes.append(_Box(np.array(sorted(outer), dtype=np.int64), _within(inner)))
        rest = [one for one in rest[1:] if not one <= outer]
    return boxes


def _divided(places: FloatArray, box: _Box, pinned: BoolArray, spacing: float, unit: float) -> None:
    """Move the neurons of a box: its boxes off each other, who is in none of them out of them."""
    for inner in box.within:
        own = inner.members
        places[own] = _drawn_in(places[own], pinned[own], unit)
        _divided(places, inner, pinned, spacing, unit)
    own, still = box.members, pinned.copy()
    if box.within:
        boxed = np.concatenate([inner.members for inner in box.within])
        alone = np.setdiff1d(own, boxed)
        posts = alone[pinned[alone]]
        low = np.array([*(places[inner.members].min(axis=0) for inner in box.within), *places[posts]])
        high = np.array([*(places[inner.members].max(axis=0) for inner in box.within), *places[posts]])
        held = np.array([*(pinned[inner.members].any() for inner in box.within), *pinned[posts]])
        half = (high - low) / 2 + _LINE
        half[len(box.within) :] = RADIUS
        centres = _pushed((low + high) / 2, half + _GAP, held)
        for inner, way in zip(box.within, centres - (low + high) / 2, strict=False):
            places[inner.members] += way
        still[boxed] = True
    free = own[~still[own]]
    for turn in range(_TURNS if len(free) else 0):
        before = places[free]
        if box.within:
            frames = slice(0, len(box.within))
            places[free] = _outside(before, centres[frames], half[frames] + RADIUS)
        if turn and np.array_equal(places[free], before):
            break
        places[own] = apart(places[own], spacing, np.flatnonzero(still[own]))


def _drawn_in(places: FloatArray, pinned: BoolArray, unit: float) -> FloatArray:
    """Places of which none is much farther out than most are, and which take no more room than their number needs;
    where some are pinned, the others stand around these."""
    if pinned.all():
        return places
    middle = np.median(places[~pinned], axis=0)
    free = places[~pinned] - middle
    if len(free) >= _MANY:
        far = np.hypot(free[:, 0], free[:, 1])
        limit = _MORE * float(np.quantile(far, _MOST))
        free *= np.minimum(1.0, limit / np.maximum(far, 1e-9))[:, None]
    wide, high = np.maximum(np.ptp(free, axis=0) / unit, 1.0).tolist()
    room, long = ROOM * len(free) / (wide * high), _LONG * len(places) / max(wide, high)
    drawn = places.copy()
    about = places[pinned].mean(axis=0) if pinned.any() else middle
    drawn[~pinned] = about + free * min(1.0, float(np.sqrt(room)), long)
    return drawn


def _pushed(centres: FloatArray, half: FloatArray, held: BoolArray) -> FloatArray:
    """Centres (k, 2) of rectangles, so wide and high by half, moved until no two overlap, but for those ``held``."""
    centres = centres.copy()
    one, other = np.triu_indices(len(centres), 1)
    movable = ~(held[one] & held[other])
    one, other = one[movable], other[movable]
    # how much of a push each of two takes
    share = np.where(held[one], 0.0, np.where(held[other], 1.0, 0.5))
    for turn in range(_ROUNDS):
        way = centres[other] - centres[one]
        missing = half[one] + half[other] - np.abs(way)
        close = np.flatnonzero((missing > 1e-6).all(axis=1))
        if not len(close):
            break
        if turn >= _PATIENCE:
            grown = centres.mean(axis=0) + _GROWTH * (centres - centres.mean(axis=0))
            centres = np.where(held[:, None], centres, grown)
        axis = np.argmin(missing[close], axis=1)
        step = 0.5 * missing[close, axis] + 1e-3
        step *= np.where(way[close, axis] < 0, -1.0, 1.0)
        np.add.at(centres, (other[close], axis), (1 - share[close]) * step)
        np.add.at(centres, (one[close], axis), -share[close] * step)
    return centres


def _outside(points: FloatArray, centres: FloatArray, half: FloatArray) -> FloatArray:
    """Points that stand in a rectangle, put on the nearest of its sides; twice, as they may come into another."""
    points = points.copy()
    for _ in range(2):
        for centre, reach in zip(centres, half, strict=True):
            way = points - centre
            inside = np.flatnonzero((np.abs(way) < reach).all(axis=1))
            if not len(inside):
                continue
            axis = np.argmin(reach - np.abs(way[inside]), axis=1)
            side = np.where(way[inside, axis] < 0, -1.0, 1.0)
            points[inside, axis] = centre[axis] + side * reach[axis]
    return points
