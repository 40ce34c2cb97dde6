"""Rules that change no weight: with any signals, or because a signal is the connection's own target.

In: a compiled spec, a rule and its parameters. Out: whether the rule changes no weight, found by trial: its formulas
are evaluated at a few arbitrary points, and one that returns the weight at all of them is taken to do so everywhere;
a rule with states is tried over several steps. A warning at each signal that is the very neuron whose activity is
``post`` (``A -> O`` that learns by ``delta`` from the target O), where the rule then changes no weight, though it does
with any other signal.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.program import Rule
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.expressions.arrays import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.sections import ConnectionModel

_POINTS = 16
_STEPS = 6
_GIVEN = ("pre", "sent", "post", "weight")


def changes_nothing(rule: Rule, parameters: Mapping[str, FloatArray]) -> bool:
    """Whether neither a step nor an episode's end changes a weight, with the first connection's parameters."""
    generator = np.random.default_rng(0)  # the points of a test, not a draw of the network
    names = (*_GIVEN, *rule.signals, *(state.name for state in rule.state))
    values: dict[str, Value] = {**CONSTANTS, "dt": 0.5, "k": np.arange(1.0, _POINTS + 1)}
    values["t"] = values["k"] * 0.5
    values |= {name: float(array[0]) for name, array in parameters.items()}
    values |= {name: generator.uniform(-2.0, 2.0, _POINTS) for name in names}
    for name, tree in rule.let:
        values[name] = evaluate_array(tree, values)
    formulas = [tree for tree in (rule.each_step, rule.each_episode) if tree is not None]
    return all(bool(np.all(evaluate_array(tree, values) == values["weight"])) for tree in formulas)


def ever_changes(rule: Rule, parameters: Mapping[str, FloatArray], own: Collection[str] = ()) -> bool:
    """Whether a weight changes in a few steps and episodes with arbitrary values, from the states' initial values; the
    signals of ``own`` are the target's activity."""
    generator = np.random.default_rng(0)
    values: dict[str, Value] = {**CONSTANTS, "dt": 0.5, "weight": generator.uniform(-2.0, 2.0, _POINTS)}
    values |= {name: float(array[0]) for name, array in parameters.items()}
    values |= {state.name: evaluate_array(state.initial, values) for state in rule.state}
    for k in range(_STEPS):
        values |= {"k": float(k), "t": k * 0.5}
        for name in ("pre", "sent", "post", *rule.signals):
            values[name] = generator.uniform(-2.0, 2.0, _POINTS) * 10.0 ** (k % 3)
        values |= dict.fromkeys(own, values["post"])
        for episode in (False, True):
            new: dict[str, Value] = {}
            for name, tree in rule.let:
                values[name] = evaluate_array(tree, values)
            weight = rule.each_episode if episode else rule.each_step
            if weight is not None and not np.array_equal(evaluate_array(weight, values), values["weight"]):
                return True
            for state in rule.state:
                change = state.each_episode if episode else state.each_step
                if change is not None:
                    new[state.name] = evaluate_array(change, values)
            values |= new
    return False


def check_own_ends(compiled: Compiled, findings: Findings) -> None:
    """Warn of every signal that keeps a rule from changing weights, as it is the connection's own end."""
    for _, body, bundles in compiled.entries():
        learning = next((bundle.learning for bundle in bundles), None)
        for signal in () if learning is None else learning.rule.signals:
            if all(_is_own(bundle, signal) for bundle in bundles):
                _check_signal(body, learning, signal, findings)


def _is_own(bundle: Bundle, signal: str) -> bool:
    """Whether a signal is, for every connection, the activity of its own target."""
    return bundle.learning is not None and np.array_equal(bundle.learning.signals[signal], bundle.targets)


def _check_signal(body: ConnectionModel, learning: Learning | None, signal: str, findings: Findings) -> None:
    assert body.plasticity is not None
    assert learning is not None
    rule = learning.rule
    if ever_changes(rule, learning.parameters, (signal,)) or not ever_changes(rule, learning.parameters):
        return
    span = next(entry.value.span for entry in body.plasticity.settings if entry.name == signal)
    message = (
        f"'{shorten(learning.texts[signal])}' is this connection's own end: '{signal}' is then always 'post', and "
        f"'{rule.name}' changes no weight"
    )
    findings.warning("no-effect", span, message, "name a neuron or an input that says what 'post' should be")
