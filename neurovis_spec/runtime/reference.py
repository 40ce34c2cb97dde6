"""The reference interpreter: walks the update program plainly, one neuron and one connection after the other.

In: a Network, a State, the vector of all inputs. Out: the State, advanced. It is slow and meant to be obviously
right: every other backend is tested against it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import singledispatch
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.network import Network, Outlet
from neurovis_spec.compiler.program import (
    CENTRE,
    MODEL,
    Advance,
    Diffuse,
    Gather,
    Integrate,
    Learn,
    Operation,
    Population,
    Projection,
    ReadInputs,
    Receive,
    Send,
    SendAhead,
    Softmax,
    Tie,
    Update,
    Use,
)
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import PLAIN
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.events import rows_of
from neurovis_spec.runtime.reference_flows import Flow
from neurovis_spec.runtime.reference_seen import NO_FUNCTIONS, Functions, NetworkArray, Seen, is_first, with_let
from neurovis_spec.runtime.softmax import shared
from neurovis_spec.runtime.stages import acts_now, formulas_of, given
from neurovis_spec.runtime.state import State


class Bounded(NamedTuple):
    """A number that must stay within its bounds."""

    value: float
    low: float
    high: float


class ReferenceBackend:
    """Executes anything, slowly."""

    name = "reference"
    capabilities = Capabilities(
        noise=True, flows=True, synapses=True, spikes=True, clamped_states=True, exactness="bits"
    )

    def availability(self) -> Availability:
        """Always there."""
        return Availability(True, "plain and slow: what the others are tested against")

    def prepare(self, network: Network) -> ReferenceStepper:
        """Nothing is compiled."""
        return ReferenceStepper(network)


class ReferenceStepper(Seen):
    """One network; ``step`` executes its program once, each operation as it is registered with ``perform``."""

    def __init__(self, network: Network) -> None:
        super().__init__(network)
        self.functions = PLAIN
        variables, connections = network.settable.variables, network.connections
        self.low = NetworkArray(connections.low.whole(), variables.get(LOW))
        self.high = NetworkArray(connections.high.whole(), variables.get(HIGH))
        #: what integrates flow states
        self.flows = [Flow(self, operation) for operation in network.program if isinstance(operation, Integrate)]
        #: of each population what of its model its update carries out
        self.updating = [replace(one.model, definition=one.model.definition.at_update) for one in network.populations]
        #: by populations, then by ports, what each member was given there last
        self.ports: dict[int, dict[str, list[float]]] = {}

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Execute the operations of the program in order."""
        for projection in self.network.projections:
            self.hold_states(projection.use, state)
        for operation in self.network.program:
            perform(operation, self, state, inputs)
        state.k += 1

    def gather(
        self, population: Population, state: State, inputs: FloatArray, now: bool = False
    ) -> dict[str, list[float]]:
        """What each member is given at each port: what arrives, combined, + bias + input + noise; of spikes that act
        ``now``, behind all others, these alone."""
        self.hold_states(population.model, state)
        result = {}
        for port in population.ports:
            signals = self.signals(port, np.flatnonzero(acts_now(port) == now).tolist(), state)
            result[port.name] = self.given(population, port, signals, state, None if now else inputs.tolist())
        return result

    def update(self, number: int, ports: Mapping[str, Sequence[float]], state: State) -> None:
        """The states of a population from old states and the ports, then outputs and activities from the new ones, and
        what of these is sent."""
        network = self.network
        population = network.populations[number]
        self.hold_states(population.model, state)
        for position, neuron in enumerate(population.members.tolist()):
            initial = float(network.neurons.initial[neuron])
            if is_first(state) and not math.isnan(initial):
                state.activity[neuron] = initial
            else:
                own = {name: values[position] for name, values in ports.items()}
                state.activity[neuron] = self.advance(number, position, own, state)
            held = state.conditions.held_at(neuron)
            if held is not None:
                state.activity[neuron] = held
        for outlet in network.outlets:
            if outlet.population == number:
                self.let_out(outlet, state.cells[population.model.owner][outlet.name], state)

    def advance_in(self, operation: Advance, state: State) -> None:
        """What becomes of the states of a population in a phase before its update, from old values and the ports."""
        if is_first(state):
            return
        population, ports = self.network.populations[operation.population], self.ports[operation.population]
        definition = replace(population.model.definition.during([operation.phase]), gives=())
        use = replace(population.model, definition=definition)
        self.hold_states(use, state)
        for position in range(len(population.members)):
            seen = self.known(use, position, state) | {name: values[position] for name, values in ports.items()}
            self.change(use, position, seen, state, {}, self.functions_of(population, position, state))

    def hold_states(self, use: Use, state: State) -> None:
        """The states of a definition in use that are held, at what they are held at."""
        for (owner, name), (positions, values) in (state.conditions.fixed or {}).items():
            if owner == use.owner:
                state.cells[owner][name][positions] = values

    def let_out(self, outlet: Outlet, values: FloatArray, state: State) -> None:
        """What connections take of a population beside its activities; 0 of neurons that are lesioned."""
        silent = state.conditions.lesioned_neurons[self.network.populations[outlet.population].members]
        state.outlets[outlet.start : outlet.start + len(values)] = np.where(silent, 0.0, values)

    def send_ahead(self, operation: SendAhead, state: State) -> None:
        """What connections take of a population, where flow states are all that it is made of."""
        population = self.network.populations[operation.population]
        self.hold_states(population.model, state)
        own = {name: values.tolist() for name, values in state.cells[population.model.owner].items()}
        trees = [(name, given(population.model.definition, name)) for name in operation.names]
        for name, values in self.values(population, formulas_of(population, trees), own, state).items():
            if name == MODEL.gives:
                for neuron, value in zip(population.members.tolist(), values, strict=True):
                    held = state.conditions.held_at(neuron)
                    state.activity[neuron] = value if held is None else held
            for outlet in self.network.outlets:
                if (outlet.population, outlet.name) == (operation.population, name):
                    self.let_out(outlet, np.array(values), state)

    def advance(self, number: int, position: int, ports: dict[str, float], state: State) -> float:
        """The step of one neuron of a population: its states and outputs are replaced, its activity is returned."""
        population = self.network.populations[number]
        seen = self.known(population.model, position, state) | ports
        functions = self.functions_of(population, position, state)
        return self.change(self.updating[number], position, seen, state, {}, functions)["activity"]

    def change(
        self,
        use: Use,
        position: int,
        seen: Mapping[str, float],
        state: State,
        lasting: Mapping[str, Bounded],
        functions: Functions = NO_FUNCTIONS,
    ) -> dict[str, float]:
        """What becomes of the states of a definition in use, and of what it gives, for one member: all from old values
        at once, then what does not last from the new states; at an episode's end once more from what these gave. What
        flows begins with its initial states: they stay at step 0. ``lasting`` is what it gives and lasts, within its
        bounds. States and outputs are replaced, all is returned."""
        definition, cells = use.definition, state.cells[use.owner]
        fixed = self.fixed(use, position, state)
        old = {one.name: float(cells[one.name][position]) for one in definition.state}
        old |= {name: bounded.value for name, bounded in lasting.items()}
        known = with_let({**seen, **old}, definition.let, functions)
        stay = definition.staying if is_first(state) else ()
        steps = [(name, tree) for name, tree in definition.steps.items() if name not in stay]
        new = changed(old, steps, known, lasting, functions) | fixed
        fleeting = [(one.name, one.each_step) for one in definition.fleeting]
        results = changed(new, fleeting, known | new, {}, functions) if fleeting else new
        if self.ends_episode(state):
            ends = [(one.name, one.each_episode) for one in definition.lasting]
            new = changed(new, ends, with_let({**seen, **new}, definition.let, functions), lasting, functions) | fixed
            results = results | new
        for name in cells.keys() & results.keys():
            cells[name][position] = results[name]
        return results

    def fixed(self, use: Use, position: int, state: State) -> dict[str, float]:
        """The states of a member that are held, and at what."""
        found: dict[str, float] = {}
        for one in use.definition.holdable if state.conditions.fixed else ():
            at = state.conditions.fixed_in(use.owner, one.name)
            if position in at:
                found[one.name] = at[position]
        return found

    def send(self, state: State) -> None:
        """w[t]·a[t] of every delayed connection without a synapse leaves, or a[t] where it is shared; a[t] is
        remembered."""
        sent, layout = np.concatenate((state.activity, state.outlets)), self.layouts[state.own_signals]
        for connection, first in enumerate(layout.offsets.tolist()):
            if first < 0:
                continue
            leaving = float(sent[self.sending[connection]])
            if not layout.shares[connection]:
                leaving = float(state.weights[connection]) * leaving
            length = int(layout.lengths[connection])
            state.signals[first + state.k % length] = leaving
            if is_first(state) and self.lags is not None and self.lags.there[connection]:
                state.signals[first : first + length] = leaving  # so it was before the first step
        if len(state.history):
            state.history[state.k % len(state.history)] = sent

    def receive(self, operation: Receive, state: State) -> None:
        """The states of synapses from old values."""
        projection = self.network.projections[operation.projection].during(operation.phases)
        self.hold_states(self.behind[operation.projection][0].model, state)
        idle = state.conditions.structure.idle(projection)
        for position in self.in_turn(projection):
            if not idle[position]:
                seen = self.known(projection.use, position, state) | self.before_update(projection, position, state)
                if projection.when and not seen[projection.when]:
                    continue
                seen["weight"] = float(state.weights[projection.members[position]])
                if projection.slots is None:
                    self.change(projection.use, position, seen, state, {})
                else:
                    self.add(projection, position, seen, state)

    def in_turn(self, projection: Projection) -> list[int]:
        """The members of a projection in the order in which they are changed: of what adds to shared states, where the
        order counts, in that in which spikes come."""
        if projection.slots is None or not projection.when:
            return list(range(len(projection.members)))
        end = self.ends[projection.use.owner.number][projection.when]
        order: list[int] = rows_of(end.places, self.delays[projection.members]).order.tolist()
        return order

    def add(self, projection: Projection, position: int, seen: Mapping[str, float], state: State) -> None:
        """What a connection adds to states of a shared synapse; those that are held stay."""
        assert projection.slots is not None
        receptor, slot = self.network.projections[projection.feeds].use, int(projection.slots[position])
        cells = state.cells[receptor.owner]
        added = {
            one.name: Bounded(float(cells[one.name][slot]), -math.inf, math.inf)
            for one in projection.use.definition.gives
        }
        results = self.change(projection.use, position, seen, state, added)
        for name in added:
            cells[name][slot] = results[name]
        self.hold_states(receptor, state)

    def learn(self, operation: Learn, state: State, inputs: FloatArray) -> None:
        """w[t+1] and the states of a rule from old values; at an episode's end, once more from what these gave."""
        projection = self.network.projections[operation.projection].during(operation.phases)
        for position, connection in enumerate(projection.members.tolist()):
            if not state.conditions.structure.still[connection]:
                self.learn_one(projection, position, connection, state, inputs)

    def learn_one(
        self, projection: Projection, position: int, connection: int, state: State, inputs: FloatArray
    ) -> None:
        """The weight and the states of one connection."""
        low, high = self.low.at(connection, state), self.high.at(connection, state)
        behind = len(state.activity) + len(state.outlets)

        def now(index: int) -> float:
            return self.at(index, state) if index < behind else float(inputs[index - behind])

        seen = self.known(projection.rule, position, state) | self.seen(projection, position, state, now, 1.0)
        if projection.when and not seen[projection.when]:
            return
        if projection.rule.definition.moves_centre:
            centre = Bounded(self.centre(connection, state), -math.inf, math.inf)
            self.change(projection.rule, position, seen, state, {CENTRE: centre})
        else:
            weight = Bounded(float(state.weights[connection]), low, high)
            results = self.change(projection.rule, position, seen, state, {"weight": weight})
            state.weights[connection] = results["weight"]

    def ends_episode(self, state: State) -> bool:
        """Whether (t + 1) mod m = 0."""
        return self.network.episode is not None and (state.k + 1) % self.network.episode == 0


