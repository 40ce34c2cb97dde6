"""Backends: what executes the update program of a Network, what it can do, and which one is taken.

In: a Network and, for each step, a State and the vector of all inputs. Out: the State, advanced in place. Backends are
found through the entry point group ``neurovis.backends``; an entry point names a class called without arguments.
"""

from __future__ import annotations

import os
import warnings
from dataclasses import InitVar, dataclass
from functools import cache
from typing import TYPE_CHECKING, Final, Literal, Protocol, runtime_checkable

from neurovis_spec import plugins
from neurovis_spec.arguments import callers_level
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import RULE, SYNAPSE
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.state import State

if TYPE_CHECKING:
    from neurovis_spec.runtime.columns import Probe

#: It may name the backend that is taken where nobody names one.
ENVIRONMENT_VARIABLE: Final = "NEUROVIS_BACKEND"
#: Asks for the automatic choice, as if no backend were named.
AUTO: Final = "auto"
#: What runs a network where no backend is to be taken by default: it is everywhere, and runs all.
_LAST_RESORT: Final = "numpy"


class BackendError(ValueError):
    """A backend that does not exist, is not available, or cannot run this network."""


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a backend can execute, and how exactly."""

    delays: bool = True
    plasticity: bool = True
    noise: bool = False
    episodes: bool = True
    #: derivatives; ports, outputs and what is sent beside those that every model has
    flows: bool = False
    #: synapses, their states and signals, and all that definitions of connections read of both ends
    synapses: bool = False
    #: models that fire, jumps, and what of synapses and rules waits for spikes (``Definition.acts``)
    spikes: bool = False
    #: clamps of states of models (``Conditions.fixed``)
    clamped_states: bool = False
    #: the most neurons and connections together, None without a bound
    largest: int | None = None
    #: its numbers are the reference's to the ``bits``, where the C library is the same, or up to ``rounding``
    exactness: Literal["bits", "rounding"] = "rounding"
    #: obsolete: may still be given, and is ignored
    exact_sums: InitVar[bool | None] = None


_PLAIN: Final = Capabilities()


@dataclass(frozen=True, slots=True)
class Availability:
    """Whether a backend works here; ``note`` says which way, or why not. ``by_default``: it is the one to take here
    where nobody names one; if it is not available then, a warning says so, and NumPy computes."""

    available: bool
    note: str = ""
    by_default: bool = False


class Stepper(Protocol):
    """A network made ready to run."""

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Advance the state by one step, in place: ``activity`` becomes a[t], ``weights`` w[t+1], ``k`` t + 1.

        ``inputs`` are all inputs at step t. NumPy's floating-point warnings are left to the caller.
        """
        ...


@runtime_checkable
class Computing(Protocol):
    """A Stepper that has functions of its own: what is computed beside the steps (inputs that are expressions, clamps,
    what follows a parameter that is set) is computed by them. Of others NumPy's are taken."""

    @property
    def functions(self) -> Library:
        """What computes ``exp``, ``tanh``, … to the bit as the steps do."""
        ...


@runtime_checkable
class Runner(Protocol):
    """A Stepper that makes many steps in one call."""

    def run(
        self, state: State, vectors: FloatArray, activity: FloatArray, weights: FloatArray, every: int, look: bool
    ) -> int:
        """Make a step for each row of ``vectors``, at least one; keep those that ``every`` divides: a[t] in the first
        rows of ``activity``, the w[t] that change in those of ``weights``, unless these have no columns. With
        ``look``, end behind the first step after which something is not finite. Gives the number of steps made."""
        ...


@runtime_checkable
class Probing(Protocol):
    """A Runner that can keep states of definitions, too, and of a backend with synapses the signals of these, as they
    are at the end of a step (``runtime/formed.py``)."""

    def probe(self, probe: Probe, states: FloatArray) -> None:
        """In the next run put what a probe reads behind each step that is kept into the first rows of ``states``
        (rows, columns)."""
        ...


@runtime_checkable
class Noting(Protocol):
    """A Runner that can note spikes, so that nobody has to look for them in rows of all neurons."""

    def note(self, neurons: range) -> None:
        """In the next run note which of these neurons have an activity other than 0 behind each step; it may end before
        its last step."""
        ...

    def fired(self, made: int) -> tuple[IntArray, IntArray]:
        """What the last run has noted, which has ``made`` so many steps: in which of these (spikes,), and of which
        neuron that was asked for (spikes,), both from 0 on and in this order."""
        ...


