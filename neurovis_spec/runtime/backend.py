"""Backends: what executes the update program of a Network, what it can do, and which one is taken.

In: a Network and, for each step, a State and the vector of all inputs. Out: the State, advanced in place. Backends are
found through the entry point group ``neurovis.backends``; an entry point names a class called without arguments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from neurovis_spec import plugins
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import suggest
from neurovis_spec.runtime.state import State


class BackendError(ValueError):
    """A backend that does not exist, is not available, or cannot run this network."""


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a backend can execute.

    ``largest`` bounds neurons + connections, None without a bound; ``exact_sums`` promises that terms are added in the
    order of the connections.
    """

    delays: bool = True
    plasticity: bool = True
    noise: bool = False
    episodes: bool = True
    exact_sums: bool = True
    largest: int | None = None


@dataclass(frozen=True, slots=True)
class Availability:
    """Whether a backend works here; ``note`` says which way, or why not."""

    available: bool
    note: str = ""


class Stepper(Protocol):
    """A network made ready to run."""

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Advance the state by one step, in place: ``activity`` becomes a[t], ``weights`` w[t+1], ``k`` t + 1.

        ``inputs`` are all inputs at step t. NumPy's floating-point warnings are left to the caller.
        """
        ...


@runtime_checkable
class Runner(Protocol):
    """A Stepper that makes many steps in one call."""

    @property
    def at_once(self) -> int:
        """How many steps are well made in one call, so that a run can be stopped between two."""
        ...

    def run(
        self, state: State, vectors: FloatArray, activity: FloatArray, weights: FloatArray, every: int, look: bool
    ) -> int:
        """Make a step for each row of ``vectors``, at least one; keep those that ``every`` divides: a[t] in the first
        rows of ``activity``, the w[t] that change in those of ``weights``. With ``look``, end behind the first step
        after which something is not finite. Gives the number of steps made."""
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
    except plugins.PluginError as error:
        return Availability(False, str(error))


def listing() -> tuple[str, ...]:
    """A line for each backend: ``NAME available [note]`` or ``NAME unavailable: reason``."""
    lines = []
    for name in names():
        found = available(name)
        lines.append(
            f"{name} available {found.note}".rstrip() if found.available else f"{name} unavailable: {found.note}"
        )
    return tuple(lines)


def choose_backend(network: Network, steps: int | None = None) -> tuple[str, str]:
    """The name of the backend that runs this network unless another is asked for, and why. A run that is shorter than
    ``time.steps``, and one step by step, count as one of these: a run and its parts give the same bits."""
    size = f"{len(network.neurons)} neurons, {len(network.connections)} connections"
    if "c" not in names():
        return "numpy", f"array code made for this network ({size}); needs nothing but NumPy"
    from neurovis_spec.runtime.c_choice import pays

    better, why = pays(network, max(network.steps, steps or 0))
    return ("c", f"{why} ({size})") if better else ("numpy", f"array code made for this network ({size}); {why}")


def prepare(network: Network, backend: str | Backend | None = None, steps: int | None = None) -> Stepper:
    """Make a network ready to run on a backend, by default on the one chosen for so many steps.

    Raises BackendError where it is unknown, not available, or lacks something that the network asks for.
    """
    if backend is None:
        backend = choose_backend(network, steps)[0]
        if backend == "c":
            try:
                return load(backend).prepare(network)
            except (BackendError, plugins.PluginError):  # a compiler that cannot compile
                backend = "numpy"
    chosen = load(backend) if isinstance(backend, str) else backend
    found = chosen.availability()
    if not found.available:
        raise BackendError(f"the backend '{chosen.name}' is not available here: {found.note}")
    missing = lacking(network, chosen.capabilities)
    if missing:
        raise BackendError(f"the backend '{chosen.name}' cannot run '{network.name}': {'; '.join(missing)}")
    return chosen.prepare(network)


def lacking(network: Network, capabilities: Capabilities) -> tuple[str, ...]:
    """What the network asks for and the backend does not have."""
    size = len(network.neurons) + len(network.connections)
    asked = (
        (not capabilities.delays and bool((network.connections.delays > 1).any()), "no delays of more than a step"),
        (not capabilities.plasticity and bool(network.plasticity), "no plasticity"),
        (not capabilities.noise and bool(network.noises), "no noise"),
        (not capabilities.episodes and network.episode is not None, "no episodes"),
        (
            capabilities.largest is not None and size > capabilities.largest,
            f"at most {capabilities.largest} neurons and connections, not {size}",
        ),
    )
    return tuple(text for lacks, text in asked if lacks)
