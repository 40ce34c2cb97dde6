"""Files written as a whole or not at all; and the part into which a recording is written during its run.

In: a path. Out: an open file beside it, which takes its place when all is written. So a reader never sees half a file,
and an interrupted run leaves what was there before. A character device (``/dev/null``, a terminal) has no place to
take: it gets all at the end. A part takes rows as they come, and is kept if the run fails, so that no step is lost.
"""

from __future__ import annotations

import errno
import io
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import BinaryIO, Final

from neurovis_spec.real_paths import CIRCLE, is_circular, real_path
from neurovis_spec.runtime.parts import Kind, clear, open_beside, path_shown

#: What the system says where there is no room: on the disk, for this user, in a file.
FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})


@contextmanager
def named(path: str | os.PathLike[str]) -> Iterator[None]:
    """A block that writes to a file; where there is no room for it, the error says that it is this one."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            error.filename = os.fspath(path)
        raise


@contextmanager
def replacing(path: str | os.PathLike[str], kind: Kind = "neurovis-new") -> Iterator[BinaryIO]:
    """A file to write (and to read) that replaces ``path`` at the end; after an exception nothing has changed. Of which
    ``kind`` it is until then says whether it is of use to somebody if its writer is killed.

    A link is followed. Permissions stay. Raises OSError where the folder cannot be written or the path is neither a
    regular file nor a character device.
    """
    target = written_to(path)
    with named(path):
        if target.is_char_device():
            with tempfile.TemporaryFile() as file:
                yield file
                copy_to_device(file, target)
            return
        clear(target, kind)
        beside, raw = open_beside(target, kind)
        try:
            buffered = io.BufferedRandom(raw)
            yield buffered
            buffered.flush()
            os.fsync(raw.fileno())
            beside.replace(target)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        finally:
            with suppress(OSError):  # what could not be written by now cannot be written
                raw.close()


def written_to(path: str | os.PathLike[str]) -> Path:
    """The file that a path stands for, links followed. Raises OSError for a folder, a pipe, a block device, links that
    lead round in a circle, and where there is no folder to write it into."""
    target = real_path(path)
    if is_circular(target):
        raise OSError(errno.ELOOP, CIRCLE, os.fspath(path))
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "there is no folder", os.path.dirname(path))  # noqa: PTH120
    if target.exists() and not target.is_file() and not target.is_char_device():
        raise OSError(f"{path} is not a regular file")
    return target


def copy_to_device(file: BinaryIO, device: Path) -> None:
    """Send a whole file to a character device."""
    file.seek(0)
    with device.open("wb") as opened:
        shutil.copyfileobj(file, opened)


def regular_size(path: str | os.PathLike[str]) -> int:
    """The size of a regular file in bytes. Raises OSError for a pipe, device or folder, which is never opened."""
    found = Path(path).stat()
    if not stat.S_ISREG(found.st_mode):
        raise OSError("not a regular file")
    return found.st_size


@dataclass
class Part:
    """A file that is written to without a buffer, and becomes that of a recording."""

    file: FileIO
    #: None where the recording goes to a device, and once it has taken its place
    path: Path | None
    #: where the recording will be
    target: Path
    #: the last step that can be read from it, None for none
    held: int | None = None

    def take_place(self) -> None:
        """Move the part to the path of the recording; both have the same format. Raises OSError."""
        if self.path is None:
            copy_to_device(self.file, self.target)
            return
        os.fsync(self.file.fileno())
        self.path.replace(self.target)
        self.path = None


@contextmanager
def part_of(path: Path) -> Iterator[Part]:
    """A part for a recording. It is removed when the block ends; after an exception it stays if it holds a step, and a
    warning says so. Raises OSError."""
    target = written_to(path)
    with named(path):
        if not target.is_char_device():
            yield from _open(path, target)
            return
        with tempfile.TemporaryFile(buffering=0) as unnamed, FileIO(os.dup(unnamed.fileno()), "r+") as file:
            yield Part(file, None, target)


def _open(path: Path, target: Path) -> Iterator[Part]:
    """A part in a file beside ``target``, which ``path`` leads to."""
    beside, file = open_beside(target, "part")
    part = Part(file, beside, target)
    try:
        yield part
    except BaseException:
        if part.path is not None and part.held is None:
            part.path.unlink(missing_ok=True)
        elif part.path is not None:
            words = f"{path}: what was recorded, up to step {part.held}, is in {path_shown(beside, path)}"
            warnings.warn(words + ("" if target.exists() else ", and is read in its place"), stacklevel=2)
        raise
    else:
        if part.path is not None:
            part.path.unlink(missing_ok=True)
    finally:
        with suppress(OSError):
            file.close()


def move(file: FileIO, part: Path, path: Path) -> None:
    """Move a part, which has the same format as the recording, to the path of the recording. Raises OSError."""
    target = written_to(path)
    if target.is_char_device():
        with target.open("wb") as device:
            file.seek(0)
            shutil.copyfileobj(file, device)
        part.unlink()
        return
    os.fsync(file.fileno())
    part.replace(target)
