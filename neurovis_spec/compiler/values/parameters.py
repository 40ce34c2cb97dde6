"""Parameters: the named constants of a spec, or of an instance of a module.

In: a section's ``parameters``, in the order written, and what is set from outside. Out: their values, in Constants.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from neurovis_spec.compiler.names.references import Section, key_span
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Span, shorten
from neurovis_spec.language.expressions.functions import RESERVED, meaning
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import ParameterModel
from neurovis_spec.language.yaml.source import Scalar


def make_parameters(
    section: Section,
    constants: Constants,
    given: Mapping[str, float | str],
    given_at: Mapping[str, Span] | None = None,
) -> None:
    """Declare the parameters in the order written; a value that is given from outside replaces the written one, within
    its bounds. ``given_at`` says where it is given."""
    later = dict.fromkeys(section.parameters)
    for name, parameter in section.parameters.items():
        del later[name]
        name_span = key_span(section, "parameters", name)
        given_span = (given_at or {}).get(name, name_span)
        _parameter(name, parameter, name_span, given_span, constants=constants, given=given, later=later)


def _parameter(
    name: str,
    parameter: ParameterModel,
    name_span: Span,
    given_span: Span,
    *,
    constants: Constants,
    given: Mapping[str, float | str],
    later: Collection[str],
) -> None:
    """Declare one parameter. ``later`` are the names declared below, for the message where its formula uses one."""
    findings = constants.findings
    if name in RESERVED:
        message = f"a parameter may not be called '{name}': the language gives this name a meaning of its own"
        hint = f"'{name}' is {meaning(name)}; take another name, such as '{name}_0'"
        findings.error("reserved-name", name_span, message, hint)
    if parameter.unit is not None:
        constants.units[name] = parameter.measure
    invalid = constants.names.declared.get(name) is UNKNOWN  # the value set from outside was found invalid before
    tree = constants.tree(parameter.value, what="parameters before this one, and constants", later=later)
    # a parameter whose value is given does not depend on those of its formula
    constants.uses[name] = frozenset() if tree is UNKNOWN or name in given else names(tree)
    value = UNKNOWN if tree is UNKNOWN else constants.scalar(parameter.value)
    with constants.following() as lower:
        low = _bound(parameter.minimum, -math.inf, constants)
    with constants.following() as upper:
        high = _bound(parameter.maximum, math.inf, constants)
    if name in given:
        value = _given(name, given[name], given_span, constants)
    if value is UNKNOWN or invalid:
        constants.names.declared[name] = UNKNOWN
        return
    constants.names.declared[name] = value
    # a bound that follows parameters is kept as a formula
    low_bound = lower[0].formula if lower else low
    high_bound = upper[0].formula if upper else high
    constants.declare(name, tree, value, low_bound, high_bound, given=name in given)
    if low > high and parameter.minimum is not None:
        message = f"the least value of '{name}', {low:g}, is above the greatest, {high:g}"
        findings.error("out-of-range", parameter.minimum.span, message, "swap min and max")
        return
    if not low <= value <= high:
        bounds = f"{low:g} to {high:g}".replace("inf", "∞")
        where = given_span if name in given else parameter.value.span
        findings.error("out-of-range", where, f"'{name}' is {value:g}; its bounds are {bounds}")


def _given(name: str, value: float | str, span: Span, constants: Constants) -> float | Unknown:
    """A value from outside, which may be a number with a unit."""
    formula = constants.measured(name, Located(value, Scalar(value, span)))
    if formula.value is UNKNOWN:
        return UNKNOWN
    if isinstance(formula.value, str):
        message = f"the parameter '{name}' is set to '{shorten(formula.value)}', and has no unit"
        constants.findings.error("bad-unit", span, message, "give it one: {value: …, unit: …}, or set it to a number")
        return UNKNOWN
    if not math.isfinite(formula.value):
        constants.findings.error("not-finite", span, f"the parameter '{name}' is set to {float(formula.value)}")
        return UNKNOWN
    return float(formula.value)


def _bound(formula: Formula | None, otherwise: float, constants: Constants) -> float:
    """A bound of a parameter; ``otherwise`` where there is none, or an invalid one."""
    value = UNKNOWN if formula is None else constants.scalar(formula)
    return otherwise if value is UNKNOWN else value
