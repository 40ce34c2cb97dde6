"""The part: the file into which a recording is written during its run; kept if the run fails, so no step is lost.

In: the path of a recording. Out: a file beside it, to which rows are written as they come, and which replaces the
recording at the end.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from neurovis_spec.runtime.files import copy_to_device, named, written_to
from neurovis_spec.runtime.parts import open_beside, shown


@dataclass
class Part:
    """A file that is written to without a buffer. ``held`` is the last step that can be read from it, None for none."""

    file: FileIO
    #: None where the recording goes to a device
    path: Path | None
    target: Path
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
            yield from _beside(path, target)
            return
        with tempfile.TemporaryFile(buffering=0) as unnamed, FileIO(os.dup(unnamed.fileno()), "r+") as file:
            yield Part(file, None, target)


def _beside(path: Path, target: Path) -> Iterator[Part]:
    beside, file = open_beside(target, "part")
    part = Part(file, beside, target)
    try:
        yield part
    except BaseException:
        if part.path is not None and part.held is None:
            part.path.unlink(missing_ok=True)
        elif part.path is not None:
            words = f"{path}: what was recorded, up to step {part.held}, is in {shown(beside, path)}"
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
