"""Texts: how wide they are at most (``text_width``), shortened to a width, numbers for people.

In: strings. Out: widths in user units, shorter strings.
"""

from __future__ import annotations

import math
from bisect import bisect_right

from neurovis_spec.text_width import FAMILIES, SUBSCRIPT_DROP, SUBSCRIPT_SIZE, width, with_subscript

__all__ = ["FAMILIES", "SUBSCRIPT_DROP", "SUBSCRIPT_SIZE", "number", "shorten", "width", "with_subscript"]


def shorten(text: str, size: float, room: float, weight: int = 400) -> str:
    """The text, or as much of it as fits into ``room`` with an ellipsis; empty where not even one character fits.

    >>> shorten("a long name", 10, 40), shorten("a long name", 1, 4)
    ('a lon…', 'a lon…')
    """
    if width(text, size, weight) <= room:
        return text
    # the more of it there is, the wider it is
    end = bisect_right(range(1, len(text)), room, key=lambda end: width(_begun(text, end), size, weight))
    return _begun(text, end) if end else ""


def _begun(text: str, end: int) -> str:
    return text[:end].rstrip() + "…"


def number(value: float, digits: int = 3, sign: bool = False) -> str:
    """A number for people, with a real minus sign.

    >>> number(-0.12345), number(0.5, sign=True), number(1e-5), number(12000.0)
    ('−0.123', '+0.5', '1e−5', '12000')
    """
    if not math.isfinite(value):
        return {"inf": "∞", "-inf": "−∞"}.get(str(value), "no number")
    text = f"{value:{'+' if sign else ''}.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}e{int(exponent)}" if not -4 < int(exponent) < 7 else f"{value:{'+' if sign else ''}.0f}"
    if value == 0:
        text = "0"
    return text.replace("-", "−")
