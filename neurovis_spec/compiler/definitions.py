"""Definitions: activations, models and rules, from their formulas to checked trees.

In: the models of a library file or of a spec's own sections. Out: Definitions by name. A definition sees its own
parameters, states and intermediate values, and what its kind is given (``x``; ``drive``; ``pre``, ``post``, …); never
the spec's parameters. It is checked even if nobody uses it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from neurovis_spec.compiler.constants import CONSTANTS, parse_formula
from neurovis_spec.compiler.network import Activation, Model, Quantity, Rule
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.errors import ExpressionError
from neurovis_spec.language.expressions.tree import Number, Tree, substitute
from neurovis_spec.language.located import Formula
from neurovis_spec.language.source import Mapping as SourceMapping
from neurovis_spec.language.spec import ActivationModel, Library, ModelModel, RuleModel, StateModel
from neurovis_spec.language.values import Parameter

_ALWAYS = (*CONSTANTS, "dt")
_ACTIVATION = ("x",)
_MODEL = ("drive", "k", "t")
_RULE = ("pre", "sent", "post", "weight", "k", "t")

#: Parameter names with the trees of their defaults; a default may use earlier parameters.
Defaults = tuple[tuple[str, Tree], ...]


@dataclass(frozen=True)
class Definitions:
    """All definitions in reach, with the defaults of their parameters."""

    activations: Mapping[str, tuple[Activation, Defaults]] = field(default_factory=dict)
    models: Mapping[str, tuple[Model, Defaults]] = field(default_factory=dict)
    rules: Mapping[str, tuple[Rule, Defaults]] = field(default_factory=dict)


class _Checker:
    """Checks one definition: the names that are taken, and the trees of its formulas."""

    def __init__(self, given: tuple[str, ...], source: SourceMapping, findings: Findings) -> None:
        self.source = source
        self.findings = findings
        self.known: dict[str, Span | None] = dict.fromkeys((*_ALWAYS, *given))

    def declare(self, section: str, name: str) -> None:
        """A parameter, state, signal or intermediate value; each name once, and none that is given."""
        span = self._key(section, name)
        if name in self.known:
            first = self.known[name]
            where = "" if first is None else f" (it is declared in line {first.line})"
            message = f"'{name}' already means something here{where}"
            self.findings.error("duplicate-name", span, message, "choose another name")
        self.known[name] = span

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
        return parse_formula(formula, self.known, self.findings, functions=functions, what="known in this definition")

    def parameters(self, parameters: Mapping[str, Parameter]) -> Defaults:
        """Declare the parameters; a default sees those before it."""
        result: list[tuple[str, Tree]] = []
        earlier: list[str] = [*_ALWAYS]
        for name, parameter in parameters.items():
            tree = parse_formula(parameter.value, earlier, self.findings, what="known in this default")
            self.declare("parameters", name)
            result.append((name, tree or Number(0.0)))
            earlier.append(name)
        return tuple(result)

    def let(self, let: Mapping[str, Formula]) -> tuple[tuple[str, Tree], ...]:
        """Declare the intermediate values, in order."""
        result: list[tuple[str, Tree]] = []
        for name, formula in let.items():
            tree = self.tree(formula)
            self.declare("let", name)
            result.append((name, tree or Number(0.0)))
        return tuple(result)

    def states(self, state: Mapping[str, StateModel], defaults: Defaults) -> tuple[Quantity, ...]:
        """The states; their right-hand sides see everything, their initial values the parameters alone."""
        result = []
        constant = (*_ALWAYS, *(name for name, _ in defaults))
        for name, model in state.items():
            initial = model.initial and parse_formula(model.initial, constant, self.findings, what="known here")
            result.append(
                Quantity(
                    name,
                    initial or Number(0.0),
                    self.optional(model.each_step),
                    self.optional(model.each_episode),
                )
            )
        return tuple(result)


def _activation(name: str, model: ActivationModel, findings: Findings) -> tuple[Activation, Defaults]:
    checker = _Checker(_ACTIVATION, model.source, findings)
    defaults = checker.parameters(model.parameters)
    replaced: dict[str, Tree] = {}
    for key, tree in checker.let(model.let):
        replaced[key] = _expanded(tree, replaced, checker.known[key] or model.source.span, findings)
    value = checker.tree(model.value)
    tree = _expanded(value or Number(0.0), replaced, model.value.span, findings)
    return Activation(name, tuple(key for key, _ in defaults), tree), defaults


def _expanded(tree: Tree, let: Mapping[str, Tree], span: Span, findings: Findings) -> Tree:
    """The tree with its intermediate values put in; a finding where that makes too much of it."""
    try:
        return substitute(tree, let)
    except ExpressionError as error:
        findings.error(error.code, span, f"with its intermediate values put in, {error.message}", error.hint)
        return Number(0.0)


def _model(name: str, model: ModelModel, findings: Findings) -> tuple[Model, Defaults]:
    checker = _Checker(_MODEL, model.source, findings)
    defaults = checker.parameters(model.parameters)
    for key in model.state:
        checker.declare("state", key)
    let = checker.let(model.let)
    state = checker.states(model.state, defaults)
    activity = checker.tree(model.activity, {"f": 1})
    names = tuple(key for key, _ in defaults)
    return Model(name, names, let, state, activity or Number(0.0)), defaults


def _rule(name: str, model: RuleModel, findings: Findings) -> tuple[Rule, Defaults]:
    checker = _Checker(_RULE, model.source, findings)
    defaults = checker.parameters(model.parameters)
    for signal in model.signals:
        if signal.value in checker.known:
            findings.error("duplicate-name", signal.span, f"'{signal.value}' already means something here")
        checker.known[signal.value] = signal.span
    for key in model.state:
        checker.declare("state", key)
    let = checker.let(model.let)
    state = checker.states(model.state, defaults)
    step = checker.optional(model.weight.each_step)
    episode = checker.optional(model.weight.each_episode)
    if model.weight.each_step is None and model.weight.each_episode is None:
        span = model.weight.source.span
        findings.error("missing-key", span, "a rule changes the weight in 'each_step' or in 'each_episode'")
    signals = tuple(signal.value for signal in model.signals)
    return Rule(name, tuple(key for key, _ in defaults), signals, let, state, step, episode), defaults


def define(library: Library, findings: Findings, builtin: Definitions | None = None) -> Definitions:
    """The definitions of a file, on top of the built-in ones. Who replaces a built-in is warned."""
    base = builtin or Definitions()
    for section, known in (("activations", base.activations), ("models", base.models), ("rules", base.rules)):
        node = library.source.get(section)
        for entry in node.entries if isinstance(node, SourceMapping) else ():
            if entry.name in known:
                message = f"'{entry.name}' replaces the built-in of that name"
                findings.warning("replaces-builtin", entry.key.span, message)
    own_activations = {name: _activation(name, model, findings) for name, model in library.activations.items()}
    own_models = {name: _model(name, model, findings) for name, model in library.models.items()}
    own_rules = {name: _rule(name, model, findings) for name, model in library.rules.items()}
    return Definitions(
        {**base.activations, **own_activations},
        {**base.models, **own_models},
        {**base.rules, **own_rules},
    )
