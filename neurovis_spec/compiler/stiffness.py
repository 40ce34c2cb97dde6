"""Stiffness: how fast states decay beside what the method of integration bears, in a step.

In: a Network, how the derivative of a state changes with it. Out: whether the step is too long for that, and words.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.flows import jacobian, slope_by, with_slope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.initial_states import Beginning, beginning, initial_states
from neurovis_spec.compiler.program import MODEL, SYNAPSE, Definition, Each, EndName, Population, Port, Projection
from neurovis_spec.language.expressions.evaluate import Value
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import ExpressionError, Name, Tree
from neurovis_spec.language.units import TIMES
from neurovis_spec.language.words import Method

#: How far into the negative a method stays stable: the least h·∂f/∂x. Others are not limited.
_LIMITS: Final[Mapping[Method, float]] = {"euler": -2.0, "heun": -2.0, "rk4": -2.785}


def limit_of(network: Network) -> float | None:
    """How far into the negative h·∂f/∂x may go; None where there is no such limit, or nothing is integrated."""
    by = network.integration
    return None if by is None else _LIMITS.get(by.method)


class Stiffest(NamedTuple):
    """The state that decays fastest: the neuron or the connection, the state, how fast, per second, and at which step;
    None before the first one."""

    owner: str
    state: str
    slope: float
    step: int | None = None

    def is_too_stiff(self, network: Network) -> bool:
        """Whether a step of a network is too long for it."""
        return _is_too_stiff(self.slope, network)

    def words(self, network: Network) -> tuple[str, str]:
        """What is said of a step that is too long for it, and what to do."""
        limit, by = limit_of(network), network.integration
        assert limit is not None
        assert by is not None
        reached = network.dt / by.substeps * self.slope
        most = _shown(limit / self.slope * by.substeps, network.dt_unit)
        where = f"'{self.owner}'" + ("" if self.step is None else f" at step {self.step}")
        message = f"dt·∂{self.state}'/∂{self.state} is {reached:.3g} at {where}; the limit of {by.method} is {limit:g}"
        return message, f"take a dt of at most {most}, or integrate: exponential"


def _is_too_stiff(slope: float, network: Network) -> bool:
    limit, by = limit_of(network), network.integration
    return limit is not None and by is not None and network.dt / by.substeps * slope < limit


class _Least(NamedTuple):
    """Where the slope of a state is least: the member, a neuron or a connection, and the slope, per second."""

    each: Each
    member: int
    state: str
    slope: float


def stiffest_at_begin(network: Network) -> Stiffest | None:
    """What is too stiff for the method as a run begins, most of all; None where nothing is, as far as is known."""
    if limit_of(network) is None:
        return None
    worst = min(_slopes(network), key=lambda one: one.slope, default=None)
    if worst is None or not _is_too_stiff(worst.slope, network):
        return None
    names = network.neurons.names if worst.each == "neuron" else network.connection_names  # there may be many
    return Stiffest(names[worst.member], worst.state, worst.slope)


def _slopes(network: Network) -> Iterator[_Least]:
    """For each flow state how its derivative changes with it where a run begins, at the neuron or the connection where
    that is least. What arrives is taken for nothing but the bias; how much a synapse gives way to its target counts."""
    joined = [one for one in network.projections if one.kind == SYNAPSE or one.use.definition.flows]
    at_ends = _at_ends(network) if joined else np.zeros(0)
    connected = [_Connected(one, _begun_at(network, one, at_ends)) for one in joined]
    for population in (one for one in network.populations if one.model.definition.flows):
        model = population.model.definition
        with suppress(ExpressionError):  # where it is too long to be told anything of
            slopes = jacobian(model)
            begin = _with(_begun(network, population), slopes.let)
            for state, tree in slopes.diagonal.items():
                found = np.asarray(begin.of(tree)) + _giving_way(population, state, begin, connected)
                yield from _least(found, state, model, population.members)
    for projection, begin in connected:
        made = projection.use.definition
        with suppress(ExpressionError):
            slopes = jacobian(made)
            for state, tree in slopes.diagonal.items():
                own = _with(begin, slopes.let).of(tree)
                yield from _least(own, state, made, projection.members)


def _least(slopes: Value, state: str, definition: Definition, members: IntArray) -> Iterator[_Least]:
    """Where the slope of a state is least, of those that are finite."""
    found = np.broadcast_to(slopes, members.shape)
    if np.isfinite(found).any():
        place = int(np.nanargmin(np.where(np.isfinite(found), found, np.nan)))
        slope = float(found[place]) * definition.per_second
        yield _Least(definition.kind.each, int(members[place]), state, slope)


def _begun(network: Network, population: Population) -> Beginning:
    """What formulas of a model see where a run begins, and may call, the derivative of the activation among it. Raises
    ExpressionError."""
    ports: dict[str, Value] = {port.name: _resting(network, population, port) for port in population.ports}
    if population.model.definition.flows:
        activation = with_slope(population.activation.definition)
        population = replace(population, activation=replace(population.activation, definition=activation))
    return beginning(population, network.dt, network.neurons.starts, ports)


def _with(begin: Beginning, let: Iterable[tuple[str, Tree]]) -> Beginning:
    """The same with further intermediate values."""
    for name, tree in let:
        begin.values[name] = begin.of(tree)
    return begin


def _at_ends(network: Network) -> FloatArray:
    """What begins where the ends of connections are read: the activities of all neurons, then the outlets; NaN where
    too much is written for anything to be told."""
    n = len(network.neurons)
    result = np.full(n + network.outlet_count, np.nan)
    for number, population in enumerate(network.populations):
        given = {one.name: one.each_step for one in population.model.definition.gives}
        outlets = [one for one in network.outlets if one.population == number]
        places = {one.name: n + one.start + np.arange(len(population.members)) for one in outlets}
        with suppress(ExpressionError):
            begin = _begun(network, population)
            for name, where in {MODEL.gives: population.members, **places}.items():
                result[where] = begin.of(given.get(name) or Name(name))
    return result


class _Connected(NamedTuple):
    """A projection, and what its formulas see where a run begins."""

    projection: Projection
    begin: Beginning


def _begun_at(network: Network, projection: Projection, at_ends: FloatArray) -> Beginning:
    """What formulas of a synapse or a rule see where a run begins; of ``pre`` as if it had no delay. Nothing is known
    of signals."""
    use, members, connections = projection.use, projection.members, network.connections
    definition = use.definition
    sent = connections.sources[members] if network.sending is None else network.sending[members]
    values: dict[str, Value] = {**CONSTANTS, "dt": network.dt * definition.per_second, "t": 0.0, "k": 0.0}
    values |= dict.fromkeys(definition.signals, np.nan)
    values |= {"pre": at_ends[sent], "sent": at_ends[sent], "post": at_ends[connections.targets[members]]}
    values |= {name: at_ends[places] for name, places in projection.ends.items()}
    values |= {"weight": connections.weights[members], "centre": connections.centres[members], **use.parameters}
    values |= initial_states(use, members, network.dt)
    return _with(Beginning(values, {}), definition.let)


def _giving_way(population: Population, state: str, begin: Beginning, connected: Iterable[_Connected]) -> FloatArray:
    """How much the derivative of a state changes with it through synapses that read it at their target, and ports that
    are sums."""
    model, result = population.model.definition, np.zeros(len(population.members))
    derivative = next(one.derivative for one in model.flows if one.name == state)
    for port in (one for one in population.ports if one.combine == "sum"):
        brought = np.zeros(len(population.members))
        for projection, seen in connected:
            made, text = projection.use.definition, EndName("post", state).text
            inside = np.isin(port.incoming, projection.members)
            if made.kind != SYNAPSE or text not in projection.ends or not inside.any():
                continue
            assert made.given.each_step is not None
            back = slope_by(made, made.given.each_step, text)
            slopes = np.broadcast_to(_with(seen, back.let).of(back.tree), projection.members.shape)
            factors = 1.0 if port.factors is None else port.factors[inside]
            places = np.searchsorted(projection.members, port.incoming[inside])
            np.add.at(brought, port.slots[inside], slopes[places] * factors)
        if brought.any():
            assert derivative is not None
            by_port = slope_by(model, derivative, port.name)
            result += _with(begin, by_port.let).of(by_port.tree) * brought
    return result


def _resting(network: Network, population: Population, port: Port) -> FloatArray:
    """What a port is where nothing arrives: its bias."""
    bias = network.neurons.bias_at(port.name)[population.members]
    return np.asarray(bias + port.nothing, dtype=np.float64)


def _shown(seconds: float, unit: str) -> str:
    """A time in this unit, rounded down to two digits."""
    value = seconds / float(TIMES[unit])
    power = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / power) * power:.2g} {unit}"
