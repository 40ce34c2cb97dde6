"""Rules that replace the weight where a change of it is meant: ``weight: {each_step: 0.01 * pre * post}``.

In: the rules of a spec and of the files that it includes. Out: a warning at each such formula. It reads what is active
but nothing that outlasts the step, neither the weight nor a state that builds up, and in silence it is 0, as a change
is. A weight that follows states, the time or a signal, or that has a value in silence, is let be.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.unused_parts import Part, parts_of, reached, read
from neurovis_spec.compiler.program import Rule
from neurovis_spec.compiler.values.constants import value_of
from neurovis_spec.compiler.values.definitions import Defaults
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.arrays import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.language.unknown import UNKNOWN

_ACTIVE = frozenset({"pre", "sent", "post"})


def check_replaced_weights(compiled: Compiled, findings: Findings) -> None:
    """Warn of formulas of a weight that can only be meant as a change of it."""
    for library in (*compiled.included, compiled.spec):
        for name, model in library.rules.items():
            parts = parts_of(model)
            rule, defaults = compiled.library.definitions.rules.known()[name]
            formulas = ((model.weight.each_step, rule.each_step), (model.weight.each_episode, rule.each_episode))
            for formula, tree in formulas:
                if formula is None or tree is None:
                    continue
                found = reached(read(formula), parts)
                if _ACTIVE & found and not _lasts(found, parts) and _in_silence(tree, rule, defaults) == 0:
                    message = "this replaces the weight at each step: it does not read 'weight'"
                    if tree is rule.each_episode:
                        message = message.replace("each step", "the end of each episode")
                    findings.warning("replaces-weight", formula.span, message, "for a change write weight + …")


def _lasts(found: set[str], parts: dict[str, Part]) -> bool:
    """Whether there is among some names one whose value outlasts a step: the weight, or a state that reads itself."""
    states = [name for name in found if name in parts and parts[name].section == "state"]
    return "weight" in found or any(name in reached(parts[name].reads, parts) for name in states)


def _in_silence(tree: Tree, rule: Rule, defaults: Defaults) -> Value:
    """What a formula gives where nothing is active, with the default parameters."""
    values: dict[str, Value] = {**CONSTANTS, "dt": 1.0, "k": 1.0, "t": 1.0, "weight": 0.0}
    values |= dict.fromkeys((*_ACTIVE, *rule.signals), 0.0)
    for default in defaults:
        value = value_of(default.value, values)
        values[default.name] = 0.0 if value is UNKNOWN else value
    values |= {state.name: evaluate_array(state.initial, values) for state in rule.state}
    for name, let in rule.let:
        values[name] = evaluate_array(let, values)
    with np.errstate(all="ignore"):
        return evaluate_array(tree, values)
