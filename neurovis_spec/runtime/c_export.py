"""A network as C for a robot: one header and one source, without heap and without variables that change.

In: a Network, the State that it begins in, the type of numbers. Out: the texts of the files. The step is that of the C
backend; around it stand what is done in Python elsewhere: inputs, noise, events, the setting of parameters. Everything
that changes is in a struct of the caller's. Events of step 0 happen in ``NAME_init``; those of step k + 1 at the end of
step k, when ``state->k`` is that of the step to come.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.events.changes import Change, Clamp
from neurovis_spec.compiler.events.settable import table_of
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Input, Network, Noise, Spikes
from neurovis_spec.compiler.program import SYNAPSE, Owner
from neurovis_spec.compiler.run_checks import without_checks
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.language.expressions.emit_c import Emitter, Value
from neurovis_spec.language.expressions.tree import Draw, Tree
from neurovis_spec.runtime import c_plan
from neurovis_spec.runtime.beginning import Rewind, slots_of
from neurovis_spec.runtime.c_backend import SMALL
from neurovis_spec.runtime.c_code import Code, Form, Tables, function, state_name, words_of
from neurovis_spec.runtime.c_draws import drawing
from neurovis_spec.runtime.c_names import LONGEST_STRING, identifiers, prefix, string, words
from neurovis_spec.runtime.c_settable import ExportError, fixed, formula, write_follow
from neurovis_spec.runtime.c_step import Built, StepCode, begins_otherwise, write_input
from neurovis_spec.runtime.columns import named_signals, probe_of, spiking_of
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.lags import ring_lengths
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import NEVER_LOST, Mask, State, by_kind, initial_state, kept_as


@dataclass(frozen=True)
class Phase:
    """What is held and left out from a step on, by events: at that step ``gone``, ``cut``, ``still`` and ``lost`` are
    those of Structure, ``order`` and ``clamps`` those of Held."""

    #: the step, −1 for what is so before any
    at: int
    #: of each neuron the order of the clamp that holds it, −1 for none
    order: tuple[int, ...]
    lesioned: Mask
    gone: Mask
    cut: Mask
    still: Mask
    lost: IntArray
    #: the clamps that hold, by their order
    clamps: Mapping[int, Clamp]


@dataclass(frozen=True)
class Member:
    """A member of the struct: an array of numbers."""

    name: str
    #: what it begins with
    begin: FloatArray
    #: what it is, for the comment beside it
    about: str


#: What the members of the struct that hold states are of.
_STATES = {"cells": "states of models", "traces": "states of rules", "synapse": "states of synapses"}


class _Computing(NamedTuple):
    """Lines of functions, and how many numbers of ``work`` these put together what arrives in."""

    lines: list[str]
    room: int


class Exported:
    """The C of one network."""

    def __init__(self, network: Network, start: State | None = None, real: str = "double") -> None:
        settable, kept_slots = fixed(network.settable)
        self.network, self.real = replace(without_checks(network), settable=settable), real
        self.name = prefix(network.name)
        self.macro = self.name.upper()
        self.state = (initial_state(network, own_signals=True) if start is None else start).copy()
        self.emitter, self.tables = Emitter(real), Tables(real, None)
        #: the kinds of draws that noise makes, whose functions the source needs
        self.kinds: set[str] = set()
        self.inputs = [one for one in network.inputs if not one.has_source]
        self.input_names = identifiers(one.name for one in self.inputs)
        self.output_names = identifiers(one.name for one in network.outputs)
        slots = network.settable.index
        free = [name for name in network.parameters if name not in network.structural and name in slots]
        self.settable = [name for name in free if slots[name] not in kept_slots]
        #: parameters that keep their values in C, and could be set in a run; what follows each
        self.kept_parameters: Mapping[str, str] = {
            name: kept_slots[slots[name]] for name in free if slots[name] in kept_slots
        }
        self._check_events(kept_slots)
        if signals := named_signals(network):
            problem = (
                f"the output '{signals[0]}' is of signals of synapses, which exported C does not form by themselves"
            )
            raise ExportError(f"{problem}: export the network without this output")
        self.settable_names = identifiers(self.settable)
        self._controls = Controls(self.network)
        self.phases = self._phases()
        #: whether any phase holds neurons
        self.holding = any(any(order >= 0 for order in phase.order) or phase.lesioned.any() for phase in self.phases)
        n = len(network.neurons)
        of_neurons = network.clampable_of_neurons
        #: whether any holds states of models, and of rules and synapses, and how many numbers can be held
        self.fixing = any(order >= 0 for phase in self.phases for order in phase.order[n:of_neurons])
        self.fixing_joined = any(order >= 0 for phase in self.phases for order in phase.order[of_neurons:])
        self.clampable = network.clampable if self.fixing_joined else of_neurons if self.fixing else n
        fires = any(one.model.definition.fires for one in network.populations)
        #: which neurons spike, where a model has a ``spike`` block
        self.spiking = spiking_of(network) if fires else None
        self.built = Built(self.network, signal_layout(network, own=True))

    # ---- what there is -----------------------------------------------------------------------------------------

    def _check_events(self, kept_slots: Mapping[int, str]) -> None:
        """Refuse events that set what keeps its value. Raises ExportError."""
        for change in self.network.changes:
            for slot, _ in change.parameters:
                if slot in kept_slots:
                    name = self.network.settable.slots[slot].name
                    problem = f"an event sets '{name}' at step {change.at}, and C cannot work out what follows it"
                    raise ExportError(f"{problem} ({kept_slots[slot]}): export the network without this event")

    def _phases(self) -> list[Phase]:
        """What is held and left out after the events of each step, as in a run; no parameter decides that."""
        network, controls = self.network, self._controls
        state = self.state.copy()
        phases = [self._phase(-1, state)]
        with np.errstate(all="ignore"):
            for change in network.changes:
                if _only_sets(change):
                    continue
                state.k = change.at
                # what is set changes nothing of this; it is done in C
                controls.apply(state, change._replace(parameters=()))
                phases.append(self._phase(change.at, state))
        return phases

    def _phase(self, at: int, state: State) -> Phase:
        """The phase that begins with a state."""
        now = state.conditions
        order = tuple(now.held.order.tolist())
        structure = now.structure
        lesioned, clamps = now.lesioned_neurons.copy(), dict(now.held.active)
        return Phase(
            at,
            order,
            lesioned,
            gone=structure.gone,
            cut=structure.cut,
            still=structure.still,
            lost=structure.lost,
            clamps=clamps,
        )

    @cached_property
    def members(self) -> list[Member]:
        """The arrays of the struct, without those that are empty. Raises ExportError."""
        network, state = self.network, self.state
        # the state may have checks of a run, which this network has not
        cells = {
            use.owner: {quantity.name: state.cells[use.owner][quantity.name] for quantity in use.definition.kept}
            for _, use in network.uses
        }
        members = [
            Member("activity", state.activity, "a[k - 1] of all neurons"),
            Member("weights", state.weights, "w[k] of all connections"),
            Member("signals", state.signals, "what is under way on delayed connections"),
            Member("history", state.history.ravel(), self._about_history()),
            Member("outlets", state.outlets, "what connections take beside activities"),
            *(
                Member(kept, np.concatenate([np.zeros(0), *arrays]), _STATES.get(kept, "states"))
                for kept, arrays in by_kind(cells).items()
            ),
            Member("parameters", state.conditions.parameters, "parameters of the spec and of its instances"),
            Member("variables", state.conditions.variables, "numbers that follow parameters"),
            Member("vector", np.zeros(network.vector_size), "the inputs and the noise of a step"),
            Member("work", np.zeros(c_plan.work_size(self.built.plan) + self._computing.room), self._about_work()),
        ]
        if self.holding:
            about = "what neurons are held at" + (", then states" if self.clampable > len(self.network.neurons) else "")
            members.append(Member("holding", np.zeros(self.clampable), about))
        return [member for member in members if len(member.begin) or member.name in ("activity", "weights")]

    def _about_work(self) -> str:
        """What is kept within a step."""
        return "what is put together" if self.built.plan is None else "what an integration keeps between stages"

    def _about_history(self) -> str:
        """What the history is."""
        joined = any(one.kind == SYNAPSE for one in self.network.projections)
        return "what was sent in the past, for synapses and rules" if joined else "past activities, for rules"

    @property
    def marks_lesioned(self) -> bool:
        """Whether the struct says which neurons are lesioned: their activities are held, of what else they are worth
        outlets and spikes are 0."""
        told = bool(self.network.outlets) or (self.spiking is not None and len(self.spiking.by_state) > 0)
        return self.holding and told

    @property
    def _rewinding(self) -> bool:
        """Whether events put anything back to its beginning."""
        return any(len(change.reset) for change in self.network.changes)

    @property
    def takes_initial(self) -> bool:
        """Whether neurons take ``initial`` at step 0, or are not integrated there."""
        return not self.state.continued and begins_otherwise(self.network)

    # ---- the header --------------------------------------------------------------------------------------------

    def header(self) -> str:
        """The text of NAME.h."""
        network, name, macro = self.network, self.name, self.macro
        n, m = len(network.neurons), len(network.connections)
        inputs = [(c_name, entry.size) for c_name, entry in zip(self.input_names, self.inputs, strict=True)]
        outputs = [(c_name, entry.size) for c_name, entry in zip(self.output_names, network.outputs, strict=True)]
        setters = "".join(map(self._setter, self.settable, self.settable_names))
        return f"""/*
 * {words(network.title or network.name)}
 *
 * A network of {plural(n, "neuron")} and {plural(m, "connection")}, made by neurovis export. C99 and C++17; needs libm.
 */
