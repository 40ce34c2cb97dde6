"""Crossings: how many segments cross in an order, and what the nodes of a rank have with one another.

In: Levels. Out: counts. The ends of segments are compared as integers: the place of the node in its rank, then which of
its ports it is (the offsets of a block, in their order). So every count is exact, and the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.levels import Levels

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Side:
    """What leads from a rank to one beside it: for each segment its other node and the port there, sorted by the node
    in the rank; ``starts`` is where the segments of each node begin that has any, ``who`` its place in ``ranks[r]``."""

    other: Ints
    port: Ints
    starts: Ints
    who: Ints

    def sizes(self) -> Ints:
        """How many segments each node of ``who`` has."""
        return np.diff(np.append(self.starts, len(self.other)))


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
        self.gap: Ints = np.repeat(np.arange(len(gaps), dtype=np.int64), gaps)
        #: by rank: to the rank above, to the rank below
        self.above: list[Side] = []
        self.below: list[Side] = []
        self.local: Ints = np.zeros(len(levels.nodes), dtype=np.int64)
        for rank in levels.ranks:
            self.local[rank] = np.arange(len(rank), dtype=np.int64)
        bounds = np.cumsum([0, 0, *gaps, 0]).tolist()  # the first rank has nothing above, the last nothing below
        for r in range(len(levels.ranks)):
            above, below = slice(bounds[r], bounds[r + 1]), slice(bounds[r + 1], bounds[r + 2])
            self.above.append(self._side(self.lower[above], self.upper[above], self.upper_port[above]))
            self.below.append(self._side(self.upper[below], self.lower[below], self.lower_port[below]))

    def _side(self, own: Ints, other: Ints, port: Ints) -> Side:
        local = self.local[own]
        order = np.argsort(local, kind="stable")
        local = local[order]
        first = np.ones(len(local), dtype=np.bool_)
        first[1:] = local[1:] != local[:-1]
        return Side(other[order], port[order], np.flatnonzero(first), local[first])

    def count(self, place: Ints) -> int:
        """Crossings of all segments whose nodes have these places in their ranks; those from one point have none."""
        wide = (int(place.max(initial=0)) + 1) * self.ports
        start = (self.gap * wide + place[self.upper]) * self.ports + self.upper_port
        end = self.gap * wide + place[self.lower] * self.ports + self.lower_port
        return inversions(end[np.argsort(start * (int(end.max(initial=0)) + 1) + end)])

    def differences(self, size: int, side: Side, place: Ints) -> Ints:
        """For the nodes of a rank, by their places in ``ranks[r]``: (i, j) is how many more crossings they have with
        each other on this side if i stands before j than if j stands before i."""
        result = np.zeros((size, size), dtype=np.int64)
        count = len(side.other)
        if not count:
            return result
        key = place[side.other] * self.ports + side.port
        along = np.argsort(key, kind="stable")
        # (k, j): how many of the first k segments, in the order of their other ends, are of the j-th node
        before = np.zeros((count + 1, len(side.starts)), dtype=np.int64)
        before[np.arange(1, count + 1), np.repeat(np.arange(len(side.starts)), side.sizes())[along]] = 1
        np.cumsum(before, axis=0, out=before)
        pairs = np.add.reduceat(before[np.searchsorted(key[along], key)], side.starts, axis=0)
        result[side.who[:, None], side.who] = pairs - pairs.T
        return result

    def means(self, size: int, side: Side, place: Ints) -> Floats:
        """The mean place of what each node of a rank is connected to on a side; NaN for those without."""
        result = np.full(size, np.nan)
        if len(side.other):
            key = place[side.other] * self.ports + side.port
            result[side.who] = np.add.reduceat(key, side.starts) / side.sizes()
        return result


def _ports(nodes: Ints, offsets: Sequence[float]) -> Ints:
    """For each end its place among the different offsets of its node on this side."""
    if not any(offsets):
        return np.zeros(len(nodes), dtype=np.int64)
    different: dict[int, set[float]] = {}
    for node, offset in zip(nodes.tolist(), offsets, strict=True):
        different.setdefault(node, set()).add(offset)
    port = {node: {offset: i for i, offset in enumerate(sorted(found))} for node, found in different.items()}
    return np.array([port[node][offset] for node, offset in zip(nodes.tolist(), offsets, strict=True)], dtype=np.int64)


def inversions(values: Ints) -> int:
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
