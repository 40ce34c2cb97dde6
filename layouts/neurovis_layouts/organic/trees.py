"""Trees: parts without a ring are drawn without a crossing, and no connection runs over a disc.

In: a wiring, or the links of a tree and which end of each is above. Out: places. Points as far from the root share a
row, subtrees lie side by side as close as their outlines allow (Reingold and Tilford 1981). Where all runs away from
the root, or all to it, rows run across the direction; otherwise along it, to both sides of the root, and each point
stands between its neighbours above and those below it, so that everything runs down all the same. A star is a fan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from neurovis_layouts.wiring import Wiring
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import turn

#: In steps: how far rows are apart at least, and how far links keep off the discs beside their ends.
_ROW, _CLEAR = 1.2, 0.36
#: How deep a tree is on one side of its root, by its length, if rows need not be farther apart for that than by this
#: factor.
_HALF, _STRETCH = 0.4, 2.5
#: From so many points on a star is a fan.
_FAN = 16
#: How far two rows of a fan are from each other.
_TIERS = 0.8
#: A tree of more points than this is left to others if it is so many times as long as it is deep.
_FEW, _LONGEST = 120, 40.0

#: Neighbours of each point: which, and 1 where that is below, −1 above, 0 where it may be either.
Neighbours = Sequence[Sequence[tuple[int, int]]]


def trees_of(wiring: Wiring, part: IntArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """The parts of a wiring that are trees, hubs and mirror images aside, each with its places (n, 2), in steps: not
    those that are far longer than deep, chains above all, which fill a plane better otherwise."""
    count = int(part.max(initial=-1)) + 1
    sizes = np.bincount(part, minlength=count)
    is_tree = (sizes > 1) & (np.bincount(part[wiring.a], minlength=count) == sizes - 1)
    is_tree[part[wiring.neurons :]] = False
    is_tree[part[wiring.image != np.arange(wiring.count)]] = False
    order = np.argsort(part, kind="stable")
    place = np.zeros(wiring.count, dtype=np.int64)
    place[order] = np.arange(wiring.count) - np.searchsorted(part[order], part[order])
    keys = wiring.above * np.int64(wiring.count) + wiring.below
    way = np.isin(wiring.a * np.int64(wiring.count) + wiring.b, keys).astype(np.int64)
    way -= np.isin(wiring.b * np.int64(wiring.count) + wiring.a, keys)
    links: list[list[tuple[int, int, int]]] = [[] for _ in range(count)]
    of = zip(part[wiring.a].tolist(), place[wiring.a].tolist(), place[wiring.b].tolist(), way.tolist(), strict=True)
    for number, a, b, side in of:
        links[number].append((a, b, side))
    begin = np.cumsum(sizes) - sizes
    for number in np.flatnonzero(is_tree).tolist():
        near: list[list[tuple[int, int]]] = [[] for _ in range(sizes[number])]
        for a, b, side in links[number]:
            near[a].append((b, side))
            near[b].append((a, -side))
        places = tree_places(near)
        short, long = sorted(np.ptp(places, axis=0).tolist())
        if len(near) <= _FEW or long <= _LONGEST * short:
            yield order[begin[number] : begin[number] + sizes[number]], places


def tree_places(near: Neighbours) -> FloatArray:
    """Places (n, 2) of a tree's points, neighbours in a row a step apart."""
    count = len(near)
    hub = max(range(count), key=lambda i: (len(near[i]), -i))
    if count >= _FAN and len(near[hub]) == count - 1:
        return _fan(hub, near)
    for side in (1, -1):
        # nothing, or all of it, runs to the root
        roots = [i for i in range(count) if all(way in (side, 0) for _, way in near[i])]
        inner = [i for i in range(count) if sum(way == -side for _, way in near[i]) > 1]
        if len(roots) == 1 and not inner:
            rows = _Rows(near, roots[0], near[roots[0]], _over_the_middle)
            return np.stack([rows.along, side * _apart(rows.away, rows.along, _HALF)], axis=1)
    root = _middle(near)
    halves = _halves(near, root)
    places = np.zeros((count, 2))
    for sign, half in zip((1.0, -1.0), halves, strict=True):
        rows = _Rows(near, root, half, _between)
        places += np.stack([sign * rows.away, rows.along], axis=1)
    return np.stack([_apart(places[:, 0], places[:, 1], 2 * _HALF), places[:, 1]], axis=1)


def _apart(away: FloatArray, along: FloatArray, share: float) -> FloatArray:
    """Rows farther apart where all of them take less than this share of how long they are."""
    deep, long = float(np.ptp(away)), float(np.ptp(along))
    return away * float(np.clip(share * long / max(deep, 1e-9), 1.0, _STRETCH))


def _fan(hub: int, near: Neighbours) -> FloatArray:
    """The points around the hub on half circles below it and above it, every second one farther out."""
    places = np.zeros((len(near), 2))
    for side in (1, -1):
        others = [other for other, way in near[hub] if (way or 1) == side]
        radius = max(_CLEAR * (len(others) + 1) / math.pi, 2 * _ROW)
        for i, other in enumerate(others):
            (cosine, sine), reach = turn((i + 1) / (2 * len(others) + 2)), radius + _TIERS * (i % 2)
            places[other] = (-reach * cosine, side * reach * sine)
    return places


