"""What a stage of the integration is made of: which outputs are taken at it, what is derived, what these read.

In: a Network, and its operation Integrate. Out: a Part for each population, in the order in which a stage makes them,
and Contacts for each projection whose signals or states a stage makes; when stages are. All backends ask here, so that
they do the same in the same order.

At a stage the signal of a synapse, and what derivatives of its states and of rules read, are made of what is *now*: of
what flows, as it is taken at the stage, else as it was left (this step's where it was updated before, else the last
step's); and of what was sent d ≥ 1 steps ago, which the history has.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.flows import (
    BY_SLOPE,
    Jacobian,
    flows_by,
    jacobian,
    signal_flows,
    slope_by,
    with_slope,
)
from neurovis_spec.compiler.levels import held_at
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    AT_SPIKE,
    MODEL,
    SYNAPSE,
    Definition,
    EndName,
    Integrate,
    Population,
    Port,
    Projection,
)
from neurovis_spec.compiler.values.definitions import sorted_by_need
from neurovis_spec.language.expressions.tree import Name, Tree, names

Let: TypeAlias = tuple[tuple[str, Tree], ...]

#: how far inside a step its ends are seen from, of its length: what jumps on the grid jumps between two steps
INSIDE: Final = 2.0**-20
#: of a substep, how much of it is over at its stages
PARTS: Final = (INSIDE, 0.5, 1.0 - INSIDE)


class Unfolded(NamedTuple):
    """What formulas need: the intermediate values among these, in their order, and all names that both read."""

    let: Let
    names: frozenset[str]


def unfolded(let: Let, trees: Iterable[Tree | None]) -> Unfolded:
    """What some formulas need of the intermediate values of their definition, which are in order."""
    read = frozenset[str]().union(*(names(tree) for tree in trees if tree is not None))
    needed: list[tuple[str, Tree]] = []
    for name, tree in reversed(let):
        if name in read:
            read |= names(tree)
            needed.append((name, tree))
    return Unfolded(tuple(reversed(needed)), read)


class Formulas(NamedTuple):
    """Formulas of a definition that are evaluated together, by names, with the intermediate values and, of a model, the
    ports that they read."""

    trees: tuple[tuple[str, Tree], ...] = ()
    let: Let = ()
    ports: tuple[Port, ...] = ()
    #: all names that they read
    names: frozenset[str] = frozenset()


class Taken(NamedTuple):
    """What connections take of a population at a stage: its activity, an output or a state. ``places`` are where its
    members stand in the activities of all neurons followed by the outlets."""

    formulas: Formulas
    places: IntArray
    is_activity: bool


class Through(NamedTuple):
    """That a derivative changes with its own ``state`` by what synapses bring to a port: by how much for each unit at
    the port (one formula), times what the signals there change by (``Contacts.back``), which are added up in the order
    of the connections."""

    state: str
    port: Port
    slope: Formulas


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A population at a stage. What is ``taken`` of all populations comes first (``taken_in_order``), then the
    derivatives of all. Of what is taken each is behind what it needs of the same neurons."""

    number: int
    population: Population
    taken: tuple[Taken, ...]
    derivatives: Formulas
    #: how much each derivative changes with its own state, where the method looks at that
    slopes: Formulas
    #: by states with noise, what their random numbers are multiplied by: at the first stage of a step
    spread: Formulas
    #: what is added to the slopes, in this order
    through: tuple[Through, ...] = ()

    @property
    def ports(self) -> tuple[Port, ...]:
        """The ports that are read at a stage."""
        formulas = (*(taken.formulas for taken in self.taken), self.derivatives, self.slopes, self.spread)
        return tuple({port.name: port for one in formulas for port in one.ports}.values())

    @property
    def flows(self) -> tuple[str, ...]:
        """The names of its flow states."""
        return tuple(name for name, _ in self.derivatives.trees)


class End(NamedTuple):
    """What connections read of an end: where each of them finds it, an index into the activities of all neurons
    followed by the outlets; and whether it is what was sent by their delays ago, rather than what is now. Spikes lie on
    no line between two steps: continuous delays are ``rounded`` there."""

    places: IntArray
    past: bool
    rounded: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """A projection at a stage: its signals, where its definition is a synapse and a port of a stage reads them, and the
    derivatives of its states."""

    number: int
    projection: Projection
    #: by its name what they bring to ports, without the factors of these
    signal: Formulas
    derivatives: Formulas
    #: how much each derivative changes with its own state, where the method looks at that
    slopes: Formulas
    #: by states of their targets' models how much the signal changes with these, where it does
    back: Formulas
    #: what they read of their ends, by its names
    ends: Mapping[str, End]

    @property
    def flows(self) -> tuple[str, ...]:
        """The names of its flow states."""
        return tuple(name for name, _ in self.derivatives.trees)


