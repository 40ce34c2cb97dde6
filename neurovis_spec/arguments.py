"""Who calls the Python interface: arguments are checked where they come in, warnings are about the caller's line.

In: what an argument is called, and a value; the call stack. Out: the value as the type that is wanted; else a TypeError
or a ValueError that names the argument, rather than an error from deep within. A ``stacklevel``.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping
from inspect import currentframe
from pathlib import Path
from typing import SupportsFloat, SupportsIndex, TypeVar

import numpy as np

#: The most steps of a run: beyond it a step is no number that a double can hold.
MOST_STEPS = 1 << 53

Kind = TypeVar("Kind")
Item = TypeVar("Item")


def text(name: str, value: object) -> str:
    """A text."""
    return instance(name, value, str, "a text")


def path(name: str, value: object) -> Path:
    """A path that a file could have.

    >>> path("path", 3)
    Traceback (most recent call last):
    TypeError: 'path' is a path, not int
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(plain := os.fspath(value), str):
        raise _wrong(name, "a path", value)
    if "\0" in plain:
        raise ValueError(f"'{name}' holds a NUL character, which no path does")
    return Path(plain)


def body(value: object) -> bool | Path:
    """Which body a network has: that of its spec (True), none (False), or that of a file."""
    return value if isinstance(value, bool) else path("body", value)


def integer(name: str, value: object, least: int | None = None, most: int | None = None) -> int:
    """An integer from ``least`` to ``most``.

    >>> integer("limit", -5, least=0)
    Traceback (most recent call last):
    ValueError: 'limit' is at least 0, not -5
    """
    if isinstance(value, bool) or not isinstance(value, SupportsIndex):
        raise _wrong(name, "an integer", value)
    try:
        whole = operator.index(value)
    except TypeError:  # an array of several
        raise _wrong(name, "an integer", value) from None
    if least is not None and whole < least:
        raise ValueError(f"'{name}' is at least {least}, not {_shown(whole)}")
    if most is not None and whole > most:
        raise ValueError(f"'{name}' is at most {most}, not {_shown(whole)}")
    return whole


def number(name: str, value: object) -> float:
    """A number, which may be NaN or infinite."""
    if isinstance(value, bool | np.bool_ | str | bytes | bytearray):
        raise _wrong(name, "a number", value)
    if not isinstance(value, SupportsFloat | SupportsIndex):
        raise _wrong(name, "a number", value)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise _wrong(name, "a number", value) from None
    except OverflowError:
        raise ValueError(f"'{name}' is beyond what a double can hold") from None


def finite(value: object) -> float | None:
    """A number that a double can hold; None where it is none, as texts, truth values and lists are."""
    try:
        result = number("value", value)
    except (TypeError, ValueError):
        return None
    return result if math.isfinite(result) else None


def truth(name: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise _wrong(name, "True or False", value)
    return bool(value)


def mapping(name: str, value: object) -> Mapping[str, object]:
    """A mapping whose keys are texts; None is an empty one."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise _wrong(name, "a mapping", value)
    return {text(f"{name}: key", key): item for key, item in value.items()}


def texts(name: str, value: object, what: str = "a text or several") -> tuple[str, ...]:
    """One text, or several."""
    if isinstance(value, str):
        return (value,)
    if not isinstance(value, Iterable):
        raise _wrong(name, what, value)
    return tuple(text(name, one) for one in value)


def several(name: str, values: Iterable[Item], what: str) -> Iterable[Item]:
    """Values one after the other."""
    if not isinstance(values, Iterable):
        raise _wrong(name, what, values)
    return values


def pair(name: str, value: object) -> tuple[object, object]:
    """Two values."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise _wrong(name, "a pair", value)
    values: tuple[object, ...] = tuple(value)
    if len(values) != 2:
        raise ValueError(f"'{name}' is a pair, not {len(values)} values")
    return values[0], values[1]


def instance(name: str, value: object, kind: type[Kind], what: str) -> Kind:
    """A value of this kind."""
    if not isinstance(value, kind):
        raise _wrong(name, what, value)
    return value


def function(name: str, value: object) -> None:
    """Refuse what cannot be called; None is no function and fine."""
    if value is not None and not callable(value):
        raise _wrong(name, "a function", value)


def _wrong(name: str, what: str, value: object) -> TypeError:
    return TypeError(f"'{name}' is {what}, not {type(value).__name__}")


def _shown(whole: int) -> str:
    """An integer of any length."""
    return str(whole) if abs(whole) < 10**15 else f"about {'-' if whole < 0 else ''}2^{whole.bit_length() - 1}"


class CodedWarning(UserWarning):
    """A warning of a run that has its page in the catalogue: ``code`` is what ``neurovis explain`` takes."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


def callers_level() -> int:
    """The ``stacklevel`` by which ``warnings.warn``, called where this is called, points at the line that called this
    package."""
    frame, level = currentframe(), 0
    while frame is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] == "neurovis_spec":
        frame, level = frame.f_back, level + 1
    return level