def _middle(near: Neighbours) -> int:
    """The point from which the farthest is nearest."""
    one = _farthest(near, 0)
    origin = dict(_walk(near, one))
    way = [_farthest(near, one)]
    while way[-1] != one:
        way.append(origin[way[-1]])
    return way[len(way) // 2]


def _farthest(near: Neighbours, root: int) -> int:
    far = {root: 0}
    for point, origin in _walk(near, root)[1:]:
        far[point] = far[origin] + 1
    return max(far, key=lambda i: (far[i], -i))


def _walk(near: Neighbours, root: int, first: Sequence[tuple[int, int]] | None = None) -> list[tuple[int, int]]:
    """Points in an order in which each comes after the one that it is reached from, with that (the root's own); from
    the root to all of its neighbours, or to the ``first`` alone."""
    found = [(root, root)]
    for point, origin in found:
        ways = near[point] if point != root or first is None else first
        found += [(other, point) for other, _ in ways if other != origin]
    return found


def _halves(near: Neighbours, root: int) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """The root's neighbours in two halves that hold about as many points."""
    size = [1] * len(near)
    for point, origin in reversed(_walk(near, root)[1:]):
        size[origin] += size[point]
    halves: tuple[list[tuple[int, int]], list[tuple[int, int]]] = ([], [])
    held = [0, 0]
    for neighbour in sorted(near[root], key=lambda each: (-size[each[0]], each[0])):
        side = int(held[1] < held[0])
        halves[side].append(neighbour)
        held[side] += size[neighbour[0]]
    return halves


def _over_the_middle(along: Sequence[float], ways: Sequence[int]) -> float:
    return (along[0] + along[-1]) / 2


def _between(along: Sequence[float], ways: Sequence[int]) -> float:
    """Below the last of those above, above the first of those below."""
    above = sum(way < 0 for way in ways)
    if 0 < above < len(along):
        return (along[above - 1] + along[above]) / 2
    return along[0] - 0.5 if above == 0 else along[-1] + 0.5


class _Rows:
    """The tree on one side of its root: ``along`` (n,) the rows and ``away`` (n,) from it; 0 for what is not there."""

    def __init__(
        self,
        near: Neighbours,
        root: int,
        first: Sequence[tuple[int, int]],
        put: Callable[[Sequence[float], Sequence[int]], float],
    ) -> None:
        count = len(near)
        walk = _walk(near, root, first)
        way = {(point, other): side for point, of in enumerate(near) for other, side in of}
        children: list[list[int]] = [[] for _ in range(count)]
        for point, origin in walk[1:]:
            children[origin].append(point)
        offset = [0.0] * count  # from the origin
        shapes: dict[int, _Outline] = {}
        for point, _ in reversed(walk):
            own = children[point]
            # those above first; the deepest outside
            own.sort(key=lambda i: (_sign(way[point, i]), _sign(way[point, i]) * shapes[i].depth, i))
            shape = _Outline()
            at = [shape.add(shapes.pop(child)) for child in own]
            middle = put(at, [way[point, child] for child in own]) if own else 0.0
            for child, place in zip(own, at, strict=True):
                offset[child] = place - middle
            shape.over(middle)
            shapes[point] = shape
        self.along = np.zeros(count)
        row = np.zeros(count, dtype=np.int64)
        for point, origin in walk[1:]:
            self.along[point] = self.along[origin] + offset[point]
            row[point] = row[origin] + 1
        self.away: FloatArray = np.cumsum(_gaps(row, self.along, walk))[row]


def _gaps(row: IntArray, along: FloatArray, walk: Sequence[tuple[int, int]]) -> FloatArray:
    """(rows,) how far each row is from the one before it: so far that links, which lead along the rows as well, pass
    beside the discs next to their ends."""
    gaps = np.full(int(row.max()) + 1, _ROW)
    gaps[0] = 0.0
    points = np.array([point for point, _ in walk], dtype=np.int64)
    order = points[np.lexsort((along[points], row[points]))]
    same = np.diff(row[order]) == 0
    step = np.where(same, np.diff(along[order]), np.inf)
    after, before = np.full(len(row), np.inf), np.full(len(row), np.inf)
    after[order[:-1]], before[order[1:]] = step, step
    for point, origin in walk[1:]:
        lead = float(along[point] - along[origin])
        beside = (before[point], after[origin]) if lead > 0 else (after[point], before[origin])
        room = float(min(beside))
        if abs(lead) > room:
            gaps[row[point]] = max(gaps[row[point]], _CLEAR * abs(lead) / math.sqrt(room**2 - _CLEAR**2))
    return gaps


def _sign(way: int) -> int:
    return way or 1


class _Outline:
    """Of a subtree: for each row, the deepest first, from where to where it reaches; all moved by ``shift``."""

    def __init__(self) -> None:
        self.low: list[float] = []
        self.high: list[float] = []
        self.shift = 0.0

    @property
    def depth(self) -> int:
        """How many rows there are."""
        return len(self.low)

    def add(self, other: _Outline) -> float:
        """Put another beside this one, a step off at least, and take it in; where its root comes."""
        both = min(self.depth, other.depth)
        move = max(
            (self.high[-k] + self.shift + 1.0 - other.low[-k] - other.shift for k in range(1, both + 1)), default=0.0
        )
        place = other.high[-1] + other.shift + move
        if other.depth > self.depth:
            rest = self.low, self.high, self.shift
            self.low, self.high, self.shift = other.low, other.high, other.shift + move
            for k in range(1, both + 1):
                self.low[-k] = rest[0][-k] + rest[2] - self.shift
        else:
            for k in range(1, both + 1):
                self.high[-k] = other.high[-k] + other.shift + move - self.shift
        return place

    def over(self, middle: float) -> None:
        """Begin a new row with the root of all, in the ``middle``, from which is counted from now on."""
        self.shift -= middle
        self.low.append(-self.shift)
        self.high.append(-self.shift)
