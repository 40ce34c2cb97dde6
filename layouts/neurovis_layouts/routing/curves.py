"""Curves along the direction: down from the source, through gaps in the ranks between, spread into the target.

In: edges, centres, the waypoints between. Out: a route for each. Where it leaves and arrives is told by ports: for one
side of one disc, each connection there leans sideways by a share u in (−1, 1) of a unit vector whose other part points
away from the disc, in the order of the other ends, spread so that arrowheads do not pile up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from neurovis_layouts.isotonic import spread
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: How far across a route runs in a gap, at most, for a unit along.
_SLOPE = 1.0
#: How much the shares of neighbours at a port differ, those of two that share both ends, and how far out the last lean.
_GAP, _PARTNER_GAP, _WIDEST = 0.28, 0.5, 0.85
#: Lines leave more steeply than they arrive: first out of the rank, then across.
_LEAN_SOURCE, _LEAN_TARGET = 0.5, 0.75


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A gap through which a route passes: straight, from ``half`` before ``y`` to ``half`` behind it."""

    x: float
    y: float
    half: float = 0.0


def curves(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    chosen: Sequence[int],
    waypoints: Mapping[int, Sequence[Waypoint]],
) -> dict[int, Route]:
    """Curves along the direction for the ``chosen`` edges, by index, from port to port: these lean by disc and side."""
    sides: dict[tuple[int, bool], list[Port]] = {}
    for i in chosen:
        edge = edges[i]
        ways = [(way.x, way.y) for way in waypoints.get(i, ())]
        start, end = centres[edge.source], centres[edge.target]
        line = [start, *ways, end]
        backward = end[1] < start[1]
        for own, other, partner, at_source in (
            (start, line[1], edge.target, True),
            (end, line[-2], edge.source, False),
        ):
            below = other[1] > own[1]
            port = Port(other[0] - own[0], partner, backward, i, at_source, other[1] - own[1])
            sides.setdefault((edge.source if at_source else edge.target, below), []).append(port)
    lean: dict[tuple[int, bool], float] = {}
    for ports in sides.values():
        lean.update(leanings(ports))
    return {
        i: curve(
            centres[edges[i].source],
            centres[edges[i].target],
            waypoints.get(i, ()),
            (lean[i, True], lean[i, False]),
        )
        for i in chosen
    }


def handle(across: float, along: float) -> float:
    """How much of the way along an end keeps its direction: more where the way across is long, so that the curve gets
    clear of the neighbours first."""
    return 0.5 + 0.4 * min(1.0, abs(across) / (6 * abs(along)))


def curve(start: Point, end: Point, ways: Sequence[Waypoint], lean: tuple[float, float]) -> Route:
    """The route. ``lean`` are the sideways shares at both ends."""
    sign = 1.0 if end[1] > start[1] else -1.0
    #: points that it passes, and its slope there
    knots = [(start, 0.0)]
    for way, slope in zip(ways, _slopes(start, end, ways), strict=True):
        if way.half > 0:
            knots += [((way.x, way.y - sign * way.half), 0.0), ((way.x, way.y + sign * way.half), 0.0)]
        else:
            knots.append(((way.x, way.y), slope))
    knots.append((end, 0.0))
    points: list[Point] = [start]
    for i, (((ax, ay), before), ((bx, by), behind)) in enumerate(pairwise(knots)):
        along = by - ay
        share = handle(bx - ax, along)
        reach, length = min(share, 0.5) * along, share * abs(along)
        first, second = (ax + before * reach, ay + reach), (bx - behind * reach, by - reach)
        if i == 0:
            first = _leaning(ax, ay, lean[0], sign, length)
        if i == len(knots) - 2:
            second = _leaning(bx, by, lean[1], -sign, length)
        points += [first, second, (bx, by)]
    return tuple(points)


def _leaning(x: float, y: float, lean: float, sign: float, length: float) -> Point:
    return x + lean * length, y + sign * math.sqrt(1 - lean * lean) * length


def _slopes(start: Point, end: Point, ways: Sequence[Waypoint]) -> list[float]:
    """Slopes (across by along) at waypoints: monotone (Fritsch and Butland 1984), so that nothing overshoots."""
    line = [start, *((way.x, way.y) for way in ways), end]
    secants = [(b[0] - a[0]) / (b[1] - a[1]) if b[1] != a[1] else 0.0 for a, b in pairwise(line)]
    result: list[float] = []
    for before, after in pairwise(secants):
        slope = 2 * before * after / (before + after) if before * after > 0 else 0.0
        result.append(max(-_SLOPE, min(_SLOPE, slope)))
    return result


@dataclass(frozen=True, slots=True, order=True)
class Port:
    """One end of an edge on one side of a disc: where it goes (relative), the partner, the edge, which end."""

    across: float
    partner: int
    backward: bool
    edge: int
    at_source: bool
    along: float


def leanings(ports: Sequence[Port]) -> dict[tuple[int, bool], float]:
    """u for each (edge, whether at its source), in the order of the other ends.

    A lone connection leans towards its other end; several keep a least difference, smaller where they are many.
    """
    ordered = sorted(ports)
    wishes = [
        (_LEAN_SOURCE if port.at_source else _LEAN_TARGET)
        * (port.across / math.sqrt(port.across * port.across + port.along * port.along))
        for port in ordered
    ]
    room = 2 * _WIDEST / max(1, len(ordered) - 1)
    gaps = [min(room, _PARTNER_GAP if first.partner == second.partner else _GAP) for first, second in pairwise(ordered)]
    places = spread(wishes, [1.0] * len(ordered), gaps)
    # a whole fan that leans out to one side is moved back, one that is too wide is narrowed as well
    over, under = places[-1] - _WIDEST, -_WIDEST - places[0]
    if over > 0 and under <= 0:
        places = [place - min(over, -under) for place in places]
    elif under > 0 and over <= 0:
        places = [place + min(under, -over) for place in places]
    widest = max(abs(place) for place in places)
    scale = _WIDEST / widest if widest > _WIDEST else 1.0
    return {(port.edge, port.at_source): place * scale for port, place in zip(ordered, places, strict=True)}
