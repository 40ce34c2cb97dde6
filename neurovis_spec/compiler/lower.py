"""Lowering: from neurons and connections to populations and the update program.

In: the Census, the connections, the Order of the neurons; Projections. Out: Populations (neurons that are updated
together) and the program, an ordered list of operations.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray, frozen, narrow, sorting, starts_of, width
from neurovis_spec.compiler.levels import Order, Stages
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import (
    AT_SPIKE,
    DRIVE,
    JOINING,
    PHASES,
    RULE,
    Advance,
    Diffuse,
    Gather,
    Integrate,
    Learn,
    Operation,
    Owner,
    Phase,
    Population,
    Port,
    PortOf,
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
from neurovis_spec.compiler.projections import Projected
from neurovis_spec.compiler.taken import Wired
from neurovis_spec.language.words import Method


class Integration(NamedTuple):
    """How states are integrated over a step."""

    method: Method = "rk4"
    substeps: int = 1


def make_program(
    populations: tuple[Population, ...],
    projected: Projected,
    order: Order,
    by: Integration,
    tied: Iterable[Tie] = (),
) -> tuple[Operation, ...]:
    """What a step does, in order: inputs, neurons along delay 0, signals that leave, rules. Where states flow they are
    integrated behind the neurons that reach a derivative without delay and do not flow themselves."""
    before = 0
    integration: tuple[Operation, ...] = ()
    if order.stages is not None:
        before = sum(population.level < order.stages.level for population in populations)
        integration = _integration(populations, projected.projections, order.stages, by)
    updates = [_updating(number, one) for number, one in enumerate(populations)]
    behind = _at_once(populations, projected.projections)
    learning = _learning(projected.projections)
    program = (
        ReadInputs(),
        *chain(*updates[:before]),
        *integration,
        *chain(*updates[before:]),
        *behind,
        Send(),
        *learning,
        *tied,
    )
    return receiving(program, projected.projections, projected.targets)


def _updating(number: int, population: Population) -> list[Operation]:
    """What becomes of a population, behind the integration of its states."""
    model = population.model.definition
    ahead: list[Operation] = [Advance(number, "jump")] if model.has("jump") else []
    if model.fires:
        ahead += [Advance(number, "each_step")] if model.has("each_step") else []
        ahead.append(Advance(number, "fire"))
    return [Gather(number), *ahead, Update(number), *([] if population.shares is None else [Softmax(number)])]


def _at_once(populations: tuple[Population, ...], projections: tuple[Projection, ...]) -> Iterator[Operation]:
    """What spikes do that are without delay, behind all of them."""
    for number, one in enumerate(projections):
        if one.kind in JOINING and one.at_once:
            yield Receive(number, ("on_pre",))
    for number, population in enumerate(populations):
        if any(port.now is not None for port in population.ports):
            yield from (Gather(number, now=True), Advance(number, "jump_now"))


def receiving(
    program: Iterable[Operation], projections: Sequence[Projection], targets: Mapping[int, int]
) -> tuple[Operation, ...]:
    """The program in which what of the states of synapses is made once a step is: an episode's end of it when their
    targets are updated, the rest before anything is gathered for these, first what arriving spikes do. ``targets`` are
    their populations, by the numbers of the projections."""
    made: list[Operation] = []
    for operation in program:
        if isinstance(operation, Receive):
            if operation.phases == ("on_pre",) and projections[operation.projection].at_once:
                made.append(operation)  # it stays behind all updates
            continue
        made.append(operation)
        if isinstance(operation, Gather | Update) and operation != Gather(operation.population, now=True):
            phases: tuple[Phase, ...] = ("each_episode",)
            if isinstance(operation, Gather):
                phases = "on_pre", "each_step"
            place = len(made) - isinstance(operation, Gather)
            made[place:place] = [
                Receive(number, (phase,))
                for phase in phases
                for number, target in targets.items()
                if target == operation.population
                and projections[number].use.definition.has(phase)
                and not (phase == "on_pre" and projections[number].at_once)
            ]
    return tuple(made)


def _learning(projections: tuple[Projection, ...]) -> Iterator[Operation]:
    """The rules of all connections. Where some have several, or spikes change something, a phase of all comes before
    the next, in the order in which connections have them."""
    rules = [number for number, one in enumerate(projections) if one.kind == RULE]
    spiking = any(projections[number].use.definition.acts for number in rules)
    if not spiking and not any(projections[number].place for number in rules):
        yield from map(Learn, rules)
        return
    for phase in (*AT_SPIKE, *PHASES):
        for number in sorted(rules, key=lambda number: projections[number].place):
            definition = projections[number].use.definition
            along = phase == "each_step" and any(tree is not None for tree in definition.steps.values())
            if along or definition.has(phase):
                yield Learn(number, (phase,))


def _integration(
    populations: tuple[Population, ...], projections: tuple[Projection, ...], stages: Stages, by: Integration
) -> tuple[Operation, ...]:
    """The integration of all states that flow, and what noise adds to them."""
    flowing = [number for number, one in enumerate(populations) if one.model.definition.flows]
    made = [number for number, one in enumerate(populations) if stages.made[one.members].any()]
    numbers = sorted({*flowing, *made}, key=lambda number: (populations[number].stage, number))
    at_connections = tuple(number for number, one in enumerate(projections) if one.use.definition.flows)
    noisy = tuple(n for n in flowing if any(one.noise is not None for one in populations[n].model.definition.flows))
    diffuse = (Diffuse(noisy),) if noisy else ()
    integrate = Integrate(tuple(numbers), by.method, by.substeps, at_connections)
    return integrate, *diffuse, *_sends_ahead(populations, stages)


def _sends_ahead(populations: tuple[Population, ...], stages: Stages) -> Iterator[Operation]:
    """What is made of flow states alone and read by neurons that are updated before those that send it."""
    for number, population in enumerate(populations):
        names = tuple(name for name, neurons in stages.ahead.items() if neurons[population.members].any())
        if names:
            yield SendAhead(number, names)


def make_populations(census: Census, wired: Wired, order: Order) -> tuple[Population, ...]:
    """Neurons of the same level, activation, model and combination, in the order of the levels."""
    groups = census.groups
    kind_numbers: dict[tuple[str, ...], int] = {}
    kind_of_group = [
        kind_numbers.setdefault(
            (*(used.definition.name for used in built.kind), built.group.combine), len(kind_numbers)
        )
        for built in groups
    ]
    counts = [built.group.count for built in groups]
    group_of = np.repeat(np.arange(len(groups)), counts)
    kinds = np.repeat(np.array(kind_of_group, dtype=np.int64), counts)
    if order.stages is not None:  # those of different levels within a stage are different kinds, too
        kinds = np.unique(kinds * len(kinds) + order.stage, return_inverse=True)[1]
    population_of = _population_of(order.level, kinds, int(kinds.max(initial=0)) + 1)
    members_of = [members.astype(np.int64) for members in _split(population_of, int(population_of.max(initial=-1)) + 1)]
    population_of = narrow(population_of)
    place_in_population = np.zeros(len(population_of), dtype=width(0, len(population_of)))
    for members in members_of:
        place_in_population[members] = np.arange(len(members))
    arriving = _arriving(wired, order, population_of, place_in_population, len(members_of))
    populations = []
    for number, members in enumerate(members_of):
        group_of_member = group_of[members]
        first = groups[group_of_member[0]]
        activation, model = (_use(number, members, group_of_member, groups, which) for which in (0, 1))
        declared = (PortOf(DRIVE, first.group.combine), *model.definition.ports)
        ports = tuple(_port(one, arriving[one.name][number] if one.name in arriving else _NOTHING) for one in declared)
        level, stage = int(order.level[members[0]]), int(order.stage[members[0]])
        shares = _shares(group_of_member) if activation.definition.softmax else None
        populations.append(Population(level, frozen(members), activation, model, ports, stage, shares))
    return tuple(populations)


def _shares(group_of_member: IntArray) -> IntArray:
    """Where each group begins among the members of a population, and behind the last one."""
    begins = np.flatnonzero(np.diff(group_of_member, prepend=-1))
    return frozen(np.append(begins, len(group_of_member)))


class _Arriving(NamedTuple):
    """What arrives at a port of a population, as a Port has it."""

    incoming: Indices
    slots: Indices
    factors: FloatArray | None = None
    staged: Indices | None = None
    now: Indices | None = None


_NOTHING = _Arriving(frozen(np.zeros(0, dtype=np.int8)), frozen(np.zeros(0, dtype=np.int8)))


def _port(declared: PortOf, arriving: _Arriving) -> Port:
    return Port(declared.name, declared.combine, *arriving)


def _arriving(
    wired: Wired, order: Order, population_of: Indices, places: Indices, count: int
) -> dict[str, list[_Arriving]]:
    """By ports what arrives there, for each of so many populations; ``places`` has for each neuron which member it
    is."""
    targets = wired.targets.compact()
    result: dict[str, list[_Arriving]] = {}
    for port, (connections, factors) in wired.lines.items():
        staged = None if order.stages is None else order.stages.staged[port]
        ends = targets if connections is None else targets[connections]
        result[port] = []
        for at in _split(population_of[ends], count):
            incoming = at if connections is None else connections[at]
            anew = None if staged is None else np.flatnonzero(staged[at])
            now = np.flatnonzero(order.now[port][at]) if port in order.now else None
            result[port].append(
                _Arriving(
                    incoming=frozen(incoming),
                    slots=frozen(places[ends[at]]),
                    factors=None if factors is None or (factors[at] == 1).all() else frozen(factors[at]),
                    staged=None if anew is None or not len(anew) else frozen(anew),
                    now=None if now is None or not len(now) else frozen(now),
                )
            )
    return result


def _population_of(levels: IntArray, kind_of: IntArray, kinds: int) -> Indices:
    """The number of each neuron's population, by levels, then by first neurons. ``kind_of`` is what else they have in
    common: the number of one of so many kinds."""
    _, first, population = np.unique(levels * kinds + kind_of, return_index=True, return_inverse=True)
    number = np.empty_like(first)
    number[np.lexsort((first, levels[first]))] = np.arange(len(first))
    return np.asarray(number[population], dtype=np.int64)


def _split(populations: Indices, count: int) -> list[Indices]:
    """The members of each population, ascending, in the least width. ``populations`` has the population of each."""
    kind = width(0, len(populations))
    if count == 1:
        return [np.arange(len(populations), dtype=kind)]
    starts, order = starts_of(populations, count), np.empty(len(populations), dtype=kind)
    for some, places in sorting(populations, starts):
        order[places] = np.arange(some.start, some.stop)
    return [order[start:end].copy() for start, end in pairwise(starts.tolist())]


def _use(population: int, members: IntArray, group_of: IntArray, groups: Sequence[Built], which: int) -> Use:
    """A definition in use at a population: the activation (``which`` is 0) or the model (1) of its groups, each of
    which has settings of its own. ``group_of`` says of each member which group it belongs to."""
    definition = groups[group_of[0]].kind[which].definition
    owner = Owner(definition.kind.name, population)
    if not definition.parameters:
        return Use(owner, definition, {})
    # members are ascending, and so are their groups: each run of equal groups takes the settings of one group
    starts = np.flatnonzero(np.diff(group_of, prepend=-1))
    ends = pairwise((*starts.tolist(), len(group_of)))
    parts = [
        (built.kind[which].parameters, members[start:end] - built.group.start)
        for built, (start, end) in zip((groups[place] for place in group_of[starts].tolist()), ends, strict=True)
    ]
    parameters = {
        name: frozen(np.concatenate([values[name][rows] for values, rows in parts])) for name in definition.parameters
    }
    return Use(owner, definition, parameters)
