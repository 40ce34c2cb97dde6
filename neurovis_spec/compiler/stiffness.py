"""Stiffness: how fast states decay beside what the method of integration bears, in a step.

In: a Network, how the derivative of a state changes with it. Out: whether the step is too long for that, and words.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.flows import jacobian, with_slope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.initial_states import beginning
from neurovis_spec.compiler.program import Population, Port
from neurovis_spec.language.expressions.evaluate import Value
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.language.units import TIMES
from neurovis_spec.language.words import Method

#: How far into the negative a method stays stable: the least h·∂f/∂x. Others are not limited.
_LIMITS: Final[Mapping[Method, float]] = {"euler": -2.0, "heun": -2.0, "rk4": -2.785}


def limit_of(network: Network) -> float | None:
    """How far into the negative h·∂f/∂x may go; None where there is no such limit, or nothing is integrated."""
    by = network.integration
    return None if by is None else _LIMITS.get(by.method)


class Stiffest(NamedTuple):
    """The state that decays fastest: the neuron, the state, how fast, per second, and at which step; None before the
    first one."""

    neuron: str
    state: str
    slope: float
    step: int | None = None

    def is_too_stiff(self, network: Network) -> bool:
        """Whether a step of a network is too long for it."""
        limit, by = limit_of(network), network.integration
        return limit is not None and by is not None and network.dt / by.substeps * self.slope < limit

    def words(self, network: Network) -> tuple[str, str]:
        """What is said of a step that is too long for it, and what to do."""
        limit, by = limit_of(network), network.integration
        assert limit is not None
        assert by is not None
        reached = network.dt / by.substeps * self.slope
        most = _shown(limit / self.slope * by.substeps, network.dt_unit)
        where = f"'{self.neuron}'" + ("" if self.step is None else f" at step {self.step}")
        message = f"dt·∂{self.state}'/∂{self.state} is {reached:.3g} at {where}; the limit of {by.method} is {limit:g}"
        return message, f"take a dt of at most {most}, or integrate: exponential"


def stiffest_at_begin(network: Network) -> Stiffest | None:
    """What is too stiff for the method as a run begins, most of all; None where nothing is, as far as is known."""
    if limit_of(network) is None:
        return None
    worst = min(_slopes(network), key=lambda one: one.slope, default=None)
    return worst if worst is not None and worst.is_too_stiff(network) else None


def _slopes(network: Network) -> Iterator[Stiffest]:
    """For each flow state how its derivative changes with it where a run begins, at the neuron where that is least.
    What arrives is taken for nothing but the bias."""
    for population in network.populations:
        model = population.model.definition
        if not model.flows:
            continue
        try:
            slopes, activation = jacobian(model), with_slope(population.activation.definition)
        except ExpressionError:
            continue  # it is too long to be told anything of
        ports: dict[str, Value] = {port.name: _resting(network, population, port) for port in population.ports}
        sloped = replace(population, activation=replace(population.activation, definition=activation))
        begin = beginning(sloped, network.dt, network.neurons.starts, ports)
        for name, tree in slopes.let:
            begin.values[name] = begin.of(tree)
        for state, tree in slopes.diagonal.items():
            found = np.broadcast_to(begin.of(tree), population.members.shape)
            if np.isfinite(found).any():
                place = int(np.nanargmin(np.where(np.isfinite(found), found, np.nan)))
                neuron = network.neurons.names[population.members[place]]
                yield Stiffest(neuron, state, float(found[place]) * model.per_second)


def _resting(network: Network, population: Population, port: Port) -> FloatArray:
    """What a port is where nothing arrives: its bias."""
    bias = network.neurons.bias_at(port.name)[population.members]
    return np.asarray(bias + (1.0 if port.combine == "product" else 0.0), dtype=np.float64)


def _shown(seconds: float, unit: str) -> str:
    """A time in this unit, rounded down to two digits."""
    value = seconds / float(TIMES[unit])
    power = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / power) * power:.2g} {unit}"
