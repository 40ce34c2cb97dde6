"""What arrives at the neurons of a population, as C: sums of terms, each in the order of its connections.

In: a Network, a port of one of its populations. Out: lines of C. The sums of a full matrix, and those of neurons with
many connections, go on beside each other, since an addition need not wait for the one before in another sum. Where
synapses bring something, neurons of many connections are gone through one after the other, and of each the connections
of a kind in a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray, sorting, starts_of, width
from neurovis_spec.compiler.events.settable import CENTRES
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import CENTRE, SYNAPSE, Port
from neurovis_spec.language.expressions.emit_c import Value
from neurovis_spec.language.words import Combine
from neurovis_spec.runtime.c_code import Code, Form, Place, plus, state_name
from neurovis_spec.runtime.c_connections import Forming, Some, taken
from neurovis_spec.runtime.events import Rows, in_order, rows_of
from neurovis_spec.runtime.signals import SignalLayout
from neurovis_spec.runtime.stages import taken_by

#: which of all connections that arrive a place is one of
_Column: TypeAlias = slice | Indices
_NONE = np.zeros(0, dtype=np.int64)
#: connections of a neuron that are written out one after the other
_FEW = 16
#: neurons of a dense population whose sums are kept beside each other
_BESIDE = 4096
#: the unit in which the length of a ring stands beside a continuous delay
_LATE = 1 << 20
#: neurons of any other population whose sums go on beside each other: an addition need not wait for the one before
_LANES = 8


@dataclass(frozen=True, slots=True)
class _Lanes:
    """How the sums of some neurons go on beside each other, in groups of eight neurons of like many connections. First
    come the connections that all of a group have, then the others, neuron by neuron. Of two neurons a and b with the
    connections a1, a2 and b1, b2, b3 in a group of two, in this order: a1 b1 a2 b2, then b3."""

    #: places in the population, by the number of connections
    neurons: IntArray
    #: group g reads from ``begins[g]`` on: the first connection of each neuron, then the second of each, …
    begins: IntArray
    #: the further connections of the i-th neuron are read from ``rests[i]`` on
    rests: IntArray


def _in_lanes(ends: IntArray) -> tuple[_Lanes, Indices]:
    """Neurons whose connections lie neuron by neuron, those of the i-th up to ``ends[i + 1]``; and the order in which
    the connections are read then."""
    degrees = np.diff(ends)
    neurons = np.argsort(degrees, kind="stable").astype(np.int64)
    count = len(neurons) - len(neurons) % _LANES
    # per neuron, how many connections all of its group have; the degrees ascend, so the first of a group has the fewest
    shared = np.zeros(len(neurons), dtype=np.int64)
    shared[:count] = np.repeat(degrees[neurons[:count:_LANES]], _LANES)
    begins = np.zeros(-(-len(neurons) // _LANES) + 1, dtype=np.int64)
    begins[1:] = np.cumsum(np.add.reduceat(shared, np.arange(0, len(neurons), _LANES)))
    rests = begins[-1] + np.concatenate(([0], np.cumsum(degrees[neurons] - shared)))
    own, kind = degrees[neurons], width(0, _LANES * int(ends[-1]))  # there may be millions of connections
    owner = np.repeat(np.arange(len(neurons), dtype=kind), own)
    nth = np.arange(len(owner), dtype=kind) - np.repeat((np.cumsum(own) - own).astype(kind), own)
    places = begins.astype(kind)[owner // _LANES] + nth * _LANES + owner % _LANES
    behind = nth >= shared.astype(kind)[owner]
    places[behind] = (rests[:-1] - shared).astype(kind)[owner[behind]] + nth[behind]
    order = np.empty(len(owner), dtype=kind)
    order[places] = ends[neurons].astype(kind)[owner] + nth
    return _Lanes(neurons, begins, rests.astype(np.int64)), order


class _Run(NamedTuple):
    """Connections of neurons that are gone through in a loop of their own: of which synapses they are (−1: of none),
    which they are of all that arrive, neuron by neuron, those of the i-th neuron up to ``ends[i + 1]``; and how many
    connections are in the runs before."""

    kinds: tuple[int, ...]
    edges: Indices
    ends: IntArray
    before: int = 0


def _runs(kinds: IntArray, connections: Indices, ends: IntArray) -> tuple[_Run, ...]:
    """What arrives at some neurons, neuron by neuron, as a run for each kind, in which all of their sums keep their
    order; one for all where there is no such order."""
    found, owner = np.unique(kinds).tolist(), np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    found.sort(key=lambda kind: int(connections[kinds == kind].min()))
    ranks = np.array(found).argsort()[np.searchsorted(np.sort(found), kinds)]
    if bool(((np.diff(ranks) < 0) & (np.diff(owner) == 0)).any()):
        return (_Run(tuple(found), np.arange(len(kinds)), ends),)
    of_kind = [np.flatnonzero(kinds == kind) for kind in found]
    before = np.cumsum([0, *map(len, of_kind)]).tolist()
    return tuple(
        _Run((kind,), edges, np.searchsorted(owner[edges], np.arange(len(ends))).astype(np.int64), first)
        for kind, edges, first in zip(found, of_kind, before, strict=False)
    )


def begin_of(combine: Combine) -> Value:
    """What is put together of signals before the first of them."""
    return "-INFINITY" if combine == "max" else 1.0 if combine == "product" else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Incoming:
    """The connections that arrive at a port of the neurons of a population, whatever is made of them: neuron by neuron,
    each neuron's in their order, those of the i-th neuron up to ``ends[i + 1]``."""

    connections: Indices
    ends: IntArray
    #: the number of connections of each neuron, −1 where they differ
    degree: int
    #: whether all of it arrives after one step along weights that stay
    can_be_fused: bool
    #: whether they are a full matrix, row by row
    full: bool
    #: how sums go on beside each other, and in which order the connections are read then; None where neurons have few
    lanes: tuple[_Lanes, Indices] | None
    #: what each signal is multiplied by; None where that is 1
    factors: FloatArray | None
    #: how what arrives at a neuron is put together
    combine: Combine
    #: where any has a synapse, of each of them which projection that is, −1 for none; else None
    kinds: IntArray | None = None
    #: where so many arrive that they are not written out, in which order
    runs: tuple[_Run, ...] = ()
    #: whether none of the weights changes in a step, so that those of runs may be packed
    weights_stay: bool = False
    #: where spikes are all that comes, the connections by what has fired
    rows: Rows | None = None
    #: whether they come to each neuron in the order of its connections then
    in_order: bool = True


