"""What rules read of the past: ``pre``, the activity of a source when that left which now reaches the synapse.

In: a Network. Out: how far back its activities are kept, and which connections look there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Projection


def history_depth(network: Network) -> int:
    """Rows of the history: a[t−d] … a[t] for the largest d of a rule that reads ``pre``; 0 where none is delayed."""
    deepest = max(
        (int(network.connections.delays[reader.members].max(initial=0)) for reader in _readers_of_pre(network)),
        default=0,
    )
    return deepest + 1 if deepest else 0


def remembering(network: Network) -> npt.NDArray[np.bool_]:
    """The connections (m,) whose rule reads an activity of the past: delayed ones whose rule reads ``pre``."""
    reading = np.zeros(len(network.connections), dtype=np.bool_)
    for reader in _readers_of_pre(network):
        reading[reader.members] = True
    return reading & (network.connections.delays.whole() > 0)


def _readers_of_pre(network: Network) -> list[Projection]:
    return [projection for projection in network.projections if "pre" in projection.read]
