"""Polylines: many routes as lines of few points, measured all at once.

In: routes. Out: how long they are, how much they bend, where they leave a disc, what cells they run through, how often
they cross segments; one figure a line. All points stand in one array: a line of three points and one of two are
``points`` (5, 2) with ``starts`` 0, 3, 5; they have three segments, from ``a`` (3, 2) to ``b`` (3, 2), of the ``owner``
0, 0, 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from neurovis_layouts.routing.obstacles import blocked
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import crossing, cubic, lengths, pieces_of, ranges, squared_distances
from neurovis_spec.layout.model import Route

#: Into how many segments a piece is cut that is not straight, and how far off its chord such a piece reaches, by the
#: length of that.
_PARTS, _STRAIGHT = 8, 0.01
#: How far apart points are that are checked for what else runs there, how large their cells; those this close to the
#: ends of a line are left out.
STEP, _CELL, END = 0.15, 0.16, 0.6
#: On a line so many are checked, at most: memory has an end.
_MOST = 2000
_ROW = 1 << 31
#: Closer than this two lines are one to the eye; how far apart points are that are checked for that, what disc and
#: arrowhead hide, what share of a line may run on another, and how far.
_CLOSE, _FINE, _DISC, _SHARE, _RUN = 0.12, 0.1, 0.4, 0.2, 0.4
#: What is farther apart than this on any axis need not be measured to be told farther apart than ``_CLOSE``.
_NEAR = 0.13
#: Crossings this close to an end of a line are how it meets others at a disc.
_HIDDEN = 0.4
#: A bend is no tighter than this for a turn of one.
_TIGHTEST, _LEAST = 4.0, 0.05
_T = np.arange(1, _PARTS + 1, dtype=np.float64) / _PARTS


class Polylines:
    """Lines: all ``points`` (m, 2), and where each line starts among them (n + 1,)."""

    def __init__(self, points: FloatArray, starts: IntArray) -> None:
        self.points, self.starts = points, starts
        self._lines: IntArray = np.repeat(np.arange(len(starts) - 1, dtype=np.int64), np.diff(starts))
        # segments: all steps from point to point but those from line to line
        self._first = np.flatnonzero(self._lines[1:] == self._lines[:-1])
        self.owner: IntArray = self._lines[self._first]
        self.a, self.b = points[self._first], points[self._first + 1]
        #: of each line its first segment
        self._segments: IntArray = starts[:-1] - np.arange(len(starts) - 1, dtype=np.int64)
        way = self.b - self.a
        self._way, self._lengths = way, lengths(way)

    def __len__(self) -> int:
        return len(self.starts) - 1

    def some(self, chosen: IntArray) -> Polylines:
        """The lines with these numbers."""
        first, last = self.starts[chosen], self.starts[chosen + 1]
        starts = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(last - first)])
        return Polylines(self.points[ranges(first, last)[1]], starts)

    def and_then(self, others: Polylines) -> Polylines:
        """These and others behind them."""
        starts = np.concatenate([self.starts[:-1], self.starts[-1] + others.starts])
        return Polylines(np.concatenate([self.points, others.points]), starts)

    def replaced(self, number: int, line: Polylines) -> Polylines:
        """The same with another line in place of one."""
        chosen = np.arange(len(self), dtype=np.int64)
        chosen[number] = len(self)
        return self.and_then(line).some(chosen)

    def reflected(self, twice: float) -> Polylines:
        """Their mirror images, about an axis at half of ``twice``."""
        return Polylines(self.points * (-1.0, 1.0) + (twice, 0.0), self.starts)

    def lengths(self) -> FloatArray:
        """(n,) how long they are."""
        return self._sums(self._lengths, self.owner)

    def bends(self) -> tuple[FloatArray, FloatArray]:
        """(n,) and (n,) how much they turn, in chords of the unit circle, and how much of that where they bend tightly:
        by a radius r it counts 1 / r times."""
        some = np.flatnonzero(self._lengths > 1e-9)
        unit, far, owner = self._way[some] / self._lengths[some, None], self._lengths[some], self.owner[some]
        turn = unit[1:] - unit[:-1]
        chords = lengths(turn)
        chords[owner[1:] != owner[:-1]] = 0.0
        near = np.maximum(np.minimum(far[1:], far[:-1]), _LEAST)
        tight = chords * np.minimum(chords / near, _TIGHTEST)
        return self._sums(chords, owner[1:]), self._sums(tight, owner[1:])

    def extents(self) -> tuple[FloatArray, FloatArray]:
        """(n, 2) and (n, 2) their low and their high corners."""
        return np.minimum.reduceat(self.points, self.starts[:-1]), np.maximum.reduceat(self.points, self.starts[:-1])

    def backward(self) -> FloatArray:
        """(n,) how far they run back along the direction."""
        down = self._way[:, 1]
        back: FloatArray = (self._sums(np.abs(down), self.owner) - np.abs(self._sums(down, self.owner))) / 2
        return back

    def _sums(self, figures: FloatArray, owner: IntArray) -> FloatArray:
        """(n,) the sums of figures by line."""
        return np.bincount(owner, figures, len(self)).astype(np.float64)

    def leave(self, ring: float) -> FloatArray:
        """(n, 2) where they leave the ring round their first points."""
        return _left(self.points, self.starts, self._lines, ring)

    def arrive(self, ring: float) -> FloatArray:
        """(n, 2) where they enter the ring round their last points."""
        starts = len(self.points) - self.starts[::-1]
        return _left(self.points[::-1], starts, (len(self) - 1 - self._lines)[::-1], ring)[::-1]

    def cells(self) -> tuple[IntArray, IntArray]:
        """(k,) and (k,) the cells that they run through, their ends apart, and which line does."""
        places, owner = self.places(STEP, END)
        place = np.floor(places / _CELL).astype(np.int64)
        cells: IntArray = place[:, 0] * _ROW + place[:, 1]
        return cells, owner

    def shared(self, others: Polylines) -> FloatArray:
        """(n,) through how many of its cells each runs where that of the others runs that has its number."""
        (cells, owner), (there, number) = self.cells(), others.cells()
        place = np.unique(np.concatenate([cells, there]), return_inverse=True)[1]
        key = place * len(self) + np.concatenate([owner, number])
        both = np.isin(key[: len(cells)], key[len(cells) :])
        return np.bincount(owner, both, len(self)).astype(np.float64)

    def on(self, mates: Polylines) -> FloatArray:
        """(n,) the largest share of each that runs on one of these, beyond half of what may: a fifth, or less where
        that would be a long way."""
        places, owner = self.places(_FINE, _DISC)
        share = np.zeros(len(self))
        if not len(places):
            return share
        for first, last in pairwise(np.append(mates._segments, len(mates.a)).tolist()):
            # few are near: how far exactly is worked out for these alone
            i, j = close_segments(places, places, mates.a[first:last], mates.b[first:last], _NEAR)
            j += first
            (x, y), (ux, uy) = (places[i] - mates.a[j]).T, mates._way[j].T
            near = np.zeros(len(places), dtype=np.bool_)
            near[i[squared_distances(x, y, ux, uy) < _CLOSE * _CLOSE]] = True
            share = np.maximum(share, np.bincount(owner, near, len(self)))
        share /= np.maximum(np.bincount(owner, minlength=len(self)), 1)
        most = np.minimum(1.0, _RUN / _SHARE / np.maximum(self.lengths() - 2 * _DISC, _FINE))
        beyond: FloatArray = np.maximum(share / most - _SHARE / 2, 0.0)
        return beyond

    def places(self, apart: float, off: float) -> tuple[FloatArray, IntArray]:
        """(k, 2) and (k,) points so far apart along them, no closer than ``off`` to an end, and of which line each."""
        total = self.lengths()
        before = np.concatenate([np.zeros(1), np.cumsum(self._lengths)])
        offset = before[self._segments]
        step = np.maximum(apart, total / _MOST)
        counts = np.ceil((total - 2 * off) / step).astype(np.int64)
        owner, number = ranges(np.zeros_like(counts), counts)
        at = offset[owner] + off + step[owner] * number
        segment = np.clip(np.searchsorted(before, at, side="right") - 1, 0, len(self._lengths) - 1)
        share = (at - before[segment]) / np.maximum(self._lengths[segment], 1e-9)
        return self.a[segment] + share[:, None] * self._way[segment], owner

    def clearances(self, centres: FloatArray, most: float) -> FloatArray:
        """(n,) how close they come to the nearest of centres (c, 2), at most so far."""
        i, j = close_segments(centres, centres, self.a, self.b, most)
        (x, y), (ux, uy) = (centres[i] - self.a[j]).T, self._way[j].T
        least = np.full(len(self), np.inf)
        np.minimum.at(least, self.owner[j], squared_distances(x, y, ux, uy))
        clear: FloatArray = np.minimum(np.sqrt(least), most)
        return clear

    def enter(self, rects: FloatArray) -> BoolArray:
        """(n,) whether they run through any of these rectangles (f, 4)."""
        through: BoolArray = np.logical_or.reduceat(blocked(self.a, self.b, rects), self._segments)
        return through

    def crossed(self, c: FloatArray, d: FloatArray, weight: FloatArray | None = None) -> FloatArray:
        """(n,) how often they cross segments from ``c`` to ``d`` (k, 2), but for where lines meet at their ends; each
        counts 1, or its ``weight`` (k,)."""
        if not len(self.points) or not len(c):
            return np.zeros(len(self))
        weight = np.ones(len(c)) if weight is None else weight
        (x0, y0), (x1, y1) = self.points.min(axis=0), self.points.max(axis=0)
        (cx, cy), (dx, dy) = c.T, d.T
        near = (np.maximum(cx, dx) >= x0) & (np.minimum(cx, dx) <= x1)
        near &= (np.maximum(cy, dy) >= y0) & (np.minimum(cy, dy) <= y1)
        i, j, share = crossings(self.a, self.b, c[near], d[near])
        where, line = self.a[i] + share[:, None] * self._way[i], self.owner[i]
        seen = np.ones(len(i), dtype=np.bool_)
        for end in (self.points[self.starts[:-1]], self.points[self.starts[1:] - 1]):
            x, y = (where - end[line]).T
            seen &= x * x + y * y >= _HIDDEN * _HIDDEN
        return self._sums(weight[near][j[seen]], line[seen])


def polylines(routes: Sequence[Route]) -> Polylines:
    """Routes as lines: a straight piece is one step."""
    return along(*pieces_of(routes), len(routes))


def along(pieces: FloatArray, owner: IntArray, count: int) -> Polylines:
    """So many lines along cubic pieces (p, 4, 2), of which ``owner`` says whose each is."""
    many = np.bincount(owner, minlength=count)
    a, b, c, d = (pieces[:, k] for k in range(4))
    way, one, other = d - a, b - a, c - a
    squared = way[:, 0] * way[:, 0] + way[:, 1] * way[:, 1]
    off = np.maximum(
        np.abs(way[:, 0] * one[:, 1] - way[:, 1] * one[:, 0]), np.abs(way[:, 0] * other[:, 1] - way[:, 1] * other[:, 0])
    )
    points = cubic(pieces[:, None], _T)
    keep: BoolArray = np.zeros((len(pieces), _PARTS), dtype=np.bool_)
    # what ends where it begins has no straight way that it could be
    looped = (squared < 1e-9) & (np.abs(np.concatenate([one, other], axis=1)).max(axis=1) > _STRAIGHT)
    keep[looped | (off > _STRAIGHT * np.maximum(squared, 1e-9))] = True
    keep[:, -1] = True
    # each line begins with the first point of its first piece
    ends = np.cumsum(many)
    counts = np.add.reduceat(keep.sum(axis=1), ends - many) + 1
    starts = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
    whole = np.empty((int(starts[-1]), 2))
    inner = np.ones(len(whole), dtype=np.bool_)
    inner[starts[:-1]] = False
    whole[starts[:-1]], whole[inner] = a[ends - many], points[keep]
    return Polylines(whole, starts)


def _left(points: FloatArray, starts: IntArray, lines: IntArray, ring: float) -> FloatArray:
    first = points[starts[:-1]]
    far = lengths(points - first[lines])
    number = np.arange(len(points), dtype=np.int64)
    beyond = np.where(far >= ring, number, len(points))
    k = np.minimum(np.minimum.reduceat(beyond, starts[:-1]), starts[1:] - 1)
    before = far[k - 1]
    share = np.clip((ring - before) / np.maximum(far[k] - before, 1e-9), 0.0, 1.0)
    left: FloatArray = points[k - 1] + share[:, None] * (points[k] - points[k - 1])
    return left


def crossings(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Which segments from ``a`` to ``b`` cross which from ``c`` to ``d``, and at what share of their way."""
    i, j = close_segments(a, b, c, d, 0.0)
    share, hit = crossing(a[i].T, (b - a)[i].T, c[j].T, (d - c)[j].T)
    return i[hit], j[hit], share


