"""Corners: a route as a line with few corners, and the smooth route along such a line.

In: a route, or the points of a line. Out: the other of the two.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_layouts.routing.rounded import arc
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import cubic, distance, pieces_of, snap, squared_distances, straight
from neurovis_spec.layout.model import Point, Route

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
#: Shorter pieces are left out.
_SHORT = 1e-3


def corners(route: Route) -> tuple[Point, ...]:
    """The line of few points that the route follows (Douglas and Peucker 1973)."""
    points = np.concatenate([np.array(route[:1]), cubic(pieces_of([route])[0][:, None], _ON).reshape(-1, 2)])
    flat = _FLAT
    while len(line := _simple(points, flat)) > _MOST + 2:
        flat *= _MORE
    return line


def reflected(route: Route, twice: float, start: Point, end: Point) -> Route:
    """The reflection of a route on the axis at half of ``twice``, from centre to centre exactly."""
    return (start, *((twice - x, y) for x, y in route[1:-1]), end)


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
    points: list[Point] = [line[0]]
    last = len(line) - 2
    for number in range(1, len(line) - 1):
        before, corner, after = line[number - 1 : number + 2]
        lead, tail = distance(before, corner), distance(corner, after)
        if lead < _SHORT or tail < _SHORT:
            continue
        lead = min(cut, max(lead - _HEAD, (1 - _SHARE) * lead) if number == 1 else lead / 2)
        tail = min(cut, max(tail - _HEAD, (1 - _SHARE) * tail) if number == last else tail / 2)
        start, *control, end = arc(corner, before, after, min(lead, _UNEVEN * tail), min(tail, _UNEVEN * lead), _HOLD)
        if distance(points[-1], start) > _SHORT:
            points += straight(points[-1], start)[1:]
        points += [*control, end]
    if distance(points[-1], line[-1]) > _SHORT:
        points += straight(points[-1], line[-1])[1:]
    return line[0], *((snap(x), snap(y)) for x, y in points[1:-1]), line[-1]
