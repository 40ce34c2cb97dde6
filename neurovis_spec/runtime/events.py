"""Spikes that come to connections: which connections are those of whatever has fired.

In: what connections take of an end, and how many steps ago. Out: Rows. A step visits those alone whose end has fired,
in place of all connections.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Port


def takes_spikes(network: Network, port: Port) -> bool:
    """Whether spikes are all that comes to a port, and are added up there."""
    if port.combine != "sum" or not len(port.incoming) or not network.spikes.any():
        return False
    sources = network.connections.sources
    taken = sources.some(port.incoming) if network.sending is None else network.sending[port.incoming]
    return bool(network.spikes[taken].all() and (network.synapses.numbers[port.incoming] < 0).all())


def weights_stay(network: Network) -> BoolArray:
    """The connections (m,) whose weights nothing changes in a run."""
    result = np.asarray(network.connections.rules.compact() < 0)
    for binding in network.settable.bindings:
        if binding.weights:
            result[binding.indices] = False
    return result


class Rows(NamedTuple):
    """Connections by what they take and when: row r are ``order[starts[r] : starts[r + 1]]`` of them, ascending, whose
    end is ``ends[r]``; the rows of the i-th of the ``delays``, ascending, are those from ``firsts[i]`` on, up to
    ``firsts[i + 1]``."""

    delays: IntArray
    firsts: IntArray
    ends: IntArray
    starts: IntArray
    order: Indices


def rows_of(ends: IntArray, delays: IntArray) -> Rows:
    """The rows of some connections by their delays, then by their ends.

    >>> rows = rows_of(np.array([7, 3, 7]), np.array([1, 1, 2]))
    >>> rows.delays.tolist(), rows.firsts.tolist(), rows.ends.tolist(), rows.starts.tolist(), rows.order.tolist()
    ([1, 2], [0, 2, 3], [3, 7, 7], [0, 1, 2, 3], [1, 0, 2])
    """
    order = np.lexsort((ends, delays))  # which keeps the order of those that are alike
    sorted_ends, sorted_delays = ends[order], delays[order]
    new = np.flatnonzero((np.diff(sorted_ends, prepend=-1) != 0) | (np.diff(sorted_delays, prepend=-1) != 0))
    different = np.unique(delays)
    return Rows(
        different,
        np.append(np.searchsorted(sorted_delays[new], different), len(new)),
        sorted_ends[new],
        np.append(new, len(ends)),
        order,
    )


def in_order(rows: Rows, slots: Indices, connections: Indices) -> bool:
    """Whether what comes to each of the ``slots`` is in the order of its connections, row by row."""
    by_slot = np.argsort(slots[rows.order], kind="stable")
    same = np.diff(slots[rows.order][by_slot]) == 0
    return bool((np.diff(connections[rows.order][by_slot])[same] > 0).all())
