"""Patterns of nearness: the nearest targets, and bands.

In: the Ends. Out: pairs, row by row. Nothing is drawn.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.compiler.ends import Ends, Pairs
from neurovis_spec.compiler.network import FloatArray, IntArray

#: Distances held at once.
_CELLS = 1 << 22


def nearest(ends: Ends, count: int) -> Pairs:
    """Every source with its ``count`` nearest targets, by position, or, where no neuron has one, by |i − j|. Of targets
    equally far the first ones are taken; a source's own neuron is left out, if it may not connect to itself."""
    n, m = len(ends.sources), len(ends.targets)
    placed = np.isfinite(ends.source_places).all() and len(ends.source_places) == n
    excluded = ends.excluded()
    # Without positions the nearest lie in a window around i, or at the end of the shorter end.
    width = m if placed else min(m, 2 * count + 3)
    sources, targets = _comparable(ends) if placed else (ends.source_places, ends.target_places)
    found: list[IntArray] = []
    together = max(1, _CELLS // width)
    for start in range(0, n, together):
        rows = np.arange(start, min(start + together, n), dtype=np.int64)
        if placed:
            columns = np.broadcast_to(np.arange(m, dtype=np.int64), (len(rows), m))
            apart = np.zeros((len(rows), m))
            for axis in range(2):  # squares and a sum are the same everywhere; a root need not be
                apart += (sources[rows, axis, None] - targets[:, axis]) ** 2
        else:
            columns = np.clip(rows - count - 1, 0, m - width)[:, None] + np.arange(width)
            apart = np.abs(rows[:, None] - columns).astype(np.float64)
        apart[columns == excluded[rows, None]] = np.inf
        found.append(columns[_least(apart, count)])
    return np.repeat(np.arange(n, dtype=np.int64), count), np.concatenate(found)


def _least(apart: FloatArray, count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Which are the ``count`` least numbers of every row; of equal ones the first."""
    limit = np.partition(apart, count - 1, axis=1)[:, count - 1, None]
    less, equal = apart < limit, apart == limit
    wanted = count - np.count_nonzero(less, axis=1)
    taken: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = less | (
        equal & (np.cumsum(equal, axis=1) <= wanted[:, None])
    )
    return taken


def _comparable(ends: Ends) -> tuple[FloatArray, FloatArray]:
    """The positions, brought by a power of two to a size whose squares are numbers."""
    most = max(float(np.abs(ends.source_places).max()), float(np.abs(ends.target_places).max()))
    power = -int(np.frexp(most)[1])
    return np.ldexp(ends.source_places, power), np.ldexp(ends.target_places, power)


def in_band(n: int, m: int, width: int) -> int:
    """How many pairs of n sources and m targets have |i − j| ≤ width."""
    i = np.arange(n, dtype=np.int64)
    return int(np.maximum(0, np.minimum(m, i + width + 1) - np.maximum(0, i - width)).sum())


def band(ends: Ends, width: int) -> Pairs:
    """All pairs with |i − j| ≤ width."""
    n, m = len(ends.sources), len(ends.targets)
    i = np.arange(n, dtype=np.int64)
    first = np.maximum(0, i - width)
    sizes = np.maximum(0, np.minimum(m, i + width + 1) - first)
    rows = np.repeat(i, sizes)
    columns = np.arange(len(rows)) - np.repeat(np.cumsum(sizes) - sizes, sizes) + np.repeat(first, sizes)
    return ends.pairs(rows, columns)
