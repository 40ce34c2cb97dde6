"""Texts over several lines, without the indentation they happen to have.

In: a text as written. Out: its lines, from which a text of the same value can be written at any indentation.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from neurovis_spec.language.format.gaps import Comment

_HEADER: Final = re.compile(r"([|>])([-+0-9]*)([ \t]*)(#[^\n]*)?")
_BLANK_LINES: Final = re.compile(r"[ \t]*(?:\n *(?=\n|\Z))*")


class Lines(NamedTuple):
    """A plain or quoted text over several lines, each without the blanks around it; a blank line is empty."""

    lines: tuple[str, ...]


class Block(NamedTuple):
    """A text behind | or >: the header, a comment on its line, the lines without their common indentation, and the
    index behind it."""

    header: str
    comment: Comment | None
    lines: tuple[str, ...]
    end: int


def read_lines(written: str) -> Lines:
    r"""A plain or quoted text: blanks around its line breaks say nothing, but those behind a backslash.

    >>> read_lines("one\n    two")
    Lines(lines=('one', 'two'))
    """
    first, *others = written.split("\n")
    lines = [first, *(line.lstrip(" \t") for line in others)]
    escapes = written.startswith('"')
    return Lines((*(_without_blanks(line, escapes) for line in lines[:-1]), lines[-1]))


def _without_blanks(line: str, escapes: bool) -> str:
    bare = line.rstrip(" \t")
    backslashes = len(bare) - len(bare.rstrip("\\"))
    if escapes and backslashes % 2 and len(bare) < len(line):
        return line[: len(bare) + 1]  # the blank is escaped
    return bare


def read_block(text: str, start: int, stop: int, column: int) -> Block:
    """A text behind | or >, whose last line with something on it ends at ``stop``, in a collection that stands in
    ``column``. With ``+``, where all line breaks count, the blank lines below belong to it."""
    header = _HEADER.match(text, start)
    assert header is not None
    comment = None
    if header.group(4) is not None:
        place = header.start(4) - text.rfind("\n", 0, start) - 1
        comment = Comment(header.group(4).rstrip(), place, len(header.group(3)))
    sign = "".join(re.findall("[-+]", header.group(2)))
    if sign == "+":
        blank = _BLANK_LINES.match(text, stop)
        assert blank is not None
        stop = blank.end()
    raw = text[header.end() + 1 : stop].split("\n")
    digit = re.sub("[-+]", "", header.group(2))
    indent = column + int(digit) if digit else _common(raw)
    lines = tuple(line[indent:] for line in raw) if stop > header.end() else ()
    return Block(header.group(1) + ("2" if digit else "") + sign, comment, lines, stop)


def _common(lines: list[str]) -> int:
    """The indentation of the first line that holds more than blanks; where none does, all of it."""
    for line in lines:
        bare = line.lstrip(" ")
        if bare:
            return len(line) - len(bare)
    return max((len(line) for line in lines), default=0)
