"""Curves along the direction: down from the source, through gaps in the ranks between, spread into the target.

In: both centres, the waypoints between, how the ends lean. Out: a route.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from neurovis_spec.layout.model import Point, Route

#: How far across a route runs in a gap, at most, for a unit along.
_SLOPE = 1.0


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A gap through which a route passes: straight, from ``half`` before ``y`` to ``half`` behind it."""

    x: float
    y: float
    half: float = 0.0


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
