"""Ways: the best way between two neurons, row by row through what discs and frames leave free.

In: rows, two neurons, gates. Out: a way as points, what it costs, and the points at which it bends. A way is the
shortest through the free places of every row between its ends (dynamic programming over rows); ways that share a gap
keep apart, and cross what is drawn already as little as can be.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from neurovis_layouts.routing.curves import Waypoint
from neurovis_layouts.routing.lines import crossed
from neurovis_layouts.routing.rows import OccupiedRows, Own, Span
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.model import Point

_FINE = 0.15
_INSET = 0.25
_NARROW = 0.3
_APART = 0.22
#: What it costs to share a gap, to squeeze between two discs, to run through a wall, and to cross a line.
_SHARED, _SQUEEZED, _WALL, _CROSSING = 1.5, 0.4, 60.0, 4.0
_LEAST = 0.75
#: By how much the cost of a way may be rounded.
_ROUNDED = 1e-9
#: What costs more leads through a wall.
WALLED = _WALL
#: Places tried in a row, about; ways closer than this to the straight line are kept apart from, but for so many on
#: either side.
_CHOICES, _NEAR, _MOST_NEAR, _KEPT = 16, 2.0, 8, 2
#: Where a way is pulled straight: over how many rows, how far aside, and how close to another.
_FARTHEST, _ASIDE, _BESIDE_WAY = 12, 0.6, 0.12
#: How far before and behind a bend in a narrow gap a way is straight, and at most of the way to the next bend: two that
#: are straight leave room for a curve between them.
_STRAIGHT, _SHARE = 0.2, 0.45


def straight(a: Point, b: Point) -> float:
    """Hardly more than the least that a way between two points costs."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) * (1 - 1e-9)


def way(
    rows: OccupiedRows, ends: tuple[int, int], limit: float = math.inf, crossing: float = _CROSSING
) -> tuple[float, list[Point]]:
    """The cost of the best way, infinite where the ends are level or it costs more than the limit, and its points: both
    ends, one in each row. ``crossing`` is what it costs to cross a line."""
    start, end = rows.centres[ends[0]], rows.centres[ends[1]]
    if abs(end[1] - start[1]) < _LEAST:
        return math.inf, []
    own = rows.own(*ends)
    if start[1] > end[1]:
        cost, path = _down(rows, end, start, own, limit, crossing)
        return cost, path[::-1]
    return _down(rows, start, end, own, limit, crossing)


def through(rows: OccupiedRows, ends: tuple[int, int], gates: Sequence[Waypoint]) -> list[Point]:
    """The points of the best way through these gates, from above to below or the other way round."""
    start, end = rows.centres[ends[0]], rows.centres[ends[1]]
    if start[1] > end[1]:
        return through(rows, ends[::-1], gates[::-1])[::-1]
    own = rows.own(*ends)
    path = [start]
    for gate in gates:
        top, bottom = (gate.x, gate.y - gate.half), (gate.x, gate.y + gate.half)
        path += _down(rows, path[-1], top, own)[1][1:]
        path += [(gate.x, y) for y in rows.between(top[1], bottom[1], own, _FINE)]
        if gate.half > 0:
            path.append(bottom)
    return [*path, *_down(rows, path[-1], end, own)[1][1:]]


def _down(
    rows: OccupiedRows,
    start: Point,
    end: Point,
    own: Own,
    limit: float = math.inf,
    crossing: float = _CROSSING,
) -> tuple[float, list[Point]]:
    """The cost of the best way down from one point to another, and its points: both ends, one in each row."""
    limit *= 1 + _ROUNDED
    heights = [*rows.between(start[1], end[1], own), end[1]]
    line = [(_at(start, end, y), y) for y in heights]
    if _open(rows, [start, *line], own):
        # nothing is shorter
        return _cost([start, *line]), [start, *line]
    layers: list[tuple[FloatArray, IntArray]] = []
    cost, across, before = np.zeros(1), np.array(start[:1]), start[1]
    for middle, y in line:
        if limit < math.inf and _least(cost, across, end, before) > limit:
            return math.inf, []
        places, extra = np.array(end[:1]), np.zeros(1)
        if y != end[1]:
            kept = across[np.argsort(cost, kind="stable")[:_KEPT]].tolist()
            places, extra = _places(rows.free(y, own), rows.used(y), middle, (start[0], end[0]), kept)
        ways = cost[None, :] + _step(across, places, y - before)
        limits = min(across[0], places[0]), max(across[-1], places[-1])
        walls = rows.walls(before, y, own, limits)
        if walls:
            ways = ways + _WALL * _sides(across, places, walls)
        lines = rows.lines.between(before, y)
        if len(lines[0]) and crossing:
            ways = ways + crossing * crossed(across, places, lines)
        chosen = ways.argmin(axis=1)
        layers.append((places, chosen))
        cost, across, before = ways[np.arange(len(places)), chosen] + extra, places, y
    path: list[Point] = []
    k = 0
    for (places, chosen), y in zip(layers[::-1], heights[::-1], strict=True):
        path.append((float(places[k]), y))
        k = int(chosen[k])
    return float(cost[0]), [start, *path[::-1]]


