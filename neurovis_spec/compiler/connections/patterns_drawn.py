"""Patterns that are drawn so many at a time: fixed degrees and small worlds.

In: the Ends and a Stream. Out: pairs, row by row. No row knows of another, and no number depends on how many rows are
made at once, so that the pairs depend on nothing but seed, names and sizes (§4, Randomness).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.connections.ends import Ends, Pairs
from neurovis_spec.compiler.values.draws import Stream

#: Cells of the table of slots, which bounds the memory; the result does not depend on it.
_CELLS = 1 << 24


def fixed_outdegree(ends: Ends, count: int, stream: Stream) -> Pairs:
    """Every source i with ``count`` targets of its own choice, each set of them equally likely.

    A partial shuffle (Fisher and Yates): the targets that i may have lie in slots 0 … m − 1, ascending; in round s the
    slot s + ⌊u·(m − s)⌋ is taken and what lay in slot s is put there. u is the uniform number of the counter
    (i, 0, 0, s).
    """
    return _chosen(ends, count, lambda rows, rounds: stream.uniform(rows, 0, 0, rounds))


def fixed_indegree(ends: Ends, count: int, stream: Stream) -> Pairs:
    """Every target j with ``count`` sources; as ``fixed_outdegree``, u is of the counter (0, j, 0, s)."""
    j, i = _chosen(ends.reversed(), count, lambda rows, rounds: stream.uniform(0, rows, 0, rounds))
    order = np.lexsort((j, i))
    return i[order], j[order]


def small_world(ends: Ends, degree: int, rewire: float, stream: Stream) -> Pairs:
    """A ring whose neurons reach ``degree`` neighbours, some of these connections led elsewhere.

    Source i begins with the targets i + 1, i − 1, i + 2, … i − degree/2 around the ring. In this order each of them, j,
    is given up where the uniform number of the counter (i, j, 0, 0) is below ``rewire``, for one of the f targets that
    i does not have. These lie in slots: i + degree/2 + 1, … around the ring, and at last i itself where that is
    allowed. The slot ⌊u·f⌋ is taken, u of the counter (i, j, 0, 1), and j is put there. Source: Watts and Strogatz,
    Collective dynamics of 'small-world' networks (Nature 393, 1998); here of directed connections.
    """
    n, half = len(ends.sources), degree // 2
    ahead = np.arange(1, half + 1, dtype=np.int64)
    offsets = np.stack((ahead, -ahead), axis=1).ravel()
    # Slots hold what is to be added to i, so that they begin alike for every source.
    slots = np.arange(half + 1, n - half, dtype=np.int64)
    if ends.loops or not (ends.sources == ends.targets).any():
        slots = np.append(slots, 0)
    if not len(slots):
        rewire = 0.0
    found: list[IntArray] = []
    for rows, table in _tables(n, slots):
        reached = np.tile(offsets, (len(rows), 1))
        first = (rows[:, None] + offsets) % n
        moved = stream.uniform(rows[:, None], first, 0, 0) < rewire
        places = _slot(stream.uniform(rows[:, None], first, 0, 1), len(slots)) if rewire else first
        for number in range(degree):
            row = np.flatnonzero(moved[:, number])
            place = places[row, number]
            reached[row, number] = table[row, place]
            table[row, place] = offsets[number]
        changed = places[moved]
        table[np.nonzero(moved)[0], changed] = slots[changed]
        found.append(np.sort((rows[:, None] + reached) % n, axis=1))
    targets = np.concatenate(found).ravel()
    return ends.pairs(np.repeat(np.arange(n, dtype=np.int64), degree), targets)


def _chosen(ends: Ends, count: int, draw: Callable[[IntArray, IntArray], FloatArray]) -> Pairs:
    """For every source ``count`` different targets, ascending; there are as many."""
    n, slots = len(ends.sources), np.arange(len(ends.targets), dtype=np.int64)
    excluded = ends.excluded()
    found: list[IntArray] = []
    for rows, table in _tables(n, slots):
        out = excluded[rows]
        room = len(slots) - (out >= 0)
        numbers = draw(rows[:, None], np.arange(count, dtype=np.int64))
        chosen = np.empty((len(rows), count), dtype=np.int64)
        places = np.empty_like(chosen)
        row = np.arange(len(rows))
        for number in range(count):
            place = places[:, number] = number + _slot(numbers[:, number], room - number)
            chosen[:, number] = table[row, place]
            table[row, place] = table[:, number]
        table[row[:, None], places] = places
        chosen += (out >= 0)[:, None] & (chosen >= out[:, None])  # those behind the one left out
        found.append(np.sort(chosen, axis=1))
    return np.repeat(np.arange(n, dtype=np.int64), count), np.concatenate(found).ravel()


def _slot(number: FloatArray, slots: int | IntArray) -> IntArray:
    """⌊number · slots⌋, and below ``slots`` whatever rounding does."""
    place: IntArray = np.minimum(np.floor(number * slots).astype(np.int64), np.asarray(slots) - 1)
    return place


def _tables(n: int, slots: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Stretches of the rows 0 … n − 1, each with a table of one line of ``slots`` for every row. It is always the same
    memory: who changes a cell puts it back. So a few draws among a million cost no million steps a row."""
    together = max(1, min(n, _CELLS // max(1, len(slots))))
    table = np.tile(slots, (together, 1))
    for start in range(0, n, together):
        rows = np.arange(start, min(start + together, n), dtype=np.int64)
        yield rows, table[: len(rows)]
