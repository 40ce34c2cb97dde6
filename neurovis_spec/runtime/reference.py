"""The reference interpreter: walks the update program plainly, one neuron and one connection after the other.

In: a Network, a State, the vector of all inputs. Out: the State, advanced. It is slow and meant to be obviously
right: every other backend is tested against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from neurovis_spec.arrays import FloatArray, FloatColumn
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Block, Gather, Learn, ReadInputs, Send, Update
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import PLAIN
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import State, constants

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
    """One network; ``step`` executes its program once."""

    def __init__(self, network: Network) -> None:
        self.network, self.functions = network, PLAIN
        self.offsets = signal_layout(network).offsets

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Execute the operations of the program in order."""
        drives: dict[int, list[float]] = {}
        for operation in self.network.program:
            match operation:
                case ReadInputs():
                    pass  # done by the caller: ``inputs`` holds them
                case Gather(block=number):
                    drives[number] = self.gather(self.network.blocks[number], state, inputs)
                case Update(block=number):
                    self.update(number, drives[number], state)
                case Send():
                    self.send(state)
                case Learn(plasticity=number):
                    self.learn(number, state, inputs)
        state.k += 1

    def gather(self, block: Block, state: State, inputs: FloatArray) -> list[float]:
        """u[t] of each member: what arrives, combined, + bias + input + noise (§5.2)."""
        connections, neurons = self.network.connections, self.network.neurons
        arriving: list[list[tuple[float, float]]] = [[] for _ in block.members]
        for connection, slot in zip(block.incoming.tolist(), block.slots.tolist(), strict=True):
            if not state.conditions.structure.gone[connection]:
                signal = self.arriving(connection, state)
                arriving[slot].append((signal, self.number("centres", connections.centres, connection, state)))
        drives = []
        for neuron, signals in zip(block.members.tolist(), arriving, strict=True):
            drive = combined(block.combine, signals) + self.number("bias", neurons.bias, neuron, state)
            if neurons.input[neuron] >= 0:
                drive += float(inputs[neurons.input[neuron]])
            if self.network.noise_index[neuron] >= 0:
                drive += float(inputs[self.network.noise_index[neuron]])
            drives.append(drive)
        return drives

    def number(self, array: str, values: FloatArray | FloatColumn, place: int, state: State) -> float:
        """A number of the network; of an array that can be set, as it is by now."""
        variable = self.network.settable.variables.get(array)
        if variable is None:
            return float(values[place])
        return float(state.conditions.variables[variable.start + (place if variable.size > 1 else 0)])

    def numbers(self, owner: str, arrays: Mapping[str, FloatArray], place: int, state: State) -> dict[str, float]:
        """The parameters of a definition in use, for one of its neurons or connections."""
        return {name: self.number(f"{owner}/{name}", values, place, state) for name, values in arrays.items()}

    def arriving(self, connection: int, state: State) -> float:
        """w[t−d]·a[t−d]: of this step for d = 0, else what was sent d steps ago."""
        connections = self.network.connections
        delay = int(connections.delays[connection])
        if delay == 0:
            return float(state.weights[connection]) * float(state.activity[connections.sources[connection]])
        return float(state.signals[self.offsets[connection] + state.k % delay])

    def update(self, number: int, drives: list[float], state: State) -> None:
        """The states of a block from old states and the drive, then the activities from the new ones."""
        block, neurons = self.network.blocks[number], self.network.neurons
        for position, neuron in enumerate(block.members.tolist()):
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
        block = self.network.blocks[number]
        model, cells = block.model, state.cells[number]
        own = self.clock(state) | self.numbers(f"model/{number}", block.model_parameters, position, state)
        own["drive"] = drive
        shape = self.clock(state)
        shape |= self.numbers(f"activation/{number}", block.activation_parameters, position, state)
        functions = {
            name: lambda x, value=value: evaluate(value, shape | {"x": x})
            for name, value in block.activation.functions.items()
        }
        old = {quantity.name: float(cells[i][position]) for i, quantity in enumerate(model.state)}
        known = with_let(own | old, model.let)
        new = changed(old, {q.name: q.each_step for q in model.state}, known, functions)
        activity = evaluate(model.activity, known | new, functions)
        if self.ends_episode(state):
            known = with_let(own | new, model.let)
            new = changed(new, {q.name: q.each_episode for q in model.state}, known)
        for i, quantity in enumerate(model.state):
            cells[i][position] = new[quantity.name]
        return activity

    def send(self, state: State) -> None:
        """w[t]·a[t] of every delayed connection leaves; a[t] is remembered."""
        connections = self.network.connections
        for connection, delay in enumerate(connections.delays.tolist()):
            if delay > 0:
                signal = float(state.weights[connection]) * float(state.activity[connections.sources[connection]])
                state.signals[self.offsets[connection] + state.k % delay] = signal
        if len(state.history):
            state.history[state.k % len(state.history)] = state.activity

    def learn(self, number: int, state: State, inputs: FloatArray) -> None:
        """w[t+1] and the states of a rule from old values; at an episode's end, once more from what these gave."""
        plasticity = self.network.plasticity[number]
        for position, connection in enumerate(plasticity.members.tolist()):
            if not state.conditions.structure.still[connection]:
                self.learn_one(number, position, connection, state, inputs)

    def learn_one(self, number: int, position: int, connection: int, state: State, inputs: FloatArray) -> None:
        """The weight and the states of one connection."""
        plasticity, traces, connections = (
            self.network.plasticity[number],
            state.traces[number],
            self.network.connections,
        )
        rule = plasticity.rule
        low = self.number("low", connections.low, connection, state)
        high = self.number("high", connections.high, connection, state)
        own = self.clock(state) | self.numbers(f"rule/{number}", plasticity.parameters, position, state)
        own |= self.seen(connection, state)
        both = (*state.activity.tolist(), *inputs.tolist())
        own |= {signal: both[plasticity.signals[signal][position]] for signal in rule.signals}
        old = {quantity.name: float(traces[i][position]) for i, quantity in enumerate(rule.state)}
        old["weight"] = float(state.weights[connection])
        steps = {quantity.name: quantity.each_step for quantity in rule.state} | {"weight": rule.each_step}
        new = changed(old, steps, with_let(own | old, rule.let))
        if rule.each_step is not None:
            new["weight"] = min(max(new["weight"], low), high)
        if self.ends_episode(state):
            ends = {quantity.name: quantity.each_episode for quantity in rule.state} | {"weight": rule.each_episode}
            new = changed(new, ends, with_let(own | new, rule.let))
            if rule.each_episode is not None:
                new["weight"] = min(max(new["weight"], low), high)
        for i, quantity in enumerate(rule.state):
            traces[i][position] = new[quantity.name]
        state.weights[connection] = new["weight"]

    def seen(self, connection: int, state: State) -> dict[str, float]:
        """``pre`` = a_j[t−d], 0 where what was sent then is lost, ``sent`` = a_j[t] and ``post`` = a_i[t] of a
        connection from j to i."""
        connections = self.network.connections
        source, target = int(connections.sources[connection]), int(connections.targets[connection])
        delay = int(connections.delays[connection])
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
    """The names known and the intermediate values, computed in order."""
    known = dict(known)
    for name, tree in let:
        known[name] = evaluate(tree, known)
    return known


def changed(
    old: dict[str, float],
    trees: dict[str, Tree | None],
    known: dict[str, float],
    functions: Mapping[str, Callable[..., float]] = _NONE,
) -> dict[str, float]:
    """New values, all from ``known``; what has no expression stays."""
    return {
        name: value if (tree := trees[name]) is None else evaluate(tree, known, functions)
        for name, value in old.items()
    }
