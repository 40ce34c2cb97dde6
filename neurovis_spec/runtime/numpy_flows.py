"""The flow as NumPy code: states with a derivative, integrated together, a stage at a time.

In: a Step in the making. Out: lines in its ``Code``. While they are integrated, the flow states of all populations lie
one behind the other in one array, so that a method computes with all at once. What of a port is held over the step is
made once, before the first stage; a stage is a function of the time. A state v of two neurons gives, with euler,

    # kept with the text: f4, the states at the beginning of a step, f5, where a stage looks, f6, its derivatives, and
    # f7, which is f5[0:2]
    def stage8(t):                               # before the steps
        f6[0:2] = 3.0 - f7
        if fixed: f6[held] = 0.0                 # of states that are clamped
    …
        if not (k == 0 and not state.continued):
            f4[0:2] = v0_
            t = (k - 1) * 0.1
            f5[:] = f4
            stage8(t + 9.5367431640625e-08)
            multiply(f6, c12, f6)                # c12 the length of the step
            add(f4, f6, f4)
            v0_[:] = f4[0:2]
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain, pairwise
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.flows import BY_SLOPE
from neurovis_spec.compiler.program import Diffuse, Integrate, Key, Owner, Port, Projection, Use
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.numpy_arrivals import (
    Step,
    accumulated,
    cell_of,
    each,
    end_at,
    finished,
    put_together,
    signals_at,
    some_of,
    with_bias,
    with_factors,
    with_step_values,
)
from neurovis_spec.runtime.numpy_code import FIRST, shared
from neurovis_spec.runtime.numpy_lags import Around, at_stage, ends_around, signals_around
from neurovis_spec.runtime.stages import (
    Contacts,
    End,
    Formulas,
    Moment,
    Part,
    Through,
    apart,
    contacts_of,
    ends_of,
    flowing,
    formed_at,
    parts_of,
    places_among_taken,
    taken_by,
    taken_in_order,
    times,
)

#: fewer signals are added one by one, however they lie
_DENSE = 4096
#: a name that no author can write
_FORMED = "the signal"


def integrate(operation: Integrate, step: Step) -> None:
    """The flow states of some populations, over a step."""
    _Flow(step, operation).emit()


def diffuse(operation: Diffuse, step: Step) -> None:
    """x + g·√dt·ξ of each flow state with noise."""
    code, network = step.code, step.network
    with _unless_first(step):
        for number in operation.populations:
            population = network.populations[number]
            root = float(np.sqrt(network.dt * population.model.definition.per_second))
            for one in population.model.definition.flows:
                if one.noise is not None:
                    drawn = network.noise_of(state=one.name)[population.members]
                    cells = code.state(population.model, one.name)
                    numbers = code.select("s", drawn, network.vector_size)
                    code.line(f"{cells} += ({step.spread[number, one.name]} * {root!r}) * {numbers}")
            code.line(f"if fixed: hold_cells(fixed, {code.constant((population.model.owner,))}, cells)")


@contextmanager
def _unless_first(step: Step) -> Iterator[None]:
    """At any step but the first one of all."""
    step.code.line(f"if not ({FIRST}):")
    step.code.indent += 1
    yield
    step.code.indent -= 1


class _Anew(NamedTuple):
    """What some connections of a projection read anew at each stage: which, and where it stands, among what is taken at
    the stage, or else in the vector of its inputs."""

    some: IntArray
    places: IntArray
    is_input: bool


@dataclass
class _Joined:
    """The connections of a projection that take part in a stage: all that there is of it there, it with these alone,
    and which of its members they are, None for all."""

    at: Contacts
    projection: Projection
    some: IntArray | None
    #: identifiers of what they read that stays over the stages
    held: dict[str, str] = field(default_factory=dict)
    #: what of each of them, by its name, is read anew at each stage
    anew: dict[str, list[_Anew]] = field(default_factory=dict)
    #: what of each of them is read between steps: of which connections, and what was sent then
    between: dict[str, tuple[IntArray, Around]] = field(default_factory=dict)

    @property
    def use(self) -> Use:
        """The synapse or the rule."""
        return self.projection.use


class _Flow:
    """The integration of some populations and projections in the making."""

    def __init__(self, step: Step, operation: Integrate) -> None:
        self.step, self.code, self.network, self.operation = step, step.code, step.network, operation
        contacts = contacts_of(step.network, operation)
        working = [_Joined(one, *step.working(one.number)) for one in contacts]
        self.contacts = {one.at.number: one for one in working if len(one.projection.members)}
        #: of activities and outlets whether they are, where connections read them now, those of a stage
        self.flowing = flowing(step.whole) if working else np.zeros(0, dtype=np.bool_)
        self.parts = parts_of(step.network, operation, contacts, self.flowing)
        #: where in what is taken at a stage each activity and each outlet lies, −1 for the others
        self.taken = places_among_taken(self.network, self.parts)
        #: the flow states, whose they are and by how many, and where each of them lies among all
        self.states = [
            (part.population.model, name, len(part.population.members)) for part in self.parts for name in part.flows
        ] + [(one.use, name, len(one.projection.members)) for one in self.contacts.values() for name in one.at.flows]
        ends = np.cumsum([0, *(count for _, _, count in self.states)]).tolist()
        self.places = {
            Key(use.owner, name): slice(begin, end)
            for (use, name, _), (begin, end) in zip(self.states, pairwise(ends), strict=True)
        }
        self.size, self.taken_count = ends[-1], int(self.taken.max(initial=-1)) + 1
        #: the states at the beginning of the step, those where a stage looks, the derivatives there, their slopes
        looked_at = np.empty(self.size)
        self.x, self.y, self.k = self.temporary(), self.code.array("f", looked_at), self.temporary()
        self.j = self.temporary() if operation.method in BY_SLOPE else ""
        self.sent = self.code.array("f", np.empty(self.taken_count)) if self.taken_count else ""
        #: each state where a stage looks
        self.now = {key: self.code.array("f", looked_at[place]) for key, place in self.places.items()}
        #: by population and port what is made of it once a step, before the stages: all that is at the port, where that
        #: is held over the step, else what arrives there and is held
        self.whole: dict[tuple[int, str], str] = {}
        self.held: dict[tuple[int, str], str] = {}
        #: what arrives there with continuous delays
        self.around: dict[tuple[int, str], Around] = {}
        #: matrices of weights, by population and port, and what fills those once a step that learn
        self.matrices: dict[tuple[int, str], str] = {}
        self.filled: list[str] = []

    def temporary(self) -> str:
        """An array to work in, as long as all flow states."""
        return self.code.array("f", np.empty(self.size))

    def numbers(self, value: Callable[[float], float]) -> str:
        """What a method makes of the length of its steps, for each number in the time of its definition."""
        made = np.empty(self.size)
        for use, name, _ in self.states:
            h = self.network.dt * use.definition.per_second / self.operation.substeps
            made[self.places[Key(use.owner, name)]] = value(h)
        return self.code.constant(shared(made))

    def emit(self) -> None:
        """The whole integration, and what the noise behind it is multiplied by."""
        if not self.size:  # rules alone flow, and none is carried out
            return
        code, substeps, h = self.code, self.operation.substeps, self.network.dt / self.operation.substeps
        stage = code.name("stage")
        with _unless_first(self.step):
            some = {
                one.use.owner: f"[{code.constant(one.some)}]" for one in self.contacts.values() if one.some is not None
            }
            cells = [code.state(use, name) + some.get(use.owner, "") for use, name, _ in self.states]
            for cell, place in zip(cells, self.places.values(), strict=True):
                code.line(f"{self.x}[{_text(place)}] = {cell}")
            self.emit_fixed()
            for one in self.contacts.values():
                self.hold_ends(one)
            for part in self.parts:
                for port in part.ports:
                    self.hold(part, port)
            spread = self.make_spread()
            arguments = [*(("share",) if self.step.lags is not None else ()), *(("first=False",) if spread else ())]
            with code.function(stage, "t", *arguments):
                _Stage(self).emit()
            for line in (*self.filled, f"t = (k - 1) * {self.network.dt!r}"):
                code.line(line)
            if substeps > 1:
                code.line("start = t")
                code.line(f"for substep in range({substeps}):")
                code.indent += 1
                code.line(f"t = start + substep * {h!r}")
            inside, is_first = times(0.0, h).first.t, ""
            if spread:
                is_first = ", first=substep == 0" if substeps > 1 else ", first=True"
            first, middle, last = map(self.share, times(0.0, h))
            calls = [
                f"{stage}(t + {inside!r}{first}{is_first})",
                f"{stage}(t + {h / 2.0!r}{middle})",
                f"{stage}(t + {h!r} - {inside!r}{last})",
            ]
            for line in _METHODS[self.operation.method](self, *calls):
                code.line(line)
            code.line(f"if fixed: {self.x}[held] = values")
            code.indent -= substeps > 1
            for cell, place in zip(cells, self.places.values(), strict=True):
                code.line(f"{cell if cell[-1] == ']' else f'{cell}[:]'} = {self.x}[{_text(place)}]")

    def share(self, at: Moment) -> str:
        """The argument of a stage that says which share of the step is over; ``at`` is that of a substep."""
        if self.step.lags is None:
            return ""
        substeps = self.operation.substeps
        return f", {at.share!r}" if substeps == 1 else f", (substep + {at.share!r}) / {substeps}"

    def emit_fixed(self) -> None:
        """Which of the flow states are held, and at what."""
        some: dict[Owner | None, IntArray | None] = {one.use.owner: one.some for one in self.contacts.values()}
        starts = {key: (place.start, some.get(key.owner)) for key, place in self.places.items()}
        self.code.line("if fixed:")
        self.code.line(f"    held, values = held_among(fixed, {self.code.constant(starts)})")
        self.code.line(f"    {self.x}[held] = values")

    def make_spread(self) -> bool:
        """Room for what the noise of the flow states is multiplied by, where there is any."""
        for part in self.parts:
            for name, _ in part.spread.trees:
                self.step.spread[part.number, name] = self.code.array("g", np.empty(len(part.population.members)))
        return bool(self.step.spread)

    def hold(self, part: Part, port: Port) -> None:
        """What of a port is made before the stages."""
        held, staged = apart(port)
        key, step, arriving = (part.number, port.name), self.step, ""
        if key in self.whole or key in self.held:
            return
        if len(held):
            signals = signals_at(step, part.number, port, held)
            arriving = self.code.let("h", accumulated(step, part.population, port, held, signals))
        lagging = self.lagging(port.incoming[staged])
        if lagging.any() and step.lags is not None:
            self.around[key] = signals_around(step, step.lags, port.incoming[staged[lagging]])
        if len(staged) or self.reads_formulas(part, port):
            self.held[key] = arriving
        else:
            self.whole[key] = self.given(part, port, arriving)

    def lagging(self, connections: Indices) -> BoolArray:
        """Which of some connections bring what is under way with a continuous delay."""
        if self.step.lags is None:
            return np.zeros(len(connections), dtype=np.bool_)
        return np.asarray(self.step.lags.there[connections] & (self.network.synapses.numbers[connections] < 0))

    def hold_ends(self, joined: _Joined) -> None:
        """What connections read that stays over the stages: weights, and of both ends what was sent, and what does not
        flow."""
        code, connections = self.code, self.network.connections
        members, contacts = joined.projection.members, joined.at
        every = (contacts.signal, contacts.derivatives, contacts.slopes, contacts.back)
        read = frozenset().union(*(one.names for one in every))
        if "weight" in read:
            joined.held["weight"] = code.let("w", code.select("weights", members, len(connections)))
        for name, end in ends_of(self.network, joined.projection).items():
            if name not in read:
                continue
            past = end.past & (connections.delays[members] > 0)
            anew = list(self.anew(end, past))
            if anew:
                joined.anew[name] = anew
            made = sum(len(one.some) for one in anew)
            if (lags := self.step.lags) is not None and (late := past & lags.there[members]).any():
                around = ends_around(self.step, lags, members[late], end.places[late])
                joined.between[name] = np.flatnonzero(late), around
                made += int(late.sum())
            if made < len(members):
                held = end_at(self.step, members, end)
                if made:  # of each connection: it is filled in at each stage
                    held = f"np.array(np.broadcast_to({held}, ({len(members)},)))"
                joined.held[name] = code.let("a", held)

    def anew(self, end: End, past: BoolArray) -> Iterator[_Anew]:
        """What connections read of an end that is made anew at each stage; ``past``: those that read what was sent."""
        behind = len(self.flowing)
        neural = np.minimum(end.places, behind - 1)
        flows = (end.places < behind) & self.flowing[neural] & (self.taken[neural] >= 0)
        formulas = np.zeros(len(past), dtype=np.bool_)
        for entry in map(self.network.input_index.__getitem__, self.network.held_inputs):
            formulas |= (end.places >= behind + entry.start) & (end.places < behind + entry.start + entry.size)
        for which, places, is_input in ((flows, self.taken[neural], False), (formulas, end.places - behind, True)):
            some = np.flatnonzero(which & ~past)
            if len(some):
                yield _Anew(some, places[some], is_input)

    def given(self, part: Part, port: Port, arriving: str, vector: str = "s") -> str:
        """All that is at a port, of what arrives there, "" for nothing."""
        if arriving:
            arriving = self.code.let("u", finished(port, arriving))
        drive = with_bias(self.step, part.population, port, arriving)
        return with_step_values(self.step, part.population, port, drive, vector)

    def reads_formulas(self, part: Part, port: Port) -> bool:
        """Whether inputs that are formulas are put into a port."""
        fed = self.network.neurons.input_at(port.name)[part.population.members]
        entries = map(self.network.input_index.__getitem__, self.network.held_inputs)
        return any(((fed >= entry.start) & (fed < entry.start + entry.size)).any() for entry in entries)


class _Stage:
    """What a stage does, in the making: the lines of a function of the time ``t``."""

    def __init__(self, flow: _Flow) -> None:
        self.flow, self.step, self.code, self.network = flow, flow.step, flow.code, flow.network
        #: the names that formulas of a population see, and the functions, as far as they are known
        self.known: dict[int, dict[str, str]] = {}
        self.functions = {part.number: self.code.functions(part.population.activation) for part in flow.parts}
        #: the same of projections
        self.joined: dict[int, dict[str, str]] = {}
        self.vector = self.emit_inputs()
        self.taking = False
        #: what is taken, as far as it is written
        self.done = np.zeros(flow.taken_count, dtype=np.bool_)

    def emit(self) -> None:
        """The derivatives of all flow states, and how much they change with these, where the method looks at that; at
        the first stage of a step what their noise is multiplied by, too."""
        self.emit_taken()
        for part in self.flow.parts:
            for array, formulas in ((self.flow.k, part.derivatives), (self.flow.j, part.slopes)):
                for name, value in self.values(part, formulas).items():
                    self.code.line(f"{self.place(array, part.population.model, name)} = {value}")
            for through in part.through:
                ((_, value),) = self.values(part, through.slope).items()
                back, j = self.back(part, through), self.place(self.flow.j, part.population.model, through.state)
                self.code.line(f"{j} += ({value}) * {back}")
        for joined in self.flow.contacts.values():
            for array, formulas in ((self.flow.k, joined.at.derivatives), (self.flow.j, joined.at.slopes)):
                for name, value in self.values_of(joined, formulas).items():
                    self.code.line(f"{self.place(array, joined.use, name)} = {value}")
        self.code.line(f"if fixed: {self.flow.k}[held] = 0.0")
        if not self.step.spread:
            return
        self.code.line("if first:")
        self.code.indent += 1
        for part in self.flow.parts:
            for name, value in self.values(part, part.spread).items():
                self.code.line(f"{self.step.spread[part.number, name]}[:] = {value}")
        self.code.indent -= 1

    def emit_inputs(self) -> str:
        """The vector of the step, in which inputs that are formulas are made anew."""
        if not self.network.held_inputs:
            return "s"
        vector = self.code.let("s", "s.copy()")
        for name, held in self.network.held_inputs.items():
            entry = self.network.input_index[name]
            if entry.expression is not None:
                read = names(entry.expression) & self.network.parameters.keys()
                known = {name: self.code.constant(self.network.parameters[name]) for name in sorted(read)}
                known |= {name: f"state.conditions.parameters[{slot}]" for name, slot in entry.slots.items()}
                if entry.indexed:
                    known |= {"i": self.code.constant(np.arange(float(entry.size))), "n": repr(float(entry.size))}
                value = self.code.expression(entry.expression, known | {"t": "t"})
                place = f"{entry.start}:{entry.start + entry.size}"
                self.code.line(f"if not s[{held}]: {vector}[{place}] = {value}")
        return vector

    def emit_taken(self) -> None:
        """What connections take at the stage."""
        self.taking = True
        for part, taken in taken_in_order(self.flow.parts):
            begin = int(self.flow.taken[taken.places[0]])
            (value,) = self.values(part, taken.formulas).values()
            place, held = f"{self.flow.sent}[{begin}:{begin + len(taken.places)}]", f"holds[{part.number}]"
            self.code.line(f"{place} = {value}")
            if taken.is_activity:
                positions = self.code.constant(self.flow.taken)
                self.code.line(f"if holds and {held}: {self.flow.sent}[{positions}[{held}[0]]] = {held}[1]")
            else:  # where a lesioned neuron is a signal of a rule
                members = self.code.constant(part.population.members)
                self.code.line(f"if holds and {held}: {place}[state.conditions.lesioned_neurons[{members}]] = 0.0")
            self.done[begin : begin + len(taken.places)] = True
        self.taking = False

    def values(self, part: Part, formulas: Formulas) -> dict[str, str]:
        """The code of formulas by their names; the intermediate values and ports that they need are written once."""
        known, functions = self.seen(part), self.functions[part.number]
        if self.taking and not all(map(self.is_complete, formulas.ports)):
            known = dict(known)  # what arrives at members of which nothing is taken yet may be taken later
        for port in formulas.ports:
            if port.name not in known:
                known[port.name] = self.port(part, port)
        for name, tree in formulas.let:
            if name not in known:
                known[name] = self.code.let("m", self.code.expression(tree, known, functions))
        return {name: self.code.expression(tree, known, functions) for name, tree in formulas.trees}

    def is_complete(self, port: Port) -> bool:
        """Whether all that arrives at a port at the stage has been taken by now."""
        connections = port.incoming[apart(port)[1]]
        plain = connections[self.network.synapses.numbers[connections] < 0]
        read = [self.flow.taken[taken_by(self.network)[plain]]]
        for one in formed_at(self.network, connections):
            ends = chain.from_iterable(self.flow.contacts[one.number].anew.values())
            read += (anew.places for anew in ends if not anew.is_input)
        return all(bool(self.done[taken[taken >= 0]].all()) for taken in read)

    def seen(self, part: Part) -> dict[str, str]:
        """What all formulas of a population see: parameters, the time, states."""
        if part.number not in self.known:
            model = part.population.model
            known = self.code.parameters(model)
            unit = model.definition.per_second
            known["t"] = "t" if unit == 1.0 else f"(t * {unit!r})"
            for one in model.definition.state:
                key = Key(model.owner, one.name)
                known[one.name] = self.flow.now[key] if key in self.flow.now else self.code.state(model, one.name)
            self.known[part.number] = known
        return self.known[part.number]

    def place(self, array: str, use: Use, name: str) -> str:
        """The part of an array that is a flow state's."""
        return f"{array}[{_text(self.flow.places[Key(use.owner, name)])}]"

    def values_of(self, joined: _Joined, formulas: Formulas) -> dict[str, str]:
        """The code of formulas of a projection by their names. What it reads of ends is complete when all is taken;
        before, it is read anew each time."""
        known: dict[str, str] = {} if self.taking else self.joined.setdefault(joined.at.number, {})
        if not formulas.trees:
            return {}
        if not known:
            known |= self.code.parameters(joined.use, joined.some)
            unit = joined.use.definition.per_second
            known["t"] = "t" if unit == 1.0 else f"(t * {unit!r})"
            varying = joined.anew.keys() | joined.between.keys()
            known |= {name: held for name, held in joined.held.items() if name not in varying}
            for one in joined.use.definition.state:
                now = self.flow.now.get(Key(joined.use.owner, one.name))
                known[one.name] = now or cell_of(self.code, joined.projection, one.name, joined.some)
        for name in sorted((joined.anew.keys() | joined.between.keys()) & formulas.names - known.keys()):
            known[name] = self.read_anew(joined, name)
        for name, tree in formulas.let:
            if name not in known:
                known[name] = self.code.let("m", self.code.expression(tree, known))
        return {name: self.code.expression(tree, known) for name, tree in formulas.trees}

    def read_anew(self, joined: _Joined, name: str) -> str:
        """What connections read of an end, of which something is made at the stage, or lies between steps."""
        code, flow, parts = self.code, self.flow, list[tuple[str, IntArray]]()
        for one in joined.anew.get(name, ()):
            size = self.network.vector_size if one.is_input else flow.taken_count
            parts.append((code.select(self.vector if one.is_input else flow.sent, one.places, size), one.some))
        if name in joined.between:
            some, around = joined.between[name]
            parts.append((at_stage(code, around), some))
        count = len(joined.projection.members)
        if name not in joined.held:
            return put_together(code, parts, count, "a")
        made = code.let("a", f"{joined.held[name]}.copy()")
        for values, some in parts:
            code.line(f"{made}{code.position(some, count)} = {values}")
        return made

    def formed(self, number: int) -> str:
        """The signals of the synapses of a projection."""
        joined = self.flow.contacts[number]
        known = {} if self.taking else self.joined.setdefault(number, {})
        if _FORMED not in known:
            (value,) = self.values_of(joined, joined.at.signal).values()
            known[_FORMED] = each(self.step, joined.projection, joined.at.signal.names, value)
        return known[_FORMED]

    def back(self, part: Part, through: Through) -> str:
        """How much what synapses bring to a port of each member changes with one of its states."""
        _, staged = apart(through.port)
        connections = through.port.incoming[staged]
        parts = []
        for one in formed_at(self.network, connections):
            joined = self.flow.contacts[one.number]
            value = self.values_of(joined, joined.at.back).get(through.state)
            if value is not None:
                value = each(self.step, joined.projection, joined.at.back.names, value)
                parts.append((some_of(self.step, one, value), one.places))
        places = np.sort(np.concatenate([places for _, places in parts]))
        parts = [(values, np.searchsorted(places, own)) for values, own in parts]
        signals = put_together(self.code, parts, len(places))
        signals = with_factors(self.code, through.port, staged[places], signals)
        return self.code.let("h", accumulated(self.step, part.population, through.port, staged[places], signals))

    def port(self, part: Part, port: Port) -> str:
        """What is at a port."""
        flow, key = self.flow, (part.number, port.name)
        if key in flow.whole:
            return flow.whole[key]
        arriving, (_, staged) = flow.held[key], apart(port)
        if len(staged):
            connections = port.incoming[staged]
            if key in flow.around or (self.network.synapses.numbers[connections] >= 0).any():
                signals = with_factors(self.code, port, staged, self.mixed(connections, flow.around.get(key)))
                arriving = accumulated(self.step, part.population, port, staged, signals, arriving)
                return flow.given(part, port, arriving, self.vector)
            weights, taken, signals = self.plain(connections)
            if port.combine == "sum" and port.factors is None and not arriving and len(staged) >= _DENSE:
                arriving = self.product(part, port, taken, weights, signals)
            else:
                signals = with_factors(self.code, port, staged, self.code.let("g", signals))
                arriving = accumulated(self.step, part.population, port, staged, signals, arriving)
        return flow.given(part, port, arriving, self.vector)

    def plain(self, connections: Indices) -> tuple[str, IntArray, str]:
        """Of connections without a synapse weights, where what they take is among all that is, and their signals."""
        weights = self.code.select("weights", connections, len(self.network.connections))
        taken = self.flow.taken[taken_by(self.network)[connections]]
        return weights, taken, f"{weights} * {self.code.select(self.flow.sent, taken, self.flow.taken_count)}"

    def mixed(self, connections: Indices, around: Around | None) -> str:
        """The signals of connections of which some have a synapse, or bring what was sent ``around`` some time."""
        parts = [
            (some_of(self.step, one, self.formed(one.number)), one.places)
            for one in formed_at(self.network, connections)
        ]
        lagging = self.flow.lagging(connections)
        if around is not None:
            parts.append((at_stage(self.code, around), np.flatnonzero(lagging)))
        plain = np.flatnonzero((self.network.synapses.numbers[connections] < 0) & ~lagging)
        if len(plain):
            *_, signals = self.plain(connections[plain])
            parts.append((signals, plain))
        return put_together(self.code, parts, len(connections))

    def product(self, part: Part, port: Port, taken: IntArray, weights: str, signals: str) -> str:
        """The sums of a port all of whose signals are made anew. Where most neurons are connected, they are a product
        of a matrix of weights, which adds in the same order; it has a 0 where there is no connection, which an infinite
        activity must not make NaN."""
        _, staged = apart(port)
        count, slots = len(part.population.members), port.slots[staged]
        if _row_by_row(taken, slots, count):
            sent = self.code.select(self.flow.sent, taken[::count], self.flow.taken_count)
            return f"einsum('st,s->t', {weights}.reshape({(len(taken) // count, count)}), {sent})"
        slots = slots.astype(np.int64)
        rows, row = np.unique(taken, return_inverse=True)
        flat, size = row * count + slots, len(rows) * count
        one_by_one = accumulated(self.step, part.population, port, staged, signals)
        in_order = np.argsort(slots, kind="stable")
        ascends = np.diff(flat[in_order])[np.diff(slots[in_order]) == 0] > 0
        if count == 1 or not ascends.all() or 2 * len(flat) < size:
            return one_by_one
        sent, shape = self.code.select(self.flow.sent, rows, self.flow.taken_count), (len(rows), count)
        key = part.number, port.name
        if key not in self.flow.matrices:
            matrix = self.flow.matrices[key] = self.code.array("f", np.zeros(shape))
            fill = f"{matrix}.reshape(-1)[{self.code.constant(flat)}] = {weights}"
            if (self.network.connections.rules[port.incoming[staged]] >= 0).any():
                self.flow.filled.append(fill)
            else:
                self.code.before.append(f"    {fill}")
        a = self.code.let("a", sent)
        return f"einsum('st,s->t', {self.flow.matrices[key]}, {a}) if isfinite(dot({a}, {a})) else {one_by_one}"


