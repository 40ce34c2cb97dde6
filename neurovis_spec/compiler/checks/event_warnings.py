"""Events that are legal but surely not meant: beyond the run, clamps upon clamps, what is lesioned already.

In: the ``events`` as written, the Directory that their references mean, the Constants. Out: warnings. What an event
comes to be in a run does not matter here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.names.references import Directory, key_of, resolve_part, resolve_sum
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.references import Arrow, Sum, parse, parse_sum
from neurovis_spec.language.sections import EventModel
from neurovis_spec.language.unknown import known


class _Clamp(NamedTuple):
    """A key of a clamp: its neurons, or whose ``state`` ("" for the activity), neurons or ``connections``, and from
    which step (inclusive) to which (exclusive) it holds; ``number`` counts the keys in the order written."""

    number: int
    key: Located[str]
    state: str
    connections: bool
    members: IntArray
    begin: float
    end: float


class _Lesions(NamedTuple):
    """Since when each neuron is lesioned, and the number of the place that says so."""

    since: FloatArray
    number: IntArray
    places: list[Span]


def check_events(models: tuple[EventModel, ...], seen: Compiled, steps: int | None, findings: Findings) -> None:
    """Warn of events that change nothing, or are lost among others. ``steps``: the length of a run, if the spec has
    it."""
    constants = replace(seen.scopes[0].constants, findings=Findings(), structural=set())
    reader = _Reader(seen.network, seen.census.directory, constants)
    if steps is not None:
        for model in models:
            _check_beyond(model, reader, steps, findings)
    _check_mended(models, reader, findings)
    _check_learning(models, reader, findings)
    lesions = _lesions(models, reader, findings)
    clamps = [clamp for clamp in reader.clamps(models) if not _is_lesioned(clamp, lesions, findings)]
    count = max(reader.count, len(reader.network.connections))
    for what in dict.fromkeys((clamp.state, clamp.connections) for clamp in clamps):
        _check_overlaps([clamp for clamp in clamps if (clamp.state, clamp.connections) == what], count, findings)


@dataclass(frozen=True)
class _Reader:
    """Evaluates events that were found valid before; ``constants`` therefore report into findings that are thrown
    away."""

    network: Network
    directory: Directory
    constants: Constants
    known: dict[str, IntArray] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """How many neurons there are."""
        return self.directory.members.stop

    def step(self, formula: Formula | None) -> int | None:
        """A step, which may be an expression, or a time."""
        return None if formula is None else known(self.constants.steps(formula, "a step", 0), None)

    def neurons(self, text: Located[str]) -> IntArray:
        """The neurons of a reference."""
        found = parse(text.value)
        return self._of(found, text) if isinstance(found, Sum) else np.zeros(0, dtype=np.int64)

    def clamped(self, text: Located[str]) -> tuple[str, bool, IntArray]:
        """The state that a key of a clamp names, "" for the activity, whether it is one of connections, and whose it
        is."""
        part, *others = parse_sum(text.value)
        name = None if others else self.directory.name_of_state(part)
        if name is None:
            return "", False, self.neurons(text)
        if isinstance(name.owner, Arrow):
            connections, ends = self.network.connections, (name.owner.sources, name.owner.targets)
            sources, targets = (self._of(end, text) for end in ends)
            there = np.isin(connections.sources.whole(), sources) & np.isin(connections.targets.whole(), targets)
            return name.state, True, np.flatnonzero(there)
        found = known(resolve_part(name.owner, text, self.directory, self.constants.findings), ())
        return name.state, False, np.array(found, dtype=np.int64)

    def ends(self, text: Located[str]) -> tuple[IntArray, ...]:
        """The neurons of a reference, or those of either end of a connection."""
        found = parse(text.value)
        ends = (found.sources, found.targets) if isinstance(found, Arrow) else (found,)
        return tuple(self._of(end, text) for end in ends if isinstance(end, Sum))

    def _of(self, end: Sum, text: Located[str]) -> IntArray:
        """The neurons of an end of a connection."""
        if end.text not in self.known:
            found = known(resolve_sum(end, text, self.directory, self.constants.findings), ())
            self.known[end.text] = np.array(found, dtype=np.int64)
        return self.known[end.text]

    def clamps(self, models: tuple[EventModel, ...]) -> Iterator[_Clamp]:
        """All clamps, key by key."""
        number = 0
        for model in models:
            begin, end = self.step(model.from_), self.step(model.to)
            for name in model.clamp if begin is not None else ():
                key = key_of(model.source, "clamp", name)
                yield _Clamp(number, key, *self.clamped(key), begin or 0.0, math.inf if end is None else end)
                number += 1


def _check_beyond(model: EventModel, reader: _Reader, steps: int, findings: Findings) -> None:
    formula = model.at if model.at is not None else model.from_
    begin = reader.step(formula)
    if formula is not None and begin is not None and begin >= steps:
        message = f"step {begin:.0f} is never reached: a run has the steps 0 to {steps - 1} ('steps')"
        hint = f"let it be earlier, or lengthen the run: time: {{steps: {begin + 1:.0f}}}"
        findings.warning("beyond-steps", formula.span, message, hint)


def _check_learning(models: tuple[EventModel, ...], reader: _Reader, findings: Findings) -> None:
    """Warn of rules that are stopped or started where they are so already, as far as no event names some of their
    connections in another way."""
    timed = [(begin, model) for model in models if (begin := reader.step(model.at)) is not None]
    keys = [
        (begin, key_of(model.source, "learning", name), on.value)
        for begin, model in sorted(timed, key=lambda one: one[0])
        for name, on in model.learning.items()
    ]
    ends = {_normal(key): reader.ends(key) for _, key, _ in keys}
    alone = {name for name in ends if not any(_meet(ends[name], ends[other]) for other in ends if other != name)}
    learns: dict[str, bool] = {}
    for begin, key, on in keys:
        name = _normal(key)
        if name in alone and learns.get(name, True) == on:
            message = f"'{shorten(key.value)}' {'learns' if on else 'does not learn'} already at step {begin:.0f}"
            findings.warning("no-effect", key.span, message, "remove it")
        learns[name] = on


def _normal(key: Located[str]) -> str:
    """Connections as they are named, without what blanks make of it."""
    found = parse(key.value)
    return found.normal if isinstance(found, Arrow) else key.value


def _meet(some: tuple[IntArray, ...], others: tuple[IntArray, ...]) -> bool:
    """Whether two pairs of ends may have a connection in common."""
    return all(bool(np.isin(one, other).any()) for one, other in zip(some, others, strict=True))


def _check_mended(models: tuple[EventModel, ...], reader: _Reader, findings: Findings) -> None:
    """Warn of what is mended and was not lesioned until then, neither by itself nor with its neurons or connections."""
    lesioned = np.full(reader.count, np.inf)  # since when a neuron, or any of its connections, is
    timed = [(begin, model) for model in models if (begin := reader.step(model.at)) is not None]
    for begin, text in ((begin, text) for begin, model in timed for text in model.lesion):
        touched = np.concatenate(reader.ends(text))
        lesioned[touched] = np.minimum(lesioned[touched], begin)
    for begin, text in ((begin, text) for begin, model in timed for text in model.mend):
        if (lesioned[np.concatenate(reader.ends(text))] > begin).all():
            message = f"nothing of '{shorten(text.value)}' is lesioned until step {begin:.0f}: it mends nothing"
            findings.warning("no-effect", text.span, message, "remove it, or lesion it before")


def _lesions(models: tuple[EventModel, ...], reader: _Reader, findings: Findings) -> _Lesions:
    """Since when each neuron is lesioned; a warning at what is lesioned again."""
    lesions = _Lesions(np.full(reader.count, np.inf), np.zeros(reader.count, dtype=np.int64), [])
    mended = np.zeros(reader.count, dtype=np.bool_)  # these come and go
    for model in models:
        for text in model.mend:
            mended[np.concatenate(reader.ends(text))] = True
    timed = [(begin, model) for model in models if model.lesion and (begin := reader.step(model.at)) is not None]
    for begin, model in sorted(timed, key=lambda one: one[0]):
        for text in model.lesion:
            ends = reader.ends(text)
            gone = next((end for end in ends if len(end) and np.isfinite(lesions.since[end]).all()), None)
            if gone is not None:
                since, place = _last(lesions, gone)
                message = f"'{shorten(text.value)}' is lesioned already, since step {since:.0f}"
                findings.warning("no-effect", text.span, f"{message} ({place.seen_from(text.span)})", "remove it")
            elif len(ends) == 1:
                new = ends[0][np.isinf(lesions.since[ends[0]]) & ~mended[ends[0]]]
                lesions.since[new], lesions.number[new] = begin, len(lesions.places)
                lesions.places.append(text.span)
    return lesions


def _last(lesions: _Lesions, neurons: IntArray) -> tuple[float, Span]:
    """Since when all of some lesioned neurons are, and where that is said."""
    last = int(neurons[np.argmax(lesions.since[neurons])])
    return float(lesions.since[last]), lesions.places[int(lesions.number[last])]


def _is_lesioned(clamp: _Clamp, lesions: _Lesions, findings: Findings) -> bool:
    """Whether the neurons of a clamp are all lesioned before it begins, whose states go on; a warning if so."""
    if clamp.state or not len(clamp.members) or (lesions.since[clamp.members] > clamp.begin).any():
        return False
    since, place = _last(lesions, clamp.members)
    message = f"'{shorten(clamp.key.value)}' is lesioned from step {since:.0f} on ({place.seen_from(clamp.key.span)})"
    findings.warning("no-effect", clamp.key.span, f"{message}: clamping it changes nothing", "remove it")
    return True


def _check_overlaps(clamps: list[_Clamp], count: int, findings: Findings) -> None:
    """Clamps, all of activities or of one state, that hold a neuron while another one does; a warning at the one
    written later."""
    end, owner = np.zeros(count), np.zeros(count, dtype=np.int64)  # until when a neuron is clamped, and by which
    order = sorted(clamps, key=lambda one: one.begin)
    told: set[int] = set()
    for number, clamp in enumerate(order):
        for other in np.unique(owner[clamp.members[end[clamp.members] > clamp.begin]]).tolist():
            first, second = sorted((order[other], clamp), key=lambda one: one.number)
            if second.number not in told:
                told.add(second.number)
                _tell(first, second, findings)
        longer = clamp.members[end[clamp.members] < clamp.end]
        end[longer], owner[longer] = clamp.end, number


def _tell(first: _Clamp, second: _Clamp, findings: Findings) -> None:
    """Warn, at the later one, of two clamps that hold a neuron at the same steps."""
    begin, end = max(first.begin, second.begin), min(first.end, second.end) - 1
    when = f"from step {begin:.0f} on" if math.isinf(end) else f"at the steps {begin:.0f} to {end:.0f}"
    when = f"at step {begin:.0f}" if begin == end else when
    one, other = second.key, first.key
    both = f"'{shorten(one.value)}' and '{shorten(other.value)}' ({other.span.seen_from(one.span)})"
    what = "state" if first.state else "neuron"
    message = f"{both} clamp the same {what} {when}: this one, written last, holds"
    findings.warning("clamps-overlap", second.key.span, message, "end one, with 'to', before the other")
