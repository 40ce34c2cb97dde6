"""What every kind of data file gives: numbers in rows, or a CellError that says what is wrong and where.

In: shapes and entries as a file states them. Out: Table. Memory is taken only after the number of cells was checked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import Span

#: a table has at most this many cells: 256 MiB in double precision
MOST_CELLS: Final = 1 << 25
#: faults of one file that are told
MOST_FAULTS: Final = 20
#: Is told how many cells a table has (or edges a list) before these are made, and refuses too many by a CellError. The
#: header of a table may be counted among its cells.
Room: TypeAlias = Callable[[int], None]
#: what to do with a sparse matrix that has more
SPARSER: Final = "list its entries as 'edges', or divide it among several entries of 'connections'"


#: what is said of NaN and infinity where a cell may be empty
EMPTY_CELL: Final = "an empty cell means that there is none"


class CellError(ValueError):
    """What is wrong with a file: a finding's code, a sentence that names the place, and perhaps a hint; of a file of
    text also ``at``, the row or line and the column of the cell, from 1 (a column of 0: the whole row). ``span`` is
    where it stands in the spec, if not at the path of the file."""

    def __init__(
        self,
        code: str,
        message: str,
        hint: str | None = None,
        at: tuple[int, int] = (0, 0),
        span: Span | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.hint = hint
        self.at = at
        self.span = span
        #: what else is wrong with the file, in its order
        self.others: tuple[CellError, ...] = ()


def in_cell(row: int, column: int, message: str, hint: str | None = None, code: str = "file-format") -> CellError:
    """What is wrong with a cell."""
    return CellError(code, f"row {row}, column {column}: {message}", hint, (row, column))


def in_row(row: int, message: str, hint: str | None = None, code: str = "file-format") -> CellError:
    """What is wrong with a row as a whole; the message goes on behind its number."""
    return CellError(code, f"row {row} {message}", hint, (row, 0))


class Faults:
    """What is wrong with a file, as long as reading can go on; with MOST_FAULTS it does not."""

    def __init__(self) -> None:
        self._found: list[CellError] = []

    def __bool__(self) -> bool:
        return bool(self._found)

    @property
    def many(self) -> bool:
        """Whether these are enough for one file."""
        return len(self._found) >= MOST_FAULTS

    def note(self, error: CellError) -> None:
        """Report what is wrong in a row or a line."""
        self._found.append(error)

    def first(self) -> CellError | None:
        """The first in the file, which holds the others; None where nothing is wrong."""
        found = sorted(self._found, key=lambda error: error.at[0])[:MOST_FAULTS]
        if not found:
            return None
        found[0].others = (*found[1:],)
        return found[0]

    def check(self) -> None:
        """Raise the first in the file, if there is any. Raises CellError."""
        error = self.first()
        if error is not None:
            raise error


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Numbers (rows × columns; NaN where not ``present``), and the names of the columns, if any. ``numbered``: the
    first row seems to number the columns."""

    values: NDArray[np.float64]
    present: NDArray[np.bool_]
    header: tuple[str, ...] | None = None
    numbered: bool = False

    def gaps(self) -> Iterator[tuple[int, int]]:
        """The rows and columns, from 1 and the header included, of the cells that are empty."""
        present = self.present
        for row in np.flatnonzero(~present.all(axis=1)).tolist():  # who asks for few of many takes no memory for all
            for column in np.flatnonzero(~present[row]).tolist():
                yield 1 + row + (self.header is not None), 1 + column


def check_cells(cells: int, most: int = MOST_CELLS, *, hint: str | None = None) -> None:
    """Refuse a table that is too large, before memory is taken for it. Raises CellError."""
    if cells > most:
        raise CellError("too-large", f"it has more than {most:,} cells, the most that are read", hint)


def check_rows(rows: int, most: int) -> None:
    """Refuse a table of too many rows, before memory is taken for it. Raises CellError."""
    if rows > most:
        raise CellError("too-large", f"it has more than {most:,} rows, the most that are read")


def check_finite(values: NDArray[np.float64]) -> None:
    """Refuse NaN and infinity, naming the first one, row by row. Raises CellError."""
    finite = np.isfinite(values)
    if not finite.all():
        row, column = divmod(int(np.argmin(finite)), values.shape[1])
        raise CellError("not-finite", f"row {row + 1}, column {column + 1} is {not_finite(values[row, column])}")


def not_finite(value: float) -> str:
    """NaN or infinity, in words."""
    return "NaN" if math.isnan(value) else "infinity"


def full(values: NDArray[np.float64]) -> Table:
    """Table in which no cell is missing."""
    return Table(values, np.ones(values.shape, dtype=np.bool_))


def scattered(
    shape: tuple[int, int], i: NDArray[np.int64], j: NDArray[np.int64], numbers: NDArray[np.float64]
) -> Table:
    """Table that hold these numbers at rows i and columns j (from 0) and nothing elsewhere."""
    values = np.full(shape, np.nan)
    values[i, j] = numbers
    return Table(values, ~np.isnan(values))


def repeated(i: NDArray[np.int64], j: NDArray[np.int64], columns: int) -> tuple[int, int] | None:
    """Two entries of the same cell, the later one as early as can be; None where each cell has one at most."""
    cells = i * columns + j
    order = np.argsort(cells, kind="stable")
    again = np.flatnonzero(np.diff(cells[order]) == 0)
    if not len(again):
        return None
    place = int(again[np.argmin(order[again + 1])])
    return int(order[place]), int(order[place + 1])


def printable(text: str) -> str:
    """A text of a file in a sentence: the beginning of a long one, nothing that a terminal would obey.

    >>> printable("a" + chr(27) + "[2J")
    'a?[2J'
    """
    short = text if len(text) <= 40 else text[:38] + "…"
    return "".join(character if character.isprintable() else "?" for character in short)


def quoted(text: str) -> str:
    """``printable`` text in quotes, for messages."""
    return f"'{printable(text)}'"
