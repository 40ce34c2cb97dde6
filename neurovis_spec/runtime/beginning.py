"""Back to the beginning, within a run: neurons that an event resets, and new trials that keep what was learned.

In: a Network, a State, neurons. Out: the State with them as they were before the first step, whatever has come since;
or a State to begin another trial in. Weights and centres stay as they are, and random numbers go on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as field_of

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import CENTRE, Holder, Key, Population, Use
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.stages import taken_by
from neurovis_spec.runtime.state import State, initial_state


@dataclass(frozen=True)
class Rewind:
    """Where some neurons go back to their beginning, and to which numbers."""

    #: the neurons, and their activities
    neurons: IntArray
    activity: FloatArray
    #: places among the outlets, and what they are
    outlet_places: IntArray
    outlets: FloatArray
    #: by states, of which members, and what these begin with
    cells: Mapping[Key, tuple[IntArray, FloatArray]]
    #: connections with what they sent lost
    lost: IntArray
    #: connections with a continuous delay, where what comes before the first step is what is ``sent`` there
    steady: IntArray
    sent: FloatArray
    #: of the history the columns of what these take
    columns: IntArray
    column_values: FloatArray

    def apply(self, network: Network, state: State) -> None:
        """Have a state be so, but for what is lost."""
        state.activity[self.neurons] = self.activity
        state.outlets[self.outlet_places] = self.outlets
        for key, (members, values) in self.cells.items():
            assert key.owner is not None
            state.cells[key.owner][key.name][members] = values
        if len(self.steady):
            layout = signal_layout(network, state.own_signals)
            slots, each = slots_of(layout, self.steady)
            factors = np.where(layout.shares[self.steady], 1.0, state.weights[self.steady])
            with np.errstate(all="ignore"):
                state.signals[slots] = (factors * self.sent)[each]
        if len(state.history):
            state.history[:, self.columns] = self.column_values


def slots_of(layout: SignalLayout, connections: IntArray) -> tuple[IntArray, IntArray]:
    """The slots of what is under way on some connections, and of which of these each is."""
    lengths = np.where(layout.offsets[connections] >= 0, layout.lengths[connections], 0).astype(np.int64)
    each = np.repeat(np.arange(len(connections)), lengths)
    within = np.arange(len(each)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return layout.offsets[connections].astype(np.int64)[each] + within, each


@dataclass
class Beginnings:
    """What the neurons of a network begin with, worked out where it is first asked for."""

    network: Network
    _known: State | None = field_of(default=None, repr=False)
    _rewinds: dict[bytes, Rewind] = field_of(default_factory=dict, repr=False)

    def rewind(self, neurons: IntArray) -> Rewind:
        """How these neurons go back, with the synapses and rules of all connections that begin or end at them, and what
        they have sent; worked out once, as it is asked for twice at a reset, and the same neurons are reset often."""
        known = neurons.tobytes()
        if known not in self._rewinds:
            self._rewinds[known] = self._rewind(neurons)
        return self._rewinds[known]

    def _rewind(self, neurons: IntArray) -> Rewind:
        network, begin = self.network, self._begin()
        chosen = np.zeros(len(network.neurons), dtype=np.bool_)
        chosen[neurons] = True
        sources = network.connections.sources.whole()
        cells: dict[Key, tuple[IntArray, FloatArray]] = {}
        for holder, use in network.uses:
            members = np.flatnonzero(self._goes_back(holder, use, chosen))
            for one in use.definition.kept if len(members) else ():
                if not (use.definition.moves_centre and one.name == CENTRE):
                    cells[Key(use.owner, one.name)] = members, begin.cells[use.owner][one.name][members]
        outlets = [np.zeros(0, dtype=np.int64)]
        for outlet in network.outlets:
            outlets.append(outlet.start + np.flatnonzero(chosen[network.populations[outlet.population].members]))
        places = np.concatenate(outlets)
        lags, sending = lags_of(network), chosen[sources]
        steady = np.flatnonzero(sending & lags.there) if lags is not None else np.zeros(0, dtype=np.int64)
        taken = np.concatenate((begin.activity, begin.outlets))
        columns = np.unique(taken_by(network)[steady]).astype(np.int64)
        return Rewind(
            neurons=neurons,
            activity=begin.activity[neurons],
            outlet_places=places,
            outlets=begin.outlets[places],
            cells=cells,
            lost=np.setdiff1d(np.flatnonzero(sending), steady),
            steady=steady,
            sent=taken[taken_by(network)[steady]],
            columns=columns,
            column_values=taken[columns],
        )

    def _goes_back(self, holder: Holder, use: Use, chosen: BoolArray) -> BoolArray:
        """Which members of a holder do where these neurons (n,) do; states of a shared synapse are those of the
        target."""
        if isinstance(holder, Population):
            return chosen[holder.members]
        connections = self.network.connections
        at_target = chosen[connections.targets[holder.members]]
        if use.owner.number in self.network.fed:
            return at_target
        return at_target | chosen[connections.sources[holder.members]]

    def _begin(self) -> State:
        """The state before the first step: activities are those with which neurons begin, 0 where they are computed;
        of what flows the activities and outputs that its states give where nothing arrives."""
        if self._known is None:
            network = self.network
            state = initial_state(network)
            start = network.neurons.initial
            state.activity[:] = np.where(np.isnan(start), 0.0, start)
            if network.integration is not None:
                self._flow(state)
            self._known = state
        return self._known

    def _flow(self, state: State) -> None:
        """Activities and outlets of what flows."""
        from neurovis_spec.runtime.backend import ready

        first = initial_state(self.network)
        stepper = ready(self.network, "reference")
        stepper.take(first)
        with np.errstate(all="ignore"):
            stepper.stepper.step(first, np.zeros(self.network.vector_size))
        for number, population in enumerate(self.network.populations):
            if population.model.definition.flows:
                state.activity[population.members] = first.activity[population.members]
                for outlet in self.network.outlets:
                    if outlet.population == number:
                        places = slice(outlet.start, outlet.start + len(population.members))
                        state.outlets[places] = first.outlets[places]


def new_trial(network: Network, begin: State, now: State) -> State:
    """The state in which a run begins, but with the weights and centres that have been learned ``now``; random numbers
    go on behind the steps that were made."""
    state = begin.copy()
    state.weights[network.learned] = now.weights[network.learned]
    for holder, use in network.uses:
        if use.definition.moves_centre and len(holder.members):
            state.cells[use.owner][CENTRE][:] = now.cells[use.owner][CENTRE]
    state.drawn = now.drawn + now.k
    return state
