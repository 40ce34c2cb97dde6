"""The C backend: a network's step and whole runs, compiled for this machine.

In: a Network. Out: a Stepper over the arrays of a State, which are read and written in place. What can be set, held,
lesioned or stopped is data: none of it compiles anything. A step looks for it only where there is any: there are two
forms of the step, a plain one and one that looks after everything.

Whole runs of large networks have a third form, the *fused* one: a signal that arrives after one step along a weight
that does not change is not stored; the neuron that it arrives at takes it from the activities of the step *before*. The
weights of such connections are *packed* at the beginning of a call, in the order in which neurons read them; at its
end their last signals *leave*, into the array where every other form looks for them. There, states of connections that
are the same for many are kept *once* (``runtime/kept_once.py``), where they are the same when a call begins.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Definition, Key
from neurovis_spec.compiler.values.spikes import always_finite
from neurovis_spec.language.expressions.emit_c import Emitter
from neurovis_spec.language.expressions.functions import Library
from neurovis_spec.language.expressions.tree import Name
from neurovis_spec.runtime import c_flows, c_functions, c_library, c_once, c_plan
from neurovis_spec.runtime.backend import Availability, BackendError, Capabilities
from neurovis_spec.runtime.c_code import Code, Form, Table, Tables, function_of_arrays, state_name, words_of
from neurovis_spec.runtime.c_step import Built, StepCode, begins_otherwise, is_watched
from neurovis_spec.runtime.kept_once import Once, kept_once
from neurovis_spec.runtime.lags import ring_lengths
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.state import Conditions, Mask, State, Structure

if TYPE_CHECKING:
    from neurovis_spec.runtime.columns import Probe

#: neurons and connections up to which a network is written out one by one
SMALL = 600
#: items of a table that stands in the text; longer ones are handed over
LONGEST = 1024
#: the forms of a step, as ``nv_once`` and ``nv_run`` take them: nothing held, left out or still; any of it; and in
#: addition neurons that take ``initial``
_PLAIN, _GENERAL, _FIRST = 0, 1, 2
_NO_INPUTS: Final[frozenset[str]] = frozenset()
#: spikes of a run that there is room for: it ends before its last step where there are more
_MOST_NOTED: Final = 1 << 16
#: a step behind all others
_NEVER: Final = 1 << 62

#: ``nv_state``: of a State ``activity``, ``weights``, ``signals``, ``history``, ``outlets``, and ``cells``, one pointer
#: for each state or output of a model or a rule; ``x``: the numbers that can be set; ``parameters``; ``s``: the inputs
#: of the step; ``reads``: of each input whether the step computes it by its expression; ``held``, ``holding``,
#: ``lesioned``, ``gone``, ``cut``, ``still``, ``lost``, ``before``, ``packed``: as ``Form`` says; ``once``: what is
#: kept once for many connections; ``given``: the tables that are too long for the text; ``work``: what an integration
#: keeps, and arrays of what arrives. ``k`` and ``form``: the step that ``nv_once`` makes, and its form.
#:
#: ``nv_course``: ``steps`` steps from ``k`` on, the first in ``form``, the others in the form ``then``; the inputs of
#: each are a row of ``rows``, but for those that the step computes, which it puts there. Steps that ``every`` divides
#: are kept: a row of ``activity``; one of ``weights`` with the ``changes`` that are ``changing`` (0 where nobody asks
#: for them), which lie next to each other if ``beside``; and one of ``states``, with the ``columns`` numbers that
#: ``probed`` points to, of which signals of synapses stand in ``formed``; where rules change weights that these read,
#: those of the step are kept in ``weighed``.
#: Of the ``spiking`` neurons from ``spikes_from`` on, those whose activity behind a step is a number and not 0 stand in
#: ``fired`` then, and in ``noted`` how many do; it ends behind the step after which there may be more than ``most``.
#: With ``look`` it ends behind the first step after which something is not finite; ``fused``: whether steps may be made
#: in the fused form, as where nothing reads states that are kept once in it.
_HEAD: Final = """#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef _WIN32
#define NV_PUBLIC __declspec(dllexport)
#else
#define NV_PUBLIC
#endif

