"""Integration as C: flow states over a step, stage by stage, all populations together, and the noise behind it.

In: a Network with an Integrate. Out: the lines of these operations, over an array ``work`` of the caller's, whose parts
are

    fx  the flow states at the beginning of a substep      fh  what is held at ports over the step
    fy  those of a stage                                   fo  what connections take at a stage
    fk  their derivatives there                            fv  the inputs and the noise of the step, inputs that are
    fj  how much these change with their own states            expressions as they are at a stage
    fs  sums of derivatives, over stages                   fg  what their noise is multiplied by

Of a leaky neuron with an input and Heun's method the text is

    fx[0] = cells0_0[0];
    for (int32_t sub = 0; sub < 1; sub++) {
        memcpy(fy, fx, 1*sizeof(fx[0]));
        for (int32_t stage = 0; stage < 2; stage++) {
            const double u1 = 0.0 + s[0];
            fk[0] = (u1 - fy[0])/0.02;
            if (stage == 0)
                fs[0] = fk[0], fy[0] = fx[0] + 0.01*fk[0];
            else
                fx[0] = fx[0] + 0.005*(fs[0] + fk[0]);
        }
    }
    cells0_0[0] = fx[0];

with loops over all states in place of the last two lines of a stage, and in large networks over neurons everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, groupby
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import MODEL, Diffuse, Integrate, Port, SendAhead, Use
from neurovis_spec.language.expressions.emit_c import INEXACT, Made, Value
from neurovis_spec.language.expressions.parser import formula
from neurovis_spec.language.expressions.tree import Name
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.c_arrivals import Arrivals, incoming_of
from neurovis_spec.runtime.c_code import Place, plus, words_of
from neurovis_spec.runtime.c_step import StepCode, write, write_input
from neurovis_spec.runtime.stages import (
    INSIDE,
    Formulas,
    Part,
    Taken,
    apart,
    formulas_of,
    given,
    parts_of,
    places_among_taken,
    taken_by,
    unfolded,
)

#: Of a substep of the length 1, when the stages of a method are: just behind the beginning, in the middle, just before
#: the end.
_BEGIN, _MIDDLE, _END = range(3)
STAGES: Mapping[Method, tuple[int, ...]] = {
    "euler": (_BEGIN,),
    "heun": (_BEGIN, _END),
    "rk4": (_BEGIN, _MIDDLE, _MIDDLE, _END),
    "exponential": (_BEGIN,),
    "semi_implicit": (_BEGIN,),
}
#: What a state changes by in a substep of the length h, by its derivative f and j = ∂f/∂x.
_CHANGES: Mapping[Method, str] = {
    "exponential": "(h*exprel(h*min(j, 0)))*f",
    "semi_implicit": "(h*f)/(1 - h*min(j, 0))",
}
#: Functions of two arguments.
_OF_TWO = ("atan2", "pow")


class _State(NamedTuple):
    """A flow state of a population: where its members stand among all flow states."""

    part: Part
    name: str
    start: int

    @property
    def use(self) -> Use:
        """The model that it is a state of."""
        return self.part.population.model

    @property
    def size(self) -> int:
        """How many numbers it is."""
        return len(self.part.population.members)

    @property
    def varies(self) -> bool:
        """Whether more than parameters says how much its derivative changes with it."""
        let, diagonal = self.part.slopes.let, dict(self.part.slopes.trees)
        if self.name not in diagonal:  # the method does not look at that
            return False
        return not unfolded(let, [diagonal[self.name]]).names <= {*self.use.parameters, *dict(let)}


@dataclass(frozen=True)
class Plan:
    """What an integration keeps in ``work``, and where."""

    network: Network
    operation: Integrate
    #: whether noise is added behind it
    diffuses: bool

    @cached_property
    def of_stage(self) -> tuple[Part, ...]:
        """What is done at a stage, population by population."""
        return parts_of(self.network, self.operation)

    @cached_property
    def states(self) -> tuple[_State, ...]:
        """All flow states, population by population."""
        found: list[_State] = []
        start = 0
        for part in self.of_stage:
            for name in part.flows:
                found.append(_State(part, name, start))
                start += found[-1].size
        return tuple(found)

    @cached_property
    def starts(self) -> Mapping[tuple[int, str], int]:
        """Where the members of a flow state of a population stand."""
        return {(one.part.number, one.name): one.start for one in self.states}

    @cached_property
    def held(self) -> Mapping[tuple[int, str], int]:
        """Where what is held at the ports of populations stands."""
        found: dict[tuple[int, str], int] = {}
        start = 0
        for part in self.of_stage:
            formulas = (part.derivatives, part.spread, *(one.formulas for one in part.taken))
            for port in dict.fromkeys(chain.from_iterable(one.ports for one in formulas)):
                if len(apart(port)[0]):
                    found[part.number, port.name] = start
                    start += len(part.population.members)
        return found

    @cached_property
    def places(self) -> IntArray:
        """Where each activity and each outlet, as ``Network.sending`` has them, stands among what is taken at a stage;
        −1 for none."""
        return places_among_taken(self.network, self.of_stage)

    def sent(self, connections: Indices) -> IntArray:
        """Where what connections take stands among that."""
        return np.asarray(self.places[taken_by(self.network)[connections]], dtype=np.int64)

    @cached_property
    def parts(self) -> Mapping[str, int]:
        """Where the parts of ``work`` begin, by their names; those of no numbers are left out."""
        several = len(STAGES[self.operation.method]) > 1
        count = sum(one.size for one in self.states)
        sizes = {
            "fx": count,
            "fy": count if several else 0,
            "fk": count,
            "fj": count if self.operation.method in _CHANGES else 0,
            "fs": count if several else 0,
            "fg": count if self.diffuses else 0,
            "fh": sum(len(self.network.populations[number].members) for number, _ in self.held),
            "fo": int(self.places.max(initial=-1)) + 1,
            "fv": self.network.vector_size if self.network.held_inputs else 0,
        }
        starts, start = dict[str, int](), 0
        for name, size in sizes.items():
            if size:
                starts[name] = start
                start += size
        return starts | {"": start}


def plan_of(network: Network) -> Plan | None:
    """The plan of a network; None where nothing flows."""
    by = network.integration
    if by is None:
        return None
    return Plan(network, by, any(isinstance(one, Diffuse) for one in network.program))


def work_size(network: Network) -> int:
    """How many numbers ``work`` has."""
    plan = plan_of(network)
    return 0 if plan is None else plan.parts[""]


def written_out(network: Network, most: int) -> int:
    """Up to how many neurons and connections a network is written out one by one, if it is up to ``most`` where nothing
    flows: derivatives take more lines for each, which have to stay in the processor's cache from stage to stage."""
    return most if plan_of(network) is None else most // 6


