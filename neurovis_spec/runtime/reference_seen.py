"""What the formulas of a step see, for the reference: the clock, parameters, activations, and what is given to a port.

In: a Network, a State, the vector of all inputs. Out: numbers, of one neuron or one connection at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.events.settable import CENTRES, Variable, bias_of
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import CENTRE, JOINING, Definition, Key, Population, Port, Projection, Use
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.lags import Lags, lags_of
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.stages import Formulas, behind_flow, ends_of, signal_of, taken_by, target_of
from neurovis_spec.runtime.state import NEVER_LOST, State, constants

#: What is now of activities and outlets, by the index among these.
Now: TypeAlias = Callable[[int], float]
#: The signal of a synapse, by the number of its projection and which of the members it is.
Forming: TypeAlias = Callable[[int, int], float]
#: What formulas may call, by name.
Functions: TypeAlias = Mapping[str, Callable[..., float]]
NO_FUNCTIONS: Functions = MappingProxyType({})


class NetworkArray(NamedTuple):
    """An array of the network, and the variable that it is in a run, where it can be set there."""

    values: FloatArray
    variable: Variable | None

    def at(self, place: int, state: State) -> float:
        """One of them, as it is by now."""
        if self.variable is None:
            return float(self.values[place])
        return float(state.conditions.variables[self.variable.start + (place if self.variable.size > 1 else 0)])


class Sent(NamedTuple):
    """What connections bring at a stage, where this ``share`` of the step is over: of what is ``sent`` now, all
    activities and then the outlets, and what synapses have ``formed``."""

    sent: Sequence[float]
    share: float
    formed: Forming


class Signal(NamedTuple):
    """What a connection brings to a port: to which member (its position), and the centre where a distance is formed."""

    slot: int
    value: float
    centre: float


class Seen:
    """What formulas of one network see."""

    def __init__(self, network: Network) -> None:
        self.network = network
        #: where signals are under way, by whether each connection has its own
        self.layouts = {own: signal_layout(network, own) for own in (False, True)}
        variables, connections = network.settable.variables, network.connections
        #: the parameters of definitions in use
        self.settings = {
            use.owner: [
                (name, NetworkArray(values, variables.get(Key(use.owner, name))))
                for name, values in use.parameters.items()
            ]
            for _, use in network.uses
        }
        # one connection after the other is slow in columns
        self.targets, self.delays = connections.targets.whole(), connections.delays.whole()
        self.lags = lags_of(network)
        #: what each connection takes: an index into the activities followed by the outlets
        self.sending = taken_by(network)
        #: by ports
        names, neurons = network.port_names, network.neurons
        self.bias = {name: NetworkArray(neurons.bias_at(name), variables.get(bias_of(name))) for name in names}
        self.fed = {name: (neurons.input_at(name), network.noise_of(name)) for name in names}
        #: what connections read of their ends, by projections
        self.ends = [ends_of(network, one) for one in network.projections]
        self.synapses = network.synapses
        #: of synapses the targets, and which of their states are seen as they are behind the integration
        self.behind = {
            number: (network.populations[target_of(network, one)], behind_flow(network, one))
            for number, one in enumerate(network.projections)
            if one.kind in JOINING
        }
        self.centres = NetworkArray(connections.centres.whole(), variables.get(CENTRES))

    def signals(self, port: Port, places: Iterable[int], state: State, now: Sent | None = None) -> Iterator[Signal]:
        """What some of the connections bring to a port, ``places`` of its ``incoming``: at a stage what is sent
        ``now``, or what was sent before by continuous delays; else by their delays, and of synapses what is formed
        before the update."""
        formed = partial(self.formed, state) if now is None else now.formed
        for place in places:
            connection = int(port.incoming[place])
            if not state.conditions.structure.gone[connection]:
                synapse = int(self.synapses.numbers[connection])
                if synapse >= 0:
                    value = formed(synapse, int(self.synapses.positions[connection]))
                elif now is None:
                    value = self.arriving(connection, state)
                elif self.lags is not None and self.lags.there[connection]:
                    value = self.between(connection, self.lags, state, now.share)
                else:
                    value = float(state.weights[connection]) * now.sent[self.sending[connection]]
                if port.factors is not None:
                    value *= float(port.factors[place])
                yield Signal(int(port.slots[place]), value, self.centre(connection, state))

    def centre(self, connection: int, state: State) -> float:
        """What the signal of a connection is compared with where its target combines by distance."""
        holders, numbers, positions = self.network.moving_centres
        if numbers[connection] < 0:
            return self.centres.at(connection, state)
        (use,) = holders[numbers[connection]].uses
        return float(state.cells[use.owner][CENTRE][positions[connection]])

    def given(
        self,
        population: Population,
        port: Port,
        signals: Iterable[Signal],
        state: State,
        inputs: Sequence[float] | None,
    ) -> list[float]:
        """What each member is given at a port: these signals, combined in their order, + bias + input + noise; without
        ``inputs`` the signals alone."""
        arriving: list[list[Signal]] = [[] for _ in population.members]
        for signal in signals:
            arriving[signal.slot].append(signal)
        result = []
        for neuron, own in zip(population.members.tolist(), arriving, strict=True):
            value = combined(port.combine, own)
            if inputs is not None:
                value += self.bias[port.name].at(neuron, state)
                for fed in self.fed[port.name]:
                    if fed[neuron] >= 0:
                        value += inputs[fed[neuron]]
            result.append(value)
        return result

    def known(self, use: Use, place: int, state: State, t: float | None = None) -> dict[str, float]:
        """What the formulas of a definition in use see, whatever its kind: the clock, and its parameters for one of the
        members. ``t`` are the seconds of a stage, else those of the step."""
        known = self.clock(state, use.definition, t)
        for name, numbers in self.settings[use.owner]:
            known[name] = numbers.at(place, state)
        return known

    def functions_of(self, population: Population, position: int, state: State) -> dict[str, Callable[..., float]]:
        """The functions of a neuron's activation, which formulas of its model call."""
        shape = self.known(population.activation, position, state)
        return {
            name: lambda x, value=value: evaluate(value, shape | {"x": x})
            for name, value in population.activation.definition.functions.items()
        }

    def values(
        self,
        population: Population,
        formulas: Formulas,
        own: Mapping[str, Sequence[float]],
        state: State,
        t: float | None = None,
    ) -> dict[str, list[float]]:
        """The values of formulas by their names, of each one a member; ``own`` are what they see of states and ports,
        ``t`` the seconds of a stage."""
        result: dict[str, list[float]] = {name: [] for name, _ in formulas.trees}
        for position in range(len(population.members)):
            functions = self.functions_of(population, position, state)
            known = self.known(population.model, position, state, t)
            known |= {name: values[position] for name, values in own.items()}
            with_let(known, formulas.let, functions)
            for name, tree in formulas.trees:
                result[name].append(evaluate(tree, known, functions))
        return result

    def formed(self, state: State, number: int, position: int) -> float:
        """The signal of a synapse before its target is updated."""
        projection = self.network.projections[number]
        own = {name: float(values[position]) for name, values in state.cells[projection.use.owner].items()}
        own |= self.before_update(projection, position, state)
        (value,) = self.values_at(projection, position, signal_of(projection), own, state).values()
        return value

    def values_at(
        self,
        projection: Projection,
        position: int,
        formulas: Formulas,
        own: Mapping[str, float],
        state: State,
        t: float | None = None,
    ) -> dict[str, float]:
        """The values of formulas by their names for one of the connections; ``own`` are what they see of states and of
        both ends, ``t`` the seconds of a stage."""
        known = {**self.known(projection.use, position, state, t), **own}
        known["weight"] = float(state.weights[projection.members[position]])
        with_let(known, formulas.let)
        return {name: evaluate(tree, known) for name, tree in formulas.trees}

    def before_update(self, projection: Projection, position: int, state: State) -> dict[str, float]:
        """What a synapse sees of its ends before its target is updated: of the states of that which flow, as they are
        behind the integration."""
        target, states = self.behind[projection.use.owner.number]
        cells = state.cells[target.model.owner]
        member = int(np.searchsorted(target.members, self.targets[projection.members[position]]))
        known = {name: float(cells[own][member]) for name, own in states.items()}
        return self.seen(projection, position, state) | known

    def seen(
        self, projection: Projection, position: int, state: State, now: Now | None = None, share: float | None = None
    ) -> dict[str, float]:
        """What one of the connections reads of its ends: ``pre``, what is sent at t−d, 0 where that is lost, ``sent``,
        what is at t, ``post`` = a_i[t] of a connection from j to i, and of what else is there the same. ``now`` says
        what is now, by default what was left there last. Continuous delays are read where this ``share`` of the step is
        over, if it is said."""
        connection, found = int(projection.members[position]), dict[str, float]()
        for name, end in self.ends[projection.use.owner.number].items():
            index = int(end.places[position])
            if end.past and self.delays[connection] > 0:
                found[name] = self.past(connection, index, state, share, end.rounded)
            else:
                found[name] = self.at(index, state) if now is None else now(index)
        return found

    def past(self, connection: int, index: int, state: State, share: float | None, rounded: bool) -> float:
        """An activity or an outlet of d steps ago, 0 where that is lost; with a continuous delay that is not
        ``rounded`` at the first step what it was before, too, and as it was before this ``share`` of the step was over,
        if it is said."""
        step = state.k - int(self.delays[connection])
        if self.lags is None or rounded or not self.lags.there[connection]:
            return self.remembered(connection, index, step, state)
        least = NEVER_LOST if state.continued else 0
        if share is None:
            return self.remembered(connection, index, max(step, least), state)
        at = self.lags.at(connection, share)
        first = state.k - 1 - int(self.lags.whole[connection]) + at.first
        return at.of(*(self.remembered(connection, index, max(one, least), state) for one in (first, first + 1)))

    def remembered(self, connection: int, index: int, step: int, state: State) -> float:
        """An activity or an outlet as it was at a step, 0 where what left a connection then is lost."""
        lost = step < state.conditions.structure.lost[connection]
        return 0.0 if lost else float(state.history[step % len(state.history)][index])

    def arriving(self, connection: int, state: State) -> float:
        """w[t−d]·a[t−d]: of this step for d = 0, else what was sent d steps ago; 0 where that is lost."""
        delay = int(self.delays[connection])
        if delay == 0:
            return float(state.weights[connection]) * self.sent(connection, state)
        return self.under_way(connection, state.k - delay, state)

    def between(self, connection: int, lags: Lags, state: State, share: float) -> float:
        """What arrives with a continuous delay where this share of the step is over."""
        at = lags.at(connection, share)
        first = state.k - 1 - int(lags.whole[connection]) + at.first
        return at.of(self.under_way(connection, first, state), self.under_way(connection, first + 1, state))

    def under_way(self, connection: int, step: int, state: State) -> float:
        """w·a as it left at a step; 0 where that is lost."""
        layout = self.layouts[state.own_signals]
        left = float(state.signals[layout.offsets[connection] + step % int(layout.lengths[connection])])
        if not layout.shares[connection]:
            return left
        lost = step < state.conditions.structure.lost[connection]
        return 0.0 if lost else float(state.weights[connection]) * left

    def sent(self, connection: int, state: State) -> float:
        """What a connection takes now."""
        return self.at(int(self.sending[connection]), state)

    def at(self, index: int, state: State) -> float:
        """An activity or an outlet as it is now."""
        neurons = len(state.activity)
        return float(state.activity[index] if index < neurons else state.outlets[index - neurons])

    def clock(self, state: State, definition: Definition, t: float | None = None) -> dict[str, float]:
        """The step, the time and the constants, in the unit of a definition. ``t``: the seconds of a stage."""
        dt, unit = self.network.dt, definition.per_second
        return constants(dt * unit) | {"k": float(state.k), "t": (state.k * dt if t is None else t) * unit}


