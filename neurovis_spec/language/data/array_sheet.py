"""Sheets whose columns are arrays: those of an ``.npz`` archive by their names, and a ``.parquet`` file.

In: the bytes of a file, which rows count. Out: an ArraySheet. Rows are counted from 1, as there is no header. A fault
is a CellError; how many cells there are is known, and refused, before any is unpacked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.language.data.columns import Picked, find_column
from neurovis_spec.language.data.npy import REAL, Archive
from neurovis_spec.language.data.sheet import MOST_COLUMNS
from neurovis_spec.language.data.table import CellError, check_rows, in_cell, not_finite, quoted
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition

#: bytes of a column of a .parquet, unpacked
_LARGEST: Final = 256 << 20
_NO_PARQUET: Final = "pip install 'neurovis-spec[parquet]'"


class ArraySheet:
    """A sheet whose columns are read one by one, each as an array: of numbers, or of texts, None where a cell is
    empty."""

    def __init__(self, read: Mapping[str, Callable[[], npt.NDArray[Any]]], where: tuple[Condition, ...]) -> None:
        self.header = tuple(read)
        self.about = ""
        self._read = read
        self._size: int | None = None
        self._rows: IntArray | None = None
        if where:
            self._rows = self._picked(where)

    def _picked(self, where: tuple[Condition, ...]) -> IntArray:
        taken: npt.NDArray[np.bool_] = np.array(True)
        for condition in where:
            one = Picked(condition, find_column(self.header, condition.column))
            here = np.array([one.takes(text) for text in self.texts(condition.column)], dtype=np.bool_)
            one.check()
            taken = taken & here
        rows = np.flatnonzero(taken)
        self.about = f"{len(rows):,} of {self._size:,} rows"
        return rows

    def __len__(self) -> int:
        if self._rows is not None:
            return len(self._rows)
        return len(self._whole(self.header[0])) if self._size is None else self._size

    def where(self, row: int) -> int:
        """Where a row stands in the file, from 1."""
        return 1 + (row if self._rows is None else int(self._rows[row]))

    def _whole(self, name: str) -> npt.NDArray[Any]:
        """A column of all rows, as many as in the columns before. Raises CellError."""
        found = self._read[name]()
        if self._size is not None and len(found) != self._size:
            raise CellError("file-format", f"{quoted(name)} has {len(found):,} values, another column {self._size:,}")
        self._size = len(found)
        return found

    def _column(self, column: Located[str]) -> npt.NDArray[Any]:
        found = self._whole(self.header[find_column(self.header, column)])
        return found if self._rows is None else found[self._rows]

    def numbers(self, column: Located[str]) -> FloatArray:
        """A column of numbers, NaN where a cell is empty. Raises CellError."""
        found, at = self._column(column), self.header.index(column.value) + 1
        if found.dtype.kind not in REAL:
            raise CellError("file-format", f"{quoted(column.value)} is no column of numbers", span=column.span)
        with np.errstate(over="ignore"):
            values = found.astype(np.float64)
        wild = np.flatnonzero(np.isinf(values))
        if len(wild):
            message = f"this is {not_finite(float(values[wild[0]]))}"
            raise in_cell(self.where(int(wild[0])), at, message, code="not-finite")
        return values

    def texts(self, column: Located[str]) -> tuple[str, ...]:
        """A column of texts, without the blanks around them, or of numbers as they are written. Raises CellError."""
        found, at = self._column(column).tolist(), self.header.index(column.value) + 1
        texts = tuple("" if cell is None or cell != cell else _text(cell) for cell in found)
        wrong = next((row for row, text in enumerate(texts) if not text.isprintable()), None)
        if wrong is not None:
            raise in_cell(self.where(wrong), at, "a text has a character here that cannot be shown")
        return texts


def _text(cell: object) -> str:
    if isinstance(cell, bool):
        return str(cell).lower()
    return f"{cell:.17g}" if isinstance(cell, float) else str(cell).strip()


def parse_npz_sheet(data: bytes, where: tuple[Condition, ...], most: int) -> ArraySheet:
    """The arrays of an archive as columns, of at most so many rows. Raises CellError."""
    archive = Archive(data)

    def reading(name: str) -> Callable[[], npt.NDArray[Any]]:
        return lambda: archive.part(name, f"{REAL}Ub", room=partial(check_rows, most=most))

    if not archive.names:
        raise CellError("file-format", "the archive holds no array")
    return ArraySheet({name: reading(name) for name in archive.names}, where)


def parse_parquet_sheet(data: bytes, where: tuple[Condition, ...], most: int) -> ArraySheet:
    """The columns of a ``.parquet`` file, of at most so many rows. Raises CellError."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        message = "a .parquet file needs pyarrow, which is not installed"
        raise CellError("file-unreadable", message, _NO_PARQUET) from None
    try:
        file = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data))
        names, about = list(file.schema_arrow.names), file.metadata
    except Exception as error:  # pyarrow has errors of its own and of others for every way to be damaged
        raise CellError("file-format", "this is no .parquet file, or it is damaged") from error
    if len(names) > MOST_COLUMNS:
        raise CellError("too-large", f"it has {len(names):,} columns; a table has {MOST_COLUMNS:,} at most")
    check_rows(about.num_rows, most)
    groups = [about.row_group(number) for number in range(about.num_row_groups)]
    if sum(group.total_byte_size for group in groups) > _LARGEST:
        raise CellError("too-large", f"it has more than {_LARGEST >> 20} MiB, unpacked")

    def reading(name: str) -> Callable[[], npt.NDArray[Any]]:
        def read() -> npt.NDArray[Any]:
            try:
                column = file.read(columns=[name]).column(name)
                made: npt.NDArray[Any] = column.to_numpy()
            except Exception as error:  # as above
                raise CellError("file-format", f"the column {quoted(name)} cannot be read") from error
            if made.ndim != 1 or made.dtype.kind not in f"{REAL}ObU":
                raise CellError("file-format", f"the column {quoted(name)} has neither numbers nor texts")
            return made

        return read

    return ArraySheet({name: reading(name) for name in names}, where)
