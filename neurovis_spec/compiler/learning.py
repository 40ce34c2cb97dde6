"""Learning: what an entry of ``connections`` says of its plasticity.

In: a Choice (a rule with settings and signals). Out: a Learning: the rule, its parameters (one value a connection),
and for each signal where it comes from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray, IntArray
from neurovis_spec.compiler.program import Rule
from neurovis_spec.compiler.references import Directory, few, resolve_end
from neurovis_spec.compiler.settings import check_initials, choose, look_at_settings, parameters, settle
from neurovis_spec.compiler.unit import Unit
from neurovis_spec.diagnostics import shown, suggest
from neurovis_spec.language.located import Located
from neurovis_spec.language.source import Entry, Node, Scalar
from neurovis_spec.language.values import Choice


class Learning(NamedTuple):
    """A rule in use. ``signals`` are indices into all activities followed by all inputs, one a connection; ``texts``
    are what the author calls them."""

    rule: Rule
    parameters: Mapping[str, FloatArray]
    signals: Mapping[str, IntArray]
    texts: Mapping[str, str]


def learning_of(
    choice: Choice,
    targets: IntArray | None,
    target_count: int | None,
    unit: Unit,
    directory: Directory,
    neurons: int,
) -> Learning | None:
    """The rule of an entry whose connection c goes to the ``targets[c]``-th of ``target_count`` targets; None where one
    of these is not known: the entry is at fault, and its rule is looked at only.

    ``directory`` says what the names of the unit mean, ``neurons`` is how many the network has.
    """
    constants, definitions = unit.constants, unit.definitions
    found = choose(choice, definitions.rules, "rule", definitions, constants.findings)
    if found is None:
        look_at_settings(choice, constants, ("i", "n"))
        return None
    rule, defaults = found
    known = (*(default.name for default in defaults), *rule.signals)
    settled = settle(choice, known, constants.findings)
    values = parameters(choice, defaults, None if targets is None else len(targets), constants, settled)
    signals: dict[str, IntArray] = {}
    failed = values is None
    for signal in rule.signals:
        entry = settled.entries.get(signal)
        if entry is None:
            failed = True
            if signal not in settled.perhaps:
                message = f"the rule '{rule.name}' needs the signal '{signal}'"
                hint = f"write {{{rule.name}: {{{signal}: NEURON_OR_INPUT}}}}"
                constants.findings.error("missing-signal", choice.name.span, message, hint)
            continue
        where = _signal(entry, targets, target_count, unit, directory, neurons)
        if where is None:
            failed = True
        else:
            signals[signal] = where
    if failed or values is None or not check_initials(rule.state, values, choice, constants):
        return None
    return Learning(rule, values, signals, {name: _text(settled.entries[name].value) for name in rule.signals})


def _signal(
    entry: Entry,
    targets: IntArray | None,
    target_count: int | None,
    unit: Unit,
    directory: Directory,
    neurons: int,
) -> IntArray | None:
    findings, inputs = unit.constants.findings, unit.inputs
    node = entry.value
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        findings.error(
            "wrong-type", node.span, f"the signal '{entry.name}' is the name of a neuron, a group or an input"
        )
        return None
    name = node.value.strip()
    if name in inputs:
        source = inputs[name]
        first = neurons + source.start
        where = np.arange(first, first + source.size, dtype=np.int64)
    elif unit.gaps.cover("inputs", name) or directory.covers(name):
        return None
    elif directory.find(name) is None and "." not in name and "+" not in name:
        names = (*unit.section.inputs, *directory.known)
        hint = suggest(name, few(name, names), "inputs and neurons")
        findings.error("unknown-signal", node.span, f"there is no neuron, group or input '{shown(name)}'", hint)
        return None
    else:
        found = resolve_end(Located(node.value, node), directory, findings)
        if found is None:
            return None
        where = np.array(found, dtype=np.int64)
    if len(where) == 1 and targets is not None:
        return np.repeat(where, len(targets))
    if len(where) == target_count and targets is not None:
        return where[targets]
    if target_count is None or len(where) in (1, target_count):
        return None
    message = f"the signal '{name}' has {len(where)} components; 1 or {target_count}, one for each target, are wanted"
    findings.error("wrong-size", node.span, message)
    return None


def _text(node: Node) -> str:
    """What an author calls a signal."""
    return str(node.value) if isinstance(node, Scalar) else "…"


def title_of(rule: Rule, values: Mapping[str, FloatArray], texts: Mapping[str, str]) -> str:
    """A rule in use for display: ``delta(rate=0.01, target=T)``; a parameter that has several values is ``…``."""
    parts = [
        f"{name}={array[0]:g}" if len(array) and (array == array[0]).all() else f"{name}=…"
        for name, array in values.items()
    ]
    parts += [f"{signal}={texts[signal]}" for signal in rule.signals]
    return f"{rule.name}({', '.join(parts)})" if parts else rule.name
