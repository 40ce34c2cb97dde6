"""Flips: frames are replaced by their mirror images where that saves crossings.

In: Levels in order, and which frames may be reflected. Out: Levels in which some are reflected, and which.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from neurovis_layouts.layered.levels import Levels, Segment
from neurovis_layouts.layered.place import placed

#: With more segments in a gap than this nobody sees the difference.
_MOST = 1500


def reflected(levels: Levels, order: Sequence[Sequence[int]], may: AbstractSet[int]) -> tuple[Levels, set[int]]:
    """The levels with some frames reflected, and the first neurons of these; ``may`` are first neurons of frames."""
    frames = [n for rank in order for n in rank if levels.nodes[n].members and _first(levels, n) in may]
    frames = [n for n in frames if any(dx for _, dx, _ in levels.nodes[n].members)]
    if not frames:
        return levels, set()
    x = [place[0] for place in placed(levels, order, 1.0, 2.0)]
    flipped: set[int] = set()
    for _ in range(2):
        before = set(flipped)
        for node in frames:
            now, other = (_crossings(levels, x, flipped ^ change, node) for change in (set(), {node}))
            if other < now:
                flipped ^= {node}
        if flipped == before:
            break
    return _reflect(levels, flipped), {_first(levels, node) for node in flipped}


def _first(levels: Levels, node: int) -> int:
    return min(member for member, _, _ in levels.nodes[node].members)


def _crossings(levels: Levels, x: Sequence[float], flipped: AbstractSet[int], node: int) -> int:
    """Crossings of the segments at a node, as straight lines."""
    total = 0
    rank = levels.nodes[node].rank
    for gap in (rank - 1, rank):
        if not 0 <= gap < len(levels.segments) or len(levels.segments[gap]) > _MOST:
            continue
        segments = levels.segments[gap]
        start = np.array([x[s.upper] + _offset(s.upper, s.a, flipped) for s in segments])
        end = np.array([x[s.lower] + _offset(s.lower, s.b, flipped) for s in segments])
        own = np.array([node in (s.upper, s.lower) for s in segments], dtype=np.bool_)
        met = (start[own, None] - start) * (end[own, None] - end) < 0
        # two at the node meet in both of their rows, others in one
        total += 2 * int(met.sum()) - int(met[:, own].sum())
    return total


def _offset(node: int, offset: float, flipped: AbstractSet[int]) -> float:
    return -offset if node in flipped else offset


def _reflect(levels: Levels, flipped: AbstractSet[int]) -> Levels:
    nodes = list(levels.nodes)
    for node in flipped:
        nodes[node] = replace(nodes[node], members=tuple((m, -dx + 0.0, dy) for m, dx, dy in nodes[node].members))
    segments = [
        [
            Segment(s.upper, _offset(s.upper, s.a, flipped), s.lower, _offset(s.lower, s.b, flipped), s.weight)
            for s in gap
        ]
        for gap in levels.segments
    ]
    ends = {
        i: (upper, _offset(upper, a, flipped), lower, _offset(lower, b, flipped))
        for i, (upper, a, lower, b) in levels.ends.items()
    }
    return Levels(nodes, levels.ranks, segments, levels.passages, levels.spines, ends)