class Formed(NamedTuple):
    """Those of some connections that have a synapse of the same projection: the number of that, where they are among
    the connections, and which of its members."""

    number: int
    places: IntArray
    members: IntArray


class Moment(NamedTuple):
    """When a stage is: in seconds, and which share of the step is over."""

    t: float
    share: float


class Times(NamedTuple):
    """When the stages of a step, or of a part of one, are."""

    first: Moment
    middle: Moment
    last: Moment


def times(start: float, h: float, substep: int = 0, substeps: int = 1) -> Times:
    """The stages of a substep of ``h`` seconds of the step that begins at ``start``: the ends are seen from inside."""
    begin, inside = start + substep * h, INSIDE * h
    seconds = (begin + inside, begin + h / 2.0, begin + h - inside)
    return Times(*(Moment(t, (substep + part) / substeps) for t, part in zip(seconds, PARTS, strict=True)))


def parts_of(
    network: Network, operation: Integrate, joined: Iterable[Contacts], flows: BoolArray | None = None
) -> tuple[Part, ...]:
    """What is done at a stage, population by population; ``joined`` is what is done projection by projection
    (``contacts_of``), and ``flows`` what is ``flowing`` in the network before a lesion, which changes nothing of
    that."""
    contacts = {one.number: one for one in joined}
    taken = _taken(network, operation, contacts.values(), flowing(network) if contacts and flows is None else flows)
    parts = []
    for number in operation.populations:
        population, slopes = _at_stages(network, network.populations[number]), Jacobian((), {})
        model = population.model.definition
        if operation.method in BY_SLOPE:
            slopes, activation = jacobian(model), population.activation
            if model.reads_activation:
                activation = replace(activation, definition=with_slope(activation.definition))
                population = replace(population, activation=activation)
        own = {
            name: Taken(formulas_of(population, [(name, given(model, name))]), places, name == MODEL.gives)
            for (owner, name), places in taken.items()
            if owner == number
        }
        parts.append(
            Part(
                number,
                population,
                tuple(own[name] for name in _in_own_order(network, own, contacts)),
                formulas_of(population, [(one.name, one.derivative) for one in model.flows]),
                formulas_of(population, slopes.diagonal.items(), slopes.let),
                formulas_of(population, [(one.name, one.noise) for one in model.flows]),
                tuple(_through(network, population, contacts)) if operation.method in BY_SLOPE else (),
            )
        )
    return tuple(parts)


def _in_own_order(network: Network, own: Mapping[str, Taken], contacts: Mapping[int, Contacts]) -> list[str]:
    """The names of what is taken of a population, each behind what of it synapses read at the ports that it reads."""
    needs: dict[str, set[str]] = {name: set() for name in own}
    for name, one in own.items() if len(own) > 1 else ():
        for formed in (found for port in one.formulas.ports for found in formed_at(network, _staged(port))):
            for end in (end for text, end in contacts[formed.number].ends.items() if text.startswith("post")):
                needs[name] |= {other for other in own if np.isin(own[other].places, end.places).any()}
    return sorted_by_need(needs)[0]


def _at_stages(network: Network, population: Population) -> Population:
    """A population without the signals of synapses that a stage does not make. Where something is taken of some members
    they may arrive at others, of which it is not."""
    kept = [np.ones(len(port.incoming), dtype=np.bool_) for port in population.ports]
    for port, keep in zip(population.ports, kept, strict=True):
        keep[network.synapses.numbers[port.incoming] >= 0] = False
        if port.staged is not None:
            keep[port.staged] = True
    if all(keep.all() for keep in kept):
        return population
    return replace(population, ports=tuple(map(port_with, population.ports, kept)))


def port_with(port: Port, keep: BoolArray) -> Port:
    """A port with those of its connections alone that it keeps."""
    factors, staged, now = port.factors, port.staged, port.now
    if staged is not None:
        staged = (np.cumsum(keep) - 1)[staged[keep[staged]]]
    if now is not None:
        now = (np.cumsum(keep) - 1)[now[keep[now]]]
    return replace(
        port,
        incoming=port.incoming[keep],
        slots=port.slots[keep],
        factors=None if factors is None else factors[keep],
        staged=staged,
        now=now if now is not None and len(now) else None,
    )


def acts_now(port: Port) -> BoolArray:
    """Which of the connections to a port bring spikes of the same step that act behind all of them."""
    found = np.zeros(len(port.incoming), dtype=np.bool_)
    if port.now is not None:
        found[port.now] = True
    return found


def contacts_of(network: Network, operation: Integrate) -> tuple[Contacts, ...]:
    """What is done at a stage, projection by projection: those whose signals it makes, and those whose states flow."""
    staged = [_staged(port) for number in operation.populations for port in network.populations[number].ports]
    formed = frozenset(one.number for incoming in staged for one in formed_at(network, incoming))
    return tuple(
        _contacts(network, operation, number, number in formed)
        for number in sorted(formed | frozenset(operation.projections))
    )


