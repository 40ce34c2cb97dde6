"""The signal of each connection at the end of a step, as pictures show it (Eq. 3).

In: a Network, a State behind a step, the weights of that step. Out: what each connection brings then. Without a synapse
that is its weight times what it takes of its source; with one it is formed of what was sent d steps before, of both
ends, and of the states of the synapse, all as they are at the end of the step. On connections that are lesioned, or one
of whose ends is, there is none.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE, Key, Projection
from neurovis_spec.language.expressions.evaluate import Given, evaluate_array
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.runtime.stages import Formulas, ends_of, signal_of, taken_by
from neurovis_spec.runtime.state import State, constants


def signals_of(network: Network, state: State, weights: FloatArray, by: Library = NUMPY) -> FloatArray:
    """The signals (m,) of the step before ``state.k``, in which the weights (m,) were these; functions are computed
    ``by`` a library."""
    sent = np.concatenate((state.activity, state.outlets))
    with np.errstate(all="ignore"):
        result: FloatArray = weights * sent[taken_by(network)]
        for projection in network.projections:
            if projection.kind == SYNAPSE:
                result[projection.members] = _formed(network, projection, signal_of(projection), state, weights, by)
    result[state.conditions.structure.gone] = 0.0
    return result


def formed(network: Network, projection: Projection, formulas: Formulas, state: State) -> FloatArray:
    """A formula of the synapses of a projection as it is behind the step before ``state.k``; one number a member."""
    with np.errstate(all="ignore"):
        return _formed(network, projection, formulas, state, state.weights, NUMPY)


def _formed(
    network: Network, projection: Projection, formulas: Formulas, state: State, weights: FloatArray, by: Library
) -> FloatArray:
    """The same with these weights (m,)."""
    use, members, k = projection.use, projection.members, state.k - 1
    sent = np.concatenate((state.activity, state.outlets))
    unit, delays = use.definition.per_second, network.connections.delays[members]
    known: dict[str, Given] = {**constants(network.dt * unit), "k": float(k), "t": k * network.dt * unit}
    known |= {name: _as_set(network, Key(use.owner, name), values, state) for name, values in use.parameters.items()}
    known |= state.cells[use.owner]
    known["weight"] = weights[members]
    lost = k - delays < state.conditions.structure.lost[members]
    for name, end in ends_of(network, projection).items():
        known[name] = sent[end.places]
        if end.past and delays.any():
            past = state.history[(k - delays) % len(state.history), end.places]
            known[name] = np.where(delays > 0, np.where(lost, 0.0, past), sent[end.places])
    for name, tree in formulas.let:
        known[name] = evaluate_array(tree, known, by=by)
    ((_, tree),) = formulas.trees
    return np.broadcast_to(evaluate_array(tree, known, by=by), members.shape)


def _as_set(network: Network, key: Key, values: FloatArray, state: State) -> FloatArray:
    """An array of the network as it is by now, where it can be set in a run."""
    variable = network.settable.variables.get(key)
    if variable is None:
        return values
    now = state.conditions.variables[variable.start : variable.start + variable.size]
    return np.broadcast_to(now, values.shape)
