"""Lines of canonical text: code with comments behind it, rows of a matrix, texts over several lines.

In: code and comments, cells, a text, as written. Out: lines.

- *Comments* behind code that stood in one column on neighbouring lines stay in one column: their own if the code leaves
  two blanks before it, else the first that is free. Where they stood right behind the longest line (one or two blanks),
  they do so again.
- *Rows* stand cell under cell: numbers with their decimal points below each other, names begin below each other,
  expressions end below each other; a comma stands right behind its cell.
- *Texts* lose the indentation they happen to have: one of the same value can be written at any indentation.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from neurovis_spec.language.format.gaps import Comment

_BLANKS: Final = 2  # before a comment behind code

_WIDEST: Final = 40  # a column with a wider cell is left as it is: one long text would push all others away
_NUMBER: Final = re.compile(r"([-+]?[0-9]*)((?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)|null|~")
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*")
_HEADER: Final = re.compile(r"([|>])([-+0-9]*)([ \t]*)(#[^\n]*)?")
_BLANK_LINES: Final = re.compile(r"[ \t]*(?:\n *(?=\n|\Z))*")


class _Line(NamedTuple):
    code: str  # empty for a blank line and for a comment on a line of its own
    comment: Comment | None = None
    indent: int = 0  # of a comment on a line of its own


class LineWriter:
    """Gathers lines; the last one is open."""

    def __init__(self) -> None:
        self._lines: list[_Line] = []
        self._parts: list[str] = []
        self._comment: Comment | None = None
        self.width = 0  # of the open line

    def write(self, text: str) -> None:
        """Go on in the open line."""
        self._parts.append(text)
        self.width += len(text)

    def behind(self, comment: Comment | None) -> None:
        """A comment behind the open line; nothing may follow there."""
        if comment is not None:
            assert self._comment is None
            self._comment = comment

    def end(self) -> None:
        """Close the open line, if there is anything in it."""
        code = "".join(self._parts)
        if code or self._comment is not None:
            self._lines.append(_Line(code, self._comment))
        self._parts.clear()
        self._comment = None
        self.width = 0

    def begin(self, indent: int) -> None:
        """Close the open line and begin another."""
        self.end()
        self._parts.append(" " * indent)
        self.width = indent

    def blank(self) -> None:
        """Close the open line and leave one blank."""
        self.end()
        self._lines.append(_Line(""))

    def raw(self, line: str) -> None:
        """Close the open line and write one of a text, blank or not."""
        self.end()
        self._lines.append(_Line(line))

    def own(self, comment: Comment, indent: int) -> None:
        """Close the open line and write a comment on a line of its own."""
        self.end()
        self._lines.append(_Line("", comment, indent))

    def text(self) -> str:
        """All lines, each with its line end."""
        self.end()
        written: list[str] = []
        at = 0
        while at < len(self._lines):
            line = self._lines[at]
            if line.comment is None:
                written.append(line.code)
                at += 1
            elif not line.code:
                written.append(" " * line.indent + line.comment.text)
                at += 1
            else:
                run = self._run(at, line.comment.column)
                written += _in_one_column(run, line.comment.column)
                at += len(run)
        return "".join(f"{line}\n" for line in written)

    def _run(self, first: int, column: int) -> list[_Line]:
        """The lines from ``first`` on whose comments stood in one column; one may go on below on a line of its own."""
        stop = first + 1
        while stop < len(self._lines):
            comment = self._lines[stop].comment
            if comment is None or comment.column != column or comment.blank:
                break
            stop += 1
        return self._lines[first:stop]


def _in_one_column(run: list[_Line], column: int) -> list[str]:
    longest = max(len(line.code) for line in run) + _BLANKS
    tight = any(line.code and line.comment is not None and line.comment.behind <= _BLANKS for line in run)
    place = longest if tight else max(column, longest)
    return [line.code + " " * (place - len(line.code)) + line.comment.text for line in run if line.comment is not None]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """The rows, each in its brackets.

    >>> print("\\n".join(aligned([["K1", "0.5", "-a"], ["K12", "-1.25", "3*b"]])))
    [K1,   0.5,   -a]
    [K12, -1.25, 3*b]
    """
    columns = max((len(row) for row in rows), default=0)
    padded: list[list[str]] = [[] for _ in rows]
    for column in range(columns):
        there = [index for index, row in enumerate(rows) if len(row) > column]
        pads = _pads([rows[index][column] for index in there])
        for index, (left, right) in zip(there, pads, strict=True):
            last = column == len(rows[index]) - 1
            cell = rows[index][column]
            padded[index].append(" " * left + cell + ("" if last else ", " + " " * right))
    return ["[" + "".join(row) + "]" for row in padded]


def _pads(cells: Sequence[str]) -> list[tuple[int, int]]:
    """The blanks before and behind each cell of a column."""
    if max(len(cell) for cell in cells) > _WIDEST:
        return [(0, 0)] * len(cells)
    matches = [_NUMBER.fullmatch(cell) for cell in cells]
    if all(match is not None for match in matches):
        before = [len(cell) - len((match and match.group(2)) or "") for cell, match in zip(cells, matches, strict=True)]
    elif all(_NAME.fullmatch(cell) for cell in cells):
        before = [0] * len(cells)
    else:
        before = [len(cell) for cell in cells]
    left = max(before)
    right = max(len(cell) - part for cell, part in zip(cells, before, strict=True))
    return [(left - part, right - (len(cell) - part)) for cell, part in zip(cells, before, strict=True)]


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
