"""Tables of numbers from the bytes of a ``.csv`` file, and its rows.

In: bytes. Out: numbers in rows, or rows of texts. A fault is a CellError that names row and column as an editor or a
spreadsheet counts them (from 1, the header included), and holds those behind it. Cells are turned into numbers many at
a time; they are checked one by one only among the few where something is wrong.
"""

from __future__ import annotations

import csv
import io
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.data.cells import (
    LONGEST_CELL,
    check_lengths,
    check_utf8,
    counted,
    is_number,
    number_of,
    numbers_in,
    numbers_of,
    separated,
)
from neurovis_spec.language.data.header import numbers_columns
from neurovis_spec.language.data.table import CellError, Faults, Room, Table, check_cells

#: bytes, and cells, that are made numbers of together; and cells among which one that is invalid is looked for
_STRETCH: Final = 1 << 18
_BATCH: Final = 1 << 14
_FEW: Final = 1 << 10
#: what is said of a file that begins with a comment
NO_COMMENT: Final = "row 1 is no comment: all rows of a .csv are read"
_MARK: Final = b"\xef\xbb\xbf"


class Row(NamedTuple):
    """The number of a row, and its cells as they are written."""

    number: int
    cells: list[str]

    def stripped(self) -> Row:
        """The same without blanks around the cells."""
        return Row(self.number, [cell.strip() for cell in self.cells])


def read_rows(data: bytes) -> Iterator[Row]:
    """The cells of a file, row by row; empty rows at the end are none. Raises CellError."""
    check_lengths(data)
    check_utf8(data)
    reader = csv.reader(io.TextIOWrapper(io.BytesIO(data.rstrip(b"\r\n")), "utf-8-sig", newline=""), strict=True)
    try:
        for cells in reader:
            yield Row(reader.line_num, cells)
    except csv.Error as error:
        raise CellError("file-format", f"row {reader.line_num} is no CSV: {error}", at=(reader.line_num, 0)) from error
    if not reader.line_num:
        raise empty()


def batches(rows: Iterable[Row]) -> Iterator[list[Row]]:
    """Rows, many together. Those before one that cannot be read come all the same. Raises CellError."""
    batch: list[Row] = []
    cells = 0
    try:
        for row in rows:
            batch.append(row)
            cells += 1 + len(row.cells)
            if cells > _BATCH:
                yield batch
                batch, cells = [], 0
    except CellError:
        yield batch
        raise
    yield batch


def plain_lines(data: bytes) -> bytes:
    """The same file with line feeds alone at the ends of its lines and no byte-order mark. Raises CellError."""
    check_lengths(data)
    check_utf8(data)
    data = data.removeprefix(_MARK).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if not data:
        raise empty()
    return data


def parse_numbers(data: bytes, room: Room | None = None) -> Table:
    """Numbers in rows of one width, after a header of texts, if there is one. Raises CellError."""
    table = _parsed(data, room)
    if table.header is None and numbers_columns(data, table.values):
        return replace(table, numbered=True)
    return table


def _parsed(data: bytes, room: Room | None) -> Table:
    data = data.rstrip(b"\r\n")
    # the separators bound the cells, before any are made
    cells = 1 + data.count(b",") + max(data.count(b"\n"), data.count(b"\r"))
    check_cells(cells)
    if room is not None:
        room(cells)
    if b'"' not in data:
        return _unquoted(plain_lines(data), cells)
    rows = read_rows(data)
    first = next(rows)
    header, width = _header(first), len(first.cells) or 1
    numbers, faults = array("d"), Faults()
    try:
        for batch in batches(rows if header is not None else chain((first,), rows)):
            numbers.frombytes(_numbers(batch, width, header, faults).tobytes())
            if faults.many:
                break
    except CellError as error:
        if not faults.many:
            faults.note(len(data), error)  # there is nothing behind it
    faults.check()
    return _table(np.frombuffer(numbers, dtype=np.float64), width, header)


def _table(numbers: NDArray[np.float64], width: int, header: tuple[str, ...] | None) -> Table:
    if not len(numbers):
        hint = next(filter(None, map(separated, header or ())), None)
        raise CellError("file-format", "there is a header but no row of numbers", hint)
    values = numbers.reshape(-1, width)
    return Table(values, ~np.isnan(values), header)


def _header(row: Row) -> tuple[str, ...] | None:
    """The first row if it is one of texts: no cell of it is a number, and one at least is not empty."""
    filled = False
    for cell in map(str.strip, filter(None, row.cells)):
        if is_number(cell):
            return None
        filled = filled or bool(cell)
    return tuple(row.stripped().cells) if filled else None


def _numbers(batch: list[Row], width: int, header: tuple[str, ...] | None, faults: Faults) -> NDArray[np.float64]:
    """The numbers of some rows, one behind the other, NaN for an empty cell; what is wrong with them is reported."""
    rows = [row.cells or [""] for row in batch]  # an empty line of a file with one column is an empty cell
    if all(len(cells) == width for cells in rows):
        quick = numbers_of(list(chain.from_iterable(rows)))
        if quick is not None:
            return quick
    parts = [np.zeros(0)]
    for (number, _), cells in zip(batch, rows, strict=True):
        if faults.many:
            break
        if len(cells) != width:
            faults.note(number, _ragged(number, len(cells), width, header))
        else:
            parts.append(_one_by_one(cells, number, 0, width, faults))
    return np.concatenate(parts)


