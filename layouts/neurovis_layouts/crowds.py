"""Crowds: places from data so close together that a picture of them as they are would have discs too small to see.

In: a problem, its places, each about where the data says, at the scale that gives most discs room. Out: how much
smaller the whole is drawn, and places at which discs have room at that scale: what is crowded is spread, and what is
around it gives way, so that neighbours stay neighbours. Boxes that a line across the page parts are spread each by
itself, and stay on their sides of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from neurovis_layouts.apart import LEAST, apart, jitter
from neurovis_layouts.boxed import Box, framed
from neurovis_layouts.finish import nearest
from neurovis_layouts.frame import turned
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.frames import BOX_DOWN
from neurovis_spec.layout.geometry import near_pairs
from neurovis_spec.layout.labels import TITLE_HIGH
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

#: Discs that are drawn with so many pixels of radius need no more.
_ENOUGH = 6.0
#: Room for each disc, in square spacings: what they have where they are spread evenly.
_EACH = 1.0
#: From a disc to the frame of a box that it is not in, and between two frames.
_OFF, _BETWEEN = 0.45, 0.2
#: How much larger than foreseen the whole gets by spreading, about: titles of boxes get this much more room.
_GROWN = 1.15
#: Room for each of those that stand in one place, and how wide they fan out at most, by how far the next place is.
CROWD, _NEAR = 0.9, 0.5
#: More boxes than this nobody could tell apart.
_MOST_BOXES = 200
_NONE = np.zeros(0, dtype=np.int64)


def reduction(problem: LayoutProblem, places: FloatArray) -> float | None:
    """How many times smaller these places (n, 2) are drawn so that discs can be seen, 1 at most; None where nothing has
    to be done about them, as no two are in each other's way, or all have room as they are."""
    if len(places) < 2 or nearest(places, LEAST).min() >= LEAST:
        return None
    wide, high = extent(problem, places)
    least = problem.neuron_spacing * math.sqrt(_EACH * len(places) / (wide * high))
    smaller = max(problem.disc((wide, high)) / _ENOUGH, least)
    if smaller < 1:
        return smaller
    return 1.0 if _mixed(places, problem.neuron_spacing) else None


def _mixed(places: FloatArray, spacing: float) -> bool:
    """Whether those in one spot would stand among those in another if they fanned out."""
    spots, times = np.unique(places, axis=0, return_counts=True)
    reach = CROWD * spacing * np.sqrt(times) / 2
    one, other, _, far = near_pairs(spots, 2 * float(reach.max()))
    return bool(((far < reach[one] + reach[other]) & (times[one] + times[other] > 2)).any())


def fanned(places: FloatArray, spacing: float, near: bool = False) -> FloatArray:
    """Places, those in exactly one spot fanned out around it, with room for each; ``near`` it, they keep off the next
    spot."""
    spots, spot, times = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    spot = spot.reshape(-1)
    order = np.argsort(spot, kind="stable")
    rank = np.zeros(len(places), dtype=np.int64)
    rank[order] = np.arange(len(places)) - (np.cumsum(times) - times)[spot[order]]
    crowd = times[spot]
    wide = CROWD * spacing * np.sqrt(crowd)
    if near:
        wide = np.minimum(wide, _NEAR * nearest(spots, float(wide.max(initial=0.0)) / _NEAR)[spot])
    fan = jitter(int(rank.max(initial=0)) + 1)[rank] * wide[:, None]
    spread_out: FloatArray = places + np.where(crowd > 1, 1.0, 0.0)[:, None] * fan
    return spread_out


def extent(problem: LayoutProblem, places: FloatArray) -> Point:
    """Width and height in the picture of what holds the discs at these places."""
    across, along = (np.ptp(places, axis=0) + 2 * RADIUS).tolist() if len(places) else (0.0, 0.0)
    return (across, along) if problem.direction in ("down", "up") else (along, across)


def spread(problem: LayoutProblem, places: FloatArray, want: float) -> FloatArray:
    """Places near these (n, 2), discs ``want`` apart."""
    places = fanned(places, problem.neuron_spacing, near=True)
    unit = problem.disc(extent(problem, places)) / RADIUS / _GROWN
    titles = max(0.0, TITLE_HIGH / unit - (BOX_DOWN - RADIUS))
    more = np.array(turned((0.0, -titles, 0.0, 0.0), problem.direction))
    boxes = framed(problem) if len(problem.boxes) + len(problem.modules) <= _MOST_BOXES else []
    _spread(places, np.arange(len(places)), [_titled(box, more) for box in boxes], want)
    return places


def _titled(box: Box, more: FloatArray) -> Box:
    """A box with room for its title, which does not get smaller with the picture."""
    return replace(box, line=box.line + more, within=[_titled(inner, more) for inner in box.within])


def _spread(places: FloatArray, members: IntArray, boxes: Sequence[Box], want: float) -> None:
    """Spread these, on either side of a line that parts boxes by themselves."""
    if len(boxes) == 1 and len(boxes[0].members) == len(members):
        _spread(places, members, boxes[0].within, want)
        return
    cut = _cut(places, members, boxes)
    if cut is None:
        places[members] = apart(places[members], want, _NONE)
        return
    axis, first = cut
    rects: list[tuple[FloatArray, FloatArray]] = []
    for own in (members[first], members[~first]):
        held = [box for box in boxes if box.members[0] in own]
        _spread(places, own, held, want)
        rects.append(_rect(places, own, held))
    missing = rects[0][1][axis] + _BETWEEN - rects[1][0][axis]
    if missing > 0:
        places[members, axis] += np.where(first, -missing / 2, missing / 2)


def _rect(places: FloatArray, members: IntArray, boxes: Sequence[Box]) -> tuple[FloatArray, FloatArray]:
    """The corners of what holds the frames of boxes, and the discs of those that are in none."""
    none = np.full((len(places), 4), np.nan)
    loose = places[np.setdiff1d(members, np.concatenate([_NONE, *(box.members for box in boxes)]))]
    corners = [box.rect(places, none) for box in boxes]
    low = np.array([*(low for low, _ in corners), *(loose - _OFF)]).min(axis=0)
    high = np.array([*(high for _, high in corners), *(loose + _OFF)]).max(axis=0)
    return low, high


def _cut(places: FloatArray, members: IntArray, boxes: Sequence[Box]) -> tuple[int, BoolArray] | None:
    """The widest street across the page beside a box that no box spans: the axis that it is across, and who of the
    members is before it. None where there is no such street."""
    best: tuple[float, int, float] = -1.0, 0, 0.0
    for axis in (0, 1):
        there = np.sort(places[members, axis])
        ends = np.array([[at.min(), at.max()] for at in (places[box.members, axis] for box in boxes)]).reshape(-1, 2)
        for low, high in ends.tolist():
            before, behind = there[there < low], there[there > high]
            streets = [(before[-1], low)] if len(before) else []
            streets += [(high, behind[0])] if len(behind) else []
            for start, end in streets:
                if end - start > best[0] and ((ends[:, 1] <= start) | (ends[:, 0] >= end)).all():
                    best = end - start, axis, start
    if best[0] < 0:
        return None
    return best[1], places[members, best[1]] <= best[2]
