"""Parallel edges: connections that share both ends, in either direction, are drawn beside each other.

In: routes that are drawn, what is in the way. Out: for those that run on another between the same ends, the route
shifted to a side, where it is clear of the other, of discs and frames, and on no third.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import partial

import numpy as np

from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.line_overlap import Sheaf, line_of, lines_of, tolerable
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.walls import Walls
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.model import LayoutEdge, Route

#: How much of a line may run on another, at most.
_SHARE = 0.2
#: Where a line of another is in the same cell, it is run on.
_CELL, _ROW = 0.12, 1 << 31
#: Shifts that are tried to either side, what a unit of them costs, and how often all are gone through.
_SHIFTS, _FAR, _ROUNDS = (0.16, 0.22, 0.3, 0.42, 0.6, 0.9), 0.3, 2
#: What it costs to enter a frame or a disc, a unit closer to a disc than ``REACH``, a whole line on one of the same
#: ends, on another's.
_ENTERING, _NEARING, _SAME, _OTHER = 8.0, 6.0, 4.0, 1.0

#: What is this close to a disc may be measured to run over it.
_SLACK = 0.02


def spread_out(
    edges: Sequence[LayoutEdge],
    routes: Mapping[int, Route],
    free: AbstractSet[int],
    fixed: AbstractSet[int],
    obstacles: Obstacles,
    walls: Walls | None,
) -> dict[int, Route]:
    """Routes by edge index for those that have to move, of those that are ``free`` to; the ``fixed`` are apart from
    each other as they are."""
    between = by_ends((i, edges[i]) for i in sorted(routes))
    groups = [
        group for group in between.values() if len(group) > 1 and not fixed >= set(group) and not free.isdisjoint(group)
    ]
    if not groups:
        return {}
    drawn = dict(routes)
    lines = dict(zip(routes, lines_of(list(routes.values())), strict=True))
    moved: set[int] = set()
    for _ in range(_ROUNDS):
        drawing = np.sort(np.concatenate([_cells(line) for line in lines.values()]))
        for group in groups:
            sheaf, own = Sheaf([lines[k] for k in group]), None
            for number, i in reversed(list(enumerate(group))):
                if i not in free or sheaf.together([lines[i]], number)[0] <= tolerable(lines[i], _SHARE):
                    continue
                if own is None:
                    own = np.sort(np.concatenate([_cells(lines[k]) for k in group]))
                best = _shifted(
                    drawn[i], edges[i], partial(sheaf.together, but=number), (drawing, own), obstacles, walls
                )
                if best != drawn[i]:
                    drawn[i], lines[i] = best, line_of(best)
                    moved.add(i)
                    sheaf, own = Sheaf([lines[k] for k in group]), None
    return {i: drawn[i] for i in sorted(moved)}


def _shared(line: FloatArray, share: float) -> float:
    """What it costs that so much of a line runs on one of its mates; less than to enter a frame or to run over a
    disc."""
    most = tolerable(line, _SHARE)
    return min(_ENTERING / 2, _SAME * _SHARE / most * max(0.0, share - most / 2))


def _shifted(
    route: Route,
    edge: LayoutEdge,
    together: Callable[[Sequence[FloatArray]], Sequence[float]],
    drawn: tuple[IntArray, IntArray],
    obstacles: Obstacles,
    walls: Walls | None,
) -> Route:
    """The route, or what is best of it shifted to either side; ``together`` says how much of lines runs on one between
    the same ends, ``drawn`` are the cells of all lines, and of those between the same ends."""
    own = edge.source, edge.target
    shifts = [0.0, *(side * shift for shift in _SHIFTS for side in (1.0, -1.0))]
    tried = [_beside(route, shift) for shift in shifts]
    clear = obstacles.clearances(tried, [own] * len(tried))
    enters = walls.entered(tried, [own] * len(tried)) if walls is not None else [False] * len(tried)
    lines = lines_of(tried)
    costs = [
        _FAR * abs(shift)
        + _ENTERING * (entering + (clearance < TOUCH + _SLACK))
        + _NEARING * (REACH - clearance)
        + _shared(line, share)
        + _OTHER * _crowded(line, drawn)
        for shift, line, clearance, entering, share in zip(shifts, lines, clear, enters, together(lines), strict=True)
    ]
    return tried[min(range(len(tried)), key=lambda k: (costs[k], k))]


def _beside(route: Route, by: float) -> Route:
    """The route this far to its left, but for its ends."""
    if by == 0.0:
        return route
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


def _cells(line: FloatArray) -> IntArray:
    """(n,) the cells that the points of a line are in."""
    at = np.floor(line / _CELL).astype(np.int64)
    cells: IntArray = at[:, 0] * _ROW + at[:, 1]
    return cells


def _crowded(line: FloatArray, drawn: tuple[IntArray, IntArray]) -> float:
    """The share of a line that is where others are, which are drawn but not between the same ends."""
    if not len(line):
        return 0.0
    cells = _cells(line)
    everyone, own = (np.searchsorted(a, cells, "right") - np.searchsorted(a, cells) for a in drawn)
    return float((everyone > own).sum()) / len(line)
