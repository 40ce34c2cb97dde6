"""Corners: a route as a line with few corners, and the smooth route along such a line.

In: a route, or the points of a line. Out: the other of the two.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_layouts.routing.polylines import along
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import cubic, lengths, pieces_of, squared_distances
from neurovis_spec.layout.model import GRID, Point, Route

#: Corners closer to the line than this are none; there are so many at most, else more is none.
_FLAT, _MOST, _MORE = 0.12, 6, 1.6
#: Where on a piece corners are looked for.
_ON = np.array([0.25, 0.5, 0.75, 1.0])
#: How much of the first and of the last leg stays straight, for the arrowhead, and what share of a short one.
_HEAD, _SHARE = 0.5, 0.8
#: How much more of one leg may be cut off than of the other.
_UNEVEN = 2.5
#: Where on the way to the corner the control points stand: about as on an arc of a circle.
_HOLD = 0.62
#: How much of a corner is cut off, at most, the roundest first.
_CUTS = (3.0, 1.5, 0.8, 0.4, 0.2, 0.1)
#: Shorter pieces are left out.
_SHORT = 1e-3
_PER_UNIT = round(1 / GRID)


def corners(route: Route) -> tuple[Point, ...]:
    """The line of few points that the route follows (Douglas and Peucker 1973)."""
    points = np.concatenate([np.array(route[:1]), cubic(pieces_of([route])[0][:, None], _ON).reshape(-1, 2)])
    flat = _FLAT
    while len(line := _simple(points, flat)) > _MOST + 2:
        flat *= _MORE
    return line


def _simple(points: FloatArray, flat: float) -> tuple[Point, ...]:
    keep = {0, len(points) - 1}
    waiting = [(0, len(points) - 1)]
    while waiting:
        first, last = waiting.pop()
        x, y = (points[first + 1 : last] - points[first]).T
        off = squared_distances(x, y, *(points[last] - points[first]))
        if off.max(initial=0.0) > flat * flat:
            at = first + 1 + int(np.argmax(off))
            keep.add(at)
            waiting += [(first, at), (at, last)]
    return tuple((x, y) for x, y in points[sorted(keep)].tolist())


def smooth(line: Sequence[Point], cut: float) -> Route:
    """The route along a line of at least two points, its control points on the grid; of a leg at each of its ends no
    more than ``cut`` and no more than half is cut off, but nearly all where it leads to an end of the line."""
    pieces, _ = smoothed([(line, cut)])
    return _route(pieces)


def rounded(line: Sequence[Point], rects: FloatArray) -> Route:
    """The route along a line of at least two points with the roundest corners with which it enters none of the
    rectangles (f, 4); with sharp ones where it always does."""
    pieces, owner = smoothed([(line, cut) for cut in _CUTS])
    lines = along(pieces, owner, len(_CUTS))
    chosen = int(np.argmin([*lines.enter(rects)[:-1], False]))
    return _route(pieces[owner == chosen])


def _route(pieces: FloatArray) -> Route:
    first, *rest = ((x, y) for x, y in np.concatenate([pieces[0, :1], *pieces[:, 1:]]).tolist())
    return first, *rest


def smoothed(ways: Sequence[tuple[Sequence[Point], float]]) -> tuple[FloatArray, IntArray]:
    """The cubic pieces (p, 4, 2) of the routes along many lines, and which line each (p,) is of."""
    counts = np.array([len(line) for line, _ in ways], dtype=np.int64)
    points = np.array([point for line, _ in ways for point in line], dtype=np.float64).reshape(-1, 2)
    last = np.cumsum(counts) - 1
    first = last - counts + 1
    inner = np.ones(len(points), dtype=np.bool_)
    inner[first] = inner[last] = False
    corner = np.flatnonzero(inner)
    legs = lengths(points[1:] - points[:-1])
    corner = corner[(legs[corner - 1] >= _SHORT) & (legs[corner] >= _SHORT)]
    owner = np.repeat(np.arange(len(ways), dtype=np.int64), counts)[corner]
    # how much is cut off before each corner and behind it
    cut = np.array([cut for _, cut in ways], dtype=np.float64)[owner]
    lead = np.minimum(cut, _part(legs[corner - 1], corner == first[owner] + 1))
    tail = np.minimum(cut, _part(legs[corner], corner == last[owner] - 1))
    lead, tail = np.minimum(lead, _UNEVEN * tail), np.minimum(tail, _UNEVEN * lead)
    at = points[corner]
    start = at + (lead / legs[corner - 1])[:, None] * (points[corner - 1] - at)
    end = at + (tail / legs[corner])[:, None] * (points[corner + 1] - at)
    # for each corner and each end of a line what leads there straight, and the round corner, where there is one
    slot = np.arange(len(corner), dtype=np.int64) + owner
    ends = np.cumsum(np.bincount(owner, minlength=len(ways)) + 1) - 1
    stops = np.empty((len(corner) + len(ways), 2, 2))
    stops[slot, 0], stops[slot, 1], stops[ends] = start, end, points[last][:, None]
    before = np.concatenate([points[first[:1]], stops[:-1, 1]])
    before[ends[:-1] + 1] = points[first[1:]]
    straight = lengths(stops[:, 0] - before) > _SHORT
    pieces = np.empty((len(stops), 2, 4, 2))
    pieces[:, 0, 0], pieces[:, 0, 3] = before, stops[:, 0]
    pieces[:, 0, 1], pieces[:, 0, 2] = (2 * before + stops[:, 0]) / 3, (before + 2 * stops[:, 0]) / 3
    pieces[:, 1, 0], pieces[:, 1, 3] = np.where(straight[:, None], stops[:, 0], before), stops[:, 1]
    pieces[slot, 1, 1], pieces[slot, 1, 2] = start + _HOLD * (at - start), end + _HOLD * (at - end)
    there = np.stack([straight, np.ones(len(stops), dtype=np.bool_)], axis=1)
    there[ends, 1] = False
    whole = np.rint(pieces[there] * _PER_UNIT) / _PER_UNIT + 0.0
    number = np.repeat(np.arange(len(stops), dtype=np.int64), there.sum(axis=1))
    line = np.searchsorted(ends, number)
    # from end to end exactly
    border = np.flatnonzero(line[1:] != line[:-1])
    whole[np.append(0, border + 1), 0], whole[np.append(border, -1), 3] = points[first], points[last]
    return whole, line


def _part(leg: FloatArray, whole: BoolArray) -> FloatArray:
    """How much of a leg may be cut off at most: half, and nearly all of one to an end of the line."""
    most: FloatArray = np.where(whole, np.maximum(leg - _HEAD, (1 - _SHARE) * leg), leg / 2)
    return most
