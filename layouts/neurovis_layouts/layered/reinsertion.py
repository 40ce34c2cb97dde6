"""Reinsertion: an order with fewer crossings, by nodes that are taken out and put back where they cross least.

In: Levels in order, and which nodes may change their rank. Out: Levels in which they have, and the order. Every node is
put back until none gains; then, as often as the budget allows, a few nodes near each other are taken out together and
put back one by one (ruin and recreate: Schrimpf et al. 2000), which stands if it costs no more than before, or a
crossing more than the best so far (record to record: Dueck 1993). The random numbers are the same every time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet

from neurovis_layouts.layered.insertion import CROSSING, Insertion
from neurovis_layouts.layered.levels import Ends, Levels, moved
from neurovis_spec.layout.model import Effort

Order = list[list[int]]

#: By effort: how many times the budget and the patience.
_TIMES: dict[Effort, float] = {"quick": 1 / 8, "normal": 1, "best": 10}
#: Operations on arrays in all, some 7 µs each. Two fifths more leave 5 % fewer crossings in the Rome graphs of sample
#: 11 (see ``benchmarks/layout.py``).
_BUDGET = 36_000
#: Most nodes that are taken out together; four or twelve are as good.
_MOST = 7
#: After so many times in vain for each node the search ends; it finds nothing more in sample 11 with twice as many.
_PATIENCE = 6


def reinserted(
    levels: Levels,
    order: Sequence[Sequence[int]],
    strict: bool,
    free: AbstractSet[int] = frozenset(),
    effort: Effort = "normal",
) -> tuple[int, Levels, Order]:
    """Crossings, levels and order; with ``strict`` neurons of a group keep their order in each rank; the ``free`` nodes
    stand in any rank in which what leads down leads down."""
    state = Insertion(levels, order, strict, free)
    cost = _Search(state, _TIMES[effort]).run()
    lengths = (state.rank[link.lower] - state.rank[link.upper] for link in state.links if not link.idle)
    crossings = (cost - sum(lengths)) // CROSSING
    return crossings, *levels_in(levels, state)


class _Search:
    """One search for a state that costs less."""

    def __init__(self, state: Insertion, times: float) -> None:
        self._state = state
        self._budget = int(_BUDGET * times)
        # of mirror images one stands for both
        self._near = [
            sorted({state.lead[m] for c in (*state.ups[n], *state.downs[n]) for m in state.ends_of(c)} - {n})
            for n in range(len(state.rank))
        ]
        self._nodes = [n for n, near in enumerate(self._near) if near and state.lead[n] == n]
        # what has an image moves, and saves crossings, by the pair
        self._pair = 2 if any(n != m for n, m in enumerate(state.lead)) else 1
        self._patience = int(_PATIENCE * times * len(self._nodes) / self._pair)
        self._dice = _dice()

    def run(self) -> int:
        """The least cost that was found; the state is that."""
        state = self._state
        best = now = self._descent(state.cost)
        found = state.keep()
        in_vain, most = 0, min(_MOST, len(self._nodes) // 2)
        while best >= CROSSING and most > 0 and state.work < self._budget and in_vain < self._patience:
            kept = state.keep()
            ruin = self._ruin(1 + next(self._dice) % most)
            saved = state.take(ruin)
            in_vain += 1
            limit = saved + max(0, best + self._pair * CROSSING - now)
            if saved >= CROSSING and (cost := self._recreate(ruin, limit)) <= limit:
                now += cost - saved
                if now < best:
                    in_vain = in_vain if now // CROSSING == best // CROSSING else 0
                    best, found = now, state.keep()
            else:
                state.restore(kept)
        state.restore(found)
        return best

    def _descent(self, cost: int) -> int:
        """Every node put back by itself, until none gains."""
        state, before = self._state, cost + 1
        while cost < before and cost >= CROSSING and state.work < self._budget:
            before = cost
            for node in self._nodes:
                kept = state.keep()
                saved = state.take([node])
                if saved >= CROSSING and (again := state.put(node, next(self._dice), saved - 1)) < saved:
                    cost += again - saved
                else:  # of what costs the same the order that was there stays
                    state.restore(kept)
        return cost

    def _ruin(self, size: int) -> list[int]:
        """Nodes near each other: connected, or in one rank."""
        ruin = [self._one_of(self._nodes)]
        for _ in range(4 * size):
            at = self._one_of(ruin)
            if next(self._dice) % 4:
                other = self._one_of(self._near[at])
            else:
                other, link = self._state.owner(self._one_of(self._state.order[self._state.rank[at]]))
                if link >= 0:
                    other = self._one_of(self._state.ends_of(link))
                other = self._state.lead[other]
            if other not in ruin and self._near[other]:
                ruin.append(other)
            if len(ruin) >= size:
                break
        return ruin

    def _recreate(self, ruin: Sequence[int], most: int) -> int:
        """Put these nodes back, any of those first that are connected to what is there, as long as they cost no more
        than ``most``; what they cost."""
        cost, left = 0, list(ruin)
        while left and cost <= most:
            node = self._one_of([n for n in left if any(other not in left for other in self._near[n])] or left)
            left.remove(node)
            cost += self._state.put(node, next(self._dice), most - cost)
        return cost

    def _one_of(self, nodes: Sequence[int]) -> int:
        return nodes[next(self._dice) % len(nodes)]


def levels_in(levels: Levels, state: Insertion) -> tuple[Levels, Order]:
    """The levels, without ranks in which nothing but passages is left, and their order."""
    whole, passages = levels, dict[int, Sequence[int]](enumerate(link.passages for link in state.links))
    level = {r: r for r in range(len(levels.ranks))}
    if any(state.rank[n] != node.rank for n, node in enumerate(levels.nodes)):
        filled = sorted({rank for rank, node in zip(state.rank, levels.nodes, strict=True) if node.members})
        level = {r: place for place, r in enumerate(filled)}
        levels = moved(levels, [level.get(r, 0) for r in state.rank], len(level))
        links: dict[Ends, list[int]] = {}
        for c, ends in enumerate(state.ends):
            links.setdefault(ends, []).append(c)
        passages = {links[ends].pop(): levels.passages.get(i, ()) for i, ends in levels.ends.items()}
    order: Order = []
    for r in level:
        line: list[int] = []
        for node, c in map(state.owner, state.order[r]):
            if c >= 0:
                line.append(passages[c][level[r] - level[state.rank[state.links[c].upper]] - 1])
            elif node not in line[-1:] and (levels is whole or whole.nodes[node].members):
                line.append(node)
        order.append(line)
    return levels, order


def _dice() -> Iterator[int]:
    """Numbers below 2^20, the same every time (a linear congruential generator, its high bits)."""
    state = 1
    while True:
        state = (state * 1664525 + 1013904223) % (1 << 32)
        yield state >> 12
