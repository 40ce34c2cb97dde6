"""Parts of a definition that nothing reads: parameters, signals, states and intermediate values.

In: the activations, models and rules of a spec and of the files that it includes. Out: a warning at each part on which
neither the activity nor the weight depends. A part that only such parts read is not reported: that follows from these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.names.references import key_of
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.library import ActivationModel, ModelModel, RuleModel, StateModel
from neurovis_spec.language.located import Formula

_NOUNS = {"let": "intermediate value", "state": "state", "signals": "signal", "parameters": "parameter"}


class Part(NamedTuple):
    """A part of a definition: in which section it is declared and where, and the names that its formulas read."""

    section: str
    span: Span
    reads: frozenset[str]


def check_unused_parts(compiled: Compiled, findings: Findings) -> None:
    """Warn of every part of a definition on which nothing depends."""
    for library in (*compiled.included, compiled.spec):
        for activation in library.activations.values():
            _check(activation, read(activation.value), "the value", findings)
        for model in library.models.values():
            _check(model, read(model.activity), "the activity", findings)
        for rule in library.rules.values():
            _check(rule, read(rule.weight.each_step, rule.weight.each_episode), "the weight", findings)


def read(*formulas: Formula | None) -> frozenset[str]:
    """The names that formulas read."""
    found: set[str] = set()
    for formula in formulas:
        if formula is not None and isinstance(formula.value, str):
            found |= names(parse(formula.value, extra_functions={"f": 1}))
    return frozenset(found)


def parts_of(definition: ActivationModel | ModelModel | RuleModel) -> dict[str, Part]:
    """What a definition declares, by name."""
    found: dict[str, Part] = {}

    def add(section: str, name: str, reads: frozenset[str]) -> None:
        found[name] = Part(section, key_of(definition.source, section, name).span, reads)

    for name, value in definition.parameters.items():
        add("parameters", name, read(value.value, value.minimum, value.maximum))
    for name, formula in definition.let.items():
        add("let", name, read(formula))
    states: Mapping[str, StateModel] = {} if isinstance(definition, ActivationModel) else definition.state
    for name, state in states.items():
        add("state", name, read(state.initial, state.each_step, state.each_episode))
    for signal in definition.signals if isinstance(definition, RuleModel) else ():
        found[signal.value] = Part("signals", signal.span, frozenset())
    return found


def reached(names: Iterable[str], parts: Mapping[str, Part]) -> set[str]:
    """Some names, and all that the parts among them depend on."""
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += parts[name].reads if name in parts else ()
    return found


def _check(
    definition: ActivationModel | ModelModel | RuleModel, wanted: frozenset[str], what: str, findings: Findings
) -> None:
    parts = parts_of(definition)
    used = reached(wanted, parts)
    for name in _first({name: part for name, part in parts.items() if name not in used}):
        section, span, _ = parts[name]
        message = f"{what} does not depend on the {_NOUNS[section]} '{name}'"
        if section == "parameters":
            findings.warning("unused-parameter", span, message, "remove it, or use it")
        else:
            findings.warning("unused-part", span, message, "remove it, or use it")


def _first(unused: Mapping[str, Part]) -> Iterator[str]:
    """Of unused parts those that no other reads, and one of those that read each other."""
    left = dict(unused)
    while left:
        read_by_others = {name for other, part in left.items() for name in part.reads if name != other}
        first = next((name for name in left if name not in read_by_others), next(iter(left)))
        yield first
        for name in reached((first,), unused):
            left.pop(name, None)
