"""Levels: when neurons are updated within a step, and what of them is made anew at the stages of its integration.

In: the model of each neuron, the connections with what they take and where they bring it. Out: an Order, or a Cycle:
neurons that wait for each other.

A neuron is updated behind all that reach it with delay 0. Where states flow, their integration is one more node of that
graph: behind what does not flow and reaches a derivative without delay, and before all neurons whose states flow. What
*flows* is a function of states with a derivative, parameters, the time, and ports at which only what flows arrives; it
reaches derivatives at each stage, so that such connections may form cycles, unless an output closes them. What is made
of such states alone is known behind the integration: where neurons would wait for each other, nobody waits for that.

A synapse takes of its source all that it reads there, and of its target what that is by then: a neuron waits for no
neuron of which a synapse at its own end alone reads something.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.flows import (
    PortsRead,
    flows_by,
    is_spike,
    known_behind_flow,
    plain_flow,
    ports_read_by,
    sent_by,
    signal_flows,
)
from neurovis_spec.compiler.network import Input, Neurons, Noise
from neurovis_spec.compiler.program import DRIVE, Definition
from neurovis_spec.compiler.taken import Taken, Wired, is_kept, read_at


def default_delay(
    source: Definition, sends: str, target: Definition, ports: Sequence[str], synapse: Definition | None = None
) -> int:
    """The delay of a connection that names none, by the models of its ends: 0 where the source has a derivative, what
    is sent is made of what flows there alone, and a derivative of the target reads what arrives; with a synapse where
    all that this reads of the source is made so; else 1."""
    if synapse is not None:
        if synapse.has("on_pre"):
            return 1
        return 0 if all(plain_flow(source, name) for name in read_at("pre", synapse, sends)) else 1
    if not source.flows or ports_read_by(target).flow.isdisjoint(ports):
        return 1
    return 0 if plain_flow(source, sends) else 1


class Cycle(NamedTuple):
    """Neurons that wait for each other: the first is named again at the end. The number behind those of all neurons is
    the integration. ``connections`` lead from one to the next, −1 where none does. ``algebraic``: it is their outputs
    that read each other within a stage."""

    neurons: tuple[int, ...]
    connections: tuple[int, ...]
    algebraic: bool = False

    @property
    def closing(self) -> int:
        """The connection that closes the cycle."""
        return next(one for one in reversed(self.connections) if one >= 0)


class Stages(NamedTuple):
    """The integration: its level; by ports which signals of their Line are made anew at each stage; for each neuron
    whether anything that is taken of it is. ``ahead``: by names of what is taken for each neuron whether it is read
    behind the integration, before the neuron is updated. ``lagging``: the connections (m,) whose delay is continuous,
    since what they bring is read between steps; None without any."""

    level: int
    staged: Mapping[str, BoolArray]
    made: BoolArray
    ahead: Mapping[str, BoolArray] = MappingProxyType({})
    lagging: BoolArray | None = None


class Order(NamedTuple):
    """For each neuron its level, and its level within a stage; ``stages`` where anything flows."""

    level: IntArray
    stage: IntArray
    stages: Stages | None = None
    #: by ports which signals of their Line are spikes that act behind all of a step, so that nobody waits for them
    now: Mapping[str, BoolArray] = MappingProxyType({})


def order_of(
    models: Sequence[Definition],
    model: Indices,
    wired: Wired,
    held: Mapping[str, BoolArray],
    units: IntArray | None = None,
) -> Order | Cycle:
    """The levels of all neurons. ``models`` are those that there are, ``model`` the number of that of each neuron;
    ``held`` says by ports where something is added that does not flow: tables, supplied inputs, noise. Neurons of the
    same number among ``units`` are updated as one, those of −1 by themselves."""
    if wired.flow or any(one.flows for one in models):
        return _Coupled(models, model, wired, held, units).order
    level: IntArray | Cycle = np.zeros(len(model), dtype=np.int64)
    now: Mapping[str, BoolArray] = {}
    if (wired.delays.kept == 0).any():
        waited_for = wired.undelayed
        if wired.synapses:
            waited_for = waited_for & Taken(models, model, wired).waited_for
        now = acting_now(models, model, wired)
        waited_for = waited_for & ~_all_now(wired, now)
        undelayed = np.flatnonzero(waited_for)
        ends = wired.sources.some(undelayed), wired.targets.some(undelayed)
        level = _of_units(len(model), (undelayed, *ends), units)
    return level if isinstance(level, Cycle) else Order(level, np.zeros(len(model), dtype=np.int64), now=now)


def acting_now(models: Sequence[Definition], model: Indices, wired: Wired) -> dict[str, BoolArray]:
    """By ports which connections of their Line bring spikes without delay to neurons whose states jump by them, and
    that read the port nowhere else: they act behind all spikes of the step. Ports without any are left out."""
    if not any(one.fires for one in models) or not wired.undelayed.any():
        return {}
    taken = Taken(models, model, wired)
    plain = wired.undelayed & ~taken.of_entries(lambda synapse: True)
    spikes = plain & taken.all("pre", taken.of_models(is_spike))
    result, reading = {}, [ports_read_by(one) for one in models]
    for port, line in wired.lines.items():
        alone = np.array([port in one.jump - one.update - one.flow for one in reading], dtype=np.bool_)[model]
        connections = slice(None) if line.connections is None else line.connections
        found = spikes[connections] & alone[wired.targets.compact()[connections]]
        if found.any():
            result[port] = np.asarray(found)
    return result


def _all_now(wired: Wired, now: Mapping[str, BoolArray]) -> BoolArray:
    """The connections (m,) all of whose ports are among those."""
    counts = np.zeros(len(wired.entry), dtype=np.int64)
    for port, line in wired.lines.items():
        connections = slice(None) if line.connections is None else line.connections
        counts[connections] += 1
        if port in now:
            counts[connections] -= now[port]
    return np.asarray(counts == 0)


class _Open(NamedTuple):
    """The connections to the ports of a name whose signals may be made anew within a step: which of them these are,
    that is, those without delay, or with one in seconds, and those with a synapse; these, their sources and their
    targets."""

    among: BoolArray
    connections: Indices
    sources: Indices
    targets: Indices


def made_anew(models: Sequence[Definition], model: Indices, wired: Wired, held: Mapping[str, BoolArray]) -> BoolArray:
    """For each connection whether it takes something that flows, and brings it anew at each stage. The arguments are
    those of ``order_of``."""
    made = _Coupled(models, model, wired, held)
    return made.making & made.flowing & made.taken.waited_for


def held_at(neurons: Neurons, inputs: Sequence[Input], noises: Sequence[Noise]) -> Mapping[str, BoolArray]:
    """By ports for each neuron whether a number is added there that is the same over a step: a table's, one that is
    supplied, noise."""
    flows = np.array([*(one.is_formula for one in inputs for _ in range(one.size)), True])
    result = {port: ~flows[given] for port, given in ((DRIVE, neurons.input), *neurons.port_input.items())}
    for noise in noises:
        if not noise.state:
            result.setdefault(noise.port, np.zeros(len(neurons), dtype=np.bool_))[noise.members] = True
    return result


@dataclass(frozen=True)
class _Coupled:
    """A network in which something flows."""

    models: Sequence[Definition]
    model: Indices
    wired: Wired
    held: Mapping[str, BoolArray]
    units: IntArray | None = None

    @cached_property
    def taken(self) -> Taken:
        """What connections take at their ends."""
        return Taken(self.models, self.model, self.wired)

    @cached_property
    def reads(self) -> tuple[PortsRead, ...]:
        """Which ports each model reads."""
        return tuple(map(ports_read_by, self.models))

    @property
    def targets(self) -> Indices:
        """The target of each connection."""
        return self.taken.ends["post"]

    @cached_property
    def synapse(self) -> BoolArray:
        """For each connection whether it has a synapse."""
        return self.taken.of_entries(lambda synapse: True)

    @cached_property
    def now(self) -> BoolArray:
        """For each connection whether it takes anything of its source that is of now."""
        return self.wired.undelayed | self.taken.of_entries(_reads_sent)

    @cached_property
    def receiving(self) -> BoolArray:
        """For each connection whether its synapse has states that are made once a step."""
        return self.taken.of_entries(lambda synapse: synapse.received)

    @cached_property
    def integrated(self) -> BoolArray:
        """For each connection whether its synapse has states that flow."""
        return self.taken.of_entries(lambda synapse: bool(synapse.flows))

    def _arriving(self, port: str) -> Indices:
        """The connections to the ports of a name."""
        found = self.wired.lines[port].connections
        return np.arange(len(self.targets), dtype=np.int64) if found is None else found

    @cached_property
    def open(self) -> dict[str, _Open]:
        """By ports the connections whose signals may be made anew within a step."""
        result = {}
        for port in self.wired.lines:
            arriving = self._arriving(port)
            among = (self.wired.fluent | self.synapse)[arriving]
            found = arriving[among]
            result[port] = _Open(among, found, self.taken.ends["pre"][found], self.targets[found])
        return result

    def _of_neurons(self, port: str, reading: Sequence[Collection[str]]) -> BoolArray:
        """For each neuron whether what there is for its model has the name of a port in it."""
        return np.array([port in read for read in reading], dtype=np.bool_)[self.model]

    @cached_property
    def by_flow(self) -> dict[str, BoolArray]:
        """By ports for each neuron whether a derivative reads it."""
        return {port: self._of_neurons(port, [one.flow for one in self.reads]) for port in self.wired.lines}

    @cached_property
    def by_update(self) -> dict[str, BoolArray]:
        """By ports for each neuron whether what is made once a step reads it."""
        return {port: self._of_neurons(port, [one.once for one in self.reads]) for port in self.wired.lines}

    @cached_property
    def acting_now(self) -> dict[str, BoolArray]:
        """By ports which connections of their Line bring spikes that act behind all of the step."""
        return acting_now(self.models, self.model, self.wired)

    def _updated(self, port: str) -> BoolArray:
        """For each of the open connections to a port whether what it brings is read once a step, where its target is
        updated."""
        among, _, _, targets = self.open[port]
        result = self.by_update[port][targets]
        return result & ~self.acting_now[port][among] if port in self.acting_now else result

    @cached_property
    def through(self) -> dict[str, BoolArray]:
        """By ports (names, n) whether what is taken of a neuron by a name reads that port of it."""
        outputs = {id(model): read.outputs for model, read in zip(self.models, self.reads, strict=True)}

        def reading(port: str) -> BoolArray:
            return self.taken.of_models(lambda model, name: port in outputs[id(model)].get(sent_by(model, name), ()))

        return {port: reading(port) for port in dict.fromkeys((*self.wired.lines, *self.held))}

    @cached_property
    def _flowing(self) -> tuple[BoolArray, BoolArray]:
        """Whether what is taken of a neuron by a name flows (names, n), and what a connection brings (m,). What reads
        something that is held is held, too, and so on until nothing more is found."""
        n, taken = len(self.model), self.taken
        mixed = {port: self.held.get(port, np.zeros(n, dtype=np.bool_)).copy() for port in self.through}
        flowing = taken.of_models(lambda model, name: flows_by(model, name) is not None)
        if self.units is not None:  # what is worked out for all of a group is so once a step
            flowing &= self.units < 0
        delayed = ~self.wired.fluent & taken.waited_for
        bringing = ~delayed & (~self.synapse | taken.of_entries(signal_flows))
        while True:
            for port, values in mixed.items():
                flowing &= ~(self.through[port] & values)
            bringing &= taken.all("pre", flowing) & taken.all("post", flowing)
            before = sum(int(values.sum()) for values in mixed.values())
            for port in self.wired.lines:
                arriving = self._arriving(port)
                mixed[port][self.targets[arriving[~bringing[arriving]]]] = True
            if sum(int(values.sum()) for values in mixed.values()) == before:
                return flowing, bringing

    @property
    def flowing(self) -> BoolArray:
        """For each connection whether what it brings flows."""
        return self._flowing[1]

    @cached_property
    def made(self) -> BoolArray:
        """(names, n): whether what is taken of a neuron by a name flows and is no parameter: whoever takes it at a
        stage takes it anew."""
        return self._flowing[0] & self.taken.real

    @cached_property
    def staged(self) -> dict[str, BoolArray]:
        """By ports for each of its open connections whether it is made anew at each stage: what it brings flows, or it
        has a synapse, and a derivative reads that, or what another such connection takes."""
        result: dict[str, BoolArray] = {}
        making = self.integrated.copy()
        while True:
            before = int(making.sum())
            for port, (_, connections, _, targets) in self.open.items():
                read = self.by_flow[port] | self._passed_on(port, making)
                result[port] = (self.flowing | self.synapse)[connections] & read[targets]
                making[connections[result[port]]] = True
            if int(making.sum()) == before:
                return result

    def _passed_on(self, port: str, making: BoolArray) -> BoolArray:
        """For each neuron whether any of some connections takes of it, at a stage, what reads a port."""
        reading = self.through[port] & self.made
        before = self.taken.neurons("pre", making & self.now, reading)
        return before | self.taken.neurons("post", making, reading)

    @cached_property
    def making(self) -> BoolArray:
        """For each connection whether what it takes is taken at each stage: for what it brings to a port, or for the
        states of its synapse."""
        result = self.integrated.copy()
        for port, (_, connections, _, _) in self.open.items():
            result[connections[self.staged[port]]] = True
        return result

    @property
    def order(self) -> Order | Cycle:
        """The levels."""
        n = len(self.model)
        stage = self._stages()
        if isinstance(stage, Cycle):
            return stage
        known = np.zeros(len(self.targets), dtype=np.bool_)
        level = _of_units(n + 1, self._waits(known), self.units)
        if isinstance(level, Cycle):  # perhaps not where nobody waits for what is known behind the integration
            known = self.taken.all("pre", self.taken.of_models(known_behind_flow))
            other = _of_units(n + 1, self._waits(known), self.units)
            if isinstance(other, Cycle):
                return level
            level = other
        staged = {}
        for port, (among, *_) in self.open.items():
            staged[port] = np.zeros(len(among), dtype=np.bool_)
            staged[port][among] = self.staged[port]
        made, ahead = self._taken_at_stages(), self._ahead(known)
        stages = Stages(int(level[n]), staged, made, ahead, self._lagging())
        return Order(level[:n], stage, stages, self.acting_now)

    def _lagging(self) -> BoolArray | None:
        """The connections (m,) with a delay in seconds that bring anew at each stage what flows; None without any."""
        if self.wired.timed is None:
            return None
        result = self.making & self.wired.timed & self.taken.all("pre", self._flowing[0]) & self.taken.waited_for
        result &= ~self.taken.of_entries(lambda synapse: synapse.has("on_pre"))
        return result if result.any() else None

    def _taken_at_stages(self) -> BoolArray:
        """For each neuron whether anything of it is taken at each stage, by connections, synapses or rules."""
        taken = self.taken
        sources = taken.neurons("pre", self.making & self.now, self.made)
        return sources | taken.neurons("post", self.making, self.made) | self._by_rules

    @cached_property
    def _by_rules(self) -> BoolArray:
        """For each neuron whether a rule, whose states flow, may take anything of it at each stage."""
        result = np.zeros(len(self.model), dtype=np.bool_)
        for number, rules in self.wired.rules.items():
            members = self.taken.in_entries([number])
            for rule in (one for one in rules if one.flows):
                for side, ends in self.taken.ends.items():
                    names = read_at(side, rule, self.wired.routes[number].sends)
                    flowing = [any(_flows(model, name) for name in names) for model in self.models]
                    taken = ends[members]
                    result[taken[np.array(flowing, dtype=np.bool_)[self.model[taken]]]] = True
        return result

    def _ahead(self, known: BoolArray) -> dict[str, BoolArray]:
        """By names of what is taken for each neuron whether a neuron that does not wait for it reads it. ``known``: the
        connections (m,) of which all that they take of the source is known behind the integration."""
        result: dict[str, BoolArray] = {}
        reading = self._once_a_step & known & self.wired.undelayed
        for number, name in enumerate(self.taken.names):
            if name is None or not reading.any():
                continue
            this = np.zeros_like(self.taken.real)
            this[number] = self.taken.real[number]
            neurons = self.taken.neurons("pre", reading, this)
            for place, model in enumerate(self.models):
                having = neurons & (self.model == place)
                if having.any():
                    sent = sent_by(model, name)
                    result[sent] = result.get(sent, np.zeros_like(having)) | having
        return result

    @cached_property
    def _once_a_step(self) -> BoolArray:
        """For each connection whether what it takes is needed once a step: for a port of the target that is read then,
        or for states of its synapse."""
        result = self.receiving.copy()
        for port, (_, connections, _, _) in self.open.items():
            result[connections[self._updated(port)]] = True
        return result

    def _stages(self) -> IntArray | Cycle:
        """For each neuron its level within a stage. Without a synapse a neuron waits for whatever it takes, else for
        what reads ports there; a synapse that reads such an output of its target makes it wait for itself. Where
        neurons would wait for each other, they wait for what reads ports alone: one may send such a thing beside one
        that reads none. Where only one would wait for itself, what is taken of it may have an order."""
        nothing, itself = np.zeros(len(self.synapse), dtype=np.bool_), self.taken.any("post", self._closing)
        level = self._levels_of_stage(~self.synapse, itself)
        if isinstance(level, Cycle):
            level = self._levels_of_stage(nothing, itself)
        if isinstance(level, Cycle) and itself.any():
            among, own = self._levels_of_stage(nothing, nothing), self._levels_of_own()
            if not isinstance(among, Cycle) and not isinstance(own, Cycle):
                kinds: IntArray = np.unique(np.vstack((among, own)), axis=1, return_inverse=True)[1]
                return kinds.reshape(-1)
        return level._replace(algebraic=True) if isinstance(level, Cycle) else level

    @cached_property
    def _closing(self) -> BoolArray:
        """(names, n): whether what is taken of a neuron by a name is made anew at a stage of what a port reads."""
        through = [self.through[port] for port in self.wired.lines]
        return np.asarray(self.made & np.logical_or.reduce(through))

    def _levels_of_stage(self, always: BoolArray, itself: BoolArray) -> IntArray | Cycle:
        """For each neuron its level, where the target of some connections (m,) waits ``always`` for whatever it takes,
        and that of others for ``itself``."""
        edges = []
        before = (self.taken.any("pre", self._closing) | always) & self.now
        for port, (_, connections, sources, targets) in self.open.items():
            waits = self.staged[port] & self._passed_on(port, self.making)[targets]
            for begins, of in ((sources, waits & before[connections]), (targets, waits & itself[connections])):
                edges.append((connections[of], begins[of], targets[of]))
        return levels_along(len(self.model), *_joined(edges))

    def _levels_of_own(self) -> IntArray | Cycle:
        """(names, n): the level of what is taken of a neuron by a name among all that is taken of it: what reads a port
        stands behind what synapses there read of their target."""
        n, taken = len(self.model), self.taken
        place = np.arange(len(taken.names) * n).reshape(len(taken.names), n)
        edges = []
        for port, (_, connections, _, targets) in self.open.items():
            for read in taken.each("post", np.where(self._closing, place, -1)):
                of = self.staged[port] & (read[connections] >= 0)
                for own, places in zip(self.through[port] & self.made, place, strict=True):
                    waits = of & own[targets]
                    edges.append((connections[waits], read[connections[waits]], places[targets[waits]]))
        level = levels_along(place.size, *_joined(edges))
        return level if isinstance(level, Cycle) else level.reshape(place.shape)

    def _waits(self, known: BoolArray) -> tuple[Indices, Indices, Indices]:
        """Who waits for whom within a step: the connection (−1 for none), the first, and the one that waits. ``known``:
        the connections (m,) of which all that they take is known behind the integration, so that nobody waits for
        their source."""
        integration, taken = len(self.model), self.taken
        flows = np.flatnonzero(np.array([bool(one.flows) for one in self.models], dtype=np.bool_)[self.model])
        edges: list[tuple[Indices, Indices, Indices]] = [
            (np.full(len(flows), -1), np.full(len(flows), integration), flows)
        ]
        waited_for, held = self.wired.undelayed & taken.waited_for, ~taken.all("pre", self._flowing[0])
        for port, (_, connections, sources, targets) in self.open.items():
            updated = self._updated(port) | self.receiving[connections]
            now = updated & waited_for[connections]
            begins = np.where(known[connections], integration, sources)
            edges.append((connections[now], begins[now], targets[now]))
            of_integration = self.by_flow[port][targets] | self.integrated[connections]
            before = of_integration & (waited_for & held)[connections]
            edges.append((connections[before], sources[before], np.full(int(before.sum()), integration)))
            own = updated & self.integrated[connections]
            edges.append((connections[own], np.full(int(own.sum()), integration), targets[own]))
        return _joined(edges)


def _flows(model: Definition, name: str) -> bool:
    """Whether a model has something of a name that may flow."""
    return is_kept(model, sent_by(model, name)) and flows_by(model, name) is not None


def _reads_sent(synapse: Definition) -> bool:
    """Whether a synapse reads what its source sends now, whatever the delay."""
    return "sent" in synapse.read


def _joined(edges: list[tuple[Indices, Indices, Indices]]) -> tuple[Indices, Indices, Indices]:
    """Edges one behind the other: connections, begins and ends."""
    connections, begins, ends = zip(*edges, strict=True)
    return np.concatenate(connections), np.concatenate(begins), np.concatenate(ends)


def _of_units(n: int, edges: tuple[Indices, Indices, Indices], units: IntArray | None) -> IntArray | Cycle:
    """The level of each of n nodes, of which those that are one unit have the same."""
    connections, begins, ends = edges
    if units is None:
        return levels_along(n, connections, begins, ends)
    unit = np.arange(n)
    unit[: len(units)] = np.where(units < 0, unit[: len(units)], units)
    level = levels_along(n, connections, unit[begins], unit[ends])
    if not isinstance(level, Cycle):
        return level[unit]
    source = dict(zip(connections.tolist(), begins.tolist(), strict=True))
    path = [node if one < 0 else source[one] for node, one in zip(level.neurons, level.connections, strict=False)]
    return level._replace(neurons=(*path, path[0]))


def levels_along(n: int, connections: Indices, begins: Indices, ends: Indices) -> IntArray | Cycle:
    """The level of each of n nodes, by Kahn's algorithm: one more than the highest of those that reach it; a cycle
    where there is one. ``connections`` are those that the edges stand for, −1 where there is none."""
    level = [0] * n
    if not len(begins):
        return np.array(level, dtype=np.int64)
    # the targets of each node: outgoing[starts[node] : starts[node + 1]]
    order = np.argsort(begins, kind="stable")
    outgoing = ends[order]
    starts = np.searchsorted(begins[order], np.arange(n + 1)).tolist()
    waiting = np.bincount(ends, minlength=n).tolist()
    ready = [node for node in range(n) if waiting[node] == 0]
    finished = 0
    while finished < len(ready):
        node = ready[finished]
        finished += 1
        for target in outgoing[starts[node] : starts[node + 1]].tolist():
            level[target] = max(level[target], level[node] + 1)
            waiting[target] -= 1
            if waiting[target] == 0:
                ready.append(target)
    if len(ready) == n:
        return np.array(level, dtype=np.int64)
    return _cycle(connections, begins, ends, waiting)


def _cycle(connections: Indices, begins: Indices, ends: Indices, waiting: list[int]) -> Cycle:
    """Go backwards among the nodes that still wait until one comes up again: each of them has a source that waits, as
    there is a cycle. ``begins`` and ``ends`` are the sources and the targets of the ``connections``."""
    connection_into: dict[int, int] = {}
    source_of: dict[int, int] = {}
    for connection, source, target in zip(connections.tolist(), begins.tolist(), ends.tolist(), strict=True):
        if waiting[source] and waiting[target] and target not in source_of:
            connection_into[target], source_of[target] = connection, source
    node = min(source_of)  # any of them; the same each time
    path: list[int] = []
    place_in_path: dict[int, int] = {}
    while node not in place_in_path:
        place_in_path[node] = len(path)
        path.append(node)
        node = source_of[node]
    ring = path[place_in_path[node] :]
    forward = (ring[0], *reversed(ring))
    return Cycle(forward, tuple(connection_into[one] for one in forward[1:]))