#ifndef {macro}_H
#define {macro}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {{
#endif

#define {macro}_NEURONS {n}
#define {macro}_CONNECTIONS {m}
#define {macro}_SPEC_HASH "{network.hash}"

/* The names of the neurons, in order. */
extern const char *const {name}_neuron_names[{max(n, 1)}];

/* All that changes. Copy it to keep a state, and copy it back to go on from there. */
{self._struct("state", self._state_fields())}

/* The inputs of a step that have no source of their own. */
{self._struct("inputs", [f"{self.real} {c_name}[{size}];" for c_name, size in inputs])}

/* The outputs of a step. */
{self._struct("outputs", [f"{self.real} {c_name}[{size}];" for c_name, size in outputs])}

/* Make a state ready for step 0, whatever its memory holds. */
void {name}_init({name}_state *state);

/* Make one step. in may be NULL: its inputs are 0. out may be NULL. */
void {name}_step({name}_state *state, const {name}_inputs *in, {name}_outputs *out);
{self._fired_declared()}{setters}
#ifdef __cplusplus
}}
#endif

#endif
"""

    def _struct(self, kind: str, fields: Sequence[str]) -> str:
        """The type NAME_kind, of these fields."""
        within = "".join(f"    {field}\n" for field in fields or ["char unused;"])
        return f"typedef struct {self.name}_{kind} {{\n{within}}} {self.name}_{kind};"

    def _state_fields(self) -> list[str]:
        """The lines of the struct. C has no empty arrays: one that is empty gets a number."""
        fields = [
            f"{self.real} {member.name}[{len(member.begin)}]; /* {member.about} */"
            if len(member.begin)
            else f"{self.real} {member.name}[1]; /* there are none */"
            for member in self.members
        ]
        fields.append("int64_t k; /* the step to come */")
        if slots := len(self.network.settable.slots):
            fields.append(f"unsigned char chosen[{slots}]; /* parameters that were set */")
        if len(self.phases) > 1:
            fields.append("int32_t phase; /* events that have happened */")
        if self.holding:
            about = "neurons that are held" + (", then states" if self.clampable > len(self.network.neurons) else "")
            fields.append(f"unsigned char held[{self.clampable}]; /* {about} */")
            if self.marks_lesioned:
                fields.append(f"unsigned char lesioned[{len(self.network.neurons)}]; /* neurons that are lesioned */")
        return fields

    def _setter(self, parameter: str, c_name: str) -> str:
        """The declaration of the function that sets a parameter; ``c_name`` is its name in C."""
        return f"""