@runtime_checkable
class Reading(Protocol):
    """A Stepper that can compute inputs that are expressions as a part of the step, and sees what is not finite."""

    #: the inputs of the step that was made last; may be given as those of a step whose inputs are all computed
    vector: FloatArray

    def advance(self, state: State, inputs: FloatArray, computed: frozenset[str], /) -> bool:
        """Make a step, of whose inputs those that are ``computed`` are not given; whether something is not finite
        behind it, an input, too."""
        ...

    def read(self, computed: frozenset[str]) -> None:
        """In the runs that follow (``Runner``) compute these inputs, and put them into ``vectors``."""
        ...


@runtime_checkable
class Backend(Protocol):
    """A way to execute a network."""

    name: str
    capabilities: Capabilities

    def availability(self) -> Availability:
        """Whether it works on this machine."""
        ...

    def prepare(self, network: Network) -> Stepper:
        """Make a network ready to run."""
        ...


def names() -> tuple[str, ...]:
    """The names of all backends, in order."""
    return plugins.names(plugins.BACKENDS)


def load(name: str) -> Backend:
    """The backend of this name. Raises BackendError where there is none."""
    try:
        made = plugins.load(plugins.BACKENDS, name)
    except KeyError:
        hint = suggest(name, names())
        raise BackendError(f"unknown backend '{name}'" + (f"; {hint}" if hint else "")) from None
    if not isinstance(made, Backend):
        raise BackendError(f"the plug-in '{name}' is no backend: it lacks name, capabilities, availability or prepare")
    return made


def available(name: str) -> Availability:
    """Whether the backend of this name works here; one that cannot even be loaded does not."""
    try:
        return load(name).availability()
    except (BackendError, plugins.PluginError) as error:
        return Availability(False, str(error))


def listing() -> tuple[str, ...]:
    """A line for each backend: ``NAME available [note;] EXACTNESS`` or ``NAME unavailable: reason``."""
    return tuple(map(_line, names()))


def _line(name: str) -> str:
    found = available(name)
    if not found.available:
        return f"{name} unavailable: {found.note}"
    how = "the bits of the reference" if _is_exact(name) else "the numbers of the reference up to rounding"
    return f"{name} available {'; '.join(filter(None, (found.note, how)))}"


def _is_exact(name: str) -> bool:
    """Whether the backend of this name promises the bits of the reference; one that cannot be loaded does not."""
    try:
        return load(name).capabilities.exactness == "bits"
    except (BackendError, plugins.PluginError):
        return False


def choose_backend(network: Network) -> tuple[str, str]:
    """The name of the backend that runs this network unless another is asked for, and why: the first by name that is
    to be taken by default here and has what the network asks for, else NumPy's; by the network and the machine alone,
    so that a run and its parts give the same bits. The environment may name another (``ENVIRONMENT_VARIABLE``). Raises
    BackendError where it names none that there is."""
    named = _named()
    if named:
        if named not in names():
            raise BackendError(
                f"{ENVIRONMENT_VARIABLE} names '{named}', which is no backend; {suggest(named, names(), 'there are')}"
            )
        return named, f"named by {ENVIRONMENT_VARIABLE}"
    size = f"{plural(len(network.neurons), 'neuron')}, {plural(len(network.connections), 'connection')}"
    passed_over = list[str]()  # the others, and why
    for name in names():
        if name == _LAST_RESORT:
            continue
        found = available(name)
        missing = lacking(network, load(name).capabilities) if found.available else ()
        if found.by_default and not missing:  # available or not: if not, ``ready`` warns, and NumPy computes
            return name, f"{found.note} ({size})"
        if found.by_default:
            passed_over += missing
        else:
            passed_over.append(f"{name} on request" if found.available else found.note)
    return _LAST_RESORT, "; ".join((f"array code made for this network ({size})", *passed_over))


def _named() -> str:
    """The backend that the environment names, if it does."""
    name = os.environ.get(ENVIRONMENT_VARIABLE, "").strip()
    return "" if name == AUTO else name


@dataclass(frozen=True, slots=True)
class Ready:
    """A network made ready to run: the ``name`` of the backend, what makes the steps, what computes the functions of
    formulas beside them, what it can do, and ``why`` it was chosen, where nobody asked for it."""

    name: str
    stepper: Stepper
    functions: Library
    why: str = ""
    capabilities: Capabilities = _PLAIN

    def take(self, state: State) -> None:
        """Make the steps of a run from this state on. Raises BackendError where the state is held as it cannot hold."""
        if state.conditions.fixed:
            self.check_clamp("a state")
        state.backend = self.name

    def check_clamp(self, what: str) -> None:
        """Refuse a clamp of a state. Raises BackendError."""
        if not self.capabilities.clamped_states:
            raise BackendError(f"the backend '{self.name}' cannot clamp {what}; '{_LAST_RESORT}' can")


