"""Lesions: what has been removed from a network by a step stays in its picture, faintly.

In: a network, whose events are phases (§9). Out: for each connection and neuron the step of its lesion. A lesioned
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
    """A connection is lesioned when its block no longer has it, a neuron when it is held at 0 and all of its
    connections are lesioned; one without connections is only held."""
    found = Lesions({}, {})
    count = len(network.connections)
    ends = np.concatenate([network.connections.sources, network.connections.targets])
    degree = np.bincount(ends, minlength=len(network.neurons))
    for step, phase in network.phases:
        if sum(len(block.incoming) for block in phase.blocks) == count:
            continue
        gone = np.ones(count, bool)
        for block in phase.blocks:
            gone[block.incoming] = False
        for index in np.flatnonzero(gone).tolist():
            found.connections.setdefault(index, step)
        lost = np.bincount(ends[np.concatenate([gone, gone])], minlength=len(degree))
        for neuron, value in phase.clamped:
            if value == 0 and lost[neuron] == degree[neuron] > 0:
                found.neurons.setdefault(neuron, step)
    return found
