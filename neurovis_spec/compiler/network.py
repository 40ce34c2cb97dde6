"""The Network: frozen arrays and an update program; what a spec becomes.

In: nothing; this is the value that ``compiler`` makes and that ``runtime``, ``layout`` and ``scene`` read. Neurons and
connections are structures of arrays; all arrays are read-only. What holds arrays is compared by identity: the ``hash``
of a Network compares content. What a step does is a list of operations (``program``), in the order in which they are
carried out.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, FloatColumn, IntArray, IntColumn, Texts, frozen, pieces
from neurovis_spec.compiler.digest import digest
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings, RenderSettings
from neurovis_spec.compiler.events.changes import Change
from neurovis_spec.compiler.events.settable import Binding, ParameterFormula, Part, Settable
from neurovis_spec.compiler.flows import is_spike
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.program import (
    DRIVE,
    MODEL,
    RULE,
    SPIKE,
    SYNAPSE,
    Definition,
    Each,
    Holder,
    Integrate,
    Key,
    Operation,
    Population,
    Projection,
    Use,
)
from neurovis_spec.compiler.ros_settings import RosSettings
from neurovis_spec.language.expressions.tree import Tree, draws
from neurovis_spec.language.units import TIMES
from neurovis_spec.language.words import Combine, NeuronRole

if TYPE_CHECKING:
    from neurovis_spec.compiler.body_settings import BodySettings


#: how near to the end of a step a spike is in it: as a share of the step, and of the number of the step
_NEAR_STEP, _ROUNDED = 1e-9, 1e-15
#: a step beyond all runs
_NEVER = 2.0**62


@dataclass(frozen=True, slots=True)
class Group:
    """Neurons declared together: ``count`` of them from index ``start`` on."""

    name: str
    start: int
    count: int
    activation: str
    model: str
    combine: Combine
    activation_parameters: Mapping[str, tuple[float, ...]]
    model_parameters: Mapping[str, tuple[float, ...]]
    input: str | None = None
    box: str | None = None
    role: NeuronRole | None = None
    description: str | None = None
    #: the module of whose instance it is a part, None where it is the spec's own
    module: str | None = None
    #: whether an activity is a spike of one step, or silence
    spikes: bool = False

    @property
    def indices(self) -> range:
        """The indices of its neurons."""
        return range(self.start, self.start + self.count)


@dataclass(frozen=True, slots=True)
class Instance:
    """An instance of a module: its path (``left1.knee``), and its neurons, those of instances within it behind its own.

    ``number`` is its number among those declared together as ``declared`` (the path without the number), 0 for a
    single one.
    """

    path: str
    module: str
    start: int
    count: int
    declared: str
    number: int = 0

    @property
    def indices(self) -> range:
        """The indices of its neurons."""
        return range(self.start, self.start + self.count)


@dataclass(frozen=True, slots=True, eq=False)
class Neurons:
    """All neurons, in the order of the spec (structure of arrays, n long)."""

    names: tuple[str, ...]
    labels: tuple[str, ...]
    groups: tuple[Group, ...]
    bias: FloatArray
    #: the activity at step 0, NaN where it is computed like any other
    initial: FloatArray
    #: index into the vector of all inputs, −1 without one
    input: IntArray
    #: (n, 2), NaN without a position
    position: FloatArray
    #: by states of models, what each begins with; NaN where the model says it
    starts: Mapping[str, FloatArray] = field(default_factory=dict)
    #: bias and input, as above, of ports other than ``drive``, by the names of these
    port_bias: Mapping[str, FloatArray] = field(default_factory=dict)
    port_input: Mapping[str, IntArray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.names)

    def bias_at(self, port: str) -> FloatArray:
        """The bias of a port of each neuron (n,)."""
        return self.bias if port == DRIVE else self.port_bias.get(port, np.zeros(len(self)))

    def input_at(self, port: str) -> IntArray:
        """What is put into a port of each neuron (n,): an index into the vector of all inputs, −1 for nothing."""
        return self.input if port == DRIVE else self.port_input.get(port, np.full(len(self), -1, dtype=np.int64))


class Route(NamedTuple):
    """What connections take at their source, and where they bring it: the state or output that is sent (``activity``
    is one; "" is what the source's model sends), and the ports of the target, with what the signal is multiplied by in
    each."""

    sends: str = ""
    ports: tuple[tuple[str, float], ...] = ((DRIVE, 1.0),)


#: What a connection does that says nothing else: from the activity to ``drive``.
PLAIN_ROUTE = Route()


@dataclass(frozen=True, slots=True, eq=False)
class Connections:
    """All connections, in the order written, a matrix or pattern row by row (structure of columns, m long)."""

    sources: IntColumn
    targets: IntColumn
    #: w[0]
    weights: FloatColumn
    #: c of a target that combines by distance, else 0
    centres: FloatColumn
    #: steps
    delays: IntColumn
    #: index into ``Network.projections``, −1 where fixed
    rules: IntColumn
    #: index into ``entries``
    entry: IntColumn
    #: bounds of a plastic weight, ±inf without
    low: FloatColumn
    high: FloatColumn
    #: the names of the entries of ``connections`` (``K -> O``, the second with the same ends ``K -> O (2)``)
    entries: tuple[str, ...]
    #: what the spec says of each entry
    descriptions: tuple[str | None, ...]
    #: the rule of each entry as the author wrote it, for display (``delta(rate=0.01)``), or whose weights it has; None
    #: without either
    learns: tuple[str | None, ...]
    #: what each entry is called in pictures
    labels: tuple[str | None, ...]
    #: what the connections of each entry take and where they bring it; empty where all do as PLAIN_ROUTE says
    routes: tuple[Route, ...] = ()
    #: the entries that name no delay and make connections of delay 0, by their numbers
    undelayed: tuple[int, ...] = ()
    #: the synapse of each entry as the author wrote it, for display (``phase(lag=0.5)``); None without one; empty where
    #: none has one
    synapses: tuple[str | None, ...] = ()
    #: of each connection of an entry that is symmetric the index of its twin, which leads back, else −1; None where
    #: there are none
    twins: IntColumn | None = None
    #: of each connection whose delay is continuous, so that what it brings to a derivative is read between steps, that
    #: delay in steps, else NaN; None where there are none
    lags: FloatColumn | None = None
    #: of each connection of an entry whose weights are those of another one which connection of that it is, else −1;
    #: None where there are none
    tied: IntColumn | None = None
    #: what each connection is called in pictures where the file of its edges says so, beside the ``labels`` of entries,
    #: and what each has in the column whose values pictures tell apart; None where there is none
    own_labels: Texts | None = None
    styles: Texts | None = None

    def __len__(self) -> int:
        return len(self.sources)

    @property
    def learning(self) -> BoolArray:
        """Which connections have a rule of their own: the weights of those that are tied are those of others."""
        own = np.asarray(self.rules.whole() >= 0)
        return own if self.tied is None else own & (self.tied.whole() < 0)

    def with_tied(self, some: IntArray) -> tuple[IntArray, IntArray]:
        """All connections that have a weight of some of them, and whose of these each has, by its place."""
        if self.tied is None or not len(some):
            return some, np.arange(len(some), dtype=np.int64)
        tied = self.tied.whole()
        owners = np.where(tied >= 0, tied, np.arange(len(tied)))
        order = np.argsort(owners[some], kind="stable")
        place = np.minimum(np.searchsorted(owners[some][order], owners), len(some) - 1)
        members = np.flatnonzero(owners[some][order[place]] == owners)
        return members, order[place[members]]

    def with_twins(self, some: IntArray) -> IntArray:
        """Some connections, and the twins of those that have one, ascending where there are any."""
        if self.twins is None or not len(some):
            return some
        twins = self.twins[some]
        return np.union1d(some, twins[twins >= 0])

    @property
    def second(self) -> IntArray:
        """The connections that follow their twins, with which they are drawn as one line named by these."""
        if self.twins is None:
            return np.zeros(0, dtype=np.int64)
        twins = self.twins.whole()
        return np.flatnonzero((twins >= 0) & (twins < np.arange(len(twins))))

    @property
    def each_route(self) -> tuple[Route, ...]:
        """The route of every entry."""
        return self.routes or (PLAIN_ROUTE,) * len(self.entries)


@dataclass(frozen=True, slots=True, eq=False)
class Spikes:
    """Spikes at given times: ``times`` in seconds, at least 0 and ascending, and which number of an input each is of;
    (spikes,)."""

    times: FloatArray
    indices: IntArray

    def steps(self, dt: float) -> IntArray:
        """The step in which each counts, where steps last ``dt`` seconds: k for ((k − 1)·dt, k·dt], within 1e-9 of a
        step; ascending."""
        steps = self.times / dt
        nearest = np.rint(steps)
        on_grid = np.abs(steps - nearest) <= np.maximum(_NEAR_STEP, _ROUNDED * steps)
        return np.minimum(np.where(on_grid, nearest, np.ceil(steps)), _NEVER).astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Input:
    """A signal from outside, ``size`` numbers a step, from ``start`` on in the vector of all inputs.

    ``expression`` (of k, t, dt, pi, e and parameters; where it is ``indexed``, of i and n, too), or ``table`` (one row
    a step; past its end the last row stays), or ``spikes``, which are counted, or nothing: supplied by the caller,
    else 0. An expression that draws is drawn anew for each number and step.
    """

    name: str
    start: int
    size: int
    expression: Tree | None = None
    table: FloatArray | None = None
    #: the slots of the parameters in the expression, by the names that these have in it
    slots: Mapping[str, int] = field(default_factory=dict)
    #: what of the table follows parameters
    parts: tuple[Part, ...] = ()
    #: whether an expression is taken once a step, at its end, and not at each stage of the integration
    hold: bool = False
    #: whether i and n in its expression are the index of each number, from 0, and how many there are
    indexed: bool = False
    spikes: Spikes | None = None
    #: what follows parameters and must not become negative: the rate of what is drawn
    widths: tuple[ParameterFormula, ...] = ()

    @property
    def has_source(self) -> bool:
        """Whether it is something where nobody supplies it."""
        return self.expression is not None or self.table is not None or self.spikes is not None

    @property
    def is_drawn(self) -> bool:
        """Whether its numbers are drawn."""
        return self.expression is not None and draws(self.expression)

    @property
    def counts(self) -> bool:
        """Whether its numbers are how many events a step has."""
        return self.spikes is not None or self.is_drawn

    @property
    def is_formula(self) -> bool:
        """Whether its numbers follow from the step alone: an expression that draws nothing."""
        return self.expression is not None and not self.is_drawn

    @property
    def flows(self) -> bool:
        """Whether it has a value at each stage of the integration."""
        return self.is_formula and not self.hold


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Random numbers that are drawn anew at each step and added to the drive of a group's neurons.

    ``expression`` is over i, n, k, t, dt, pi, e and ``parameters``; its draws come from the stream of ``name``. The
    numbers of a step stand from ``start`` on in the vector that a step is given, behind all inputs, one a member.
    """

    name: str
    members: IntArray
    start: int
    expression: Tree
    parameters: Mapping[str, float]
    #: the slots of those parameters that can be set
    slots: Mapping[str, int] = field(default_factory=dict)
    #: deviations, and widths of ``uniform``, that follow parameters: none may become negative
    widths: tuple[ParameterFormula, ...] = ()
    #: the port that the numbers are added to; "" where they are the standard normal numbers of a flow ``state``
    port: str = DRIVE
    state: str = ""


class Outlet(NamedTuple):
    """A state or an output that some connections take in place of the activity: of which population, and where its
    members stand in ``State.outlets``, from ``start`` on."""

    population: int
    name: str
    start: int


def outlets_of(populations: Sequence[Population], asked: Collection[str]) -> tuple[Outlet, ...]:
    """What is taken beside activities, in the order of the populations and of what these keep: whatever has one of the
    names that are ``asked`` for, and what a model sends in place of its activity."""
    found: list[Outlet] = []
    start = 0
    for number, population in enumerate(populations):
        model = population.model.definition
        for one in model.kept if asked or model.send else ():
            if is_spike(model, MODEL.gives) and one.name == SPIKE:
                continue  # the activity is that
            if one.name in asked or one.name == model.send:
                found.append(Outlet(number, one.name, start))
                start += len(population.members)
    return tuple(found)


def taken_at(populations: Sequence[Population], outlets: Sequence[Outlet], n: int, name: str) -> IntArray:
    """What is taken of each of n neurons by this name, "" for what the neuron's model sends: an index into the
    activities of all neurons followed by the outlets, the activity where nothing else has that name; (n,)."""
    result = np.arange(n, dtype=np.int64)
    for outlet in outlets:
        population = populations[outlet.population]
        if outlet.name == (name or population.model.definition.send):
            result[population.members] = n + outlet.start + np.arange(len(population.members))
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Output:
    """A name for what leaves the network: the activities of ``neurons``, or, where there are ``states``, these, and
    ``neurons`` are those whose models have them. ``scalar`` where it is a single number."""

    name: str
    neurons: IntArray
    scalar: bool
    states: tuple[StateOf, ...] = ()

    @property
    def size(self) -> int:
        """How many numbers it is."""
        return sum(one.size for one in self.states) if self.states else len(self.neurons)


class Located(NamedTuple):
    """Whoever has definitions in use, for each neuron or connection the number of the one that it is a member of (−1:
    of none), and its position among these members."""

    holders: Sequence[Holder]
    numbers: IntArray
    positions: IntArray


class StepLength(NamedTuple):
    """How long a step is, in the unit of time in which people are told."""

    length: float
    unit: str


@dataclass(frozen=True, eq=False)
class Network:
    """A compiled network. ``hash`` is the SHA-256 of its canonical content, as ``inspect`` prints it."""

    name: str
    title: str
    description: str
    #: seconds a step
    dt: float
    #: whether the spec writes ``time.dt``
    dt_given: bool
    #: default run length
    steps: int
    #: steps of an episode, None without
    episode: int | None
    seed: int
    parameters: Mapping[str, float]
    #: parameters on which something of the structure depends: these cannot be set in a run
    structural: frozenset[str]
    neurons: Neurons
    connections: Connections
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    populations: tuple[Population, ...]
    projections: tuple[Projection, ...]
    program: tuple[Operation, ...]
    layout: LayoutSettings
    render: RenderSettings
    hash: str
    noises: tuple[Noise, ...] = ()
    #: all instances of modules, an instance before those within it
    instances: tuple[Instance, ...] = ()
    #: the parameters that can be set in a run, and what depends on them
    settable: Settable = field(default_factory=Settable)
    #: what events change, a Change for each step at which something does, ascending
    changes: tuple[Change, ...] = ()
    #: w[0] with the parameters that the spec itself has, where some are given from outside
    numbering: FloatArray | None = None
    #: what a node of ROS is told; it changes nothing of what the network does
    ros: RosSettings = field(default_factory=RosSettings)
    #: the body that it senses and moves in a run; like ``ros``, no part of the hash
    body: BodySettings | None = None
    #: the unit in which the spec writes ``time.dt``, which pictures take
    dt_unit: str = "s"

    @property
    def shown_dt(self) -> StepLength | None:
        """How long a step is as the spec says it; None where it does not."""
        if not self.dt_given:
            return None
        return StepLength(self.dt / float(TIMES[self.dt_unit]), self.dt_unit)

    @property
    def holders(self) -> tuple[Holder, ...]:
        """Whatever has definitions in use, in the order in which their states are kept."""
        return *self.populations, *self.projections

    def located(self, each: Each, having: Callable[[Definition], bool] = lambda definition: True) -> Located:
        """The populations and all neurons, or the projections and all connections; of those only that have such a
        definition, of which a connection may have one alone."""
        holders: Sequence[Holder] = self.populations if each == "neuron" else self.projections
        count = len(self.neurons if each == "neuron" else self.connections)
        numbers, positions = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=np.int64)
        for number, holder in enumerate(holders):
            if any(having(use.definition) for use in holder.uses):
                numbers[holder.members] = number
                positions[holder.members] = np.arange(len(holder.members))
        return Located(holders, numbers, positions)

    @cached_property
    def synapses(self) -> Located:
        """The projections, and for each connection which of them its synapse is (−1: it has none), and which of its
        members has its states: where these are shared another connection is that."""
        numbers, positions = (np.broadcast_to(np.int64(one), (len(self.connections),)) for one in (-1, 0))
        joined = [number for number, projection in enumerate(self.projections) if projection.kind == SYNAPSE]
        if joined:
            numbers, positions = numbers.copy(), positions.copy()
        for number in joined:
            members = self.projections[number].members
            numbers[members], positions[members] = number, np.arange(len(members))
        for one in self.projections:
            if one.slots is not None:
                numbers[one.members], positions[one.members] = one.feeds, one.slots
        return Located(self.projections, numbers, positions)

    @cached_property
    def fed(self) -> Mapping[int, IntArray]:
        """By projections of shared synapses the connections that add to their states, ascending."""
        found: dict[int, list[IntArray]] = {}
        for one in self.projections:
            if one.slots is not None:
                found.setdefault(one.feeds, []).append(one.members)
        return {number: frozen(np.sort(np.concatenate(members))) for number, members in found.items()}

    @property
    def uses(self) -> Iterator[tuple[Holder, Use]]:
        """All definitions in use, each with whoever has it."""
        return ((holder, use) for holder in self.holders for use in holder.uses)

    @cached_property
    def neuron_index(self) -> Mapping[str, int]:
        """Name to index."""
        return {name: index for index, name in enumerate(self.neurons.names)}

    @cached_property
    def input_size(self) -> int:
        """Length of the vector of all inputs."""
        return sum(entry.size for entry in self.inputs)

    @cached_property
    def vector_size(self) -> int:
        """Length of the vector that a step is given: all inputs, then all noise, then what ``held_inputs`` says."""
        return self._drawn_end + len(self.held_inputs)

    @property
    def _drawn_end(self) -> int:
        return self.input_size + sum(len(noise.members) for noise in self.noises)

    @property
    def integration(self) -> Integrate | None:
        """How states with a derivative are integrated; None where nothing flows."""
        return next((one for one in self.program if isinstance(one, Integrate)), None)

    @cached_property
    def held_inputs(self) -> Mapping[str, int]:
        """Of each input that flows, and reaches what flows, by its name: where it stands in the vector of a step
        whether it is held over the step, as it is where a caller gives its value (1); else (0) its formula holds, at
        each stage."""
        by = self.integration
        fed = [
            self.neurons.input_at(port.name)[population.members]
            for population in map(self.populations.__getitem__, by.populations if by is not None else ())
            for port in population.ports
        ]
        behind = len(self.neurons) + self.outlet_count
        for projection in map(self.projections.__getitem__, by.projections if by is not None else ()):
            fed += [signal[signal >= behind] - behind for signal in projection.signals.values()]
        reached = frozenset(np.concatenate(fed).tolist()) if fed else frozenset()
        formulas = [
            entry.name
            for entry in self.inputs
            if entry.flows and not reached.isdisjoint(range(entry.start, entry.start + entry.size))
        ]
        return {name: self._drawn_end + place for place, name in enumerate(formulas)}

    def noise_of(self, port: str = "", state: str = "") -> IntArray:
        """Where the noise of a port, or the standard normal numbers of a flow state, of each neuron stand in the vector
        of a step, −1 without; (n,)."""
        result = np.full(len(self.neurons), -1, dtype=np.int64)
        for noise in self.noises:
            if (noise.port, noise.state) != (port, state):
                continue
            result[noise.members] = np.arange(noise.start, noise.start + len(noise.members))
        return frozen(result)

    @cached_property
    def port_names(self) -> frozenset[str]:
        """The names of the ports that its neurons have."""
        return frozenset(port.name for population in self.populations for port in population.ports)

    @cached_property
    def outlets(self) -> tuple[Outlet, ...]:
        """What connections, synapses and rules can take beside activities."""
        asked = {route.sends for route in self.connections.routes}
        return outlets_of(self.populations, asked.union(*(one.asks for one in self.projections)))

    @cached_property
    def outlet_count(self) -> int:
        """Length of ``State.outlets``."""
        return sum(len(self.populations[one.population].members) for one in self.outlets)

    @cached_property
    def moving_centres(self) -> Located:
        """The projections of the rules that change centres, and the connections of these."""
        return self.located("connection", lambda definition: definition.moves_centre)

    @cached_property
    def neuron_of(self) -> IntArray:
        """The neuron of each activity, and behind these of each outlet."""
        members = [self.populations[one.population].members for one in self.outlets]
        return frozen(np.concatenate([np.arange(len(self.neurons)), *members]))

    @cached_property
    def sending(self) -> IntArray | None:
        """What each connection takes, (m,): an index into the activities of all neurons followed by the outlets; None
        where all take activities, which are those of their sources."""
        if not self.outlets:
            return None
        connections = self.connections
        result, entry = connections.sources.whole().astype(np.int64), connections.entry.whole()
        routes = connections.each_route
        for name in dict.fromkeys(route.sends for route in routes):
            taking = np.isin(entry, [number for number, route in enumerate(routes) if route.sends == name])
            of_each = taken_at(self.populations, self.outlets, len(self.neurons), name)
            result[taking] = of_each[result[taking]]
        return frozen(result)

    @cached_property
    def taken(self) -> IntArray:
        """Which of the outlets (``State.outlets``) connections do take, ascending."""
        taken = np.zeros(self.outlet_count, dtype=np.bool_)
        if self.sending is not None:
            beside = self.sending[self.sending >= len(self.neurons)]
            taken[beside - len(self.neurons)] = True
        return frozen(np.flatnonzero(taken).astype(np.int64))

    @cached_property
    def joined(self) -> IntArray:
        """The connections that have a synapse, ascending."""
        return frozen(np.flatnonzero(self.synapses.numbers >= 0))

    @cached_property
    def sent(self) -> tuple[StateOf, ...]:
        """What a picture of the connections needs beside activities and weights: what these take, states and outputs of
        neurons in the same order, and behind them the signals of synapses, those of ``joined``."""
        found: list[StateOf] = []
        for outlet in self.outlets:
            members = self.populations[outlet.population].members
            places = self.taken[(self.taken >= outlet.start) & (self.taken < outlet.start + len(members))]
            found.append(StateOf.of("neuron", outlet.name, members[places - outlet.start]))
        found.append(StateOf.of("connection", SYNAPSE.gives, self.joined))
        return tuple(one for one in found if one.size)

    @cached_property
    def state_places(self) -> Mapping[Key, int]:
        """What can be clamped beside the activities of all n neurons: the states of models, then those of rules and
        synapses. By whose state it is and its name, where those of the members begin among all that can be; from n
        on."""
        found: dict[Key, int] = {}
        place = len(self.neurons)
        for holder, use in self.uses:
            for one in use.definition.holdable:
                found[Key(use.owner, one.name)] = place
                place += len(holder.members)
        return found

    def clamp_places(self, what: IntArray | StateOf) -> IntArray:
        """Where neurons, or the states of some neurons or connections, stand among all that can be clamped."""
        if not isinstance(what, StateOf):
            return what
        each: Each = "connection" if len(what.connections) else "neuron"
        members, result = getattr(what, f"{each}s"), np.full(what.size, -1, dtype=np.int64)
        for holder, use in self.uses:
            start = self.state_places.get(Key(use.owner, what.state))
            if start is not None and use.definition.kind.each == each:
                there = np.isin(members, holder.members)
                result[there] = start + np.searchsorted(holder.members, members[there])
        return result

    @cached_property
    def spikes(self) -> BoolArray:
        """For the activities of all neurons and the outlets behind them whether they are spikes."""
        n = len(self.neurons)
        found = np.zeros(n + self.outlet_count, dtype=np.bool_)
        for population in self.populations:
            found[population.members] = is_spike(population.model.definition, MODEL.gives)
        for one in self.outlets:
            population = self.populations[one.population]
            start = n + one.start
            found[start : start + len(population.members)] = is_spike(population.model.definition, one.name)
        return frozen(found)

    @property
    def spiking(self) -> BoolArray:
        """For each neuron whether its activity is a spike."""
        return self.spikes[: len(self.neurons)]

    @cached_property
    def held_as_spikes(self) -> BoolArray:
        """For all that can be clamped (``state_places``) whether it is a spike, which is held as 1 where it is not held
        at 0: activities that are one, and the states that say who fires."""
        result = np.zeros(self.clampable, dtype=np.bool_)
        result[: len(self.neurons)] = self.spiking
        for holder, use in self.uses:
            place = self.state_places.get(Key(use.owner, SPIKE))
            if use.definition.fires and place is not None:
                result[place : place + len(holder.members)] = True
        return result

    @cached_property
    def clampable_of_neurons(self) -> int:
        """How many numbers of neurons can be clamped: activities, then states of models."""
        return len(self.neurons) + _holdable_in(self.populations)

    @cached_property
    def clampable(self) -> int:
        """How many numbers can be clamped: those of neurons, then states of rules and synapses."""
        return self.clampable_of_neurons + _holdable_in(self.projections)

    @cached_property
    def mark(self) -> str:
        """What networks have in common that can take on each other's states: the content hash, and which of their
        numbers follow parameters, which that hash does not see."""
        names = [slot.name for slot in self.settable.slots]
        follow = [(binding.array.text, binding.places, sorted(binding.slots)) for binding in self.settable.bindings]
        return digest(self.hash, names, follow)

    @cached_property
    def set_by_events(self) -> tuple[Binding, ...]:
        """The bindings of all numbers that follow parameters which events set."""
        events = sorted({slot for change in self.changes for slot, _ in change.parameters})
        slots = [*events, *self.settable.reached(events, [False] * len(self.settable.slots))]
        return tuple(self.settable.bindings[number] for number in self.settable.bound_to(slots))

    @cached_property
    def changing(self) -> IntArray:
        """Indices of the connections whose weight can change in a run, by a rule or by an event (reached or not)."""
        can = np.zeros(len(self.connections), dtype=np.bool_)
        can[self.learned] = True
        for binding in self.set_by_events:
            if binding.weights:
                can[binding.indices] = True
        return frozen(self.connections.with_tied(np.flatnonzero(can).astype(np.int64))[0])

    @cached_property
    def learned(self) -> IntArray:
        """Indices of the connections whose weight a rule changes, their own or, where weights are tied, another's."""
        can = np.zeros(len(self.connections), dtype=np.bool_)
        for one in self.projections:
            if one.kind == RULE and not one.use.definition.moves_centre:
                can[one.members] = True
        return frozen(self.connections.with_tied(np.flatnonzero(can).astype(np.int64))[0])

    @cached_property
    def connection_names(self) -> tuple[str, ...]:
        """``C1 -> K1``; where several share both ends ``C1 -> K1 (2)`` …, ordered by delay, rule, weight, place. The
        weight is that of the spec: what is set from outside changes no name (``numbering``)."""
        connections, names = self.connections, self.neurons.names
        plain = [
            f"{names[s]} -> {names[t]}"
            for s, t in zip(connections.sources.tolist(), connections.targets.tolist(), strict=True)
        ]
        for index, number in self.parallel.items():
            if number > 1:
                plain[index] += f" ({number})"
        return tuple(plain)

    @cached_property
    def parallel(self) -> Mapping[int, int]:
        """The indices of the connections that share both ends with others, and the number of each among these, from 1
        on, as in its name."""
        pairs = self._pairs()
        pairs.sort()
        shared = pairs[1:][pairs[1:] == pairs[:-1]]
        if not len(shared):
            return {}
        shared = shared[np.diff(shared, prepend=-1) > 0]  # once each, as np.unique, which would import numpy.ma
        pairs = self._pairs()
        shares = (shared[np.searchsorted(shared[:-1], piece)] == piece for piece in pieces(pairs))
        indices = np.flatnonzero(np.concatenate([*shares]))
        keys = self._parallel_keys(indices.tolist())
        members: dict[int, list[int]] = {}
        for index, pair in zip(indices.tolist(), pairs[indices].tolist(), strict=True):
            members.setdefault(pair, []).append(index)
        ordered = (sorted(some, key=keys.__getitem__) for some in members.values())
        return {index: number for some in ordered for number, index in enumerate(some, 1)}

    def _pairs(self) -> IntArray:
        """Both ends of each connection as one number."""
        result: IntArray = self.connections.sources.compact().astype(np.int64)
        result *= len(self.neurons)
        result += self.connections.targets.compact()
        return result

    def _parallel_keys(self, indices: list[int]) -> Mapping[int, tuple[int, str, float, int]]:
        """What each of these connections is ordered by among those that share both ends."""
        connections, at = self.connections, np.array(indices, dtype=np.int64)
        weights: FloatColumn | FloatArray = connections.weights if self.numbering is None else self.numbering
        rules = [
            self.projections[rule].rule.definition.name if rule >= 0 else "" for rule in connections.rules[at].tolist()
        ]
        keys = zip(connections.delays[at].tolist(), rules, weights[at].tolist(), indices, strict=True)
        return dict(zip(indices, keys, strict=True))

    def state_names(self, states: Iterable[StateOf]) -> tuple[str, ...]:
        """How each number of these states is called: ``K1.v``, ``(K1 -> O).eligibility``."""
        result: list[str] = []
        for one in states:
            result += [f"{self.neurons.names[index]}.{one.state}" for index in one.neurons.tolist()]
            result += [f"({self.connection_names[index]}).{one.state}" for index in one.connections.tolist()]
        return tuple(result)

    @cached_property
    def connection_index(self) -> Mapping[str, int]:
        """Connection name to index."""
        return {name: index for index, name in enumerate(self.connection_names)}

    @cached_property
    def group_index(self) -> Mapping[str, Group]:
        """Group name to group."""
        return {group.name: group for group in self.neurons.groups}

    @cached_property
    def input_index(self) -> Mapping[str, Input]:
        """Input name to input."""
        return {entry.name: entry for entry in self.inputs}

    @cached_property
    def given_names(self) -> tuple[str, ...]:
        """What inputs are given, by their places in the vector: ``push.given``, ``touch[0].given``."""
        return tuple(
            f"{entry.name}.given" if entry.size == 1 else f"{entry.name}[{number}].given"
            for entry in self.inputs
            for number in range(entry.size)
        )


def _holdable_in(holders: Iterable[Holder]) -> int:
    """How many numbers their states are, one a member."""
    return sum(len(holder.members) * len(use.definition.holdable) for holder in holders for use in holder.uses)
