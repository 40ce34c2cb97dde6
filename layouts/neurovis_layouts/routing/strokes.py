"""Strokes: what is drawn near a place, as points in a row, and what a route crosses of it.

In: routes. Out: points on a route outside its discs; how much of a line runs on others; how often routes cross what is
drawn near a place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_layouts.routing.obstacles import points_on
from neurovis_layouts.routing.walls import FloatArray, IntArray
from neurovis_spec.layout.geometry import cubics
from neurovis_spec.layout.model import Point, Route

#: Closer than this two lines are one to the eye.
_CLOSE = 0.12
#: Hidden by the disc and the arrowhead.
_END = 0.4
_STEP = 0.1
#: How far from a place crossings are counted.
_NEAR = 3.0


def line_of(route: Route) -> FloatArray:
    """(n, 2) points on a route, between what discs and arrowheads hide."""
    pieces = np.array(cubics(route), dtype=np.float64)
    points, _ = points_on(pieces, np.zeros(len(pieces), dtype=np.int64), _STEP)
    ends = np.array([route[0], route[-1]], dtype=np.float64)
    away = points[:, None, :] - ends[None, :, :]
    line: FloatArray = points[((away * away).sum(axis=2) > _END * _END).all(axis=1)]
    return line


def together(line: FloatArray, mates: Sequence[FloatArray]) -> float:
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


class Strokes:
    """Lines by the number of their edge, and others, which stay."""

    def __init__(self, routes: Mapping[int, Route], others: Sequence[Route]) -> None:
        self.lines = {i: line_of(route) for i, route in sorted(routes.items())}
        self._others = [line_of(route) for route in others]
        self._segments: tuple[FloatArray, FloatArray, IntArray] | None = None

    def note(self, edge: int, route: Route) -> None:
        """Note that an edge has another route now."""
        self.lines[edge] = line_of(route)
        self._segments = None

    def crossed(self, edges: Sequence[int], routes: Sequence[Route], place: Point) -> list[int]:
        """How often each of these routes, of these edges, crosses lines of other edges near a place."""
        a, b, owner = self._near(place)
        result: list[int] = []
        for edge, route in zip(edges, routes, strict=True):
            line = line_of(route)
            away = line - np.array(place)
            here = np.flatnonzero((away * away).sum(axis=1)[:-1] < _NEAR * _NEAR)
            foreign = owner != edge
            result.append(_crossings(line[here], line[here + 1], a[foreign], b[foreign]))
        return result

    def _near(self, place: Point) -> tuple[FloatArray, FloatArray, IntArray]:
        """Segments near a place: from, to, and of which edge each is."""
        if self._segments is None:
            lines = [*self.lines.items(), *((-1, line) for line in self._others)]
            lines = [(edge, line) for edge, line in lines if len(line) > 1]
            self._segments = (
                np.concatenate([np.zeros((0, 2)), *(line[:-1] for _, line in lines)]),
                np.concatenate([np.zeros((0, 2)), *(line[1:] for _, line in lines)]),
                np.concatenate(
                    [
                        np.zeros(0, dtype=np.int64),
                        *(np.full(len(line) - 1, edge, dtype=np.int64) for edge, line in lines),
                    ]
                ),
            )
        a, b, owner = self._segments
        away = a - np.array(place)
        near = (away * away).sum(axis=1) < (_NEAR + 1) * (_NEAR + 1)
        return a[near], b[near], owner[near]


def _crossings(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> int:
    """How many of the segments from a to b cross those from c to d."""
    (ux, uy), (vx, vy) = (b - a).T[:, :, None], (d - c).T[:, None, :]
    wx, wy = (c[None, :, :] - a[:, None, :]).transpose(2, 0, 1)
    cross = ux * vy - uy * vx
    sign, whole = np.sign(cross), np.abs(cross)
    t, s = (wx * vy - wy * vx) * sign, (wx * uy - wy * ux) * sign
    return int(((t >= 0) & (t < whole) & (s >= 0) & (s < whole)).sum())
