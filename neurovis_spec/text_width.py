"""Text widths: how wide texts of a picture are at most, and names with subscripts.

In: strings and the size of their letters. Out: widths. These are those of DejaVu Sans, which pictures in pixels are set
in; among the widest of the fonts in ``FAMILIES``, so that a text that fits here fits with any of them. Layouts and
pictures measure with it alone, so that the room that a layout keeps is what a picture needs.
"""

from __future__ import annotations

import re
import unicodedata

#: What a picture's text is set in: the first of these that the reader has.
FAMILIES = ("DejaVu Sans", "Verdana", "Helvetica Neue", "Arial", "sans-serif")

# Hundredths of the size, from the blank to the tilde.
_REGULAR = (
    "32 40 46 84 64 95 78 27 39 39 50 84 32 36 32 34 64 64 64 64 64 64 64 64 64 64 34 34 84 84 84 53 100 68 69 70 77 "
    "63 58 77 75 29 29 66 56 86 75 79 60 79 69 63 61 73 68 99 69 61 69 39 34 39 84 50 50 61 63 55 63 62 35 63 63 28 28 "
    "58 28 97 63 61 63 63 41 52 39 63 59 82 59 59 52 64 34 64 84"
)
_BOLD = (
    "35 46 52 84 70 100 87 31 46 46 52 84 38 42 38 37 70 70 70 70 70 70 70 70 70 70 40 40 84 84 84 58 100 77 76 73 83 "
    "68 68 82 84 37 37 77 64 100 84 85 73 85 77 72 68 81 77 110 77 72 73 46 37 46 84 50 50 67 72 59 72 68 44 72 71 34 "
    "34 67 34 104 71 69 72 72 49 60 48 71 65 92 65 65 58 71 37 71 84"
)
_TABLES = {
    bold: {chr(32 + place): int(number) for place, number in enumerate(table.split())} | {"·": 38, "…": 100}
    for bold, table in ((False, _REGULAR), (True, _BOLD))
}

SUBSCRIPT_SIZE = 0.72
SUBSCRIPT_DROP = 0.2


def width(text: str, size: float, weight: int = 400, subscript: str = "") -> float:
    """At most this wide, in user units."""
    table = _TABLES[weight >= 600]
    total = float(sum(table.get(c, 0) or _other(c) for c in text))
    total += SUBSCRIPT_SIZE * sum(table.get(c, 0) or _other(c) for c in subscript)
    return total * size / 100


def fitting(text: str, size: float, room: float, weight: int = 400) -> int:
    """How many characters of a text, from its first, fit into ``room`` user units.

    >>> fitting("extraordinarily", 10, 40)
    7
    """
    table, total = _TABLES[weight >= 600], 0
    for count, character in enumerate(text):
        total += table.get(character, 0) or _other(character)
        if float(total) * size / 100 > room:
            return count
    return len(text)


def _other(character: str) -> int:
    if unicodedata.combining(character):
        return 0
    return 105 if unicodedata.east_asian_width(character) in "WF" else 84


def with_subscript(label: str) -> tuple[str, str]:
    """A numbered name as base and subscript.

    >>> with_subscript("K12"), with_subscript("swing"), with_subscript("12")
    (('K', '12'), ('swing', ''), ('12', ''))
    """
    match = re.fullmatch(r"(.*[^\d_])_?(\d{1,6})", label)
    return (match[1], match[2]) if match else (label, "")
