"""Flows: what the formulas of a definition read, what of it flows, and how its derivatives depend on its own states.

In: a Definition. Out: names, with intermediate values (``let``) unfolded; and trees.

A state with a derivative *flows*, and so does what is made of such states, parameters, ``t`` and what flows in through
ports alone: it has a value at each stage of the integration. What reads a state that steps change, ``k``, or something
that is held over a step, does not. A state without any formula keeps what it began with, as a parameter does.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

from neurovis_spec.compiler.program import MODEL, SLOPE_F, SPIKE, Definition, Quantity, ports_of
from neurovis_spec.language.expressions.derivative import derivative, slope
from neurovis_spec.language.expressions.tree import Name, Number, Tree, names
from neurovis_spec.language.words import Method

#: The methods that look at how much a derivative changes with its own state.
BY_SLOPE: Final[frozenset[Method]] = frozenset(("exponential", "semi_implicit"))
#: By what a model may call, what is called for its derivative.
_SLOPES: Final = {"f": SLOPE_F}


def reads(definition: Definition, trees: Iterable[Tree | None]) -> frozenset[str]:
    """All names that some formulas of a definition read, those of its intermediate values (which are not among them)
    with what these read."""
    let = dict(definition.let)
    waiting = [name for tree in trees if tree is not None for name in names(tree)]
    seen: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += names(let[name]) if name in let else ()
    return frozenset(seen - let.keys())


class PortsRead(NamedTuple):
    """The ports that are read: by ``flow``, derivatives and noise; by ``update``, what is made anew at the end of a
    step, ``jump`` apart; by each of its outputs and the activity; and by ``jump``."""

    flow: frozenset[str]
    update: frozenset[str]
    outputs: Mapping[str, frozenset[str]]
    jump: frozenset[str] = frozenset()

    @property
    def once(self) -> frozenset[str]:
        """All that are read once a step."""
        return self.update | self.jump


def ports_read_by(definition: Definition) -> PortsRead:
    """Which formulas of a model read which of its ports, ``drive`` among them."""
    ports = frozenset(ports_of(definition))
    flow = reads(definition, (tree for one in definition.flows for tree in (one.derivative, one.noise)))
    stepped = (tree for one in definition.state for tree in (one.each_step, one.each_episode))
    jumps = [tree for one in definition.state for phase, tree in one.acts if phase == "jump"]
    further = [tree for one in definition.state for phase, tree in one.acts if not phase.startswith("jump")]
    outputs = {one.name: reads(definition, [one.each_step]) & ports for one in definition.gives}
    update = (reads(definition, (*stepped, *further)) & ports).union(*outputs.values())
    return PortsRead(flow & ports, update, outputs, reads(definition, jumps) & ports)


def sent_by(model: Definition, sends: str) -> str:
    """What a connection takes of a neuron of this model that is told to take this; "" is what the model sends."""
    return sends or model.send or MODEL.gives


def is_spike(model: Definition, sent: str) -> bool:
    """Whether what a model sends is its spike: that state, or what is nothing else."""
    sent = sent_by(model, sent)
    let = dict(model.let)
    tree: Tree | None = next((one.each_step for one in model.gives if one.name == sent), Name(sent))
    while isinstance(tree, Name) and tree.name in let:
        tree = let.pop(tree.name)  # in a circle of names, which is reported, it is none
    return model.fires and isinstance(tree, Name) and tree.name == SPIKE  # wherever it is written


def reads_spike(model: Definition, sent: str) -> bool:
    """Whether what a model sends is its spike, or made of that."""
    sent = sent_by(model, sent)
    formulas = [one.each_step for one in model.gives if one.name == sent]
    return model.fires and SPIKE in reads(model, formulas or [Name(sent)])


def flows_by(definition: Definition, sent: str) -> frozenset[str] | None:
    """The ports that have to flow so that something flows that a model sends: a state or an output by its name, ""
    what it sends unless a connection says otherwise. None where it does not flow, whatever arrives."""
    sent, held = sent_by(definition, sent), _held(definition)
    if any(one.name == sent for one in definition.state):
        return None if sent in held else frozenset()
    read = reads(definition, [one.each_step for one in definition.gives if one.name == sent])
    return None if "k" in read or read & held else read.intersection(ports_of(definition))


def _held(definition: Definition) -> frozenset[str]:
    """The states that steps change and no derivative: they are the same over a step."""
    changed = (one for one in definition.state if one.stepped)
    return frozenset(one.name for one in changed if one.derivative is None)


def plain_flow(definition: Definition, sent: str = "") -> bool:
    """Whether what a model sends is made of flow states, parameters and ``t`` alone: it flows whatever arrives."""
    return flows_by(definition, sent) == frozenset()


def known_behind_flow(definition: Definition, sent: str = "") -> bool:
    """Whether what a model sends is known as soon as its states are integrated: it is made of flow states, parameters
    and ``t`` alone, and no ``each_step`` or ``each_episode`` changes one of these states afterwards."""
    if not plain_flow(definition, sent):
        return False
    sent = sent_by(definition, sent)
    changed = {one.name for one in definition.state if one.stepped}
    read = reads(definition, [one.each_step for one in definition.gives if one.name == sent])
    return changed.isdisjoint(read | {sent})


class Slope(NamedTuple):
    """A derivative of a formula, and further intermediate values that it reads, in order, behind those of the
    definition."""

    let: tuple[tuple[str, Tree], ...]
    tree: Tree

    @property
    def vanishes(self) -> bool:
        """Whether it is 0 wherever it is evaluated."""
        return isinstance(self.tree, Number) and self.tree.value == 0


def slope_by(definition: Definition, tree: Tree, name: str) -> Slope:
    """The derivative of a formula of a definition by one of the names that it sees, by the chain rule through
    intermediate values and the activation, whose derivative is the function SLOPE_F (``with_slope``); all other names
    count as constant. Raises ExpressionError where it is more than an expression may be.
    """
    slopes: dict[str, Tree] = {name: Number(1.0)}
    let: list[tuple[str, Tree]] = []
    for between, formula in needed(definition.let, tree):
        made = slope(formula, slopes, _SLOPES)
        if not isinstance(made, Number):
            let.append((f"d {between}/d {name}", made))
            slopes[between] = Name(let[-1][0])
        elif made.value != 0:
            slopes[between] = made
    found = slope(tree, slopes, _SLOPES)
    return Slope(tuple(needed(let, found)), found)


def signal_flows(synapse: Definition) -> bool:
    """Whether the signal of a synapse flows where all does that it reads of its ends: it reads neither the step nor a
    state that steps change."""
    return reads(synapse, [synapse.given.each_step]).isdisjoint({"k", *_held(synapse)})


class Jacobian(NamedTuple):
    """How much each derivative changes with its own state, all else but what depends on this being constant: a formula
    by each flow state, and further intermediate values that these read, in order, behind those of the definition."""

    let: tuple[tuple[str, Tree], ...]
    diagonal: Mapping[str, Tree]


def jacobian(definition: Definition) -> Jacobian:
    """The diagonal of the Jacobian of a definition. What arrives at ports counts as constant; how much of that a state
    brings about through synapses, ``slope_by`` of the derivative and the port says, times that of the signal and
    ``post.v``. Raises ExpressionError where a derivative is more than an expression may be.
    """
    let: list[tuple[str, Tree]] = []
    diagonal: dict[str, Tree] = {}
    for state in definition.flows:
        assert state.derivative is not None
        made = slope_by(definition, state.derivative, state.name)
        let += made.let
        diagonal[state.name] = made.tree
    return Jacobian(tuple(let), diagonal)


def needed(let: Sequence[tuple[str, Tree]], *by: Tree) -> list[tuple[str, Tree]]:
    """Of some intermediate values those that formulas need."""
    wanted = set().union(*map(names, by))
    found: list[tuple[str, Tree]] = []
    for name, tree in reversed(let):
        if name in wanted:
            wanted |= names(tree)
            found.insert(0, (name, tree))
    return found


def with_slope(activation: Definition) -> Definition:
    """An activation with its derivative as a further function, SLOPE_F. Raises ExpressionError where that is more than
    an expression may be."""
    given = activation.given.each_step
    if given is None or SLOPE_F in activation.functions:
        return activation
    return replace(activation, gives=(*activation.gives, Quantity(SLOPE_F, derivative(given, "x"))))