def incoming_of(network: Network, port: Port, count: int, fusible: bool = True, spiking: bool = False) -> Incoming:
    """What arrives at a port of a population of ``count`` neurons: worked out once, read by each form of a step.
    ``fusible``: whether it may be formed where it arrives; ``spiking``: whether spikes are all that comes."""
    connections, incoming, slots = network.connections, port.incoming, port.slots
    delays, rules = connections.delays.some(incoming), connections.rules.some(incoming)
    late = connections.lags is not None and not bool(np.isnan(connections.lags[incoming]).all())
    own, ends = np.empty_like(incoming), starts_of(slots, count)
    factors = None if port.factors is None else np.empty_like(port.factors)
    for some, places in sorting(slots, ends):
        own[places] = incoming[some]
        if factors is not None and port.factors is not None:
            factors[places] = port.factors[some]
    degrees = np.diff(ends)
    degree = int(degrees[0]) if (degrees == degrees[0]).all() else -1
    kinds = network.synapses.numbers[own] if any(one.kind == SYNAPSE for one in network.projections) else _NONE
    if (kinds >= 0).any():
        few = 0 <= degree <= _FEW
        runs = () if few else _runs(kinds, own, ends)
        stay = bool((rules < 0).all())
        return Incoming(own, ends, degree, False, False, None, factors, port.combine, kinds, runs, stay)
    if spiking and bool((delays > 0).all()) == bool((delays > 0).any()):
        fired = rows_of(np.asarray(taken_by(network)[own], dtype=np.int64), connections.delays[own])
        ordered = in_order(fired, np.repeat(np.arange(count), degrees), own)
        return Incoming(own, ends, degree, False, False, None, factors, "sum", rows=fired, in_order=ordered)
    full = port.combine == "sum" and degree > 1 and 1 < count <= _BESIDE and len(_different(delays)) == 1 and not late
    if full:
        rows, sent = own.reshape(count, degree), taken_by(network)[own].reshape(count, degree)
        regular = rows[0, 0] + np.arange(degree) * count + np.arange(count).reshape(-1, 1)
        full = bool((rows == regular).all() and (sent == sent[0]).all()) and port.factors is None
    lanes = None
    if not 0 <= degree <= _FEW:
        beside, read = _in_lanes(ends)
        lanes = beside, read
    fused = fusible and not late and len(delays) > 0 and bool((delays == 1).all() and (rules < 0).all())
    return Incoming(own, ends, degree, fused, full, lanes, factors, port.combine)


