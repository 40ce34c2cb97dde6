"""Lists of edges from the bytes of a ``.csv`` file.

In: bytes. Out: EdgeTable. A fault is a CellError that names row and column, from 1, the header included. Rows are taken
many at a time, column by column; they are checked one by one only among the few where something is wrong.
"""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.cells import (
    NO_COMMENT,
    Row,
    below,
    count_lines,
    counted,
    number_of,
    numbers_of,
    plain_text,
    rows_of,
    separated,
)
from neurovis_spec.language.data.table import CellError, Faults, Room, in_cell, in_row, quoted
from neurovis_spec.likeness import nearest

_COLUMNS: Final = ("from", "to", "weight", "delay")
_LARGEST_DELAY: Final = 2**31 - 1
#: cells of the first row; a header has four at most, and a few more may be a mistake to be named
_MOST_CELLS: Final = 100
_HINT: Final = "the first row is 'from,to', 'from,to,weight' or 'from,to,weight,delay'"


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTable:
    """A list of edges, one an index. ``rows`` are the rows of the file in which they stand, from 1; a delay is −1
    where the file gives none. ``fault`` is the first that is wrong with its rows, and holds the others: then edges are
    missing, and a weight or delay invalid is as if it were not given."""

    sources: tuple[str, ...]
    targets: tuple[str, ...]
    weights: NDArray[np.float64]
    delays: NDArray[np.int64]
    rows: NDArray[np.int64]
    fault: CellError | None = None


def parse_edges(data: bytes, room: Room | None = None) -> EdgeTable:
    """EdgeTable from rows whose first one names the columns, in any order. ``room`` is asked with the number of edges
    before any is made. Raises CellError where not a row is invalid but the header, or the file as a whole."""
    data = data.rstrip(b"\r\n")
    if room is not None:
        room(count_lines(data))
    text = plain_text(data)
    cells = 1 + text.count(b",", 0, text.find(b"\n") % (len(text) + 1))
    if cells > _MOST_CELLS:
        raise in_row(1, f"has {cells:,} cells", _HINT)
    first = next(rows_of(text))
    reader = _Reader(_columns(first.stripped().cells))
    try:
        for number, lines in below(text, first.number):
            reader.take(lines, number)
            if reader.faults.many:
                break
    except CellError as error:
        reader.faults.note(error)
    return reader.table()


def _columns(header: list[str]) -> dict[str, int]:
    """Where each column stands. Raises CellError."""
    names = [cell.casefold() for cell in header]
    for column, name in enumerate(names, 1):
        if name not in _COLUMNS:
            close = nearest(name, _COLUMNS, 1)
            hint = f"did you mean '{close[0]}'?" if close else "the columns are from, to, weight and perhaps delay"
            if name.startswith("#"):
                hint = NO_COMMENT
            elif separated(name):
                hint = f"{separated(name)}; {_HINT}"
            raise in_cell(1, column, f"no column is called {quoted(name)}", hint)
        if names.index(name) != column - 1:
            raise in_cell(1, column, f"'{name}' is there twice")
    missing = [name for name in _COLUMNS[:2] if name not in names]
    if missing:
        raise CellError("file-format", f"there is no column '{missing[0]}'", _HINT)
    return {name: column for column, name in enumerate(names)}


class _Reader:
    """Takes the rows after the header, and gives the table of all of them; what is wrong with them is reported."""

    def __init__(self, places: dict[str, int]) -> None:
        self.faults = Faults()
        self._places = places
        self._known: dict[str, str] = {}
        self._sources: list[str] = []
        self._targets: list[str] = []
        self._weights, self._delays, self._rows = array("d"), array("q"), array("q")

    def table(self) -> EdgeTable:
        """The table of all rows taken so far."""
        return EdgeTable(
            tuple(self._sources),
            tuple(self._targets),
            np.array(self._weights, dtype=np.float64),
            np.array(self._delays, dtype=np.int64),
            np.array(self._rows, dtype=np.int64),
            self.faults.first(),
        )

    def take(self, lines: bytes, number: int) -> None:
        """Take lines, of which the first has this number. Raises CellError where there is no reading on."""
        width, count = len(self._places), lines.count(b"\n") + 1
        if b'"' not in lines and all(line.count(b",") == width - 1 for line in lines.split(b"\n")):
            cells = lines.decode("utf-8").replace("\n", ",").split(",")
            if self._quickly({name: cells[at::width] for name, at in self._places.items()}, number, count):
                return
        for row in rows_of(lines, number):
            self._one(row.stripped())
            if self.faults.many:
                return

    def _quickly(self, columns: dict[str, list[str]], number: int, count: int) -> bool:
        """Take rows, column by column; False, and none is taken, where one of them is invalid or may be."""
        sources, targets = ([cell.strip() for cell in columns[end]] for end in ("from", "to"))
        weights, delays = (
            numbers_of(",".join(columns[name]).encode()) if name in columns else np.full(count, math.nan)
            for name in ("weight", "delay")
        )
        if weights is None or delays is None or not all(sources) or not all(targets):
            return False
        given = delays[~np.isnan(delays)]
        if not np.array_equal(given, np.clip(np.floor(given), 0, _LARGEST_DELAY)):
            return False
        self._sources += map(self._known.setdefault, sources, sources)  # one text for all edges of a neuron
        self._targets += map(self._known.setdefault, targets, targets)
        self._weights.frombytes(np.where(np.isnan(weights), 1.0, weights).tobytes())
        self._delays.frombytes(np.where(np.isnan(delays), -1, delays).astype(np.int64).tobytes())
        self._rows.extend(range(number, number + count))
        return True

    def _one(self, row: Row) -> None:
        """Take one row, or what of it is in order."""
        number, cells = row
        if len(cells) != len(self._places):
            self.faults.note(in_row(number, f"has {counted(len(cells))}, the header {len(self._places)}"))
            return
        ends = [cells[self._places[end]] for end in ("from", "to")]
        for column in sorted(self._places[end] for end in ("from", "to")):
            if not cells[column]:
                self.faults.note(in_cell(number, column + 1, "the name of a neuron is wanted"))
        weight, delay = (self._number(number, cells, name) for name in ("weight", "delay"))
        if all(ends):
            self._sources.append(self._known.setdefault(ends[0], ends[0]))
            self._targets.append(self._known.setdefault(ends[1], ends[1]))
            self._weights.append(1.0 if math.isnan(weight) else weight)
            self._delays.append(-1 if math.isnan(delay) else int(delay))
            self._rows.append(number)

    def _number(self, row: int, cells: list[str], name: str) -> float:
        """What a row has in the column of this name; NaN where that is nothing, or invalid, which is reported."""
        column = self._places.get(name)
        if column is None:
            return math.nan
        try:
            value = number_of(cells[column], row, column + 1)
            if name == "delay" and not math.isnan(value) and not (value.is_integer() and 0 <= value <= _LARGEST_DELAY):
                raise in_cell(row, column + 1, f"{quoted(cells[column])} is no delay (0, 1, 2, … steps)")
        except CellError as error:
            self.faults.note(error)
            return math.nan
        return value
