"""Formats of recordings: ``.npz``, which keeps everything, and ``.csv``, for tables and other programs.

In: a Recording and a path, or a path alone. Out: a file, or a Recording. Formats are found through the entry point
group ``neurovis.formats`` by the suffix of the path.
"""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol, runtime_checkable

from neurovis_spec import plugins
from neurovis_spec.runtime.csv_file import csv_size, read_csv, stream_csv, write_csv
from neurovis_spec.runtime.npz_file import npz_size, read_npz, stream_npz, write_npz
from neurovis_spec.runtime.recording import Recording, RecordingError
from neurovis_spec.runtime.rows import RowWriter, Steps


@runtime_checkable
class Format(Protocol):
    """A file format: ``save`` writes all or nothing, ``load`` raises RecordingError for what is no such recording."""

    name: str
    suffixes: frozenset[str]

    def save(self, recording: Recording, path: Path) -> None:
        """Write a recording."""
        ...

    def load(self, path: Path) -> Recording:
        """Read a recording."""
        ...


class NpzFormat:
    """NumPy's archive of arrays (§12)."""

    name = "npz"
    suffixes = frozenset({".npz"})

    def save(self, recording: Recording, path: Path) -> None:
        """Write the arrays of §12, and ``about``."""
        write_npz(recording, path)

    def stream(self, path: Path, frame: Recording, steps: Steps) -> AbstractContextManager[RowWriter]:
        """Write the same while the network runs."""
        return stream_npz(path, frame, steps)

    def size(self, frame: Recording, steps: Steps) -> int:
        """Bytes of the disk."""
        return npz_size(frame, steps)

    def load(self, path: Path) -> Recording:
        """Read the arrays; no pickles, and no more memory than the file's size warrants."""
        return read_npz(path)


class CsvFormat:
    """A row a step: ``step``, ``t``, the neurons, then the changing weights by name."""

    name = "csv"
    suffixes = frozenset({".csv"})

    def save(self, recording: Recording, path: Path) -> None:
        """Write the table row by row."""
        write_csv(recording, path)

    def stream(self, path: Path, frame: Recording, steps: Steps) -> AbstractContextManager[RowWriter]:
        """Write the same while the network runs."""
        return stream_csv(path, frame, steps)

    def size(self, frame: Recording, steps: Steps) -> int:
        """About the bytes of the disk."""
        return csv_size(frame, steps)

    def load(self, path: Path) -> Recording:
        """Read the table: what stays is not in it, so the recording knows the changing connections alone."""
        return read_csv(path)


def for_path(path: str | os.PathLike[str]) -> Format:
    """The format that the suffix names. Raises RecordingError where there is none."""
    suffix = Path(path).suffix.lower()
    known: set[str] = set()
    for made in plugins.working(plugins.FORMATS):
        if isinstance(made, Format):
            if suffix in made.suffixes:
                return made
            known |= made.suffixes
    raise RecordingError(f"{os.fspath(path)}: no format has the suffix '{suffix}'; known: {', '.join(sorted(known))}")


def save(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write a recording in the format of the suffix. Raises RecordingError, OSError."""
    for_path(path).save(recording, Path(path))


def load(path: str | os.PathLike[str]) -> Recording:
    """Read a recording in the format of the suffix. Raises RecordingError for anything that cannot be read."""
    return for_path(path).load(Path(path))
