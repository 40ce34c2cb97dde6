"""Lists of edges from the bytes of a file of text.

In: bytes, in parts, which are let go as they are read; what its columns are called, and which rows count. Out:
EdgeTable. A fault is a CellError that names row and column, from 1, the header included. Rows are taken many at a time,
column by column; they are checked one by one only among the few where something is wrong.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntArray, IntColumn, Texts, integers, narrow
from neurovis_spec.language.data.cells import (
    COMMAS,
    NO_COMMENT,
    Row,
    Separator,
    below,
    check_text,
    counted,
    first_row,
    given_up,
    lines_in,
    number_of,
    rows_of,
    separated,
    separator_of,
    strip_end,
    text_of,
)
from neurovis_spec.language.data.columns import (
    Lines,
    Names,
    Picked,
    find_column,
    lines_of,
    no_column,
    picked,
    rows_picked,
)
from neurovis_spec.language.data.sheet import Sheet
from neurovis_spec.language.data.table import CellError, Faults, Room, in_cell, in_row, quoted
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import EdgeFile
from neurovis_spec.language.units import TIMES
from neurovis_spec.likeness import nearest

_COLUMNS: Final = ("from", "to", "weight", "delay", "delay_seconds")
_LARGEST_DELAY: Final = 2**31 - 1
#: cells of the first row; a header of our own has five at most, and a few more may be a mistake to be named
_MOST_CELLS: Final = 100
#: columns of a file of others
MOST_COLUMNS: Final = 1000
_HINT: Final = "the first row is 'from,to', 'from,to,weight' or 'from,to,weight,delay'"
_ALL: Final = (
    "the columns are from, to, weight and perhaps delay or delay_seconds; if they are called otherwise, write columns: "
    "{from: NAME, to: NAME}"
)
_WITH_UNIT: Final = "of times, write delay: {column: NAME, unit: ms}"
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
    #: further columns of numbers, NaN where a cell is empty, by their names, and where these stand, from 1
    more: Mapping[str, FloatArray] = field(default_factory=dict)
    columns: Mapping[str, int] = field(default_factory=dict)
    #: further columns of texts, by their names, and what all columns are called
    texts: Mapping[str, Texts] = field(default_factory=dict)
    header: tuple[str, ...] = ()
    #: what was found by looking at the file, in words; nothing of one as we write them
    about: str = ""

    def __len__(self) -> int:
        return len(self.begins)

    def row(self, edge: int) -> int:
        """The row of the file in which an edge stands, from 1."""
        return edge + int(self.offsets[edge])

    def rows(self) -> IntArray:
        """The row of each edge."""
        return np.arange(len(self)) + self.offsets.whole()

    @property
    def sources(self) -> tuple[str, ...]:
        """The name at which each edge begins."""
        return tuple(map(self.names.__getitem__, self.begins.tolist()))

    @property
    def targets(self) -> tuple[str, ...]:
        """The name at which each edge ends."""
        return tuple(map(self.names.__getitem__, self.ends.tolist()))


class Written(NamedTuple):
    """How edges stand in a file: its header, where each column that is wanted stands, by what it is for (its name,
    after "column ", of those that others read), the factor that makes its delays seconds, and which rows count."""

    header: Sequence[str]
    places: dict[str, int]
    separator: Separator = COMMAS
    unit: str | None = None
    picked: tuple[Picked, ...] = ()
    #: where further columns of texts stand, by their names
    texts: Mapping[str, int] = MappingProxyType({})

    @property
    def numbers(self) -> tuple[str, ...]:
        """What the columns of numbers are for."""
        return (*_NUMBERS, *(name for name in self.places if name.startswith(MORE)))

    def about(self, edges: int, rows: int) -> str:
        """What was found, in words, where so many edges were read of so many rows."""
        parts = [] if self.separator == COMMAS else [f"separated by {self.separator.noun}"]
        if self.picked:
            parts.append(f"{edges:,} of {rows:,} rows")
        return ", ".join(parts)

    @property
    def factor(self) -> Fraction:
        """What makes its delays seconds."""
        return TIMES[self.unit or "s"]


#: what stands before the name of a column that is of no own use to edges
MORE: Final = "column "


def parse_edges(parts: list[bytes], room: Room | None = None, file: EdgeFile | None = None) -> EdgeTable:
    """EdgeTable from rows whose first one names the columns, in any order, perhaps as a ``file`` says. ``room`` is
    asked with the number of edges before any is made. Raises CellError where not a row is invalid but the header, or
    the file as a whole."""
    strip_end(parts)
    path = "" if file is None or file.file.inline else file.file.path.value
    separator = separator_of(parts, path) if parts else COMMAS
    most = lines_in(parts)
    if room is not None and not (file and file.where):  # else it is asked while rows are taken
        room(most)
    check_text(text_of(parts, separator), separator)
    cells = 1 + next(text_of(parts, separator)).partition(b"\n")[0].count(separator.byte)
    if cells > (MOST_COLUMNS if file else _MOST_CELLS):
        raise in_row(1, f"has {cells:,} cells", _HINT)
    first = first_row(text_of(parts, separator), separator)
    written = written_of(first.stripped().cells, file, separator)
    reader = _Reader(written, min(most, 1 + sum(map(len, parts)) // len(written.header)))
    for number, lines in below(text_of(given_up(parts), separator), first.number):
        if not reader.goes_on(lines, number):
            break
        if room is not None:
            room(reader.count)
    return reader.table()


def edges_of(sheet: Sheet, file: EdgeFile, room: Room | None = None) -> EdgeTable:
    """EdgeTable from a table whose columns are arrays. Raises CellError."""
    written = written_of([*sheet.header], file._replace(where=()), COMMAS)

    def called(what: str) -> Located[str]:
        return Located(sheet.header[written.places[what]], file.file.path.node)

    ends = [sheet.texts(called(what)) for what in ("from", "to")]
    if room is not None:
        room(len(ends[0]))
    number_of_name: dict[str, int] = {}
    begins, targets = (np.array([number_of_name.setdefault(name, len(number_of_name)) for name in end]) for end in ends)
    nothing = np.broadcast_to(np.nan, (len(begins),))
    found = {what: sheet.numbers(called(what)) if what in written.places else nothing for what in written.numbers}
    rows = np.array([sheet.where(edge) for edge in range(len(begins))], dtype=np.int64)
    sound = "" not in number_of_name and _are_delays(*(found[what] for what in _NUMBERS[1:]))
    for edge, row in enumerate([] if sound else rows.tolist()):
        if not (ends[0][edge] and ends[1][edge]):
            place = written.places["to" if ends[0][edge] else "from"]
            raise in_cell(row, place + 1, "the name of a neuron is wanted")
        if not _are_delays(*(found[what][edge : edge + 1] for what in _NUMBERS[1:])):
            place = written.places["delay" if "delay" in written.places else "delay_seconds"]
            raise in_cell(row, place + 1, "this is no delay (0, 1, 2, … steps, or a time)")
    steps, weights = found["delay"], found["weight"]
    return EdgeTable(
        names=tuple(number_of_name),
        begins=narrow(begins.astype(np.int64)),
        ends=narrow(targets.astype(np.int64)),
        weights=np.where(np.isnan(weights), 1.0, weights),
        delays=integers(_in_brief(np.where(np.isnan(steps), -1.0, steps))),
        offsets=integers(_in_brief(rows - np.arange(len(rows)))),
        seconds=_in_seconds(found["delay_seconds"], written.factor) if "delay_seconds" in written.places else None,
        more={what.removeprefix(MORE): values for what, values in found.items() if what.startswith(MORE)},
        columns={what.removeprefix(MORE): place + 1 for what, place in written.places.items()},
        texts={name: _texts_of(sheet.texts(Located(name, file.file.path.node))) for name in written.texts},
        header=sheet.header,
        about=sheet.about,
    )


def _texts_of(cells: Sequence[str]) -> Texts:
    """Texts, "" where there is none."""
    number_of = {text: number for number, text in enumerate(dict.fromkeys(filter(None, cells)))}
    return Texts(tuple(number_of), narrow(np.array([number_of.get(text, -1) for text in cells], dtype=np.int64)))


def written_of(header: list[str], file: EdgeFile | None, separator: Separator) -> Written:
    """Where each column stands that is wanted. Raises CellError."""
    if file is None:
        return Written(header, _columns(header, ()), separator)
    further = (*file.more, *file.texts, *file.perhaps)
    others = {*(one.column.value for one in file.where), *(name.value for name in further)}
    places = _columns(header, others) if file.columns is None else _called(header, dict(file.columns), file.unit)
    more = {f"{MORE}{name.value}": find_column(header, name) for name in file.more}
    texts = [*file.texts, *(name for name in file.perhaps if name.value in header)]
    found = {name.value: find_column(header, name) for name in texts}
    unit = None if file.unit is None else file.unit.value
    return Written(header, {**places, **more}, separator, unit, picked(file.where, header), found)


def _called(header: list[str], names: dict[str, Located[str]], unit: Located[str] | None) -> dict[str, int]:
    """Where the columns stand that are called by these names, or else as ours are. Raises CellError."""
    places: dict[str, int] = {}
    ours = [cell.casefold() for cell in header]
    for what in _COLUMNS:
        name = names.get("delay" if what == "delay_seconds" else what)
        if name is not None and (what not in ("delay", "delay_seconds") or (what == "delay") == (unit is None)):
            places[what] = find_column(header, name)
        elif name is None and ours.count(what) == 1:
            places[what] = ours.index(what)
        elif name is None and what in ("from", "to"):
            raise no_column(header, what, None, f"write columns: {{{what}: NAME}}")
    return places


def _columns(header: list[str], others: Collection[str]) -> dict[str, int]:
    """Where each column stands, of a file whose columns have our names, beside ``others``. Raises CellError."""
    names = [cell.casefold() for cell in header]
    for column, name in enumerate(names, 1):
        if header[column - 1] in others and name not in _COLUMNS:
            continue
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
    return {name: names.index(name) for name in _COLUMNS if name in names}


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

    def __init__(self, written: Written, most: int) -> None:
        """``most``: how many edges there may be."""
        self.faults = Faults()
        self._written = written
        self._places = written.places
        self._names = Names()
        #: of each further column of texts these, and the number of each edge's
        self._texts = {name: (Names(), np.empty(most, dtype=np.int32)) for name in written.texts}
        self.count = 0
        self._rows = 0
        self._begins, self._ends = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int32)
        self._numbers = {name: np.empty(most) for name in written.numbers if name in ("weight", *written.places)}
        #: those of some edges after the other
        self._delays: list[Indices] = []
        self._offsets: list[Indices] = []
        #: edges that were taken one by one since: where they begin and end, row, numbers
        self._singles = array("d")
        self._single_texts: list[list[str]] = []

    def table(self) -> EdgeTable:
        """The table of all rows taken so far."""
        self._add_singles()
        self._check_texts()
        if self.faults.first() is None:
            for one in self._written.picked:
                one.check()
        numbers = {name: values[: self.count] for name, values in self._numbers.items()}
        return EdgeTable(
            names=tuple(self._names.known),
            begins=narrow(self._begins[: self.count]),
            ends=narrow(self._ends[: self.count]),
            weights=numbers["weight"],
            delays=integers(*self._delays),
            offsets=integers(*self._offsets),
            fault=self.faults.first(),
            seconds=_in_seconds(numbers.get("delay_seconds"), self._written.factor),
            more={name.removeprefix(MORE): values for name, values in numbers.items() if name.startswith(MORE)},
            about=self._written.about(self.count, self._rows),
            columns={name.removeprefix(MORE): place + 1 for name, place in self._places.items()},
            texts={
                name: Texts(tuple(names.known), narrow(numbers[: self.count]))
                for name, (names, numbers) in self._texts.items()
            },
            header=tuple(self._written.header),
        )

    def _add(self, begins: npt.NDArray[Any], ends: npt.NDArray[Any], rows: IntArray, *numbers: FloatArray) -> None:
        """Add edges: where they begin and end, rows, numbers; NaN where one is not given."""
        at = slice(self.count, self.count + len(rows))
        self._begins[at], self._ends[at] = begins, ends
        for name, values in zip(self._written.numbers, numbers, strict=True):
            if name == "weight":
                values = np.where(np.isnan(values), 1.0, values)
            if name in self._numbers:
                self._numbers[name][at] = values
            if name == "delay":
                self._delays.append(_in_brief(np.where(np.isnan(values), -1.0, values)))
        self._offsets.append(_in_brief(rows - np.arange(at.start, at.stop)))
        self.count = at.stop

    def _add_texts(self, columns: Iterable[npt.NDArray[Any]]) -> None:
        """The further texts of the edges that were added last, as numbers, column by column."""
        for (_, numbers), found in zip(self._texts.values(), columns, strict=True):
            numbers[self.count - len(found) : self.count] = found

    def _add_singles(self) -> None:
        """Add what was taken one by one."""
        if self._singles:
            begins, ends, rows, *numbers = np.array(self._singles).reshape(-1, 3 + len(self._written.numbers)).T
            self._add(begins, ends, rows.astype(np.int64), *numbers)
            columns = zip(*self._single_texts, strict=True)
            self._add_texts(
                np.array([names[cell] for cell in cells])
                for (names, _), cells in zip(self._texts.values(), columns, strict=True)
            )
            del self._singles[:], self._single_texts[:]

    def _check_texts(self) -> None:
        """Report the first of each further text that cannot be shown."""
        for name, (names, numbers) in self._texts.items():
            for number in [number for number, text in enumerate(names.known) if not text.isprintable()]:
                edge = int(np.argmax(numbers[: self.count] == number))
                row = edge + int(integers(*self._offsets)[edge])
                message = "a text has a character here that cannot be shown"
                self.faults.note(in_cell(row, self._written.texts[name] + 1, message))

    def goes_on(self, lines: bytes, number: int) -> bool:
        """Take lines, of which the first has this number; False where there is no reading on."""
        try:
            self._take(lines, number)
        except CellError as error:
            self.faults.note(error)
            return False
        return not self.faults.many

    def _take(self, lines: bytes, number: int) -> None:
        """Take lines, of which the first has this number. Raises CellError where there is no reading on."""
        self._rows = number + lines.count(b"\n") - 1
        width, separator = len(self._written.header), self._written.separator.byte
        some = None if b'"' in lines else lines_of(lines, width, separator)
        if some is not None and self._quickly(some, number):
            return
        for row in rows_of(lines, number, self._written.separator):
            self._one(row.stripped())
            if self.faults.many:
                return

    def _quickly(self, lines: Lines, number: int) -> bool:
        """Take rows, column by column; False, and none is taken, where one of them is invalid or may be."""
        chosen = rows_picked(self._written.picked, lines)
        rows = np.arange(lines.rows) if chosen is None else chosen
        columns = {name: lines.column(at) for name, at in self._places.items()}
        if chosen is not None:
            columns = {name: cells.some(chosen) for name, cells in columns.items()}
        absent = np.broadcast_to(np.nan, (len(rows),))
        found = [columns[name].numbers() if name in columns else absent for name in self._written.numbers]
        numbers = [one for one in found if one is not None]
        if len(numbers) < len(found) or not _are_delays(*numbers[1:3]):
            return False
        begins, ends = self._names.of(columns["from"]), self._names.of(columns["to"])
        if len(rows) and min(begins.min(), ends.min()) < 0:
            return False
        self._add_singles()
        if len(rows):
            self._add(begins, ends, number + rows, *numbers)
            written = ((names, lines.column(self._written.texts[name])) for name, (names, _) in self._texts.items())
            self._add_texts(names.of(cells if chosen is None else cells.some(chosen)) for names, cells in written)
        return True

    def _one(self, row: Row) -> None:
        """Take one row, or what of it is in order."""
        number, cells = row
        if len(cells) != len(self._written.header):
            self.faults.note(in_row(number, f"has {counted(len(cells))}, the header {len(self._written.header)}"))
            return
        takes = [one.takes(cells[one.at]) for one in self._written.picked]  # each sees each row
        if not all(takes):
            return
        ends = [cells[self._places[end]] for end in ("from", "to")]
        for column in sorted(self._places[end] for end in ("from", "to")):
            if not cells[column]:
                self.faults.note(in_cell(number, column + 1, "the name of a neuron is wanted"))
        numbers = [self._number(number, cells, name) for name in self._written.numbers]
        if not any(map(math.isnan, numbers[1:3])):
            column = self._places["delay_seconds"] + 1
            self.faults.note(in_cell(number, column, "a delay in steps stands in this row, too"))
        if all(ends):
            begin, end = (self._names[name] for name in ends)
            self._singles.extend((begin, end, number, *numbers))
            self._single_texts.append([cells[place] for place in self._written.texts.values()])

    def _number(self, row: int, cells: list[str], name: str) -> float:
        """What a row has in the column of this name; NaN where that is nothing, or invalid, which is reported."""
        column = self._places.get(name)
        if column is None:
            return math.nan
        try:
            value = number_of(cells[column], row, column + 1)
            if name == "delay" and not math.isnan(value) and not (value.is_integer() and 0 <= value <= _LARGEST_DELAY):
                hint = None if self._written.header[column].casefold() == "delay" else _WITH_UNIT
                raise in_cell(row, column + 1, f"{quoted(cells[column])} is no delay (0, 1, 2, … steps)", hint)
            if name == "delay_seconds" and value < 0:
                least = f"0 {self._written.unit or 'seconds'}"
                raise in_cell(row, column + 1, f"{quoted(cells[column])} is no delay: it is at least {least}")
        except CellError as error:
            self.faults.note(error)
            return math.nan
        return value


def _in_seconds(times: FloatArray | None, factor: Fraction) -> FloatArray | None:
    """Times in seconds, each rounded once."""
    if times is None or factor == 1:
        return times
    return times * factor.numerator if factor > 1 else times / factor.denominator
