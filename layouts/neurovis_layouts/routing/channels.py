"""Channels: ways between neurons of different frames, row by row through the gaps that discs and frames leave.

In: edges, centres, frames that nothing foreign may run through. Out: waypoints of the edges that run along the
direction, and of those that run across it. A way is the shortest through the free places of every row of discs between
its ends (dynamic programming over rows); ways that share a gap keep apart.
"""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_layouts.routing.curves import Waypoint
from neurovis_spec.layout.model import LayoutEdge, Point

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
Rect: TypeAlias = tuple[float, float, float, float]
Frame: TypeAlias = tuple[frozenset[int], Rect]
_Span: TypeAlias = tuple[float, float]

_DISC, _ROW = 0.45, 0.42
_BESIDE_FRAME = 0.2
#: Rows closer than this are one.
_FINE = 0.15
_INSET = 0.25
_NARROW = 0.3
_APART = 0.22
#: What it costs to share a gap, to squeeze between two discs, and to run across rather than along.
_SHARED, _SQUEEZED, _ACROSS = 1.5, 0.4, 1.25
_LEAST = 0.75
_WALL = 60.0
#: Places tried in a row, about; ways closer than this to the straight line are kept apart from.
_CHOICES, _NEAR, _KEPT = 24, 2.0, 2
#: Where a way is pulled straight, over how many rows, and how close to another.
_FARTHEST, _BESIDE_WAY = 40, 0.12
#: With more edges than this nobody can follow one: they take the straight way.
_MOST = 1500


def channels(
    edges: Mapping[int, LayoutEdge],
    centres: Sequence[Point],
    frames: Sequence[Frame],
    gates: Mapping[int, Sequence[Waypoint]],
) -> tuple[dict[int, list[Waypoint]], dict[int, list[Waypoint]]]:
    """Waypoints of edges by index: of those along the direction, and (x and y exchanged) of those across it. Those with
    ``gates`` run along it, through these, which lie in their order."""
    along: dict[int, list[Waypoint]] = {}
    across: dict[int, list[Waypoint]] = {}
    if len(edges) > _MOST:
        return {i: [] for i in edges}, {}
    down = _Rows(centres, frames)
    side = _Rows([(y, x) for x, y in centres], [(own, (r[1], r[0], r[3], r[2])) for own, r in frames])
    for i, edge in sorted(edges.items(), key=lambda item: (_length(item[1], centres), item[0])):
        if edge.source == edge.target:
            continue
        if gates.get(i):
            path = down.through(edge.source, edge.target, gates[i])
            down.use(path)
            along[i] = down.knots(path, edge.source, edge.target)
            continue
        found = [
            (cost * factor, place, path)
            for place, (rows, factor) in enumerate(((down, 1.0), (side, _ACROSS)))
            for cost, path in [rows.way(edge.source, edge.target)]
        ]
        cost, place, path = min(found, key=lambda item: item[:2])
        if math.isinf(cost):
            continue
        (down, side)[place].use(path)
        (along, across)[place][i] = (down, side)[place].knots(path, edge.source, edge.target)
    return along, across


def _length(edge: LayoutEdge, centres: Sequence[Point]) -> float:
    (ax, ay), (bx, by) = centres[edge.source], centres[edge.target]
    return abs(ax - bx) + abs(ay - by)