def _contacts(network: Network, operation: Integrate, number: int, formed: bool) -> Contacts:
    projection = network.projections[number]
    definition = projection.use.definition
    signal, flows = definition.given.each_step, definition.flows if number in operation.projections else ()
    slopes, back = Jacobian((), {}), dict[str, Tree]()
    between: Let = ()
    if operation.method in BY_SLOPE:
        slopes = jacobian(replace(definition, state=flows))
        if formed and signal is not None:
            target = network.populations[target_of(network, projection)].model.definition
            made = {one.name: slope_by(definition, signal, EndName("post", one.name).text) for one in target.flows}
            back = {name: slope.tree for name, slope in made.items() if not slope.vanishes}
            between = tuple(one for name in back for one in made[name].let)
    return Contacts(
        number,
        projection,
        signal_of(projection) if formed else Formulas(),
        _formulas(definition, [(one.name, one.derivative) for one in flows]),
        _formulas(definition, slopes.diagonal.items(), slopes.let),
        _formulas(definition, back.items(), between),
        ends_of(network, projection),
    )


def _staged(port: Port) -> Indices:
    """The connections to a port whose signals are made anew at each stage."""
    return port.incoming[:0] if port.staged is None else port.incoming[port.staged]


def _through(network: Network, population: Population, contacts: Mapping[int, Contacts]) -> Iterator[Through]:
    """How derivatives of a population change with their own states by what synapses bring."""
    model = population.model.definition
    for state in model.flows:
        assert state.derivative is not None
        for port in population.ports:
            joined = (contacts[one.number].back.trees for one in formed_at(network, _staged(port)))
            if port.combine != "sum" or all(state.name not in dict(trees) for trees in joined):
                continue
            made = slope_by(model, state.derivative, port.name)
            if not made.vanishes:
                name = f"d {state.name}'/d {port.name}"
                yield Through(state.name, port, formulas_of(population, [(name, made.tree)], made.let))


def formulas_of(population: Population, trees: Iterable[tuple[str, Tree | None]], more: Let = ()) -> Formulas:
    """Some formulas of the population's model, with ``more`` intermediate values behind its own."""
    made = _formulas(population.model.definition, trees, more)
    return made._replace(ports=tuple(port for port in population.ports if port.name in made.names))


def _formulas(definition: Definition, trees: Iterable[tuple[str, Tree | None]], more: Let = ()) -> Formulas:
    kept = tuple((name, tree) for name, tree in trees if tree is not None)
    let, read = unfolded((*definition.let, *more), [tree for _, tree in kept])
    return Formulas(kept, let, names=read)


def ends_of(network: Network, projection: Projection) -> dict[str, End]:
    """What a projection reads of the ends of its connections, by names: ``pre``, ``sent`` and ``post``, and those of
    ``Projection.ends``; and its signals, which may be inputs: these stand behind the outlets."""
    members, read, found = projection.members, projection.read, dict[str, End]()
    if not read.isdisjoint(("pre", "sent")):
        sent = np.asarray(taken_by(network)[members], dtype=np.int64)
        found = {"pre": End(sent, True), "sent": End(sent, False)}
    if "post" in read:
        found["post"] = End(network.connections.targets[members], False)
    ends = projection.ends.items()
    found |= {name: End(places, name.startswith("pre."), name == AT_SPIKE["on_pre"]) for name, places in ends}
    found |= {name: End(places, False) for name, places in projection.signals.items()}
    return {name: end for name, end in found.items() if name in read}


def formed_at(network: Network, connections: Indices) -> list[Formed]:
    """Those of some connections that have a synapse, together by their projections."""
    numbers, members = (array[connections] for array in network.synapses[1:])
    return [
        Formed(number, places := np.flatnonzero(numbers == number), members[places])
        for number in np.unique(numbers[numbers >= 0]).tolist()
    ]


def signal_of(projection: Projection) -> Formulas:
    """The signal of a synapse, by its name."""
    definition = projection.use.definition
    return _formulas(definition, [(definition.given.name, definition.given.each_step)])


def target_of(network: Network, projection: Projection) -> int:
    """The number of the population that a synapse's connections lead to."""
    return int(network.located("neuron").numbers[network.connections.targets[projection.members[:1]][0]])


def behind_flow(network: Network, projection: Projection) -> dict[str, str]:
    """What of a synapse's targets its formulas read as it is behind the integration, before the targets are updated:
    their flow states, by what these are called in the formulas."""
    model = network.populations[target_of(network, projection)].model.definition
    found = {EndName("post", one.name).text: one.name for one in model.flows}
    return {name: state for name, state in found.items() if name in projection.ends}


