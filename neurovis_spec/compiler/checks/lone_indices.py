"""Indices that can only be 0: ``i`` of one neuron, source or instance, ``j`` of one target.

In: what a spec without errors became. Out: a warning at each such index. A group or an instance with a ``count`` of 1,
and what refers to it, is let be: another count may be meant to follow.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.names.expand import COUNTED
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.expressions.parser import parse, unknown_names
from neurovis_spec.language.expressions.tree import Name, names
from neurovis_spec.language.located import Located
from neurovis_spec.language.places import Written, formulas_of
from neurovis_spec.language.references import Arrow
from neurovis_spec.language.references import parse as parse_reference
from neurovis_spec.language.sections import ConnectionModel, GroupModel
from neurovis_spec.language.unknown import known
from neurovis_spec.language.yaml.source import Scalar

#: what counts the ends of a connection
_PAIR = ("i", "j")


def check_lone_indices(compiled: Compiled, findings: Findings) -> None:
    """Warn of every index that can only be 0 (and of ``n`` where it can only be 1)."""
    for section, scopes in compiled.sections:
        _instances(section, findings)
        for name, group in section.neurons.items():
            if group.count is None and group.names is None:
                _group(name, group, findings)
        place = compiled.scopes.index(scopes[0])
        for key, body in section.connections:
            if next(formulas_of(body, _PAIR), None) is None:  # as in most
                continue
            if alone := _alone(key, compiled, place):
                rules = [learning.rule for _, learning in compiled.entries[key.span].rules]
                _connection(body, alone, [(rule.name, signal) for rule in rules for signal in rule.signals], findings)


def _instances(section: Section, findings: Findings) -> None:
    for name, model in section.instances.items():
        if model.count is None and model.names is None:
            given = model.formulas(())  # in a matrix they count its rows and columns
            formulas = (one for one in formulas_of(model, COUNTED) if one.path[0] != "set" or one.path[1] in given)
            for place, index in _occurrences(formulas, COUNTED):
                hint = "'i' and 'n' count the instances of an entry; give it a 'count'"
                _warn(place, index, f"'{name}' is one instance", hint, findings)


def _group(name: str, group: GroupModel, findings: Findings) -> None:
    for place, index in _occurrences(formulas_of(group, COUNTED), COUNTED):
        hint = "'i' and 'n' count the neurons of a group; give it a 'count'"
        _warn(place, index, f"'{name}' is one neuron", hint, findings)


def _connection(
    body: ConnectionModel, alone: dict[str, str], signals: Collection[tuple[str, ...]], findings: Findings
) -> None:
    """``i`` and ``j`` in an entry; ``alone`` has those that stand for one neuron, with what that is called. Rules'
    ``signals``, each by the rule and its own name, are names."""
    formulas = (one for one in formulas_of(body, alone) if one.path[0] != "plasticity" or one.path[1:3] not in signals)
    for place, index in _occurrences(formulas, alone):
        hint = "'i' counts the sources and 'j' the targets, both from 0"
        if len(alone) == 1:
            hint += f"; did you mean '{'j' if index.name == 'i' else 'i'}'?"
        _warn(place, index, f"'{shorten(alone[index.name])}' is one neuron", hint, findings)


def _alone(key: Located[str], compiled: Compiled, place: int) -> dict[str, str]:
    """Which indices of an entry stand for one neuron, of the scope at a place."""
    arrow = parse_reference(key.value)
    ends = {"i": arrow.sources, "j": arrow.targets} if isinstance(arrow, Arrow) else {}
    return {
        index: end.text for index, end in ends.items() if len(end.parts) == 1 and _is_one(end.text, compiled, place)
    }


def _is_one(name: str, compiled: Compiled, place: int) -> bool:
    """Whether a reference of a scope names a neuron itself, no group or instance that is counted."""
    head, dot, rest = name.partition(".")
    if not dot:
        return name in compiled.census.directories[place].neurons
    scope = compiled.scopes[place]
    inside = known(scope.children.get(head, ()), ())
    entry = scope.section.instances.get(head)
    counted = entry is not None and (entry.count is not None or entry.names is not None)
    return len(inside) == 1 and not counted and _is_one(rest, compiled, inside[0])


def _occurrences(formulas: Iterable[Written], wanted: Collection[str]) -> Iterator[tuple[Scalar, Name]]:
    """The places of some names in formulas."""
    for formula in formulas:
        tree = parse(formula.text, random=True, naming="ends")
        for name in unknown_names(tree, names(tree).difference(wanted)):
            yield formula.node, name


def _warn(place: Scalar, index: Name, one: str, hint: str, findings: Findings) -> None:
    always = 1 if index.name == "n" else 0
    message = f"'{index.name}' is always {always} here: {one}"
    findings.warning("lone-index", place.at(index.start, index.end), message, hint)