def _least(cost: FloatArray, across: FloatArray, end: Point, y: float) -> float:
    """What a way costs at least that has come as far as these places in a row."""
    aside, down = across - end[0], end[1] - y
    return float((cost + np.sqrt(aside * aside + down * down)).min())


def _open(rows: OccupiedRows, line: Sequence[Point], own: Own) -> bool:
    """Whether a straight line runs through rows with room on both sides."""
    for x, y in line[1:-1]:
        free = rows.free(y, own)
        low, high = free[bisect_left(free, x, key=_end)]
        if not low + _INSET <= x <= high - _INSET or _crowd(rows.used(y), x):
            return False
    for (ax, top), (bx, bottom) in pairwise(line):
        if rows.walls(top, bottom, own, (min(ax, bx), max(ax, bx))):
            return False
        lines = rows.lines.between(top, bottom)
        if len(lines[0]) and crossed(np.array([ax]), np.array([bx]), lines).any():
            return False
    return True


def _cost(path: Sequence[Point]) -> float:
    """What a way costs where it has room."""
    total = 0.0
    for (ax, ay), (bx, by) in pairwise(path):
        total += float(_step(np.array([ax]), np.array([bx]), by - ay)[0, 0])
    return total


def _end(span: Span) -> float:
    return span[1]


def _at(start: Point, end: Point, y: float) -> float:
    """Where the straight line between two points is at a height."""
    return start[0] + (end[0] - start[0]) * (y - start[1]) / (end[1] - start[1])


def _sides(a: FloatArray, b: FloatArray, walls: Sequence[Span]) -> FloatArray:
    """How many walls a step leads through, from one side to the other: (to b, from a)."""
    low, high = np.minimum(a[None, :], b[:, None]), np.maximum(a[None, :], b[:, None])
    x0, x1 = np.array(walls).T[:, :, None, None]
    total: FloatArray = ((low <= x0) & (x1 <= high)).sum(axis=0, dtype=np.float64)
    return total


