"""Spikes in NumPy: what the code of a step calls to visit the connections of what has fired, in place of all.

In: the rows of some connections. Out: which connections spikes have come to, and their sums, each in the order of its
connections.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.runtime.events import Rows


class Arriving(NamedTuple):
    """What brings spikes to a port, by rows: of each connection, in the order of these, its index, what it takes, its
    neuron, and what its signal is multiplied by."""

    rows: Rows
    connections: Indices
    ends: IntArray
    slots: Indices
    factors: FloatArray | None
    #: where each has slots of its own, these; None where it weighs on arrival what was sent
    offsets: Indices | None
    delays: IntArray
    #: what was sent before never arrives; None where nothing is lost
    lost: IntArray | None
    in_order: bool
    neurons: int


def fired(rows: Rows, k: int, history: FloatArray, sent: FloatArray | None = None) -> IntArray:
    """The rows whose ends fired as many steps ago as they say; of what is ``sent`` now, if it is given."""
    found = []
    for number, ago in enumerate(rows.delays.tolist()):
        first, stop = rows.firsts[number : number + 2].tolist()
        values = history[(k - ago) % len(history)] if sent is None else sent
        found.append(first + np.flatnonzero(values[rows.ends[first:stop]]))
    return np.concatenate(found)


def of_rows(rows: Rows, which: IntArray) -> IntArray:
    """Where the connections of some rows stand in their order."""
    begins, counts = rows.starts[which], rows.starts[which + 1] - rows.starts[which]
    before = np.cumsum(counts) - counts
    return np.repeat(begins - before, counts) + np.arange(int(counts.sum()))


def come_to(rows: Rows, k: int, history: FloatArray, sent: FloatArray | None = None) -> Indices:
    """Which of the connections spikes have come to."""
    return np.asarray(rows.order[of_rows(rows, fired(rows, k, history, sent))], dtype=np.int64)


def sums(
    of: Arriving,
    k: int,
    history: FloatArray,
    weights: FloatArray,
    signals: FloatArray,
    sent: FloatArray | None = None,
) -> FloatArray:
    """What spikes bring to each neuron of a population at a port: of those that are ``sent`` now, if these are given,
    else of those that were sent by the delays ago."""
    at = of_rows(of.rows, fired(of.rows, k, history, sent))
    if not of.in_order:
        at = at[np.argsort(of.rows.order[at], kind="stable")]
    ago = of.delays[at]
    if of.offsets is None:
        ends = of.ends[at]
        values = weights[of.connections[at]] * (history[(k - ago) % len(history), ends] if sent is None else sent[ends])
        if of.lost is not None:
            values = np.where(k - ago < of.lost[at], 0.0, values)
    else:
        values = signals[of.offsets[at] + k % ago]
    if of.factors is not None:
        values = values * of.factors[at]
    return np.asarray(np.bincount(of.slots[at], values, of.neurons), dtype=np.float64)
