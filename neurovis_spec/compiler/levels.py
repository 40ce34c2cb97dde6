"""Levels: when neurons are updated within a step, and what of them is made anew at the stages of its integration.

In: the model of each neuron, the connections with what they take and where they bring it. Out: an Order, or a Cycle:
neurons that wait for each other.

A neuron is updated behind all that reach it with delay 0. Where states flow, their integration is one more node of that
graph: behind what does not flow and reaches a derivative without delay, and before all neurons whose states flow. What
*flows* is a function of states with a derivative, parameters, the time, and ports at which only what flows arrives; it
reaches derivatives at each stage, so that such connections may form cycles, unless an output closes them. What is made
of such states alone is known behind the integration: where neurons would wait for each other, nobody waits for that.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray, IntColumn, frozen, narrow
from neurovis_spec.compiler.flows import PortsRead, flows_by, known_behind_flow, plain_flow, ports_read_by, sent_by
from neurovis_spec.compiler.network import PLAIN_ROUTE, Input, Neurons, Noise, Route
from neurovis_spec.compiler.program import DRIVE, Definition


def default_delay(source: Definition, sends: str, target: Definition, ports: Sequence[str]) -> int:
    """The delay of a connection that names none, by the models of its ends: 0 where the source has a derivative, what
    is sent is made of what flows there alone, and a derivative of the target reads what arrives; else 1."""
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
    whether anything that is sent is. ``ahead``: by names of what is sent for each neuron whether others read it behind
    the integration, before the neuron is updated. ``lagging``: the connections (m,) whose delay is continuous, since
    what they bring is read between steps; None without any."""

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


class Line(NamedTuple):
    """What arrives at the ports of a name: the connections, ascending (None: all), and what each signal is multiplied
    by, None where that is 1."""

    connections: Indices | None = None
    factors: FloatArray | None = None


@dataclass(frozen=True)
class Wired:
    """The connections, as far as levels go by them: an entry has one of the ``routes``, and ``entry`` says of each
    connection which entry it is of; ``timed`` which have a delay above 0 in seconds, None where none has."""

    sources: IntColumn
    targets: IntColumn
    delays: IntColumn
    entry: IntColumn
    routes: Sequence[Route]
    timed: BoolArray | None = None

    @cached_property
    def lines(self) -> Mapping[str, Line]:
        """By ports what arrives there."""
        if all(route == PLAIN_ROUTE for route in self.routes):
            return {DRIVE: Line()}
        entry, result = self.entry.compact(), {DRIVE: Line(np.zeros(0, dtype=np.int64))}
        for port in dict.fromkeys(name for route in self.routes for name, _ in route.ports):
            factor = np.array([dict(route.ports).get(port, np.nan) for route in self.routes])
            there = np.flatnonzero(~np.isnan(factor)[entry])
            factors = factor[entry[there]]
            result[port] = Line(frozen(narrow(there)), None if (factors == 1).all() else frozen(factors))
        return result

    @cached_property
    def undelayed(self) -> BoolArray:
        """For each connection whether it brings what is sent in the same step."""
        return np.asarray(self.delays.compact() == 0)


def order_of(
    models: Sequence[Definition], model: Indices, wired: Wired, held: Mapping[str, BoolArray]
) -> Order | Cycle:
    """The levels of all neurons. ``models`` are those that there are, ``model`` the number of that of each neuron;
    ``held`` says by ports where something is added that does not flow: tables, supplied inputs, noise."""
    if any(one.flows for one in models):
        return _Coupled(models, model, wired, held).order
    level: IntArray | Cycle = np.zeros(len(model), dtype=np.int64)
    if (wired.delays.kept == 0).any():
        undelayed = np.flatnonzero(wired.undelayed)
        level = levels_along(len(model), undelayed, wired.sources.some(undelayed), wired.targets.some(undelayed))
    return level if isinstance(level, Cycle) else Order(level, np.zeros(len(model), dtype=np.int64))


class _Some(NamedTuple):
    """Some of the connections to the ports of a name: which, these, their sources and their targets."""

    among: BoolArray
    connections: Indices
    sources: Indices
    targets: Indices


def made_anew(models: Sequence[Definition], model: Indices, wired: Wired, held: Mapping[str, BoolArray]) -> BoolArray:
    """For each connection whether what it brings is made anew at each stage. The arguments are those of
    ``order_of``."""
    return _Coupled(models, model, wired, held).making


