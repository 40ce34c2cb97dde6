"""Insertion: ranks in order from which nodes and connections are taken out, and into which they are put back.

In: Levels in order. Out: the same with a node or a connection elsewhere, and what that costs. A slot is where something
may be put: before, between or behind the entries of a rank. A connection that crosses least on its way through ranks
whose order stands is a shortest path from slot to slot; the best slot of a node, in whichever of its ranks, is the one
to which the shortest paths of all of its connections are shortest together (after Gutwenger, Mutzel and Weiskircher
2005, who insert into planar graphs). All numbers are integers: the result is the same on every machine. Mirror images
are taken out and put back together: the one before the axis where it costs least, the other and its connections as
that has it.

Two ranks of two nodes, A connected with C and B with D, have three slots each. What a line from slot p above to slot q
below would cross is a table with a row for each p, which grows and shrinks with the ranks::

    slots   0   1   2
    above     A   B             q = 0  1  2
              |   |      p = 0      0  1  2
    below     C   D          1      1  0  1
    slots   0   1   2        2      2  1  0

To put in another line is to add 1 where it would be crossed; to take one out is to subtract it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.levels import Halves, Levels

Counts = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]
#: by rank: connections, and how many segments each has crossed at each slot
Lines = dict[int, tuple[list[int], Counts]]
#: by rank: slots, what decides who comes first in a slot, entries
Added = dict[int, list[tuple[int, tuple[float, ...], int]]]

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
    runs (-1: none), its passages in the Levels, from above to below, and whether nothing passes it."""

    upper: int
    top: int
    lower: int
    bottom: int
    box: int
    passages: tuple[int, ...]
    idle: bool


@dataclass(frozen=True, slots=True)
class Kept:
    """An order to which one can return."""

    order: tuple[list[int], ...]
    costs: tuple[Counts, ...]
    rank: tuple[int, ...]
    cells: tuple[tuple[int, ...] | None, ...]