def ready(network: Network, backend: str | Backend | Ready | None = None, before: str = "") -> Ready:
    """Make a network ready to run on a backend:

    - on the one that is named; with a warning if another has made the steps ``before``, and not both promise the same
      bits;
    - where none is named, or ``auto``, on the one that has made the steps ``before``;
    - where there are no such steps, on the one that is chosen. If it cannot be had, as a compiler fails, array code
      takes its place, which a RuntimeWarning says once.

    Raises BackendError where it is unknown, not available, or lacks something that the network asks for.
    """
    if isinstance(backend, Ready):
        return backend
    if backend is None or backend == AUTO:
        return _ready_as_before(network, before) if before else _ready_by_default(network)
    loaded = load(backend) if isinstance(backend, str) else backend
    result = _ready_on(network, loaded)
    if before not in ("", result.name) and not (_is_exact(before) and loaded.capabilities.exactness == "bits"):
        other = f"the backend '{before}' made the steps before, and '{result.name}' makes those to come"
        warnings.warn(f"{other}: their last bits may differ", stacklevel=callers_level())
    return result


def prepare(network: Network, backend: str | Backend | None = None) -> Stepper:
    """What makes the steps of a network, as ``ready`` does."""
    return ready(network, backend).stepper


def _ready_as_before(network: Network, before: str) -> Ready:
    """By the backend that has made the steps before. Raises BackendError, which says so."""
    try:
        return _ready_on(network, load(before))
    except (BackendError, plugins.PluginError) as error:
        problem = f"the steps before were made by the backend '{before}', which makes those to come: {error}"
        raise BackendError(f"{problem}; one that is named (--backend) goes on with other last bits") from None


def _ready_by_default(network: Network) -> Ready:
    """On the backend that is chosen; where it fails, on NumPy's, unless the environment named the one that fails."""
    name, why = choose_backend(network)
    try:
        return _ready_on(network, load(name), why)
    except BackendError as error:
        if name == _LAST_RESORT or _named():
            raise
        _warn_once(f"NumPy computes, as {error}")
        return _ready_on(network, load(_LAST_RESORT), f"array code made for this network; {error}")


@cache
def _warn_once(message: str) -> None:
    """Warn once in a process."""
    warnings.warn(message, RuntimeWarning, stacklevel=callers_level())


def _ready_on(network: Network, backend: Backend, why: str = "") -> Ready:
    """On this backend. Raises BackendError where it is not available or lacks something."""
    availability = backend.availability()
    if not availability.available:
        raise BackendError(f"the backend '{backend.name}' is not available here: {availability.note}")
    missing = lacking(network, backend.capabilities)
    if missing:
        raise BackendError(f"the backend '{backend.name}' cannot run '{network.name}': {'; '.join(missing)}")
    stepper = backend.prepare(network)
    functions = stepper.functions if isinstance(stepper, Computing) else NUMPY
    return Ready(backend.name, stepper, functions, why, backend.capabilities)


def _beyond(network: Network) -> tuple[tuple[str, bool], ...]:
    """What only a backend has that says so (``Capabilities.flows``), and whether a network asks for it."""
    ports = [port for population in network.populations for port in population.ports]
    return (
        ("derivatives", network.integration is not None),
        ("ports", len(ports) > len(network.populations) or any(port.factors is not None for port in ports)),
        ("outputs of models", any(population.model.definition.outputs for population in network.populations)),
        ("states that are sent", bool(network.outlets)),
    )


def _clamps_states(network: Network) -> bool:
    """Whether events do."""
    clamps = (clamp for change in network.changes for clamp in change.clamps)
    return any((clamp.neurons >= len(network.neurons)).any() for clamp in clamps)


def lacking(network: Network, capabilities: Capabilities) -> tuple[str, ...]:
    """What the network asks for and the backend does not have."""
    size = len(network.neurons) + len(network.connections)
    asked = (
        (
            not capabilities.delays and bool((network.connections.delays.kept > 1).any()),
            "no delays of more than a step",
        ),
        (not capabilities.plasticity and any(one.kind == RULE for one in network.projections), "no plasticity"),
        (not capabilities.synapses and any(one.kind == SYNAPSE for one in network.projections), "no synapses"),
        (not capabilities.spikes and any(use.definition.acts for _, use in network.uses), "no spikes"),
        (not capabilities.noise and bool(network.noises), "no noise"),
        (not capabilities.episodes and network.episode is not None, "no episodes"),
        *((not capabilities.flows and has, f"no {what}") for what, has in _beyond(network)),
        (not capabilities.clamped_states and _clamps_states(network), "no clamps of states"),
        (
            capabilities.largest is not None and size > capabilities.largest,
            f"at most {capabilities.largest} neurons and connections, not {size}",
        ),
    )
    return tuple(text for lacks, text in asked if lacks)
