"""What synapses and rules read of the past: ``pre`` and ``pre.v``, as they were at the source when that left which now
reaches the synapse.

In: a Network. Out: how far back its activities are kept, and which connections look there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Projection
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.stages import ends_of


def history_depth(network: Network) -> int:
    """Rows of the history: a[t−d] … a[t] for the largest d of whatever reads ``pre``, with a continuous delay also
    what is before that; 0 where none is delayed."""
    deepest, lags = 0, lags_of(network)
    for reader in _readers_of_pre(network):
        rows = network.connections.delays[reader.members]
        rows += rows > 0
        if lags is not None:
            own = lags.some(reader.members)
            rows = np.where(own.there, own.depth, rows)
        deepest = max(deepest, int(rows.max(initial=0)))
    return deepest


def remembering(network: Network) -> npt.NDArray[np.bool_]:
    """The connections (m,) whose synapse or rule reads the past: delayed ones of which one reads ``pre``."""
    reading = np.zeros(len(network.connections), dtype=np.bool_)
    for reader in _readers_of_pre(network):
        reading[reader.members] = True
    return reading & (network.connections.delays.whole() > 0)


def _readers_of_pre(network: Network) -> list[Projection]:
    """Those whose definitions read it."""
    return [one for one in network.projections if any(end.past for end in ends_of(network, one).values())]
