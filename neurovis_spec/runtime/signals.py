"""Where the signals under way lie: a flat ring buffer with d slots for each connection of delay d ≥ 1.

In: a Network. Out: a SignalLayout. The signal that connection c sends at step t lies in slot
``offsets[c] + t mod d``: it is read there when it arrives, at t + d, and then overwritten by the one sent at t + d.
Connections of the same delay into the same population lie next to each other, so that a backend reads them as one
slice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import Indices, pieces, width
from neurovis_spec.compiler.network import Network


@dataclass(frozen=True, slots=True)
class DelayClass:
    """All connections of one delay ≥ 1, as they are stored: the i-th has its slots from ``start + i·delay`` on."""

    delay: int
    start: int
    connections: Indices
    #: population of the target of each
    populations: Indices

    @property
    def stop(self) -> int:
        """End of the slots, exclusive."""
        return self.start + self.delay * len(self.connections)


@dataclass(frozen=True, slots=True)
class SignalLayout:
    """``offsets`` (m,): the first slot of each connection, −1 with delay 0; ``size``: slots in all."""

    offsets: Indices
    size: int
    classes: tuple[DelayClass, ...]


def signal_layout(network: Network) -> SignalLayout:
    """Lay the slots out by delay, then by population of the target, then in the order of the connections."""
    connections = network.connections
    population_of = np.zeros(len(network.neurons), dtype=width(0, len(network.populations)))
    for number, population in enumerate(network.populations):
        population_of[population.members] = number
    populations = population_of[connections.targets.compact()]
    delays, index_type = connections.delays.compact(), width(0, len(connections))
    offsets = np.full(len(connections), -1, dtype=width(-1, sum(int(piece.sum()) for piece in pieces(delays))))
    classes: list[DelayClass] = []
    size = 0
    for delay in np.unique(connections.delays.kept[connections.delays.kept > 0]).tolist():
        members = np.flatnonzero(delays == delay).astype(index_type)
        if len(network.populations) > 1:
            members = members[np.argsort(populations[members], kind="stable")]
        offsets[members] = np.arange(size, size + delay * len(members), delay, dtype=offsets.dtype)
        classes.append(DelayClass(delay, size, members, populations[members]))
        size += delay * len(members)
    return SignalLayout(offsets, size, tuple(classes))
