"""Bands: a long frame cut between ranks, its parts side by side, as a text stands in columns.

In: ranks with what stands in them and where, and how many bands are asked for. Out: how far each rank is moved. A cut
is made where few connections are cut and the bands are about equally long, never through a box; between two bands there
is room for the connections that run back from the end of one to the next.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

from neurovis_layouts.layered.levels import Levels
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import LayoutProblem, Point

#: What a connection that is cut counts, by the square of how much longer than the mean a band is: to even out bands of
#: five ranks by one is worth one connection.
_CUT = 0.05
#: Where more connections of instances would be cut than this, nobody could follow them back; in a network of
#: groups, which is cut where it would be too long only, so many more.
FEW, MANY_LINES = 4, 24
#: From the line of a connection that runs between two bands to the next, and from discs to the first of them.
_LINE, _BESIDE = 0.25, 0.8


@dataclass(frozen=True, slots=True)
class Wanted:
    """How many bands there are to be, and how ``few`` connections may be cut between two."""

    bands: int = 1
    few: int = 1


UNCUT = Wanted()


@dataclass(frozen=True, slots=True)
class _Rank:
    """How far a rank reaches: across from ``left`` to ``right``, along from ``top`` to ``bottom``; and how many
    connections lead from it, or past it, to the next."""

    left: float
    right: float
    top: float
    bottom: float
    lines: int


@dataclass(frozen=True, slots=True)
class Bands:
    """For each rank in which band it is, and for each band how far it is moved; the edges from band to band, each with
    the corners of its way between its ends, from above to below in the ranks as they were."""

    band: Sequence[int]
    shifts: Sequence[Point]
    ways: Mapping[int, Sequence[Point]]


def banded(
    problem: LayoutProblem, levels: Levels, places: Sequence[Point], uncut: AbstractSet[int], wanted: Wanted
) -> tuple[int, Bands]:
    """At how many places these ranks can be cut, never between two that are both ``uncut``; and the bands wanted of
    them, or as many as that makes."""
    ranks = [_rank(levels, places, r) for r in range(len(levels.ranks))]
    open_ = [
        r
        for r in _between_boxes(problem, levels)
        if ranks[r].lines <= wanted.few and (r not in uncut or r + 1 not in uncut)
    ]
    cuts = _cuts(ranks, open_, min(wanted.bands, len(open_) + 1))
    band = [sum(r > cut for cut in cuts) for r in range(len(ranks))]
    shifts: list[Point] = []
    #: the middle of what is free behind each band
    streets: list[float] = []
    at = 0.0
    for number in range(len(cuts) + 1):
        own = [rank for rank, b in zip(ranks, band, strict=True) if b == number]
        left, right = min(rank.left for rank in own), max(rank.right for rank in own)
        top = min(rank.top for rank in own)
        shifts.append((snap(at - left), snap(-top)))
        street = max(_LINE * (own[-1].lines - 1) + 2 * _BESIDE, problem.neuron_spacing)
        at += right - left + street
        streets.append(at - street / 2)
    moved = [
        (x + shifts[band[node.rank]][0], y + shifts[band[node.rank]][1])
        for node, (x, y) in zip(levels.nodes, places, strict=True)
    ]
    bottoms = {cut: max(rank.bottom for rank, b in zip(ranks, band, strict=True) if b == number) + shifts[number][1]
               for number, cut in enumerate(cuts)}  # fmt: skip
    return len(open_), Bands(band, shifts, _ways(levels, moved, bottoms, streets))


def _ways(
    levels: Levels, places: Sequence[Point], bottoms: Mapping[int, float], streets: Sequence[float]
) -> dict[int, list[Point]]:
    """The ways of what is cut: down below its band, up in the street beside that, and from above into the next. Lines
    that do not cross where they are cut do not do so there."""
    found = _cut(levels, places, bottoms)
    first = {i: levels.nodes[levels.ends[i][0]].rank for i in found}
    corners: dict[tuple[int, int], list[Point]] = {}
    for (cut, bottom), street in zip(bottoms.items(), streets, strict=False):
        here: list[tuple[float, float, int]] = []
        for i, line in found.items():
            if 0 <= (at := cut - first[i]) < len(line) - 1:
                here.append((-line[at][0], -line[at + 1][0], i))
        for lane, (start, end, i) in enumerate(sorted(here)):
            x = street + (lane - (len(here) - 1) / 2) * _LINE
            low = bottom + _BESIDE + lane * _LINE
            high = -_BESIDE - (len(here) - 1 - lane) * _LINE
            corners[i, cut] = [(-start, low), (x, low), (x, high), (-end, high)]
    ways: dict[int, list[Point]] = {}
    for i, line in found.items():
        ways[i] = list(corners.get((i, first[i]), ()))
        for rank, point in enumerate(line[1:-1], first[i] + 1):
            ways[i] += [point, *corners.get((i, rank), ())]
    return ways


def _cut(levels: Levels, places: Sequence[Point], cuts: Collection[int]) -> dict[int, list[Point]]:
    """Where the edges that are cut behind any of these ranks are, rank by rank."""
    found: dict[int, list[Point]] = {}
    for i, (upper, a, lower, b) in levels.ends.items():
        if any(levels.nodes[upper].rank <= cut < levels.nodes[lower].rank for cut in cuts):
            chain = [(upper, a), *((n, 0.0) for n in levels.passages.get(i, ())), (lower, b)]
            found[i] = [(places[n][0] + a, places[n][1]) for n, a in chain]
    return found


def _rank(levels: Levels, places: Sequence[Point], number: int) -> _Rank:
    here = [(places[n], levels.nodes[n].reach) for n in levels.ranks[number]]
    return _Rank(
        min(x - across for (x, _), (across, _) in here),
        max(x + across for (x, _), (across, _) in here),
        min(y - along for (_, y), (_, along) in here),
        max(y + along for (_, y), (_, along) in here),
        len(levels.segments[number]) if number < len(levels.segments) else 0,
    )


def _between_boxes(problem: LayoutProblem, levels: Levels) -> list[int]:
    """The ranks behind which no box goes on."""
    rank = {m: node.rank for node in levels.nodes for m, _, _ in node.members}
    closed: set[int] = set()
    for _, members in problem.boxes:
        own = [rank[m] for m in members if m in rank]
        closed.update(range(min(own, default=0), max(own, default=0)))
    return [r for r in range(len(levels.ranks) - 1) if r not in closed]


def _cuts(ranks: Sequence[_Rank], cuts: Sequence[int], bands: int) -> list[int]:
    """The ranks behind which the cuts are that cost least."""
    if bands < 2 or not cuts:
        return []
    mean = (ranks[-1].bottom - ranks[0].top) / bands
    ends = [-1, *cuts, len(ranks) - 1]

    def cost(first: int, last: int) -> float:
        long = (ranks[last].bottom - ranks[first].top) / mean
        return long * long + _CUT * (ranks[last].lines if last < len(ranks) - 1 else 0)

    best: list[tuple[float, int]] = [(0.0, -1)] + [(math.inf, -1)] * (len(ends) - 1)
    chosen: list[list[int]] = []
    for _ in range(bands):
        found = [(math.inf, -1)] * len(ends)
        for k in range(1, len(ends)):
            for before in range(k):
                found[k] = min(found[k], (best[before][0] + cost(ends[before] + 1, ends[k]), before))
        best = found
        chosen.append([before for _, before in found])
    result: list[int] = []
    k = len(ends) - 1
    for last in chosen[:0:-1]:
        k = last[k]
        result.insert(0, ends[k])
    return result
