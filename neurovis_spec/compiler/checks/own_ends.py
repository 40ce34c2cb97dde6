"""Signals of rules that are the connection's own end: ``A -> O`` that learns by ``delta`` from the target O.

In: what a spec without errors became. Out: a warning at each signal that is the very neuron whose activity is ``post``,
where the rule then changes no weight, though it does with any other signal.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.no_op_rules import ever_changes
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.sections import ConnectionModel


def check_own_ends(compiled: Compiled, findings: Findings) -> None:
    """Warn of every signal that keeps a rule from changing weights, as it is the connection's own end."""
    for _, body, bundles in compiled.entries():
        learning = next((bundle.learning for bundle in bundles), None)
        for signal in () if learning is None else learning.rule.signals:
            if all(_is_own(bundle, signal) for bundle in bundles):
                _check(body, learning, signal, findings)


def _is_own(bundle: Bundle, signal: str) -> bool:
    """Whether a signal is, for every connection, the activity of its own target."""
    return bundle.learning is not None and np.array_equal(bundle.learning.signals[signal], bundle.targets)


def _check(body: ConnectionModel, learning: Learning | None, signal: str, findings: Findings) -> None:
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
