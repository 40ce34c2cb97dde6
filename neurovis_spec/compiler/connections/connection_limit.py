"""Crowds: entries that connect far more neurons than there may be connections, found before any neuron is made.

In: a spec, its Constants, the limits. Out: findings, for large groups alone: what is wrong with a small network is told
all at once, where its connections are made; to name a hundred thousand neurons first would take long, and memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from neurovis_spec.compiler.connections.patterns import least_pairs
from neurovis_spec.compiler.limits import Limits, amount
from neurovis_spec.compiler.names.size_estimate import size_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import formula_of
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.values import Choice

#: Neurons of both ends up to which an entry is left to those who make it.
_FEW = 20_000


def crowded(spec: Spec, constants: Constants, limits: Limits) -> bool:
    """Whether there are such entries among those from one group to another, which is reported."""
    quiet = replace(constants, findings=Findings(), structural=set())
    sizes = {name: _size(group, quiet) for name, group in spec.neurons.items()}
    before = constants.findings.errors
    for key, body in spec.connections:
        ends = [sizes.get(end.strip(), 0) for end in key.value.split("->")]
        if body.pattern is None or body.lost or len(ends) != 2 or sum(ends) <= _FEW or not all(ends):
            continue
        least = least_pairs(body.pattern.name.value, ends[0], ends[1], _settings(body.pattern, quiet))
        if least > limits.connections:
            message = f"this makes {amount(least)} connections; the limit is {limits.connections:,}"
            constants.findings.error("too-many", key.span, message, "raise it with --limit")
    return constants.findings.errors > before


def _size(group: GroupModel, constants: Constants) -> int:
    """The neurons of a group; 0 where that is invalid."""
    return 0 if group.lost else int(size_of(group, constants, {}, 1)[0])


def _settings(choice: Choice, constants: Constants) -> Mapping[str, float]:
    """The settings of a pattern that are in order."""
    formulas = {entry.name: formula_of(entry.value, constants.findings) for entry in choice.settings}
    values = {name: None if formula is None else constants.scalar(formula) for name, formula in formulas.items()}
    return {name: value for name, value in values.items() if value is not None}
