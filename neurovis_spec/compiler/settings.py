"""Settings: what an author gives an activation, a model or a rule at its use.

In: a Choice (a name with settings), the definition's parameters with their defaults, the Constants. Out: the value of
every parameter, one for each of n neurons; the neuron's index ``i`` and the count ``n`` are known there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from neurovis_spec.compiler.constants import Constants, Randomness, Value
from neurovis_spec.compiler.definitions import Defaults, Definitions, check_bounds
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.network import FloatArray, Quantity
from neurovis_spec.diagnostics import Findings, suggest
from neurovis_spec.language.expressions.arrays import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.located import Formula, formula_of, shown
from neurovis_spec.language.source import Entry, Packed, Sequence
from neurovis_spec.language.values import Choice, FormulaList

T = TypeVar("T")


def choose(
    choice: Choice, known: Mapping[str, tuple[T, Defaults]], what: str, definitions: Definitions, findings: Findings
) -> tuple[T, Defaults] | None:
    """The definition that a choice names; an unknown name is answered with the nearest ones."""
    name = choice.name
    found = known.get(name.value)
    if found is None and not definitions.gaps.cover(f"{what}s", name.value):
        hint = suggest(name.value, known, "known")
        findings.error(f"unknown-{what}", name.span, f"there is no {what} '{shown(name.value)}'", hint)
    return found


def spread(
    formulas: Formula | FormulaList, n: int, constants: Constants, what: str, stream: Stream | None = None
) -> FloatArray | None:
    """One value for each of n neurons: from one formula of ``i`` and ``n``, or from a list of n.

    With a stream the formulas may draw random numbers; the counter of neuron i is (i, 0, 0, number of the draw).
    """
    if isinstance(formulas, FormulaList):
        return _listed(formulas, n, constants, what, stream)
    index = np.arange(n, dtype=np.int64)
    randomness = None if stream is None else Randomness(stream, index)
    value = constants.value(formulas, {"i": index.astype(np.float64), "n": float(n)}, randomness)
    return None if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), (n,)).copy()


def _listed(formulas: FormulaList, n: int, constants: Constants, what: str, stream: Stream | None) -> FloatArray | None:
    if len(formulas.items) != n:
        message = f"{what} has {plural(len(formulas.items), 'value')} for {plural(n, 'neuron')}"
        constants.findings.error("wrong-size", formulas.span, message)
        return None
    result: list[float] = []
    before = constants.findings.errors
    for position, item in enumerate(formulas.items):
        if not isinstance(item.value, str):
            result.append(float(item.value))
            continue
        randomness = None if stream is None else Randomness(stream, position)
        value = constants.value(item, {"i": float(position), "n": float(n)}, randomness)
        if value is not None:
            result.append(float(value))
        elif constants.findings.errors - before >= PATIENCE:
            return None
    return np.array(result, dtype=np.float64) if len(result) == n else None


def _formulas(entry: Entry, constants: Constants) -> Formula | FormulaList | None:
    node = entry.value
    if not isinstance(node, (Sequence, Packed)):
        return formula_of(node, constants.findings)
    items: list[Formula] = []
    before = constants.findings.errors
    for item in node.items:
        formula = formula_of(item, constants.findings)
        if formula is not None:
            items.append(formula)
        elif constants.findings.errors - before >= PATIENCE:
            return None
    return FormulaList(tuple(items), node.span) if len(items) == len(node) else None


def parameters(
    choice: Choice, defaults: Defaults, n: int, constants: Constants, allowed: tuple[str, ...] = ()
) -> dict[str, FloatArray] | None:
    """The value of every parameter of a definition for n neurons or connections.

    ``allowed`` are further keys (signals) that the caller reads itself.
    """
    given = _given(choice.settings, defaults, n, constants, allowed)
    if given is None:
        return None
    findings = constants.findings
    entries = {entry.name: entry for entry in choice.settings}
    values: dict[str, Value] = {**CONSTANTS, "dt": constants.dt}
    result: dict[str, FloatArray] = {}
    for default in defaults:
        name = default.name
        value = given.get(name)
        if value is None:
            value = np.broadcast_to(np.asarray(evaluate_array(default.value, values), dtype=np.float64), (n,)).copy()
            if not np.isfinite(value).all():
                message = f"with these settings the default of '{name}' is not a finite number"
                findings.error("not-finite", choice.name.span, message)
                return None
        values[name] = result[name] = value
        span = entries[name].value.span if name in entries else choice.name.span
        # A default that lies outside by itself is a finding of the definition.
        if given and not check_bounds(value, default, values, span, findings):
            return None
    return result


def _given(
    entries: tuple[Entry, ...], defaults: Defaults, n: int, constants: Constants, allowed: tuple[str, ...]
) -> dict[str, FloatArray] | None:
    """The settings as written; None where one of them is at fault."""
    names = tuple(default.name for default in defaults)
    given: dict[str, FloatArray] = {}
    failed = False
    for entry in entries:
        if entry.name in names:
            formulas = _formulas(entry, constants)
            value = None if formulas is None else spread(formulas, n, constants, f"'{entry.name}'")
            failed = failed or value is None
            if value is not None:
                given[entry.name] = value
        elif entry.name not in allowed:
            failed = True
            known = (*names, *allowed)
            hint = suggest(entry.name, known, "known here") or "it has no parameters"
            message = f"there is no parameter '{shown(entry.name)}'"
            constants.findings.error("unknown-parameter", entry.key.span, message, hint)
    return None if failed else given


def check_initials(
    states: tuple[Quantity, ...], values: Mapping[str, FloatArray], choice: Choice, constants: Constants
) -> bool:
    """Whether the states of a definition begin with finite numbers; a finding where one does not."""
    known: dict[str, Value] = {**CONSTANTS, "dt": constants.dt, **values}
    for state in states:
        if not np.isfinite(evaluate_array(state.initial, known)).all():
            message = f"with these settings the state '{state.name}' does not begin with a finite number"
            constants.findings.error("not-finite", choice.name.span, message)
            return False
    return True
