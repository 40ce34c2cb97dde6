"""How stiff a network becomes in a run: whether a step is too long for what decays fastest, later than as it begins.

In: a Network, how many steps, the conditions of a run that is under way. Out: the state whose derivative falls fastest
with it, over all these steps, or None. It is found in a run of its own, by the exponential method, which stays stable
where others diverge; each model gives its slopes (the diagonal of its Jacobian) as outputs there, and how they change
with ports through which synapses give way to a state.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.flows import jacobian, with_slope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Integrate, Population, Port, Quantity
from neurovis_spec.compiler.stiffness import Stiffest, limit_of
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.runtime.backend import BackendError, ready
from neurovis_spec.runtime.formed import formed
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.stages import Contacts, Formulas, contacts_of, formed_at, parts_of
from neurovis_spec.runtime.state import Conditions, State, initial_state

#: The most steps of such a run, and the most numbers: steps times neurons and connections.
_MOST_STEPS: Final = 1_000
_MOST_NUMBERS: Final = 2_000_000


class _Slope(NamedTuple):
    """Where the slope of a state is kept, and, by ports through which it changes, how much it does with these."""

    population: Population
    state: str
    kept: str
    through: tuple[tuple[Port, str], ...] = ()


def stiffest_of_run(network: Network, steps: int, conditions: Conditions | None = None) -> Stiffest | None:
    """What is too stiff for the method in a run of so many steps, as far as it is followed, most of all; None where
    nothing is, or nothing is known of it. ``conditions`` are those of a run under way."""
    steps = min(steps, _MOST_STEPS, _MOST_NUMBERS // (len(network.neurons) + len(network.connections)))
    if limit_of(network) is None or not steps:
        return None
    try:
        sloped, slopes, contacts = _with_slopes(network)
        made = ready(sloped, "numpy")
    except (ExpressionError, BackendError):
        return None  # a derivative is too long, or array code does not carry all that there is
    if not slopes:
        return None  # connections alone have states that flow
    state = initial_state(sloped)
    if conditions is not None:
        state.conditions = conditions.copy()
    reader = InputReader(sloped, by=made.functions)
    reader.use(state)
    found: list[Stiffest] = []
    with np.errstate(all="ignore"):
        for k, vector in enumerate(reader.rows(0, steps)):
            made.stepper.step(state, vector)
            found += (_least(sloped, one, contacts, state, k) for one in slopes)
            found = [min(found, key=lambda one: one.slope)]
    return found[0] if found and found[0].is_too_stiff(network) else None


def _least(network: Network, slope: _Slope, contacts: Mapping[int, Contacts], state: State, k: int) -> Stiffest:
    """The least slope of a state that is finite, 0 where none is, and the neuron that has it."""
    population = slope.population
    cells = state.cells[population.model.owner]
    values = cells[slope.kept]
    for port, kept in slope.through:
        values = values + cells[kept] * _giving_way(network, port, slope.state, contacts, state, len(values))
    values = np.where(np.isfinite(values), values, 0.0)
    place = int(np.argmin(values))
    neuron = network.neurons.names[population.members[place]]
    return Stiffest(neuron, slope.state, float(values[place]) * population.model.definition.per_second, k)


def _giving_way(
    network: Network, port: Port, name: str, contacts: Mapping[int, Contacts], state: State, count: int
) -> FloatArray:
    """How much what synapses bring to a port of so many neurons changes with a state of these."""
    result = np.zeros(count)
    for one in formed_at(network, port.incoming):
        back = contacts[one.number].back if one.number in contacts else Formulas()
        if (tree := dict(back.trees).get(name)) is not None:
            slopes = formed(network, contacts[one.number].projection, back._replace(trees=((name, tree),)), state)
            factors = 1.0 if port.factors is None else port.factors[one.places]
            np.add.at(result, port.slots[one.places], slopes[one.members] * factors)
    return result


def _with_slopes(network: Network) -> tuple[Network, list[_Slope], Mapping[int, Contacts]]:
    """The network by the exponential method, in which models give their slopes; where these are kept; and of synapses
    what changes with their targets. Raises ExpressionError."""
    by = network.integration
    assert by is not None
    by = replace(by, method="exponential")
    contacts = contacts_of(network, by)
    through = {part.number: part.through for part in parts_of(network, by, contacts)}
    slopes: list[_Slope] = []
    populations = []
    for number, population in enumerate(network.populations):
        model, activation = population.model, population.activation
        definition = model.definition
        if definition.flows:
            found = jacobian(definition)
            trees = {f"d {state}'/d {state}": tree for state, tree in found.diagonal.items()}
            let = dict((*definition.let, *found.let))
            for one in through.get(number, ()):
                trees |= one.slope.trees
                let |= one.slope.let
            given = tuple(Quantity(name, tree) for name, tree in trees.items())
            definition = replace(definition, let=tuple(let.items()), gives=(*definition.gives, *given))
            if definition.reads_activation:
                activation = replace(activation, definition=with_slope(activation.definition))
            for state in found.diagonal:
                ports = ((one.port, one.slope.trees[0][0]) for one in through.get(number, ()) if one.state == state)
                slopes.append(_Slope(population, state, f"d {state}'/d {state}", tuple(ports)))
        populations.append(replace(population, model=replace(model, definition=definition), activation=activation))
    program = tuple(by if isinstance(one, Integrate) else one for one in network.program)
    sloped = replace(network, populations=tuple(populations), program=program)
    return sloped, slopes, {one.number: one for one in contacts}