def is_first(state: State) -> bool:
    """Whether the step to come is the first one of all, which no other came before."""
    return state.k == 0 and not state.continued


def combined(combine: str, signals: Iterable[Signal]) -> float:
    """Signals of one neuron as one number, taken in their order.

    >>> combined("product", []), combined("distance", [Signal(0, 3.0, 0.0), Signal(0, 0.0, 4.0)])
    (1.0, 5.0)
    """
    if combine == "product":
        product = 1.0
        for signal in signals:
            product *= signal.value
        return product
    if combine == "max":
        return greatest(signal.value for signal in signals)
    total = 0.0
    for _, value, centre in signals:
        total += (value - centre) * (value - centre) if combine == "distance" else value
    return math.sqrt(total) if combine == "distance" else total


def greatest(values: Iterable[float]) -> float:
    """The greatest of some numbers, 0 without any; it is never −0, which is as great as 0, and NaN where one is that.

    >>> greatest([]), greatest([-0.0, 0.0]), greatest([-2.0, -1.0])
    (0.0, 0.0, -1.0)
    """
    result = -math.inf
    for value in values:
        if value > result or math.isnan(value):
            result = value
    return 0.0 if result == -math.inf else result + 0.0


def with_let(
    known: dict[str, float], let: Iterable[tuple[str, Tree]], functions: Functions = NO_FUNCTIONS
) -> dict[str, float]:
    """The names known, and beside them now the intermediate values, computed in order."""
    for name, tree in let:
        known[name] = evaluate(tree, known, functions)
    return known
