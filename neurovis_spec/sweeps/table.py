"""The table of a sweep, and its rows on disk while it runs, so that none is lost and none is run twice.

In: the names of its columns and its rows, or a file. Out: a Table, which saves itself as ``.csv`` or ``.parquet``; a
Journal, a file to which each row is appended as soon as it is there, and which is at the end the table in the order of
the grid. A ``.csv`` is that file itself; beside a ``.parquet``, which cannot grow, lies one, ``.x.parquet.rows``, until
the end.
"""

from __future__ import annotations

import csv
import io
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeAlias

from neurovis_spec.runtime.files import replacing, written_to
from neurovis_spec.sweeps.grid import Point, SweepError, number

if sys.platform != "win32":
    import fcntl

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


class Journal:
    """``rows`` are those that are there, by their points: the first ``width`` cells. Raises SweepError where the file
    is something else, or another process writes it; OSError."""

    def __init__(self, path: Path, columns: Sequence[str], width: int) -> None:
        check_suffix(path)
        self._path, self._columns, self._width = path, tuple(columns), width
        self.rows: dict[Row, Row] = {}
        target = written_to(path)
        self._grows = target if path.suffix == ".csv" else target.with_name(f".{target.name}.rows")
        self._beside = self._grows != target
        self._made = not self._grows.exists()
        self._file: BinaryIO = self._grows.open("a+b", buffering=0)
        try:
            self._lock()
            if self._beside and target.exists():
                self._take(rows_of_parquet(target, columns))
            self._read()
        except BaseException:
            self._file.close()
            if self._made:
                self._grows.unlink(missing_ok=True)
            raise

    def _lock(self) -> None:
        if sys.platform == "win32":
            return
        try:
            fcntl.flock(self._file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SweepError(f"another sweep is writing {self._path}") from None
        except OSError:  # a file system without locks
            return

    def _read(self) -> None:
        """Take the rows that are there; what a process that was ended has half written is cut off."""
        self._file.seek(0)
        content = self._file.read()
        header = line(self._columns).encode()
        whole = content.rfind(b"\n") + 1
        if not whole and not header.startswith(content):
            raise SweepError(f"{self._path} is not the table of a sweep", "give another file")
        try:
            text = content[:whole].decode("utf-8")
        except UnicodeDecodeError:
            raise SweepError(f"{self._path} is not the table of a sweep", "give another file") from None
        if whole:
            self._take(rows_of_csv(text, self._columns, self._path))
        if whole < len(content):
            self._file.truncate(whole)
        if not whole:
            self._file.write(header)

    def _take(self, rows: Sequence[Row]) -> None:
        self.rows |= {row[: self._width]: row for row in rows}

    def add(self, row: Row) -> None:
        """One more row, which is on its way to the disk when this returns."""
        self.rows[row[: self._width]] = row
        self._file.write(line(row).encode())

    def finish(self, points: Sequence[Point]) -> None:
        """Put the file in the order of these points, rows of others behind them, and close it."""
        inside = set(points)
        ordered = [self.rows[point] for point in points if point in self.rows]
        ordered += [row for point, row in self.rows.items() if point not in inside]
        if ordered:
            Table(self._columns, tuple(ordered)).save(self._path)
        self._file.close()
        if self._beside or (self._made and not ordered):
            self._grows.unlink(missing_ok=True)
