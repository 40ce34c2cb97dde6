"""The flow as NumPy code: states with a derivative, integrated together, a stage at a time.

In: a Step in the making. Out: lines in its ``Code``. While they are integrated, the flow states of all populations lie
one behind the other in one array, so that a method computes with all at once. What of a port is held over the step is
made once, before the first stage; a stage is a function of the time. A state v of two neurons gives, with euler,

    f4 = np.empty(2)                             # before the steps: the states at the beginning of one, …
    f5 = np.empty(2)                             # … where a stage looks, …
    f6 = np.empty(2)                             # … and its derivatives
    f7 = f5[0:2]
    def stage8(t):
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
from typing import Final

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.program import Diffuse, Integrate, Key, Port
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.numpy_arrivals import (
    Step,
    accumulated,
    finished,
    signals_at,
    with_bias,
    with_factors,
    with_step_values,
)
from neurovis_spec.runtime.numpy_code import FIRST, shared
from neurovis_spec.runtime.stages import Formulas, Part, apart, parts_of, places_among_taken, taken_by, times

#: fewer signals are added one by one, however they lie
_DENSE = 4096


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
            code.line(f"if fixed: hold_cells(fixed, {code.constant(population.model.owner)}, cells)")


@contextmanager
def _unless_first(step: Step) -> Iterator[None]:
    """At any step but the first one of all."""
    step.code.line(f"if not ({FIRST}):")
    step.code.indent += 1
    yield
    step.code.indent -= 1


class _Flow:
    """The integration of some populations in the making."""

    def __init__(self, step: Step, operation: Integrate) -> None:
        self.step, self.code, self.network, self.operation = step, step.code, step.network, operation
        self.parts = parts_of(step.network, operation)
        #: where each flow state, by its population and name, lies among all of them
        self.places: dict[tuple[int, str], slice] = {}
        #: where in what is taken at a stage each activity and each outlet lies, −1 for the others
        self.taken = places_among_taken(self.network, self.parts)
        self.size, self.taken_count = 0, int(self.taken.max(initial=-1)) + 1
        for part in self.parts:
            for name in part.flows:
                begin, self.size = self.size, self.size + len(part.population.members)
                self.places[part.number, name] = slice(begin, self.size)
        #: the states at the beginning of the step, those where a stage looks, the derivatives there, their slopes
        self.x, self.y, self.k = self.temporary(), self.temporary(), self.temporary()
        self.j = self.temporary() if any(part.slopes.trees for part in self.parts) else ""
        self.sent = self.code.array("f", f"np.empty({self.taken_count})") if self.taken_count else ""
        #: each state where a stage looks
        self.now = {key: self.code.array("f", f"{self.y}[{_text(place)}]") for key, place in self.places.items()}
        #: by population and port what is made of it once a step, before the stages: all that is at the port, where that
        #: is held over the step, else what arrives there and is held
        self.whole: dict[tuple[int, str], str] = {}
        self.held: dict[tuple[int, str], str] = {}
        #: matrices of weights, by population and port, and what fills those once a step that learn
        self.matrices: dict[tuple[int, str], str] = {}
        self.filled: list[str] = []

    def temporary(self) -> str:
        """An array to work in, as long as all flow states."""
        return self.code.array("f", f"np.empty({self.size})")

    def numbers(self, value: Callable[[float], float]) -> str:
        """What a method makes of the length of its steps, for each number in the time of its definition."""
        made = np.empty(self.size)
        for part in self.parts:
            h = self.network.dt * part.population.model.definition.per_second / self.operation.substeps
            for name in part.flows:
                made[self.places[part.number, name]] = value(h)
        return self.code.constant(shared(made))

    def emit(self) -> None:
        """The whole integration, and what the noise behind it is multiplied by."""
        code, substeps, h = self.code, self.operation.substeps, self.network.dt / self.operation.substeps
        stage = code.name("stage")
        with _unless_first(self.step):
            cells = {
                (part.number, name): code.state(part.population.model, name)
                for part in self.parts
                for name in part.flows
            }
            for key, place in self.places.items():
                code.line(f"{self.x}[{_text(place)}] = {cells[key]}")
            self.emit_fixed()
            for part in self.parts:
                for port in part.ports:
                    self.hold(part, port)
            spread = self.make_spread()
            with code.function(stage, "t", *(("first=False",) if spread else ())):
                _Stage(self).emit()
            for line in (*self.filled, f"t = (k - 1) * {self.network.dt!r}"):
                code.line(line)
            if substeps > 1:
                code.line("start = t")
                code.line(f"for substep in range({substeps}):")
                code.indent += 1
                code.line(f"t = start + substep * {h!r}")
            inside, is_first = times(0.0, h).first, ""
            if spread:
                is_first = ", substep == 0" if substeps > 1 else ", True"
            calls = [
                f"{stage}(t + {inside!r}{is_first})",
                f"{stage}(t + {h / 2.0!r})",
                f"{stage}(t + {h!r} - {inside!r})",
            ]
            for line in _METHODS[self.operation.method](self, *calls):
                code.line(line)
            code.line(f"if fixed: {self.x}[held] = values")
            code.indent -= substeps > 1
            for key, place in self.places.items():
                code.line(f"{cells[key]}[:] = {self.x}[{_text(place)}]")

    def emit_fixed(self) -> None:
        """Which of the flow states are held, and at what."""
        starts = {
            Key(self.network.populations[number].model.owner, name): place.start
            for (number, name), place in self.places.items()
        }
        self.code.line("if fixed:")
        self.code.line(f"    held, values = held_among(fixed, {self.code.constant(starts)})")
        self.code.line(f"    {self.x}[held] = values")

    def make_spread(self) -> bool:
        """Room for what the noise of the flow states is multiplied by, where there is any."""
        for part in self.parts:
            for name, _ in part.spread.trees:
                self.step.spread[part.number, name] = self.code.array("g", f"np.empty({len(part.population.members)})")
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
        if len(staged) or self.reads_formulas(part, port):
            self.held[key] = arriving
        else:
            self.whole[key] = self.given(part, port, arriving)

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
        self.vector = self.emit_inputs()
        self.sent = False

    def emit(self) -> None:
        """The derivatives of all flow states, and how much they change with these, where the method looks at that; at
        the first stage of a step what their noise is multiplied by, too."""
        for part in self.flow.parts:
            for array, formulas in ((self.flow.k, part.derivatives), (self.flow.j, part.slopes)):
                for name, value in self.values(part, formulas).items():
                    self.code.line(f"{array}[{_text(self.flow.places[part.number, name])}] = {value}")
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
                value = self.code.expression(entry.expression, known | {"t": "t"})
                place = f"{entry.start}:{entry.start + entry.size}"
                self.code.line(f"if not s[{held}]: {vector}[{place}] = {value}")
        return vector

    def emit_taken(self) -> None:
        """What connections take at the stage, population by population, once."""
        if self.sent:
            return
        self.sent, count = True, 0
        for part in self.flow.parts:
            for taken in part.taken:
                place = f"{self.flow.sent}[{count}:{count + len(taken.places)}]"
                (value,) = self.values(part, taken.formulas).values()
                self.code.line(f"{place} = {value}")
                if taken.is_activity:
                    held = f"holds[{part.number}]"
                    positions = self.code.constant(self.flow.taken)
                    self.code.line(f"if holds and {held}: {self.flow.sent}[{positions}[{held}[0]]] = {held}[1]")
                count += len(taken.places)

    def values(self, part: Part, formulas: Formulas) -> dict[str, str]:
        """The code of formulas by their names; the intermediate values and ports that they need are written once."""
        known, functions = self.seen(part), self.functions[part.number]
        for port in formulas.ports:
            if port.name not in known:
                known[port.name] = self.port(part, port)
        for name, tree in formulas.let:
            if name not in known:
                known[name] = self.code.let("m", self.code.expression(tree, known, functions))
        return {name: self.code.expression(tree, known, functions) for name, tree in formulas.trees}

    def seen(self, part: Part) -> dict[str, str]:
        """What all formulas of a population see: parameters, the time, states."""
        if part.number not in self.known:
            model = part.population.model
            known = self.code.parameters(model)
            unit = model.definition.per_second
            known["t"] = "t" if unit == 1.0 else f"(t * {unit!r})"
            for one in model.definition.state:
                key = part.number, one.name
                known[one.name] = self.flow.now[key] if key in self.flow.now else self.code.state(model, one.name)
            self.known[part.number] = known
        return self.known[part.number]

    def port(self, part: Part, port: Port) -> str:
        """What is at a port."""
        flow, key = self.flow, (part.number, port.name)
        if key in flow.whole:
            return flow.whole[key]
        arriving, (_, staged) = flow.held[key], apart(port)
        if len(staged):
            self.emit_taken()
            connections = port.incoming[staged]
            weights = self.code.select("weights", connections, len(self.network.connections))
            taken = flow.taken[taken_by(self.network)[connections]]
            signals = f"{weights} * {self.code.select(flow.sent, taken, flow.taken_count)}"
            if port.combine == "sum" and port.factors is None and not arriving and len(staged) >= _DENSE:
                arriving = self.product(part, port, taken, weights, signals)
            else:
                signals = with_factors(self.code, port, staged, self.code.let("g", signals))
                arriving = accumulated(self.step, part.population, port, staged, signals, arriving)
        return flow.given(part, port, arriving, self.vector)

    def product(self, part: Part, port: Port, taken: IntArray, weights: str, signals: str) -> str:
        """The sums of a port all of whose signals are made anew. Where most neurons are connected, they are a product
        of a matrix of weights, which adds in the same order; it has a 0 where there is no connection, which an infinite
        activity must not make NaN."""
        _, staged = apart(port)
        count, slots = len(part.population.members), port.slots[staged].astype(np.int64)
        rows, row = np.unique(taken, return_inverse=True)
        flat, size = row * count + slots, len(rows) * count
        one_by_one = accumulated(self.step, part.population, port, staged, signals)
        in_order = np.argsort(slots, kind="stable")
        ascends = np.diff(flat[in_order])[np.diff(slots[in_order]) == 0] > 0
        if not ascends.all() or 2 * len(flat) < size:
            return one_by_one
        sent, shape = self.code.select(self.flow.sent, rows, self.flow.taken_count), (len(rows), count)
        if np.array_equal(flat, np.arange(size)):
            return f"einsum('st,s->t', {weights}.reshape({shape}), {sent})"
        key = part.number, port.name
        if key not in self.flow.matrices:
            matrix = self.flow.matrices[key] = self.code.array("f", f"np.zeros({shape})")
            fill = f"{matrix}.reshape(-1)[{self.code.constant(flat)}] = {weights}"
            if (self.network.connections.rules[port.incoming[staged]] >= 0).any():
                self.flow.filled.append(fill)
            else:
                self.code.before.append(f"    {fill}")
        a = self.code.let("a", sent)
        return f"einsum('st,s->t', {self.flow.matrices[key]}, {a}) if isfinite(dot({a}, {a})) else {one_by_one}"


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