def _places(
    free: Sequence[Span], used: Sequence[float], line: float, ends: Span, kept: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Where a way may run through a row, in order, and what that costs: the places nearest to the straight line, and
    straight on from the best ones before (``kept``)."""
    at = bisect_left(used, line)
    near = used[max(bisect_left(used, line - _NEAR), at - _MOST_NEAR) : at + _MOST_NEAR]
    near = near[: bisect_left(near, line + _NEAR)]
    wishes = sorted([line, *ends, *(x - _APART for x in near), *(x + _APART for x in near)])
    found: dict[float, float] = {}
    for number in _outward(free, line):
        if len(found) > _CHOICES:
            break
        _try(free[number], wishes, kept, used, found)
    for x in kept:
        number = bisect_left(free, x, key=_end)
        if number < len(free) and free[number][0] <= x:
            _try(free[number], wishes, kept, used, found)
    places = sorted(found)
    return np.array(places), np.array([found[x] for x in places])


def _outward(free: Sequence[Span], line: float) -> Iterator[int]:
    """The free spans of a row, the nearest to a place first, that to the left of two as near."""
    right = bisect_left(free, line, key=_end)
    left = right - 1
    while left >= 0 or right < len(free):
        if right == len(free) or (left >= 0 and line - free[left][1] <= max(free[right][0] - line, 0.0)):
            yield left
            left -= 1
        else:
            yield right
            right += 1


def _try(
    span: Span, wishes: Sequence[float], kept: Sequence[float], used: Sequence[float], found: dict[float, float]
) -> None:
    """Add the places in a span that are nearest to what is wished for, with their costs; ``wishes`` are in order."""
    first, last = span
    width = last - first
    inset = min(_INSET, width / 4)
    low, high = first + inset, last - inset
    squeezed = _SQUEEZED if width < _NARROW else 0.0
    chosen = [low, high] if low <= high else [high]
    for x in kept:
        if first <= x <= last:
            chosen.append(low if x < low else high if x > high else x)
    if low < high:
        chosen += wishes[bisect_right(wishes, low) : bisect_left(wishes, high)]
    for x in chosen:
        if x not in found and -math.inf < x < math.inf:
            found[x] = squeezed + _SHARED * _crowd(used, x) if used else squeezed


def _crowd(used: Sequence[float], x: float) -> float:
    """How many ways run closer to a place than they should, and how much."""
    crowd = 0.0
    for number in range(bisect_left(used, x - _APART), bisect_left(used, x + _APART)):
        crowd += 1 - abs(x - used[number]) / _APART
    return crowd


def _step(a: FloatArray, b: FloatArray, dy: float) -> FloatArray:
    """What it costs to get from one row to the next: its length, and more where it is flat: (to b, from a)."""
    squared = (b[:, None] - a[None, :]) ** 2
    result: FloatArray = np.sqrt(squared + dy * dy) + 0.12 * squared / max(dy, 0.1)
    return result


def knots(rows: OccupiedRows, path: Sequence[Point], ends: tuple[int, int], alone: bool) -> list[Waypoint]:
    """The points of a way at which it bends; what lies on a line that is free is left out. One that is not ``alone``
    between its ends has two at least, so that it does not bulge across the others."""
    own = rows.own(*ends)
    spans = [_span(rows.free(y, own), x) for x, y in path]
    limits = np.array(
        [(max(low, x - _ASIDE), min(high, x + _ASIDE)) for (low, high), (x, _) in zip(spans, path, strict=True)]
    )
    line = np.array(path, dtype=np.float64)
    knots: list[Waypoint] = []
    at = _reach(rows, line, limits, 0)
    while at < len(path) - 1:
        low, high = spans[at]
        knots.append(Waypoint(*path[at], _STRAIGHT if 0 <= high - low < 1.2 else 0.0))
        at = _reach(rows, line, limits, at)
    if not knots and not alone and len(path) > 3:
        knots = [Waypoint(*path[1]), Waypoint(*path[-2])]
    stops = [path[0][1], *(knot.y for knot in knots), path[-1][1]]
    room = [
        _SHARE * min(abs(y - before), abs(after - y))
        for before, y, after in zip(stops, stops[1:], stops[2:], strict=False)
    ]
    return [Waypoint(knot.x, knot.y, min(knot.half, most)) for knot, most in zip(knots, room, strict=True)]


def _span(free: Sequence[Span], x: float) -> Span:
    """The free span that a place is in; one that holds nothing where it is in none."""
    number = bisect_left(free, x, key=_end)
    return free[number] if free[number][0] <= x else (math.inf, -math.inf)


def _reach(rows: OccupiedRows, path: FloatArray, limits: FloatArray, at: int) -> int:
    """The farthest point of a way that can be reached straight from another: clear of what stands in the rows between,
    of other ways, and close to the way."""
    last = min(len(path) - 1, at + _FARTHEST)
    if last == at + 1:
        return last
    (ax, ay), ends = path[at], path[at + 2 : last + 1]
    y, low, high = path[at + 1 : last, 1], limits[at + 1 : last, 0], limits[at + 1 : last, 1]
    x = ax + (ends[:, 0] - ax)[:, None] * (y - ay)[None, :] / (ends[:, 1] - ay)[:, None]
    behind = np.arange(len(ends))[:, None] < np.arange(len(y))[None, :]
    clear = (((low <= x) & (x <= high)) | behind).all(axis=1)
    candidates = np.flatnonzero(clear)[::-1].tolist()
    if not candidates:
        return at + 1
    passing = rows.lines.passing(path[at : last + 1, 1].tolist())
    known = np.cumsum(_crossings(path[at : last + 1, 0], passing))
    for number in candidates:
        line = zip(x[number, : number + 1].tolist(), path[at + 1 : at + 2 + number].tolist(), strict=True)
        if any(_beside(rows.used(height), place, own) for place, (own, height) in line):
            continue
        to = at + 2 + int(number)
        straight = np.concatenate((path[at : at + 1, 0], x[number, : number + 1], path[to : to + 1, 0]))
        if _crossings(straight, passing[: number + 3]).sum() <= known[to - at - 1]:
            return to
    return at + 1


def _crossings(line: FloatArray, passing: FloatArray) -> IntArray:
    """(n − 1,) how many lines a way (n,) crosses from row to row; ``passing`` (n, lines) is where these pass each."""
    left = line[:, None] < passing
    there = ~np.isnan(passing)
    crossed: IntArray = ((left[1:] != left[:-1]) & there[1:] & there[:-1]).sum(axis=1)
    return crossed


def _beside(used: Sequence[float], x: float, own: float) -> bool:
    """Whether another way runs beside a place."""
    beside = used[bisect_left(used, x - _BESIDE_WAY) : bisect_left(used, x + _BESIDE_WAY)]
    return any(other != own for other in beside)
