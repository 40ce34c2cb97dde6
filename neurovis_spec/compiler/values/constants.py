"""Constants: formulas evaluated while a network is compiled.

In: formulas (with their places), parameters, and what else a place makes known (``i``, ``n``, …). Out: floats or
arrays, or findings at the very character. ``structural`` holds the parameters on which something of the structure
depends, so that they cannot be set in a run.

**Following.** Where a formula reads a parameter that can be set, the number that it gives has to *follow* it in a run.
So who evaluates formulas also collects the formulas themselves, as Parts (``events/settable.py``)::

    with constants.following() as parts:
        bias = constants.value(formula)                      # 2.0, of "2*g" where g is 1
    # parts == [Part(ParameterFormula(2*g))]; [] where the formula reads no such parameter
    constants.follow(part._replace(field="bias") for part in parts)

``follow`` hands parts on to the ``following`` block around this one: what is inside knows the formula, what is around
it knows which array the number belongs to.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.events.settable import Dependent, ParameterFormula, Part, Slot, slots_named
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.poisson import LARGEST_MEAN
from neurovis_spec.diagnostics import Findings, Home, Undeclared, shorten
from neurovis_spec.language.expressions.evaluate import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, DRAWS, FUNCTIONS, GIVEN, meaning
from neurovis_spec.language.expressions.habits import UNITS, unit_hint
from neurovis_spec.language.expressions.lexer import Naming
from neurovis_spec.language.expressions.mistakes import INSTEAD
from neurovis_spec.language.expressions.parser import ExpressionError, parse, unknown_names
from neurovis_spec.language.expressions.tree import Draw, Number, Tree, draws, names
from neurovis_spec.language.grammar import PLAIN, Role
from neurovis_spec.language.located import Formula, in_unit
from neurovis_spec.language.units import Seconds
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.likeness import suggest

Value: TypeAlias = float | FloatArray
V = TypeVar("V")

#: Names that an expression may always use.
ALWAYS = (*CONSTANTS, "dt")
#: A number before a unit: ``10*ms``.
_FACTOR = re.compile(r"((?:^\s*[+-])?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*\*\s*$")
#: What other languages write for what is at an end of a connection: ``v_pre``.
_END_BEHIND = re.compile(r"(\w+)_(pre|post)", re.ASCII)
#: A number this close to an integer is that integer.
NEAR_INTEGER = 1e-9
_NOT_FINITE = "look for a division by zero, an overflow, or a root or logarithm of a negative number"


@dataclass(frozen=True, slots=True)
class Scope(Collection[str]):
    """Names from several places as one collection, without copying them: there may be many names, and many formulas."""

    parts: tuple[Collection[str], ...]

    def __contains__(self, name: object) -> bool:
        return any(name in part for part in self.parts)

    def __iter__(self) -> Iterator[str]:
        return chain(*self.parts)

    def __len__(self) -> int:
        return sum(map(len, self.parts))


@lru_cache(maxsize=4096)
def _parsed(text: str, random: bool, functions: tuple[tuple[str, int], ...], naming: Naming) -> Tree:
    """The tree of a text. A list may hold the same one a hundred thousand times."""
    return parse(text, random=random, extra_functions=dict(functions), naming=naming)


class Outside(NamedTuple):
    """Parameters around a module or a definition, which does not see them, and what to do about it; {0} is a name."""

    names: Collection[str]
    hint: str


NOTHING_OUTSIDE = Outside((), "")
#: Where a spec declares its parameters.
PARAMETERS = Home((), ("parameters",))


class Sight(NamedTuple):
    """What a formula sees: the ``known`` names, which are ``what`` in the words of a finding, and of connections what
    is at their ``ends``. And what it does not see, and why: names that come ``later``, behind it, and those that are
    ``outside``; ``home`` is where its names are declared."""

    known: Collection[str]
    what: str = "known here"
    later: Collection[str] = ()
    outside: Outside = NOTHING_OUTSIDE
    home: Home = PARAMETERS
    ends: bool = False

    def sees(self, name: str) -> bool:
        """Whether a name means something; those with a point are of ends, and who uses the definition knows more."""
        return name in self.known or (self.ends and "." in name)

    @property
    def of_connections(self) -> bool:
        """Whether it is that of a rule or a synapse, where ``E`` is hardly meant for e: it is a reversal potential."""
        return self.ends and bool(self.home.within)


def parse_formula(
    formula: Formula,
    sight: Sight,
    findings: Findings,
    *,
    random: bool = False,
    functions: Mapping[str, int] | None = None,
    naming: Naming = "",
) -> Tree | Unknown:
    """The tree of a formula whose names are all known; else findings at the invalid characters. ``naming`` says which
    names there may be beside plain ones."""
    known = sight.known
    if formula.value is UNKNOWN:
        return UNKNOWN
    if not isinstance(formula.value, str):
        return Number(float(formula.value))
    try:
        tree = _parsed(formula.value, random, tuple((functions or {}).items()), naming)
    except ExpressionError as error:
        for mistake in (error, *error.others):
            if mistake.code == "draw-not-allowed" and findings.is_invalid(formula.span):
                continue  # a comma has cut it: what it was meant to be is not sure
            place = formula.node.at(mistake.start, mistake.end)
            findings.error(mistake.code, place, mistake.message, mistake.hint)
        used = [use for use in error.used if not sight.sees(use[0])]
    else:
        unused = [name for name in names(tree) if not sight.sees(name)]
        if not unused:
            return tree
        unknown = unknown_names(tree, names(tree).difference(unused))
        used = [(node.name, node.start, node.end) for node in unknown]
    for name, start, end in used:
        few = () if findings.many else [one for one in known if one != "e"] if sight.of_connections else known
        message, hint = _unknown(name, few, functions or {}, sight.what)
        if sight.ends and (meant := _END_BEHIND.fullmatch(name)):
            hint = f"what '{meant[1]}' is at an end of a connection is written {meant[2]}.{meant[1]}"
        elif name in sight.later:
            message, hint = f"'{name}' comes later", "a parameter sees those that are declared before it"
        elif name in sight.outside.names:
            hint = sight.outside.hint.format(name)
        elif name in UNITS and (factor := _FACTOR.search(formula.value, 0, start)):
            hint = unit_hint(factor[1].strip(), name)
        elif sight.of_connections and (hint or "").startswith(sight.what):
            signal = ", or under signals where it is another neuron's" if sight.home.within[0] == "rules" else ""
            hint = f"declare it under parameters{signal}; at the ends of the connection it is pre.{name}, post.{name}"
        lost = Undeclared(name, sight.home)
        findings.error("unknown-name", formula.node.at(start, end), message, hint, undeclared=lost)
    return UNKNOWN


def _unknown(name: str, known: Collection[str], functions: Mapping[str, int], what: str) -> tuple[str, str | None]:
    """The message and the hint for a name that means nothing here."""
    row = FUNCTIONS.get(name) or DRAWS.get(name)
    usage = f"{name}(x)" if name in functions else None if row is None else row.usage
    if usage is not None:
        return f"'{name}' is a function, not a value", f"write {usage}"
    message = f"unknown name '{shorten(name)}'"
    if "." in name:
        return message, "what is at the ends of a connection is known in a run, in formulas of what becomes of it there"
    if name in GIVEN:
        return message, f"'{name}' is known elsewhere: {meaning(name)}"
    close = suggest(name, known, what)
    if name in INSTEAD and not (close or "").startswith("did you mean"):
        return message, INSTEAD[name]
    return message, close


def is_constant(tree: Tree, constants: Collection[str] = ALWAYS) -> bool:
    """Whether a tree holds no name but constants, and draws nothing: its value is known before a run."""
    return names(tree) <= frozenset(constants) and not draws(tree)


def check_finite(value: Value, formula: Formula, findings: Findings) -> bool:
    """Whether a value is finite everywhere; a finding where it is not."""
    if math.isfinite(value) if isinstance(value, float) else np.isfinite(value).all():
        return True
    what = "not finite everywhere" if np.ndim(value) else "undefined" if np.isnan(value) else "infinite"
    findings.error("not-finite", formula.span, f"the value of this expression is {what}", _NOT_FINITE)
    return False


def value_of(tree: Tree | Unknown, values: Mapping[str, Value | Unknown]) -> Value | Unknown:
    """The value of an expression over these names; UNKNOWN where it uses one that is."""
    if tree is UNKNOWN:
        return UNKNOWN
    used = names(tree)
    known = {name: value for name, value in values.items() if name in used and value is not UNKNOWN}
    return evaluate_array(tree, known) if len(known) == len(used) else UNKNOWN


class Randomness(NamedTuple):
    """Where the numbers of a formula are drawn from: a stream and the counters i, j of each value, and ``copy`` where
    several have the same (UNKNOWN in the place of a Randomness: it may draw, and nobody knows what)."""

    stream: Stream
    i: int | Indices
    j: int | Indices = 0
    copy: int | Indices = 0


@dataclass
class Constants:
    """Evaluates formulas over the parameters of one spec. An invalid formula gives UNKNOWN, and so does one that uses a
    name which is UNKNOWN."""

    names: Names[float]
    dt: float
    findings: Findings
    #: parameter → the parameters that its own formula uses
    uses: dict[str, frozenset[str]] = field(default_factory=dict)
    #: the parameters on which a count, a delay or anything else of the structure depends
    structural: set[str] = field(default_factory=set)
    #: the parameters that an instance of a module does not see
    outside: Outside = NOTHING_OUTSIDE
    #: names that formulas read, whatever became of these
    read: set[str] = field(default_factory=set)
    #: the slots of the whole network, one list for the constants of all its instances
    slots: list[Slot] = field(default_factory=list)
    #: the index of the slot of each parameter that can be set in a run, or follows one
    settable: dict[str, int] = field(default_factory=dict)
    #: the path of the instance whose parameters these are; empty for the spec itself
    path: str = ""
    #: where they are declared
    home: Home = PARAMETERS
    #: whether ``dt`` is in order, or left out
    timed: bool = True
    #: the units of the parameters that have one
    units: dict[str, str] = field(default_factory=dict)
    #: the parameters that the instance is given as formulas over those of the scope around it
    settings: Mapping[str, ParameterFormula] = field(default_factory=dict)
    #: the parts of the innermost ``following`` block; None outside of all
    _collected: list[Part] | None = None

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters whose values are known."""
        return self.names.known()

    def declare(
        self,
        name: str,
        tree: Tree | Unknown,
        value: float,
        low: float | Dependent,
        high: float | Dependent,
        given: bool,
    ) -> None:
        """Give a parameter a slot, if it can be set or follows one that can. ``tree`` is its formula, which it follows
        unless its value is ``given`` from outside or it is given another one (``settings``)."""
        own = None if tree is UNKNOWN or not given or self.path else self.bound(tree)
        tree = UNKNOWN if given else tree
        followed = None if tree is UNKNOWN or self.settable.keys().isdisjoint(names(tree)) else self.bound(tree)
        if self.path and name not in self.settings and followed is None:
            return
        slot = Slot(
            name=f"{self.path}.{name}" if self.path else name,
            value=value,
            formula=self.settings.get(name, followed),
            low=low,
            high=high,
            given=given and not self.path,
            own=own,
            unit=self.units.get(name, ""),
        )
        self.settable[name] = len(self.slots)
        self.slots.append(slot)

    @contextmanager
    def following(self) -> Iterator[list[Part]]:
        """Collect a Part for each formula that is evaluated in the block and reads a settable parameter."""
        outer, self._collected = self._collected, []
        try:
            yield self._collected
        finally:
            self._collected = outer

    def follow(self, parts: Iterable[Part]) -> None:
        """Add these parts to those of the innermost ``following`` block."""
        if self._collected is not None:
            self._collected.extend(parts)

    def bound(
        self,
        tree: Tree,
        extra: Mapping[str, Value | Dependent] | None = None,
        randomness: Randomness | None = None,
    ) -> ParameterFormula:
        """An expression, all names of which are known, with what they mean: slots of parameters that can be set, and
        values. ``extra`` goes before the parameters."""
        used = names(tree)
        extra = extra or {}
        slot_of = {name: slot for name, slot in slots_named(tree, self.settable).items() if name not in extra}
        known = self._known(sorted(used - slot_of.keys()), extra)
        draw = None if randomness is None or not draws(tree) else _Drawing(randomness)
        return ParameterFormula(tree, slot_of, known, draw)

    def tree(
        self, formula: Formula, role: Role = PLAIN, what: str = "known here", later: Collection[str] = ()
    ) -> Tree | Unknown:
        """The tree of a formula over the parameters and what it sees, for a caller that evaluates it; else findings.
        ``later`` are parameters that it does not see."""
        known = Scope((role.sees, self.names, ALWAYS))
        sight = Sight(known, what, later, self.outside, self.home, role.ends)
        naming: Naming = "ends" if role.ends else ""
        tree = parse_formula(formula, sight, self.findings, random=role.draws, naming=naming)
        if tree is UNKNOWN:
            return UNKNOWN
        used = names(tree)
        self.read |= used
        own = (name for name in used.difference(role.sees, ALWAYS) if "." not in name)
        return UNKNOWN if any(self.names[name] is UNKNOWN for name in own) else tree

    def unchecked(
        self,
        formula: Formula,
        extra: Mapping[str, Value | Unknown] | None = None,
        randomness: Randomness | Unknown | None = None,
        structural: bool = False,
        places: IntArray | None = None,
    ) -> Value | Unknown:
        """The value of a formula, finite or not: a float, or an array where ``extra`` or the draws hold arrays.
        ``places`` are the indices of the Part that is collected, where the value follows a parameter."""
        if not isinstance(formula.value, str):
            return UNKNOWN if formula.value is UNKNOWN else float(formula.value)
        seen = tuple(extra or ())
        ends = any("." in name for name in seen)
        tree = self.tree(formula, Role("formula", sees=seen, draws=randomness is not None, ends=ends))
        if tree is UNKNOWN:
            return UNKNOWN
        used = names(tree)
        if structural:
            self.depend(used)
        given = {name: value for name, value in (extra or {}).items() if name in used}
        context = {name: value for name, value in given.items() if value is not UNKNOWN}
        if len(context) < len(given) or (randomness is UNKNOWN and draws(tree)):
            return UNKNOWN
        values = self._known(used, context)
        randomness = None if randomness is UNKNOWN else randomness
        drawing = None if randomness is None else _Drawing(randomness)
        result = evaluate_array(tree, values, draw=drawing)
        if drawing is not None and drawing.wrong is not None and np.isnan(result).any():
            self.refuse_draw(formula, *drawing.wrong)
            return UNKNOWN
        if self._collected is not None and not structural and not self.settable.keys().isdisjoint(used):
            self._collected.append(Part(self.bound(tree, context, randomness), places))
        return float(result) if np.ndim(result) == 0 else np.asarray(result, dtype=np.float64)

    def evaluated(self, tree: Tree, extra: Mapping[str, Value]) -> Value:
        """What an expression is that draws nothing and all names of which are known, finite or not."""
        return evaluate_array(tree, self._known(names(tree), extra))

    def _known(self, used: Iterable[str], extra: Mapping[str, V]) -> dict[str, V | float]:
        """What names mean, all of which are known."""
        result: dict[str, V | float] = {}
        for name in used:
            if name in CONSTANTS:
                result[name] = CONSTANTS[name]
            elif name == "dt":
                result[name] = self.dt
            else:
                value = extra[name] if name in extra else self.names[name]
                assert value is not UNKNOWN
                result[name] = value
        return result

    def refuse_draw(self, formula: Formula, draw: Draw, second: float) -> None:
        """The finding about a draw from ``normal`` whose deviation is negative, from ``uniform`` whose upper end is
        below the lower one by ``second``, or from ``poisson`` with what is no mean."""
        place = formula.node.at(draw.second.start, draw.second.end)
        message = f"the deviation of a normal distribution must be at least 0, this is {second:.15g}"
        hint: str | None = "normal(mean, deviation): the mean comes first"
        if draw.kind == "uniform":
            below = f"{-second:.15g}" if second > -math.inf else "far"
            message = f"the upper end of a uniform distribution is {below} below the lower one"
            hint = "uniform(low, high): the lower end comes first"
        if draw.kind == "poisson":
            place = formula.node.at(draw.first.start, draw.first.end)
            message = f"the mean of a Poisson distribution must be from 0 to {LARGEST_MEAN:,.0f}"
            hint = None
        self.findings.error("out-of-range", place, message, hint)

    def value(
        self,
        formula: Formula,
        extra: Mapping[str, Value | Unknown] | None = None,
        randomness: Randomness | Unknown | None = None,
        structural: bool = False,
        places: IntArray | None = None,
    ) -> Value | Unknown:
        """The value of a formula, which must be finite everywhere."""
        result = self.unchecked(formula, extra, randomness, structural, places)
        return result if result is not UNKNOWN and check_finite(result, formula, self.findings) else UNKNOWN

    def scalar(
        self, formula: Formula, structural: bool = False, extra: Mapping[str, Value | Unknown] | None = None
    ) -> float | Unknown:
        """The value of a formula that is one number, as are ``extra``."""
        value = self.value(formula, extra, structural=structural)
        return UNKNOWN if value is UNKNOWN else float(value)

    def integer(
        self,
        formula: Formula,
        what: str,
        least: int,
        most: int = 2**53,
        structural: bool = True,
        extra: Mapping[str, Value | Unknown] | None = None,
    ) -> int | Unknown:
        """The value of a formula that must be an integer from ``least`` to ``most``."""
        value = self.scalar(formula, structural, extra)
        if value is UNKNOWN:
            return UNKNOWN
        nearest = round(value)
        if abs(value - nearest) > NEAR_INTEGER:  # 0.0003/dt is an integer up to rounding
            self.findings.error("not-an-integer", formula.span, f"{what} must be an integer, this is {value:.15g}")
            return UNKNOWN
        value = nearest
        if not least <= value <= most:
            bound = f"at least {least}" if value < least else f"at most {most:,}"
            self.findings.error("out-of-range", formula.span, f"{what} must be {bound}, this is {value:.15g}")
            return UNKNOWN
        return int(value)

    def measured(self, name: str, formula: Formula) -> Formula:
        """What a parameter is set to; where that has a unit it is a number in the parameter's own."""
        return in_unit(formula, self.units.get(name, ""), self.findings)

    def steps(self, formula: Formula, what: str, least: int, most: int = 2**53) -> int | Unknown:
        """How many steps something takes, an integer from ``least`` to ``most``: as it is written, or as a time, which
        must be a whole number of steps."""
        if isinstance(formula.value, Seconds):
            if not self.timed:
                return UNKNOWN
            steps = formula.value / self.dt
            if abs(steps - round(steps)) > NEAR_INTEGER:
                message = f"{what} is a whole number of steps, this is {steps:.15g}"
                hint = f"a step is {self.dt:.12g} s long"
                self.findings.error("not-an-integer", formula.span, message, hint)
                return UNKNOWN
            formula = formula._replace(value=round(steps))
        return self.integer(formula, what, least, most)

    def depend_on(self, parts: Iterable[Part]) -> None:
        """Note that something of the structure depends on the parameters, of those that are declared here, that these
        numbers follow."""
        slots = frozenset[int]().union(*(part.formula.slots for part in parts))
        self.depend([name for name, slot in self.settable.items() if slot in slots])

    def depend(self, used: Iterable[str]) -> None:
        """Note that something of the structure depends on these parameters, and so on those that they follow."""
        waiting = list(used)
        while waiting:
            name = waiting.pop()
            if name in self.names and name not in self.structural:
                self.structural.add(name)
                waiting += self.uses.get(name, ())


class _Drawing:
    """Draws the numbers of one formula, and keeps the first draw that is impossible: its width is negative.

    Such a number is NaN, so that it counts only where the formula's value depends on it: a branch that is not taken may
    have such a draw.
    """

    def __init__(self, randomness: Randomness) -> None:
        self.randomness = randomness
        #: the first such draw, and its least width
        self.wrong: tuple[Draw, float] | None = None

    def __call__(self, node: Draw, first: Value, second: Value) -> Value:
        width = width_of(node, first, second)
        wrong = np.less(width, 0)
        if self.wrong is None and wrong.any():
            self.wrong = node, float(np.nanmin(width))
        stream, i, j, copy = self.randomness
        drawn = stream.drawn(node.kind, first, second, (i, j, copy, node.index))
        return np.where(wrong, np.nan, drawn) if wrong.any() else drawn


def width_of(draw: Draw, first: Value, second: Value) -> Value:
    """How wide a distribution is, which must not be negative: the deviation, or from the lower end to the upper; of
    ``poisson`` how far the mean is inside of what it may be."""
    if draw.kind == "poisson":
        return np.minimum(first, LARGEST_MEAN - first)
    return second if draw.kind == "normal" else second - first
