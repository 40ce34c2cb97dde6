"""Where the signals under way lie: a flat ring buffer with d slots for each connection of delay d ≥ 1, or for all
that take the same.

In: a Network. Out: a SignalLayout. The signal that connection c sends at step t lies in slot
``offsets[c] + t mod d``: it is read there when it arrives, at t + d, and then overwritten by the one sent at t + d.
Where a delay is continuous, so that what arrives is read between steps, a ring is longer by one or two slots
(``lags.ring_lengths``); what comes before the first step is what is sent there.
Connections of the same delay into the same population lie next to each other, so that a backend reads them as one
slice. Where nothing changes a weight in a run, w[t−d] is w[t]: the slots hold what is sent, the activity of a source or
an outlet, which all such connections of a delay that take it share. Each has it times its weight on arrival, which
gives the same bits. Where few numbers are saved each has its own all the same: to multiply all at once costs less.
On connections with a synapse nothing is under way: their signals are made where they arrive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntColumn, pieces, width
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE
from neurovis_spec.runtime.events import weights_stay
from neurovis_spec.runtime.lags import lags_of, ring_lengths
from neurovis_spec.runtime.stages import taken_by

#: the slots that connections of a delay must save by sharing. It stays: a checkpoint holds what is under way as it lies
LEAST_SAVED = 1 << 15


#: more delays are not read and sent one by one
MANY = 96


@dataclass(frozen=True, slots=True)
class DelayClass:
    """All connections of one delay ≥ 1 with signals of their own, as they are stored: the i-th has its slots from
    ``start + i·length`` on, ``delay`` of them, or more where that is continuous."""

    delay: int
    length: int
    start: int
    connections: Indices
    #: population of the target of each
    populations: Indices

    @property
    def stop(self) -> int:
        """End of the slots, exclusive."""
        return self.start + self.length * len(self.connections)


@dataclass(frozen=True, slots=True)
class SharedSlots:
    """What connections of one delay ≥ 1 share: the i-th of what is sent has its slots from ``start + i·length`` on."""

    delay: int
    length: int
    start: int
    #: activities and outlets, as ``Network.sending`` numbers them
    sent: Indices

    @property
    def stop(self) -> int:
        """End of the slots, exclusive."""
        return self.start + self.length * len(self.sent)


@dataclass(frozen=True, slots=True)
class SignalLayout:
    """``offsets`` (m,): the first slot of each connection, −1 with delay 0 or a synapse, and ``lengths`` (m,) how many
    it has; ``size``: slots in all; ``shares`` (m,): the connections whose slots hold what is sent, not signals of their
    own."""

    offsets: Indices
    lengths: Indices
    size: int
    classes: tuple[DelayClass, ...]
    shared: tuple[SharedSlots, ...]
    shares: BoolArray

    @property
    def many(self) -> bool:
        """Whether there are so many delays that what is under way is read and sent all at once, not delay by delay."""
        return len(self.classes) + len(self.shared) > MANY

    @property
    def rings(self) -> tuple[DelayClass | SharedSlots, ...]:
        """All slots, by what they are of."""
        return *self.classes, *self.shared


def signal_layout(network: Network, own: bool = False) -> SignalLayout:
    """Lay the slots out by delay, then by population of the target, then in the order of the connections. With ``own``
    no connection shares any."""
    connections = network.connections
    population_of = np.zeros(len(network.neurons), dtype=width(0, len(network.populations)))
    for number, population in enumerate(network.populations):
        population_of[population.members] = number
    populations = population_of[connections.targets.compact()]
    rings, index_type = _rings(network), width(0, len(connections))
    offsets = np.full(len(connections), -1, dtype=width(-1, slots_of_each(network)))
    shares = np.zeros(len(connections), dtype=np.bool_) if own else _sharing(network, rings)
    classes: list[DelayClass] = []
    shared: list[SharedSlots] = []
    size = 0
    for delay, length in rings.different:
        alike = rings.are(delay, length)
        members = np.flatnonzero(alike & ~shares).astype(index_type)
        if len(members):
            if len(network.populations) > 1:
                members = members[np.argsort(populations[members], kind="stable")]
            offsets[members] = np.arange(size, size + length * len(members), length, dtype=offsets.dtype)
            classes.append(DelayClass(delay, length, size, members, populations[members]))
            size += length * len(members)
        members = np.flatnonzero(alike & shares).astype(index_type)
        if len(members):
            sends, taken = _sends(network, members)
            starts = size + length * (np.cumsum(sends) - 1)
            offsets[members] = starts.astype(offsets.dtype)[taken]
            shared.append(SharedSlots(delay, length, size, np.flatnonzero(sends)))
            size = shared[-1].stop
    return SignalLayout(offsets, rings.lengths, size, tuple(classes), tuple(shared), shares)


def slots_of_each(network: Network) -> int:
    """How many slots there are where no connection shares any."""
    return sum(int(piece.sum()) for piece in pieces(_rings(network).lengths))


def _sharing(network: Network, rings: _Rings) -> BoolArray:
    """The delayed connections (m,) whose weight nothing changes in a run, of each delay where it is worth it. Not where
    signals are multiplied: before the first one has arrived, a weight below 0 would make −0 of 0, which a sum does not
    show, but a product."""
    shares = (rings.lengths > 0) & weights_stay(network)
    for population in network.populations:
        for port in population.ports:
            if port.combine == "product":
                shares[port.incoming] = False
    for delay, length in rings.different:
        members = np.flatnonzero(shares & rings.are(delay, length))
        if length * (len(members) - np.count_nonzero(_sends(network, members)[0])) < LEAST_SAVED:
            shares[members] = False
    return shares


def _sends(network: Network, connections: Indices) -> tuple[BoolArray, Indices]:
    """Which of all activities and outlets some connections take, and which one each of them does."""
    taken = taken_by(network)[connections]
    sends = np.zeros(len(network.neurons) + network.outlet_count, dtype=np.bool_)
    sends[taken] = True
    return sends, taken


@dataclass(frozen=True)
class _Rings:
    """The delays of all connections (m,), and how many slots each has: 0 with a synapse, and without a delay."""

    delays: IntColumn
    lengths: Indices
    #: those that have a continuous delay
    lagging: BoolArray | None

    @property
    def different(self) -> list[tuple[int, int]]:
        """The delays ≥ 1 that there are with the lengths of their rings, ascending, continuous ones last; perhaps some
        that no ring has."""
        found = [(delay, delay) for delay in np.unique(self.delays.kept).tolist() if delay > 0]
        if self.lagging is None:
            return found
        pairs = zip(self.delays[self.lagging].tolist(), self.lengths[self.lagging].tolist(), strict=True)
        return found + sorted({(delay, length) for delay, length in pairs if length})

    def are(self, delay: int, length: int) -> BoolArray:
        """The connections of a delay with such a ring."""
        result: BoolArray = self.lengths == length
        return result if self.lagging is None else result & (self.delays.compact() == delay)


def _rings(network: Network) -> _Rings:
    lengths = ring_lengths(network)
    if any(one.kind == SYNAPSE for one in network.projections):
        lengths = np.where(network.synapses.numbers < 0, lengths, lengths.dtype.type(0))
    lags = lags_of(network)
    return _Rings(network.connections.delays, lengths, None if lags is None else lags.there)
