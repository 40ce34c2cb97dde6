"""The unit of a formula: what follows from those of the names in it, and what does not fit.

In: a tree, the units of names, the unit that is wanted. Out: the unit, None where nothing is known of it; noted are
parts that do not fit what is around them, and names that must have a certain unit, since no other fits.

A number that is written has any unit: of ``0.04*v^2`` nothing follows. So has the 1 that nobody writes in front of
``sigmoid(x)``, or of a comparison: by itself such a value has any, a factor of it is a number. How units go through a
function stands in its row (``functions.py``).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from typing import Final, NamedTuple

from neurovis_spec.language.expressions.functions import FUNCTIONS, OPERATORS, Passing
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Draw,
    Name,
    Number,
    Tree,
    Unary,
    Visitor,
)
from neurovis_spec.language.units import NUMBER, Unit

#: How units go through what gives a number.
_NUMBERS: Final[frozenset[Passing]] = frozenset({"number", "compared", "sign"})
#: Exponents that are written are fractions of at most this.
_FINEST: Final = 12


class Misfit(NamedTuple):
    """A part of a formula that is in ``found`` where ``wanted`` is wanted: by the parts ``beside`` it, or else by the
    ``function`` that it is an argument of."""

    part: Tree
    found: Unit
    wanted: Unit
    beside: tuple[Tree, ...] = ()
    function: str = ""


class Read(NamedTuple):
    """What follows of a formula: its unit, where it is known; what does not fit; and the units that names must have."""

    unit: Unit | None
    misfits: list[Misfit]
    deduced: dict[str, Unit]


def read_units(tree: Tree, known: Mapping[str, Unit], free: Collection[str] = (), wanted: Unit | None = None) -> Read:
    """What follows of a formula from the units that are ``known``, and from that which is ``wanted`` of it. ``free``
    are names that may be given one. What is at fault has no unit to what is around it, so that it is told once.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> from neurovis_spec.language.units import spelled, unit_of
    >>> known = {"g": unit_of("nS"), "v": unit_of("mV"), "E": unit_of("mV")}
    >>> made = read_units(parse("g*(E - v) + w"), known, ["w"])
    >>> spelled(made.unit), spelled(made.deduced["w"]), made.misfits
    ('pA', 'pA', [])
    >>> [spelled(misfit.found) for misfit in read_units(parse("exp(v) + g*E - v"), known).misfits]
    ['mV', 'mV']
    """
    reader = _Reader(known, free)
    return Read(reader.part(tree, wanted), reader.misfits, reader.deduced)


class _Quiet(Visitor[Unit | None]):
    """The unit of a formula, whatever does not fit in it: of parts that should have the same that of the most."""

    def __init__(self, known: Mapping[str, Unit]) -> None:
        self.known = known
        self.wanted: Unit | None = None
        #: the units of parts, by their identity: they are asked for at each level above them
        self.memo: dict[int, Unit | None] = {}

    def quiet(self, tree: Tree) -> Unit | None:
        """The unit of a part, by its own parts alone."""
        if id(tree) not in self.memo:
            self.memo[id(tree)] = self.of(tree)
        return self.memo[id(tree)]

    def part(self, tree: Tree, wanted: Unit | None = None) -> Unit | None:
        """The unit of a part of which this one is wanted."""
        return self.quiet(tree)

    def number(self, node: Number) -> Unit | None:
        return None

    def name(self, node: Name) -> Unit | None:
        return self.known.get(node.name)

    def negative(self, operand: Tree) -> Unit | None:
        return self.part(operand, self.wanted)

    def negation(self, operand: Tree) -> Unit | None:
        self.part(operand)
        return None

    def square(self, base: Tree) -> Unit | None:
        return self._power(base, Fraction(2))

    def comparison(self, node: Binary) -> Unit | None:
        return self._passed(OPERATORS[node.operator].units, node.parts)

    def logic(self, node: Chain) -> Unit | None:
        return self._passed(OPERATORS[node.operators[0]].units, node.parts)

    def arithmetic(self, node: Chain) -> Unit | None:
        if all(OPERATORS[sign].units == "same" for sign in node.operators):
            return self.alike(node.operands, self.wanted)
        if "%" in node.operators:  # among factors: of the whole nothing follows
            for part in node.operands:
                self.part(part)
            return None
        return self._product(node)

    def conditional(self, node: Conditional) -> Unit | None:
        wanted = self.wanted
        self.part(node.condition)
        return self.alike((node.then, node.otherwise), wanted)

    def call(self, node: Call) -> Unit | None:
        function = FUNCTIONS.get(node.function)
        if function is None:  # of the place, f: nothing is known of it
            for part in node.arguments:
                self.part(part)
            return None
        if function.units == "power":
            return self._to_the(*node.arguments)
        return self._passed(function.units, node.arguments, node.function)

    def draw(self, node: Draw) -> Unit | None:
        return self.alike(node.parts, self.wanted)

    def alike(self, parts: tuple[Tree, ...], wanted: Unit | None) -> Unit | None:
        """The unit of parts that should have the same one: the one that is wanted, if some part has it, else that of
        the most."""
        return self._common(parts, wanted)

    def _common(self, parts: tuple[Tree, ...], wanted: Unit | None) -> Unit | None:
        found = [unit for unit in map(self.quiet, parts) if unit is not None]
        return wanted if wanted in found else max(found, key=found.count, default=None)

    def _passed(self, passing: Passing, arguments: tuple[Tree, ...], function: str = "") -> Unit | None:
        """The unit of an operation on these arguments."""
        wanted = self.wanted
        match passing:
            case "same":
                return self.alike(arguments, wanted)
            case "compared":
                self.alike(arguments, None)
            case "root":
                unit = self.part(arguments[0], None if wanted is None else wanted**2)
                return None if unit is None else unit ** Fraction(1, 2)
            case "number":
                for part in arguments:
                    self.plain(part, function)
            case _:
                for part in arguments:
                    self.part(part)
        return None

    def plain(self, part: Tree, function: str) -> Unit | None:
        """The unit of an argument that should be a number."""
        return self.part(part, NUMBER)

    def _to_the(self, base: Tree, exponent: Tree) -> Unit | None:
        """The unit of a power: with an exponent that is not written that of a number alone is known."""
        negative = isinstance(exponent, Unary) and exponent.operator == "-"
        written = exponent.operand if isinstance(exponent, Unary) else exponent
        if isinstance(written, Number) and written.value:
            power = Fraction(written.value).limit_denominator(_FINEST)
            return self._power(base, -power if negative else power)
        self.plain(exponent, "^")
        return NUMBER if self.part(base) == NUMBER else None

    def _power(self, base: Tree, exponent: Fraction) -> Unit | None:
        wanted = self.wanted
        unit = self.part(base, None if wanted is None or not exponent else wanted ** (1 / exponent))
        return None if unit is None else unit**exponent

    def _product(self, node: Chain) -> Unit | None:
        """The unit of a product. Where that of one factor alone is not known, it follows from what is wanted."""
        wanted = self.wanted
        powers = [1, *(-1 if OPERATORS[sign].units == "quotient" else 1 for sign in node.operators)]
        factors = [*zip(node.operands, powers, strict=True)]
        bare = [_is_number(part) for part in node.operands]
        quiet = [
            NUMBER if number else None if (unit := self.quiet(part)) is None else unit**power
            for (part, power), number in zip(factors, bare, strict=True)
        ]
        made: Unit | None = NUMBER
        for number, (part, power) in enumerate(factors):
            rest = wanted
            for other in (*quiet[:number], *quiet[number + 1 :]):
                rest = None if rest is None or other is None else rest / other
            unit = self.part(part, None if rest is None or bare[number] else rest**power)
            unit = NUMBER if bare[number] else unit
            made = None if made is None or unit is None else made * unit**power
        return None if made == NUMBER and any(bare) else made


def _is_number(tree: Tree) -> bool:
    """Whether a part is a number whatever its own parts are in, as the value of exp or of a comparison."""
    match tree:
        case Unary(operator="-" | "+", operand=operand):
            return _is_number(operand)
        case Unary():
            return True
        case Call(function=name):
            return name in FUNCTIONS and FUNCTIONS[name].units in _NUMBERS
        case Binary(operator=sign):
            return sign != "^" and OPERATORS[sign].units in _NUMBERS
        case Chain(operators=(sign, *_)):
            return OPERATORS[sign].units in _NUMBERS
        case _:
            return False


class _Reader(_Quiet):
    """Goes through a formula from the whole to its parts, each with what is wanted of it, and notes what there is."""

    def __init__(self, known: Mapping[str, Unit], free: Collection[str]) -> None:
        super().__init__(known)
        self.free = free
        self.misfits: list[Misfit] = []
        self.deduced: dict[str, Unit] = {}
        self._quietly = _Quiet(known)

    def quiet(self, tree: Tree) -> Unit | None:
        return self._quietly.quiet(tree)

    def part(self, tree: Tree, wanted: Unit | None = None) -> Unit | None:
        before, self.wanted = self.wanted, wanted
        unit = self.of(tree)
        self.wanted = before
        return unit

    def name(self, node: Name) -> Unit | None:
        unit = self.known.get(node.name)
        if unit is None and self.wanted is not None and node.name in self.free:
            self.deduced.setdefault(node.name, self.wanted)
        return unit

    def alike(self, parts: tuple[Tree, ...], wanted: Unit | None) -> Unit | None:
        common = self._common(parts, wanted)
        wanted = common or wanted
        units = [self.part(part, wanted) for part in parts]
        odd = [(part, unit) for part, unit in zip(parts, units, strict=True) if unit not in (None, wanted)]
        for part, unit in odd[:1]:
            beside = tuple(one for one in parts if self.quiet(one) == wanted)
            assert unit is not None
            assert wanted is not None
            self.misfits.append(Misfit(part, unit, wanted, beside))
        return None if odd or all(unit is None for unit in units) else common

    def plain(self, part: Tree, function: str) -> Unit | None:
        unit = self.part(part, NUMBER)
        if unit not in (None, NUMBER):
            assert unit is not None
            self.misfits.append(Misfit(part, unit, NUMBER, function=function))
        return unit
