"""The reference interpreter: walks the update program plainly, one neuron and one connection after the other.

In: a Network, a State, the vector of all inputs. Out: the State, advanced. It is slow and meant to be obviously
right: every other backend is tested against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import singledispatch
from types import MappingProxyType
from typing import NamedTuple

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.events.settable import BIAS, CENTRES, HIGH, LOW, Variable
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Gather, Key, Learn, Operation, Population, ReadInputs, Send, Update, Use
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import PLAIN
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import State, constants


class NetworkArray(NamedTuple):
    """An array of the network, and the variable that it is in a run, where it can be set there."""

    values: FloatArray
    variable: Variable | None

    def at(self, place: int, state: State) -> float:
        """One of them, as it is by now."""
        if self.variable is None:
            return float(self.values[place])
        return float(state.conditions.variables[self.variable.start + (place if self.variable.size > 1 else 0)])


class Bounded(NamedTuple):
    """A number that must stay within its bounds."""

    value: float
    low: float
    high: float


_NONE: Mapping[str, Callable[..., float]] = MappingProxyType({})


class ReferenceBackend:
    """Executes anything, slowly."""

    name = "reference"
    capabilities = Capabilities(noise=True, exactness="bits")

    def availability(self) -> Availability:
        """Always there."""
        return Availability(True, "plain and slow: what the others are tested against")

    def prepare(self, network: Network) -> ReferenceStepper:
        """Nothing is compiled."""
        return ReferenceStepper(network)


class ReferenceStepper:
    """One network; ``step`` executes its program once, each operation as it is registered with ``perform``."""

    def __init__(self, network: Network) -> None:
        self.network, self.functions = network, PLAIN
        self.offsets = signal_layout(network).offsets.tolist()
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
        self.sources, self.targets = connections.sources.whole(), connections.targets.whole()
        self.delays = connections.delays.whole()
        self.bias = NetworkArray(network.neurons.bias, variables.get(BIAS))
        self.centres = NetworkArray(connections.centres.whole(), variables.get(CENTRES))
        self.low = NetworkArray(connections.low.whole(), variables.get(LOW))
        self.high = NetworkArray(connections.high.whole(), variables.get(HIGH))
        #: u[t] of the members of each population, as they were gathered last
        self.drives: dict[int, list[float]] = {}

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Execute the operations of the program in order."""
        for operation in self.network.program:
            perform(operation, self, state, inputs)
        state.k += 1

    def gather(self, population: Population, state: State, inputs: FloatArray) -> list[float]:
        """u[t] of each member: what arrives, combined, + bias + input + noise."""
        neurons = self.network.neurons
        arriving: list[list[tuple[float, float]]] = [[] for _ in population.members]
        for connection, slot in zip(population.drive.incoming.tolist(), population.drive.slots.tolist(), strict=True):
            if not state.conditions.structure.gone[connection]:
                signal = self.arriving(connection, state)
                arriving[slot].append((signal, self.centres.at(connection, state)))
        drives = []
        for neuron, signals in zip(population.members.tolist(), arriving, strict=True):
            drive = combined(population.drive.combine, signals) + self.bias.at(neuron, state)
            if neurons.input[neuron] >= 0:
                drive += float(inputs[neurons.input[neuron]])
            if self.network.noise_index[neuron] >= 0:
                drive += float(inputs[self.network.noise_index[neuron]])
            drives.append(drive)
        return drives

    def known(self, use: Use, place: int, state: State) -> dict[str, float]:
        """What the formulas of a definition in use see, whatever its kind: the clock, and its parameters for one of the
        members."""
        known = self.clock(state)
        for name, numbers in self.settings[use.owner]:
            known[name] = numbers.at(place, state)
        return known

    def arriving(self, connection: int, state: State) -> float:
        """w[t−d]·a[t−d]: of this step for d = 0, else what was sent d steps ago."""
        delay = int(self.delays[connection])
        if delay == 0:
            return float(state.weights[connection]) * float(state.activity[self.sources[connection]])
        return float(state.signals[self.offsets[connection] + state.k % delay])

    def update(self, number: int, drives: list[float], state: State) -> None:
        """The states of a population from old states and the drive, then the activities from the new ones."""
        population, neurons = self.network.populations[number], self.network.neurons
        for position, neuron in enumerate(population.members.tolist()):
            initial = float(neurons.initial[neuron])
            if state.k == 0 and not state.continued and not math.isnan(initial):
                state.activity[neuron] = initial
            else:
                state.activity[neuron] = self.advance(number, position, drives[position], state)
            held = state.conditions.held_at(neuron)
            if held is not None:
                state.activity[neuron] = held

    def advance(self, number: int, position: int, drive: float, state: State) -> float:
        """One neuron's step: its states are replaced, its activity is returned."""
        population = self.network.populations[number]
        shape = self.known(population.activation, position, state)
        functions = {
            name: lambda x, value=value: evaluate(value, shape | {"x": x})
            for name, value in population.activation.definition.functions.items()
        }
        seen = self.known(population.model, position, state) | {population.drive.name: drive}
        return self.change(population.model, position, seen, state, {}, functions)["activity"]

    def change(
        self,
        use: Use,
        position: int,
        seen: Mapping[str, float],
        state: State,
        lasting: Mapping[str, Bounded],
        functions: Mapping[str, Callable[..., float]] = _NONE,
    ) -> dict[str, float]:
        """What becomes of the states of a definition in use, and of what it gives, for one member: all from old values
        at once, then what does not last from the new states; at an episode's end once more from what these gave.
        ``lasting`` is what it gives and lasts, within its bounds. States are replaced, all is returned."""
        definition, cells = use.definition, state.cells[use.owner]
        old = {name: float(values[position]) for name, values in cells.items()}
        old |= {name: bounded.value for name, bounded in lasting.items()}
        known = with_let({**seen, **old}, definition.let)
        new = changed(old, [(one.name, one.each_step) for one in definition.lasting], known, lasting, functions)
        fleeting = [(one.name, one.each_step) for one in definition.fleeting]
        results = changed(new, fleeting, known | new, {}, functions) if fleeting else new
        if self.ends_episode(state):
            ends = [(one.name, one.each_episode) for one in definition.lasting]
            new = changed(new, ends, with_let({**seen, **new}, definition.let), lasting)
            results = results | new
        for name, values in cells.items():
            values[position] = new[name]
        return results

    def send(self, state: State) -> None:
        """w[t]·a[t] of every delayed connection leaves; a[t] is remembered."""
        for connection, delay in enumerate(self.delays.tolist()):
            if delay > 0:
                signal = float(state.weights[connection]) * float(state.activity[self.sources[connection]])
                state.signals[self.offsets[connection] + state.k % delay] = signal
        if len(state.history):
            state.history[state.k % len(state.history)] = state.activity

    def learn(self, number: int, state: State, inputs: FloatArray) -> None:
        """w[t+1] and the states of a rule from old values; at an episode's end, once more from what these gave."""
        projection = self.network.projections[number]
        for position, connection in enumerate(projection.members.tolist()):
            if not state.conditions.structure.still[connection]:
                self.learn_one(number, position, connection, state, inputs)

    def learn_one(self, number: int, position: int, connection: int, state: State, inputs: FloatArray) -> None:
        """The weight and the states of one connection."""
        projection = self.network.projections[number]
        low, high = self.low.at(connection, state), self.high.at(connection, state)
        seen = self.known(projection.rule, position, state) | self.seen(connection, state)
        signals = (*state.activity.tolist(), *inputs.tolist())  # as ``Projection.signals`` numbers them
        seen |= {signal: signals[indices[position]] for signal, indices in projection.signals.items()}
        weight = Bounded(float(state.weights[connection]), low, high)
        state.weights[connection] = self.change(projection.rule, position, seen, state, {"weight": weight})["weight"]

    def seen(self, connection: int, state: State) -> dict[str, float]:
        """``pre`` = a_j[t−d], 0 where what was sent then is lost, ``sent`` = a_j[t] and ``post`` = a_i[t] of a
        connection from j to i."""
        source, target = int(self.sources[connection]), int(self.targets[connection])
        delay = int(self.delays[connection])
        sent = float(state.activity[source])
        pre = sent
        if delay > 0 and len(state.history):
            lost = state.k - delay < state.conditions.structure.lost[connection]
            pre = 0.0 if lost else float(state.history[(state.k - delay) % len(state.history), source])
        return {"pre": pre, "sent": sent, "post": float(state.activity[target])}

    def clock(self, state: State) -> dict[str, float]:
        """The step, the seconds and the constants."""
        return constants(self.network.dt) | {"k": float(state.k), "t": state.k * self.network.dt}

    def ends_episode(self, state: State) -> bool:
        """Whether (t + 1) mod m = 0."""
        return self.network.episode is not None and (state.k + 1) % self.network.episode == 0


