"""The content hash of a network: what of it is content, how that is called there, and in which order it stands.

In: a Network. Out: its hash. What the spec writes in some order, and no run depends on it, is put in one that depends
on names alone: inputs, outputs, and the parameters, states and signals of definitions. What counts by the place of an
input counts by its place here.

Names of kinds and fields are those of the first version, whatever the types are called by now.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.digest import TREES, Content, Record, content, digest
from neurovis_spec.compiler.names.state_references import singles
from neurovis_spec.compiler.network import Connections, Group, Input, Network, Neurons, Noise, Output
from neurovis_spec.compiler.program import (
    ACTIVATION,
    DRIVE,
    FEED,
    MODEL,
    RULE,
    SYNAPSE,
    Definition,
    Hidden,
    Population,
    Projection,
    Quantity,
)

#: What of each type is content. What follows parameters shows by the parameters; ``starts``, states of outputs and what
#: is of ports and flows are put behind the rest, where there are some.
SCHEMA: Mapping[type, Content] = {
    **TREES,
    Neurons: content("Neurons", "names groups bias initial input position", "labels starts port_bias port_input"),
    Group: content(
        "Group",
        "name start count activation model combine activation_parameters model_parameters input",
        "box role description module spikes",
    ),
    Connections: content(
        "Connections",
        "sources targets weights centres delays rules entry low high entries",
        "descriptions learns labels routes undelayed synapses twins lags tied own_labels styles",
    ),
    Input: content("Input", "name start size expression table", "slots parts hold indexed spikes widths"),
    Output: content("Output", "name neurons scalar", "states"),
    Quantity: content("Quantity", "name initial each_step each_episode", "derivative noise unit acts"),
    Hidden: content("Quantity", "name initial each_step each_episode", "derivative noise unit acts"),
    Noise: content("Noise", "name members start expression parameters", "slots widths port state"),
}


def content_hash(network: Network) -> str:
    """The hash of a network, before events change anything in it."""
    neurons = network.neurons
    outlets = [one.name for one in network.outlets]
    members = [len(network.populations[one.population].members) for one in network.outlets]
    names = np.repeat(["", *outlets, ""], [len(neurons), *members, network.input_size])
    arranged, places = _arranged(network.inputs)
    count = len(neurons)
    moved = np.concatenate((network.neuron_of, count + places))
    return digest(
        "neurovis 1",
        network.name,
        network.dt,
        network.episode,
        network.seed,
        network.parameters,
        replace(neurons, input=np.append(places, -1)[neurons.input]),  # −1, without an input, stays −1
        network.connections,
        arranged,
        sorted(network.outputs, key=lambda output: output.name),
        [_population(one) for one in network.populations],
        [_projection(one, moved, names) for one in network.projections],
        network.noises,
        *((output.name, *singles(output.states)) for output in network.outputs if output.states),
        *([("starts", neurons.starts)] if neurons.starts else []),
        *_flows(network, places),
        schema=SCHEMA,
    )


def _flows(network: Network, places: IntArray) -> Iterator[tuple[object, ...]]:
    """What there is of ports and flows beside the definitions; nothing in most networks. ``places``: where each number
    of the vector of all inputs is here."""
    neurons = network.neurons
    if network.connections.routes:
        yield "routes", network.connections.routes
    if neurons.port_bias:
        yield "port_bias", neurons.port_bias
    if neurons.port_input:
        yield "port_input", {port: np.append(places, -1)[given] for port, given in neurons.port_input.items()}
    yield from (("noise", one.name, one.port, one.state) for one in network.noises if one.port != DRIVE)
    if indexed := sorted(one.name for one in network.inputs if one.indexed):
        yield "indexed", *indexed
    for one in sorted(network.inputs, key=lambda entry: entry.name):
        if one.spikes is not None:
            yield "spikes", one.name, one.spikes.times, one.spikes.indices
    if network.connections.lags is not None:
        yield "lags", network.connections.lags
    if network.connections.twins is not None:
        yield "twins", network.connections.twins
    if network.connections.tied is not None:
        yield "tied", network.connections.tied
    if (by := network.integration) is not None:
        yield "integrate", by.method, by.substeps
        if held := sorted(one.name for one in network.inputs if one.hold):
            yield "hold", *held


def _arranged(inputs: Sequence[Input]) -> tuple[list[Input], IntArray]:
    """The inputs by name, and where each number of the vector of all inputs stands then."""
    places = np.zeros(sum(entry.size for entry in inputs), dtype=np.int64)
    result: list[Input] = []
    start = 0
    for entry in sorted(inputs, key=lambda entry: entry.name):
        places[entry.start : entry.start + entry.size] = np.arange(start, start + entry.size)
        result.append(replace(entry, start=start))
        start += entry.size
    return result, places


def _population(population: Population) -> Record:
    """What of a population is content. Its names, here and below, stay as they were first hashed: hashes outlive a
    version."""
    fields: dict[str, object] = {
        "level": population.level,
        "members": population.members,
        "combine": population.drive.combine,
        "activation": _definition(population.activation.definition),
        "activation_parameters": population.activation.parameters,
        "model": _definition(population.model.definition),
        "model_parameters": population.model.parameters,
        "incoming": population.drive.incoming,
    }
    if population.shares is not None:
        fields["shares"] = population.shares
    return Record("Block", fields)


def _projection(one: Projection, moved: IntArray, names: npt.NDArray[np.str_]) -> Record:
    """``moved``: where each place of all activities, outlets and inputs is here, an outlet where its neuron is;
    ``names`` what each outlet is called."""
    signals = {name: moved[indices] for name, indices in one.signals.items()}
    rule, parameters = _definition(one.rule.definition), one.rule.parameters
    fields = {"rule": rule, "members": one.members, "parameters": parameters, "signals": signals}
    states = {name: names[indices].tolist() for name, indices in one.signals.items() if (names[indices] != "").any()}
    further: dict[str, object] = {"place": one.place, "states": states}
    if one.slots is not None:
        further |= {"feeds": (one.feeds, one.slots)}
    return Record("Plasticity", fields | {name: value for name, value in further.items() if value})


def _definition(made: Definition) -> Record:
    """What of a definition is content."""
    named = {"name": made.name, "parameters": sorted(made.parameters)}
    if made.kind == ACTIVATION:
        softmax = {"softmax": True} if made.softmax else {}
        return Record("Activation", {**named, "value": made.given.each_step, **softmax})
    inner = {"let": made.let, "state": sorted(made.state, key=_named)}
    if made.kind == MODEL:
        return Record("Model", {**named, **inner, "activity": made.given.each_step, **_beyond(made)})
    if made.kind == RULE:
        steps = {"each_step": made.given.each_step, "each_episode": made.given.each_episode}
        return Record("Rule", {**named, "signals": sorted(made.signals), **inner, **steps, **_beyond(made)})
    if made.kind == SYNAPSE:
        return Record("Synapse", {**named, **inner, "signal": made.given.each_step, **_beyond(made)})
    if made.kind == FEED:
        return Record("Feed", {**named, "let": made.let, **_beyond(made)})
    raise TypeError(f"no schema says what of a {made.kind.name} is content")


def _named(one: Quantity) -> str:
    return one.name


def _beyond(made: Definition) -> dict[str, object]:
    """What of a definition is content that the first ones had not: as far as it is there."""
    found: dict[str, object] = {
        "flows": [(one.name, one.derivative, one.noise) for one in sorted(made.flows, key=_named)],
        "ports": sorted((port.name, port.combine) for port in made.ports),
        "outputs": [(one.name, one.each_step) for one in sorted(made.outputs, key=_named)],
        "send": made.send,
        "derivative": made.given.derivative,
        "gives": "" if made.given.name == made.kind.gives or made.kind == FEED else made.given.name,
        "per_second": None if made.per_second == 1 else made.per_second,
        "acts": [(one.name, *act) for one in sorted((*made.gives, *made.state), key=_named) for act in one.acts],
        "fires": made.fires,
    }
    return {name: value for name, value in found.items() if value}
