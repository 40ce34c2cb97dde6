"""Definitions: activations, models and rules, from their formulas to checked trees.

In: the models of a library file or of a spec's own sections. Out: Definitions by name. A definition sees its own
parameters, states and intermediate values, and what its kind is given (``x``; ``drive``; ``pre``, ``post``, …); never
the spec's parameters. It is checked even if nobody uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.names.unresolved import Gaps, gaps_of
from neurovis_spec.compiler.program import Activation, Model, Quantity, Rule
from neurovis_spec.compiler.values.constants import ALWAYS, Value, check_finite, is_constant, parse_formula
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.arrays import evaluate_array
from neurovis_spec.language.expressions.errors import ExpressionError
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.given import meaning
from neurovis_spec.language.expressions.tree import Name, Number, Tree, substitute
from neurovis_spec.language.library import ActivationModel, Library, ModelModel, RuleModel, StateModel
from neurovis_spec.language.located import IDENTIFIER, NAME_RULE, Formula, bad_name
from neurovis_spec.language.model import Model as LanguageModel
from neurovis_spec.language.model import lost_names
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.values import ParameterModel
from neurovis_spec.language.yaml.source import Mapping as SourceMapping

_ACTIVATION = formula_at(ActivationModel, "value")
_MODEL = formula_at(ModelModel, "activity")
_RULE = formula_at(RuleModel, "weight", "each_step")


class Default(NamedTuple):
    """A parameter of a definition: its default and its bounds, which may use earlier parameters."""

    name: str
    value: Tree
    low: Tree | None = None
    high: Tree | None = None


Defaults: TypeAlias = tuple[Default, ...]


@dataclass(frozen=True)
class Definitions:
    """All definitions in reach, with the defaults of their parameters, and those that could not be read."""

    activations: Mapping[str, tuple[Activation, Defaults]] = field(default_factory=dict)
    models: Mapping[str, tuple[Model, Defaults]] = field(default_factory=dict)
    rules: Mapping[str, tuple[Rule, Defaults]] = field(default_factory=dict)
    gaps: Gaps = field(default_factory=Gaps)


M = TypeVar("M", bound=LanguageModel)
D = TypeVar("D")
#: Keys of a definition that declare what is set where it is used, and those that declare names.
_SET = frozenset({"parameters", "signals"})
_DECLARING = frozenset({"parameters", "signals", "let", "state"})


class _Checker:
    """Checks one definition: the names that are taken, and the trees of its formulas."""

    def __init__(
        self, given: tuple[str, ...], source: SourceMapping, findings: Findings, dt: float, incomplete: bool
    ) -> None:
        self.source = source
        self.findings = findings
        self.constants = {**CONSTANTS, "dt": dt}
        self.known: dict[str, Span | None] = dict.fromkeys((*ALWAYS, *given))
        #: whether there may be names that could not be read at all
        self.incomplete = incomplete

    def declare(self, section: str, name: str) -> None:
        """A parameter, state, signal or intermediate value; each name once, and none that is given."""
        span = self._key(section, name)
        if name in self.known:
            self.findings.error("duplicate-name", span, self.taken(name), "choose another name")
        self.known[name] = span

    def taken(self, name: str) -> str:
        """What a name that is known already means."""
        first = self.known[name]
        if first is not None:
            return f"'{name}' already means something here (it is declared in line {first.line})"
        return f"'{name}' already means something here: {meaning(name)}"

    def _key(self, section: str, name: str) -> Span:
        node = self.source.get(section)
        if isinstance(node, SourceMapping):
            entry = node.entry(name)
            if entry is not None:
                return entry.key.span
        return self.source.span if node is None else node.span

    def optional(self, formula: Formula | None) -> Tree | None:
        """The tree of a formula that may be left out."""
        return None if formula is None else self.tree(formula)

    def tree(self, formula: Formula, functions: Mapping[str, int] | None = None) -> Tree | None:
        """The tree of a formula over what is declared so far."""
        what = "known in this definition"
        tree = parse_formula(
            formula, self.known, self.findings, functions=functions, what=what, incomplete=self.incomplete
        )
        if tree is not None and not functions and is_constant(tree):
            check_finite(evaluate_array(tree, self.constants), formula, self.findings)
        return tree

    def parameters(self, parameters: Mapping[str, ParameterModel]) -> Defaults:
        """Declare the parameters; a default sees those before it."""
        result: list[Default] = []
        values: dict[str, Value] = dict(self.constants)
        for name, parameter in parameters.items():
            tree = self._default(parameter.value, values)
            low, high = self._default(parameter.minimum, values), self._default(parameter.maximum, values)
            self.declare("parameters", name)
            default = Default(name, Number(0.0)) if parameter.failed else Default(name, tree or Number(0.0), low, high)
            result.append(default)
            values[name] = evaluate_array(default.value, values)
            if tree is not None and not parameter.failed:
                check_bounds(values[name], default, values, parameter.value.span, self.findings)
        for name in lost_names(self.source, "parameters", dict(parameters)):
            self.known.setdefault(name, None)
            result.append(Default(name, Number(0.0)))
        return tuple(result)

    def _default(self, formula: Formula | None, values: Mapping[str, Value]) -> Tree | None:
        if formula is None:
            return None
        tree = parse_formula(formula, tuple(values), self.findings, what="known in this default")
        if tree is not None and not check_finite(evaluate_array(tree, values), formula, self.findings):
            return None
        return tree

    def let(self, let: Mapping[str, Formula]) -> tuple[tuple[str, Tree], ...]:
        """Declare the intermediate values, in order."""
        result: list[tuple[str, Tree]] = []
        for name, formula in let.items():
            tree = self.tree(formula)
            self.declare("let", name)
            result.append((name, tree or Number(0.0)))
        for name in lost_names(self.source, "let", dict(let)):
            self.known.setdefault(name, None)
        return tuple(result)

    def states(self, state: Mapping[str, StateModel], defaults: Defaults) -> tuple[Quantity, ...]:
        """The states; their right-hand sides see everything, their initial values the parameters alone."""
        result = []
        constant = (*ALWAYS, *(default.name for default in defaults))
        for name, model in state.items():
            initial = None
            if model.initial is not None:
                initial = parse_formula(model.initial, constant, self.findings, what="known here")
                if initial is not None and is_constant(initial):
                    check_finite(evaluate_array(initial, self.constants), model.initial, self.findings)
            result.append(
                Quantity(
                    name,
                    initial or Number(0.0),
                    self.optional(model.each_step),
                    self.optional(model.each_episode),
                )
            )
        return tuple(result)


def check_bounds(value: Value, default: Default, values: Mapping[str, Value], span: Span, findings: Findings) -> bool:
    """Whether a parameter lies within its bounds everywhere; a finding where it does not."""
    low = -np.inf if default.low is None else evaluate_array(default.low, values)
    high = np.inf if default.high is None else evaluate_array(default.high, values)
    outside = np.broadcast_to((value < low) | (value > high), np.broadcast_shapes(*map(np.shape, (value, low, high))))
    if not outside.any():
        return True
    first = np.unravel_index(int(outside.argmax()), outside.shape)
    one, least, most = (float(np.broadcast_to(part, outside.shape)[first]) for part in (value, low, high))
    bounds = f"{least:g} to {most:g}".replace("-inf", "-∞").replace("inf", "∞")
    hint = _bound(default, "at least", default.low) if one < least else _bound(default, "at most", default.high)
    findings.error("out-of-range", span, f"'{default.name}' is {one:g}; its bounds are {bounds}", hint)
    return False


def _bound(default: Default, how: str, bound: Tree | None) -> str | None:
    """What a parameter must not pass, where that is another one."""
    return f"'{default.name}' is {how} '{bound.name}'" if isinstance(bound, Name) else None


def _activation(name: str, model: ActivationModel, findings: Findings, dt: float) -> tuple[Activation, Defaults] | None:
    """The activation; None where an intermediate value is invalid."""
    checker = _Checker(_ACTIVATION.sees, model.source, findings, dt, not model.lost_keys.isdisjoint(_DECLARING))
    defaults = checker.parameters(model.parameters)
    replaced: dict[str, Tree] = {}
    let = checker.let(model.let)
    before = findings.errors
    for key, tree in let:
        if findings.errors > before:  # what explodes once explodes again in all that uses it
            return None
        replaced[key] = _expanded(tree, replaced, checker.known[key] or model.source.span, findings)
    value = checker.tree(model.value)
    tree = _expanded(value or Number(0.0), replaced, model.value.span, findings)
    return Activation(name, tuple(default.name for default in defaults), tree), defaults


def _expanded(tree: Tree, let: Mapping[str, Tree], span: Span, findings: Findings) -> Tree:
    """The tree with its intermediate values put in; a finding where that makes too much of it."""
    try:
        return substitute(tree, let)
    except ExpressionError as error:
        findings.error(error.code, span, f"with its intermediate values put in, {error.message}", error.hint)
        return Number(0.0)


def _model(name: str, model: ModelModel, findings: Findings, dt: float) -> tuple[Model, Defaults]:
    checker = _Checker(_MODEL.sees, model.source, findings, dt, not model.lost_keys.isdisjoint(_DECLARING))
    defaults = checker.parameters(model.parameters)
    for key in (*model.state, *lost_names(model.source, "state", dict(model.state))):
        checker.declare("state", key)
    let = checker.let(model.let)
    state = checker.states(model.state, defaults)
    activity = checker.tree(model.activity, dict.fromkeys(_MODEL.functions, 1))
    names = tuple(default.name for default in defaults)
    spikes = model.spikes is not None and model.spikes.value
    return Model(name, names, let, state, activity or Number(0.0), spikes), defaults


def _rule(name: str, model: RuleModel, findings: Findings, dt: float) -> tuple[Rule, Defaults] | None:
    """The rule; None where it is not known which signals it has."""
    checker = _Checker(_RULE.sees, model.source, findings, dt, not model.lost_keys.isdisjoint(_DECLARING))
    defaults = checker.parameters(model.parameters)
    before = findings.errors
    for signal in model.signals:
        if not IDENTIFIER.fullmatch(signal.value):
            findings.error("bad-name", signal.span, bad_name(signal.value), NAME_RULE)
        elif signal.value in checker.known:
            findings.error("duplicate-name", signal.span, checker.taken(signal.value), "choose another name")
        checker.known[signal.value] = signal.span
        if findings.errors - before >= PATIENCE:
            break
    if findings.errors > before:
        return None
    for key in (*model.state, *lost_names(model.source, "state", dict(model.state))):
        checker.declare("state", key)
    let = checker.let(model.let)
    state = checker.states(model.state, defaults)
    step = checker.optional(model.weight.each_step)
    episode = checker.optional(model.weight.each_episode)
    signals = tuple(signal.value for signal in model.signals)
    return Rule(name, tuple(default.name for default in defaults), signals, let, state, step, episode), defaults


def define(library: Library, findings: Findings, builtin: Definitions | None = None, dt: float = 1.0) -> Definitions:
    """The definitions of a file, on top of the built-in ones. Who replaces a built-in is warned."""
    base = builtin or Definitions()
    for section, known in (("activations", base.activations), ("models", base.models), ("rules", base.rules)):
        node = library.source.get(section)
        for entry in node.entries if isinstance(node, SourceMapping) else ():
            if entry.name in known:
                message = f"'{entry.name}' replaces the built-in of that name"
                findings.warning("replaces-builtin", entry.key.span, message)
    gaps = gaps_of(library)
    activations, gaps = _defined("activations", library.activations, _activation, gaps, findings, dt)
    models, gaps = _defined("models", library.models, _model, gaps, findings, dt)
    rules, gaps = _defined("rules", library.rules, _rule, gaps, findings, dt)
    return Definitions({**base.activations, **activations}, {**base.models, **models}, {**base.rules, **rules}, gaps)


def _defined(
    section: str,
    models: Mapping[str, M],
    make: Callable[[str, M, Findings, float], tuple[D, Defaults] | None],
    gaps: Gaps,
    findings: Findings,
    dt: float,
) -> tuple[dict[str, tuple[D, Defaults]], Gaps]:
    """The definitions of a section. One whose declarations could not be read is a gap: which parameters and signals it
    has is not known."""
    made = {name: make(name, model, findings, dt) for name, model in models.items()}
    found = {
        name: definition
        for name, definition in made.items()
        if definition is not None and models[name].lost_keys.isdisjoint(_SET)
    }
    return found, gaps.with_names(section, gaps.names[section] | (made.keys() - found.keys()))
