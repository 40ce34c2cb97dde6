"""Going on from a recording: what was learned is kept.

In: a Network and a Recording of it, or of a network with the same neurons. Out: the State before step 0 of a new run.

The last activities recorded become a[−1], the weights after the last step become w[0] of the connections that could
change, and the signals under way are formed again from the last rows, as far back as the delays reach and consecutive
steps were recorded (what lies before is 0). ``initial`` is not taken again. Steps count from 0, so inputs begin anew.
States of models and rules are no part of a recording and begin at their initial values; weights that could not change
are the network's own, so that a parameter given anew has its effect.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import suggest
from neurovis_spec.runtime.recording import Recording, RecordingError
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import State, initial_state


def resumed_state(network: Network, recording: Recording) -> State:
    """The state in which a run goes on. Raises RecordingError where names do not agree or the recording is empty."""
    if not len(recording):
        raise RecordingError("the recording holds no step to go on from")
    order = _matching_neurons(network, recording)
    changing = _matching_connections(network, recording)
    state = initial_state(network)
    state.continued = True
    depth = int(network.connections.delays.max(initial=1))
    for ago, row in _last_rows(recording, depth):
        activity = recording.activity[row][order]
        weights = state.weights.copy()
        weights[changing] = recording.weights[row]
        _send(network, state, -ago, activity, weights)
    state.activity = recording.activity[-1][order]
    state.weights[changing] = recording.weights_after
    return state


def _last_rows(recording: Recording, depth: int) -> list[tuple[int, int]]:
    """How many steps ago, and the row: the last consecutive steps, the latest first."""
    rows = []
    for ago in range(1, min(depth, len(recording)) + 1):
        if recording.step[-ago] != recording.step[-1] - ago + 1:
            break
        rows.append((ago, len(recording) - ago))
    return rows


def _send(network: Network, state: State, step: int, activity: FloatArray, weights: FloatArray) -> None:
    connections = network.connections
    under_way = np.flatnonzero(connections.delays >= -step)
    offsets = signal_layout(network).offsets[under_way]
    with np.errstate(all="ignore"):
        signals = weights[under_way] * activity[connections.sources[under_way]]
    state.signals[offsets + step % connections.delays[under_way]] = signals
    if -step < len(state.history):
        state.history[step % len(state.history)] = activity


def _matching_neurons(network: Network, recording: Recording) -> IntArray:
    """For each neuron of the network its column in the recording."""
    columns = {name: column for column, name in enumerate(recording.neurons)}
    for name in network.neurons.names:
        if name not in columns:
            raise RecordingError(_without("neuron", name, "the recording", columns))
    for name in recording.neurons:
        if name not in network.neuron_index:
            raise RecordingError(_without("neuron", name, f"'{network.name}'", network.neuron_index))
    return np.array([columns[name] for name in network.neurons.names], dtype=np.int64)


def _matching_connections(network: Network, recording: Recording) -> IntArray:
    """For each changing connection of the recording its index in the network."""
    names = [recording.connection_names[index] for index in recording.plastic.tolist()]
    for name in names:
        if name not in network.connection_index:
            raise RecordingError(_without("connection", name, f"'{network.name}'", network.connection_index))
    return np.array([network.connection_index[name] for name in names], dtype=np.int64)


def _without(what: str, name: str, place: str, known: Mapping[str, int]) -> str:
    hint = suggest(name, known)
    return f"the recording does not fit: {place} has no {what} '{name}'" + (f"; {hint}" if hint else "")
