"""Operations that are undefined at each step, such as ``clip(drive/s, -1, 1)`` where s is 0: what follows may hide it.

In: the models, activations and rules in use, with their settings. Out: a warning where one of them surely divides by 0,
or takes a logarithm, a root or another function where there is none, whatever arrives. What stands in a branch of a
conditional is not checked: the branch may never be taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.program import is_activation
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.arrays import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, FUNCTIONS
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Name,
    Tree,
    children,
    names,
)
from neurovis_spec.language.values import Choice


def check_undefined(compiled: Compiled, findings: Findings) -> None:
    """Warn at each choice of a definition with such an operation."""
    clock: dict[str, Value] = {"dt": compiled.network.dt}
    for kind, group in compiled.models:
        model, activation = kind.model, kind.activation
        steps = [state.each_step for state in model.state if state.each_step is not None]
        trees = [model.activity, *steps]
        _tell(group.model, "model", trees, dict(model.let), {**clock, **kind.model_parameters}, findings)
        if any(is_activation(node) for node in _always(trees, dict(model.let))):
            settings = {**clock, **kind.activation_parameters}
            _tell(group.activation, "activation", [activation.value], {}, settings, findings)
    for _, body, bundles in compiled.entries.values():
        for learning in (bundle.learning for bundle in bundles if bundle.learning is not None):
            rule = learning.rule
            trees = [tree for tree in (rule.each_step, *(state.each_step for state in rule.state)) if tree is not None]
            _tell(body.plasticity, "rule", trees, dict(rule.let), {**clock, **learning.parameters}, findings)


def _tell(
    choice: Choice | None,
    what: str,
    trees: list[Tree],
    lets: Mapping[str, Tree],
    settings: Mapping[str, Value],
    findings: Findings,
) -> None:
    if choice is None:
        return
    known: dict[str, Value] = {**CONSTANTS, **settings}
    found = next(filter(None, (_wrong(node, known) for node in _always(trees, lets))), None)
    if found is not None:
        message = f"with these settings the {what} '{choice.name.value}' {found} at each step"
        findings.warning("undefined-operation", choice.name.span, message)


def _always(trees: list[Tree], lets: Mapping[str, Tree]) -> Iterator[Tree]:
    """The parts of formulas that are computed at each step, and of the intermediate values that they read."""
    waiting, seen = [*trees], set[str]()
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend((node.condition,) if isinstance(node, Conditional) else children(node))
        if isinstance(node, Name) and node.name in lets and node.name not in seen:
            seen.add(node.name)
            waiting.append(lets[node.name])


def _wrong(node: Tree, known: Mapping[str, Value]) -> str | None:
    """What is wrong with an operation whatever arrives, for one neuron or connection at least; None if nothing is."""
    divisors = (operand for sign, operand in node.steps if sign in ("/", "%")) if isinstance(node, Chain) else ()
    for operand in divisors:
        if _is_known(operand, known) and (np.asarray(evaluate_array(operand, known)) == 0).any():
            return f"divides by {operand.name}, which is 0," if isinstance(operand, Name) else "divides by 0"
    computed = isinstance(node, Binary | Chain | Call) and _is_known(node, known)
    if computed and not np.isfinite(evaluate_array(node, known)).all():
        return "has an undefined operation"
    return None


def _is_known(tree: Tree, known: Mapping[str, Value]) -> bool:
    """Whether its value depends on nothing that arrives."""
    return names(tree) <= known.keys() and _plain(tree)


def _plain(tree: Tree) -> bool:
    """Whether there are only functions of the language in it."""
    if isinstance(tree, Call) and tree.function not in FUNCTIONS:
        return False
    return all(map(_plain, children(tree)))
