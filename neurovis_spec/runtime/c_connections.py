"""What the formulas of synapses and rules see, as C: what is their own, and both ends of their connections.

In: a Network, which members of a projection are meant. Out: code of each name, and of the signals that synapses form.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import JOINING, RULE, Definition, Key, Population, Projection, Use
from neurovis_spec.language.expressions.emit_c import Value
from neurovis_spec.language.expressions.tree import Name
from neurovis_spec.runtime.c_code import Code, Form, Place, state_name
from neurovis_spec.runtime.kept_once import Kept
from neurovis_spec.runtime.lags import Lags, lags_of
from neurovis_spec.runtime.presynaptic import history_depth
from neurovis_spec.runtime.stages import End, Formulas, behind_flow, ends_of, target_of

_NO_MORE: Mapping[str, int] = {}
Numbers = TypeVar("Numbers", Indices, BoolArray)


def taken(network: Network, code: Code, connections: Indices, place: Place) -> str:
    """What one of some connections takes: the activity of its source, or an outlet."""
    if network.sending is None:
        return taken_at(network, code, network.connections.sources.some(connections), place)
    return taken_at(network, code, network.sending[connections], place)


def taken_at(network: Network, code: Code, index: Indices, place: Place, more: Mapping[str, int] = _NO_MORE) -> str:
    """One of some numbers, by indices into all activities, followed by the outlets, as ``Network.sending`` numbers
    them, followed by the inputs of a step, as signals of rules are numbered, and by ``more`` arrays of such sizes."""
    sizes = {"activity": len(network.neurons), "outlets": network.outlet_count, "s": network.vector_size, **more}
    own, start, parts = own_of(index, place), 0, dict[str, int]()
    for name, size in sizes.items():
        if ((own >= start) & (own < start + size)).any():
            parts[name] = start
        start += size
    *others, last = parts
    if not others:
        return f"{last}[{code.at(index - parts[last] if parts[last] else index, place)}]"
    where = code.at(index, place)
    found = f"{last}[{where} - {parts[last]}]"
    for name in reversed(others):
        at = f"{where} - {parts[name]}" if parts[name] else where
        found = f"{where} < {parts[name] + sizes[name]} ? {name}[{at}] : {found}"
    return f"({found})"


def own_of(numbers: Numbers, place: Place) -> Numbers:
    """Of an array what is meant by a place: one where that is a number, else all."""
    return numbers[place : place + 1] if isinstance(place, int) else numbers


class Some(NamedTuple):
    """One of some members of a projection, by the number of that: ``which`` they are, and the ``place`` of it among
    these. Where the code goes through the targets, ``target`` is the place of its target in its population."""

    number: int
    which: Indices
    place: Place
    target: Place | None = None


@dataclass(frozen=True, eq=False)
class Ends:
    """What there is to read at the ends of the connections of a network, whatever form of a step reads it."""

    network: Network
    #: states of connections that are kept once for many, in another projection
    kept: Mapping[Key, Kept] = field(default_factory=dict)

    @cached_property
    def depth(self) -> int:
        """Rows of the history."""
        return history_depth(self.network)

    @cached_property
    def lags(self) -> Lags | None:
        """Continuous delays."""
        return lags_of(self.network)

    @cached_property
    def read(self) -> list[dict[str, End]]:
        """What each projection reads of the ends of its connections."""
        return [ends_of(self.network, one) for one in self.network.projections]

    @cached_property
    def positions(self) -> IntArray:
        """The place of each neuron in its population."""
        return self.network.located("neuron").positions


@dataclass(frozen=True)
class Sight:
    """What formulas see of connections: of their ends what was left there last, of the states of a synapse's targets
    that flow what they are behind the integration. ``sent``: the history has what is sent now."""

    ends: Ends
    code: Code
    form: Form
    sent: bool = False

    @property
    def network(self) -> Network:
        """Whose connections they are."""
        return self.ends.network

    def known(self, some: Some, read: Collection[str]) -> dict[str, Value]:
        """All that formulas see of one connection, of what they ``read``."""
        code, projection = self.code, self.network.projections[some.number]
        use, which = projection.use, some.which
        known: dict[str, Value] = {
            name: code.settable(Key(use.owner, name), values, which, some.place)
            for name, values in use.parameters.items()
            if name in read
        }
        known |= {name: cell for name, cell in self.states(some).items() if name in read}
        known |= self.clock(use.definition)
        if "weight" in read:
            known["weight"] = f"weights[{code.at(projection.members[which], some.place)}]"
        return known | self.at_ends(some, read)

    def states(self, some: Some) -> dict[str, str]:
        """The states of a synapse or a rule at one connection."""
        return self.cells(self.network.projections[some.number].use, some.place, some.which)

    def cells(self, use: Use, place: Place, which: Indices | None = None) -> dict[str, str]:
        """The states of a definition in use, and its outputs, of one member, or of ``which`` members one, wherever they
        are kept."""
        own = place if which is None else self.code.at(which, place)
        found = {one.name: f"{state_name(use.owner, i)}[{own}]" for i, one in enumerate(use.definition.kept)}
        for name in found if self.ends.kept else ():
            if (once := self.ends.kept.get(Key(use.owner, name))) is not None:
                found[name] = f"{state_name(once.owner, once.number)}[{self.among_kept(once, place, which)}]"
        return found

    def among_kept(self, once: Kept, place: Place, which: Indices | None = None) -> Place:
        """Where a state that is kept once for many stands, of one connection."""
        of, order = once.of if which is None else once.of[which], self.code.order
        return self.code.at(of, place) if order is None else self.code.at(of[order], "e")

    def clock(self, made: Definition) -> dict[str, Value]:
        """``t`` and ``dt`` where they are in another unit than seconds."""
        if made.per_second == 1.0:
            return {}
        code = self.code
        code.value(Name("t"), {})  # ``tu`` reads td
        code.head["tu"] = f"const {code.real} tu = td * {code.text(made.per_second)};"
        return {"t": "tu", "dt": self.network.dt * made.per_second}

    def at_ends(self, some: Some, read: Collection[str]) -> dict[str, Value]:
        """What formulas see of both ends of one connection."""
        return {name: self.at_end(some, name, end) for name, end in self.ends.read[some.number].items() if name in read}

    def end_at(self, projection: Projection) -> tuple[End, IntArray]:
        """What of an end says whether a spike has come to connections of a projection, and how many steps ago."""
        end, delays = self.ends.read[projection.use.owner.number][projection.when], self.network.connections.delays
        return end, delays[projection.members] if end.past else np.zeros(len(projection.members), dtype=np.int64)

    def comes(self, projection: Projection, some: Some) -> list[str]:
        """The condition that a spike has come to one connection, where that matters."""
        if not projection.when:
            return []
        return [f"{self.at_end(some, projection.when, self.ends.read[some.number][projection.when])} != 0"]

    def of_target(self, some: Some, read: Collection[str]) -> dict[str, Value]:
        """What formulas see of the target, whatever the connection; as identifiers."""
        ends = self.ends.read[some.number].items()
        return {
            name: self.code.let("a", self.at_end(some, name, end))
            for name, end in ends
            if name in read and name.startswith("post")
        }

    def at_end(self, some: Some, name: str, end: End) -> Value:
        """What is read of an end of one connection."""
        if end.past:
            return self.past_or_now(some, end)
        if name.startswith("post"):
            return self.at_target(some, name, end)
        return self.now(end.places[some.which], some.place)

    def now(self, index: IntArray, place: Place) -> str:
        """An activity or an outlet as it is now."""
        return taken_at(self.network, self.code, index, place)

    def at_target(self, some: Some, name: str, end: End) -> str:
        """What is read of the target of one connection."""
        code, projection = self.code, self.network.projections[some.number]
        state = self.behind(projection).get(name)
        if state is None:
            if some.target is None:
                return self.now(end.places[some.which], some.place)
            return self.now(self.by_target(projection, end), some.target)
        place = some.target
        if place is None:
            connections = projection.members[some.which]
            place = code.at(self.ends.positions[self.network.connections.targets[connections]], some.place)
        model = self.target(projection).model
        number = [one.name for one in model.definition.kept].index(state)
        return f"{state_name(model.owner, number)}[{place}]"

    def behind(self, projection: Projection) -> dict[str, str]:
        """Which states of the target are read as they are behind the integration, by the names in formulas."""
        return behind_flow(self.network, projection) if projection.kind in JOINING else {}

    def target(self, projection: Projection) -> Population:
        """Where the connections of a synapse lead."""
        return self.network.populations[target_of(self.network, projection)]

    def by_target(self, projection: Projection, end: End) -> IntArray:
        """What is read of a target, of all members of the population that the connections lead to."""
        members, first = self.target(projection).members, int(end.places[0])
        if first < len(self.network.neurons):
            return members
        position = int(self.ends.positions[self.network.connections.targets[projection.members[:1]][0]])
        return np.arange(first - position, first - position + len(members), dtype=np.int64)

    def past_or_now(self, some: Some, end: End) -> Value:
        """What was sent d steps ago, 0 where that is lost; what is now with a delay of 0."""
        code, connections = self.code, self.network.projections[some.number].members[some.which]
        index, delays, place = end.places[some.which], self.network.connections.delays[connections], some.place
        own = own_of(delays, place)
        now = self.now(index, place)
        if not own.any():
            return now
        is_rule = self.network.projections[some.number].kind == RULE
        lags = None if end.rounded else self.ends.lags
        if self.sent and is_rule and lags is not None and lags.there[connections].any():
            return self.between_steps(connections, lags, end.places[some.which], place)
        if lags is not None and own_of(lags.there[connections], place).any():
            value = self.remembered(connections, index, place, *self.steps_ago(delays, place))
        else:
            value = self.past(index, delays, place)
            if self.form.lost:
                lost = f"lost[{code.at(connections, place)}]"
                value = f"k - ({code.at(delays, place)}) < {lost} ? {code.text(0.0)} : {value}"
        if not own.all() and not self.sent:
            return code.let("a", f"{code.at(delays, place)} ? ({value}) : {now}")
        return code.let("a", value) if self.form.lost else value

    def between_steps(self, connections: Indices, lags: Lags, index: IntArray, place: Place) -> Value:
        """What was sent as long before now as the delay is, of which some are continuous."""
        code, some, delays = self.code, lags.some(connections), self.network.connections.delays[connections]
        whole, late = np.where(some.there, some.whole, delays), np.asarray(some.part > 0)
        next_ = code.let("a", self.remembered(connections, index, place, *self.steps_ago(whole, place)))
        own = own_of(late, place)
        if not own.any():
            return next_
        one = code.let("a", self.remembered(connections, index, place, *self.steps_ago(whole + late, place)))
        share = code.text(code.number(np.where(late, 1.0 - some.part, 0.0), place))
        between = f"{one} + {share}*({next_} - {one})"
        return code.let("a", between if own.all() else f"{code.at(late.astype(np.int64), place)} ? {between} : {one}")

    def steps_ago(self, ago: IntArray, place: Place) -> tuple[str, str]:
        """How many steps ago, and the row of the history that is of then."""
        back = str(self.code.at(ago, place))
        self.code.head["now"] = f"const int32_t now = (int32_t)(k % {self.ends.depth});"
        return back, f"(now + {self.ends.depth} - ({back})) % {self.ends.depth}"

    def remembered(self, connections: Indices, index: IntArray, place: Place, ago: str, row: str) -> str:
        """What was sent so many steps ago, 0 where that is lost; with a continuous delay what was sent at the first
        step is what was before, too."""
        code, step = self.code, f"k - ({ago})"
        late_ones = self.late(connections)
        if (own := own_of(late_ones, place)).any():
            late = "" if own.all() else f"{code.at(late_ones.astype(np.int64), place)} && "
            row = f"({late}fresh && k < {ago} ? 0 : {row})"
            step = f"({late}fresh && k < {ago} ? 0 : {step})"
        n = len(self.network.neurons) + self.network.outlet_count
        past = f"history[(size_t)({row})*{n} + {code.at(index, place)}]"
        if not self.form.lost:
            return past
        return f"({step} < lost[{code.at(connections, place)}] ? {code.text(0.0)} : {past})"

    def late(self, connections: Indices) -> BoolArray:
        """Which of some connections have a continuous delay."""
        lags = self.ends.lags
        return np.zeros(len(connections), dtype=np.bool_) if lags is None else lags.there[connections]

    def past(self, index: Indices, delays: IntArray, place: Place) -> str:
        """What was sent d steps ago, from the history, whose rows have all activities and outlets."""
        code, own = self.code, own_of(delays, place)
        n = len(self.network.neurons) + self.network.outlet_count
        source = code.at(index, place)
        if (own == own[0]).all():
            name, row = f"h{own[0]}", f"(size_t)((k + {self.ends.depth - own[0]}) % {self.ends.depth})*{n}"
            code.head[name] = f"const {code.real} *const {name} = history + {row};"
            return f"{name}[{source}]"
        code.head["now"] = f"const int32_t now = (int32_t)(k % {self.ends.depth});"
        row = f"(now + {self.ends.depth} - ({code.at(delays, place)})) % {self.ends.depth}"
        return f"history[(size_t)({row})*{n} + {source}]"


@dataclass(frozen=True)
class Forming:
    """What makes a number of each connection with a synapse, its signal or how that changes: by what is seen, and by
    the formula of each projection."""

    sight: Sight
    formulas: Mapping[int, Formulas]

    def of_target(self, some: Some) -> dict[str, Value]:
        """What the formula of one connection reads of its target."""
        return self.sight.of_target(some, self.formulas[some.number].names)

    def value(self, some: Some, known: Mapping[str, Value]) -> Value:
        """The number of one connection; ``known`` is what it sees already."""
        code, formulas = self.sight.code, self.formulas[some.number]
        seen = {**self.sight.known(some, formulas.names - known.keys()), **known}
        for name, tree in formulas.let:
            seen[name] = code.let("m", code.value(tree, seen))
        ((_, tree),) = formulas.trees
        return code.let("y", code.value(tree, seen))
