"""Checks in a run: an undefined operation whose result is swallowed, as in ``clip(1/0, -1, 1)``, would go unnoticed.

In: a Network. Out: the same, but models and rules with such an operation have a Check: a state that is an infinity
after a step in which one was undefined, so that the watch (``runtime/watch.py``) finds it among the other numbers. It
is a formula like others, which every backend computes; most networks have none, and then it costs nothing.

``clip(1/drive, -1, 1)`` gets ``∞ if drive == 0 else 0``; ``1/drive`` gets none, as its value shows; nor does
``drive/s`` for a setting that is not 0 and that nobody can set in a run.

- A *hazard* is an operation that may be undefined, with a formula that is true where it is.
- A check has a formula for each *phase* in which something may be undefined: where spikes bring about some of these,
  what one has found stays, so that it is seen behind the step.
- *Hidden* says what of a value is swallowed afterwards: NOTHING, INFINITY (a bound swallows that, but no NaN) or ALL.
- What a definition *gives* is its result: a model's activity, a rule's weight. A result is *lasting* where it is kept
  from step to step, as all states and the weight are, and *fleeting* where it is computed anew from the new states, as
  the activity is.
- What is undefined in a derivative is looked for at the end of the step alone, not at each stage of the integration.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.lower import receiving
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    JOINING,
    PHASES,
    UNDEFINED_F,
    Check,
    Definition,
    Key,
    Operation,
    Phase,
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

#: The phases that come behind ``each_step``.
_BEHIND: Final[frozenset[Phase]] = frozenset(("fire", "settle", "jump_now"))


def with_checks(network: Network) -> Network:
    """The network with the checks that it needs."""
    checks = _Checks(network)
    populations = tuple(map(checks.checked_population, network.populations))
    projections = tuple(map(checks.checked_projection, network.projections))
    if all(new is old for new, old in zip((*populations, *projections), network.holders, strict=True)):
        return network
    return replace(network, populations=populations, projections=projections, program=_receiving(network, projections))


def _receiving(network: Network, projections: tuple[Projection, ...]) -> tuple[Operation, ...]:
    """The program with what the synapses of these have to do once a step."""
    numbers = network.located("neuron").numbers
    targets = {
        number: int(numbers[network.connections.targets[one.members[:1]][0]])
        for number, one in enumerate(projections)
        if one.kind in JOINING
    }
    return receiving(network.program, projections, targets)


def without_checks(network: Network) -> Network:
    """The network without them, for one that nobody watches."""
    populations = tuple(replace(population, model=_unchecked(population.model)) for population in network.populations)
    projections = tuple(replace(one, uses=tuple(map(_unchecked, one.uses))) for one in network.projections)
    return replace(network, populations=populations, projections=projections, program=_receiving(network, projections))


def _unchecked(use: Use) -> Use:
    definition = use.definition
    state = tuple(state for state in definition.state if not isinstance(state, Check))
    return use if len(state) == len(definition.state) else replace(use, definition=replace(definition, state=state))


class _Checks:
    """Makes the checks of a network."""

    def __init__(self, network: Network) -> None:
        self.network = network

    def fixed(self, use: Use) -> dict[str, Value]:
        """The values of the names that do not change in a run: constants, and settings that nobody can set."""
        settings = {name: values for name, values in use.parameters.items() if not self.is_set(Key(use.owner, name))}
        return {**CONSTANTS, "dt": self.network.dt * use.definition.per_second, **settings}

    def is_set(self, array: Key) -> bool:
        """Whether an array can be set in a run."""
        return array in self.network.settable.variables

    def checked_population(self, population: Population) -> Population:
        """The population with the checks of its model and activation."""
        activation = population.activation.definition
        checks, calls = self.of_use(population.model, functions=activation.functions)
        if calls and activation.given.each_step is not None:
            inside = hazards(
                activation.given.each_step, max(call.hidden for some in calls.values() for call in some)
            ).found
            inside = _still_possible(inside, self.fixed(population.activation))
            if inside:
                # The activation gets a second function, true where the first one is undefined; the check of the model
                # calls it with the arguments with which the model calls the first one.
                undefined = Quantity(UNDEFINED_F, either(hazard.formula for hazard in inside))
                activation = replace(activation, gives=(*activation.gives, undefined))
                at_calls = {
                    phase: _within_formula_limit(
                        Hazard(inside[0].what, Call(UNDEFINED_F, one.call.arguments), one.where) for one in some
                    )
                    for phase, some in calls.items()
                }
                check = _check(f"activation '{activation.name}'", at_calls, {})
                checks += () if check is None else (check,)
        if not checks:
            return population
        model = _with_states(population.model, checks)
        return replace(population, model=model, activation=replace(population.activation, definition=activation))

    def checked_projection(self, projection: Projection) -> Projection:
        """The projection with the checks of its definitions."""
        connections, members = self.network.connections, projection.members
        bounded = any(
            self.is_set(array) or bool(np.isfinite(values[members]).any())
            for array, values in ((LOW, connections.low), (HIGH, connections.high))
        )
        bounded &= projection.kind not in JOINING  # whose weights nothing changes
        hidden = Hidden.INFINITY if bounded else Hidden.NOTHING  # bounds make a number of an infinite weight
        checks = [self.of_use(use, hidden)[0] for use in projection.uses]
        if not any(checks):
            return projection
        return replace(projection, uses=tuple(map(_with_states, projection.uses, checks)))

    def of_use(
        self, use: Use, hidden: Hidden = Hidden.NOTHING, functions: Mapping[str, Tree] = MappingProxyType({})
    ) -> tuple[list[Check], dict[Phase, list[Called]]]:
        """The checks of a definition, none or one, and where it calls some of the ``functions``, by the phases before
        an episode's end. ``hidden``: how far its result is swallowed afterwards. A state shows, unless an episode's end
        replaces it."""
        definition = use.definition
        found: dict[Phase, list[Hazards]] = {"each_step": []}
        end: Phase = "settle" if definition.fires else "each_step"
        for result in definition.fleeting:
            if result.each_step is not None:
                made = hazards(result.each_step, functions=functions)
                found.setdefault(end, []).append(
                    made if definition.fires else _in_terms_of_old_states(made, definition)
                )
        for quantity in (*definition.gives, *definition.state) if definition.kind.lasting else definition.state:
            degree = hidden if quantity in definition.gives else Hidden.NOTHING
            for phase, tree in _computed(quantity, end):
                is_replaced = self._is_replaced(quantity, phase, tree)
                made = hazards(tree, Hidden.ALL if is_replaced else degree, None, functions)
                found.setdefault(phase, []).append(made)
        through = {phase: through_let(some, definition.let, functions) for phase, some in found.items()}
        check = _check(
            f"{definition.kind.noun} '{definition.name}'",
            {phase: some.found for phase, some in through.items()},
            self.fixed(use),
        )
        through.pop("each_episode", None)
        return [] if check is None else [check], {phase: some.calls for phase, some in through.items() if some.calls}

    def _is_replaced(self, quantity: Quantity, phase: Phase, tree: Tree) -> bool:
        """Whether what a formula makes of something in a phase may not be seen behind the step, as an episode's end or
        a later formula makes something else of it."""
        if phase == "each_episode":
            return False
        if self.network.episode is not None and quantity.each_episode is not None:
            return True
        return quantity.each_step is not None and tree is not quantity.each_step and phase not in _BEHIND


def _computed(quantity: Quantity, end: Phase) -> Iterator[tuple[Phase, Tree]]:
    """What a step computes of something, and in which phase that is looked at: derivatives at the ``end``."""
    if quantity.each_step is not None:
        yield "each_step", quantity.each_step
    yield from ((end, flow) for flow in (quantity.derivative, quantity.noise) if flow is not None)
    yield from quantity.acts
    if quantity.each_episode is not None:
        yield "each_episode", quantity.each_episode


def _with_states(use: Use, states: list[Check]) -> Use:
    """The use of a definition that has these states, too."""
    return replace(use, definition=replace(use.definition, state=(*use.definition.state, *states)))


def through_let(
    formulas: Iterable[Hazards],
    let: tuple[tuple[str, Tree], ...],
    functions: Mapping[str, Tree] = MappingProxyType({}),
) -> Hazards:
    """The hazards of formulas, and of the intermediate values (``let``) that they read, together; ``functions`` are
    those of the place."""
    formulas = list(formulas)
    found = [hazard for formula in formulas for hazard in formula.found]
    reads: list[Read] = [read for formula in formulas for read in formula.names]
    calls: list[Called] = [call for formula in formulas for call in formula.calls]
    for name, tree in reversed(let):  # the last first, as later ones read earlier ones
        as_read = together(reads, name)
        if as_read is not None:
            inside = hazards(tree, as_read.hidden, as_read.where, functions)
            found += inside.found
            reads += inside.names
            calls += inside.calls
    return Hazards(_within_formula_limit(found), reads, calls)


def _in_terms_of_old_states(made: Hazards, definition: Definition) -> Hazards:
    """The hazards of a fleeting result, which reads the new states, as formulas over the old ones, which a check
    reads. What becomes too long for a formula is left out."""
    new = {state.name: state.each_step for state in definition.state if state.each_step is not None}

    def rewritten(tree: Tree) -> Tree:
        return substitute(tree, new) if new.keys() & names(tree) else tree

    def where(tree: Tree | None) -> Tree | None:
        return None if tree is None else rewritten(tree)

    found, reads, calls = Hazards([], [], [])
    for hazard in made.found:
        with suppress(ExpressionError):
            found.append(hazard._replace(condition=rewritten(hazard.condition), where=where(hazard.where)))
    for read in made.names:
        with suppress(ExpressionError):
            reads.append(read._replace(where=where(read.where)))
    for called in made.calls:
        with suppress(ExpressionError):
            call = replace(called.call, arguments=tuple(map(rewritten, called.call.arguments)))
            calls.append(called._replace(call=call, where=where(called.where)))
    return Hazards(found, reads, calls)


def _within_formula_limit(candidates: Iterable[Hazard]) -> list[Hazard]:
    """The first hazards, as many as are together no longer than a formula may be."""
    kept: list[Hazard] = []
    for hazard in candidates:
        with suppress(ExpressionError):
            check_extent(either(one.formula for one in (*kept, hazard)))
            kept.append(hazard)
    return kept


def _still_possible(candidates: Iterable[Hazard], fixed: Mapping[str, Value]) -> list[Hazard]:
    """The hazards that the fixed values do not rule out."""
    possible: list[Hazard] = []
    for hazard in candidates:
        if not names(hazard.condition) <= fixed.keys() or np.any(evaluate_array(hazard.condition, fixed)):
            possible.append(hazard)
    return possible


def _check(what: str, found: Mapping[Phase, list[Hazard]], fixed: Mapping[str, Value]) -> Check | None:
    """The check of a definition, of what it computes in each phase; None if it needs none."""
    possible = {phase: _still_possible(some, fixed) for phase, some in found.items()}
    if not any(possible.values()):
        return None
    kinds = {hazard.what for some in possible.values() for hazard in some}
    name = f"the {what} {kinds.pop() if len(kinds) == 1 else 'has an undefined operation'}"
    # what an earlier phase has made of the state stays, or becomes infinite; the first of a step begins anew
    made = {phase: _infinite_if_any(some, Name(name)) for phase, some in possible.items() if some}
    acts = tuple((phase, tree) for phase, tree in made.items() if phase not in PHASES)
    if not acts:
        made["each_step"] = _infinite_if_any(possible.get("each_step", []), Number(0.0))
    return Check(name, made.get("each_step"), made.get("each_episode"), acts=acts)


def _infinite_if_any(possible: list[Hazard], otherwise: Tree) -> Tree:
    """∞ where one of the hazards is computed and undefined."""
    if not possible:
        return otherwise
    return Conditional(either(hazard.formula for hazard in possible), Number(math.inf), otherwise)