class Sent(NamedTuple):
    """An array of what connections without delay take, by its name, and where each of all connections (m,) finds it
    there; and where in ``fl`` what arrives with continuous delays is, −1 for others (None: there are none)."""

    array: str
    places: Indices
    late: Indices | None = None


class Anew(NamedTuple):
    """What is made anew at a stage: the code of what the sum of a neuron ``begins`` with, by its place, else nothing,
    and what connections without delay take, else activities and outlets."""

    begins: Callable[[Place], Value]
    sent: Sent


class _Target(NamedTuple):
    """A neuron at which something arrives: its place in the population, and what synapses of projections read of it,
    by the numbers of these."""

    place: Place
    known: Mapping[int, Mapping[str, Value]]


def _length(ring: int) -> int:
    """How long a ring is."""
    return ring // _LATE or ring


def _now(ring: int) -> str:
    """A step in whose slot of a ring that is which now arrives."""
    return "k" if ring < _LATE else f"(k + {ring // _LATE - ring % _LATE})"


def _different(delays: Indices) -> list[int]:
    """The delays that there are, ascending."""
    found: list[int] = np.unique(delays[:1] if delays.strides == (0,) else delays).tolist()
    return found


def _alike(which: BoolArray) -> bool:
    """Whether all of them are true, or none is."""
    return bool((which == which[0]).all())


