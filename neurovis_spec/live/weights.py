"""Weights: between which numbers the page offers to set the weight of a connection by hand.

In: a network as it is drawn. Out: ranges, each of several connections, and which of them each line has. A line that
stands for several connections has none: one number would be given to all of these.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.scene.collapse import Gathered

#: What a line has that stands for several connections.
NO_RANGE = -1


def ranges_of(drawn: Gathered) -> dict[str, object]:
    """The ``ranges``: the bounds of the weights, None where there is none, and the largest weight of the entry that the
    connection is written in, to which a slider goes in their place; and of each line (``ranged``) the number of its
    range."""
    connections = drawn.whole.connections
    weights = np.abs(connections.weights.whole())
    largest = np.zeros(len(connections.entries))
    entry = connections.entry.whole()
    np.maximum.at(largest, entry, np.where(np.isfinite(weights), weights, 0.0))
    single = np.flatnonzero(np.isin(drawn.bundle, np.flatnonzero(drawn.counts == 1)))
    bounds: tuple[FloatArray, ...] = connections.low[single], connections.high[single], largest[entry[single]]
    found, which = np.unique(np.column_stack(bounds), axis=0, return_inverse=True)
    ranged = np.full(len(drawn.counts), NO_RANGE, np.int64)
    ranged[drawn.bundle[single]] = which.reshape(-1)
    return {
        "ranges": [[_bound(low), _bound(high), largest or 1.0] for low, high, largest in found.tolist()],
        "ranged": ranged.tolist(),
    }


def _bound(value: float) -> float | None:
    return value if np.isfinite(value) else None