typedef struct {
    double *activity, *weights, *signals, *history, *outlets, *s;
    const double *x, *parameters, *holding;
    const uint8_t *reads, *held, *lesioned, *gone, *cut, *still;
    const int64_t *lost;
    const void *const *given;
    double *const *cells;
    double *before, *packed, *once, *work;
    int64_t k, form, fresh;
} nv_state;

typedef struct {
    int64_t k, steps, every, form, then, look, fused, beside, changes, columns, spikes_from, spiking, most;
    int32_t *fired;
    int64_t *noted;
    double *rows, *activity, *weights, *states, *formed, *weighed;
    const int64_t *changing;
    const double *const *probed;
} nv_course;
"""

#: ``nv_odd``: whether a number is not finite. Its exponent is all ones then; one more overflows into bit 63.
#: ``nv_once`` makes a step, after which ``k`` is that of the next, and gives whether something is not finite. In
#: ``nv_run`` ``wait`` is the number of steps until one is kept, and ``follows`` whether the step before was made there,
#: in the form 0. Behind such a step ``nv_let_out`` makes what it has left for whoever reads it.
_TAIL: Final = """
static uint64_t nv_odd(const double *values, int64_t count)
{
    uint64_t found = 0;
    for (int64_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, values + i, sizeof bits);
        found |= (bits & UINT64_C(0x7ff0000000000000)) + UINT64_C(0x0010000000000000);
    }
    return found >> 63;
}

static int64_t nv_note(const double *values, int64_t count, int32_t *fired)
{
    int64_t found = 0;
    for (int64_t q = 0; q < count; q++) {
        if (q + 16 <= count && nv_quiet(values + q))
            q += 15;
        else if (values[q] != 0.0 && values[q] == values[q])
            fired[found++] = (int32_t)q;
    }
    return found;
}

NV_PUBLIC int64_t nv_once(nv_state *p)
{
    double odd = nv_read(p, p->k, p->s);
    if (p->form == 0) {
        odd += nv_plain(p, p->k, p->s, 0);
        nv_let_out(p);
    } else {
        nv_general(p, p->k, p->s, p->form == 2);
    }
    p->k++;
    if (odd != 0.0 || nv_odd(p->s, INPUTS) || LOOK_NEURONS(p->form))
        return 1;
    return p->form ? LOOK_CONNECTIONS : LOOK_UNWATCHED;
}

