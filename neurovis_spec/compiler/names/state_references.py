"""States by reference: ``K.v`` is the state v of the model of K's neurons, ``(K -> O).g`` that of a rule or a synapse.

In: the name of a state, the neurons or connections that are to have it, who has which states. Out: StateOf, or what is
wrong with it. A name that is a neuron's is never a state's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.program import MODEL, Definition, Each, ports_of
from neurovis_spec.diagnostics import Findings, Home, Span, Undeclared, shorten
from neurovis_spec.language.references import StateName
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.likeness import suggest

Names: TypeAlias = tuple[str, ...]

_NONE: IntArray = np.zeros(0, dtype=np.int64)


class StateOf(NamedTuple):
    """A state of the models of neurons, or of the rules and synapses of connections: one of the two is empty."""

    state: str
    neurons: IntArray
    connections: IntArray

    @classmethod
    def of(cls, each: Each, state: str, members: IntArray) -> StateOf:
        """A state of these neurons, or of these connections."""
        return cls(state, members, _NONE) if each == "neuron" else cls(state, _NONE, members)

    @property
    def size(self) -> int:
        """How many numbers it is."""
        return len(self.neurons) + len(self.connections)


class Refusal(NamedTuple):
    """Why a reference is to no state, or to no port."""

    message: str
    hint: str | None = None
    undeclared: Undeclared | None = None

    def report(self, code: str, span: Span, findings: Findings) -> None:
        """Report it, as an error at a place."""
        findings.error(code, span, self.message, self.hint, undeclared=self.undeclared)

    def __str__(self) -> str:
        """In one line."""
        return self.message + (f"; {self.hint}" if self.hint else "")


class Holder(NamedTuple):
    """Members (neurons, or connections) whose model, rule or synapse is ``kind`` and has these states, and these
    outputs beside them, where outputs are asked for, too; a synapse's is its signal. ``carriers``: of connections that
    share their states which of them has those of each, by whose name they go; None where each has its own."""

    members: IntArray
    kind: str
    states: tuple[str, ...]
    outputs: tuple[str, ...] = ()
    carriers: IntArray | None = None

    def having(self, state: str, connections: IntArray) -> IntArray:
        """The connections that have this state, or this output, of some connections."""
        own = np.isin(self.members, connections)
        if self.carriers is not None and state in self.states:
            return np.unique(self.carriers[own])
        return self.members[own]


class Wiring(NamedTuple):
    """The ends of all connections, what the entries are called, and the states of the rules and the synapses.
    ``complete``: there are no others. ``empty`` are the ends of the entries that make no connection."""

    sources: Indices
    targets: Indices
    names: tuple[str, ...]
    rules: tuple[Holder, ...]
    complete: bool = True
    empty: tuple[tuple[Indices, Indices], ...] = ()
    synapses: tuple[Holder, ...] = ()

    def nothing_between(self, sources: Sequence[int], targets: Sequence[int]) -> bool:
        """Whether an entry from any of some neurons to any of others makes no connection."""
        return any(np.isin(own[0], sources).any() and np.isin(own[1], targets).any() for own in self.empty)

    def between(self, sources: Sequence[int], targets: Sequence[int]) -> IntArray:
        """The connections from any of some neurons to any of others."""
        return np.flatnonzero(np.isin(self.sources, sources) & np.isin(self.targets, targets))


def model_state(name: StateName, neurons: Sequence[int], models: Iterable[Holder]) -> StateOf | Refusal:
    """A state of these neurons, all of whose models must have it."""
    wanted = np.array(neurons, dtype=np.int64)
    lacking = {
        int(found.min()): holder
        for holder in models
        if name.state not in (*holder.states, *holder.outputs) and len(found := wanted[np.isin(wanted, holder.members)])
    }
    if lacking:
        holder = lacking[min(lacking)]
        of = f"of '{shorten(name.owner.text)}'"
        return no_state("model", holder.kind, of, name.state, holder.states, holder.outputs)
    return StateOf.of("neuron", name.state, wanted)


def connections_state(
    name: StateName, connections: IntArray, wiring: Wiring, *, outputs: bool = True
) -> StateOf | Refusal | Unknown:
    """A state of those of these connections whose rule or synapse has it, or, as ``outputs`` are asked for, too, their
    signal; UNKNOWN where the connection that has it may be one that is invalid."""
    rules, synapses = (
        [holder for holder in some if np.isin(connections, holder.members).any()]
        for some in (wiring.rules, wiring.synapses)
    )
    holders = (*rules, *synapses)
    having = [
        holder.having(name.state, connections)
        for holder in holders
        if name.state in (*holder.states, *(holder.outputs if outputs else ()))
    ]
    if having:
        return StateOf.of("connection", name.state, np.sort(np.concatenate(having)))
    if not wiring.complete:
        return UNKNOWN
    if not len(connections):
        return Refusal(f"there is no connection '{shorten(name.owner.text)}'")
    if not holders:
        return Refusal(f"no rule changes '{shorten(name.owner.text)}', so it has no states")
    of = f"of '{shorten(name.owner.text)}'"
    several = [holder for holder in holders if holder.states and connections[0] in holder.members]
    if len(several) > 1:
        kinds = " and ".join(f"'{one.kind}'" for one in several)
        hint = suggest(name.state, [state for one in several for state in one.states], "their states are")
        return Refusal(f"{kinds} {of} have no state '{shorten(name.state)}'", hint)
    if rules and not any(one.states for one in synapses):
        return no_state("rule", rules[0].kind, of, name.state, rules[0].states)
    return no_state("synapse", synapses[0].kind, of, name.state, synapses[0].states)


def no_state(
    what: Literal["model", "rule", "synapse"], name: str, of: str, state: str, states: Names, outputs: Names = ()
) -> Refusal:
    """That a model, a rule or a synapse, ``of`` somebody, has not this state, but ``states``, and not this output, but
    ``outputs``."""
    owner = f"the {what} '{name}' {of}"
    if not states and not outputs:
        return Refusal(f"{owner} has no states")
    if not outputs:
        lost = Undeclared(state, Home((f"{what}s", name), ("state",)))
        return Refusal(f"{owner} has no state '{shorten(state)}'", suggest(state, states, "its states are"), lost)
    lost = Undeclared(state, Home((f"{what}s", name), ("state", "outputs")))
    hint = suggest(state, (*states, *outputs), "its states and outputs are")
    return Refusal(f"{owner} has no state and no output '{shorten(state)}'", hint, lost)


def no_port(port: str, group: str, model: Definition) -> Refusal | None:
    """That the neurons of a group have not this port, by their model; None where they have."""
    known = ports_of(model)
    if port in known:
        return None
    lost = Undeclared(port, Home((MODEL.section, model.name), ("ports",)))
    return Refusal(f"'{group}' has no port '{shorten(port)}'", suggest(port, known, "ports"), lost)


def singles(states: Iterable[StateOf]) -> Iterator[tuple[str, Each, int]]:
    """Each number by itself: the state, what has it (a neuron, a connection), and its index."""
    for one in states:
        yield from ((one.state, "neuron", index) for index in one.neurons.tolist())
        yield from ((one.state, "connection", index) for index in one.connections.tolist())
