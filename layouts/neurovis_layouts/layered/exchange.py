"""Exchange: neighbours change places where that saves crossings, in many ranks at once.

In: segments and an order. Out: a better order. Every other rank depends only on those
between, and so does every other pair of neighbours within a rank: four steps weigh every pair, each with a few array
operations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_layouts.layered.crossings import Ints, Segments
from neurovis_layouts.layered.halves import Halves

_MOST_ROUNDS = 60
#: A round that saves less than this share of all crossings is the last.
_HARDLY = 1 / 4000


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
