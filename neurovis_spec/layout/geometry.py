"""Plane geometry: the coordinate grid, points on a circle, cubic Bézier splines, straight segments, rectangles.

In: points, routes and rectangles, one or as arrays of many. Out: points, distances, crossings. Engines, metrics and
scenes measure with this module alone. Everything here uses + − × ÷ and √ alone, which IEEE 754 fixes to the last bit,
so that engines built on it give the same bytes on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.model import GRID, Point, Route

#: x0, y0, x1, y1
Rect: TypeAlias = tuple[float, float, float, float]
#: (2, …) their parts across and along
Vectors: TypeAlias = FloatArray | tuple[FloatArray, FloatArray]

_PER_UNIT = round(1 / GRID)
_PI = 3.141592653589793
#: How many points there are on a piece, and how many are made at once: so many stay in the processor's cache.
_FEWEST, _MOST, _AT_ONCE = 4, 4096, 1 << 14
#: With at most so many cells for each place all of them are counted; more would fill the memory.
_MOST_CELLS = 64


def snap(value: float) -> float:
    """The nearest multiple of 1/1024; ties go to even, so that mirrored values stay mirrored.

    >>> snap(0.3) * 1024, snap(-0.3) * 1024
    (307.0, -307.0)
    """
    return round(value * _PER_UNIT) / _PER_UNIT + 0.0


def snapped(route: Route) -> Route:
    """A route with all but its ends on the grid."""
    return route[0], *((snap(x), snap(y)) for x, y in route[1:-1]), route[-1]


def turn(part: float) -> Point:
    """Cosine and sine of ``part`` of a full turn, by series: the same bits on every machine.

    >>> turn(0.25)
    (0.0, 1.0)
    """
    part -= math.floor(part)
    quarter = (int(part * 8) + 1) // 2  # the nearest one: what is left is at most an eighth of a turn
    angle = (part - quarter / 4) * 2 * _PI
    cosine, sine = _series(angle)
    for _ in range(quarter % 4):
        cosine, sine = -sine, cosine
    return cosine + 0.0, sine + 0.0


def _series(angle: float) -> Point:
    cosine, sine, term = 0.0, 0.0, 1.0
    for n in range(0, 24, 2):
        cosine += term
        term *= angle / (n + 1)
        sine += term
        term *= -angle / (n + 2)
    return cosine, sine


def cubic(pieces: FloatArray, t: FloatArray) -> FloatArray:
    """The points (…, 2) of cubic pieces (…, 4, 2) at ``t`` (…) in [0, 1] (Bernstein's weights)."""
    s = 1 - t
    weights = (s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t)
    points = np.empty((*np.broadcast_shapes(pieces.shape[:-2], t.shape), 2))
    for k in (0, 1):
        a, b, c, d = (weight * pieces[..., i, k] for i, weight in enumerate(weights))
        points[..., k] = a + b + c + d
    return points


def pieces_of(routes: Sequence[Route]) -> tuple[FloatArray, IntArray]:
    """The cubic pieces (p, 4, 2) of routes, and which route each (p,) is of."""
    pieces = [route[i : i + 4] for route in routes for i in range(0, len(route) - 3, 3)]
    counts = [(len(route) - 1) // 3 for route in routes]
    owner = np.repeat(np.arange(len(routes), dtype=np.int64), counts)
    return np.array(pieces, dtype=np.float64).reshape(-1, 4, 2), owner


def points_on(pieces: FloatArray, owner: IntArray, apart: float) -> tuple[FloatArray, IntArray]:
    """Points on cubic pieces (p, 4, 2), about ``apart``, without the first of each, and whose they are."""
    parts = _counts(pieces, apart)
    piece = np.repeat(np.arange(len(pieces), dtype=np.int64), parts)
    number = np.arange(len(piece), dtype=np.int64) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    return cubic(pieces[piece], number / parts[piece]), owner[piece]


def points_in_turn(pieces: FloatArray, owner: IntArray, apart: float) -> Iterator[tuple[FloatArray, IntArray]]:
    """What ``points_on`` gives, of some pieces after the other: points of many long routes would fill the memory."""
    until = np.cumsum(_counts(pieces, apart))
    first = before = 0
    while first < len(pieces):
        last = max(first + 1, int(np.searchsorted(until, before + _AT_ONCE, side="right")))
        yield points_on(pieces[first:last], owner[first:last], apart)
        first, before = last, int(until[last - 1])


def _counts(pieces: FloatArray, apart: float) -> IntArray:
    """(p,) how many points there are on each piece: by the length of its control polygon."""
    steps = np.diff(pieces, axis=1)
    legs = np.sqrt(steps[:, :, 0] * steps[:, :, 0] + steps[:, :, 1] * steps[:, :, 1])
    counts: IntArray = np.clip(np.ceil((legs[:, 0] + legs[:, 1] + legs[:, 2]) / apart), _FEWEST, _MOST).astype(np.int64)
    return counts


def sampled(route: Route, step: float = 0.2) -> list[Point]:
    """Points along a route, about ``step`` apart, both ends included."""
    points, _ = points_on(*pieces_of([route]), step)
    return [route[0], *((x, y) for x, y in points.tolist())]


def distance(a: Point, b: Point) -> float:
    """Between two points (by √, whose result is fixed; ``hypot``'s is not)."""
    x, y = b[0] - a[0], b[1] - a[1]
    return math.sqrt(x * x + y * y)


def straight(a: Point, b: Point) -> Route:
    """A straight route, its control points on the line."""
    third = ((2 * a[0] + b[0]) / 3, (2 * a[1] + b[1]) / 3)
    return (a, third, ((a[0] + 2 * b[0]) / 3, (a[1] + 2 * b[1]) / 3), b)


def angular(points: Sequence[Point]) -> Route:
    """A route straight from point to point, its corners as they are."""
    return (points[0], *(point for a, b in pairwise(points) for point in (a, b, b)))


class Cells:
    """Places (n, 2) in square cells that are ``reach`` wide, to find which of them are closer than that to what."""

    def __init__(self, places: FloatArray, reach: float) -> None:
        self._reach = reach
        cells = self._cells(places)
        self._low = cells.min(axis=0, initial=2**40)
        columns, self._rows = (np.maximum(cells.max(axis=0, initial=-(2**40)) - self._low, 0) + 3).tolist()
        keys = self._keys(places)
        self._order = np.argsort(keys, kind="stable")
        self._sorted, self._places = keys[self._order], places[self._order]
        #: how many places are in cells before each, where there are not too many cells
        self._before: IntArray | None = None
        if columns * self._rows <= _MOST_CELLS * len(places):
            self._before = np.cumsum(np.bincount(keys + 1, minlength=columns * self._rows))

    def _cells(self, points: FloatArray) -> IntArray:
        cells: IntArray = np.floor(points / self._reach).astype(np.int64)
        return cells

    def _keys(self, points: FloatArray) -> IntArray:
        """(k,) the cell that each point is in: those of a column follow each other, with an empty one on either end."""
        column, row = (self._cells(points) - self._low).T
        keys: IntArray = (column + 1) * self._rows + np.clip(row + 1, 0, self._rows - 1)
        return keys

    def _begin(self, keys: IntArray) -> IntArray:
        """(k,) where what is in this cell, or behind it, begins."""
        if self._before is None:
            return np.searchsorted(self._sorted, keys)
        return self._before[np.clip(keys, 0, len(self._before) - 1)]

    def near(self, points: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """All pairs of points (k, 2) and places closer than the reach: both numbers, how far, squared."""
        keys = self._keys(points)
        found: list[tuple[IntArray, IntArray, FloatArray]] = []
        for column in (-self._rows, 0, self._rows):
            point, place = ranges(self._begin(keys + (column - 1)), self._begin(keys + (column + 2)))
            x, y = self._places[place, 0] - points[point, 0], self._places[place, 1] - points[point, 1]
            squared = x * x + y * y
            near = squared < self._reach * self._reach
            found.append((point[near], self._order[place[near]], squared[near]))
        point, place, squared = (np.concatenate(part) for part in zip(*found, strict=True))
        return point, place, squared

    def pairs(self) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """All pairs of places closer than the reach: both numbers, from the first to the second (k, 2), how far."""
        keys, ones, others = self._sorted, list[IntArray](), list[IntArray]()
        # each cell with half of those around it, and what is in it with what follows
        for step in (0, 1, self._rows - 1, self._rows, self._rows + 1):
            begin = self._begin(keys + step) if step else np.arange(len(keys), dtype=np.int64) + 1
            one, other = ranges(begin, self._begin(keys + (step + 1)))
            ones.append(one)
            others.append(other)
        one, other = np.concatenate(ones), np.concatenate(others)
        way = self._places[other] - self._places[one]
        squared = (way**2).sum(axis=1)
        near = squared < self._reach * self._reach
        return self._order[one[near]], self._order[other[near]], way[near], np.sqrt(squared[near])


def ranges(begin: IntArray, end: IntArray) -> tuple[IntArray, IntArray]:
    """For ranges of numbers, all those within them, each behind the number of its range; of one that ends before it
    begins none."""
    counts = np.maximum(end - begin, 0)
    which = np.repeat(np.arange(len(counts), dtype=np.int64), counts)
    return which, begin[which] + np.arange(len(which), dtype=np.int64) - np.repeat(np.cumsum(counts) - counts, counts)


def distinct(numbers: IntArray) -> IntArray:
    """Each number once, in order: a tenth of the time of ``np.unique``, whose hashes are poor for keys of cells."""
    ordered = np.sort(numbers)
    once: IntArray = ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]
    return once


def near_pairs(places: FloatArray, reach: float) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """All pairs of places (n, 2) closer than ``reach``: both numbers, from the first to the second (k, 2), how far."""
    return Cells(places, reach).pairs()


def lengths(way: FloatArray) -> FloatArray:
    """(n,) how long vectors (n, 2) are."""
    x, y = way.T
    far: FloatArray = np.sqrt(x * x + y * y)
    return far


def squared_distances(x: FloatArray, y: FloatArray, ux: FloatArray, uy: FloatArray) -> FloatArray:
    """How far points are from segments, squared: points (x, y) as seen from where their segments (ux, uy) begin."""
    t = np.clip((x * ux + y * uy) / np.maximum(ux * ux + uy * uy, 1e-12), 0.0, 1.0)
    dx, dy = x - t * ux, y - t * uy
    squared: FloatArray = dx * dx + dy * dy
    return squared


def crossing(a: Vectors, u: Vectors, b: Vectors, v: Vectors) -> tuple[FloatArray, BoolArray]:
    """Whether segments a to a + u and b to b + v cross (half-open, so that a corner counts once; parallel ones never
    do), and for those that do, at what share of u: the shares of these alone, and the whole answer (…)."""
    (ux, uy), (vx, vy) = u, v
    bx, by = b[0] - a[0], b[1] - a[1]
    cross = ux * vy - uy * vx
    sign, whole = np.sign(cross), np.abs(cross)
    s, t = sign * (bx * vy - by * vx), sign * (bx * uy - by * ux)
    hit = (s >= 0) & (s < whole) & (t >= 0) & (t < whole)
    return s[hit] / whole[hit], hit


def bounds(points: Iterable[Point]) -> Rect:
    """The rectangle around points."""
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def padded(rect: Rect, by: float) -> Rect:
    """A rectangle wider on all sides."""
    return rect[0] - by, rect[1] - by, rect[2] + by, rect[3] + by


def shifted(rect: Rect, by: Point) -> Rect:
    """A rectangle moved."""
    return rect[0] + by[0], rect[1] + by[1], rect[2] + by[0], rect[3] + by[1]


def united(rects: Iterable[Rect]) -> Rect:
    """The rectangle around rectangles."""
    x0, y0, x1, y1 = zip(*rects, strict=True)
    return min(x0), min(y0), max(x1), max(y1)


def meet(one: Rect, other: Rect, gap: float = 0.0) -> bool:
    """Whether rectangles share more than an edge, or come closer than ``gap``."""
    return one[0] < other[2] + gap and other[0] < one[2] + gap and one[1] < other[3] + gap and other[1] < one[3] + gap
