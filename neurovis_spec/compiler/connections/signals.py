"""Signals of rules: what an entry of ``connections`` says of where they come from.

In: what is written: neurons, groups, states and outputs of these, inputs; one for all, one for each target, or under
``from`` one for each source. Out: a Signal, by which each connection has its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.names.references import Directory, few, resolve_end, resolve_part
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.names.state_references import no_state
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.neurons.groups import is_written
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Arrow, Part, StateName, parse_sum
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import FROM
from neurovis_spec.language.yaml.source import AnyList, Entry, Node, Scalar, one_or_more
from neurovis_spec.language.yaml.source import Mapping as Written
from neurovis_spec.likeness import suggest

#: Signals of a list that are named where a rule is shown.
_SHOWN = 3


class Signal(NamedTuple):
    """Where the signal of each of some connections comes from: ``places`` in the activities of all neurons followed by
    all inputs; and, by the names of states and outputs, for which connections it is that of the neuron instead."""

    places: IntArray
    states: Mapping[str, BoolArray]

    def some(self, which: IntArray) -> Signal:
        """That of some of them alone."""
        return Signal(self.places[which], {name: own[which] for name, own in self.states.items()})

    def is_activity_of(self, neurons: Indices) -> bool:
        """Whether it is the activity of these, connection by connection."""
        return not self.states and np.array_equal(self.places, neurons)


class ConnectionEnds(NamedTuple):
    """The connections of an entry: connection c goes from the ``i[c]``-th of ``n_from`` sources to the ``j[c]``-th of
    ``n_to`` targets. The fields have the names that the settings of a rule see."""

    i: IntArray
    j: IntArray
    n_from: int
    n_to: int


class Place(NamedTuple):
    """Where rules are written: of which connections they are, UNKNOWN where those are not known (then the entry is
    invalid, and its rules are checked only), how many sources and targets these have, and what names mean there."""

    ends: ConnectionEnds | Unknown
    sources: int | Unknown
    targets: int | Unknown
    scope: Scope
    directory: Directory
    census: Census
    #: what a mapping means as the value of a setting
    table: Callable[[Written], FloatArray | Unknown] | None = None

    @property
    def findings(self) -> Findings:
        """Where findings go."""
        return self.scope.constants.findings


class _Components(NamedTuple):
    """What is named, one after the other: places as a Signal has them, and the state or output of each, "" without."""

    places: IntArray
    states: Sequence[str]


def signal_of(entry: Entry, at: Place) -> Signal | Unknown:
    """Where a signal comes from; UNKNOWN where that is invalid, which is reported, or the connections are. It is one
    name, or a list of names that are taken together, with one component in all or one for each target; or, under
    ``from``, one for each source."""
    node, findings = entry.value, at.findings
    of_sources = isinstance(node, Written)
    if isinstance(node, Written):
        inner = node.get(FROM)
        if inner is None or len(node.entries) != 1:
            hint = f"write {{{FROM}: NEURONS}} for one value for each source"
            findings.error("wrong-type", node.span, f"the signal '{entry.name}' is a name, or {{{FROM}: NAME}}", hint)
            return UNKNOWN
        node = inner
    found = _components(entry.name, node, at)
    if found is UNKNOWN:
        return UNKNOWN
    count, wanted = len(found.places), at.sources if of_sources else at.targets
    if wanted is not UNKNOWN and count not in (1, wanted):
        _report_size(entry.name, node, count, at, of_sources)
        return UNKNOWN
    if at.ends is UNKNOWN:
        return UNKNOWN
    which = at.ends.i if of_sources else at.ends.j
    which = np.zeros_like(which) if count == 1 else which
    states = np.array(found.states)[which]
    return Signal(found.places[which], {name: states == name for name in dict.fromkeys(found.states) if name})


def _report_size(signal: str, node: Node, count: int, at: Place, of_sources: bool) -> None:
    """That a signal has components for other than its connections' ends."""
    each, wanted = ("source", at.sources) if of_sources else ("target", at.targets)
    title = f"'{text_of(node)}'" if isinstance(node, Scalar) else f"'{signal}'"
    needed = "one is wanted" if wanted == 1 else f"1 or {wanted}, one for each {each}, are wanted"
    message = f"the signal {title} has {count} components; {needed}"
    hint = None
    if not of_sources and count == at.sources:
        hint = f"one for each source is written {signal}: {{{FROM}: {text_of(node)}}}"
    at.findings.error("wrong-size", node.span, message, hint)


