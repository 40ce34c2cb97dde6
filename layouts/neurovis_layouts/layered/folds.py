"""Folds: frames that are too many for one rank, in several rows one behind the other.

In: units with their ranks. Out: what of them can be folded (Folding), and how that looks in so many rows (Folds): ranks
in which frames that stand side by side without anything between them come in rows, and for the neurons of each how far
along the row the connections of its frame run. What is connected to them runs in the gaps between the frames of the
other rows, in one order from side to side for all rows, so that folding adds no crossing. In how many rows they stand
is found by what the page costs (``component_layout.with_rows``).

Once all has its place, connections of folded frames, and of staggered ranks, get a waypoint at the edge of the rank,
straight in front of the neuron, from which they fan out without a bend (``with_exits``); several that leave side by
side are ordered by where they go. Where they cross nothing, these and the passages are all the waypoints that they
need.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx

from neurovis_layouts.layered.levels import Levels, Segment
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout.model import LayoutProblem, Point

#: Fewer frames than this stay in one row.
_FEWEST = 8
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
    """Frames that are connected with each other, those of their images with them: they stay together. ``lines`` is how
    many connections come from before and leave behind."""

    units: tuple[int, ...]
    first: int
    last: int
    lines: tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Block:
    """Strands side by side in the ranks from ``first`` to ``last``."""

    first: int
    last: int
    strands: Sequence[_Strand]

    def rows(self) -> list[int]:
        """In how many rows it can stand: so many that none is empty, and that not too much runs through them."""
        count = len(self.strands)
        through = max(sum(strand.lines[side] for strand in self.strands) for side in (0, 1))
        most = min(count, 1 + _MOST // max(through, 1))
        return [rows for rows in range(1, most + 1) if -(-count // -(-count // rows)) == rows]


@dataclass(frozen=True, slots=True)
class Folding:
    """What of ``units`` with these ranks can be folded; ``half`` says that each strand stands on both sides of an
    axis."""

    units: Sequence[Unit]
    rank: Sequence[int]
    half: bool
    blocks: Sequence[_Block] = ()

    def folded(self, rows: Sequence[int]) -> Folds:
        """The folds of these blocks into so many rows each; 0 for what stands as it comes."""
        found = Folds(list(self.rank))
        for block, count in sorted(zip(self.blocks, rows, strict=True), key=lambda one: -one[0].first):
            if count:
                found = _into_rows(found, self.units, block, count, self.half)
        return _closed(found) if found.ranks else found


def folding(
    problem: LayoutProblem,
    units: Sequence[Unit],
    bonds: Sequence[int],
    rank: Sequence[int],
    edges: Sequence[int],
    pair: Mapping[int, int],
) -> Folding:
    """What of these units, whose ``bonds`` say who is to share a rank, can be folded."""
    free = _free(problem, units, bonds, pair)
    none = Folding(units, rank, bool(pair))
    if len(free) < _FEWEST:
        return none
    blocks = _blocks(_strands(problem, units, rank, edges, pair, free))
    large = [block for block in blocks if sum(len(strand.units) for strand in block.strands) >= _FEWEST]
    return replace(none, blocks=large)


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
        up, down = (sum(lines[u][side] for u in own) for side in (0, 1))
        return _Strand(own, min(levels), max(levels), (up, down))

    found = map(strand, nx.connected_components(graph))
    return sorted(found, key=lambda strand: min(units[strand.units[0]].members))


def _blocks(strands: Sequence[_Strand]) -> list[_Block]:
    """Strands by the ranks that they share."""
    found: list[tuple[int, int]] = []
    for first, last in sorted({(strand.first, strand.last) for strand in strands}):
        if found and first <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], last)
        else:
            found.append((first, last))
    return [_Block(first, last, [s for s in strands if first <= s.first <= last]) for first, last in found]


def _into_rows(found: Folds, units: Sequence[Unit], block: _Block, rows: int, half: bool) -> Folds:
    """One block folded; ``half`` says that each strand stands on both sides of an axis."""
    deep = block.last - block.first + 1
    more = deep * (rows - 1)
    rank = [level + more * (level > block.last) for level in found.rank]
    slots, columns = dict(found.slots), dict(found.columns)
    line: list[tuple[float, int, int]] = []
    per = _shared_out(len(block.strands), rows)
    seats = [(row, column, count) for row, count in enumerate(per) for column in range(count)]
    for number, (strand, (row, column, count)) in enumerate(zip(block.strands, seats, strict=True)):
        # what comes from rows farther before runs nearer to the middle
        turn = 1 if half or 2 * column + 1 < count else -1 if 2 * column + 1 > count else (-1) ** row
        line.append(((column + 0.5) / count, turn * (rows - row), number))
        beside: Counter[int] = Counter()
        for u in strand.units:
            columns.update(dict.fromkeys(units[u].members, (column, count, beside[rank[u]])))
            beside[rank[u]] += 1
        for u in strand.units:
            rank[u] += deep * row
    for place, (_, _, number) in enumerate(sorted(line)):
        for u in block.strands[number].units:
            slots.update(dict.fromkeys(units[u].members, (place + 0.5) / len(block.strands)))
    moved = {level + more if level > block.last else level for level in found.ranks}
    own = range(block.first, block.last + more + 1)
    return replace(found, rank=rank, slots=slots, columns=columns, ranks=frozenset(moved.union(own)))


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
