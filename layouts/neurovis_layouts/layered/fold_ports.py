"""Fold ports: where connections leave the ranks of folded frames, and staggered ranks, so that they fan out from there
without a bend.

In: levels with their places, folds. Out: for each connection from or to such a rank a waypoint at the edge of the rank,
straight in front of the neuron; several that leave side by side are ordered by where they go. Where they cross nothing,
these and the passages are all the waypoints that a connection of folded frames needs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

from neurovis_layouts.layered.folds import Folds
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout.model import LayoutProblem, Point

#: How close a neuron of the same frame may stand to the line out of it, and how far apart such lines are.
_CLEAR, _APART = 0.5, 0.16
#: How far beyond the neurons of a staggered rank lines are side by side, and how far the first is from the last.
_BEYOND, _FREE = 0.5, 0.2
#: What in a rank reaches less far than this is in nobody's way.
_LOW = 0.5


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
    levels, places, spans = ranks.levels, ranks.places, ranks.spans
    folds, uneven = ranks.folds, ranks.uneven
    found = {i: list(line) for i, line in ways.items()}
    if not folds.slots and not uneven:
        return found, set()
    whole: set[int] = set()
    node = {m: n for n, each in enumerate(levels.nodes) for m, _, _ in each.members}
    rank = {m: levels.nodes[n].rank for m, n in node.items()}
    leaving: dict[tuple[int, bool], list[tuple[float, int]]] = {}
    for i in edges:
        ends = sorted((problem.edges[i].source, problem.edges[i].target), key=lambda m: rank[m])
        line = [way.x for way in ways.get(i, ())]
        clear = rank[ends[1]] - rank[ends[0]] == len(line) + 1
        for end, other, down in ((ends[0], ends[1], True), (ends[1], ends[0], False)):
            if rank[end] == rank[other]:
                continue
            if end not in folds.slots and rank[end] not in uneven:
                # beside what is high a flat line would run through that
                clear = clear and max(spans[rank[end]]) < _LOW
            elif rank[end] in uneven or _open(levels, node[end], end, down):
                towards = [*(line if down else line[::-1]), _at(levels, places, node[other], other)][0]
                leaving.setdefault((end, down), []).append((towards, i))
            else:
                clear = False
        if clear and uneven.isdisjoint((rank[ends[0]], rank[ends[1]])):
            whole.add(i)
    for (end, down), lines in sorted(leaving.items()):
        n = node[end]
        before, behind = spans[rank[end]]
        beyond, apart = (_BEYOND, min(_APART, _FREE / max(1, len(lines) - 1))) if rank[end] in uneven else (0.0, _APART)
        y = places[n][1] - levels.nodes[n].lift + (behind + beyond if down else -before - beyond)
        middle = _at(levels, places, n, end)
        for place, (_, i) in enumerate(sorted(lines)):
            gate = Waypoint(middle + (place - (len(lines) - 1) / 2) * apart, y)
            found[i] = [gate, *found.get(i, [])] if down else [*found.get(i, []), gate]
    return found, whole


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
