"""Operations that are undefined at each step, such as ``clip(drive/s, -1, 1)`` where s is 0: what follows may hide it.

In: the models, activations and rules in use, with their settings. Out: a warning where one of them surely divides by 0,
or takes a logarithm, a root or another function where there is none, whatever arrives. What stands in a branch of a
conditional is not checked: the branch may never be taken. What depends on what arrives, a run checks
(``compiler/run_checks.py``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.program import Definition
from neurovis_spec.compiler.run_checks import through_let
from neurovis_spec.compiler.values.arguments import Settled
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, Hidden
from neurovis_spec.language.expressions.tree import Binary, Name, Tree, names
from neurovis_spec.language.expressions.undefined import Hazard, hazards
from neurovis_spec.language.values import Choice


def check_undefined(compiled: Compiled, findings: Findings) -> None:
    """Warn at each choice of a definition with such an operation."""
    found: dict[tuple[str, str], tuple[list[Hazard], list[Hazard]]] = {}
    for kind, group in compiled.models:
        choices = group.model, group.activation
        if not any(choices):
            continue
        model, activation = kind.model.definition, kind.activation.definition
        key = model.name, activation.name  # there may be very many groups of the same kind
        if key not in found:
            found[key] = _of_kind(model, activation)
        for hidden, used, choice in zip(found[key], (kind.model, kind.activation), choices, strict=True):
            if hidden:
                _tell(choice, used, hidden, compiled.network.dt, findings)
    for _, body, bundles in compiled.entries.values():
        for bundle in bundles:
            rules = [learning.settled for learning in bundle.rules]  # none without connections
            for choice, rule in zip(body.plasticity, rules, strict=False):
                _tell(choice, rule, _of_connections(rule.definition), compiled.network.dt, findings)
            if bundle.synapse is not None:
                hidden = _of_connections(bundle.synapse.definition)
                _tell(body.synapse, bundle.synapse, hidden, compiled.network.dt, findings)


def _at_steps(definition: Definition) -> Iterator[Tree]:
    """What a definition computes at each step."""
    for one in (*definition.gives, *definition.state):
        yield from (tree for tree in (one.each_step, one.derivative, one.noise) if tree is not None)


def _of_connections(definition: Definition) -> list[Hazard]:
    """What may be undefined in the formulas of a rule or a synapse."""
    made = [hazards(tree, Hidden.ALL) for tree in _at_steps(definition)]
    return through_let(made, definition.let).found


def _of_kind(model: Definition, activation: Definition) -> tuple[list[Hazard], list[Hazard]]:
    """What may be undefined in the formulas of a model, and in an activation that it always computes."""
    functions = activation.functions
    made = [hazards(tree, Hidden.ALL, functions=functions) for tree in _at_steps(model)]
    found = through_let(made, model.let, functions)
    computed = any(call.where is None for call in found.calls)
    inside = [hazard for tree in _at_steps(activation) for hazard in hazards(tree, Hidden.ALL).found]
    return found.found, inside if computed else []


def _tell(choice: Choice | None, used: Settled, found: Iterable[Hazard], dt: float, findings: Findings) -> None:
    """Warn of the first hazard that is always computed, and undefined for one neuron or connection at least."""
    what = used.definition.kind.name
    known: dict[str, Value] = {**CONSTANTS, "dt": dt * used.definition.per_second, **used.parameters}
    for hazard in found if choice is not None else ():
        condition = hazard.condition
        if hazard.where is None and names(condition) <= known.keys() and np.any(evaluate_array(condition, known)):
            assert choice is not None
            named = condition.left if isinstance(condition, Binary) and hazard.what == "divides by 0" else None
            words = f"divides by {named.name}, which is 0," if isinstance(named, Name) else hazard.what
            message = f"with these settings the {what} '{choice.name.value}' {words} at each step"
            findings.warning("undefined-operation", choice.name.span, message)
            return
