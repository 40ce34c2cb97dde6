"""Files written as a whole or not at all.

In: a path. Out: an open file beside it, which takes its place when all is written. So a reader never sees half a
file, and an interrupted run leaves what was there before. A character device (``/dev/null``, a terminal) has no place
to take: it gets all at the end.
"""

from __future__ import annotations

import os
import shutil
import signal
import stat
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A file to write (and to read) that replaces ``path`` at the end; after an exception nothing has changed.

    A link is followed. Raises OSError where the folder cannot be written or the path is neither a regular file nor a
    character device.
    """
    target = Path(os.path.realpath(path))
    if target.is_char_device():
        with tempfile.TemporaryFile() as file:
            yield file
            file.seek(0)
            with target.open("wb") as device:
                shutil.copyfileobj(file, device)
        return
    if target.exists() and not target.is_file():
        raise OSError(f"{path} is not a regular file")
    beside = target.with_name(f".{target.name[:100]}.{uuid4().hex[:12]}.part")
    try:
        with beside.open("x+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        beside.replace(target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


@contextmanager
def uninterrupted() -> Iterator[None]:
    """A block in which Ctrl-C waits for its end, so that nothing in it is half done."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield  # nothing that Ctrl-C raises comes here
        return
    waiting: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: waiting.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if waiting:
        before(waiting[0], None)


def regular_size(path: str | os.PathLike[str]) -> int:
    """The size of a regular file in bytes. Raises OSError for a pipe, device or folder, which is never opened."""
    found = Path(path).stat()
    if not stat.S_ISREG(found.st_mode):
        raise OSError("not a regular file")
    return found.st_size
