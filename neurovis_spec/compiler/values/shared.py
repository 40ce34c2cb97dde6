"""Shared synapses: all connections of an entry that lead to the same target have their states together.

In: the definition of a synapse with ``shared: true``. Out: what keeps it from that, formula by formula; and what it is
made of: the *receptor*, a synapse without what spikes do, of which there is one at each target, and the *feed*, what
each connection adds to the states of that.

States of several connections that are multiples of themselves and of each other add up to states of the same formulas,
as long as nothing in these is of one connection alone; so it is with what they bring.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final, NamedTuple

from neurovis_spec.compiler.flows import needed, reads
from neurovis_spec.compiler.program import AT_SPIKE, FEED, SYNAPSE, Definition, Quantity
from neurovis_spec.compiler.values.spikes import share_of
from neurovis_spec.language.expressions.tree import Chain, ChainOperator, Name, Number, Tree, Unary, names

#: What each connection has for itself, beside what is of its source.
_OWN: Final = ("weight", "pre", "sent")
_ZERO: Final = Number(0.0)


class Obstacle(NamedTuple):
    """Why a synapse cannot be shared: a formula of a state, of which ``key`` it is, or (without a state) the signal or
    the synapse as a whole; the message, and what to do."""

    state: str
    key: str
    message: str
    hint: str


def obstacles(synapse: Definition) -> Iterator[Obstacle]:
    """What keeps a synapse from being shared, in the order of its formulas, one a formula."""
    if not any(one.has("on_pre") for one in synapse.state):
        message = "there is nothing to share: no state of this synapse has 'on_pre'"
        yield Obstacle("", "shared", message, "leave 'shared' out")
        return
    for one in synapse.state:
        if one.initial != _ZERO:
            message = f"shared states begin with 0: each connection would bring its own '{one.name}'"
            yield Obstacle(one.name, "initial", message, "leave 'initial' out")
        for key, tree in _becoming(one):
            yield from _multiple(synapse, one.name, key, tree, f"as in {key}: -{one.name}/tau")
        for _, tree in one.acts:
            if _added(synapse, one.name, tree) is None:
                message = f"a spike adds to the shared state '{one.name}' what reads no state, and does nothing else"
                yield Obstacle(one.name, "on_pre", message, f"as in on_pre: {one.name} + weight")
    signal = synapse.given.each_step
    if signal is not None:
        yield from _multiple(synapse, "", SYNAPSE.gives, signal, "as in signal: g*(E - post.v)")


def _becoming(state: Quantity) -> Iterator[tuple[str, Tree]]:
    """What becomes of a state without spikes, by keys."""
    written = ("derivative", state.derivative), ("each_step", state.each_step), ("each_episode", state.each_episode)
    return ((key, tree) for key, tree in written if tree is not None)


def _multiple(synapse: Definition, state: str, key: str, tree: Tree, hint: str) -> Iterator[Obstacle]:
    """That a formula is no sum of multiples of states, or reads what is of one connection alone."""
    of_one = sorted(name for name in reads(synapse, [tree]) if name in _OWN or name.startswith("pre."))
    if of_one:
        name = of_one[0].removeprefix("pre.") if of_one[0] == AT_SPIKE["on_pre"] else of_one[0]
        message = f"'{name}' is of one connection, and this is of all that lead to the same target: it is shared"
        yield Obstacle(state, key, message, "read it in 'on_pre' alone, in what is added to a state")
    elif not _vanishes(tree) and share_of(tree, [one.name for one in synapse.state], synapse.let) != "multiple":
        message = "shared states add up what all connections bring, and this is no sum of multiples of states"
        yield Obstacle(state, key, message, f"each term has one state, as a factor: {hint}")


def _added(synapse: Definition, state: str, tree: Tree) -> Tree | None:
    """What a spike adds to a state; None where it does anything else."""
    states, let = [one.name for one in synapse.state], dict(synapse.let)
    if isinstance(tree, Name):
        return _ZERO if tree.name == state else _added(synapse, state, let[tree.name]) if tree.name in let else None
    if isinstance(tree, Unary) and tree.operator == "+":
        return _added(synapse, state, tree.operand)
    if not isinstance(tree, Chain) or not {"+", "-"}.issuperset(tree.operators):
        return None
    operators: tuple[ChainOperator, ...] = ("+", *tree.operators)
    terms = list(zip(operators, tree.operands, strict=True))
    own = [place for place, (_, term) in enumerate(terms) if share_of(term, states, synapse.let) != "constant"]
    if len(own) != 1 or terms[own[0]][0] != "+":
        return None
    within = _added(synapse, state, terms[own[0]][1])
    if within is None:
        return None
    plus: ChainOperator = "+"
    left = [*terms[: own[0]], *([] if _vanishes(within) else [(plus, within)]), *terms[own[0] + 1 :]]
    if not left or left[0][0] != "+":
        left = [(plus, _ZERO), *left]
    signs, added = zip(*left, strict=True)
    return Chain(signs[1:], added) if len(added) > 1 else left[0][1]


def _vanishes(tree: Tree) -> bool:
    return isinstance(tree, Number) and tree.value == 0


def receptor(synapse: Definition) -> Definition:
    """What of a shared synapse there is at each target: all but what spikes do."""
    states = tuple(replace(one, acts=()) for one in synapse.state)
    made = replace(synapse, state=states, let=(), sign=None, shared=False)
    return _pruned(replace(made, let=tuple(needed(synapse.let, *made.formulas))), ())


def feed(synapse: Definition) -> Definition:
    """What each connection of a shared synapse adds to the states there, and how its line ends."""
    gives = tuple(
        Quantity(one.name, acts=tuple((phase, _adding(synapse, one.name, tree)) for phase, tree in one.acts))
        for one in synapse.state
        if one.acts
    )
    made = replace(synapse, kind=FEED, gives=gives, state=(), let=(), shared=False)
    shown = () if made.sign is None else names(made.sign)
    return _pruned(replace(made, let=tuple(needed(synapse.let, *made.formulas))), shown)


def _adding(synapse: Definition, state: str, tree: Tree) -> Tree:
    added = _added(synapse, state, tree)
    assert added is not None  # of a definition that has obstacles no network is made
    return Chain(("+",), (Name(state), added))


def added_by(given: Quantity) -> Tree | None:
    """What of a feed is added to a state, without that; None where nothing is, in these phases."""
    tree = given.each_step
    return tree.operands[1] if isinstance(tree, Chain) else None


def _pruned(made: Definition, shown: Iterable[str]) -> Definition:
    """A definition without the parameters that it does not read."""
    read = made.read.union(shown)
    return replace(made, parameters=tuple(one for one in made.parameters if one in read))
