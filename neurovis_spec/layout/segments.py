"""Segments: where straight lines cross, for many at once.

In: their ends, as arrays of equal shapes, or of shapes that broadcast. Out: which of them cross, and where.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray


def meet(
    ax: FloatArray, ay: FloatArray, ux: FloatArray, uy: FloatArray,
    bx: FloatArray, by: FloatArray, vx: FloatArray, vy: FloatArray,
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:  # fmt: skip
    """Whether segments a to a + u and b to b + v cross (half-open, so that a corner counts once; parallel ones never
    do), and for those that do, at what share of u: the shares of these alone, and the whole answer."""
    bx, by = bx - ax, by - ay
    cross = ux * vy - uy * vx
    sign, whole = np.sign(cross), np.abs(cross)
    s, t = sign * (bx * vy - by * vx), sign * (bx * uy - by * ux)
    hit = (s >= 0) & (s < whole) & (t >= 0) & (t < whole)
    return s[hit] / whole[hit], hit
