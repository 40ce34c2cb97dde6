"""Events: what changes during a run.

In: the ``events`` section, who finds what it names. Out: the events, resolved; those that name the same share one
array. What they change in a run is for ``timeline``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.finder import Finder
from neurovis_spec.compiler.names.references import key_of, known_inputs, other_parameter
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings, Span, Undeclared, shorten
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.model import names_of
from neurovis_spec.language.references import Arrow, Sum, parse
from neurovis_spec.language.sections import EventModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import FormulaList
from neurovis_spec.language.yaml.source import Scalar


class SetWeights(NamedTuple):
    """Weights of connections that are set, as ``name`` says, to a formula, or to one each."""

    name: str
    members: IntArray
    value: Formula | FormulaList
    key: Span


class Feed(NamedTuple):
    """An input of so many numbers, and what it is fed: a formula a number, or None for its source again; ``node`` is
    where that is written."""

    name: str
    size: int
    values: tuple[Formula, ...] | None
    key: Span
    node: Scalar


@dataclass(frozen=True)
class Event:
    """One event, resolved: it applies from step ``at`` on; a clamp ends before step ``to``. What is set and what is
    clamped follow the parameters, as these are by then. Each reference is an array of ascending indices."""

    at: int
    #: None: the clamp has no end
    to: int | None = None
    #: parameters, and what each is set to
    set: Mapping[str, Formula] = field(default_factory=dict)
    #: neurons or states, and what they are clamped to
    clamp: tuple[tuple[IntArray | StateOf, Formula], ...] = ()
    lesioned_neurons: tuple[IntArray, ...] = ()
    lesioned_connections: tuple[IntArray, ...] = ()
    mended_neurons: tuple[IntArray, ...] = ()
    mended_connections: tuple[IntArray, ...] = ()
    #: connections, and whether their rules are switched on or off
    learning: tuple[tuple[IntArray, bool], ...] = ()
    #: where each parameter that is set is named
    keys: Mapping[str, Span] = field(default_factory=dict)
    weights: tuple[SetWeights, ...] = ()
    feeds: tuple[Feed, ...] = ()
    #: neurons that go back to their beginning
    reset: tuple[IntArray, ...] = ()


@dataclass(frozen=True)
class EventReader:
    """Reads the events of a spec; ``finder`` knows what references name, ``inputs`` are those of the network."""

    finder: Finder
    constants: Constants
    inputs: Mapping[str, Input]

    @property
    def findings(self) -> Findings:
        """Where findings go."""
        return self.constants.findings

    def read(self, models: tuple[EventModel, ...]) -> tuple[Event, ...]:
        """All events, in the order written; those that are invalid are left out, and reported."""
        events = [self._event(model) for model in models]
        return tuple(event for event in events if event is not UNKNOWN)

    def _event(self, model: EventModel) -> Event | Unknown:
        """One event; UNKNOWN where anything of it is invalid, which is reported."""
        errors_before = self.findings.errors
        begin = model.at if model.at is not None else model.from_
        at = None if begin is None else self.constants.steps(begin, "the step of an event", 0)
        to = None if model.to is None else self.constants.steps(model.to, "the end of a clamp", 1)
        if isinstance(at, int) and isinstance(to, int) and model.to is not None and to <= at:
            message = f"the clamp ends before it begins: from {at} to {to}, which is exclusive"
            self.findings.error("out-of-range", model.to.span, message)
        given, weights = self._set(model)
        fed: Mapping[str, Formula | FormulaList | Unknown | None] = names_of(model, "feed", model.feed)
        feeds = [one for name, value in fed.items() for one in self._feed(key_of(model.source, "feed", name), value)]
        named = names_of(model, "clamp", model.clamp)
        clamps = [one for name, formula in named.items() for one in self._clamp(model, name, formula)]
        lesioned_neurons, lesioned_connections = self._neurons_and_connections(model.lesion)
        reset = tuple(found for part in model.reset if (found := self.finder.neurons(part)) is not UNKNOWN)
        mended_neurons, mended_connections = self._neurons_and_connections(model.mend)
        learning = [
            one
            for name, on in model.learning.items()
            for one in self._learning(key_of(model.source, "learning", name), on.value)
        ]
        if at is None or at is UNKNOWN or to is UNKNOWN or model.contradictory or self.findings.errors > errors_before:
            return UNKNOWN
        return Event(
            at,
            to,
            set=given,
            clamp=tuple(clamps),
            lesioned_neurons=lesioned_neurons,
            lesioned_connections=lesioned_connections,
            mended_neurons=mended_neurons,
            mended_connections=mended_connections,
            learning=tuple(learning),
            keys={name: key_of(model.source, "set", name).span for name in given},
            weights=tuple(weights),
            feeds=tuple(feeds),
            reset=reset,
        )

    def _set(self, model: EventModel) -> tuple[dict[str, Formula], list[SetWeights]]:
        """The parameters and the weights that an event sets, as far as they are valid."""
        given: dict[str, Formula] = {}
        weights: list[SetWeights] = []
        # a name whose value could not be read (UNKNOWN) is checked, too; ``model.set`` is without it
        values: Mapping[str, Formula | FormulaList] = model.set
        named: Mapping[str, Formula | FormulaList | Unknown] = names_of(model, "set", values)
        for name, value in named.items():
            key = key_of(model.source, "set", name)
            if isinstance(parse(name), Arrow):
                weights += self._weights(key, value)
                continue
            self._check_set(model, name)
            if isinstance(value, FormulaList):
                message = f"the parameter '{shorten(name)}' takes one value, not a list"
                self.findings.error("wrong-size", value.span, message)
            elif value is not UNKNOWN:
                given[name] = self.constants.measured(name, value)
                self.constants.scalar(given[name])
        return given, weights

    def _weights(self, key: Located[str], value: Formula | FormulaList | Unknown) -> list[SetWeights]:
        """The weights that a key of ``set`` names, and what they are set to; nothing where either is invalid, or where
        nothing was drawn."""
        members = self.finder.connections(key)
        if value is UNKNOWN:
            return []
        items = value.items if isinstance(value, FormulaList) else (value,)
        sound = [self.constants.scalar(item) is not UNKNOWN for item in items]
        if members is UNKNOWN or not len(members) or not all(sound):
            return []
        return [SetWeights(key.value, members, value, key.span)]

    def _feed(self, key: Located[str], value: Formula | FormulaList | Unknown | None) -> list[Feed]:
        """What a key of ``feed`` names, and what that is fed; nothing where either is invalid."""
        name = key.value
        entry = self.inputs.get(name)
        if entry is None:
            message = f"there is no input '{shorten(name)}' to be fed"
            lost, known = Undeclared(name, self.constants.home), tuple(self.inputs)
            hint = partial(known_inputs, name, known)
            self.findings.error("unknown-input", key.span, message, hint, undeclared=lost)
        if value is UNKNOWN:
            return []
        items = () if value is None else value.items if isinstance(value, FormulaList) else (value,)
        sound = [self.constants.scalar(item) is not UNKNOWN for item in items]
        if entry is None or not all(sound):
            return []
        if isinstance(value, FormulaList) and len(items) != entry.size:
            message = f"the input '{shorten(name)}' takes {plural(entry.size, 'number')}, not {len(items)}"
            self.findings.error("wrong-size", value.span, message)
            return []
        if value is None:
            return [Feed(name, entry.size, None, key.span, key.node)]
        each = items if isinstance(value, FormulaList) else items * entry.size
        return [Feed(name, entry.size, tuple(each), key.span, key.node)]

    def _check_set(self, model: EventModel, name: str) -> None:
        """Report a name that is no parameter, or one that cannot be set in a run."""
        span = key_of(model.source, "set", name).span
        constants = self.constants
        if name not in constants.names:
            message = f"there is no parameter '{shorten(name)}' to be set"
            known = constants.names
            lost = Undeclared(name, constants.home)
            self.findings.error(
                "unknown-parameter", span, message, lambda: other_parameter(name, known), undeclared=lost
            )
        elif name in self.constants.structural:
            message = f"'{name}' cannot be set in a run: the structure of the network depends on it"
            self.findings.error("structural-parameter", span, message)

    def _clamp(
        self, model: EventModel, name: str, formula: Formula | Unknown
    ) -> list[tuple[IntArray | StateOf, Formula]]:
        """What a key of ``clamp`` names, and what that is clamped to; nothing where either is invalid."""
        if formula is UNKNOWN and self.finder.directory.instance(name):
            return []
        found = self.finder.clamped(key_of(model.source, "clamp", name))
        if found is UNKNOWN or formula is UNKNOWN or self.constants.scalar(formula) is UNKNOWN:
            return []
        return [(found, formula)]

    def _neurons_and_connections(
        self, references: Iterable[Located[str]]
    ) -> tuple[tuple[IntArray, ...], tuple[IntArray, ...]]:
        """What the references of a lesion or a mend name: the neurons, and the connections."""
        neurons: list[IntArray] = []
        connections: list[IntArray] = []
        for reference in references:
            is_connection = not isinstance(parse(reference.value), Sum)
            members = self.finder.connections(reference) if is_connection else self.finder.neurons(reference)
            if members is not UNKNOWN:
                (connections if is_connection else neurons).append(members)
        return tuple(neurons), tuple(connections)

    def _learning(self, name: Located[str], on: bool) -> list[tuple[IntArray, bool]]:
        """The connections of a key of ``learning``, and whether their rules are on from now on; nothing where it is
        invalid."""
        members = self.finder.connections(name)
        if members is UNKNOWN:
            return []
        if len(members) and not self.finder.learns(members):
            message = f"nothing learns at '{shorten(name.value)}'"
            self.findings.error("no-rule", name.span, message, "name a connection that has a 'plasticity'")
        return [(members, on)]
