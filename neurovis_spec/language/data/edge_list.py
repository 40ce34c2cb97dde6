"""Lists of edges from the bytes of a ``.csv`` file.

In: bytes. Out: EdgeTable. A fault is a CellError that names row and column, from 1, the header included. Rows are taken
many at a time, column by column; they are checked one by one only among the few where something is wrong.
"""

from __future__ import annotations

import itertools
import math
from array import array
from dataclasses import dataclass
from typing import Final, NamedTuple

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
_NO_MARKS: Final = bytes(set(range(256)) - set(b",\n"))
#: names are looked up by so many words of eight bytes, at one of so many places
_WORDS: Final = 4
_PLACES: Final = 1 << 20
#: what of a word belongs to a name of which so many bytes are left
_MASKS: Final = np.array([(1 << 8 * size) - 1 for size in range(9)], dtype=np.uint64)
#: odd numbers that spread words over places (the golden ratio's, as in Knuth 6.4, and powers of it)
_SPREAD: Final = [np.uint64(pow(0x9E3779B97F4A7C15, power, 1 << 64)) for power in range(1, _WORDS + 1)]
_HINT: Final = "the first row is 'from,to', 'from,to,weight' or 'from,to,weight,delay'"


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTable:
    """A list of edges, one an index: from ``names[begins[i]]`` to ``names[ends[i]]``. ``rows`` are the rows of the file
    in which they stand, from 1; a delay is −1 where the file gives none. ``fault`` is the first that is wrong with its
    rows, and holds the others: then edges are missing, and a weight or delay invalid is as if it were not given."""

    names: tuple[str, ...]
    begins: NDArray[np.int32]
    ends: NDArray[np.int32]
    weights: NDArray[np.float64]
    delays: NDArray[np.int32]
    rows: NDArray[np.int32]
    fault: CellError | None = None

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def sources(self) -> tuple[str, ...]:
        """The name at which each edge begins."""
        return tuple(map(self.names.__getitem__, self.begins.tolist()))

    @property
    def targets(self) -> tuple[str, ...]:
        """The name at which each edge ends."""
        return tuple(map(self.names.__getitem__, self.ends.tolist()))


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


