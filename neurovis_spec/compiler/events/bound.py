"""What follows parameters, from all parts of a network, as bindings of its arrays.

In: the slots, the parts of groups, entries and inputs, the network that was made of these. Out: Settable. A Part says
which numbers of a group follow a formula, a Binding which numbers of an array of the network do (``settable``).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Column, FloatArray, FloatColumn, IntArray, frozen
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.events.changes import NO_INDICES
from neurovis_spec.compiler.events.settable import (
    BIAS,
    CENTRES,
    HIGH,
    LOW,
    NOISE,
    WEIGHTS,
    Binding,
    Dependent,
    ParameterFormula,
    Part,
    Settable,
    Slot,
    Variable,
    bias_of,
    table_of,
)
from neurovis_spec.compiler.network import Located, Network
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import FEED, SYNAPSE, Definition, Key, Owner
from neurovis_spec.language.expressions.tree import Number

#: Fields that are no numbers of a network: the first weights and centres of what learns, and positions.
_ELSEWHERE = ("initial_weights", "initial_centres", "position")


class LocatedPart(NamedTuple):
    """A part, with the array of the network that its numbers stand in, and their indices there."""

    array: Key
    places: IntArray
    part: Part


def found_in(network: Network, census: Census, bundles: tuple[Bundle, ...]) -> Iterator[LocatedPart]:
    """The parts of all of a network: of neurons, connections, and tables of inputs."""
    neurons, connections = network.located("neuron"), dict[tuple[str, str, str], Located]()

    def at_connections(part: Part) -> Located:
        """Where the definition is in use that a part is of: the parts of some connections may be of several."""
        key = part.field, part.of, part.name
        if key not in connections:
            connections[key] = network.located("connection", partial(_has, key))
        return connections[key]

    for one in census.groups:
        for part in one.parts:
            yield from _found(part, one.group.start + part.within(one.group.count), lambda part: neurons)
    start = 0
    for bundle in bundles:
        count = len(bundle.sources)
        parts = bundle.parts if count else ()
        if bundle.carriers is not None:  # what is shared is of two definitions
            feeding = (part._replace(field=FEED.name) for part in parts if part.name and part.field == SYNAPSE.name)
            parts = (*parts, *feeding)
        for part in parts:
            yield from _found(part, start + part.within(count), at_connections)
        start += count
    for number, entry in enumerate(network.inputs):
        for part in entry.parts:
            assert entry.table is not None
            yield LocatedPart(table_of(number), part.within(entry.table.size), part)


def _has(key: tuple[str, str, str], one: Definition) -> bool:
    """Whether a definition is of a kind and has a name and a parameter."""
    return (one.kind.name, one.name) == key[:2] and key[2] in one.parameters


def _found(part: Part, members: IntArray, locate: Callable[[Part], Located]) -> Iterator[LocatedPart]:
    """A part of some neurons or connections: of a definition, which may be in use at several populations, or of what
    the network has one of. ``locate`` says where a definition is in use."""
    if part.field == BIAS.name:
        yield LocatedPart(bias_of(part.name), members, part)
    elif part.name:
        located = locate(part)
        numbers = located.numbers[members]
        owners = np.flatnonzero(np.bincount(numbers + 1)[1:]).tolist()  # np.unique would import numpy.ma
        for number in owners:
            inside = np.flatnonzero(numbers == number)
            array = Key(Owner(part.field, number), part.name)
            of_owner = part if len(inside) == len(members) else part.subset(inside)
            yield LocatedPart(array, located.positions[members[inside]], of_owner)
    elif part.field not in _ELSEWHERE:
        yield LocatedPart(Key(None, part.field), members, part)


def make_settable(network: Network, slots: tuple[Slot, ...], found: Iterable[LocatedPart]) -> Settable:
    """The slots and bindings of a network, and the arrays that the bindings write to. Parts with the same formula
    become one binding; an array of which all numbers follow one number takes one place among the variables."""
    if not slots:  # nothing can be set
        return Settable()
    arrays = _arrays(network)
    merged = list(_merged([located for located in found if len(located.places)]))  # a cell may be of no connection
    by_array: dict[Key, list[LocatedPart]] = {}
    for located in merged:
        by_array.setdefault(located.array, []).append(located)
    variables: dict[Key, Variable] = {}
    initial: list[FloatArray] = [np.zeros(0)]
    start = 0
    for array in sorted(by_array.keys() - {WEIGHTS}, key=lambda key: key.text):  # the order in checkpoints
        numbers, parts = arrays[array], by_array[array]
        is_one = len(parts) == 1 and _is_one_number(parts[0].part.formula)
        if is_one and len(parts[0].places) == len(numbers) > 0:
            numbers = numbers[:1]
        elif isinstance(numbers, Column):
            numbers = numbers.whole()
        variables[array] = Variable(start, len(numbers))
        initial.append(np.asarray(numbers, dtype=np.float64))
        start += len(numbers)
    bindings = [
        _binding(located, variables.get(located.array), len(arrays.get(located.array, ()))) for located in merged
    ]
    drawn = [*(one.widths for one in network.noises), *(one.widths for one in network.inputs)]
    bindings += [_of_width(width) for widths in drawn for width in widths]
    return Settable(slots, tuple(bindings), variables, frozen(np.concatenate(initial)))


def _arrays(network: Network) -> Mapping[Key, FloatArray | FloatColumn]:
    """The arrays of a network, all numbers of which can be set."""
    connections = network.connections
    arrays: dict[Key, FloatArray | FloatColumn] = {
        BIAS: network.neurons.bias,
        CENTRES: connections.centres,
        LOW: connections.low,
        HIGH: connections.high,
        **{bias_of(port): values for port, values in network.neurons.port_bias.items()},
    }
    for _, use in network.uses:
        arrays |= {Key(use.owner, name): values for name, values in use.parameters.items()}
    for number, entry in enumerate(network.inputs):
        if entry.table is not None:
            arrays[table_of(number)] = entry.table.ravel()
    return arrays


def _binding(located: LocatedPart, variable: Variable | None, size: int) -> Binding:
    """The binding of a part, whose array has this size; it is the weights where it is no variable."""
    array, places, part = located
    indices = places
    if variable is not None:
        indices = variable.start + (places if variable.size == size else places[:1])
    return Binding(
        formula=part.formula,
        weights=variable is None,
        indices=frozen(indices),
        array=array,
        places=frozen(places),
        low=part.low,
        high=part.high,
    )


def _of_width(width: ParameterFormula) -> Binding:
    """A spread of a noise or a rate of an input, which must not become negative. It is computed in a run, so that its
    binding writes nothing and only checks."""
    zero = ParameterFormula(Number(0.0), {})
    return Binding(width, weights=False, indices=NO_INDICES, array=NOISE, places=NO_INDICES, low=zero)


def own_weights(slots: tuple[Slot, ...], bundles: tuple[Bundle, ...], weights: FloatColumn) -> FloatArray | None:
    """The first weights with the parameters as the spec has them; None where none are given from outside."""
    if not any(slot.given for slot in slots):
        return None
    own = np.zeros(len(slots))
    for index, slot in enumerate(slots):  # a formula reads only slots before its own
        formula = slot.own if slot.given else slot.formula
        own[index] = slot.value if formula is None else formula.values(own)
    result: FloatArray = np.array(weights.whole())
    start = 0
    for bundle in bundles:
        count = len(bundle.sources)
        for part in bundle.parts:
            if part.field in ("weights", "initial_weights"):
                result[start + part.within(count)] = part.formula.values(own)
        start += count
    return frozen(result)


def _is_one_number(formula: Dependent) -> bool:
    return isinstance(formula, ParameterFormula) and formula.plain


def _merged(found: list[LocatedPart]) -> Iterator[LocatedPart]:
    """The parts, those of an array with the same formula, which gives one number, as one part."""
    groups: dict[Hashable, list[LocatedPart]] = {}
    for index, (array, _, part) in enumerate(found):
        formula = part.formula
        key: Hashable = (array, index)  # of this part alone
        if isinstance(formula, ParameterFormula) and formula.plain and part.low is None and part.high is None:
            key = (array, formula.tree, tuple(formula.slot_of.items()), tuple(formula.known.items()))
        groups.setdefault(key, []).append(found[index])
    for group in groups.values():
        yield group[0]._replace(places=np.concatenate([located.places for located in group]))
