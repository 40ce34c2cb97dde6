"""Settings: what an author gives an activation, a model or a rule at its use.

In: a Choice (a name with settings), the definition's parameters with their defaults, the Constants. Out: the value of
every parameter, one for each of n neurons or connections (Each), of which the indices are known there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.events.settable import Assembled, Dependent, ParameterFormula, Part, Subset
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.program import Quantity
from neurovis_spec.compiler.values.constants import Constants, Randomness, Value, check_finite
from neurovis_spec.compiler.values.definitions import Default, Defaults, Definitions, check_bounds
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, meant, nearest, shorten, suggest
from neurovis_spec.language.expressions.arrays import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import Name, Tree, names
from neurovis_spec.language.located import IDENTIFIER, Formula, formula_of
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.values import Choice, FormulaList
from neurovis_spec.language.yaml.source import Entry, Packed, Scalar, Sequence

T = TypeVar("T")
_BIAS = formula_at(GroupModel, "bias")

#: Values of a list that are checked where it is not known how many there should be.
_MOST_LOOKS = 1000


class Settled(NamedTuple):
    """Settings by name; ``perhaps`` are names that an unknown one may be meant for. ``failed``: one was unknown."""

    entries: Mapping[str, Entry]
    perhaps: frozenset[str]
    failed: bool


class Each(NamedTuple):
    """What values are for: ``known`` are the names that mean something of each of them, numbers or arrays of integers,
    None where it is not known how many there are."""

    noun: str
    names: tuple[str, ...]
    known: Mapping[str, int | IntArray] | None = None

    def extra(self, one: int | None = None) -> dict[str, Value]:
        """The values of the names, for all or for one."""
        result: dict[str, Value] = {}
        for name, value in (self.known or {}).items():
            if isinstance(value, np.ndarray):
                result[name] = value.astype(np.float64) if one is None else float(value[one])
            else:
                result[name] = float(value)
        return result


def neurons(n: int | None) -> Each:
    """n neurons of a group: ``i`` and ``n``."""
    return Each("neuron", _BIAS.sees, None if n is None else {"i": np.arange(n, dtype=np.int64), "n": n})


def choose(
    choice: Choice, known: Mapping[str, tuple[T, Defaults]], what: str, definitions: Definitions, findings: Findings
) -> tuple[T, Defaults] | None:
    """The definition that a choice names; an unknown name is answered with the nearest ones, and taken for the one that
    it can only be meant for."""
    name = choice.name
    found = known.get(name.value)
    if found is None and not definitions.gaps.cover(f"{what}s", name.value):
        right = None if findings.many else meant(name.value, known)
        message = f"there is no {what} '{shorten(name.value)}'"
        findings.error(f"unknown-{what}", name.span, message, lambda: suggest(name.value, known, "known"))
        found = None if right is None else known[right]
    return found


def settle(choice: Choice, known: Collection[str], findings: Findings) -> Settled:
    """The settings of a choice by the names of its definition. An unknown one is a finding, and is taken for the one
    that it can only be meant for."""
    entries = {entry.name: entry for entry in choice.settings if entry.name in known}
    perhaps: set[str] = set()
    failed = False
    for entry in choice.settings:
        if entry.name in known:
            continue
        failed = True
        hint = suggest(entry.name, known, "known here") or "it has no parameters"
        message = f"there is no parameter '{shorten(entry.name)}'"
        findings.error("unknown-parameter", entry.key.span, message, hint)
        free = [name for name in known if name not in entries]
        right = meant(entry.name, free)
        if right is None:
            perhaps.update(nearest(entry.name, free))
        else:
            entries[right] = entry
    return Settled(entries, frozenset(perhaps), failed)


def check_settings(choice: Choice, constants: Constants, extra: tuple[str, ...] = ()) -> None:
    """What can be said of the settings of a definition that is not known: of those that are no names."""
    for entry in choice.settings:
        nodes = entry.value.items if isinstance(entry.value, (Sequence, Packed)) else (entry.value,)
        for node in nodes[:_MOST_LOOKS]:
            name = isinstance(node, Scalar) and isinstance(node.value, str) and IDENTIFIER.fullmatch(node.value.strip())
            formula = None if name else formula_of(node, constants.findings)
            if formula is not None:
                constants.look(formula, extra)


def spread(
    formulas: Formula | FormulaList,
    n: int | None,
    constants: Constants,
    what: str,
    stream: Stream | None = None,
    each: Each | None = None,
) -> FloatArray | None:
    """One value for each of n neurons, or for ``each`` of n others: from one formula, or from a list of n. Where n is
    not known, one value for all, or None.

    With a stream the formulas may draw random numbers; the counter of neuron i is (i, 0, 0, number of the draw).
    """
    if n is None:
        return _looked_at(formulas, constants, stream is not None, each or neurons(n))
    if isinstance(formulas, FormulaList):
        return _listed(formulas, n, constants, what, stream, each or neurons(n))
    if not isinstance(formulas.value, str):
        number = float(formulas.value)
        return np.full(n, number) if check_finite(number, formulas, constants.findings) else None
    randomness = None if stream is None else Randomness(stream, np.arange(n, dtype=np.int64))
    value = constants.value(formulas, (each or neurons(n)).extra(), randomness)
    return None if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), (n,)).copy()


def _looked_at(formulas: Formula | FormulaList, constants: Constants, random: bool, each: Each) -> FloatArray | None:
    """The value of a formula that is the same for each; the others are checked."""
    if isinstance(formulas, FormulaList):
        for item in formulas.items[:_MOST_LOOKS]:
            constants.look(item, each.names, random)
        return None
    value = constants.look(formulas, each.names, random)
    return None if value is None else np.array([value], dtype=np.float64)


def _listed(
    formulas: FormulaList, n: int, constants: Constants, what: str, stream: Stream | None, each: Each
) -> FloatArray | None:
    if len(formulas.items) != n:
        message = f"{what} has {plural(len(formulas.items), 'value')} for {plural(n, each.noun)}"
        constants.findings.error("wrong-size", formulas.span, message)
        return None
    result: list[float] = []
    before = constants.findings.errors
    for position, item in enumerate(formulas.items):
        if not isinstance(item.value, str):
            result.append(float(item.value))
            continue
        randomness = None if stream is None else Randomness(stream, position)
        place = np.array([position], dtype=np.int64)
        value = constants.value(item, each.extra(position), randomness, places=place)
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
    choice: Choice,
    defaults: Defaults,
    n: int | None,
    constants: Constants,
    settled: Settled | None = None,
    each: Each | None = None,
) -> dict[str, FloatArray] | None:
    """The value of every parameter of a definition for n neurons, or for ``each`` of n connections; None where one is
    invalid, or where n is not known and one depends on it.

    ``settled`` are its settings, where the caller has looked at them for more than the parameters.
    """
    findings = constants.findings
    settled = settled or settle(choice, tuple(default.name for default in defaults), findings)
    values: dict[str, Value] = {**CONSTANTS, "dt": constants.dt}
    result: dict[str, FloatArray] = {}
    following: dict[str, list[Part]] = {}
    for default in defaults:
        entry = settled.entries.get(default.name)
        with constants.following() as parts:
            value = _default(default, n, values) if entry is None else _setting(entry, default.name, n, constants, each)
        if value is None:
            continue
        if entry is None and not np.isfinite(value).all():
            message = f"with these settings the default of '{default.name}' is not a finite number"
            findings.error("not-finite", choice.name.span, message)
            return None
        if entry is None and _follows(default.value, following):
            parts = [Part(_assembled(default.value, values, following))]
        values[default.name] = value
        low, high = (
            None if bound is None or not _bounded(default, values) else _assembled(bound, values, following)
            for bound in (default.low, default.high)
        )
        if any(bound is not None and bound.slots for bound in (low, high)):
            parts = _all_of(default.name, value, parts)  # what stays must lie within bounds that do not
        if parts:
            following[default.name] = parts
            constants.follow(_between(part, low, high)._replace(name=default.name) for part in parts)
        span = choice.name.span if entry is None else entry.value.span
        # A default that lies outside by itself is a finding of the definition.
        if not settled.entries or (_bounded(default, values) and check_bounds(value, default, values, span, findings)):
            result[default.name] = value
    return None if settled.failed or len(result) < len(defaults) else result


def _setting(entry: Entry, name: str, n: int | None, constants: Constants, each: Each | None) -> FloatArray | None:
    formulas = _formulas(entry, constants)
    return None if formulas is None else spread(formulas, n, constants, f"'{name}'", each=each)


def _default(default: Default, n: int | None, values: Mapping[str, Value]) -> FloatArray | None:
    """The value of a parameter that is not set; None where it depends on one that is invalid."""
    if not names(default.value) <= values.keys():
        return None
    return np.broadcast_to(np.asarray(evaluate_array(default.value, values), dtype=np.float64), (n or 1,)).copy()


def _all_of(name: str, value: FloatArray, parts: list[Part]) -> list[Part]:
    """Parts that cover all numbers of a parameter: those that follow no parameter of the run are as they are."""
    if any(part.places is None for part in parts):
        return parts
    rest = np.ones(len(value), dtype=np.bool_)
    for part in parts:
        rest[part.places] = False
    if not parts:
        return [Part(ParameterFormula(Name(name), {}, {name: value}))]
    places = np.flatnonzero(rest)
    return [*parts, Part(ParameterFormula(Name(name), {}, {name: value[places]}), places)] if len(places) else parts


def _between(part: Part, low: Dependent | None, high: Dependent | None) -> Part:
    """A part that must lie within bounds, which are one for all or one for each."""
    if part.places is None:
        return part._replace(low=low, high=high)
    own = [None if bound is None else Subset(bound, part.places) for bound in (low, high)]
    return part._replace(low=own[0], high=own[1])


def _follows(tree: Tree, following: Mapping[str, list[Part]]) -> bool:
    """Whether an expression over parameters of a definition depends on one that follows parameters of the run."""
    return not names(tree).isdisjoint(following)


def _assembled(tree: Tree, values: Mapping[str, Value], following: Mapping[str, list[Part]]) -> ParameterFormula:
    """An expression over parameters of a definition, some of which follow parameters of the run."""
    known: dict[str, Value | Dependent] = {}
    for name in names(tree):
        value = values[name]
        known[name] = Assembled(np.asarray(value), tuple(following[name])) if name in following else value
    return ParameterFormula(tree, {}, known)


def _bounded(default: Default, values: Mapping[str, Value]) -> bool:
    """Whether the bounds of a parameter are known."""
    return all(names(bound) <= values.keys() for bound in (default.low, default.high) if bound is not None)


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
