"""Flow: what runs from one loop to another runs along the direction.

In: a wiring, or heights and the arcs that are to run down. Out: how far down each point is by its arcs alone, which is
how long long chains have to be; heights near given ones by which all arcs run down.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from neurovis_layouts.wiring import Wiring, parts_of
from neurovis_spec.layout import FloatArray, IntArray

#: Heights are evened out in so many rounds: what has one source ends up a step below it.
_ROUNDS = 50


def heights(wiring: Wiring) -> FloatArray:
    """(count,) how far down each point is, in steps, of which an arc takes about one; all of a loop are at one height;
    0 in the mean."""
    # links that are no arcs join the members of a loop
    arc = np.isin(
        wiring.a * np.int64(wiring.count) + wiring.b,
        np.minimum(wiring.above, wiring.below) * np.int64(wiring.count) + np.maximum(wiring.above, wiring.below),
    )
    within = ~arc & (wiring.b < wiring.neurons)
    loop = parts_of(wiring.count, wiring.a[within], wiring.b[within])
    count = int(loop.max(initial=-1)) + 1
    above, below, pull = loop[wiring.above], loop[wiring.below], wiring.pull
    high = _downwards(np.zeros(count), downward(count, above, below), 1.0)
    held = np.bincount(above, pull, count) + np.bincount(below, pull, count)
    for _ in range(_ROUNDS):
        wish = np.bincount(below, pull * (high[above] + 1), count) + np.bincount(above, pull * (high[below] - 1), count)
        high = np.where(held > 0, (high + wish / np.maximum(held, 1e-9)) / 2, high)
    found: FloatArray = high[loop]
    hubs = wiring.b >= wiring.neurons
    spokes = np.bincount(wiring.b[hubs], minlength=wiring.count)
    around = np.bincount(wiring.b[hubs], found[wiring.a[hubs]], wiring.count) / np.maximum(spokes, 1)
    found = np.where(spokes > 0, around, found)
    return found - float(found.mean())


def downward(count: int, above: IntArray, below: IntArray) -> list[tuple[int, int]]:
    """The arcs (above, below), which close no ring, ordered: those into a point come before those out of it."""
    order = np.argsort(above, kind="stable")
    begin = np.searchsorted(above[order], np.arange(count + 1)).tolist()
    ends = below[order].tolist()
    waiting = np.bincount(below, minlength=count).tolist()
    ready = deque(i for i in range(count) if not waiting[i])
    arcs: list[tuple[int, int]] = []
    while ready:
        one = ready.popleft()
        for other in ends[begin[one] : begin[one + 1]]:
            arcs.append((one, other))
            waiting[other] -= 1
            if not waiting[other]:
                ready.append(other)
    return arcs


def in_flow(high: FloatArray, arcs: list[tuple[int, int]], gap: float) -> FloatArray:
    """Heights (n,) near these, each arc's target ``gap`` below its source at least; ``arcs`` as ``downward`` has them.

    Targets may be pushed down as far as it takes, or sources pulled up: both do it, and so does their middle.
    """
    back = [(below, above) for above, below in reversed(arcs)]
    found: FloatArray = (_downwards(high, arcs, gap) - _downwards(-high, back, gap)) / 2
    return found


def _downwards(high: FloatArray, arcs: list[tuple[int, int]], gap: float) -> FloatArray:
    pushed = high.tolist()
    for above, below in arcs:
        if pushed[below] < pushed[above] + gap:
            pushed[below] = pushed[above] + gap
    return np.array(pushed, dtype=np.float64)
