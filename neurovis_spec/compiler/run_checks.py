"""What is checked in a run beside all that shows: operations that are undefined, and hidden by what is around them.

In: a Network. Out: the same, but models and rules with such an operation have a Check: a state that is an infinity
after a step in which one was undefined, so that the watch (``runtime/watch.py``) finds it among the other numbers. It
is a formula like others, which every backend computes; most networks have none, and then it costs nothing.

``clip(1/drive, -1, 1)`` gets ``∞ if drive == 0 else 0``; ``1/drive`` none, as its value shows; nor ``drive/s`` for a
setting that is not 0 and that nobody can set in a run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    UNDEFINED_F,
    Check,
    Definition,
    Key,
    Population,
    Projection,
    Quantity,
    Use,
)
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, Hidden
from neurovis_spec.language.expressions.tree import (
    Call,
    Conditional,
    ExpressionError,
    Name,
    Number,
    Tree,
    check_extent,
    names,
    substitute,
)
from neurovis_spec.language.expressions.undefined import (
    Called,
    Hazard,
    Hazards,
    Read,
    either,
    hazards,
    together,
)


def with_checks(network: Network) -> Network:
    """The network with the checks that it needs."""
    checks = _Checks(network)
    populations = tuple(map(checks.of_population, network.populations))
    projections = tuple(map(checks.of_projection, network.projections))
    if all(new is old for new, old in zip((*populations, *projections), network.holders, strict=True)):
        return network
    return replace(network, populations=populations, projections=projections)


def without_checks(network: Network) -> Network:
    """The network without them, for one that nobody watches."""
    populations = tuple(replace(population, model=_unchecked(population.model)) for population in network.populations)
    projections = tuple(replace(one, uses=tuple(map(_unchecked, one.uses))) for one in network.projections)
    return replace(network, populations=populations, projections=projections)


def _unchecked(use: Use) -> Use:
    made = use.definition
    state = tuple(state for state in made.state if not isinstance(state, Check))
    return use if len(state) == len(made.state) else replace(use, definition=replace(made, state=state))


class _Checks:
    """Makes the checks of a network, of whose settings some stay as they are in a run."""

    def __init__(self, network: Network) -> None:
        self.network = network

    def known(self, use: Use) -> dict[str, Value]:
        """The values of the names that do not change."""
        fixed = {name: values for name, values in use.parameters.items() if not self.is_set(Key(use.owner, name))}
        return {**CONSTANTS, "dt": self.network.dt, **fixed}

    def is_set(self, array: Key) -> bool:
        """Whether an array can be set in a run."""
        return array in self.network.settable.variables

    def of_population(self, population: Population) -> Population:
        """The population with the checks of its model and activation."""
        activation = population.activation.definition
        states, calls = self.of_use(population.model, functions=activation.functions)
        if calls and activation.given.each_step is not None:
            inside = hazards(activation.given.each_step, max(call.hidden for call in calls)).found
            inside = list(_open(inside, self.known(population.activation)))
            if inside:
                undefined = Quantity(UNDEFINED_F, either(hazard.formula for hazard in inside))
                activation = replace(activation, gives=(*activation.gives, undefined))
                found = [Hazard(inside[0].what, Call(UNDEFINED_F, c.call.arguments), c.where) for c in calls]
                states += _check(f"activation '{activation.name}'", _sized(found), [], {})
        if not states:
            return population
        model = _with_states(population.model, states)
        return replace(population, model=model, activation=replace(population.activation, definition=activation))

    def of_projection(self, projection: Projection) -> Projection:
        """The projection with the checks of its definitions."""
        connections, members = self.network.connections, projection.members
        bounded = any(
            self.is_set(array) or bool(np.isfinite(values[members]).any())
            for array, values in ((LOW, connections.low), (HIGH, connections.high))
        )
        degree = Hidden.INFINITY if bounded else Hidden.NOTHING
        states = [self.of_use(use, degree)[0] for use in projection.uses]
        if not any(states):
            return projection
        return replace(projection, uses=tuple(map(_with_states, projection.uses, states)))

    def of_use(
        self, use: Use, hidden: Hidden = Hidden.NOTHING, functions: Mapping[str, Tree] = MappingProxyType({})
    ) -> tuple[list[Check], list[Called]]:
        """The checks of a definition, of which what it gives is ``hidden`` to this degree, and what it calls of
        ``functions``. What is computed shows, but for what an episode's end replaces."""
        made = use.definition
        steps: list[Hazards] = []
        ends: list[Hazards] = []
        calls: list[Called] = []
        for one in made.fleeting:
            if one.each_step is not None:
                steps.append(_with_new(hazards(one.each_step, functions=functions), made))
                calls += steps[-1].calls
        for one in (*made.gives, *made.state) if made.kind.lasting else made.state:
            degree = hidden if one in made.gives else Hidden.NOTHING
            if one.each_step is not None:
                replaced = self.network.episode is not None and one.each_episode is not None
                steps.append(hazards(one.each_step, Hidden.ALL if replaced else degree))
            if one.each_episode is not None:
                ends.append(hazards(one.each_episode, degree))
        found, last = through_let(steps, made.let), through_let(ends, made.let)
        return list(_check(f"{made.kind.name} '{made.name}'", found, last, self.known(use))), calls


