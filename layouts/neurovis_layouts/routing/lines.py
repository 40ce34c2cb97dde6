"""Lines that are drawn already, as a table of x by height, to count quickly what a new way would cross.

In: lines as points. Out: for two heights, the x of every line at both, of those lines that pass both.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.model import Point

#: How many heights and runs there is room for at first.
_FEW = 64


class CutLines:
    """Lines, cut where they turn back."""

    def __init__(self) -> None:
        #: of each run the heights, in order, and where it is there
        self._runs: list[tuple[FloatArray, FloatArray]] = []
        #: the row of the table that each height has; where each run (second index) passes it, NaN where it does not
        self._rows: dict[float, int] = {}
        self._heights: FloatArray = np.zeros(_FEW)
        self._table: FloatArray = np.full((_FEW, _FEW), np.nan)

    def add(self, line: Sequence[Point]) -> None:
        """Add a line: it is cut wherever it turns back up or down."""
        run: list[Point] = list(line[:1])
        for (_, before), point in pairwise(line):
            if len(run) > 1 and (point[1] - before) * (run[-1][1] - run[0][1]) < 0:
                self._note(run)
                run = run[-1:]
            run.append(point)
        self._note(run)

    def _note(self, run: Sequence[Point]) -> None:
        found = np.array(run if run[0][1] <= run[-1][1] else run[::-1], dtype=np.float64)
        if found[0, 1] < found[-1, 1]:
            number, known = len(self._runs), len(self._rows)
            if number == self._table.shape[1]:
                self._table = np.concatenate((self._table, np.full_like(self._table, np.nan)), axis=1)
            ys, xs = found[:, 1].copy(), found[:, 0].copy()
            self._runs.append((ys, xs))
            self._table[:known, number] = np.interp(self._heights[:known], ys, xs, np.nan, np.nan)

    def between(self, top: float, bottom: float) -> tuple[FloatArray, FloatArray]:
        """Where the lines that pass two heights pass the first, and the second."""
        if not self._runs:
            return np.zeros(0), np.zeros(0)
        above, below = self.passing((top, bottom))
        both = ~np.isnan(above + below)
        return above[both], below[both]

    def passing(self, heights: Sequence[float]) -> FloatArray:
        """(heights, runs) where each run passes each height; NaN where it does not."""
        rows = [self._row(y) for y in heights]
        passing: FloatArray = self._table[rows, : len(self._runs)]
        return passing

    def _row(self, y: float) -> int:
        """The row of the table for a height."""
        row = self._rows.get(y)
        if row is None:
            row = self._rows[y] = len(self._rows)
            if row == len(self._table):
                self._heights = np.concatenate((self._heights, np.zeros_like(self._heights)))
                self._table = np.concatenate((self._table, np.full_like(self._table, np.nan)))
            self._heights[row] = y
            for run, (ys, xs) in enumerate(self._runs):
                if ys[0] <= y <= ys[-1]:
                    self._table[row, run] = np.interp(y, ys, xs)
        return row


def crossed(a: FloatArray, b: FloatArray, lines: tuple[FloatArray, FloatArray]) -> FloatArray:
    """How many lines a step crosses, by where these pass both of its heights: (to b, from a).

    >>> crossed(np.array([0.0]), np.array([0.0, 2.0]), (np.array([1.0]), np.array([1.0]))).tolist()
    [[0.0], [1.0]]
    """
    left, right = a[:, None] < lines[0], b[:, None] < lines[1]
    # those that are right of either end, but for those that are so of both
    ones, others = left.sum(axis=1), right.sum(axis=1)
    both = right.astype(np.float32) @ left.astype(np.float32).T
    total: FloatArray = ones[None, :] + others[:, None] - 2.0 * both.astype(np.float64)
    return total
