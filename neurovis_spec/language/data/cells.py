"""The rows and cells of a ``.csv`` file, and the numbers in them.

In: bytes. Out: rows of texts; float64 numbers, NaN for an empty cell. A fault is a CellError that names row and column
as an editor or a spreadsheet counts them (from 1, the header included).
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.table import EMPTY_CELL, CellError, in_cell, in_row, quoted

#: what is said of a file that begins with a comment
NO_COMMENT: Final = "row 1 is no comment: all rows of a .csv are read"
#: bytes of a cell; Python's reader takes twice as many
LONGEST_CELL: Final = 1 << 16
#: bytes of lines that are read together
_STRETCH: Final = 1 << 18
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
_SEPARATOR: Final = re.compile(rb"[,\n]")
#: what numbers and blanks consist of
PLAIN: Final = b"0123456789+-.eE \t"


class Row(NamedTuple):
    """The number of a row, and its cells as they are written."""

    number: int
    cells: list[str]

    def stripped(self) -> Row:
        """The same without blanks around the cells."""
        return Row(self.number, [cell.strip() for cell in self.cells])


def count_lines(data: bytes) -> int:
    """How many lines end, however they do."""
    return data.count(b"\n") + data.count(b"\r") - data.count(b"\r\n")


def plain_text(data: bytes) -> bytes:
    """The same file with line feeds alone at the ends of its lines, none at its own, and no byte-order mark. Raises
    CellError where it is empty or no text, or where a cell is longer than any number or name."""
    text = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if not text:
        raise CellError("file-format", "the file is empty")
    _check_lengths(text)
    if not text.isascii():
        try:
            text.decode("utf-8")
        except UnicodeDecodeError as error:
            row = text.count(b"\n", 0, error.start) + 1
            raise in_row(row, "is not UTF-8", "save the file as UTF-8", "invalid-utf8") from None
    return text


def _check_lengths(text: bytes) -> None:
    """Refuse a cell that is longer than any number or name. It covers a stretch of half its length that holds no
    separator; few stretches have none. Raises CellError."""
    half = LONGEST_CELL // 2
    for start in range(0, len(text) - half, half):
        if _SEPARATOR.search(text, start, start + half):
            continue
        low, high = max(0, start - LONGEST_CELL), start + LONGEST_CELL + half
        begin = max(low, text.rfind(b",", low, start) + 1, text.rfind(b"\n", low, start) + 1)
        end = _SEPARATOR.search(text, start + half, high)
        if (min(len(text), high) if end is None else end.start()) - begin > LONGEST_CELL:
            row, line = text.count(b"\n", 0, begin) + 1, text.rfind(b"\n", 0, begin) + 1
            column = text.count(b",", line, begin) + 1
            raise in_cell(row, column, f"no number or name has more than {LONGEST_CELL:,} bytes")


def rows_of(text: bytes, number: int = 1) -> Iterator[Row]:
    """The rows of a text whose first line has this number; an empty line is a row of one empty cell. Raises
    CellError."""
    reader = csv.reader(io.TextIOWrapper(io.BytesIO(text), "utf-8", newline=""), strict=True)
    try:
        for cells in reader:
            yield Row(number - 1 + reader.line_num, cells or [""])
    except csv.Error as error:
        raise in_row(number - 1 + reader.line_num, f"is no CSV: {error}") from error


def below(text: bytes, number: int) -> Iterator[tuple[int, bytes]]:
    """The lines below that of this number, many together, each time with the number of the first; all at once where
    quotes may hold ends of lines."""
    start = 0
    for _ in range(number):
        start = text.find(b"\n", start) + 1
        if not start:
            return
    size = len(text) if text.find(b'"', start) >= 0 else _STRETCH
    number += 1
    while start <= len(text):
        end = text.find(b"\n", start + size) % (len(text) + 1)
        yield number, text[start:end]
        number += 1 + text.count(b"\n", start, end)
        start = end + 1


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
            values = np.array([float(text.strip() or "nan") for text in texts])
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
    """A hint, where a cell seems to be several that something else than commas separates."""
    return "columns are separated by commas" if ";" in cell or "\t" in cell else None


def counted(cells: int) -> str:
    """A number of cells, with its noun."""
    return "1 cell" if cells == 1 else f"{cells} cells"
