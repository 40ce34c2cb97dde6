"""Ranks: how far along the direction each unit stands.

In: units and the connections between them. Out: a rank for each, from 0. Connections that go back against the ranks
are as few as a greedy choice and moves of single units make them; the ranks are those with the shortest connections in
all (``simplex``). Instances of one kind come beside each other where that makes the whole shorter.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from collections.abc import Set as AbstractSet

import networkx as nx
import numpy as np

from neurovis_layouts.layered.simplex import shortened

#: The weight of a connection without delay: it is reversed only where a loop of such connections leaves no choice.
INSTANT = 1000.0
#: How much more an arc weighs that is in a loop only because units are.
_ALONG = 100.0
#: Loops of more units are cut greedily only.
_MOST_IMPROVED = 1500
Arcs = Mapping[tuple[int, int], float]


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
        surplus[unit] += entered * any(other not in inside for other in graph.predecessors(unit))
        surplus[unit] -= entered * any(other not in inside for other in graph.successors(unit))
    came, went = dict.fromkeys(loop, 0), dict.fromkeys(loop, 0)
    for unit in loop:
        for other in graph.successors(unit):
            if other in inside:
                surplus[unit] += arcs[unit, other]
                surplus[other] -= arcs[unit, other]
                went[unit] += 1
                came[other] += 1
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
        elif sources:
            chosen = sources[0]
            head.append(chosen)
        else:
            chosen = max(left, key=lambda unit: (surplus[unit], reached[unit], -unit))
            head.append(chosen)
        left.remove(chosen)
        inside.discard(chosen)
        for other in graph.successors(chosen):
            if other in inside:
                surplus[other] += arcs[chosen, other]
                reached[other] += arcs[chosen, other]
                came[other] -= 1
        for other in graph.predecessors(chosen):
            if other in inside:
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