def _with_states(use: Use, states: list[Check]) -> Use:
    return replace(use, definition=replace(use.definition, state=(*use.definition.state, *states)))


def through_let(read: Iterable[Hazards], let: tuple[tuple[str, Tree], ...]) -> list[Hazard]:
    """The hazards of formulas, and of the intermediate values that they read."""
    formulas = list(read)
    found = [hazard for formula in formulas for hazard in formula.found]
    reads: list[Read] = [read for formula in formulas for read in formula.names]
    for name, tree in reversed(let):
        one = together(reads, name)
        if one is not None:
            made = hazards(tree, one.hidden, one.where)
            found += made.found
            reads += made.names
    return _sized(found)


def _with_new(made: Hazards, model: Definition) -> Hazards:
    """What is given reads, over the old states: it sees the new ones."""
    new = {state.name: state.each_step for state in model.state if state.each_step is not None}

    def old(tree: Tree) -> Tree:
        return substitute(tree, new) if new.keys() & names(tree) else tree

    def where(tree: Tree | None) -> Tree | None:
        return None if tree is None else old(tree)

    found, read, calls = Hazards([], [], [])
    for hazard in made.found:
        with suppress(ExpressionError):  # too long to be computed beside the rest
            found.append(hazard._replace(condition=old(hazard.condition), where=where(hazard.where)))
    for name in made.names:
        with suppress(ExpressionError):
            read.append(name._replace(where=where(name.where)))
    for one in made.calls:
        with suppress(ExpressionError):
            arguments = tuple(map(old, one.call.arguments))
            calls.append(one._replace(call=replace(one.call, arguments=arguments), where=where(one.where)))
    return Hazards(found, read, calls)


def _sized(found: Iterable[Hazard]) -> list[Hazard]:
    """The first of them, as many as are together no longer than a formula may be."""
    kept: list[Hazard] = []
    for hazard in found:
        with suppress(ExpressionError):
            check_extent(either(one.formula for one in (*kept, hazard)))
            kept.append(hazard)
    return kept


def _open(found: Iterable[Hazard], known: Mapping[str, Value]) -> Iterator[Hazard]:
    """Without what is defined with these settings, whatever arrives."""
    for hazard in found:
        settled = names(hazard.condition) <= known.keys()
        if not settled or np.any(evaluate_array(hazard.condition, known)):
            yield hazard


def _check(what: str, steps: list[Hazard], ends: list[Hazard], known: Mapping[str, Value]) -> Iterator[Check]:
    """The check of a definition, if it needs one: of what it computes at each step, and at an episode's end."""
    at_step, at_end = list(_open(steps, known)), list(_open(ends, known))
    if not at_step and not at_end:
        return
    kinds = {hazard.what for hazard in (*at_step, *at_end)}
    name = f"the {what} {kinds.pop() if len(kinds) == 1 else 'has an undefined operation'}"
    step = _infinite(at_step, Number(0.0)) if at_step else Number(0.0)
    yield Check(name, step, _infinite(at_end, Name(name)) if at_end else None)


def _infinite(found: list[Hazard], otherwise: Tree) -> Tree:
    return Conditional(either(hazard.formula for hazard in found), Number(math.inf), otherwise)
