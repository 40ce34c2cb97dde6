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
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, singledispatch

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.events.settable import BIAS, HIGH, LOW
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.compiler.program import (
    Definition,
    Gather,
    Learn,
    Operation,
    Population,
    Projection,
    ReadInputs,
    Send,
    Update,
    Use,
)
from neurovis_spec.language.expressions.emit_c import Made, Value
from neurovis_spec.language.expressions.tree import Tree, names
from neurovis_spec.runtime.c_arrivals import Arrivals, Incoming
from neurovis_spec.runtime.c_code import Code, Form, Place, state_name
from neurovis_spec.runtime.presynaptic import history_depth
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.state import Mask

_NONE: Mapping[str, Made] = {}
#: connections whose rule is written side by side in a loop: a compiler makes vectors of them
_RULES_SIDE_BY_SIDE = 4


class StepCode:
    """Writes the body of a step; ``incoming`` is what arrives at each population, which all forms of a step share."""

    def __init__(self, network: Network, code: Code, form: Form, incoming: Sequence[Incoming]) -> None:
        self.network, self.code, self.form = network, code, form
        self.layout: SignalLayout = signal_layout(network)
        self.depth = history_depth(network)
        self.arrivals = [
            Arrivals(network, population, own, code, form, self.layout)
            for population, own in zip(network.populations, incoming, strict=True)
        ]
        #: connections that are fused, (m,)
        self.fuses = np.zeros(len(network.connections), dtype=np.bool_)
        #: how many weights are packed
        self.count = 0
        #: projections whose connections send while they learn, in one pass over their weights: those of one delay
        learn = (one.projection for one in network.program if isinstance(one, Learn) and not form.written_out)
        self.sent_with = frozenset(
            number
            for number in learn
            if _common_delay(network.connections.delays[network.projections[number].members]) > 0
        )
        for arrivals in self.arrivals:
            if arrivals.can_be_fused:
                self.fuses[arrivals.connections] = True
                arrivals.begin = self.count
                self.count += len(arrivals.packed)

    def pack(self) -> None:
        """The weights of fused populations in the order in which they are read, where they do not lie so."""
        code = self.code
        for arrivals in self.arrivals:
            if len(arrivals.packed):
                code.line(code.loop("e", len(arrivals.packed)))
                code.line(f"    packed[{arrivals.begin} + e] = weights[{code.at(arrivals.packed, 'e')}];")

    def read(self) -> None:
        """The inputs that are expressions, those that are asked for (``reads``), into ``s``; ``odd`` as of a step."""
        code, network = self.code, self.network
        expressions = [(number, one) for number, one in enumerate(network.inputs) if one.expression is not None]
        if expressions:
            code.line(f"{code.real} odd = {code.text(0.0)};")
        for number, entry in expressions:
            with code.block(f"if (reads[{number}])"):
                value = write_input(code, network, entry, "s")
                code.line(f"odd += {value} - {value};")

    def write(self) -> None:
        """All operations in order."""
        if self.form.watched:
            self.code.line(f"{self.code.real} odd = {self.code.text(0.0)};")
        for operation in self.network.program:
            write(operation, self)

    # ---- neurons -----------------------------------------------------------------------------------------------

    def population(self, number: int) -> None:
        """The neurons of a population."""
        population, code = self.network.populations[number], self.code
        arrivals = self.arrivals[number]
        if self.form.written_out:
            for place in range(len(population.members)):
                with code.block(""):
                    self.neuron(number, place, arrivals)
        elif arrivals.dense and self.reads_drive(population):
            with code.block(""):
                sums = arrivals.matrix()
                with code.block(code.loop("p", len(population.members))):
                    self.neuron(number, "p", arrivals, f"{sums}[p]")
        elif arrivals.lanes is not None and self.reads_drive(population):
            with arrivals.beside(arrivals.lanes) as (where, total):
                self.neuron(number, where, arrivals, total)
        else:
            with code.block(code.loop("p", len(population.members))):
                self.neuron(number, "p", arrivals)

    def neuron(self, number: int, place: Place, arrivals: Arrivals, total: str = "") -> None:
        """One neuron's step; ``total`` is what arrives at it, where that was summed before."""
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
        drive = self.drive(population, place, arrivals, total) if self.reads_drive(population) else 0.0
        self.advance(number, place, neuron, drive)
        if may_take:
            code.indent -= 1
            code.line("}")
        if self.form.held:
            code.line(f"if (held[{neuron}])")
            code.line(f"    activity[{neuron}] = holding[{neuron}];")

    def reads_drive(self, population: Population) -> bool:
        """Whether the model of a population takes what arrives."""
        return population.drive.name in population.model.definition.read

    def drive(self, population: Population, place: Place, arrivals: Arrivals, total: str) -> Value:
        """u[t]: what arrives, combined, + bias + input + noise."""
        code, network = self.code, self.network
        drive: Value = total or arrivals.combined(place)
        bias = code.settable(BIAS, network.neurons.bias, population.members, place)
        if isinstance(drive, float) and isinstance(bias, float):
            drive += bias
        elif isinstance(drive, float) or population.drive.combine == "product" or bias != 0.0:
            # a sum that begins with 0 is never −0, so adding 0 changes nothing; a product may be
            drive = f"{code.text(drive)} + {code.text(bias)}"
        for fed in (network.neurons.input[population.members], network.noise_index[population.members]):
            drive = self._plus_step_value(drive, fed, place)
        return code.let("u", drive)

    def _plus_step_value(self, drive: Value, index_in_s: IntArray, place: Place) -> Value:
        """The drive, and the number of ``s`` that ``index_in_s`` points to, −1 for none."""
        code = self.code
        if isinstance(place, int):
            return f"{code.text(drive)} + s[{int(index_in_s[place])}]" if index_in_s[place] >= 0 else drive
        if (index_in_s >= 0).all():
            return f"{code.text(drive)} + s[{code.at(index_in_s, place)}]"
        if (index_in_s < 0).all():
            return drive
        name, index = code.variable("u", drive), code.at(index_in_s, place)
        code.line(f"if ({index} >= 0)")
        code.line(f"    {name} += s[{index}];")
        return name

    def advance(self, number: int, place: Place, neuron: Place, drive: Value) -> None:
        """The states of a neuron from old ones and the drive, its activity from the new ones; the episode's end."""
        code, population = self.code, self.network.populations[number]

        def activation(x: Value, formula: Tree) -> Value:
            parameters = code.parameters(population.activation, place)
            known = parameters | ({"x": code.let("x", x)} if "x" in names(formula) else {})
            return code.let("y", code.value(formula, known))

        functions = {
            name: partial(activation, formula=tree) for name, tree in population.activation.definition.functions.items()
        }
        seen = code.parameters(population.model, place) | {population.drive.name: drive}
        stored = self.states(population.model, place)
        new, given = self.change(population.model.definition, seen, stored, functions)
        self.store([(stored[name], value) for name, value in new.items()])
        self.store([(f"activity[{neuron}]", given["activity"])])

    def states(self, use: Use, place: Place) -> dict[str, str]:
        """The states of a definition in use, of one member."""
        return {one.name: f"{state_name(use.owner, i)}[{place}]" for i, one in enumerate(use.definition.state)}

    def change(
        self,
        made: Definition,
        seen: Mapping[str, Value],
        stored: Mapping[str, str],
        functions: Mapping[str, Made] = _NONE,
        bounded: Callable[[str, Value], Value] = lambda name, value: value,
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        """What becomes of all that lasts of a definition, which is ``stored`` there, from old values at once, and once
        more at an episode's end, ``bounded``; and what does not last, made from the new states. Nothing is stored
        yet."""
        code = self.code
        steps = {one.name: one.each_step for one in made.lasting}
        ends = {one.name: one.each_episode for one in made.lasting}
        fleeting = {one.name: one.each_step for one in made.fleeting}
        known = self.let(made.let, {**seen, **stored}, [*steps.values(), *fleeting.values()])
        new = self.values(steps, known, "n", functions)
        new = {name: bounded(name, value) for name, value in new.items()}
        given = self.values(fleeting, known | new, "y", functions)
        if self.network.episode is None or not any(tree is not None for tree in ends.values()):
            return new, given
        changed = {name for name in steps if steps[name] is not None or ends[name] is not None}
        needed = changed | read_through(made.let, list(ends.values()))
        if fleeting:  # all of them: so models have always been written
            changed = needed = set(stored)
        variables = {name: code.variable("e", new.get(name, cell)) for name, cell in stored.items() if name in needed}
        with code.block(f"if ({self.ends_episode()})"):
            last = self.values(ends, self.let(made.let, {**seen, **variables}, list(ends.values())), "n")
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
        self, let: tuple[tuple[str, Tree], ...], known: Mapping[str, Value], readers: list[Tree | None]
    ) -> dict[str, Value]:
        """The intermediate values that somebody reads, in order, beside the names known."""
        wanted = read_through(let, readers)
        result = dict(known)
        for name, tree in let:
            if name in wanted:
                result[name] = self.code.let("m", self.code.value(tree, result))
        return result

    # ---- signals -----------------------------------------------------------------------------------------------

    def send(self) -> None:
        """w[t]·a[t] of every delayed connection leaves; a[t] is remembered for ``pre``."""
        code = self.code
        which = ~self.fuses if self.form.fused else np.ones(len(self.fuses), dtype=np.bool_)
        for number in self.sent_with:
            which[self.network.projections[number].members] = False
        self.leave(which)
        if self.depth:
            n = len(self.network.neurons)
            row = f"(size_t)(k % {self.depth})*{n}"
            code.line(f"memcpy(history + {row}, activity, {n}*sizeof(activity[0]));")

    def leave(self, which: Mask) -> None:
        """The signals of some connections (m,) leave."""
        code = self.code
        for delay_class in self.layout.classes:
            sent = which[delay_class.connections]
            if not sent.any():
                continue
            members = delay_class.connections[sent]
            if self.form.written_out:
                self.store([self.leaving(members, place) for place in range(len(members))])
            else:
                with code.block(code.loop("p", len(members))):
                    self.store([self.leaving(members, "p")])

    def leaving(self, members: Indices, place: Place) -> tuple[str, Value]:
        """The signal of one of some connections, all of one delay: its slot, and what leaves."""
        code, connections = self.code, self.network.connections
        delay = int(connections.delays[members[0]])
        slot, source = code.at(self.layout.offsets[members], place), code.at(connections.sources.some(members), place)
        shift = "" if delay == 1 else f" + {code.remainder(delay)}"
        return f"signals[{slot}{shift}]", f"weights[{code.at(members, place)}]*activity[{source}]"

    # ---- connections -------------------------------------------------------------------------------------------

    def learn(self, number: int) -> None:
        """The rule of a projection: in a loop several connections side by side, then one by one those that are left.
        The sums ``o`` are put together behind the loop, so that no addition waits for the one before."""
        code, count = self.code, len(self.network.projections[number].members)
        if self.form.written_out:
            for place in range(count):
                with code.block(""):
                    self.connections(number, [place])
            return
        lanes = 1 if self.form.still else _RULES_SIDE_BY_SIDE
        in_lanes = count - count % lanes
        if lanes > 1 and in_lanes:
            sums = [code.variable("o", 0.0) for _ in range(lanes)] if self.form.watched else []
            with code.block(code.loop("q", in_lanes, step=lanes)):
                self.connections(number, ["q", *(f"(q + {lane})" for lane in range(1, lanes))], sums)
            if sums:
                code.line(f"odd += {' + '.join(sums)};")
        if in_lanes < count or lanes == 1:
            with code.block(code.loop("q", count, 0 if lanes == 1 else in_lanes)):
                self.connections(number, ["q"], ["odd"] if self.form.watched else [])

    def connections(self, number: int, places: Sequence[Place], sums: Sequence[str] = ()) -> None:
        """The rule at some connections: all is read before anything is stored. To each of ``sums``, one a connection,
        what is stored adds 0, or NaN where it is not finite."""
        code, leaving = self.code, []
        if number in self.sent_with:
            leaving = [self.leaving(self.network.projections[number].members, place) for place in places]
            # what leaves is read before its weight learns
            leaving = [(slot, code.let("s", signal)) for slot, signal in leaving]
        if self.form.still:
            self.store(leaving)
        stores = [self.connection(number, place) for place in places]
        for name, made in zip(sums, stores, strict=False):
            for _, value in made:
                if not isinstance(value, float):  # x − x is 0, or NaN where x is not finite
                    code.line(f"{name} += {value} - {value};")
        if not self.form.still:
            self.store(leaving)
        for made in stores:
            self.store(made)
        if self.form.still and isinstance(places[0], int):
            code.indent -= 1
            code.line("}")

    def store(self, made: Sequence[tuple[str, Value]]) -> None:
        """Values, each in its cell."""
        for cell, value in made:
            self.code.line(f"{cell} = {self.code.text(value)};")

    def connection(self, number: int, place: Place) -> list[tuple[str, Value]]:
        """The weight and the states of one connection, at a step and, where it has one, at an episode's end: where
        each is stored, and what."""
        code, projection = self.code, self.network.projections[number]
        connection = code.at(projection.members, place)
        if self.form.still:
            if isinstance(place, int):
                code.line(f"if (!still[{connection}]) {{")
                code.indent += 1
            else:
                code.line(f"if (still[{connection}])")
                code.line("    continue;")
        seen = code.parameters(projection.rule, place) | self.seen(projection, place)
        stored = {**self.states(projection.rule, place), "weight": f"weights[{connection}]"}

        def bounded(name: str, value: Value) -> Value:
            return self.bounded(projection, place, value) if name == "weight" else value

        new, _ = self.change(projection.rule.definition, seen, stored, bounded=bounded)
        return [(stored[name], value) for name, value in new.items()]

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
        """What a rule may read besides its own: pre, sent, post, the signals."""
        code, connections, members = self.code, self.network.connections, projection.members
        sources, targets = connections.sources[members], connections.targets[members]
        source, read = code.at(sources, place), projection.read
        seen: dict[str, Value] = {
            "sent": f"activity[{source}]",
            "post": f"activity[{code.at(targets, place)}]",
            "pre": f"activity[{source}]",
        }
        if self.depth and "pre" in read:
            seen["pre"] = self.remembered(projection, source, place)
        for name, indices in projection.signals.items():
            seen[name] = self.signal(indices, place)
        return {name: value for name, value in seen.items() if name in read}

    def remembered(self, projection: Projection, source: Place, place: Place) -> Value:
        """a_j[t−d], 0 where what was sent then is lost."""
        code, delays = self.code, self.network.connections.delays[projection.members]
        own = delays if not isinstance(place, int) else delays[place : place + 1]
        if not own.any():
            return f"activity[{source}]"
        past = self.past(delays, own, source, place)
        if not self.form.lost:
            return past
        lost = f"lost[{code.at(projection.members, place)}]"
        return code.let("a", f"k - ({code.at(delays, place)}) < {lost} ? {code.text(0.0)} : {past}")

    def past(self, delays: IntArray, own: IntArray, source: Place, place: Place) -> str:
        """a_j[t−d], from the history."""
        code, n = self.code, len(self.network.neurons)
        if (own == own[0]).all():
            name, row = f"h{own[0]}", f"(size_t)((k + {self.depth - own[0]}) % {self.depth})*{n}"
            code.head[name] = f"const {code.real} *const {name} = history + {row};"
            return f"{name}[{source}]"
        code.head["now"] = f"const int32_t now = (int32_t)(k % {self.depth});"
        row = f"(now + {self.depth} - ({code.at(delays, place)})) % {self.depth}"
        return f"history[(size_t)({row})*{n} + {source}]"

    def signal(self, indices: IntArray, place: Place) -> str:
        """A signal of a rule: an activity or an input."""
        code, n = self.code, len(self.network.neurons)
        own = indices if not isinstance(place, int) else indices[place : place + 1]
        if (own < n).all():
            return f"activity[{code.at(indices, place)}]"
        if (own >= n).all():
            return f"s[{code.at(indices - n, place)}]"
        index = code.at(indices, place)
        return f"({index} < {n} ? activity[{index}] : s[{index} - {n}])"


