"""Boxed: every box drawn together, and nothing foreign in its frame.

In: where an engine that places neurons anywhere has put them. Out: places at which the frame of each box holds its
neurons alone: those far out are drawn in, boxes are moved off each other as wholes, and who stands in a foreign frame
leaves it. Boxes that share neurons move as one.
"""

from __future__ import annotations

import numpy as np

from neurovis_layouts.apart import apart
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.frames import BOX_ACROSS, BOX_DOWN, TITLE
from neurovis_spec.layout.model import RADIUS, LayoutProblem

#: Half of what is free between two frames: one line of a title fits.
_GAP = TITLE / 2
#: Of a box with so many neurons, those farther out than this share of them, and so much more, are drawn in.
_MANY, _MOST, _MORE = 8, 0.8, 1.25
#: More boxes than this nobody could tell apart.
_MOST_BOXES = 1000
#: Steps in which frames push each other off; after so many of them the whole grows a little with each.
_ROUNDS, _PATIENCE, _GROWTH = 400, 60, 1.02


def boxes_apart(problem: LayoutProblem, places: FloatArray, spacing: float) -> FloatArray:
    """The places (n, 2) of the neurons of a problem without pins, each box by itself."""
    wholes = _wholes(problem)
    if not wholes or problem.pins or len(wholes) > _MOST_BOXES:
        return places
    places = places.copy()
    for own in wholes:
        places[own] = apart(_drawn_in(places[own]), spacing)
    low = np.array([places[own].min(axis=0) for own in wholes])
    high = np.array([places[own].max(axis=0) for own in wholes])
    reach = np.array([BOX_ACROSS + _GAP, BOX_DOWN + _GAP])
    centres = _pushed((low + high) / 2, (high - low) / 2 + reach)
    for own, way in zip(wholes, centres - (low + high) / 2, strict=True):
        places[own] += way
    free = np.setdiff1d(np.arange(len(problem.neurons)), np.concatenate(wholes))
    half = (high - low) / 2 + np.array([BOX_ACROSS, BOX_DOWN]) + RADIUS
    if not len(free):
        return places
    places[free] = _outside(places[free], centres, half)
    return apart(places, spacing, np.concatenate(wholes))


def _wholes(problem: LayoutProblem) -> list[IntArray]:
    """The neurons of each box; of boxes that share neurons, all together."""
    wholes: list[set[int]] = []
    for _, members in problem.boxes:
        own = set(members)
        touching = [whole for whole in wholes if not whole.isdisjoint(own)]
        wholes = [whole for whole in wholes if whole.isdisjoint(own)] + [own.union(*touching)]
    return [np.array(sorted(whole), dtype=np.int64) for whole in wholes]


def _drawn_in(places: FloatArray) -> FloatArray:
    """Places of which none is much farther out than most are."""
    if len(places) < _MANY:
        return places
    middle = np.median(places, axis=0)
    way = places - middle
    far = np.hypot(way[:, 0], way[:, 1])
    limit = _MORE * float(np.quantile(far, _MOST))
    result: FloatArray = middle + way * np.minimum(1.0, limit / np.maximum(far, 1e-9))[:, None]
    return result


def _pushed(centres: FloatArray, half: FloatArray) -> FloatArray:
    """Centres (k, 2) of rectangles, so wide and high by half, moved until no two overlap."""
    centres = centres.copy()
    one, other = np.triu_indices(len(centres), 1)
    for turn in range(_ROUNDS):
        way = centres[other] - centres[one]
        missing = half[one] + half[other] - np.abs(way)
        close = np.flatnonzero((missing > 1e-6).all(axis=1))
        if not len(close):
            break
        if turn >= _PATIENCE:
            centres = centres.mean(axis=0) + _GROWTH * (centres - centres.mean(axis=0))
        axis = np.argmin(missing[close], axis=1)
        step = 0.5 * missing[close, axis] + 1e-3
        step *= np.where(way[close, axis] < 0, -1.0, 1.0)
        np.add.at(centres, (other[close], axis), 0.5 * step)
        np.add.at(centres, (one[close], axis), -0.5 * step)
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
