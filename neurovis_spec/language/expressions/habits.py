"""Numbers as they are written elsewhere: with thousands apart, with units. What to write instead.

In: what stands where a number is wanted. Out: a help line with the number worked out, or None.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Final

from neurovis_spec.diagnostics import shorten

_GROUPED: Final = re.compile(r"([+-]?)([1-9][0-9]{0,2}(?:([,_' .\u00a0\u202f’])[0-9]{3})(?:\3[0-9]{3})*)")
#: Units of time as others write them, in seconds.
SECONDS: Final[Mapping[str, float]] = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "µs", "μs", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("hour", "hours"), 3600.0),
}
_DEGREES: Final = frozenset({"deg", "degree", "degrees", "°"})
_PLAIN: Final = frozenset({
    "V", "mV", "uV", "µV", "nA", "pA", "uA", "µA", "mA", "nS", "pS", "uS", "µS", "mS", "Hz", "kHz", "pF", "nF", "uF",
    "µF", "MOhm", "kOhm", "Ohm", "ohm", "Ω", "mm", "um", "µm", "cm", "rad",
})  # fmt: skip
#: A number and what may be its unit.
_WITH_UNIT: Final = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*([^\W\d]\w*|[°%])\s*")
#: Keys that take a time with its unit, those in steps alone, and those that are no times.
_TIMED: Final = frozenset({"dt", "delay", "at", "from", "to"})
_IN_STEPS: Final = frozenset({"steps"})
_NO_TIMES: Final = frozenset({"bias", "initial", "weight"})
#: Units that are no likely names.
UNITS: Final = frozenset({*SECONDS, *_DEGREES, *_PLAIN})


def ungrouped(text: str) -> str | None:
    """A number without what sets its thousands apart; None where it has no such thing. With points it may be another
    number, unless there are several.

    >>> ungrouped("10,000"), ungrouped("-1_000_000"), ungrouped("1.000.000"), ungrouped("10.000"), ungrouped("0,500")
    ('10000', '-1000000', '1000000', None, None)
    """
    match = _GROUPED.fullmatch(text.strip())
    if match is None or (match[3] == "." and match[2].count(".") < 2):
        return None
    return match[1] + match[2].replace(match[3], "")


def ungrouped_hint(text: str) -> str | None:
    """The help line for such a number.

    >>> ungrouped_hint("10,000"), ungrouped_hint("1,234")
    ('write 10000', 'write 1234; if the comma is a decimal one, 1.234')
    """
    digits = ungrouped(text)
    if digits is None:
        return None
    decimal = text.count(",") == 1 and not text.strip().endswith("000")
    return f"write {shorten(digits)}" + (
        f"; if the comma is a decimal one, {text.strip().replace(',', '.')}" if decimal else ""
    )


def unit_of(text: str) -> tuple[str, str] | None:
    """A number and what may be its unit, of which a text consists.

    >>> unit_of("0.1 ms"), unit_of("0.1*ms")
    (('0.1', 'ms'), None)
    """
    match = _WITH_UNIT.fullmatch(text)
    return None if match is None else (match[1], match[2])


def unit_hint(number: str, unit: str, key: str | None = None) -> str | None:
    """The help line for a number with a unit behind it; ``key`` is the key that it is the value of.

    >>> unit_hint("5", "ms")[23:]
    'write 0.005 where seconds are wanted, 0.005/dt where steps are, 5 in a model with time: ms'
    >>> unit_hint("-65", "mV"), unit_hint("2", "feet")
    ('numbers have no units: write -65', None)
    >>> unit_hint("0.1", "ms", "dt"), unit_hint("5", "s", "steps")
    ('a blank stands before a unit: write 0.1 ms', "'steps' counts steps: write 5/dt")
    """
    if unit in UNITS and math.isinf(float(number)):
        return "numbers have no units, and end near 1.8e308"
    if unit in SECONDS:
        seconds = f"{float(number) * SECONDS[unit]:.12g}"
        if key in _TIMED:
            return f"a blank stands before a unit: write {number} {unit}"
        if key in _IN_STEPS:
            return f"'{key}' counts steps: write {seconds}/dt"
        if key in _NO_TIMES:
            return f"numbers have no units: write {number}"
        hint = f"numbers have no units: write {seconds} where seconds are wanted, {seconds}/dt where steps are"
        return f"{hint}, {float(number) * SECONDS[unit] * 1e3:.12g} in a model with time: ms"
    if unit in _DEGREES:
        return f"angles are in radians: write {number}*pi/180"
    if unit == "%" and math.isfinite(float(number)):
        return f"write {float(number) / 100:.12g}"
    return f"numbers have no units: write {number}" if unit in _PLAIN else None
