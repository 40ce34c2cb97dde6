"""Characters that a spec may not hold, and lines as the parser counts them.

In: a text. Out: its lines, and the places of characters that are invisible, that reorder what is shown, or that
some readers take for a line break and others do not.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_right
from functools import cached_property
from typing import Final

#: Controls except tab and line ends, bidirectional embeddings, overrides and isolates, the separators U+2028 and
#: U+2029, a byte-order mark inside the text, surrogates, and what is no character at all.
FORBIDDEN: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff\ufffe\uffff]"
)
REPLACEMENT: Final = "\ufffd"
_LINE_END: Final = re.compile("\r\n|\n|\r")


class Lines:
    """The lines of a text: ends are LF, CR LF or CR, and nothing else."""

    def __init__(self, text: str) -> None:
        self.text = text

    @cached_property
    def starts(self) -> list[int]:
        """The index of each line's first character."""
        return [0, *(match.end() for match in _LINE_END.finditer(self.text))]

    def line(self, number: int) -> str:
        """A line by its number (from 1) without its end; empty beyond the text."""
        if not 1 <= number <= len(self.starts):
            return ""
        start = self.starts[number - 1]
        end = self.starts[number] if number < len(self.starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")

    def place(self, index: int) -> tuple[int, int]:
        """Line and column (both from 1) of the character at an index."""
        line = bisect_right(self.starts, index)
        return line, index - self.starts[line - 1] + 1


def character_name(character: str) -> str:
    """A character that cannot be shown, in words.

    >>> character_name(chr(0x202E))
    'U+202E (right-to-left override)'
    """
    name = unicodedata.name(character, "").lower()
    code = ord(character)
    if not name and (code < 0x20 or 0x7F <= code < 0xA0):
        name = "a control character"
    return f"U+{code:04X}" + (f" ({name})" if name else "")
