"""A recording and a network that it may be of: what a table leaves out, the network knows.

In: a Recording and a Network. Out: the Recording with all connections of the network, or what is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import Columns, Keep, Numbers, Probe, columns_of, recording_of, spiking_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.rows import After
from neurovis_spec.runtime.spikes import Fired


def fitted(recording: Recording, network: Network) -> Recording:
    """A recording with all connections of the network: a ``.csv`` holds the changing ones alone, or none, and may hold
    some neurons alone; the others are the network's. Raises RecordingError for a recording of another network: its
    neurons and connections are not the same."""
    sources, targets = network.connections.sources.whole(), network.connections.targets.whole()
    same_neurons = recording.neurons == network.neurons.names
    if same_neurons and np.array_equal(recording.sources, sources) and np.array_equal(recording.targets, targets):
        return with_spikes(recording, network)
    table = of_table(recording, network)
    if table is None:
        whose = f"{recording.network or 'unnamed'}, {plural(len(recording.neurons), 'neuron')}"
        raise RecordingError(f"the recording is of another network ({whose})")
    return with_spikes(table, network)


def with_spikes(recording: Recording, network: Network) -> Recording:
    """A recording that holds no spikes with those that its rows tell, of the neurons of which they tell them: by their
    activities, or by the state, where that was recorded."""
    spiking = spiking_of(network, recording.recorded)
    if recording.spiking is not None or not spiking or not len(recording):
        return recording
    place = {name: column for column, name in enumerate(recording.state_names)}
    known = [name in place for name in spiking.probe.names]
    columns = [place[name] for name in spiking.probe.names if name in place]
    told = replace(spiking, by_state=spiking.by_state[known])
    by_activity = spiking.by_activity
    if recording.recorded is not None:
        by_activity = np.searchsorted(recording.recorded, by_activity)
    nobody = np.zeros(len(network.neurons), np.bool_)
    fired = told.of_rows(0, recording.activity[:, by_activity], recording.states[:, columns], nobody)
    steps = Fired(recording.step[fired.steps], fired.neurons, int(recording.step[0]), int(recording.step[-1]) + 1)
    return recording.with_fired(steps, told.neurons)


def of_table(recording: Recording, network: Network) -> Recording | None:
    """What a table holds, in the structure of a network whose neurons and changing connections it names; else None."""
    changing = tuple(network.connection_names[index] for index in network.changing.tolist())
    table = not recording.hash and len(recording.plastic) == len(recording.sources)
    known = all(name in network.neuron_index for name in recording.neurons)
    if not (table and known and set(recording.connection_names) <= set(changing)):
        return None
    indices = np.array([network.neuron_index[name] for name in recording.columns], dtype=np.int64)
    order = np.argsort(indices)
    named = np.array([network.connection_index[name] for name in recording.connection_names], dtype=np.int64)
    weights = np.argsort(named)
    rows = recording.rows._replace(activity=recording.activity[:, order], weights=recording.weights[:, weights])
    weights_after = np.full(len(changing), np.nan)
    weights_after[np.searchsorted(network.changing, named)] = recording.weights_after
    after = After(weights_after, recording.reached)
    held = columns_of(network, Keep(weights=len(named) > 0))
    columns = replace(
        held,
        weights=named[weights],
        neurons=None if len(indices) == len(network.neurons) else indices[order],
        probe=Probe(recording.state_names, ()),
        outputs=dict(_outputs(held, recording.state_names)),
        sensors=None if recording.sensors is None else recording.sensor_names,
    )
    return recording_of(
        network, columns, Numbers(recording.step, rows), network.connections.weights.whole(), after, recording.backend
    )


def _outputs(held: Columns, states: tuple[str, ...]) -> Iterator[tuple[str, tuple[tuple[int, ...], bool]]]:
    """The outputs that name states, where all of these are in a table with these ones."""
    place = {name: column for column, name in enumerate(states)}
    for name, (columns, single) in held.outputs.items():
        wanted = [held.probe.names[column] for column in columns]
        if place.keys() >= set(wanted):
            yield name, (tuple(place[one] for one in wanted), single)