def declarations(network: Network) -> str:
    """Where slopes of formulas are made, in which the functions of these come again: that a function gives the same for
    the same, so that a compiler calls it once."""
    plan = plan_of(network)
    if plan is None or plan.operation.method not in _CHANGES:
        return ""
    return "\n".join(f"double {name}(double) __attribute__((__const__));" for name in INEXACT if name not in _OF_TWO)


def pointer_lines(network: Network, real: str, quick: str, work: str) -> dict[str, str]:
    """For each part of ``work``, the line that gives it its name; ``quick`` is how ``restrict`` is written."""
    plan = plan_of(network)
    if plan is None:
        return {}
    parts = {name: start for name, start in plan.parts.items() if name}
    return {name: f"{real} *{quick} const {name} = {work} + {start};" for name, start in parts.items()}


def _some(port: Port, positions: Indices) -> Port:
    """The port with some of its signals alone."""
    factors = None if port.factors is None else port.factors[positions]
    return replace(port, incoming=port.incoming[positions], slots=port.slots[positions], factors=factors, staged=None)


class _Integration:
    """Writes one integration."""

    def __init__(self, step: StepCode, plan: Plan) -> None:
        self.step, self.plan, self.code, self.network = step, plan, step.code, step.network
        self.method, self.substeps = plan.operation.method, plan.operation.substeps
        #: the flow states of a stage
        self.now = "fy" if "fy" in plan.parts else "fx"
        self.varying = {(one.part.number, one.name): one.varies for one in plan.states}

    def write(self) -> None:
        """All of it."""
        code, network, plan = self.code, self.network, self.plan
        self.copy("fx[{at}] = {now};")
        if network.held_inputs:
            code.line(f"memcpy(fv, s, {network.vector_size}*sizeof(fv[0]));")
        for part in plan.of_stage:
            for port in part.population.ports:
                if (part.number, port.name) in plan.held:
                    self.hold(part, port)
        h = network.dt / self.substeps
        code.value(Name("k"), {})  # since reads kd
        with code.block(code.loop("sub", self.substeps)):
            begin = f"(kd - {code.text(1.0)})*{code.text(network.dt)} + ({code.real})sub*{code.text(h)}"
            with self.where_read("since", begin):
                self.substep(h)
        self.copy("{cell} = fx[{at}];")

    @contextmanager
    def where_read(self, name: str, value: str) -> Iterator[None]:
        """Lines with a name for a value, where they read it."""
        code, before = self.code, len(self.code.lines)
        yield
        body = code.lines[before:]
        del code.lines[before:]
        if name in words_of(body):
            code.line(f"const {code.real} {name} = {value};")
        code.lines += body

    def copy(self, line: str) -> None:
        """A line for each flow state, which is ``cell`` in the State, ``now`` with what is held, and ``at`` here."""
        for one in self.plan.states:

            def copied(place: Place, totals: Mapping[int, str], one: _State = one) -> None:
                now = cell = self.step.states(one.use, place)[one.name]
                if held := self.step.held(one.part.number, one.name, place):
                    now = f"held[{held}] ? holding[{held}] : {cell}"
                self.code.line(line.format(cell=cell, now=now, at=plus(one.start, place)))

            self.step.each(one.size, {}, copied)

    # ---- what arrives ------------------------------------------------------------------------------------------

    def hold(self, part: Part, port: Port) -> None:
        """What is held at a port over the step; a root is taken of all together, with the signals of a stage."""
        start, (held, staged) = self.plan.held[part.number, port.name], apart(port)
        arrivals = self.arrivals(part, _some(port, held))
        arrivals.finished = not len(staged)

        def kept(place: Place, totals: Mapping[int, str]) -> None:
            total = totals.get(0, "") or self.code.text(arrivals.combined(place))
            self.code.line(f"fh[{plus(start, place)}] = {total};")

        self.step.each(len(part.population.members), {0: arrivals}, kept)

    def arrivals(
        self,
        part: Part,
        port: Port,
        begins: Callable[[Place], Value] | None = None,
        sent: Callable[[Indices, Place], str] | None = None,
    ) -> Arrivals:
        """What arrives at a port of a population."""
        step, network = self.step, self.network
        incoming = incoming_of(network, port, len(part.population.members), fusible=False)
        return Arrivals(network, incoming, self.code, step.form, step.layout, begins, sent)

    def at_stage(self, part: Part, port: Port) -> Arrivals:
        """What arrives at a port at a stage: what is held, and on top of it what flows."""
        held, start = self.plan.held.get((part.number, port.name)), 1.0 if port.combine == "product" else 0.0
        _, staged = apart(port)

        def begins(place: Place) -> Value:
            return start if held is None else f"fh[{plus(held, place)}]"

        def sent(connections: Indices, place: Place) -> str:
            return f"fo[{self.code.at(self.plan.sent(connections), place)}]"

        arrivals = self.arrivals(part, _some(port, staged), begins, sent)
        arrivals.finished = held is None or len(staged) > 0  # else what is held is
        return arrivals

    # ---- stages ------------------------------------------------------------------------------------------------

    def substep(self, h: float) -> None:
        """A substep of so many seconds."""
        code, stages = self.code, STAGES[self.method]
        times = [self.time(one, h) for one in stages]
        if len(stages) == 1:
            with code.block(""):
                self.stage(times[0], "sub == 0")
                if self.method in _CHANGES:
                    self.changes(_CHANGES[self.method])
                else:
                    self.states(lambda own: [f"fx[i] = fx[i] + {own}*fk[i];"])
            return
        code.line(f"memcpy(fy, fx, {sum(one.size for one in self.plan.states)}*sizeof(fx[0]));")
        with code.block(code.loop("stage", len(stages))):
            at = times[-1]
            for number in range(len(stages) - 2, -1, -1):
                if times[number] != times[number + 1]:
                    at = f"stage <= {number} ? {times[number]} : {at}"
            self.stage(at, "sub == 0 && stage == 0")
            if self.method == "heun":
                self.heun()
            else:
                self.rk4()

    def time(self, when: int, h: float) -> str:
        """The time of a stage."""
        code, inside = self.code, self.code.text(INSIDE * h)
        if when == _BEGIN:
            return f"since + {inside}"
        return f"since + {code.text(h / 2.0)}" if when == _MIDDLE else f"since + {code.text(h)} - {inside}"

    def changes(self, formula_: str) -> None:
        """x + the change; of all neurons state by state, since a branch within exprel then goes the same way in all."""
        for one in self.plan.states:
            with self.code.block(self.code.loop("i", one.start + one.size, one.start)):
                change: Value = "fk[i]"
                if self.varying[one.part.number, one.name]:
                    h = self.length(one.use.definition.per_second)
                    change = self.code.value(formula(formula_), {"h": h, "f": "fk[i]", "j": "fj[i]"})
                self.code.line(f"fx[i] = fx[i] + {self.code.text(change)};")

    def heun(self) -> None:
        """x + h/2·(f₁ + f₂)."""
        with self.code.block("if (stage == 0)"):
            self.states(lambda h: ["fs[i] = fk[i];", f"fy[i] = fx[i] + {h}*fk[i];"])
        with self.code.block("else"):
            self.states(lambda h: [f"fx[i] = fx[i] + {h}*(fs[i] + fk[i]);"], 2.0)

    def rk4(self) -> None:
        """x + h/6·(f₁ + 2f₂ + 2f₃ + f₄)."""
        two = self.code.text(2.0)
        with self.code.block("if (stage == 0)"):
            self.states(lambda h: ["fs[i] = fk[i];", f"fy[i] = fx[i] + {h}*fk[i];"], 2.0)
        for number, share in ((1, 2.0), (2, 1.0)):
            with self.code.block(f"else if (stage == {number})"):
                self.states(lambda h: [f"fs[i] = fs[i] + {two}*fk[i];", f"fy[i] = fx[i] + {h}*fk[i];"], share)
        with self.code.block("else"):
            self.states(lambda h: [f"fx[i] = fx[i] + {h}*(fs[i] + fk[i]);"], 6.0)

    def states(self, lines: Callable[[str], Sequence[str]], share: float = 1.0) -> None:
        """Lines for all flow states i; they get the code of h/share, in the unit of the states."""
        code, first = self.code, 0
        for per_second, own in groupby(self.plan.states, key=lambda one: one.use.definition.per_second):
            stop = first + sum(one.size for one in own)
            with code.block(code.loop("i", stop, first)):
                for line in lines(code.text(self.length(per_second) / share)):
                    code.line(line)
            first = stop

    def length(self, per_second: float) -> float:
        """h, a substep in units of which a second has so many."""
        return self.network.dt * per_second / self.substeps

    def stage(self, at: str, first: str) -> None:
        """The derivatives at a time, which has this code. Where ``first`` holds it is the first one of the step."""
        with ExitStack() as clocks:
            clocks.enter_context(self.where_read("ts", at))
            for unit in sorted({one.use.definition.per_second for one in self.plan.states} - {1.0}):
                clocks.enter_context(self.where_read(_clock(unit), f"ts*{self.code.text(unit)}"))
            self.derivatives(first)

    def derivatives(self, first: str) -> None:
        """The inputs of a stage, what connections take at it, the derivatives."""
        self.inputs()
        parts = self.plan.of_stage
        for part in parts:
            for one in part.taken:
                self.neurons(part, one.formulas, partial(self.give, part, one))
        for part in parts:
            if part.flows:
                self.neurons(part, part.derivatives, partial(self.slope, part))
        noisy = [part for part in parts if part.spread.trees]
        if noisy and self.plan.diffuses:
            with self.code.block(f"if ({first})"):
                for part in noisy:
                    self.neurons(part, part.spread, partial(self.spread, part))

    def inputs(self) -> None:
        """Inputs that are formulas, at the time of a stage, but those that somebody has given for the step."""
        code, network = self.code, self.network
        for name, held in network.held_inputs.items():
            with code.block(f"if (s[{held}] == {code.text(0.0)})"):
                write_input(code, network, network.input_index[name], "fv", {"t": "ts"})

    def neurons(
        self, part: Part, formulas: Formulas, body: Callable[[Place, Mapping[str, Value], Mapping[str, Made]], None]
    ) -> None:
        """What is done for each neuron of a population, by its place, what formulas see there, and the functions of its
        activation."""
        code, population = self.code, part.population
        numbers = {port.name: number for number, port in enumerate(population.ports)}
        arrivals = {numbers[port.name]: self.at_stage(part, port) for port in formulas.ports}

        def each(place: Place, totals: Mapping[int, str]) -> None:
            ports: dict[str, Value] = {}
            for number, own in arrivals.items():
                port = population.ports[number]
                total: Value = totals.get(number) or own.combined(place)
                ports[port.name] = code.let("u", self.step.with_own(population, port, place, total, self.step_value))
            functions = self.step.activation(population, place)
            known = self.step.let(
                formulas.let, self.known(part, place) | ports, [tree for _, tree in formulas.trees], functions
            )
            body(place, known, functions)

        self.step.each(len(population.members), arrivals, each)

    def step_value(self, index_in_s: IntArray, place: Place) -> str:
        """A number of the vector of the step, as it is at the stage."""
        return f"{'fv' if self.network.held_inputs else 's'}[{self.code.at(index_in_s, place)}]"

    def known(self, part: Part, place: Place) -> dict[str, Value]:
        """What formulas of the model of a neuron see at a stage beside its ports."""
        use = part.population.model
        per_second = use.definition.per_second
        known: dict[str, Value] = {**self.code.parameters(use, place), **self.step.states(use, place)}
        for name in part.flows:
            known[name] = f"{self.now}[{plus(self.plan.starts[part.number, name], place)}]"
        known["t"] = _clock(per_second)
        known["dt"] = self.network.dt * per_second
        return known

    def give(
        self, part: Part, one: Taken, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]
    ) -> None:
        """What connections take of a neuron."""
        code, neuron = self.code, self.code.at(part.population.members, place)
        ((_, tree),) = one.formulas.trees
        value = code.text(code.value(tree, known, functions))
        if self.step.form.held and one.is_activity:
            value = f"held[{neuron}] ? holding[{neuron}] : {value}"
        elif self.step.form.held:
            value = f"lesioned[{neuron}] ? {code.text(0.0)} : {value}"
        code.line(f"fo[{code.at(self.plan.places[one.places], place)}] = {value};")

    def slope(self, part: Part, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]) -> None:
        """The derivatives of the states of a neuron, or what these change by."""
        code, changes = self.code, _CHANGES.get(self.method)
        made = part.population.model.definition
        diagonal = dict(part.slopes.trees)
        more = tuple((name, tree) for name, tree in part.slopes.let if name not in known)
        known = self.step.let(more, known, [*diagonal.values()], functions)
        for name, tree in part.derivatives.trees:
            slope, at = code.value(tree, known, functions), plus(self.plan.starts[part.number, name], place)
            held = self.step.held(part.number, name, place)
            if changes is not None:
                own_slope = code.value(diagonal[name], known, functions)
                if self.varying[part.number, name]:
                    if held:  # 0, so that the change is 0 even where this is NaN
                        own_slope = f"held[{held}] ? {code.text(0.0)} : {code.text(own_slope)}"
                    code.line(f"fj[{at}] = {code.text(own_slope)};")
                else:
                    h = self.length(made.per_second)
                    parts: dict[str, Value] = {"h": h, "f": code.let("n", slope), "j": own_slope}
                    slope = code.value(formula(changes), parts)
            if held:
                slope = f"held[{held}] ? {code.text(0.0)} : {code.text(slope)}"
            code.line(f"fk[{at}] = {code.text(slope)};")

    def spread(self, part: Part, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]) -> None:
        """What the noise of the states of a neuron is multiplied by."""
        for name, tree in part.spread.trees:
            value = self.code.text(self.code.value(tree, known, functions))
            self.code.line(f"fg[{plus(self.plan.starts[part.number, name], place)}] = {value};")


