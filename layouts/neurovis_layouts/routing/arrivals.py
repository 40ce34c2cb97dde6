"""Arrivals: no connection arrives where another leaves, since an arrowhead on the start of a line makes both one.

In: routes that are drawn, those within frames, what is in the way. Out: for those that meet so, the route with an end
turned about the disc's centre, to where there is room.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.strokes import Strokes, line_of, together
from neurovis_layouts.routing.walls import FloatArray, Walls
from neurovis_spec.layout.geometry import distance, turn
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: How far from a centre arrowheads are looked at, how far apart two lines are there at best, and below what too close.
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
_MOST = 40
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
    for route in drawn:
        for leaves, line in ((True, route), (False, route[::-1])):
            if line[0] in number:
                fixed.setdefault(number[line[0]], []).append((_End(-1, leaves), _place(line)))
    between: dict[frozenset[int], list[int]] = {}
    for i in sorted(routes):
        between.setdefault(frozenset((edges[i].source, edges[i].target)), []).append(i)
    picture = _Picture(edges, dict(routes), free, Strokes(routes, drawn), between, obstacles, walls)
    turned: set[int] = set()
    for _ in range(_ROUNDS):
        before = len(turned)
        for neuron, own in sorted(ends.items()):
            others = fixed.get(neuron, [])
            both = [*own, *(end for end, _ in others)]
            if free.isdisjoint(end.edge for end in own) or len(both) > _MOST:
                continue
            turned |= _Disc(picture, centres[neuron], own, others).part()
        if len(turned) == before:
            break
    return {i: picture.routes[i] for i in sorted(turned)}


class _Disc:
    """The ends at one disc, those that may be turned first."""

    def __init__(
        self, picture: _Picture, centre: Point, own: Sequence[_End], others: Sequence[tuple[_End, Point]]
    ) -> None:
        self._picture, self._centre = picture, centre
        self._ends = [*own, *(end for end, _ in others)]
        routes = [picture.routes[end.edge] if end.leaves else picture.routes[end.edge][::-1] for end in own]
        places = [*map(_place, routes), *(place for _, place in others)]
        self._places: FloatArray = np.array(places) - np.array(centre)
        self._leaves = np.array([end.leaves for end in self._ends])
        self._free = [end.edge in picture.free for end in self._ends]

    def part(self) -> set[int]:
        """Turn what has to be; the edges turned."""
        turned: set[int] = set()
        for a, b in combinations(range(len(self._ends)), 2):
            one, other = self._ends[a], self._ends[b]
            if one.edge == other.edge or not (self._free[a] or self._free[b]):
                continue
            least = _CLOSE if one.leaves != other.leaves else _ONE if len(self._ends) <= _FEW else 0.0
            if self._gap(a, b) < least:
                turned |= self._parted(a, b)
        return turned

    def _gap(self, a: int, b: int) -> float:
        (ax, ay), (bx, by) = self._places[[a, b]].tolist()
        return distance((ax, ay), (bx, by))

    def _parted(self, a: int, b: int) -> set[int]:
        """Turn one of two ends, or both to opposite sides, if that is better."""
        steps = range(-_STEPS, _STEPS + 1)
        ways = [(0, 0), *((s, 0) for s in steps if s), *((0, s) for s in steps if s)]
        ways += [(s, -s) for s in steps if abs(s) in (1, 2, 3)]
        ways = [(s, t) for s, t in ways if (self._free[a] or not s) and (self._free[b] or not t)]
        lines = {(end, step): self._line(end, step) for way in ways for end, step in zip((a, b), way, strict=True)}
        spoilt = self._spoilt({key: line for key, line in lines.items() if line})
        costs = [
            _TURNING * (abs(s) + abs(t))
            + spoilt.get((a, s), 0.0)
            + spoilt.get((b, t), 0.0)
            + self._crowd({a: self._from(a, lines[a, s]), b: self._from(b, lines[b, t])})
            for s, t in ways
        ]
        s, t = ways[min(range(len(ways)), key=lambda number: (costs[number], number))]
        turned: set[int] = set()
        for end, step in ((a, s), (b, t)):
            if step:
                edge, route = self._ends[end].edge, lines[end, step]
                self._picture.routes[edge] = route
                self._picture.lines.note(edge, route)
                self._places[end] = self._from(end, route)
                turned.add(edge)
        return turned

    def _spoilt(self, lines: Mapping[tuple[int, int], Route]) -> dict[tuple[int, int], float]:
        """What it costs where these routes run, each of an end that is turned by so many steps."""
        picture = self._picture
        edges, routes = [self._ends[end].edge for end, _ in lines], list(lines.values())
        own = [picture.ends(edge) for edge in edges]
        clear = picture.obstacles.clearances(routes, own)
        enters = picture.walls.entered(routes, own) if picture.walls is not None else [False] * len(routes)
        crossed = picture.lines.crossed(edges, routes, self._centre)
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

    def _from(self, end: int, route: Route) -> Point:
        """Where an end is seen on this route, from the centre."""
        if not route:
            x, y = self._places[end].tolist()
            return x, y
        x, y = _place(route if self._ends[end].leaves else route[::-1])
        return x - self._centre[0], y - self._centre[1]

    def _crowd(self, moved: Mapping[int, Point]) -> float:
        """What it costs that two ends are there: close to others."""
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


def _place(route: Route) -> Point:
    """Where a route leaves the ring round its first point in which arrowheads lie."""
    a, b, c, d = (np.array(point) for point in route[:4])
    t, s = _T[:, None], 1 - _T[:, None]
    line = s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d
    x, y = (line - a).T
    far = np.sqrt(x * x + y * y)
    beyond = int(np.argmax(far >= _AT)) if far[-1] >= _AT else len(far) - 1
    px, py = (_AT / max(float(far[beyond]), 1e-9) * (line[beyond] - a) + a).tolist()
    return px, py