def held_at(neurons: Neurons, inputs: Sequence[Input], noises: Sequence[Noise]) -> Mapping[str, BoolArray]:
    """By ports for each neuron whether a number is added there that is the same over a step: a table's, one that is
    supplied, or held, noise."""
    flows = np.array([*(one.flows for one in inputs for _ in range(one.size)), True])
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

    @cached_property
    def reads(self) -> tuple[PortsRead, ...]:
        """Which ports each model reads."""
        return tuple(map(ports_read_by, self.models))

    @cached_property
    def sources(self) -> Indices:
        """The source of each connection."""
        return self.wired.sources.compact()

    @cached_property
    def targets(self) -> Indices:
        """The target of each connection."""
        return self.wired.targets.compact()

    def _arriving(self, port: str) -> Indices:
        """The connections to the ports of a name."""
        found = self.wired.lines[port].connections
        return np.arange(len(self.sources), dtype=np.int64) if found is None else found

    @cached_property
    def undelayed(self) -> dict[str, _Some]:
        """By ports the connections without delay."""
        return {port: self._some(port, self.wired.undelayed) for port in self.wired.lines}

    @cached_property
    def fluent(self) -> dict[str, _Some]:
        """By ports the connections that bring what flows as such: without delay, or with one in seconds."""
        timed = self.wired.timed
        if timed is None:
            return self.undelayed
        return {port: self._some(port, self.wired.undelayed | timed) for port in self.wired.lines}

    def _some(self, port: str, which: BoolArray) -> _Some:
        """Those of the connections to the ports of a name that are among these (m,)."""
        arriving = self._arriving(port)
        among = which[arriving]
        found = arriving[among]
        return _Some(among, found, self.sources[found], self.targets[found])

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
        return {port: self._of_neurons(port, [one.update for one in self.reads]) for port in self.wired.lines}

    def _of_sent(self, holds: Callable[[int, str], bool]) -> BoolArray:
        """For each connection what holds of the number of its source's model and of what it takes."""
        sends = {name: number for number, name in enumerate(dict.fromkeys(one.sends for one in self.wired.routes))}
        table = [[holds(number, sent_by(model, one)) for one in sends] for number, model in enumerate(self.models)]
        of_both = np.array(table, dtype=np.bool_).reshape(len(self.models), len(sends))
        of_entry = np.array([sends[one.sends] for one in self.wired.routes], dtype=np.int64)
        return np.asarray(of_both[self.model[self.sources], of_entry[self.wired.entry.compact()]])

    @cached_property
    def through(self) -> dict[str, BoolArray]:
        """By ports for each connection whether what it takes reads that port of its source."""
        return {port: self._reading(port) for port in self.wired.lines}

    def _reading(self, port: str) -> BoolArray:
        """The same for one port."""
        return self._of_sent(lambda number, sent: port in self.reads[number].outputs.get(sent, ()))

    @cached_property
    def flowing(self) -> BoolArray:
        """For each connection whether what it brings flows. What reads something that is held is held, too, and so on
        until nothing more is found."""
        n = len(self.model)
        mixed = {port: self.held.get(port, np.zeros(n, dtype=np.bool_)).copy() for port in self.wired.lines}
        for port, values in mixed.items():
            arriving = self._arriving(port)
            values[self.targets[arriving[~self.fluent[port].among]]] = True
        flowing = self._of_sent(lambda number, sent: flows_by(self.models[number], sent) is not None)
        while True:
            for port, values in mixed.items():
                flowing &= ~(self.through[port] & values[self.sources])
            before = sum(int(values.sum()) for values in mixed.values())
            for port, (_, connections, _, targets) in self.fluent.items():
                mixed[port][targets[~flowing[connections]]] = True
            if sum(int(values.sum()) for values in mixed.values()) == before:
                return flowing

    @cached_property
    def staged(self) -> dict[str, BoolArray]:
        """By ports for each of its fluent connections whether it is made anew at each stage: what it brings flows, and a
        derivative reads that, or what another such connection without delay takes."""
        result: dict[str, BoolArray] = {}
        making = np.zeros(len(self.sources), dtype=np.bool_)
        while True:
            before = int(making.sum())
            for port, (_, connections, _, targets) in self.fluent.items():
                read = self.by_flow[port] | self._passed_on(port, making)
                result[port] = self.flowing[connections] & read[targets]
                making[connections[result[port]]] = True
            if int(making.sum()) == before:
                return result

    def _passed_on(self, port: str, making: BoolArray) -> BoolArray:
        """For each neuron whether any of some connections without delay takes of it what reads a port."""
        reading = np.zeros(len(self.model), dtype=np.bool_)
        reading[self.sources[making & self.wired.undelayed & self.through[port]]] = True
        return reading

    @cached_property
    def making(self) -> BoolArray:
        """For each connection whether it brings to any port what is made anew at each stage."""
        result = np.zeros(len(self.sources), dtype=np.bool_)
        for port, (_, connections, _, _) in self.fluent.items():
            result[connections[self.staged[port]]] = True
        return result

    @property
    def order(self) -> Order | Cycle:
        """The levels."""
        n = len(self.model)
        stage = self._stages()
        if isinstance(stage, Cycle):
            return stage
        ahead: Mapping[str, BoolArray] = {}
        level = levels_along(n + 1, *self._waits(np.zeros(len(self.sources), dtype=np.bool_)))
        if isinstance(level, Cycle):  # perhaps not where nobody waits for what is known behind the integration
            known = self._of_sent(lambda number, sent: known_behind_flow(self.models[number], sent))
            other = levels_along(n + 1, *self._waits(known))
            if isinstance(other, Cycle):
                return level
            level, ahead = other, self._ahead(known)
        staged = {}
        for port, (among, *_) in self.fluent.items():
            staged[port] = np.zeros(len(among), dtype=np.bool_)
            staged[port][among] = self.staged[port]
        made = np.zeros(n, dtype=np.bool_)
        made[self.sources[self.making & self.wired.undelayed]] = True
        lagging = None if self.wired.timed is None else self.making & self.wired.timed
        lagging = lagging if lagging is not None and lagging.any() else None
        return Order(level[:n], stage, Stages(int(level[n]), staged, made, ahead, lagging))

    def _ahead(self, known: BoolArray) -> dict[str, BoolArray]:
        """By names of what is sent for each neuron whether a neuron that does not wait for it reads it. ``known``: the
        connections (m,) whose signal is known behind the integration."""
        waiting = np.zeros(len(self.sources), dtype=np.bool_)
        for port, (_, connections, _, targets) in self.undelayed.items():
            waiting[connections[self.by_update[port][targets]]] = True
        result: dict[str, BoolArray] = {}
        for name in dict.fromkeys(sent_by(model, one.sends) for model in self.models for one in self.wired.routes):
            taking = self._of_sent(partial(_is, name)) & waiting & known
            if taking.any():
                result[name] = np.zeros(len(self.model), dtype=np.bool_)
                result[name][self.sources[taking]] = True
        return result

    def _stages(self) -> IntArray | Cycle:
        """For each neuron its level within a stage."""
        edges = []
        for port, (_, connections, sources, targets) in self.fluent.items():
            waits = self.staged[port] & self._passed_on(port, self.making)[targets]
            waits &= self.wired.undelayed[connections]
            edges.append((connections[waits], sources[waits], targets[waits]))
        level = levels_along(len(self.model), *_joined(edges))
        return level._replace(algebraic=True) if isinstance(level, Cycle) else level

    def _waits(self, known: BoolArray) -> tuple[Indices, Indices, Indices]:
        """Who waits for whom within a step: the connection (−1 for none), the first, and the one that waits. ``known``:
        the connections (m,) whose signal is known behind the integration, so that nobody waits for their source."""
        integration = len(self.model)
        flows = np.flatnonzero(np.array([bool(one.flows) for one in self.models], dtype=np.bool_)[self.model])
        edges: list[tuple[Indices, Indices, Indices]] = [
            (np.full(len(flows), -1), np.full(len(flows), integration), flows)
        ]
        for port, (_, connections, sources, targets) in self.undelayed.items():
            updated = self.by_update[port][targets]
            begins = np.where(known[connections], integration, sources)
            edges.append((connections[updated], begins[updated], targets[updated]))
            before = self.by_flow[port][targets] & ~self.flowing[connections]
            edges.append((connections[before], sources[before], np.full(int(before.sum()), integration)))
        return _joined(edges)


def _is(name: str, number: int, sent: str) -> bool:
    """Whether this is sent, of whatever model."""
    return sent == name


def _joined(edges: list[tuple[Indices, Indices, Indices]]) -> tuple[Indices, Indices, Indices]:
    """Edges one behind the other: connections, begins and ends."""
    connections, begins, ends = zip(*edges, strict=True)
    return np.concatenate(connections), np.concatenate(begins), np.concatenate(ends)


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
