"""Ranks: how far along the direction each unit stands.

In: units and the connections between them. Out: a rank for each, from 0. Connections that go back against the ranks are
as few as a greedy choice and moves of single units make them; instances of one kind come beside each other where that
makes the whole shorter.

The ranks are those with the shortest connections in all: they minimise the sum of weight × length, by the network
simplex of Gansner, Koutsofios, North and Vo (1993). What they compute arc by arc is here one sum over the numbering of
the tree: the cut value of an arc is what leaves the subtree below it less what enters it. Integers throughout.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from collections.abc import Set as AbstractSet

import networkx as nx
import numpy as np

from neurovis_layouts.layered.crossings import Ints

#: The weight of a connection without delay: it is reversed only where a loop of such connections leaves no choice.
INSTANT = 1000.0
#: How much more an arc weighs that is in a loop only because units are.
_ALONG = 100.0
#: Loops of more units are cut greedily only.
_MOST_IMPROVED = 1500
Arcs = Mapping[tuple[int, int], float]
#: At most so many pivots for each node, and a few more: a limit against cycling where pivots change nothing.
_PIVOTS = 8


def ranks_of(
    count: int,
    arcs: Arcs,
    first: AbstractSet[int],
    last: AbstractSet[int],
    along: AbstractSet[tuple[int, int]] = frozenset(),
    entered: float = 0.0,
) -> list[int]:
    """A rank for each of ``count`` units; ``arcs`` are (from, to): weight. ``first`` and ``last`` are where signals
    enter and leave: they decide where a loop is cut, if it can be at none of the arcs that are to run ``along``, as
    their neurons are in no loop. ``entered`` is how much more what is driven from outside of a loop is to come first
    in it, and what drives something there last; less than half an arc."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(count))
    graph.add_edges_from(arcs)
    kept = {arc: weight * (_ALONG if arc in along else 1.0) for arc, weight in arcs.items()}
    loop_of, place = [0] * count, [0] * count
    for k, loop in enumerate(nx.strongly_connected_components(graph)):
        units = _improved(_cut(sorted(loop), kept, graph, first, last, entered), kept) if len(loop) > 1 else loop
        for position, unit in enumerate(units):
            loop_of[unit], place[unit] = k, position
    forward: dict[tuple[int, int], float] = {}
    for (a, b), weight in arcs.items():
        # within a loop an arc against the cut order is turned round
        turned = loop_of[a] == loop_of[b] and place[a] > place[b]
        key = (b, a) if turned else (a, b)
        forward[key] = forward.get(key, 0.0) + weight
    acyclic: nx.DiGraph[int] = nx.DiGraph()
    acyclic.add_nodes_from(range(count))
    acyclic.add_edges_from(forward)
    rank = [0] * count
    for unit in nx.topological_sort(acyclic):
        rank[unit] = max((rank[other] + 1 for other in acyclic.predecessors(unit)), default=0)
    for part in nx.connected_components(graph.to_undirected(as_view=True)):
        number = {unit: i for i, unit in enumerate(sorted(part))}
        arcs_within = [(number[a], number[b], int(weight)) for (a, b), weight in forward.items() if a in part]
        for unit, level in zip(number, shortened([rank[unit] for unit in number], arcs_within), strict=True):
            rank[unit] = level
    return rank


def levelled(ranks: Sequence[int], arcs: Collection[tuple[int, int]], kinds: Mapping[int, str]) -> list[int]:
    """The ranks where instances stand beside one of their kind farther on, if that leaves a rank without any: the rank
    is as high as a neuron then, not as an instance. ``kinds`` says what is an instance of what. No arc turns round.

    >>> levelled([0, 1, 1, 2], [(0, 1), (0, 2), (2, 3)], {1: "leg", 3: "leg"})
    [0, 2, 1, 2]
    """
    rank = list(ranks)
    for level in sorted({rank[unit] for unit in kinds}, reverse=True):
        until = [max(rank)] * len(rank)
        for a, b in arcs:
            one, other = (a, b) if rank[a] < rank[b] else (b, a)
            until[one] = min(until[one], rank[other] - 1)
        here = [unit for unit in kinds if rank[unit] == level]
        farthest = [
            max(rank[other] for other, kind in kinds.items() if kind == kinds[unit] and rank[other] <= until[unit])
            for unit in here
        ]
        if min(farthest) > level:
            for unit, farther in zip(here, farthest, strict=True):
                rank[unit] = farther
    place = {level: number for number, level in enumerate(sorted(set(rank)))}
    return [place[level] for level in rank]


def _cut(
    loop: Sequence[int],
    arcs: Arcs,
    graph: nx.DiGraph[int],
    first: AbstractSet[int],
    last: AbstractSet[int],
    entered: float,
) -> list[int]:
    """An order of a loop's units that few arcs run against (Eades, Lin and Smyth 1993), ties by number."""
    inside = set(loop)
    surplus = {unit: (0.5 if unit in first else 0.0) - (0.5 if unit in last else 0.0) for unit in loop}
    for unit in loop:
        surplus[unit] += entered * (not inside.issuperset(graph.predecessors(unit)))
        surplus[unit] -= entered * (not inside.issuperset(graph.successors(unit)))
    within: nx.DiGraph[int] = graph.subgraph(loop)
    came, went = dict(within.in_degree()), dict(within.out_degree())
    for unit in loop:
        for other in within.successors(unit):
            surplus[unit] += arcs[unit, other]
            surplus[other] -= arcs[unit, other]
    head: list[int] = []
    tail: list[int] = []
    reached = dict.fromkeys(loop, 0.0)  # among equals, what the head drives most comes next
    left = list(loop)
    while left:
        sinks = [unit for unit in left if went[unit] == 0]
        sources = [unit for unit in left if came[unit] == 0]
        if sinks:
            chosen = sinks[-1]
            tail.append(chosen)
        else:
            chosen = sources[0] if sources else max(left, key=lambda unit: (surplus[unit], reached[unit], -unit))
            head.append(chosen)
        left.remove(chosen)
        inside.discard(chosen)
        for other in inside.intersection(within.successors(chosen)):
            surplus[other] += arcs[chosen, other]
            reached[other] += arcs[chosen, other]
            came[other] -= 1
        for other in inside.intersection(within.predecessors(chosen)):
            surplus[other] -= arcs[other, chosen]
            went[other] -= 1
    return head + tail[::-1]


def _improved(order: list[int], arcs: Arcs) -> list[int]:
    """The order after moving units to where fewer arcs run against it, until no such move is left."""
    if len(order) > _MOST_IMPROVED:
        return order
    number = {unit: i for i, unit in enumerate(order)}
    costs = np.zeros((len(order), len(order)), dtype=np.int64)
    for (a, b), weight in arcs.items():
        if a in number and b in number:
            costs[number[a], number[b]] -= int(weight)
            costs[number[b], number[a]] += int(weight)
    line = list(range(len(order)))
    gained = True
    while gained:
        gained = False
        for unit in range(len(order)):
            at = line.index(unit)
            others = line[:at] + line[at + 1 :]
            # what it costs to stand behind so many of the others
            behind = np.concatenate(([0], np.cumsum(costs[others, unit])))
            best = int(behind.argmin())
            if behind[best] < behind[at]:
                line = [*others[:best], unit, *others[best:]]
                gained = True
    return [order[i] for i in line]


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
