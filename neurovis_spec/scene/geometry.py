"""Cubic Bézier splines as arrays: sampled, bounded, and trimmed to the discs at their ends.

In: routes from centre to centre (1 + 3k points). Out: sample points, rectangles, and the part of a route between two
discs, again a cubic spline (de Casteljau). Routes with the same number of points are worked on together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, cubic
from neurovis_spec.layout.model import Point

_SAMPLES = 24


def sample(points: Sequence[Point] | FloatArray, per_segment: int = _SAMPLES) -> FloatArray:
    """Points on a spline, ``per_segment`` for each of its segments and its end: (k · per_segment + 1, 2)."""
    return samples([points], per_segment)[0]


def samples(splines: Sequence[Sequence[Point] | FloatArray], per_segment: int = _SAMPLES) -> list[FloatArray]:
    """The same of many splines."""
    result = [np.zeros((0, 2))] * len(splines)
    t = np.arange(per_segment) / per_segment
    for members, control in batches(splines):
        inner = cubic(_segments(control)[:, :, None], t).reshape(len(control), -1, 2)
        for index, dots in zip(members, np.concatenate([inner, control[:, -1:]], axis=1), strict=True):
            result[index] = dots
    return result


def batches(splines: Sequence[Sequence[Point] | FloatArray]) -> Iterator[tuple[list[int], FloatArray]]:
    """Splines with the same number of points together: their indices, and their points (m, 1 + 3k, 2)."""
    sizes: dict[int, list[int]] = {}
    for index, spline in enumerate(splines):
        sizes.setdefault(len(spline), []).append(index)
    for _, members in sorted(sizes.items()):
        yield members, np.array([splines[index] for index in members], float)


def _segments(control: FloatArray) -> FloatArray:
    """Splines (m, 1 + 3k, 2) as segments (m, k, 4, 2)."""
    return np.stack([control[:, 0:-1:3], control[:, 1::3], control[:, 2::3], control[:, 3::3]], axis=2)


def bounds(points: Iterable[FloatArray]) -> Rect | None:
    """The smallest rectangle around all points, None without any."""
    arrays = [array for array in points if len(array)]
    if not arrays:
        return None
    everything = np.concatenate(arrays)
    (x0, y0), (x1, y1) = everything.min(axis=0).tolist(), everything.max(axis=0).tolist()
    return x0, y0, x1, y1


def leaving(routes: FloatArray, radius: FloatArray | float) -> FloatArray:
    """Where routes (m, 1 + 3k, 2) leave the disc of this radius, one or (m,), around their first point: the parameter
    in 0…k.

    Half of the route where it never does. To find where routes arrive, give them reversed.
    """
    m, size, _ = routes.shape
    radii, k = np.broadcast_to(radius, (m,)), (size - 1) // 3
    segments = _segments(routes)
    steps = np.arange(1, 16 * k + 1) / 16
    segment = np.minimum(np.floor(steps).astype(int), k - 1)
    dots = cubic(segments[:, segment], np.broadcast_to(steps - segment, (m, len(steps))))
    outside = np.hypot(*np.moveaxis(dots - routes[:, :1], 2, 0)) >= radii[:, None]
    first = np.argmax(outside, axis=1)
    low, high = first / 16, (first + 1) / 16
    rows = np.arange(m)
    for _ in range(40):
        middle = (low + high) / 2
        part = np.minimum(np.floor(middle).astype(int), k - 1)
        at = cubic(segments[rows, part], middle - part)
        out = np.hypot(*(at - routes[:, 0]).T) >= radii
        low, high = np.where(out, low, middle), np.where(out, middle, high)
    result: FloatArray = np.where(outside.any(axis=1), high, k / 2)
    return result


def between(points: Sequence[Point], start: float, end: float) -> tuple[Point, ...]:
    """The part of a spline from parameter ``start`` to ``end`` (0…k), as a spline."""
    k = (len(points) - 1) // 3
    first, last = min(int(start), k - 1), min(int(end), k - 1)
    result: list[Point] = []
    for segment in range(first, last + 1):
        piece = [points[3 * segment + place] for place in range(4)]
        low = start - segment if segment == first else 0.0
        high = end - segment if segment == last else 1.0
        cut = _cut(piece, low, high)
        result.extend(cut if not result else cut[1:])
    return tuple(result)


def between_all(curves: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """The same of single cubics (m, 4, 2), each from and to parameters of its own (m,)."""

    def blossom(*parameters: FloatArray) -> FloatArray:
        row = [curves[:, place] for place in range(4)]
        for t in parameters:
            row = [p + t[:, None] * (q - p) for p, q in pairwise(row)]
        return row[0]

    corners = [(start, start, start), (start, start, end), (start, end, end), (end, end, end)]
    return np.stack([blossom(*corner) for corner in corners], axis=1)


def _cut(piece: Sequence[Point], low: float, high: float) -> list[Point]:
    """One cubic between two parameters: its polar form (blossom)."""

    def blossom(a: float, b: float, c: float) -> Point:
        row = list(piece)
        for t in (a, b, c):
            row = [(p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])) for p, q in pairwise(row)]
        return row[0]

    return [blossom(low, low, low), blossom(low, low, high), blossom(low, high, high), blossom(high, high, high)]


def point_at(points: Sequence[Point], parameter: float) -> Point:
    """The point of a spline at a parameter in 0…k."""
    return between(points, parameter, parameter)[0]
