"""Patterns: which pairs of two ends are connected.

In: the neurons of both ends, by index, and a pattern with its settings. Out: positions (i, j) of the pairs within
the ends, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.connections.ends import Ends, Pairs
from neurovis_spec.compiler.connections.patterns_drawn import fixed_indegree, fixed_outdegree, small_world
from neurovis_spec.compiler.connections.patterns_near import band, in_band, nearest
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.values.arguments import check_settings
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, Span, meant, shorten, suggest
from neurovis_spec.language.keys import settings_of
from neurovis_spec.language.located import Formula, formula_of
from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
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


def pairs_of(
    choice: Choice, ends: Ends | None, constants: Constants, stream: Stream, fits: Callable[[int], bool]
) -> Pairs | None:
    """The pairs of a pattern as the author wrote it; None where it is invalid, which is reported, or where the ends are
    not known.

    ``fits`` says, before they are made, whether there is room for so many.
    """
    findings = constants.findings
    written, span = choice.name.value, choice.name.span
    name = written if written in PATTERNS else meant(written, PATTERNS)
    if written not in PATTERNS:
        hint = suggest(written, PATTERNS, "patterns")
        findings.error("unknown-pattern", span, f"there is no pattern '{shorten(written)}'", hint)
    if name is None:
        check_settings(choice, constants)
        return None
    settings = _settings(name, choice, findings)
    sized = _Sized(name, span, settings, constants)
    values = sized.values()
    if ends is None:
        return None
    n, m = len(ends.sources), len(ends.targets)
    if n != m and ((name in _FIXED and name != "all_to_all") or name == "small_world"):
        message = f"'{name}' needs ends of equal size; these have {n} and {m} neurons"
        findings.error("wrong-size", span, message)
        return None
    if len(values) < len(PATTERNS[name].settings) or name != written:
        return None
    if name in _FIXED:
        return _FIXED[name](ends) if fits(least_pairs(name, n, m, {})) else None
    return sized.pairs(values, ends, stream, fits)


def least_pairs(name: str, n: int, m: int, values: Mapping[str, float]) -> int:
    """A lower bound (but for one case in a million) of the pairs that a pattern makes of n sources and m targets.
    It may include a neuron's connections to itself. 0 where the settings do not fit such ends."""
    if name in _FIXED:
        return n * m if name == "all_to_all" else n
    if name not in PATTERNS or not PATTERNS[name].settings.keys() <= values.keys():
        return 0
    if name == "random":
        probability = values["probability"]
        if not 0 < probability <= 1:
            return 0
        # there are fewer in one case in a million; once made, the pairs are counted again
        return max(0, int(n * m * probability - 5 * (n * m * probability * (1 - probability)) ** 0.5))
    if name == "band":
        return max(0, in_band(n, m, min(int(values["width"]), max(n, m))) - min(n, m))
    each, ends, others = (values["count"], n, m) if name != "small_world" else (values["degree"], n, n)
    if name == "fixed_indegree":
        ends, others = m, n
    return int(each) * ends if each <= others else 0


def is_drawn(choice: Choice, constants: Constants) -> bool:
    """Whether chance decides which pairs a valid pattern makes."""
    if choice.name.value != "random":
        return False
    formulas = [formula_of(entry.value, constants.findings) for entry in choice.settings.entries]
    return any(formula is not None and known(constants.scalar(formula), 0.0) for formula in formulas)


def _settings(name: str, choice: Choice, findings: Findings) -> dict[str, Formula]:
    """The formulas of the settings; each of them has to be there."""
    allowed = PATTERNS[name].settings
    entries = settings_of(choice.settings, allowed, "setting", f"'{name}' has no settings", findings)
    for missing in [setting for setting in allowed if setting not in entries][:1]:
        message = f"'{name}' needs a {missing}"
        findings.error("missing-key", choice.name.span, message, f"write {PATTERNS[name].use}")
    formulas = {setting: formula_of(entry.value, findings) for setting, entry in entries.known().items()}
    return {setting: formula for setting, formula in formulas.items() if formula is not None}


@dataclass(frozen=True)
class _Sized:
    """A pattern with settings, which are checked before anything is made."""

    name: str
    span: Span
    settings: Mapping[str, Formula]
    constants: Constants

    def values(self) -> dict[str, float]:
        """What the settings are, without those invalid."""
        found = {setting: self._value(setting, formula) for setting, formula in self.settings.items()}
        return {setting: value for setting, value in found.items() if value is not UNKNOWN}

    def _value(self, setting: str, formula: Formula) -> float | Unknown:
        least = PATTERNS[self.name].settings[setting].least
        if least is not None:
            value = self.constants.integer(formula, f"a {setting}", least)
            if setting != "degree" or value is UNKNOWN or not value % 2:
                return value
            self._too_many("degree", f"a degree is even, half of it on each side of the ring; this is {value}")
            return UNKNOWN
        share = self.constants.scalar(formula, structural=True)
        if share is UNKNOWN or 0 <= share <= 1:
            return share
        self._too_many(setting, f"a probability lies between 0 and 1, this is {share:g}")
        return UNKNOWN

    def _too_many(self, setting: str, message: str) -> None:
        self.constants.findings.error("out-of-range", self.settings[setting].span, message)

    def pairs(
        self, values: Mapping[str, float], ends: Ends, stream: Stream, fits: Callable[[int], bool]
    ) -> Pairs | None:
        """The pairs; None, and a finding, where the settings do not fit the ends."""
        n, m = len(ends.sources), len(ends.targets)
        least = least_pairs(self.name, n, m, values)
        if self.name == "random":
            return random(ends, values["probability"], stream) if fits(least) else None
        if self.name == "band":
            return band(ends, min(int(values["width"]), max(n, m))) if fits(least) else None
        if self.name == "small_world":
            degree = int(values["degree"])
            if degree > n - 1:
                self._too_many("degree", f"a degree of {degree} where each has {plural(n - 1, 'neighbour')}")
                return None
            return small_world(ends, degree, values["rewire"], stream) if fits(least) else None
        return self._counted(int(values["count"]), ends, stream, fits)

    def _counted(self, count: int, ends: Ends, stream: Stream, fits: Callable[[int], bool]) -> Pairs | None:
        by_target = self.name == "fixed_indegree"
        turned = ends.reversed() if by_target else ends
        there = len(turned.targets) - bool((turned.excluded() >= 0).any())
        if count > there:
            from_, to = ("target", "source") if by_target else ("source", "target")
            itself = " but itself" if there < len(turned.targets) else ""
            self._too_many("count", f"a count of {count} where a {from_} has {plural(there, to)}{itself}")
            return None
        if not fits(count * len(turned.sources)):
            return None
        if self.name == "nearest":
            return nearest(ends, count) if self._placed(ends) else None
        return (fixed_indegree if by_target else fixed_outdegree)(ends, count, stream)

    def _placed(self, ends: Ends) -> bool:
        """Whether all neurons have a position, or none; a finding where some have."""
        places = np.concatenate((ends.source_places, ends.target_places))
        known = np.isfinite(places).all(axis=1)
        if known.all() or not known.any():
            return True
        message = "'nearest' goes by position, and some neurons of these ends have none"
        self.constants.findings.error("no-position", self.span, message, "give all of them a 'position', or none")
        return False
