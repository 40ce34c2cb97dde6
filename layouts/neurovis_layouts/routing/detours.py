"""Detours: the shortest ways round frames and discs, for routes that would run through a foreign frame.

In: walls, centres, two neurons. Out: a route of straight lines and round corners that touches neither, where there is
a way. It bends only at the corners of frames, in one of several lanes around them, and beside discs (a visibility
graph, searched by A*: Hart, Nilsson and Raphael 1968); where a detour runs already, the next one costs more.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from neurovis_layouts.routing.nearby import Nearby
from neurovis_layouts.routing.rounded import rounded
from neurovis_layouts.routing.visibility import MOST, Sight, lengths, runs_along
from neurovis_layouts.routing.walls import Walls, blocked, meet, touch
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.model import Point, Route

#: How far off a frame's lines lanes run, and how far off a disc's centre.
_LANES = (0.16, 0.3, 0.44, 0.58)
_BESIDE = 0.52
#: How close to frames and to centres a line may come: at best, and at all.
_CLEAR = ((0.1, 0.44), (0.02, 0.34))
#: Ways that look longer than the best by this factor are not followed up: a tenth of the work; and where more detours
#: than so many are looked for.
_HASTE, _MORE_HASTE, _MANY = 1.1, 1.3, 60
#: With more frames than this corners see those nearby alone; the haste then, and how many lanes there are.
_CROWD, _MOST_HASTE, _FEW_LANES = 128, 1.5, 2
#: What a bend costs, a lane that is taken already, and a corner that an edge between the same neurons has taken.
_BEND, _TAKEN, _SAME = 0.2, 0.6, 1e6
#: Outwards, from each side of a rectangle.
_OUT = np.array([-1.0, -1.0, 1.0, 1.0])
#: Directions round a disc.
_DIAGONAL = 0.7071067811865476
_QUARTER = np.array([(1, 0), (_DIAGONAL, _DIAGONAL), (0, 1), (-_DIAGONAL, _DIAGONAL)], dtype=np.float64)
_AROUND = np.concatenate([_QUARTER, -_QUARTER])


@dataclass(frozen=True, slots=True)
class _Ground:
    """What is in the way: rectangles (f, 4) and centres (c, 2) to keep ``clear`` of."""

    rects: FloatArray
    discs: FloatArray
    clear: float

    def free(self, a: FloatArray, b: FloatArray) -> BoolArray:
        """(k,) whether the segments from ``a`` to ``b`` (k, 2) are clear of all."""
        found: BoolArray = np.logical_not(blocked(a, b, self.rects))
        found[found] = ~touch(a[found], b[found], self.discs, self.clear).any(axis=0)
        return found

    def clears(self, piece: Route) -> bool:
        """Whether a curve is clear of all."""
        line = np.array(sampled(piece, 0.1), dtype=np.float64)
        low, high = line.min(axis=0) - self.clear, line.max(axis=0) + self.clear
        rects = self.rects[((self.rects[:, :2] < high) & (self.rects[:, 2:] > low)).all(axis=1)]
        discs = self.discs[((self.discs > low) & (self.discs < high)).all(axis=1)]
        return bool(_Ground(rects, discs, self.clear).free(line[:-1], line[1:]).all())


@dataclass(frozen=True, slots=True)
class _Taken:
    """Where detours run: how much it costs to bend at a corner that they bend at, and what stretches of which lines
    across (0: at this x) and along (1: at this y) they run on."""

    corners: dict[Point, float] = field(default_factory=dict)
    lines: dict[tuple[int, float], list[Point]] = field(default_factory=dict)

    def add(self, path: Sequence[Point]) -> None:
        """Add a detour: later ones that use its corners or run along it cost more."""
        for point in path[1:-1]:
            self.corners[point] = self.corners.get(point, 0.0) + _TAKEN
        for a, b in pairwise(path):
            for axis in (0, 1):
                if a[axis] == b[axis]:
                    stretch = min(a[1 - axis], b[1 - axis]), max(a[1 - axis], b[1 - axis])
                    self.lines.setdefault((axis, a[axis]), []).append(stretch)

    def beside(self, at: Point, points: FloatArray) -> FloatArray:
        """(k,) what it costs to run from here straight to points (k, 2), for the stretches shared."""
        times = np.zeros(len(points), dtype=np.int64)
        for axis in (0, 1):
            stretches = self.lines.get((axis, at[axis]))
            on = np.flatnonzero(points[:, axis] == at[axis]) if stretches else ()
            if len(on):
                low, high = np.array(stretches, dtype=np.float64).T
                other, here = points[on, 1 - axis, None], at[1 - axis]
                shared = (np.minimum(other, here) < high) & (np.maximum(other, here) > low)
                times[on] += shared.sum(axis=1)
        costs = np.full(int(times.max(initial=0)) + 1, _TAKEN)
        costs[0] = 0.0
        total: FloatArray = np.cumsum(costs)[times]
        return total


class Detours:
    """Finds detours, one after the other."""

    def __init__(self, walls: Walls, centres: Sequence[Point], lanes: int = len(_LANES), ways: int = 1) -> None:
        """``lanes`` is how many there are around a frame, at most; ``ways`` how many detours will be looked for."""
        many = len(walls.rects) > _CROWD
        self._haste = _MOST_HASTE if many else _HASTE if ways <= _MANY else _MORE_HASTE
        self._walls = walls
        self._centres: FloatArray = np.array(centres, dtype=np.float64).reshape(-1, 2)
        x0, y0, x1, y1 = walls.rects.T
        corners = [
            np.stack([x + right * off, y + down * off, np.full(len(x), right), np.full(len(x), down)], axis=1)
            for off in _LANES[: min(lanes, _FEW_LANES) if many else lanes]
            for x, right in ((x0, -1.0), (x1, 1.0))
            for y, down in ((y0, -1.0), (y1, 1.0))
        ]
        #: (lane and corner, frame, 4): where, and to which sides the corner points
        self._corners: FloatArray = np.stack(corners)
        flat = self._corners.reshape(-1, 4)
        #: what corners see, by how far off frames lines stay
        self._sights = {off: Sight(flat, walls.rects + off * _OUT) for off, _ in _CLEAR}
        #: of many frames, what corners see nearby
        #: (n,) in how many frames each neuron is
        self._depth: IntArray = walls.inside.sum(axis=1)
        free = self._centres[self._depth == 0]
        self._nearby = {o: Nearby(flat, walls.rects + o * _OUT, free, clear) for o, clear in _CLEAR} if many else {}
        #: what it costs to bend at a corner, of many frames
        self._bends: FloatArray = np.full(len(flat), _BEND)
        self._corner = {(x, y): number for number, (x, y) in enumerate(flat[:, :2].tolist())} if many else {}
        self._taken = _Taken()
        self._between: dict[tuple[int, int], list[Point]] = {}

    def route(self, source: int, target: int, alone: bool) -> Route | None:
        """A way round, None where there is none; one that is not ``alone`` between its ends keeps off the straight
        line and off those before it."""
        same = self._between.setdefault((min(source, target), max(source, target)), [])
        path, ground = self._way(source, target, same, alone)
        if path is None:
            return None
        self._taken.add(path)
        same += path[1:-1]
        for point in path[1:-1]:
            if point in self._corner:
                self._bends[self._corner[point]] += _TAKEN
        return rounded(path, ground.clears)

    def folded(self, source: int, target: int, twice: float) -> Route | None:
        """A way round from a neuron to its mirror image (the axis is at half of ``twice``, and what is in the way is
        the same on both sides) that is its own reflection, None where there is none; each keeps off those before it."""
        same = self._between.setdefault((min(source, target), max(source, target)), [])
        path, ground = self._way(source, target, same, False)
        if path is None:
            return None
        side = path[0][0] < twice / 2
        last = next(k for k, point in enumerate(path) if (point[0] < twice / 2) != side) - 1
        (ax, ay), (bx, by) = path[last : last + 2]
        half = path[: last + 1]
        across = np.array([[ax, ay], [twice - ax, ay]])
        if not ground.free(across[:1], across[1:]).all():
            half = [*half, (twice / 2, ay + (by - ay) * (twice / 2 - ax) / (bx - ax))]
        path = [*half, *((twice - x, y) for x, y in half[::-1] if 2 * x != twice)]
        self._taken.add(path)
        same += path[1:-1]
        return rounded(path, ground.clears)

    def longer(self, source: int, target: int) -> float:
        """By how much the way round is longer than the straight one; 0 where there is none. Among many frames all ways
        round are much the same: there it is how long the straight one is."""
        if self._nearby:
            return float(lengths(self._centres[[target]] - self._centres[[source]])[0])
        path, _ = self._way(source, target, (), True)
        if path is None:
            return 0.0
        return math.fsum(distance(a, b) for a, b in pairwise(path)) - distance(path[0], path[-1])

    def _way(self, source: int, target: int, same: Sequence[Point], alone: bool) -> tuple[list[Point] | None, _Ground]:
        """The line that a detour follows, and what is in its way."""
        ends = self._centres[[source, target]]
        bends = {**self._taken.corners, **dict.fromkeys(same, _SAME)}
        foreign = self._walls.foreign(source, target)
        # in no frame but those that hold an end
        inside = self._walls.inside
        loose: BoolArray = inside[:, ~foreign].sum(axis=1) == self._depth
        loose[[source, target]] = False
        frames, discs = np.flatnonzero(foreign), np.flatnonzero(loose)
        for search in (self._past, self._over) if self._nearby else (self._over,):
            for off, clear in _CLEAR:
                whole = _Ground(self._walls.rects[frames] + off * _OUT, self._centres[discs], clear)
                path = search(ends, whole, frames, off, bends, alone)
                if path is not None:
                    return path, whole
        return None, whole

    def _past(
        self,
        ends: FloatArray,
        whole: _Ground,
        frames: IntArray,
        off: float,
        bends: Mapping[Point, float],
        alone: bool,
    ) -> list[Point] | None:
        """A short line round many frames, from one to the next; None where none is found so."""
        if alone and whole.free(ends[:1], ends[1:])[0]:
            return [(x, y) for x, y in ends.tolist()]
        foreign = np.zeros(len(self._walls.rects), dtype=np.bool_)
        foreign[frames] = True
        same = [self._corner[place] for place, cost in bends.items() if cost >= _SAME and place in self._corner]
        extra = self._bends.copy()
        extra[same] += _SAME
        path = self._nearby[off].way(ends, foreign, whole.discs, extra, self._taken.beside, self._haste)
        line = np.array(path or ends.tolist(), dtype=np.float64)
        return path if whole.free(line[:-1], line[1:]).all() else None

    def _over(
        self,
        ends: FloatArray,
        whole: _Ground,
        frames: IntArray,
        off: float,
        bends: Mapping[Point, float],
        alone: bool,
    ) -> list[Point] | None:
        """The shortest line round what is in its way: at first nothing, then whatever the last one ran into."""
        met, touched = np.zeros(len(whole.rects), dtype=np.bool_), np.zeros(len(whole.discs), dtype=np.bool_)
        if not alone:
            met |= meet(ends[:1], ends[1:], whole.rects + _OUT)[0]
        path: list[Point] | None = [(x, y) for x, y in ends.tolist()]
        while path is not None:
            line = np.array(path, dtype=np.float64)
            new = meet(line[:-1], line[1:], whole.rects).any(axis=0) & ~met
            near = touch(line[:-1], line[1:], whole.discs, whole.clear).any(axis=1) & ~touched
            if len(path) > 2 - alone and not (new.any() or near.any()):
                return path
            met, touched = met | new, touched | near
            ground = _Ground(whole.rects[met], whole.discs[touched], whole.clear)
            beside = (ground.discs[:, None, :] + _BESIDE * _AROUND[None, :, :]).reshape(-1, 2)
            beside = np.concatenate([beside, np.zeros_like(beside)], axis=1)
            nodes = np.concatenate([self._corners[:, frames[met]].reshape(-1, 4), beside])
            corners, among = self._corners.shape[:2], np.zeros(self._corners.shape[1], dtype=np.bool_)
            among[frames[met]] = True
            number = (np.arange(corners[0])[:, None] * corners[1] + frames[met][None, :]).reshape(-1)
            free = whole.free(nodes[:, :2], nodes[:, :2])
            known = self._sights[off] if corners[1] <= MOST else None
            graph = _Graph(ends, nodes[free], ground, number[free[: len(number)]], among, known)
            path = _shortest(graph, bends, self._taken, alone, self._haste)
        return None


class _Graph:
    """The ends of a way, corners and places beside discs, in this order: ``points`` (n, 2); from where one sees what.
    ``number`` are the corners' (c,) in ``sight``, ``among`` those of the rectangles that are in the way; without
    ``sight`` all is checked anew."""

    def __init__(
        self,
        ends: FloatArray,
        nodes: FloatArray,
        ground: _Ground,
        number: IntArray,
        among: BoolArray,
        sight: Sight | None,
    ) -> None:
        self.points = np.concatenate([ends, nodes[:, :2]])
        self._sides: FloatArray = np.concatenate([np.zeros((2, 2)), nodes[:, 2:]])
        self._ground, self._known = ground, 0
        if sight is not None:
            self._known = len(number)
            corners = self.points[2 : 2 + self._known]
            # the end and what is beside discs
            others = np.array([1, *range(2 + self._known, len(self.points))])
            a = np.repeat(corners, len(others), axis=0)
            b = np.tile(self.points[others], (len(number), 1))
            along = runs_along(b - a, np.repeat(self._sides[2 : 2 + self._known], len(others), axis=0))
            along &= runs_along(b - a, np.tile(self._sides[others], (len(number), 1)))
            along[along] = ground.free(a[along], b[along])
            self._far = np.zeros((self._known, len(self.points)))
            self._open = np.zeros(self._far.shape, dtype=np.bool_)
            within = slice(2, 2 + self._known)
            self._far[:, within], self._open[:, within] = sight.views(number, among)
            self._far[:, others] = lengths(b - a).reshape(len(number), len(others))
            self._open[:, others] = along.reshape(len(number), len(others))

    def view(self, at: int) -> tuple[FloatArray, BoolArray]:
        """(n,) how far all are from one of them, and to which of them a line may run."""
        if 0 <= at - 2 < self._known:
            return self._far[at - 2], self._open[at - 2]
        way = self.points - self.points[at]
        return lengths(way), runs_along(way, self._sides) & runs_along(way, self._sides[at])

    def clear(self, at: int, to: IntArray) -> IntArray:
        """Those of what it sees which nothing stands in the way to."""
        known = 0 <= at - 2 < self._known
        if not len(to) or (known and not len(self._ground.discs)):
            return to
        here = np.repeat(self.points[at][None, :], len(to), axis=0)
        if known:
            return to[~touch(here, self.points[to], self._ground.discs, self._ground.clear).any(axis=0)]
        return to[self._ground.free(here, self.points[to])]


def _shortest(
    graph: _Graph, bends: Mapping[Point, float], taken: _Taken, alone: bool, haste: float
) -> list[Point] | None:
    """The shortest line from the first end to the second."""
    points = graph.points
    places: list[Point] = [(x, y) for x, y in points.tolist()]
    extra = np.array([0.0, 0.0, *(_BEND + bends.get(place, 0.0) for place in places[2:])])
    ahead = haste * lengths(points - points[1])
    best = np.full(len(points), np.inf)
    best[0] = 0.0
    before = np.zeros(len(points), dtype=np.int64)
    done = np.zeros(len(points), dtype=np.bool_)
    waiting = [(float(ahead[0]), 0)]
    while waiting:
        _, at = heapq.heappop(waiting)
        if at == 1:
            line = [at]
            while line[-1]:
                line.append(int(before[line[-1]]))
            return [places[n] for n in line[::-1]]
        if done[at]:
            continue
        done[at] = True
        far, along = graph.view(at)
        cost = best[at] + far + extra + taken.beside(places[at], points)
        better = np.flatnonzero((cost < best) & ~done & along)
        if at == 0 and not alone:
            better = better[better != 1]
        better = graph.clear(at, better)
        best[better] = cost[better]
        before[better] = at
        for node in better.tolist():
            heapq.heappush(waiting, (float(best[node] + ahead[node]), node))
    return None
