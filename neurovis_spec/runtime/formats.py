"""Formats of recordings: ``.npz``, which keeps everything, and ``.csv``, for tables and other programs.

In: a Recording and a path, or a path alone. Out: a file, or a Recording. Formats are found through the entry point
group ``neurovis.formats`` by the suffix of the path.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol, runtime_checkable

from neurovis_spec import plugins
from neurovis_spec.runtime.csv_file import read_csv, write_csv
from neurovis_spec.runtime.npz_file import read_npz, write_npz
from neurovis_spec.runtime.recording import Recording, RecordingError


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