def combined(combine: str, signals: Iterable[tuple[float, float]]) -> float:
    """Signals and centres of one neuron as one number, taken in the order of the connections.

    >>> combined("product", []), combined("distance", [(3.0, 0.0), (0.0, 4.0)])
    (1.0, 5.0)
    """
    if combine == "product":
        product = 1.0
        for signal, _ in signals:
            product *= signal
        return product
    total = 0.0
    for signal, centre in signals:
        total += (signal - centre) * (signal - centre) if combine == "distance" else signal
    return math.sqrt(total) if combine == "distance" else total


def with_let(known: dict[str, float], let: tuple[tuple[str, Tree], ...]) -> dict[str, float]:
    """The names known, and beside them now the intermediate values, computed in order."""
    for name, tree in let:
        known[name] = evaluate(tree, known)
    return known


def changed(
    old: dict[str, float],
    trees: Iterable[tuple[str, Tree | None]],
    known: dict[str, float],
    bounds: Mapping[str, Bounded],
    functions: Mapping[str, Callable[..., float]] = _NONE,
) -> dict[str, float]:
    """New values, all from ``known``, within their bounds; what has no expression stays."""
    new = dict(old)
    for name, tree in trees:
        if tree is not None:
            new[name] = evaluate(tree, known, functions)
            if name in bounds:
                new[name] = min(max(new[name], bounds[name].low), bounds[name].high)
    return new


@singledispatch
def perform(operation: Operation, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    """Carry out an operation of the program. Raises TypeError for one that is not registered."""
    raise TypeError(f"the reference does not know how to {type(operation).__name__}")


@perform.register
def _read(operation: ReadInputs, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    """Nothing: ``inputs`` holds what the caller has read."""


@perform.register
def _gather(operation: Gather, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.drives[operation.population] = by.gather(by.network.populations[operation.population], state, inputs)


@perform.register
def _update(operation: Update, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.update(operation.population, by.drives[operation.population], state)


@perform.register
def _send(operation: Send, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.send(state)


@perform.register
def _learn(operation: Learn, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.learn(operation.projection, state, inputs)
