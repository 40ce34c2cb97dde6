"""Detours: the shortest ways round what a route would run into: foreign frames, and the discs of other neurons.

In: routes that are drawn, what is in the way. Out: for those that run into it routes of straight lines and round
corners that touch neither, where there is a way. A disc is a frame with one neuron in it. A way bends only at the
corners of frames, in one of several lanes around them (a visibility graph, searched by A*: Hart, Nilsson and Raphael
1968), and crosses few lines; only those frames are considered that a shorter way runs into, from a corner only those
nearest to it. Where a detour runs already, the next one costs more.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from neurovis_layouts.routing.corners import rounded
from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.obstacles import TOUCH, Barriers, Walls, blocked, meet
from neurovis_layouts.routing.polylines import crossings, polylines
from neurovis_layouts.routing.route_cost import ALONG, BENDING, ENTERING
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import distance, lengths
from neurovis_spec.layout.model import RADIUS, LayoutEdge, Point, Route

#: How far off a frame's border lanes run.
_LANES = (0.16, 0.3, 0.44, 0.58)
#: How close to frames a line may come: at best, and at all.
_CLEAR = (0.1, 0.02)
#: Between a frame and the one around it nothing runs where there is less room than this.
_NARROW = 0.6
#: Ways that look longer than the best by this factor are not followed up: a fifth of the work among 400 frames (with
#: 1.2 a hundredth fewer crossings in dense networks).
_HASTE = 1.5
#: What it costs to cross a line, in units of length (without: 10 % more crossings in drawings with frames), and, by its
#: own length, all that the straight way crosses: a way round a bundle is worse than one more line in it (without: what
#: drives a layer back goes round its box; with 1: a quarter more crossings in the hexapod at other spacings).
_CROSSING, _CROSSED = 4.0, 2.0
#: What it costs to turn at a corner, by the chord of the turn: a right angle is a unit and a half of length (without:
#: 3 % more crossings among 30 coupled instances, and kinks; with twice as much a sixth more work).
_TURNING = 1.0
#: The product of two lengths, across and along, that is nothing: coordinates are multiples of 1/1024, about.
_NOTHING = 1e-7
#: With more lines than this, times those that go round something, nobody counts how often they cross.
_MOST_CROSSED = 5000
#: From more corners than this nobody counts either: where discs stand in rows, ways among them took 18 s.
_MOST_SEEN_FROM = 1000
#: From a corner so many of the nearest frames are seen.
_NEAREST = 24
#: Outwards, from each side of a rectangle, and from its corners.
_OUT = np.array([-1.0, -1.0, 1.0, 1.0])
_CORNERS = ((0, 1), (0, 3), (2, 1), (2, 3))
#: The corners of all lanes: how far off, and which corner.
_AROUND = tuple((off, corner) for off in _LANES for corner in _CORNERS)
#: What comes this close to a disc may be measured to run over it.
_BARELY = 0.01


def detoured(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    routes: Mapping[int, Route],
    barriers: Barriers,
    ways: Mapping[int, Sequence[Point]],
    drawn: Sequence[Route],
    most: int,
) -> dict[int, Route]:
    """Detours by edge index for the routes that enter foreign frames or run over discs, where there are some: first
    those between the farthest neurons, which so take the inner lanes round what they share with others. What has a way
    already, from point to point, goes round what is in the way between two of these alone, if none is in a
    frame. Others cross few lines, of the routes that can stay and of those that are ``drawn``.
    Where more than ``most`` run over discs, detours would only move the crowd: these stay."""
    chosen = sorted(routes)
    own = [(edges[i].source, edges[i].target) for i in chosen]
    entered = barriers.frames.entered([routes[i] for i in chosen], own)
    clear = barriers.discs.clearances([routes[i] for i in chosen], own)
    crowd = sum(near < TOUCH + _BARELY and not enters for near, enters in zip(clear, entered, strict=True)) > most
    wrong = [
        (-distance(*(centres[end] for end in ends)), i, enters, clearance)
        for i, ends, enters, clearance in zip(chosen, own, entered, clear, strict=True)
        if enters or (clearance < TOUCH + _BARELY and not crowd)
    ]
    if not wrong:
        return {}
    between, found = by_ends(enumerate(edges)), dict[int, Route]()
    right = [routes[i] for i in sorted(routes.keys() - {i for _, i, _, _ in wrong})]
    few = (len(routes) + len(drawn)) * len(wrong) <= _MOST_CROSSED
    detours = Detours(barriers.frames, centres, [*right, *drawn] if few else None)
    for _, i, enters, clearance in sorted(wrong):
        ends = edges[i].source, edges[i].target
        route = detours.route(*ends, len(between[frozenset(ends)]) == 1, ways.get(i, ()))
        if route is not None and (enters or barriers.discs.clearance(route, ends) > clearance):
            found[i] = route
    return found


@dataclass(frozen=True, slots=True)
class _Taken:
    """Where detours run: what stretches of which lines across (0: at this x) and along (1: at this y) they run on. Each
    stretch that is shared costs what a unit ``ALONG`` another line does."""

    lines: dict[tuple[int, float], list[Point]] = field(default_factory=dict)

    def add(self, path: Sequence[Point]) -> None:
        """Add a detour: later ones that run along it cost more."""
        for a, b in pairwise(path):
            for axis in (0, 1):
                if a[axis] == b[axis]:
                    stretch = min(a[1 - axis], b[1 - axis]), max(a[1 - axis], b[1 - axis])
                    self.lines.setdefault((axis, a[axis]), []).append(stretch)

    def beside(self, at: Point, x: FloatArray, y: FloatArray) -> FloatArray:
        """(k,) what it costs to run from here straight to points (x, y), for the stretches shared."""
        times = np.zeros(len(x), dtype=np.int64)
        for axis, along, off in ((0, y, x), (1, x, y)):
            stretches = self.lines.get((axis, at[axis]))
            if stretches:
                on = np.flatnonzero(off == at[axis])
                low, high = np.array(stretches, dtype=np.float64).T
                other, here = along[on, None], at[1 - axis]
                shared = (np.minimum(other, here) < high) & (np.maximum(other, here) > low)
                times[on] += shared.sum(axis=1)
        return ALONG * times.astype(np.float64)


@dataclass(frozen=True, slots=True)
class _Around:
    """What a way goes round: rectangles ``rects`` (f, 4), the same as far as it keeps off them ``whole``, the
    ``corners`` (c, f, 2) of all lanes around them, and how much it costs to bend at each, ``bends`` (c, f)."""

    rects: FloatArray
    whole: FloatArray
    corners: FloatArray
    bends: FloatArray

    def some(self, chosen: BoolArray) -> _Around:
        """Some of the rectangles."""
        return _Around(self.rects[chosen], self.whole[chosen], self.corners[:, chosen], self.bends[:, chosen])


class Detours:
    """Finds detours, one after the other."""

    def __init__(self, walls: Walls, centres: Sequence[Point], lines: Sequence[Route] | None) -> None:
        """``lines`` are there, to be crossed as little as can be; so are detours then, from the first one on."""
        self._walls = walls
        self._lines = None if lines is None else polylines(lines)
        self._centres: FloatArray = np.array(centres, dtype=np.float64).reshape(-1, 2)
        #: the frames, and behind them the discs
        self._rects: FloatArray = np.concatenate([_closed(walls), np.tile(self._centres, 2) + RADIUS * _OUT])
        #: (n, f) which neurons stand in which of their frames: beside the frames that are labels
        x, y = self._centres.T[:, :, None]
        x0, y0, x1, y1 = walls.rects.T
        self._standing: BoolArray = walls.inside & (x > x0) & (x < x1) & (y > y0) & (y < y1)
        #: (c, f, 2) the corners of all lanes around each rectangle, (c, f) how much it costs to bend there: more at
        #: those that detours bend at already
        self._corners: FloatArray = np.stack([self._rects[:, at] + off * _OUT[list(at)] for off, at in _AROUND])
        self._bends: FloatArray = np.full(self._corners.shape[:2], BENDING)
        self._taken = _Taken()
        #: from how many corners ways have been sought
        self._seen_from = 0
        self._between: dict[tuple[int, int], list[Point]] = {}

    def route(self, source: int, target: int, alone: bool, by: Sequence[Point] = ()) -> Route | None:
        """A way round, ``by`` these points if there is one, None where there is none at all; one that is not ``alone``
        between its ends and has no such points keeps off the straight line and off those before it."""
        if self._seen_from > _MOST_SEEN_FROM:
            self._lines = None
        found = (self._line(source, target, True, by) if by else None) or self._line(source, target, alone)
        if found is None:
            return None
        path, rects = found
        self._taken.add(path)
        for point in path[1:-1]:
            self._bends[(self._corners == point).all(axis=2)] += ALONG
        self._between.setdefault((min(source, target), max(source, target)), []).extend(path[1:-1])
        route = rounded(path, rects)
        if self._lines is not None:
            self._lines = self._lines.and_then(polylines([route]))
        return route

    def _line(
        self, source: int, target: int, alone: bool, by: Sequence[Point] = ()
    ) -> tuple[list[Point], FloatArray] | None:
        """The line that a detour follows, ``by`` these points, and what it keeps off."""
        ends = self._centres[[source, target]]
        stops = np.concatenate([ends[:1], np.array(by, dtype=np.float64).reshape(-1, 2), ends[1:]])
        foreign = self._walls.foreign(source, target)
        # discs in foreign frames are behind the borders of these
        loose: BoolArray = self._standing[:, foreign].sum(axis=1) == 0
        loose[[source, target]] = False
        chosen = np.concatenate([foreign, loose])
        rects, corners, bends = self._rects[chosen], self._corners[:, chosen], self._bends[:, chosen]
        # of all between the same ends each bends at corners of its own
        for point in self._between.get((min(source, target), max(source, target)), ()):
            bends[(corners == point).all(axis=2)] = BENDING + ENTERING
        for clear in _CLEAR:
            around = _Around(rects, rects + clear * _OUT, corners, bends)
            path: list[Point] = []
            for k, hit in enumerate(meet(stops[:-1], stops[1:], around.whole)):
                leg = self._round(stops[k : k + 2], hit, around, alone)
                if leg is None:
                    break
                path += leg if k == 0 else leg[1:]
            else:
                return path, around.whole
        return None

    def _round(self, ends: FloatArray, hit: BoolArray, around: _Around, alone: bool) -> list[Point] | None:
        """The shortest line round what is in its way: at first what the straight line has ``hit``, then whatever the
        last one ran into."""
        if alone and not hit.any():
            return [(x, y) for x, y in ends.tolist()]
        met = hit if alone else hit | meet(ends[:1], ends[1:], around.rects + _OUT)[0]
        while path := self._shortest(ends, around.some(met), alone):
            line = np.array(path, dtype=np.float64)
            new = meet(line[:-1], line[1:], around.whole).any(axis=0) & ~met
            if len(path) > 2 - alone and not new.any():
                return self._pulled(path, around.whole, alone)
            met |= new
        return None

    def _pulled(self, path: list[Point], rects: FloatArray, alone: bool) -> list[Point]:
        """The line without corners at which it turns back, as it may between two of one rectangle though each leg is
        taut, where it enters nothing and crosses no more lines without them."""
        k = 1
        while k < len(path) - 1 and len(path) > 3 - alone:
            before, here, behind = np.array(path[k - 1 : k + 2], dtype=np.float64)
            back = (here - before) @ (behind - here) < 0
            if back and self._may_run(np.stack([before, here, before]), np.stack([here, behind, behind]), rects):
                path = path[:k] + path[k + 1 :]
            else:
                k += 1
        return path

    def _may_run(self, a: FloatArray, b: FloatArray, rects: FloatArray) -> bool:
        """Whether the third of these legs enters nothing and crosses no more lines than the first two together."""
        if meet(a[2:], b[2:], rects).any():
            return False
        if self._lines is None:
            return True
        which, _, _ = crossings(a, b, self._lines.a, self._lines.b)
        return bool(np.count_nonzero(which == 2) <= np.count_nonzero(which < 2))

    def _price(self, ends: FloatArray) -> float:
        """What it costs to cross a line on the way between two ends."""
        if self._lines is None:
            return 0.0
        many = len(crossings(ends[:1], ends[1:], self._lines.a, self._lines.b)[0])
        return min(_CROSSING, _CROSSED * float(lengths(ends[1:] - ends[:1])[0]) / max(many, 1))

    def _shortest(self, ends: FloatArray, around: _Around, alone: bool) -> list[Point] | None:
        """The shortest line from the first end to the second by way of corners, which enters none of the rectangles."""
        corners = _Corners(ends, around)
        points = corners.points
        extra = np.concatenate([np.zeros(2), around.bends.ravel()])
        ahead = _HASTE * lengths(points - points[1])
        best = np.full(len(points), np.inf)
        best[0] = 0.0
        price = self._price(ends)
        before = np.zeros(len(points), dtype=np.int64)
        done = np.zeros(len(points), dtype=np.bool_)
        waiting = [(float(ahead[0]), 0)]
        while waiting:
            _, at = heapq.heappop(waiting)
            if at == 1:
                return [corners.place(n) for n in _line_to(before, at)]
            if done[at]:
                continue
            done[at] = True
            self._seen_from += 1
            to, here = corners.near(at), corners.place(at)
            dx, dy = corners.x[to] - here[0], corners.y[to] - here[1]
            far = np.sqrt(dx * dx + dy * dy)
            cost = best[at] + far + extra[to]
            if at:
                ux, uy = _unit(corners.place(int(before[at])), here)
                cost += _TURNING * np.sqrt(np.maximum(2 - 2 * (dx * ux + dy * uy) / np.maximum(far, _NOTHING), 0.0))
            cost += self._taken.beside(here, corners.x[to], corners.y[to])
            better = (cost < best[to]) & ~done[to]
            if at == 0 and not alone:
                better &= to != 1
            seen = np.flatnonzero(better)
            seen = seen[corners.sees(at, to[seen], dx[seen] * dy[seen])]
            to, cost = to[seen], cost[seen]
            if self._lines is not None:
                start = np.repeat(points[None, at], len(to), axis=0)
                which, _, _ = crossings(start, points[to], self._lines.a, self._lines.b)
                cost += price * np.bincount(which, minlength=len(to))
                better = cost < best[to]
                to, cost = to[better], cost[better]
            best[to] = cost
            before[to] = at
            for node in to.tolist():
                heapq.heappush(waiting, (float(best[node] + ahead[node]), node))
        return None


def _line_to(before: IntArray, end: int) -> list[int]:
    """The points on the way to one, from the first on; ``before`` is the one before each."""
    line = [end]
    while line[-1]:
        line.append(int(before[line[-1]]))
    return line[::-1]


def _closed(walls: Walls) -> FloatArray:
    """(f, 4) the frames, each as far as the border of the frame around it where nothing could run between the two
    without lying on one of them."""
    rects = walls.rects.copy()
    held = walls.inside.T.astype(np.int64)
    for number in np.argsort(-held.sum(axis=1), kind="stable").tolist():
        around = (held @ held[number] == held[number].sum()) & (held.sum(axis=1) > held[number].sum())
        for outer in rects[around]:
            narrow = (walls.rects[number] - outer) * -_OUT < _NARROW
            rects[number] = np.where(narrow, outer, rects[number])
    return rects


class _Corners:
    """Both ends of a way, and the corners around what it goes round, behind each other: ``points`` (n, 2), which are
    (``x``, ``y``)."""

    def __init__(self, ends: FloatArray, around: _Around) -> None:
        self._rects, self._whole = around.rects, around.whole
        self.points: FloatArray = np.concatenate([ends, around.corners.reshape(-1, 2)])
        self.x, self.y = np.ascontiguousarray(self.points.T)
        #: whether a corner points to both sides in the same sense (1), or not (-1); the ends to none (0)
        senses = np.array([_OUT[x] * _OUT[y] for _, (x, y) in _AROUND])
        self._senses: FloatArray = np.concatenate([np.zeros(2), np.repeat(senses, len(around.rects))])
        self._others = np.arange(1, len(self.points), dtype=np.int64)

    def place(self, at: int) -> Point:
        """Where a point is."""
        return self.x.item(at), self.y.item(at)

    def near(self, at: int) -> IntArray:
        """The second end, and the corners around the rectangles that are nearest to a point."""
        here, rects = self.points[at], self._rects
        if len(rects) <= _NEAREST:
            return self._others
        x, y = np.maximum(np.maximum(rects[:, :2] - here, here - rects[:, 2:]), 0.0).T
        chosen = np.sort(np.argsort(x * x + y * y, kind="stable")[:_NEAREST])
        around = np.arange(len(_AROUND), dtype=np.int64)[:, None] * len(rects) + chosen
        return np.concatenate([np.ones(1, dtype=np.int64), around.ravel() + 2])

    def sees(self, at: int, to: IntArray, slant: FloatArray) -> BoolArray:
        """(k,) whether a line may run from a point to these, in order: clear of the rectangles, and taut at both ends;
        ``slant`` (k,) is how far that is across times how far it is along."""
        # a taut string runs along a corner, neither to it from the front nor through it
        seen: BoolArray = (slant * self._senses[to] <= _NOTHING) & (slant * self._senses[at] <= _NOTHING)
        chosen = np.flatnonzero(seen)
        # the second end may be far away, the corners are not: of many rectangles few are near these
        ends = int(len(self._whole) > _NEAREST and len(chosen) > 0 and to[chosen[0]] == 1)
        for line in (chosen[:ends], chosen[ends:]):
            seen[line] = ~blocked(self.points[at : at + 1], self.points[to[line]], self._whole)
        return seen


def _unit(a: Point, b: Point) -> Point:
    """The way from one point to another, of length 1; none where they are one."""
    far = distance(a, b) or 1.0
    return (b[0] - a[0]) / far, (b[1] - a[1]) / far
