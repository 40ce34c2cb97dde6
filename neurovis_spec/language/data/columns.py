"""Columns of tables in text, which are found by their names, some lines at a time.

In: lines of whole rows, of which the separator is known; what is wanted of them. Out: the Cells of a column, as numbers
or as texts that are numbered; which rows a ``where`` takes. Names are looked for in the header, and a missing one is a
CellError that stands where an author names it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.diagnostics import listed, shorten
from neurovis_spec.language.data.cells import is_number, numbers_of
from neurovis_spec.language.data.table import CellError, printable, quoted
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.likeness import suggest

#: names are looked up by so many words of eight bytes, at one of so many places
_WORDS: Final = 4
_PLACES: Final = 1 << 19
#: spellings of names for which there is room at first
_FIRST_ROOM: Final = 1 << 10
#: what of a word belongs to a name of which so many bytes are left
_MASKS: Final = np.array([(1 << 8 * size) - 1 for size in range(9)], dtype=np.uint64)
#: odd numbers that spread words over places (the golden ratio's, as in Knuth 6.4, and powers of it)
_SPREAD: Final = [np.uint64(pow(0x9E3779B97F4A7C15, power, 1 << 64)) for power in range(1, _WORDS + 1)]
#: spellings of a column that are compared one by one
_FEW: Final = 8
#: texts of a column that are compared with one that it has not
_COMPARED: Final = 1000
#: columns that are named where one is not found
_NAMED: Final = 20


class Cells(NamedTuple):
    """A column of some lines: the bytes of these, with room behind them, where the cells begin and end, and what
    separates them."""

    text: npt.NDArray[np.uint8]
    begins: npt.NDArray[np.int64]
    ends: npt.NDArray[np.int64]
    separator: bytes

    def some(self, rows: IntArray) -> Cells:
        """Those of some of the rows, in their order."""
        return self._replace(begins=self.begins[rows], ends=self.ends[rows])

    def words(self) -> list[npt.NDArray[np.uint64]]:
        """The cells in words of eight bytes, as far as these go."""
        at_all = np.ndarray((len(self.text) - 7,), dtype="<u8", buffer=self.text, strides=(1,))
        sizes = self.ends - self.begins
        used = min(_WORDS, max(1, -(-int(sizes.max()) // 8)))
        return [at_all[self.begins + 8 * n] & _MASKS[np.clip(sizes - 8 * n, 0, 8)] for n in range(used)]

    def joined(self) -> bytes:
        """The cells, with commas between them."""
        sizes = self.ends - self.begins + 1
        after = np.cumsum(sizes)
        places = np.repeat(self.begins - after + sizes, sizes) + np.arange(after[-1])
        found: bytes = self.text[places].tobytes()
        return found.replace(b"\n", b",").replace(self.separator, b",")[:-1]

    def numbers(self) -> FloatArray | None:
        """The numbers in the cells, NaN for an empty one; None where one holds something else."""
        if not len(self.begins):
            return np.empty(0)
        found = numbers_of(self.joined())
        return found if found is not None and len(found) == len(self.begins) else None


class Lines(NamedTuple):
    """Some rows of a file: their bytes, with room behind them, and where each of their cells ends."""

    text: npt.NDArray[np.uint8]
    ends: npt.NDArray[np.int64]
    width: int
    separator: bytes

    @property
    def rows(self) -> int:
        """How many these are."""
        return len(self.ends) // self.width

    def column(self, at: int) -> Cells:
        """The cells of a column, from 0."""
        before = (
            self.ends[at - 1 :: self.width]
            if at
            else np.concatenate(([-1], self.ends[self.width - 1 : -1 : self.width]))
        )
        return Cells(self.text, before + 1, self.ends[at :: self.width], self.separator)


def lines_of(lines: bytes, width: int, separator: bytes) -> Lines | None:
    """Lines that all have so many cells, in whose bytes quotes mean nothing; None where some have other numbers."""
    text = np.frombuffer(lines + b"\n" + bytes(8 * _WORDS), dtype=np.uint8)
    ends = np.flatnonzero((text == ord(separator)) | (text == ord("\n")))
    turns = text[ends] == ord("\n")
    if len(ends) % width or not turns[width - 1 :: width].all() or turns.sum() != len(ends) // width:
        return None
    return Lines(text, ends, width, separator)


class Names:
    """The numbers of texts, in the order in which they come; blanks around one do not count, an empty one has −1.

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

    def of(self, cells: Cells) -> npt.NDArray[np.int32]:
        """The number of the name in each cell."""
        if not len(cells.begins):
            return np.empty(0, dtype=np.int32)
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


def find_column(header: Sequence[str], name: Located[str]) -> int:
    """Where the column of this name stands, from 0. Raises CellError, at the name, where there is none or several."""
    if name.value not in header:
        raise no_column(header, name.value, name)
    if header.count(name.value) > 1:
        message = f"the file has {header.count(name.value)} columns '{shorten(name.value)}'"
        raise CellError("file-format", message, "give them different names", span=name.span)
    return header.index(name.value)


