"""Learning: what an entry of ``connections`` says of its plasticity.

In: Choices (rules with settings and signals). Out: for each a Learning: the rule, its parameters (one value a
connection), and for each signal where it comes from.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.names.references import Directory, few, resolve_end
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.program import RULE, Definition
from neurovis_spec.compiler.values.arguments import Each, Settled, check_initials, settled_of
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Choice
from neurovis_spec.language.yaml.source import AnyList, Entry, Node, Scalar, one_or_more
from neurovis_spec.likeness import suggest


class Learning(NamedTuple):
    """A rule in use."""

    settled: Settled
    #: where each signal comes from: indices into all activities followed by all inputs, one a connection
    signals: Mapping[str, IntArray]
    #: what the author calls each signal
    texts: Mapping[str, str]

    @property
    def rule(self) -> Definition:
        """The rule."""
        return self.settled.definition

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        """Its parameters, one value a connection."""
        return self.settled.parameters


class ConnectionEnds(NamedTuple):
    """The connections of an entry: connection c goes from the ``i[c]``-th of ``n_from`` sources to the ``j[c]``-th of
    ``n_to`` targets. The fields have the names that the settings of a rule see (``_SETTING``)."""

    i: IntArray
    j: IntArray
    n_from: int
    n_to: int


class Place(NamedTuple):
    """Of which connections the rules are, UNKNOWN where those are not known: the entry is invalid, and its rules are
    checked only. ``directory`` says what the names of the scope mean, ``neurons`` is how many the network has."""

    ends: ConnectionEnds | Unknown
    target_count: int | Unknown
    scope: Scope
    directory: Directory
    neurons: int


_SETTING = formula_at(ConnectionModel, "plasticity", "RULE", "SETTING")
#: Signals of a list that are named where a rule is shown.
_SHOWN = 3


def rules_of(choices: tuple[Choice, ...], at: Place) -> tuple[Learning, ...] | Unknown:
    """The rules of an entry, in their order; UNKNOWN where one is invalid, or they have something in common."""
    found = [_learning_of(choice, at) for choice in choices]
    known = [one for one in found if one is not UNKNOWN]
    apart = _are_apart(choices, found, at.scope.constants.findings)
    return tuple(known) if apart and len(known) == len(choices) else UNKNOWN


def _are_apart(choices: tuple[Choice, ...], found: list[Learning | Unknown], findings: Findings) -> bool:
    """Whether no two rules of a connection are the same, or have states of the same name; a finding where two do."""
    before, owners = findings.errors, dict[str, str]()
    for number, (choice, learning) in enumerate(zip(choices, found, strict=True)):
        name = choice.name.value
        if name in (other.name.value for other in choices[:number]):
            message = f"the rule '{shorten(name)}' is here already: a connection has a rule once"
            findings.error("duplicate-name", choice.name.span, message, "leave it out here")
            continue
        for state in () if learning is UNKNOWN else learning.rule.state:
            other = owners.setdefault(state.name, name)
            if other != name:
                message = f"the rules '{shorten(other)}' and '{shorten(name)}' both have a state '{state.name}'"
                hint = "states of a connection have different names: rename it in one of them"
                findings.error("duplicate-name", choice.name.span, message, hint)
    return findings.errors == before


def _learning_of(choice: Choice, at: Place) -> Learning | Unknown:
    """A rule of an entry; UNKNOWN where it is invalid."""
    ends, target_count, scope, directory, neurons = at
    constants, targets = scope.constants, UNKNOWN if ends is UNKNOWN else ends.j
    each = Each("connection", dict.fromkeys(_SETTING.sees, UNKNOWN) if ends is UNKNOWN else ends._asdict())
    count = UNKNOWN if targets is UNKNOWN else len(targets)
    settled = settled_of(choice, RULE, scope.definitions, constants, each, count)
    if settled is UNKNOWN:
        return UNKNOWN
    rule = settled.definition
    signals: dict[str, IntArray] = {}
    failed = not settled.sound
    is_reported = constants.findings.is_invalid(choice.name.span)
    for signal in rule.signals:
        entry = settled.entries.get(signal)
        if entry is None or entry is UNKNOWN:
            failed = True
            if entry is None and not is_reported:
                message = f"the rule '{rule.name}' needs the signal '{signal}'"
                hint = f"write {{{rule.name}: {{{signal}: NEURON_OR_INPUT}}}}"
                constants.findings.error("missing-signal", choice.name.span, message, hint, key=signal)
            continue
        indices = _signal_indices(entry, targets, target_count, scope, directory, neurons)
        if indices is UNKNOWN:
            failed = True
        else:
            signals[signal] = indices
    if failed or not check_initials(settled, choice, constants):
        return UNKNOWN
    return Learning(settled, signals, {name: _text(settled.entries.known()[name].value) for name in rule.signals})


def _signal_indices(
    entry: Entry,
    targets: IntArray | Unknown,
    target_count: int | Unknown,
    scope: Scope,
    directory: Directory,
    neurons: int,
) -> IntArray | Unknown:
    """Where a signal comes from, for each connection: an index into all activities followed by all inputs. It is one
    name, or a list of names that are taken together, with one component in all or one for each target."""
    node, before = entry.value, scope.constants.findings.errors
    per_item: list[IntArray | Unknown] = []
    for item in one_or_more(node):
        per_item.append(_source_indices(entry.name, item, scope, directory, neurons))
        if scope.constants.findings.errors - before >= PATIENCE:
            return UNKNOWN
    if not per_item:
        message = f"the signal '{entry.name}' names no neuron, group or input"
        scope.constants.findings.error("wrong-type", node.span, message)
    sources = [indices for indices in per_item if indices is not UNKNOWN]
    if not sources or len(sources) < len(per_item):
        return UNKNOWN
    components = np.concatenate(sources)
    count = len(components)
    if target_count is not UNKNOWN and count not in (1, target_count):
        title = f"'{_text(node)}'" if isinstance(node, Scalar) else f"'{entry.name}'"
        message = f"the signal {title} has {count} components; 1 or {target_count}, one for each target, are wanted"
        scope.constants.findings.error("wrong-size", node.span, message)
        return UNKNOWN
    if targets is UNKNOWN:
        return UNKNOWN
    return np.repeat(components, len(targets)) if count == 1 else components[targets]


def _source_indices(signal: str, node: Node, scope: Scope, directory: Directory, neurons: int) -> IntArray | Unknown:
    """What a name of a signal means: indices into all activities followed by all inputs."""
    findings = scope.constants.findings
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        message = f"the signal '{signal}' is the name of a neuron, a group or an input, or a list of these"
        findings.error("wrong-type", node.span, message)
        return UNKNOWN
    name = node.value.strip()
    source = scope.input(name)
    if isinstance(source, Input):
        first = neurons + source.start
        return np.arange(first, first + source.size, dtype=np.int64)
    if source is UNKNOWN or directory.find(name) is UNKNOWN:
        return UNKNOWN
    if directory.find(name) is None and not any(mark in name for mark in (".", "+")):
        names = (*scope.section.inputs, *directory.known)
        message = f"there is no neuron, group or input '{shorten(name)}'"
        findings.error(
            "unknown-signal",
            node.span,
            message,
            lambda: suggest(name, few(name, names), "inputs and neurons"),
            undeclared=directory.undeclared(name),
        )
        return UNKNOWN
    found = resolve_end(Located(node.value, node), directory, findings)
    return UNKNOWN if found is UNKNOWN else np.array(found, dtype=np.int64)


def _text(node: Node) -> str:
    """What an author calls a signal."""
    if isinstance(node, AnyList):
        shown = [_text(item) for item in node.items[:_SHOWN]]
        return f"[{', '.join(shown if len(node.items) <= _SHOWN else [*shown, '…'])}]"
    return str(node.value).strip() if isinstance(node, Scalar) else "…"


def title_of(rules: Iterable[Learning]) -> str:
    """Rules in use for display, in their order: ``delta(rate=0.01, target=T) + decay(rate=0.1)``."""
    return " + ".join(
        called(one.settled, (f"{signal}={one.texts[signal]}" for signal in one.rule.signals)) for one in rules
    )


def called(used: Settled, further: Iterable[str] = ()) -> str:
    """A rule or a synapse in use for display: ``phase(lag=0.5)``; a parameter that has several values is ``…``."""
    parts = [
        f"{name}={array[0]:g}" if len(array) and (array == array[0]).all() else f"{name}=…"
        for name, array in used.parameters.items()
    ]
    parts += further
    return f"{used.definition.name}({', '.join(parts)})" if parts else used.definition.name
