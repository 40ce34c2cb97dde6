"""What is read of the past: ``pre`` and ``pre.v``, as they were at the source when that left which now reaches the
synapse; and which neurons fired then.

In: a Network. Out: how far back its activities are kept, and which connections look there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import Indices
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.stages import ends_of, taken_by


def history_depth(network: Network) -> int:
    """Rows of the history: a[t−d] … a[t] for the largest d of whatever reads ``pre``, with a continuous delay also
    what is before that; 0 where none is delayed."""
    deepest, lags = 0, lags_of(network)
    for members in _looking_back(network):
        rows = network.connections.delays[members]
        rows += rows > 0
        if lags is not None:
            own = lags.some(members)
            rows = np.where(own.there, own.depth, rows)
        deepest = max(deepest, int(rows.max(initial=0)))
    return deepest


def remembering(network: Network) -> npt.NDArray[np.bool_]:
    """The connections (m,) of which the past is read: delayed ones whose synapse or rule reads ``pre``, or that send
    spikes."""
    reading = np.zeros(len(network.connections), dtype=np.bool_)
    for members in _looking_back(network):
        reading[members] = True
    return reading & (network.connections.delays.whole() > 0)


def _looking_back(network: Network) -> Iterator[Indices]:
    """The connections that do, some at a time."""
    for one in network.projections:
        if any(end.past for end in ends_of(network, one).values()):
            yield one.members
    if network.spikes.any():
        yield np.flatnonzero(network.spikes[taken_by(network)] & (network.synapses.numbers < 0))
