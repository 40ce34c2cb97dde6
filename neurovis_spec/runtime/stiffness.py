"""How stiff a network becomes in a run: whether a step is too long for what decays fastest, later than as it begins.

In: a Network, how many steps, the conditions of a run that is under way. Out: the state whose derivative falls fastest
with it, over all these steps, or None. It is found in a run of its own, by the exponential method, which stays stable
where others diverge; each model gives its slopes (the diagonal of its Jacobian) as outputs there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.compiler.flows import jacobian, with_slope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Integrate, Population, Quantity
from neurovis_spec.compiler.stiffness import Stiffest, limit_of
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.runtime.backend import BackendError, ready
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.state import Conditions, State, initial_state

#: The most steps of such a run, and the most numbers: steps times neurons and connections.
_MOST_STEPS: Final = 1_000
_MOST_NUMBERS: Final = 2_000_000


class _Slope(NamedTuple):
    """Where the slope of a state is kept."""

    population: Population
    state: str
    kept: str


def stiffest_of_run(network: Network, steps: int, conditions: Conditions | None = None) -> Stiffest | None:
    """What is too stiff for the method in a run of so many steps, as far as it is followed, most of all; None where
    nothing is, or nothing is known of it. ``conditions`` are those of a run under way."""
    steps = min(steps, _MOST_STEPS, _MOST_NUMBERS // (len(network.neurons) + len(network.connections)))
    if limit_of(network) is None or not steps:
        return None
    try:
        sloped, slopes = _with_slopes(network)
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
            found += (_least(network, one, state, k) for one in slopes)
            found = [min(found, key=lambda one: one.slope)]
    return found[0] if found and found[0].is_too_stiff(network) else None


def _least(network: Network, slope: _Slope, state: State, k: int) -> Stiffest:
    """The least slope of a state that is finite, 0 where none is, and the neuron that has it."""
    population = slope.population
    values = state.cells[population.model.owner][slope.kept]
    values = np.where(np.isfinite(values), values, 0.0)
    place = int(np.argmin(values))
    neuron = network.neurons.names[population.members[place]]
    return Stiffest(neuron, slope.state, float(values[place]) * population.model.definition.per_second, k)


def _with_slopes(network: Network) -> tuple[Network, list[_Slope]]:
    """The network by the exponential method, in which models give their slopes; and where these are kept. Raises
    ExpressionError."""
    slopes: list[_Slope] = []
    populations = []
    for population in network.populations:
        model, activation = population.model, population.activation
        definition = model.definition
        if definition.flows:
            found = jacobian(definition)
            given = tuple(Quantity(f"d {state}'/d {state}", tree) for state, tree in found.diagonal.items())
            definition = replace(definition, let=(*definition.let, *found.let), gives=(*definition.gives, *given))
            if definition.reads_activation:
                activation = replace(activation, definition=with_slope(activation.definition))
            slopes += (_Slope(population, state, f"d {state}'/d {state}") for state in found.diagonal)
        populations.append(replace(population, model=replace(model, definition=definition), activation=activation))
    program = tuple(
        replace(one, method="exponential") if isinstance(one, Integrate) else one for one in network.program
    )
    return replace(network, populations=tuple(populations), program=program), slopes
