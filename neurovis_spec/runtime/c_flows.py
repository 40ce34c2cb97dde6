"""Integration as C: flow states over a step, stage by stage, all populations together, and the noise behind it.

In: a Network with an Integrate, and its Plan, which says what is kept in ``work``. Out: the lines of these operations.
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
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.program import (
    MODEL,
    SYNAPSE,
    Definition,
    Diffuse,
    Integrate,
    Key,
    Port,
    Projection,
    SendAhead,
    Use,
)
from neurovis_spec.language.expressions.emit_c import INEXACT, Made, Value
from neurovis_spec.language.expressions.parser import formula
from neurovis_spec.language.expressions.tree import Conditional, Name, Number, names
from neurovis_spec.language.words import Method
from neurovis_spec.runtime.c_arrivals import Anew, Arrivals, Incoming, begin_of
from neurovis_spec.runtime.c_code import Place, plus, state_name, words_of
from neurovis_spec.runtime.c_connections import Forming, Sight, Some, own_of, taken_at
from neurovis_spec.runtime.c_lags import write_arriving
from neurovis_spec.runtime.c_plan import BEGIN, MIDDLE, STAGES, FlowState, Plan
from neurovis_spec.runtime.c_step import StepCode, write, write_input
from neurovis_spec.runtime.stages import (
    INSIDE,
    PARTS,
    Contacts,
    End,
    Formulas,
    Part,
    Taken,
    Through,
    formulas_of,
    given,
    taken_in_order,
    unfolded,
)

#: What a state changes by in a substep of the length h, by its derivative f and j = ∂f/∂x.
_CHANGES: Mapping[Method, str] = {
    "exponential": "(h*exprel(h*min(j, 0)))*f",
    "semi_implicit": "(h*f)/(1 - h*min(j, 0))",
}
#: The same state by state, in loops one behind the other, with what each of these leaves, and then the change: of a
#: loop that calls a function compilers make no vectors.
_BY_LOOPS: Mapping[Method, tuple[tuple[tuple[str, str], ...], str]] = {
    "exponential": ((("fj", "h*min(j, 0)"), ("fx", "expm1(j)")), "(h*(1 if j == 0 else e/j))*f"),
    "semi_implicit": ((), _CHANGES["semi_implicit"]),
}
#: Functions of two arguments.
_OF_TWO = ("atan2", "pow")


def declarations(plan: Plan | None) -> str:
    """Where slopes of formulas are made, in which the functions of these come again: that a function gives the same for
    the same, so that a compiler calls it once."""
    if plan is None or plan.operation.method not in _CHANGES:
        return ""
    return "\n".join(f"double {name}(double) __attribute__((__const__));" for name in INEXACT if name not in _OF_TWO)


class _Integration:
    """Writes one integration."""

    def __init__(self, step: StepCode) -> None:
        assert step.plan is not None
        self.step, self.plan, self.code, self.network = step, step.plan, step.code, step.network
        self.method, self.substeps = self.plan.operation.method, self.plan.operation.substeps
        #: the flow states of a stage
        self.now = "fy" if "fy" in self.plan.parts else "fx"
        #: whether nobody else reads a state at a stage, so that it changes where it is kept
        self.in_place = (
            step.form.follows and not step.form.written_out and len(STAGES[self.method]) == 1 and not self.plan.contacts
        )
        #: those that are 0 where members rest, and of which else a number says it
        self.resting = {one.key: found for one in self.plan.states if (found := self.rest(one)) is not None}
        self.varying = {one.key: one.varies and one.key not in self.resting for one in self.plan.states}
        #: those of which what else moves says it, in loops: both are chosen behind that
        self.pausing = {one.key: found for one in self.plan.states if (found := self.pause(one)) is not None}
        #: what formulas of connections see at a stage
        self.sight = _StageSight(step.sight.ends, self.code, step.form, plan=self.plan)
        self.forming = Forming(self.sight, {one.number: one.signal for one in self.plan.contacts})

    def rest(self, one: FlowState) -> tuple[Conditional, Conditional] | None:
        """``FlowState.resting`` where the method looks at it, and numbers are all that it reads of what moves."""
        if self.method not in _CHANGES or (found := one.resting) is None:
            return None
        let, parameters = one.part.slopes.let, self.code.parameters(one.use, "p")
        read = unfolded(let, [found[1].otherwise]).names - {name for name, _ in let}
        if not self.asks_itself(one, found[0]):
            return None
        return found if all(isinstance(parameters.get(name), float) for name in read) else None

    def pause(self, one: FlowState) -> tuple[Conditional, Conditional] | None:
        """``FlowState.resting`` of a state in a loop whose slope varies."""
        if self.method not in _CHANGES or self.step.form.written_out or not self.varying[one.key]:
            return None
        found = one.resting
        return found if found is not None and self.asks_itself(one, found[0]) else None

    def asks_itself(self, one: FlowState, chosen: Conditional) -> bool:
        """Whether a condition reads nothing but states and parameters of the member."""
        own = {*one.use.parameters, *(state.name for state in one.use.definition.state)}
        return names(chosen.condition) <= own

    def write(self) -> None:
        """All of it."""
        code, network, plan = self.code, self.network, self.plan
        if not self.in_place:
            with code.block("if (!follows)") if self.step.form.follows and plan.stays else nullcontext():
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
        if not self.in_place:
            self.copy("{cell} = fx[{at}];", back=True)

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

    def copy(self, line: str, back: bool = False) -> None:
        """A line for each flow state, which is ``cell`` in the State, ``now`` with what is held, and ``at`` here. Those
        of connections that do nothing are not copied ``back``."""
        for one in self.plan.states:
            if self.step.form.follows and not self.step.form.written_out:  # all do something, and nothing is held
                here, there = f"fx + {one.start}", state_name(one.use.owner, one.place)
                to, of = (there, here) if back else (here, there)
                self.code.line(f"memcpy({to}, {of}, {one.size}*sizeof(fx[0]));")
                continue

            def copied(place: Place, totals: Mapping[int, str], one: FlowState = one) -> None:
                now = cell = self.step.states(one.use, place)[one.name]
                held = self.step.held(one.use, one.name, place) if isinstance(one.part, Part) else ""
                if held:
                    now = f"held[{held}] ? holding[{held}] : {cell}"
                if back and isinstance(one.part, Contacts) and (idle := self.idle(one.part, one.name, place)):
                    self.code.line(f"if (!{idle})")
                self.code.line(line.format(cell=cell, now=now, at=plus(one.start, place)))

            self.step.each(one.size, {}, copied)

    # ---- what arrives ------------------------------------------------------------------------------------------

    def hold(self, part: Part, port: Port) -> None:
        """What is held at a port over the step; a root is taken of all together, with the signals of a stage."""
        start, reaching = self.plan.held[part.number, port.name], self.plan.reaching[part.number, port.name]
        arrivals = self.arrivals(reaching.held)
        arrivals.finished = not len(reaching.anew.connections)

        def kept(place: Place, totals: Mapping[int, str]) -> None:
            total = totals.get(0, "") or self.code.text(arrivals.combined(place))
            self.code.line(f"fh[{plus(start, place)}] = {total};")

        self.step.each(len(part.population.members), {0: arrivals}, kept)

    def arrivals(self, incoming: Incoming, anew: Anew | None = None) -> Arrivals:
        """What arrives at a port of a population."""
        return Arrivals(self.network, incoming, self.code, self.step.form, self.step.layout, self.forming, anew)

    def at_stage(self, part: Part, port: Port) -> Arrivals:
        """What arrives at a port at a stage: what is held, and on top of it what flows."""
        held, start = self.plan.held.get((part.number, port.name)), begin_of(port.combine)
        anew = self.plan.reaching[part.number, port.name].anew

        def begins(place: Place) -> Value:
            return start if held is None else f"fh[{plus(held, place)}]"

        arrivals = self.arrivals(anew, Anew(begins, self.plan.sent))
        arrivals.begin = self.step.at_stages[part.number, port.name].begin
        arrivals.finished = held is None or len(anew.connections) > 0  # else what is held is
        return arrivals

    # ---- stages ------------------------------------------------------------------------------------------------

    def substep(self, h: float) -> None:
        """A substep of so many seconds."""
        code, stages = self.code, STAGES[self.method]
        times, shares = ([made(one, h) for one in stages] for made in (self.time, self.share))
        if len(stages) == 1:
            with code.block(""):
                self.stage(times[0], shares[0], "sub == 0")
                if self.in_place:
                    self.change_in_place()
                elif self.method in _CHANGES:
                    self.changes(_CHANGES[self.method])
                else:
                    self.states(lambda own: [f"fx[i] = fx[i] + {own}*fk[i];"])
            return
        code.line(f"memcpy(fy, fx, {sum(one.size for one in self.plan.states)}*sizeof(fx[0]));")
        with code.block(code.loop("stage", len(stages))):
            self.stage(_by_stage(times), _by_stage(shares), "sub == 0 && stage == 0")
            if self.method == "heun":
                self.heun()
            else:
                self.rk4()

    def time(self, when: int, h: float) -> str:
        """The time of a stage."""
        code, inside = self.code, self.code.text(INSIDE * h)
        if when == BEGIN:
            return f"since + {inside}"
        return f"since + {code.text(h / 2.0)}" if when == MIDDLE else f"since + {code.text(h)} - {inside}"

    def share(self, when: int, h: float) -> str:
        """Which share of the step is over at a stage."""
        code, part = self.code, PARTS[when]
        if self.substeps == 1:
            return code.text(part)
        return f"(({code.real})sub + {code.text(part)})/{code.text(float(self.substeps))}"

    def changes(self, formula_: str) -> None:
        """x + the change; of all neurons state by state, since a branch within exprel then goes the same way in all."""
        for one in self.plan.states:
            with self.code.block(self.code.loop("i", one.start + one.size, one.start)):
                change: Value = "fk[i]"
                if self.varying[one.key]:
                    h = self.length(one.use.definition.per_second)
                    change = self.code.value(formula(formula_), {"h": h, "f": "fk[i]", "j": "fj[i]"})
                self.code.line(f"fx[i] = fx[i] + {self.code.text(change)};")

    def change_in_place(self) -> None:
        """The same of states whose derivatives and slopes are there; the others have changed with these."""
        for one in self.plan.states:
            if self.varying[one.key]:
                before, change = _BY_LOOPS[self.method]
                at, h = plus(one.start, "p"), self.length(one.use.definition.per_second)
                seen: dict[str, Value] = {"h": h, "f": f"fk[{at}]", "j": f"fj[{at}]", "e": f"fx[{at}]"}
                cell = self.step.states(one.use, "p")[one.name]
                made = [*((f"{array}[{at}]", "{}", text) for array, text in before), (cell, f"{cell} + {{}}", change)]
                for there, sum_, text in made:
                    with self.code.block(self.code.loop("p", one.size)):
                        value = self.code.text(self.code.value(formula(text), seen))
                        self.code.line(f"{there} = {sum_.format(value)};")

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

    def stage(self, at: str, share: str, first: str) -> None:
        """The derivatives at a time, which has this code, and at which this share of the step is over. Where ``first``
        holds it is the first one of the step."""
        with ExitStack() as clocks:
            clocks.enter_context(self.where_read("ts", at))
            clocks.enter_context(self.where_read("share", share))
            used = [one.use for one in self.plan.states] + [one.projection.use for one in self.plan.contacts]
            for unit in sorted({one.definition.per_second for one in used} - {1.0}):
                clocks.enter_context(self.where_read(_clock(unit), f"ts*{self.code.text(unit)}"))
            self.derivatives(first)

    def derivatives(self, first: str) -> None:
        """The inputs of a stage, what connections take at it, the derivatives."""
        self.inputs()
        if self.sight.ends.lags is not None and len(self.plan.lagging):
            # the second stage in the middle sees what the first one does
            with self.code.block("if (stage != 2)" if self.method == "rk4" else ""):
                write_arriving(self.step, self.sight.ends.lags, self.plan.lagging)
        parts = self.plan.of_stage
        for part, one in taken_in_order(parts):
            if not self.step.form.held and one.places[0] in self.plan.idle:
                continue
            with self.unless_there(part, one, first):
                self.neurons(part, one.formulas, partial(self.give, part, one))
        noisy = [part for part in parts if part.spread.trees]
        if noisy and self.plan.diffuses:
            with self.code.block(f"if ({first})"):
                for part in noisy:
                    self.neurons(part, part.spread, partial(self.spread, part))
        for part in parts:
            if part.flows:
                self.neurons(part, part.derivatives, partial(self.slope, part))
                self.let_rest(part)
        for contacts in self.plan.contacts:
            if contacts.flows:
                self.step.each(len(contacts.projection.members), {}, partial(self.joined, contacts))

    @contextmanager
    def unless_there(self, part: Part, one: Taken, first: str) -> Iterator[None]:
        """Lines that make what connections take, but where it is there from the end of the step before: then it is
        taken from there at the first stage."""
        code = self.code
        if not (self.step.form.follows and self.plan.lasts(part, one)):
            yield
            return

        def take(place: Place, totals: Mapping[int, str]) -> None:
            there = taken_at(self.network, code, one.places, place)
            code.line(f"fo[{code.at(self.plan.places[one.places], place)}] = {there};")

        with code.block(f"if (follows && {first})"):
            self.step.each(len(one.places), {}, take)
        with code.block("else"):
            yield

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

    def known(self, part: Part | Contacts, place: Place) -> dict[str, Value]:
        """What formulas of the model of a neuron see at a stage beside its ports, and those of a synapse or a rule
        beside both ends."""
        use = part.population.model if isinstance(part, Part) else part.projection.use
        per_second = use.definition.per_second
        known: dict[str, Value] = {**self.code.parameters(use, place), **self.step.states(use, place)}
        for name in () if self.in_place else part.flows:
            known[name] = f"{self.now}[{plus(self.plan.starts[Key(use.owner, name)], place)}]"
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

    def idle(self, part: Part | Contacts, name: str, place: Place) -> str:
        """The code of whether a flow state is held, or its connection does nothing; "" where it never is."""
        use = part.population.model if isinstance(part, Part) else part.projection.use
        held = self.step.held(use, name, place)
        found = [f"held[{held}]"] if held else []
        if isinstance(part, Contacts):
            form, connection = self.step.form, self.code.at(part.projection.members, place)
            if part.projection.kind == SYNAPSE:
                found += [f"gone[{connection}]"] if form.gone else []
            else:
                found += [f"still[{connection}]"] if form.still else []
        return found[0] if len(found) == 1 else f"({' || '.join(found)})" if found else ""

    def joined(self, contacts: Contacts, place: Place, totals: Mapping[int, str]) -> None:
        """The derivatives of the states of a connection, or what these change by."""
        derivatives = contacts.derivatives
        some = Some(contacts.number, np.arange(len(contacts.projection.members)), place)
        seen = self.sight.known(some, derivatives.names | contacts.slopes.names)
        self.slope(contacts, place, self.step.let(derivatives.let, seen, [tree for _, tree in derivatives.trees]), {})

    def through(
        self, part: Part, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]
    ) -> dict[str, str]:
        """What is added to the slopes of the states of a neuron for what synapses bring to its ports."""
        found = dict[str, str]()
        for one in part.through:
            ((_, tree),) = one.slope.trees
            further = tuple((name, between) for name, between in one.slope.let if name not in known)
            seen = self.step.let(further, known, [tree], functions)
            by = self.code.text(self.code.let("n", self.code.value(tree, seen, functions)))
            found[one.state] = f"{found.get(one.state, '')} + {by}*{self.back(part, one, place)}"
        return found

    def back(self, part: Part, through: Through, place: Place) -> str:
        """How much what synapses bring to a port of a neuron changes with one of its states."""
        slopes = {one.number: one.back for one in self.plan.contacts if through.state in dict(one.back.trees)}
        formulas = {
            number: one._replace(trees=((through.state, dict(one.trees)[through.state]),))
            for number, one in slopes.items()
        }
        step, forming = self.step, Forming(self.sight, formulas)
        form = replace(step.form, fused=False)  # these are summed here alone: no weights are packed in their order
        incoming = self.plan.back[part.number, through.port.name, through.state]
        arrivals = Arrivals(self.network, incoming, self.code, form, step.layout, forming)
        return self.code.text(self.code.let("u", arrivals.combined(place)))

    def slope(
        self, part: Part | Contacts, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]
    ) -> None:
        """The derivatives of the states of a neuron or a connection, or what these change by."""
        code, changes = self.code, _CHANGES.get(self.method)
        use = part.population.model if isinstance(part, Part) else part.projection.use
        diagonal = dict(part.slopes.trees)
        pausing = {name: self.pausing[key] for name in diagonal if (key := Key(use.owner, name)) in self.pausing}
        diagonal |= {name: slope.otherwise for name, (_, slope) in pausing.items()}
        more = tuple((name, tree) for name, tree in part.slopes.let if name not in known)
        known = self.step.let(more, known, [*diagonal.values()], functions)
        through = self.through(part, place, known, functions) if isinstance(part, Part) else {}
        made = list[tuple[str, Value]]()
        for name, tree in part.derivatives.trees:
            key = Key(use.owner, name)
            tree = pausing[name][0].otherwise if name in pausing else tree
            idle, at = self.idle(part, name, place), plus(self.plan.starts[key], place)
            slope = self.change_or_rest(key, use, place, known, functions)
            slope = code.value(tree, known, functions) if slope is None else slope
            if changes is not None and key not in self.resting:
                own_slope = code.value(diagonal[name], known, functions)
                if name in through:
                    own_slope = f"{code.text(code.let('n', own_slope))}{through[name]}"
                if self.varying[key]:
                    if idle:  # 0, so that the change is 0 even where this is NaN
                        own_slope = f"{idle} ? {code.text(0.0)} : {code.text(own_slope)}"
                    if self.in_place and name in pausing:
                        own_slope, slope = (
                            self.unless_at_rest(pausing[name][0], code.let("n", moved), known, functions)
                            for moved in (own_slope, slope)
                        )
                    code.line(f"fj[{at}] = {code.text(own_slope)};")
                else:
                    h = self.length(use.definition.per_second)
                    parts: dict[str, Value] = {"h": h, "f": code.let("n", slope), "j": own_slope}
                    slope = code.value(formula(changes), parts)
            if idle:
                slope = f"{idle} ? {code.text(0.0)} : {code.text(slope)}"
            is_whole = self.in_place and not self.varying[key]
            if is_whole:  # behind all that reads it
                made.append(self.changed(use, name, place, slope))
            else:
                code.line(f"fk[{at}] = {code.text(slope)};")
        self.step.store(made)

    def changed(self, use: Use, name: str, place: Place, change: Value) -> tuple[str, Value]:
        """Where a state of a member is kept, and what becomes of it, by what it changes by, or by its derivative."""
        code, cell = self.code, self.step.states(use, place)[name]
        added = code.text(code.let("n", change))
        if self.method not in _CHANGES:
            added = f"{code.text(self.length(use.definition.per_second))}*{added}"
        return cell, f"{cell} + {added}"

    def change_or_rest(
        self, key: Key, use: Use, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]
    ) -> Value | None:
        """What a state that members hold at rest changes by: in a loop as if none did (``let_rest``). None of other
        states."""
        if key not in self.resting:
            return None
        code, (derivative, slope) = self.code, self.resting[key]
        parts: dict[str, Value] = {"h": self.length(use.definition.per_second)}
        parts["j"] = code.value(slope.otherwise, known, functions)
        parts["f"] = code.let("n", code.value(derivative.otherwise, known, functions))
        moved = code.value(formula(_CHANGES[self.method]), parts)
        if self.in_place:
            moved = code.let("n", moved)
        elif not self.step.form.written_out:
            return moved
        return self.unless_at_rest(derivative, moved, known, functions)

    def unless_at_rest(
        self, derivative: Conditional, moved: Value, known: Mapping[str, Value], functions: Mapping[str, Made]
    ) -> Value:
        """What is said of a state that moves; 0 where it is at rest."""
        chosen = Conditional(derivative.condition, Number(0.0), Name("it moves"))
        return self.code.value(chosen, {**known, "it moves": self.code.text(moved)}, functions)

    def let_rest(self, part: Part) -> None:
        """What members that rest change by is 0: in a loop of its own, for compilers make vectors of a choice between
        numbers that are there, and not of one with a division in it."""
        owner = part.population.model.owner
        keys = [key for name in part.flows if (key := Key(owner, name)) in self.resting or key in self.pausing]
        if not keys or self.step.form.written_out or self.in_place:
            return

        def rest(place: Place, totals: Mapping[int, str]) -> None:
            functions = self.step.activation(part.population, place)
            for key in keys:
                (derivative, _), at = self.resting.get(key) or self.pausing[key], plus(self.plan.starts[key], place)
                for array in ("fj", "fk") if key in self.pausing else ("fk",):
                    value = self.unless_at_rest(derivative, f"{array}[{at}]", self.known(part, place), functions)
                    self.code.line(f"{array}[{at}] = {self.code.text(value)};")

        self.step.each(len(part.population.members), {}, rest)

    def spread(self, part: Part, place: Place, known: Mapping[str, Value], functions: Mapping[str, Made]) -> None:
        """What the noise of the states of a neuron is multiplied by."""
        for name, tree in part.spread.trees:
            value = self.code.text(self.code.value(tree, known, functions))
            key = Key(part.population.model.owner, name)
            self.code.line(f"fg[{plus(self.plan.starts[key], place)}] = {value};")


@dataclass(frozen=True, kw_only=True)
class _StageSight(Sight):
    """What formulas of connections see at a stage: of what flows, at both ends and of their own, what it is there."""

    plan: Plan

    def now(self, index: IntArray, place: Place) -> str:
        """An activity, an outlet or an input, as it is at the stage where it flows, else as it was left."""
        network, plan = self.network, self.plan
        more = {"fo": plan.parts_taken, "fv": network.vector_size if network.held_inputs else 0}
        more["fy" if "fy" in plan.parts else "fx"] = plan.count
        return taken_at(network, self.code, plan.now(index, direct=not self.form.held), place, more)

    def states(self, some: Some) -> dict[str, str]:
        """The states of a synapse or a rule at one connection; those that flow as they are at the stage."""
        found, use = super().states(some), self.network.projections[some.number].use
        place, stage = self.code.at(some.which, some.place), "fy" if "fy" in self.plan.parts else "fx"
        for name in found:
            key, at = Key(use.owner, name), place
            if (once := self.ends.kept.get(key)) is not None:
                key, at = Key(once.owner, name), self.among_kept(once, some.place, some.which)
            if (start := self.plan.starts.get(key)) is not None:
                found[name] = f"{stage}[{plus(start, at)}]"
        return found

    def clock(self, made: Definition) -> dict[str, Value]:
        """The time of the stage, and how long a step is, in the unit of a definition."""
        return {"t": _clock(made.per_second), "dt": self.network.dt * made.per_second}

    def behind(self, projection: Projection) -> dict[str, str]:
        """None: all is that of the stage."""
        return {}

    def past_or_now(self, some: Some, end: End) -> Value:
        """What was sent as long ago as the delay is: with a continuous one before this share of the step was over."""
        connections, place = self.network.projections[some.number].members[some.which], some.place
        if self.ends.lags is None or not own_of(self.late(connections), place).any():
            return super().past_or_now(some, end)
        code, lags, index = self.code, self.ends.lags.some(connections), end.places[some.which]
        q, back = code.let("q", f"share - {code.text(code.number(lags.part, place))}"), code.at(lags.whole + 1, place)
        slot, ago = code.name("i"), code.name("i")
        code.head["now"] = f"const int32_t now = (int32_t)(k % {self.ends.depth});"
        code.line(f"const int32_t {slot} = nv_slot(now, {back}, {self.ends.depth}, {q});")
        code.line(f"const int32_t {ago} = {back} + ({q} < {code.text(0.0)});")
        steps = [(ago, slot), (f"{ago} - 1", f"nv_next({slot}, {self.ends.depth})")]
        sent = [self.remembered(connections, index, place, *one) for one in steps]
        between = f"nv_between({', '.join(sent)}, {q})"
        if own_of(self.late(connections), place).all():
            return code.let("a", between)
        late = code.at(lags.there.astype(np.int64), place)
        return code.let("a", f"{late} ? {between} : {code.text(super().past_or_now(some, end))}")


def _by_stage(values: Sequence[str]) -> str:
    """Of the codes of a value at each stage that of the stage."""
    at = values[-1]
    for number in range(len(values) - 2, -1, -1):
        if values[number] != values[number + 1]:
            at = f"stage <= {number} ? {values[number]} : {at}"
    return at


def _clock(per_second: float) -> str:
    """The name of the time of a stage, in units of which a second has so many."""
    return "ts" if per_second == 1.0 else f"ts{per_second:.0f}"


@write.register
def _integrate(operation: Integrate, step: StepCode) -> None:
    with step.unless_first():
        _Integration(step).write()


@write.register
def _send_ahead(operation: SendAhead, step: StepCode) -> None:
    """What connections take of a population, where flow states are all that it is made of."""
    code, number = step.code, operation.population
    population = step.network.populations[number]
    use = population.model

    def shown(place: Place, totals: Mapping[int, str]) -> None:
        step.hold_states(use, place)
        neuron, functions = code.at(population.members, place), step.activation(population, place)
        seen: Mapping[str, Value] = {
            **code.parameters(use, place), **step.sight.clock(use.definition), **step.states(use, place),
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
    plan, code, network = step.plan, step.code, step.network
    assert plan is not None
    with step.unless_first():
        for one in plan.states:
            part = one.part
            if not isinstance(part, Part) or one.name not in dict(part.spread.trees):
                continue
            drawn = network.noise_of(state=one.name)[part.population.members]
            root = code.text(math.sqrt(network.dt * one.use.definition.per_second))

            def disturb(
                place: Place,
                totals: Mapping[int, str],
                one: FlowState = one,
                drawn: IntArray = drawn,
                root: str = root,
            ) -> None:
                cell, spread = step.states(one.use, place)[one.name], f"fg[{plus(one.start, place)}]"
                if held := step.held(one.use, one.name, place):
                    code.line(f"if (!held[{held}])")
                code.line(f"{cell} = {cell} + {spread}*{root}*s[{code.at(drawn, place)}];")

            step.each(one.size, {}, disturb)
