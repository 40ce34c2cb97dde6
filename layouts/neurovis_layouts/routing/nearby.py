"""Nearby: ways round many frames, from corner to corner among those that are near each other.

In: frames, the corners around them, discs; two ends. Out: a line between the ends that bends at corners and enters no
foreign frame. What a corner sees of the corners around the frames next to it is found once, when a search first comes
by, and serves all searches; so the work for a way does not grow with the number of frames.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from neurovis_layouts.routing.visibility import lengths, runs_along
from neurovis_layouts.routing.walls import meetings, touch
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.model import Point

#: A corner sees what is around so many of the nearest frames.
_FRAMES = 24


class View(NamedTuple):
    """What is seen from a place: corners (k,), how far they are, and for each the frames (k, g) that the line there
    leads into or out of, past the last of which stands the number of frames."""

    corners: IntArray
    far: FloatArray
    gates: IntArray


class Nearby:
    """Corners (c, 4), of which every f-th is one of a frame's, among rectangles (f, 4) and discs (d, 2)."""

    def __init__(self, corners: FloatArray, rects: FloatArray, discs: FloatArray, clear: float) -> None:
        self.points, self._sides = corners[:, :2], corners[:, 2:]
        self._rects, self._discs, self._clear = rects, discs, clear
        self._of_frame: IntArray = np.arange(len(corners), dtype=np.int64).reshape(-1, len(rects))
        self._views: dict[int, View] = {}

    def view(self, corner: int) -> View:
        """What a corner sees."""
        if corner not in self._views:
            self._views[corner] = self.look(self.points[corner], self._sides[corner], self._discs)
        return self._views[corner]

    def look(self, here: FloatArray, side: FloatArray, discs: FloatArray) -> View:
        """What is seen from a place, lines keeping off these discs."""
        x, y = np.maximum(np.maximum(self._rects[:, :2] - here, here - self._rects[:, 2:]), 0.0).T
        frames = np.argsort(x * x + y * y, kind="stable")[:_FRAMES]
        corners = self._of_frame[:, frames].reshape(-1)
        way = self.points[corners] - here
        along = runs_along(way, self._sides[corners]) & runs_along(way, side)
        along &= (way != 0).any(axis=1)
        corners, way = corners[along], way[along]
        there = self.points[corners]
        low, high = np.minimum(there.min(axis=0), here), np.maximum(there.max(axis=0), here)
        near = np.flatnonzero(((self._rects[:, :2] < high) & (self._rects[:, 2:] > low)).all(axis=1))
        line, number = meetings(np.repeat(here[None, :], len(there), axis=0), there, self._rects[near])
        frame: IntArray = near[number]
        gate: BoolArray = self._within(here[None, :], frame) | self._within(there[line], frame)
        seen: BoolArray = np.ones(len(there), dtype=np.bool_)
        seen[line[~gate]] = False
        close: FloatArray = discs[((discs > low - self._clear) & (discs < high + self._clear)).all(axis=1)]
        some = np.flatnonzero(seen)
        if len(close):
            over = touch(np.repeat(here[None, :], len(some), axis=0), there[some], close, self._clear)
            seen[some] = np.logical_not(over.any(axis=0))
        times = np.bincount(line, minlength=len(there))
        gates = np.full((len(there), int(times[seen].max(initial=0))), len(self._rects), dtype=np.int64)
        for place in np.flatnonzero(seen & (times > 0)).tolist():
            own = frame[line == place]
            gates[place, : len(own)] = own
        return View(corners[seen], lengths(way[seen]), gates[seen])

    def _within(self, points: FloatArray, frames: IntArray) -> BoolArray:
        """(k,) whether points are in rectangles."""
        rects = self._rects[frames]
        within: BoolArray = np.all((points > rects[:, :2]) & (points < rects[:, 2:]), axis=1)
        return within

    def way(
        self,
        ends: FloatArray,
        foreign: BoolArray,
        discs: FloatArray,
        extra: FloatArray,
        beside: Callable[[Point, FloatArray], FloatArray],
        haste: float,
    ) -> list[Point] | None:
        """The shortest line from the first of the ends (2, 2) to the second, with one corner at least; ``discs`` are
        those around the ends, ``extra`` (c,) is what it costs to bend at a corner,
        ``beside`` to run from a place to others."""
        own = np.append(~foreign, True)
        nowhere = np.zeros(2)
        first, last = (self.look(end, nowhere, discs) for end in ends)
        home = dict(zip(_open(last, own)[0].tolist(), _open(last, own)[1].tolist(), strict=True))
        count = len(self.points)
        best = np.full(count + 1, np.inf)
        before = np.full(count + 1, -1, dtype=np.int64)
        done = np.zeros(count + 1, dtype=np.bool_)
        waiting: list[tuple[float, int]] = []

        def spread(at: int, place: FloatArray, reached: float, view: View) -> None:
            corners, far = _open(view, own)
            cost = reached + far + extra[corners]
            better = (cost < best[corners]) & ~done[corners]
            corners, cost = corners[better], cost[better]
            cost += beside((float(place[0]), float(place[1])), self.points[corners])
            better = cost < best[corners]
            corners, cost = corners[better], cost[better]
            best[corners], before[corners] = cost, at
            ahead = haste * lengths(self.points[corners] - ends[1])
            for total, corner in zip((cost + ahead).tolist(), corners.tolist(), strict=True):
                heapq.heappush(waiting, (total, corner))
            if at in home and reached + home[at] < best[count]:
                best[count], before[count] = reached + home[at], at
                heapq.heappush(waiting, (float(best[count]), count))

        spread(-1, ends[0], 0.0, first)
        while waiting:
            _, at = heapq.heappop(waiting)
            if at == count:
                line = [int(before[count])]
                while before[line[-1]] >= 0:
                    line.append(int(before[line[-1]]))
                points = [ends[0], *(self.points[corner] for corner in line[::-1]), ends[1]]
                return [(float(x), float(y)) for x, y in points]
            if not done[at]:
                done[at] = True
                spread(at, self.points[at], float(best[at]), self.view(at))
        return None


def _open(view: View, own: BoolArray) -> tuple[IntArray, FloatArray]:
    """The corners of a view to which no line leads into or out of a frame that is not an end's own."""
    if not view.gates.shape[1]:
        return view.corners, view.far
    free = own[view.gates].all(axis=1)
    return view.corners[free], view.far[free]
