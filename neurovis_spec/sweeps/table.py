"""The table of a sweep.

In: the names of its columns and its rows, or a file. Out: a Table, which saves itself as ``.csv`` or ``.parquet``.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from neurovis_spec.runtime.files import replacing
from neurovis_spec.sweeps.grid import SweepError, number

if TYPE_CHECKING:
    import pandas

Cell: TypeAlias = int | float | str | None
Row: TypeAlias = tuple[Cell, ...]

ERROR = "error"
SUFFIXES = (".csv", ".parquet")


@dataclass(frozen=True)
class Table:
    """A row for each point of a sweep, in the order of the grid: its values, its metrics (None where it failed), and
    what is wrong with it, None where nothing is. ``table["eta"]`` is a column."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> tuple[Cell, ...]:
        """A column. Raises KeyError."""
        if column not in self.columns:
            raise KeyError(f"no column '{column}'; there are: {', '.join(self.columns)}")
        place = self.columns.index(column)
        return tuple(row[place] for row in self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __str__(self) -> str:
        """The table as it is in a ``.csv``."""
        return "".join(line(row) for row in (self.columns, *self.rows))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a ``.csv`` or ``.parquet`` file. Raises SweepError for another, OSError."""
        check_suffix(Path(path))
        with replacing(path) as file:
            file.write(_parquet(self) if Path(path).suffix == ".parquet" else str(self).encode())

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a DataFrame. Raises ImportError where pandas is not installed."""
        import pandas

        return pandas.DataFrame({name: list(self[name]) for name in self.columns})


def check_suffix(path: Path) -> None:
    """Refuse what a table cannot be written to. Raises SweepError."""
    if path.suffix not in SUFFIXES:
        raise SweepError(f"{path}: the table of a sweep is written as {' or '.join(SUFFIXES)}")
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        raise SweepError(
            "a .parquet file needs pyarrow, which is not installed", "pip install 'neurovis-spec[parquet]'"
        )


def line(row: Iterable[Cell]) -> str:
    """A row as a line of a ``.csv``; what is None is empty, numbers are exact."""
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerow("" if cell is None else cell for cell in row)
    return written.getvalue()


def rows_of_csv(text: str, columns: Sequence[str], path: Path) -> list[Row]:
    """The rows behind the header of a ``.csv``. Raises SweepError where it is not a table with these columns."""
    rows = csv.reader(io.StringIO(text, newline=""))
    check_columns(next(rows, []), columns, path)
    return [_row(cells, columns, path, rows.line_num) for cells in rows if cells]


def rows_of_parquet(path: Path, columns: Sequence[str]) -> list[Row]:
    """The rows of a ``.parquet``. Raises SweepError where it is not a table with these columns, OSError."""
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path)
    except pyarrow.ArrowException as error:
        raise SweepError(f"{path} is no .parquet file: {error}") from None
    check_columns(table.column_names, columns, path)
    return [tuple(row) for row in zip(*(table.column(name).to_pylist() for name in columns), strict=True)]


def check_columns(found: Sequence[str], columns: Sequence[str], path: Path) -> None:
    """Refuse a file whose table is another one. Raises SweepError."""
    if list(found) != list(columns):
        message = f"{path} is not the table of this sweep: its columns are {_listed(found)}, not {_listed(columns)}"
        raise SweepError(message, "give another file, or the same --over and --metric")


def _listed(names: Sequence[str]) -> str:
    text = ", ".join(names) or "none"
    return text if len(text) <= 200 else text[:199] + "…"


def _row(cells: Sequence[str], columns: Sequence[str], path: Path, number_of_line: int) -> Row:
    try:
        if len(cells) != len(columns):
            raise ValueError
        return (*(number(cell) if cell else None for cell in cells[:-1]), cells[-1] or None)
    except ValueError:
        raise SweepError(f"{path}:{number_of_line}: this is no row of the table of a sweep") from None


def _parquet(table: Table) -> bytes:
    import pyarrow
    import pyarrow.parquet

    written = pyarrow.BufferOutputStream()
    arrays = [pyarrow.array(table[name], _type(table[name], name)) for name in table.columns]
    pyarrow.parquet.write_table(pyarrow.Table.from_arrays(arrays, names=list(table.columns)), written)
    return bytes(written.getvalue())


def _type(cells: Sequence[Cell], name: str) -> object:
    import pyarrow

    if name == ERROR:
        return pyarrow.string()
    whole = all(isinstance(cell, int) and -(2**63) <= cell < 2**63 for cell in cells)
    return pyarrow.int64() if whole and cells else pyarrow.float64()