def _clock(per_second: float) -> str:
    """The name of the time of a stage, in units of which a second has so many."""
    return "ts" if per_second == 1.0 else f"ts{per_second:.0f}"


@write.register
def _integrate(operation: Integrate, step: StepCode) -> None:
    plan = plan_of(step.network)
    assert plan is not None
    with step.unless_first():
        _Integration(step, plan).write()


@write.register
def _send_ahead(operation: SendAhead, step: StepCode) -> None:
    """What connections take of a population, where flow states are all that it is made of."""
    code, number = step.code, operation.population
    population = step.network.populations[number]
    use = population.model

    def shown(place: Place, totals: Mapping[int, str]) -> None:
        step.hold_states(number, place)
        neuron, functions = code.at(population.members, place), step.activation(population, place)
        seen: Mapping[str, Value] = {
            **code.parameters(use, place), **step.clock(use.definition), **step.states(use, place),
        }  # fmt: skip
        for name in operation.names:
            formulas = formulas_of(population, [(name, given(use.definition, name))])
            ((_, tree),) = formulas.trees
            value = code.let("y", code.value(tree, step.let(formulas.let, seen, [tree], functions), functions))
            if name == MODEL.gives:
                step.put_activity(neuron, value)
            for outlet in step.network.outlets:
                if (outlet.population, outlet.name) == (number, name):
                    step.put_out(outlet, place, neuron, code.text(value))

    step.each(len(population.members), {}, shown)


@write.register
def _diffuse(operation: Diffuse, step: StepCode) -> None:
    plan, code, network = plan_of(step.network), step.code, step.network
    assert plan is not None
    with step.unless_first():
        for one in plan.states:
            if one.name not in dict(one.part.spread.trees):
                continue
            drawn = network.noise_of(state=one.name)[one.part.population.members]
            root = code.text(math.sqrt(network.dt * one.use.definition.per_second))

            def disturb(
                place: Place,
                totals: Mapping[int, str],
                one: _State = one,
                drawn: IntArray = drawn,
                root: str = root,
            ) -> None:
                cell, spread = step.states(one.use, place)[one.name], f"fg[{plus(one.start, place)}]"
                if held := step.held(one.part.number, one.name, place):
                    code.line(f"if (!held[{held}])")
                code.line(f"{cell} = {cell} + {spread}*{root}*s[{code.at(drawn, place)}];")

            step.each(one.size, {}, disturb)
