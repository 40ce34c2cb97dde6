"""The flow of the reference: states with a derivative, integrated over a step, a stage at a time, in plain loops.

In: a Network, a State before the step's updates, the vector of all inputs. Out: the flow states behind the step. A
*stage* is one evaluation of all derivatives: first what connections take within it, then the ports that derivatives
read, with the signals that synapses form there, then the derivatives, of neurons and of connections. In a port what is
held over the step comes first, then what is made anew at the stage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.program import Integrate, Owner, Port
from neurovis_spec.language.expressions.functions import FUNCTIONS, divide, minimum
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.inputs import at_stage
from neurovis_spec.runtime.reference_seen import Seen, Sent, is_first
from neurovis_spec.runtime.stages import (
    Contacts,
    Formulas,
    Moment,
    Part,
    Through,
    Times,
    apart,
    contacts_of,
    flowing,
    parts_of,
    taken_in_order,
    times,
)
from neurovis_spec.runtime.state import State


class Place(NamedTuple):
    """Whose flow state it is, a model's, a synapse's or a rule's, and its name."""

    owner: Owner
    name: str


#: Numbers of flow states, of each one a member.
Numbers: TypeAlias = Mapping[Place, Sequence[float]]
#: What flow states are held at over a step, by the positions of the members that are.
Still: TypeAlias = Mapping[Place, Mapping[int, float]]


@dataclass
class Stage:
    """What is known at a stage: the flow states ``x``, the seconds ``t``, which ``share`` of the step is over, all
    inputs; and what is made of them: what is ``sent``, all activities and then the outlets, and the ports, by
    population and name."""

    state: State
    still: Still
    x: Numbers
    t: float
    share: float
    inputs: Sequence[float]
    sent: list[float]
    ports: dict[tuple[int, str], list[float]] = field(default_factory=dict)


#: The stage of flow states, which are given, at a time.
Look: TypeAlias = Callable[[Numbers, Moment], Stage]


