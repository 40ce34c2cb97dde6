"""Levels: a network made smaller and smaller by joining what hangs together most.

In: a Wiring. Out: the wirings from fine to coarse, each with who became part of whom. Neighbours are joined in pairs,
the heaviest links first, all at once by sorting (Karypis and Kumar 1998: heavy-edge matching); whoever finds all
neighbours taken joins the nearest pair, so that stars shrink, too. The images of two are joined as these are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_layouts.wiring import Wiring, linked, summed
from neurovis_spec.layout import FloatArray, IntArray

#: Parts of so few points are not made smaller.
COARSEST = 30
#: A level that saves less than this is not worth it.
_WORTH = 0.95
#: So often pairs are looked for among those that have none yet.
_TRIES = 6


@dataclass(frozen=True, slots=True)
class Level:
    """A wiring, and for each of its points the point of the next coarser level that it is part of."""

    wiring: Wiring
    part_of: IntArray


def levels_of(wiring: Wiring) -> tuple[list[Level], Wiring]:
    """The levels from the finest on, and the coarsest wiring."""
    levels: list[Level] = []
    while wiring.count > COARSEST:
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
    image = np.arange(count)
    image[part_of] = part_of[wiring.image]
    return Wiring(count, mass, a, b, weight, above, below, pull, image)


def _joined(wiring: Wiring) -> IntArray:
    """(count,) numbers of the pairs (and of those that joined one)."""
    count, image = wiring.count, wiring.image
    paired = image != np.arange(count)
    distinct = image[wiring.a] != wiring.b  # an image is never joined with its own
    a, b = wiring.a[distinct], wiring.b[distinct]
    score = wiring.weight[distinct] / np.sqrt(wiring.mass[a] * wiring.mass[b])
    # equal links must not all wait for their neighbour: a little noise, the same every time, and for images
    ends = ((a, b), (image[a], image[b]))
    keys = [7919 * np.minimum(one, other) + 104729 * np.maximum(one, other) for one, other in ends]
    score = score * (1 + np.minimum(*keys) % 10007 / 1e10)
    head = np.arange(count, dtype=np.int64)
    free = np.ones(count, dtype=np.bool_)
    for _ in range(_TRIES):
        open_ones = free[a] & free[b] & (paired[a] == paired[b])
        if not open_ones.any():
            break
        pick = _best(count, a[open_ones], b[open_ones], score[open_ones])
        has = np.flatnonzero(pick >= 0)
        lead = has[(pick[pick[has]] == has) & (has < pick[has]) & (pick[image[has]] == image[pick[has]])]
        head[pick[lead]] = lead
        free[lead] = free[pick[lead]] = False
    pick = _best(count, a, b, score)
    late = np.flatnonzero(free & (pick >= 0))
    late = late[~free[pick[late]] | (paired[late] & ~paired[pick[late]])]
    late = late[pick[image[late]] == image[pick[late]]]
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
