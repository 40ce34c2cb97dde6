"""Spikes: what a model writes of them, as formulas of its states, so that whoever computes a step knows states alone.

In: the trees of a spike block, the states that it is about. Out: the states, with what becomes of them in the phases
"jump", "fire" and "settle", and what these need beside what is written.

A neuron fires where ``when`` holds, it is armed, and it does not rest. It is disarmed by that while ``when`` still
holds; ``set`` counts as the reset. It rests for r steps, the next one on; what ``hold`` names stays as it is meanwhile.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.flows import reads
from neurovis_spec.compiler.program import SPIKE, Definition, Hidden, Quantity
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Name,
    Number,
    Tree,
    Unary,
    names,
)

#: Whether it may fire again as far as ``when`` goes, and one more than the steps for which it still rests.
_ARMED: Final = "is armed"
_RESTS: Final = "rests for"
#: The intermediate value that is true in the step in which it fires.
FIRES: Final = "it fires"
_ZERO, _ONE = Number(0.0), Number(1.0)


@dataclass(frozen=True, slots=True)
class Spike:
    """A spike block: trees, ``set`` by states. ``refractory`` is in the unit of time of the model, as ``dt`` is."""

    when: Tree
    set: Mapping[str, Tree]
    refractory: Tree | None = None
    hold: Collection[str] = ()

    @property
    def fires(self) -> tuple[str, Tree]:
        """The intermediate value that is true in the step in which the neuron fires."""
        return FIRES, Chain(("and", "and"), (self.when, Name(_ARMED), Binary("<=", Name(_RESTS), _ONE)))


def when_of(let: Collection[tuple[str, Tree]]) -> Tree | None:
    """``when`` of a model, from its intermediate values; None where it has no spike block."""
    return next((tree.parts[0] for name, tree in let if name == FIRES), None)


def still_fires(model: Definition, parameters: Mapping[str, FloatArray], dt: float) -> bool:
    """Whether what ``set`` leaves fulfils ``when`` at any of some neurons, by their parameters, as far as that is
    known: where ``when`` reads these alone, and states that are set by these alone."""
    when = when_of(model.let)
    if when is None or model.reads_activation:
        return False
    known = _known(model, parameters, dt)
    sets = {one.name: dict(one.acts).get("fire") for one in model.state if one.name != SPIKE}
    trees = {name: tree.then for name, tree in sets.items() if isinstance(tree, Conditional)}
    left = {name: _value(model, tree, known) for name, tree in trees.items() if reads(model, [tree]) <= known.keys()}
    read = reads(model, [when])
    if read.isdisjoint(left) or not read <= known.keys() | left.keys():
        return False
    return bool(np.any(_value(model, when, {**known, **left})))


def steps_at_rest(model: Definition, parameters: Mapping[str, FloatArray], dt: float) -> FloatArray | None:
    """For how many steps some neurons rest behind a spike, not rounded, one for all or one a neuron; None where the
    model has no refractory time, or one that more than parameters decide."""
    fired = next((dict(one.acts)["fire"] for one in model.state if one.name == _RESTS), None)
    rests = fired.then.parts[-1] if isinstance(fired, Conditional) else None
    if not isinstance(rests, Conditional) or model.reads_activation:
        return None
    time, known = rests.condition.parts[0], _known(model, parameters, dt)
    if not reads(model, [time]) <= known.keys():
        return None
    return np.atleast_1d(np.asarray(_value(model, time, known) / known["dt"]))


def _known(model: Definition, parameters: Mapping[str, FloatArray], dt: float) -> dict[str, Value]:
    """What is known of some neurons before a run."""
    return {**CONSTANTS, "dt": dt * model.per_second, **parameters}


def _value(model: Definition, tree: Tree, known: Mapping[str, Value]) -> Value:
    """The value of a formula of a model, of which all is known that it reads."""
    seen = dict(known)
    for name, one in model.let:
        if names(one) <= seen.keys():
            seen[name] = evaluate_array(one, seen)
    return evaluate_array(tree, seen)


def with_spike(states: tuple[Quantity, ...], spike: Spike) -> tuple[Quantity, ...]:
    """The states of a model with a spike block, with those that this adds."""
    made = tuple(_firing(one, spike) for one in states)
    rest = Conditional(Binary(">", Name(_RESTS), _ONE), Chain(("-",), (Name(_RESTS), _ONE)), _ZERO)
    resting = _if_fires(Chain(("+",), (_ONE, _steps(spike.refractory))), rest)
    rearmed = Chain(("and",), (Name(_ARMED), Unary("not", Name(SPIKE))))
    armed = Chain(("or",), (Unary("not", spike.when), rearmed))
    return (
        *made,
        Quantity(SPIKE, acts=(("fire", _if_fires(_ONE, _ZERO)),)),
        Hidden(_ARMED, initial=_ONE, acts=(("settle", armed),)),
        Hidden(_RESTS, acts=(("fire", resting),)),
    )


def jumping(state: Quantity, jump: Tree) -> Quantity:
    """A state to which something is added when spikes arrive: before the threshold is tested, or, for those of the same
    step, behind all spikes of it."""
    new = Chain(("+",), (Name(state.name), jump))
    return replace(state, acts=(("jump", new), ("jump_now", new)))


def _firing(state: Quantity, spike: Spike) -> Quantity:
    """A state with what a spike does to it."""
    if state.name in spike.hold:
        state = _held(state)
    if state.name in spike.set:
        state = replace(state, acts=(*state.acts, ("fire", _if_fires(spike.set[state.name], Name(state.name)))))
    return state


def _held(state: Quantity) -> Quantity:
    """A state that stays as it is while the neuron rests."""
    rests = Binary(">", Name(_RESTS), _ONE)
    # behind the spikes of a step the count is one less, and one that has fired in it rests from the next step on
    still = Chain(("and",), (Binary(">=", Name(_RESTS), _ONE), Unary("not", Name(SPIKE))))
    own = Name(state.name)

    def unless(otherwise: Tree, tree: Tree | None, condition: Tree = rests) -> Tree | None:
        return None if tree is None else Conditional(condition, otherwise, tree)

    acts = tuple((phase, Conditional(still if phase == "jump_now" else rests, own, tree)) for phase, tree in state.acts)
    return replace(
        state,
        derivative=unless(_ZERO, state.derivative),
        noise=unless(_ZERO, state.noise),
        each_step=unless(own, state.each_step),
        acts=acts,
    )


def _if_fires(then: Tree, otherwise: Tree) -> Tree:
    return Conditional(Name(FIRES), then, otherwise)


def _steps(time: Tree | None) -> Tree:
    """How many steps a time is, rounded; at least 1 where it is above 0."""
    if time is None:
        return _ZERO
    rounded = Call("floor", (Chain(("+",), (Chain(("/",), (time, Name("dt"))), Number(0.5))),))
    return Conditional(Binary(">", time, _ZERO), Call("max", (rounded, _ONE)), _ZERO)


def always_finite(state: Quantity) -> bool:
    """Whether a state of a model that fires is one of those that are 0 or 1."""
    return state.name in (SPIKE, _ARMED)


#: How a formula depends on what arrives: not at all, as a multiple of it, or otherwise.
Share: TypeAlias = Literal["constant", "multiple", "other"]


def share_of(tree: Tree, ports: Collection[str], let: Collection[tuple[str, Tree]]) -> Share:
    """How a formula depends on the ports of its model, which it may read through intermediate values.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> [share_of(parse(text), "ab", ()) for text in ("2*x", "x*a + b/2", "a*b", "a + 1")]
    ['constant', 'multiple', 'other', 'other']
    """
    shares: dict[str, Share] = dict.fromkeys(ports, "multiple")
    for name, between in let:
        shares[name] = _share(between, shares)
    return _share(tree, shares)


def _share(tree: Tree, shares: Mapping[str, Share]) -> Share:
    """The same by what is known of names; all others are constant."""
    if isinstance(tree, Name):
        return shares.get(tree.name, "constant")
    parts = tree.parts
    found = [_share(part, shares) for part in parts]
    match tree:
        case Unary(operator="-" | "+"):
            return found[0]
        case Chain(operators=("*" | "/", *_)) if "%" not in tree.operators:
            return _product(found, [operator == "/" for operator, _ in tree.steps])
        case Chain(operators=("+" | "-", *_)):
            return _sum(found, parts)
        case Conditional() if found[1] == "constant":  # its condition
            return _sum(found[::2], parts[::2])
    return "constant" if all(share == "constant" for share in found) else "other"


def _is_zero(tree: Tree) -> bool:
    return isinstance(tree, Number) and tree.value == 0


def _sum(shares: Sequence[Share], parts: Sequence[Tree]) -> Share:
    found = {share for share, part in zip(shares, parts, strict=True) if not _is_zero(part)}
    return found.pop() if len(found) == 1 else "constant" if not found else "other"


def _product(shares: Sequence[Share], divisors: Sequence[bool]) -> Share:
    if all(share == "constant" for share in shares):
        return "constant"
    under = any(share != "constant" for share, divides in zip(shares[1:], divisors, strict=True) if divides)
    once = sorted(shares) == ["constant"] * (len(shares) - 1) + ["multiple"]
    return "multiple" if once and not under else "other"
