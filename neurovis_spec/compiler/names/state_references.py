"""States by reference: ``K.v`` is the state v of the model of K's neurons, ``(K -> O).eligibility`` that of a rule.

In: a reference as written, who finds neurons by name, who has which states. Out: StateOf, or what is wrong with it.
Specs, commands, simulations and recordings read such references here; a name that is a neuron's is never a state's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.diagnostics import shorten, suggest

if TYPE_CHECKING:
    from neurovis_spec.compiler.network import Network

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NONE: IntArray = np.zeros(0, dtype=np.int64)


class StateName(NamedTuple):
    """A reference to a state, taken apart: ``owner`` is a reference to neurons, or ``FROM -> TO``."""

    owner: str
    state: str
    of_rule: bool


class StateOf(NamedTuple):
    """A state of the models of neurons, or of the rules of connections: one of the two is empty."""

    state: str
    neurons: IntArray
    connections: IntArray

    @property
    def size(self) -> int:
        """How many numbers it is."""
        return len(self.neurons) + len(self.connections)


class Refusal(NamedTuple):
    """Why a reference is to no state."""

    message: str
    hint: str | None = None


class Holder(NamedTuple):
    """Members (neurons, or connections) whose model or rule is ``kind`` and has these states."""

    members: IntArray
    kind: str
    states: tuple[str, ...]


class Wiring(NamedTuple):
    """The ends of all connections, and the states of their rules. ``complete``: there are no others."""

    sources: IntArray
    targets: IntArray
    rules: tuple[Holder, ...]
    complete: bool = True


def split_state(text: str) -> StateName | None:
    """A reference taken apart, None where it cannot be one to a state.

    >>> [None if name is None else tuple(name) for name in map(split_state, ("left1.K.v", "(K -> O).e", "K1..K3"))]
    [('left1.K', 'v', False), ('K -> O', 'e', True), None]
    """
    owner, dot, state = (part.strip() for part in text.rpartition("."))
    if not dot or not _NAME.fullmatch(state) or not owner or owner.endswith("."):
        return None
    low, dots, high = text.partition("..")
    way, dot, _ = low.strip().rpartition(".")
    if dots and "." not in high.strip().removeprefix(way + dot):  # left1.K1..left1.K3: the end of a range
        return None
    if owner.startswith("(") and owner.endswith(")"):
        ends = owner[1:-1].strip()
        return StateName(ends, state, True) if ends.count("->") == 1 else None
    return None if "->" in owner or "(" in owner or ")" in owner else StateName(owner, state, False)


def split_sum(text: str) -> Iterator[tuple[int, str]]:
    """The references that are joined with ``+``, which stand outside of parentheses, each with where it begins.

    >>> list(split_sum("(K + L -> O).e + K.v"))
    [(0, '(K + L -> O).e '), (16, ' K.v')]
    """
    start = depth = 0
    for place, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if character == "+" and depth <= 0:
            yield start, text[start:place]
            start = place + 1
    yield start, text[start:]


def model_state(name: StateName, neurons: Sequence[int], models: Iterable[Holder]) -> StateOf | Refusal:
    """A state of these neurons, all of whose models must have it."""
    wanted = np.array(neurons, dtype=np.int64)
    for holder in models:
        if name.state not in holder.states and np.isin(wanted, holder.members).any():
            return no_state(f"the model '{holder.kind}' of '{shorten(name.owner)}'", name.state, holder.states)
    return StateOf(name.state, wanted, _NONE)


def rule_state(
    name: StateName, sources: Sequence[int], targets: Sequence[int], wiring: Wiring
) -> StateOf | Refusal | None:
    """A state of the rules between two ends; None where the connection that has it may be one that is invalid."""
    between = np.isin(wiring.sources, np.array(sources)) & np.isin(wiring.targets, np.array(targets))
    return connections_state(name, np.flatnonzero(between), wiring)


def connections_state(name: StateName, connections: IntArray, wiring: Wiring) -> StateOf | Refusal | None:
    """A state of those of these connections whose rule has it."""
    holders = [holder for holder in wiring.rules if np.isin(connections, holder.members).any()]
    having = [holder.members for holder in holders if name.state in holder.states]
    if having:
        return StateOf(name.state, _NONE, connections[np.isin(connections, np.concatenate(having))])
    if not wiring.complete:
        return None
    if not len(connections):
        return Refusal(f"there is no connection '{shorten(name.owner)}'")
    if not holders:
        return Refusal(f"no rule changes '{shorten(name.owner)}', so it has no states")
    return no_state(f"the rule '{holders[0].kind}' of '{shorten(name.owner)}'", name.state, holders[0].states)


def no_state(owner: str, state: str, states: tuple[str, ...]) -> Refusal:
    """That a model or a rule, which is called ``owner``, has not this state, but ``states``."""
    if not states:
        return Refusal(f"{owner} has no states")
    return Refusal(f"{owner} has no state '{shorten(state)}'", suggest(state, states, "its states are"))


def holders_of(network: Network) -> tuple[Holder, ...]:
    """The states of the models of all neurons."""
    return tuple(
        Holder(block.members, block.model.name, tuple(quantity.name for quantity in block.model.state))
        for block in network.blocks
    )


def wiring_of(network: Network) -> Wiring:
    """All connections, with the states of their rules."""
    rules = tuple(
        Holder(entry.members, entry.rule.name, tuple(quantity.name for quantity in entry.rule.state))
        for entry in network.plasticity
    )
    return Wiring(network.connections.sources, network.connections.targets, rules)


def singles(states: Iterable[StateOf]) -> Iterator[tuple[str, str, int]]:
    """Each number by itself: the state, what has it (a neuron, a connection), and its index."""
    for one in states:
        yield from ((one.state, "neuron", index) for index in one.neurons.tolist())
        yield from ((one.state, "connection", index) for index in one.connections.tolist())


def names_of_states(network: Network, states: Iterable[StateOf]) -> tuple[str, ...]:
    """How each of these numbers is called: ``K1.v``, ``(K1 -> O).eligibility``."""
    result: list[str] = []
    for one in states:
        result += [f"{network.neurons.names[index]}.{one.state}" for index in one.neurons.tolist()]
        result += [f"({network.connection_names[index]}).{one.state}" for index in one.connections.tolist()]
    return tuple(result)
