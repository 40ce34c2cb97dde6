"""Patterns of nearness: the nearest targets, and bands.

In: the Ends. Out: pairs, row by row. Nothing is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.connections.ends import Ends, Pairs

#: Most distances computed at once; bounds the memory.
_CELLS = 1 << 22
#: The fewest neurons in a leaf: the work on a leaf outweighs the call.
_LEAF = 32


def nearest(ends: Ends, counts: IntArray) -> Pairs:
    """Every source with as many of its nearest targets as its count says (n,), by position, or, where no neuron has
    one, by |i − j|. Of targets equally far the first ones are taken; a source's own neuron is left out, if it may not
    connect to itself."""
    n = len(ends.sources)
    placed = np.isfinite(ends.source_places).all() and len(ends.source_places) == n
    columns = _by_position(ends, counts) if placed else _by_index(ends, counts)
    return np.repeat(np.arange(n, dtype=np.int64), counts), columns


def _by_index(ends: Ends, counts: IntArray) -> IntArray:
    """The nearest by |i − j| lie in a window around i, or at the last targets where there are fewer targets than
    sources."""
    n, m = len(ends.sources), len(ends.targets)
    excluded, count = ends.excluded(), int(counts.max(initial=0))
    width = min(m, 2 * count + 3)  # i itself, and count + 1 on each side, as one may be excluded
    batches: list[IntArray] = []
    together = max(1, _CELLS // width)
    for start in range(0, n, together):
        rows = np.arange(start, min(start + together, n), dtype=np.int64)
        columns = np.clip(rows - count - 1, 0, m - width)[:, None] + np.arange(width)
        distances = np.abs(rows[:, None] - columns).astype(np.float64)
        distances[columns == excluded[rows, None]] = np.inf
        batches.append(columns[_is_among_least(distances, counts[rows])])
    return np.concatenate(batches)


def _by_position(ends: Ends, counts: IntArray) -> IntArray:
    """Sources and targets are split into the leaves of a k-d tree. For a leaf of sources the closest leaves of targets
    say how far the nearest can be; then only leaves whose boxes are within that reach are compared.

    A box is never further away than a neuron in it, also as computed: differences, squares and their sum are rounded
    in the same order, and rounding keeps an order. So the result is that of comparing all pairs.
    """
    sources, targets = _scaled_against_overflow(ends)
    excluded, m, largest = ends.excluded(), len(targets), int(counts.max(initial=0))
    size = max(_LEAF, 2 * largest, math.isqrt(m) // 16)
    leaves = _leaves(targets, size)
    lengths = np.array([len(leaf) for leaf in leaves])
    low, high = _boxes(targets, leaves)
    begins, result = np.cumsum(counts) - counts, np.empty(int(counts.sum()), dtype=np.int64)
    for rows in _leaves(sources, size):
        places, count = sources[rows], max(1, int(counts[rows].max()))
        # per axis the gap between the box of these sources and the box of each leaf of targets
        gaps = np.maximum(0.0, np.maximum(low - places.max(axis=0), places.min(axis=0) - high))
        squared_box_distances = _squared(gaps)
        order = np.argsort(squared_box_distances, kind="stable")
        # the closest leaves with count + 1 targets, as one may be the excluded own neuron
        enough = int(np.searchsorted(np.cumsum(lengths[order]), min(count + 1, m))) + 1
        candidates = np.concatenate([leaves[leaf] for leaf in order[:enough]])
        reach = max(
            float(np.partition(squared, count - 1, axis=1)[:, count - 1].max())
            for _, squared in _squared_distances(places, rows, targets, candidates, excluded)
        )
        columns = np.sort(np.concatenate([leaves[leaf] for leaf in np.flatnonzero(squared_box_distances <= reach)]))
        for batch, squared in _squared_distances(places, rows, targets, columns, excluded):
            taken = _is_among_least(squared, counts[batch])
            among = np.cumsum(taken, axis=1) - 1  # which of those of its source each is
            result[(begins[batch, None] + among)[taken]] = np.broadcast_to(columns, squared.shape)[taken]
    return result


def _squared_distances(
    places: FloatArray, rows: IntArray, targets: FloatArray, columns: IntArray, excluded: IntArray
) -> Iterator[tuple[IntArray, FloatArray]]:
    """Some of the rows at a time, and the squared distances from their places to the columns; ∞ for what is
    excluded."""
    together = max(1, _CELLS // len(columns))
    for start in range(0, len(rows), together):
        batch = rows[start : start + together]
        squared = _squared(places[start : start + together, None] - targets[columns])
        squared[columns == excluded[batch, None]] = np.inf
        yield batch, squared


def _squared(differences: FloatArray) -> FloatArray:
    """Squared lengths. Squares and a sum are the same on every machine; a root need not be."""
    result: FloatArray = differences[..., 0] ** 2 + differences[..., 1] ** 2
    for axis in range(2, differences.shape[-1]):
        result = result + differences[..., axis] ** 2
    return result


def _leaves(places: FloatArray, size: int) -> list[IntArray]:
    """The leaves of a k-d tree: the indices of places, split at the median of the wider axis until there are at most
    ``size``."""
    result: list[IntArray] = []
    waiting = [np.arange(len(places), dtype=np.int64)]
    while waiting:
        part = waiting.pop()
        if len(part) <= size:
            result.append(part)
            continue
        inside = places[part]
        axis = int(np.argmax(np.ptp(inside, axis=0)))
        half = len(part) // 2
        order = np.argpartition(inside[:, axis], half)
        waiting += [part[order[:half]], part[order[half:]]]
    return result


def _boxes(places: FloatArray, leaves: list[IntArray]) -> tuple[FloatArray, FloatArray]:
    """The lower and the upper corner of every leaf, (leaves, 2) each."""
    low = np.array([places[leaf].min(axis=0) for leaf in leaves])
    return low, np.array([places[leaf].max(axis=0) for leaf in leaves])


def _is_among_least(distances: FloatArray, counts: IntArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Whether each number is among the least of its row, of which there are ``counts`` (rows,); of equal ones the
    first are."""
    last = np.maximum(counts, 1) - 1
    limit = np.take_along_axis(np.partition(distances, np.unique(last), axis=1), last[:, None], axis=1)
    less, equal = distances < limit, distances == limit
    wanted = counts - np.count_nonzero(less, axis=1)
    taken: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = less | (
        equal & (np.cumsum(equal, axis=1) <= wanted[:, None])
    )
    return taken


def _scaled_against_overflow(ends: Ends) -> tuple[FloatArray, FloatArray]:
    """The positions, divided by a power of two (which rounds nothing) so that their squares are finite."""
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
    # for each row first, first + 1, …: the index of a pair, less that of the first pair of its row
    columns = np.arange(len(rows)) - np.repeat(np.cumsum(sizes) - sizes, sizes) + np.repeat(first, sizes)
    return ends.pairs(rows, columns)
