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
from typing import TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import UNDEFINED_F, Block, Check, CheckedActivation, Model, Plasticity, Rule
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
from neurovis_spec.language.expressions.undefined import Hazard, Hazards, Read, either, hazards, together

M = TypeVar("M", Model, Rule)


def with_checks(network: Network) -> Network:
    """The network with the checks that it needs."""
    blocks = tuple(_Settings(network, number).of_block(block) for number, block in enumerate(network.blocks))
    rules = tuple(_Settings(network, number).of_rule(one) for number, one in enumerate(network.plasticity))
    if all(new is old for new, old in zip(blocks + rules, network.blocks + network.plasticity, strict=True)):
        return network
    return replace(network, blocks=blocks, plasticity=rules)


def without_checks(network: Network) -> Network:
    """The network without them, for one that nobody watches."""
    blocks = tuple(
        replace(block, model=_unchecked(block.model)) if _checks(block.model) else block for block in network.blocks
    )
    rules = tuple(replace(one, rule=_unchecked(one.rule)) if _checks(one.rule) else one for one in network.plasticity)
    return replace(network, blocks=blocks, plasticity=rules)


def _checks(definition: Model | Rule) -> bool:
    return any(isinstance(state, Check) for state in definition.state)


def _unchecked(definition: M) -> M:
    return replace(definition, state=tuple(state for state in definition.state if not isinstance(state, Check)))


class _Settings:
    """A block or a plasticity, with the settings of its definitions that stay as they are in a run."""

    def __init__(self, network: Network, number: int) -> None:
        self.network, self.number = network, number

    def known(self, owner: str, settings: Mapping[str, FloatArray]) -> dict[str, Value]:
        """The values of the names that do not change; ``owner``: ``model``, ``activation`` or ``rule``."""
        fixed = {name: values for name, values in settings.items() if not self.is_set(f"{owner}/{self.number}/{name}")}
        return {**CONSTANTS, "dt": self.network.dt, **fixed}

    def is_set(self, array: str) -> bool:
        """Whether an array can be set in a run."""
        return array in self.network.settable.variables

    def of_block(self, block: Block) -> Block:
        """The block with the checks of its model and activation."""
        model, activation = block.model, block.activation
        active = _with_new(hazards(model.activity, functions={"f": activation.value}), model)
        found = through_let([active, *self._of_states(model)], model.let)
        last = through_let(_of_episode(model), model.let)
        states = list(_check(f"model '{model.name}'", found, last, self.known("model", block.model_parameters)))
        if active.calls:
            inside = hazards(activation.value, max(call.hidden for call in active.calls)).found
            inside = list(_open(inside, self.known("activation", block.activation_parameters)))
            if inside:
                undefined = either(hazard.formula for hazard in inside)
                activation = CheckedActivation(activation.name, activation.parameters, activation.value, undefined)
                calls = [Hazard(inside[0].what, Call(UNDEFINED_F, c.call.arguments), c.where) for c in active.calls]
                states += _check(f"activation '{activation.name}'", _sized(calls), [], {})
        if not states:
            return block
        return replace(block, model=replace(model, state=(*model.state, *states)), activation=activation)

    def of_rule(self, plasticity: Plasticity) -> Plasticity:
        """The plasticity with the checks of its rule."""
        rule, connections, members = plasticity.rule, self.network.connections, plasticity.members
        bounded = any(
            self.is_set(name) or bool(np.isfinite(values[members]).any())
            for name, values in (("low", connections.low), ("high", connections.high))
        )
        hidden = Hidden.INFINITY if bounded else Hidden.NOTHING
        first = Hidden.ALL if self._replaced(rule.each_episode) else hidden
        steps = [] if rule.each_step is None else [hazards(rule.each_step, first)]
        ends = [] if rule.each_episode is None else [hazards(rule.each_episode, hidden)]
        found = through_let([*steps, *self._of_states(rule)], rule.let)
        last = through_let([*ends, *_of_episode(rule)], rule.let)
        states = list(_check(f"rule '{rule.name}'", found, last, self.known("rule", plasticity.parameters)))
        return replace(plasticity, rule=replace(rule, state=(*rule.state, *states))) if states else plasticity

    def _of_states(self, definition: Model | Rule) -> list[Hazards]:
        """What the states compute at each step. It shows, but for one that an episode's end replaces."""
        return [
            hazards(state.each_step, Hidden.ALL if self._replaced(state.each_episode) else Hidden.NOTHING)
            for state in definition.state
            if state.each_step is not None
        ]

    def _replaced(self, each_episode: Tree | None) -> bool:
        return self.network.episode is not None and each_episode is not None


def _of_episode(definition: Model | Rule) -> list[Hazards]:
    """What the states compute at an episode's end."""
    return [hazards(state.each_episode) for state in definition.state if state.each_episode is not None]


def through_let(read: Iterable[Hazards], let: tuple[tuple[str, Tree], ...]) -> list[Hazard]:
    """The hazards of formulas, and of the intermediate values that they read."""
    formulas = list(read)
    found = [hazard for formula in formulas for hazard in formula.found]
    reads: list[Read] = [read for formula in formulas for read in formula.names]
    for name, tree in reversed(let):
        one = together(read for read in reads if read.name == name)
        if one is not None:
            made = hazards(tree, one.hidden, one.where)
            found += made.found
            reads += made.names
    return _sized(found)


def _with_new(made: Hazards, model: Model) -> Hazards:
    """What an activity reads, over the old states: it sees the new ones."""
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
    yield Check(name, Number(0.0), step, _infinite(at_end, Name(name)) if at_end else None)


def _infinite(found: list[Hazard], otherwise: Tree) -> Tree:
    return Conditional(either(hazard.formula for hazard in found), Number(math.inf), otherwise)
