"""Texts over several lines, without the indentation they happen to have.

In: a text as written. Out: its lines, from which a text of the same value can be written at any indentation.
"""

from __future__ import annotations

import re
from typing import Final

from neurovis_spec.language.format.between import Comment
from neurovis_spec.language.format.tree import Block, Lines

_HEADER: Final = re.compile(r"([|>])([-+0-9]*)([ \t]*)(#[^\n]*)?")


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


def read_block(text: str, start: int, stop: int, column: int) -> tuple[Block, int]:
    """A text behind | or >, in a collection that stands in ``column``. Returns it and the index behind it.

    That is behind its last line with something on it; with ``+`` (all line breaks count) behind its last line break.
    """
    header = _HEADER.match(text, start)
    assert header is not None
    comment = None
    if header.group(4) is not None:
        place = header.start(4) - text.rfind("\n", 0, start) - 1
        comment = Comment(header.group(4).rstrip(), place, len(header.group(3)))
    head_end = text.index("\n", start)
    raw = text[head_end + 1 : stop].split("\n")
    if raw[-1].strip(" ") == "":
        raw.pop()  # what is behind the last line break is no line of the text
    digit = re.sub("[-+]", "", header.group(2))
    indent = column + int(digit) if digit else _common(raw)
    lines = [line[indent:] for line in raw]
    sign = "".join(re.findall("[-+]", header.group(2)))
    written = header.group(1) + ("2" if digit else "") + sign
    if sign == "+":
        behind = head_end + 1 + sum(len(line) + 1 for line in raw) if raw else head_end
        return Block(written, comment, tuple(lines)), behind
    while lines and not lines[-1]:
        lines.pop()
    end = head_end + sum(len(line) + 1 for line in raw[: len(lines)])
    return Block(written, comment, tuple(lines)), end


def _common(lines: list[str]) -> int:
    """The indentation of the first line that holds more than blanks; where none does, all of it."""
    for line in lines:
        bare = line.lstrip(" ")
        if bare:
            return len(line) - len(bare)
    return max((len(line) for line in lines), default=0)
