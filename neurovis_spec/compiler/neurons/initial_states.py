"""Initial states: the values with which the states of definitions in use begin.

In: a definition in use at neurons or connections. Out: the value of each state before step 0, one a member: what the
group says (``initial: {v: …}``), else what the definition says; and what formulas of a model see then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.program import Population, Use
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, PLAIN
from neurovis_spec.language.expressions.tree import Tree


def initial_states(
    use: Use, members: IntArray, dt: float, given: Mapping[str, FloatArray] = MappingProxyType({})
) -> dict[str, FloatArray]:
    """The initial values of each state and output by its name, one per member, in new arrays. ``given`` has for each
    state the value of every neuron of the network, NaN where its group gives none; then it is the definition's."""
    definition = use.definition
    known: dict[str, Value] = {**CONSTANTS, "dt": dt * definition.per_second, **use.parameters}
    result: dict[str, FloatArray] = {}
    for state in definition.kept:
        # by the functions of the C library, whatever computes the steps: all begin in the same state
        initial = evaluate_array(state.initial, known, by=PLAIN)
        values = np.array(np.broadcast_to(initial, members.shape), dtype=np.float64)
        if state.name in given:
            of_members = given[state.name][members]
            values = np.where(np.isnan(of_members), values, of_members)
        result[state.name] = values
    return result


class Beginning(NamedTuple):
    """What formulas of a model see where a run begins: values by their names, and what they may call."""

    values: dict[str, Value]
    functions: Mapping[str, Callable[..., Value]]

    def of(self, tree: Tree) -> Value:
        """The value of a formula."""
        return evaluate_array(tree, self.values, functions=self.functions)


def beginning(
    population: Population, dt: float, given: Mapping[str, FloatArray], ports: Mapping[str, Value]
) -> Beginning:
    """What formulas of the model of a population see where a run begins, intermediate values among it. ``given`` is
    that of ``initial_states``, ``ports`` has the value of each port."""
    model = population.model.definition
    known: dict[str, Value] = {**CONSTANTS, "dt": dt, **population.activation.parameters}

    def function(tree: Tree) -> Callable[..., Value]:
        return lambda x: evaluate_array(tree, {**known, "x": x})

    values: dict[str, Value] = {**CONSTANTS, "dt": dt * model.per_second, "t": 0.0, "k": 0.0}
    values |= population.model.parameters
    values |= ports
    values |= initial_states(population.model, population.members, dt, given)
    functions = {name: function(tree) for name, tree in population.activation.definition.functions.items()}
    found = Beginning(values, functions)
    for name, tree in model.let:
        values[name] = found.of(tree)
    return found
