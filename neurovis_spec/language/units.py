"""Numbers with a unit behind them: ``1.5 ms``, ``-65 mV``. The only place where a unit is more than a label.

In: a text, and the unit that is wanted. Out: the number in that unit. The number is moved by powers of ten (or by 60)
before it becomes one of 64 bits, so that it is rounded once: ``2.3 us`` is 2.3e-6, to the bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
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
#: What a unit may begin with, as powers of ten.
_PREFIXES: Final[Mapping[str, int]] = {
    "": 0, "f": -15, "p": -12, "n": -9, "u": -6, "µ": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9,
}  # fmt: skip
#: Units that take them.
_BASES: Final = ("s", "V", "A", "S", "F", "C", "N", "Pa", "m", "g", "M", "mol", "Hz", "J", "W", "ohm", "Ohm", "Ω")
#: Words that stand between numbers.
_WORDS: Final = frozenset({"if", "else", "and", "or", "not"})
#: A decimal, a blank, a unit.
_WRITTEN: Final = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)[ ]+((?:1/)?[^\W\d_][\w^/*·.-]*|[°%])\s*"
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

    >>> number_in("ms", Measured("0.02", "s")), number_in("nS/cm2", Measured("3", "nS/cm2"))
    (20.0, 3.0)
    """
    if wanted == written.unit:
        return written.times(Fraction(1))
    own, other = _split(wanted), _split(written.unit)
    if own is None or other is None or own.base != other.base:
        raise UnitError(f"expected a value in {shorten(wanted)}, found '{written.number} {shorten(written.unit)}'")
    return written.times(other.factor / own.factor)


class _Split(NamedTuple):
    """A unit as a factor and what it is a multiple of."""

    factor: Fraction
    base: str


def _split(unit: str) -> _Split | None:
    """A unit that is a multiple of one of ours; None where it is another one."""
    if unit in TIMES:
        return _Split(TIMES[unit], "s")
    if unit in _BASES:
        return _Split(Fraction(1), _base(unit))
    power = _PREFIXES.get(unit[:1])
    return None if power is None or unit[1:] not in _BASES else _Split(Fraction(10) ** power, _base(unit[1:]))


def _base(unit: str) -> str:
    return "ohm" if unit in ("Ohm", "Ω") else unit
