"""Lesions: what has been removed from a network by a step stays in its picture, faintly.

In: a network with its events. Out: for each connection and neuron the step of its lesion. A lesioned
connection keeps the width of its last weight (Eq. 4), so what says that it is gone is that all of it is faint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.network import Network

#: how much of what has been removed can still be seen
FAINT = 0.3


@dataclass(frozen=True, slots=True)
class Lesions:
    """Steps of lesions, by index; what is never lesioned has none."""

    neurons: dict[int, int]
    connections: dict[int, int]

    def __bool__(self) -> bool:
        return bool(self.neurons or self.connections)


def lesions_of(network: Network) -> Lesions:
    """A connection is lesioned with either of its ends, too."""
    found = Lesions({}, {})
    sources, targets = network.connections.sources.whole(), network.connections.targets.whole()
    for change in network.changes:
        silent = np.zeros(len(network.neurons), dtype=bool)
        silent[change.lesioned_neurons] = True
        gone = silent[sources] | silent[targets]
        gone[change.lesioned_connections] = True
        for index in np.flatnonzero(gone).tolist():
            found.connections.setdefault(index, change.at)
        for neuron in change.lesioned_neurons.tolist():
            found.neurons.setdefault(neuron, change.at)
    return found
