"""Settings of patterns: what the formulas of a pattern come to, for the ends of an entry.

In: a pattern and its settings as written. Out: Values; what is wrong with them is reported where they stand. A count
may be a number of each source or target, a probability one of each pair; the structure depends on all that they read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.connections.ends import counted
from neurovis_spec.compiler.connections.pair_formulas import At, PairFormulas, Rows
from neurovis_spec.compiler.values.constants import NEAR_INTEGER, Constants
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.tree import draws
from neurovis_spec.language.grammar import OF_ENTRY, OF_SOURCE, OF_TARGET, WHICH
from neurovis_spec.language.keys import settings_of
from neurovis_spec.language.located import Formula, formula_of
from neurovis_spec.language.patterns import Pattern
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Choice
from neurovis_spec.language.yaml.source import Node, Scalar, describe

#: The largest count.
_MOST = 2**53
_NO_COUNTS = np.zeros(0, dtype=np.int64)
_COUNTS = (OF_SOURCE, OF_TARGET, OF_ENTRY)


class Values(NamedTuple):
    """The settings of a pattern: ``numbers`` by their names, how many connections each source or each target has, or
    the entry in all, and the probabilities of pairs where these differ."""

    numbers: Mapping[str, float]
    counts: IntArray = _NO_COUNTS
    chances: Rows | None = None
    multapses: bool = False


@dataclass(frozen=True)
class SettingsReader:
    """Reads the settings of a pattern that the author chose. ``stream`` has the random numbers of a purpose."""

    pattern: Pattern
    choice: Choice
    formulas: PairFormulas
    stream: Callable[[str], Stream]
    #: where each setting stands that could be read
    spans: dict[str, Span] = field(default_factory=dict)

    @property
    def _constants(self) -> Constants:
        return self.formulas.constants

    def read(self) -> Values | Unknown:
        """What they are; UNKNOWN where one is invalid or missing. Of an entry whose ends are not known all that can be
        is checked."""
        findings, allowed = self._constants.findings, self.pattern.settings
        none = f"'{self.pattern.name}' has no settings"
        entries = settings_of(self.choice.settings, allowed, "setting", none, findings)
        for missing in [setting for setting in self.pattern.needed if setting not in entries][:1]:
            message = f"'{self.pattern.name}' needs a {missing}"
            findings.error("missing-key", self.choice.name.span, message, f"write {self.pattern.use}")
        flags = {name: _flag(entry.value, findings) for name, entry in entries.known().items() if allowed[name].flag}
        written = {name: entry.value for name, entry in entries.known().items() if not allowed[name].flag}
        formulas = {name: formula_of(node, findings) for name, node in written.items()}
        found = {name: self._value(name, one) for name, one in formulas.items() if one is not UNKNOWN}
        values = Values(
            {name: one for name, one in found.items() if isinstance(one, float)},
            next((one for one in found.values() if isinstance(one, np.ndarray)), _NO_COUNTS),
            next((one for one in found.values() if isinstance(one, Rows)), None),
            flags.get("multapses") is True,
        )
        sound = len(found) == len(self.pattern.needed) and UNKNOWN not in [*flags.values()]
        return values if sound and not any(one is UNKNOWN for one in found.values()) else UNKNOWN

    def _value(self, setting: str, formula: Formula) -> float | IntArray | Rows | Unknown:
        """What one is."""
        self.spans[setting] = formula.span
        role, least = self.pattern.settings[setting].role, self.pattern.settings[setting].least
        if role in _COUNTS:
            return self._counts(formula)
        if role == WHICH:
            if self.formulas.differs(formula, role):
                return self._chances(formula)
            value = self._constants.scalar(formula, structural=True, extra=self.formulas.sizes(role))
        elif least is None:
            value = self._constants.scalar(formula, structural=True)
        else:
            value = self._constants.integer(formula, f"a {setting}", least)
        message = "a probability lies between 0 and 1, this is {:g}"
        valid = value is UNKNOWN or least is not None or 0 <= value <= 1
        if setting == "degree":
            message = "a degree is even, half of it on each side of the ring; this is {}"
            valid = value is UNKNOWN or not value % 2
        if not valid:
            self._constants.findings.error("out-of-range", formula.span, message.format(value))
        return float(value) if valid and value is not UNKNOWN else UNKNOWN

    def _chances(self, formula: Formula) -> Rows | Unknown:
        """The probability of each pair."""
        rows = self.formulas.rows(formula, WHICH)
        if rows is UNKNOWN:
            return UNKNOWN

        def checked(some: slice) -> FloatArray | Unknown:
            values = rows.made(some)
            if values is UNKNOWN or (values.min(initial=0) >= 0 and values.max(initial=0) <= 1):
                return values
            row, j = (int(one[0]) for one in np.nonzero((values < 0) | (values > 1)))
            pair = self.formulas.called(some.start + row, j)
            message = f"a probability lies between 0 and 1, that of {pair} is {values[row, j]:g}"
            self._constants.findings.error("out-of-range", formula.span, message, "write clip(…, 0, 1)")
            return UNKNOWN

        return Rows(checked, rows.n, rows.m)

    def _counts(self, formula: Formula) -> IntArray | Unknown:
        """How many connections each source or target has, or the entry in all; what is drawn is rounded."""
        role, which = self.pattern.settings["count"].role, self._which()
        if not self.formulas.differs(formula, role):
            count = self._constants.integer(formula, "a count", 0, extra=self.formulas.sizes(role))
            return UNKNOWN if count is UNKNOWN or which is UNKNOWN else np.full(which.shape, count, dtype=np.int64)
        values = self.formulas.structural(formula, role, which, self.stream("count"))
        tree = self._constants.tree(formula, role) if values is not UNKNOWN else UNKNOWN
        if values is UNKNOWN or tree is UNKNOWN:
            return UNKNOWN
        whole = np.rint(values)
        far = np.zeros(values.shape, dtype=np.bool_) if draws(tree) else np.abs(values - whole) > NEAR_INTEGER
        wrong = np.flatnonzero(far | (whole < 0) | (whole > _MOST))
        if not len(wrong):
            return whole.astype(np.int64)
        place = int(wrong[0])
        this = f"this is {values[place]:.15g}{self._of(which, place)}"
        told = "not-an-integer", formula.span, f"a count must be an integer, {this}", "write round(…)"
        if not far[place]:
            bound = "at least 0" if values[place] < 0 else f"at most {_MOST:,}"
            told = "out-of-range", formula.span, f"a count must be {bound}, {this}", "write clip(…, 0, …)"
        self._constants.findings.error(*told)
        return UNKNOWN

    def _of(self, which: At | Unknown, place: int) -> str:
        """Of which neuron a count is, for a finding."""
        if which is UNKNOWN or self.pattern.settings["count"].role == OF_ENTRY:
            return ""
        return f" at '{self.formulas.neuron(at_source=which.i is not None, place=place)}'"

    def _which(self) -> At | Unknown:
        """What a count is of: each source, each target, or the entry."""
        role = self.pattern.settings["count"].role
        if self.formulas.sources is UNKNOWN or self.formulas.targets is UNKNOWN:
            return UNKNOWN
        if role == OF_ENTRY:
            return At(counted(1), None)
        if role == OF_SOURCE:
            return At(counted(len(self.formulas.sources)), None)
        return At(None, counted(len(self.formulas.targets)))


def _flag(node: Node, findings: Findings) -> bool | Unknown:
    """true or false."""
    if isinstance(node, Scalar) and isinstance(node.value, bool):
        return node.value
    findings.error("wrong-type", node.span, f"expected true or false, found {describe(node)}")
    return UNKNOWN