def _row_by_row(taken: Indices, slots: Indices, count: int) -> bool:
    """Whether connections are a full matrix as they lie: from each of what they take to all of ``count`` neurons. A
    matrix of one column is none, since a product adds up that in another order."""
    if count == 1 or len(slots) % count:
        return False
    rows = taken[::count].reshape(-1, 1)
    return bool((slots.reshape(-1, count) == np.arange(count)).all() and (taken.reshape(-1, count) == rows).all())


def _text(place: slice) -> str:
    return f"{place.start}:{place.stop}"


def _euler(flow: _Flow, first: str, middle: str, last: str) -> Iterator[str]:
    x, y, k = flow.x, flow.y, flow.k
    yield f"{y}[:] = {x}"
    yield first
    yield f"multiply({k}, {flow.numbers(float)}, {k})"
    yield f"add({x}, {k}, {x})"


def _heun(flow: _Flow, first: str, middle: str, last: str) -> Iterator[str]:
    x, y, k, total = flow.x, flow.y, flow.k, flow.temporary()
    yield f"{y}[:] = {x}"
    yield first
    yield f"{total}[:] = {k}"
    yield from _moved(flow, flow.numbers(float))
    yield last
    yield f"add({total}, {k}, {total})"
    yield f"multiply({total}, {flow.numbers(lambda h: h / 2.0)}, {total})"
    yield f"add({x}, {total}, {x})"