class Insertion:
    """Ranks as lists of entries: the points at which a node is connected (one, or several of a block, in their order)
    and cells (where a connection passes). Lists, arrays and tuples are replaced, never changed."""

    def __init__(
        self, levels: Levels, order: Sequence[Sequence[int]], strict: bool, free: AbstractSet[int] = frozenset()
    ) -> None:
        """With ``strict`` neurons of a group keep their order in each rank; ``free`` nodes may change theirs."""
        nodes, halves = levels.nodes, Halves(levels)
        self.free, self._height = free, len(order)
        #: of each node its mirror image, and that of the two which stands before the axis
        self.image = halves.image.tolist()
        self.lead = np.where(halves.side > 0, halves.image, np.arange(len(nodes))).tolist()
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
        #: the mirror image of each connection; by point and by connection, whether it stands in the middle
        self._twin = self._twins(levels)
        self._central: BoolArray = np.array([self.image[n] == n for n in self._owner], dtype=np.bool_)
        self._straight: BoolArray = np.array([*(c == twin for c, twin in enumerate(self._twin)), True], dtype=np.bool_)
        #: the cells of each connection from above to below; None while it is taken out
        self.cells: list[tuple[int, ...] | None] = [
            tuple(self._cell(number, nodes[n].rank) for n in link.passages) for number, link in enumerate(self.links)
        ]
        self.order = self._entries(order)
        #: by rank (p, q): how many segments a line from slot p to slot q of the next rank crosses
        self._costs: list[Counts] = [
            np.zeros((len(a) + 1, len(b) + 1), dtype=np.int32) for a, b in pairwise(self.order)
        ]
        self.work = 0
        #: what all connections cost in the order at first: their crossings and their lengths
        self.cost = sum(self._threaded(c, 1) for c in range(len(self.links)))
        #: by rank, whether some of its slots are shut: within a box, a group that keeps its order, a block; beside an
        #: axis
        self._tight = [bool(levels.images) or any(map(self._shuts, rank)) for rank in order]
        self._out: set[int] = set()
        #: by rank the entries that were in it when slots were last found to be shut, and those by box and for what
        #: stands in the middle or not
        self._known: list[tuple[list[int], dict[tuple[int, bool], Counts]]] = [([], {}) for _ in order]

    def _entries(self, order: Sequence[Sequence[int]]) -> list[list[int]]:
        """By rank the points of its nodes, and the cells of those that are passages."""
        cell_of = {
            n: cell
            for link, cells in zip(self.links, self.cells, strict=True)
            for n, cell in zip(link.passages, cells or (), strict=True)
        }
        return [[e for n in rank for e in ([cell_of[n]] if n in cell_of else self._points[n])] for rank in order]

    def _shuts(self, node: int) -> bool:
        """Whether something stands beside a node that others may not come between."""
        points = self._points[node]
        return bool(points) and (self._box[node] >= 0 or self._kin[node] >= 0 or len(points) > 1)

    def _find_links(self, levels: Levels) -> None:
        """Points, links, and the links of each node on both sides."""
        count = len(levels.nodes)
        above: list[list[tuple[int, float, float, bool]]] = [[] for _ in range(count)]
        below: list[list[tuple[int, float, float, bool]]] = [[] for _ in range(count)]
        for segment in (segment for gap in levels.segments for segment in gap):
            below[segment.upper].append((segment.lower, segment.a, segment.b, segment.idle))
            above[segment.lower].append((segment.upper, segment.a, segment.b, segment.idle))
        passing = [
            not node.members and n not in levels.spines and len(above[n]) == len(below[n]) == 1
            for n, node in enumerate(levels.nodes)
        ]
        point: dict[tuple[int, float], int] = {}
        for n in range(count):
            for offset in (
                () if passing[n] else sorted({a for _, a, _, _ in below[n]} | {b for _, _, b, _ in above[n]}) or [0]
            ):
                point[n, offset] = len(self._owner)
                self._points[n].append(len(self._owner))
                self._owner.append(n)
        for n in range(count):
            for lower, a, b, idle in () if passing[n] else sorted(below[n]):
                end, offset, passages = lower, b, []
                while passing[end]:
                    passages.append(end)
                    end, _, offset, _ = below[end][0]
                self.downs[n].append(len(self.links))
                self.ups[end].append(len(self.links))
                box = levels.nodes[passages[0]].box if passages else -1
                self.links.append(Link(n, point[n, a], end, point[end, offset], box, tuple(passages), idle))
                self.ends.append((n, a, end, offset))

    def _twins(self, levels: Levels) -> list[int]:
        """The mirror image of each connection: between the images of its points and of its passages."""
        point = list(range(len(self._owner)))
        for n, image in levels.images.items():
            for one, other in zip(self._points[n], reversed(self._points[image]), strict=True):
                point[one] = other
        known: dict[tuple[int, ...], list[int]] = {}
        for c, link in enumerate(self.links):
            known.setdefault((link.top, link.bottom, *link.passages), []).append(c)
        twin = list(range(len(self.links)))
        for (top, bottom, *passages), links in known.items():
            images = known[point[top], point[bottom], *(self.image[n] for n in passages)]
            for c, image in zip(links, images, strict=True):
                twin[c] = image
        return twin

    def _cell(self, number: int, rank: int) -> int:
        """The entry of a connection in a rank."""
        return len(self._owner) + number * self._height + rank

    def ends_of(self, c: int) -> tuple[int, int]:
        """The nodes from which and to which a connection leads."""
        return self.links[c].upper, self.links[c].lower

    def owner(self, entry: int) -> tuple[int, int]:
        """The node of an entry, or -1, and its connection, or -1."""
        if entry < len(self._owner):
            return self._owner[entry], -1
        return -1, (entry - len(self._owner)) // self._height

    def _threaded(self, c: int, sign: int) -> int:
        """Count the segments of a connection with all others (``sign`` 1), or no more (-1); what they cost."""
        link, cost = self.links[c], 0
        if link.idle:
            return cost
        r = self.rank[link.upper]
        i = self.order[r].index(link.top)
        for entry in (*(self.cells[c] or ()), link.bottom):
            j, costs = self.order[r + 1].index(entry), self._costs[r]
            for crossing in (costs[: i + 1, j + 1 :], costs[i + 1 :, : j + 1]):
                crossing += sign
            # the lines beside it cross what it crosses and what begins or ends where it does
            beside = costs.item(i, j + 1) + costs.item(i + 1, j)
            alike = costs.item(i + 1, 0) - costs.item(i, 0) + costs.item(0, j + 1) - costs.item(0, j)
            cost += (beside - alike) // 2 * CROSSING + 1
            i, r = j, r + 1
        self.work += len(self.cells[c] or ()) + 1
        return cost

    def keep(self) -> Kept:
        """The order as it is now."""
        return Kept(tuple(self.order), tuple(self._costs), tuple(self.rank), tuple(self.cells))

    def restore(self, kept: Kept) -> None:
        """Return to an order in which nothing was taken out."""
        self.order, self._costs = list(kept.order), list(kept.costs)
        self.rank, self.cells = list(kept.rank), list(kept.cells)
        self._out.clear()

    def take(self, nodes: Sequence[int]) -> int:
        """Take nodes out with their connections, and their images; what these cost."""
        nodes = [m for n in nodes for m in sorted({n, self.image[n]})]
        every = dict.fromkeys(c for n in nodes for c in (*self.ups[n], *self.downs[n]) if self.cells[c] is not None)
        gone: dict[int, set[int]] = {}
        copied: set[int] = set()
        cost = 0
        for c in every:
            top = self.rank[self.links[c].upper]
            for r in range(top, self.rank[self.links[c].lower]):
                if r not in copied:
                    copied.add(r)
                    self._costs[r] = self._costs[r].copy()
            cost += self._threaded(c, -1)
            for r, cell in enumerate(self.cells[c] or (), top + 1):
                gone.setdefault(r, set()).add(cell)
            self.cells[c] = None
        for n in nodes:
            gone.setdefault(self.rank[n], set()).update(self._points[n])
        left: dict[int, list[int]] = {}
        for r, entries in gone.items():
            left[r] = [0, *(i for i, entry in enumerate(self.order[r], 1) if entry not in entries)]
            self.order[r] = [entry for entry in self.order[r] if entry not in entries]
        self._select(left)
        self._out.update(nodes)
        return cost

    def _select(self, slots: Mapping[int, Sequence[int]]) -> None:
        """Some ranks are others now: for each of their slots which one it was."""
        for gap in sorted({r - 1 for r in slots if r} | {r for r in slots if r < len(self._costs)}):
            costs = self._costs[gap]
            if gap in slots:
                costs = costs.take(slots[gap], 0)
            if gap + 1 in slots:
                costs = costs.take(slots[gap + 1], 1)
            self._costs[gap] = costs
            self.work += 1 + costs.size // _NUMBERS

    def put(self, node: int, roll: int, most: int) -> int:
        """Put a node back where its connections, to what is not taken out, cost least, and its image opposite; what
        they cost. Where that is more than ``most`` it stays out. ``roll`` is a random number that chooses between slots
        that cost the same."""
        first, last = self._first(node), self._last(node)
        ups = [c for c in self.ups[node] if self.links[c].upper not in self._out]
        downs = [c for c in self.downs[node] if self.links[c].lower not in self._out]
        sides = [
            (self._lines([c for c in links if self.links[c].idle == idle], end, step < 0, idle), step, idle)
            for links, end, step in ((ups, last, -1), (downs, first, 1))
            for idle in (False, True)
        ]
        options = list(self._options(node, ups, downs, [lines for lines, *_ in sides if lines]))
        best = min(cost for cost, *_ in options)
        if best > most:
            return best
        options = [option for option in options if option[0] == best]
        roll, choice = divmod(roll, len(options))
        _, at, costs = options[choice]
        ties = np.flatnonzero(costs == costs.min())
        slot = int(ties[roll % len(ties)])
        added = self._placed(node, at, slot)
        led: set[int] = set()
        for lines, step, idle in sides:
            for k, c in enumerate(lines[at][0] if lines else ()):
                if c not in led:
                    self._lead(c, [slot, *self._way(lines, k, at, slot, step, idle)], at, step, added)
                    led.update((c, self._twin[c]))
        return self._insert(added, sorted(led))

    def _placed(self, node: int, at: int, slot: int) -> Added:
        """A node, and its image, in a rank again, at a slot, and at the one opposite."""
        added: Added = {at: []}
        for behind, n in enumerate(dict.fromkeys((node, self.image[node]))):
            self.rank[n] = at
            self._out.discard(n)
            there = len(self.order[at]) - slot if behind else slot
            added[at] += [(there, (behind, number), point) for number, point in enumerate(self._points[n])]
        return added

    def _options(
        self, node: int, ups: Sequence[int], downs: Sequence[int], ways: Sequence[Lines]
    ) -> Iterator[tuple[int, int, Counts]]:
        """For each rank that a node may have what its connections up and down cost there at least, the rank, and what
        they cross at each slot; ``ways`` are those of its connections."""
        first, last = self._first(node), self._last(node)
        length = sum(first - self.rank[self.links[c].upper] for c in ups)
        length += sum(self.rank[self.links[c].lower] - last for c in downs)
        for r in range(first, last + 1):
            costs = sum((np.add.reduce(lines[r][1], 0) for lines in ways), self._shut_to(r, node))
            least = int(costs[costs.argmin()])
            yield least * CROSSING + length + len(ups) * (r - first) + len(downs) * (last - r), r, costs
            self.work += 1

    def _costs_of(self, gap: int, idle: bool) -> Counts:
        """What a segment between two ranks costs; one that is ``idle`` counts as the one whose image it is."""
        return self._costs[gap][::-1, ::-1] if idle else self._costs[gap]

    def _lines(self, links: Sequence[int], end: int, down: bool, idle: bool) -> Lines:
        """For each rank on the way from the far ends of these connections, above or below, to the ``end``: those that
        have begun, and for each slot how many segments each of them crosses to get there."""
        lines: Lines = {}
        if not links:
            return lines
        step = 1 if down else -1
        ends: dict[int, list[int]] = {}
        for c in links:
            ends.setdefault(self.rank[self.links[c].upper if down else self.links[c].lower], []).append(c)
        begun: list[int] = []
        for r in range((min if down else max)(ends), end, step):
            costs = self._costs_of(r, idle) if down else self._costs_of(r - 1, idle).T
            found: list[Counts] = []
            if begun:
                here = lines[r][1]
                if self._tight[r]:
                    kinds = [(self.links[c].box, self._twin[c] == c) for c in begun]
                    shut = {kind: self._shut(r, *kind) for kind in set(kinds)}
                    here = here + np.array([shut[kind] for kind in kinds])
                self.work += 2 + len(begun) * costs.size // _NUMBERS
                found.append(np.minimum.reduce(here[:, :, None] + costs, axis=1))
            if r in ends:
                at = [self.order[r].index(self.links[c].top if down else self.links[c].bottom) for c in ends[r]]
                before, after = costs[at], costs[[i + 1 for i in at]]
                # both cross what a line from between them crosses, and one or the other what begins there, too
                found.append((before + after - (after[:, :1] - before[:, :1])) // 2)
                begun = begun + ends[r]
            lines[r + step] = begun, found[0] if len(found) == 1 else np.concatenate(found)
        return lines

    def _way(self, lines: Lines, k: int, r: int, slot: int, step: int, idle: bool) -> Iterator[int]:
        """The slots through which the k-th of some lines comes to a slot of a rank, from the last one back."""
        while (r := r + step) in lines and k < len(lines[r][0]):
            reached = lines[r][1][k]
            if self._tight[r]:
                c = lines[r][0][k]
                reached = reached + self._shut(r, self.links[c].box, self._twin[c] == c)
            costs = self._costs_of(r - 1, idle).T if step > 0 else self._costs_of(r, idle)
            slot = int((reached + costs[:, slot]).argmin())
            yield slot

    def _lead(self, c: int, way: Sequence[int], r: int, step: int, added: Added) -> None:
        """A connection from a slot of a rank through others, and its image: of several in one slot that stands first
        which comes from farther to the front; the images of what comes from one place the other way round."""
        link, twin = self.links[c], self._twin[c]
        end = link.top if step < 0 else link.bottom
        line = [*way, self.order[r + step * len(way)].index(end) + 0.5]
        opposite = [len(self.order[r + step * i]) - place for i, place in enumerate(line)]
        for i in range(1, len(way)):
            there = r + step * i
            some = added.setdefault(there, [])
            some.append((way[i], (*line[i + 1 :], 0, c), self._cell(c, there)))
            if twin != c:
                some.append((len(self.order[there]) - way[i], (*opposite[i + 1 :], 1, -c), self._cell(twin, there)))

    def _insert(self, added: Added, links: Sequence[int]) -> int:
        """Put entries into slots, and connections through them; what these cost."""
        slots: dict[int, list[int]] = {}
        for r, entries in added.items():
            rank = list(self.order[r])
            slots[r] = sorted([*range(len(rank) + 1), *(slot for slot, *_ in entries)])
            for slot, _, entry in sorted(entries, reverse=True):
                rank.insert(slot, entry)
            self.order[r] = rank
        self._select(slots)
        cost = 0
        for c in links:
            link = self.links[c]
            self.cells[c] = tuple(self._cell(c, r) for r in range(self.rank[link.upper] + 1, self.rank[link.lower]))
            cost += self._threaded(c, 1)
        return cost

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

    def _shut(self, r: int, box: int, central: bool) -> Counts:
        """For each slot of a rank ``_SHUT`` where it lies within a block or another box, outside of ``box`` though
        that is in the rank, or, for what is ``central``, outside of the middle, for others within; else 0."""
        entries, known = self._known[r]
        if entries is not self.order[r]:
            known = {}
            self._known[r] = self.order[r], known
        if (box, central) not in known:
            known[box, central] = self._found_shut(r, box, central)
        return known[box, central]

    def _found_shut(self, r: int, box: int, central: bool) -> Counts:
        node, boxes, middle = self._owners(r)
        within = (node[1:] == node[:-1]) & (node[1:] >= 0)
        within |= (boxes[1:] == boxes[:-1]) & (boxes[1:] >= 0) & (boxes[1:] != box)
        found = np.zeros(len(node) + 1, dtype=np.int32)
        found[1:-1][within] = _SHUT
        first, last = self._middle(middle)
        own = np.flatnonzero(boxes[:last] == box)
        if box >= 0 and len(own):
            found[: own[0]] = _SHUT
            found[own[-1] + 2 :] = _SHUT
        if central:
            found[:first] = found[last + 1 :] = _SHUT
        else:
            found[first + 1 : last] = _SHUT
        return found

    def _middle(self, central: BoolArray) -> tuple[int, int]:
        """The slots before and behind what stands in the middle of a rank, by which entries are that."""
        first = (len(central) - int(np.count_nonzero(central))) // 2
        return first, len(central) - first

    def _shut_to(self, r: int, node: int) -> Counts:
        """``_shut`` for a node, which also has to keep its place in the order of its group, and on its side of an
        axis."""
        if not self._tight[r]:
            return np.zeros(len(self.order[r]) + 1, dtype=np.int32)
        central = self.image[node] == node
        found = self._shut(r, int(self._box[node]), central).copy()
        if not central:
            found[self._middle(self._owners(r)[2])[0] + 1 :] = _SHUT
        if self._kin[node] >= 0:
            other, boxes, _ = self._owners(r)
            alike = (other >= 0) & (self._kin[other] == self._kin[node]) & (boxes == self._box[node])
            before = alike & (self._natural[other] < self._natural[node])
            found[: np.flatnonzero(before).max(initial=-1) + 1] = _SHUT
            found[np.flatnonzero(alike & ~before).min(initial=len(other)) + 1 :] = _SHUT
        return found

    def _owners(self, r: int) -> tuple[Counts, Counts, BoolArray]:
        """The node of each entry of a rank, or -1, its box, or that of its connection, and whether it stands in the
        middle."""
        entries = np.array(self.order[r], dtype=np.int64)
        count = len(self._owner)
        point = entries < count
        node = np.where(point, self._node_of[np.minimum(entries, count - 1)], -1)
        link = np.where(point, -1, (entries - count) // self._height)
        central = np.where(point, self._central[np.minimum(entries, count - 1)], self._straight[link])
        return node, np.where(point, self._box[node], self._box_of[link]), central
