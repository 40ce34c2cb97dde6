"""Lists of edges from the bytes of a ``.csv`` file.

In: bytes, in parts, which are let go as they are read. Out: EdgeTable. A fault is a CellError that names row and
column, from 1, the header included. Rows are taken many at a time, column by column; they are checked one by one only
among the few where something is wrong.
"""

from __future__ import annotations

import itertools
import math
from array import array
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntColumn, integers, narrow
from neurovis_spec.language.data.cells import (
    NO_COMMENT,
    Row,
    below,
    check_text,
    count_lines,
    counted,
    first_row,
    given_up,
    number_of,
    numbers_of,
    rows_of,
    separated,
    strip_end,
    text_of,
)
from neurovis_spec.language.data.table import CellError, Faults, Room, in_cell, in_row, quoted
from neurovis_spec.likeness import nearest

_COLUMNS: Final = ("from", "to", "weight", "delay", "delay_seconds")
_LARGEST_DELAY: Final = 2**31 - 1
#: cells of the first row; a header has five at most, and a few more may be a mistake to be named
_MOST_CELLS: Final = 100
_NO_MARKS: Final = bytes(set(range(256)) - set(b",\n"))
#: names are looked up by so many words of eight bytes, at one of so many places
_WORDS: Final = 4
_PLACES: Final = 1 << 19
#: spellings of names for which there is room at first
_FIRST_ROOM: Final = 1 << 10
#: what of a word belongs to a name of which so many bytes are left
_MASKS: Final = np.array([(1 << 8 * size) - 1 for size in range(9)], dtype=np.uint64)
#: odd numbers that spread words over places (the golden ratio's, as in Knuth 6.4, and powers of it)
_SPREAD: Final = [np.uint64(pow(0x9E3779B97F4A7C15, power, 1 << 64)) for power in range(1, _WORDS + 1)]
_HINT: Final = "the first row is 'from,to', 'from,to,weight' or 'from,to,weight,delay'"
_ALL: Final = "the columns are from, to, weight and perhaps delay or delay_seconds"
#: the columns of numbers
_NUMBERS: Final = _COLUMNS[2:]


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTable:
    """A list of edges, one an index: from ``names[begins[i]]`` to ``names[ends[i]]``. A delay is −1 where the file
    gives none in steps; ``seconds`` are those in seconds, NaN where it gives none, None without a column of them;
    ``offsets`` is what has to be added to an edge's index for its row in the file. ``fault`` is the first that is wrong
    with its rows, and holds the others: then edges are missing, and a weight or delay invalid is as if it were not
    given."""

    names: tuple[str, ...]
    begins: Indices
    ends: Indices
    weights: FloatArray
    delays: IntColumn
    offsets: IntColumn
    fault: CellError | None = None
    seconds: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.begins)

    def row(self, edge: int) -> int:
        """The row of the file in which an edge stands, from 1."""
        return edge + int(self.offsets[edge])

    @property
    def sources(self) -> tuple[str, ...]:
        """The name at which each edge begins."""
        return tuple(map(self.names.__getitem__, self.begins.tolist()))

    @property
    def targets(self) -> tuple[str, ...]:
        """The name at which each edge ends."""
        return tuple(map(self.names.__getitem__, self.ends.tolist()))