def _rk4(flow: _Flow, first: str, middle: str, last: str) -> Iterator[str]:
    x, y, k, total = flow.x, flow.y, flow.k, flow.temporary()
    half, h = flow.numbers(lambda h: h / 2.0), flow.numbers(float)
    yield f"{y}[:] = {x}"
    yield first
    yield f"{total}[:] = {k}"
    for _ in range(2):
        yield from _moved(flow, half)
        yield middle
        yield f"multiply({k}, 2.0, {y})"
        yield f"add({total}, {y}, {total})"
    yield from _moved(flow, h)
    yield last
    yield f"add({total}, {k}, {total})"
    yield f"multiply({total}, {flow.numbers(lambda h: h / 6.0)}, {total})"
    yield f"add({x}, {total}, {x})"


def _moved(flow: _Flow, h: str) -> Iterator[str]:
    """The next stage looks so far along the derivatives of the last one."""
    yield f"multiply({flow.k}, {h}, {flow.y})"
    yield f"add({flow.x}, {flow.y}, {flow.y})"


def _exponential(flow: _Flow, first: str, middle: str, last: str) -> Iterator[str]:
    x, y, k, j, h = flow.x, flow.y, flow.k, flow.j, flow.numbers(float)
    yield f"{y}[:] = {x}"
    yield first
    yield f"multiply(minimum({j}, 0.0), {h}, {j})"
    yield f"multiply({h}, {FUNCTIONS['exprel'].code.format(j)}, {j})"
    yield f"multiply({j}, {k}, {k})"
    yield f"add({x}, {k}, {x})"


def _semi_implicit(flow: _Flow, first: str, middle: str, last: str) -> Iterator[str]:
    x, y, k, j, h = flow.x, flow.y, flow.k, flow.j, flow.numbers(float)
    yield f"{y}[:] = {x}"
    yield first
    yield f"multiply(minimum({j}, 0.0), {h}, {j})"
    yield f"subtract(1.0, {j}, {j})"
    yield f"multiply({k}, {h}, {k})"
    yield f"divide({k}, {j}, {k})"
    yield f"add({x}, {k}, {x})"


#: What a method makes of the states at the beginning of a step and of derivatives at stages; ``first``, ``middle`` and
#: ``last`` evaluate these there.
_METHODS: Final[Mapping[Method, Callable[[_Flow, str, str, str], Iterator[str]]]] = {
    "euler": _euler,
    "heun": _heun,
    "rk4": _rk4,
    "exponential": _exponential,
    "semi_implicit": _semi_implicit,
}
