"""The signal of each connection at the end of a step, as pictures show it (Eq. 3).

In: a Network, a State behind a step, the weights of that step. Out: what each connection brings then. Without a synapse
that is its weight times what it takes of its source; with one it is formed of what was sent d steps before, of both
ends, and of the states of the synapse, all as they are at the end of the step. On connections that are lesioned, or one
of whose ends is, there is none.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SYNAPSE, Key, Projection, Use
from neurovis_spec.language.expressions.evaluate import Given, evaluate_array
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.stages import End, Formulas, ends_of, signal_of, taken_by
from neurovis_spec.runtime.state import NEVER_LOST, State, constants


def signals_of(network: Network, state: State, weights: FloatArray, by: Library = NUMPY) -> FloatArray:
    """The signals (m,) of the step before ``state.k``, in which the weights (m,) were these; functions are computed
    ``by`` a library."""
    return Forming(network, by).signals(state, weights)


def formed(network: Network, projection: Projection, formulas: Formulas, state: State) -> FloatArray:
    """A formula of the synapses of a projection as it is behind the step before ``state.k``; one number a member."""
    of = _Synapses.of(network, projection)._replace(formulas=formulas)
    with np.errstate(all="ignore"):
        return Forming(network).formed(of, state, np.concatenate((state.activity, state.outlets)), state.weights)


class _Synapses(NamedTuple):
    """A projection whose members (k,) have a synapse: what is formed of what, the delays of these, and the ``first``
    step that they look at: with a continuous delay what was sent at step 0 is what was there before."""

    projection: Projection
    formulas: Formulas
    ends: Mapping[str, End]
    delays: IntArray
    first: IntArray

    @classmethod
    def of(cls, network: Network, projection: Projection) -> _Synapses:
        """The signals of a projection."""
        members, lags = projection.members, lags_of(network)
        late = np.zeros(len(members), dtype=np.bool_) if lags is None else lags.there[members]
        delays, first = network.connections.delays[members], np.where(late, 0, NEVER_LOST)
        return cls(projection, signal_of(projection), ends_of(network, projection), delays, first)


class Forming:
    """Forms the signals of a network, step by step."""

    def __init__(self, network: Network, by: Library = NUMPY) -> None:
        self._network, self._by = network, by

    @cached_property
    def _synapses(self) -> tuple[_Synapses, ...]:
        network = self._network
        return tuple(_Synapses.of(network, one) for one in network.projections if one.kind == SYNAPSE)

    def signals(self, state: State, weights: FloatArray) -> FloatArray:
        """The signals (m,) of the step before ``state.k``, in which the weights (m,) were these."""
        sent = np.concatenate((state.activity, state.outlets))
        with np.errstate(all="ignore"):
            result: FloatArray = weights * sent[taken_by(self._network)]
            for one in self._synapses:
                made, cut = self.formed(one, state, sent, weights), state.conditions.structure.cut
                members, shares = shares_of(self._network, one.projection, weights, cut)
                result[members] = made if shares is None else made[self._network.synapses.positions[members]] * shares
        result[state.conditions.structure.cut] = 0.0
        return result

    def formed(self, of: _Synapses, state: State, sent: FloatArray, weights: FloatArray) -> FloatArray:
        """A formula of the synapses of a projection; ``sent`` are the activities and the outlets."""
        network, use, members, delays = self._network, of.projection.use, of.projection.members, of.delays
        unit, k = use.definition.per_second, state.k - 1
        known: dict[str, Given] = {**constants(network.dt * unit), "k": float(k), "t": k * network.dt * unit}
        known |= parameters_of(network, use, state.conditions.variables)
        known |= state.cells[use.owner]
        known["weight"] = weights[members]
        left = k - delays if state.continued else np.maximum(k - delays, of.first)
        lost = left < state.conditions.structure.lost[members]
        for name, end in of.ends.items():
            known[name] = sent[end.places]
            if end.past and delays.any():
                past = state.history[left % len(state.history), end.places]
                known[name] = np.where(delays > 0, np.where(lost, 0.0, past), sent[end.places])
        for name, tree in of.formulas.let:
            known[name] = evaluate_array(tree, known, by=self._by)
        ((_, tree),) = of.formulas.trees
        return np.broadcast_to(evaluate_array(tree, known, by=self._by), members.shape)


def shares_of(
    network: Network, projection: Projection, weights: FloatArray, cut: BoolArray
) -> tuple[IntArray, FloatArray | None]:
    """The connections that have a synapse, and which share of a signal each of them brings, where it is shared: its
    weight over those of all that add to the same, as far as they are not ``cut``."""
    members = network.fed.get(projection.use.owner.number)
    if members is None:
        return projection.members, None
    slots, own = network.synapses.positions[members], np.where(cut[members], 0.0, weights[members])
    total = np.bincount(slots, own, len(projection.members))[slots]
    return members, np.where(total == 0, 0.0, own / total)


def parameters_of(network: Network, use: Use, variables: FloatArray | None) -> dict[str, FloatArray]:
    """The parameters of a definition in use, one number a member: those that can be set in a run as the ``variables``
    of its conditions have them, where these are given."""
    found = dict(use.parameters)
    for name, values in use.parameters.items():
        variable = network.settable.variables.get(Key(use.owner, name))
        if variable is not None and variables is not None:
            now = variables[variable.start : variable.start + variable.size]
            found[name] = np.broadcast_to(now, values.shape)
    return found
