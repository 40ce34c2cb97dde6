"""Tables and edge lists from the bytes of a ``.csv`` file.

In: bytes. Out: numbers in rows, or edges. A fault is a CellError that names row and column as an editor or a
spreadsheet counts them (from 1, the header included).
"""

from __future__ import annotations

import csv
import io
import math
import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import nearest
from neurovis_spec.language.data_files_table import CellError, Table, check_cells, full, quoted

_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
_UNEVEN: Final = re.compile(rb"(?:\A|\n)\s*\n|\r(?!\n)|,\s*,|,\s*\n|\n\s*,")
_PLAIN: Final = b"0123456789+-.eE,\r\n "
_LONGEST_NUMBER: Final = 1000
_EDGE_COLUMNS: Final = ("from", "to", "weight", "delay")
_LARGEST_DELAY: Final = 2**31 - 1


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTable:
    """A list of edges, one an index. ``rows`` are the rows of the file in which they stand, from 1; a delay is −1
    where the file gives none."""

    sources: tuple[str, ...]
    targets: tuple[str, ...]
    weights: NDArray[np.float64]
    delays: NDArray[np.int64]
    rows: NDArray[np.int64]


class _Row(NamedTuple):
    number: int
    cells: list[str]


def parse_rows(data: bytes) -> Iterator[_Row]:
    """The cells of a file, row by row, blanks around them removed; empty rows at the end are none. Raises CellError."""
    reader = csv.reader(io.TextIOWrapper(io.BytesIO(data.rstrip(b"\r\n")), "utf-8-sig", newline=""), strict=True)
    try:
        for cells in reader:
            yield _Row(reader.line_num, [cell.strip() for cell in cells])
    except UnicodeDecodeError:
        raise _not_utf8(data) from None
    except csv.Error as error:
        raise CellError("file-format", f"row {reader.line_num} is no CSV: {error}") from error
    if not reader.line_num:
        raise CellError("file-format", "the file is empty")


def _not_utf8(data: bytes) -> CellError:
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        return CellError("invalid-utf8", f"row {line} is not UTF-8", "save the file as UTF-8")
    raise AssertionError("what could not be decoded in parts cannot be decoded as a whole")


def parse_numbers(data: bytes) -> Table:
    """Numbers in rows of one width, after a header of texts, if there is one. Raises CellError."""
    data = data.rstrip(b"\r\n")
    # the separators bound the cells, before any are made
    check_cells(1 + data.count(b",") + max(data.count(b"\n"), data.count(b"\r")))
    plain = _parse_plain(data)
    if plain is not None:
        return plain
    numbers = array("d")
    width, header = 0, None
    for row in parse_rows(data):
        if not width:
            width = len(row.cells) or 1
            header = _header(row)
            if header is not None:
                continue
        cells = row.cells or [""]  # an empty line of a file with one column is an empty cell
        if len(cells) != width:
            message = f"row {row.number} has {_count(len(cells))}, the first row {width}"
            raise CellError("file-format", message, "rows of a table are equally long")
        numbers.extend([_number(cell, row.number, column) for column, cell in enumerate(cells, 1)])
    if not numbers:
        raise CellError("file-format", "there is a header but no row of numbers")
    values = np.array(numbers, dtype=np.float64).reshape(-1, width)
    return Table(values, ~np.isnan(values), header)


def _parse_plain(data: bytes) -> Table | None:
    """The quick way for a file of nothing but digits, signs, commas and line ends; None leaves it to the slow one."""
    if not data or data.translate(None, _PLAIN) or _UNEVEN.search(data):
        return None
    try:
        values = np.loadtxt(io.BytesIO(data), delimiter=",", ndmin=2, comments=None, dtype=np.float64)
    except (ValueError, OverflowError):
        return None
    return full(values) if np.isfinite(values).all() else None


def _header(row: _Row) -> tuple[str, ...] | None:
    """The first row if it is one of texts: no cell of it is a number, and one at least is not empty."""
    if any(_NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell) for cell in row.cells) or not any(row.cells):
        return None
    return tuple(row.cells)


def _number(cell: str, row: int, column: int) -> float:
    """A cell's number, NaN for an empty cell. Raises CellError."""
    if not cell:
        return math.nan
    plain = len(cell) <= _LONGEST_NUMBER and _NUMBER.fullmatch(cell)
    if plain and math.isfinite(value := float(cell)):
        return value
    place = f"row {row}, column {column}"
    if plain:
        raise CellError("not-finite", f"{place}: {quoted(cell)} is beyond double precision")
    if _NOT_FINITE.fullmatch(cell):
        raise CellError("not-finite", f"{place}: '{cell}' is not finite", "an empty cell means that there is none")
    hint = "columns are separated by commas" if ";" in cell or "\t" in cell else None
    raise CellError("file-format", f"{place}: {quoted(cell)} is no number", hint)


def parse_edges(rows: Iterable[_Row]) -> EdgeTable:
    """EdgeTable from rows whose first one names the columns, in any order. Raises CellError."""
    rows = iter(rows)
    names = [cell.casefold() for cell in next(rows).cells]
    places = _edge_columns(names)
    known: dict[str, str] = {}
    ends: dict[str, list[str]] = {"from": [], "to": []}
    weights, delays, numbers = array("d"), array("q"), array("q")
    for row in rows:
        if len(row.cells) != len(names):
            raise CellError("file-format", f"row {row.number} has {_count(len(row.cells))}, the header {len(names)}")
        for end, called in ends.items():
            cell = row.cells[places[end]]
            if not cell:
                message = f"row {row.number}, column {places[end] + 1}: the name of a neuron is wanted"
                raise CellError("file-format", message)
            called.append(known.setdefault(cell, cell))  # one text for all edges of a neuron
        weight = _number(row.cells[places["weight"]], row.number, places["weight"] + 1)
        weights.append(1.0 if math.isnan(weight) else weight)
        delays.append(_delay(row, places["delay"]) if "delay" in places else -1)
        numbers.append(row.number)
    return EdgeTable(
        tuple(ends["from"]),
        tuple(ends["to"]),
        np.array(weights, dtype=np.float64),
        np.array(delays, dtype=np.int64),
        np.array(numbers, dtype=np.int64),
    )


def _edge_columns(names: list[str]) -> dict[str, int]:
    for column, name in enumerate(names, 1):
        if name not in _EDGE_COLUMNS:
            close = nearest(name, _EDGE_COLUMNS, 1)
            hint = f"did you mean '{close[0]}'?" if close else "the columns are from, to, weight and perhaps delay"
            raise CellError("file-format", f"row 1, column {column}: no column is called {quoted(name)}", hint)
        if names.index(name) != column - 1:
            raise CellError("file-format", f"row 1, column {column}: '{name}' is there twice")
    missing = [name for name in _EDGE_COLUMNS[:3] if name not in names]
    if missing:
        message = f"there is no column '{missing[0]}'"
        raise CellError("file-format", message, "the first row is 'from,to,weight' or 'from,to,weight,delay'")
    return {name: column for column, name in enumerate(names)}


def _delay(row: _Row, column: int) -> int:
    value = _number(row.cells[column], row.number, column + 1)
    if math.isnan(value):
        return -1
    if value < 0 or value != int(value) or value > _LARGEST_DELAY:
        cell = quoted(row.cells[column])
        raise CellError("file-format", f"row {row.number}, column {column + 1}: {cell} is no delay (0, 1, 2, … steps)")
    return int(value)


def _count(cells: int) -> str:
    return "1 cell" if cells == 1 else f"{cells} cells"
