"""What connections take of the neurons at their ends: without a synapse what is sent, else all that the synapse reads.

In: the model of each neuron, the connections with their synapses. Out: names, and for each connection what holds of
them by the models at its ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray, IntColumn, frozen, narrow
from neurovis_spec.compiler.flows import needed, sent_by
from neurovis_spec.compiler.network import PLAIN_ROUTE, Route
from neurovis_spec.compiler.program import DRIVE, MODEL, PHASES, Definition

#: An end of a connection.
Side: TypeAlias = Literal["pre", "post"]
#: The number of what is taken where nothing more is.
_NOTHING: Final = 0


def read_at(side: Side, definition: Definition, sends: str) -> tuple[str, ...]:
    """What a definition of connections reads of an end, by the names of that neuron's model: what is sent is ``sends``,
    as a Route has it."""
    made = definition.during(PHASES)  # what spikes change is changed behind what orders a step
    definition = replace(made, let=tuple(needed(made.let, *replace(made, let=()).formulas)))
    found = dict.fromkeys(one.name for one in definition.end_names if one.side == side)
    read = definition.read
    if side == "pre" and not read.isdisjoint(("pre", "sent")):
        found[sends] = None
    if side == "post" and "post" in read:
        found[MODEL.gives] = None
    return tuple(found)


def reads_past(definition: Definition) -> bool:
    """Whether a definition of connections reads what was sent before, not only what is sent now."""
    return "pre" in definition.read or any(one.side == "pre" for one in definition.end_names)


class Line(NamedTuple):
    """What arrives at the ports of a name: the connections, ascending (None: all), and what each signal is multiplied
    by, None where that is 1."""

    connections: Indices | None = None
    factors: FloatArray | None = None


@dataclass(frozen=True)
class Wired:
    """The connections, as far as levels go by them: an entry has one of the ``routes``, and ``entry`` says of each
    connection which entry it is of; ``timed`` which have a delay above 0 in seconds, None where none has.
    ``synapses`` and ``rules`` are by the numbers of entries that have some; ``silent`` which bring nothing to a port
    themselves, None where all do."""

    sources: IntColumn
    targets: IntColumn
    delays: IntColumn
    entry: IntColumn
    routes: Sequence[Route]
    timed: BoolArray | None = None
    synapses: Mapping[int, Definition] = field(default_factory=dict)
    rules: Mapping[int, Sequence[Definition]] = field(default_factory=dict)
    silent: BoolArray | None = None

    @property
    def flow(self) -> bool:
        """Whether a synapse or a rule has a state with a derivative."""
        return any(one.flows for one in (*self.synapses.values(), *chain.from_iterable(self.rules.values())))

    @cached_property
    def lines(self) -> Mapping[str, Line]:
        """By ports what arrives there."""
        if self.silent is None and all(route == PLAIN_ROUTE for route in self.routes):
            return {DRIVE: Line()}
        entry, result = self.entry.compact(), {DRIVE: Line(np.zeros(0, dtype=np.int64))}
        for port in dict.fromkeys(name for route in self.routes for name, _ in route.ports):
            factor = np.array([dict(route.ports).get(port, np.nan) for route in self.routes])
            brings = ~np.isnan(factor)[entry]
            there = np.flatnonzero(brings if self.silent is None else brings & ~self.silent)
            factors = factor[entry[there]]
            result[port] = Line(frozen(narrow(there)), None if (factors == 1).all() else frozen(factors))
        return result

    @cached_property
    def undelayed(self) -> BoolArray:
        """For each connection whether it brings what is sent in the same step."""
        return np.asarray(self.delays.compact() == 0)

    @cached_property
    def fluent(self) -> BoolArray:
        """For each connection whether it brings what flows as such: without delay, or with one in seconds."""
        return self.undelayed if self.timed is None else self.undelayed | self.timed


@dataclass(frozen=True)
class Taken:
    """What connections take of the neurons at their ends, by names: without a synapse what is sent, else all that the
    synapse reads, of the target, too."""

    models: Sequence[Definition]
    model: Indices
    wired: Wired

    @cached_property
    def ends(self) -> Mapping[Side, Indices]:
        """The source and the target of each connection."""
        return {"pre": self.wired.sources.compact(), "post": self.wired.targets.compact()}

    @cached_property
    def _of_entries(self) -> Mapping[Side, Sequence[tuple[str, ...]]]:
        """What connections take at a side, entry by entry."""
        found: dict[Side, list[tuple[str, ...]]] = {"pre": [], "post": []}
        for number, route in enumerate(self.wired.routes):
            synapse = self.wired.synapses.get(number)
            found["pre"].append((route.sends,) if synapse is None else read_at("pre", synapse, route.sends))
            found["post"].append(() if synapse is None else read_at("post", synapse, route.sends))
        return found

    @cached_property
    def names(self) -> tuple[str | None, ...]:
        """All names of what is taken, behind that of nothing."""
        return None, *dict.fromkeys(name for side in self._of_entries.values() for names in side for name in names)

    @cached_property
    def ranks(self) -> Mapping[Side, Sequence[IntArray]]:
        """By sides: for each entry the number of the first name that it takes, of the second, and so on."""
        number = {name: place for place, name in enumerate(self.names)}
        result: dict[Side, list[IntArray]] = {}
        for side, entries in self._of_entries.items():
            most = max(map(len, entries), default=0)
            numbers = [[number[name] for name in names] + [_NOTHING] * (most - len(names)) for names in entries]
            result[side] = [*np.array(numbers, dtype=np.int64).reshape(len(entries), most).T]
        return result

    def of_models(self, holds: Callable[[Definition, str], bool]) -> BoolArray:
        """(names, n): for each name whether this holds of it and of the model of each neuron."""
        table = [[name is not None and holds(model, name) for model in self.models] for name in self.names]
        return np.array(table, dtype=np.bool_).reshape(len(self.names), len(self.models))[:, self.model]

    @cached_property
    def real(self) -> BoolArray:
        """(names, n): whether a neuron has something of that name which changes in a step; parameters do not."""
        return self.of_models(lambda model, name: is_kept(model, sent_by(model, name)))

    def each(self, side: Side, of: BoolArray) -> Iterator[BoolArray]:
        """Name by name of what each connection takes at a side what ``of`` (names, n) says of it."""
        entry = self.wired.entry.compact()
        for rank in self.ranks[side]:
            yield of[rank[entry], self.ends[side]]

    def all(self, side: Side, of: BoolArray) -> BoolArray:
        """For each connection (m,) whether that holds of all that it takes at a side."""
        of = of.copy()
        of[_NOTHING] = True
        result = np.ones(len(self.ends[side]), dtype=np.bool_)
        for found in self.each(side, of):
            result &= found
        return result

    def any(self, side: Side, of: BoolArray) -> BoolArray:
        """For each connection (m,) whether that holds of anything that it takes at a side."""
        of = of.copy()
        of[_NOTHING] = False
        result = np.zeros(len(self.ends[side]), dtype=np.bool_)
        for found in self.each(side, of):
            result |= found
        return result

    @cached_property
    def waited_for(self) -> BoolArray:
        """For each connection whether it takes anything of its source that is made in a step."""
        return self.any("pre", self.real)

    def neurons(self, side: Side, some: BoolArray, of: BoolArray) -> BoolArray:
        """For each neuron (n,) whether some connections (m,) take something of it of which ``of`` holds."""
        of = of.copy()
        of[_NOTHING] = False
        result = np.zeros(len(self.model), dtype=np.bool_)
        for found in self.each(side, of):
            result[self.ends[side][some & found]] = True
        return result

    def of_entries(self, holds: Callable[[Definition], bool]) -> BoolArray:
        """For each connection whether this holds of its synapse."""
        having = [number for number, synapse in self.wired.synapses.items() if holds(synapse)]
        return self.in_entries(having)

    def in_entries(self, having: Sequence[int]) -> BoolArray:
        """For each connection whether it is of one of these entries."""
        if not having:
            return np.broadcast_to(np.False_, (len(self.wired.entry),))
        of_entry = np.zeros(len(self.wired.routes), dtype=np.bool_)
        of_entry[having] = True
        return np.asarray(of_entry[self.wired.entry.compact()])


def is_kept(model: Definition, name: str) -> bool:
    """Whether a model has the activity, a state or an output of this name."""
    return name == MODEL.gives or any(one.name == name for one in model.kept)
