"""Tables and edge lists from the bytes of a ``.csv`` file.

In: bytes. Out: numbers in rows, or edges. A fault is a CellError that names row and column as an editor or a
spreadsheet counts them (from 1, the header included).
"""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import nearest

_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
_PLAIN: Final = b"0123456789+-.eE,\r\n "
_LONGEST_NUMBER: Final = 1000
_EDGE_COLUMNS: Final = ("from", "to", "weight", "delay")
_LARGEST_DELAY: Final = 2**31 - 1


class CellError(ValueError):
    """What is wrong with a file: a finding's code, a sentence that names row and column, and perhaps a hint."""

    def __init__(self, code: str, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.hint = hint


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Numbers (rows × columns; NaN where not ``present``), and the names of the columns, if any."""

    values: NDArray[np.float64]
    present: NDArray[np.bool_]
    header: tuple[str, ...] | None


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTable:
    """A list of edges, one an index. ``rows`` are the rows of the file in which they stand, from 1; a delay is None
    where the file gives none. ``digest`` is the SHA-256 of the file's bytes, in hex."""

    sources: tuple[str, ...]
    targets: tuple[str, ...]
    weights: NDArray[np.float64]
    delays: tuple[int | None, ...]
    rows: tuple[int, ...]
    digest: str


@dataclass(frozen=True, slots=True)
class _Row:
    number: int
    cells: list[str]


def parse_rows(data: bytes) -> list[_Row]:
    """The cells of a file, row by row, blanks around them removed; empty rows at the end are none. Raises CellError."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise CellError("invalid-utf8", f"row {line} is not UTF-8", "save the file as UTF-8") from error
    rows: list[_Row] = []
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for cells in reader:
            rows.append(_Row(reader.line_num, [cell.strip() for cell in cells]))
    except csv.Error as error:
        raise CellError("file-format", f"row {reader.line_num} is no CSV: {error}") from error
    while rows and not rows[-1].cells:
        rows.pop()
    if not rows:
        raise CellError("file-format", "the file is empty")
    return rows


def parse_numbers(data: bytes) -> Rows:
    """Numbers in rows of one width, after a header of texts, if there is one. Raises CellError."""
    plain = _parse_plain(data)
    if plain is not None:
        return plain
    rows = parse_rows(data)
    width = len(rows[0].cells)
    header = _header(rows[0])
    body = rows if header is None else rows[1:]
    if not body:
        raise CellError("file-format", "there is a header but no row of numbers")
    values = np.empty((len(body), width))
    for index, row in enumerate(body):
        cells = row.cells or [""]  # an empty line of a file with one column is an empty cell
        if len(cells) != width:
            message = f"row {row.number} has {_count(len(cells))}, the first row {width}"
            raise CellError("file-format", message, "rows of a table are equally long")
        values[index] = [_number(cell, row.number, column) for column, cell in enumerate(cells, 1)]
    return Rows(values, ~np.isnan(values), header)


def _parse_plain(data: bytes) -> Rows | None:
    """The quick way for a file of nothing but digits, signs, commas and line ends; None leaves it to the slow one."""
    if not data.strip() or data.translate(None, _PLAIN) or re.search(rb"\n\s*\n|\r(?!\n)|,\s*,|,\s*\n|\n\s*,", data):
        return None
    try:
        values = np.loadtxt(io.BytesIO(data), delimiter=",", ndmin=2, comments=None, dtype=np.float64)
    except (ValueError, OverflowError):
        return None
    return Rows(values, np.ones(values.shape, dtype=np.bool_), None) if np.isfinite(values).all() else None


def _header(row: _Row) -> tuple[str, ...] | None:
    """The first row if it is one of texts: no cell of it is a number, and one at least is not empty."""
    if any(_NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell) for cell in row.cells) or not any(row.cells):
        return None
    return tuple(row.cells)


def _number(cell: str, row: int, column: int) -> float:
    """A cell's number, NaN for an empty cell. Raises CellError."""
    if not cell:
        return math.nan
    place = f"row {row}, column {column}"
    if _NOT_FINITE.fullmatch(cell):
        raise CellError("not-finite", f"{place}: '{cell}' is not finite", "an empty cell means that there is none")
    if not _NUMBER.fullmatch(cell) or len(cell) > _LONGEST_NUMBER:
        hint = "columns are separated by commas" if ";" in cell or "\t" in cell else None
        raise CellError("file-format", f"{place}: {_quoted(cell)} is no number", hint)
    value = float(cell)
    if not math.isfinite(value):
        raise CellError("not-finite", f"{place}: {_quoted(cell)} is beyond double precision")
    return value


def parse_edges(rows: list[_Row], digest: str) -> EdgeTable:
    """EdgeTable from rows whose first one names the columns, in any order. Raises CellError."""
    names = [cell.casefold() for cell in rows[0].cells]
    places = _edge_columns(names)
    sources: list[str] = []
    targets: list[str] = []
    weights: list[float] = []
    delays: list[int | None] = []
    for row in rows[1:]:
        if len(row.cells) != len(names):
            raise CellError("file-format", f"row {row.number} has {_count(len(row.cells))}, the header {len(names)}")
        for ends, name in ((sources, "from"), (targets, "to")):
            column = places[name]
            if not row.cells[column]:
                raise CellError("file-format", f"row {row.number}, column {column + 1}: the name of a neuron is wanted")
            ends.append(row.cells[column])
        weight = _number(row.cells[places["weight"]], row.number, places["weight"] + 1)
        weights.append(1.0 if math.isnan(weight) else weight)
        delays.append(_delay(row, places["delay"]) if "delay" in places else None)
    numbers = tuple(row.number for row in rows[1:])
    return EdgeTable(
        tuple(sources), tuple(targets), np.array(weights, dtype=np.float64), tuple(delays), numbers, digest
    )


def _edge_columns(names: list[str]) -> dict[str, int]:
    for column, name in enumerate(names, 1):
        if name not in _EDGE_COLUMNS:
            close = nearest(name, _EDGE_COLUMNS, 1)
            hint = f"did you mean '{close[0]}'?" if close else "the columns are from, to, weight and perhaps delay"
            raise CellError("file-format", f"row 1, column {column}: no column is called {_quoted(name)}", hint)
        if names.index(name) != column - 1:
            raise CellError("file-format", f"row 1, column {column}: '{name}' is there twice")
    missing = [name for name in _EDGE_COLUMNS[:3] if name not in names]
    if missing:
        message = f"there is no column '{missing[0]}'"
        raise CellError("file-format", message, "the first row is 'from,to,weight' or 'from,to,weight,delay'")
    return {name: column for column, name in enumerate(names)}


def _delay(row: _Row, column: int) -> int | None:
    value = _number(row.cells[column], row.number, column + 1)
    if math.isnan(value):
        return None
    if value < 0 or value != int(value) or value > _LARGEST_DELAY:
        cell = _quoted(row.cells[column])
        raise CellError("file-format", f"row {row.number}, column {column + 1}: {cell} is no delay (0, 1, 2, … steps)")
    return int(value)


def _count(cells: int) -> str:
    return "1 cell" if cells == 1 else f"{cells} cells"


def _quoted(text: str) -> str:
    return f"'{text if len(text) <= 40 else text[:38] + '…'}'"
