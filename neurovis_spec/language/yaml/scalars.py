"""Plain scalars: what an unquoted YAML text stands for.

In: the characters of a plain scalar. Out: None, a truth value, a number or the text itself. YAML 1.2's core schema,
except that ``010``, ``0o7`` and ``0x1f`` are texts; so are ``on``, ``off``, ``yes``, ``no``, dates and ``190:20:30``.
"""

from __future__ import annotations

import math
import re
from typing import Final

from neurovis_spec.language.yaml.source import ScalarValue

INTEGER_LOW: Final = -(2**63)
INTEGER_HIGH: Final = 2**63 - 1
_MOST_DIGITS: Final = 19  # of a signed 64-bit integer
_LONGEST_NUMBER: Final = 1000  # characters; nobody writes a longer one, and converting them costs time
_LARGEST: Final = 1.7976931348623157e308

_WORDS: Final[dict[str, ScalarValue]] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
    **{sign + word: math.inf for sign in ("", "+") for word in (".inf", ".Inf", ".INF")},
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
}
_WORD_STARTS: Final = frozenset(word[:1] for word in _WORDS)
_NUMBER_STARTS: Final = frozenset("+-.0123456789")

#: Group 1 is there for a number with a point or an exponent, group 2 for an integer; ``010`` has neither.
NUMBER: Final = re.compile(
    r"[-+]?(?:((?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[0-9]+[eE][-+]?[0-9]+)|(0|[1-9][0-9]*))"
)


class NumberRangeError(ValueError):
    """A number that cannot be held. ``code`` is the finding's, ``nearest`` the nearest number that can."""

    def __init__(self, code: str, message: str, nearest: int | float) -> None:
        super().__init__(message)
        self.code = code
        self.nearest = nearest


def resolve(text: str) -> ScalarValue:
    """What a plain scalar stands for. Raises NumberRangeError for integers beyond signed 64 bits and for floats
    beyond double precision.

    >>> [resolve(text) for text in ("~", "true", "1e5", "-3", "010", "yes", "2001-01-01")]
    [None, True, 100000.0, -3, '010', 'yes', '2001-01-01']
    """
    start = text[:1]
    if start in _NUMBER_STARTS:
        match = NUMBER.fullmatch(text)
        if match is not None:
            return _integer(text) if match.lastindex == 2 else _float(text)
    if start in _WORD_STARTS and len(text) <= 5:
        return _WORDS.get(text, text)
    return text


def _integer(text: str) -> int:
    value = int(text) if len(text) <= _MOST_DIGITS + 1 else None
    if value is not None and INTEGER_LOW <= value <= INTEGER_HIGH:
        return value
    nearest = INTEGER_LOW if text.startswith("-") else INTEGER_HIGH
    raise NumberRangeError("integer-range", f"the integer {_shown(text)} is beyond signed 64 bits", nearest)


def _float(text: str) -> float:
    if len(text) <= _LONGEST_NUMBER:
        value = float(text)
        if math.isfinite(value):
            return value
    nearest = math.copysign(_LARGEST, -1.0 if text.startswith("-") else 1.0)
    raise NumberRangeError("number-range", f"the number {_shown(text)} is beyond double precision", nearest)


def _shown(text: str) -> str:
    return text if len(text) <= 32 else text[:30] + "…"
