"""A step of a network as C: the operations of the program, for one neuron or one connection after the other.

In: a Network. Out: the lines of a function's body, over the arrays of a State by the names ``activity``, ``weights``,
``signals``, ``history``, ``cells…``, ``traces…``, the numbers that can be set as ``x``, the vector of the step as
``s`` and the step ``k``. Sums go in the order of the connections. A small network is written out neuron by neuron;
of a larger one, each block is a loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Block, Gather, Learn, Plasticity, ReadInputs, Send, Update
from neurovis_spec.language.expressions.emit_c import Value
from neurovis_spec.language.expressions.tree import Tree, names
from neurovis_spec.runtime.c_code import Code, Place
from neurovis_spec.runtime.conditions import Mask
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.state import history_depth, rule_names

#: connections of a neuron that are written out one after the other
_FEW = 16
#: neurons of a dense block whose sums are kept beside each other
_BESIDE = 4096
#: neurons of any other block whose sums go on beside each other: an addition need not wait for the one before
_LANES = 8
#: connections that learn beside each other: a compiler makes vectors of them
_RULES = 4


@dataclass(frozen=True, slots=True)
class Form:
    """What a step looks after. ``written_out``: neuron by neuron, without loops. ``first``: neurons with ``initial``
    take it at step 0 (``first`` is not 0). ``held``: neurons whose byte of ``held`` is set have the activity
    ``holding``. ``gone`` and ``still``: connections whose byte is set are left out, do not learn. ``fused``: what
    arrives after one step along weights that stay is formed where it arrives, from the activities ``before`` and the
    weights ``packed`` in that order; it is not sent. ``watched``: what loops over connections store is checked:
    the number ``odd`` is NaN after the step where some of it is not finite, else 0."""

    written_out: bool = False
    first: bool = False
    held: bool = False
    gone: bool = False
    still: bool = False
    fused: bool = False
    watched: bool = False


class StepCode:
    """Writes the body of a step."""

    def __init__(self, network: Network, code: Code, form: Form) -> None:
        self.network, self.code, self.form = network, code, form
        self.layout: SignalLayout = signal_layout(network)
        self.depth = history_depth(network)
        #: where the weights of each fused block begin among those packed
        self.packed: dict[int, int] = {}
        #: connections that are fused, (m,)
        self.fuses = np.zeros(len(network.connections), dtype=np.bool_)
        self.count = 0
        #: plasticities whose connections send while they learn, in one pass over their weights: those of one delay
        self.sent_with = frozenset(
            number
            for number, plasticity in enumerate(network.plasticity)
            if not form.written_out and _alike(network.connections.delays[plasticity.members]) > 0
        )
        for number, block in enumerate(network.blocks):
            delays, rules = network.connections.delays[block.incoming], network.connections.rules[block.incoming]
            if len(delays) and (delays == 1).all() and (rules < 0).all():
                self.packed[number] = self.count
                self.fuses[block.incoming] = True
                self.count += len(block.incoming)

    def pack(self) -> None:
        """The weights of fused blocks in the order in which they are read."""
        code = self.code
        for number, begin in self.packed.items():
            arrivals = _Arrivals(self, number)
            code.line(code.loop("e", len(arrivals.connections)))
            code.line(f"    packed[{begin} + e] = weights[{code.at(arrivals.connections, 'e')}];")

    def write(self) -> None:
        """All operations in order. What a block gathers is computed neuron by neuron, together with its update."""
        if self.form.watched:
            self.code.line(f"{self.code.real} odd = {self.code.text(0.0)};")
        for operation in self.network.program:
            match operation:
                case ReadInputs() | Gather():
                    pass
                case Update(block=number):
                    self.block(number)
                case Send():
                    self.send()
                case Learn(plasticity=number):
                    self.learn(number)

    # ---- neurons -----------------------------------------------------------------------------------------------

    def block(self, number: int) -> None:
        """The neurons of a block."""
        block, code = self.network.blocks[number], self.code
        arrivals = _Arrivals(self, number)
        if self.form.written_out:
            for place in range(len(block.members)):
                with code.block(""):
                    self.neuron(number, place, arrivals)
        elif arrivals.dense and self.reads_drive(block):
            with code.block(""):
                sums = arrivals.matrix()
                with code.block(code.loop("p", len(block.members))):
                    self.neuron(number, "p", arrivals, f"{sums}[p]")
        elif arrivals.lanes is not None and self.reads_drive(block):
            with arrivals.beside(arrivals.lanes) as (where, total):
                self.neuron(number, where, arrivals, total)
        else:
            with code.block(code.loop("p", len(block.members))):
                self.neuron(number, "p", arrivals)

    def neuron(self, number: int, place: Place, arrivals: _Arrivals, total: str = "") -> None:
        """One neuron's step."""
        block, code = self.network.blocks[number], self.code
        neuron = code.at(block.members, place)
        initial = self.network.neurons.initial[block.members]
        given = ~np.isnan(initial)
        taken = self.form.first and (given[place] if isinstance(place, int) else given.any())
        if taken:
            value = code.text(code.number(initial, place))
            condition = "first" if isinstance(place, int) or given.all() else f"first && {value} == {value}"
            code.line(f"if ({condition}) {{")
            code.line(f"    activity[{neuron}] = {value};")
            code.line("} else {")
            code.indent += 1
        drive = self.drive(block, place, arrivals, total) if self.reads_drive(block) else 0.0
        self.advance(number, place, neuron, drive)
        if taken:
            code.indent -= 1
            code.line("}")
        if self.form.held:
            code.line(f"if (held[{neuron}])")
            code.line(f"    activity[{neuron}] = holding[{neuron}];")

    def reads_drive(self, block: Block) -> bool:
        """Whether the model of a block takes what arrives."""
        model = block.model
        trees = [model.activity, *(tree for _, tree in model.let)]
        trees += [tree for q in model.state for tree in (q.each_step, q.each_episode) if tree is not None]
        return any("drive" in names(tree) for tree in trees)

    def drive(self, block: Block, place: Place, arrivals: _Arrivals, total: str) -> Value:
        """u[t]: what arrives, combined, + bias + input + noise."""
        code, network = self.code, self.network
        drive: Value = total or arrivals.combined(place)
        bias = code.settable("bias", network.neurons.bias, block.members, place)
        if isinstance(drive, float) and isinstance(bias, float):
            drive += bias
        elif isinstance(drive, float) or block.combine == "product" or bias != 0.0:
            # a sum that begins with 0 is never −0, so adding 0 changes nothing; a product may be
            drive = f"{code.text(drive)} + {code.text(bias)}"
        for fed in (network.neurons.input[block.members], network.noise_index[block.members]):
            drive = self._fed(drive, fed, place)
        return code.let("u", drive)

    def _fed(self, drive: Value, fed: IntArray, place: Place) -> Value:
        code = self.code
        if isinstance(place, int):
            return f"{code.text(drive)} + s[{int(fed[place])}]" if fed[place] >= 0 else drive
        if (fed >= 0).all():
            return f"{code.text(drive)} + s[{code.at(fed, place)}]"
        if (fed < 0).all():
            return drive
        name, index = code.variable("u", drive), code.at(fed, place)
        code.line(f"if ({index} >= 0)")
        code.line(f"    {name} += s[{index}];")
        return name

    def advance(self, number: int, place: Place, neuron: Place, drive: Value) -> None:
        """The states of a neuron from old ones and the drive, its activity from the new ones; the episode's end."""
        code, block = self.code, self.network.blocks[number]
        model = block.model
        own = code.parameters(f"model/{number}", block.model_parameters, place) | {"drive": drive}
        cells = {q.name: f"cells{number}_{i}[{place}]" for i, q in enumerate(model.state)}
        steps = {q.name: q.each_step for q in model.state}
        known = self.let(model.let, own | cells, [*steps.values(), model.activity])
        new: dict[str, Value] = {
            name: code.let("n", code.value(tree, known)) for name, tree in steps.items() if tree is not None
        }

        def activation(x: Value) -> Value:
            parameters = code.parameters(f"activation/{number}", block.activation_parameters, place)
            value = block.activation.value
            known = parameters | ({"x": code.let("x", x)} if "x" in names(value) else {})
            return code.let("y", code.value(value, known))

        activity = code.let("y", code.value(model.activity, known | new, {"f": activation}))
        ends = {q.name: q.each_episode for q in model.state}
        if self.network.episode is not None and any(tree is not None for tree in ends.values()):
            new = {name: code.variable("e", new.get(name, cell)) for name, cell in cells.items()}
            with code.block(f"if ({self.ends_episode()})"):
                self.replace(new, self.let(model.let, own | new, list(ends.values())), ends)
        for name, value in new.items():
            code.line(f"{cells[name]} = {code.text(value)};")
        code.line(f"activity[{neuron}] = {code.text(activity)};")

    def ends_episode(self) -> str:
        """Whether (k + 1) mod m = 0."""
        self.code.head["ends"] = f"const int ends = (k + 1) % {self.network.episode} == 0;"
        return "ends"

    def replace(
        self, variables: Mapping[str, Value], known: Mapping[str, Value], trees: Mapping[str, Tree | None]
    ) -> None:
        """All right-hand sides, then all variables."""
        code = self.code
        made = {name: code.let("n", code.value(tree, known)) for name, tree in trees.items() if tree is not None}
        for name, value in made.items():
            code.line(f"{variables[name]} = {code.text(value)};")

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
            which[self.network.plasticity[number].members] = False
        self.leave(which)
        if self.depth:
            n = len(self.network.neurons)
            row = f"(size_t)(k % {self.depth})*{n}"
            code.line(f"memcpy(history + {row}, activity, {n}*sizeof(activity[0]));")

    def leave(self, which: Mask) -> None:
        """The signals of some connections (m,) leave."""
        code = self.code
        for kind in self.layout.classes:
            sent = which[kind.connections]
            if not sent.any():
                continue
            members = kind.connections[sent]
            if self.form.written_out:
                self.store([self.leaving(members, place) for place in range(len(members))])
            else:
                with code.block(code.loop("p", len(members))):
                    self.store([self.leaving(members, "p")])

    def leaving(self, members: IntArray, place: Place) -> tuple[str, Value]:
        """The signal of one of some connections, all of one delay: its slot, and what leaves."""
        code, connections = self.code, self.network.connections
        delay = int(connections.delays[members[0]])
        slot, source = code.at(self.layout.offsets[members], place), code.at(connections.sources[members], place)
        shift = "" if delay == 1 else f" + {code.remainder(delay)}"
        return f"signals[{slot}{shift}]", f"weights[{code.at(members, place)}]*activity[{source}]"

    # ---- connections -------------------------------------------------------------------------------------------

    def learn(self, number: int) -> None:
        """The rule of a plasticity."""
        code, count = self.code, len(self.network.plasticity[number].members)
        if self.form.written_out:
            for place in range(count):
                with code.block(""):
                    self.connections(number, [place])
            return
        lanes = 1 if self.form.still else _RULES
        beside = count - count % lanes
        if lanes > 1 and beside:
            sums = [code.variable("o", 0.0) for _ in range(lanes)] if self.form.watched else []
            with code.block(code.loop("q", beside, step=lanes)):
                self.connections(number, ["q", *(f"(q + {lane})" for lane in range(1, lanes))], sums)
            if sums:
                code.line(f"odd += {' + '.join(sums)};")
        if beside < count or lanes == 1:
            with code.block(code.loop("q", count, 0 if lanes == 1 else beside)):
                self.connections(number, ["q"], ["odd"] if self.form.watched else [])

    def connections(self, number: int, places: Sequence[Place], sums: Sequence[str] = ()) -> None:
        """The rule at some connections: all is read before anything is stored. To each of ``sums``, one a connection,
        what is stored adds 0, or NaN where it is not finite."""
        code, leaving = self.code, []
        if number in self.sent_with:
            leaving = [self.leaving(self.network.plasticity[number].members, place) for place in places]
            leaving = [(slot, code.let("s", signal)) for slot, signal in leaving]
        if self.form.still:
            self.store(leaving)
        stores = [self.connection(number, place) for place in places]
        for name, made in zip(sums, stores, strict=False):
            for _, value in made:
                if not isinstance(value, float):
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
        code, plasticity = self.code, self.network.plasticity[number]
        rule, connection = plasticity.rule, code.at(plasticity.members, place)
        if self.form.still:
            if isinstance(place, int):
                code.line(f"if (!still[{connection}]) {{")
                code.indent += 1
            else:
                code.line(f"if (still[{connection}])")
                code.line("    continue;")
        own = code.parameters(f"rule/{number}", plasticity.parameters, place) | self.seen(plasticity, place)
        stored = {q.name: f"traces{number}_{i}[{place}]" for i, q in enumerate(rule.state)}
        stored["weight"] = f"weights[{connection}]"
        steps = {q.name: q.each_step for q in rule.state} | {"weight": rule.each_step}
        ends = {q.name: q.each_episode for q in rule.state} | {"weight": rule.each_episode}
        known = self.let(rule.let, own | stored, list(steps.values()))
        new = {name: code.let("n", code.value(tree, known)) for name, tree in steps.items() if tree is not None}
        if "weight" in new:
            new["weight"] = self.bounded(plasticity, place, new["weight"])
        if self.network.episode is not None and any(tree is not None for tree in ends.values()):
            changed = {name for name in steps if steps[name] is not None or ends[name] is not None}
            needed = changed | read_through(rule.let, list(ends.values()))
            new = {name: code.variable("e", new.get(name, cell)) for name, cell in stored.items() if name in needed}
            with code.block(f"if ({self.ends_episode()})"):
                self.replace(new, self.let(rule.let, own | new, list(ends.values())), ends)
                if rule.each_episode is not None:
                    code.line(f"{new['weight']} = {code.text(self.bounded(plasticity, place, new['weight']))};")
            new = {name: value for name, value in new.items() if name in changed}
        return [(stored[name], value) for name, value in new.items()]

    def bounded(self, plasticity: Plasticity, place: Place, weight: Value) -> Value:
        """A new weight within its bounds."""
        code, connections, members = self.code, self.network.connections, plasticity.members
        for function, array, values in (("nv_max", "low", connections.low), ("nv_min", "high", connections.high)):
            own = values[members] if not isinstance(place, int) else values[members[place : place + 1]]
            if code.is_set(array) or np.isfinite(own).any():
                bound = code.text(code.settable(array, values, members, place))
                weight = f"{function}({code.text(weight)}, {bound})"
        return code.let("n", weight)

    def seen(self, plasticity: Plasticity, place: Place) -> dict[str, Value]:
        """What a rule may read besides its own: pre, sent, post, the signals."""
        code, connections, members = self.code, self.network.connections, plasticity.members
        sources, targets = connections.sources[members], connections.targets[members]
        source = code.at(sources, place)
        seen: dict[str, Value] = {
            "sent": f"activity[{source}]",
            "post": f"activity[{code.at(targets, place)}]",
            "pre": f"activity[{source}]",
        }
        if self.depth:
            seen["pre"] = self.remembered(connections.delays[members], source, place)
        for name, indices in plasticity.signals.items():
            seen[name] = self.signal(indices, place)
        return {name: value for name, value in seen.items() if name in rule_names(plasticity.rule)}

    def remembered(self, delays: IntArray, source: Place, place: Place) -> str:
        """a_j[t−d]."""
        code, n = self.code, len(self.network.neurons)
        own = delays if not isinstance(place, int) else delays[place : place + 1]
        if not own.any():
            return f"activity[{source}]"
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