/* Set the parameter {words(parameter, 40)} from the next step on, and what follows it. Gives 1; or
   0, and nothing has changed, where a number would not be finite or leave its bounds. */
int {self.name}_set_{c_name}({self.name}_state *state, {self.real} value);
"""

    def _fired_declared(self) -> str:
        """The declaration of the function that says who has fired; "" where nobody can."""
        if self.spiking is None:
            return ""
        return f"""
/* Say which neurons have fired in the last step: 1 of each that has, 0 of all others. Gives how many have. */
{self._fired_head};
"""

    @property
    def _fired_head(self) -> str:
        """Its head."""
        count = len(self.network.neurons)
        return f"int32_t {self.name}_fired(const {self.name}_state *state, unsigned char fired[{count}])"

    # ---- the source --------------------------------------------------------------------------------------------

    def source(self) -> str:
        """The text of NAME.c. Raises ExportError."""
        body = [*self._computing.lines, "", *self._init(), "", *self._step(), *self._fired()]
        for parameter, c_name in zip(self.settable, self.settable_names, strict=True):
            body += ["", *self._set(parameter, c_name)]
        if self.holding:
            body = [*self._hold(), "", *body]
        used = words_of(body)
        parts = [
            f"/* {words(self.network.title or self.network.name)}: made by neurovis export, see {self.name}.h. */",
            f'#include "{self.name}.h"',
            "#include <math.h>\n#include <stddef.h>\n#include <string.h>",
            _restrict(self.macro) if f"{self.macro}_RESTRICT" in used else "",
            self._names(),
            self.emitter.helpers(used),
            drawing(self.kinds.union({"poisson"} if "nv_poisson" in used else ())),
            self.tables.text(used),
            "\n".join(body),
        ]
        return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"

    @cached_property
    def _computing(self) -> _Computing:
        """What ``NAME_step`` calls. Raises ExportError."""
        lines: list[str] = []
        if self.network.settable.slots:
            lines += [*self._follow(), ""]
        if self.network.changes:
            lines += [*self._events(), ""]
        if self._rewinding:
            lines += [*self._rewinds(), ""]
        if self.network.vector_size:
            lines += [*self._sense(), ""]
        step = self._compute()
        return _Computing([*lines, *step.lines], step.room)

    def _names(self) -> str:
        """The names of the neurons; those that are too long for a literal as arrays."""
        before, items = [], []
        for number, name in enumerate(self.network.neurons.names):
            data = name.encode()
            if len(data) <= LONGEST_STRING // 4:
                items.append(f"    {string(name)},")
                continue
            codes = ", ".join(f"(char){byte if byte < 128 else byte - 256}" for byte in (*data, 0))
            before.append(f"static const char name{number}[{len(data) + 1}] = {{{codes}}};")
            items.append(f"    name{number},")
        count = max(len(items), 1)
        head = f"const char *const {self.name}_neuron_names[{count}] = {{"
        return "\n".join([*before, head, *(items or ["    0,"]), "};"])

    def _code(self) -> Code:
        return Code(self.emitter, self.tables, self.network.dt, self.network.settable.variables)

    def _pointer_lines(self) -> dict[str, str]:
        """For each array of the state, and its parts, the line that gives it its name."""
        network, real, quick = self.network, self.real, f"{self.macro}_RESTRICT"
        pointer_lines = {
            name: f"{real} *{quick} const {name} = state->{name};"
            for name in ("activity", "weights", "signals", "history", "outlets")
        }
        pointer_lines |= c_plan.pointer_lines(self.built.plan, real, quick, "state->work")
        pointer_lines["fresh"] = f"const int fresh = {int(not self.state.continued)};"
        pointer_lines["lesioned"] = f"const unsigned char *{quick} const lesioned = state->lesioned;"
        pointer_lines["x"] = f"{real} *{quick} const x = state->variables;"
        pointer_lines["s"] = f"const {real} *{quick} const s = state->vector;"
        pointer_lines["holding"] = f"const {real} *{quick} const holding = state->holding;"
        pointer_lines["held"] = f"const unsigned char *{quick} const held = state->held;"
        pointer_lines["parameters"] = f"const {real} *const parameters = state->parameters;"
        for _, use in network.uses:
            for i, quantity in enumerate(use.definition.kept):
                name, (kept, start) = state_name(use.owner, i), self._state_starts[use.owner, quantity.name]
                pointer_lines[name] = f"{real} *{quick} const {name} = state->{kept} + {start};"
        return pointer_lines

    @cached_property
    def _state_starts(self) -> Mapping[tuple[Owner, str], tuple[str, int]]:
        """For each state of an owner the array of the struct that holds it, and where it begins there."""
        starts: dict[tuple[Owner, str], tuple[str, int]] = {}
        lengths: dict[str, int] = {}
        for holder, use in self.network.uses:
            kept = kept_as(use.owner.kind)
            for quantity in use.definition.kept:
                starts[use.owner, quantity.name] = kept, lengths.get(kept, 0)
                lengths[kept] = lengths.get(kept, 0) + len(holder.members)
        return starts

    def _left_out(self) -> dict[str, tuple[str, list[npt.NDArray[np.integer]]]]:
        """Those of ``gone``, ``cut``, ``still`` and ``lost`` that a step has to look at, as events leave something out
        by them: the type in C, and the array in each phase."""
        phases, found = self.phases, dict[str, tuple[str, list[npt.NDArray[np.integer]]]]()
        for name in ("gone", *(["cut"] if self.network.fed else []), "still"):
            masks: list[Mask] = [getattr(phase, name) for phase in phases]
            if any(mask.any() for mask in masks):
                found[name] = "unsigned char", [mask.astype(np.uint8) for mask in masks]
        if any((phase.lost > NEVER_LOST).any() for phase in phases):
            first = -int(ring_lengths(self.network).max())  # nothing is read of before
            found["lost"] = "int64_t", [np.maximum(phase.lost, first) for phase in phases]
        return found

    def _compute(self) -> _Computing:
        """The step itself."""
        network, code, pointer_lines = self.network, self._code(), self._pointer_lines()
        left_out = self._left_out()
        form = Form(
            written_out=len(network.neurons) + len(network.connections) <= c_plan.written_out(self.built.plan, SMALL),
            first=self.takes_initial,
            held=self.holding,
            fixed=self.fixing,
            fixed_joined=self.fixing_joined,
            gone="gone" in left_out,
            cut="cut" in left_out,
            still="still" in left_out,
            lost="lost" in left_out,
        )
        step = StepCode(self.built, code, form)
        step.write()
        before: list[str] = []
        for name in sorted(left_out.keys() & words_of(code.lines)):  # what never learns asks for none that is still
            kind, phases = left_out[name]
            lines, which = _by_phase(name, kind, phases)
            before += lines
            pointer_lines[name] = f"const {kind} *const {name} = {which};"
        if self.takes_initial:
            code.head["first"] = "const int first = k == 0;"
        lines = self._function(code, "What a step computes.", "void nv_compute", pointer_lines)
        return _Computing([*before, *lines], step.room)

    def _function(
        self, code: Code, about: str, declaration: str, pointer_lines: dict[str, str], more: str = ""
    ) -> list[str]:
        """A function of our own over a state; ``declaration`` is its type and name, ``more`` its further parameters."""
        head = f"static {declaration}({self.name}_state *state{more})"
        lines = function(code, head, {"k": "const int64_t k = state->k;", **pointer_lines})
        if "state" not in words_of(lines[1:]):
            lines.insert(2, "    (void)state;")
        return [f"/* {about} */", *lines]

    def _hold(self) -> list[str]:
        """What neurons are held at, by the parameters of now."""
        code = self._code()
        code.line("memset(state->held, 0, sizeof state->held);")
        if self.marks_lesioned:
            code.line("memset(state->lesioned, 0, sizeof state->lesioned);")
        switch = len(self.phases) > 1
        for number, phase in enumerate(self.phases):
            order = np.array(phase.order)
            order[: len(phase.lesioned)][phase.lesioned] = -1
            if (order < 0).all() and not phase.lesioned.any():
                continue
            with code.block(f"if (state->phase == {number})" if switch else ""):
                for clamp in sorted(set(order[order >= 0].tolist())):
                    value = code.text(formula(code, phase.clamps[clamp].value, 0))
                    held, fires = order == clamp, self.network.held_as_spikes
                    self._hold_at(code, np.flatnonzero(held & ~fires), value)
                    self._hold_at(code, np.flatnonzero(held & fires), f"({value}) != 0")
                if phase.lesioned.any():
                    self._hold_at(code, np.flatnonzero(phase.lesioned), code.text(0.0))
                    if self.marks_lesioned:
                        with code.block(code.loop("i", int(phase.lesioned.sum()))):
                            code.line(f"state->lesioned[{code.at(np.flatnonzero(phase.lesioned), 'i')}] = 1;")
        return self._function(code, "What neurons are held at.", "void nv_hold", self._pointer_lines())

    def _hold_at(self, code: Code, neurons: IntArray, value: str) -> None:
        """The lines that hold some neurons at a value, if there are any."""
        if not len(neurons):
            return
        name = code.variable("n", value)
        with code.block(code.loop("i", len(neurons))):
            neuron = code.at(neurons, "i")
            code.line(f"state->held[{neuron}] = 1;")
            code.line(f"state->holding[{neuron}] = {name};")

    def _follow(self) -> list[str]:
        """What follows parameters that are set."""
        code = self._code()
        write_follow(code, self.network.settable)
        pointer_lines = {name: line for name, line in self._pointer_lines().items() if name != "parameters"}
        more = f", {self.real} *parameters, unsigned char *changed"
        about = "What follows parameters that change: gives 0, and changes nothing, where it cannot be."
        return self._function(code, about, "int nv_follow", pointer_lines, more)

    def _begin_setting(self, code: Code) -> None:
        """The lines that copy the parameters, to be set or given up as a whole, and make room for ``changed``."""
        count = len(self.network.settable.slots)
        code.line(f"{self.real} parameters[{count}];")
        code.line(f"unsigned char changed[{count}];")
        code.line("memcpy(parameters, state->parameters, sizeof parameters);")
        code.line("memset(changed, 0, sizeof changed);")

    def _events(self) -> list[str]:
        """What the events of the step to come change."""
        code, phase = self._code(), 0
        code.line("switch (state->k) {")
        for change in self.network.changes:
            after = phase if _only_sets(change) else phase + 1
            code.line(f"case {change.at}: {{")
            code.indent += 1
            if change.parameters:
                self._begin_setting(code)
                values = [code.text(formula(code, one, 0, "state->parameters")) for _, one in change.parameters]
                for (slot, _), value in zip(change.parameters, values, strict=True):
                    code.line(f"parameters[{slot}] = {value};")
                    code.line(f"changed[{slot}] = 1;")
                code.line("if (nv_follow(state, parameters, changed)) {")
                for slot, _ in change.parameters:
                    code.line(f"    state->chosen[{slot}] = 1;")
                code.line("}")
            if len(change.reset):
                self._silence(code, self._controls.beginnings.rewind(change.reset).lost)
            if after != phase:
                self._silence(code, np.flatnonzero(self.phases[phase].cut & ~self.phases[after].cut))
                code.line(f"state->phase = {after};")
            if self.holding:
                code.line("nv_hold(state);")
            code.line("break;")
            code.indent -= 1
            code.line("}")
            phase = after
        code.line("default:")
        code.line("    break;")
        code.line("}")
        return self._function(code, "What events change at the step to come.", "void nv_events", {})

    def _silence(self, code: Code, connections: IntArray) -> None:
        """Nothing is under way on connections."""
        places, _ = slots_of(signal_layout(self.network, own=True), connections)
        self._put(code, "signals", places, np.zeros(len(places)))

    def _rewinds(self) -> list[str]:
        """What goes back to its beginning at the step to come, just before that is made."""
        code = self._code()
        code.line("switch (state->k) {")
        for change in self.network.changes:
            if len(change.reset):
                code.line(f"case {change.at}: {{")
                code.indent += 1
                self._rewind(code, self._controls.beginnings.rewind(change.reset))
                code.line("break;")
                code.indent -= 1
                code.line("}")
        code.line("default:")
        code.line("    break;")
        code.line("}")
        return self._function(code, "What goes back to its beginning at the step to come.", "void nv_rewind", {})

    def _rewind(self, code: Code, rewind: Rewind) -> None:
        """Neurons go back to their beginning, but for what is lost."""
        network, depth = self.network, len(self.state.history)
        self._put(code, "activity", rewind.neurons, rewind.activity)
        self._put(code, "outlets", rewind.outlet_places, rewind.outlets)
        for key, (members, values) in rewind.cells.items():
            assert key.owner is not None
            kept, start = self._state_starts[key.owner, key.name]
            self._put(code, kept, members + start, values)
        places, each = slots_of(signal_layout(network, own=True), rewind.steady)
        if len(places):
            with code.block(code.loop("i", len(places))):
                weight = f"state->weights[{code.at(rewind.steady[each], 'i')}]"
                sent = code.text(code.number(rewind.sent[each], "i"))
                code.line(f"state->signals[{code.at(places, 'i')}] = {weight}*{sent};")
        rows = np.arange(depth).reshape(-1, 1) * (len(network.neurons) + network.outlet_count)
        columns = (rows + rewind.columns).ravel()
        self._put(code, "history", columns, np.tile(rewind.column_values, depth))

    def _put(self, code: Code, array: str, places: IntArray, values: FloatArray) -> None:
        """The lines that put numbers into an array of the struct."""
        if len(places):
            code.line(code.loop("i", len(places)))
            value = code.text(code.number(values, "i"))
            code.line(f"    state->{array}[{code.at(places, 'i')}] = {value};")

    def _sense(self) -> list[str]:
        """The inputs and the noise of a step."""
        code, network = self._code(), self.network
        for number, entry in enumerate(network.inputs):
            if entry.is_drawn:
                self._rates(code, entry)
            elif entry.expression is not None:
                write_input(code, network, entry, "v")
            elif entry.spikes is not None:
                self._spikes(code, entry, entry.spikes)
            elif entry.table is not None:
                self._row(code, number, entry)
        for c_name, entry in zip(self.input_names, self.inputs, strict=True):
            code.line(code.loop("i", entry.size))
            code.line(f"    v[{entry.start} + i] = in != NULL ? in->{c_name}[i] : {code.text(0.0)};")
        for name, first in network.settable.feeds.items():
            self._fed(code, network.input_index[name], first)
        for noise in network.noises:
            self._noise(code, noise)
        if not self.inputs:
            code.line("(void)in;")
        pointer_lines = {**self._pointer_lines(), "v": f"{self.real} *const v = state->vector;"}
        more = f", const {self.name}_inputs *in"
        return self._function(code, "The inputs and the noise of a step.", "void nv_sense", pointer_lines, more)

    def _fed(self, code: Code, entry: Input, first: int) -> None:
        """The lines that put what events feed an input in the place of what it is else; ``first`` is the slot that says
        whether they do."""
        held = self.network.held_inputs.get(entry.name)
        if held is not None:
            code.line(f"v[{held}] = parameters[{first}];")
        code.line(f"if (parameters[{first}] != {code.text(0.0)})")
        code.line(f"    memcpy(v + {entry.start}, parameters + {first + 1}, {entry.size}*sizeof(v[0]));")

    def _row(self, code: Code, number: int, entry: Input) -> None:
        """The lines that take an input's row of this step from its table; behind the last row, the last."""
        assert entry.table is not None
        rows, size = len(entry.table), entry.size
        with code.block(""):
            code.line(f"const int32_t row = k < {rows} ? (int32_t)k : {rows - 1};")
            variable = self.network.settable.variables.get(table_of(number))
            if variable is None:
                value = f"{code.tables.name(entry.table.ravel())}[row*{size} + i]"
            else:
                value = f"x[{variable.start} + row*{size} + i]" if variable.size > 1 else f"x[{variable.start}]"
            if "row" not in value:
                code.line("(void)row;")
            code.line(code.loop("i", size))
            code.line(f"    v[{entry.start} + i] = {value};")

    def _noise(self, code: Code, noise: Noise) -> None:
        """The lines that draw a noise: each number from the stream's key, the member, the step and the draw."""
        stream = Stream(self.network.seed, "noise", noise.name)
        known: dict[str, Value] = {**noise.parameters, **{n: f"parameters[{slot}]" for n, slot in noise.slots.items()}}
        self._each_drawn(code, stream, noise.expression, known, noise.start, len(noise.members))

    def _rates(self, code: Code, entry: Input) -> None:
        """The lines that draw an input, in the same way."""
        assert entry.expression is not None
        stream = Stream(self.network.seed, "input", entry.name)
        slots: dict[str, Value] = {name: f"parameters[{slot}]" for name, slot in entry.slots.items()}
        self._each_drawn(code, stream, entry.expression, {**self.network.parameters, **slots}, entry.start, entry.size)

    def _spikes(self, code: Code, entry: Input, spikes: Spikes) -> None:
        """The lines that count the spikes of a step: the first of them is searched in their ascending steps."""
        steps = spikes.steps(self.network.dt)
        reached = steps < np.iinfo(np.int32).max  # further than the index of a table goes nobody gets
        steps, indices, count = steps[reached], spikes.indices[reached], int(np.count_nonzero(reached))
        code.line(code.loop("i", entry.size))
        code.line(f"    v[{entry.start} + i] = {code.text(0.0)};")
        if not count:
            return
        of = code.tables.name(steps)
        with code.block(""):
            code.line(f"int32_t low = 0, high = {count};")
            with code.block("while (low < high)"):
                code.line("const int32_t middle = low + (high - low)/2;")
                code.line(f"if ({of}[middle] < k)")
                code.line("    low = middle + 1;")
                code.line("else")
                code.line("    high = middle;")
            code.line(f"for (; low < {count} && {of}[low] == k; low++)")
            code.line(f"    v[{entry.start} + {code.tables.name(indices)}[low]] += {code.text(1.0)};")

    def _each_drawn(
        self, code: Code, stream: Stream, tree: Tree, known: Mapping[str, Value], start: int, count: int
    ) -> None:
        """The lines that draw so many numbers, from ``start`` on in the vector of a step, by a formula of i and n."""
        low, high = stream.key
        step = f"(uint32_t)(k + {self.state.drawn})" if self.state.drawn else "(uint32_t)k"

        def drawn(node: Draw, first: Value, second: Value) -> Value:
            kind = "normal" if node.kind == "normal" else "uniform"
            self.kinds.add(kind)
            number = f"nv_{kind}(UINT32_C({low}), UINT32_C({high}), (uint32_t)i, {step}, {node.index})"
            if node.kind == "poisson":
                number = f"nv_poisson({code.text(first)}, {number})"
                return code.let("d", f"(float){number}" if self.real == "float" else number)
            number = f"(float){number}" if self.real == "float" else number
            a, b = code.text(first), code.text(second)
            if node.kind == "uniform":
                return code.let("d", f"({a}) + (({b}) - ({a}))*{number}")
            drawn = f"({a}) + ({b})*{number}"
            return code.let("d", drawn if isinstance(second, float) and second >= 0 else f"({b}) < 0 ? NAN : {drawn}")

        known = {**known, "i": f"({self.real})i", "n": float(count)}
        with code.block(code.loop("i", count)):
            value = code.value(tree, known, {}, drawn)
            code.line(f"v[{start} + i] = {code.text(value)};")

    def _init(self) -> list[str]:
        """All members of the state."""
        code = self._code()
        for member in self.members:
            array = np.ascontiguousarray(member.begin, dtype=np.float64)
            if not array.view(np.int64).any():  # nothing but zeros
                code.line(f"memset(state->{member.name}, 0, sizeof state->{member.name});")
            else:
                code.line(f"memcpy(state->{member.name}, {self.tables.name(array)}, sizeof state->{member.name});")
        code.line("state->k = 0;")
        if self.network.settable.slots:
            code.line("memset(state->chosen, 0, sizeof state->chosen);")
            for slot in np.flatnonzero(self.state.conditions.was_set).tolist():
                code.line(f"state->chosen[{slot}] = 1;")
        if len(self.phases) > 1:
            code.line("state->phase = 0;")
        if self.holding:
            code.line("nv_hold(state);")
        if self.network.changes:
            code.line("nv_events(state);")
        return function(code, f"void {self.name}_init({self.name}_state *state)", {})

    def _step(self) -> list[str]:
        """The step with all that belongs to it."""
        code, name = self._code(), self.name
        if self._rewinding:
            code.line("nv_rewind(state);")
        code.line("nv_sense(state, in);" if self.network.vector_size else "(void)in;")
        code.line("nv_compute(state);")
        code.line("state->k++;")
        if self.network.changes:
            code.line("nv_events(state);")
        if self.network.outputs:
            with code.block("if (out != NULL)"):
                for c_name, entry in zip(self.output_names, self.network.outputs, strict=True):
                    if not entry.states:
                        code.line(code.loop("i", len(entry.neurons)))
                        code.line(f"    out->{c_name}[i] = state->activity[{code.at(entry.neurons, 'i')}];")
                    for read in probe_of(self.network, entry.states).reads:
                        kept, start = self._state_starts[read.owner, read.state]
                        to, place = code.at(read.columns, "i"), code.at(read.members + start, "i")
                        code.line(code.loop("i", len(read.members)))
                        code.line(f"    out->{c_name}[{to}] = state->{kept}[{place}];")
        else:
            code.line("(void)out;")
        head = f"void {name}_step({name}_state *state, const {name}_inputs *in, {name}_outputs *out)"
        return function(code, head, {})

    def _fired(self) -> list[str]:
        """Which neurons have fired: what the activity tells of, and what a state does."""
        if self.spiking is None:
            return []
        code, spiking = self._code(), self.spiking
        code.line("int32_t count = 0;")
        code.line(f"memset(fired, 0, {len(self.network.neurons)});")
        if len(spiking.by_activity):
            with code.block(code.loop("i", len(spiking.by_activity))):
                neuron = code.at(spiking.by_activity, "i")
                code.line(f"const {self.real} a = state->activity[{neuron}];")
                code.line(f"fired[{neuron}] = a != 0 && a == a;")
                code.line(f"count += fired[{neuron}];")
        for read in spiking.probe.reads:
            kept, start = self._state_starts[read.owner, read.state]
            with code.block(code.loop("i", len(read.members))):
                neuron = code.at(spiking.by_state[read.columns], "i")
                lesioned = f" && !state->lesioned[{neuron}]" if self.marks_lesioned else ""
                code.line(f"fired[{neuron}] = state->{kept}[{code.at(read.members + start, 'i')}] != 0{lesioned};")
                code.line(f"count += fired[{neuron}];")
        code.line("return count;")
        return ["", *function(code, self._fired_head, {})]

    def _set(self, parameter: str, c_name: str) -> list[str]:
        """The function that sets a parameter."""
        code, slot = self._code(), self.network.settable.index[parameter]
        self._begin_setting(code)
        code.line(f"parameters[{slot}] = value;")
        code.line(f"changed[{slot}] = 1;")
        code.line("if (!nv_follow(state, parameters, changed))")
        code.line("    return 0;")
        code.line(f"state->chosen[{slot}] = 1;")
        if self.holding:
            code.line("nv_hold(state);")
        code.line("return 1;")
        return function(code, f"int {self.name}_set_{c_name}({self.name}_state *state, {self.real} value)", {})


