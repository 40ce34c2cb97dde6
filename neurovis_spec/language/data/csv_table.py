"""Tables of numbers from the bytes of a ``.csv`` file.

In: bytes. Out: Table. A fault is a CellError that names row and column, and holds those behind it. Cells are turned
into numbers many at a time; they are checked one by one only among the few where something is wrong. A first row that
numbers its columns, as pandas writes them, is no data (``numbers_columns``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.data.cells import (
    COMMAS,
    NO_COMMENT,
    PLAIN,
    Row,
    below,
    check_text,
    count_lines,
    counted,
    first_row,
    is_number,
    number_of,
    numbers_of,
    rows_of,
    separated,
    separator_of,
    strip_end,
    text_of,
)
from neurovis_spec.language.data.table import CellError, Faults, Room, Table, check_cells, in_row

#: cells of a row among which one that is invalid is searched
_FEW: Final = 1 << 10

#: what is said of such a file where its rows are steps, and what to do
NUMBERED = "the first row, 0, 1, …, seems to number the columns; it is read as step 0"
AS_TEXTS = "remove it, or give the columns names; in pandas, that is the argument header of to_csv"
_POINT = re.compile(rb"[.eE]")
#: rows without which nothing can be said: the first one and two others
_LEAST = 3


def parse_numbers(data: bytes, room: Room | None = None) -> Table:
    """Numbers in rows of one width, after a header of texts, if there is one. Raises CellError."""
    parts = [data]
    strip_end(parts)
    most = 1 + data.count(b",") + count_lines(text_of(parts))  # the separators bound the cells, before any are made
    check_cells(most)
    if room is not None:
        room(most)
    check_text(text_of(parts))
    first = first_row(text_of(parts))
    header, width = _header(first), len(first.cells)
    values, filled, faults = np.empty(most), 0, Faults()
    try:
        for number, lines in below(text_of(parts), 0 if header is None else first.number):
            for part in _numbers(lines, number, width, header, faults):
                values[filled : filled + len(part)] = part
                filled += len(part)
            if faults.many:
                break
    except CellError as error:
        faults.note(error)
    faults.check()
    if not filled:
        hint = next(filter(None, map(separated, header or ())), None)
        raise CellError("file-format", "there is a header but no row of numbers", hint)
    table = values[:filled].reshape(-1, width)
    numbered = header is None and numbers_columns(data, table)
    return Table(table, ~np.isnan(table), header, numbered)


def parse_separated(data: bytes, path: str, room: Room | None = None) -> Table:
    """The same of a file whose cells something else than commas may separate. Raises CellError."""
    separator = separator_of([data], path) if data else COMMAS
    if separator == COMMAS:
        return parse_numbers(data, room)
    for number, lines in below(text_of([data], separator), 0):
        if b"," in lines:
            row = number + lines.count(b"\n", 0, lines.index(b","))
            raise in_row(row, f"has a comma, and {separator.noun} separate its cells", "numbers have a decimal point")
    parts = (lines.replace(separator.byte, b",") for lines in text_of([data], separator))
    return parse_numbers(b"\n".join(parts), room)


def _header(row: Row) -> tuple[str, ...] | None:
    """The first row if it is one of texts: no cell of it is a number, and one at least is not empty."""
    cells = tuple(row.stripped().cells)
    return cells if any(cells) and not any(map(is_number, cells)) else None


def _numbers(
    lines: bytes, number: int, width: int, header: tuple[str, ...] | None, faults: Faults
) -> Iterator[NDArray[np.float64]]:
    """The numbers of lines, the first of which has this number, NaN for an empty cell; what is wrong with them is
    reported. Raises CellError where there is no reading on."""
    count = lines.count(b"\n") + 1
    if lines.count(b",") == (width - 1) * count:
        marks = (b"," * (width - 1) + b"\n") * count
        plain = (lines + b"\n").translate(None, PLAIN) == marks
        quick = numbers_of(lines.replace(b"\n", b",")) if plain else None
        if quick is not None:
            yield quick
            return
    for row in rows_of(lines, number):
        if len(row.cells) == width:
            yield from _row_numbers(row, faults)
        elif header is not None and header[0].startswith("#"):  # a comment, of which the width of all rows is taken
            raise _ragged(row, width, NO_COMMENT)
        else:
            faults.note(_ragged(row, width, "rows of a table are equally long"))
        if faults.many:
            return


def _row_numbers(row: Row, faults: Faults) -> Iterator[NDArray[np.float64]]:
    """The numbers of a row, some at a time; among those where something is wrong one by one."""
    for start in range(0, len(row.cells), _FEW):
        cells = row.cells[start : start + _FEW]
        quick = numbers_of(",".join(cells).encode())
        if quick is not None and len(quick) == len(cells):
            yield quick
            continue
        for column, cell in enumerate(cells, start + 1):
            try:
                yield np.array([number_of(cell.strip(), row.number, column)])
            except CellError as error:
                faults.note(error)
            if faults.many:
                return


def _ragged(row: Row, width: int, hint: str) -> CellError:
    message = f"row {row.number} has {counted(len(row.cells))}, the first row {width}"
    return CellError("file-format", message, hint, (row.number, min(len(row.cells), width + 1)))


def cell_at(data: bytes, file: str, at: tuple[int, int]) -> Span:
    """Where a cell of a file stands, by its row and its column; a column of 0 is the whole row."""
    row, column = at
    lines = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n", row)
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


def numbers_columns(data: bytes, values: NDArray[np.float64]) -> bool:
    """Whether the first row numbers the columns.

    >>> values = np.array([[0, 1], [0.5, 0.25], [0.625, 0.125]])
    >>> [numbers_columns(first + b"\\n0.5,0.25\\n0.625,0.125", values) for first in (b"0,1", b"0.0,1.0")]
    [True, False]
    """
    rows, columns = values.shape
    if columns < 2 or rows < _LEAST or not np.array_equal(values[0], np.arange(columns)):
        return False
    first, _, rest = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").partition(b"\n")
    cells = [cell.strip(b' \t"') for cell in first.removeprefix(b"\xef\xbb\xbf").split(b",")]
    if cells != [b"%d" % column for column in range(columns)]:
        return False
    if not all(_POINT.search(cell) for cell in rest.rstrip(b"\n").replace(b"\n", b",").split(b",")):
        return False
    low, high = values[1:].min(axis=0), values[1:].max(axis=0)
    return bool((np.maximum(low - values[0], values[0] - high) > high - low).any())