def parse_edges(parts: list[bytes], room: Room | None = None) -> EdgeTable:
    """EdgeTable from rows whose first one names the columns, in any order. ``room`` is asked with the number of edges
    before any is made. Raises CellError where not a row is invalid but the header, or the file as a whole."""
    strip_end(parts)
    most = count_lines(text_of(parts))
    if room is not None:
        room(most)
    check_text(text_of(parts))
    cells = 1 + next(text_of(parts)).partition(b"\n")[0].count(b",")
    if cells > _MOST_CELLS:
        raise in_row(1, f"has {cells:,} cells", _HINT)
    first = first_row(text_of(parts))
    reader = _Reader(_columns(first.stripped().cells), most)
    try:
        for number, lines in below(text_of(given_up(parts)), first.number):
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
            hint = f"did you mean '{close[0]}'?" if close else _ALL
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

    text: npt.NDArray[np.uint8]
    begins: npt.NDArray[np.int64]
    ends: npt.NDArray[np.int64]

    def words(self) -> list[npt.NDArray[np.uint64]]:
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

    Many cells are looked up at once, by their bytes, in a table with one place for all spellings that fall on it: which
    came first has it, the others are looked up one by one, as is each when it comes first."""

    def __init__(self) -> None:
        self.known: list[str] = []
        self._numbers: dict[str, int] = {"": -1}
        #: which spelling is at each place; 0: none
        self._at = np.zeros(_PLACES, dtype=np.int32)
        #: of each spelling at a place its words, and the number of the name
        self._words = np.zeros((_WORDS, _FIRST_ROOM), dtype=np.uint64)
        self._number = np.full(_FIRST_ROOM, -1, dtype=np.int32)
        self._spellings = 1
        #: the most words that any name has
        self._most = 0

    def __getitem__(self, written: str) -> int:
        name = written.strip()
        number = self._numbers.setdefault(name, len(self.known))
        if number == len(self.known):
            self.known.append(name)
        return number

    def of(self, cells: _Cells) -> npt.NDArray[np.int32]:
        """The number of the name in each cell."""
        words = cells.words()
        mixed = words[0] * _SPREAD[0]
        for word, spread in zip(words[1:], _SPREAD[1:], strict=False):
            mixed += word * spread
        places = (mixed >> np.uint64(64 - _PLACES.bit_length() + 1)).astype(np.int64)
        spellings = self._at[places]
        numbers = self._number[spellings]
        other = (numbers < 0) | (cells.ends - cells.begins > 8 * _WORDS)
        self._most = max(self._most, len(words))
        for word, held in itertools.zip_longest(words, self._words[: self._most]):
            other |= held[spellings] != (0 if word is None else word)
        for cell in np.flatnonzero(other).tolist():
            written = cells.text[cells.begins[cell] : cells.ends[cell]].tobytes()
            number, place = self[written.decode("utf-8")], int(places[cell])
            numbers[cell] = number
            if number >= 0 and len(written) <= 8 * _WORDS and not self._at[place]:
                self._at[place] = self._spelling([word[cell] for word in words], number)
        return numbers

    def _spelling(self, words: list[np.uint64], number: int) -> int:
        """Keep a spelling of the name of this number, by its words."""
        kept = self._spellings
        if kept == len(self._number):  # twice the room
            self._words = np.concatenate((self._words, np.zeros_like(self._words)), axis=1)
            self._number = np.concatenate((self._number, self._number))
        self._words[: len(words), kept] = words
        self._number[kept] = number
        self._spellings += 1
        return kept


def _in_brief(numbers: npt.NDArray[Any]) -> Indices:
    """Integers as narrow as they fit, only one of them where all are equal."""
    kept = narrow(numbers.astype(np.int64))
    return np.broadcast_to(kept[0], kept.shape) if (kept == kept[0]).all() else kept


def _are_delays(steps: FloatArray, seconds: FloatArray) -> bool:
    """Whether these are delays, of each edge one at most; NaN where none is given."""
    given = steps[~np.isnan(steps)]
    if not np.array_equal(given, np.clip(np.floor(given), 0, _LARGEST_DELAY)):
        return False
    return not ((seconds < 0) | ~(np.isnan(steps) | np.isnan(seconds))).any()


class _Reader:
    """Takes the rows after the header, and gives the table of all of them; what is wrong with them is reported."""

    def __init__(self, places: dict[str, int], most: int) -> None:
        """``most``: how many edges there may be."""
        self.faults = Faults()
        self._places = places
        self._names = _Names()
        self._count = 0
        self._begins, self._ends = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int32)
        self._weights = np.empty(most)
        self._seconds = np.empty(most) if "delay_seconds" in places else None
        #: those of some edges after the other
        self._delays: list[Indices] = []
        self._offsets: list[Indices] = []
        #: edges that were taken one by one since: where they begin and end, weight, delay, that in seconds, row
        self._singles = array("d")

    def table(self) -> EdgeTable:
        """The table of all rows taken so far."""
        self._add_singles()
        return EdgeTable(
            names=tuple(self._names.known),
            begins=narrow(self._begins[: self._count]),
            ends=narrow(self._ends[: self._count]),
            weights=self._weights[: self._count],
            delays=integers(*self._delays),
            offsets=integers(*self._offsets),
            fault=self.faults.first(),
            seconds=None if self._seconds is None else self._seconds[: self._count],
        )

    def _add(self, *columns: npt.NDArray[Any]) -> None:
        """Add edges: where they begin and end, weights, delays, those in seconds, rows."""
        begins, ends, weights, delays, seconds, rows = columns
        at = slice(self._count, self._count + len(rows))
        self._begins[at], self._ends[at], self._weights[at] = begins, ends, weights
        if self._seconds is not None:
            self._seconds[at] = seconds
        self._delays.append(_in_brief(delays))
        self._offsets.append(_in_brief(rows - np.arange(at.start, at.stop)))
        self._count = at.stop

    def _add_singles(self) -> None:
        """Add what was taken one by one."""
        if self._singles:
            self._add(*np.array(self._singles).reshape(-1, 6).T)
            del self._singles[:]

    def take(self, lines: bytes, number: int) -> None:
        """Take lines, of which the first has this number. Raises CellError where there is no reading on."""
        width, marks = len(self._places), lines.translate(None, _NO_MARKS) + b"\n"
        count = len(marks) // width
        if b'"' not in lines and marks == (b"," * (width - 1) + b"\n") * count:
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
        found = [
            numbers_of(columns[name].joined()) if name in columns else np.broadcast_to(np.nan, (count,))
            for name in _NUMBERS
        ]
        numbers = [one for one in found if one is not None]
        if len(numbers) < len(found) or not _are_delays(*numbers[1:]):
            return False
        begins, ends = self._names.of(columns["from"]), self._names.of(columns["to"])
        if min(begins.min(), ends.min()) < 0:
            return False
        weights, steps, seconds = numbers
        weights, steps = np.where(np.isnan(weights), 1.0, weights), np.where(np.isnan(steps), -1.0, steps)
        self._add_singles()
        self._add(begins, ends, weights, steps, seconds, np.arange(number, number + count))
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
        weight, steps, seconds = (self._number(number, cells, name) for name in _NUMBERS)
        if not (math.isnan(steps) or math.isnan(seconds)):
            column = self._places["delay_seconds"] + 1
            self.faults.note(in_cell(number, column, "a delay in steps stands in this row, too"))
        if all(ends):
            begin, end = (self._names[name] for name in ends)
            weight, steps = 1.0 if math.isnan(weight) else weight, -1.0 if math.isnan(steps) else steps
            self._singles.extend((begin, end, weight, steps, seconds, number))

    def _number(self, row: int, cells: list[str], name: str) -> float:
        """What a row has in the column of this name; NaN where that is nothing, or invalid, which is reported."""
        column = self._places.get(name)
        if column is None:
            return math.nan
        try:
            value = number_of(cells[column], row, column + 1)
            if name == "delay" and not math.isnan(value) and not (value.is_integer() and 0 <= value <= _LARGEST_DELAY):
                raise in_cell(row, column + 1, f"{quoted(cells[column])} is no delay (0, 1, 2, … steps)")
            if name == "delay_seconds" and value < 0:
                raise in_cell(row, column + 1, f"{quoted(cells[column])} is no delay: it is at least 0 seconds")
        except CellError as error:
            self.faults.note(error)
            return math.nan
        return value