NV_PUBLIC int64_t nv_run(const nv_state *p, const nv_course *c)
{
    double *s = c->rows, *activity = c->activity, *weights = c->weights, *states = c->states;
    // in the fused form from the step ``begin`` on, with what is kept once where it is the same for all: to take that
    // over and back takes less than a step does without
    int fused = FUSED && c->fused && c->then == 0 && (c->steps > 3 || !PACKED), once = 0, follows = 0;
    const int64_t begin = PACKED || c->form;
    int64_t made = 0, noted = 0;
    if (fused)
        nv_pack(p);
    int64_t wait = (c->every - c->k % c->every) % c->every;
    for (int64_t i = 0; i < c->steps; i++, s += INPUTS) {
        double odd = nv_read(p, c->k + i, s);
        const int kept = wait == 0;
        if (kept) {
            if (c->beside)
                memcpy(weights, p->weights + c->changing[0], sizeof(double)*c->changes);
            else
                for (int64_t j = 0; j < c->changes; j++)
                    weights[j] = p->weights[c->changing[j]];
            weights += c->changes;
            wait = c->every;
            if (c->weighed)
                memcpy(c->weighed, p->weights, sizeof(double)*CONNECTIONS);
        }
        wait--;
        const int64_t form = i ? c->then : c->form;
        if (ONCE && fused && i == begin) {
            fused = once = (int)nv_gather(p);
            follows = follows && !once;
        }
        if (form)
            nv_general(p, c->k + i, s, form == 2);
        else if (fused && i >= begin)
            odd += nv_fused(p, c->k + i, s, follows);
        else
            odd += nv_plain(p, c->k + i, s, follows);
        follows = form == 0;
        if (fused && BEFORE)
            memcpy(p->before, p->activity, sizeof(double)*NEURONS);
        if (kept) {
            memcpy(activity, p->activity, sizeof(double)*NEURONS);
            activity += NEURONS;
            if (c->formed) {
                if (follows)
                    nv_let_out(p);
                nv_signals(p, c->k + i, c->weighed ? c->weighed : p->weights, c->formed);
            }
            for (int64_t j = 0; j < c->columns; j++)
                *states++ = *c->probed[j];
        }
        made = i + 1;
        if (c->spiking) {
            noted += nv_note(p->activity + c->spikes_from, c->spiking, c->fired + noted);
            c->noted[i] = noted;
        }
        // what no step looked at is checked here; what no step changes, once
        if (c->look && (odd != 0.0 || LOOK_NEURONS(form) || ((form || !i) && LOOK_CONNECTIONS)
                        || (!form && (once ? LOOK_ONCE : LOOK_UNWATCHED))))
            break;
        if (c->spiking && noted + c->spiking > c->most)
            break;
    }
    if (fused)
        nv_leave(p);
    if (once)
        nv_scatter(p);
    if (follows)
        nv_let_out(p);
    return made;
}
"""


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """The text of a network, and the arrays that it is handed."""

    text: str
    #: the tables that are too long for the text, as ``nv_state.given`` has them
    long_tables: tuple[Table, ...]
    #: how many weights are packed in whole runs
    packed: int
    #: how many states are kept once in whole runs, and which these are
    once: int
    kept: frozenset[Key]
    #: how many numbers ``nv_state.work`` has
    work: int
    #: whether connections share signals
    shares: bool


_written: WeakKeyDictionary[Network, dict[bool, Written]] = WeakKeyDictionary()


def written(network: Network, own_signals: bool = False) -> Written:
    """The C of a network, for states that share signals or have each connection its own; made once for each."""
    found = _written.setdefault(network, {})
    if own_signals not in found:
        made = found[own_signals] = _write(network, signal_layout(network, own_signals))
        if not made.shares:  # then each has its own, whoever asks
            found[True] = made
    return found[own_signals]


def forget() -> None:
    """Write all networks anew when they are asked for."""
    _written.clear()


class _Function(NamedTuple):
    """A function of the text, over an ``nv_state``."""

    type: str
    name: str
    form: Form
    write: Callable[[StepCode], None]
    #: its further parameters
    parameters: str = ""
    #: what it is for alone, and empty where there is none of that: what whole runs do otherwise, states that are kept
    #: once there, or what steps before it in the text leave to be let out
    only: Literal["", "fused", "once", "late"] = ""


def _write(network: Network, layout: SignalLayout) -> Written:
    emitter, tables, built = Emitter(), Tables("double", LONGEST), Built(network, layout)
    small = len(network.neurons) + len(network.connections) <= c_plan.written_out(built.plan, SMALL)
    bodies, work = list[str](), 0
    once = None if small else kept_once(network)
    built_once = built if once is None else Built(once.network, layout, once.kept, built)
    watched = bool(network.projections) and not small
    # a network that is written out is in registers, and nothing is gained
    whole = StepCode(built, Code(emitter, tables, network.dt, {}), Form())
    packed = not small and whole.count + int(whole.fuses.sum()) > 0
    there = {"": True, "fused": packed or once is not None, "once": once is not None, "late": False}
    variables = network.settable.variables if once is None else once.variables
    for type_, name, form, write, parameters, only in _functions(small, watched, once):
        code, of = Code(emitter, tables, network.dt, variables), built_once if only in ("fused", "once") else built
        if there[only]:
            write(step := StepCode(of, code, form))
            work = max(work, c_plan.work_size(of.plan) + step.room)
        if form.follows and built.settles:
            made, code.lines = code.lines, _let_out_late(code.lines)
            there["late"] |= len(code.lines) < len(made)
        if type_ == "double":
            code.line("return odd;" if form.watched and code.lines else "return 0.0;")
        elif type_ == "int64_t" and not there[only]:
            code.line("return 0;")
        pointers = _pointer_lines(network, of.plan, once)
        named = {array: line for array, line in pointers.items() if f"*restrict {array}" not in parameters}
        handed = named | tables.pointer_lines()
        bodies += [*function_of_arrays(code, type_, name, f"const nv_state *p{parameters}", handed), ""]
    used, flags = words_of(bodies), {"FUSED": there["fused"], "ONCE": there["once"], "PACKED": packed}
    flags["BEFORE"] = bool(whole.fuses.any())
    parts = [
        _HEAD,
        c_flows.declarations(built.plan),
        _defined(built, flags, _look(built, watched, once)),
        emitter.helpers(used | {"nv_quiet"}),
        tables.text(used),
        "\n".join(bodies),
    ]
    text = "\n\n".join(part for part in parts if part) + _TAIL
    states, kept = (0, frozenset[Key]()) if once is None else (c_once.size(once), frozenset(once.kept))
    count = whole.count if packed else 0
    return Written(text, tuple(tables.passed_in), count, states, kept, work, bool(layout.shared))


def _defined(built: Built, flags: Mapping[str, bool], looks: _Looks) -> str:
    """The constants of the text."""
    network = built.network
    counts = {"NEURONS": len(network.neurons), "CONNECTIONS": len(network.connections), "INPUTS": network.vector_size}
    counts |= {name: int(flag) for name, flag in flags.items()}
    codes = {"LOOK_NEURONS(form)": looks.neurons, "LOOK_CONNECTIONS": looks.connections}
    codes |= {"LOOK_UNWATCHED": looks.unwatched, "LOOK_ONCE": looks.once}
    lines = [f"#define {name} {value}" for name, value in counts.items()]
    return "\n".join([*lines, *(f"#define {name} ({code})" for name, code in codes.items())])


def _functions(small: bool, watched: bool, once: Once | None) -> tuple[_Function, ...]:
    """The functions that ``nv_once`` and ``nv_run`` call. Those of type double give ``odd``."""
    of_inputs, of_step = ", int64_t k, double *restrict s", ", int64_t k, const double *restrict s"
    of_signals = ", int64_t k, const double *restrict weights, double *restrict formed"
    plain = Form(written_out=small, follows=True, watched=watched)
    general = Form(first=True, held=True, fixed=True, fixed_joined=True, gone=True, cut=True, still=True, lost=True)
    fused = Form(follows=True, fused=True)
    return (
        _Function("double", "nv_read", Form(watched=True), StepCode.read, of_inputs),
        _Function("double", "nv_plain", plain, StepCode.write, f"{of_step}, int follows"),
        _Function("void", "nv_general", general, StepCode.write, f"{of_step}, int first"),
        _Function(
            "double",
            "nv_fused",
            replace(fused, watched=watched),
            StepCode.write,
            f"{of_step}, int follows",
            only="fused",
        ),
        _Function("void", "nv_let_out", Form(), StepCode.let_all_out, only="late"),
        _Function("void", "nv_signals", Form(gone=True, cut=True, lost=True), StepCode.signals, of_signals),
        _Function("void", "nv_pack", fused, StepCode.pack, only="fused"),
        _Function("void", "nv_leave", fused, lambda step: step.leave(step.fuses), only="fused"),
        _Function("int64_t", "nv_gather", Form(), _of_once(once, c_once.gather), only="once"),
        _Function("void", "nv_scatter", Form(), _of_once(once, c_once.scatter), only="once"),
    )


def _of_once(once: Once | None, write: Callable[[Once, Code], None]) -> Callable[[StepCode], None]:
    """What writes a function of states that are kept once, where there are any."""

    def written(step: StepCode) -> None:
        if once is not None:
            write(once, step.code)

    return written


def _let_out_late(lines: list[str]) -> list[str]:
    """The lines of a step; where none reads what connections take beside activities, without those that let it out:
    ``nv_let_out`` does when somebody else reads it."""
    others = [line for line in lines if not line.lstrip().startswith("outlets[")]
    return lines if "outlets" in words_of(others) else others


def _pointer_lines(network: Network, plan: c_plan.Plan | None, once: Once | None) -> dict[str, str]:
    """For each array of the state, and for what is handed over, the line that gives it its name."""
    kinds = (
        ("double", ("activity", "weights", "signals", "history", "outlets", "packed")),
        ("const double", ("x", "parameters", "holding", "before")),
        ("const uint8_t", ("reads", "held", "lesioned", "gone", "cut", "still")),
        ("const int64_t", ("lost",)),
    )
    lines = {name: f"{kind} *restrict const {name} = p->{name};" for kind, names in kinds for name in names}
    names = [state_name(use.owner, i) for _, use in network.uses for i in range(len(use.definition.kept))]
    lines |= c_plan.pointer_lines(plan, "double", "restrict", "p->work")
    lines |= {} if once is None else c_once.pointer_lines(once)
    lines["fresh"] = "const int fresh = (int)p->fresh;"
    return lines | {name: f"double *restrict const {name} = p->cells[{at}];" for at, name in enumerate(names)}


def _shows_state(model: Definition) -> bool:
    """Whether the activity of a model is a state of it, as it is."""
    shown = model.given.each_step
    return isinstance(shown, Name) and any(one.name == shown.name for one in model.state)


class _Looks(NamedTuple):
    """The code of whether anything is not finite behind a step of a ``form``: anything that neurons carry, and that
    connections carry, and what of the latter a plain step has not watched itself, and one with states that are kept
    once."""

    neurons: str
    connections: str
    unwatched: str
    once: str


def _look(built: Built, watched: bool, once: Once | None) -> _Looks:
    """What is looked at behind the steps of a network; ``watched``: whether plain ones watch what they can."""
    network = built.network
    tests = {"neuron": [f"nv_odd(p->activity, {len(network.neurons)})"], "connection": list[str]()}
    unwatched, whole = list[str](), list[str]()
    if built.settles and all(_shows_state(one.model.definition) for one in network.populations):
        tests["neuron"] = [f"(form && {tests['neuron'][0]})"]  # where nothing is held it is what a cell is
    if network.projections and len(network.changing):  # what neither a rule nor an event changes is finite
        first, last = int(network.changing[0]), int(network.changing[-1])
        tests["connection"].append(f"nv_odd(p->weights + {first}, {last - first + 1})")
    cell = 0
    for holder, use in network.uses:
        for one in use.definition.kept:
            if not (use.definition.fires and always_finite(one)):
                test = f"nv_odd(p->cells[{cell}], {len(holder.members)})"
                tests[use.definition.kind.each].append(test)
                if use.definition.kind.each == "connection" and not is_watched(use.definition, one):
                    unwatched.append(test)
                    if once is not None and Key(use.owner, one.name) not in once.kept:
                        whole.append(test)
            cell += 1
    if once is not None:
        whole.append(f"nv_odd(p->once, {c_once.size(once)})")
    found = (tests["neuron"], tests["connection"], unwatched if watched else tests["connection"], whole)
    return _Looks(*(" || ".join(some) or "0" for some in found))


_POINTERS: Final = (
    *("activity", "weights", "signals", "history", "outlets", "s", "x", "parameters", "holding"),
    *("reads", "held", "lesioned", "gone", "cut", "still", "lost"),
    *("given", "cells", "before", "packed", "once", "work"),
)


class _State(ctypes.Structure):
    """``nv_state``: where the arrays of a State lie, and those of the stepper."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in _POINTERS),
        *((name, ctypes.c_int64) for name in ("k", "form", "fresh")),
    ]


