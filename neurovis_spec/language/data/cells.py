"""The rows and cells of a file of text, such as a ``.csv``, and the numbers in them.

In: bytes, in parts. Out: rows of texts; float64 numbers, NaN for an empty cell. A fault is a CellError that names row
and column as an editor or a spreadsheet counts them (from 1, the header included). What separates cells is a Separator,
commas if nothing else is said.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.table import EMPTY_CELL, CellError, in_cell, in_row, quoted

#: what is said of a file that begins with a comment
NO_COMMENT: Final = "row 1 is no comment: all rows of a .csv are read"
#: bytes of a cell; Python's reader takes twice as many
LONGEST_CELL: Final = 1 << 16
#: bytes of lines that are read together
STRETCH: Final = 1 << 16
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
_QUOTED: Final = re.compile(rb'"[^"]*"?')
_BLANKS: Final = re.compile(rb"[ \t]+")
_AROUND: Final = re.compile(rb" ?\n ?")
_DECIMAL_COMMA: Final = re.compile(r"[-+]?[0-9]+,[0-9]+")
#: what numbers and blanks consist of
PLAIN: Final = b"0123456789+-.eE \t"


class Separator(NamedTuple):
    """What stands between the cells of a row: a byte, and what it is called."""

    byte: bytes
    noun: str

    @property
    def blank(self) -> bool:
        """Whether several of them are one."""
        return self.byte == b" "

    def between(self, line: bytes) -> int:
        """How many there are in a line, outside of quotes."""
        line = _QUOTED.sub(b'""', line) if b'"' in line else line
        return max(len(line.split()) - 1, 0) if self.blank else line.count(self.byte)


COMMAS: Final = Separator(b",", "commas")
TABS: Final = Separator(b"\t", "tabs")
SEMICOLONS: Final = Separator(b";", "semicolons")
BLANKS: Final = Separator(b" ", "blanks")
#: lines of a file in which its separator is looked for
_LOOKED_AT: Final = 3


def separator_of(parts: Iterable[bytes], path: str) -> Separator:
    """What separates the cells of a file: what the first lines have equally often. It is looked for in this order:
    commas (of a ``.tsv`` tabs), tabs, semicolons, blanks; where nothing is found it is the first of these.

    >>> [separator_of([text], "x.csv").noun for text in (b"a;b\\n0,5;1\\n", b"a b\\n1  2\\n", b"my column\\n1\\n")]
    ['semicolons', 'blanks', 'commas']
    """
    known = (COMMAS, TABS, SEMICOLONS, BLANKS)
    if path.lower().endswith(".tsv"):
        known = (TABS, COMMAS, SEMICOLONS, BLANKS)
    lines = [line for line in next(iter(text_of(parts))).split(b"\n", _LOOKED_AT)[:_LOOKED_AT] if line]
    for separator in known:
        counts = {separator.between(line) for line in lines}
        if len(counts) == 1 and 0 not in counts:
            return separator
    return known[0]


class Row(NamedTuple):
    """The number of a row, and its cells as they are written."""

    number: int
    cells: list[str]

    def stripped(self) -> Row:
        """The same without blanks around the cells."""
        return Row(self.number, [cell.strip() for cell in self.cells])


def strip_end(parts: list[bytes]) -> None:
    """Take the ends of lines at the end of a file from its parts."""
    while parts:
        last = parts.pop().rstrip(b"\r\n")
        if last:
            parts.append(last)
            return


def given_up(parts: list[bytes]) -> Iterator[bytes]:
    """One part after the other; each is taken out, so that it takes memory no longer than it is needed."""
    parts.reverse()
    while parts:
        yield parts.pop()


def stretches_of(parts: Iterable[bytes]) -> Iterator[bytes]:
    """A file that is given in parts, in stretches of whole lines, each without the line feed at its end."""
    begun: list[bytes] = []
    for part in parts:
        for start in range(0, len(part), STRETCH):
            some = part[start : start + STRETCH]
            end = some.rfind(b"\n")
            begun.append(some if end < 0 else some[:end])
            if end >= 0:
                stretch, begun = b"".join(begun), [some[end + 1 :]]
                yield stretch
    stretch, begun = b"".join(begun), []
    yield stretch


def text_of(parts: Iterable[bytes], separator: Separator = COMMAS) -> Iterator[bytes]:
    """The stretches of a file of text, whose lines may end in any way, without a byte-order mark; of several blanks
    that separate cells one is left, and none around a line."""
    stretches = stretches_of(_with_line_feeds(parts))
    return map(_squeezed, stretches) if separator.blank else stretches


def _squeezed(lines: bytes) -> bytes:
    return _AROUND.sub(b"\n", _BLANKS.sub(b" ", lines)).strip(b" ")


def _with_line_feeds(parts: Iterable[bytes]) -> Iterator[bytes]:
    held, mark = b"", b"\xef\xbb\xbf"
    for part in parts:
        start, mark = len(mark) if part.startswith(mark) else 0, b""
        for begin in range(start, len(part), STRETCH):
            some = held + part[begin : begin + STRETCH]
            held = b"\r" if some.endswith(b"\r") else b""  # a line feed may follow
            some = some.removesuffix(held)
            yield some.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in some else some
    if held:
        yield b"\n"


def count_lines(text: Iterable[bytes]) -> int:
    """How many lines of a text end."""
    return sum(lines.count(b"\n") + 1 for lines in text) - 1


def lines_in(parts: Sequence[bytes]) -> int:
    """The same of a file in parts."""
    if any(b"\r" in part for part in parts):
        return count_lines(text_of(parts))
    return sum(part.count(b"\n") for part in parts)


def check_text(text: Iterable[bytes], separator: Separator = COMMAS) -> None:
    """Refuse what is empty, or no text, or has a cell that is longer than any number or name. Raises CellError."""
    number, broken, empty = 1, 0, True
    for lines in text:
        _check_lengths(lines, number, separator.byte)
        broken = broken or _broken_row(lines, number)
        number, empty = number + lines.count(b"\n") + 1, empty and not lines
    if empty:
        raise CellError("file-format", "the file is empty")
    if broken:
        raise in_row(broken, "is not UTF-8", "save the file as UTF-8", "invalid-utf8")


def _broken_row(lines: bytes, number: int) -> int:
    """The first row that is not UTF-8, of lines of which the first has this number; 0 without one."""
    if lines.isascii():
        return 0
    try:
        lines.decode("utf-8")
    except UnicodeDecodeError as error:
        return number + lines.count(b"\n", 0, error.start)
    return 0


def _check_lengths(lines: bytes, number: int, separator: bytes) -> None:
    """Refuse a cell that is longer than any number or name. It covers a stretch of half its length that holds no
    separator; few stretches have none. Raises CellError."""
    half = LONGEST_CELL // 2
    separators = re.compile(b"[" + separator + b"\n]")
    for start in range(0, len(lines) - half, half):
        if separators.search(lines, start, start + half):
            continue
        low, high = max(0, start - LONGEST_CELL), start + LONGEST_CELL + half
        begin = max(low, lines.rfind(separator, low, start) + 1, lines.rfind(b"\n", low, start) + 1)
        end = separators.search(lines, start + half, high)
        if (min(len(lines), high) if end is None else end.start()) - begin > LONGEST_CELL:
            row, line = number + lines.count(b"\n", 0, begin), lines.rfind(b"\n", 0, begin) + 1
            column = lines.count(separator, line, begin) + 1
            raise in_cell(row, column, f"no number or name has more than {LONGEST_CELL:,} bytes")


def first_row(text: Iterator[bytes], separator: Separator = COMMAS) -> Row:
    """The first row of a text. Raises CellError."""
    lines = next(text)
    return next(rows_of(b"\n".join((lines, *text)) if b'"' in lines else lines, separator=separator))


def rows_of(lines: bytes, number: int = 1, separator: Separator = COMMAS) -> Iterator[Row]:
    """The rows of lines, of which the first has this number; an empty line is a row of one empty cell. Raises
    CellError."""
    text = io.TextIOWrapper(io.BytesIO(lines + b"\n"), "utf-8", newline="")
    reader = csv.reader(text, strict=True, delimiter=separator.byte.decode())
    try:
        for cells in reader:
            yield Row(number - 1 + reader.line_num, cells or [""])
    except csv.Error as error:
        raise in_row(number - 1 + reader.line_num, f"is no CSV: {error}") from error


def below(stretches: Iterable[bytes], number: int) -> Iterator[tuple[int, bytes]]:
    """The lines below that of this number, a stretch at a time, each time with the number of the first; from the first
    quote on, which may hold ends of lines, all at once."""
    rest, above = iter(stretches), number
    for stretch in rest:
        lines = stretch
        if above:
            first = stretch.split(b"\n", above)
            if len(first) <= above:
                above -= len(first)
                continue
            lines, above = first[above], 0
        if b'"' in lines:
            lines = b"\n".join((lines, *rest))
        yield number + 1, lines
        number += lines.count(b"\n") + 1


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, be it a finite one or not."""
    return bool(_NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell))


