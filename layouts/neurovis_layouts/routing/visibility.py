"""Visibility: which corners of frames see each other, computed once for many searches.

In: corners, each a place and to which sides it points, rectangles. Out: from one corner to all others how far they are,
which lines run along both corners, and which rectangles stand between.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_layouts.routing.walls import meet
from neurovis_spec.layout import BoolArray, FloatArray, IntArray

Words: TypeAlias = npt.NDArray[np.uint64]

#: With more rectangles than this too much would have to be remembered.
MOST = 128


class Sight:
    """Views from corners (n, 4) among rectangles (f, 4)."""

    def __init__(self, corners: FloatArray, rects: FloatArray) -> None:
        self._points, self._sides, self._rects = corners[:, :2], corners[:, 2:], rects
        # from each corner that was asked for: how far all are, and what is in the way to them
        count = len(corners) if len(rects) <= MOST else 0
        self._known = np.zeros(count, dtype=np.bool_)
        self._far: FloatArray = np.zeros((count, count))
        self._entered = np.zeros((count, count, -(-len(rects) // 64)), dtype=np.uint64)

    def views(self, corners: IntArray, among: BoolArray) -> tuple[FloatArray, BoolArray]:
        """(k, k) how far these corners are from each other, and whether a line from one to another runs along both
        and enters none of the rectangles ``among`` (f,) all, of which there is one at least."""
        for corner in corners[~self._known[corners]].tolist():
            self._look(corner)
        square = np.ix_(corners, corners)
        mask = _words(among[None, :])[0]
        entered = np.bitwise_or.reduce(self._entered[square] & mask, axis=2)
        return self._far[square], entered == 0

    def _look(self, corner: int) -> None:
        here = np.repeat(self._points[corner][None, :], len(self._points), axis=0)
        way = self._points - here
        along = runs_along(way, self._sides) & runs_along(way, self._sides[corner])
        # what does not run along is as good as entering all
        entered = np.ones((len(way), len(self._rects)), dtype=np.bool_)
        entered[along] = meet(here[along], self._points[along], self._rects)
        self._far[corner], self._entered[corner] = lengths(way), _words(entered)
        self._known[corner] = True


def _words(bits: BoolArray) -> Words:
    """(n, f) bits as words (n, w)."""
    padded = np.zeros((len(bits), -(-bits.shape[1] // 64) * 64), dtype=np.bool_)
    padded[:, : bits.shape[1]] = bits
    return np.packbits(padded, axis=1).view(np.uint64)


def runs_along(way: FloatArray, sides: FloatArray) -> BoolArray:
    """Whether a line runs along a corner, as a taut string does: neither to it from the front nor through it."""
    (x, y), least = (way * sides).T, 1e-9
    along: BoolArray = ~(((x > least) & (y > least)) | ((x < -least) & (y < -least)))
    return along


def lengths(way: FloatArray) -> FloatArray:
    """(n,) how long lines (n, 2) are."""
    x, y = way.T
    far: FloatArray = np.sqrt(x * x + y * y)
    return far
