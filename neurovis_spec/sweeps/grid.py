"""The grid of a sweep: which values each parameter takes, and the points that they make.

In: ``0.001:0.1:log20``, ``0..9``, ``1,2,5``, or numbers. Out: an Axis for each name; the points, the last name varying
first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, TypeAlias

import numpy as np

from neurovis_spec import arguments
from neurovis_spec.language.units import UnitError, measured, number_in

Number: TypeAlias = int | float
Point: TypeAlias = tuple[Number, ...]
#: The values of each name of a grid, as a caller gives them.
Over: TypeAlias = Mapping[str, str | Iterable[Number | str]]
#: The unit of a parameter, "" where it has none.
UnitOf: TypeAlias = Callable[[str], str]

#: The axis that is no parameter.
SEED: Final = "seed"
FORMS: Final = "a:b:N (N numbers evenly from a to b), a:b:logN (by equal factors), a..b (integers) or a,b,c"
_MOST: Final = 10_000_000
_INTEGERS: Final = re.compile(r"\s*([+-]?[0-9]+)\s*\.\.\s*([+-]?[0-9]+)\s*")
_COUNT: Final = re.compile(r"\s*(log)?\s*([0-9]{1,9})\s*")
_INTEGER: Final = re.compile(r"\s*[+-]?[0-9]+\s*")


class SweepError(ValueError):
    """A sweep that cannot be made; ``hint`` says what to do."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        self.hint = hint
        super().__init__(message)


@dataclass(frozen=True)
class Axis:
    """A name and the values that it takes, in order."""

    name: str
    values: Point


def _no_unit(name: str) -> str:
    return ""


def axis(name: str, values: str | Iterable[Number | str], unit_of: UnitOf = _no_unit) -> Axis:
    """The values of a name, from a text or as they are; those that are written with a unit in that of the parameter.
    Raises SweepError."""
    if isinstance(values, str):
        found = _of_text(name, values, unit_of)
    else:
        given = arguments.several(name, values, "a range or numbers")
        found = tuple(_plain(name, value, unit_of) for value in given)
    if not found:
        raise SweepError(f"'{name}' has no value")
    wrong = next((value for value in found if not math.isfinite(value)), None)
    if wrong is not None:
        raise SweepError(f"'{name}': {wrong} is no finite number")
    if len(set(found)) < len(found):
        twice = next(value for place, value in enumerate(found) if value in found[:place])
        raise SweepError(f"'{name}' takes the value {twice} twice")
    if name == SEED:
        wrong = next((value for value in found if value != int(value)), None)
        if wrong is not None:
            raise SweepError(f"the seed is an integer, not {wrong}", "write 0..9 for ten of them")
        found = tuple(map(int, found))
    return Axis(name, found)


def axes(over: Over, unit_of: UnitOf = _no_unit) -> tuple[Axis, ...]:
    """The axes of a grid, in the order given; ``unit_of`` says which unit a parameter has. Raises SweepError."""
    arguments.mapping("over", over)
    found = tuple(axis(name, values, unit_of) for name, values in (over or {}).items())
    if not found:
        raise SweepError("a sweep is over one name at least", f"as in eta=0.1:0.5:5; a range is {FORMS}")
    if math.prod(len(one.values) for one in found) > _MOST:
        raise SweepError(f"this grid has more than {_MOST:,} points")
    return found


def points(grid: Sequence[Axis]) -> list[Point]:
    """All points: the values of the last axis vary first.

    >>> points([axis("a", "1,2"), axis("seed", "0..1")])
    [(1, 0), (1, 1), (2, 0), (2, 1)]
    """
    return list(product(*(one.values for one in grid)))


def number(text: str) -> Number:
    """A number as it is written: an integer stays one. Raises ValueError."""
    if "_" in text:
        raise ValueError(text)
    return int(text) if _INTEGER.fullmatch(text) else float(text)


def _plain(name: str, value: object, unit_of: UnitOf) -> Number:
    if isinstance(value, str) and measured(value) is not None:
        return _number(name, value, unit_of)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise SweepError(f"'{name}' takes numbers, not {value!r}")
    return int(value) if isinstance(value, int | np.integer) else float(value)


def _of_text(name: str, text: str, unit_of: UnitOf) -> Point:
    if match := _INTEGERS.fullmatch(text):
        low, high = int(match[1]), int(match[2])
        if low > high:
            raise SweepError(f"'{name}': the range {text.strip()} runs backwards")
        _bounded(name, high - low + 1)
        return tuple(range(low, high + 1))
    if ":" in text:
        return _spread(name, text, unit_of)
    return tuple(_number(name, part, unit_of) for part in text.split(","))


def _spread(name: str, text: str, unit_of: UnitOf) -> Point:
    """``a:b:N`` and ``a:b:logN``."""
    parts = text.split(":")
    count = _COUNT.fullmatch(parts[-1])
    if len(parts) != 3 or count is None:
        raise SweepError(f"'{name}': '{text}' is no range", f"a range is {FORMS}")
    low, high = (_number(name, part, unit_of) for part in parts[:2])
    number = int(count[2])
    if number < 2:
        raise SweepError(f"'{name}': a range has two numbers or more, its ends")
    _bounded(name, number)
    if count[1] and not (low > 0 and high > 0):
        raise SweepError(f"'{name}': a range by equal factors is of numbers above 0")
    spread = np.geomspace(low, high, number) if count[1] else np.linspace(low, high, number)
    return tuple(float(value) for value in spread)


def _number(name: str, text: str, unit_of: UnitOf) -> Number:
    written = measured(text)
    unit = "" if written is None else unit_of(name)
    try:
        return number_in(unit, written) if written is not None and unit else number(text)
    except UnitError as error:
        raise SweepError(f"'{name}': {error}") from None
    except ValueError:
        raise SweepError(f"'{name}': '{text.strip()}' is no number", f"a range is {FORMS}") from None


def _bounded(name: str, count: int) -> None:
    if count > _MOST:
        raise SweepError(f"'{name}' takes more than {_MOST:,} values")
