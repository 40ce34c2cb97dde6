"""What a text stands for that is written in quotes, over several lines, or behind | or >, and where its characters are.

In: the characters as they are written; a stretch of a document that holds a scalar, and its value. Out: the text: line
breaks within become blanks, blank lines line breaks; escapes stand for characters. For each character of it its place
in the document: YAML changes nothing but blanks, line ends, doubled quotes and escapes, so what is none of these is
found in the same order in both.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from functools import lru_cache
from typing import Final, NamedTuple

_FOLD: Final = r"[ \t]*(?:\r\n|\n|\r)[ \t]*((?:(?:\r\n|\n|\r)[ \t]*)*)"
_PLAIN: Final = re.compile(_FOLD)
_SINGLE: Final = re.compile(f"''|{_FOLD}")
#: An escape of a text in double quotes: the end of a line behind which the text goes on, one with a number, any other.
_ESCAPES: Final = (
    r"\\(?:(?:\r\n|\n|\r)[ \t]*((?:(?:\r\n|\n|\r)[ \t]*)*)|x([0-9A-Fa-f]{2})|u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))"
)
_DOUBLE: Final = re.compile(f"{_ESCAPES}|{_FOLD}", re.DOTALL)
#: What is written otherwise between quotes, by the quote.
OTHERWISE: Final = {"'": _SINGLE, '"': _DOUBLE}
_BREAK: Final = re.compile(r"\r\n|\n|\r")
_ESCAPED: Final = {
    **{"0": "\0", "a": "\a", "b": "\b", "t": "\t", "\t": "\t", "n": "\n", "v": "\v", "f": "\f", "r": "\r", "e": "\x1b"},
    **{" ": " ", '"': '"', "/": "/", "\\": "\\", "N": "\x85", "_": "\xa0", "L": "\u2028", "P": "\u2029"},
}


class EscapeError(ValueError):
    """An escape that YAML does not know; ``at`` is where its backslash is."""

    def __init__(self, at: int) -> None:
        super().__init__(at)
        self.at = at


def plain(written: str) -> str:
    r"""An unquoted text.

    >>> plain("one\n  two\n\n  three")
    'one two\nthree'
    """
    return _PLAIN.sub(_folded, written)


def single(inner: str) -> str:
    """What stands between single quotes."""
    return _SINGLE.sub(meaning, inner)


def double(inner: str) -> str:
    """What stands between double quotes. Raises EscapeError."""
    return _DOUBLE.sub(meaning, inner)


def _folded(match: re.Match[str]) -> str:
    """One line break is a blank; of more the first says nothing."""
    later = match[match.re.groups]
    return "\n" * len(_BREAK.findall(later)) if later else " "


def meaning(match: re.Match[str]) -> str:
    """The characters that an escape, a doubled quote or a line break between quotes stands for. Raises EscapeError."""
    if match[0] == "''":
        return "'"
    if match[0][0] != "\\":
        return _folded(match)
    if match[1] is not None:
        return "\n" * len(_BREAK.findall(match[1]))
    number = match[2] or match[3] or match[4]
    if number is None:
        if match[5] not in _ESCAPED:
            raise EscapeError(match.start())
        return _ESCAPED[match[5]]
    code = int(number, 16)
    if code > 0x10FFFF or 0xD800 <= code < 0xE000:
        raise EscapeError(match.start())
    return chr(code)


def block(lines: list[str], *, folded: bool, chomping: str | None) -> str:
    r"""A text behind | or > (``folded``), of which these are the lines without their indentation. Of the line breaks at
    its end one is kept, with ``-`` none and with ``+`` all.

    >>> block(["one", "two", "", "three", "  four", ""], folded=True, chomping=None)
    'one two\nthree\n  four\n'
    """
    count = len(lines)
    while count and not lines[count - 1]:
        count -= 1
    behind = len(lines) - count
    text = _fold(lines[:count]) if folded else "\n".join(lines[:count])
    if chomping == "-":
        return text
    if chomping == "+":
        return text + "\n" * (behind + (count > 0))
    return text + "\n" * (count > 0)


def _fold(lines: list[str]) -> str:
    """Lines become one, but for those that are indented further."""
    parts: list[str] = []
    breaks, before = 0, None
    for line in lines:
        if not line:
            breaks += 1
            continue
        if before is not None:
            apart = line[0] in " \t" or before[0] in " \t"
            parts.append("\n" * (breaks + 1) if apart else "\n" * breaks or " ")
        else:
            parts.append("\n" * breaks)
        parts.append(line)
        breaks, before = 0, line
    return "".join(parts)


class Written(NamedTuple):
    """A scalar as it is written: the characters ``begin`` to ``end`` of a text, quotes and headers among them."""

    text: str
    begin: int
    end: int

    def places(self, value: str) -> tuple[tuple[int, int], ...] | None:
        """For each character of the value how many lines below the begin it stands, and how many columns behind the
        begin of its line (of the first line: behind the begin of the scalar); None where the value is another one.

        Blanks and line ends of the value stand where those before them end.

        >>> Written("'it''s\\n  so'", 0, 12).places("it's so")
        ((0, 1), (0, 2), (0, 3), (0, 5), (0, 6), (1, 2), (1, 3))
        """
        found = _places(self, value)
        return None if found is None else tuple((line, column) for _, line, column in found)

    def part(self, value: str, start: int, end: int) -> Written | None:
        """How the characters ``start`` to ``end`` of the value are written."""
        found = _places(self, value)
        if not found or not start < end <= len(found):
            return None
        return Written(self.text, self.begin + found[start][0], self.begin + found[end - 1][0] + 1)

    def pieces(self) -> Iterator[tuple[str, int, int]]:
        """The characters that are no blanks, each with where it begins and ends."""
        raw = self.text[self.begin : self.end]
        at, end = 0, len(raw)
        if raw[:1] in ("|", ">"):
            header = _BREAK.search(raw)
            at = end if header is None else header.end()
        elif (pattern := OTHERWISE.get(raw[:1])) is not None:
            at, end = 1, end - 1
            for match in pattern.finditer(raw, at, end):
                yield from _visible(raw, at, match.start())
                at = match.end()
                if character := meaning(match).strip():
                    yield character, match.start(), at
        yield from _visible(raw, at, end)


@lru_cache(maxsize=4)
def _places(written: Written, value: str) -> tuple[tuple[int, int, int], ...] | None:
    """For each character its offset, line and column. Of one text several are asked for, one after the other."""
    pieces = written.pieces()
    offsets: list[int] = []
    behind = 0
    for character in value:
        if character.isspace():
            offsets.append(behind)
            continue
        found, start, stop = next(pieces, ("", 0, 0))
        if found != character:
            return None
        offsets.append(start)
        behind = stop
    if next(pieces, None) is not None:
        return None
    raw = written.text[written.begin : written.end]
    starts = [0, *(match.end() for match in _BREAK.finditer(raw))]
    lines = (bisect_right(starts, offset) - 1 for offset in offsets)
    return tuple((offset, line, offset - starts[line]) for line, offset in zip(lines, offsets, strict=True))


def _visible(raw: str, begin: int, end: int) -> Iterator[tuple[str, int, int]]:
    for at in range(begin, end):
        if not raw[at].isspace():
            yield raw[at], at, at + 1
