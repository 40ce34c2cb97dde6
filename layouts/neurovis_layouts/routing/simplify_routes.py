"""Simplified routes: routes with needless bends are drawn anew, with as few and gentle bends as obstacles allow.

In: routes that are drawn, what is in the way. Out: for those that wind, and those that run through a self-loop or along
a frame's border, a better route where there is one: with fewer corners or with its corners elsewhere, judged by all
that makes a line hard to follow (``Judge``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import pairwise, product

from neurovis_layouts.routing.corners import corners, smooth, smoothed
from neurovis_layouts.routing.polylines import along, polylines
from neurovis_layouts.routing.route_cost import Judge, Pen
from neurovis_spec.layout.geometry import distance, turn
from neurovis_spec.layout.model import RADIUS, Point, Route

#: A route is checked that bends by more than this (in chords of the unit circle) and is no single curve, or is longer
#: than the straight way by this factor.
_WINDS, _LONG = 1.2, 1.35
#: How much of a corner is cut off, at most.
_CUTS = (4.0, 1.0)
#: So many corners in a row are left out at once, at first and later on.
_MOST_CORNERS, _FEW_CORNERS = 9, 2
#: How far corners are moved, and how far off the straight way a lone one is tried.
_MOVES = (1.0, 0.45, 0.2)
_BOWS = (0.35, 0.7, 1.2, 2.0, 3.2, 5.0)
#: A new route is better than the old one by this at least.
_BETTER = 0.4
#: What is worse than the old one by this, where the search begins, will not become better.
_HOPELESS = 0.7
#: More than so many connections between two neurons are a fan, in which each has its place.
_FAN = 3
#: How many routes are checked, at most, by how many there are: in a crowd nobody follows one. How many in vain.
_LEAST, _MOST, _WORK, _VAIN = 15, 40, 3000, 12
_ROUNDS, _PASSES = 2, 4
#: A step on the way there is worth this at least.
_GAIN = 0.05
#: Of all ways that are tried from there so many are checked closely.
_SOME = 24
#: How far routes are shifted to be told apart, to what parts of a full turn their ends are turned, and which pieces are
#: too short for that.
_SHIFTS = (0.16, 0.22, 0.3, 0.42, 0.6, 0.9)
_TURNS = tuple(turn(step / 48) for step in (1, -1, 2, -2, 3, -3, 5, -5))
_SHORT, _TURNS_ROUND = 1.0, 3
#: So many are checked for that in a round, by how many pairs of routes there are, but always some.
_UNCLEAR = 1_200_000
#: What it costs there that an arrival and a departure are one line: more than a crossing, which can be followed. Where
#: whole lines are searched it would keep them on long ways.
_ARRIVING = 3.0
#: With more routes than this none is drawn anew or told apart: they cross too much to be followed.
MOST_EASED = 300
_DIAGONAL = 0.7071067811865476
_AROUND = (
    (1.0, 0.0), (_DIAGONAL, _DIAGONAL), (0.0, 1.0), (-_DIAGONAL, _DIAGONAL),
    (-1.0, 0.0), (-_DIAGONAL, -_DIAGONAL), (0.0, -1.0), (_DIAGONAL, -_DIAGONAL),
)  # fmt: skip


def eased(judge: Judge, free: AbstractSet[int]) -> dict[int, Route]:
    """Routes by edge index for those that are eased, of those that are ``free`` to be; the worst first."""
    most = max(_LEAST, min(_MOST, _WORK // max(1, len(judge.routes))))
    changed: set[int] = set()
    looked = sorted(free - judge.in_fans(_FAN))
    for _ in range(_ROUNDS):
        winding, through = judge.winding(), judge.through_loops() | judge.along_borders()
        chosen = [
            i
            for i in looked
            if i in through or winding[i][1] > _LONG or (winding[i][0] > _WINDS and len(judge.routes[i]) > 4)
        ]
        chosen.sort(key=lambda i: (-winding[i][0] - 2 * winding[i][1], i))
        looked, vain = [], 0
        for i in chosen[:most]:
            found = _better(Pen(judge, i))
            if found is not None:
                judge.draw(i, found)
                looked.append(i)
            vain = vain + 1 if found is None else 0
            if vain == _VAIN:
                break
        changed.update(looked)
        looked.sort()
    return {i: judge.routes[i] for k in sorted(changed) for i in judge.both(k)}


def told_apart(judge: Judge, free: AbstractSet[int]) -> dict[int, Route]:
    """Routes by edge index for those that are shifted to a side, or turned at an end, to be told apart from others, of
    those that are ``free`` to be."""
    changed: set[int] = set()
    for _ in range(_TURNS_ROUND):
        new: set[int] = set()
        on_others, meeting = judge.on_others(), judge.meeting()
        unclear = [*sorted(free & on_others), *sorted((free & meeting.keys()) - on_others)]
        for i in unclear[: max(_LEAST, _UNCLEAR // max(1, len(judge.routes) ** 2))]:
            pen = Pen(judge, i, arriving=_ARRIVING)
            tries = [*_shifted(pen.route)]
            tries += [turned for leaves in sorted(meeting.get(i, ())) for turned in _turned(pen.route, leaves)]
            found = _clearer(pen, tries)
            if found is not None:
                judge.draw(i, found)
                new.add(i)
        changed |= new
        if not new:
            break
    return {i: judge.routes[i] for k in sorted(changed) for i in judge.both(k)}


def _clearer(pen: Pen, tries: Sequence[Route]) -> Route | None:
    """The best of these routes, where it is better; no closer to a disc or a frame than what is there."""
    found = pen.cheapest(polylines(tries), pen.cost())
    if found is None:
        return None
    now, before = pen.trespass(tries[found[0]]), pen.trespass(pen.route)
    return tries[found[0]] if now[0] <= before[0] and now[1] <= before[1] else None


def _shifted(route: Route) -> Iterator[Route]:
    """The route this far to either side, but for its ends."""
    for by in _SHIFTS:
        for side in (by, -by):
            yield _beside(route, side)


def _beside(route: Route, by: float) -> Route:
    result = [route[0]]
    for number in range(1, len(route) - 1):
        # a knot and what is before and behind it move as one, so that the line stays smooth
        knot = (number + 1) // 3 * 3
        around = (max(knot - 1, 0), min(knot + 1, len(route) - 1)), (max(knot - 3, 0), min(knot + 3, len(route) - 1))
        for before, behind in around:
            dx, dy = route[behind][0] - route[before][0], route[behind][1] - route[before][1]
            length = math.sqrt(dx * dx + dy * dy)
            if length > 0:
                break
        x, y = route[number]
        result.append((x + by * dy / length, y - by * dx / length) if length > 0 else (x, y))
    return *result, route[-1]


def _turned(route: Route, leaves: bool) -> Iterator[Route]:
    """The route turned about its first or its last point by some steps."""
    line = route if leaves else route[::-1]
    while len(line) > 4 and distance(line[0], line[3]) < _SHORT:
        line = line[0], *line[4:]  # a piece too short to be turned
    (x, y), (px, py) = line[:2]
    for cosine, sine in _TURNS:
        dx, dy = px - x, py - y
        turned = (line[0], (x + cosine * dx - sine * dy, y + sine * dx + cosine * dy), *line[2:])
        yield turned if leaves else turned[::-1]


@dataclass(frozen=True, slots=True)
class _Try:
    """What a route costs, the line that it follows, and how much is cut off its corners."""

    cost: float
    line: tuple[Point, ...]
    cut: float


def _better(pen: Pen) -> Route | None:
    """A route that is clearly better than the one that is there, if one is found."""
    if distance(pen.route[0], pen.route[-1]) < 2 * RADIUS:
        return None  # between discs that overlap, as pins may have it
    now = pen.cost()
    line = corners(pen.route)
    starts = [line, *_fewer(line), *_bowed(line[0], line[-1])]
    best = _best(pen, product(starts, _CUTS), now + _HOPELESS)
    if best is None:
        return None
    for far in _MOVES:
        for _ in range(_PASSES):
            lines = *_moved(best.line, far), *_fewer(best.line, _FEW_CORNERS)
            better = _best(pen, ((line, best.cut) for line in lines), best.cost - _GAIN, _SOME)
            if better is None:
                break
            best = better
    best = _best(pen, product([best.line], _CUTS), best.cost - _GAIN) or best
    if best.cost > now - _BETTER:
        return None
    route = smooth(best.line, best.cut)
    entered, close = pen.trespass(route)
    before = pen.trespass(pen.route)
    return route if entered <= before[0] and close <= before[1] else None


def _best(
    pen: Pen, tries: Iterable[tuple[tuple[Point, ...], float]], limit: float, most: int | None = None
) -> _Try | None:
    """The best of these lines, with so much cut off their corners, None where all cost more than the limit; at most so
    many are checked closely."""
    ways = list(tries)
    if not ways:
        return None
    found = pen.cheapest(along(*smoothed(ways), len(ways)), limit, most)
    return None if found is None else _Try(found[1], *ways[found[0]])


def _fewer(line: tuple[Point, ...], most: int = _MOST_CORNERS) -> Iterator[tuple[Point, ...]]:
    """The line without some corners in a row, up to so many, and with one in their middle."""
    for first in range(1, len(line) - 1):
        for last in range(first, min(first + most, len(line) - 1)):
            yield line[:first] + line[last + 1 :]
            if last > first:
                left_out = line[first : last + 1]
                x, y = (math.fsum(part) / len(left_out) for part in zip(*left_out, strict=True))
                yield (*line[:first], (x, y), *line[last + 1 :])


def _moved(line: tuple[Point, ...], far: float) -> Iterator[tuple[Point, ...]]:
    for k in range(1, len(line) - 1):
        x, y = line[k]
        for dx, dy in _AROUND:
            yield (*line[:k], (x + far * dx, y + far * dy), *line[k + 1 :])
    for k, (a, b) in enumerate(pairwise(line[1:-1]), 1) if far == _MOVES[0] else ():
        for dx, dy in _AROUND[::2]:
            yield (
                *line[:k], (a[0] + far * dx, a[1] + far * dy), (b[0] + far * dx, b[1] + far * dy), *line[k + 2 :],
            )  # fmt: skip


def _bowed(start: Point, end: Point) -> Iterator[tuple[Point, ...]]:
    """The straight way, and lines with a corner or two beside it."""
    yield start, end
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = distance(start, end)
    for high in _BOWS:
        for side in (high, -high):
            nx, ny = dy / length * side, -dx / length * side
            for share in (0.25, 0.5, 0.75):
                yield start, (start[0] + share * dx + nx, start[1] + share * dy + ny), end
            yield (
                start,
                (start[0] + 0.2 * dx + nx, start[1] + 0.2 * dy + ny),
                (start[0] + 0.8 * dx + nx, start[1] + 0.8 * dy + ny),
                end,
            )
