"""Ends: whether the line of a connection ends in an arrow, in a bar, or in neither.

In: a network, its weights, and where a sign follows parameters that are set in a run what they are by then. Out: 1 (an
arrow), −1 (a bar) or 0 for each connection: as the ``sign`` of its synapse says, where that has one, else as its weight
is positive or negative.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Key
from neurovis_spec.language.expressions.evaluate import Given, evaluate_array
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.formed import parameters_of
from neurovis_spec.runtime.state import first_conditions

if TYPE_CHECKING:
    from neurovis_spec.runtime.simulation import Simulation

EndArray: TypeAlias = npt.NDArray[np.int8]


def ends_of(network: Network, weights: FloatArray, variables: FloatArray | None = None) -> EndArray:
    """How the lines of connections with these weights (…, m) end; with a sign that is no number in neither. The numbers
    that follow parameters are these ``variables``, by default what they begin with."""
    result = np.where(weights < 0, np.int8(-1), np.int8(1))
    for projection in network.projections:
        definition, members = projection.use.definition, projection.members
        if definition.sign is None:
            continue
        known: dict[str, Given] = {**parameters_of(network, projection.use, variables), "weight": weights[..., members]}
        with np.errstate(all="ignore"):
            sign = np.nan_to_num(np.sign(evaluate_array(definition.sign, known)), nan=0.0)
        result[..., members] = sign
    return result


def signed(network: Network) -> IntArray:
    """The connections whose synapse says how they end, ascending."""
    found = [one.members for one in network.projections if one.use.definition.sign is not None]
    return np.sort(np.concatenate([np.zeros(0, np.int64), *found]))


def effects_of(network: Network, weights: FloatArray, ends: EndArray) -> FloatArray:
    """Weights (…, m), below 0 where they inhibit: of a synapse that says how its lines end its size, with that sign,
    where lines end so (…, m)."""
    said = signed(network)
    if not len(said):
        return weights
    result, size = weights.copy(), np.abs(weights[..., said])
    result[..., said] = np.where(ends[..., said] < 0, -size, size)
    return result


@dataclass(frozen=True, eq=False)
class SetEnds:
    """How lines end in a run of a network in which parameters are set that signs of synapses read."""

    network: Network

    def __bool__(self) -> bool:
        """Whether a sign follows a parameter that can be set."""
        return self._follows

    @cached_property
    def _follows(self) -> bool:
        variables = self.network.settable.variables
        return any(
            Key(one.use.owner, name) in variables
            for one in self.network.projections
            if one.use.definition.sign is not None
            for name in names(one.use.definition.sign)
        )

    def of_run(self, run: Simulation) -> EndArray | None:
        """How they end in the step that a run makes next, (m,); None where nothing that is set changes that."""
        return ends_of(self.network, run.connection_weights, run.variables) if self else None

    def by_events(self) -> ByEvents | None:
        """The same in steps of a recording; None where nothing that is set changes that."""
        return ByEvents(self.network) if self else None

    def kinds(self) -> Iterator[EndArray]:
        """How lines end when a run begins, and after each event that sets parameters."""
        weights = self.network.connections.weights.whole()
        yield ends_of(self.network, weights)
        if self:
            events = ByEvents(self.network)
            yield from (events.at(change.at, weights) for change in self.network.changes if change.parameters)


class ByEvents:
    """How lines end in steps of a recording, which ascend, as far as events set parameters: what was set by hand is not
    in it step by step."""

    def __init__(self, network: Network) -> None:
        self._network, self._controls, self._applied = network, Controls(network), 0
        self._conditions, self._weights = first_conditions(network), network.connections.weights.whole().copy()

    def at(self, step: int, weights: FloatArray) -> EndArray:
        """How lines of connections with these weights end in a step, (m,)."""
        for change in self._network.changes[self._applied :]:
            if change.at > step:
                break
            with np.errstate(all="ignore"):
                self._controls.set_parameters(self._conditions, self._weights, change)
            self._applied += 1
        return ends_of(self._network, weights, self._conditions.variables)
