"""Channels: ways between neurons of different frames, through the gaps that discs and frames leave.

In: edges, centres, frames that nothing foreign may run through. Out: waypoints of the edges that run along the
direction, and of those that run across it. Ways are found one after the other, short ones first.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from neurovis_layouts.routing.channel_search import WALLED, knots, straight, through, way
from neurovis_layouts.routing.curves import Waypoint
from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.rows import OccupiedRows
from neurovis_layouts.routing.walls import Frame
from neurovis_spec.layout.geometry import Rect, distance, sampled
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: What it costs to run across rather than along.
_ACROSS = 1.25
#: What is hardly longer than straight, and what is much longer.
_HARDLY, _MUCH = 1.1, 1.2
#: With more edges than this nobody can follow one: they take the straight way.
_MOST = 1500
#: With more edges than this nobody counts how often they cross.
_MOST_CROSSED = 300
_SAMPLED = 0.25


def channels(
    edges: Mapping[int, LayoutEdge],
    centres: Sequence[Point],
    frames: Sequence[Frame],
    gates: Mapping[int, Sequence[Waypoint]],
    drawn: Iterable[Route] = (),
) -> tuple[dict[int, list[Waypoint]], dict[int, list[Waypoint]]]:
    """Waypoints of edges by index: of those along the direction, and (x and y exchanged) of those across it. Those with
    ``gates`` run along it, through these, which lie in their order. ``drawn`` are routes that are there already, to be
    crossed as little as the ways themselves."""
    if len(edges) > _MOST:
        return {i: [] for i in edges}, {}
    # what was planned to run where there is a foreign frame now finds its way round that
    gates = {i: line for i, line in gates.items() if i in edges and not _walled(edges[i], line, frames)}
    down = OccupiedRows(centres, frames, len(edges), True)
    side = OccupiedRows([(y, x) for x, y in centres], [(own, _turned(rect)) for own, rect in frames], len(edges))
    careful = len(edges) <= _MOST_CROSSED
    for route in drawn if careful else ():
        _note(sampled(route, _SAMPLED), down, side)
    between = by_ends(sorted(edges.items()))
    found: tuple[dict[int, list[Waypoint]], dict[int, list[Waypoint]]] = {}, {}
    for i in sorted(edges, key=lambda i: (_length(edges[i], centres), i)):
        ends = edges[i].source, edges[i].target
        across, line = 0, gates.get(i)
        if ends[0] == ends[1]:
            continue
        if line:
            path = through(down, ends, line)
        else:
            cost, path = way(down, ends)
            least = straight(centres[ends[0]], centres[ends[1]]) * _ACROSS
            other, aside = way(side, ends, cost / _ACROSS) if cost > least else (math.inf, [])
            if math.isinf(min(cost, other)):
                continue
            if cost > other * _ACROSS and not _round_it_all(down, ends, aside):
                across, path = 1, aside
        rows, beside = (side, down) if across else (down, side)
        rows.use(path[1:-1])
        # what has the same ends runs beside it, as the ends lean
        bends = found[across][i] = knots(rows, path, ends, len(between[frozenset(ends)]) == 1)
        if careful:
            _note(path if line else [path[0], *((bend.x, bend.y) for bend in bends), path[-1]], rows, beside)
    return found


def _round_it_all(down: OccupiedRows, ends: tuple[int, int], aside: Sequence[Point]) -> bool:
    """Whether a way across is much longer than the straight line, and one along, whatever that crosses, hardly:
    crossings are followed more easily than a way round it all."""
    if _stretch(aside) <= _MUCH:
        return False
    cost, path = way(down, ends, WALLED, 0.0)
    return cost < WALLED and _stretch(path) <= _HARDLY


def _stretch(path: Sequence[Point]) -> float:
    """How much longer than straight a way is."""
    return sum(distance(a, b) for a, b in pairwise(path)) / distance(path[0], path[-1])


def _note(line: Sequence[Point], rows: OccupiedRows, beside: OccupiedRows) -> None:
    """Note a line that is to be crossed as little as can be; x and y are exchanged in the rows beside."""
    rows.lines.add(line)
    beside.lines.add([(y, x) for x, y in line])


def _turned(rect: Rect) -> Rect:
    return rect[1], rect[0], rect[3], rect[2]


def _length(edge: LayoutEdge, centres: Sequence[Point]) -> float:
    (ax, ay), (bx, by) = centres[edge.source], centres[edge.target]
    return abs(ax - bx) + abs(ay - by)


def _walled(edge: LayoutEdge, gates: Sequence[Waypoint], frames: Sequence[Frame]) -> bool:
    """Whether a gate of an edge is in a frame that holds neither of its ends."""
    return any(
        rect[0] < gate.x < rect[2] and rect[1] < gate.y < rect[3]
        for own, rect in frames
        if edge.source not in own and edge.target not in own
        for gate in gates
    )
