"""Line overlap: how far lines run on each other, and how often they cross near a place, measured on sample points.

In: routes. Out: points on a route outside its discs; the length of a line that runs on others; how often routes cross
the lines near a place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import crossing, pieces_of, points_on
from neurovis_spec.layout.model import Point, Route

#: Closer than this two lines are one to the eye.
_CLOSE = 0.12
#: Hidden by the disc and the arrowhead.
_END = 0.4
_STEP = 0.1
#: How far lines may run on each other, about.
_RUN = 0.4
#: Cells of this width have what is close to a point beside the point's own; numbers of cells in a column.
_WITHIN, _COLUMN = 0.15, 1 << 31
#: So many lines are compared one by one.
_FEW = 4
#: How far from a place crossings are counted.
_NEAR = 2.5


def line_of(route: Route) -> FloatArray:
    """(n, 2) points on a route, between what discs and arrowheads hide."""
    return lines_of([route])[0]


def lines_of(routes: Sequence[Route]) -> list[FloatArray]:
    """The line of each route."""
    if not routes:
        return []
    points, owner = points_on(*pieces_of(routes), _STEP)
    ends = np.array([(route[0], route[-1]) for route in routes], dtype=np.float64)
    away = points[:, None, :] - ends[owner]
    seen = ((away * away).sum(axis=2) > _END * _END).all(axis=1)
    points, owner = points[seen], owner[seen]
    cuts = np.searchsorted(owner, np.arange(1, len(routes)))
    return np.split(points, cuts)


def tolerable(line: FloatArray, share: float) -> float:
    """The share of a line that may run on another: this one, or less where that would be a long way."""
    return min(share, _RUN / max(_STEP * len(line), _STEP))


def together(line: FloatArray, mates: Sequence[FloatArray]) -> float:
    """The largest share of a line that runs on one of its mates."""
    return max(_near(line, mate) for mate in mates)


def crossings(line: FloatArray, others: Sequence[FloatArray]) -> int:
    """How often a line crosses others."""
    a, b, _ = _segments([(0, line)])
    c, d, _ = _segments(list(enumerate(others)))
    return int(_crossing(a, b, c, d).sum())


def _near(line: FloatArray, points: FloatArray) -> float:
    """The share of a line that is close to some of these points."""
    if not len(line) or not len(points):
        return 0.0
    low, high = line.min(axis=0) - 2 * _CLOSE, line.max(axis=0) + 2 * _CLOSE
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    if not len(points):
        return 0.0
    close = _beside(line[:, None, 0] - points[None, :, 0], line[:, None, 1] - points[None, :, 1])
    return float(close.any(axis=1).sum()) / len(line)


def _beside(dx: FloatArray, dy: FloatArray) -> BoolArray:
    """Whether what is so far off is one to the eye."""
    dx *= dx
    dy *= dy
    dx += dy
    # points stand a step apart: half of it may be missing to the nearest
    near: BoolArray = dx < _CLOSE * _CLOSE + _STEP * _STEP / 4
    return near


class Sheaf:
    """Lines between the same ends, which are asked about over and over."""

    def __init__(self, lines: Sequence[FloatArray]) -> None:
        self._lines = list(lines)
        points = np.concatenate([np.zeros((0, 2)), *lines])
        owner = np.repeat(np.arange(len(lines), dtype=np.int64), [len(line) for line in lines])
        keys = _keys(points)
        order = np.argsort(keys, kind="stable")
        self._keys, self._points, self._owner = keys[order], points[order], owner[order]

    def together(self, tried: Sequence[FloatArray], but: int) -> list[float]:
        """For each of these lines the largest share of it that runs on one of the sheaf ``but`` for one."""
        mates = [line for number, line in enumerate(self._lines) if number != but]
        if len(mates) <= _FEW:
            return [together(line, mates) for line in tried]
        points = np.concatenate([np.zeros((0, 2)), *tried])
        near = np.zeros((len(points), len(self._lines)), dtype=np.bool_)
        keys = _keys(points)
        for column in (-1, 0, 1):  # what is near lies in this cell or in one beside it
            first = np.searchsorted(self._keys, keys + column * _COLUMN - 1)
            count = np.searchsorted(self._keys, keys + column * _COLUMN + 1, "right") - first
            at = np.repeat(np.arange(len(points), dtype=np.int64), count)
            entry = np.arange(len(at), dtype=np.int64) - np.repeat(np.cumsum(count) - count - first, count)
            close = _beside(points[at, 0] - self._points[entry, 0], points[at, 1] - self._points[entry, 1])
            near[at[close], self._owner[entry[close]]] = True
        near[:, but] = False
        cuts = np.cumsum([len(line) for line in tried])[:-1]
        return [
            float(part.sum(axis=0).max()) / len(line) if len(line) else 0.0
            for line, part in zip(tried, np.split(near, cuts), strict=True)
        ]


def _keys(points: FloatArray) -> IntArray:
    """(n,) the cells that points (n, 2) are in, as numbers: those of a column follow each other."""
    cells = np.floor(points / _WITHIN).astype(np.int64)
    keys: IntArray = cells[:, 0] * _COLUMN + cells[:, 1]
    return keys


class Strokes:
    """Lines by the number of their edge, and others, which stay."""

    def __init__(self, routes: Mapping[int, Route], others: Sequence[Route]) -> None:
        chosen = sorted(routes)
        self.lines = dict(zip(chosen, lines_of([routes[i] for i in chosen]), strict=True))
        first = _segments([*self.lines.items(), *((-1, line) for line in lines_of(others))])
        # from left to right, so that what is near a place is found soon
        order = np.argsort(first[0][:, 0], kind="stable")
        self._from, self._to, self._owner = (figures[order] for figures in first)
        #: edges whose lines are others by now than at first
        self._noted: dict[int, FloatArray] = {}

    def note(self, edge: int, route: Route) -> None:
        """Give an edge another route."""
        self.lines[edge] = self._noted[edge] = line_of(route)

    def crossed(self, edges: Sequence[int], routes: Sequence[Route], place: Point) -> list[int]:
        """How often each of these routes, of these edges, crosses lines of other edges near a place."""
        a, b, number = _segments(list(enumerate(line[_close(line, place)] for line in lines_of(routes))))
        if not len(a):
            return [0] * len(edges)
        low, high = np.minimum(a, b).min(axis=0) - 2 * _STEP, np.maximum(a, b).max(axis=0) + 2 * _STEP
        first, last = np.searchsorted(self._from[:, 0], (low[0], high[0])).tolist()
        here = first + np.flatnonzero((self._from[first:last, 1] > low[1]) & (self._from[first:last, 1] < high[1]))
        here = here[~np.isin(self._owner[here], list(self._noted))]
        c, d, owner = _segments(sorted(self._noted.items()))
        new = ((c > low) & (c < high)).all(axis=1)
        c, d = np.concatenate((self._from[here], c[new])), np.concatenate((self._to[here], d[new]))
        owner = np.concatenate((self._owner[here], owner[new]))
        crossing = _crossing(a, b, c, d) & (np.array(edges)[number][:, None] != owner[None, :])
        return [int(count) for count in np.bincount(number, crossing.sum(axis=1), len(edges))]


def _close(line: FloatArray, place: Point) -> BoolArray:
    """(n,) which points of a line are near a place."""
    away = line - np.array(place)
    near: BoolArray = (away * away).sum(axis=1) < _NEAR * _NEAR
    return near


def _segments(lines: Sequence[tuple[int, FloatArray]]) -> tuple[FloatArray, FloatArray, IntArray]:
    """Segments of lines, of two steps each: from, to, and of which line each is."""
    coarse = [(number, line[::2]) for number, line in lines if len(line) > 2]
    counts = [len(line) - 1 for _, line in coarse]
    return (
        np.concatenate([np.zeros((0, 2)), *(line[:-1] for _, line in coarse)]),
        np.concatenate([np.zeros((0, 2)), *(line[1:] for _, line in coarse)]),
        np.repeat(np.array([number for number, _ in coarse], dtype=np.int64), counts),
    )


def _crossing(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> BoolArray:
    """(k, n) which of the segments from a to b (k, 2) cross which of those from c to d (n, 2)."""
    (ax, ay), (ux, uy) = a.T[:, :, None], (b - a).T[:, :, None]
    (cx, cy), (vx, vy) = c.T[:, None, :], (d - c).T[:, None, :]
    return crossing(ax, ay, ux, uy, cx, cy, vx, vy)[1]
