"""Patterns: which pairs of two ends are connected.

In: the neurons of both ends, by index, and a pattern with its settings. Out: positions (i, j) of the pairs within
the ends, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray, width
from neurovis_spec.compiler.connections.ends import Ends, Pairs, counted
from neurovis_spec.compiler.connections.pair_formulas import PairFormulas, Rows
from neurovis_spec.compiler.connections.pattern_settings import SettingsReader, Values
from neurovis_spec.compiler.connections.patterns_drawn import fixed_indegree, fixed_outdegree, small_world, total
from neurovis_spec.compiler.connections.patterns_near import band, in_band, nearest
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.values.arguments import check_settings
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.located import formula_of
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
    probability = values.numbers.get("probability", 0)
    return max(0, int(n * m * probability - 5 * (n * m * probability * (1 - probability)) ** 0.5))


def _least_counted(n: int, m: int, values: Values) -> int:
    return int(values.counts.sum(dtype=np.float64))  # there may be more than an integer of 64 bits holds


def _count_misfit(ends: Ends, values: Values, of: str, others: str) -> _Misfit | None:
    """Each of the sources wants as many others as its count says."""
    itself = ends.excluded() >= 0
    there = len(ends.targets) - itself
    allowed = np.where(there > 0, np.inf, 0) if values.multapses else there
    wrong = np.flatnonzero(values.counts > allowed)
    if not len(wrong):
        return None
    first = wrong[0]
    but = " but itself" if itself[first] else ""
    message = f"a count of {values.counts[first]} where a {of} has {plural(int(there[first]), others)}{but}"
    return _Misfit(message, "count")


def _total_misfit(ends: Ends, values: Values) -> _Misfit | None:
    there = len(ends.sources) * len(ends.targets) - int((ends.excluded() >= 0).sum())
    if values.counts[0] <= there or (values.multapses and there):
        return None
    hint = "multapses: true connects a pair several times" if there else None
    return _Misfit(f"a count of {values.counts[0]} where there are {plural(there, 'pair')}", "count", hint=hint)


def _nearest_misfit(ends: Ends, values: Values) -> _Misfit | None:
    """All neurons have a position, or none."""
    places = np.concatenate((ends.source_places, ends.target_places))
    known = np.isfinite(places).all(axis=1)
    if known.all() or not known.any():
        return _count_misfit(ends, values, "source", "target")
    message = "'nearest' goes by position, and some neurons of these ends have none"
    return _Misfit(message, None, "no-position", "give all of them a 'position', or none")


def _degree_misfit(ends: Ends, values: Values) -> _Misfit | None:
    degree, others = int(values.numbers["degree"]), len(ends.sources) - 1
    message = f"a degree of {degree} where each has {plural(others, 'neighbour')}"
    return _Misfit(message, "degree") if degree > others else None


def _width(n: int, m: int, values: Values) -> int:
    return min(int(values.numbers["width"]), max(n, m))


RECIPES: Final[Mapping[str, _Recipe]] = {
    "all_to_all": _Recipe(lambda n, m, values: n * m, lambda ends, values, stream: all_to_all(ends)),
    "one_to_one": _Recipe(lambda n, m, values: n, lambda ends, values, stream: one_to_one(ends), equal=True),
    "chain": _Recipe(lambda n, m, values: n, lambda ends, values, stream: chain(ends), equal=True),
    "ring": _Recipe(lambda n, m, values: n, lambda ends, values, stream: ring(ends), equal=True),
    "random": _Recipe(
        _least_random, lambda ends, values, stream: random(ends, values.numbers["probability"], stream), alone=True
    ),
    "fixed_indegree": _Recipe(
        _least_counted,
        lambda ends, values, stream: fixed_indegree(ends, values.counts, stream, values.multapses),
        lambda ends, values: _count_misfit(ends.reversed(), values, "target", "source"),
        alone=True,
    ),
    "fixed_outdegree": _Recipe(
        _least_counted,
        lambda ends, values, stream: fixed_outdegree(ends, values.counts, stream, values.multapses),
        lambda ends, values: _count_misfit(ends, values, "source", "target"),
        alone=True,
    ),
    "total": _Recipe(
        _least_counted,
        lambda ends, values, stream: total(ends, int(values.counts[0]), stream, values.multapses),
        _total_misfit,
        alone=True,
    ),
    "nearest": _Recipe(
        _least_counted,
        lambda ends, values, stream: nearest(ends, values.counts),
        _nearest_misfit,
    ),
    "small_world": _Recipe(
        lambda n, m, values: int(values.numbers["degree"]) * n,
        lambda ends, values, stream: small_world(ends, int(values.numbers["degree"]), values.numbers["rewire"], stream),
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
    **dict.fromkeys(("bernoulli", "pairwise_bernoulli", "sparse", "erdos_renyi"), "random"),
    **dict.fromkeys(("fixed_total_number", "fixed_number"), "total"),
    "watts_strogatz": "small_world",
}


def pairs_of(
    choice: Choice,
    ends: Ends | Unknown,
    formulas: PairFormulas,
    stream: Callable[[str], Stream],
    fits: Callable[[int], bool],
) -> Pairs | Unknown:
    """The pairs of a pattern as the author wrote it; UNKNOWN where it is invalid, which is reported, or where
    the ends are not known.

    ``stream`` has the random numbers of a purpose; ``fits`` says, before they are made, whether there is room for so
    many.
    """
    findings = formulas.constants.findings
    written, span = choice.name.value, choice.name.span
    name = written if written in PATTERNS else meant(written, PATTERNS)
    if written not in PATTERNS:
        elsewhere = _ELSEWHERE.get(written.casefold())
        hint = suggest(written, PATTERNS, "patterns") if elsewhere is None else did_you_mean([elsewhere])
        findings.error("unknown-pattern", span, f"there is no pattern '{shorten(written)}'", hint)
    if name is None:
        check_settings(choice, formulas.constants)
        return UNKNOWN
    recipe, settings = RECIPES[name], SettingsReader(PATTERNS[name], choice, formulas, stream)
    values = settings.read()
    if ends is UNKNOWN:
        return UNKNOWN
    n, m = len(ends.sources), len(ends.targets)
    if n != m and recipe.equal:
        message = f"'{name}' needs ends of equal size; these have {n} and {m} neurons"
        findings.error("wrong-size", span, message)
        return UNKNOWN
    if values is UNKNOWN or name != written:
        return UNKNOWN
    misfit = recipe.misfit(ends, values)
    if misfit is not None:
        place = span if misfit.setting is None else settings.spans[misfit.setting]
        findings.error(misfit.code, place, misfit.message, misfit.hint)
        return UNKNOWN
    if values.chances is not None:
        return _of_blocks(ends, values.chances, stream("edges").chosen, fits)
    if "count" in PATTERNS[name].settings and not recipe.least(n, m, values):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    return recipe.make(ends, values, stream("edges")) if fits(recipe.least(n, m, values)) else UNKNOWN


def pairs_where(ends: Ends, condition: Rows, fits: Callable[[int], bool]) -> Pairs | Unknown:
    """The pairs of which a condition holds."""

    def holds(rows: IntArray, values: FloatArray) -> Pairs:
        row, target = np.nonzero(values)
        return row, target

    return _of_blocks(ends, condition, holds, fits)


def _of_blocks(
    ends: Ends,
    numbers: Rows,
    chosen: Callable[[IntArray, FloatArray], Pairs],
    fits: Callable[[int], bool],
) -> Pairs | Unknown:
    """Of all pairs, of which there are ``numbers``, those ``chosen`` by them: the indices of their rows, of some at a
    time, and their targets."""
    kind = width(-1, max(numbers.n, numbers.m))
    i, j = [np.empty(0, dtype=kind)], [np.empty(0, dtype=kind)]
    count = 0
    for rows, values in numbers.blocks():
        if values is UNKNOWN:
            return UNKNOWN
        row, target = chosen(rows, values)
        found = ends.pairs(rows[row].astype(kind), target.astype(kind))
        count += len(found[0])
        if not fits(count):
            return UNKNOWN
        i.append(found[0])
        j.append(found[1])
    return np.concatenate(i), np.concatenate(j)


def drawn_alone(choice: Choice) -> bool:
    """Whether a pattern draws each of its pairs by itself."""
    recipe = RECIPES.get(choice.name.value)
    return recipe is not None and recipe.alone


def empty_reason(choice: Choice, formulas: PairFormulas) -> tuple[str, str] | None:
    """Why a valid pattern may make no pair at all, and what to do: chance decides, or it is told to make none. None
    where that follows from the ends alone."""
    constants, settings = formulas.constants, PATTERNS[choice.name.value].settings
    for entry in choice.settings.entries:
        if entry.name not in ("probability", "count"):
            continue
        formula, role = formula_of(entry.value, constants.findings), settings[entry.name].role
        if formula is UNKNOWN:
            return None
        drawn = formulas.differs(formula, role)
        value = UNKNOWN if drawn else constants.scalar(formula, extra=formulas.sizes(role))
        if entry.name == "probability" and (drawn or (value is not UNKNOWN and value > 0)):
            return "this entry draws no connection at all", "another seed, or a larger probability, draws some"
        return f"with a {entry.name} of 0 this entry makes no connection at all", f"give it a larger {entry.name}"
    return None
