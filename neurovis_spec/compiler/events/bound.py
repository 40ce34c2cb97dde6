"""What follows parameters, from all parts of a network, as bindings of its arrays (§9).

In: the slots, the parts of groups, entries and inputs that follow formulas, the blocks and plasticities. Out: Settable.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, frozen
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.events.changes import NO_INDICES
from neurovis_spec.compiler.events.settable import Binding, Dependent, ParameterFormula, Part, Settable, Slot, Variable
from neurovis_spec.compiler.network import Connections, Input, Noise
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.compiler.program import Block, Plasticity
from neurovis_spec.language.expressions.tree import Number


class _Found(NamedTuple):
    """A formula for some numbers of an array."""

    array: str
    places: IntArray
    part: Part


def make_settable(
    slots: tuple[Slot, ...],
    population: Population,
    bundles: tuple[Bundle, ...],
    connections: Connections,
    inputs: tuple[Input, ...],
    blocks: tuple[Block, ...],
    plasticity: tuple[Plasticity, ...],
    noises: tuple[Noise, ...],
) -> Settable:
    """The bindings of a network, those of the same formula as one, and the arrays that they write to."""
    arrays: dict[str, FloatArray] = {
        "bias": population.neurons.bias,
        "centres": connections.centres.whole(),
        "low": connections.low.whole(),
        "high": connections.high.whole(),
    }
    for number, block in enumerate(blocks):
        for kind, values in (("activation", block.activation_parameters), ("model", block.model_parameters)):
            arrays |= {f"{kind}/{number}/{name}": array for name, array in values.items()}
    for number, rule in enumerate(plasticity):
        arrays |= {f"rule/{number}/{name}": array for name, array in rule.parameters.items()}
    for number, entry in enumerate(inputs):
        if entry.table is not None:
            arrays[f"table/{number}"] = entry.table.ravel()
    found = [
        *_of_neurons(population, blocks),
        *_of_connections(bundles, connections, plasticity),
        *_of_inputs(inputs),
    ]
    merged = list(_merged([one for one in found if len(one.places)]))  # a cell may be of no connection
    variables: dict[str, Variable] = {}
    initial: list[FloatArray] = []
    start = 0
    by_array: dict[str, list[_Found]] = {}
    for one in merged:
        by_array.setdefault(one.array, []).append(one)
    for name in sorted(by_array.keys() - {"weights"}):
        own = by_array[name]
        whole = arrays[name]
        if len(own) == 1 and _is_one_number(own[0].part.formula) and len(own[0].places) == len(whole) > 0:
            whole = whole[:1]
        variables[name] = Variable(start, len(whole))
        initial.append(np.asarray(whole, dtype=np.float64))
        start += len(whole)
    bindings = []
    for one in merged:
        indices = one.places
        if one.array != "weights":
            place, size = variables[one.array]
            indices = place + (one.places if size == len(arrays[one.array]) else one.places[:1])
        part, places = one.part, frozen(one.places)
        bindings.append(
            Binding(part.formula, one.array == "weights", frozen(indices), one.array, places, part.low, part.high)
        )
    least = ParameterFormula(Number(0.0), {})
    for noise in noises:
        bindings += (Binding(width, False, NO_INDICES, "noise", NO_INDICES, least) for width in noise.widths)
    return Settable(slots, tuple(bindings), variables, frozen(np.concatenate([*initial, np.zeros(0)])))


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


def _of_neurons(population: Population, blocks: tuple[Block, ...]) -> Iterator[_Found]:
    n = len(population.neurons)
    home, position = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for number, block in enumerate(blocks):
        home[block.members] = number
        position[block.members] = np.arange(len(block.members))
    for group, part in ((one.group, part) for one in population.groups for part in one.parts):
        if part.field == "bias":
            yield _Found("bias", group.start + part.within(group.count), part)
        elif part.field in ("activation", "model"):  # neurons of a group may belong to several blocks
            members = group.start + part.within(group.count)
            blocked = np.unique(home[members])
            for number in blocked.tolist():
                inside = np.flatnonzero(home[members] == number)
                own = part if len(blocked) == 1 else part.some(inside)
                yield _Found(f"{part.field}/{number}/{part.name}", position[members[inside]], own)


def _of_connections(
    bundles: tuple[Bundle, ...], connections: Connections, plasticity: tuple[Plasticity, ...]
) -> Iterator[_Found]:
    position = np.zeros(len(connections), dtype=np.int64)
    for rule in plasticity:
        position[rule.members] = np.arange(len(rule.members))
    start = 0
    for bundle in bundles:
        count = len(bundle.sources)
        for part in bundle.parts if count else ():
            members = start + part.within(count)
            if part.field == "first":
                continue
            if part.field == "rule":
                yield _Found(f"rule/{int(connections.rules[start])}/{part.name}", position[members], part)
            else:
                yield _Found(part.field, members, part)
        start += count


def _of_inputs(inputs: tuple[Input, ...]) -> Iterator[_Found]:
    for number, entry in enumerate(inputs):
        for part in entry.parts:
            assert entry.table is not None
            yield _Found(f"table/{number}", part.within(entry.table.size), part)


def _is_one_number(formula: Dependent) -> bool:
    return isinstance(formula, ParameterFormula) and formula.plain


def _merged(found: list[_Found]) -> Iterator[_Found]:
    """Numbers of an array that follow the same formula, which gives one number, as one."""
    groups: dict[Hashable, list[_Found]] = {}
    for place, one in enumerate(found):
        formula = one.part.formula
        key: Hashable = (one.array, place)
        if isinstance(formula, ParameterFormula) and formula.plain and one.part.low is None and one.part.high is None:
            key = (one.array, formula.tree, tuple(formula.places.items()), tuple(formula.known.items()))
        groups.setdefault(key, []).append(one)
    for parts in groups.values():
        places = np.concatenate([one.places for one in parts])
        yield parts[0]._replace(places=places)
