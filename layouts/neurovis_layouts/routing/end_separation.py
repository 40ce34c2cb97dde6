"""End separation: turns the end of a route that arrives at a disc where another leaves, as both look like one line.

In: routes that are drawn, those within frames, what is in the way. Out: for those that meet so, the route with an end
turned about the disc's centre, to where there is room.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.line_overlap import Strokes, line_of, together
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.walls import Walls
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import cubic, distance, turn
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: How far from a centre arrowheads are checked, how far apart two lines are there at best, and below what too close.
_AT, _APART, _CLOSE = 0.45, 0.16, 0.13
#: Closer than this two arrowheads, or two starts, are one: looked at where there are no more ends than so many.
_ONE, _FEW = 0.07, 8
#: Ends are turned by so many steps at most, each a part of a full turn.
_STEPS, _STEP = 5, 1 / 48
#: What it costs to turn by a step, to be close to an end of the other kind and to one of the same, to cross a line, to
#: run on one between the same ends, to come a unit closer to a disc than ``REACH``, and to enter a frame or a disc.
_TURNING, _MEETING, _BESIDE, _CROSSING, _SAME, _NEARING, _ENTERING = 0.03, 2.0, 1.0, 0.7, 8.0, 6.0, 20.0
_ROUNDS = 2
_SHORT = 1.0
#: What is this close to a disc may be measured to run over it.
_SLACK = 0.02
#: With more ends than this at a disc there is no room for all.
_MOST = 12
#: With more routes than this nobody counts how often they cross.
_MOST_CROSSED = 300
_T = np.arange(1, 33, dtype=np.float64) / 32
#: Turned by ``_STEP`` times −``_STEPS``, …, ``_STEPS``: cosine and sine.
_TURNS = tuple(turn(number * _STEP) for number in range(-_STEPS, _STEPS + 1))


@dataclass(frozen=True, slots=True)
class _End:
    """One end of a route: of which edge (−1: of one that stays as it is), whether that leaves here."""

    edge: int
    leaves: bool


@dataclass(frozen=True, slots=True)
class _Picture:
    """What is drawn, and what is in the way; ``between`` are the edges that share ends."""

    edges: Sequence[LayoutEdge]
    routes: dict[int, Route]
    free: AbstractSet[int]
    lines: Strokes
    between: Mapping[frozenset[int], Sequence[int]]
    obstacles: Obstacles
    walls: Walls | None

    def ends(self, edge: int) -> tuple[int, int]:
        """From where to where an edge leads."""
        return self.edges[edge].source, self.edges[edge].target

    def shared(self, edge: int, route: Route) -> float:
        """How much of this route for an edge would run on one between the same ends."""
        mates = [self.lines.lines[k] for k in self.between[frozenset(self.ends(edge))] if k != edge]
        return together(line_of(route), mates) if mates else 0.0


def parted(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    routes: Mapping[int, Route],
    free: AbstractSet[int],
    drawn: Sequence[Route],
    obstacles: Obstacles,
    walls: Walls | None,
) -> dict[int, Route]:
    """Routes by edge index for those that have to turn, of those that are ``free`` to; ``drawn`` are others, which stay
    as they are."""
    ends: dict[int, list[_End]] = {}
    for i in sorted(routes):
        ends.setdefault(edges[i].source, []).append(_End(i, True))
        ends.setdefault(edges[i].target, []).append(_End(i, False))
    fixed: dict[int, list[tuple[_End, Point]]] = {}
    number = {centres[neuron]: neuron for neuron in ends}
    there = [(leaves, route[:: 1 if leaves else -1]) for route in drawn for leaves in (True, False)]
    there = [(leaves, line) for leaves, line in there if line[0] in number]
    for (leaves, line), place in zip(there, _places([line for _, line in there]), strict=True):
        fixed.setdefault(number[line[0]], []).append((_End(-1, leaves), place))
    all_ends = [end for own in ends.values() for end in own]
    places = dict(zip(all_ends, _places([routes[e.edge][:: 1 if e.leaves else -1] for e in all_ends]), strict=True))
    between = by_ends((i, edges[i]) for i in sorted(routes))
    picture = _Picture(edges, dict(routes), free, Strokes(routes, drawn), between, obstacles, walls)
    turned: set[int] = set()
    for _ in range(_ROUNDS):
        before = len(turned)
        for neuron, own in sorted(ends.items()):
            others = fixed.get(neuron, [])
            both = [*own, *(end for end, _ in others)]
            if free.isdisjoint(end.edge for end in own) or len(both) > _MOST:
                continue
            turned |= _Disc(picture, centres[neuron], own, others, places).part()
        if len(turned) == before:
            break
    return {i: picture.routes[i] for i in sorted(turned)}


class _Disc:
    """The ends at one disc, those that may be turned first."""

    def __init__(
        self,
        picture: _Picture,
        centre: Point,
        own: Sequence[_End],
        others: Sequence[tuple[_End, Point]],
        seen: dict[_End, Point],
    ) -> None:
        """``seen`` is where each end of a route is seen."""
        self._picture, self._centre, self._seen = picture, centre, seen
        self._ends = [*own, *(end for end, _ in others)]
        places = [*(seen[end] for end in own), *(place for _, place in others)]
        self._places: FloatArray = np.array(places) - np.array(centre)
        self._leaves = np.array([end.leaves for end in self._ends])
        self._free = [end.edge in picture.free for end in self._ends]

    def part(self) -> set[int]:
        """Turn what has to be; the edges turned."""
        turned: set[int] = set()
        kinds = self._leaves[:, None] != self._leaves[None, :]
        least = np.where(kinds, _CLOSE, _ONE if len(self._ends) <= _FEW else 0.0)
        for a, one in enumerate(self._ends):
            after = a
            while True:
                x, y = (self._places - self._places[a]).T
                near = np.flatnonzero(np.sqrt(x * x + y * y) < least[a])
                b = next((int(k) for k in near if k > after and self._parts(one, self._ends[k])), None)
                if b is None:
                    break
                turned |= self._parted(a, b)
                after = b
        return turned

    def _parts(self, one: _End, other: _End) -> bool:
        """Whether one of two ends may be turned off the other."""
        free = self._picture.free
        return one.edge != other.edge and (one.edge in free or other.edge in free)

    def _parted(self, a: int, b: int) -> set[int]:
        """Turn one of two ends, or both to opposite sides, if that is better."""
        steps = range(-_STEPS, _STEPS + 1)
        ways = [(0, 0), *((s, 0) for s in steps if s), *((0, s) for s in steps if s)]
        ways += [(s, -s) for s in steps if abs(s) in (1, 2, 3)]
        ways = [(s, t) for s, t in ways if (self._free[a] or not s) and (self._free[b] or not t)]
        lines = {(end, step): self._line(end, step) for way in ways for end, step in zip((a, b), way, strict=True)}
        spoilt = self._spoilt({key: line for key, line in lines.items() if line})
        seen = self._from(lines)
        costs = [
            _TURNING * (abs(s) + abs(t))
            + spoilt.get((a, s), 0.0)
            + spoilt.get((b, t), 0.0)
            + self._crowd({a: seen[a, s], b: seen[b, t]})
            for s, t in ways
        ]
        s, t = ways[min(range(len(ways)), key=lambda number: (costs[number], number))]
        turned: set[int] = set()
        for end, step in ((a, s), (b, t)):
            if step:
                edge, route = self._ends[end].edge, lines[end, step]
                self._picture.routes[edge] = route
                self._picture.lines.note(edge, route)
                self._places[end] = seen[end, step]
                self._seen.update(
                    zip((_End(edge, True), _End(edge, False)), _places([route, route[::-1]]), strict=True)
                )
                turned.add(edge)
        return turned

    def _spoilt(self, lines: Mapping[tuple[int, int], Route]) -> dict[tuple[int, int], float]:
        """What it costs where these routes run, each of an end that is turned by so many steps."""
        picture = self._picture
        edges, routes = [self._ends[end].edge for end, _ in lines], list(lines.values())
        own = [picture.ends(edge) for edge in edges]
        # of a route only what turns
        pieces = [self._turning(end, route) for (end, _), route in lines.items()]
        clear = picture.obstacles.clearances(pieces, own)
        enters = picture.walls.entered(pieces, own) if picture.walls is not None else [False] * len(routes)
        few = len(picture.routes) <= _MOST_CROSSED
        crossed = picture.lines.crossed(edges, pieces, self._centre) if few else [0] * len(edges)
        costs = [
            _NEARING * (REACH - clearance)
            + _ENTERING * (entering + (clearance < TOUCH + _SLACK))
            + _CROSSING * crossings
            for clearance, entering, crossings in zip(clear, enters, crossed, strict=True)
        ]
        shared = [_SAME * picture.shared(edge, route) for edge, route in zip(edges, routes, strict=True)]
        return dict(zip(lines, map(sum, zip(costs, shared, strict=True)), strict=True))

    def _line(self, end: int, step: int) -> Route:
        """The route of an end, turned by so many steps there; nothing where that is not known."""
        if self._ends[end].edge < 0:
            return ()
        route = self._picture.routes[self._ends[end].edge]
        if not step:
            return route
        line = _merged(route if self._ends[end].leaves else route[::-1])
        (x, y), (cosine, sine) = self._centre, _TURNS[step + _STEPS]
        dx, dy = line[1][0] - x, line[1][1] - y
        line = (line[0], (x + cosine * dx - sine * dy, y + sine * dx + cosine * dy), *line[2:])
        return line if self._ends[end].leaves else line[::-1]

    def _turning(self, end: int, route: Route) -> Route:
        """The part of a route that is another where its end is turned, from the centre on."""
        now = self._picture.routes[self._ends[end].edge]
        rest = len(_merged(now[:: 1 if self._ends[end].leaves else -1])) - 4
        return route[:: 1 if self._ends[end].leaves else -1][: len(route) - rest]

    def _from(self, lines: Mapping[tuple[int, int], Route]) -> dict[tuple[int, int], Point]:
        """Where ends are seen on these routes, from the centre."""
        known = {key: line[:: 1 if self._ends[key[0]].leaves else -1] for key, line in lines.items() if line}
        places = dict(zip(known, _places(list(known.values())), strict=True))
        (cx, cy), stay = self._centre, {end: self._places[end].tolist() for end, _ in lines}
        away = {key: (x - cx, y - cy) for key, (x, y) in places.items()}
        return {key: away.get(key, (stay[key[0]][0], stay[key[0]][1])) for key in lines}

    def _crowd(self, moved: Mapping[int, Point]) -> float:
        """The cost of ends being ``moved`` there, by how close they are to other ends."""
        places = self._places.copy()
        for end, place in moved.items():
            places[end] = place
        total = 0.0
        for end in moved:
            x, y = (places - places[end]).T
            close = np.maximum(0.0, 1 - np.sqrt(x * x + y * y) / _APART)
            close[end] = 0.0
            total += float((close * np.where(self._leaves != self._leaves[end], _MEETING, _BESIDE)).sum())
        return total


def _merged(route: Route) -> Route:
    """The route with no piece at its beginning that is too short to be turned."""
    while len(route) > 4 and distance(route[0], route[3]) < _SHORT:
        route = route[0], *route[4:]
    return route


def _places(routes: Sequence[Route]) -> list[Point]:
    """Where each route leaves the ring round its first point in which arrowheads lie."""
    if not routes:
        return []
    p = np.array([route[:4] for route in routes], dtype=np.float64)
    away = cubic(p[:, None], _T) - p[:, None, 0]
    x, y = away[:, :, 0], away[:, :, 1]
    far = np.sqrt(x * x + y * y)
    far[:, -1] = np.where((far < _AT).all(axis=1), np.maximum(far[:, -1], 1e-9), far[:, -1])
    beyond = np.where((far < _AT).all(axis=1), far.shape[1] - 1, np.argmax(far >= _AT, axis=1))
    each = np.arange(len(p))
    found = _AT / far[each, beyond][:, None] * away[each, beyond] + p[:, 0]
    return [(px, py) for px, py in found.tolist()]
