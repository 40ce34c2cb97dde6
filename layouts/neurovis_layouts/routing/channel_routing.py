"""Channels: ways between neurons of different frames, through the gaps that discs and frames leave.

In: edges, centres, frames that nothing foreign may run through. Out: waypoints of the edges that run along the
direction, and of those that run across it. Ways are found one after the other, short ones first; where they are few
each is found anew when all the others are known.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from neurovis_layouts.routing.channel_search import WALLED, knots, straight, through, way
from neurovis_layouts.routing.curves import Waypoint
from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.rows import OccupiedRows
from neurovis_layouts.routing.walls import Frame
from neurovis_spec.layout.geometry import sampled
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: What it costs to run across rather than along.
_ACROSS = 1.25
#: What is hardly longer, and what is much longer.
_HARDLY, _MUCH = 1.1, 1.2
#: How far beyond both of its ends a way leads that turns back.
_BEYOND = 0.5
#: With more edges than this nobody can follow one: they take the straight way.
_MOST = 1500
#: With more edges than this nobody counts how often they cross.
_MOST_CROSSED = 300
_SAMPLED = 0.25
#: How often all ways are found, and where they are more than so many.
_ROUNDS, _FEWER, _MANY = 3, 2, 120


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
    network = _Network(edges, centres, frames, gates)
    if network.careful:
        network.note(drawn)
    rounds = _ROUNDS if len(edges) <= _MANY else _FEWER
    for turn in range(rounds if network.careful else 1):
        for i in sorted(edges, key=lambda i: (_length(edges[i], centres), i)):
            if edges[i].source != edges[i].target:
                network.find(i, turn > 0)
    return network.found(along=True), network.found(along=False)


def _length(edge: LayoutEdge, centres: Sequence[Point]) -> float:
    (ax, ay), (bx, by) = centres[edge.source], centres[edge.target]
    return abs(ax - bx) + abs(ay - by)


def _length_of(path: Sequence[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(path))


def _walled(edge: LayoutEdge, gates: Sequence[Waypoint], frames: Sequence[Frame]) -> bool:
    """Whether a gate of an edge is in a frame that holds neither of its ends."""
    return any(
        rect[0] < gate.x < rect[2] and rect[1] < gate.y < rect[3]
        for own, rect in frames
        if edge.source not in own and edge.target not in own
        for gate in gates
    )


@dataclass(frozen=True, slots=True)
class _Way:
    """A way that was found: along the direction or across it, its points, where it bends, its line, and the
    numbers of that line's runs in the ``CutLines`` of either direction."""

    along: bool
    path: Sequence[Point]
    bends: list[Waypoint]
    line: Sequence[Point]
    notes: tuple[Sequence[int], Sequence[int]]


class _Network:
    """The rows along the direction and across it, and the ways through them."""

    def __init__(
        self,
        edges: Mapping[int, LayoutEdge],
        centres: Sequence[Point],
        frames: Sequence[Frame],
        gates: Mapping[int, Sequence[Waypoint]],
    ) -> None:
        self._edges, self._centres = edges, centres
        # what was planned to run where there is a foreign frame now finds its way round that
        self._gates = {i: line for i, line in gates.items() if i in edges and not _walled(edges[i], line, frames)}
        across = [(own, (r[1], r[0], r[3], r[2])) for own, r in frames]
        self._down = OccupiedRows(centres, frames, len(edges), True)
        self._side = OccupiedRows([(y, x) for x, y in centres], across, len(edges))
        self._ways: dict[int, _Way] = {}
        self._between = by_ends(sorted(edges.items()))
        self.careful = len(edges) <= _MOST_CROSSED

    def found(self, along: bool) -> dict[int, list[Waypoint]]:
        """The waypoints of the ways along the direction, or of those across it."""
        return {i: found.bends for i, found in sorted(self._ways.items()) if found.along == along}

    def note(self, drawn: Iterable[Route]) -> None:
        """Note lines that are there already."""
        for route in drawn:
            self._note(sampled(route, _SAMPLED), True)

    def find(self, i: int, anew: bool) -> None:
        """The way of an edge; ``anew`` without that which it has."""
        edge = self._edges[i]
        ends = edge.source, edge.target
        # what has the same ends runs beside it, as the ends lean
        beside = [mate for mate in self._between[frozenset(ends)] if mate != i]
        if anew and i in self._ways:
            self._leave(i)
            del self._ways[i]
        for mate in beside:
            self._drop(mate)
        if self._gates.get(i):
            along, path = True, through(self._down, ends, self._gates[i])
        else:
            cost, path = way(self._down, ends)
            least = straight(self._centres[ends[0]], self._centres[ends[1]]) * _ACROSS
            other, aside = way(self._side, ends, limit=cost / _ACROSS) if cost > least else (math.inf, [])
            if math.isinf(min(cost, other)):
                return  # and then so it is for those with the same ends
            along = cost <= other * _ACROSS or self._round_it_all(ends, aside)
            path = path if along else aside
        rows = self._down if along else self._side
        rows.use(path[1:-1])
        bends = knots(rows, path, ends, not beside)
        line = path if self._gates.get(i) else [path[0], *((bend.x, bend.y) for bend in bends), path[-1]]
        self._ways[i] = _Way(along, path, bends, line, ((), ()))
        for one in (i, *beside):
            if self.careful and one in self._ways:
                found = self._ways[one]
                self._ways[one] = replace(found, notes=self._note(found.line, found.along))

    def _round_it_all(self, ends: tuple[int, int], aside: Sequence[Point]) -> bool:
        """Whether a way across leads out beyond its ends, and is much longer than one along, whatever that crosses,
        which is hardly longer than the straight line: crossings are followed more easily than a way round it all."""
        first, last = sorted((aside[0][0], aside[-1][0]))
        if all(first - _BEYOND <= x <= last + _BEYOND for x, _ in aside):
            return False
        if _length_of(aside) <= _MUCH * math.dist(aside[0], aside[-1]):
            return False
        cost, path = way(self._down, ends, 0.0, WALLED)
        length = _length_of(path)
        return cost < WALLED and length <= _HARDLY * math.dist(path[0], path[-1]) and _length_of(aside) > _MUCH * length

    def _note(self, line: Sequence[Point], along: bool) -> tuple[Sequence[int], Sequence[int]]:
        other = [(y, x) for x, y in line]
        return self._down.lines.add(line if along else other), self._side.lines.add(other if along else line)

    def _leave(self, i: int) -> None:
        """Free the room that a way takes, and forget its line."""
        self._drop(i)
        gone = self._ways[i]
        (self._down if gone.along else self._side).leave(gone.path[1:-1])

    def _drop(self, i: int) -> None:
        """Forget the line of a way."""
        if i in self._ways:
            gone = self._ways[i]
            self._down.lines.drop(gone.notes[0])
            self._side.lines.drop(gone.notes[1])
            self._ways[i] = replace(gone, notes=((), ()))
