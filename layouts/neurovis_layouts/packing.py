"""Packing: drawings of parts that nothing connects, side by side.

In: the extents of the parts. Out: where the corner of each comes: in rows, the highest first, about as wide as high in
all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from neurovis_spec.layout.model import Point


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
