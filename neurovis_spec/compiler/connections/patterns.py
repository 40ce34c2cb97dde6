"""Patterns: which pairs of two ends are connected.

In: the neurons of both ends, by index, and a pattern with its settings. Out: positions (i, j) of the pairs within
the ends, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.compiler.connections.ends import Ends, Pairs, counted
from neurovis_spec.compiler.connections.patterns_drawn import fixed_indegree, fixed_outdegree, small_world
from neurovis_spec.compiler.connections.patterns_near import band, in_band, nearest
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.values.arguments import check_settings
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.keys import settings_of
from neurovis_spec.language.located import Formula, formula_of
from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Choice
from neurovis_spec.likeness import did_you_mean, meant, suggest


def all_to_all(ends: Ends) -> Pairs:
    """Every source with every target."""
    n, m = len(ends.sources), len(ends.targets)
    return ends.pairs(np.repeat(counted(n), m), np.tile(counted(m), n))


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
    """Every pair with a probability; drawn row by row by geometric gaps."""
    return ends.pairs(*stream.random_pairs(len(ends.sources), len(ends.targets), probability))


#: The settings of a pattern.
Values: TypeAlias = Mapping[str, float]


class _Misfit(NamedTuple):
    """Why a pattern cannot be made between two ends: one of its settings, or (None) the pattern as such."""

    message: str
    setting: str | None = None
    code: str = "out-of-range"
    hint: str | None = None


class _Recipe(NamedTuple):
    """How a pattern is made: at ``least`` how many pairs it has of n sources and m targets (some of which may connect a
    neuron to itself), the pairs themselves, whether its settings fit the ends, and whether these are ``equal`` in
    size, and whether each pair is drawn by itself, so that of a symmetric entry one direction counts alone."""

    least: Callable[[int, int, Values], int]
    make: Callable[[Ends, Values, Stream], Pairs]
    misfit: Callable[[Ends, Values], _Misfit | None] = lambda ends, values: None
    equal: bool = False
    alone: bool = False


def _least_random(n: int, m: int, values: Values) -> int:
    """In one case in a million there are fewer; once made, the pairs are counted again."""
    probability = values["probability"]
    return max(0, int(n * m * probability - 5 * (n * m * probability * (1 - probability)) ** 0.5))


def _count_misfit(ends: Ends, values: Values, of: str, others: str) -> _Misfit | None:
    """Each of the sources wants as many others as ``count`` says."""
    count, there = int(values["count"]), len(ends.targets) - bool((ends.excluded() >= 0).any())
    if count <= there:
        return None
    itself = " but itself" if there < len(ends.targets) else ""
    return _Misfit(f"a count of {count} where a {of} has {plural(there, others)}{itself}", "count")


def _nearest_misfit(ends: Ends, values: Values) -> _Misfit | None:
    """All neurons have a position, or none."""
    places = np.concatenate((ends.source_places, ends.target_places))
    known = np.isfinite(places).all(axis=1)
    if known.all() or not known.any():
        return _count_misfit(ends, values, "source", "target")
    message = "'nearest' goes by position, and some neurons of these ends have none"
    return _Misfit(message, None, "no-position", "give all of them a 'position', or none")


def _degree_misfit(ends: Ends, values: Values) -> _Misfit | None:
    degree, others = int(values["degree"]), len(ends.sources) - 1
    message = f"a degree of {degree} where each has {plural(others, 'neighbour')}"
    return _Misfit(message, "degree") if degree > others else None


def _width(n: int, m: int, values: Values) -> int:
    return min(int(values["width"]), max(n, m))


RECIPES: Final[Mapping[str, _Recipe]] = {
    "all_to_all": _Recipe(lambda n, m, values: n * m, lambda ends, values, stream: all_to_all(ends)),
    "one_to_one": _Recipe(lambda n, m, values: n, lambda ends, values, stream: one_to_one(ends), equal=True),
    "chain": _Recipe(lambda n, m, values: n, lambda ends, values, stream: chain(ends), equal=True),
    "ring": _Recipe(lambda n, m, values: n, lambda ends, values, stream: ring(ends), equal=True),
    "random": _Recipe(
        _least_random, lambda ends, values, stream: random(ends, values["probability"], stream), alone=True
    ),
    "fixed_indegree": _Recipe(
        lambda n, m, values: int(values["count"]) * m,
        lambda ends, values, stream: fixed_indegree(ends, int(values["count"]), stream),
        lambda ends, values: _count_misfit(ends.reversed(), values, "target", "source"),
        alone=True,
    ),
    "fixed_outdegree": _Recipe(
        lambda n, m, values: int(values["count"]) * n,
        lambda ends, values, stream: fixed_outdegree(ends, int(values["count"]), stream),
        lambda ends, values: _count_misfit(ends, values, "source", "target"),
        alone=True,
    ),
    "nearest": _Recipe(
        lambda n, m, values: int(values["count"]) * n,
        lambda ends, values, stream: nearest(ends, int(values["count"])),
        _nearest_misfit,
    ),
    "small_world": _Recipe(
        lambda n, m, values: int(values["degree"]) * n,
        lambda ends, values, stream: small_world(ends, int(values["degree"]), values["rewire"], stream),
        _degree_misfit,
        equal=True,
        alone=True,
    ),
    "band": _Recipe(
        lambda n, m, values: max(0, in_band(n, m, _width(n, m, values)) - min(n, m)),
        lambda ends, values, stream: band(ends, _width(len(ends.sources), len(ends.targets), values)),
    ),
}


#: What other languages call patterns.
_ELSEWHERE: Final[Mapping[str, str]] = {
    **dict.fromkeys(("full", "fully_connected", "dense", "complete"), "all_to_all"),
    **dict.fromkeys(("identity", "diagonal", "pairwise"), "one_to_one"),
    **dict.fromkeys(("bernoulli", "sparse", "erdos_renyi"), "random"),
    "watts_strogatz": "small_world",
}


def pairs_of(
    choice: Choice, ends: Ends | Unknown, constants: Constants, stream: Stream, fits: Callable[[int], bool]
) -> Pairs | Unknown:
    """The pairs of a pattern as the author wrote it; UNKNOWN where it is invalid, which is reported, or where
    the ends are not known.

    ``fits`` says, before they are made, whether there is room for so many.
    """
    findings = constants.findings
    written, span = choice.name.value, choice.name.span
    name = written if written in PATTERNS else meant(written, PATTERNS)
    if written not in PATTERNS:
        elsewhere = _ELSEWHERE.get(written.casefold())
        hint = suggest(written, PATTERNS, "patterns") if elsewhere is None else did_you_mean([elsewhere])
        findings.error("unknown-pattern", span, f"there is no pattern '{shorten(written)}'", hint)
    if name is None:
        check_settings(choice, constants)
        return UNKNOWN
    recipe, formulas = RECIPES[name], _settings(name, choice, findings)
    found = {setting: _value(name, setting, formula, constants) for setting, formula in formulas.items()}
    values = {setting: value for setting, value in found.items() if value is not UNKNOWN}
    if ends is UNKNOWN:
        return UNKNOWN
    n, m = len(ends.sources), len(ends.targets)
    if n != m and recipe.equal:
        message = f"'{name}' needs ends of equal size; these have {n} and {m} neurons"
        findings.error("wrong-size", span, message)
        return UNKNOWN
    if len(values) < len(PATTERNS[name].settings) or name != written:
        return UNKNOWN
    misfit = recipe.misfit(ends, values)
    if misfit is not None:
        place = span if misfit.setting is None else formulas[misfit.setting].span
        findings.error(misfit.code, place, misfit.message, misfit.hint)
        return UNKNOWN
    if values.get("count") == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    return recipe.make(ends, values, stream) if fits(recipe.least(n, m, values)) else UNKNOWN


def drawn_alone(choice: Choice) -> bool:
    """Whether a pattern draws each of its pairs by itself."""
    recipe = RECIPES.get(choice.name.value)
    return recipe is not None and recipe.alone


def empty_reason(choice: Choice, constants: Constants) -> tuple[str, str] | None:
    """Why a valid pattern may make no pair at all, and what to do: chance decides, or it is told to make none. None
    where that follows from the ends alone."""
    for entry in choice.settings.entries:
        formula = formula_of(entry.value, constants.findings)
        value = UNKNOWN if formula is UNKNOWN else constants.scalar(formula)
        if entry.name == "probability" and value is not UNKNOWN and value > 0:
            return "this entry draws no connection at all", "another seed, or a larger probability, draws some"
        if entry.name in ("probability", "count") and value is not UNKNOWN:
            return f"with a {entry.name} of 0 this entry makes no connection at all", f"give it a larger {entry.name}"
    return None


def _settings(name: str, choice: Choice, findings: Findings) -> dict[str, Formula]:
    """The formulas of the settings; each of them has to be there."""
    allowed = PATTERNS[name].settings
    entries = settings_of(choice.settings, allowed, "setting", f"'{name}' has no settings", findings)
    for missing in [setting for setting in allowed if setting not in entries][:1]:
        message = f"'{name}' needs a {missing}"
        findings.error("missing-key", choice.name.span, message, f"write {PATTERNS[name].use}")
    formulas = {setting: formula_of(entry.value, findings) for setting, entry in entries.known().items()}
    return {setting: formula for setting, formula in formulas.items() if formula is not UNKNOWN}


def _value(name: str, setting: str, formula: Formula, constants: Constants) -> float | Unknown:
    """What a setting is; UNKNOWN where it is invalid, which is reported."""
    least = PATTERNS[name].settings[setting].least
    if least is None:
        value = constants.scalar(formula, structural=True)
        message = "a probability lies between 0 and 1, this is {:g}"
        valid = value is UNKNOWN or 0 <= value <= 1
    else:
        value = constants.integer(formula, f"a {setting}", least)
        message = "a degree is even, half of it on each side of the ring; this is {}"
        valid = value is UNKNOWN or setting != "degree" or not value % 2
    if not valid:
        constants.findings.error("out-of-range", formula.span, message.format(value))
    return value if valid else UNKNOWN