def _unquoted(data: bytes, cells: int) -> Table:
    """The same of a file in which every comma and every line end separates two cells, of which it has at most so many;
    a stretch of it at a time. Raises CellError."""
    end = data.find(b"\n") % (len(data) + 1)  # of the first line, which may be the only one
    width = 1 + data.count(b",", 0, end)
    header = _header(Row(1, data[:end].decode("utf-8").split(","))) if data[:end].strip(b", \t") else None
    above, start = (0, 0) if header is None else (1, end + 1)
    values = np.empty(cells)
    filled, faults = 0, Faults()
    while start <= len(data) and not faults.many:
        stop = _stop(data, start)
        row, column = divmod(filled, width)
        made, wrong = _stretch(data, start, stop, (1 + above + row, column), width, faults)
        if not faults:
            values[filled : filled + len(made)] = made
        filled += len(made)
        start = stop + 1
        if wrong is not None and not faults.many:
            place, number = wrong
            end = data.find(b"\n", place) % (len(data) + 1)
            found = 1 + data.count(b",", data.rfind(b"\n", 0, place) + 1, end)
            faults.note(number, _ragged(number, found, width, header))
            if _comment(header):  # the width of all rows is taken from it
                break
            filled, start = (number - above) * width, end + 1  # as if the row were even
    faults.check()
    return _table(values[:filled], width, header)


def _stop(data: bytes, start: int) -> int:
    """The place of the separator that ends a stretch; the end of the file counts as one."""
    at = start + _STRETCH
    found = (data.find(mark, at, at + LONGEST_CELL + 1) for mark in (b",", b"\n"))
    return min((place for place in found if place >= 0), default=len(data))


def _stretch(
    data: bytes, start: int, stop: int, at: tuple[int, int], width: int, faults: Faults
) -> tuple[NDArray[np.float64], tuple[int, int] | None]:
    """The numbers of a stretch, whose first cell stands ``at`` a row (from 1) and column (from 0), up to the first row
    that is uneven, if there is one: then also a place in that row, and its number."""
    row, column = at
    text = data[start:stop] + (data[stop : stop + 1] or b"\n")
    marks = np.frombuffer(text, dtype=np.uint8)
    ends = np.flatnonzero((marks == ord(",")) | (marks == ord("\n")))
    last = np.zeros(len(ends), dtype=np.bool_)
    last[width - 1 - column :: width] = True
    uneven = np.flatnonzero((marks[ends] == ord("\n")) != last)
    wrong = int(uneven[0]) if len(uneven) else None
    good = len(ends) if wrong is None else max(0, wrong - (column + wrong) % width)  # cells of rows that are even
    numbers = np.zeros(0)
    if good:
        text = text[: ends[good - 1]].replace(b"\n", b",")
        quick = numbers_in(text, np.diff(ends[:good], prepend=-1) == 1)
        numbers = _one_by_one(text.decode("utf-8").split(","), row, column, width, faults) if quick is None else quick
    return numbers, None if wrong is None else (start + int(ends[wrong]), row + (column + wrong) // width)


def _one_by_one(cells: list[str], row: int, column: int, width: int, faults: Faults) -> NDArray[np.float64]:
    """The numbers of cells of which some may be invalid, which is reported; the first is in this row and column."""
    parts: list[NDArray[np.float64]] = []
    for start in range(0, len(cells), _FEW):
        few = cells[start : start + _FEW]
        quick = numbers_of(few)
        if quick is None:
            quick = np.full(len(few), np.nan)
            for at, cell in enumerate(few):
                down, across = divmod(column + start + at, width)
                try:
                    quick[at] = number_of(cell.strip(), row + down, 1 + across)
                except CellError as error:
                    faults.note(row + down, error)
                    if faults.many:
                        break
        parts.append(quick)
        if faults.many:
            break
    return np.concatenate(parts)


def _ragged(row: int, cells: int, width: int, header: tuple[str, ...] | None) -> CellError:
    message = f"row {row} has {counted(cells)}, the first row {width}"
    hint = NO_COMMENT if _comment(header) else "rows of a table are equally long"
    return CellError("file-format", message, hint, (row, min(cells, width + 1)))


def cell_at(data: bytes, file: str, at: tuple[int, int]) -> Span:
    """Where a cell of a file stands, by its row and its column; a column of 0 is the whole row."""
    row, column = at
    lines = data.removeprefix(_MARK).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n", row)
    line = lines[row - 1].decode("utf-8", "replace") if row <= len(lines) else ""
    begin, end, count = 0, len(line), 1
    quoted = False
    for place, character in enumerate(line if column else ""):
        if character == '"':
            quoted = not quoted
        elif character == "," and not quoted:
            if count == column:
                end = place
                break
            begin, count = place + 1, count + 1
    cell = line[begin:end]
    begin += (len(cell) - len(cell.lstrip())) % (len(cell) + 1)
    return Span(file, row, begin + 1, row, max(begin + 1, begin + len(cell.strip())) + 1)


def _comment(header: tuple[str, ...] | None) -> bool:
    """Whether the first row was meant as a comment."""
    return header is not None and header[0].startswith("#")


def empty() -> CellError:
    """What is wrong with a file without a row."""
    return CellError("file-format", "the file is empty")
