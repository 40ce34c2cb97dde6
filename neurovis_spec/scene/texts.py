"""Texts: how wide they are at most (``text_width``), shortened to a width, numbers for people.

In: strings; all names that stand together in a picture (Cut). Out: widths in user units; lines; shorter strings, which
can still be told apart: the beginning of a name and an ellipsis, or its end, if others begin in the same way.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator

from neurovis_spec.text_width import FAMILIES, SUBSCRIPT_DROP, SUBSCRIPT_SIZE, fitting, width, with_subscript

#: A part of a word behind which a line may end.
_PARTS = re.compile(r"[^_\-./]*[_\-./]+|[^_\-./]+")

__all__ = [
    "FAMILIES",
    "SUBSCRIPT_DROP",
    "SUBSCRIPT_SIZE",
    "Cut",
    "number",
    "parts_of",
    "shorten",
    "width",
    "with_subscript",
    "wrapped",
]


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


def wrapped(text: str, size: float, room: float, weight: int = 400) -> list[str]:
    """The text in as many lines as it takes, each no wider than ``room``: broken between words and behind ``_-./``,
    anywhere where a word is wider by itself; at least a letter a line.

    >>> wrapped("a title of several words", 10, 60)
    ['a title of', 'several', 'words']
    >>> wrapped("extraordinarily", 10, 40)
    ['extraor', 'dinarily']
    """
    lines = [""]
    for between, word in parts_of(text):
        longer = f"{lines[-1]}{between}{word}"
        if width(longer, size, weight) <= room:
            lines[-1] = longer
            continue
        if lines[-1]:
            lines.append("")
        while len(word) > 1 and (end := fitting(word, size, room, weight)) < len(word):
            lines[-1:] = [word[: max(end, 1)], ""]
            word = word[max(end, 1) :]
        lines[-1] = word
    return lines


def parts_of(text: str) -> Iterator[tuple[str, str]]:
    """What a text can be broken into, and what is before each within a line."""
    for number, word in enumerate(text.split()):
        for place, part in enumerate(_PARTS.findall(word)):
            yield " " if number and not place else "", part


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


class Cut:
    """Shortens names: to their beginning if that tells a name from the others, else to their end."""

    def __init__(self, names: Iterable[str]) -> None:
        self._names = sorted(set(names))

    def _is_shared(self, begin: str) -> bool:
        """Whether two names or more go on behind this beginning: in order they stand together, right behind it."""
        second = bisect_right(self._names, begin) + 1
        return begin != "" and second < len(self._names) and self._names[second].startswith(begin)

    def shorten(self, name: str, size: float, room: float, weight: int = 600) -> str:
        """The name, or what of its beginning (or end) fits into ``room`` with an ellipsis; '' where nothing does.

        >>> cut = Cut(["descending_1", "descending_2", "photoreceptor"])
        >>> cut.shorten("descending_2", 10, 60), cut.shorten("photoreceptor", 10, 60)
        ('…nding_2', 'photore…')
        """
        text = shorten(name, size, room, weight)
        if text in (name, "") or not self._is_shared(text[:-1]):
            return text
        return shorten(name[::-1], size, room, weight)[::-1]

    def parts(self, base: str, subscript: str, size: float, room: float, weight: int = 600) -> tuple[str, str]:
        """A name and its number, which stays whole.

        >>> Cut(["descending", "interneuron"]).parts("interneuron", "12", 10, 60)
        ('intern…', '12')
        """
        return self.shorten(base, size, room - width("", size, weight, subscript), weight), subscript