class _Course(ctypes.Structure):
    """``nv_course``: the steps of a call."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("k", "steps", "every", "form", "then", "look")),
        *((name, ctypes.c_int64) for name in ("fused", "beside", "changes", "columns")),
        *((name, ctypes.c_int64) for name in ("spikes_from", "spiking", "most")),
        *((name, ctypes.c_void_p) for name in ("fired", "noted", "rows", "activity", "weights")),
        *((name, ctypes.c_void_p) for name in ("states", "formed", "weighed", "changing", "probed")),
    ]


class CStepper:
    """One network, compiled. Of the state that it stepped last it keeps where the arrays lie, and looks them up again
    only where one of them is another object (``_point_to``). What steps states with ``own_signals``, where others share
    them, is compiled when there is one."""

    def __init__(self, network: Network) -> None:
        self.network = network
        #: what computes formulas beside the steps
        self.functions: Library = c_functions.library()
        #: the inputs of the step that is made: what it computes of them stands there behind it
        self.vector = np.zeros(network.vector_size)
        #: the inputs that a step computes, and of each input whether it is one
        self._computed = _NO_INPUTS
        self._reads = np.zeros(len(network.inputs), dtype=np.uint8)
        #: whether the first step of a run is another one
        self._initial = begins_otherwise(network)
        self._changing = np.ascontiguousarray(network.changing, dtype=np.int64)
        # whether the weights that are recorded lie next to each other
        count = len(self._changing)
        self._contiguous = count > 0 and bool((np.diff(self._changing) == 1).all())
        self._pointers = _State()
        self._pointers.s, self._pointers.reads = self.vector.ctypes.data, self._reads.ctypes.data
        self._address = ctypes.addressof(self._pointers)
        #: what ``nv_once`` takes, which need not be converted anew; and the step and the form that stand there
        self._struct = ctypes.c_void_p(self._address)
        self._k, self._form_there = 0, _PLAIN
        self._before = np.zeros(len(network.neurons))
        self._pointers.before = self._before.ctypes.data
        self._take_code(own_signals=not written(network).shares)
        #: the state whose arrays the struct points to, these arrays, and the objects that say what holds in it: where
        #: each is still the same one, nothing has changed
        self._known_state: State | None = None
        self._activity = self._weights = self._signals = self._history = self._outlets = self.vector
        self._variables = self._parameters = self.vector
        self._holds: object = None
        self._fixed: object = None
        self._structure: Structure | None = None
        #: signals of synapses behind a step that is kept, of all connections
        self._formed = np.zeros(len(network.connections) if len(network.synapses.holders) else 0)
        #: the weights of that step, where rules change some that synapses read
        learning = (network.synapses.numbers >= 0) & (network.connections.rules.whole() >= 0)
        self._weighed = np.zeros(len(network.connections) if learning.any() else 0)
        #: what the next run reads of states, and where it puts that
        self._probed: tuple[Probe, FloatArray] | None = None
        #: of which neurons the next run notes spikes; those that the last one has noted, and how many were by each step
        self._spiking = range(0)
        self._fired, self._noted = np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int64)
        #: the first step at which nothing is held, left out, still or lost
        self._plain_from = 0

    def _take_code(self, own_signals: bool) -> None:
        """Make the steps of states that share signals, where anything can be shared, or of those with their own."""
        made = written(self.network, own_signals)
        library = c_library.load(made.text)
        self._library, self._own_signals = library, own_signals
        self._step, self._run = library.nv_once, library.nv_run
        self._step.restype = ctypes.c_int64
        self._run.argtypes, self._run.restype = (ctypes.c_void_p, ctypes.c_void_p), ctypes.c_int64
        self._long_tables, self._packed, self._work = made.long_tables, np.zeros(made.packed), np.zeros(made.work)
        self._table_addresses = _addresses(self._long_tables)
        self._once, self._kept_once = np.zeros(made.once), made.kept
        self._pointers.packed, self._pointers.work = self._packed.ctypes.data, self._work.ctypes.data
        self._pointers.once = self._once.ctypes.data
        self._pointers.given = ctypes.addressof(self._table_addresses)

    def read(self, computed: frozenset[str]) -> None:
        """Compute these inputs, which are expressions, in the runs that follow."""
        self._computed = computed
        self._reads[:] = [one.name in computed for one in self.network.inputs]

    def probe(self, probe: Probe, states: FloatArray) -> None:
        """In the next run put what a probe reads behind each step that is kept into the first rows of ``states``."""
        self._probed = probe, states

    def note(self, neurons: range) -> None:
        """In the next run note which of these neurons fire."""
        self._spiking = neurons
        room = max(_MOST_NOTED, 2 * len(neurons))
        if len(self._fired) < room:
            self._fired = np.zeros(room, dtype=np.int32)

    def fired(self, made: int) -> tuple[IntArray, IntArray]:
        """Who has fired in the steps of the last run, of which so many were made."""
        noted = self._noted[:made]
        return np.repeat(np.arange(made), np.diff(noted, prepend=0)), self._fired[: noted[-1]].astype(np.int64)

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Advance the state by a step."""
        self.advance(state, inputs, _NO_INPUTS)

    def advance(self, state: State, inputs: FloatArray, computed: frozenset[str], /) -> bool:
        """Advance the state by a step that computes some inputs; whether something is not finite behind it."""
        now = state.conditions
        if (
            state is not self._known_state
            or now.holds is not self._holds
            or now.fixed is not self._fixed
            or now.structure is not self._structure
            or now.variables is not self._variables
            or now.parameters is not self._parameters
            or state.activity is not self._activity
            or state.weights is not self._weights
            or state.signals is not self._signals
            or state.history is not self._history
            or state.outlets is not self._outlets
        ):
            self._point_to(state)
        if computed is not self._computed:
            self.read(computed)
        k = state.k
        if k != self._k:
            self._pointers.k = k
        form = _PLAIN if k > 0 and k >= self._plain_from else self._form(state)
        if form != self._form_there:
            self._pointers.form = self._form_there = form
        if inputs is not self.vector:
            self.vector[:] = inputs
        odd: int = self._step(self._struct)
        state.k = self._k = k + 1
        return odd != 0

    def run(
        self, state: State, vectors: FloatArray, activity: FloatArray, weights: FloatArray, every: int, look: bool
    ) -> int:
        """Advance the state by a step for each row of ``vectors``; steps that ``every`` divides are kept, in the first
        rows of ``activity`` and ``weights``. With ``look`` it ends behind the first step after which something is not
        finite. Gives the number of steps made."""
        self._point_to(state)
        rows = vectors if _as_c_has_it(vectors) else np.array(vectors, dtype=np.float64)
        course = _Course(
            k=state.k,
            steps=len(rows),
            every=every,
            form=self._form(state),
            then=_GENERAL if state.k + 1 < self._plain_from else _PLAIN,
            look=look,
            fused=True,
            beside=self._contiguous,
            changes=weights.shape[1],
            rows=rows.ctypes.data,
            activity=activity.ctypes.data,
            weights=weights.ctypes.data,
            changing=self._changing.ctypes.data,
        )
        if self._probed is not None:
            probe, states = self._probed
            numbers, self._probed = probe.addresses(state, self._formed), None
            read = (Key(one.owner, one.state) for one in probe.reads)
            course.fused = not (self._kept_once and probe.forms) and self._kept_once.isdisjoint(read)
            if probe.forms:
                course.formed = self._formed.ctypes.data
                course.weighed = self._weighed.ctypes.data if len(self._weighed) else None
            course.columns, course.states, course.probed = len(numbers), states.ctypes.data, numbers.ctypes.data
        if self._spiking:
            self._noted = np.zeros(len(rows), dtype=np.int64)
            course.spikes_from, course.spiking, course.most = self._spiking[0], len(self._spiking), len(self._fired)
            course.fired, course.noted = self._fired.ctypes.data, self._noted.ctypes.data
            self._spiking = range(0)
        made: int = self._run(self._address, ctypes.addressof(course))
        state.k += made
        return made

    def _form(self, state: State) -> int:
        """The form of the step to come."""
        if state.k == 0 and not state.continued and self._initial:
            return _FIRST
        return _GENERAL if state.k < self._plain_from else _PLAIN

    def _point_to(self, state: State) -> None:
        """Note where the arrays of a state lie, and what is held and left out."""
        now, pointers = state.conditions, self._pointers
        if state.own_signals != self._own_signals:
            self._take_code(state.own_signals)
        for name in ("activity", "weights", "signals", "history", "outlets"):
            array = getattr(state, name)
            if not _as_c_has_it(array):
                array = np.array(array, dtype=np.float64)
                setattr(state, name, array)
            setattr(pointers, name, array.ctypes.data)
        pointers.x, pointers.parameters = now.variables.ctypes.data, now.parameters.ctypes.data
        self._cells = _addresses([array for own in state.cells.values() for array in own.values()])
        pointers.cells = ctypes.addressof(self._cells)
        pointers.fresh = int(not state.continued)
        if now.holds is not self._holds or now.fixed is not self._fixed or now.structure is not self._structure:
            self._take_conditions(now)
        self._known_state = state  # what is kept alive cannot be mistaken for another array at the same address
        self._activity, self._weights = state.activity, state.weights
        self._variables, self._parameters = now.variables, now.parameters
        self._signals, self._history, self._outlets = state.signals, state.history, state.outlets

    def _take_conditions(self, now: Conditions) -> None:
        count, pointers = self.network.clampable, self._pointers
        self._holds, self._fixed, self._structure = now.holds, now.fixed, now.structure
        plain = now.holds is None and now.fixed is None and now.structure.whole
        self._plain_from = 0 if plain else _NEVER
        if plain and now.structure.has_lost:
            self._plain_from = int((now.structure.lost + ring_lengths(self.network)).max())
        self._held, self._holding = np.zeros(count, dtype=np.uint8), np.zeros(count)
        if now.fixed is not None:
            states = now.held.order >= 0
            states[: len(self.network.neurons)] = False
            self._held[states], self._holding[states] = 1, now.held.value[states]
        for hold in now.holds or ():
            if hold is not None:
                neurons, values = hold
                self._held[neurons] = 1
                self._holding[neurons] = values
        self._lesioned = _bytes(now.lesioned_neurons)
        pointers.lesioned = self._lesioned.ctypes.data
        structure = now.structure
        self._gone, self._cut, self._still = map(_bytes, (structure.gone, structure.cut, structure.still))
        pointers.held, pointers.holding = self._held.ctypes.data, self._holding.ctypes.data
        self._lost = np.ascontiguousarray(now.structure.lost, dtype=np.int64)
        pointers.gone, pointers.still = self._gone.ctypes.data, self._still.ctypes.data
        pointers.cut = self._cut.ctypes.data
        pointers.lost = self._lost.ctypes.data