def _components(signal: str, node: Node, at: Place) -> _Components | Unknown:
    """What a signal names; UNKNOWN where that is invalid, which is reported."""
    before, found = at.findings.errors, list[_Components | Unknown]()
    for item in one_or_more(node):
        found.append(_named(signal, item, at))
        if at.findings.errors - before >= PATIENCE:
            return UNKNOWN
    if not found:
        at.findings.error("wrong-type", node.span, f"the signal '{signal}' names no neuron, group or input")
    known = [one for one in found if one is not UNKNOWN]
    if not known or len(known) < len(found):
        return UNKNOWN
    return _Components(np.concatenate([one.places for one in known]), [state for one in known for state in one.states])


def _named(signal: str, node: Node, at: Place) -> _Components | Unknown:
    """What a name of a signal means: neurons, states of neurons, or an input."""
    findings, directory = at.findings, at.directory
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        message = f"the signal '{signal}' is the name of a neuron, a group or an input, or a list of these"
        findings.error("wrong-type", node.span, message)
        return UNKNOWN
    name = node.value.strip()
    source = at.scope.input(name)
    if isinstance(source, Input):
        first = len(at.census.neurons) + source.start
        return _plain(range(first, first + source.size))
    if source is UNKNOWN or directory.find(name) is UNKNOWN:
        return UNKNOWN
    if directory.find(name) is None and not any(mark in name for mark in (".", "+")):
        names = (*at.scope.section.inputs, *directory.known)
        message = f"there is no neuron, group or input '{shorten(name)}'"
        findings.error(
            "unknown-signal",
            node.span,
            message,
            lambda: suggest(name, few(name, names), "inputs and neurons"),
            undeclared=directory.undeclared(name),
        )
        return UNKNOWN
    text = Located(node.value, node)
    parts = [(part, directory.name_of_state(part)) for part in parse_sum(text.value)]
    if all(state is None for _, state in parts):
        neurons = resolve_end(text, directory, findings)
        return UNKNOWN if neurons is UNKNOWN else _plain(neurons)
    found = [_part(part, state, text, at) for part, state in parts]
    known = [one for one in found if one is not UNKNOWN]
    if len(known) < len(found):
        return UNKNOWN
    return _Components(np.concatenate([one.places for one in known]), [state for one in known for state in one.states])


def _plain(places: Sequence[int]) -> _Components:
    return _Components(np.array(places, dtype=np.int64), [""] * len(places))


def _part(part: Part, state: StateName | None, text: Located[str], at: Place) -> _Components | Unknown:
    """Neurons, or a state of some."""
    span = text.node.at(part.start, part.end)
    owner = part if state is None else state.owner
    if isinstance(owner, Arrow):
        message = f"'{shorten(part.text)}' is a state of connections; a signal is one of neurons, or an input"
        at.findings.error("unknown-state", span, message, "in the rule itself its states are known by their names")
        return UNKNOWN
    neurons = resolve_part(owner, text, at.directory, at.findings)
    if neurons is UNKNOWN or state is None:
        return UNKNOWN if neurons is UNKNOWN else _plain(neurons)
    return _states(state, np.array(neurons, dtype=np.int64), span, at)


def _states(name: StateName, neurons: IntArray, span: Span, at: Place) -> _Components | Unknown:
    """A state or an output of neurons, all of whose models must have it."""
    for group in at.census.groups_of(neurons):
        model = group.kind.model.definition
        if not is_written(group.kind, group.model):
            return UNKNOWN
        known = tuple(one.name for one in model.named)
        if name.state not in known:
            refused = no_state("model", model.name, f"of '{shorten(name.owner.text)}'", name.state, known)
            at.findings.error("unknown-state", span, refused.message, refused.hint, undeclared=refused.undeclared)
            return UNKNOWN
    return _Components(neurons, [name.state] * len(neurons))


def text_of(node: Node) -> str:
    """What an author calls a signal."""
    if isinstance(node, Written):
        return f"{{{', '.join(f'{entry.name}: {text_of(entry.value)}' for entry in node.entries)}}}"
    if isinstance(node, AnyList):
        shown = [text_of(item) for item in node.items[:_SHOWN]]
        return f"[{', '.join(shown if len(node.items) <= _SHOWN else [*shown, '…'])}]"
    return str(node.value).strip() if isinstance(node, Scalar) else "…"
