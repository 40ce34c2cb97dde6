"""Insertion: ranks in order from which nodes and connections are taken out, and into which they are put back.

In: Levels in order. Out: the same with a node or a connection elsewhere, and what that costs. A slot is where something
may be put: before, between or behind the entries of a rank. A connection that crosses least on its way through ranks
whose order stands is a shortest path from slot to slot; the best slot of a node, in whichever of its ranks, is the one
to which the shortest paths of all of its connections are shortest together (after Gutwenger, Mutzel and Weiskircher
2005, who insert into planar graphs). All numbers are integers: the result is the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.levels import Levels

Counts = npt.NDArray[np.int32]

#: What a crossing costs; a connection costs 1 for each rank that it is long. So a crossing is saved at the price of
#: this many ranks; where it were less, connections would cross that need not; more changes nothing.
CROSSING = 64
#: The cost of a slot that nothing may take.
_SHUT = 1 << 22
#: Work is counted in operations on small arrays; one on so many numbers counts as two.
_NUMBERS = 4096


@dataclass(frozen=True, slots=True)
class Link:
    """A connection: the node and the entry where it leaves above, those where it arrives below, the box in which it
    runs (-1: none), its passages in the Levels, from above to below."""

    upper: int
    top: int
    lower: int
    bottom: int
    box: int
    passages: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Kept:
    """An order to which one can return."""

    order: tuple[list[int], ...]
    before: tuple[Counts, ...]
    costs: tuple[Counts | None, ...]
    rank: tuple[int, ...]
    cells: tuple[tuple[int, ...] | None, ...]


class Insertion:
    """Ranks as lists of entries: the points at which a node is connected (one, or several of a block, in their order)
    and cells (where a connection passes). Lists, arrays and tuples are replaced, never changed."""

    def __init__(
        self, levels: Levels, order: Sequence[Sequence[int]], strict: bool, free: AbstractSet[int] = frozenset()
    ) -> None:
        """With ``strict`` neurons of a group keep their order in each rank; ``free`` nodes may change theirs."""
        nodes = levels.nodes
        self.free, self._height = free, len(order)
        self.rank = [node.rank for node in nodes]
        self._box: Counts = np.array([node.box for node in nodes], dtype=np.int32)
        self._kin: Counts = np.array([node.kin if strict else -1 for node in nodes], dtype=np.int32)
        self._natural: Counts = np.zeros(len(nodes), dtype=np.int32)
        for rank in levels.ranks:
            self._natural[rank] = np.arange(len(rank), dtype=np.int32)
        self._points: list[list[int]] = [[] for _ in nodes]
        self._owner: list[int] = []
        self.ups: list[list[int]] = [[] for _ in nodes]
        self.downs: list[list[int]] = [[] for _ in nodes]
        self.links: list[Link] = []
        self.ends: list[tuple[int, float, int, float]] = []
        self._find_links(levels)
        # the node of each point, the box of each connection
        self._node_of: Counts = np.array(self._owner, dtype=np.int32)
        self._box_of: Counts = np.array([*(link.box for link in self.links), -1], dtype=np.int32)
        #: the cells of each connection from above to below; None while it is taken out
        self.cells: list[tuple[int, ...] | None] = [
            tuple(self._cell(number, nodes[n].rank) for n in link.passages) for number, link in enumerate(self.links)
        ]
        cell_of = {
            n: cell
            for link, cells in zip(self.links, self.cells, strict=True)
            for n, cell in zip(link.passages, cells or (), strict=True)
        }
        self.order = [[e for n in rank for e in ([cell_of[n]] if n in cell_of else self._points[n])] for rank in order]
        #: (i, j): how many segments leave a rank before its i-th entry and arrive before the j-th of the next
        self._before: list[Counts] = [
            np.zeros((len(a) + 1, len(b) + 1), dtype=np.int32) for a, b in pairwise(self.order)
        ]
        for r, i, j in self._segments():
            self._before[r][i + 1, j + 1] += 1
        self._before = [counts.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32) for counts in self._before]
        self._costs: list[Counts | None] = [None] * len(self._before)
        self._tight = [
            any(self._points[n] and (self._box[n] >= 0 or self._kin[n] >= 0 or len(self._points[n]) > 1) for n in rank)
            for rank in order
        ]
        self._out: set[int] = set()
        self.work = 0

    def _find_links(self, levels: Levels) -> None:
        """Points, links, and the links of each node on both sides."""
        count = len(levels.nodes)
        above: list[list[tuple[int, float, float]]] = [[] for _ in range(count)]
        below: list[list[tuple[int, float, float]]] = [[] for _ in range(count)]
        for segment in (segment for gap in levels.segments for segment in gap):
            below[segment.upper].append((segment.lower, segment.a, segment.b))
            above[segment.lower].append((segment.upper, segment.a, segment.b))
        passing = [
            not node.members and n not in levels.spines and len(above[n]) == len(below[n]) == 1
            for n, node in enumerate(levels.nodes)
        ]
        point: dict[tuple[int, float], int] = {}
        for n in range(count):
            for offset in () if passing[n] else sorted({a for _, a, _ in below[n]} | {b for *_, b in above[n]}) or [0]:
                point[n, offset] = len(self._owner)
                self._points[n].append(len(self._owner))
                self._owner.append(n)
        for n in range(count):
            for lower, a, b in () if passing[n] else sorted(below[n]):
                end, offset, passages = lower, b, []
                while passing[end]:
                    passages.append(end)
                    end, _, offset = below[end][0]
                self.downs[n].append(len(self.links))
                self.ups[end].append(len(self.links))
                box = levels.nodes[passages[0]].box if passages else -1
                self.links.append(Link(n, point[n, a], end, point[end, offset], box, tuple(passages)))
                self.ends.append((n, a, end, offset))

    def _cell(self, number: int, rank: int) -> int:
        """The entry of a connection in a rank."""
        return len(self._owner) + number * self._height + rank

    def owner(self, entry: int) -> tuple[int, int]:
        """The node of an entry, or -1, and its connection, or -1."""
        if entry < len(self._owner):
            return self._owner[entry], -1
        return -1, (entry - len(self._owner)) // self._height

    def cost(self) -> int:
        """That of the whole: its crossings and lengths."""
        segments = list(self._segments())
        crossed = sum(_between(self._before[r], i, j) for r, i, j in segments) // 2
        return crossed * CROSSING + len(segments)

    def _segments(self) -> Iterator[tuple[int, int, int]]:
        """Every piece of a connection: its upper rank, which entry it leaves there, at which of the next it arrives."""
        place = [{entry: i for i, entry in enumerate(rank)} for rank in self.order]
        for link, cells in zip(self.links, self.cells, strict=True):
            line = [link.top, *(cells or ()), link.bottom]
            for r, (a, b) in enumerate(pairwise(line), self.rank[link.upper]):
                yield r, place[r][a], place[r + 1][b]

    def keep(self) -> Kept:
        """The order as it is now."""
        return Kept(tuple(self.order), tuple(self._before), tuple(self._costs), tuple(self.rank), tuple(self.cells))

    def restore(self, kept: Kept) -> None:
        """Return to an order in which nothing was taken out."""
        self.order, self._before, self._costs = list(kept.order), list(kept.before), list(kept.costs)
        self.rank, self.cells = list(kept.rank), list(kept.cells)
        self._out.clear()

    def take(self, node: int) -> int:
        """Take a node out with its connections; what they cost."""
        saved = sum(self._unroute(c) for c in (*self.ups[node], *self.downs[node]) if self.cells[c] is not None)
        r, more = self.rank[node], len(self._points[node])
        p = self.order[r].index(self._points[node][0])
        self.order[r] = self.order[r][:p] + self.order[r][p + more :]
        if r > 0:
            old = self._before[r - 1]
            self._set(r - 1, np.concatenate((old[:, : p + 1], old[:, p + 1 + more :]), axis=1))
        if r < len(self._before):
            old = self._before[r]
            self._set(r, np.concatenate((old[: p + 1], old[p + 1 + more :])))
        self._out.add(node)
        return saved

    def put(self, node: int, roll: int) -> int:
        """Put a node back where its connections, to what is not taken out, cost least; what they cost. ``roll`` is a
        random number that chooses between slots that cost the same."""
        links = self.links
        first, last = self._first(node), self._last(node)
        ups = [c for c in self.ups[node] if links[c].upper not in self._out]
        downs = [c for c in self.downs[node] if links[c].lower not in self._out]
        from_above = self._reach([(self.rank[links[c].upper], links[c].top) for c in ups], first, last, True)
        from_below = self._reach([(self.rank[links[c].lower], links[c].bottom) for c in downs], first, last, False)
        best = slot = -1
        for r in range(first, last + 1):
            sums = [side[r] for side in (from_above, from_below) if side]
            costs = (
                sums[0] + sums[1] if len(sums) > 1 else sums[0] if sums else np.zeros(len(self.order[r]) + 1, np.int32)
            )
            if self._tight[r]:
                costs = costs + self._shut_to(r, node)
            least = int(costs.min())
            cost = least * CROSSING + len(ups) * (r - first) + len(downs) * (last - r)
            if slot < 0 or cost < best or (cost == best and roll & 1):
                ties = np.flatnonzero(costs == least)
                best, slot, self.rank[node] = cost, int(ties[roll % len(ties)]), r
            roll >>= 1
        r, more = self.rank[node], len(self._points[node])
        self.order[r] = self.order[r][:slot] + self._points[node] + self.order[r][slot:]
        if r > 0:
            old = self._before[r - 1]
            self._set(
                r - 1, np.concatenate((old[:, :slot], *[old[:, slot : slot + 1]] * (more + 1), old[:, slot + 1 :]), 1)
            )
        if r < len(self._before):
            old = self._before[r]
            self._set(r, np.concatenate((old[:slot], *[old[slot : slot + 1]] * (more + 1), old[slot + 1 :])))
        self._out.discard(node)
        return sum(self._route(c) for c in (*ups, *downs))

    def _first(self, node: int) -> int:
        """The first rank in which a node may stand, with a rank left for each node before it that is taken out."""
        if node not in self.free:
            return self.rank[node]
        above = {self.links[c].upper for c in self.ups[node]}
        return max((self._first(n) if n in self._out else self.rank[n] for n in above), default=-1) + 1

    def _last(self, node: int) -> int:
        if node not in self.free:
            return self.rank[node]
        below = {self.links[c].lower for c in self.downs[node]}
        return min((self._last(n) if n in self._out else self.rank[n] for n in below), default=self._height) - 1

    def _reach(self, starts: Sequence[tuple[int, int]], first: int, last: int, down: bool) -> dict[int, Counts]:
        """By rank from ``first`` to ``last``, for each slot: how many segments lines from all of these entries above,
        else below, cross on their way to it."""
        found: dict[int, Counts] = {}
        waiting = _by_rank(starts)
        lines: Counts | None = None
        step, end = (1, last) if down else (-1, first)
        begin = (min if down else max)(waiting, default=end + step)
        for r in range(begin, end + step, step):
            if lines is not None and first <= r <= last:
                found[r] = lines.sum(axis=0, dtype=np.int32)
            if r == end:
                break
            gap = r if down else r - 1
            if lines is not None:
                if self._tight[r]:
                    lines = lines + self._shut(r, -1)
                costs = self._cost_of(gap)
                lines = self._through(lines, costs if down else costs.T)
            if r in waiting:
                at = [self.order[r].index(entry) for entry in waiting[r]]
                whole = self._before[gap] if down else self._before[gap].T
                before, after = whole[at], whole[[i + 1 for i in at]]
                # what leaves before it and arrives behind, and what leaves behind it and arrives before
                more = before[:, -1:] - before + whole[-1] - after
                lines = more if lines is None else np.concatenate((lines, more))
        return found

    def _through(self, lines: Counts, costs: Counts) -> Counts:
        """The lines led on by one rank."""
        self.work += 2 + lines.shape[0] * costs.size // _NUMBERS
        found: Counts = (lines[:, :, None] + costs).min(axis=1)
        return found

    def _cost_of(self, r: int) -> Counts:
        """(p, q): how many segments a line from slot p of a rank to slot q of the next crosses."""
        found = self._costs[r]
        if found is None:
            before = self._before[r]
            found = before[:, -1:] + before[-1] - 2 * before
            self._costs[r] = found
        return found

    def _set(self, r: int, before: Counts) -> None:
        self._before[r], self._costs[r] = before, None

    def _unroute(self, c: int) -> int:
        """Take a connection out; what it costs."""
        link = self.links[c]
        line = [link.top, *(self.cells[c] or ()), link.bottom]
        first, last = self.rank[link.upper], len(line) - 2
        at = [self.order[first + k].index(entry) for k, entry in enumerate(line)]
        crossed = 0
        for k in range(last + 1):
            old = self._before[first + k]
            a, b, da, db = at[k] + 1, at[k + 1] + 1, k > 0, k < last
            crossed += _between(old, a - 1, b - 1)
            new = np.empty((old.shape[0] - da, old.shape[1] - db), dtype=np.int32)
            new[:a, :b] = old[:a, :b]
            new[:a, b:] = old[:a, b + db :]
            new[a:, :b] = old[a + da :, :b]
            np.subtract(old[a + da :, b + db :], 1, out=new[a:, b:])
            self._set(first + k, new)
            self.work += 1 + old.size // _NUMBERS
        for k in range(1, last + 1):
            rank = self.order[first + k]
            self.order[first + k] = rank[: at[k]] + rank[at[k] + 1 :]
        self.cells[c] = None
        return crossed * CROSSING + last + 1

    def _route(self, c: int) -> int:
        """Put a connection back where it crosses least; what it costs."""
        link = self.links[c]
        first, last = self.rank[link.upper], self.rank[link.lower]
        a, b = self.order[first].index(link.top), self.order[last].index(link.bottom)
        if last == first + 1:
            crossed, at = _between(self._before[first], a, b), [a, b]
        else:
            crossed, at = self._way(link, a, b)
        for k in range(last - first):
            old = self._before[first + k]
            i, j, di, dj = at[k] + 1, at[k + 1] + 1, k > 0, first + k + 1 < last
            new = np.empty((old.shape[0] + di, old.shape[1] + dj), dtype=np.int32)
            new[:i, :j] = old[:i, :j]
            new[:i, j:] = old[:i, j - dj :]
            new[i:, :j] = old[i - di :, :j]
            np.add(old[i - di :, j - dj :], 1, out=new[i:, j:])
            self._set(first + k, new)
            self.work += 1 + old.size // _NUMBERS
        cells = tuple(self._cell(c, r) for r in range(first + 1, last))
        for r, slot, cell in zip(range(first + 1, last), at[1:-1], cells, strict=True):
            self.order[r] = [*self.order[r][:slot], cell, *self.order[r][slot:]]
        self.cells[c] = cells
        return crossed * CROSSING + last - first

    def _way(self, link: Link, a: int, b: int) -> tuple[int, list[int]]:
        """The least crossings on the way from the a-th to the b-th entry of two ranks; these and the slots between."""
        first, last = self.rank[link.upper] + 1, self.rank[link.lower] - 1
        before = self._before[first - 1]
        line = before[a, -1] - before[a] + before[-1] - before[a + 1]
        come: list[npt.NDArray[np.int64]] = []
        for r in range(first, last + 1):
            if self._tight[r]:
                line = line + self._shut(r, link.box)
            if r < last:
                through = line[:, None] + self._cost_of(r)
                come.append(through.argmin(axis=0))
                line = through.min(axis=0)
                self.work += 2 + through.size // _NUMBERS
        before = self._before[last]
        line = line + before[:, -1] - before[:, b + 1] + before[-1, b] - before[:, b]
        slots = [int(line.argmin())]
        crossed = int(line[slots[0]])
        for back in reversed(come):
            slots.append(int(back[slots[-1]]))
        return crossed, [a, *slots[::-1], b]

    def _shut(self, r: int, box: int) -> Counts:
        """For each slot of a rank ``_SHUT`` where it lies within a block or another box, or outside of ``box`` though
        that is in the rank; else 0."""
        node, boxes = self._owners(r)
        within = (node[1:] == node[:-1]) & (node[1:] >= 0)
        within |= (boxes[1:] == boxes[:-1]) & (boxes[1:] >= 0) & (boxes[1:] != box)
        found = np.zeros(len(node) + 1, dtype=np.int32)
        found[1:-1][within] = _SHUT
        own = np.flatnonzero(boxes == box)
        if box >= 0 and len(own):
            found[: own[0]] = _SHUT
            found[own[-1] + 2 :] = _SHUT
        return found

    def _shut_to(self, r: int, node: int) -> Counts:
        """``_shut`` for a node, which also has to keep its place in the order of its group."""
        found = self._shut(r, int(self._box[node]))
        if self._kin[node] >= 0:
            other, boxes = self._owners(r)
            alike = (other >= 0) & (self._kin[other] == self._kin[node]) & (boxes == self._box[node])
            before = alike & (self._natural[other] < self._natural[node])
            found[: np.flatnonzero(before).max(initial=-1) + 1] = _SHUT
            found[np.flatnonzero(alike & ~before).min(initial=len(other)) + 1 :] = _SHUT
        return found

    def _owners(self, r: int) -> tuple[Counts, Counts]:
        """The node of each entry of a rank, or -1, and its box, or that of its connection."""
        entries = np.array(self.order[r], dtype=np.int64)
        count = len(self._owner)
        point = entries < count
        node = np.where(point, self._node_of[np.minimum(entries, count - 1)], -1)
        link = np.where(point, -1, (entries - count) // self._height)
        return node, np.where(point, self._box[node], self._box_of[link])


def _between(before: Counts, i: int, j: int) -> int:
    """How many segments a line between the i-th entry of a rank and the j-th of the next crosses."""
    return int(before[i, -1] - before[i, j + 1] + before[-1, j] - before[i + 1, j])


def _by_rank(starts: Sequence[tuple[int, int]]) -> Mapping[int, list[int]]:
    found: dict[int, list[int]] = {}
    for rank, entry in starts:
        found.setdefault(rank, []).append(entry)
    return found
