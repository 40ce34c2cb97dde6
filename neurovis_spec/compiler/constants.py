"""Constants: formulas evaluated while a network is compiled.

In: formulas (with their places), parameters, and what else a place makes known (``i``, ``n``, …). Out: floats or
arrays, or findings at the very character. ``used`` notes on which parameters something of the structure depends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.network import FloatArray, IntArray
from neurovis_spec.diagnostics import Findings, suggest
from neurovis_spec.language.expressions.arrays import Drawing, evaluate_array
from neurovis_spec.language.expressions.parser import ExpressionError, parse
from neurovis_spec.language.expressions.tree import Draw, Name, Tree, names, walk
from neurovis_spec.language.located import Formula

Value: TypeAlias = float | FloatArray

#: Names that an expression may always use, besides dt.
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}
#: Names that no parameter may have (§6).
RESERVED = frozenset({"t", "k", "dt", "i", "j", "n", "pi", "e"})


def parse_formula(
    formula: Formula,
    known: Iterable[str],
    findings: Findings,
    *,
    random: bool = False,
    functions: Mapping[str, int] | None = None,
    what: str = "known here",
) -> Tree | None:
    """The tree of a formula whose names are all known; else findings at the characters at fault."""
    from neurovis_spec.language.expressions.tree import Number

    if not isinstance(formula.value, str):
        return Number(float(formula.value))
    try:
        tree = parse(formula.value, random=random, extra_functions=functions or {})
    except ExpressionError as error:
        findings.error(error.code, formula.node.at(error.start, error.end), error.message, error.hint)
        return None
    known = tuple(known)
    unknown = [node for node in walk(tree) if isinstance(node, Name) and node.name not in known]
    for node in unknown:
        place = formula.node.at(node.start, node.end)
        findings.error("unknown-name", place, f"unknown name '{node.name}'", suggest(node.name, known, what))
    return None if unknown else tree


@dataclass(frozen=True, slots=True)
class Randomness:
    """Where the numbers of a formula are drawn from: a stream and the counters i, j of each value."""

    stream: Stream
    i: int | IntArray
    j: int | IntArray = 0


@dataclass
class Constants:
    """Evaluates formulas over the parameters of one spec."""

    parameters: dict[str, float]
    dt: float
    findings: Findings
    #: parameter → the parameters that its own formula uses
    uses: dict[str, frozenset[str]] = field(default_factory=dict)
    structural: set[str] = field(default_factory=set)
    #: parameters whose own formulas are at fault: no follow-up findings about these
    broken: set[str] = field(default_factory=set)

    def value(
        self,
        formula: Formula,
        extra: Mapping[str, Value] | None = None,
        randomness: Randomness | None = None,
        structural: bool = False,
    ) -> Value | None:
        """The value of a formula: a float, or an array where ``extra`` or the draws hold arrays."""
        extra = extra or {}
        if not isinstance(formula.value, str):
            return float(formula.value)
        known = (*extra, *self.parameters, *self.broken, *CONSTANTS, "dt")
        tree = parse_formula(formula, known, self.findings, random=randomness is not None)
        if tree is None or names(tree) & self.broken:
            return None
        if structural:
            self.depend(names(tree))
        values: dict[str, Value] = {**self.parameters, **CONSTANTS, "dt": self.dt, **extra}
        result = evaluate_array(tree, values, draw=None if randomness is None else _drawing(randomness))
        if not np.all(np.isfinite(result)):
            shown = f"{result}" if np.ndim(result) == 0 else "not finite everywhere"
            hint = "look for a division by zero, an overflow, or a root or logarithm of a negative number"
            self.findings.error("not-finite", formula.span, f"the value of this expression is {shown}", hint)
            return None
        return float(result) if np.ndim(result) == 0 else np.asarray(result, dtype=np.float64)

    def scalar(self, formula: Formula, structural: bool = False) -> float | None:
        """The value of a formula that is one number."""
        value = self.value(formula, structural=structural)
        return None if value is None else float(value)

    def integer(self, formula: Formula, what: str, least: int, structural: bool = True) -> int | None:
        """The value of a formula that must be an integer of at least ``least``."""
        value = self.scalar(formula, structural=structural)
        if value is None:
            return None
        if value != math.floor(value):
            self.findings.error("not-an-integer", formula.span, f"{what} must be an integer, this is {value:g}")
            return None
        if value < least:
            self.findings.error("out-of-range", formula.span, f"{what} must be at least {least}, this is {int(value)}")
            return None
        return int(value)

    def depend(self, used: Iterable[str]) -> None:
        """Something of the structure depends on these parameters, and so on those behind them."""
        for name in used:
            if name in self.parameters and name not in self.structural:
                self.structural.add(name)
                self.depend(self.uses.get(name, ()))


def _drawing(randomness: Randomness) -> Drawing:
    def draw(node: Draw, first: Value, second: Value) -> Value:
        return randomness.stream.drawn(node.kind, first, second, randomness.i, randomness.j, 0, node.index)

    return draw
