"""Patterns: which pairs of two ends are connected.

In: the neurons of both ends, by index, and a pattern with its settings. Out: positions (i, j) of the pairs within
the ends, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.constants import Constants
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.ends import Ends, Pairs
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.patterns_drawn import fixed_indegree, fixed_outdegree, small_world
from neurovis_spec.compiler.patterns_near import band, in_band, nearest
from neurovis_spec.diagnostics import Findings, Span, suggest
from neurovis_spec.language.located import Formula, formula_of, shown
from neurovis_spec.language.values import Choice


def all_to_all(ends: Ends) -> Pairs:
    """Every source with every target."""
    n, m = len(ends.sources), len(ends.targets)
    return ends.pairs(np.repeat(np.arange(n), m), np.tile(np.arange(m), n))


def one_to_one(ends: Ends) -> Pairs:
    """The first with the first and so on; within a group this makes self-loops, which is what was asked for."""
    index = np.arange(len(ends.sources), dtype=np.int64)
    return ends.pairs(index, index, loops=True)


def chain(ends: Ends) -> Pairs:
    """i to i + 1."""
    index = np.arange(len(ends.sources) - 1, dtype=np.int64)
    return ends.pairs(index, index + 1)


def ring(ends: Ends) -> Pairs:
    """i to i + 1, and the last to the first."""
    index = np.arange(len(ends.sources), dtype=np.int64)
    return ends.pairs(index, np.roll(index, -1))


def random(ends: Ends, probability: float, stream: Stream) -> Pairs:
    """Every pair with a probability; drawn row by row by geometric gaps (§4, Randomness)."""
    return ends.pairs(*stream.random_pairs(len(ends.sources), len(ends.targets), probability))


_FIXED: Mapping[str, Callable[[Ends], Pairs]] = {
    "all_to_all": all_to_all,
    "one_to_one": one_to_one,
    "chain": chain,
    "ring": ring,
}
#: Patterns with settings, and how they are written.
_USES: Mapping[str, str] = {
    "random": "{random: {probability: 0.1}}",
    "fixed_indegree": "{fixed_indegree: {count: 3}}",
    "fixed_outdegree": "{fixed_outdegree: {count: 3}}",
    "nearest": "{nearest: {count: 3}}",
    "small_world": "{small_world: {degree: 4, rewire: 0.1}}",
    "band": "{band: {width: 1}}",
}
_SETTINGS: Mapping[str, tuple[str, ...]] = {
    "random": ("probability",),
    "fixed_indegree": ("count",),
    "fixed_outdegree": ("count",),
    "nearest": ("count",),
    "small_world": ("degree", "rewire"),
    "band": ("width",),
}
PATTERNS = (*_FIXED, *_USES)


def pairs_of(
    choice: Choice, ends: Ends, constants: Constants, stream: Stream, fits: Callable[[int], bool]
) -> Pairs | None:
    """The pairs of a pattern as the author wrote it; None where it is at fault, which is noted.

    ``fits`` says, before they are made, whether there is room for so many.
    """
    findings = constants.findings
    name = choice.name.value
    span = choice.name.span
    allowed = _SETTINGS.get(name, ())
    if name not in PATTERNS:
        hint = suggest(name, PATTERNS, "patterns")
        findings.error("unknown-pattern", span, f"there is no pattern '{shown(name)}'", hint)
        return None
    for entry in choice.settings:
        if entry.name not in allowed:
            hint = suggest(entry.name, allowed, "known here") or f"'{name}' has no settings"
            findings.error("unknown-parameter", entry.key.span, f"there is no setting '{shown(entry.name)}'", hint)
            return None
    n, m = len(ends.sources), len(ends.targets)
    if n != m and ((name in _FIXED and name != "all_to_all") or name == "small_world"):
        message = f"'{name}' needs ends of equal size; these have {n} and {m} neurons"
        findings.error("wrong-size", span, message)
        return None
    if name in _FIXED:
        return _FIXED[name](ends) if fits(n * m if name == "all_to_all" else n) else None
    settings = _settings(choice, allowed, findings)
    return None if settings is None else _Sized(name, span, settings, ends, constants, stream, fits).pairs()


def _settings(choice: Choice, allowed: tuple[str, ...], findings: Findings) -> dict[str, Formula] | None:
    """The formulas of all settings; each of them has to be there."""
    name = choice.name.value
    given = {entry.name: formula_of(entry.value, findings) for entry in choice.settings}
    for missing in [setting for setting in allowed if setting not in given][:1]:
        message = f"'{name}' needs a {missing}"
        findings.error("missing-key", choice.name.span, message, f"write {_USES[name]}")
        return None
    settings = {setting: formula for setting, formula in given.items() if formula is not None}
    return settings if len(settings) == len(given) else None


@dataclass(frozen=True)
class _Sized:
    """A pattern with settings, which are looked at before anything is made."""

    name: str
    span: Span
    settings: Mapping[str, Formula]
    ends: Ends
    constants: Constants
    stream: Stream
    fits: Callable[[int], bool]

    def pairs(self) -> Pairs | None:
        if self.name == "random":
            return self._random()
        if self.name == "band":
            return self._band()
        if self.name == "small_world":
            return self._small_world()
        return self._counted()

    def _probability(self, setting: str) -> float | None:
        formula = self.settings[setting]
        value = self.constants.scalar(formula, structural=True)
        if value is None or 0 <= value <= 1:
            return value
        message = f"a probability lies between 0 and 1, this is {value:g}"
        self.constants.findings.error("out-of-range", formula.span, message)
        return None

    def _too_many(self, setting: str, message: str) -> None:
        self.constants.findings.error("out-of-range", self.settings[setting].span, message)

    def _random(self) -> Pairs | None:
        probability = self._probability("probability")
        if probability is None:
            return None
        n, m = len(self.ends.sources), len(self.ends.targets)
        # So many there are at the least, but for one case in a million; who has made them is asked again.
        least = n * m * probability - 5 * (n * m * probability * (1 - probability)) ** 0.5
        return random(self.ends, probability, self.stream) if self.fits(max(0, int(least))) else None

    def _band(self) -> Pairs | None:
        n, m = len(self.ends.sources), len(self.ends.targets)
        width = self.constants.integer(self.settings["width"], "a width", 0)
        if width is None:
            return None
        width = min(width, max(n, m))
        return band(self.ends, width) if self.fits(max(0, in_band(n, m, width) - min(n, m))) else None

    def _small_world(self) -> Pairs | None:
        n = len(self.ends.sources)
        degree = self.constants.integer(self.settings["degree"], "a degree", 2)
        rewire = self._probability("rewire")
        if degree is None or rewire is None:
            return None
        if degree % 2:
            self._too_many("degree", f"a degree is even, half of it on each side of the ring; this is {degree}")
            return None
        if degree > n - 1:
            self._too_many("degree", f"a degree of {degree} where each has {plural(n - 1, 'neighbour')}")
            return None
        return small_world(self.ends, degree, rewire, self.stream) if self.fits(n * degree) else None

    def _counted(self) -> Pairs | None:
        count = self.constants.integer(self.settings["count"], "a count", 1)
        if count is None:
            return None
        by_target = self.name == "fixed_indegree"
        ends = self.ends.reversed() if by_target else self.ends
        there = len(ends.targets) - bool((ends.excluded() >= 0).any())
        if count > there:
            from_, to = ("target", "source") if by_target else ("source", "target")
            itself = " but itself" if there < len(ends.targets) else ""
            self._too_many("count", f"a count of {count} where a {from_} has {plural(there, to)}{itself}")
            return None
        if not self.fits(count * len(ends.sources)):
            return None
        if self.name == "nearest":
            return nearest(self.ends, count) if self._placed() else None
        return (fixed_indegree if by_target else fixed_outdegree)(self.ends, count, self.stream)

    def _placed(self) -> bool:
        """Whether all neurons have a position, or none; a finding where some have."""
        places = np.concatenate((self.ends.source_places, self.ends.target_places))
        known = np.isfinite(places).all(axis=1)
        if known.all() or not known.any():
            return True
        message = "'nearest' goes by position, and some neurons of these ends have none"
        self.constants.findings.error("no-position", self.span, message, "give all of them a 'position', or none")
        return False
