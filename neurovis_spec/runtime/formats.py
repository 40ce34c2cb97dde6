"""Formats of recordings: ``.npz``, which keeps everything, ``.csv`` for tables, ``.mcap`` for the tools of robots.

In: a Recording and a path, or a path alone. Out: a file, or a Recording. Formats are found through the entry point
group ``neurovis.formats`` by the suffix of the path. A *part* is the file of a run that is going on, or broke off,
beside the one that it is to become (``runtime/parts.py``).
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from io import FileIO
from pathlib import Path
from typing import Protocol, runtime_checkable

from neurovis_spec.arguments import callers_level
from neurovis_spec.real_paths import real_path
from neurovis_spec.runtime.csv_file import csv_size, finish_csv, held_csv, read_csv, recover_csv, stream_csv, write_csv
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.mcap_file import (
    finish_mcap,
    held_mcap,
    mcap_size,
    read_mcap,
    recover_mcap,
    stream_mcap,
    write_mcap,
)
from neurovis_spec.runtime.npz_file import (
    finish_npz,
    held_npz,
    npz_size,
    read_npz,
    recover_npz,
    stream_npz,
    write_npz,
)
from neurovis_spec.runtime.parts import abandoned_parts, files_beside, is_written, lock_abandoned, path_shown, target_of
from neurovis_spec.runtime.recording import Format, Readable, Recording, for_path, read_by
from neurovis_spec.runtime.rows import RowWriter, Steps


@runtime_checkable
class RepeatingFormat(Readable, Protocol):
    """A format whose files may hold several runs: of a network that began anew while it was recorded."""

    def load_run(self, path: Path, run: int | None) -> Recording:
        """Read the run with this number, from 1; None: the last, with a warning where there are several. Raises
        RecordingError."""
        ...


@runtime_checkable
class StreamingFormat(Format, Protocol):
    """A format that takes rows as they come, into a part beside the file that can be read whatever becomes of a run."""

    def stream(self, path: Path, frame: Recording, steps: Steps) -> AbstractContextManager[RowWriter]:
        """A writer for the rows of these steps; ``frame`` is the recording without them. The file is there when the
        block ends, with as many rows as came, which are fewer where a run was stopped; after an exception the part
        stays, if it holds a step (``part_of``). What a ``write`` was given can be read when it returns. Raises
        OSError."""
        ...

    def size(self, frame: Recording, steps: Steps) -> int:
        """About how many bytes of the disk it takes."""
        ...

    def held(self, file: FileIO) -> int | None:
        """The last step that a part holds, None for none. Raises RecordingError for a file that is no part, OSError."""
        ...

    def recover(self, part: Path) -> Recording:
        """Read a part as far as it is whole. Raises RecordingError."""
        ...

    def finish(self, file: FileIO, part: Path, path: Path) -> None:
        """Turn the part of a run that broke off into a recording at ``path``; ``file`` is the part, open. Raises
        RecordingError, OSError."""
        ...


class NpzFormat:
    """NumPy's archive of the arrays of a recording, and ``about``. No pickles are read, and no more memory is taken
    than the file's size warrants."""

    name = "npz"
    suffixes = frozenset({".npz"})
    save, load = staticmethod(write_npz), staticmethod(read_npz)
    stream, size = staticmethod(stream_npz), staticmethod(npz_size)
    held, recover, finish = staticmethod(held_npz), staticmethod(recover_npz), staticmethod(finish_npz)


class CsvFormat:
    """A row a step: ``step``, ``t``, the neurons, then the changing weights by name. What stays is not in it: a
    recording that is read knows the changing connections alone."""

    name = "csv"
    suffixes = frozenset({".csv"})
    save, load = staticmethod(write_csv), staticmethod(read_csv)
    stream, size = staticmethod(stream_csv), staticmethod(csv_size)
    held, recover, finish = staticmethod(held_csv), staticmethod(recover_csv), staticmethod(finish_csv)


class McapFormat:
    """Messages as a node of ROS 2 would send them, for the tools of robots, with index and footer. A file that breaks
    off is read as far as it is whole; one that holds several runs, run by run."""

    name = "mcap"
    suffixes = frozenset({".mcap"})
    save, load, load_run = staticmethod(write_mcap), staticmethod(read_mcap), staticmethod(read_mcap)
    stream, size = staticmethod(stream_mcap), staticmethod(mcap_size)
    held, recover, finish = staticmethod(held_mcap), staticmethod(recover_mcap), staticmethod(finish_mcap)


def load(path: str | os.PathLike[str], run: int | None = None) -> Recording:
    """Read a recording in the format of the suffix, or a part of one, whose run has not come to its end; of several
    runs in one file the one with this number, from 1, by default the last.

    Where the file is not there, but a part of it, this is read, and a warning says so. Raises RecordingError for
    anything that cannot be read."""
    path = Path(path)
    target = target_of(path)
    if target is not None:
        format_ = for_path(target)
        if isinstance(format_, StreamingFormat):
            return format_.recover(path)
    found = read_by(path)
    if isinstance(found, StreamingFormat):
        parts = files_beside(real_path(path), "part")
        if path.exists():
            _warn_of_later_part(path, parts, found)
        elif parts:
            return _load_part_instead(path, parts[0], found)
    if isinstance(found, RepeatingFormat):
        return found.load_run(path, run)
    if run not in (None, 1):
        raise RecordingError(f"{path}: there is no run {run}: it holds one run")
    return found.load(path)


def _load_part_instead(path: Path, part: Path, format_: StreamingFormat) -> Recording:
    """The recording in a part, which stands in for the file itself."""
    try:
        recording = format_.recover(part)
    except RecordingError:  # a file of somebody else
        return format_.load(path)
    if not len(recording):
        return format_.load(path)
    fate = "is still going on" if is_written(part) else "did not come to its end"
    where = f"what was recorded, up to step {recording.step[-1]}, is read from {path_shown(part, path)}"
    _warn(f"{path}: its run {fate}; {where}")
    return recording


def _warn_of_later_part(path: Path, parts: Sequence[Path], format_: StreamingFormat) -> None:
    """Warn if beside the file that is read lies the part of a later run, which broke off."""
    for part in parts:
        file = lock_abandoned(part)
        if file is not None:
            last = None
            with file, suppress(RecordingError):
                last = format_.held(file)
            if last is not None:
                where = f"what it recorded, up to step {last}, is in {path_shown(part, path)}"
                _warn(f"{path} is of an earlier run: a later run did not come to its end; {where}")


def take_over_parts(path: Path, format_: StreamingFormat) -> None:
    """Before a run writes a recording: take over what runs that are gone have left beside it, or clear it away, and
    say so. Where the file itself is not there a part becomes it. Raises RecordingError, OSError."""
    target = real_path(path)
    for part, file in abandoned_parts(target):
        try:
            last = format_.held(file)
        except RecordingError:  # a file of somebody else
            continue
        recorded = f"what an earlier run recorded before it broke off, up to step {last},"
        if last is None:
            part.unlink()
        elif target.exists():
            part.unlink()
            _warn(f"{path}: {recorded} is removed ({path_shown(part, path)})")
        else:
            format_.finish(file, part, path)
            _warn(f"{path}: {recorded} is in it until this run is at its end")


def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=callers_level())