def close_segments(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, by: float) -> tuple[IntArray, IntArray]:
    """Which segments from ``a`` to ``b`` and which from ``c`` to ``d`` have rectangles around them that come as close
    to each other as this, or closer, in order."""
    if not len(a) or not len(c):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    low, high = np.minimum(a, b) - by, np.maximum(a, b) + by
    least, most = np.minimum(c, d), np.maximum(c, d)
    wide = (high - low).sum(axis=0) * len(c) + (most - least).sum(axis=0) * len(a)
    reach = np.concatenate([high, most]).max(axis=0) - np.concatenate([low, least]).min(axis=0)
    # the axis on which fewer share anything
    one = int(wide[0] * reach[1] > wide[1] * reach[0])
    i, j = _overlapping(low[:, one], high[:, one], least[:, one], most[:, one])
    both = (least[j, 1 - one] <= high[i, 1 - one]) & (most[j, 1 - one] >= low[i, 1 - one])
    i, j = i[both], j[both]
    order = np.argsort(i * len(c) + j)
    return i[order], j[order]


def _overlapping(low: FloatArray, high: FloatArray, least: FloatArray, most: FloatArray) -> tuple[IntArray, IntArray]:
    """Which intervals from ``low`` to ``high`` and which from ``least`` to ``most`` share a point: either the second
    begins within the first, or the first within the second."""
    firsts, seconds = np.argsort(low), np.argsort(least)
    i, begun = ranges(np.searchsorted(least[seconds], low), np.searchsorted(least[seconds], high, side="right"))
    j, within = ranges(
        np.searchsorted(low[firsts], least, side="right"), np.searchsorted(low[firsts], most, side="right")
    )
    return np.concatenate([i, firsts[within]]), np.concatenate([seconds[begun], j])
