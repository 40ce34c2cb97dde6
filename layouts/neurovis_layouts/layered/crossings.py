"""Crossings: how many segments cross in an order, and where those of a node lead in the mean.

In: Levels. Out: counts. The ends of segments are compared as integers: the place of the node in its rank, then which of
its ports it is (the offsets of a block, in their order). So every count is exact, and the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.levels import Levels

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


class Segments:
    """Segments of all gaps, as arrays."""

    def __init__(self, levels: Levels) -> None:
        every = [segment for gap in levels.segments for segment in gap]
        gaps = [len(gap) for gap in levels.segments]
        self.upper: Ints = np.array([segment.upper for segment in every], dtype=np.int64)
        self.lower: Ints = np.array([segment.lower for segment in every], dtype=np.int64)
        self.upper_port = _ports(self.upper, [segment.a for segment in every])
        self.lower_port = _ports(self.lower, [segment.b for segment in every])
        self.ports = 1 + int(max(self.upper_port.max(initial=0), self.lower_port.max(initial=0)))
        self.real = np.array([not segment.idle for segment in every], dtype=np.bool_)
        self.gap: Ints = np.repeat(np.arange(len(gaps), dtype=np.int64), gaps)
        #: where the segments of each gap begin and end
        self._bounds = np.cumsum([0, *gaps]).tolist()

    def count(self, place: Ints, turned: npt.NDArray[np.bool_] | None = None) -> int:
        """Crossings of all segments whose nodes have these places in their ranks; those from one point have none, nor
        do idle ones. The ports of nodes that are ``turned`` stand the other way round."""
        upper, lower = self.upper_port, self.lower_port
        if turned is not None:
            upper = np.where(turned[self.upper], self.ports - 1 - upper, upper)
            lower = np.where(turned[self.lower], self.ports - 1 - lower, lower)
        wide = (int(place.max(initial=0)) + 1) * self.ports
        start = (self.gap * wide + place[self.upper]) * self.ports + upper
        end = self.gap * wide + place[self.lower] * self.ports + lower
        start, end = start[self.real], end[self.real]
        return inversions(end[np.argsort(start * (int(end.max(initial=0)) + 1) + end)])

    def means(self, r: int, down: bool, place: Ints, size: int) -> Floats:
        """The mean place of what each of the nodes of a rank, so many, in their order, is connected to in the rank
        above, else below; NaN for those without."""
        gap = slice(*self._bounds[r - 1 : r + 1]) if down else slice(*self._bounds[r : r + 2])
        here, there = (self.lower, self.upper) if down else (self.upper, self.lower)
        port = (self.upper_port if down else self.lower_port)[gap]
        own = place[here[gap]]
        count = np.bincount(own, minlength=size)
        sums = np.bincount(own, place[there[gap]] * self.ports + port, size)
        return np.where(count > 0, sums / np.maximum(count, 1), np.nan)


def _ports(nodes: Ints, offsets: Sequence[float]) -> Ints:
    """For each end its place among the different offsets of its node on this side."""
    if not any(offsets):
        return np.zeros(len(nodes), dtype=np.int64)
    different: dict[int, set[float]] = {}
    for node, offset in zip(nodes.tolist(), offsets, strict=True):
        different.setdefault(node, set()).add(offset)
    port = {node: {offset: i for i, offset in enumerate(sorted(found))} for node, found in different.items()}
    return np.array([port[node][offset] for node, offset in zip(nodes.tolist(), offsets, strict=True)], dtype=np.int64)


def inversions(values: Ints | Floats) -> int:
    """Pairs of which the first is greater, counted bit by bit, from the highest on: ones before zeros, among values
    that agree in all higher bits.

    >>> inversions(np.array([3, 1, 2, 1]))
    4
    """
    count = len(values)
    if count < 2:
        return 0
    place = np.arange(count, dtype=np.int32)
    rank = np.empty(count, dtype=np.int32)
    rank[np.argsort(values, kind="stable")] = place
    total = 0
    for bit in range((count - 1).bit_length() - 1, -1, -1):
        # values that agree in all higher bits stand side by side, from the place of the least of them on
        ones = (rank >> bit) & 1
        first = (rank >> (bit + 1)) << (bit + 1)
        before = np.cumsum(ones, dtype=np.int32) - ones
        before -= before[first]
        total += int((before * (1 - ones)).sum(dtype=np.int64))
        moved = np.empty(count, dtype=np.int32)
        moved[np.where(ones == 1, first + (1 << bit) + before, place - before)] = rank
        rank = moved
    return total
