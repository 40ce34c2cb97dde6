"""What follows parameters, from all parts of a network, as bindings of its arrays (§9).

In: the slots, the parts of groups, entries and inputs that follow formulas, the network that was made of these. Out:
Settable.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, frozen
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
    table_of,
)
from neurovis_spec.compiler.network import Located, Network, Noise
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import Key, Owner
from neurovis_spec.language.expressions.tree import Number

#: Fields that are no numbers of a network: the first weights of what learns, and positions.
_ELSEWHERE = ("first", "position")


class Found(NamedTuple):
    """A formula for some numbers of an array."""

    array: Key
    places: IntArray
    part: Part


def found_in(network: Network, census: Census, bundles: tuple[Bundle, ...]) -> Iterator[Found]:
    """What follows parameters in all of a network: of neurons, connections, and tables of inputs."""
    neurons, connections = network.located("neuron"), network.located("connection")
    for one in census.groups:
        for part in one.parts:
            yield from _found(part, one.group.start + part.within(one.group.count), neurons)
    start = 0
    for bundle in bundles:
        count = len(bundle.sources)
        for part in bundle.parts if count else ():
            yield from _found(part, start + part.within(count), connections)
        start += count
    for number, entry in enumerate(network.inputs):
        for part in entry.parts:
            assert entry.table is not None
            yield Found(table_of(number), part.within(entry.table.size), part)


def _found(part: Part, members: IntArray, located: Located) -> Iterator[Found]:
    """A part of some neurons or connections: of a definition, which may be in use at several populations, or of what
    the network has one of."""
    if part.name:
        numbers = located.numbers[members]
        owners = np.unique(numbers).tolist()
        for number in owners:
            inside = np.flatnonzero(numbers == number)
            own = part if len(owners) == 1 else part.subset(inside)
            yield Found(Key(Owner(part.field, number), part.name), located.positions[members[inside]], own)
    elif part.field not in _ELSEWHERE:
        yield Found(Key(None, part.field), members, part)


def make_settable(network: Network, slots: tuple[Slot, ...], found: Iterable[Found]) -> Settable:
    """The bindings of a network, those of the same formula as one, and the arrays that they write to."""
    if not slots:  # nothing can be set
        return Settable()
    arrays = _arrays(network)
    merged = list(_merged([one for one in found if len(one.places)]))  # a cell may be of no connection
    by_array: dict[Key, list[Found]] = {}
    for one in merged:
        by_array.setdefault(one.array, []).append(one)
    variables: dict[Key, Variable] = {}
    initial: list[FloatArray] = [np.zeros(0)]
    start = 0
    for array in sorted(by_array.keys() - {WEIGHTS}, key=lambda key: key.text):  # the order in checkpoints
        whole, own = arrays[array], by_array[array]
        if len(own) == 1 and _is_one_number(own[0].part.formula) and len(own[0].places) == len(whole) > 0:
            whole = whole[:1]
        variables[array] = Variable(start, len(whole))
        initial.append(np.asarray(whole, dtype=np.float64))
        start += len(whole)
    bindings = [_binding(one, variables.get(one.array), len(arrays.get(one.array, ()))) for one in merged]
    bindings += [binding for noise in network.noises for binding in _of_noise(noise)]
    return Settable(slots, tuple(bindings), variables, frozen(np.concatenate(initial)))


def _arrays(network: Network) -> Mapping[Key, FloatArray]:
    """The arrays of a network, all numbers of which can be set."""
    connections = network.connections
    arrays = {
        BIAS: network.neurons.bias,
        CENTRES: connections.centres.whole(),
        LOW: connections.low.whole(),
        HIGH: connections.high.whole(),
    }
    for _, use in network.uses:
        arrays |= {Key(use.owner, name): values for name, values in use.parameters.items()}
    for number, entry in enumerate(network.inputs):
        if entry.table is not None:
            arrays[table_of(number)] = entry.table.ravel()
    return arrays


def _binding(one: Found, variable: Variable | None, size: int) -> Binding:
    """Some numbers of an array of this size that follow a formula; of the weights where it is no variable."""
    indices, part = one.places, one.part
    if variable is not None:
        indices = variable.start + (one.places if variable.size == size else one.places[:1])
    weights = variable is None
    return Binding(part.formula, weights, frozen(indices), one.array, frozen(one.places), part.low, part.high)


def _of_noise(noise: Noise) -> Iterator[Binding]:
    """The spreads of a noise, which nothing is written to, and none of which may become negative."""
    for width in noise.widths:
        yield Binding(width, False, NO_INDICES, NOISE, NO_INDICES, ParameterFormula(Number(0.0), {}))


def own_weights(slots: tuple[Slot, ...], bundles: tuple[Bundle, ...], weights: FloatArray) -> FloatArray | None:
    """The first weights with the parameters as the spec has them; None where none are given from outside."""
    if not any(slot.given for slot in slots):
        return None
    own = np.zeros(len(slots))
    for place, slot in enumerate(slots):
        formula = slot.own if slot.given else slot.formula
        own[place] = slot.value if formula is None else formula.values(own)
    result = weights.copy()
    start = 0
    for bundle in bundles:
        count = len(bundle.sources)
        for part in bundle.parts:
            if part.field in ("weights", "first"):
                result[start + part.within(count)] = part.formula.values(own)
        start += count
    return frozen(result)


def _is_one_number(formula: Dependent) -> bool:
    return isinstance(formula, ParameterFormula) and formula.plain


def _merged(found: list[Found]) -> Iterator[Found]:
    """Numbers of an array that follow the same formula, which gives one number, as one."""
    groups: dict[Hashable, list[Found]] = {}
    for place, one in enumerate(found):
        formula = one.part.formula
        key: Hashable = (one.array, place)
        if isinstance(formula, ParameterFormula) and formula.plain and one.part.low is None and one.part.high is None:
            key = (one.array, formula.tree, tuple(formula.slot_of.items()), tuple(formula.known.items()))
        groups.setdefault(key, []).append(one)
    for parts in groups.values():
        places = np.concatenate([one.places for one in parts])
        yield parts[0]._replace(places=places)