def _only_sets(change: Change) -> bool:
    """Whether it sets parameters and does nothing else, so that no phase begins with it."""
    mended, lesioned = (
        (change.mended_neurons, change.mended_connections),
        (change.lesioned_neurons, change.lesioned_connections),
    )
    arrays = (*mended, *lesioned, change.reset)
    return not (change.clamps or change.released or change.learning or any(len(array) for array in arrays))


def _by_phase(name: str, kind: str, arrays: list[npt.NDArray[np.integer]]) -> tuple[list[str], str]:
    """The numbers of an array in each phase, each different one once, and the code of those of now:

        static const unsigned char nv_gone[2][3] = {
            {0, 0, 0},
            {1, 0, 0},
        };
        static const int32_t nv_gone_at[3] = {0, 1, 0};

    and ``nv_gone[nv_gone_at[state->phase]]``."""
    unique: dict[tuple[int, ...], int] = {}
    numbers = [tuple(array.tolist()) for array in arrays]
    for row in numbers:
        unique.setdefault(row, len(unique))
    rows = ["    {" + ", ".join(map(str, row)) + "}," for row in unique]
    lines = [f"static const {kind} nv_{name}[{len(rows)}][{len(numbers[0])}] = {{", *rows, "};"]
    if len(arrays) == 1:
        return lines, f"nv_{name}[0]"
    which = ", ".join(str(unique[row]) for row in numbers)
    lines.append(f"static const int32_t nv_{name}_at[{len(arrays)}] = {{{which}}};")
    return lines, f"nv_{name}[nv_{name}_at[state->phase]]"


def _restrict(macro: str) -> str:
    """What says that arrays do not overlap."""
    return f"#ifdef __cplusplus\n#define {macro}_RESTRICT __restrict\n#else\n#define {macro}_RESTRICT restrict\n#endif"
