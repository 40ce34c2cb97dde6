"""Order: who stands beside whom in a rank, so that few segments cross.

In: Levels. Out: node indices by rank, in order. Sweeps by barycentres from two starts, then swaps of neighbours.
Members of a box stay together; neurons of a group keep the order of their numbers unless crossings gain clearly.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_layouts.layered.levels import Levels

_CLEARLY = 0.85
_SMALL = 3000


class _Graph:
    """Neighbours above and below with the offsets of the ends, scaled so that a block is one place wide."""

    def __init__(self, levels: Levels) -> None:
        count = len(levels.nodes)
        self.nodes = levels.nodes
        self.above: list[list[tuple[int, float, float]]] = [[] for _ in range(count)]
        self.below: list[list[tuple[int, float, float]]] = [[] for _ in range(count)]
        self.size = 0
        for segment in (segment for gap in levels.segments for segment in gap):
            a = self._part(segment.upper, segment.a)
            b = self._part(segment.lower, segment.b)
            self.below[segment.upper].append((segment.lower, a, b))
            self.above[segment.lower].append((segment.upper, b, a))
            self.size += 1

    def _part(self, node: int, offset: float) -> float:
        return 0.45 * offset / (self.nodes[node].reach[0] + 0.5)


Order = list[list[int]]


def ordered(levels: Levels) -> Order:
    """The ranks in order. Deterministic: every tie falls to the order before, in the end to that of the names."""
    graph = _Graph(levels)
    natural = [_grouped_start(levels, rank) for rank in levels.ranks]
    sweeps = 12 if graph.size < _SMALL else 6 if graph.size < 20_000 else 3
    strict = _best(graph, [natural, _by_descent(graph, natural)], sweeps, True)
    if graph.size == 0 or strict[0] == 0:
        return strict[1]
    free = _best(graph, [strict[1], natural], sweeps, False)
    return free[1] if free[0] < _CLEARLY * strict[0] else strict[1]


def _best(graph: _Graph, starts: Sequence[Order], sweeps: int, strict: bool) -> tuple[int, Order]:
    best: tuple[int, Order] | None = None
    for start in starts:
        order = [list(rank) for rank in start]
        for sweep in range(sweeps):
            crossings = count(graph, order)
            if best is None or crossings < best[0]:
                best = crossings, [list(rank) for rank in order]
            if crossings == 0:
                return best
            _sweep(graph, order, sweep % 2 == 0, strict)
            if graph.size < _SMALL:
                _swap(graph, order, strict)
        crossings = count(graph, order)
        if best is None or crossings < best[0]:
            best = crossings, order
    assert best is not None
    return best


def _grouped_start(levels: Levels, rank: Sequence[int]) -> list[int]:
    """Natural order with the members of each box together, where its first one stands."""
    first: dict[int, int] = {}
    for place, node in enumerate(rank):
        first.setdefault(levels.nodes[node].box, place)
    key = {node: first[levels.nodes[node].box] if levels.nodes[node].box >= 0 else i for i, node in enumerate(rank)}
    return sorted(rank, key=lambda node: key[node])


def _by_descent(graph: _Graph, natural: Order) -> Order:
    """Nodes in the order in which a walk down from the first rank meets them: keeps what hangs together together."""
    met: dict[int, int] = {}
    for root in (node for rank in natural for node in rank):
        stack = [root]
        while stack:
            node = stack.pop()
            if node in met:
                continue
            met[node] = len(met)
            stack.extend(other for other, _, _ in reversed(graph.below[node]) if other not in met)
    order = [sorted(rank, key=lambda node: met[node]) for rank in natural]
    return [_settle(graph, rank, {node: float(i) for i, node in enumerate(rank)}, True) for rank in order]


def _sweep(graph: _Graph, order: Order, down: bool, strict: bool) -> None:
    ranks = range(1, len(order)) if down else range(len(order) - 2, -1, -1)
    near = graph.above if down else graph.below
    for r in ranks:
        place = {node: i for i, node in enumerate(order[r - 1 if down else r + 1])}
        value: dict[int, float] = {}
        last = -1.0
        for node in order[r]:
            ends = [place[other] + offset for other, _, offset in near[node]]
            last = sum(ends) / len(ends) if ends else last
            value[node] = last
        order[r] = _settle(graph, order[r], value, strict)


def _settle(graph: _Graph, rank: list[int], value: dict[int, float], strict: bool) -> list[int]:
    """Sort by value, boxes as a whole; with ``strict`` neurons of a group take the places they got in natural order."""
    boxes: dict[int, list[float]] = {}
    for node in rank:
        if graph.nodes[node].box >= 0:
            boxes.setdefault(graph.nodes[node].box, []).append(value[node])
    middle = {box: sum(values) / len(values) for box, values in boxes.items()}
    at = {node: i for i, node in enumerate(rank)}

    def key(node: int) -> tuple[float, int, float, int]:
        box = graph.nodes[node].box
        return (middle.get(box, value[node]), box, value[node], at[node])

    result = sorted(rank, key=key)
    if strict:
        slots: dict[tuple[int, int], list[int]] = {}
        for i, node in enumerate(result):
            if graph.nodes[node].kin >= 0:
                slots.setdefault((graph.nodes[node].kin, graph.nodes[node].box), []).append(i)
        for places in slots.values():
            for i, node in zip(places, sorted(result[i] for i in places), strict=True):
                result[i] = node
    return result


def _swap(graph: _Graph, order: Order, strict: bool) -> None:
    """Swap neighbours where that saves crossings, until none does (at most a few rounds)."""
    for _ in range(4):
        better = False
        for r, rank in enumerate(order):
            upper = {node: i for i, node in enumerate(order[r - 1])} if r > 0 else {}
            lower = {node: i for i, node in enumerate(order[r + 1])} if r + 1 < len(order) else {}
            up = {n: sorted(upper[o] + f for o, _, f in graph.above[n]) for n in rank} if upper else {}
            low = {n: sorted(lower[o] + f for o, _, f in graph.below[n]) for n in rank} if lower else {}
            for i in range(len(rank) - 1):
                a, b = rank[i], rank[i + 1]
                if not _may_swap(graph, a, b, strict):
                    continue
                gain = sum(_cross(s[a], s[b]) - _cross(s[b], s[a]) for s in (up, low) if s)
                if gain > 0:
                    rank[i], rank[i + 1] = b, a
                    better = True
        if not better:
            return


def _may_swap(graph: _Graph, a: int, b: int, strict: bool) -> bool:
    first, second = graph.nodes[a], graph.nodes[b]
    return first.box == second.box and not (strict and first.kin >= 0 and first.kin == second.kin)


def _cross(left: Sequence[float], right: Sequence[float]) -> int:
    """How many pairs cross when ``left``'s node stands to the left: ends of right before ends of left."""
    total, j = 0, 0
    for end in left:
        while j < len(right) and right[j] < end:
            j += 1
        total += j
    return total


def count(graph: _Graph, order: Order) -> int:
    """Crossings of all segments: inversions, by a Fenwick tree (Barth, Mutzel and Jünger 2004)."""
    total = 0
    for r in range(len(order) - 1):
        place = {node: i for i, node in enumerate(order[r + 1])}
        pairs = sorted(
            (i + a, place[other] + b) for i, node in enumerate(order[r]) for other, a, b in graph.below[node]
        )
        ends = {end: i + 1 for i, end in enumerate(sorted({end for _, end in pairs}))}
        tree = [0] * (len(ends) + 1)
        waiting: list[int] = []
        seen, start = 0, None
        for begin, end in pairs:
            if begin != start:  # segments from one point do not cross: they are entered when it is done
                for i in waiting:
                    _enter(tree, i)
                seen, waiting, start = seen + len(waiting), [], begin
            total += seen - _up_to(tree, ends[end])
            waiting.append(ends[end])
    return total


def _enter(tree: list[int], i: int) -> None:
    while i < len(tree):
        tree[i] += 1
        i += i & -i


def _up_to(tree: Sequence[int], i: int) -> int:
    total = 0
    while i > 0:
        total += tree[i]
        i -= i & -i
    return total
