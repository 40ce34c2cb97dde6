"""Initial states: the values with which the states of definitions in use begin.

In: a definition in use at neurons or connections. Out: the value of each state before step 0, one a member: what the
group says (``initial: {v: …}``), else what the definition says.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.program import Use
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, PLAIN


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