def numbers_of(cells: bytes) -> NDArray[np.float64] | None:
    """The numbers of cells that commas separate, NaN for an empty one; None where one holds something else, or a number
    beyond double precision.

    >>> numbers_of(b"1,, 2e-1"), numbers_of(b"1,1_0")
    (array([1. , nan, 0.2]), None)
    """
    if cells.translate(None, PLAIN + b","):
        return None
    texts = cells.decode("ascii").split(",")
    try:
        try:
            values = np.array(list(map(float, texts)))
        except ValueError:  # as of an empty one
            commas = np.flatnonzero(np.frombuffer(cells, np.uint8) == ord(","))
            filled = np.diff(commas, prepend=-1, append=len(cells)) > 1
            values = np.full(len(texts), np.nan)
            values[filled] = [float(text.strip() or "nan") for text in filter(None, texts)]
    except ValueError:
        return None
    return None if np.isinf(values).any() else values


def number_of(cell: str, row: int, column: int) -> float:
    """A cell's number, NaN for an empty cell. Raises CellError."""
    if not cell:
        return math.nan
    if _NUMBER.fullmatch(cell):
        value = float(cell)
        if math.isfinite(value):
            return value
        raise in_cell(row, column, f"{quoted(cell)} is beyond double precision", code="not-finite")
    if _NOT_FINITE.fullmatch(cell):
        raise in_cell(row, column, f"'{cell}' is not finite", EMPTY_CELL, "not-finite")
    raise in_cell(row, column, f"{quoted(cell)} is no number", separated(cell))


def separated(cell: str) -> str | None:
    """A hint, where a cell seems to be several that something else than commas separates, or has a decimal comma."""
    if _DECIMAL_COMMA.fullmatch(cell):
        return f"numbers have a decimal point: write {cell.replace(',', '.')}"
    return "columns are separated by commas" if ";" in cell or "\t" in cell else None


def counted(cells: int) -> str:
    """A number of cells, with its noun."""
    return "1 cell" if cells == 1 else f"{cells} cells"
