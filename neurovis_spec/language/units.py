"""Units: numbers with one behind them, ``1.5 ms``, ``-65 mV``, and what they are made of.

In: a text, and the unit that is wanted. Out: the number in that unit. The number is moved by powers of ten (or by 60)
before it becomes one of 64 bits, so that it is rounded once: ``2.3 us`` is 2.3e-6, to the bit. A Unit is what formulas
are checked by (``expressions/dimensions.py``); no number of a run has one.
"""

from __future__ import annotations

import math
import operator
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import listed, shorten
from neurovis_spec.language.expressions.habits import SECONDS

#: Units of time, in seconds.
TIMES: Final[Mapping[str, Fraction]] = {
    "s": Fraction(1),
    "ms": Fraction(1, 10**3),
    "us": Fraction(1, 10**6),
    "min": Fraction(60),
}
#: What units are made of: powers of ten and of sixty (min), and quantities.
_AXES: Final = ("10", "60", "V", "A", "s", "m", "mol", "rad")
#: Powers of ten beyond this are no factors.
_MOST_POWERS: Final = 300
#: What to say of units of time.
TIME_ABOUTS: Final[Mapping[str, str]] = {
    "s": "Seconds.", "ms": "Milliseconds.", "us": "Microseconds.", "min": "Minutes.",
}  # fmt: skip
#: What a unit may begin with, as powers of ten.
_PREFIXES: Final[Mapping[str, int]] = {
    "": 0, "f": -15, "p": -12, "n": -9, "u": -6, "μ": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9,
}  # fmt: skip
#: Words that stand between numbers.
_WORDS: Final = frozenset({"if", "else", "and", "or", "not"})
#: A decimal, a blank, a unit.
_WRITTEN: Final = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)[ ]+((?:1/)?[^\W\d_][\w^/*·.⁻-]*|[°%])\s*"
)


class UnitError(ValueError):
    """A unit that there is not, or that does not fit; ``hint`` says what to do."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        self.hint = hint
        super().__init__(message)


class Seconds(float):
    """A time as it was written with a unit."""

    __slots__ = ()


class Measured(NamedTuple):
    """A number as it is written, and the unit behind it."""

    number: str
    unit: str

    def times(self, factor: Fraction) -> float:
        """The number times a factor, rounded once. Raises UnitError where that is no finite number."""
        try:
            result = float(Fraction(self.number) * factor)
        except OverflowError:
            result = math.inf
        if not math.isfinite(result):
            raise UnitError(f"'{self.number} {self.unit}' is beyond what numbers reach")
        return result


def measured(text: str) -> Measured | None:
    """A number with a unit, of which a text consists; None where it is something else.

    >>> measured("1.5 ms"), measured("1.5*ms"), measured("x if y else z")
    (Measured(number='1.5', unit='ms'), None, None)
    >>> measured("2 1/s")
    Measured(number='2', unit='1/s')
    """
    match = _WRITTEN.fullmatch(text)
    return None if match is None or match[2] in _WORDS else Measured(match[1], match[2])


def seconds_of(written: Measured) -> Seconds:
    """A time in seconds. Raises UnitError.

    >>> seconds_of(Measured("2.3", "us")), seconds_of(Measured("1", "min"))
    (2.3e-06, 60.0)
    """
    factor = TIMES.get(written.unit)
    if factor is None:
        raise UnitError(f"'{shorten(written.unit)}' is no unit of time", _hint(written.unit))
    return Seconds(written.times(factor))


def _hint(unit: str) -> str:
    """What to write for a unit of time that there is not."""
    seconds = SECONDS.get(unit, SECONDS.get(unit.casefold()))
    right = next((own for own, factor in TIMES.items() if float(factor) == seconds), None)
    return f"write {right}" if right is not None else f"units of time: {listed(TIMES)}"


def number_in(wanted: str, written: Measured) -> float:
    """A number in the unit that is wanted. Raises UnitError where the units do not fit.

    >>> number_in("ms", Measured("0.02", "s")), number_in("nS/cm2", Measured("3", "nS/cm²"))
    (20.0, 3.0)
    """
    if wanted == written.unit:
        return written.times(Fraction(1))
    own, other = unit_of(wanted), unit_of(written.unit)
    factor = None if own is None or other is None else (other / own).factor
    if factor is None:
        message = f"expected a value in {shorten(wanted)}, found '{written.number} {shorten(written.unit)}'"
        raise UnitError(message, f"a number without a unit is in {shorten(wanted)}")
    return written.times(factor)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit that is made of ours: how often each of the axes is in it."""

    powers: tuple[Fraction, ...]

    def __mul__(self, other: Unit) -> Unit:
        return Unit(tuple(map(operator.add, self.powers, other.powers)))

    def __truediv__(self, other: Unit) -> Unit:
        return Unit(tuple(map(operator.sub, self.powers, other.powers)))

    def __pow__(self, exponent: Fraction | int) -> Unit:
        return self if exponent == 1 else Unit(tuple(power * exponent for power in self.powers))

    @property
    def is_scale(self) -> bool:
        """Whether it is a mere factor, as that between units of the same kind is."""
        return not any(self.powers[2:])

    @property
    def factor(self) -> Fraction | None:
        """The factor that it is; None where it is none, or is no fraction that a number can hold."""
        tens, sixties = self.powers[:2]
        if not self.is_scale or tens.denominator != 1 or sixties.denominator != 1:
            return None
        if abs(tens) + 2 * abs(sixties) > _MOST_POWERS:  # 60 is less than 10^2
            return None
        return Fraction(10) ** tens.numerator * Fraction(60) ** sixties.numerator

    @property
    def to_formulas(self) -> Unit:
        """The same as formulas take it: an angle is a number."""
        return Unit((*self.powers[:-1], Fraction(0)))


def _made(**powers: int) -> Unit:
    """``_made(A=1, V=-1)`` is S; ``tens`` and ``sixties`` are powers of these."""
    given = {"10": powers.pop("tens", 0), "60": powers.pop("sixties", 0), **powers}
    return Unit(tuple(Fraction(given.get(axis, 0)) for axis in _AXES))


#: What has no unit.
NUMBER: Final = _made()
#: That of a time where no other is said.
SECOND: Final = _made(s=1)
#: Units that take prefixes; of one kind that by which results are told comes first.
_BASES: Final[Mapping[str, Unit]] = {
    "V": _made(V=1), "A": _made(A=1), "S": _made(A=1, V=-1), "F": _made(A=1, s=1, V=-1), "s": SECOND,
    "C": _made(A=1, s=1), "ohm": _made(V=1, A=-1), "Ohm": _made(V=1, A=-1), "Ω": _made(V=1, A=-1), "m": _made(m=1),
    "mol": _made(mol=1), "M": _made(tens=3, mol=1, m=-3), "W": _made(V=1, A=1), "J": _made(V=1, A=1, s=1),
    "N": _made(V=1, A=1, s=1, m=-1), "Pa": _made(V=1, A=1, s=1, m=-3), "g": _made(tens=-3, V=1, A=1, s=3, m=-2),
    "Hz": _made(s=-1), "L": _made(tens=-3, m=3), "rad": _made(rad=1),
}  # fmt: skip
#: Units without.
_WHOLE: Final[Mapping[str, Unit]] = {
    "min": _made(sixties=1, s=1),
    "1": NUMBER,
    "10": _made(tens=1),
    "60": _made(sixties=1),
}
#: A factor of a unit: how it is joined to those before it, what it is, and how often it is there.
_FACTOR: Final = re.compile(r"([*·. ]|/|^)(10|60|1(?!\d)|[^\W\d_]+)(?:\^(-?\d{1,2}(?:\.\d{1,2})?)|(-?\d))?")


@lru_cache(maxsize=1024)
def unit_of(text: str) -> Unit | None:
    """A unit as it is written, made of ours; None where it is another one, which is but a label.

    >>> unit_of("nS*mV") == unit_of("pA"), unit_of("uA/cm^2") == unit_of("µA/cm²"), unit_of("spikes")
    (True, True, None)
    """
    text = unicodedata.normalize("NFKC", text).replace("\N{MINUS SIGN}", "-").strip()
    result, at = NUMBER, 0
    while at < len(text):
        match = _FACTOR.match(text, at)
        one = None if match is None else _base(match[2])
        if match is None or one is None:
            return None
        power = Fraction(match[3] or match[4] or 1)
        result = result / one**power if match[1] == "/" else result * one**power
        at = match.end()
    return result if text else None


def _base(name: str) -> Unit | None:
    """A unit by its name, which may have a prefix."""
    found = _WHOLE.get(name, _BASES.get(name))
    power = _PREFIXES.get(name[:1])
    if found is not None or power is None or name[1:] not in _BASES:
        return found
    return _BASES[name[1:]] * _made(tens=power)


#: By what results are told that are no multiple of a unit: such a one by that.
_PER: Final = ("ms", "s", "cm^2", "ms^0.5", "s^0.5", "ms^2", "s^2", "mV", "um", "m")


def spelled(unit: Unit, words: Iterable[str] = ()) -> str:
    """How a unit is written: by one of these ``words`` where one of them is it, else in ours.

    >>> made = unit_of("nS*mV/s")
    >>> spelled(made), spelled(made, ["pA"]), spelled(unit_of("nS*mV")), spelled(NUMBER), spelled(unit_of("V/mV"))
    ('fA/ms', 'pA/s', 'pA', '1', '10^3')
    """
    if unit == NUMBER:
        return "1"
    known = {word: found.to_formulas for word in words if (found := unit_of(word)) is not None}
    for word, one in known.items():
        if one == unit:
            return word
    pers = () if unit.is_scale else _PER  # a factor is not told by units, as in s/ms
    for per in pers[:5]:
        for word, one in known.items():
            if unit == one / _unit(per) and "/" not in word:
                return f"{word}/{per}"
    plain = _by_one()
    if unit in plain:
        return plain[unit]
    for per in pers:
        if (whole := unit * _unit(per)) in plain:
            return f"{plain[whole]}/{per}"
    axes = [f"{axis}^{power}" if power != 1 else axis for axis, power in zip(_AXES, unit.powers, strict=True) if power]
    return "·".join(axes)


@cache
def _by_one() -> Mapping[Unit, str]:
    """How units are told that are a multiple of one, and a number."""
    found: dict[Unit, str] = {NUMBER: "1"}
    for name, base in _BASES.items():
        for prefix, power in _PREFIXES.items() if name not in ("Hz", "rad") else ():
            found.setdefault(base * _made(tens=power), prefix + name)
    return found


def _unit(text: str) -> Unit:
    """One of ours."""
    found = unit_of(text)
    assert found is not None
    return found
