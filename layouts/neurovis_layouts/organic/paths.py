"""Paths: how far neurons are from each other in the network.

In: links. Out: for every pair the number of links on the shortest way between them; pairs between which there is none
are a little farther apart than any others.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_spec.layout import FloatArray, IntArray


def distances(count: int, a: IntArray, b: IntArray) -> FloatArray:
    """(count, count) shortest ways along links without direction, all sources at once, breadth first."""
    ones, others = np.concatenate([a, b]), np.concatenate([b, a])
    order = np.argsort(ones, kind="stable")
    ones, others = ones[order], others[order]
    begin = np.searchsorted(ones, np.arange(count))
    degree = np.searchsorted(ones, np.arange(count), side="right") - begin
    far: npt.NDArray[np.int64] = np.full(count * count, -1, dtype=np.int64)
    source = node = np.arange(count, dtype=np.int64)
    far[source * count + node] = 0
    step = 0
    while len(node):
        step += 1
        counts = degree[node]
        first = np.repeat(begin[node] - (np.cumsum(counts) - counts), counts)
        reached = np.repeat(source, counts) * count + others[first + np.arange(len(first))]
        reached = np.unique(reached[far[reached] < 0])
        far[reached] = step
        source, node = reached // count, reached % count
    ways = far.reshape(count, count).astype(np.float64)
    ways[ways < 0] = ways.max(initial=0) + 1
    return ways