def _addresses(arrays: Sequence[npt.NDArray[np.generic]]) -> ctypes.Array[ctypes.c_void_p]:
    """Where arrays lie, as an array; a room more, so that it is never empty."""
    return (ctypes.c_void_p * (len(arrays) + 1))(*(array.ctypes.data for array in arrays), None)


def _as_c_has_it(array: FloatArray) -> bool:
    """Whether C can read and write an array where it lies."""
    return array.flags.c_contiguous and array.flags.writeable and array.dtype == np.float64


def _bytes(mask: Mask) -> npt.NDArray[np.uint8]:
    return np.ascontiguousarray(mask, dtype=np.uint8)


class CBackend:
    """C made from the update program, compiled for this machine."""

    name = "c"
    capabilities = Capabilities(
        noise=True, flows=True, synapses=True, spikes=True, clamped_states=True, exactness="bits"
    )

    def availability(self) -> Availability:
        """Whether there is a compiler."""
        try:
            found = c_library.compiler()
        except c_library.CompilerError as error:
            return Availability(False, str(error), by_default=c_library.is_asked_for())
        return Availability(True, f"C made for each network, compiled by {found.name}", not found.on_request)

    def prepare(self, network: Network) -> CStepper:
        """Compile a network, or take what was compiled before."""
        try:
            return CStepper(network)
        except c_library.CompilerError as error:
            raise BackendError(f"the backend 'c' is not available here: {error}") from None