class Arrivals:
    """What arrives at a port of the neurons of a population: their connections, in the order in which they are read:
    neuron by neuron, or as ``lanes`` says. What arrives at one neuron is put together in the order of its connections.
    ``forming`` makes what synapses bring, and ``anew`` says what is another at a stage."""

    def __init__(
        self,
        network: Network,
        incoming: Incoming,
        code: Code,
        form: Form,
        layout: SignalLayout,
        forming: Forming,
        anew: Anew | None = None,
    ) -> None:
        self.network, self.code, self.form, self.forming = network, code, form, forming
        self.combine, self.count = incoming.combine, len(incoming.ends) - 1
        #: where the weights begin among those packed
        self.begin = 0
        self.can_be_fused, self.ends, self.degree = incoming.can_be_fused, incoming.ends, incoming.degree
        #: whether it is formed here, not sent
        self.fused = form.fused and incoming.can_be_fused
        self._begins = None if anew is None else anew.begins
        self._sent = None if anew is None else anew.sent
        #: whether nothing is added any more to what is put together here
        self.finished = True
        self.connections, self.factors = incoming.connections, incoming.factors
        #: whether the sums of all neurons go on beside each other, each in its own order
        self.dense = incoming.full and not (form.gone or form.written_out) and _alike(layout.shares[self.connections])
        self.lanes: _Lanes | None = None
        if incoming.lanes is not None and not (form.written_out or self.dense):
            self.lanes, read = incoming.lanes
            self.connections = self.connections[read]
            self.factors = None if self.factors is None else self.factors[read]
        #: where whatever has fired is gone through in place of all connections, these by that
        self.rows, self.in_order = None if form.written_out else incoming.rows, incoming.in_order
        self.kinds, self.runs = incoming.kinds, () if form.written_out else incoming.runs
        self.can_be_packed = bool(self.runs) and incoming.weights_stay
        self._packs = form.fused and self.can_be_packed
        #: the connections, in the place of those with a synapse some other one
        self.plain = self.connections
        if self.kinds is not None:
            others = self.connections[self.kinds < 0]
            self.plain = np.where(self.kinds < 0, self.connections, others[0] if len(others) else self.connections)
        self.sources = network.connections.sources.some(self.plain)
        self.delays = network.connections.delays.some(self.plain)
        self._layout = layout

    def start(self, place: Place) -> Value:
        """What the sum, the product or the greatest signal of a neuron begins with."""
        return begin_of(self.combine) if self._begins is None else self._begins(place)

    @property
    def _nothing(self) -> float:
        """What there is where nothing arrives."""
        return 1.0 if self.combine == "product" else 0.0

    def sent(self, column: _Column, edge: Place) -> str:
        """What a connection without delay takes."""
        if self._sent is None:
            return taken(self.network, self.code, self.plain[column], edge)
        return f"{self._sent.array}[{self.code.at(self.sent_places[column], edge)}]"

    @cached_property
    def sent_places(self) -> Indices:
        """Where each connection finds what it takes, in the array of ``sent``."""
        assert self._sent is not None
        return self._sent.places[self.plain]

    @cached_property
    def offsets(self) -> Indices:
        """The first slot of each connection."""
        return self._layout.offsets[self.plain]

    @cached_property
    def shares(self) -> BoolArray:
        """Which connections weigh on arrival what was sent."""
        return self._layout.shares[self.plain]

    @property
    def packed(self) -> Indices:
        """The connections whose weights are packed; those of a full matrix lie as they are read."""
        if self.can_be_packed:
            read = np.concatenate([run.edges for run in self.runs])
            return np.asarray(self.connections[read], dtype=self.connections.dtype)
        return self.connections if self.can_be_fused and not self.dense else self.connections[:0]

    @cached_property
    def slots(self) -> IntArray:
        """The neuron of each connection: its place in the population."""
        return np.repeat(np.arange(self.count), np.diff(self.ends))

    def add_spike(self, total: str, edge: Place, column: _Column, sent: str, ago: str, weight: Value | None) -> None:
        """Lines that add what one connection brings, of a spike of so many steps ago (now where nothing is said), which
        ``sent`` is; ``weight`` is that of the connection where it is known."""
        code, connections = self.code, self.connections[column]
        connection = code.at(connections, edge)
        conditions = [f"!gone[{connection}]"] if self.form.gone else []
        weighted = not ago or bool(self.shares[column].all())
        if ago and weighted and self.form.lost:
            conditions.append(f"k - {ago} >= lost[{connection}]")
        weight = f"weights[{connection}]" if weight is None else self._operand(weight)
        term = f"{weight}*{sent}" if weighted else self._signal(edge, column)
        if self.factors is not None:
            term = f"{term}*{self._operand(code.number(self.factors[column], edge))}"
        if conditions:
            code.line(f"if ({' && '.join(conditions)})")
        code.line(f"{'    ' if conditions else ''}{total} += {term};")

    @contextmanager
    def beside(self, lanes: _Lanes) -> Iterator[tuple[Place, str]]:
        """The body of a loop over all neurons of the population: the place of one, and what arrives at it."""
        code, count = self.code, len(lanes.neurons)
        begins, rests = code.tables.name(lanes.begins), code.tables.name(lanes.rests)
        with code.block(code.loop("g", len(lanes.begins) - 1)):
            totals = [code.variable("u", self._start_of_lane(lanes, lane)) for lane in range(_LANES)]
            with code.block(code.loop("e", f"{begins}[g + 1]", f"{begins}[g]", _LANES)):
                for lane, total in enumerate(totals):
                    self._add(total, f"(e + {lane})" if lane else "e", slice(None))
            sums = code.name("u")
            code.line(f"const {code.real} {sums}[{_LANES}] = {{{', '.join(totals)}}};")
            code.line(f"const int32_t last = {_LANES}*g + {_LANES} < {count} ? {_LANES}*g + {_LANES} : {count};")
            with code.block(code.loop("i", "last", f"{_LANES}*g")):
                place = code.at(lanes.neurons, "i")
                if isinstance(place, str):
                    code.line(f"const int32_t p = {place};")
                    place = "p"
                total = code.variable("u", f"{sums}[i - {_LANES}*g]")
                with code.block(code.loop("e", f"{rests}[i + 1]", f"{rests}[i]")):
                    self._add(total, "e", slice(None))
                yield place, code.text(self._finished(total))

    def matrix(self, name: str) -> None:
        """The sums of a full matrix, into an array of this name. It adds source by source:

        for (int32_t q = 0; q < 3; q++) {
            const double a = activity[q];
            for (int32_t p = 0; p < 2; p++)
                u1[p] += weights[0 + 2*q + p]*a;
        }
        """
        code, count = self.code, self.count
        code.line(code.loop("p", count))
        code.line(f"    {name}[p] = {code.text(self.start('p'))};")
        delay = int(self.delays[0])
        first, offset = int(self.connections[0]), int(self.offsets[0])
        with code.block(code.loop("q", self.degree)):
            now, shares = delay == 0 or self.fused, bool(self.shares[0])
            if now:
                # each row is of the same sources
                source = f"before[{code.at(self.sources[: self.degree], 'q')}]"
                code.line(f"const {code.real} a = {self.sent(slice(self.degree), 'q') if delay == 0 else source};")
            elif shares:
                code.line(f"const {code.real} a = {self._slot(delay, self.offsets[: self.degree], 'q')};")
            code.line(code.loop("p", count))
            if now or shares:
                code.line(f"    {name}[p] += weights[{first} + {count}*q + p]*a;")
            elif delay == 1:
                code.line(f"    {name}[p] += signals[{offset} + {count}*q + p];")
            else:
                shift = code.remainder(delay)
                code.line(f"    {name}[p] += signals[{offset} + {delay}*({count}*q + p) + {shift}];")

    def combined(self, place: Place) -> Value:
        """All that arrives at one neuron as one number. In a loop (of neurons with equally many connections) the c-th
        connection of each is the column ``c::degree``."""
        start = self.start(place)
        if not len(self.connections):
            return self._finished(self.code.text(start)) if self._begins is not None else self._nothing
        if isinstance(place, int):
            edges: list[Place] = list(range(int(self.ends[place]), int(self.ends[place + 1])))
            if not edges:
                return self._nothing if self._begins is None or isinstance(start, float) else self._finished(start)
            return self._terms(start, edges, [slice(None)] * len(edges), place)
        if self.runs:
            return self._in_runs(start, place)
        assert 0 <= self.degree <= _FEW, "others go on in lanes"
        columns = [slice(column, None, self.degree) for column in range(self.degree)]
        return self._terms(start, [place] * self.degree, columns, place)

    def _terms(self, start: Value, edges: list[Place], columns: list[slice], target: Place) -> Value:
        """The terms of some connections of a neuron, one after the other, combined."""
        if not self.form.gone and self.combine == "sum":
            terms = [self.term(edge, column, self._at(target)) for edge, column in zip(edges, columns, strict=True)]
            return " + ".join([self.code.text(start), *terms])
        total = self.code.variable("u", start)
        for edge, column in zip(edges, columns, strict=True):
            self._add(total, edge, column, self._at(target))
        return self._finished(total)

    def _in_runs(self, start: Value, target: Place) -> Value:
        """The terms of all connections of a neuron, combined, run by run. What synapses read of the neuron is read
        before."""
        code, total = self.code, self.code.variable("u", start)
        for run in self.runs:
            at = self._at(target, run.kinds)
            if self._packs:
                weight = f"packed[{plus(self.begin + run.before, 'e')}]"
                at = at._replace(known={kind: {**known, "weight": weight} for kind, known in at.known.items()})
            begin, end = (code.at(run.ends, where) for where in (target, f"({target} + 1)"))
            with code.block(code.loop("e", str(end), begin, type_="ptrdiff_t")):  # as wide as an address
                self._add(total, "e", run.edges, at)
        return self._finished(total)

    def _at(self, target: Place, kinds: Iterable[int] = ()) -> _Target:
        """A neuron at which something arrives, with what synapses of some projections read of it."""
        some = ((kind, Some(kind, _NONE, 0, target)) for kind in kinds if kind >= 0)
        return _Target(target, {kind: self.forming.of_target(one) for kind, one in some})

    def _add(self, total: str, edge: Place, column: _Column, target: _Target | None = None) -> None:
        """Lines that add (multiply) one connection's term to a variable, if the connection is not gone."""
        code = self.code
        if self.form.gone:
            code.line(f"if (!gone[{code.at(self.connections[column], edge)}]) {{")
            code.indent += 1
        term = self.term(edge, column, target)
        match self.combine:
            case "sum":
                code.line(f"{total} += {term};")
            case "product":
                code.line(f"{total} *= {term};")
            case "max":
                signal = code.let("d", term)
                code.line(f"if ({signal} > {total} || {signal} != {signal}) {total} = {signal};")
            case "distance":
                centre = self._centre(self.connections[column], edge)
                difference = code.let("d", f"{term} - {self._operand(centre)}" if centre != 0.0 else term)
                code.line(f"{total} += {difference}*{difference};")
        if self.form.gone:
            code.indent -= 1
            code.line("}")

    def _centre(self, connections: Indices, edge: Place) -> Value:
        """What the signal of one of some connections is compared with: a centre that a rule moves, or one that
        stays."""
        code, (holders, numbers, positions) = self.code, self.network.moving_centres
        own = numbers[connections]
        here, found = own[edge : edge + 1] if isinstance(edge, int) else own, code.text(0.0)
        if (here < 0).all():
            return code.settable(CENTRES, self.network.connections.centres.whole(), connections, edge)
        if (here < 0).any():
            found = code.text(code.settable(CENTRES, self.network.connections.centres.whole(), connections, edge))
        for number in np.flatnonzero(np.bincount(here[here >= 0])).tolist():
            (use,) = holders[number].uses
            place = next(place for place, one in enumerate(use.definition.kept) if one.name == CENTRE)
            at = code.at(np.where(own == number, positions[connections], 0), edge)
            moving = f"{state_name(use.owner, place)}[{at}]"
            if (here == number).all():
                return moving
            found = f"({code.at((own == number).astype(np.int64), edge)} ? {moving} : {found})"
        return found

    def _operand(self, value: Value) -> str:
        """A value as it may stand behind a minus."""
        text = self.code.text(value)
        return f"({text})" if text.startswith("-") else text

    def _finished(self, total: str) -> Value:
        """What a neuron gets of its sum: the root of a sum of squares, 0 in place of the greatest signal where there is
        none (and of −0, which is as great), else the sum itself."""
        if self.combine == "max" and self.finished:
            return f"({total} == -INFINITY ? 0 : {total} + 0)"
        return f"sqrt{self.code.emitter.suffix}({total})" if self.combine == "distance" and self.finished else total

    def _start_of_lane(self, lanes: _Lanes, lane: int) -> Value:
        """What the sum of a lane of a group begins with; behind the last neuron there are lanes for nobody."""
        if self._begins is None:
            return self.start(0)
        last = len(lanes.neurons) - 1
        index = f"({_LANES}*g + {lane} < {last} ? {_LANES}*g + {lane} : {last})"
        return self.start(str(self.code.at(lanes.neurons, index)))

    def term(self, edge: Place, column: _Column, target: _Target | None = None) -> str:
        """What a connection brings: its signal, times its factor."""
        signal = self._signal(edge, column) if target is None else self._of_kind(edge, column, target)
        if self.factors is None:
            return signal
        return f"{signal}*{self._operand(self.code.number(self.factors[column], edge))}"

    def _of_kind(self, edge: Place, column: _Column, target: _Target) -> str:
        """The signal of a connection, whether a synapse forms it or not; a choice in a loop over connections of
        several synapses."""
        code = self.code
        if self.kinds is None:
            return self._signal(edge, column)
        kinds = self.kinds[column]
        found = np.unique(kinds if not isinstance(edge, int) else kinds[edge : edge + 1]).tolist()
        if len(found) == 1:
            return self._of(found[0], edge, column, target)
        name, which = code.name("y"), code.at(np.searchsorted(found, kinds).astype(np.int64), edge)
        code.line(f"{code.real} {name};")
        for number, kind in enumerate(found):
            test = f"if ({which} == {number})" if number < len(found) - 1 else ""
            with code.block(" ".join(filter(None, ("else" if number else "", test)))):
                code.line(f"{name} = {self._of(kind, edge, column, target)};")
        return name

    def _of(self, kind: int, edge: Place, column: _Column, target: _Target) -> str:
        """The signal of a connection of a kind."""
        if kind < 0:
            return self._signal(edge, column)
        assert self.kinds is not None
        members = np.where(self.kinds == kind, self.network.synapses.positions[self.connections], 0)
        some = Some(kind, members[column], edge, target.place)
        return self.code.text(self.forming.value(some, target.known.get(kind, {})))

    def _signal(self, edge: Place, column: _Column) -> str:
        """w[t−d]·a[t−d] of a connection: ``weights[3]*activity[1]`` without a delay, ``signals[5 + r2]`` with one of
        2, ``weights[3]*signals[5 + r2]`` where it is shared, and a choice in a loop over connections of which some
        are of one kind and some of another."""
        code = self.code
        rings = self.rings[column] if not isinstance(edge, int) else self.rings[column][edge : edge + 1]
        kinds = _different(rings)
        if self._sent is not None and self._sent.late is not None:
            return self._at_stage(self._sent.late[self.plain[column]], edge, column)
        if self.fused:
            end = self.begin + len(self.connections)
            places = np.arange(self.begin, end, dtype=width(0, end))[column]
            return f"packed[{code.at(places, edge)}]*before[{code.at(self.sources[column], edge)}]"
        now = ""
        if kinds[0] == 0:
            now = f"weights[{code.at(self.plain[column], edge)}]*{self.sent(column, edge)}"
        if kinds == [0]:
            return now
        if len(kinds) == 1:
            return self._on_arrival(self._slot(kinds[0], self.offsets[column], edge), edge, column)
        offset = code.at(self.offsets[column], edge)
        kind = code.at(np.searchsorted(kinds, rings).astype(np.int64), edge)
        rests = "_".join(["r", *(str(one) if one < _LATE else "{}of{}".format(*divmod(one, _LATE)) for one in kinds)])
        shifts = ", ".join("0" if one < 2 else f"(int32_t)({_now(one)} % {_length(one)})" for one in kinds)
        code.head[rests] = f"const int32_t {rests}[{len(kinds)}] = {{{shifts}}};"
        arriving = self._on_arrival(f"signals[{offset} + {rests}[{kind}]]", edge, column)
        return f"({kind} ? {arriving} : {now})" if kinds[0] == 0 else arriving

    def _at_stage(self, late: Indices, edge: Place, column: _Column) -> str:
        """What a connection brings at a stage: what has come with a continuous delay, else what is sent now."""
        code = self.code
        own = late[edge : edge + 1] if isinstance(edge, int) else late
        arrived = f"fl[{code.at(late, edge)}]"
        if (own >= 0).all():
            return arrived
        now = f"weights[{code.at(self.plain[column], edge)}]*{self.sent(column, edge)}"
        return f"({code.at(late, edge)} >= 0 ? {arrived} : {now})" if (own >= 0).any() else now

    @cached_property
    def rings(self) -> Indices:
        """The delay of each connection; of a continuous one also how long its ring is."""
        lags = self.network.connections.lags
        held = None if lags is None else np.isnan(lags[self.plain])
        if held is None or held.all():
            return self.delays
        delays = self.delays.astype(np.int64)
        return np.where(held, delays, delays + _LATE * self._layout.lengths[self.plain])

    def _slot(self, ring: int, offsets: Indices, edge: Place) -> str:
        """What arrives in this step in the slots of a connection with such a ring."""
        shift = "" if ring == 1 else f" + {self.code.remainder(ring)}"
        if ring >= _LATE:
            length, delay = divmod(ring, _LATE)
            shift = f" + r{length}of{delay}"
            self.code.head[shift[3:]] = f"const int32_t {shift[3:]} = (int32_t)({_now(ring)} % {length});"
        return f"signals[{self.code.at(offsets, edge)}{shift}]"

    def _on_arrival(self, sent: str, edge: Place, column: _Column) -> str:
        """What is made of the content of a slot: what is shared is weighted, and 0 where it is lost."""
        code, connections = self.code, self.plain[column]
        delays, shares = self.delays[column], self.shares[column]
        some = slice(edge, edge + 1) if isinstance(edge, int) else slice(None)
        if not shares[some].any():
            return sent
        connection = code.at(connections, edge)
        arriving = f"weights[{connection}]*{sent}"
        if self.form.lost:
            arriving = f"(k - {code.at(delays, edge)} < lost[{connection}] ? {code.text(0.0)} : {arriving})"
        if shares[some][delays[some] > 0].all():
            return arriving
        return f"({code.at(shares.astype(np.int64), edge)} ? {arriving} : {sent})"
