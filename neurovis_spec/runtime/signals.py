"""Where the signals under way lie: a flat ring buffer with d slots for each connection of delay d ≥ 1.

In: a Network. Out: a SignalLayout. The signal that connection c sends at step t lies in slot
``offsets[c] + t mod d``: it is read there when it arrives, at t + d, and then overwritten by the one sent at t + d.
Connections of the same delay into the same population lie next to each other, so that a backend reads them as one
slice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network


@dataclass(frozen=True, slots=True)
class DelayClass:
    """All connections of one delay ≥ 1, as they are stored: the i-th has its slots from ``start + i·delay`` on."""

    delay: int
    start: int
    connections: IntArray
    #: population of the target of each
    populations: IntArray

    @property
    def stop(self) -> int:
        """End of the slots, exclusive."""
        return self.start + self.delay * len(self.connections)


@dataclass(frozen=True, slots=True)
class SignalLayout:
    """``offsets`` (m,): the first slot of each connection, −1 with delay 0; ``size``: slots in all."""

    offsets: IntArray
    size: int
    classes: tuple[DelayClass, ...]


def signal_layout(network: Network) -> SignalLayout:
    """Lay the slots out by delay, then by population of the target, then in the order of the connections."""
    connections = network.connections
    block_of = np.zeros(len(network.neurons), dtype=np.int64)
    for number, population in enumerate(network.populations):
        block_of[population.members] = number
    populations = block_of[connections.targets.whole()]
    offsets = np.full(len(connections), -1, dtype=np.int64)
    classes: list[DelayClass] = []
    size = 0
    # the counts take no more memory than the slots of one connection with the longest delay
    for delay in (np.flatnonzero(np.bincount(connections.delays.whole())[1:]) + 1).tolist():
        members = np.flatnonzero(connections.delays.whole() == delay)
        members = members[np.argsort(populations[members], kind="stable")]
        offsets[members] = size + delay * np.arange(len(members))
        classes.append(DelayClass(delay, size, members, populations[members]))
        size += delay * len(members)
    return SignalLayout(offsets, size, tuple(classes))
