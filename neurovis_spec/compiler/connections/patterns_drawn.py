"""Patterns that draw a fixed number for each neuron: fixed degrees and small worlds.

In: the Ends and a Stream. Out: pairs, row by row. No row knows of another, and no number depends on how many rows are
made at once, so that the pairs depend on nothing but seed, names and sizes.

Both patterns draw from a row of *slots*, which change as they are drawn from. Writing a fresh row of slots for each
source would take as long as connecting it with all targets. So there is one table, a line of slots for each of some
rows, that is used again and again: who changes a cell puts it back, and a few draws among a million slots cost a few
steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.connections.ends import Ends, Pairs
from neurovis_spec.compiler.values.draws import Stream

#: Most cells of the table of slots; bounds the memory. The result does not depend on it.
_CELLS = 1 << 24


def fixed_outdegree(ends: Ends, counts: IntArray, stream: Stream, multapses: bool = False) -> Pairs:
    """Every source i with ``counts[i]`` targets of its own choice, each set of them equally likely.

    A partial shuffle (Fisher and Yates): the targets that i may have lie in slots 0 … m − 1, ascending; in round s the
    slot s + ⌊u·(m − s)⌋ is taken and what lay in slot s is put there. u is the uniform number of the counter
    (i, 0, 0, s). With ``multapses`` the slot ⌊u·m⌋ is taken, and stays as it is.
    """
    return _chosen_targets(ends, counts, lambda sources, rounds: stream.uniform(sources, 0, 0, rounds), multapses)


def fixed_indegree(ends: Ends, counts: IntArray, stream: Stream, multapses: bool = False) -> Pairs:
    """Every target j with ``counts[j]`` sources; as ``fixed_outdegree``, u is of the counter (0, j, 0, s)."""
    j, i = _chosen_targets(
        ends.reversed(), counts, lambda targets, rounds: stream.uniform(0, targets, 0, rounds), multapses
    )
    order = np.lexsort((j, i))  # by i, then by j
    return i[order], j[order]


def total(ends: Ends, count: int, stream: Stream, multapses: bool = False) -> Pairs:
    """``count`` of all pairs, each set of them equally likely.

    The M pairs that there may be lie in slots 0 … M − 1, row by row; the s-th choice is slot ⌊u·M⌋, u of the counter
    (0, 0, 0, s). The first ``count`` different choices are the pairs, or, of more than half of all, the first M −
    ``count`` those that are left out. With ``multapses`` the first ``count`` choices are the pairs, different or not.
    """
    excluded = ends.excluded()
    ends_of_rows = np.cumsum(len(ends.targets) - (excluded >= 0))
    slots = int(ends_of_rows[-1])
    if multapses:
        chosen = np.sort(_slot_index(stream.uniform(0, 0, 0, np.arange(count, dtype=np.int64)), slots))
    elif 2 * count <= slots:
        chosen = _different(count, slots, stream)
    else:
        chosen = np.delete(np.arange(slots, dtype=np.int64), _different(slots - count, slots, stream))
    i = np.searchsorted(ends_of_rows, chosen, side="right")
    j = chosen - np.concatenate(([0], ends_of_rows))[i]
    return i, j + ((excluded[i] >= 0) & (j >= excluded[i]))


def _different(count: int, slots: int, stream: Stream) -> IntArray:
    """The first ``count`` different slots that are drawn, ascending."""
    found, drawn = np.zeros(0, dtype=np.int64), 0
    while len(found) < count:
        numbers = np.arange(drawn, drawn + count + count // 2 + 16, dtype=np.int64)
        found = np.concatenate((found, _slot_index(stream.uniform(0, 0, 0, numbers), slots)))
        found = found[np.sort(np.unique(found, return_index=True)[1])]
        drawn += len(numbers)
    return np.sort(found[:count])


def small_world(ends: Ends, degree: int, rewire: float, stream: Stream) -> Pairs:
    """A ring whose neurons reach ``degree`` neighbours (an even number), some of these connections led elsewhere.

    Source i begins with the targets i + 1, i − 1, i + 2, … i − degree/2 around the ring. In this order each of them, j,
    is given up where the uniform number of the counter (i, j, 0, 0) is below ``rewire``, for one of the f targets that
    i does not have. These lie in slots: i + degree/2 + 1, … around the ring, and at last i itself where that is
    allowed. The slot ⌊u·f⌋ is taken, u of the counter (i, j, 0, 1), and j is put there. Source: Watts and Strogatz,
    Collective dynamics of 'small-world' networks (Nature 393, 1998); here of directed connections.
    """
    n, half = len(ends.sources), degree // 2
    ahead = np.arange(1, half + 1, dtype=np.int64)
    offsets = np.stack((ahead, -ahead), axis=1).ravel()
    # Slots hold offsets, what is to be added to i, so that they begin alike for every source.
    slots = np.arange(half + 1, n - half, dtype=np.int64)
    if ends.loops or not (ends.sources == ends.targets).any():
        slots = np.append(slots, 0)
    if not len(slots):
        rewire = 0.0
    batches: list[IntArray] = []
    for sources, table in _row_tables(n, slots, degree):
        reached_offsets = np.tile(offsets, (len(sources), 1))
        neighbours = (sources[:, None] + offsets) % n
        rewired = stream.uniform(sources[:, None], neighbours, 0, 0) < rewire
        drawn_slots = np.zeros_like(neighbours)
        if rewire:
            drawn_slots = _slot_index(stream.uniform(sources[:, None], neighbours, 0, 1), len(slots))
        for neighbour in range(degree):
            table_rows = np.flatnonzero(rewired[:, neighbour])
            drawn = drawn_slots[table_rows, neighbour]
            reached_offsets[table_rows, neighbour] = table[table_rows, drawn]
            table[table_rows, drawn] = offsets[neighbour]
        # put the table back
        changed = drawn_slots[rewired]
        table[np.nonzero(rewired)[0], changed] = slots[changed]
        batches.append(np.sort((sources[:, None] + reached_offsets) % n, axis=1))
    targets = np.concatenate(batches).ravel()
    return ends.pairs(np.repeat(np.arange(n, dtype=np.int64), degree), targets)


def _chosen_targets(
    ends: Ends, counts: IntArray, draw: Callable[[IntArray, IntArray], FloatArray], multapses: bool
) -> Pairs:
    """For every source so many targets, ascending; there are as many, unless they need not be different. ``draw`` gives
    the uniform numbers for sources and rounds."""
    n, slots, count = len(ends.sources), np.arange(len(ends.targets), dtype=np.int64), int(counts.max(initial=0))
    excluded = ends.excluded()
    batches: list[IntArray] = []
    for sources, table in _row_tables(n, slots, count):
        excluded_target = excluded[sources]  # −1: none
        allowed = len(slots) - (excluded_target >= 0)
        uniform = draw(sources[:, None], np.arange(count, dtype=np.int64))
        chosen = np.full((len(sources), count), len(slots), dtype=np.int64)  # behind all targets: none
        drawn_slots = np.zeros_like(chosen)
        for draw_round in range(count):
            rows = np.flatnonzero(counts[sources] > draw_round)
            taken = 0 if multapses else draw_round
            drawn = drawn_slots[rows, draw_round] = taken + _slot_index(
                uniform[rows, draw_round], allowed[rows] - taken
            )
            chosen[rows, draw_round] = table[rows, drawn]
            if not multapses:
                table[rows, drawn] = table[rows, draw_round]
        # put the table back: in a fresh row slot s holds s
        table[np.arange(len(sources))[:, None], drawn_slots] = drawn_slots
        # slots skip the excluded target, so those at or behind it are one too low
        chosen += (excluded_target >= 0)[:, None] & (chosen >= excluded_target[:, None])
        batches.append(np.sort(chosen, axis=1)[np.arange(count) < counts[sources, None]])
    return np.repeat(np.arange(n, dtype=np.int64), counts), np.concatenate(batches)


def _slot_index(uniform: FloatArray, slots: int | IntArray) -> IntArray:
    """⌊uniform · slots⌋, and below ``slots`` whatever rounding does."""
    index: IntArray = np.minimum(np.floor(uniform * slots).astype(np.int64), np.asarray(slots) - 1)
    return index


def _row_tables(n: int, slots: IntArray, drawn: int) -> Iterator[tuple[IntArray, IntArray]]:
    """The rows 0 … n − 1, some at a time, each time with the table: a line of ``slots`` for each of these rows, of
    which at most so many are ``drawn``. It is always the same memory, so who changes a cell puts it back."""
    rows_at_once = max(1, min(n, _CELLS // max(1, len(slots), drawn)))
    table = np.tile(slots, (rows_at_once, 1))
    for start in range(0, n, rows_at_once):
        rows = np.arange(start, min(start + rows_at_once, n), dtype=np.int64)
        yield rows, table[: len(rows)]