class _Cells(NamedTuple):
    """A column of some lines: the bytes of these, with room behind them, and where the cells begin and end."""

    text: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]

    def words(self) -> list[NDArray[np.uint64]]:
        """The cells in words of eight bytes, as far as these go."""
        at_all = np.ndarray((len(self.text) - 7,), dtype="<u8", buffer=self.text, strides=(1,))
        sizes = self.ends - self.begins
        used = min(_WORDS, max(1, -(-int(sizes.max()) // 8)))
        return [at_all[self.begins + 8 * n] & _MASKS[np.clip(sizes - 8 * n, 0, 8)] for n in range(used)]

    def joined(self) -> bytes:
        """The cells, with commas between them."""
        steps = np.zeros(len(self.text) + 1, dtype=np.int8)
        steps[self.begins] = 1
        steps[self.ends + 1] -= 1
        return self.text[np.cumsum(steps[:-1], dtype=np.int8).view(np.bool_)].tobytes().replace(b"\n", b",")[:-1]


class _Names:
    """The numbers of names, in the order in which they come; blanks around a name do not count, an empty one has −1.

    Many cells are looked up at once, by their bytes, in a table with one place for all names that fall on it: who came
    first has it, the others are looked up one by one, as is each name when it comes first."""

    def __init__(self) -> None:
        self.known: list[str] = []
        self._numbers: dict[str, int] = {"": -1}
        self._held = np.zeros((_WORDS, _PLACES), dtype=np.uint64)
        #: the number of the name at each place, and 1
        self._number = np.zeros(_PLACES, dtype=np.int32)
        #: the most words that any name has
        self._most = 0

    def __getitem__(self, written: str) -> int:
        name = written.strip()
        number = self._numbers.setdefault(name, len(self.known))
        if number == len(self.known):
            self.known.append(name)
        return number

    def of(self, cells: _Cells) -> NDArray[np.int32]:
        """The number of the name in each cell."""
        words = cells.words()
        mixed = words[0] * _SPREAD[0]
        for word, spread in zip(words[1:], _SPREAD[1:], strict=False):
            mixed += word * spread
        places = (mixed >> np.uint64(64 - _PLACES.bit_length() + 1)).astype(np.int64)
        numbers = self._number[places] - 1
        other = (numbers < 0) | (cells.ends - cells.begins > 8 * _WORDS)
        self._most = max(self._most, len(words))
        for word, held in itertools.zip_longest(words, self._held[: self._most]):
            other |= held[places] != (0 if word is None else word)
        for cell in np.flatnonzero(other).tolist():
            written = cells.text[cells.begins[cell] : cells.ends[cell]].tobytes()
            number, place = self[written.decode("utf-8")], int(places[cell])
            numbers[cell] = number
            if number >= 0 and len(written) <= 8 * _WORDS and not self._number[place]:
                self._number[place] = number + 1
                self._held[: len(words), place] = [word[cell] for word in words]
        return numbers


class _Reader:
    """Takes the rows after the header, and gives the table of all of them; what is wrong with them is reported."""

    def __init__(self, places: dict[str, int]) -> None:
        self.faults = Faults()
        self._places = places
        self._names = _Names()
        self._begins, self._ends, self._delays, self._rows = array("i"), array("i"), array("i"), array("i")
        self._weights = array("d")

    def table(self) -> EdgeTable:
        """The table of all rows taken so far."""
        begins, ends, delays, rows = (
            np.asarray(one, dtype=np.int32) for one in (self._begins, self._ends, self._delays, self._rows)
        )
        weights = np.asarray(self._weights, dtype=np.float64)
        return EdgeTable(tuple(self._names.known), begins, ends, weights, delays, rows, self.faults.first())

    def take(self, lines: bytes, number: int) -> None:
        """Take lines, of which the first has this number. Raises CellError where there is no reading on."""
        width, count = len(self._places), lines.count(b"\n") + 1
        marks = (b"," * (width - 1) + b"\n") * count
        if b'"' not in lines and lines.translate(None, _NO_MARKS) == marks[:-1]:
            text = np.frombuffer(lines + b"\n" + bytes(8 * _WORDS), dtype=np.uint8)
            ends = np.flatnonzero((text == ord(",")) | (text == ord("\n")))
            begins = np.concatenate(([0], ends[:-1] + 1))
            columns = {name: _Cells(text, begins[at::width], ends[at::width]) for name, at in self._places.items()}
            if self._quickly(columns, number, count):
                return
        for row in rows_of(lines, number):
            self._one(row.stripped())
            if self.faults.many:
                return

    def _quickly(self, columns: dict[str, _Cells], number: int, count: int) -> bool:
        """Take rows, column by column; False, and none is taken, where one of them is invalid or may be."""
        weights, delays = (
            numbers_of(columns[name].joined()) if name in columns else np.full(count, math.nan)
            for name in ("weight", "delay")
        )
        if weights is None or delays is None:
            return False
        given = delays[~np.isnan(delays)]
        if not np.array_equal(given, np.clip(np.floor(given), 0, _LARGEST_DELAY)):
            return False
        begins, ends = self._names.of(columns["from"]), self._names.of(columns["to"])
        if min(begins.min(), ends.min()) < 0:
            return False
        self._begins.frombytes(begins.tobytes())
        self._ends.frombytes(ends.tobytes())
        self._weights.frombytes(np.where(np.isnan(weights), 1.0, weights).tobytes())
        self._delays.frombytes(np.where(np.isnan(delays), -1, delays).astype(np.int32).tobytes())
        self._rows.frombytes(np.arange(number, number + count, dtype=np.int32).tobytes())
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
            self._begins.append(self._names[ends[0]])
            self._ends.append(self._names[ends[1]])
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