def no_column(header: Sequence[str], wanted: str, name: Located[str] | None, hint: str | None = None) -> CellError:
    """That a file has no such column; at the ``name`` in the spec, if it is written there."""
    there = listed([f"'{printable(one)}'" for one in header[:_NAMED]])
    message = f"the file has no column '{shorten(wanted)}'; its columns are {there}"
    if len(header) > _NAMED:
        message = f"the file has no column '{shorten(wanted)}' among its {len(header):,} columns"
    hint = hint or suggest(wanted, header)
    return CellError("file-format", message, hint, span=None if name is None else name.span)


class Picked:
    """Which rows a condition takes: those with one of some values in a column."""

    def __init__(self, condition: Condition, at: int) -> None:
        """``at``: where the column stands, from 0."""
        self.at = at
        self._condition = condition
        self._names = Names()
        #: of the text of each number whether it is one of the values; the last is that of an empty cell
        self._taken = np.array([_takes(condition, "")])
        #: of a few spellings, as words, whether they are taken
        self._spellings: dict[tuple[int, ...], bool] = {}

    def of(self, cells: Cells) -> BoolArray:
        """Which of the rows with these cells in the column."""
        quick = self._by_spelling(cells)
        if quick is not None:
            return quick
        numbers = self._names.of(cells)
        new = self._names.known[len(self._taken) - 1 :]
        if new:
            found = [_takes(self._condition, text) for text in new]
            self._taken = np.concatenate((self._taken[:-1], found, self._taken[-1:]))
        taken = self._taken[numbers]
        self._learn(cells, numbers, taken)
        return taken

    def _by_spelling(self, cells: Cells) -> BoolArray | None:
        """The same by the few spellings that were seen before; None where a cell has another one."""
        if not self._spellings or not len(cells.begins) or (cells.ends - cells.begins).max() > 8 * _WORDS:
            return None
        words = cells.words()
        taken, known = np.zeros(len(cells.begins), dtype=np.bool_), np.zeros(len(cells.begins), dtype=np.bool_)
        for spelling, takes in self._spellings.items():
            if not any(spelling[len(words) :]):
                here = np.logical_and.reduce([word == held for word, held in zip(words, spelling, strict=False)])
                known |= here
                taken |= here & takes
        return taken if known.all() else None

    def _learn(self, cells: Cells, numbers: npt.NDArray[np.int32], taken: BoolArray) -> None:
        """Remember how texts are spelled, as long as these are few."""
        found = dict(zip(numbers.tolist(), range(len(numbers)), strict=True))
        if len(found) + len(self._spellings) > _FEW or (cells.ends - cells.begins).max(initial=0) > 8 * _WORDS:
            return
        words = cells.words() if found else []
        for row in found.values():
            spelling = [int(word[row]) for word in words]
            self._spellings[(*spelling, *[0] * (_WORDS - len(spelling)))] = bool(taken[row])

    def takes(self, cell: str) -> bool:
        """Whether a row with this cell in the column."""
        self._names[cell]  # so that it is known that there is one
        return _takes(self._condition, cell.strip())

    def check(self) -> None:
        """Refuse a value that no row has. Raises CellError, at the value."""
        for value in self._condition.values:
            if not any(_equals(value, text) for text in ("", *self._names.known)):
                message = f"no row has {_shown(value)} in the column '{shorten(self._condition.column.value)}'"
                hint = suggest(str(value.value), self._names.known[:_COMPARED], "there are")
                raise CellError("file-format", message, hint, span=value.span)


def _takes(condition: Condition, text: str) -> bool:
    return any(_equals(value, text) for value in condition.values)


def _equals(value: Scalar, text: str) -> bool:
    """Whether a cell has a value: an equal number, the same text, true or false in whatever case; null is empty."""
    match value.value:
        case None:
            return not text
        case bool() as truth:
            return text.casefold() == str(truth).casefold()
        case str() as word:
            return text == word.strip()
        case number:
            return is_number(text) and float(text) == number


def _shown(value: Scalar) -> str:
    if value.value is None:
        return "an empty cell"
    return quoted(str(value.value).lower() if isinstance(value.value, bool) else str(value.value))


def picked(conditions: Iterable[Condition], header: Sequence[str]) -> tuple[Picked, ...]:
    """The conditions of a ``where``, by the columns of a file. Raises CellError."""
    return tuple(Picked(one, find_column(header, one.column)) for one in conditions)


def rows_picked(by: Iterable[Picked], lines: Lines) -> IntArray | None:
    """Which of some rows all conditions take; None where they take all."""
    taken: npt.NDArray[Any] | None = None
    for one in by:
        here = one.of(lines.column(one.at))
        taken = here if taken is None else taken & here
    return None if taken is None or taken.all() else np.flatnonzero(taken)
