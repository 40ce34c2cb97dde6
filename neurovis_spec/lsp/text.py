"""Places in a text: ours count code points from 1, those of the protocol units of UTF-16 from 0 (or of another
encoding that client and server agreed upon).

In: the text of a document. Out: conversions both ways, exact also beyond the basic plane. Lines end where the reader's
end (LF, CR LF, CR), which is where those of the protocol end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.characters import Lines

_BOM = "\ufeff"
#: How many units a character takes.
_UNITS: Final[Mapping[str, Callable[[str], int]]] = {
    "utf-8": lambda character: 1 + sum(ord(character) > most for most in (0x7F, 0x7FF, 0xFFFF)),
    "utf-16": lambda character: 2 if ord(character) > 0xFFFF else 1,
    "utf-32": lambda character: 1,
}


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A place between two characters; line and column count from 1, columns in code points."""

    line: int
    column: int


class Text:
    """A document's text. A byte-order mark that an editor left in it counts for the editor and not for us."""

    def __init__(self, text: str, encoding: str = "utf-16") -> None:
        self.units = _UNITS[encoding]
        self.bom = text.startswith(_BOM)
        self.text = text.removeprefix(_BOM)
        self.lines = Lines(self.text)

    def line(self, number: int) -> str:
        """A line by its number (from 1), without its end."""
        return self.lines.line(number)

    def place(self, line: int, units: int) -> Place:
        """The place of a position of the protocol (both from 0). One beyond a line is its end, one within a
        character its beginning.

        >>> Text("a: \U0001d70e!").place(0, 5)
        Place(line=1, column=5)
        """
        if line >= len(self.lines.starts):
            last = len(self.lines.starts)
            return Place(last, len(self.line(last)) + 1)
        if self.bom and line == 0:
            units = max(0, units - self.units(_BOM))
        column = 1
        for character in self.line(line + 1):
            units -= self.units(character)
            if units < 0:
                break
            column += 1
        return Place(line + 1, column)

    def position(self, line: int, column: int) -> tuple[int, int]:
        """The position of the protocol (both from 0) of a place.

        >>> Text("a: \U0001d70e!").position(1, 5)
        (0, 5)
        """
        before = (_BOM if self.bom and line == 1 else "") + self.line(line)[: column - 1]
        return line - 1, sum(map(self.units, before))

    def index(self, line: int, column: int) -> int:
        """The index of the character at a place; the length of the text beyond its end."""
        starts = self.lines.starts
        return min(starts[line - 1] + column - 1, len(self.text)) if line <= len(starts) else len(self.text)

    def part(self, span: Span) -> str:
        """The characters of a span."""
        return self.text[self.index(span.line, span.column) : self.index(span.end_line, span.end_column)]

    def span(self, file: str, start: int, end: int) -> Span:
        """The span of the characters from one index to another."""
        return Span(file, *self.lines.place(start), *self.lines.place(end))


def holds(span: Span, place: Place) -> bool:
    """Whether a place is in a span or at its end.

    >>> holds(Span("x", 1, 3, 1, 5), Place(1, 5))
    True
    """
    return (span.line, span.column) <= (place.line, place.column) <= (span.end_line, span.end_column)
