"""A step of a network as C: the operations of the program, for one neuron or one connection after the other.

In: a Network. Out: the lines of a function's body, over the arrays of a State by the names ``activity``, ``weights``,
``signals``, ``history``, ``cells…``, ``traces…``, the numbers that can be set as ``x``, the vector of the step as
``s`` and the step ``k``. Sums go in the order of the connections. A small network is written out neuron by neuron;
of a larger one, each population is a loop. So K -> O after one step, O with a bias, is

    {
        const double u1 = 0.0 + signals[0] + 0.5;
        activity[1] = u1;
    }
    signals[0] = weights[0]*activity[0];

and where K's signals are shared, ``weights[0]*signals[0]`` and ``signals[0] = activity[0]``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property, partial, singledispatch
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.events.settable import HIGH, LOW, bias_of
from neurovis_spec.compiler.network import Input, Network, Outlet
from neurovis_spec.compiler.program import (
    PHASES,
    RULE,
    SPIKE,
    SYNAPSE,
    Advance,
    Definition,
    Gather,
    Holder,
    Key,
    Learn,
    Operation,
    Phase,
    Population,
    Port,
    Projection,
    Quantity,
    ReadInputs,
    Receive,
    Send,
    Softmax,
    Tie,
    Update,
    Use,
)
from neurovis_spec.compiler.values.spikes import FIRES
from neurovis_spec.language.expressions.emit_c import Made, Value
from neurovis_spec.language.expressions.tree import Name, Tree, names
from neurovis_spec.runtime.c_arrivals import Arrivals, Incoming, incoming_of
from neurovis_spec.runtime.c_code import Code, Form, Place, plus, words_of
from neurovis_spec.runtime.c_connections import Ends, Forming, Sight, Some, taken, taken_at
from neurovis_spec.runtime.c_plan import Plan, plan_of
from neurovis_spec.runtime.c_spikes import Firing
from neurovis_spec.runtime.events import rows_of, takes_spikes
from neurovis_spec.runtime.kept_once import Kept
from neurovis_spec.runtime.signals import DelayClass, SharedSlots, SignalLayout
from neurovis_spec.runtime.stages import acts_now, port_with, signal_of, target_of, unfolded
from neurovis_spec.runtime.state import Mask

_NONE: Mapping[str, Made] = {}
_NO_TOTALS: Mapping[int, str] = {}
_NO_ARRIVALS: Mapping[int, Arrivals] = {}
_NO_CLOCK: Mapping[str, Value] = {}
#: connections whose rule is written side by side in a loop: a compiler makes vectors of them
_RULES_SIDE_BY_SIDE = 4


@dataclass(frozen=True, eq=False)
class Built:
    """What all forms of the step of a network share, each worked out once; ``layout``: where signals are under way."""

    network: Network
    layout: SignalLayout
    #: states of connections that are kept once for many, in projections of their own
    kept: Mapping[Key, Kept] = field(default_factory=dict)
    #: what is worked out already of the network without these, where they change nothing of it
    whole: Built | None = None

    @cached_property
    def plan(self) -> Plan | None:
        """What is integrated."""
        return plan_of(self.network, None if self.whole is None else self.whole.network)

    @cached_property
    def in_work(self) -> bool:
        """Whether arrays of what arrives lie in ``work``, behind what an integration keeps there: not on the stack, as
        they always have where nothing flows and all arrives at one port, without synapses."""
        synapses = any(one.kind == SYNAPSE for one in self.network.projections)
        return self.plan is not None or synapses or len(self.network.port_names) > 1

    @cached_property
    def settles(self) -> bool:
        """Whether states of neurons are, behind a step, what their update has made of them: no spike of the same step
        makes any jump."""
        return not any(isinstance(one, Advance) and one.phase == "jump_now" for one in self.network.program)

    @cached_property
    def ends(self) -> Ends:
        """What there is to read at the ends of connections."""
        return Ends(self.network, self.kept)

    @cached_property
    def incoming(self) -> list[list[Incoming]]:
        """What arrives at each port of each population, but for spikes of the same step that act behind all."""
        if self.whole is not None:
            return self.whole.incoming
        network = self.network
        return [
            [
                incoming_of(
                    network,
                    port if port.now is None else port_with(port, ~acts_now(port)),
                    len(one.members),
                    fusible=network.sending is None and _plain(one),
                    spiking=takes_spikes(network, port),
                )
                for port in one.ports
            ]
            for one in network.populations
        ]

    @cached_property
    def now(self) -> list[list[Incoming | None]]:
        """The spikes of the same step that act behind all, at each port of each population; None at most ports."""
        return [
            [
                None
                if port.now is None
                else incoming_of(self.network, port_with(port, acts_now(port)), len(one.members), False, spiking=True)
                for port in one.ports
            ]
            for one in self.network.populations
        ]


class StepCode:
    """Writes the body of a step of one form."""

    def __init__(self, built: Built, code: Code, form: Form) -> None:
        self.built, self.network, self.code, self.form = built, built.network, code, form
        self.layout, self.plan = layout, plan = built.layout, built.plan
        network = built.network
        #: what formulas of synapses see before their targets are updated, and those of rules behind all
        self.sight, self.behind = Sight(built.ends, code, form), Sight(built.ends, code, form, sent=True)
        synapses = ((number, one) for number, one in enumerate(network.projections) if one.kind == SYNAPSE)
        self.firing = Firing(built.ends, code, form)
        self.forming = forming = Forming(self.sight, {number: signal_of(one) for number, one in synapses})
        #: what ports have beside what arrives, by their names
        self.own = {name: _own(network, name) for name in network.port_names}
        #: what becomes of the states of each population before its update, phase by phase
        self.phases = [_phases(network, number) for number in range(len(network.populations))]
        #: the names that are read when a population is updated
        self.read_at_update = [
            frozenset().union(*(self._read_in(one) for one in self.definitions(number)))
            for number in range(len(network.populations))
        ]
        self.arrivals = [
            [Arrivals(network, one, code, form, self.layout, forming) for one in of_population]
            for of_population in built.incoming
        ]
        #: how many numbers of ``work`` arrays of what arrives take at most, and how many they take here
        self.room = self._taken = 0
        #: connections that are fused, (m,)
        self.fuses = np.zeros(len(network.connections), dtype=np.bool_)
        #: how many weights are packed
        self.count = 0
        #: projections whose connections send while they learn, in one pass over their weights: those of one delay
        learn = (one for one in network.program if isinstance(one, Learn) and not form.written_out)
        self.sent_with = frozenset(
            number
            for number in (one.projection for one in learn if one.phases == PHASES)
            if network.projections[number].kind == RULE
            and _common_delay(network.connections.delays[network.projections[number].members]) > 0
            and self.all_send(network.projections[number].members)
        )
        #: what arrives at a stage at ports of populations
        self.at_stages = {
            key: Arrivals(network, one.anew, code, form, layout, forming)
            for key, one in (plan.reaching if plan is not None else {}).items()
        }
        for arrivals in self.packing:
            if arrivals.can_be_fused:
                self.fuses[arrivals.connections] = True
            arrivals.begin = self.count
            self.count += len(arrivals.packed)

    def all_send(self, connections: Indices) -> bool:
        """Whether signals of all of these leave, and none has a continuous delay."""
        lags = self.network.connections.lags
        whole = lags is None or bool(np.isnan(lags[connections]).all())
        return whole and bool((self.layout.offsets[connections] >= 0).all())

    @property
    def packing(self) -> Iterator[Arrivals]:
        """Whatever may have its weights packed, of what is read at an update and at a stage."""
        at_updates = (
            own
            for number, arrivals in enumerate(self.arrivals)
            for port, own in zip(self.network.populations[number].ports, arrivals, strict=True)
            if port.name in self.read_at_update[number]
        )
        return (one for one in (*at_updates, *self.at_stages.values()) if one.can_be_fused or one.can_be_packed)

    def pack(self) -> None:
        """The weights of fused populations, and of synapses, in the order in which they are read, where they do not lie
        so."""
        code = self.code
        for arrivals in self.packing:
            if len(arrivals.packed):
                code.line(code.loop("e", len(arrivals.packed)))
                code.line(f"    packed[{arrivals.begin} + e] = weights[{code.at(arrivals.packed, 'e')}];")

    def read(self) -> None:
        """The inputs that are expressions, those that are asked for (``reads``), into ``s``; ``odd`` as of a step."""
        code, network = self.code, self.network
        expressions = [(number, one) for number, one in enumerate(network.inputs) if one.is_formula]
        if expressions:
            code.line(f"{code.real} odd = {code.text(0.0)};")
        for number, entry in expressions:
            with code.block(f"if (reads[{number}])"):
                value = write_input(code, network, entry, "s")
                if entry.indexed:
                    code.line(code.loop("i", entry.size))
                code.line(f"{'    ' * entry.indexed}odd += {value} - {value};")

    def write(self) -> None:
        """All operations in order."""
        if self.form.watched:
            self.code.line(f"{self.code.real} odd = {self.code.text(0.0)};")
        for projection in self.network.projections if self.form.fixed_joined else ():
            if projection.use.definition.holdable:
                self.hold_all(projection, projection.use)
        for operation in self.network.program:
            write(operation, self)

    # ---- neurons -----------------------------------------------------------------------------------------------

    def population(self, number: int) -> None:
        """The neurons of a population."""
        population = self.network.populations[number]
        read = self.read_at_update[number]
        arrivals = {
            one: own
            for one, (port, own) in enumerate(zip(population.ports, self.arrivals[number], strict=True))
            if port.name in read
        }
        if any(own.kinds is not None for own in arrivals.values()):
            self.hold_ahead(number)
        ahead = {one: own for one, own in arrivals.items() if self.reads_within(population, own)}
        with self.holding_arrays() if ahead else nullcontext():
            gathered = {one: self.summed(own, len(population.members)) for one, own in ahead.items()}

            def updated(place: Place, totals: Mapping[int, str]) -> None:
                self.neuron(number, place, {**totals, **{one: f"{name}[{place}]" for one, name in gathered.items()}})

            others = {one: own for one, own in arrivals.items() if one not in ahead}
            if parts := self.apart(number):
                self.part_by_part(number, parts, others, gathered)
            else:
                self.each(len(population.members), others, updated)

    def apart(self, number: int) -> tuple[Definition, ...]:
        """What of the model of a population that fires is carried out in loops of their own, one behind the other, as a
        compiler makes vectors of short ones; none where it is written neuron by neuron, or where more than the first
        reads a port."""
        population = self.network.populations[number]
        ports = {port.name for port in population.ports}
        first, *others = self.definitions(number)
        if self.form.written_out or not population.model.definition.fires or not others:
            return ()
        if any(not ports.isdisjoint(self._read_in(one)) for one in others):
            return ()
        return *self._firing_first(first), *(part for one in others for part in self._firing_first(one))

    def _firing_first(self, part: Definition) -> tuple[Definition, ...]:
        """A part of a model that decides what fires, with that ahead, for the rest to read it; another as it is."""
        spike = next((one for one in part.state if one.name == SPIKE and one.each_step is not None), None)
        others = [one for one in part.state if one is not spike]
        read = [one.each_step for one in others if one.each_step is not None]
        if spike is None or self.form.fixed or any(SPIKE in names(tree) for tree in read):
            return (part,)
        let = tuple((name, Name(SPIKE) if name == FIRES else tree) for name, tree in part.let)
        ahead = (replace(one, each_step=None) for one in others)
        rest = replace(part, state=tuple(replace(one, each_step=None) if one is spike else one for one in part.state))
        return replace(part, state=(spike, *ahead)), replace(rest, let=let)

    def part_by_part(
        self,
        number: int,
        parts: Sequence[Definition],
        arrivals: Mapping[int, Arrivals],
        gathered: Mapping[int, str],
    ) -> None:
        """The neurons of a population, part by part of its model; what arrives is read by the first of these."""
        population, code = self.network.populations[number], self.code
        count, last = len(population.members), parts[-1]
        no_ports: dict[str, Value] = {port.name: 0.0 for port in population.ports}

        def carried_out(place: Place, totals: Mapping[int, str], part: Definition) -> None:
            ports = no_ports
            if part is parts[0]:
                sums = {**totals, **{one: f"{name}[{place}]" for one, name in gathered.items()}}
                ports = self.at_ports(number, place, sums)
                self.hold_states(population.model, place)
            given = self.carry_out(number, place, part, ports)
            if part is last:
                neuron = code.at(population.members, place)
                self.put_given(number, place, neuron, given)
                self.hold_activity(neuron)
                self.let_out(number, place, neuron)

        for part in parts:
            self.each(count, arrivals if part is parts[0] else _NO_ARRIVALS, partial(carried_out, part=part))

    def reads_within(self, population: Population, arrivals: Arrivals) -> bool:
        """Whether synapses that lead to a population read, before any of it is updated, what is there of others of its
        neurons."""
        network = self.network
        for number in [] if arrivals.kinds is None else np.unique(arrivals.kinds[arrivals.kinds >= 0]).tolist():
            undelayed = network.connections.delays[network.projections[number].members] == 0
            for name, end in self.sight.ends.read[number].items():
                places = end.places[undelayed] if end.past else end.places
                if not name.startswith("post") and np.isin(network.neuron_of[places], population.members).any():
                    return True
        return False

    def hold_ahead(self, number: int) -> None:
        """The states of a population that are held, before synapses read them."""
        use = self.network.populations[number].model
        if self.form.fixed and use.definition.flows:
            self.hold_all(self.network.populations[number], use)

    def hold_all(self, holder: Holder, use: Use) -> None:
        """The states of all members that are held, at what they are held at."""
        self.each(len(holder.members), _NO_ARRIVALS, lambda place, totals: self.hold_states(use, place))

    def each(
        self, count: int, arrivals: Mapping[int, Arrivals], body: Callable[[Place, Mapping[int, str]], None]
    ) -> None:
        """The body of each neuron of a population, by its place and what arrives at it, by the numbers of ports, where
        that is summed before: of the first port beside the neurons, of others in a loop of their own."""
        code = self.code
        if self.form.written_out:
            for place in range(count):
                with code.block(""):
                    body(place, _NO_TOTALS)
            return
        # formulas beside runs of many connections would take registers from these
        ahead = {one: own for one, own in arrivals.items() if own.dense or own.runs or own.lanes or own.rows}
        first = next(iter(ahead), None)
        beside = first is not None and ahead[first].lanes is not None
        summed = {one: own for one, own in ahead.items() if one != first or not beside}
        with self.holding_arrays() if summed else nullcontext():
            sums = {one: self.summed(own, count) for one, own in summed.items()}
            if first is not None and beside:
                lanes = ahead[first].lanes
                assert lanes is not None
                with ahead[first].beside(lanes) as (where, total):
                    body(where, {first: total, **{one: f"{name}[{where}]" for one, name in sums.items()}})
            else:
                with code.block(code.loop("p", count)):
                    body("p", {one: f"{name}[p]" for one, name in sums.items()})

    def summed(self, arrivals: Arrivals, count: int) -> str:
        """What arrives at a port of all neurons of a population, combined: the name of an array."""
        code, name = self.code, self.array(count)

        def combined(place: Place, totals: Mapping[int, str]) -> None:
            code.line(f"{name}[{place}] = {code.text(arrivals.combined(place))};")

        if arrivals.rows is not None:
            words = -(-len(arrivals.connections) // 64)  # of 64 bits each, whatever a number is
            room = words if self.code.real == "double" else 2 * words
            marks = "" if arrivals.in_order else self.array(room)
            self.firing.add_up(arrivals, arrivals.rows, name, marks)
        elif arrivals.dense:
            arrivals.matrix(name)
        elif arrivals.lanes is not None:
            with arrivals.beside(arrivals.lanes) as (where, total):
                code.line(f"{name}[{where}] = {total};")
        else:
            self.each(count, _NO_ARRIVALS, combined)
        return name

    @contextmanager
    def holding_arrays(self) -> Iterator[None]:
        """A block for lines that make arrays and read them: behind it their room is free."""
        taken = self._taken
        with self.code.block(""):
            yield
        self._taken = taken

    def array(self, count: int) -> str:
        """The name of a new array for what arrives at so many neurons."""
        code, name = self.code, self.code.name("u")
        if self.built.in_work:
            code.line(f"{code.real} *const {name} = fu + {self._taken};")
            self._taken += count
            self.room = max(self.room, self._taken)
        else:
            code.line(f"{code.real} {name}[{count}];")
        return name

    @contextmanager
    def unless_first(self) -> Iterator[None]:
        """Lines that are left out at the first step of a run."""
        if not self.form.first:
            yield
            return
        with self.code.block("if (!first)"):
            yield

    def neuron(self, number: int, place: Place, totals: Mapping[int, str] = _NO_TOTALS) -> None:
        """One neuron's step; ``totals`` are what arrives at its ports, by their numbers, where that was summed
        before."""
        population, code = self.network.populations[number], self.code
        neuron = code.at(population.members, place)
        initial = self.network.neurons.initial[population.members]
        given = ~np.isnan(initial)
        may_take = self.form.first and (given[place] if isinstance(place, int) else given.any())
        if may_take:
            value = code.text(code.number(initial, place))
            # in a loop, ``value == value`` leaves out NaN: neurons without an initial
            condition = "first" if isinstance(place, int) or given.all() else f"first && {value} == {value}"
            code.line(f"if ({condition}) {{")
            code.line(f"    activity[{neuron}] = {value};")
            code.line("} else {")
            code.indent += 1
        self.advance(number, place, neuron, self.at_ports(number, place, totals))
        if may_take:
            code.indent -= 1
            code.line("}")
        self.hold_activity(neuron)
        self.let_out(number, place, neuron)

    def jump_now(self, number: int) -> None:
        """The states of a population that jump by spikes of the same step, which ports hold alone."""
        population, code = self.network.populations[number], self.code
        made = _in_advance(population.model.definition, "jump_now")
        read = self._read_in(made)
        arrivals = {
            one: Arrivals(self.network, incoming, code, self.form, self.layout, self.forming)
            for one, incoming in enumerate(self.built.now[number])
            if incoming is not None and population.ports[one].name in read
        }

        def jumped(place: Place, totals: Mapping[int, str]) -> None:
            ports: dict[str, Value] = {port.name: 0.0 for port in population.ports}
            for one, own in arrivals.items():
                ports[population.ports[one].name] = code.let("u", totals.get(one) or own.combined(place))
            self.carry_out(number, place, made, ports)

        self.each(len(population.members), arrivals, jumped)

    def let_all_out(self) -> None:
        """What connections take beside activities, of all neurons."""
        for number in sorted({outlet.population for outlet in self.network.outlets}):
            members = self.network.populations[number].members
            with self.code.block(self.code.loop("p", len(members))):
                self.let_out(number, "p", self.code.at(members, "p"))

    def let_out(self, number: int, place: Place, neuron: Place) -> None:
        """What connections take of a neuron beside its activity; nothing of one that is lesioned."""
        stored = self.states(self.network.populations[number].model, place)
        for outlet in self.network.outlets:
            if outlet.population == number:
                self.put_out(outlet, place, neuron, stored[outlet.name])

    def put_out(self, outlet: Outlet, place: Place, neuron: Place, value: str) -> None:
        """A value is what connections take of a neuron; 0 where it is lesioned."""
        if self.form.held:
            value = f"lesioned[{neuron}] ? {self.code.text(0.0)} : {value}"
        self.code.line(f"outlets[{plus(outlet.start, place)}] = {value};")

    def put_activity(self, neuron: Place, value: Value) -> None:
        """A value is the activity of a neuron, unless that is held."""
        self.code.line(f"activity[{neuron}] = {self.code.text(value)};")
        self.hold_activity(neuron)

    def hold_activity(self, neuron: Place) -> None:
        """The activity of a neuron, if it is held, at what it is held at."""
        if self.form.held:
            self.code.line(f"if (held[{neuron}])")
            self.code.line(f"    activity[{neuron}] = holding[{neuron}];")

    def definitions(self, number: int) -> tuple[Definition, ...]:
        """What of the model of a population is carried out at its update, one behind the other; the last gives the
        activity and the outputs."""
        made = self.network.populations[number].model.definition
        return *(_in_advance(made, phase) for phase in self.phases[number]), made.at_update

    def _read_in(self, made: Definition) -> frozenset[str]:
        """The names that a part of a model reads when its neurons are updated, derivatives left out."""
        if made.gives and not (made.flows or made.fires):
            return made.read
        ends = [] if self.network.episode is None else [one.each_episode for one in made.lasting]
        readers = [*(one.each_step for one in (*made.lasting, *made.fleeting)), *ends]
        return unfolded(made.let, readers).names

    def at_ports(self, number: int, place: Place, totals: Mapping[int, str]) -> dict[str, Value]:
        """All ports of a neuron at u[t], by their names, as far as its update reads them."""
        read = self.read_at_update[number]
        return {
            port.name: self.at_port(number, one, place, totals.get(one, "")) if port.name in read else 0.0
            for one, port in enumerate(self.network.populations[number].ports)
        }

    def at_port(self, number: int, port_number: int, place: Place, total: str) -> Value:
        """A port at u[t]: what arrives, combined, + bias + input + noise."""
        code, population = self.code, self.network.populations[number]
        port = population.ports[port_number]
        value: Value = total or self.arrivals[number][port_number].combined(place)
        return code.let("u", self.with_own(population, port, place, value, self.step_value))

    def with_own(
        self,
        population: Population,
        port: Port,
        place: Place,
        total: Value,
        step_value: Callable[[IntArray, Place], str],
    ) -> Value:
        """What arrives at a port, + bias + input + noise; ``step_value`` gives the code of a number of the step."""
        code, members = self.code, population.members
        own = self.own[port.name]
        bias = code.settable(own.key, own.bias, members, place)
        value = total
        if isinstance(value, float) and isinstance(bias, float):
            value += bias
        elif isinstance(value, float) or port.combine == "product" or bias != 0.0:
            # a sum that begins with 0 is never −0, so adding 0 changes nothing; a product may be
            value = f"{code.text(value)} + {code.text(bias)}"
        for fed in (own.input, own.noise):
            value = self._plus_step_value(value, fed[members], place, step_value)
        return value

    def step_value(self, index_in_s: IntArray, place: Place) -> str:
        """A number of the vector of the step."""
        return f"s[{self.code.at(index_in_s, place)}]"

    def _plus_step_value(
        self, drive: Value, index_in_s: IntArray, place: Place, step_value: Callable[[IntArray, Place], str]
    ) -> Value:
        """A port, and the number of ``s`` that ``index_in_s`` points to, −1 for none."""
        code = self.code
        if isinstance(place, int):
            return f"{code.text(drive)} + {step_value(index_in_s, place)}" if index_in_s[place] >= 0 else drive
        if (index_in_s >= 0).all():
            return f"{code.text(drive)} + {step_value(index_in_s, place)}"
        if (index_in_s < 0).all():
            return drive
        name = code.variable("u", drive)
        code.line(f"if ({code.at(index_in_s, place)} >= 0)")
        code.line(f"    {name} += {step_value(index_in_s, place)};")
        return name

    def advance(self, number: int, place: Place, neuron: Place, ports: Mapping[str, Value]) -> None:
        """The states of a neuron from old ones and its ports, its activity and its outputs from the new ones; the
        episode's end. Those of a model with derivatives stay as they are at the first step."""
        self.hold_states(self.network.populations[number].model, place)
        given: dict[str, Value] = {}
        for part in self.definitions(number):
            given = self.carry_out(number, place, part, ports)
        self.put_given(number, place, neuron, given)

    def carry_out(self, number: int, place: Place, part: Definition, ports: Mapping[str, Value]) -> dict[str, Value]:
        """What a part of the model of a population makes of the states of a neuron, stored; and what it gives."""
        population = self.network.populations[number]
        model, stored = population.model, self.states(population.model, place)
        states = {one.name: stored[one.name] for one in part.state}
        seen: Mapping[str, Value] = {**self.code.parameters(model, place), **self.sight.clock(part), **ports}
        functions, kept = self.activation(population, place), partial(self.unless_held, model, place)
        new, given = self.change(part, seen, states, functions, kept, begins=self.form.first)
        self.store([(stored[name], value) for name, value in new.items()])
        return given

    def put_given(self, number: int, place: Place, neuron: Place, given: Mapping[str, Value]) -> None:
        """The outputs of a neuron and its activity."""
        model = self.network.populations[number].model
        stored = self.states(model, place)
        self.store([(stored[one.name], given[one.name]) for one in model.definition.outputs])
        self.store([(f"activity[{neuron}]", given["activity"])])

    def hold_states(self, use: Use, place: Place) -> None:
        """The states of one member that are held, at what they are held at."""
        stored = self.states(use, place)
        for one in use.definition.holdable:
            if at := self.held(use, one.name, place):
                self.code.line(f"if (held[{at}])")
                self.code.line(f"    {stored[one.name]} = holding[{at}];")

    def unless_held(self, use: Use, place: Place, name: str, value: Value) -> Value:
        """The new value of a state of one member, or what it is held at."""
        at = self.held(use, name, place)
        return self.code.let("n", f"held[{at}] ? holding[{at}] : {self.code.text(value)}") if at else value

    def held(self, use: Use, name: str, place: Place) -> str:
        """The code of where a state of one member stands among what can be held; "" where none is."""
        form, of_neurons = self.form, use.definition.kind.each == "neuron"
        is_held = form.fixed if of_neurons else form.fixed_joined
        start = self.network.state_places.get(Key(use.owner, name)) if is_held else None
        return "" if start is None else str(plus(start, place))

    def activation(self, population: Population, place: Place) -> dict[str, Made]:
        """The functions of the activation of a neuron, for formulas of its model."""
        code = self.code

        def called(x: Value, formula: Tree) -> Value:
            parameters = code.parameters(population.activation, place)
            seen = parameters | ({"x": code.let("x", x)} if "x" in names(formula) else {})
            return code.let("y", code.value(formula, seen))

        known = population.activation.definition.functions
        return {name: partial(called, formula=tree) for name, tree in known.items()}

    def states(self, use: Use, place: Place) -> dict[str, str]:
        """The states of a definition in use, and its outputs, of one member."""
        return self.sight.cells(use, place)

    def change(
        self,
        made: Definition,
        seen: Mapping[str, Value],
        stored: Mapping[str, Value],
        functions: Mapping[str, Made] = _NONE,
        bounded: Callable[[str, Value], Value] = lambda name, value: value,
        begins: bool = False,
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        """What becomes of all that lasts of a definition, which is ``stored`` there, from old values at once, and once
        more at an episode's end, ``bounded``; and what does not last, made from the new states. Nothing is stored
        yet. With ``begins`` there is a first step, at which what stays as it is does."""
        code = self.code
        steps = made.steps
        ends = {one.name: one.each_episode for one in made.lasting}
        fleeting = {one.name: one.each_step for one in made.fleeting}
        readers = [*steps.values(), *fleeting.values()]
        known = self.let(made.let, {**seen, **stored}, readers, functions)
        new = self.values(steps, known, "n", functions)
        new = {name: bounded(name, value) for name, value in new.items()}
        for name in new if begins else ():
            if name in made.staying:
                new[name] = code.let("n", f"first ? {code.text(stored[name])} : {code.text(new[name])}")
        given = self.values(fleeting, known | new, "y", functions)
        if self.network.episode is None or not any(tree is not None for tree in ends.values()):
            return new, given
        changed = {name for name in steps if steps[name] is not None or ends[name] is not None}
        needed = changed | unfolded(made.let, ends.values()).names
        if fleeting:  # all of them: so models have always been written
            changed = needed = set(stored)
        variables = {name: code.variable("e", new.get(name, cell)) for name, cell in stored.items() if name in needed}
        with code.block(f"if ({self.ends_episode()})"):
            within_end = self.let(made.let, {**seen, **variables}, list(ends.values()), functions)
            last = self.values(ends, within_end, "n", functions)
            self.store([(variables[name], value) for name, value in last.items()])
            for name in last:
                within = bounded(name, variables[name])
                if within != variables[name]:
                    self.store([(variables[name], within)])
        return {name: value for name, value in variables.items() if name in changed}, given

    def values(
        self,
        trees: Mapping[str, Tree | None],
        known: Mapping[str, Value],
        prefix: str,
        functions: Mapping[str, Made] = _NONE,
    ) -> dict[str, Value]:
        """What expressions give, those that there are."""
        code = self.code
        return {
            name: code.let(prefix, code.value(tree, known, functions))
            for name, tree in trees.items()
            if tree is not None
        }

    def ends_episode(self) -> str:
        """Whether (k + 1) mod m = 0."""
        self.code.head["ends"] = f"const int ends = (k + 1) % {self.network.episode} == 0;"
        return "ends"

    def let(
        self,
        let: tuple[tuple[str, Tree], ...],
        known: Mapping[str, Value],
        readers: Sequence[Tree | None],
        functions: Mapping[str, Made] = _NONE,
    ) -> dict[str, Value]:
        """The intermediate values that somebody reads, in order, beside the names known."""
        result = dict(known)
        for name, tree in unfolded(let, readers).let:
            result[name] = self.code.let("m", self.code.value(tree, result, functions))
        return result

    # ---- signals -----------------------------------------------------------------------------------------------

    def send(self) -> None:
        """w[t]·a[t] of every delayed connection leaves, or a[t] where it is shared; a[t] is remembered for ``pre``."""
        code = self.code
        which = ~self.fuses if self.form.fused else np.ones(len(self.fuses), dtype=np.bool_)
        for number in self.sent_with:
            which[self.network.projections[number].members] = False
        if not self.form.written_out:
            spikes = which & self.firing.own(self.layout)
            self.firing.leave(spikes, self.layout)
            which &= ~spikes
        self.leave(which)
        for slots in self.layout.shared:
            self.share(slots)
        for one in self.layout.rings:
            self.fill(one)
        if depth := self.sight.ends.depth:
            n, beside = len(self.network.neurons), self.network.outlet_count
            row = f"(size_t)(k % {depth})*{n + beside}"
            code.line(f"memcpy(history + {row}, activity, {n}*sizeof(activity[0]));")
            if beside:
                code.line(f"memcpy(history + {row} + {n}, outlets, {beside}*sizeof(outlets[0]));")

    def share(self, slots: SharedSlots) -> None:
        """What is sent to all connections that share it; of spikes where something fires, or did when that left which
        is there."""
        spikes = self.network.spikes[slots.sent]
        if self.form.written_out or not spikes.any():
            self.store_each(len(slots.sent), partial(self.sharing, slots))
            return
        code, places = self.code, slots.start + slots.length * np.arange(len(slots.sent))
        at = np.flatnonzero(spikes)
        rows = rows_of(slots.sent[at].astype(np.int64), np.full(len(at), slots.delay))
        with self.firing.now_or_then(rows) as now:
            code.line(f"signals[{code.at(places[at][rows.order], 'r')} + k % ago] = {now};")
        others = np.flatnonzero(~spikes)
        if not len(others):
            return
        self.store_each(len(others), lambda place: self.sharing(slots, place, others))

    def fill(self, slots: DelayClass | SharedSlots) -> None:
        """With a continuous delay what comes before the first step is what is sent there."""
        if slots.length != slots.delay and self.form.first:
            code, start = self.code, slots.start
            code.line("if (first)")
            code.line(f"    {code.loop('i', slots.stop, start)}")
            code.line(f"        signals[i] = signals[i - (i - {start}) % {slots.length}];")

    def leave(self, which: Mask) -> None:
        """The signals of some connections (m,) leave, as far as they have their own."""
        for delay_class in self.layout.classes:
            sent = which[delay_class.connections]
            if not sent.any():
                continue
            members = delay_class.connections[sent]
            self.store_each(len(members), partial(self.leaving, members))

    def leaving(self, members: Indices, place: Place) -> tuple[str, Value]:
        """The signal of one of some connections, all of one delay: its slot, and what leaves."""
        code, length = self.code, int(self.layout.lengths[members[0]])
        slot = code.at(self.layout.offsets[members], place)
        shift = "" if length == 1 else f" + {code.remainder(length)}"
        signal = f"weights[{code.at(members, place)}]*{taken(self.network, code, members, place)}"
        return f"signals[{slot}{shift}]", signal

    def sharing(self, slots: SharedSlots, place: Place, some: Indices | slice = slice(None)) -> tuple[str, Value]:
        """What is sent to all connections that share it, or to those that share ``some``: its slot, and what leaves."""
        code = self.code
        slot = code.at(np.arange(slots.start, slots.stop, slots.length)[some], place)
        shift = "" if slots.length == 1 else f" + {code.remainder(slots.length)}"
        return f"signals[{slot}{shift}]", taken_at(self.network, code, slots.sent[some], place)

    # ---- connections -------------------------------------------------------------------------------------------

    def receive(self, operation: Receive) -> None:
        """The states of synapses from old values; of connections that are left out they stay."""
        code, number = self.code, operation.projection
        projection = self.network.projections[number].during(operation.phases)
        made, members = projection.use.definition, projection.members
        if projection.slots is None:
            made = replace(made, gives=())
        changes = [tree for one in made.lasting for tree in (one.each_step, one.each_episode)]
        read = unfolded(made.let, changes).names
        self.hold_ahead(target_of(self.network, projection))

        def received(place: Place, totals: Mapping[int, str] = _NO_TOTALS) -> None:
            some = Some(number, np.arange(len(members)), place)
            left_out = ("cut", self.form.cut) if projection.slots is not None else ("gone", self.form.gone)
            conditions = [f"!{left_out[0]}[{code.at(members, place)}]"] if left_out[1] else []
            conditions += self.sight.comes(projection, some) if self.form.written_out else []  # a row knows of it
            with code.block(f"if ({' && '.join(conditions)})") if conditions else nullcontext():
                stored, seen = self.sight.states(some), self.sight.known(some, read)
                kept = partial(self.unless_held, projection.use, place)
                if projection.slots is not None:
                    receptor, slot = self.network.projections[projection.feeds].use, code.at(projection.slots, place)
                    of_receptor = self.states(receptor, slot)
                    stored |= {one.name: of_receptor[one.name] for one in made.gives}
                    kept = partial(self.unless_held, receptor, slot)
                new, _ = self.change(made, seen, stored, bounded=kept, begins=self.form.first)
                stores = [(stored[name], value) for name, value in new.items()]
                if self.form.watched and projection.when:
                    self.watch("odd", stores)
                self.store(stores)

        if projection.when and not self.form.written_out:
            with self.rows(projection, self.sight) as place:
                received(place)
        elif projection.when and projection.slots is not None:  # where the order counts, in that of the rows
            end, delays = self.sight.end_at(projection)
            for place in rows_of(end.places, delays).order.tolist():
                with code.block(""):
                    received(place)
        else:
            self.each(len(members), _NO_ARRIVALS, received)

    @contextmanager
    def rows(self, projection: Projection, sight: Sight) -> Iterator[Place]:
        """The body of a loop over the connections of a projection to which a spike has come, by ``when`` of it: source
        by source, or target by target."""
        code, members = self.code, projection.members
        end, delays = sight.end_at(projection)
        rows = rows_of(end.places, delays)
        with self.firing.before(rows, sight.sent or bool(delays.all())) as (ago, row, _):
            starts, order = code.tables.name(rows.starts), code.at(rows.order, "e")
            with code.block(code.loop("e", f"{starts}[{row} + 1]", f"{starts}[{row}]")):
                first, code.order = len(code.lines), rows.order
                if self.form.lost and ago:
                    code.line(f"if (k - {ago} < lost[{code.at(members, 'q')}])")
                    code.line("    continue;")
                yield "q"
                code.order = None
                if "q" in words_of(code.lines[first:]):  # not with one member alone
                    code.line(f"const int32_t q = {order};")
                    code.lines.insert(first, code.lines.pop())

    def signals(self) -> None:
        """The signal of each connection with a synapse as it is behind a step, into ``formed``; 0 of one that is left
        out."""
        code = self.code
        for number, projection in enumerate(self.network.projections):
            if projection.kind != SYNAPSE:
                continue
            if number in self.network.fed:
                self.shared_signals(number)
                continue
            members, forming = projection.members, Forming(self.behind, {number: signal_of(projection)})
            with code.block(code.loop("q", len(members))):
                connection = code.at(members, "q")
                value = code.text(forming.value(Some(number, np.arange(len(members)), "q"), {}))
                code.line(f"formed[{connection}] = gone[{connection}] ? {code.text(0.0)} : {value};")

    def shared_signals(self, number: int) -> None:
        """The same of a shared synapse: of each connection its share, by its weight over the weights of all of them at
        a target, which are added up where the first of these has its signal: it comes last."""
        code, projection, members = self.code, self.network.projections[number], self.network.fed[number]
        slots = self.network.synapses.positions[members]
        carriers, forming = projection.members[slots], Forming(self.behind, {number: signal_of(projection)})
        zero = code.text(0.0)
        with code.block(code.loop("q", len(projection.members))):
            code.line(f"formed[{code.at(projection.members, 'q')}] = {zero};")
        with code.block(code.loop("q", len(members))):
            connection = code.at(members, "q")
            code.line(f"formed[{code.at(carriers, 'q')}] += cut[{connection}] ? {zero} : weights[{connection}];")
        behind = members[::-1].copy()
        with code.block(code.loop("q", len(behind))):
            connection, total = code.at(behind, "q"), code.let("t", f"formed[{code.at(carriers[::-1].copy(), 'q')}]")
            value = code.text(forming.value(Some(number, slots[::-1].copy(), "q"), {}))
            left_out = f"cut[{connection}] || {total} == 0"
            code.line(f"formed[{connection}] = {left_out} ? {zero} : {value}*(weights[{connection}]/{total});")

    def softmax(self, number: int) -> None:
        """The shares of the groups of a population in 1, each of which lies in a row; those that begin with an
        ``initial`` are that at the first step."""
        population = self.network.populations[number]
        assert population.shares is not None
        for begin, end in pairwise(population.shares.tolist()):
            first, last = int(population.members[begin]), int(population.members[end - 1]) + 1
            begins = bool(np.isnan(self.network.neurons.initial[first]))
            with nullcontext() if begins else self.unless_first(), self.code.block(""):
                self._share(first, last)

    def _share(self, first: int, last: int) -> None:
        """The shares of the neurons from the first one on."""
        code, exp = self.code, f"exp{self.code.emitter.suffix}"
        free = "if (!held[q]) " if self.form.held else ""
        code.line(f"{code.real} greatest = -INFINITY, taken = 0, total = 0;")
        with code.block(code.loop("q", last, first)):
            if free:
                code.line("if (held[q]) taken += activity[q];")
            code.line(f"{'else ' if free else ''}if (activity[q] > greatest) greatest = activity[q];")
        with code.block(code.loop("q", last, first)), code.block(free.strip()):
            code.line(f"activity[q] = {exp}(activity[q] - greatest);")
            code.line("total += activity[q];")
        code.line(f"const {code.real} rest = taken < 1 ? 1 - taken : 0;")
        code.line(code.loop("q", last, first))
        code.line(f"    {free}activity[q] = activity[q]/total*rest;")

    def tie(self, operation: Tie) -> None:
        """The weights of tied connections, behind the rules of those that they are of."""
        code = self.code
        for place in range(len(operation.of)) if self.form.written_out else ():
            code.line(f"weights[{operation.connections[place]}] = weights[{operation.of[place]}];")
        if not self.form.written_out:
            code.line(code.loop("q", len(operation.of)))
            own, other = (code.at(one, "q") for one in (operation.connections, operation.of))
            code.line(f"    weights[{own}] = weights[{other}];")

    def learn(self, operation: Learn) -> None:
        """The rule of a projection: in a loop several connections side by side, then one by one those that are left.
        The sums ``o`` are put together behind the loop, so that no addition waits for the one before."""
        code, projection = self.code, self.network.projections[operation.projection].during(operation.phases)
        count = len(projection.members)
        if self.form.written_out:
            for place in range(count):
                with code.block(""):
                    self.connections(projection, [place])
            return
        if projection.when:
            with self.rows(projection, self.behind) as at:
                self.connections(projection, [at], ["odd"] if self.form.watched else [])
            return
        lanes = 1 if self.form.still else _RULES_SIDE_BY_SIDE
        in_lanes = count - count % lanes
        if lanes > 1 and in_lanes:
            sums = [code.variable("o", 0.0) for _ in range(lanes)] if self.form.watched else []
            with code.block(code.loop("q", in_lanes, step=lanes)):
                self.connections(projection, ["q", *(f"(q + {lane})" for lane in range(1, lanes))], sums)
            if sums:
                code.line(f"odd += {' + '.join(sums)};")
        if in_lanes < count or lanes == 1:
            with code.block(code.loop("q", count, 0 if lanes == 1 else in_lanes)):
                self.connections(projection, ["q"], ["odd"] if self.form.watched else [])

    def connections(self, projection: Projection, places: Sequence[Place], sums: Sequence[str] = ()) -> None:
        """The rule at some connections: all is read before anything is stored. To each of ``sums``, one a connection,
        what is stored adds 0, or NaN where it is not finite."""
        code, leaving = self.code, []
        if projection.use.owner.number in self.sent_with:
            leaving = [self.leaving(projection.members, place) for place in places]
            # what leaves is read before its weight learns
            leaving = [(slot, code.let("s", signal)) for slot, signal in leaving]
        if self.form.still:
            self.store(leaving)
        with self.where_carried_out(projection, places[0]):
            stores = [self.connection(projection, place) for place in places]
            for name, made in zip(sums, stores, strict=False):
                self.watch(name, made)
            if not self.form.still:
                self.store(leaving)
            for made in stores:
                self.store(made)

    def watch(self, name: str, made: Sequence[tuple[str, Value]]) -> None:
        """To the sum of this name what is to be stored adds 0, or NaN where it is not finite."""
        for _, value in made:
            if not isinstance(value, float):  # x − x is 0, or NaN where x is not finite
                self.code.line(f"{name} += {value} - {value};")

    def store_each(self, count: int, made: Callable[[Place], tuple[str, Value]]) -> None:
        """As many values, each in its cell."""
        if self.form.written_out:
            self.store([made(place) for place in range(count)])
        else:
            with self.code.block(self.code.loop("p", count)):
                self.store([made("p")])

    def store(self, made: Sequence[tuple[str, Value]]) -> None:
        """Values, each in its cell."""
        for cell, value in made:
            self.code.line(f"{cell} = {self.code.text(value)};")

    def connection(self, projection: Projection, place: Place) -> list[tuple[str, Value]]:
        """The weight and the states of one connection, at a step and, where it has one, at an episode's end: where
        each is stored, and what."""
        code, connection = self.code, self.code.at(projection.members, place)
        rule = projection.use
        seen = code.parameters(rule, place) | self.behind.clock(rule.definition) | self.seen(projection, place)
        stored = self.states(rule, place)
        if not rule.definition.moves_centre:
            stored["weight"] = f"weights[{connection}]"

        def bounded(name: str, value: Value) -> Value:
            if name == "weight":
                return self.bounded(projection, place, value)
            return self.unless_held(rule, place, name, value)

        new, _ = self.change(rule.definition, seen, stored, bounded=bounded, begins=self.form.first)
        return [(stored[name], value) for name, value in new.items()]

    @contextmanager
    def where_carried_out(self, projection: Projection, place: Place) -> Iterator[None]:
        """What is carried out of the rule of one connection, where it is; a loop over what has fired knows of that."""
        code = self.code
        conditions = [f"!still[{code.at(projection.members, place)}]"] if self.form.still else []
        if projection.when and isinstance(place, int):
            some = Some(projection.use.owner.number, np.arange(len(projection.members)), place)
            conditions += self.behind.comes(projection, some)
        if conditions and not isinstance(place, int):
            code.line(f"if ({conditions[0].removeprefix('!')})")
            code.line("    continue;")
            conditions = []
        with code.block(f"if ({' && '.join(conditions)})") if conditions else nullcontext():
            yield

    def bounded(self, projection: Projection, place: Place, weight: Value) -> Value:
        """A new weight within its bounds."""
        code, connections, members = self.code, self.network.connections, projection.members
        for function, array, values in (
            ("nv_max", LOW, connections.low.whole()),
            ("nv_min", HIGH, connections.high.whole()),
        ):
            own = values[members] if not isinstance(place, int) else values[members[place : place + 1]]
            if code.is_set(array) or np.isfinite(own).any():
                bound = code.text(code.settable(array, values, members, place))
                weight = f"{function}({code.text(weight)}, {bound})"
        return code.let("n", weight)

    def seen(self, projection: Projection, place: Place) -> dict[str, Value]:
        """What a rule reads besides its own, but in derivatives of its states: what there is at both ends, and the
        signals."""
        made = projection.use.definition
        some = Some(projection.use.owner.number, np.arange(len(projection.members)), place)
        ends = () if self.network.episode is None else (one.each_episode for one in made.lasting)
        return self.behind.at_ends(some, unfolded(made.let, [*made.steps.values(), *ends]).names)


def _in_advance(model: Definition, phase: Phase) -> Definition:
    """What of a model is carried out in a phase apart from its update: states alone, and, as of what fires, nothing at
    the first step."""
    return replace(model.during([phase]), gives=(), fires=True)


def _phases(network: Network, population: int) -> tuple[Phase, ...]:
    """What becomes of the states of a population before its update, behind what arrives."""
    ahead = (one for one in network.program if isinstance(one, Advance) and one.population == population)
    return tuple(one.phase for one in ahead if one.phase != "jump_now")


class _Own(NamedTuple):
    """What a port has beside what arrives, each (n,): its bias, and what that is called; where its input and its noise
    stand in the vector of the step, −1 for nowhere."""

    key: Key
    bias: FloatArray
    input: IntArray
    noise: IntArray


def _own(network: Network, port: str) -> _Own:
    neurons = network.neurons
    return _Own(bias_of(port), neurons.bias_at(port), neurons.input_at(port), network.noise_of(port))


def is_watched(definition: Definition, state: Quantity) -> bool:
    """Whether whatever changes a state of connections watches it, in a form that watches: all that rules do but to
    integrate, and of synapses what waits for spikes."""
    if state.derivative is not None:
        return False
    return definition.kind.lasting or (state.each_step is None and state.each_episode is None)


def begins_otherwise(network: Network) -> bool:
    """Whether the first step of a run is another one than all others: of neurons with ``initial``, or where anything
    flows."""
    flows = any(use.definition.flows or use.definition.staying for _, use in network.uses)
    flows |= any(isinstance(one, Advance) for one in network.program)
    return flows or bool((~np.isnan(network.neurons.initial)).any())


def _plain(population: Population) -> bool:
    """Whether nothing but ``drive`` is an input of its neurons, and nothing flows in them."""
    return len(population.ports) == 1 and not population.model.definition.flows


def _common_delay(delays: IntArray) -> int:
    """The delay that all of these connections have; 0 where they differ, and where there are none."""
    return int(delays[0]) if len(delays) and (delays == delays[0]).all() else 0


def write_input(code: Code, network: Network, entry: Input, vector: str, clock: Mapping[str, Value] = _NO_CLOCK) -> str:
    """An input that is an expression, by the parameters as they are by now, into its places of the ``vector`` of all
    inputs. Gives what its value is called; of one that is indexed that of number i. ``clock``: the time where it is not
    that of the step."""
    assert entry.expression is not None
    slots: dict[str, Value] = {name: f"parameters[{slot}]" for name, slot in entry.slots.items()}
    known = {**network.parameters, **slots, **clock}
    if entry.indexed:
        with code.block(code.loop("i", entry.size)):
            made = code.value(entry.expression, {**known, "i": f"({code.real})i", "n": float(entry.size)})
            code.line(f"{vector}[{entry.start} + i] = {code.text(made)};")
        return f"{vector}[{entry.start} + i]"
    value = code.variable("n", code.value(entry.expression, known))
    code.line(code.loop("i", entry.size))
    code.line(f"    {vector}[{entry.start} + i] = {value};")
    return value


@singledispatch
def write(operation: Operation, step: StepCode) -> None:
    """The lines of an operation of the program. Raises TypeError for one that is not registered."""
    raise TypeError(f"there is no C for {type(operation).__name__}")


@write.register(ReadInputs)
@write.register(Gather)
def _together(operation: ReadInputs | Gather, step: StepCode) -> None:
    """Nothing: ``s`` holds the inputs (``StepCode.read``), and what a population gathers is computed neuron by neuron,
    with its update or what comes of it now."""


@write.register
def _update(operation: Update, step: StepCode) -> None:
    step.population(operation.population)


@write.register
def _advance(operation: Advance, step: StepCode) -> None:
    """Jumps by spikes of the same step; all else is computed neuron by neuron, with the update."""
    if operation.phase == "jump_now":
        step.jump_now(operation.population)


@write.register
def _receive(operation: Receive, step: StepCode) -> None:
    step.receive(operation)


@write.register
def _send(operation: Send, step: StepCode) -> None:
    step.send()


@write.register
def _learn(operation: Learn, step: StepCode) -> None:
    step.learn(operation)


@write.register
def _tie(operation: Tie, step: StepCode) -> None:
    step.tie(operation)


@write.register
def _softmax(operation: Softmax, step: StepCode) -> None:
    step.softmax(operation.population)
