"""The flow of the reference: states with a derivative, integrated over a step, a stage at a time, in plain loops.

In: a Network, a State before the step's updates, the vector of all inputs. Out: the flow states behind the step. A
*stage* is one evaluation of all derivatives: first what connections take within it, then the ports that derivatives
read, then the derivatives. In a port what is held over the step comes first, then what is made anew at the stage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.program import Integrate, Port
from neurovis_spec.language.expressions.functions import FUNCTIONS, divide, minimum
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.inputs import at_stage
from neurovis_spec.runtime.reference_seen import Seen, is_first
from neurovis_spec.runtime.stages import Formulas, Part, Times, apart, parts_of, times
from neurovis_spec.runtime.state import State


class Place(NamedTuple):
    """The number of a population, and the name of one of its flow states."""

    population: int
    name: str


#: Numbers of flow states, of each one a member.
Numbers: TypeAlias = Mapping[Place, Sequence[float]]


@dataclass
class Stage:
    """What is known at a stage: the flow states ``x``, the seconds ``t``, all inputs; and what is made of them: what is
    ``sent``, all activities and then the outlets, and the ports, by population and name."""

    state: State
    x: Numbers
    t: float
    inputs: Sequence[float]
    sent: list[float]
    ports: dict[tuple[int, str], list[float]] = field(default_factory=dict)


#: The stage of flow states, which are given, at a time (seconds).
Look: TypeAlias = Callable[[Numbers, float], Stage]


class Flow:
    """The integration of some populations of a network."""

    def __init__(self, seen: Seen, operation: Integrate) -> None:
        self.seen, self.network, self.operation = seen, seen.network, operation
        self.parts = parts_of(seen.network, operation)
        #: what the noise of each state is multiplied by, as it was at the beginning of the step
        self.spread: Numbers = {}

    def integrate(self, state: State, inputs: FloatArray) -> None:
        """From what the flow states were after the step before to what they are now; they stay at the first step."""
        if is_first(state):
            return
        cells = {Place(part.number, name): self._cells(part, name, state) for part in self.parts for name in part.flows}
        x = self.fix({place: values.tolist() for place, values in cells.items()}, state)
        start, h = (state.k - 1) * self.network.dt, self.network.dt / self.operation.substeps
        stage = self.stage(state, x, times(start, h).first, inputs)
        self.spread = self.all_values(stage, lambda part: part.spread)
        for substep in range(self.operation.substeps):
            at = times(start + substep * h, h)
            x = METHODS[self.operation.method](self, x, at, lambda x, t: self.stage(state, x, t, inputs))
            x = self.fix(x, state)
        for place, values in cells.items():
            values[:] = x[place]

    def diffuse(self, state: State, inputs: FloatArray) -> None:
        """x + g·√dt·ξ of each flow state with noise, with g as it was at the beginning of the step."""
        if is_first(state):
            return
        for part in self.parts:
            root = math.sqrt(self.network.dt * part.population.model.definition.per_second)
            for name, _ in part.spread.trees:
                drawn = self.network.noise_of(state=name)[part.population.members]
                values, spread = self._cells(part, name, state), self.spread[Place(part.number, name)]
                fixed = state.conditions.fixed_in(part.population.model.owner, name)
                for position, g in enumerate(spread):
                    if position not in fixed:
                        values[position] += (g * root) * float(inputs[drawn[position]])

    def fix(self, x: Numbers, state: State, at: float | None = None) -> Numbers:
        """The same, but for states that are held: what these are held at, or what all of them have ``at``."""
        result: dict[Place, list[float]] = {}
        for place, values in x.items():
            owner = self.network.populations[place.population].model.owner
            fixed = state.conditions.fixed_in(owner, place.name)
            result[place] = [
                value if position not in fixed else fixed[position] if at is None else at
                for position, value in enumerate(values)
            ]
        return result

    def _cells(self, part: Part, name: str, state: State) -> FloatArray:
        return state.cells[part.population.model.owner][name]

    def stage(self, state: State, x: Numbers, t: float, inputs: FloatArray) -> Stage:
        """What is taken at a stage, population by population."""
        sent = [*state.activity.tolist(), *state.outlets.tolist()]
        stage = Stage(state, x, t, at_stage(self.network, inputs, state, t), sent)
        for part in self.parts:
            for taken in part.taken:
                (values,) = self.values(part, taken.formulas, stage).values()
                for position, neuron in enumerate(part.population.members.tolist()):
                    held = state.conditions.held_at(neuron) if taken.is_activity else None
                    value = values[position] if held is None else held
                    sent[taken.places[position]] = 0.0 if state.conditions.lesioned_neurons[neuron] else value
        return stage

    def derivatives(self, stage: Stage) -> Numbers:
        """All derivatives at a stage; 0 of states that are held."""
        return self.fix(self.all_values(stage, lambda part: part.derivatives), stage.state, 0.0)

    def slopes(self, stage: Stage) -> Numbers:
        """How much each derivative changes with its own state at a stage."""
        return self.all_values(stage, lambda part: part.slopes)

    def all_values(self, stage: Stage, formulas: Callable[[Part], Formulas]) -> Numbers:
        """The values of formulas of all parts."""
        return {
            Place(part.number, name): values
            for part in self.parts
            for name, values in self.values(part, formulas(part), stage).items()
        }

    def values(self, part: Part, formulas: Formulas, stage: Stage) -> dict[str, list[float]]:
        """The values of formulas at a stage by their names, of each one a member."""
        if not formulas.trees:
            return {}
        own = {name: values.tolist() for name, values in stage.state.cells[part.population.model.owner].items()}
        own |= {name: stage.x[Place(part.number, name)] for name in part.flows}
        own |= {port.name: self.port(part, port, stage) for port in formulas.ports}
        return self.seen.values(part.population, formulas, own, stage.state, stage.t)

    def port(self, part: Part, port: Port, stage: Stage) -> list[float]:
        """What each member is given at a port at a stage."""
        made = stage.ports.get((part.number, port.name))
        if made is None:
            held, staged = apart(port)
            signals = [
                *self.seen.signals(port, held, stage.state),
                *self.seen.signals(port, staged, stage.state, stage.sent),
            ]
            made = self.seen.given(part.population, port, signals, stage.state, stage.inputs)
            stage.ports[part.number, port.name] = made
        return made

    def combine(self, made: Callable[..., float], *numbers: Numbers) -> Numbers:
        """For each flow state what is made of the length of a step, in the time of its definition, and of what it has
        in each of these numbers."""
        result: dict[Place, list[float]] = {}
        for place in numbers[0]:
            definition = self.network.populations[place.population].model.definition
            h = self.network.dt * definition.per_second / self.operation.substeps
            result[place] = [made(h, *values) for values in zip(*(one[place] for one in numbers), strict=True)]
        return result


def _euler(flow: Flow, x: Numbers, at: Times, look: Look) -> Numbers:
    return flow.combine(lambda h, x, k: x + h * k, x, flow.derivatives(look(x, at.first)))


def _heun(flow: Flow, x: Numbers, at: Times, look: Look) -> Numbers:
    k1 = flow.derivatives(look(x, at.first))
    k2 = flow.derivatives(look(flow.combine(lambda h, x, k: x + h * k, x, k1), at.last))
    return flow.combine(lambda h, x, k1, k2: x + (h / 2.0) * (k1 + k2), x, k1, k2)


def _rk4(flow: Flow, x: Numbers, at: Times, look: Look) -> Numbers:
    k1 = flow.derivatives(look(x, at.first))
    k2 = flow.derivatives(look(flow.combine(lambda h, x, k: x + (h / 2.0) * k, x, k1), at.middle))
    k3 = flow.derivatives(look(flow.combine(lambda h, x, k: x + (h / 2.0) * k, x, k2), at.middle))
    k4 = flow.derivatives(look(flow.combine(lambda h, x, k: x + h * k, x, k3), at.last))
    return flow.combine(
        lambda h, x, k1, k2, k3, k4: x + (h / 6.0) * (((k1 + 2.0 * k2) + 2.0 * k3) + k4), x, k1, k2, k3, k4
    )


def _exponential(flow: Flow, x: Numbers, at: Times, look: Look) -> Numbers:
    stage, exprel = look(x, at.first), FUNCTIONS["exprel"].scalar
    return flow.combine(
        lambda h, x, k, j: x + (h * exprel(h * minimum(j, 0.0))) * k, x, flow.derivatives(stage), flow.slopes(stage)
    )


def _semi_implicit(flow: Flow, x: Numbers, at: Times, look: Look) -> Numbers:
    stage = look(x, at.first)
    return flow.combine(
        lambda h, x, k, j: x + divide(h * k, 1.0 - h * minimum(j, 0.0)), x, flow.derivatives(stage), flow.slopes(stage)
    )


METHODS: Final[Mapping[Method, Callable[[Flow, Numbers, Times, Look], Numbers]]] = {
    "euler": _euler,
    "heun": _heun,
    "rk4": _rk4,
    "exponential": _exponential,
    "semi_implicit": _semi_implicit,
}