def _alike(delays: IntArray) -> int:
    """The delay of all of some connections, 0 where they differ."""
    return int(delays[0]) if len(delays) and (delays == delays[0]).all() else 0


def read_through(let: tuple[tuple[str, Tree], ...], readers: list[Tree | None]) -> set[str]:
    """The names that expressions read, by themselves or through intermediate values."""
    wanted: set[str] = set().union(*(names(tree) for tree in readers if tree is not None))
    for name, tree in reversed(let):
        if name in wanted:
            wanted |= names(tree)
    return wanted


@dataclass(frozen=True, slots=True)
class _Lanes:
    """How the sums of some neurons go on beside each other. ``neurons``: places in the block, those of like many
    connections beside each other, eight to a group. First come the connections that all of a group have (those of
    group g from ``begins[g]`` on, the first of each neuron, then the second of each, …), then the others, neuron by
    neuron (those of the i-th from ``rests[i]`` on)."""

    neurons: IntArray
    begins: IntArray
    rests: IntArray


def _in_lanes(ends: IntArray) -> tuple[_Lanes, IntArray]:
    """Neurons whose connections lie neuron by neuron, those of the i-th up to ``ends[i + 1]``; and the order in which
    the connections are read then."""
    degrees = np.diff(ends)
    neurons = np.argsort(degrees, kind="stable").astype(np.int64)
    count = len(neurons) - len(neurons) % _LANES
    # neurons have ever more connections: of a group the first has the fewest
    shared = np.zeros(len(neurons), dtype=np.int64)
    shared[:count] = np.repeat(degrees[neurons[:count:_LANES]], _LANES)
    begins = np.zeros(-(-len(neurons) // _LANES) + 1, dtype=np.int64)
    begins[1:] = np.cumsum(np.add.reduceat(shared, np.arange(0, len(neurons), _LANES)))
    rests = begins[-1] + np.concatenate(([0], np.cumsum(degrees[neurons] - shared)))
    lane = np.arange(len(neurons))
    owner = np.repeat(lane, degrees[neurons])
    nth = np.arange(len(owner)) - np.repeat(np.cumsum(degrees[neurons]) - degrees[neurons], degrees[neurons])
    beside = begins[owner // _LANES] + nth * _LANES + owner % _LANES
    places = np.where(nth < shared[owner], beside, rests[owner] + nth - shared[owner])
    order = np.empty(len(owner), dtype=np.int64)
    order[places] = ends[neurons[owner]] + nth
    return _Lanes(neurons, begins, rests.astype(np.int64)), order


class _Arrivals:
    """What arrives at the neurons of a block: their connections, in the order in which they are read: neuron by neuron,
    or as ``lanes`` says. What arrives at one neuron is put together in the order of its connections."""

    def __init__(self, step: StepCode, number: int) -> None:
        block = step.network.blocks[number]
        self.step, self.block, self.code = step, block, step.code
        #: where the weights begin among those packed, None where signals are read
        self.packed = step.packed.get(number) if step.form.fused else None
        order = np.argsort(block.slots, kind="stable")
        self._take(block.incoming[order])
        self.ends = np.searchsorted(block.slots[order], np.arange(len(block.members) + 1)).astype(np.int64)
        degrees = np.diff(self.ends)
        #: the number of connections of each neuron, −1 where they differ
        self.degree = int(degrees[0]) if (degrees == degrees[0]).all() else -1
        self.dense = self._is_dense()
        self.lanes: _Lanes | None = None
        if not (step.form.written_out or self.dense or 0 <= self.degree <= _FEW):
            self.lanes, order = _in_lanes(self.ends)
            self._take(self.connections[order])

    def _take(self, connections: IntArray) -> None:
        """Read connections in this order."""
        self.connections = connections
        self.sources = self.step.network.connections.sources[connections]
        self.delays = self.step.network.connections.delays[connections]
        self.offsets = self.step.layout.offsets[connections]

    def _is_dense(self) -> bool:
        """Whether the connections are a full matrix, row by row: then the sums of all neurons go on beside each other,
        each in its own order."""
        count = len(self.block.members)
        if self.block.combine != "sum" or self.degree <= 1 or not 1 < count <= _BESIDE or self.step.form.gone:
            return False
        if self.step.form.written_out or len(set(self.delays.tolist())) > 1:
            return False
        rows = self.connections.reshape(count, self.degree)
        sources = self.sources.reshape(count, self.degree)
        regular = rows[0, 0] + np.arange(self.degree) * count + np.arange(count).reshape(-1, 1)
        return bool((rows == regular).all() and (sources == sources[0]).all())

    @contextmanager
    def beside(self, lanes: _Lanes) -> Iterator[tuple[Place, str]]:
        """The body of a loop over all neurons of the block: the place of one, and what arrives at it."""
        code, count = self.code, len(lanes.neurons)
        start: Value = 1.0 if self.block.combine == "product" else 0.0
        begins, rests = code.tables.name(lanes.begins), code.tables.name(lanes.rests)
        with code.block(code.loop("g", len(lanes.begins) - 1)):
            totals = [code.variable("u", start) for _ in range(_LANES)]
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

    def matrix(self) -> str:
        """The sums of a full matrix; the name of their array."""
        code, count = self.code, len(self.block.members)
        name = code.name("u")
        code.line(f"{code.real} {name}[{count}];")
        code.line(code.loop("p", count))
        code.line(f"    {name}[p] = {code.text(0.0)};")
        delay = int(self.delays[0])
        first, offset = int(self.connections[0]), int(self.offsets[0])
        with code.block(code.loop("q", self.degree)):
            direct = delay == 0 or self.packed is not None
            if direct:
                source = code.at(self.sources[: self.degree], "q")
                code.line(f"const {code.real} a = {'activity' if delay == 0 else 'before'}[{source}];")
            code.line(code.loop("p", count))
            if direct:
                code.line(f"    {name}[p] += weights[{first} + {count}*q + p]*a;")
            elif delay == 1:
                code.line(f"    {name}[p] += signals[{offset} + {count}*q + p];")
            else:
                shift = code.remainder(delay)
                code.line(f"    {name}[p] += signals[{offset} + {delay}*({count}*q + p) + {shift}];")
        return name

    def combined(self, place: Place) -> Value:
        """All that arrives at one neuron as one number."""
        combine = self.block.combine
        start: Value = 1.0 if combine == "product" else 0.0
        if not len(self.connections):
            return start
        if isinstance(place, int):
            edges: list[Place] = list(range(int(self.ends[place]), int(self.ends[place + 1])))
            return self._written(start, edges, [slice(None)] * len(edges)) if edges else start
        assert 0 <= self.degree <= _FEW, "others go on in lanes"
        columns = [slice(column, None, self.degree) for column in range(self.degree)]
        return self._written(start, [place] * self.degree, columns)

    def _written(self, start: Value, edges: list[Place], columns: list[slice]) -> Value:
        """One term after the other."""
        if not self.step.form.gone and self.block.combine == "sum":
            terms = [self.term(edge, column) for edge, column in zip(edges, columns, strict=True)]
            return " + ".join([self.code.text(start), *terms])
        total = self.code.variable("u", start)
        for edge, column in zip(edges, columns, strict=True):
            self._add(total, edge, column)
        return self._finished(total)

    def _add(self, total: str, edge: Place, column: slice) -> None:
        code = self.code
        if self.step.form.gone:
            code.line(f"if (!gone[{code.at(self.connections[column], edge)}]) {{")
            code.indent += 1
        term = self.term(edge, column)
        match self.block.combine:
            case "sum":
                code.line(f"{total} += {term};")
            case "product":
                code.line(f"{total} *= {term};")
            case "distance":
                centres = self.step.network.connections.centres
                centre = code.settable("centres", centres, self.connections[column], edge)
                difference = code.let("d", f"{term} - {self._operand(centre)}" if centre != 0.0 else term)
                code.line(f"{total} += {difference}*{difference};")
        if self.step.form.gone:
            code.indent -= 1
            code.line("}")

    def _operand(self, value: Value) -> str:
        text = self.code.text(value)
        return f"({text})" if text.startswith("-") else text

    def _finished(self, total: str) -> Value:
        return f"sqrt{self.code.emitter.suffix}({total})" if self.block.combine == "distance" else total

    def term(self, edge: Place, column: slice) -> str:
        """w[t−d]·a[t−d] of a connection."""
        code = self.code
        delays = self.delays[column] if not isinstance(edge, int) else self.delays[column][edge : edge + 1]
        kinds = sorted(set(delays.tolist()))
        if self.packed is not None:
            places = self.packed + np.arange(len(self.connections))[column]
            return f"packed[{code.at(places, edge)}]*before[{code.at(self.sources[column], edge)}]"
        now = ""
        if kinds[0] == 0:
            weight, source = code.at(self.connections[column], edge), code.at(self.sources[column], edge)
            now = f"weights[{weight}]*activity[{source}]"
        if kinds == [0]:
            return now
        offset = code.at(self.offsets[column], edge)
        if len(kinds) == 1:
            shift = "" if kinds[0] == 1 else f" + {code.remainder(kinds[0])}"
            return f"signals[{offset}{shift}]"
        kind = code.at(np.searchsorted(kinds, delays).astype(np.int64), edge)
        rests = "_".join(["r", *map(str, kinds)])
        shifts = ", ".join("0" if delay < 2 else f"(int32_t)(k % {delay})" for delay in kinds)
        code.head[rests] = f"const int32_t {rests}[{len(kinds)}] = {{{shifts}}};"
        arriving = f"signals[{offset} + {rests}[{kind}]]"
        return f"({kind} ? {arriving} : {now})" if kinds[0] == 0 else arriving
