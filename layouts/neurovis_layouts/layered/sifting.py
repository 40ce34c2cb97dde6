"""Sifting: every node of a rank to the place where it has the fewest crossings, until none gains by moving.

In: for each two nodes of a rank what it costs that one stands before the other (``Segments.differences``), and their
order. Out: a better order. After Matuszewski, Schönfeld and Molitor (1999); all moves are weighed in one matrix, and
the best ones that do not overlap are made together.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.crossings import Ints

#: What it costs to take a neuron past one of its own group: more than any crossings.
HELD = 1 << 40


def sifted(costs: Ints, order: Ints) -> tuple[Ints, int]:
    """The order after moves of single nodes, and how many crossings that saved.

    >>> costs = np.array([[0, 1, 1], [-1, 0, -1], [-1, 1, 0]])
    >>> sifted(costs, np.array([0, 1, 2]))
    (array([1, 2, 0]), 2)
    """
    saved, count = 0, len(order)
    if count < 2:
        return order, 0
    at = np.arange(count)
    ahead = at[:, None] <= at
    line, here = order, costs[order].take(order, axis=1)
    while True:
        # (i, j): what the i-th has with those up to the j-th, itself among them; with those it passes if it goes there
        sums = np.cumsum(here, axis=1)
        passed = sums - here
        np.copyto(passed, sums, where=ahead)
        best = passed.argmax(axis=1)
        gain = passed[at, best] - sums.diagonal()
        better = np.flatnonzero(gain > 0)
        if not len(better):
            return line, saved
        better = better[np.argsort(-gain[better], kind="stable")]
        places, taken = list(range(count)), bytearray(count)
        for i, j, gained in zip(better.tolist(), best[better].tolist(), gain[better].tolist(), strict=True):
            first, last = min(i, j), max(i, j)
            if taken.find(1, first, last + 1) < 0:
                taken[first : last + 1] = b"\1" * (last + 1 - first)
                saved += gained
                places.insert(j, places.pop(i))
        moved = np.array(places, dtype=np.int64)
        line, here = line[moved], here[moved].take(moved, axis=1)


def sifted_in_boxes(costs: Ints, order: Ints, boxes: Ints) -> tuple[Ints, int]:
    """The same where nodes of a box stand together: the boxes among the others, then each within. ``boxes`` is by node,
    less than 0 for those in none."""
    runs: list[list[int]] = []
    for node in order.tolist():
        if runs and boxes[node] >= 0 and boxes[runs[-1][-1]] == boxes[node]:
            runs[-1].append(node)
        else:
            runs.append([node])
    member: npt.NDArray[np.int64] = np.zeros((len(runs), len(boxes)), dtype=np.int64)
    for i, run in enumerate(runs):
        member[i, run] = 1
    outer, saved = sifted(member @ costs @ member.T, np.arange(len(runs), dtype=np.int64))
    result: list[int] = []
    for i in outer.tolist():
        inner, gain = sifted(costs, np.array(runs[i], dtype=np.int64))
        saved += gain
        result += inner.tolist()
    return np.array(result, dtype=np.int64), saved
