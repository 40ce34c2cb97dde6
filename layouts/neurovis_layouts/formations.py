"""Formations: members placed relative to each other, as a row, a column, a grid, a ring or an arc.

In: how many, and how far apart neighbours are. Out: offsets from the middle, x right, y down.
"""

from __future__ import annotations

import math

from neurovis_spec.layout.geometry import snap, turn
from neurovis_spec.layout.model import Arrangement, Point


def offsets(how: Arrangement, count: int, spacing: float) -> list[Point]:
    """Offsets of ``count`` members, the middle of their extent at (0, 0).

    >>> offsets("row", 2, 1.0)
    [(-0.5, 0.0), (0.5, 0.0)]
    """
    if count <= 1:
        return [(0.0, 0.0)] * count
    match how:
        case "row":
            points = [(i * spacing, 0.0) for i in range(count)]
        case "column":
            points = [(0.0, i * spacing) for i in range(count)]
        case "grid":
            points = grid(count, columns(count), spacing)
        case "ring":
            points = ring(count, spacing)
        case "arc":
            points = arc(count, spacing)
    return _centred(points)


def columns(count: int) -> int:
    """How many columns make a grid nearly square."""
    root = math.isqrt(count)
    return root if root * root == count else root + 1


def grid(count: int, width: int, spacing: float) -> list[Point]:
    """Rows of ``width`` members, from the top left; a last row that is not full stands in the middle."""
    points: list[Point] = []
    for i in range(count):
        row, column = divmod(i, width)
        missing = width - min(width, count - row * width)
        points.append(((column + missing / 2) * spacing, row * spacing))
    return points


def ring(count: int, spacing: float) -> list[Point]:
    """Round a circle, clockwise, the first at the top; neighbours are ``spacing`` apart."""
    radius = spacing / (2 * turn(0.5 / count)[1])
    points: list[Point] = []
    for i in range(count):
        cosine, sine = turn(i / count)
        points.append((radius * sine, -radius * cosine))
    return points


def arc(count: int, spacing: float) -> list[Point]:
    """Over the upper half of a circle, from left to right; neighbours are ``spacing`` apart."""
    radius = spacing / (2 * turn(0.25 / (count - 1))[1])
    points: list[Point] = []
    for i in range(count):
        cosine, sine = turn(0.5 * i / (count - 1))
        points.append((-radius * cosine, -radius * sine))
    return points


def _centred(points: list[Point]) -> list[Point]:
    xs, ys = [x for x, _ in points], [y for _, y in points]
    middle = ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2)
    return [(snap(x - middle[0]), snap(y - middle[1])) for x, y in points]
