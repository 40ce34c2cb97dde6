"""Sheaves: connections that share both ends, in either direction, do not run on each other.

In: routes that are drawn, what is in the way. Out: for those that run on another between the same ends, the route
shifted to a side, where it is clear of the other, of discs and frames, and on no third.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from neurovis_layouts.routing.obstacles import REACH, Obstacles, points_on
from neurovis_layouts.routing.walls import FloatArray, IntArray, Walls
from neurovis_spec.layout.geometry import cubics
from neurovis_spec.layout.model import LayoutEdge, Route

#: Closer than this two lines are one to the eye; how much of a line may be, at most.
_CLOSE, _SHARE = 0.12, 0.2
#: Where a line of another is in the same cell, it is run on.
_CELL, _ROW = 0.12, 1 << 31
#: Shifts that are tried to either side, what a unit of them costs, and how often all are gone through.
_SHIFTS, _FAR, _ROUNDS = (0.16, 0.22, 0.3, 0.42, 0.6, 0.9), 0.3, 2
#: What it costs to enter a frame, a unit closer to a disc than ``REACH``, a whole line on one of the same ends, on
#: another's.
_ENTERING, _NEARING, _SAME, _OTHER = 8.0, 6.0, 4.0, 1.0
#: Hidden by the disc and the arrowhead.
_END = 0.4
_STEP = 0.1


def spread_out(
    edges: Sequence[LayoutEdge],
    routes: Mapping[int, Route],
    fixed: AbstractSet[int],
    obstacles: Obstacles,
    walls: Walls | None,
) -> dict[int, Route]:
    """Routes by edge index for those that have to move; the ``fixed`` are apart from each other as they are."""
    between: dict[tuple[int, int], list[int]] = {}
    for i in sorted(routes):
        source, target = edges[i].source, edges[i].target
        between.setdefault((min(source, target), max(source, target)), []).append(i)
    groups = [group for group in between.values() if len(group) > 1 and not fixed >= set(group)]
    if not groups:
        return {}
    drawn = dict(routes)
    lines = {i: _line(route) for i, route in routes.items()}
    moved: set[int] = set()
    for _ in range(_ROUNDS):
        drawing = np.sort(np.concatenate([_cells(line) for line in lines.values()]))
        for group in groups:
            for i in group[::-1]:
                mates = [lines[k] for k in group if k != i]
                if _together(lines[i], mates) <= _SHARE:
                    continue
                own = np.sort(np.concatenate([_cells(lines[k]) for k in group]))
                best = _shifted(drawn[i], edges[i], mates, (drawing, own), obstacles, walls)
                if best != drawn[i]:
                    drawn[i], lines[i] = best, _line(best)
                    moved.add(i)
    return {i: drawn[i] for i in sorted(moved)}


def _shifted(
    route: Route,
    edge: LayoutEdge,
    mates: Sequence[FloatArray],
    drawn: tuple[IntArray, IntArray],
    obstacles: Obstacles,
    walls: Walls | None,
) -> Route:
    """The route, or what is best of it shifted to either side; ``drawn`` are the cells of all lines, and of those
    between the same ends."""
    own = edge.source, edge.target
    shifts = [0.0, *(side * shift for shift in _SHIFTS for side in (1.0, -1.0))]
    tried = [_beside(route, shift) for shift in shifts]
    clear = obstacles.clearances(tried, [own] * len(tried))
    enters = walls.entered(tried, [own] * len(tried)) if walls is not None else [False] * len(tried)
    costs = [
        _FAR * abs(shift)
        + _ENTERING * entering
        + _NEARING * (REACH - clearance)
        + _SAME * max(0.0, _together(line, mates) - _SHARE / 2)
        + _OTHER * _crowded(line, drawn)
        for shift, line, clearance, entering in zip(shifts, map(_line, tried), clear, enters, strict=True)
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


def _line(route: Route) -> FloatArray:
    """(n, 2) points on a route, between what discs and arrowheads hide."""
    pieces = np.array(cubics(route), dtype=np.float64)
    points, _ = points_on(pieces, np.zeros(len(pieces), dtype=np.int64), _STEP)
    ends = np.array([route[0], route[-1]], dtype=np.float64)
    away = points[:, None, :] - ends[None, :, :]
    line: FloatArray = points[((away * away).sum(axis=2) > _END * _END).all(axis=1)]
    return line


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


def _together(line: FloatArray, mates: Sequence[FloatArray]) -> float:
    """The largest share of a line that runs on one of its mates."""
    return max(_near(line, mate) for mate in mates)


def _near(line: FloatArray, points: FloatArray) -> float:
    """The share of a line that is close to some of these points."""
    if not len(line) or not len(points):
        return 0.0
    low, high = line.min(axis=0) - 2 * _CLOSE, line.max(axis=0) + 2 * _CLOSE
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    if not len(points):
        return 0.0
    # points stand a step apart: half of it may be missing to the nearest
    dx, dy = line[:, None, 0] - points[None, :, 0], line[:, None, 1] - points[None, :, 1]
    dx *= dx
    dy *= dy
    dx += dy
    near = dx.min(axis=1) < _CLOSE * _CLOSE + _STEP * _STEP / 4
    return float(near.sum()) / len(line)
