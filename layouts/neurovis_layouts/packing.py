"""Packing: drawings of parts that nothing connects, in the gaps of others or side by side.

In: what is drawn of a part, and how large another is. Out: a gap in it for the other. In: the extents of parts. Out:
where the corner of each comes: in rows, the highest first, about as wide as high in all. Both are what is left of
packing polyominoes (Freivalds, Dogrusoz and Kikusts 2002) where what is put into a gap is a rectangle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.model import Point

#: How fine the places are that are tried in a part.
_STEP = 0.5


def packed(sizes: Sequence[Point], gap: float) -> list[Point]:
    """The upper left corner of each part of these sizes (width, height), ``gap`` apart.

    >>> packed([(1.0, 1.0), (4.0, 3.0)], 1.0)
    [(0.0, 4.0), (0.0, 0.0)]
    """
    total = math.fsum((width + gap) * (height + gap) for width, height in sizes)
    most = max([math.sqrt(1.3 * total), *(width for width, _ in sizes)])
    corners: list[Point] = [(0.0, 0.0)] * len(sizes)
    x = y = high = 0.0
    for part in sorted(range(len(sizes)), key=lambda part: (-sizes[part][1], -sizes[part][0], part)):
        width, height = sizes[part]
        if x > 0 and x + width > most:
            x, y, high = 0.0, y + high + gap, 0.0
        corners[part] = (x, y)
        x, high = x + width + gap, max(high, height)
    return corners


def gap_in(pieces: FloatArray, size: Point, gap: float) -> Point | None:
    """The uppermost corner, of these the leftmost, at which a part of this size (width, height) is ``gap`` away from
    each of the ``pieces`` (n, 4) and does not reach beyond them all; None where there is none.

    >>> gap_in(np.array([[0.0, 0.0, 1.0, 6.0], [0.0, 5.0, 4.0, 6.0]]), (2.0, 2.0), 1.0)
    (2.0, 0.0)
    """
    low, high = pieces[:, :2].min(axis=0), pieces[:, 2:].max(axis=0)
    counts = np.floor((high - low - size) / _STEP).astype(np.int64) + 1
    if counts.min() < 1:
        return None
    first = np.floor((pieces[:, :2] - low - size - gap) / _STEP).astype(np.int64) + 1
    last = np.ceil((pieces[:, 2:] - low + gap) / _STEP).astype(np.int64)
    taken = np.zeros(counts + 1, dtype=np.int64)
    (x0, y0), (x1, y1) = (np.clip(corner, 0, counts).T for corner in (first, last))
    for x, y, sign in ((x0, y0, 1), (x1, y0, -1), (x0, y1, -1), (x1, y1, 1)):
        np.add.at(taken, (x, y), sign)
    y, x = np.nonzero(taken.cumsum(axis=0).cumsum(axis=1)[:-1, :-1].T == 0)
    return (float(low[0] + _STEP * x[0]), float(low[1] + _STEP * y[0])) if len(x) else None
