"""Levels: a network made smaller and smaller by joining what hangs together most.

In: a Wiring. Out: the wirings from fine to coarse, each with who became part of whom. Neighbours are joined in pairs,
the heaviest links first, all at once by sorting (Karypis and Kumar 1998: heavy-edge matching); whoever finds all
neighbours taken joins the nearest pair, so that stars shrink, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_layouts.wiring import Wiring, linked, summed
from neurovis_spec.layout import FloatArray, IntArray

_COARSEST = 30
#: A level that saves less than this is not worth it.
_WORTH = 0.95
_TRIES = 6


@dataclass(frozen=True, slots=True)
class Level:
    """A wiring, and for each of its points the point of the next coarser level that it is part of."""

    wiring: Wiring
    part_of: IntArray


def levels_of(wiring: Wiring) -> tuple[list[Level], Wiring]:
    """The levels from the finest on, and the coarsest wiring."""
    levels: list[Level] = []
    while wiring.count > _COARSEST:
        part_of = _joined(wiring)
        count = int(part_of.max()) + 1
        if count > _WORTH * wiring.count:
            break
        levels.append(Level(wiring, part_of))
        wiring = _coarser(wiring, part_of, count)
    return levels, wiring


def _coarser(wiring: Wiring, part_of: IntArray, count: int) -> Wiring:
    a, b, weight = linked(count, part_of[wiring.a], part_of[wiring.b], wiring.weight)
    above, below, pull = summed(count, part_of[wiring.above], part_of[wiring.below], wiring.pull)
    mass: FloatArray = np.bincount(part_of, wiring.mass, count).astype(np.float64)
    return Wiring(count, mass, a, b, weight, above, below, pull)


def _joined(wiring: Wiring) -> IntArray:
    """(count,) numbers of the pairs (and of those that joined one)."""
    count, a, b = wiring.count, wiring.a, wiring.b
    score = wiring.weight / np.sqrt(wiring.mass[a] * wiring.mass[b])
    # equal links must not all wait for their neighbour: a little noise, the same every time
    score = score * (1 + (a * 7919 + b * 104729) % 10007 / 1e10)
    head = np.arange(count, dtype=np.int64)
    free = np.ones(count, dtype=np.bool_)
    for _ in range(_TRIES):
        open_ones = free[a] & free[b]
        if not open_ones.any():
            break
        pick = _best(count, a[open_ones], b[open_ones], score[open_ones])
        has = np.flatnonzero(pick >= 0)
        lead = has[(pick[pick[has]] == has) & (has < pick[has])]
        head[pick[lead]] = lead
        free[lead] = free[pick[lead]] = False
    pick = _best(count, a, b, score)
    late = np.flatnonzero(free & (pick >= 0))
    late = late[~free[pick[late]]]
    head[late] = head[pick[late]]
    return np.unique(head, return_inverse=True)[1].astype(np.int64)


def _best(count: int, a: IntArray, b: IntArray, score: FloatArray) -> IntArray:
    """(count,) each point's neighbour over the heaviest link, −1 without any."""
    ones, others = np.concatenate([a, b]), np.concatenate([b, a])
    order = np.lexsort((np.concatenate([score, score]), ones))
    ones, others = ones[order], others[order]
    last = np.flatnonzero(np.diff(ones, append=-1) != 0)
    best = np.full(count, -1, dtype=np.int64)
    best[ones[last]] = others[last]
    return best