def flowing(network: Network) -> BoolArray:
    """For the activities of all neurons and the outlets behind them whether they flow (``compiler/flows.py``). What
    reads something that is held is held, too, and so on until nothing more is found."""
    held = held_at(network.neurons, network.inputs, network.noises)
    mixed = {name: held.get(name, np.zeros(len(network.neurons), dtype=np.bool_)).copy() for name in network.port_names}
    made = [
        (population.members, places, flows_by(population.model.definition, name))
        for number, population in enumerate(network.populations)
        for name, places in _names_of(network, number)
    ]
    result = np.ones(len(network.neurons) + network.outlet_count, dtype=np.bool_)
    while True:
        before, brings = result.copy(), _bringing(network, result)
        for population in network.populations:
            for port in population.ports:
                mixed[port.name][population.members[port.slots[~brings[port.incoming]]]] = True
        for members, places, ports in made:
            if ports is None:
                result[places] = False
            for port_name in ports or ():
                result[places[mixed[port_name][members]]] = False
        if np.array_equal(result, before):
            return result


def _bringing(network: Network, flows: BoolArray) -> BoolArray:
    """For each connection whether what it brings flows, as far as what it takes does: undelayed, or by a continuous
    delay."""
    connections = network.connections
    fluent = connections.delays.whole() == 0
    if connections.lags is not None:
        fluent |= ~np.isnan(connections.lags.whole())
    result = np.asarray(fluent & flows[taken_by(network)])
    for projection in network.projections:
        members = projection.members
        if projection.kind == SYNAPSE:
            result[members] = signal_flows(projection.use.definition)
            for name, end in ends_of(network, projection).items():
                result[members] &= flows[end.places] & (fluent[members] | name.startswith("post"))
    return result


def apart(port: Port) -> tuple[IntArray, IntArray]:
    """The places of the connections in ``Port.incoming`` whose signals are held over a step, and of those whose signals
    are made anew at each stage."""
    anew = np.zeros(len(port.incoming), dtype=np.bool_)
    if port.staged is not None:
        anew[port.staged] = True
    return np.flatnonzero(~anew), np.flatnonzero(anew)


def given(model: Definition, name: str) -> Tree | None:
    """The formula of the activity or of an output; a state is its own."""
    formulas = {one.name: one.each_step for one in model.gives}
    return formulas.get(name, Name(name))


def taken_by(network: Network) -> Indices:
    """What each connection takes (m,): an index into the activities of all neurons followed by the outlets."""
    return network.connections.sources.compact() if network.sending is None else network.sending


def taken_in_order(parts: Iterable[Part]) -> list[tuple[Part, Taken]]:
    """All that is taken at a stage, each behind what it needs: first what reads no port; then by the levels of a step,
    in which whoever sends what reads a port is behind all who bring such a thing there; of one population as the part
    has it."""
    every = [(part, one) for part in parts for one in part.taken]
    return sorted(every, key=lambda one: one[0].population.level if one[1].formulas.ports else -1)


def places_among_taken(network: Network, parts: Iterable[Part]) -> IntArray:
    """Where each activity and each outlet, as ``taken_by`` has them, stands among all that is taken at a stage; −1 for
    what is not."""
    result = np.full(len(network.neurons) + network.outlet_count, -1, dtype=np.int64)
    start = 0
    for one in (taken for part in parts for taken in part.taken):
        result[one.places] = start + np.arange(len(one.places))
        start += len(one.places)
    return result


def _names_of(network: Network, number: int) -> Iterator[tuple[str, IntArray]]:
    """What of a population can be taken, and the places of that: its activity, and its outlets."""
    members, n = network.populations[number].members, len(network.neurons)
    yield MODEL.gives, members
    for one in network.outlets:
        if one.population == number:
            yield one.name, n + one.start + np.arange(len(members))


def _taken(
    network: Network, operation: Integrate, contacts: Iterable[Contacts], flows: BoolArray | None
) -> dict[tuple[int, str], IntArray]:
    """By population and name what is taken at a stage, and its places."""
    sending = taken_by(network)
    asked = np.zeros(len(network.neurons) + network.outlet_count, dtype=np.bool_)
    for number in operation.populations:
        for port in network.populations[number].ports:
            plain = _staged(port)
            asked[sending[plain[network.synapses.numbers[plain] < 0]]] = True
    for one in contacts:
        assert flows is not None
        undelayed = network.connections.delays[one.projection.members] == 0
        for end in one.ends.values():
            now = end.places[undelayed] if end.past else end.places
            now = now[now < len(flows)]  # no inputs
            asked[now[flows[now]]] = True
    return {
        (number, name): places
        for number in operation.populations
        for name, places in _names_of(network, number)
        if asked[places].any()
    }
