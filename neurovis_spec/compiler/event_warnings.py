"""Events that are legal but surely not meant: beyond the run, clamps upon clamps, what is lesioned already.

In: the ``events`` as written, the Directory that their references mean, the Constants. Out: warnings. What an event
comes to be in a run does not matter here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from neurovis_spec.compiler.constants import Constants
from neurovis_spec.compiler.references import Directory, key_of, resolve_end, resolve_ends
from neurovis_spec.diagnostics import Findings, Span, shown
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.sections import EventModel


class _Clamp(NamedTuple):
    """A key of a clamp: its neurons, and from which step (inclusive) to which (exclusive) it holds; ``number`` counts
    the keys in the order written."""

    number: int
    key: Located[str]
    neurons: tuple[int, ...]
    begin: float
    end: float


class _Lesion(NamedTuple):
    """Since when a neuron is lesioned, and where that is said."""

    begin: float
    span: Span


def look_at_events(
    models: tuple[EventModel, ...], directory: Directory, constants: Constants, steps: int | None, findings: Findings
) -> None:
    """Warn of events that change nothing, or are lost among others. ``steps``: the length of a run, if the spec has
    it."""
    reader = _Reader(directory, replace(constants, findings=Findings(), structural=set()))
    if steps is not None:
        for model in models:
            _look_beyond(model, reader, steps, findings)
    lesions = _lesions(models, reader, findings)
    clamps = [clamp for clamp in reader.clamps(models) if not _is_lesioned(clamp, lesions, findings)]
    _look_at_overlaps(clamps, findings)


@dataclass(frozen=True)
class _Reader:
    """What events say, which has been found right before: ``constants`` tell nobody of anything."""

    directory: Directory
    constants: Constants

    def step(self, formula: Formula | None) -> float | None:
        """A step, which may be an expression."""
        value = None if formula is None else self.constants.scalar(formula)
        return value

    def neurons(self, text: Located[str]) -> tuple[int, ...]:
        """The neurons of a reference."""
        return resolve_end(text, self.directory, self.constants.findings) or ()

    def clamps(self, models: tuple[EventModel, ...]) -> Iterator[_Clamp]:
        """All clamps, key by key."""
        number = 0
        for model in models:
            begin, end = self.step(model.from_), self.step(model.to)
            for name in model.clamp if begin is not None else ():
                key = key_of(model.source, "clamp", name)
                yield _Clamp(number, key, self.neurons(key), begin or 0.0, math.inf if end is None else end)
                number += 1


def _look_beyond(model: EventModel, reader: _Reader, steps: int, findings: Findings) -> None:
    formula = model.at if model.at is not None else model.from_
    begin = reader.step(formula)
    if formula is not None and begin is not None and begin >= steps:
        message = f"step {begin:g} is never reached: a run has the steps 0 to {steps - 1} ('steps')"
        hint = f"let it be earlier, or lengthen the run: time: {{steps: {begin + 1:g}}}"
        findings.warning("beyond-steps", formula.span, message, hint)


def _lesions(models: tuple[EventModel, ...], reader: _Reader, findings: Findings) -> dict[int, _Lesion]:
    """Since when each neuron is lesioned; a warning at what is lesioned again."""
    lesions: dict[int, _Lesion] = {}
    timed = [(begin, model) for model in models if model.lesion and (begin := reader.step(model.at)) is not None]
    for begin, model in sorted(timed, key=lambda one: one[0]):
        for text in model.lesion:
            ends = [reader.neurons(text)] if "->" not in text.value else _ends(text, reader)
            gone = next((end for end in ends if end and all(neuron in lesions for neuron in end)), None)
            if gone is not None:
                before = lesions[gone[-1]]
                message = f"'{shown(text.value)}' is lesioned already, since step {before.begin:g}"
                findings.warning("no-effect", text.span, f"{message} ({_place(before.span, text.span)})", "remove it")
            elif len(ends) == 1:
                for neuron in ends[0]:
                    lesions.setdefault(neuron, _Lesion(begin, text.span))
    return lesions


def _ends(text: Located[str], reader: _Reader) -> tuple[tuple[int, ...], ...]:
    return resolve_ends(text, reader.directory, reader.constants.findings) or ()


def _is_lesioned(clamp: _Clamp, lesions: dict[int, _Lesion], findings: Findings) -> bool:
    """Whether the neurons of a clamp are all lesioned before it begins; a warning if so."""
    before = [lesions.get(neuron) for neuron in clamp.neurons]
    last = max((one for one in before if one is not None), key=lambda one: one.begin, default=None)
    if last is None or not all(before) or last.begin > clamp.begin:
        return False
    message = f"'{shown(clamp.key.value)}' is lesioned from step {last.begin:g} on"
    place = _place(last.span, clamp.key.span)
    findings.warning("no-effect", clamp.key.span, f"{message} ({place}): clamping it changes nothing", "remove it")
    return True


def _look_at_overlaps(clamps: list[_Clamp], findings: Findings) -> None:
    """Clamps that hold a neuron while another one does; a warning at the one written later."""
    last: dict[int, _Clamp] = {}
    told: set[int] = set()
    for clamp in sorted(clamps, key=lambda one: one.begin):
        for neuron in clamp.neurons:
            other = last.get(neuron)
            if other is None or other.end < clamp.end:
                last[neuron] = clamp
            if other is None or other.end <= clamp.begin:
                continue
            first, second = sorted((other, clamp))
            if second.number not in told:
                told.add(second.number)
                begin, end = clamp.begin, min(other.end, clamp.end) - 1
                when = f"from step {begin:g} on" if math.isinf(end) else f"at the steps {begin:g} to {end:g}"
                when = f"at step {begin:g}" if begin == end else when
                place = _place(first.key.span, second.key.span)
                both = f"'{shown(second.key.value)}' and '{shown(first.key.value)}' ({place})"
                message = f"{both} clamp the same neuron {when}: this one, written last, holds"
                findings.warning("clamps-overlap", second.key.span, message, "end one, with 'to', before the other")


def _place(other: Span, here: Span) -> str:
    return f"column {other.column}" if other.line == here.line else f"line {other.line}"
