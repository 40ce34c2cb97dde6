"""What an integration in C keeps, and where: made once for a network, read by all forms of its step.

In: a Network. Out: its Plan, None where nothing flows: the parts of an array ``work`` of the caller's, what arrives at
the ports that a stage reads, and what connections take there. The parts are

    fx  the flow states at the beginning of a substep      fh  what is held at ports over the step
    fy  those of a stage                                   fo  what connections take at a stage
    fk  their derivatives there                            fv  the inputs and the noise of the step, inputs that are
    fj  how much these change with their own states            expressions as they are at a stage
    fs  sums of derivatives, over stages                   fg  what their noise is multiplied by
    fl  what arrives at a stage with continuous delays

and behind all of them, also where there is no plan, ``fu``: arrays of what arrives at the neurons of a population,
where that is put together before any of these goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray, width
from neurovis_spec.compiler.flows import BY_SLOPE
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Diffuse, Integrate, Key, Port, Use
from neurovis_spec.language.expressions.tree import Conditional, Name, Number
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.c_arrivals import Incoming, Sent, incoming_of
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.stages import (
    Contacts,
    Part,
    Taken,
    Through,
    apart,
    contacts_of,
    flowing,
    parts_of,
    places_among_taken,
    taken_by,
    taken_in_order,
    unfolded,
)

#: Of a substep of the length 1, when the stages of a method are: just behind the beginning, in the middle, just before
#: the end.
BEGIN, MIDDLE, END = range(3)
STAGES: Mapping[Method, tuple[int, ...]] = {
    "euler": (BEGIN,),
    "heun": (BEGIN, END),
    "rk4": (BEGIN, MIDDLE, MIDDLE, END),
    "exponential": (BEGIN,),
    "semi_implicit": (BEGIN,),
}


class FlowState(NamedTuple):
    """A flow state of a population, or of a projection: where its members stand among all flow states."""

    part: Part | Contacts
    name: str
    start: int

    @property
    def key(self) -> Key:
        """Whose it is, and its name."""
        return Key(self.use.owner, self.name)

    @property
    def use(self) -> Use:
        """The model, the synapse or the rule that it is a state of."""
        return self.part.population.model if isinstance(self.part, Part) else self.part.projection.use

    @property
    def place(self) -> int:
        """Which of all that is kept of its definition it is."""
        return [one.name for one in self.use.definition.kept].index(self.name)

    @property
    def size(self) -> int:
        """How many numbers it is."""
        holder = self.part.population if isinstance(self.part, Part) else self.part.projection
        return len(holder.members)

    @property
    def varies(self) -> bool:
        """Whether more than parameters says how much its derivative changes with it."""
        let, diagonal = self.part.slopes.let, dict(self.part.slopes.trees)
        if self.name not in diagonal:  # the method does not look at that
            return False
        if isinstance(self.part, Part) and any(one.state == self.name for one in self.part.through):
            return True
        return not unfolded(let, [diagonal[self.name]]).names <= {*self.use.parameters, *dict(let)}

    @property
    def resting(self) -> tuple[Conditional, Conditional] | None:
        """The derivative, and how much it changes with the state, where both are 0 under one condition, as of what is
        held at rest."""
        part = self.part
        if isinstance(part, Part) and any(one.state == self.name for one in part.through):
            return None
        derivative, slope = (dict(one.trees).get(self.name) for one in (part.derivatives, part.slopes))
        if not (isinstance(derivative, Conditional) and isinstance(slope, Conditional)):
            return None
        zero = all(isinstance(one.then, Number) and one.then.value == 0 for one in (derivative, slope))
        return (derivative, slope) if zero and derivative.condition == slope.condition else None


class Reaching(NamedTuple):
    """What arrives at a port that a stage reads: what is held over the step, and what is made anew at each stage."""

    held: Incoming
    anew: Incoming


@dataclass(frozen=True)
class Plan:
    """What an integration keeps in ``work``, and where, and what it reads."""

    network: Network
    operation: Integrate
    #: whether noise is added behind it
    diffuses: bool
    #: the network before states of it were kept once, which says what flows: a signal of one that steps change is held
    whole: Network

    @cached_property
    def of_stage(self) -> tuple[Part, ...]:
        """What is done at a stage, population by population."""
        return parts_of(self.network, self.operation, self.contacts, self.flows if self.contacts else None)

    @cached_property
    def contacts(self) -> tuple[Contacts, ...]:
        """What is done at a stage, projection by projection."""
        return contacts_of(self.network, self.operation)

    @cached_property
    def states(self) -> tuple[FlowState, ...]:
        """All flow states, population by population, then projection by projection."""
        found: list[FlowState] = []
        parts: tuple[Part | Contacts, ...] = (*self.of_stage, *self.contacts)
        start = 0
        for part in parts:
            for name in part.flows:
                found.append(FlowState(part, name, start))
                start += found[-1].size
        return tuple(found)

    @cached_property
    def starts(self) -> Mapping[Key, int]:
        """Where the members of a flow state stand."""
        return {one.key: one.start for one in self.states}

    @cached_property
    def reaching(self) -> Mapping[tuple[int, str], Reaching]:
        """What arrives at the ports of populations that a stage reads."""
        return {
            (part.number, port.name): Reaching(*(self._incoming(part, port, some) for some in apart(port)))
            for part in self.of_stage
            for port in part.ports
        }

    @cached_property
    def back(self) -> Mapping[tuple[int, str, str], Incoming]:
        """The signals of a port that change with a state of the neuron itself, by population, port and state."""
        return {
            (part.number, one.port.name, one.state): self._back(part, one)
            for part in self.of_stage
            for one in part.through
        }

    def _back(self, part: Part, through: Through) -> Incoming:
        found = [one.number for one in self.contacts if through.state in dict(one.back.trees)]
        positions = apart(through.port)[1]
        kinds = self.network.synapses.numbers[through.port.incoming[positions]]
        return self._incoming(part, through.port, positions[np.isin(kinds, found)])

    def _incoming(self, part: Part, port: Port, positions: IntArray) -> Incoming:
        """Some of the signals of a port."""
        factors = None if port.factors is None else port.factors[positions]
        incoming, slots = port.incoming[positions], port.slots[positions]
        some = replace(port, incoming=incoming, slots=slots, factors=factors, staged=None)
        return incoming_of(self.network, some, len(part.population.members), fusible=False)

    @cached_property
    def held(self) -> Mapping[tuple[int, str], int]:
        """Where what is held at the ports of populations stands."""
        found: dict[tuple[int, str], int] = {}
        start = 0
        for part in self.of_stage:
            formulas = (part.derivatives, part.spread, *(one.formulas for one in part.taken))
            for port in dict.fromkeys(chain.from_iterable(one.ports for one in formulas)):
                if len(apart(port)[0]):
                    found[part.number, port.name] = start
                    start += len(part.population.members)
        return found

    @cached_property
    def places(self) -> IntArray:
        """Where each activity and each outlet, as ``Network.sending`` has them, stands among what is taken at a stage;
        −1 for none."""
        return places_among_taken(self.network, self.of_stage)

    @cached_property
    def flows(self) -> BoolArray:
        """Which activities and outlets flow."""
        return flowing(self.whole)

    @cached_property
    def count(self) -> int:
        """How many flow states there are."""
        return sum(one.size for one in self.states)

    @cached_property
    def direct(self) -> IntArray:
        """Of activities and outlets, where what is taken at a stage is a flow state, which; −1 for the others."""
        found = np.full(len(self.places), -1, dtype=np.int64)
        for part, one in taken_in_order(self.of_stage):
            ((_, tree),) = one.formulas.trees
            if isinstance(tree, Name) and tree.name in part.flows:
                start = self.starts[Key(part.population.model.owner, tree.name)]
                found[one.places] = np.arange(start, start + len(one.places))
        return found

    @cached_property
    def idle(self) -> frozenset[int]:
        """The places among activities and outlets of what nothing reads that is taken at a stage, where nothing is
        held: flow states that synapses and rules alone take."""
        connections = [one.anew.connections for one in self.reaching.values()]
        incoming = np.concatenate([np.zeros(0, dtype=np.int64), *connections])
        plain = taken_by(self.network)[incoming[self.network.synapses.numbers[incoming] < 0]]
        alone = [
            one.places
            for _, one in taken_in_order(self.of_stage)
            if (self.direct[one.places] >= 0).all() and not np.isin(one.places, plain).any()
        ]
        return frozenset(np.concatenate(alone).tolist() if alone else ())

    def now(self, places: IntArray, direct: bool = False) -> IntArray:
        """Where what connections read now, by its places among activities, outlets and inputs, is to be found at a
        stage: behind all these stand what is taken at the stage, then the inputs as they are at it, then the flow
        states, which are read ``direct`` where they are what is taken."""
        network = self.network
        neural = len(network.neurons) + network.outlet_count
        behind = neural + network.vector_size
        taken = np.append(np.where(self.flows, self.places, -1), -1)[np.minimum(places, neural)]
        formulas = np.zeros(len(places), dtype=np.bool_)
        for entry in map(network.input_index.__getitem__, network.held_inputs):
            formulas |= (places >= neural + entry.start) & (places < neural + entry.start + entry.size)
        anew = np.where(formulas, behind + self.parts_taken + places - neural, places)
        found = np.where(taken >= 0, behind + taken, anew)
        if not direct:
            return found
        states = behind + self.parts_taken + (network.vector_size if network.held_inputs else 0)
        own = np.append(np.where(self.flows, self.direct, -1), -1)[np.minimum(places, neural)]
        return np.where(own >= 0, states + own, found)

    @cached_property
    def parts_taken(self) -> int:
        """How many numbers are taken at a stage."""
        return int(self.places.max(initial=-1)) + 1

    @cached_property
    def takes(self) -> Indices:
        """Where what each connection takes (m,) stands among that; −1 for none."""
        return self.places.astype(width(-1, len(self.places)))[taken_by(self.network)]

    @cached_property
    def lagging(self) -> Indices:
        """The connections whose signals arrive at a stage with a continuous delay, ascending."""
        lags, synapses = lags_of(self.network), self.network.synapses
        anew = [one.anew.connections for one in self.reaching.values()]
        found = np.unique(np.concatenate(anew)) if anew and lags is not None else np.zeros(0, dtype=np.int64)
        return found if lags is None else found[lags.there[found] & (synapses.numbers[found] < 0)]

    @cached_property
    def sent(self) -> Sent:
        """What connections bring at a stage."""
        late = None
        if len(self.lagging):
            late = np.full(len(self.network.connections), -1, dtype=np.int64)
            late[self.lagging] = np.arange(len(self.lagging))
        return Sent("fo", self.takes, late)

    @cached_property
    def stays(self) -> bool:
        """Whether flow states are, when a step begins, as the integration of the step before has left them, if nothing
        has come between: nothing else of a step changes any."""
        quantities = (quantity for one in self.states for quantity in one.use.definition.flows)
        return not self.diffuses and all(
            one.each_step is None and one.each_episode is None and not one.acts for one in quantities
        )

    def lasts(self, part: Part, one: Taken) -> bool:
        """Whether what connections take at the first stage of a step is what was made at the end of the step before, if
        nothing has come between: it is made of states and parameters alone, and no episode's end changes these behind
        it."""
        ends = self.network.episode is not None and any(
            state.each_episode is not None for state in part.population.model.definition.lasting
        )
        return not (ends or one.formulas.ports or {"k", "t"} & one.formulas.names)

    @cached_property
    def parts(self) -> Mapping[str, int]:
        """Where the parts of ``work`` begin, by their names; those of no numbers are left out."""
        several = len(STAGES[self.operation.method]) > 1
        count = self.count
        sizes = {
            "fx": count,
            "fy": count if several else 0,
            "fk": count,
            "fj": count if self.operation.method in BY_SLOPE else 0,
            "fs": count if several else 0,
            "fg": count if self.diffuses else 0,
            "fh": sum(len(self.network.populations[number].members) for number, _ in self.held),
            "fo": self.parts_taken,
            "fv": self.network.vector_size if self.network.held_inputs else 0,
            "fl": len(self.lagging),
        }
        starts, start = dict[str, int](), 0
        for name, size in sizes.items():
            if size:
                starts[name] = start
                start += size
        return starts | {"": start}


def plan_of(network: Network, whole: Network | None = None) -> Plan | None:
    """The plan of a network, which may be what keeps states of a ``whole`` once; None where nothing flows."""
    by = network.integration
    if by is None:
        return None
    return Plan(network, by, any(isinstance(one, Diffuse) for one in network.program), whole or network)


def work_size(plan: Plan | None) -> int:
    """How many numbers of ``work`` an integration keeps."""
    return 0 if plan is None else plan.parts[""]


def written_out(plan: Plan | None, most: int) -> int:
    """Up to how many neurons and connections a network is written out one by one, if it is up to ``most`` where nothing
    flows: derivatives take more lines for each, which have to stay in the processor's cache from stage to stage."""
    return most if plan is None else most // 6


def pointer_lines(plan: Plan | None, real: str, quick: str, work: str) -> dict[str, str]:
    """For each part of ``work``, the line that gives it its name; ``quick`` is how ``restrict`` is written."""
    parts = {} if plan is None else {name: start for name, start in plan.parts.items() if name}
    parts["fu"] = work_size(plan)
    return {name: f"{real} *{quick} const {name} = {work} + {start};" for name, start in parts.items()}
