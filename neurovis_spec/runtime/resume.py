"""Going on from a recording: what was learned is kept.

In: a Network and a Recording of it, or of a network with the same neurons. Out: the State before step 0 of a new run.

What was learned and what was changed is kept, unless it is given anew. The last activities recorded become a[−1]; the
weights after the last step become w[0] of the connections that learned. Parameters that were set (by ``--set``, an
event or a caller) keep their values, and all that follows them with them; one that this network is given (``--set``)
goes before that. Lesions stay. The signals under way are formed again from the activities and the weights of the last
rows, as far back as the delays reach and consecutive steps were recorded (what lies before is 0, on connections with a
continuous delay what was sent at the first of these steps). ``initial`` is not taken again.

Steps count from 0, so inputs, events and episodes begin anew; random numbers go on behind the steps that were made.
Clamps and stopped rules are no part of a recording. States of models and rules begin anew, but where something flows:
there those that the recording has (``--states all``) are taken, and what of the signals under way is known then.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from neurovis_spec.arguments import CodedWarning, callers_level
from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.events.patch import PatchError
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Holder, Key, Population, Quantity, Use
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.controls import Controls, lose
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import of_table
from neurovis_spec.runtime.lags import lags_of, ring_lengths
from neurovis_spec.runtime.presynaptic import remembering
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.stages import taken_by
from neurovis_spec.runtime.state import State, have_own_signals, initial_state


def resumed_state(
    network: Network, recording: Recording, functions: Library = NUMPY, own_signals: bool = False
) -> State:
    """The state in which a run goes on, with what computes the ``functions`` of formulas; it has ``own_signals``, too,
    where what is under way left by other weights. Raises RecordingError where names do not agree or the recording is
    empty."""
    # a table is given the structure of the network first: what it lacks is known by that
    (of_table(recording, network) or recording).check_whole("a run cannot go on from")
    if not len(recording):
        raise RecordingError("the recording holds no step to go on from")
    column_of = _matching_neurons(network, recording)  # of each neuron
    columns, learned = _learned_weights(network, recording)
    state = initial_state(network, own_signals)
    state.continued, state.drawn = True, recording.reached
    controls = Controls(network, functions)
    _set_again(network, recording, state, controls)
    _lesion_again(network, recording, state, controls)
    depth = int(ring_lengths(network).max(initial=1))
    theirs, ours = _same_connections(network, recording)
    kept = _Kept(network, recording) if _goes_on(network) else None
    state.weights[learned] = recording.weights_after[columns]

    def weights_at(row: int) -> FloatArray:
        weights = state.weights.copy()
        weights[ours] = recording.all_weights(row)[theirs]
        return weights

    rows, layout = _last_rows(recording, depth), signal_layout(network, state.own_signals)
    shares = layout.shares
    if shares.any() and any(not np.array_equal(weights_at(row)[shares], state.weights[shares]) for _, row in rows):
        have_own_signals(network, state)
        layout = signal_layout(network, own=True)
    for ago, row in rows:
        activity = recording.activity[row][column_of]
        sent, known = (activity, np.True_) if kept is None else kept.sent(activity, row)
        _send(network, layout, state, -ago, sent, known, weights_at(row))
    _prolong(network, layout, state, len(rows))
    lose(network, state, np.flatnonzero(state.conditions.structure.cut))
    if kept is not None:
        kept.restore(state)
    state.activity = recording.activity[-1][column_of]
    return state


def learned_state(network: Network, recording: Recording, functions: Library = NUMPY) -> State:
    """The state before a new trial that keeps nothing but the weights of connections that learn: activities, states,
    parameters and lesions are those of the beginning, random numbers go on. Raises RecordingError."""
    (of_table(recording, network) or recording).check_whole("a run cannot go on from")
    _matching_neurons(network, recording)
    state = initial_state(network)
    columns, places = _learned_weights(network, recording)
    kept = np.isin(places, network.learned)
    state.weights[places[kept]] = recording.weights_after[columns[kept]]
    state.drawn = recording.reached
    return state


def _set_again(network: Network, recording: Recording, state: State, controls: Controls) -> None:
    """Parameters keep the values that they had been given, unless they are given others now."""
    slots = network.settable
    values: dict[int, float] = {}
    for name, value in recording.set_parameters.items():
        slot = slots.index.get(name)
        if slot is None or slots.slots[slot].given or name not in network.parameters:
            continue
        if name in network.structural:
            if value != network.parameters[name]:
                raise RecordingError(
                    f"the recording was made with {name} = {value:g}, on which the structure of the network depends, "
                    f"and this network has {network.parameters[name]:g}: set '{name}' to one of them"
                )
            continue
        values[slot] = value
    if values:
        try:
            with np.errstate(all="ignore"):
                controls.set(state.conditions, state.weights, values)
        except PatchError as error:
            raise RecordingError(f"the parameters of the recording do not fit: {error}") from None


def _lesion_again(network: Network, recording: Recording, state: State, controls: Controls) -> None:
    """What was lesioned stays so."""
    neurons = [network.neuron_index[recording.neurons[index]] for index in recording.lesioned_neurons.tolist()]
    names = [recording.connection_names[index] for index in recording.lesioned_connections.tolist()]
    connections = [network.connection_index[name] for name in names if name in network.connection_index]
    if neurons or connections:
        controls.lesion(state, np.array(neurons, dtype=np.int64), np.array(connections, dtype=np.int64))


def _last_rows(recording: Recording, depth: int) -> list[tuple[int, int]]:
    """How many steps ago, and the row: the last consecutive steps, at most ``depth``, the latest first."""
    rows = []
    for ago in range(1, min(depth, len(recording)) + 1):
        if recording.step[-ago] != recording.step[-1] - ago + 1:
            break
        rows.append((ago, len(recording) - ago))
    return rows


def _goes_on(network: Network) -> bool:
    """Whether states go on: something flows, or fires."""
    return network.integration is not None or any(use.definition.fires for _, use in network.uses)


class _Kept:
    """The states that a recording has, of a network in which something flows or fires; a warning says whose flow states
    it has not, or whose states of those that fire, which begin anew."""

    def __init__(self, network: Network, recording: Recording) -> None:
        self.network, self.states = network, recording.states
        self._columns = {name: column for column, name in enumerate(recording.state_names)}
        #: the columns of what the recording has of all members of an owner
        self.found: dict[Key, IntArray] = {}
        for holder, use in network.uses:
            for one in use.definition.kept:
                columns = self._columns_of(holder, use, one.name)
                if (columns >= 0).all():
                    self.found[Key(use.owner, one.name)] = columns
        flowing = [one for one in network.uses if not self._has(one[1], one[1].definition.flows)]
        firing = [
            one for one in network.uses if one[1].definition.fires and not self._has(one[1], one[1].definition.state)
        ]
        #: the populations and projections whose states begin anew
        self.anew = [holder for holder, _ in (*flowing, *firing)]
        if self.anew:
            first = min(self._first_of(holder) for holder, _ in flowing or firing)
            what = "with a derivative" if flowing else "of neurons that fire"
            message = (
                f"the recording lacks states {what}, as of {first}, which begin anew: record them (run --states all)"
            )
            warnings.warn(CodedWarning("states-begin-anew", message), stacklevel=callers_level())

    def _has(self, use: Use, states: Sequence[Quantity]) -> bool:
        """Whether the recording has all of these states of a definition in use."""
        return all(Key(use.owner, one.name) in self.found for one in states)

    def _first_of(self, holder: Holder) -> str:
        """The name of the first member."""
        names = self.network.neurons.names if isinstance(holder, Population) else self.network.connection_names
        return names[int(holder.members[0])]

    def _columns_of(self, holder: Holder, use: Use, state: str) -> IntArray:
        """The columns of a state of all members, −1 where it was not recorded."""
        one = StateOf.of(use.definition.kind.each, state, holder.members)
        return np.array([self._columns.get(name, -1) for name in self.network.state_names([one])], dtype=np.int64)

    def sent(self, activity: FloatArray, row: int) -> tuple[FloatArray, BoolArray]:
        """What was sent in a row: activities, then outlets; and which of it is known, and not of what begins anew."""
        network, n = self.network, len(activity)
        sent, known = np.concatenate((activity, np.zeros(network.outlet_count))), np.ones(n, dtype=np.bool_)
        for one in self.anew:
            if isinstance(one, Population):
                known[one.members] = False
        known = np.concatenate((known, np.zeros(network.outlet_count, dtype=np.bool_)))
        for outlet in network.outlets:
            population = network.populations[outlet.population]
            columns = self.found.get(Key(population.model.owner, outlet.name))
            if columns is not None:
                place = slice(n + outlet.start, n + outlet.start + len(columns))
                sent[place], known[place] = self.states[row][columns], known[population.members]
        return sent, known

    def restore(self, state: State) -> None:
        """Have a state what was kept behind the last step."""
        for key, columns in self.found.items():
            assert key.owner is not None
            state.cells[key.owner][key.name][:] = self.states[-1][columns]
        for outlet in self.network.outlets:
            values = state.cells[self.network.populations[outlet.population].model.owner][outlet.name]
            state.outlets[outlet.start : outlet.start + len(values)] = values


def _send(
    network: Network,
    layout: SignalLayout,
    state: State,
    step: int,
    sent: FloatArray,
    known: BoolArray | np.bool_,
    weights: FloatArray,
) -> None:
    """Send what was sent at a step before 0, as far as it is known, and has not arrived by then: −1 was the last step
    before the run."""
    taken, between = taken_by(network), network.connections.lags is not None
    under_way = np.flatnonzero((layout.lengths >= -step) & np.broadcast_to(known, sent.shape)[taken])
    factors = np.where(layout.shares[under_way], 1.0, weights[under_way])
    with np.errstate(all="ignore"):
        signals = factors * sent[taken[under_way]]
    # a step is negative here; its remainder is a slot ≥ 0 all the same
    state.signals[layout.offsets[under_way] + step % layout.lengths[under_way].astype(np.int64)] = signals
    if -step < len(state.history) + between:  # the last one is read before what is sent next takes its place
        state.history[step % len(state.history)] = np.where(known, sent, 0.0)


def _prolong(network: Network, layout: SignalLayout, state: State, known: int) -> None:
    """What was sent on connections with a continuous delay before the steps that are known, as many as these are, is
    what was sent at the first of them, as it is before the first step of all; with any other delay it is 0."""
    lags = lags_of(network)
    if lags is None:
        return
    for ago in range(known + 1, int(layout.lengths.max(initial=0)) + 1):
        members = np.flatnonzero(lags.there & (layout.lengths >= ago))
        offsets, lengths = layout.offsets[members].astype(np.int64), layout.lengths[members].astype(np.int64)
        state.signals[offsets + -ago % lengths] = state.signals[offsets + -known % lengths]
    depth = len(state.history)
    if known < depth:
        state.history[-np.arange(known + 1, depth + 1) % depth] = state.history[-known % depth]
        others = remembering(network) & ~lags.there & (network.connections.delays.whole() > known)
        if others.any():
            lost = np.where(others, -known, state.conditions.structure.lost)
            state.conditions.structure = replace(state.conditions.structure, lost=lost)


def _matching_neurons(network: Network, recording: Recording) -> IntArray:
    """For each neuron of the network its column in the recording."""
    columns = {name: column for column, name in enumerate(recording.neurons)}
    for name in network.neurons.names:
        if name not in columns:
            raise RecordingError(_does_not_fit("neuron", name, "the recording", columns))
    for name in recording.neurons:
        if name not in network.neuron_index:
            raise RecordingError(_does_not_fit("neuron", name, f"'{network.name}'", network.neuron_index))
    return np.array([columns[name] for name in network.neurons.names], dtype=np.int64)


def _same_connections(network: Network, recording: Recording) -> tuple[IntArray, IntArray]:
    """The connections that both have: their indices in the recording, and in the network."""
    places = np.array([network.connection_index.get(name, -1) for name in recording.connection_names], dtype=np.int64)
    known = np.flatnonzero(places >= 0)
    return known, places[known]


def _learned_weights(network: Network, recording: Recording) -> tuple[IntArray, IntArray]:
    """The columns of weights that were learned, and their places in the network. Weights that follow parameters are
    what these make of them."""
    follows = np.zeros(len(network.connections), dtype=np.bool_)
    for binding in network.settable.bindings:
        if binding.weights:
            follows[binding.indices] = True
    for binding in network.settable.given_by_events:  # these are kept as those that are learned
        follows[binding.indices] = False
    columns, places = [], []
    for column, index in enumerate(recording.plastic.tolist()):
        name = recording.connection_names[index]
        place = network.connection_index.get(name)
        if place is None:
            raise RecordingError(_does_not_fit("connection", name, f"'{network.name}'", network.connection_index))
        if not follows[place]:
            columns.append(column)
            places.append(place)
    return np.array(columns, dtype=np.int64), np.array(places, dtype=np.int64)


def _does_not_fit(what: str, name: str, place: str, known: Mapping[str, int]) -> str:
    hint = suggest(name, known)
    return f"the recording does not fit: {place} has no {what} '{name}'" + (f"; {hint}" if hint else "")
