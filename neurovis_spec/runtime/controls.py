"""Controls: how events and callers change the conditions of a run.

In: a State, and Changes or what a caller sets, clamps, lesions, mends, stops. Out: other Conditions in the State.
A *slot* is the index of a parameter in ``Settable``. Setting and clamping replace numbers; only lesions and stopped
rules give the step another ``structure``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.events.changes import Change, Held
from neurovis_spec.compiler.events.patch import Patcher, PatchError
from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Key
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.runtime.beginning import Beginnings
from neurovis_spec.runtime.presynaptic import remembering
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import Conditions, State, have_own_signals


def lose(network: Network, state: State, connections: IntArray) -> None:
    """Nothing is under way on these connections: what they have sent so far never arrives."""
    if not len(connections):
        return
    layout = signal_layout(network, state.own_signals)
    for connection in connections[~layout.shares[connections]].tolist():
        if (first := int(layout.offsets[connection])) >= 0:
            state.signals[first : first + int(layout.lengths[connection])] = 0.0
    # those that read past activities on arrival, or whose synapses or rules do
    read_later = connections[(layout.shares | remembering(network))[connections]]
    if len(read_later):
        lost = state.conditions.structure.lost.copy()
        lost[read_later] = state.k
        state.conditions.structure = replace(state.conditions.structure, lost=lost)


@dataclass
class Controls:
    """Changes the conditions of runs of one network, whose functions are computed ``by`` a library."""

    network: Network
    by: Library = NUMPY

    def __post_init__(self) -> None:
        self.beginnings = Beginnings(self.network)
        self._patcher = Patcher(self.network.settable, self.by)
        self._changes = {change.at: change for change in self.network.changes}

    def due(self, state: State) -> bool:
        """Whether events change something at the step to come, and have not yet."""
        return state.k in self._changes and state.begun != state.k

    def begin(self, state: State) -> bool:
        """What events change at the step to come, once; whether they do. Raises PatchError."""
        if not self.due(state):
            return False
        change, state.begun = self._changes[state.k], state.k
        with np.errstate(all="ignore"):
            self.apply(state, change)
        return True

    def rewind(self, state: State) -> None:
        """Put the neurons that events reset at the step to come back to their beginning. It is made just before that
        step, not when all else changes, so that until then what they have become can be read."""
        change = self._changes.get(state.k)
        if change is not None and len(change.reset):
            self.beginnings.rewind(change.reset).apply(self.network, state)

    def set(self, now: Conditions, weights: FloatArray, values: Mapping[int, float]) -> None:
        """Set slots and all that follows them: parameters, weights and variables, clamps; all or nothing. Raises
        PatchError."""
        patch = self._patcher.patch(now.parameters, now.was_set, values)
        now.parameters = patch.parameters
        for slot in values:
            now.was_set[slot] = True
        patch.write(weights, now.variables)
        if now.held.active:
            now.held.follow(patch.changed, now.parameters, self.by)
            self.hold(now)

    def weigh(self, state: State, connections: IntArray, value: float) -> None:
        """Give connections this weight, as an event that sets it does, and what has the same weight as they: their
        twins, and those that are tied to them. What is under way has left with the weight of before. Raises PatchError
        for one beyond its bounds."""
        network, variables = self.network.connections, self.network.settable.variables
        members, _ = network.with_tied(network.with_twins(connections))
        for key, column, beyond, word in (
            (LOW, network.low, np.less, "below"),
            (HIGH, network.high, np.greater, "above"),
        ):
            edges = column[members]
            if key in variables:
                start, size = variables[key]
                edges = state.conditions.variables[start + (members if size > 1 else 0)]
            if beyond(value, edges).any():
                raise PatchError(f"a weight would be {word} its bound of {float(np.max(edges)):g}", frozenset())
        if not state.own_signals and signal_layout(self.network).shares[members].any():
            have_own_signals(self.network, state)
        state.weights[members] = value

    def apply(self, state: State, change: Change) -> None:
        """What the events of a step change; all or nothing. Raises PatchError, which it cannot where nothing was set
        but by the events before."""
        now = state.conditions
        self.set_parameters(now, state.weights, change)
        if change.released or change.clamps:
            now.held.end(change.released, now.parameters, self.by)
            for clamp in change.clamps:
                now.held.begin(clamp, now.parameters, self.by)
            self.hold(now)
        if len(change.reset):
            lose(self.network, state, self.beginnings.rewind(change.reset).lost)
        if len(change.mended_neurons) or len(change.mended_connections):
            self.mend(state, change.mended_neurons, change.mended_connections)
        if len(change.lesioned_neurons) or len(change.lesioned_connections):
            self.lesion(state, change.lesioned_neurons, change.lesioned_connections)
        for members, on in change.learning:
            self.learn(state, members, on)

    def set_parameters(self, now: Conditions, weights: FloatArray, change: Change) -> None:
        """Set the parameters that the events of a step set. Raises PatchError."""
        if change.parameters:
            values = {slot: float(formula.values(now.parameters, self.by)) for slot, formula in change.parameters}
            self.set(now, weights, values)

    def lesion(self, state: State, neurons: IntArray, connections: IntArray) -> None:
        """Neurons and connections, with their twins, are silent from now on."""
        state.conditions.lesioned_neurons[neurons] = True
        state.conditions.lesioned_connections[self.network.connections.with_twins(connections)] = True
        self.restructure(state)

    def mend(self, state: State, neurons: IntArray, connections: IntArray) -> None:
        """The opposite of a lesion: what has been silent takes part again. What was left out of a step has nothing
        under way: it has lost that, and sent nothing meanwhile. A lesion that is mended before a step is none."""
        now = state.conditions
        now.lesioned_neurons[neurons] = False
        now.lesioned_connections[self.network.connections.with_twins(connections)] = False
        before = now.structure
        self.restructure(state)
        lose(self.network, state, np.flatnonzero(before.cut & (before.since < state.k) & ~now.structure.cut))

    def learn(self, state: State, connections: IntArray, on: bool) -> None:
        """Switch the rules of connections on or off; weights and states of a rule that is off stay as they are."""
        state.conditions.paused[connections] = not on
        self.restructure(state)

    def hold(self, now: Conditions) -> None:
        """Work out what is held in each population, lesioned neurons at 0, and put it into ``now.holds``; and the
        states that are held into ``now.fixed``."""
        n = len(self.network.neurons)
        now.fixed = self._fixed(now.held) if (now.held.order[n:] >= 0).any() else None
        holding = (now.held.order[:n] >= 0) | now.lesioned_neurons
        if not holding.any():
            now.holds = None
            return
        values = np.where(now.lesioned_neurons, 0.0, now.held.value[:n])
        holds: list[tuple[IntArray, FloatArray] | None] = []
        for population in self.network.populations:
            held = population.members[holding[population.members]]
            holds.append((held, values[held]) if len(held) else None)
        now.holds = tuple(holds)

    def _fixed(self, held: Held) -> dict[Key, tuple[IntArray, FloatArray]]:
        """The states that are held."""
        places = self.network.state_places
        starts = np.fromiter(places.values(), dtype=np.int64)
        held_places = np.flatnonzero(held.order[starts[0] :] >= 0) + starts[0]
        ends = np.searchsorted(held_places, [*starts, self.network.clampable])
        fixed: dict[Key, tuple[IntArray, FloatArray]] = {}
        for key, start, (begin, end) in zip(places, starts, pairwise(ends), strict=True):
            own = held_places[begin:end]
            if len(own):
                fixed[key] = own - start, held.value[own]
        return fixed

    def restructure(self, state: State) -> None:
        """Work out what a step leaves out, and put it into ``conditions.structure``: another object only where it
        changes, as backends make their code anew for it."""
        connections, now, before = self.network.connections, state.conditions, state.conditions.structure
        silent = now.lesioned_neurons
        cut = silent[connections.sources.whole()] | silent[connections.targets.whole()] | now.lesioned_connections
        gone, still = cut, cut | now.paused
        if self.network.fed:
            gone = cut.copy()
            carriers = np.concatenate([self.network.projections[number].members for number in self.network.fed])
            gone[carriers] = silent[connections.targets[carriers]]
        if not all(map(np.array_equal, (gone, cut, still), (before.gone, before.cut, before.still))):
            since = np.where(cut & ~before.cut, state.k, before.since)
            now.structure = replace(before, gone=gone, cut=cut, since=since, still=still)
        self.hold(now)
