"""Quantities: all that a run has beside activities and weights and can be looked at by a name: states and outputs of
models, states of rules and synapses, and the signals that synapses form.

In: a Network. Out: where each of them stands, one number a neuron or a connection; and in a run what they are now.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE, Each, Hidden
from neurovis_spec.runtime.state import State


class Glyphs(NamedTuple):
    """By which of some things each neuron, or each connection, is drawn, −1 by none; and how many things there are."""

    of: IntArray
    size: int


class Listed(NamedTuple):
    """Lists of names, of which the first is empty, and which of them is that of each thing: of connections, then of
    neurons, as they are drawn."""

    lists: tuple[tuple[str, ...], ...]
    of: IntArray


class Quantities:
    """The quantities of a network, (k,): those of a definition in use one after the other, signals at the end."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._kept = [
            (use.owner, StateOf.of(use.definition.kind.each, one.name, holder.members))
            for holder, use in network.uses
            for one in use.definition.kept
            if not isinstance(one, Hidden)
        ]
        signals = [StateOf.of("connection", SYNAPSE.gives, network.joined)] if len(network.joined) else []
        #: by their names, each of some neurons or some connections
        self.blocks = (*(one for _, one in self._kept), *signals)
        self._starts = np.cumsum([0, *(one.size for one in self.blocks)]).tolist()

    def __len__(self) -> int:
        return int(self._starts[-1])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """How each is called (k,): ``K1.v``, ``(K1 -> O).signal``."""
        return self._network.state_names(self.blocks)

    def places(self, each: Each, name: str, members: IntArray) -> IntArray:
        """Where those of this name stand, of these neurons or connections, as far as they have it."""
        found = [np.zeros(0, dtype=np.int64)]
        for block, start in zip(self.blocks, self._starts, strict=False):
            of = block.neurons if each == "neuron" else block.connections
            if block.state == name and len(of):
                found.append(start + np.flatnonzero(np.isin(of, members)))
        return np.concatenate(found)

    def listed(self, neurons: Glyphs, connections: Glyphs) -> Listed:
        """The names of what each thing has that is drawn."""
        firsts = {"connection": 0, "neuron": connections.size}
        of, lists = np.zeros(connections.size + neurons.size, dtype=np.int64), list[tuple[str, ...]]([()])
        for block in self.blocks:
            each: Each = "neuron" if len(block.neurons) else "connection"
            drawn, members = (neurons, block.neurons) if each == "neuron" else (connections, block.connections)
            things = np.unique(drawn.of[members])
            things = things[things >= 0] + firsts[each]
            for old in np.unique(of[things]).tolist():
                if block.state not in lists[old]:
                    own = things[of[things] == old]
                    lists.append((*lists[old], block.state))
                    of[own] = len(lists) - 1
        return Listed(tuple(lists), of)

    def now(self, state: State, signals: FloatArray | None) -> FloatArray:
        """What they are behind a step, (k,); of the ``signals`` (m,), which whoever looks at them has to form, NaN
        where they are not known."""
        joined = self._network.joined
        brought = np.full(len(joined), np.nan) if signals is None else signals[joined]
        return np.concatenate([*(state.cells[owner][one.state] for owner, one in self._kept), brought])