class _Rows:
    """Discs and frames by rows, and where ways run already."""

    def __init__(self, centres: Sequence[Point], frames: Sequence[Frame]) -> None:
        self._centres = centres
        self._frames = frames
        self._sorted = sorted((y, x, i) for i, (x, y) in enumerate(centres))
        self._heights = [y for y, _, _ in self._sorted]
        self._used: dict[float, list[float]] = {}
        stops = sorted(set(self._heights) | {y for _, r in frames for y in (r[1], r[3])})
        self._rows: list[float] = []
        for y in stops:
            if not self._rows or y - self._rows[-1] >= _FINE:
                self._rows.append(y)

    def way(self, source: int, target: int) -> tuple[float, list[Point]]:
        """The cost of the best way, infinite where the ends are level, and its points: both ends, one in each row."""
        start, end = self._centres[source], self._centres[target]
        if abs(end[1] - start[1]) < _LEAST:
            return math.inf, []
        if start[1] > end[1]:
            cost, path = self._way(end, start, (source, target))
            return cost, path[::-1]
        return self._way(start, end, (source, target))

    def through(self, source: int, target: int, gates: Sequence[Waypoint]) -> list[Point]:
        """The points of the best way through these gates, from above to below or the other way round."""
        start, end = self._centres[source], self._centres[target]
        if start[1] > end[1]:
            return self.through(target, source, gates[::-1])[::-1]
        path = [start]
        for gate in gates:
            top, bottom = (gate.x, gate.y - gate.half), (gate.x, gate.y + gate.half)
            path += self._way(path[-1], top, (source, target))[1][1:]
            path += [(gate.x, y) for y in self._rows if top[1] + _FINE < y < bottom[1] - _FINE]
            if gate.half > 0:
                path.append(bottom)
        return [*path, *self._way(path[-1], end, (source, target))[1][1:]]

    def _way(self, start: Point, end: Point, own: tuple[int, int]) -> tuple[float, list[Point]]:
        """The cost of the best way down from one point to another, and its points: both ends, one in each row."""
        source, target = own
        rows = [y for y in self._rows if start[1] + _ROW < y < end[1] - _ROW]
        foreign = self._foreign(source, target)
        layers: list[tuple[FloatArray, IntArray]] = []
        cost, across, before = np.zeros(1), np.array([start[0]]), start[1]
        for y in [*rows, end[1]]:
            places, extra = np.array([end[0]]), np.zeros(1)
            if y != end[1]:
                kept = across[np.argsort(cost, kind="stable")[:_KEPT]].tolist()
                places, extra = self._places(self._spans(y, source, target, foreign), y, start, end, kept)
            walls = [(r[0], r[2]) for r in foreign if r[1] <= y and before <= r[3]]
            ways = cost[None, :] + _step(across, places, y - before) + _through(across, places, walls)
            chosen = np.argmin(ways, axis=1)
            layers.append((places, chosen))
            cost, across, before = ways[np.arange(len(places)), chosen] + extra, places, y
        path: list[Point] = []
        k = 0
        for (places, chosen), y in zip(layers[::-1], [end[1], *rows[::-1]], strict=True):
            path.append((float(places[k]), y))
            k = int(chosen[k])
        return float(cost[0]), [start, *path[::-1]]

    def _foreign(self, source: int, target: int) -> list[Rect]:
        return [rect for own, rect in self._frames if source not in own and target not in own]

    def _spans(self, y: float, source: int, target: int, foreign: Sequence[Rect]) -> list[_Span]:
        """What is free in a row."""
        low, high = bisect_left(self._heights, y - _ROW), bisect_left(self._heights, y + _ROW)
        blocked = [(x - _DISC, x + _DISC) for _, x, i in self._sorted[low:high] if i not in (source, target)]
        blocked += [(x0 - _BESIDE_FRAME, x1 + _BESIDE_FRAME) for x0, y0, x1, y1 in foreign if y0 <= y <= y1]
        blocked.sort()
        free: list[_Span] = []
        edge = -math.inf
        for low_x, high_x in blocked:
            if low_x > edge:
                free.append((edge, low_x))
            edge = max(edge, high_x)
        return [*free, (edge, math.inf)]

    def _places(
        self, free: Sequence[_Span], y: float, start: Point, end: Point, kept: Sequence[float]
    ) -> tuple[FloatArray, FloatArray]:
        """Where a way may run through a row, in order, and what that costs: the places nearest to the straight line,
        and straight on from the best ones before (``kept``)."""
        line = start[0] + (end[0] - start[0]) * (y - start[1]) / (end[1] - start[1])
        used = self._used.get(y, [])
        near = used[bisect_left(used, line - _NEAR) : bisect_left(used, line + _NEAR)]
        wishes = [line, start[0], end[0], *(x - _APART for x in near), *(x + _APART for x in near)]
        straight = {x for x in kept if any(low <= x <= high for low, high in free)}
        found: dict[float, float] = {}
        for low, high in sorted(free, key=lambda span: (max(span[0] - line, line - span[1], 0.0), span)):
            inset = min(_INSET, (high - low) / 2)
            if len(found) > _CHOICES and not any(low <= x <= high for x in straight):
                continue
            for wish in [*wishes, low + inset, high - inset, *(x for x in kept if low <= x <= high)]:
                x = min(max(wish, low + inset), high - inset)
                if math.isfinite(x) and x not in found:
                    beside = used[bisect_left(used, x - _APART) : bisect_left(used, x + _APART)]
                    crowd = sum(1 - abs(x - other) / _APART for other in beside)
                    found[x] = _SHARED * crowd + (_SQUEEZED if high - low < _NARROW else 0.0)
        places = sorted(found)
        return np.array(places), np.array([found[x] for x in places])

    def use(self, path: Sequence[Point]) -> None:
        """Note where a way runs."""
        for x, y in path[1:-1]:
            insort(self._used.setdefault(y, []), x)

    def knots(self, path: Sequence[Point], source: int, target: int) -> list[Waypoint]:
        """The points of a way at which it bends; what lies on a line that is free is left out."""
        foreign = self._foreign(source, target)
        free = [self._spans(y, source, target, foreign) for _, y in path]
        knots: list[Waypoint] = []
        at = 0
        while at < len(path) - 1:
            reach = next(
                n
                for n in range(min(len(path) - 1, at + _FARTHEST), at, -1)
                if n == at + 1 or self._clear(path, free, at, n)
            )
            if reach < len(path) - 1:
                x, y = path[reach]
                narrow = any(low <= x <= high and high - low < 1.2 for low, high in free[reach])
                knots.append(Waypoint(x, y, 0.2 if narrow else 0.0))
            at = reach
        return _spaced(knots)

    def _clear(self, path: Sequence[Point], free: Sequence[Sequence[_Span]], at: int, to: int) -> bool:
        (ax, ay), (bx, by) = path[at], path[to]
        for n in range(at + 1, to):
            y = path[n][1]
            x = ax + (bx - ax) * (y - ay) / (by - ay)
            if abs(x - path[n][0]) > 0.6 or not any(low <= x <= high for low, high in free[n]):
                return False
            used = self._used.get(y, [])
            beside = used[bisect_left(used, x - _BESIDE_WAY) : bisect_left(used, x + _BESIDE_WAY)]
            if any(other != path[n][0] for other in beside):
                return False
        return True


def _through(a: FloatArray, b: FloatArray, walls: Sequence[_Span]) -> FloatArray:
    """What it costs to run from one side of frames to the other between two rows: (to b, from a)."""
    low, high = np.minimum(a[None, :], b[:, None]), np.maximum(a[None, :], b[:, None])
    total = np.zeros(low.shape)
    for x0, x1 in walls:
        total += _WALL * ((low <= x0) & (x1 <= high))
    return total


def _step(a: FloatArray, b: FloatArray, dy: float) -> FloatArray:
    """What it costs to get from one row to the next: its length, and more where it is flat: (to b, from a)."""
    squared = (b[:, None] - a[None, :]) ** 2
    result: FloatArray = np.sqrt(squared + dy * dy) + 0.12 * squared / max(dy, 0.1)
    return result


def _spaced(knots: list[Waypoint]) -> list[Waypoint]:
    """Knots are straight as far as there is room to their neighbours."""
    result = list(knots)
    for i, (a, b) in enumerate(pairwise(knots)):
        room = abs(b.y - a.y) / 2 - 0.05
        if a.half > room:
            result[i] = Waypoint(a.x, a.y, 0.0)
        if b.half > room:
            result[i + 1] = Waypoint(b.x, b.y, 0.0)
    return result
