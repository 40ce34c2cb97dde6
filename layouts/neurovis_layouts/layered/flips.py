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
from neurovis_spec.layout import FloatArray

#: With more segments in a gap than this nobody sees the difference.
_MOST = 1500


def reflected(levels: Levels, order: Sequence[Sequence[int]], may: AbstractSet[int]) -> tuple[Levels, set[int]]:
    """The levels with some frames reflected, and the first neurons of these; ``may`` are first neurons of frames."""
    frames = [n for rank in order for n in rank if levels.nodes[n].members and _first(levels, n) in may]
    frames = [n for n in frames if any(dx for _, dx, _ in levels.nodes[n].members)]
    if not frames:
        return levels, set()
    x = np.array([place[0] for place in placed(levels, order, 1.0, 2.0)])
    gaps = [_Gap(gap, x) for gap in levels.segments]
    #: for each node −1 where it is reflected, else 1
    side = np.ones(len(levels.nodes))
    for _ in range(2):
        before = side.copy()
        for node in frames:
            rank = levels.nodes[node].rank
            beside = [gap for gap in gaps[max(rank - 1, 0) : rank + 1] if len(gap.upper) <= _MOST]
            now = sum(gap.crossings(node, side) for gap in beside)
            side[node] = -side[node]
            if sum(gap.crossings(node, side) for gap in beside) >= now:
                side[node] = -side[node]
        if (side == before).all():
            break
    flipped = set(np.flatnonzero(side < 0).tolist())
    return _reflect(levels, flipped), {_first(levels, node) for node in flipped}


def _first(levels: Levels, node: int) -> int:
    return min(member for member, _, _ in levels.nodes[node].members)


class _Gap:
    """The segments between two ranks as straight lines."""

    def __init__(self, segments: Sequence[Segment], x: FloatArray) -> None:
        self.upper = np.array([s.upper for s in segments], dtype=np.int64)
        self._lower = np.array([s.lower for s in segments], dtype=np.int64)
        self._a = np.array([s.a for s in segments], dtype=np.float64)
        self._b = np.array([s.b for s in segments], dtype=np.float64)
        self._x = x

    def crossings(self, node: int, side: FloatArray) -> int:
        """How many crossings those at a node have, which ``side`` tells whether it is reflected."""
        start = self._x[self.upper] + self._a * side[self.upper]
        end = self._x[self._lower] + self._b * side[self._lower]
        own = (self.upper == node) | (self._lower == node)
        met = (start[own, None] - start) * (end[own, None] - end) < 0
        # two at the node meet in both of their rows, others in one
        return 2 * int(met.sum()) - int(met[:, own].sum())


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
