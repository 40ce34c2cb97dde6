"""Lines: what is drawn already, and where it passes each height, for ways that are to cross little of it.

In: lines as points. Out: for two heights, where every line that passes both passes them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from neurovis_layouts.routing.walls import FloatArray
from neurovis_spec.layout.model import Point

_NOWHERE = (np.array([np.inf, -np.inf]), np.zeros(2))


class Lines:
    """Lines, cut where they turn back."""

    def __init__(self) -> None:
        self._runs: list[tuple[FloatArray, FloatArray]] = []
        self._at: dict[float, FloatArray] = {}

    def add(self, line: Sequence[Point]) -> range:
        """Note a line; the numbers of its runs, which go one way."""
        first = len(self._runs)
        run: list[Point] = list(line[:1])
        for (_, before), point in pairwise(line):
            if len(run) > 1 and (point[1] - before) * (run[-1][1] - run[0][1]) < 0:
                self._note(run)
                run = run[-1:]
            run.append(point)
        self._note(run)
        return range(first, len(self._runs))

    def drop(self, runs: Iterable[int]) -> None:
        """Forget runs."""
        for run in runs:
            self._runs[run] = _NOWHERE
            for known in self._at.values():
                known[run : run + 1] = np.nan

    def _note(self, run: Sequence[Point]) -> None:
        found = np.array(run if run[0][1] <= run[-1][1] else run[::-1], dtype=np.float64)
        if found[0, 1] < found[-1, 1]:
            self._runs.append((found[:, 1].copy(), found[:, 0].copy()))

    def between(self, top: float, bottom: float) -> tuple[FloatArray, FloatArray]:
        """Where the lines that pass two heights pass the first, and the second."""
        above, below = self._passing(top), self._passing(bottom)
        both = ~(np.isnan(above) | np.isnan(below))
        return above[both], below[both]

    def _passing(self, y: float) -> FloatArray:
        """Where each run passes a height; NaN where it does not."""
        known = self._at.get(y, np.zeros(0))
        if len(known) < len(self._runs):
            new = [np.interp(y, ys, xs) if ys[0] <= y <= ys[-1] else np.nan for ys, xs in self._runs[len(known) :]]
            known = self._at[y] = np.concatenate((known, np.array(new, dtype=np.float64)))
        return known


def crossed(a: FloatArray, b: FloatArray, lines: tuple[FloatArray, FloatArray]) -> FloatArray:
    """How many lines a step crosses, by where these pass both of its heights: (to b, from a).

    >>> crossed(np.array([0.0]), np.array([0.0, 2.0]), (np.array([1.0]), np.array([1.0]))).tolist()
    [[0.0], [1.0]]
    """
    left, right = a[:, None] < lines[0], b[:, None] < lines[1]
    total: FloatArray = (left[None, :, :] != right[:, None, :]).sum(axis=2).astype(np.float64)
    return total
