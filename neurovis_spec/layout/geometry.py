"""Plane geometry for layouts: the coordinate grid, points on a circle, cubic Bézier splines.

In: points and routes. Out: points. Everything here uses + − × ÷ and √ alone, which IEEE 754 fixes to the last bit,
so that engines built on it give the same bytes on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from neurovis_spec.layout.model import GRID, Point, Route

_PER_UNIT = round(1 / GRID)
_PI = 3.141592653589793


def snap(value: float) -> float:
    """The nearest multiple of 1/1024; ties go to even, so that mirrored values stay mirrored.

    >>> snap(0.3) * 1024, snap(-0.3) * 1024
    (307.0, -307.0)
    """
    return round(value * _PER_UNIT) / _PER_UNIT + 0.0


def turn(part: float) -> Point:
    """Cosine and sine of ``part`` of a full turn, by series: the same bits on every machine.

    >>> turn(0.25)
    (0.0, 1.0)
    """
    part -= math.floor(part)
    quarter = (int(part * 8) + 1) // 2  # the nearest one: what is left is at most an eighth of a turn
    angle = (part - quarter / 4) * 2 * _PI
    cosine, sine = _series(angle)
    for _ in range(quarter % 4):
        cosine, sine = -sine, cosine
    return cosine + 0.0, sine + 0.0


def _series(angle: float) -> Point:
    cosine, sine, term = 0.0, 0.0, 1.0
    for n in range(0, 24, 2):
        cosine += term
        term *= angle / (n + 1)
        sine += term
        term *= -angle / (n + 2)
    return cosine, sine


def cubics(route: Route) -> list[tuple[Point, Point, Point, Point]]:
    """The cubic pieces of a route, each with its four points."""
    return [(route[i], route[i + 1], route[i + 2], route[i + 3]) for i in range(0, len(route) - 3, 3)]


def point_on(piece: Sequence[Point], t: float) -> Point:
    """The point of a cubic piece at ``t`` in [0, 1] (de Casteljau's weights)."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = piece
    s = 1 - t
    a, b, c, d = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
    return a * ax + b * bx + c * cx + d * dx, a * ay + b * by + c * cy + d * dy


def sampled(route: Route, step: float = 0.2) -> list[Point]:
    """Points along a route, about ``step`` apart, both ends included."""
    points = [route[0]]
    for piece in cubics(route):
        # not by sum(), which rounds once at the end from Python 3.12 on
        length = distance(piece[0], piece[1]) + distance(piece[1], piece[2]) + distance(piece[2], piece[3])
        parts = max(4, min(400, math.ceil(length / step)))
        points.extend(point_on(piece, i / parts) for i in range(1, parts + 1))
    return points


def distance(a: Point, b: Point) -> float:
    """Between two points (by √, whose result is fixed; ``hypot``'s is not)."""
    x, y = b[0] - a[0], b[1] - a[1]
    return math.sqrt(x * x + y * y)


def segment_distance(point: Point, a: Point, b: Point) -> float:
    """From a point to the segment from ``a`` to ``b``."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    squared = ux * ux + uy * uy
    if squared == 0:
        return distance(point, a)
    t = max(0.0, min(1.0, ((point[0] - a[0]) * ux + (point[1] - a[1]) * uy) / squared))
    return distance(point, (a[0] + t * ux, a[1] + t * uy))


def straight(a: Point, b: Point) -> Route:
    """A straight route, its control points on the line."""
    third = ((2 * a[0] + b[0]) / 3, (2 * a[1] + b[1]) / 3)
    return (a, third, ((a[0] + 2 * b[0]) / 3, (a[1] + 2 * b[1]) / 3), b)
