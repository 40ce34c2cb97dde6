"""Starts: the values with which the states of models begin.

In: a block of a network. Out: the value of each state before step 0, one a member: what the group says
(``initial: {v: …}``), else what the model says.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Neurons
from neurovis_spec.compiler.program import Block
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, PLAIN


def starts_of(block: Block, neurons: Neurons, dt: float) -> dict[str, FloatArray]:
    """By names of states, arrays of their own, as long as the members of the block."""
    known: dict[str, Value] = {**CONSTANTS, "dt": dt, **block.model_parameters}
    result: dict[str, FloatArray] = {}
    for state in block.model.state:
        # by the functions of the C library, whatever computes the steps: all begin in the same state
        initial = evaluate_array(state.initial, known, by=PLAIN)
        values = np.array(np.broadcast_to(initial, block.members.shape), dtype=np.float64)
        if state.name in neurons.starts:
            given = neurons.starts[state.name][block.members]
            values = np.where(np.isnan(given), values, given)
        result[state.name] = values
    return result
