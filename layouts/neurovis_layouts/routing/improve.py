"""Improved routes: what is hard to follow is drawn anew, the worst first, by the one cost of routes.

In: all that is drawn, the edges whose routes are free. Out: better routes for some of them. A route is shifted to a
side, turned at an end, made straight, bowed, or led through other corners, and the best of all that is taken; of
mirror images one is drawn and the other reflected, and what joins two images of each other is its own reflection.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from itertools import product

from neurovis_layouts.routing.corners import corners, smooth, smoothed
from neurovis_layouts.routing.polylines import along, polylines
from neurovis_layouts.routing.route_cost import Drawn, RouteCost
from neurovis_spec.layout.geometry import distance, turn
from neurovis_spec.layout.model import RADIUS, Point, Route

#: With more routes than this none is drawn anew: they cross too much to be followed.
MOST_IMPROVED = 300
#: How many routes are drawn anew, at most, by how many there are: in a crowd nobody follows one (twice as many: 5 %
#: less turning in the Rome graphs of sample 11). How many in vain, and how often each is tried, a last time where they
#: are few (of many it takes a fifth of the time: 2 % less turning).
_LEAST, _WORK, _VAIN, _ROUNDS, _FEW = 15, 1500, 12, 3, 30
#: How far routes are shifted, to what parts of a full turn their ends are turned, and which pieces are too short for
#: that.
_SHIFTS = (0.1, 0.16, 0.22, 0.3, 0.42, 0.6, 0.9)
_TURNS = tuple(turn(step / 48) for step in (1, -1, 2, -2, 3, -3, 5, -5))
_SHORT = 1.0
#: How much of a corner is cut off, at most.
_CUTS = (4.0, 1.0)
#: So many corners in a row are left out at once, at first and later on.
_MOST_CORNERS, _FEW_CORNERS = 9, 2
#: How far corners are moved, how often one is, and how far off the straight way a lone one is tried.
_MOVES, _PASSES = (1.0, 0.45, 0.2), 8
_BOWS = (0.35, 0.7, 1.2, 2.0, 3.2, 5.0)
#: A new line is better than the old route by this at least.
_BETTER = 0.4
#: What is worse than the old one by this, where the search begins, will not become better; each step of it is worth
#: this at least.
_HOPELESS, _GAIN = 0.7, 0.05
#: Of all lines that are tried in a step so many are checked closely.
_SOME = 48
_DIAGONAL = 0.7071067811865476
_AROUND = (
    (1.0, 0.0), (_DIAGONAL, _DIAGONAL), (0.0, 1.0), (-_DIAGONAL, _DIAGONAL),
    (-1.0, 0.0), (-_DIAGONAL, -_DIAGONAL), (0.0, -1.0), (_DIAGONAL, -_DIAGONAL),
)  # fmt: skip

#: A line by its corners, and how much is cut off these.
_Line = tuple[tuple[Point, ...], float]


def improved(drawn: Drawn, free: AbstractSet[int]) -> dict[int, Route]:
    """Better routes by edge index, of the edges that are ``free``; mirror images with them."""
    changed: set[int] = set()
    left, most = set(free), max(_LEAST, _WORK // max(1, len(drawn.routes)))
    for _ in range(_ROUNDS if len(drawn.routes) <= _FEW else _ROUNDS - 1):
        unclear = drawn.unclear(left)
        vain, found = 0, False
        for i in sorted(unclear, key=lambda i: (-unclear[i].cost, i))[:most]:
            route = _better(RouteCost(drawn, i), unclear[i].winds)
            if route is None:
                left.discard(i)
                vain += 1
                if vain == _VAIN:
                    break
            else:
                drawn.draw(i, route)
                changed.add(i)
                found, vain = True, 0
        if not found:
            break
    return {i: drawn.routes[i] for k in sorted(changed) for i in drawn.both(k)}


def _better(cost: RouteCost, winds: bool) -> Route | None:
    """The best route that an edge may have, if it is better than the one that is there, no closer to a disc or a
    frame, and crosses no more."""
    if distance(cost.route[0], cost.route[-1]) < 2 * RADIUS:
        return None  # between discs that overlap, as pins may have it
    now = cost.cost()
    best = _searched(cost, now) if winds else None
    if best is not None and not cost.trespasses(best):
        return best
    tries = [cost.whole(route) for route in (*_shifted(cost.route), *_turned(cost.route))]
    cheaper = (tries[k] for k, _ in cost.cheaper(polylines(tries), now))
    return next((route for route in cheaper if not cost.trespasses(route)), None)


def _searched(cost: RouteCost, now: float) -> Route | None:
    """The best line of few corners that is found, if it is clearly better than ``now``."""
    line = corners(cost.route)
    starts = [line, *_fewer(line), *_bowed(line[0], line[-1])]
    best = _best(cost, product(starts, _CUTS), now + _HOPELESS)
    if best is None:
        return None
    for _ in range(_PASSES):
        least, (line, cut) = best
        tries = [(line, other) for other in _CUTS if other != cut]
        tries += ((other, cut) for other in (*_moved(line), *_fewer(line, _FEW_CORNERS)))
        better = _best(cost, tries, least - _GAIN, _SOME)
        if better is None:
            break
        best = better
    least, chosen = best
    return cost.whole(smooth(*chosen)) if least <= now - _BETTER else None


def _best(cost: RouteCost, tries: Iterable[_Line], limit: float, most: int | None = None) -> tuple[float, _Line] | None:
    """What the best of these lines costs, and that line, None where all cost more than the limit; at most so many are
    checked closely."""
    ways = [(cost.line(line), cut) for line, cut in tries]
    if not ways:
        return None
    found = cost.cheapest(along(*smoothed(ways), len(ways)), limit, most)
    return None if found is None else (found[1], ways[found[0]])


def _shifted(route: Route) -> Iterator[Route]:
    """The route this far to either side, but for its ends."""
    last, square = len(route) - 1, list[tuple[float, float, float]]()
    for number in range(1, last):
        # a knot and what is before and behind it move as one, so that the line stays smooth
        knot = (number + 1) // 3 * 3
        for far in (1, 3):
            before, behind = route[max(knot - far, 0)], route[min(knot + far, last)]
            length = distance(before, behind)
            if length > 0:
                break
        square.append((behind[1] - before[1], before[0] - behind[0], length or 1.0))
    for by in _SHIFTS:
        for side in (by, -by):
            yield (
                route[0],
                *(
                    (x + side * dx / length, y + side * dy / length)
                    for (x, y), (dx, dy, length) in zip(route[1:-1], square, strict=True)
                ),
                route[-1],
            )


def _turned(route: Route) -> Iterator[Route]:
    """The route turned about its first or its last point by some steps."""
    for leaves in (False, True):
        line = route if leaves else route[::-1]
        while len(line) > 4 and distance(line[0], line[3]) < _SHORT:
            line = line[0], *line[4:]  # a piece too short to be turned
        (x, y), (px, py) = line[:2]
        for cosine, sine in _TURNS:
            dx, dy = px - x, py - y
            turned = (line[0], (x + cosine * dx - sine * dy, y + sine * dx + cosine * dy), *line[2:])
            yield turned if leaves else turned[::-1]


def _fewer(line: tuple[Point, ...], most: int = _MOST_CORNERS) -> Iterator[tuple[Point, ...]]:
    """The line without some corners in a row, up to so many."""
    for first in range(1, len(line) - 1):
        for last in range(first, min(first + most, len(line) - 1)):
            yield line[:first] + line[last + 1 :]


def _moved(line: tuple[Point, ...]) -> Iterator[tuple[Point, ...]]:
    """The line with a corner elsewhere."""
    for far in _MOVES:
        for k in range(1, len(line) - 1):
            x, y = line[k]
            for dx, dy in _AROUND:
                yield (*line[:k], (x + far * dx, y + far * dy), *line[k + 1 :])


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
