"""Settings: what an author gives an activation, a model or a rule at its use.

In: a Choice (a name with settings), the definition's parameters with their defaults, the Constants. Out: the value of
every parameter, one for each of n neurons or connections (Each), of which the indices are known there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.events.settable import Assembled, Dependent, ParameterFormula, Part, Subset
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.program import RULE, SPIKE, SYNAPSE, Definition, Kind
from neurovis_spec.compiler.values.constants import Constants, Randomness, Value, value_of
from neurovis_spec.compiler.values.definitions import Default, Defined, Definitions, check_bounds
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.table_values import TableReader
from neurovis_spec.diagnostics import Findings, Hint, Home, Undeclared, shorten
from neurovis_spec.language.expressions.evaluate import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import Name, Tree, names
from neurovis_spec.language.keys import settings_of
from neurovis_spec.language.located import IDENTIFIER, Formula, Located, formula_of, in_unit
from neurovis_spec.language.tables import is_from_table, numbers_column
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.values import Choice, FormulaList, Initial
from neurovis_spec.language.yaml.source import AnyList, Entry, Scalar, one_or_more
from neurovis_spec.language.yaml.source import Mapping as Written
from neurovis_spec.likeness import did_you_mean, meant, suggest

#: What other languages call activations, models and rules.
_ELSEWHERE: Final[Mapping[str, str]] = {
    **dict.fromkeys(("logistic", "logsig", "expit"), "sigmoid"),
    **dict.fromkeys(("linear", "none", "purelin"), "identity"),
    **dict.fromkeys(("heaviside", "threshold", "binary"), "step"),
    **dict.fromkeys(("rectifier", "rectified", "threshold_linear"), "relu"),
    **dict.fromkeys(("rbf", "gauss"), "gaussian"),
    **dict.fromkeys(("lif", "if", "spiking"), "integrate_and_fire"),
    **dict.fromkeys(("ctrnn", "leaky_integrate"), "leaky_integrator"),
    **dict.fromkeys(("hebb", "hebbs"), "hebbian"),
}
#: Under which keys connections have definitions.
_AT_CONNECTIONS: Final[Mapping[Kind, str]] = {RULE: "plasticity", SYNAPSE: "synapse"}
#: Values of a list that are checked where it is not known how many there should be.
_MOST_CHECKED = 1000


class Each(NamedTuple):
    """What values are for: ``names`` mean something of each of them, numbers or arrays of integers, UNKNOWN where it is
    not known how many there are."""

    noun: str
    names: Mapping[str, int | IntArray | Unknown]
    #: what a mapping means as the value of a setting: values from a table
    table: Callable[[Written], FloatArray | Unknown] | None = None

    def extra(self, one: int | None = None) -> dict[str, Value | Unknown]:
        """The values of the names, for all or for one."""
        result: dict[str, Value | Unknown] = {}
        for name, value in self.names.items():
            if isinstance(value, np.ndarray):
                result[name] = value.astype(np.float64) if one is None else float(value[one])
            else:
                result[name] = UNKNOWN if value is UNKNOWN else float(value)
        return result


def neurons(n: int | Unknown, table: TableReader | None = None) -> Each:
    """n neurons of a group: ``i`` and ``n``; what a table has for them."""
    names = {"i": UNKNOWN if n is UNKNOWN else np.arange(n, dtype=np.int64), "n": n}
    if table is None:
        return Each("neuron", names)

    def value(node: Written) -> FloatArray | Unknown:
        wanted = numbers_column(node, table.files.findings)
        return UNKNOWN if wanted is UNKNOWN else table.numbers(wanted)

    return Each("neuron", names, value)


class Settled(NamedTuple):
    """A definition where it is used, as ``leaky_integrator: {leak: 2}`` of a group."""

    definition: Definition
    #: the values of its parameters, one for each neuron or connection
    parameters: Mapping[str, FloatArray]
    #: which of these follow parameters of the run (``events/settable.py``)
    parts: tuple[Part, ...]
    #: what is written for each of its parameters and signals
    entries: Names[Entry]
    #: whether its parameters are known
    sound: bool = True


def settled_of(
    choice: Choice, kind: Kind, definitions: Definitions, constants: Constants, each: Each, n: int | Unknown
) -> Settled | Unknown:
    """The definition that a choice names, with its settings for ``each`` of n; UNKNOWN where there is none."""
    defined = _named_definition(choice, definitions, kind, constants.findings)
    if defined is UNKNOWN:
        check_settings(choice, constants, each.names)
        return UNKNOWN
    definition = defined.definition
    known = (*definition.parameters, *definition.signals)
    home = Home((kind.section, definition.name), ("parameters", "signals"))
    entries = settings_of(choice.settings, known, "parameter", "it has no parameters", constants.findings, home)
    with constants.following() as parts:
        values = _parameters(choice, defined, n, constants, entries, each)
    if values is UNKNOWN:
        return Settled(definition, {}, (), entries, sound=False)
    named = tuple(part._replace(field=kind.name, of=definition.name) for part in parts)
    return Settled(definition, values, named, entries)


def _named_definition(choice: Choice, definitions: Definitions, kind: Kind, findings: Findings) -> Defined | Unknown:
    """The definition that a choice names; an unknown name is answered with the nearest ones, and taken for the one that
    it can only be meant for."""
    name, what, known = choice.name, kind.name, definitions.of(kind)
    found = known.get(name.value)
    if found is None:
        right = None if findings.many else meant(name.value, known)
        message = f"there is no {what} '{shorten(name.value)}'"
        lost = Undeclared(name.value, Home((), (kind.section,)))
        elsewhere = _ELSEWHERE.get(name.value.casefold(), "")
        hint: Hint = did_you_mean([elsewhere]) if elsewhere in known else partial(suggest, name.value, known, "known")
        for other, key in _AT_CONNECTIONS.items():
            if kind in _AT_CONNECTIONS and name.value in definitions.of(other).known():
                hint = f"'{name.value}' is a {other.name}: write {key}: {name.value}"
        findings.error(f"unknown-{what}", name.span, message, hint, undeclared=lost)
        found = UNKNOWN if right is None else known[right]
    return found


def check_settings(choice: Choice, constants: Constants, extra: Collection[str] = ()) -> None:
    """Evaluate the settings of a definition that is UNKNOWN, as far as they are no names: these may be signals."""
    for entry in choice.settings.entries:
        nodes = () if isinstance(entry.value, Written) else one_or_more(entry.value)
        for node in nodes[:_MOST_CHECKED]:
            text = node.value.strip() if isinstance(node, Scalar) and isinstance(node.value, str) else ""
            is_name = all(map(IDENTIFIER.fullmatch, text.split(".")))
            formula = UNKNOWN if is_name else formula_of(node, constants.findings)
            if formula is not UNKNOWN:
                constants.value(formula, dict.fromkeys(extra, UNKNOWN))


def spread(
    formulas: Formula | FormulaList,
    n: int | Unknown,
    constants: Constants,
    what: str,
    stream: Stream | None = None,
    each: Each | None = None,
) -> FloatArray | Unknown:
    """One value for each of n neurons, or for ``each`` of n others: from one formula, or from a list of n. Where n is
    UNKNOWN, one value that is the same for all.

    With a stream the formulas may draw random numbers; the counter of neuron i is (i, 0, 0, number of the draw).
    """
    each = each or neurons(n)
    if isinstance(formulas, FormulaList):
        return _value_of_each(formulas, n, constants, what, stream, each)
    randomness: Randomness | Unknown | None = None
    if stream is not None:
        randomness = UNKNOWN if n is UNKNOWN else Randomness(stream, np.arange(n, dtype=np.int64))
    value = constants.value(formulas, each.extra(), randomness)
    if value is UNKNOWN:
        return UNKNOWN
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (1 if n is UNKNOWN else n,)).copy()


def _value_of_each(
    formulas: FormulaList, n: int | Unknown, constants: Constants, what: str, stream: Stream | None, each: Each
) -> FloatArray | Unknown:
    """The values of a list of n formulas, each for one; UNKNOWN where one is invalid, or they are not n."""
    if n is UNKNOWN:
        for item in formulas.items[:_MOST_CHECKED]:
            constants.value(item, each.extra(), None if stream is None else UNKNOWN)
        return UNKNOWN
    if len(formulas.items) != n:
        message = f"{what} has {plural(len(formulas.items), 'value')} for {plural(n, each.noun)}"
        constants.findings.error("wrong-size", formulas.span, message)
        return UNKNOWN
    result: list[float] = []
    before = constants.findings.errors
    for position, item in enumerate(formulas.items):
        if isinstance(item.value, (int, float)):
            result.append(float(item.value))
            continue
        randomness = None if stream is None else Randomness(stream, position)
        place = np.array([position], dtype=np.int64)
        value = constants.value(item, each.extra(position), randomness, places=place)
        if value is not UNKNOWN:
            result.append(float(value))
        elif constants.findings.errors - before >= PATIENCE:
            return UNKNOWN
    return np.array(result, dtype=np.float64) if len(result) == n else UNKNOWN


def _formulas(entry: Entry, unit: str, constants: Constants) -> Formula | FormulaList | Unknown:
    """What is written for a parameter that has a unit, or "": a formula, or a list of formulas; UNKNOWN where one is
    invalid."""
    node, findings = entry.value, constants.findings
    if not isinstance(node, AnyList):
        formula = formula_of(node, findings)
        return formula if formula is UNKNOWN else in_unit(formula, unit, findings)
    items: list[Formula] = []
    before = findings.errors
    for item in node.items:
        formula = formula_of(item, findings)
        if formula is not UNKNOWN:
            items.append(in_unit(formula, unit, findings))
        elif findings.errors - before >= PATIENCE:
            return UNKNOWN
    return FormulaList(tuple(items), node.span) if len(items) == len(node) else UNKNOWN


def _parameters(
    choice: Choice, defined: Defined, n: int | Unknown, constants: Constants, entries: Names[Entry], each: Each
) -> dict[str, FloatArray] | Unknown:
    """The value of every parameter of a definition with these settings, for ``each`` of n; UNKNOWN where one is. A
    parameter may follow parameters of the run by its setting, by its default (which may use parameters before it that
    do), or by its bounds alone; in the last case its value stays, and is checked again when the bounds change."""
    findings = constants.findings
    definition, defaults = defined
    values: dict[str, Value | Unknown] = {**CONSTANTS, "dt": constants.dt * definition.per_second}
    result: dict[str, FloatArray] = {}
    following: dict[str, list[Part]] = {}
    for default in defaults:
        entry = entries.get(default.name)
        with constants.following() as parts:
            value = _default(default, n, values) if entry is None else _setting(entry, default, n, constants, each)
        values[default.name] = value
        if value is UNKNOWN:
            continue
        if entry is None and not np.isfinite(value).all():
            message = f"with these settings the default of '{default.name}' is not a finite number"
            findings.error("not-finite", choice.name.span, message)
            return UNKNOWN
        if entry is None and default.value is not UNKNOWN and not names(default.value).isdisjoint(following):
            parts = [Part(_assembled(default.value, values, following))]
        low, high = (
            None if bound is None or value_of(bound, values) is UNKNOWN else _assembled(bound, values, following)
            for bound in (default.low, default.high)
        )
        if any(bound is not None and bound.slots for bound in (low, high)):
            parts = _covering_all(default.name, value, parts)  # what stays must lie within bounds that do not
        if parts:
            following[default.name] = parts
            constants.follow(_bounded(part, low, high)._replace(name=default.name) for part in parts)
        span = choice.name.span if entry is None or entry is UNKNOWN else entry.value.span
        # A default that lies outside by itself is a finding of the definition.
        if not entries or check_bounds(value, default, values, span, findings):
            result[default.name] = value
    return UNKNOWN if len(result) < len(defaults) else result


def _setting(
    entry: Entry | Unknown, default: Default, n: int | Unknown, constants: Constants, each: Each
) -> FloatArray | Unknown:
    """The value of a parameter that is set; a number with a unit is one in that of the parameter."""
    if entry is not UNKNOWN and each.table is not None and is_from_table(entry.value):
        return each.table(entry.value)
    formulas = UNKNOWN if entry is UNKNOWN else _formulas(entry, default.unit, constants)
    return UNKNOWN if formulas is UNKNOWN else spread(formulas, n, constants, f"'{default.name}'", each=each)


def _default(default: Default, n: int | Unknown, values: Mapping[str, Value | Unknown]) -> FloatArray | Unknown:
    """The value of a parameter that is not set."""
    value = value_of(default.value, values)
    if value is UNKNOWN:
        return UNKNOWN
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (1 if n is UNKNOWN else n,)).copy()


def _covering_all(name: str, value: FloatArray, parts: list[Part]) -> list[Part]:
    """Parts that cover all numbers of a parameter: these, and one for the numbers that follow no parameter of the run,
    whose formula gives them as they are."""
    if any(part.places is None for part in parts):
        return parts
    rest = np.ones(len(value), dtype=np.bool_)
    for part in parts:
        rest[part.places] = False
    if not parts:
        return [Part(ParameterFormula(Name(name), {}, {name: value}))]
    places = np.flatnonzero(rest)
    return [*parts, Part(ParameterFormula(Name(name), {}, {name: value[places]}), places)] if len(places) else parts


def _bounded(part: Part, low: Dependent | None, high: Dependent | None) -> Part:
    """A part that must lie within bounds, which are one for all or one for each."""
    if part.places is None:
        return part._replace(low=low, high=high)
    low, high = (None if bound is None else Subset(bound, part.places) for bound in (low, high))
    return part._replace(low=low, high=high)


def _assembled(
    tree: Tree, values: Mapping[str, Value | Unknown], following: Mapping[str, list[Part]]
) -> ParameterFormula:
    """An expression over parameters of a definition, all known, some of which follow parameters of the run."""
    known: dict[str, Value | Dependent] = {}
    for name in names(tree):
        value = values[name]
        assert value is not UNKNOWN
        known[name] = Assembled(np.asarray(value), tuple(following[name])) if name in following else value
    return ParameterFormula(tree, {}, known)


_NOBODY_FIRES: Final = "no neuron fires at step 0, where runs begin"


def as_states(given: Initial, model: Definition, findings: Findings) -> Initial:
    """What neurons begin with, in states alone where their model has a derivative or fires: the activity follows from
    these. One that is a state is given by that; else, and where it is a spike, there is a finding."""
    if not (model.flows or model.fires):
        return given
    written, activity = given.activity, model.given.each_step
    own = [one.name for one in model.holdable if not (model.fires and one.name == SPIKE)]
    hint = f"write initial: {{{own[0]}: …}}" if own else "leave it out"
    for spike in (name for name, _ in given.states if model.fires and name.value == SPIKE):
        findings.error("initial-activity", spike.span, _NOBODY_FIRES, hint)
    states = tuple(one for one in given.states if not (model.fires and one[0].value == SPIKE))
    if written is None:
        return Initial(None, states)
    state = next((name for name in own if isinstance(activity, Name) and name == activity.name), None)
    if state is None:
        message = f"the activity of the model '{model.name}' follows from its states"
        if isinstance(activity, Name) and activity.name == SPIKE:
            message = _NOBODY_FIRES
        findings.error("initial-activity", written.span, message, hint)
    elif any(name.value == state for name, _ in states):
        message = f"the activity of the model '{model.name}' is the state '{state}', which is given, too"
        findings.error("conflicting-keys", written.span, message, "leave one of them out")
    else:
        name = Located(state, Scalar(state, written.span))
        return Initial(None, (*states, (name, written)))
    return Initial(None, states)


def check_initials(used: Settled, choice: Choice, constants: Constants) -> bool:
    """Whether the states of a definition begin with finite numbers; a finding where one does not."""
    dt = constants.dt * used.definition.per_second
    known: dict[str, Value] = {**CONSTANTS, "dt": dt, **used.parameters}
    for state in used.definition.state:
        if not np.isfinite(evaluate_array(state.initial, known)).all():
            message = f"with these settings the state '{state.name}' does not begin with a finite number"
            constants.findings.error("not-finite", choice.name.span, message)
            return False
    return True
