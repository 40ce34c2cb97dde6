"""Order: who stands beside whom in a rank, so that few segments cross.

In: Levels. Out: node indices by rank, in order, and Levels in which what may has moved to other ranks. Sweeps by
barycentres, exchanges of neighbours (``exchange``); then, unless the levels are large, nodes are taken out and put back
(``reinsertion``). Members of a box stay together; neurons of a group keep its order unless crossings gain clearly.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from itertools import pairwise
from operator import itemgetter

import numpy as np

from neurovis_layouts.layered.crossings import Floats, Ints, Segments
from neurovis_layouts.layered.exchange import Exchange
from neurovis_layouts.layered.halves import Halves
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.layered.reinsertion import reinserted
from neurovis_spec.layout.model import Effort

Order = list[list[int]]

#: Neurons of a group give up their order where that leaves less than this share of the crossings.
_CLEARLY = 0.85
#: Sweeps, down and up in turns.
_SWEEPS = 14
#: Beyond so many pairs of nodes of neighbouring ranks none are put back: one at a time is too slow.
_MOST_PAIRS = 1_000_000


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
    for sweep in range(_SWEEPS):
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
