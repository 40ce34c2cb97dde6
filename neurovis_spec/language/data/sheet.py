"""Sheets: tables whose columns have names, and are read one by one when they are asked for.

In: the bytes of a file, which rows count. Out: a Sheet, which gives a column as numbers or as texts, and says in which
row of the file each stands. A fault is a CellError; what is wrong with cells is found when their column is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple, Protocol, TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.language.data.cells import (
    COMMAS,
    Separator,
    below,
    check_text,
    counted,
    first_row,
    lines_in,
    number_of,
    rows_of,
    separator_of,
    strip_end,
    text_of,
)
from neurovis_spec.language.data.columns import (
    Cells,
    Lines,
    Names,
    find_column,
    lines_of,
    picked,
    rows_picked,
)
from neurovis_spec.language.data.table import CellError, Faults, check_cells, check_rows, in_cell, in_row
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition

V = TypeVar("V")
#: columns of a sheet
MOST_COLUMNS: Final = 1000
#: rows of a table of neurons, as many as a sheet of common spreadsheets has
MOST_ROWS: Final = 1 << 20
#: what separates the cells of rows that were read one by one, as some are in quotes
_INNER: Final = b"\x1f"
_WITHIN: Final = str.maketrans("\x1f\r\n", "   ")
#: bytes of lines that are kept together
_STRETCH: Final = 1 << 20


class Sheet(Protocol):
    """A table whose columns have names."""

    @property
    def header(self) -> tuple[str, ...]:
        """The names of its columns."""
        ...

    @property
    def about(self) -> str:
        """What was found by looking at the file, in words; nothing of one as we write them."""
        ...

    def __len__(self) -> int:
        """How many of its rows count."""
        ...

    def where(self, row: int) -> int:
        """Where one of them stands in the file, from 1."""
        ...

    def numbers(self, column: Located[str]) -> FloatArray:
        """A column of numbers, NaN where a cell is empty. Raises CellError."""
        ...

    def texts(self, column: Located[str]) -> tuple[str, ...]:
        """A column of texts, without the blanks around them; "" where a cell is empty. Raises CellError."""
        ...


class _Some(NamedTuple):
    """Rows that count among some lines, of which each has a number in the file; None: all of them."""

    lines: Lines
    at: IntArray
    chosen: IntArray | None = None

    @property
    def rows(self) -> int:
        """How many count."""
        return self.lines.rows if self.chosen is None else len(self.chosen)

    def column(self, at: int) -> Cells:
        """Their cells in a column."""
        cells = self.lines.column(at)
        return cells if self.chosen is None else cells.some(self.chosen)

    def numbers(self) -> IntArray:
        """The number of each row."""
        return self.at if self.chosen is None else self.at[self.chosen]


class TextSheet:
    """A sheet from a file of text."""

    def __init__(self, header: tuple[str, ...], parts: list[_Some], about: str) -> None:
        self.header = header
        self.about = about
        self._parts = parts
        self._starts = np.cumsum([0, *(part.rows for part in parts)])

    def __len__(self) -> int:
        return int(self._starts[-1])

    def where(self, row: int) -> int:
        """Where a row stands in the file, from 1."""
        part = int(np.searchsorted(self._starts, row, side="right")) - 1
        return int(self._parts[part].numbers()[row - self._starts[part]])

    def numbers(self, column: Located[str]) -> FloatArray:
        """A column of numbers, NaN where a cell is empty. Raises CellError."""
        at, faults, found = find_column(self.header, column), Faults(), [np.empty(0)]
        for part in self._parts:
            quick = part.column(at).numbers()
            found.append(np.array([*_each(part, at, number_of, math.nan, faults)]) if quick is None else quick)
            if faults.many:
                break
        faults.check()
        return np.concatenate(found)

    def texts(self, column: Located[str]) -> tuple[str, ...]:
        """A column of texts, without the blanks around them. Raises CellError."""
        at, faults, names = find_column(self.header, column), Faults(), Names()
        found = [number for part in self._parts for number in names.of(part.column(at)).tolist()]
        if not all(map(str.isprintable, names.known)):
            for part in self._parts:
                [*_each(part, at, _printable, "", faults)]
        faults.check()
        return tuple([names.known[number] if number >= 0 else "" for number in found])


def _each(part: _Some, at: int, read: Callable[[str, int, int], V], otherwise: V, faults: Faults) -> Iterator[V]:
    """What is read of each cell of a column; faults are noted."""
    cells = part.column(at)
    for begin, end, row in zip(cells.begins.tolist(), cells.ends.tolist(), part.numbers().tolist(), strict=True):
        try:
            yield read(cells.text[begin:end].tobytes().decode().strip(), row, at + 1)
        except CellError as error:
            faults.note(error)
            yield otherwise
        if faults.many:
            return


def _printable(cell: str, row: int, column: int) -> str:
    if cell.isprintable():
        return cell
    raise in_cell(row, column, "a text has a character here that cannot be shown")


def parse_sheet(data: bytes, path: str, where: tuple[Condition, ...] = (), most: int = MOST_ROWS) -> TextSheet:
    """The sheet in a file of text, whose first row names its columns, of at most so many rows. Raises CellError."""
    parts = [data]
    strip_end(parts)
    separator = separator_of(parts, path) if parts else COMMAS
    check_text(text_of(parts, separator), separator)
    cells = 1 + next(text_of(parts, separator)).partition(b"\n")[0].count(separator.byte)
    if cells > MOST_COLUMNS:
        raise in_row(1, f"has {cells:,} cells; a table has {MOST_COLUMNS:,} columns at most")
    first = first_row(text_of(parts, separator), separator)
    header = tuple(first.stripped().cells)
    lines_below = lines_in(parts)
    check_rows(lines_below, most)
    check_cells(lines_below * len(header))
    conditions, faults, found, rows = picked(where, header), Faults(), list[_Some](), 0
    for number, lines in _gathered(below(text_of(parts, separator), first.number)):
        part = _part(lines, number, separator, len(header), faults)
        if part is not None:
            rows += part.rows
            found.append(part._replace(chosen=rows_picked(conditions, part.lines)))
        if faults.many:
            break
    faults.check()
    for one in conditions:
        one.check()
    told = [] if separator == COMMAS else [f"separated by {separator.noun}"]
    if where:
        told.append(f"{sum(part.rows for part in found):,} of {rows:,} rows")
    return TextSheet(header, found, ", ".join(told))


def _gathered(stretches: Iterator[tuple[int, bytes]]) -> Iterator[tuple[int, bytes]]:
    """Stretches of lines, several of them together, with the number of the first line."""
    first, held, size = 0, list[bytes](), 0
    for number, lines in stretches:
        if held and size + len(lines) > _STRETCH:
            yield first, b"\n".join(held)
            held, size = [], 0
        first = first if held else number
        held.append(lines)
        size += len(lines)
    if held:
        yield first, b"\n".join(held)


def _part(lines: bytes, number: int, separator: Separator, width: int, faults: Faults) -> _Some | None:
    """Some lines, of which the first has this number; None where none is in order. Faults are noted."""
    if b'"' not in lines:
        some = lines_of(lines, width, separator.byte)
        if some is not None:
            return _Some(_narrowed(some), np.arange(number, number + some.rows))
    kept, numbers = list[bytes](), list[int]()
    try:
        for row in rows_of(lines, number, separator):
            if len(row.cells) == width:
                kept.append(_INNER.join(cell.translate(_WITHIN).encode() for cell in row.cells))
                numbers.append(row.number)
            else:
                faults.note(in_row(row.number, f"has {counted(len(row.cells))}, the header {width}"))
            if faults.many:
                break
    except CellError as error:
        faults.note(error)
    some = lines_of(b"\n".join(kept), width, _INNER) if kept else None
    return None if some is None else _Some(_narrowed(some), np.array(numbers))


def _narrowed(lines: Lines) -> Lines:
    """The same, kept in less room."""
    return lines._replace(ends=lines.ends.astype(np.int32))
