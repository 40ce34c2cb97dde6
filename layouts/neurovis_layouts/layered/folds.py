"""Folds: frames that are too many for one rank, in several rows one behind the other.

In: units with their ranks. Out: ranks in which frames that stand side by side without anything between them come in
rows, where one row would make the picture much wider than high, and for the neurons of each how far along the row the
connections of its frame run. What is connected to them runs in the gaps between the frames of the other rows, in one
order from side to side for all rows, so that folding adds no crossing.

Once all has its place, connections of folded frames, and of staggered ranks, get a waypoint at the edge of the rank,
straight in front of the neuron, from which they fan out without a bend (``with_exits``); several that leave side by
side are ordered by where they go. Where they cross nothing, these and the passages are all the waypoints that they
need.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx

from neurovis_layouts.layered.levels import Levels, Segment
from neurovis_layouts.layered.page_cost import page_across
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout.model import LayoutProblem, Point

#: What is wider than a page by this gets room for what fans out, what is wider by the second is folded, and by the last
#: is how wide rows are to be.
_WIDE, _TOO_WIDE, _AIM = 1.1, 2.2, 1.15
#: Fewer frames than this stay in one row.
_FEWEST = 8
#: How much wider a rank gets by a connection that runs through it, and a gap between frames by the first one in it.
_LINE, _FIRST_LINE = 0.25, 0.2
#: What a row that is not full counts, against proportions that are off.
_RAGGED = 0.5
#: How strongly what stands in one column is held together.
_COLUMN = 400.0
#: How much less what leads out of the rows pulls than what leads through them.
_LEAVING = 1 / 64
#: Folds of more connections than this by rows make too many passages.
_MOST = 6000
#: How close a neuron of the same frame may stand to the line out of it, and how far apart such lines are.
_CLEAR, _APART = 0.5, 0.16
#: How far beyond the neurons of a staggered rank lines are side by side, and how far the first is from the last.
_BEYOND, _FREE = 0.5, 0.2
#: What in a rank reaches less far than this is in nobody's way.
_LOW = 0.5


@dataclass(frozen=True, slots=True)
class Folds:
    """A rank for each unit; for neurons in frames of a fold where their frame comes in the order from side to side,
    and in which column of how many it stands, as which frame there; the ranks of all folds."""

    rank: list[int]
    slots: Mapping[int, float] = field(default_factory=dict)
    columns: Mapping[int, tuple[int, int, int]] = field(default_factory=dict)
    ranks: AbstractSet[int] = frozenset()


@dataclass(frozen=True, slots=True)
class _Strand:
    """Frames that are connected with each other, those of their images with them: they stay together. ``wide`` is the
    room that they take, ``lines`` how many connections come from before and leave behind."""

    units: tuple[int, ...]
    first: int
    last: int
    wide: float
    lines: tuple[int, int]


def folded(
    problem: LayoutProblem,
    units: Sequence[Unit],
    bonds: Sequence[int],
    rank: Sequence[int],
    edges: Sequence[int],
    pair: Mapping[int, int],
) -> Folds:
    """The folds of these units, whose ``bonds`` say who is to share a rank."""
    free = _free(problem, units, bonds, pair)
    if len(free) < _FEWEST:
        return Folds(list(rank))
    sheet = _Sheet(problem, units, rank, free)
    strands = _strands(problem, units, rank, edges, pair, free, sheet)
    found = Folds(list(rank))
    for first, last, block in sorted(_blocks(strands), reverse=True):
        rows = sheet.rows(first, last, block, 2 if pair else 1)
        if rows:
            sheet.fold(first, last, rows)
            found = _into_rows(found, units, block, first, last, rows, bool(pair))
    return _closed(found) if found.ranks else found


def _closed(found: Folds) -> Folds:
    """The folds without ranks in which nothing stands, as where strands of one row are less deep than others."""
    place = {level: number for number, level in enumerate(sorted(set(found.rank)))}
    ranks = frozenset(place[level] for level in found.ranks if level in place)
    return replace(found, rank=[place[level] for level in found.rank], ranks=ranks)


def _free(problem: LayoutProblem, units: Sequence[Unit], bonds: Sequence[int], pair: Mapping[int, int]) -> set[int]:
    """Frames that nobody asked to be on a line, and that stand in no stairs and not on the axis."""
    lines = {m for line in problem.align for m in line}
    bound = {bond for unit, bond in zip(units, bonds, strict=True) if unit.lift or lines.intersection(unit.members)}
    return {
        u
        for u, unit in enumerate(units)
        if unit.reach is not None and bonds[u] not in bound and not symmetric(unit.members, pair)
    }


def _strands(
    problem: LayoutProblem,
    units: Sequence[Unit],
    rank: Sequence[int],
    edges: Sequence[int],
    pair: Mapping[int, int],
    free: AbstractSet[int],
    sheet: _Sheet,
) -> list[_Strand]:
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(sorted(free))
    lines: dict[int, list[int]] = {u: [0, 0] for u in free}
    for i in edges:
        a, b = owner[problem.edges[i].source], owner[problem.edges[i].target]
        if a in free and b in free:
            graph.add_edge(a, b)
        for one, other in ((a, b), (b, a)):
            if one in free and other not in free and rank[one] != rank[other]:
                lines[one][rank[other] > rank[one]] += 1
    graph.add_edges_from((u, owner[pair[m]]) for u in sorted(free) for m in units[u].members if m in pair)

    def strand(part: AbstractSet[int]) -> _Strand:
        own = tuple(sorted(part, key=lambda u: min(units[u].members)))
        levels = [rank[u] for u in own]
        wide = max(math.fsum(sheet.wide(u) for u in own if rank[u] == level) for level in levels)
        up, down = (sum(lines[u][side] for u in own) for side in (0, 1))
        return _Strand(own, min(levels), max(levels), wide, (up, down))

    found = map(strand, nx.connected_components(graph))
    return sorted(found, key=lambda strand: min(units[strand.units[0]].members))


def _blocks(strands: Sequence[_Strand]) -> list[tuple[int, int, list[_Strand]]]:
    """Strands by the ranks that they share: first, last, strands."""
    found: list[tuple[int, int, list[_Strand]]] = []
    for first, last in sorted({(strand.first, strand.last) for strand in strands}):
        if found and first <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], last), [])
        else:
            found.append((first, last, []))
    return [(first, last, [s for s in strands if first <= s.first <= last]) for first, last, _ in found]


class _Sheet:
    """How wide and high the ranks are, about."""

    def __init__(
        self, problem: LayoutProblem, units: Sequence[Unit], rank: Sequence[int], free: AbstractSet[int]
    ) -> None:
        self._spacing, self._gap = max(problem.neuron_spacing, 0.65), max(problem.rank_spacing, 0.75)
        self._units = units
        self._page = page_across(problem)
        count = max(rank, default=-1) + 1
        self._fixed, self._high = [0.0] * count, [0.0] * count
        for u, r in enumerate(rank):
            self._fixed[r] += 0.0 if u in free else self.wide(u)
            self._high[r] = max(self._high[r], self._high_of(u))

    def wide(self, u: int) -> float:
        """How wide a unit is, with the gap to the next."""
        unit = self._units[u]
        if unit.places is None:
            return self._spacing * len(unit.members)
        across = max(abs(x) for x, _ in unit.places) if unit.reach is None else unit.reach[0]
        return 2 * across + self._spacing

    def _high_of(self, u: int) -> float:
        unit = self._units[u]
        along = max((abs(y) for _, y in unit.places or ()), default=0.0) if unit.reach is None else unit.reach[1]
        return 2 * along + self._gap

    def rows(self, first: int, last: int, block: Sequence[_Strand], sides: int) -> int:
        """In how many rows these strands stand best, on so many sides; 0 where nothing has to be done about them."""
        count = len(block)
        if sum(len(strand.units) for strand in block) < _FEWEST:
            return 0
        through = max(sum(strand.lines[side] for strand in block) for side in (0, 1))
        free = math.fsum(strand.wide for strand in block)
        beside, most = max(self._fixed[first : last + 1]), max(self._fixed)
        high, each = math.fsum(self._high), math.fsum(self._high[first : last + 1])
        if free + beside <= max(_TOO_WIDE * self._page * high, most):
            return int(free + beside > _WIDE * self._page * high)
        area = (free + beside) * high
        best = (math.inf, 1)
        for rows in range(1, min(count, 1 + _MOST // max(through, 1)) + 1):
            columns = -(-count // rows)
            if -(-count // columns) < rows:
                continue
            lines = through * (rows - 1) / rows * _LINE + columns * sides * _FIRST_LINE if rows > 1 else 0.0
            wide, tall = max(free * columns / count + lines + beside, most), high + (rows - 1) * each
            # rounded, since the last bits of a logarithm are the machine's
            worse = round(abs(math.log(wide / tall / (_AIM * self._page))) + max(0.0, math.log(wide * tall / area)), 6)
            best = min(best, (worse + _RAGGED * (rows * columns - count) / columns, rows))
        return best[1]

    def fold(self, first: int, last: int, rows: int) -> None:
        """Repeat the ranks ``first`` to ``last`` once for each row that their block is folded into."""
        here, more = slice(first, last + 1), [0.0] * ((last + 1 - first) * (rows - 1))
        self._fixed[here] = [*self._fixed[here], *more]
        self._high[here] = self._high[here] * rows


def _into_rows(
    found: Folds, units: Sequence[Unit], block: Sequence[_Strand], first: int, last: int, rows: int, half: bool
) -> Folds:
    """One block folded; ``half`` says that each strand stands on both sides of an axis."""
    deep = last - first + 1
    more = deep * (rows - 1)
    inside = {u for strand in block for u in strand.units}
    rank = list(found.rank)
    for u, level in enumerate(found.rank):
        if u not in inside and level >= first:
            rank[u] += more * (level > last)
    slots, columns = dict(found.slots), dict(found.columns)
    line: list[tuple[float, int, int]] = []
    per = _shared_out(len(block), rows)
    number = 0
    for row, count in enumerate(per):
        for column in range(count):
            # what comes from rows farther before runs nearer to the middle
            turn = 1 if half or 2 * column + 1 < count else -1 if 2 * column + 1 > count else (-1) ** row
            line.append(((column + 0.5) / count, turn * (rows - row), number))
            beside: dict[int, int] = {}
            for u in block[number].units:
                beside[rank[u]] = beside.get(rank[u], -1) + 1
                columns.update(dict.fromkeys(units[u].members, (column, count, beside[rank[u]])))
            for u in block[number].units:
                rank[u] += deep * row
            number += 1
    for place, (_, _, strand) in enumerate(sorted(line)):
        for u in block[strand].units:
            slots.update(dict.fromkeys(units[u].members, (place + 0.5) / len(block)))
    moved = {level + more if level > last else level for level in found.ranks}
    return replace(
        found, rank=rank, slots=slots, columns=columns, ranks=frozenset(moved | set(range(first, last + more + 1)))
    )


def _shared_out(count: int, rows: int) -> list[int]:
    """So many in each row, the first ones longer where they are not equal."""
    return [count // rows + (row < count % rows) for row in range(rows)]


def interleaved(levels: Levels, problem: LayoutProblem, folds: Folds) -> None:
    """Put what stands in the rows of folds, and what runs through them, in one order from side to side."""
    slot: dict[int, float] = {}
    for n, node in enumerate(levels.nodes):
        if node.members:
            slot[n] = folds.slots.get(node.members[0][0], 1.0)
    for i, passages in levels.passages.items():
        edge = problem.edges[i]
        ends = [folds.slots[m] for m in (edge.source, edge.target) if m in folds.slots]
        slot.update(dict.fromkeys(passages, math.fsum(ends) / len(ends) if ends else 0.5))
    for r in sorted(folds.ranks):
        levels.ranks[r].sort(key=lambda n: slot.get(n, 0.5))


def stacked(levels: Levels, folds: Folds) -> Levels:
    """Levels in which what stands in one column of a fold is tied together."""
    if not folds.ranks:
        return levels
    segments = [list(gap) for gap in levels.segments]
    column = [
        {folds.columns[m]: n for n in rank for m, _, _ in levels.nodes[n].members if m in folds.columns}
        for rank in levels.ranks
    ]
    for r, (above, below) in enumerate(pairwise(column)):
        if (r in folds.ranks) != (r + 1 in folds.ranks):
            segments[r] = [replace(s, weight=s.weight * _LEAVING) for s in segments[r]]
        elif r in folds.ranks:
            segments[r] += [Segment(above[c], 0.0, below[c], 0.0, _COLUMN) for c in above if c in below]
    return replace(levels, segments=segments)


@dataclass(frozen=True, slots=True)
class PlacedRanks:
    """Levels with the place of each node; ``spans`` say how far each rank reaches before its line and behind it,
    ``uneven`` ranks are staggered."""

    levels: Levels
    places: Sequence[Point]
    spans: Sequence[tuple[float, float]]
    folds: Folds
    uneven: AbstractSet[int]


def with_exits(
    problem: LayoutProblem, edges: Sequence[int], ranks: PlacedRanks, ways: Mapping[int, list[Waypoint]]
) -> tuple[dict[int, list[Waypoint]], set[int]]:
    """The waypoints of each edge, from above to below, those at the exits among them, and which edges need no others
    to pass all frames."""
    levels, places, uneven = ranks.levels, ranks.places, ranks.uneven
    found = {i: list(line) for i, line in ways.items()}
    if not ranks.folds.slots and not uneven:
        return found, set()
    node = {m: n for n, each in enumerate(levels.nodes) for m, _, _ in each.members}
    leaving, whole = _leaving(problem, edges, ranks, node, ways)
    for (end, down), lines in sorted(leaving.items()):
        n = node[end]
        rank = levels.nodes[n].rank
        before, behind = ranks.spans[rank]
        beyond, apart = (_BEYOND, min(_APART, _FREE / max(1, len(lines) - 1))) if rank in uneven else (0.0, _APART)
        y = places[n][1] - levels.nodes[n].lift + (behind + beyond if down else -before - beyond)
        middle = _at(levels, places, n, end)
        for place, (_, i) in enumerate(sorted(lines)):
            gate = Waypoint(middle + (place - (len(lines) - 1) / 2) * apart, y)
            found[i] = [gate, *found.get(i, [])] if down else [*found.get(i, []), gate]
    return found, whole


def _leaving(
    problem: LayoutProblem,
    edges: Sequence[int],
    ranks: PlacedRanks,
    node: Mapping[int, int],
    ways: Mapping[int, list[Waypoint]],
) -> tuple[dict[tuple[int, bool], list[tuple[float, int]]], set[int]]:
    """The edges that get a waypoint at the edge of a rank, with where across they go, by their neuron there and whether
    they lead down; and those that need no others then. ``node`` is that of each neuron."""
    levels, folds, uneven = ranks.levels, ranks.folds, ranks.uneven
    leaving: dict[tuple[int, bool], list[tuple[float, int]]] = {}
    whole: set[int] = set()
    rank = {m: levels.nodes[n].rank for m, n in node.items()}
    for i in edges:
        ends = sorted((problem.edges[i].source, problem.edges[i].target), key=lambda m: rank[m])
        line = [way.x for way in ways.get(i, ())]
        clear = rank[ends[1]] - rank[ends[0]] == len(line) + 1
        for end, other, down in ((ends[0], ends[1], True), (ends[1], ends[0], False)):
            if rank[end] == rank[other]:
                continue
            if end not in folds.slots and rank[end] not in uneven:
                # beside what is high a flat line would run through that
                clear = clear and max(ranks.spans[rank[end]]) < _LOW
            elif rank[end] in uneven or _open(levels, node[end], end, down):
                towards = [*(line if down else line[::-1]), _at(levels, ranks.places, node[other], other)][0]
                leaving.setdefault((end, down), []).append((towards, i))
            else:
                clear = False
        if clear and uneven.isdisjoint((rank[ends[0]], rank[ends[1]])):
            whole.add(i)
    return leaving, whole


def _at(levels: Levels, places: Sequence[Point], node: int, member: int) -> float:
    """Where a neuron stands across."""
    return places[node][0] + next(dx for m, dx, _ in levels.nodes[node].members if m == member)


def _open(levels: Levels, node: int, member: int, down: bool) -> bool:
    """Whether nothing of its own frame stands between a neuron and the line of the rank."""
    x, y = next((dx, dy) for m, dx, dy in levels.nodes[node].members if m == member)
    return not any(
        m != member and abs(dx - x) < _CLEAR and (dy > y if down else dy < y)
        for m, dx, dy in levels.nodes[node].members
    )
