"""Order: who stands beside whom in a rank, so that few segments cross.

In: Levels. Out: node indices by rank, in order, and Levels in which what may has moved to other ranks. Sweeps by
barycentres; exchanges of neighbours; then, unless the levels are large, nodes are taken out and put back
(``reinsertion``). Members of a box stay together; neurons of a group keep its order unless crossings gain clearly.

Neighbours change places in many ranks at once: what a rank gains depends only on those above and below it, so every
other rank may change, and in it every other pair. Four steps (even and odd ranks, even and odd places) weigh each pair
once, with a few array operations each.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from itertools import pairwise
from operator import itemgetter

import numpy as np

from neurovis_layouts.layered.crossings import Floats, Ints, Segments
from neurovis_layouts.layered.levels import Halves, Levels
from neurovis_layouts.layered.reinsertion import reinserted
from neurovis_spec.layout.model import Effort

Order = list[list[int]]

#: Neurons of a group give up their order where that leaves less than this share of the crossings.
_CLEARLY = 0.85
#: Sweeps, down and up in turns.
_SWEEPS = 14
#: Beyond so many pairs of nodes of neighbouring ranks none are put back: one at a time is too slow.
_MOST_PAIRS = 1_000_000
_MOST_ROUNDS = 60
#: A round that saves less than this share of all crossings is the last.
_HARDLY = 1 / 4000


def ordered(
    levels: Levels, free: AbstractSet[int] = frozenset(), effort: Effort = "normal", draft: bool = False
) -> tuple[Levels, Order]:
    """The ranks in order; ``free`` nodes may have moved to others. A ``draft`` is as wide, about, as what is drawn in
    full. Deterministic: every tie falls to the order before, in the end to that of the names."""
    segments = Segments(levels)
    strict = any(node.kin >= 0 for node in levels.nodes)
    # in large levels the two starts lead to very different orders, and neither is always better
    starts = levels.ranks, _by_descent(levels)
    crossings, order = min((_swept(levels, segments, start, strict) for start in starts), key=itemgetter(0))
    if strict and crossings:
        fewer, other = _swept(levels, segments, order, False)
        if fewer < _CLEARLY * crossings:
            strict, order = False, other
    if draft or not crossings or sum(len(a) * len(b) for a, b in pairwise(order)) > _MOST_PAIRS:
        return levels, order
    return reinserted(levels, order, strict, free, effort)[1:]


def crossings(levels: Levels, order: Order) -> int:
    """How many segments cross in this order."""
    return Segments(levels).count(places(len(levels.nodes), order))


def places(count: int, order: Sequence[Sequence[int] | Ints]) -> Ints:
    """The place of each of ``count`` nodes in its rank."""
    place = np.zeros(count, dtype=np.int64)
    for rank in order:
        place[rank] = np.arange(len(rank), dtype=np.int64)
    return place


def _swept(levels: Levels, segments: Segments, start: Order, strict: bool) -> tuple[int, Order]:
    """The best order that sweeps and exchanges lead to, and its crossings; with ``strict`` neurons of a group keep
    theirs in each rank."""
    box = np.array([node.box for node in levels.nodes], dtype=np.int64)
    group = np.array([node.kin if strict else -1 for node in levels.nodes], dtype=np.int64)
    kin = [_kin(levels, rank) if strict else [] for rank in levels.ranks]
    halves = Halves(levels)
    order = [halves.whole(np.array(rank, dtype=np.int64)) for rank in start]
    order = [
        halves.whole(_settled(rank, np.arange(len(rank)), box, mates)) for rank, mates in zip(order, kin, strict=True)
    ]
    place = places(len(levels.nodes), order)
    best = segments.count(place), list(order)
    for sweep in range(_SWEEPS if best[0] else 0):
        down = sweep % 2 == 0
        for r in range(1, len(order)) if down else range(len(order) - 2, -1, -1):
            means = segments.means(r, down, place, len(order[r]))
            known = ~np.isnan(means)
            if known.any():
                # what is connected to nothing there stays behind what it stands behind
                last = np.maximum.accumulate(np.where(known, np.arange(len(means)), -1))
                order[r] = halves.whole(_settled(order[r], np.where(last >= 0, means[last], -1.0), box, kin[r]))
                place[order[r]] = np.arange(len(means))
        if (crossings := segments.count(place)) < best[0]:
            best = crossings, list(order)
    crossings, order = Exchange(segments, (box, group), halves).improved(*best)
    return crossings, [rank.tolist() for rank in order]


def _settled(rank: Ints, value: Ints | Floats, boxes: Ints, kin: Sequence[Ints]) -> Ints:
    """Sorted by value, boxes as a whole; neurons of a group take the places that they got in its order."""
    box = boxes[rank]
    inside = box >= 0
    count = np.maximum(np.bincount(box[inside], minlength=1), 1)
    mean = np.where(inside, (np.bincount(box[inside], value[inside], len(count)) / count)[np.maximum(box, 0)], value)
    result = rank[np.lexsort((np.arange(len(rank)), value, box, mean))]
    for mates in kin:
        result[np.isin(result, mates)] = mates
    return result


def _kin(levels: Levels, rank: Sequence[int]) -> list[Ints]:
    """Neurons of one group in one box, in their order, where there are several."""
    kin: dict[tuple[int, int], list[int]] = {}
    for node in rank:
        if levels.nodes[node].kin >= 0:
            kin.setdefault((levels.nodes[node].kin, levels.nodes[node].box), []).append(node)
    return [np.array(mates, dtype=np.int64) for mates in kin.values() if len(mates) > 1]


def _by_descent(levels: Levels) -> Order:
    """Nodes in the order in which a walk down from the first rank meets them: keeps what hangs together together."""
    below: list[list[int]] = [[] for _ in levels.nodes]
    for segment in (segment for gap in levels.segments for segment in gap):
        below[segment.upper].append(segment.lower)
    met: dict[int, int] = {}
    for root in (node for rank in levels.ranks for node in rank):
        stack = [root]
        while stack:
            node = stack.pop()
            if node not in met:
                met[node] = len(met)
                stack.extend(other for other in sorted(below[node], reverse=True) if other not in met)
    return [sorted(rank, key=lambda node: met[node]) for rank in levels.ranks]


class Exchange:
    """What exchanges need: the segments of each node on both sides, and who may change places with whom: within
    ``classes``, neighbours of one rank whose first number (the box) is the same and whose second (the group) is not, or
    is less than 0; behind the axis of ``halves`` all follow their images."""

    def __init__(self, segments: Segments, classes: tuple[Ints, Ints], halves: Halves) -> None:
        self.ports, self._halves = segments.ports, halves
        self.box, self.kin = classes
        upper, above = segments.upper[segments.real], segments.upper_port[segments.real]
        lower, below = segments.lower[segments.real], segments.lower_port[segments.real]
        self.sides = [_Ends(len(self.box), lower, upper, above), _Ends(len(self.box), upper, lower, below)]

    def improved(self, crossings: int, order: Sequence[Ints]) -> tuple[int, list[Ints]]:
        """The order after exchanges, and its crossings."""
        line = np.concatenate(order)
        sizes = np.array([len(rank) for rank in order], dtype=np.int64)
        rank = np.repeat(np.arange(len(order), dtype=np.int64), sizes)
        within = np.arange(len(line), dtype=np.int64) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        place = np.zeros(len(self.box), dtype=np.int64)
        place[line] = within
        side = self._halves.side[line]
        pair = (rank[1:] == rank[:-1]) & (side[1:] == side[:-1]) & (side[1:] <= 0)
        steps = [
            np.flatnonzero(pair & (rank[:-1] % 2 == ranks) & (within[:-1] % 2 == places))
            for ranks in (0, 1)
            for places in (0, 1)
        ]
        for _ in range(_MOST_ROUNDS):
            saved = sum(self._step(line, place, step) for step in steps)
            crossings -= saved
            if saved <= crossings * _HARDLY:
                break
        return crossings, np.split(line, np.cumsum(sizes)[:-1])

    def _step(self, line: Ints, place: Ints, at: Ints) -> int:
        """Exchange what stands at these places with what comes next, where that saves crossings, and their images;
        how many."""
        left, right = line[at], line[at + 1]
        may = (self.box[left] == self.box[right]) & ((self.kin[left] < 0) | (self.kin[left] != self.kin[right]))
        at, left, right = at[may], left[may], right[may]
        twin = np.flatnonzero(self._halves.side[left] < 0)
        first, second = self._halves.image[right[twin]], self._halves.image[left[twin]]
        at = np.concatenate((at, at[twin] - place[left[twin]] + place[first]))
        left, right = np.concatenate((left, first)), np.concatenate((right, second))
        gain = np.zeros(len(at), dtype=np.int64)
        for side in self.sides:
            gain += side.gains(left, right, place, self.ports)
        images = slice(len(at) - len(twin), None)
        gain[twin] += gain[images]
        gain[images] = gain[twin]
        better = gain > 0
        at, left, right = at[better], left[better], right[better]
        line[at], line[at + 1] = right, left
        place[left] += 1
        place[right] -= 1
        return int(gain[: images.start].sum(where=better[: images.start]))


class _Ends:
    """By node: what it is connected to on one side."""

    def __init__(self, nodes: int, own: Ints, other: Ints, port: Ints) -> None:
        order = np.argsort(own, kind="stable")
        self.own, self.other, self.port = own[order], other[order], port[order]
        self.degree = np.bincount(own, minlength=nodes)
        self.start = np.cumsum(self.degree) - self.degree

    def gains(self, left: Ints, right: Ints, place: Ints, ports: int) -> Ints:
        """For pairs of neighbours how many crossings they have with each other now, less those if exchanged: each end
        of the left node is searched among the sorted ends of the right one."""
        key = place[self.other] * ports + self.port
        wide = int(key.max(initial=0)) + 1
        every = np.sort(self.own * wide + key)
        number, step = _within(self.degree[left])
        wanted = right[number] * wide + key[self.start[left][number] + step]
        start, degree = self.start[right][number], self.degree[right][number]
        smaller = np.searchsorted(every, wanted) - start
        greater = degree - (np.searchsorted(every, wanted, side="right") - start)
        return np.bincount(number, smaller - greater, len(left)).astype(np.int64)


def _within(sizes: Ints) -> tuple[Ints, Ints]:
    """For groups of these sizes: the group of each element, and its place in the group."""
    number = np.repeat(np.arange(len(sizes), dtype=np.int64), sizes)
    return number, np.arange(len(number), dtype=np.int64) - np.repeat(np.cumsum(sizes) - sizes, sizes)
