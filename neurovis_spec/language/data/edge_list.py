"""Lists of edges from the bytes of a ``.csv`` file.

In: bytes. Out: EdgeTable. A fault is a CellError that names row and column, from 1, the header included. Rows are taken
many at a time, column by column; they are checked one by one only among the few where something is wrong.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import nearest
from neurovis_spec.language.data.cells import counted, number_of, numbers_of, separated
from neurovis_spec.language.data.csv_table import NO_COMMENT, Row, batches, plain_lines, read_rows
from neurovis_spec.language.data.table import CellError, Faults, Room, quoted

T = TypeVar("T")
_COLUMNS: Final = ("from", "to", "weight", "delay")
_LARGEST_DELAY: Final = 2**31 - 1
#: separators in the first line; a header has three at most, and a few more may be a mistake to be named
_MOST_SEPARATORS: Final = 100
#: bytes above which rows of the wrong length are told alone
_LARGE: Final = 1 << 20
#: bytes of rows that are taken together
_STRETCH: Final = 1 << 18


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
        room(max(data.count(b"\n"), data.count(b"\r")))
    header = min(data.find(end) % (len(data) + 1) for end in (b"\n", b"\r"))
    separators = data.count(b",", 0, header)
    if separators > _MOST_SEPARATORS:
        raise CellError("file-format", f"row 1 has {separators + 1:,} cells", _hint())
    if b'"' in data:
        rows = read_rows(data)
        reader = _Reader(next(rows))
        try:
            for batch in batches(rows):
                reader.take(batch)
        except CellError as error:  # there is nothing behind it
            reader.faults.note(len(data), error)
    else:
        plain = plain_lines(data)
        lines = _lines(plain)
        number, first = next(lines)
        reader = _Reader(Row(number, first.split(",")))
        even = plain.count(b",") == reader.separators * (plain.count(b"\n") + 1)
        # a large file that some row of spoils is not read to where that is
        take = reader.take_lines if even or len(data) <= _LARGE else reader.take_odd
        for number, text in lines:
            take(text, number)
            if reader.faults.many:
                break
    return reader.table()


def _lines(data: bytes) -> Iterator[tuple[int, str]]:
    """The lines of a file without quotes, each time with the number of the first: one, then many together."""
    start, number = 0, 1
    while start <= len(data):
        stop = data.find(b"\n", start if number == 1 else start + _STRETCH) % (len(data) + 1)
        text = data[start:stop].decode("utf-8")
        yield number, text
        start, number = stop + 1, number + 1 + text.count("\n")


def _hint() -> str:
    return "the first row is 'from,to', 'from,to,weight' or 'from,to,weight,delay'"


def _columns(header: Row) -> dict[str, int]:
    """Where each column stands. Raises CellError."""
    names = [cell.casefold() for cell in header.stripped().cells]
    for column, name in enumerate(names, 1):
        if name not in _COLUMNS:
            close = nearest(name, _COLUMNS, 1)
            hint = f"did you mean '{close[0]}'?" if close else "the columns are from, to, weight and perhaps delay"
            if name.startswith("#"):
                hint = NO_COMMENT
            elif separated(name):
                hint = f"{separated(name)}; {_hint()}"
            raise CellError("file-format", f"row 1, column {column}: no column is called {quoted(name)}", hint)
        if names.index(name) != column - 1:
            raise CellError("file-format", f"row 1, column {column}: '{name}' is there twice")
    missing = [name for name in _COLUMNS[:2] if name not in names]
    if missing:
        raise CellError("file-format", f"there is no column '{missing[0]}'", _hint())
    return {name: column for column, name in enumerate(names)}


class _Reader:
    """Takes the rows after the header, and gives the table of all of them; what is wrong with them is reported."""

    def __init__(self, header: Row) -> None:
        self.faults = Faults()
        self._places = _columns(header)
        self._known: dict[str, str] = {}
        self._sources: list[str] = []
        self._targets: list[str] = []
        self._weights, self._delays, self._rows = array("d"), array("q"), array("q")

    @property
    def separators(self) -> int:
        """How many a row has."""
        return len(self._places) - 1

    def table(self) -> EdgeTable:
        """What was taken."""
        return EdgeTable(
            tuple(self._sources),
            tuple(self._targets),
            np.array(self._weights, dtype=np.float64),
            np.array(self._delays, dtype=np.int64),
            np.array(self._rows, dtype=np.int64),
            self.faults.first(),
        )

    def take(self, batch: list[Row]) -> None:
        """Take some rows."""
        if all(len(row.cells) == len(self._places) for row in batch):
            columns = list(zip(*(row.cells for row in batch), strict=True))
            if not batch or self._quickly(columns, [row.number for row in batch]):
                return
        for row in batch:
            self._one(row)

    def take_lines(self, text: str, number: int) -> None:
        """Take lines without quotes, of which the first has this number."""
        width, lines = len(self._places), text.split("\n")
        if all(line.count(",") == width - 1 for line in lines):
            cells = text.replace("\n", ",").split(",")
            if self._quickly([cells[place::width] for place in range(width)], range(number, number + len(lines))):
                return
        for below, line in enumerate(lines):
            self._one(Row(number + below, line.split(",")))

    def take_odd(self, text: str, number: int) -> None:
        """Take only the lines that have not as many cells as the header."""
        if text.count(",") == self.separators * (text.count("\n") + 1):
            # a line with too many may make up for one with too few, but not in the file as a whole
            return
        for below, line in enumerate(text.split("\n")):
            if line.count(",") != self.separators:
                self._one(Row(number + below, line.split(",")))

    def _quickly(self, columns: Sequence[Sequence[str]], numbers: Sequence[int]) -> bool:
        """Take rows, column by column; False, and none is taken, where one of them is invalid or may be."""
        sources, targets = (list(map(str.strip, columns[self._places[end]])) for end in ("from", "to"))
        weights: NDArray[np.float64] | None = np.full(len(numbers), math.nan)
        if "weight" in self._places:
            weights = numbers_of(list(columns[self._places["weight"]]))
        delays = np.full(len(numbers), math.nan)
        if "delay" in self._places:
            given = numbers_of(list(columns[self._places["delay"]]))
            if given is None or (given < 0).any() or (given > _LARGEST_DELAY).any() or (np.mod(given, 1) > 0).any():
                return False
            delays = given
        if weights is None or not all(sources) or not all(targets):
            return False
        self._sources += map(self._known.setdefault, sources, sources)  # one text for all edges of a neuron
        self._targets += map(self._known.setdefault, targets, targets)
        self._weights.frombytes(np.where(np.isnan(weights), 1.0, weights).tobytes())
        self._delays.frombytes(np.where(np.isnan(delays), -1, delays).astype(np.int64).tobytes())
        self._rows.extend(numbers)
        return True

    def _one(self, row: Row) -> None:
        """Take one row, or what of it is in order."""
        if self.faults.many:
            return
        number, cells = row.stripped()
        if len(cells) != len(self._places):
            message = f"row {number} has {counted(len(cells))}, the header {len(self._places)}"
            self.faults.note(number, CellError("file-format", message))
            return
        named = True
        for column in (self._places["from"], self._places["to"]):
            if not cells[column]:
                message = f"row {number}, column {column + 1}: the name of a neuron is wanted"
                self.faults.note(number, CellError("file-format", message))
                named = False
        weight, delay = math.nan, -1
        if "weight" in self._places:
            column = self._places["weight"]
            weight = self._noted(number, lambda: number_of(cells[column], number, column + 1), math.nan)
        if "delay" in self._places:
            delay = self._noted(number, lambda: _delay(cells, number, self._places["delay"]), -1)
        if not named:
            return
        for end, called in (("from", self._sources), ("to", self._targets)):
            name = cells[self._places[end]]
            called.append(self._known.setdefault(name, name))
        self._weights.append(1.0 if math.isnan(weight) else weight)
        self._delays.append(delay)
        self._rows.append(number)

    def _noted(self, row: int, read: Callable[[], T], otherwise: T) -> T:
        """What a cell holds; something else where it is invalid, which is reported."""
        try:
            return read()
        except CellError as error:
            self.faults.note(row, error)
            return otherwise


def _delay(cells: list[str], row: int, column: int) -> int:
    value = number_of(cells[column], row, column + 1)
    if math.isnan(value):
        return -1
    if value < 0 or value != int(value) or value > _LARGEST_DELAY:
        message = f"row {row}, column {column + 1}: {quoted(cells[column])} is no delay (0, 1, 2, … steps)"
        raise CellError("file-format", message)
    return int(value)
