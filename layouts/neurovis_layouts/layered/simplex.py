"""Short connections: ranks whose connections are as short as can be in all.

In: a connected graph without loops, and ranks in which every arc leads forward. Out: ranks that minimise the sum of
weight × length. This is the network simplex of Gansner, Koutsofios, North and Vo (1993); what they compute arc by arc
is here one sum over the numbering of the tree: the cut value of an arc is what leaves the subtree below it less what
enters it. Integers throughout.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_layouts.layered.crossings import Ints

#: At most so many pivots for each node, and a few more: a limit against cycling where pivots change nothing.
_PIVOTS = 8


def shortened(rank: Sequence[int], arcs: Sequence[tuple[int, int, int]]) -> list[int]:
    """Ranks from 0; ``arcs`` are (from, to, weight), each at least one rank long.

    >>> shortened([0, 1, 2, 3], [(0, 1, 1), (1, 3, 2), (2, 3, 1)])
    [0, 1, 1, 2]
    """
    if not arcs:
        return [0] * len(rank)
    tree = _Tree(np.array(rank, dtype=np.int64), np.array(sorted(arcs), dtype=np.int64))
    tree.grow()
    for _ in range(_PIVOTS * len(rank) + 16):
        if not tree.pivot():
            break
    found = tree.rank - tree.rank.min()
    return [int(value) for value in found]


class _Tree:
    """Ranks and a spanning tree of arcs that are one rank long."""

    def __init__(self, rank: Ints, arcs: Ints) -> None:
        self.rank = rank
        self.tails, self.heads = np.ascontiguousarray(arcs[:, 0]), np.ascontiguousarray(arcs[:, 1])
        self.net = np.zeros(len(rank), dtype=np.int64)
        np.add.at(self.net, self.tails, arcs[:, 2])
        np.add.at(self.net, self.heads, -arcs[:, 2])
        self.near: list[list[tuple[int, int]]] = [[] for _ in range(len(rank))]

    def slack(self, arcs: Ints) -> Ints:
        return self.rank[self.heads[arcs]] - self.rank[self.tails[arcs]] - 1

    def grow(self) -> None:
        """A tree of tight arcs (as short as may be) from the first node; where none leads on from it, all of it is
        moved until the arc with the least slack that does is tight."""
        beside: list[list[tuple[int, int]]] = [[] for _ in self.near]
        for arc, (tail, head) in enumerate(zip(self.tails.tolist(), self.heads.tolist(), strict=True)):
            beside[tail].append((head, arc))
            beside[head].append((tail, arc))
        inside = np.zeros(len(self.rank), dtype=np.bool_)
        inside[0] = True
        waiting = [0]
        while True:
            while waiting:
                node = waiting.pop()
                for other, arc in beside[node]:
                    if not inside[other] and abs(int(self.rank[other] - self.rank[node])) == 1:
                        inside[other] = True
                        self._join(arc)
                        waiting.append(other)
            leaving = np.flatnonzero(inside[self.tails] != inside[self.heads])
            if not len(leaving):
                return
            slack = self.slack(leaving)
            arc = int(leaving[slack.argmin()])
            self.rank[inside] += slack.min() if inside[self.tails[arc]] else -slack.min()
            waiting = np.flatnonzero(inside).tolist()

    def pivot(self) -> bool:
        """Replace the tree's arc with the most negative cut value by the arc with the least slack that runs the other
        way between its two sides; False where no cut value is negative: then the ranks are optimal."""
        order, size, by = self._numbered()
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        sums = np.concatenate(([0], np.cumsum(self.net[order])))
        child = order[1:]
        arcs = by[child]
        leaves = sums[place[child] + size[child]] - sums[place[child]]
        upward = self.tails[arcs] == child
        cut = np.where(upward, leaves, -leaves)
        worst = int(cut.argmin())
        if cut[worst] >= 0:
            return False
        node, arc = int(child[worst]), int(arcs[worst])
        first, end = place[node], place[node] + size[node]
        tail_in = (place[self.tails] >= first) & (place[self.tails] < end)
        head_in = (place[self.heads] >= first) & (place[self.heads] < end)
        back = ~tail_in & head_in if upward[worst] else tail_in & ~head_in
        candidates = np.flatnonzero(back)
        slack = self.slack(candidates)
        self.rank[order[first:end]] += -slack.min() if upward[worst] else slack.min()
        tail, head = int(self.tails[arc]), int(self.heads[arc])
        self.near[tail].remove((head, arc))
        self.near[head].remove((tail, arc))
        self._join(int(candidates[slack.argmin()]))
        return True

    def _join(self, arc: int) -> None:
        tail, head = int(self.tails[arc]), int(self.heads[arc])
        self.near[tail].append((head, arc))
        self.near[head].append((tail, arc))

    def _numbered(self) -> tuple[Ints, Ints, Ints]:
        """Nodes in the order of a walk from the first, the size of the tree below each, the arc that leads to each."""
        order: list[int] = []
        size, by, above = [1] * len(self.near), [-1] * len(self.near), [-1] * len(self.near)
        waiting = [0]
        while waiting:
            node = waiting.pop()
            order.append(node)
            for other, arc in self.near[node]:
                if other != above[node]:
                    above[other], by[other] = node, arc
                    waiting.append(other)
        for node in reversed(order[1:]):
            size[above[node]] += size[node]
        return np.array(order, dtype=np.int64), np.array(size, dtype=np.int64), np.array(by, dtype=np.int64)
