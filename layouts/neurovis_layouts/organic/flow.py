"""Flow: what runs from one loop to another runs along the direction.

In: heights and the arcs that are to run down. Out: heights near these by which all of them do.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from neurovis_spec.layout import FloatArray, IntArray


def in_flow(high: FloatArray, above: IntArray, below: IntArray, gap: float) -> FloatArray:
    """Heights (n,) near these by which each of ``below`` is ``gap`` under its ``above`` at least; where arcs close a
    ring, as mirror images may, one of them gives way.

    Targets may be pushed down as far as it takes, or sources pulled up: both do it, and so does their middle.
    """
    arcs = _downward(high, above, below)
    back = [(below, above) for above, below in reversed(arcs)]
    found: FloatArray = (_pushed(high, arcs, gap) - _pushed(-high, back, gap)) / 2
    return found


def _downward(high: FloatArray, above: IntArray, below: IntArray) -> list[tuple[int, int]]:
    """The arcs (above, below), ordered: those into a point come before those out of it. A ring begins with its highest
    point, to which none of them leads."""
    count, order = len(high), np.argsort(above, kind="stable")
    begin = np.searchsorted(above[order], np.arange(count + 1)).tolist()
    ends = below[order].tolist()
    waiting = np.bincount(below, minlength=count).tolist()
    ready = deque(i for i in range(count) if not waiting[i])
    rings = iter(np.argsort(high, kind="stable").tolist())
    arcs: list[tuple[int, int]] = []
    while ready or (one := next((i for i in rings if waiting[i]), -1)) >= 0:
        if ready:
            one = ready.popleft()
        waiting[one] = 0
        for other in ends[begin[one] : begin[one + 1]]:
            if waiting[other]:
                arcs.append((one, other))
                waiting[other] -= 1
                if not waiting[other]:
                    ready.append(other)
    return arcs


def _pushed(high: FloatArray, arcs: list[tuple[int, int]], gap: float) -> FloatArray:
    pushed = high.tolist()
    for above, below in arcs:
        if pushed[below] < pushed[above] + gap:
            pushed[below] = pushed[above] + gap
    return np.array(pushed, dtype=np.float64)