def _common_delay(delays: IntArray) -> int:
    """The delay that all of these connections have; 0 where they differ, and where there are none."""
    return int(delays[0]) if len(delays) and (delays == delays[0]).all() else 0


def read_through(let: tuple[tuple[str, Tree], ...], readers: list[Tree | None]) -> set[str]:
    """The names that expressions read, by themselves or through intermediate values."""
    wanted: set[str] = set().union(*(names(tree) for tree in readers if tree is not None))
    for name, tree in reversed(let):
        if name in wanted:
            wanted |= names(tree)
    return wanted


def write_input(code: Code, network: Network, entry: Input, vector: str) -> str:
    """An input that is an expression, by the parameters as they are by now, into its places of the ``vector`` of all
    inputs. Gives the identifier of its value."""
    assert entry.expression is not None
    slots: dict[str, Value] = {name: f"parameters[{slot}]" for name, slot in entry.slots.items()}
    value = code.variable("n", code.value(entry.expression, {**network.parameters, **slots}))
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
    with its update."""


@write.register
def _update(operation: Update, step: StepCode) -> None:
    step.population(operation.population)


@write.register
def _send(operation: Send, step: StepCode) -> None:
    step.send()


@write.register
def _learn(operation: Learn, step: StepCode) -> None:
    step.learn(operation.projection)