def changed(
    old: dict[str, float],
    trees: Iterable[tuple[str, Tree | None]],
    known: dict[str, float],
    bounds: Mapping[str, Bounded],
    functions: Functions = NO_FUNCTIONS,
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
    population = by.network.populations[operation.population]
    by.ports[operation.population] = by.gather(population, state, inputs, operation.now)


@perform.register
def _advance(operation: Advance, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.advance_in(operation, state)


@perform.register
def _receive(operation: Receive, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.receive(operation, state)


@perform.register
def _update(operation: Update, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.update(operation.population, by.ports[operation.population], state)


@perform.register
def _integrate(operation: Integrate, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    for flow in by.flows:
        flow.integrate(state, inputs)


@perform.register
def _diffuse(operation: Diffuse, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    for flow in by.flows:
        flow.diffuse(state, inputs)


@perform.register
def _send_ahead(operation: SendAhead, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.send_ahead(operation, state)


@perform.register
def _send(operation: Send, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.send(state)


@perform.register
def _learn(operation: Learn, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    by.learn(operation, state, inputs)


@perform.register
def _tie(operation: Tie, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    for connection, other in zip(operation.connections.tolist(), operation.of.tolist(), strict=True):
        state.weights[connection] = state.weights[other]


@perform.register
def _softmax(operation: Softmax, by: ReferenceStepper, state: State, inputs: FloatArray) -> None:
    population = by.network.populations[operation.population]
    members, initial = population.members, by.network.neurons.initial
    assert population.shares is not None
    for begin, end in pairwise(population.shares.tolist()):
        own = members[begin:end].tolist()
        begun = [is_first(state) and not math.isnan(float(initial[neuron])) for neuron in own]
        held = [state.conditions.held_at(neuron) is not None for neuron in own]
        free = [not (one or other) for one, other in zip(begun, held, strict=True)]
        state.activity[own] = shared(state.activity[own].tolist(), free)
