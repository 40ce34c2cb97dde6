"""Order: who stands beside whom in a rank, so that few segments cross.

In: Levels. Out: node indices by rank, in order, and Levels in which what may has moved to other ranks. Sweeps by
barycentres from several starts, sifting after each; then nodes are taken out and put back (``reinsertion``). Members of
a box stay together; neurons of a group keep the order of their numbers unless crossings gain clearly.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from neurovis_layouts.layered.crossings import Floats, Ints, Segments
from neurovis_layouts.layered.exchange import Exchange
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.layered.reinsertion import reinserted
from neurovis_layouts.layered.sifting import HELD, sifted, sifted_in_boxes
from neurovis_spec.layout.model import Effort

Order = list[list[int]]

_CLEARLY = 0.85
#: Work is counted as pairs of segments that a pass of sifting compares, and this for each rank.
_A_RANK = 3000
#: Beyond this a pass takes too long.
_SIFTED = 1_500_000
#: Sweeps from each start, with sifting and without.
_SWEEPS, _PLAIN_SWEEPS = 4, 14
#: Beyond this the order that keeps groups in theirs is not improved where another is clearly better.
_LONG = 100_000


def ordered(
    levels: Levels, free: AbstractSet[int] = frozenset(), effort: Effort = "normal", draft: bool = False
) -> tuple[Levels, Order]:
    """The ranks in order; ``free`` nodes may have moved to others. A ``draft`` is one start, sifted once: as wide,
    about, as what is drawn in full. Deterministic: every tie falls to the order before, in the end to that of the
    names."""
    natural = [_grouped_start(levels, rank) for rank in levels.ranks]
    if not any(levels.segments):
        return levels, natural
    segments = Segments(levels)
    starts = [natural, _by_descent(levels, natural)]
    if draft:
        return levels, _Search(levels, segments, False, effort).best(starts[1:], 0)[1]
    held = _Search(levels, segments, True, effort)
    strict = held.best(starts)
    if strict[0] == 0 or not any(held.kin):
        return held.improved(*strict, free)[1:]
    loose = _Search(levels, segments, False, effort)
    if held.work > _LONG:
        unbound = loose.improved(*loose.best([natural, strict[1]]), free)
        return (unbound if unbound[0] < _CLEARLY * strict[0] else held.improved(*strict, free))[1:]
    kept = held.improved(*strict, free)
    unbound = loose.improved(*loose.best([natural, strict[1]]), free)
    return (unbound if unbound[0] < _CLEARLY * kept[0] else kept)[1:]


def crossings(levels: Levels, order: Order) -> int:
    """How many segments cross in this order."""
    return Segments(levels).count(places(len(levels.nodes), [np.array(rank, dtype=np.int64) for rank in order]))


def places(count: int, order: Sequence[Ints]) -> Ints:
    """The place of each of ``count`` nodes in its rank."""
    place = np.zeros(count, dtype=np.int64)
    for rank in order:
        place[rank] = np.arange(len(rank), dtype=np.int64)
    return place


class _Search:
    """One search; with ``strict`` neurons of a group keep their order in each rank."""

    def __init__(self, levels: Levels, segments: Segments, strict: bool, effort: Effort) -> None:
        self.levels, self.segments, self.strict, self.effort = levels, segments, strict, effort
        self.ids = [np.array(rank, dtype=np.int64) for rank in levels.ranks]
        boxes = np.array([node.box for node in levels.nodes], dtype=np.int64)
        self.boxes = [_shared(boxes[ids]) for ids in self.ids]
        self.kin = [_kin(levels, rank) if strict else [] for rank in levels.ranks]
        self.work = sum(len(side.other) ** 2 + _A_RANK for side in (*segments.above, *segments.below)) // 2
        # by order: what sifting makes of it, and a sweep; different starts lead to the same orders
        self._settled: dict[bytes, tuple[int, list[Ints]]] = {}
        self._swept: dict[tuple[bytes, bool], list[Ints]] = {}

        self.sifts = max(self.work, max(len(rank) for rank in self.ids) ** 2) <= _SIFTED

    def best(self, starts: Sequence[Order], sweeps: int = _SWEEPS) -> tuple[int, Order]:
        """The best order that so many sweeps and sifting lead to, and its crossings; what is too large to be sifted is
        swept more often, from one start."""
        sift = self.sifts
        best: tuple[int, list[Ints]] | None = None
        for start in starts if sift else starts[1:2] or starts:
            state = _State(self, [np.array(rank, dtype=np.int64) for rank in start])
            state.group()
            for sweep in range((sweeps if sift else _PLAIN_SWEEPS) + 1):
                if sweep and sift:
                    state = self._after(state, sweep % 2 == 1)
                elif sweep:
                    state.sweep(sweep % 2 == 1, False)
                crossings, order = self._sifted(state.copy()) if sift else (state.count(), list(state.order))
                if best is None or crossings < best[0]:
                    best = crossings, order
                if crossings == 0:
                    return 0, [rank.tolist() for rank in order]
        assert best is not None
        if not sift:
            best = Exchange(self.segments, self._classes()).improved(*best)
        return best[0], [rank.tolist() for rank in best[1]]

    def _sifted(self, state: _State) -> tuple[int, list[Ints]]:
        """The order of a state after all of its ranks are sifted, and its crossings."""
        key = state.key()
        if key not in self._settled:
            crossings = state.count() - state.sift()
            self._settled[key] = crossings, list(state.order)
        return self._settled[key]

    def _after(self, state: _State, down: bool) -> _State:
        """The state after a sweep."""
        key = state.key(), down
        if key not in self._swept:
            state.sweep(down, True)
            self._swept[key] = list(state.order)
            return state
        return _State(self, list(self._swept[key]))

    def _classes(self) -> tuple[Ints, Ints]:
        """Boxes and, where their order is kept, groups by node."""
        nodes = self.levels.nodes
        box = np.array([node.box for node in nodes], dtype=np.int64)
        return box, np.array([node.kin if self.strict else -1 for node in nodes], dtype=np.int64)

    def improved(self, crossings: int, order: Order, free: AbstractSet[int]) -> tuple[int, Levels, Order]:
        """The order after reinsertion, with its crossings and levels; the same where there is nothing to gain."""
        if self.sifts and crossings:
            return reinserted(self.levels, order, self.strict, free, self.effort)
        return crossings, self.levels, order


class _State:
    """An order that is worked on; rank arrays are replaced, never changed."""

    def __init__(self, search: _Search, order: list[Ints]) -> None:
        self.search, self.order = search, order
        self.place = places(len(search.levels.nodes), order)
        # by rank and side: the order beside it, and what its nodes cost each other with regard to that
        self.known: dict[tuple[int, bool], tuple[Ints, Ints]] = {}

    def copy(self) -> _State:
        state = _State(self.search, list(self.order))
        state.known = dict(self.known)
        return state

    def key(self) -> bytes:
        return np.concatenate(self.order).tobytes()

    def count(self) -> int:
        return self.search.segments.count(self.place)

    def set(self, r: int, local: Ints) -> None:
        rank = self.search.ids[r][local]
        self.order[r] = rank
        self.place[rank] = np.arange(len(rank), dtype=np.int64)

    def sweep(self, down: bool, sift: bool) -> None:
        """Each rank by the barycentres of what lies above (else below), and sifted with regard to it."""
        segments, count = self.search.segments, len(self.order)
        for r in range(1, count) if down else range(count - 2, -1, -1):
            side = (segments.above if down else segments.below)[r]
            order = segments.local[self.order[r]]
            means = segments.means(len(order), side, self.place)[order]
            known = ~np.isnan(means)
            if not known.any():
                continue
            # what is connected to nothing there stays behind what it stands behind
            last = np.maximum.accumulate(np.where(known, np.arange(len(means)), -1))
            order = self._settled(r, order, np.where(last >= 0, means[last], -1.0))
            if sift:
                order = self._sifted(r, order, False, down)[0]
            self.set(r, order)

    def sift(self) -> int:
        """All ranks sifted with regard to both sides, down and up, until none gains; how many crossings that saved."""
        count, saved = len(self.order), 0
        due = [len(rank) > 1 for rank in self.order]
        down = True
        while any(due):
            for r in range(count) if down else range(count - 1, -1, -1):
                if due[r]:
                    order, gain = self._sifted(r, self.search.segments.local[self.order[r]], True, True)
                    due[r] = False
                    if gain:
                        self.set(r, order)
                        saved += gain
                        for beside in (r - 1, r + 1):
                            if 0 <= beside < count:
                                due[beside] = len(self.order[beside]) > 1
            down = not down
        return saved

    def group(self) -> None:
        """Boxes together, and neurons of a group that keep their order in it."""
        for r, rank in enumerate(self.order):
            self.set(r, self._settled(r, self.search.segments.local[rank], np.arange(len(rank), dtype=np.float64)))

    def _sifted(self, r: int, order: Ints, both: bool, down: bool) -> tuple[Ints, int]:
        search = self.search
        costs = self._costs(r, True) + self._costs(r, False) if both else self._costs(r, down).copy()
        for mates in search.kin[r]:
            costs[mates[:, None], mates] = np.sign(mates[:, None] - mates) * HELD
        boxes = search.boxes[r]
        return sifted(costs, order) if boxes is None else sifted_in_boxes(costs, order, boxes)

    def _costs(self, r: int, above: bool) -> Ints:
        """What the nodes of a rank cost each other with regard to the rank above, else below, as long as that keeps its
        order."""
        segments, beside = self.search.segments, r - 1 if above else r + 1
        order = self.order[beside] if 0 <= beside < len(self.order) else self.order[r][:0]
        known = self.known.get((r, above))
        if known is None or not (known[0] is order or np.array_equal(known[0], order)):
            side = (segments.above if above else segments.below)[r]
            known = self.known[r, above] = (order, segments.differences(len(self.order[r]), side, self.place))
        return known[1]

    def _settled(self, r: int, order: Ints, value: Floats) -> Ints:
        """Sorted by value, boxes as a whole; neurons of a group take the places that they got in natural order."""
        boxes = self.search.boxes[r]
        if boxes is None:
            result = order[np.argsort(value, kind="stable")]
        else:
            box = boxes[order]
            inside = box >= 0
            sums = np.bincount(box[inside], value[inside])
            mean = np.where(inside, (sums / np.maximum(np.bincount(box[inside]), 1))[np.maximum(box, 0)], value)
            result = order[np.lexsort((np.arange(len(order)), value, box, mean))]
        for mates in self.search.kin[r]:
            places = np.flatnonzero(np.isin(result, mates))
            result[places] = mates
        return result


def _shared(boxes: Ints) -> Ints | None:
    """Boxes by node, if any holds two of a rank."""
    inside = boxes[boxes >= 0]
    return boxes if len(inside) > len(np.unique(inside)) else None


def _kin(levels: Levels, rank: Sequence[int]) -> list[Ints]:
    """Places in ``ranks[r]`` of neurons of one group in one box, in their order, where there are several."""
    kin: dict[tuple[int, int], list[int]] = {}
    for i, node in enumerate(rank):
        if levels.nodes[node].kin >= 0:
            kin.setdefault((levels.nodes[node].kin, levels.nodes[node].box), []).append(i)
    return [np.array(mates, dtype=np.int64) for mates in kin.values() if len(mates) > 1]


def _grouped_start(levels: Levels, rank: Sequence[int]) -> list[int]:
    """Natural order with the members of each box together, where its first one stands."""
    first: dict[int, int] = {}
    for place, node in enumerate(rank):
        first.setdefault(levels.nodes[node].box, place)
    key = {node: first[levels.nodes[node].box] if levels.nodes[node].box >= 0 else i for i, node in enumerate(rank)}
    return sorted(rank, key=lambda node: key[node])


def _by_descent(levels: Levels, natural: Order) -> Order:
    """Nodes in the order in which a walk down from the first rank meets them: keeps what hangs together together."""
    below: list[list[int]] = [[] for _ in levels.nodes]
    for segment in (segment for gap in levels.segments for segment in gap):
        below[segment.upper].append(segment.lower)
    met: dict[int, int] = {}
    for root in (node for rank in natural for node in rank):
        stack = [root]
        while stack:
            node = stack.pop()
            if node not in met:
                met[node] = len(met)
                stack.extend(other for other in reversed(below[node]) if other not in met)
    return [_grouped_start(levels, sorted(rank, key=lambda node: met[node])) for rank in natural]