class Flow:
    """The integration of the states of some populations and projections of a network."""

    def __init__(self, seen: Seen, operation: Integrate) -> None:
        self.seen, self.network, self.operation = seen, seen.network, operation
        self.contacts = {one.number: one for one in contacts_of(seen.network, operation)}
        flows = flowing(seen.network) if self.contacts else np.zeros(0, dtype=np.bool_)
        self.parts = parts_of(seen.network, operation, self.contacts.values(), flows)
        #: of activities and outlets whether they are, where connections read them now, those of a stage
        self.flowing: list[bool] = flows.tolist()
        #: whose states flow
        self.uses = {part.population.model.owner: part.population.model for part in self.parts}
        self.uses |= {one.projection.use.owner: one.projection.use for one in self.contacts.values()}
        #: what the noise of each state is multiplied by, as it was at the beginning of the step
        self.spread: Numbers = {}

    def integrate(self, state: State, inputs: FloatArray) -> None:
        """From what the flow states were after the step before to what they are now; they stay at the first step."""
        if is_first(state):
            return
        cells = {
            Place(owner, one.name): state.cells[owner][one.name]
            for owner, use in self.uses.items()
            for one in use.definition.flows
        }
        still = self.still(cells, state)
        x = fix({place: values.tolist() for place, values in cells.items()}, still)
        start, h = (state.k - 1) * self.network.dt, self.network.dt / self.operation.substeps

        def look(x: Numbers, at: Moment) -> Stage:
            return self.stage(state, still, x, at, inputs)

        stage = look(x, times(start, h, 0, self.operation.substeps).first)
        self.spread = {
            Place(part.population.model.owner, name): values
            for part in self.parts
            for name, values in self.values(part, part.spread, stage).items()
        }
        substeps = self.operation.substeps
        for substep in range(substeps):
            x = fix(METHODS[self.operation.method](self, x, times(start, h, substep, substeps), look), still)
        for place, values in cells.items():
            values[:] = x[place]

    def diffuse(self, state: State, inputs: FloatArray) -> None:
        """x + g·√dt·ξ of each flow state with noise, with g as it was at the beginning of the step."""
        if is_first(state):
            return
        for part in self.parts:
            use = part.population.model
            root = math.sqrt(self.network.dt * use.definition.per_second)
            for name, _ in part.spread.trees:
                drawn = self.network.noise_of(state=name)[part.population.members]
                values, spread = state.cells[use.owner][name], self.spread[Place(use.owner, name)]
                fixed = state.conditions.fixed_in(use.owner, name)
                for position, g in enumerate(spread):
                    if position not in fixed:
                        values[position] += (g * root) * float(inputs[drawn[position]])

    def still(self, cells: Mapping[Place, FloatArray], state: State) -> Still:
        """The states that are held, and those of connections whose synapse or rule does nothing, which stay what they
        are."""
        found = {place: state.conditions.fixed_in(place.owner, place.name) for place in cells}
        for one in self.contacts.values():
            idle = state.conditions.structure.idle(one.projection)
            for name in one.flows:
                place = Place(one.projection.use.owner, name)
                stay = {position: float(cells[place][position]) for position in np.flatnonzero(idle).tolist()}
                found[place] = {**found[place], **stay}
        return found

    def stage(self, state: State, still: Still, x: Numbers, at: Moment, inputs: FloatArray) -> Stage:
        """What is taken at a stage, population by population."""
        sent = [*state.activity.tolist(), *state.outlets.tolist()]
        stage = Stage(state, still, x, *at, at_stage(self.network, inputs, state, at.t), sent)
        for part, taken in taken_in_order(self.parts):
            (values,) = self.values(part, taken.formulas, stage).values()
            for position, neuron in enumerate(part.population.members.tolist()):
                held = state.conditions.held_at(neuron) if taken.is_activity else None
                value = values[position] if held is None else held
                sent[taken.places[position]] = 0.0 if state.conditions.lesioned_neurons[neuron] else value
        stage.ports.clear()  # what arrives at members of which nothing is taken may have been taken later
        return stage

    def derivatives(self, stage: Stage) -> Numbers:
        """All derivatives at a stage; 0 of states that are held."""
        return fix(self.all_values(stage, lambda one: one.derivatives), stage.still, 0.0)

    def slopes(self, stage: Stage) -> Numbers:
        """How much each derivative changes with its own state at a stage, through synapses, too."""
        made = dict(self.all_values(stage, lambda one: one.slopes))
        for part in self.parts:
            for through in part.through:
                place = Place(part.population.model.owner, through.state)
                ((_, by_port),) = self.values(part, through.slope, stage).items()
                back = self.back(part, through, stage)
                made[place] = [j + by * sum_ for j, by, sum_ in zip(made[place], by_port, back, strict=True)]
        return made

    def back(self, part: Part, through: Through, stage: Stage) -> list[float]:
        """How much what synapses bring to a port of each member changes with one of its states."""
        totals = [0.0 for _ in part.population.members]
        port, synapses = through.port, self.seen.synapses
        for place in apart(port)[1].tolist():
            connection = int(port.incoming[place])
            contacts = self.contacts.get(int(synapses.numbers[connection]))
            if contacts is None or stage.state.conditions.structure.gone[connection]:
                continue
            values = self.joined(contacts, int(synapses.positions[connection]), contacts.back, stage)
            if through.state in values:
                factor = 1.0 if port.factors is None else float(port.factors[place])
                totals[port.slots[place]] += values[through.state] * factor
        return totals

    def all_values(self, stage: Stage, formulas: Callable[[Part | Contacts], Formulas]) -> Numbers:
        """The values of formulas of all populations, and of all projections."""
        found: dict[Place, list[float]] = {}
        for part in self.parts:
            for name, values in self.values(part, formulas(part), stage).items():
                found[Place(part.population.model.owner, name)] = values
        for one in self.contacts.values():
            made = [self.joined(one, place, formulas(one), stage) for place in range(len(one.projection.members))]
            for name, _ in formulas(one).trees:
                found[Place(one.projection.use.owner, name)] = [values[name] for values in made]
        return found

    def values(self, part: Part, formulas: Formulas, stage: Stage) -> dict[str, list[float]]:
        """The values of formulas at a stage by their names, of each one a member."""
        if not formulas.trees:
            return {}
        owner = part.population.model.owner
        own = {name: values.tolist() for name, values in stage.state.cells[owner].items()}
        own |= {name: stage.x[Place(owner, name)] for name in part.flows}
        own |= {port.name: self.port(part, port, stage) for port in formulas.ports}
        return self.seen.values(part.population, formulas, own, stage.state, stage.t)

    def joined(self, contacts: Contacts, position: int, formulas: Formulas, stage: Stage) -> dict[str, float]:
        """The values of formulas of a synapse or a rule at a stage by their names, for one of its connections."""
        if not formulas.trees:
            return {}
        state, projection = stage.state, contacts.projection
        owner = projection.use.owner

        def now(index: int) -> float:
            if index >= len(self.flowing):
                return stage.inputs[index - len(self.flowing)]
            return stage.sent[index] if self.flowing[index] else self.seen.at(index, state)

        own = {name: float(values[position]) for name, values in state.cells[owner].items()}
        own |= {name: stage.x[Place(owner, name)][position] for name in contacts.flows}
        own |= self.seen.seen(projection, position, state, now, stage.share)
        return self.seen.values_at(projection, position, formulas, own, state, stage.t)

    def port(self, part: Part, port: Port, stage: Stage) -> list[float]:
        """What each member is given at a port at a stage."""
        made = stage.ports.get((part.number, port.name))
        if made is None:

            def formed(number: int, position: int) -> float:
                contacts = self.contacts[number]
                (value,) = self.joined(contacts, position, contacts.signal, stage).values()
                return value

            held, staged = apart(port)
            signals = [
                *self.seen.signals(port, held, stage.state),
                *self.seen.signals(port, staged, stage.state, Sent(stage.sent, stage.share, formed)),
            ]
            made = self.seen.given(part.population, port, signals, stage.state, stage.inputs)
            stage.ports[part.number, port.name] = made
        return made

    def combine(self, made: Callable[..., float], *numbers: Numbers) -> Numbers:
        """For each flow state what is made of the length of a step, in the time of its definition, and of what it has
        in each of these numbers."""
        result: dict[Place, list[float]] = {}
        for place in numbers[0]:
            h = self.network.dt * self.uses[place.owner].definition.per_second / self.operation.substeps
            result[place] = [made(h, *values) for values in zip(*(one[place] for one in numbers), strict=True)]
        return result


def fix(x: Numbers, still: Still, at: float | None = None) -> Numbers:
    """The same, but for states that are held: what these are held at, or what all of them have ``at``."""
    return {
        place: [
            value if position not in still[place] else still[place][position] if at is None else at
            for position, value in enumerate(values)
        ]
        for place, values in x.items()
    }


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
