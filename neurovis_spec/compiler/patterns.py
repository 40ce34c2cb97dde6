"""Patterns: which pairs of two ends are connected.

In: the neurons of both ends, by index, and a pattern with its settings. Out: positions (i, j) of the pairs within
the ends, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from neurovis_spec.compiler.constants import Constants
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.network import IntArray
from neurovis_spec.diagnostics import suggest
from neurovis_spec.language.located import formula_of, shown
from neurovis_spec.language.values import Choice

Pairs: TypeAlias = tuple[IntArray, IntArray]

#: Patterns of the language that this version does not read yet.
LATER = ("fixed_indegree", "fixed_outdegree", "nearest", "small_world", "band")


@dataclass(frozen=True)
class Ends:
    """The neurons of both ends, in the order of the reference, and whether a neuron may connect to itself, where the
    author says so."""

    sources: IntArray
    targets: IntArray
    loops: bool | None = None

    def pairs(self, i: IntArray, j: IntArray, loops: bool = False) -> Pairs:
        """The pairs, without a neuron's connection to itself unless that is allowed (by ``loops`` where nothing is
        said)."""
        if not (loops if self.loops is None else self.loops):
            keep = self.sources[i] != self.targets[j]
            i, j = i[keep], j[keep]
        return i, j


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
PATTERNS = (*_FIXED, "random")


def pairs_of(
    choice: Choice, ends: Ends, constants: Constants, stream: Stream, fits: Callable[[int], bool]
) -> Pairs | None:
    """The pairs of a pattern as the author wrote it; None where it is at fault, which is noted.

    ``fits`` says, before they are made, whether there is room for so many.
    """
    findings = constants.findings
    name = choice.name.value
    span = choice.name.span
    allowed = ("probability",) if name == "random" else ()
    if name in LATER:
        findings.error("unsupported", span, f"the pattern '{name}' is not read by this version yet")
        return None
    if name not in PATTERNS:
        hint = suggest(name, PATTERNS, "patterns")
        findings.error("unknown-pattern", span, f"there is no pattern '{shown(name)}'", hint)
        return None
    for entry in choice.settings:
        if entry.name not in allowed:
            hint = suggest(entry.name, allowed, "known here") or f"'{name}' has no settings"
            findings.error("unknown-parameter", entry.key.span, f"there is no setting '{shown(entry.name)}'", hint)
            return None
    if name != "random":
        n, m = len(ends.sources), len(ends.targets)
        if name != "all_to_all" and n != m:
            message = f"'{name}' needs ends of equal size; these have {n} and {m} neurons"
            findings.error("wrong-size", span, message)
            return None
        return _FIXED[name](ends) if fits(n * m if name == "all_to_all" else n) else None
    return _random(choice, ends, constants, stream, fits)


def _random(
    choice: Choice, ends: Ends, constants: Constants, stream: Stream, fits: Callable[[int], bool]
) -> Pairs | None:
    findings = constants.findings
    if not choice.settings:
        message = "'random' needs a probability"
        findings.error("missing-key", choice.name.span, message, "write {random: {probability: 0.1}}")
        return None
    formula = formula_of(choice.settings[0].value, findings)
    probability = None if formula is None else constants.scalar(formula, structural=True)
    if formula is None or probability is None:
        return None
    if not 0 <= probability <= 1:
        findings.error("out-of-range", formula.span, f"a probability lies between 0 and 1, this is {probability:g}")
        return None
    n, m = len(ends.sources), len(ends.targets)
    # So many there are at the least, but for one case in a million; who has made them is asked again.
    least = n * m * probability - 5 * (n * m * probability * (1 - probability)) ** 0.5
    return random(ends, probability, stream) if fits(max(0, int(least))) else None
