"""What a stage of the integration is made of: which outputs are taken at it, what is derived, what these read.

In: a Network, and its operation Integrate. Out: a Part for each population, in the order in which a stage makes them;
when stages are. All backends ask here, so that they do the same in the same order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.flows import BY_SLOPE, Jacobian, jacobian, with_slope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Definition, Integrate, Population, Port
from neurovis_spec.language.expressions.tree import Name, Tree, names

Let: TypeAlias = tuple[tuple[str, Tree], ...]

#: how far inside a step its ends are seen from, of its length: what jumps on the grid jumps between two steps
INSIDE: Final = 2.0**-20
#: what every model gives
_ACTIVITY: Final = "activity"


class Unfolded(NamedTuple):
    """What formulas need: the intermediate values among these, in their order, and all names that both read."""

    let: Let
    names: frozenset[str]


def unfolded(let: Let, trees: Iterable[Tree | None]) -> Unfolded:
    """What some formulas need of the intermediate values of their definition, which are in order."""
    read = frozenset[str]().union(*(names(tree) for tree in trees if tree is not None))
    needed: list[tuple[str, Tree]] = []
    for name, tree in reversed(let):
        if name in read:
            read |= names(tree)
            needed.append((name, tree))
    return Unfolded(tuple(reversed(needed)), read)


class Formulas(NamedTuple):
    """Formulas of a model that are evaluated together, by names, with the intermediate values and ports they read."""

    trees: tuple[tuple[str, Tree], ...]
    let: Let
    ports: tuple[Port, ...]
    #: all names that they read
    names: frozenset[str]


class Taken(NamedTuple):
    """What connections take of a population at a stage: its activity, an output or a state. ``places`` are where its
    members stand in the activities of all neurons followed by the outlets."""

    formulas: Formulas
    places: IntArray
    is_activity: bool


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A population at a stage. What is ``taken`` of all populations comes first, then the derivatives of all."""

    number: int
    population: Population
    taken: tuple[Taken, ...]
    derivatives: Formulas
    #: how much each derivative changes with its own state, where the method looks at that
    slopes: Formulas
    #: by states with noise, what their random numbers are multiplied by: at the first stage of a step
    spread: Formulas

    @property
    def ports(self) -> tuple[Port, ...]:
        """The ports that are read at a stage."""
        formulas = (*(taken.formulas for taken in self.taken), self.derivatives, self.slopes, self.spread)
        return tuple({port.name: port for one in formulas for port in one.ports}.values())

    @property
    def flows(self) -> tuple[str, ...]:
        """The names of its flow states."""
        return tuple(name for name, _ in self.derivatives.trees)


class Times(NamedTuple):
    """When the stages of a step, or of a part of one, are, in seconds."""

    first: float
    middle: float
    last: float


def times(start: float, h: float) -> Times:
    """The stages of ``h`` seconds from ``start`` on: the ends are seen from inside."""
    inside = INSIDE * h
    return Times(start + inside, start + h / 2.0, start + h - inside)


def parts_of(network: Network, operation: Integrate) -> tuple[Part, ...]:
    """What is done at a stage, population by population."""
    taken = _taken(network, operation)
    parts = []
    for number in operation.populations:
        population, slopes = network.populations[number], Jacobian((), {})
        model = population.model.definition
        if operation.method in BY_SLOPE:
            slopes, activation = jacobian(model), population.activation
            if model.reads_activation:
                activation = replace(activation, definition=with_slope(activation.definition))
                population = replace(population, activation=activation)
        own = [(name, places) for (owner, name), places in taken.items() if owner == number]
        parts.append(
            Part(
                number,
                population,
                tuple(
                    Taken(formulas_of(population, [(name, given(model, name))]), places, name == _ACTIVITY)
                    for name, places in own
                ),
                formulas_of(population, [(one.name, one.derivative) for one in model.flows]),
                formulas_of(population, slopes.diagonal.items(), slopes.let),
                formulas_of(population, [(one.name, one.noise) for one in model.flows]),
            )
        )
    return tuple(parts)


def formulas_of(population: Population, trees: Iterable[tuple[str, Tree | None]], more: Let = ()) -> Formulas:
    """Some formulas of the population's model, with ``more`` intermediate values behind its own."""
    kept = tuple((name, tree) for name, tree in trees if tree is not None)
    let, read = unfolded((*population.model.definition.let, *more), [tree for _, tree in kept])
    return Formulas(kept, let, tuple(port for port in population.ports if port.name in read), read)


def apart(port: Port) -> tuple[IntArray, IntArray]:
    """The places of the connections in ``Port.incoming`` whose signals are held over a step, and of those whose signals
    are made anew at each stage."""
    anew = np.zeros(len(port.incoming), dtype=np.bool_)
    if port.staged is not None:
        anew[port.staged] = True
    return np.flatnonzero(~anew), np.flatnonzero(anew)


def given(model: Definition, name: str) -> Tree | None:
    """The formula of the activity or of an output; a state is its own."""
    formulas = {one.name: one.each_step for one in model.gives}
    return formulas.get(name, Name(name))


def taken_by(network: Network) -> Indices:
    """What each connection takes (m,): an index into the activities of all neurons followed by the outlets."""
    return network.connections.sources.compact() if network.sending is None else network.sending


def places_among_taken(network: Network, parts: Iterable[Part]) -> IntArray:
    """Where each activity and each outlet, as ``taken_by`` has them, stands among all that is taken at a stage; −1 for
    what is not."""
    result = np.full(len(network.neurons) + network.outlet_count, -1, dtype=np.int64)
    start = 0
    for one in (taken for part in parts for taken in part.taken):
        result[one.places] = start + np.arange(len(one.places))
        start += len(one.places)
    return result


def _taken(network: Network, operation: Integrate) -> dict[tuple[int, str], IntArray]:
    """By population and name what is taken at a stage, and its places."""
    n, sending = len(network.neurons), taken_by(network)
    asked = np.zeros(n + network.outlet_count, dtype=np.bool_)
    for number in operation.populations:
        for port in network.populations[number].ports:
            if port.staged is not None:
                asked[sending[port.incoming[port.staged]]] = True
    found: dict[tuple[int, str], IntArray] = {}
    for number in operation.populations:
        members = network.populations[number].members
        beside = [one for one in network.outlets if one.population == number]
        outlets = [(one.name, n + one.start + np.arange(len(members))) for one in beside]
        for name, places in ((_ACTIVITY, members), *outlets):
            if asked[places].any():
                found[number, name] = places
    return found
