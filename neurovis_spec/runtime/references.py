"""What references name in a network: neurons, connections, states of models and rules.

In: a Network, a reference as a spec writes it. Out: indices, or KeyError with the nearest names.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.names.given import given_of
from neurovis_spec.compiler.names.state_references import (
    Holder,
    Refusal,
    StateOf,
    Wiring,
    connections_state,
    model_state,
)
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import MODEL, RULE, SYNAPSE, Check, Kind
from neurovis_spec.language.references import Arrow, Part, Sum, parse, parse_sum, state_of
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.errors import UnknownNameError
from neurovis_spec.runtime.names import Names, names_of


def find_neurons(reference: str, names: Names) -> tuple[int, ...]:
    """The neurons of a reference. Raises KeyError."""
    found = names.find(reference)
    if isinstance(found, str):
        raise UnknownNameError(found)
    return found.neurons


def find_connections(network: Network, reference: str, names: Names) -> IntArray:
    """The connections of ``FROM -> TO``, or the one of several with the same ends that is called ``A -> B (2)``. Raises
    KeyError."""
    found = parse(reference)
    if not isinstance(found, Arrow):
        raise UnknownNameError(f"'{reference}' is no connection: write FROM -> TO")
    connections = _between(network, found, names)
    if not len(connections):
        hint = suggest(reference, (*network.connections.entries, *network.connection_names), "connections")
        raise UnknownNameError(f"there is no connection '{reference}'" + (f"; {hint}" if hint else ""))
    return connections


def find_parts(network: Network, reference: str, names: Names) -> tuple[IntArray, IntArray]:
    """The neurons, or else the connections, that a reference names. Raises KeyError."""
    none: IntArray = np.zeros(0, dtype=np.int64)
    if isinstance(parse(reference), Sum):
        return np.array(find_neurons(reference, names), dtype=np.int64), none
    return none, find_connections(network, reference, names)


def _between(network: Network, arrow: Arrow, names: Names) -> IntArray:
    if arrow.text.endswith(")") and arrow.text in network.connection_index:
        return np.array([network.connection_index[arrow.text]], dtype=np.int64)
    sources, targets = find_neurons(arrow.sources.text, names), find_neurons(arrow.targets.text, names)
    return _wiring_of(network).between(sources, targets)


def find_states(network: Network, reference: str, names: Names | None = None) -> tuple[StateOf, ...]:
    """The states of a reference (``K.v``, ``(K -> O).eligibility``, several joined with ``+``, or ``all``), outputs of
    models among them. Raises KeyError with the nearest names."""
    names = names_of(network) if names is None else names
    if reference == "all" and isinstance(names.find(reference), str):
        return all_states(network)
    return tuple(_state(network, part, names) for part in parse_sum(reference))


def find_recorded(network: Network, reference: str, names: Names | None) -> tuple[tuple[StateOf, ...], tuple[int, ...]]:
    """The states of a reference, as ``find_states`` gives them, and the places of what inputs are given that it names
    (``push.given``). Raises KeyError with the nearest names."""
    states: list[StateOf] = []
    places: list[int] = []
    for part in parse_sum(reference):
        given = find_given(network, part.text)
        if given is None:
            states += find_states(network, part.text, names)
        places += given or ()
    return tuple(states), tuple(places)


def find_given(network: Network, reference: str) -> range | None:
    """The places of what an input is given (``push.given``, ``touch[2].given``); None for any other reference. Raises
    KeyError."""
    found = given_of(reference, network.input_index)
    if isinstance(found, Refusal):
        raise UnknownNameError(str(found))
    return found


def find_lasting_state(network: Network, reference: str) -> StateOf | None:
    """The state of models that ``K.v`` names, or of rules and synapses (``(K -> O).g``), which lasts, as outputs do
    not; None for what is no such reference. Raises KeyError with the nearest names."""
    part, *others = parse_sum(reference)
    name, names = None if others else state_of(part), names_of(network)
    if name is None:
        return None
    if isinstance(name.owner, Arrow):
        return _state(network, part, names, outputs=False)
    if isinstance(names.find(name.owner.text), str):
        return None
    neurons = find_neurons(name.owner.text, names)
    if any(name.state in one.outputs and np.isin(neurons, one.members).any() for one in _holders_of(network, MODEL)):
        raise UnknownNameError(f"'{reference}' is an output, made anew at each step: clamp a state, or the neurons")
    return _state(network, part, names, outputs=False)


def all_states(network: Network) -> tuple[StateOf, ...]:
    """All that models and rules keep, outputs of models among it; and whether what fires is armed, and for how long it
    rests, without which no run could go on from what is recorded."""
    return tuple(
        StateOf.of(use.definition.kind.each, one.name, holder.members)
        for holder, use in network.uses
        for one in use.definition.kept
        if not isinstance(one, Check)
    )


def _state(network: Network, part: Part, names: Names, *, outputs: bool = True) -> StateOf:
    text = part.text
    if not isinstance(names.find(text), str):
        raise UnknownNameError(f"'{text}' is no state: its activity is recorded as that of a neuron, group or output")
    name = state_of(part)
    if name is None:
        raise UnknownNameError(f"'{text}' is no state: write K.v for v of K's model, (K -> O).v for that of a rule")
    if isinstance(name.owner, Arrow):
        one = connections_state(name, _between(network, name.owner, names), _wiring_of(network), outputs=outputs)
    else:
        holders = _holders_of(network, MODEL)
        if not outputs:
            holders = tuple(holder._replace(outputs=()) for holder in holders)
        one = model_state(name, find_neurons(name.owner.text, names), holders)
    assert one is not UNKNOWN  # no connection of a network is invalid
    if isinstance(one, Refusal):
        raise UnknownNameError(f"'{text}': {one}")
    return one


def _holders_of(network: Network, kind: Kind) -> tuple[Holder, ...]:
    """The states of all definitions of a kind, with those that have them; a centre that learns is one."""
    return tuple(
        Holder(
            holder.members,
            made.name,
            tuple(one.name for one in made.holdable),
            tuple(one.name for one in made.outputs),
        )
        for holder, made in ((holder, use.definition) for holder, use in network.uses)
        if made.kind == kind
    )


def _each_sharing(network: Network, synapses: Iterable[Holder]) -> Iterator[Holder]:
    """The states of all synapses, those that are shared with all connections that have them together."""
    numbers = (number for number, one in enumerate(network.projections) if one.kind == SYNAPSE)
    for number, one in zip(numbers, synapses, strict=True):
        members = network.fed.get(number)
        if members is None:
            yield one
        else:
            yield one._replace(members=members, carriers=one.members[network.synapses.positions[members]])


def _wiring_of(network: Network) -> Wiring:
    """All connections, with the states of their rules and synapses."""
    rules, synapses = (_holders_of(network, kind) for kind in (RULE, SYNAPSE))
    synapses = tuple(one._replace(outputs=(SYNAPSE.gives,)) for one in _each_sharing(network, synapses))
    connections = network.connections
    ends = connections.sources.whole(), connections.targets.whole()
    return Wiring(*ends, connections.entries, rules, synapses=synapses)
