"""The rows of a sweep on disk while it runs, so that none is lost and none is run twice.

In: a path, the columns, rows as they come. Out: a file to which each row is appended as soon as it is there, and which
is at the end the table in the order of the grid. A ``.csv`` is that file itself; beside a ``.parquet``, which cannot
grow, lies one, ``.x.parquet.rows``, until the end.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from neurovis_spec.runtime.files import written_to
from neurovis_spec.sweeps.grid import Point, SweepError
from neurovis_spec.sweeps.table import Row, Table, check_suffix, line, rows_of_csv, rows_of_parquet

if sys.platform != "win32":
    import fcntl


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
