"""Measures that somebody has typed, as curves of a run.

In: the text of a measure, a Network. Out: what is wrong with it, or Typed, the measures of a run, which go on in an
edited network as far as they mean anything there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic, Span, SpecError
from neurovis_spec.live.series import Measured, Series, measured
from neurovis_spec.live.source import SourceError
from neurovis_spec.runtime.measures import findings_of, measure_of

#: The most measures of a run, characters of one, and steps that its windows are of, together.
MOST: Final = 16
LONGEST: Final = 500
_WINDOWS: Final = 1 << 17
_LABEL: Final = "measure"


@dataclass(frozen=True, slots=True)
class Entry:
    """A measure, by which it is asked for, ``m3``, and its text."""

    number: int
    text: str
    series: Measured


@dataclass(frozen=True, slots=True)
class Typed:
    """The measures of a run, and how many there were."""

    all: tuple[Entry, ...] = ()
    made: int = 0

    @property
    def series(self) -> Mapping[str, Series]:
        """What they are, by what they are asked for."""
        return {f"m{one.number}": one.series for one in self.all}

    @property
    def told(self) -> tuple[tuple[int, str], ...]:
        """The number and the text of each."""
        return tuple((one.number, one.text) for one in self.all)

    def add(self, text: str, network: Network) -> Typed:
        """With another; one that is there already stays as it is. Raises SpecError, SourceError where they are too
        many."""
        if any(one.text == text for one in self.all):
            return self
        if len(self.all) >= MOST:
            raise SourceError(f"there are {MOST} measures already: take one away")
        return Typed((*self.all, Entry(self.made, text, of_text(text, network))), self.made + 1)

    def without(self, number: int) -> Typed:
        """Without that of this number."""
        return replace(self, all=tuple(one for one in self.all if one.number != number))

    def on(self, network: Network) -> Typed:
        """Those that mean something in another network."""
        kept = list[Entry]()
        for one in self.all:
            with suppress(SpecError):  # of what is no longer there
                kept.append(replace(one, series=of_text(one.text, network)))
        return replace(self, all=tuple(kept))


def of_text(text: str, network: Network) -> Measured:
    """What a text measures. Raises SpecError."""
    measure = measure_of(text, network, _LABEL)
    steps = sum(window.last or 0 for window in measure.formula.windows)
    if steps > _WINDOWS:
        findings = findings_of(text, _LABEL)
        window = max(measure.formula.windows, key=lambda one: one.last or 0)
        place = Span(_LABEL, 1, 1, 1, 1).within(window.start, window.end)
        findings.error("bad-window", place, f"the last {steps:,} steps are more than are kept for a curve")
        findings.check()
    return measured(measure, network)


def findings(text: str, network: Network) -> Sequence[Diagnostic]:
    """What is wrong with a text as a measure of a network, nothing where all is well."""
    try:
        of_text(text, network)
    except SpecError as error:
        return error.diagnostics
    return ()
