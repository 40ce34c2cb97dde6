"""Opening files that somebody else named: regular files only, bounded in size, never waiting.

In: a path and the most bytes wanted. Out: the bytes, whole or in parts, or a FileFault that says in an author's words
why not. A device, a pipe or a socket is told from a file before it is opened (opening one may have effects, reading one
may never end).
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import NamedTuple

from neurovis_spec.real_paths import reason_of

_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
#: bytes that are read at once of a file that says to have fewer
_CHUNK = 1 << 18


class FileFault(NamedTuple):
    """Why a file could not be read: the finding's code and what completes the sentence 'FILE …'."""

    code: str
    reason: str


def fault_of(path: Path, most: int) -> FileFault | None:
    """Why a path is no regular file of at most ``most`` bytes, if it is none; nothing is opened."""
    try:
        return _fault(path.stat(), most)
    except (OSError, ValueError) as error:
        return _unreadable(error)


def read_bytes(path: Path, most: int) -> bytes | FileFault:
    """The bytes of a regular file of at most ``most`` bytes; symbolic links are followed (see ``data.files``)."""
    parts = read_parts(path, most)
    return parts if isinstance(parts, FileFault) else b"".join(parts)


def read_parts(path: Path, most: int, size: int | None = None) -> list[bytes] | FileFault:
    """The same in parts of this size; by default in one, where the file is as long as it says."""
    fault = fault_of(path, most)
    if fault is not None:
        return fault
    try:
        handle = os.open(path, _FLAGS)
    except (OSError, ValueError) as error:
        return _unreadable(error)
    try:
        status = os.fstat(handle)
        return _fault(status, most) or _read(handle, most, size or max(status.st_size + 1, _CHUNK))
    except OSError as error:
        return _unreadable(error)
    finally:
        os.close(handle)


def _fault(status: os.stat_result, most: int) -> FileFault | None:
    if stat.S_ISDIR(status.st_mode):
        return FileFault("file-kind", "is a folder, not a file")
    if not stat.S_ISREG(status.st_mode):
        return FileFault("file-kind", "is no regular file (a device, a pipe or a socket)")
    return _too_large(most) if status.st_size > most else None


def _read(handle: int, most: int, size: int) -> list[bytes] | FileFault:
    parts: list[bytes] = []
    room = most + 1  # one more: a file may grow, and some systems' files claim to be empty
    while room and (part := os.read(handle, min(room, size))):
        parts.append(part)
        room -= len(part)
    return parts if room else _too_large(most)


def _too_large(most: int) -> FileFault:
    return FileFault("too-large", f"is larger than {most >> 20} MiB")


def _unreadable(error: Exception) -> FileFault:
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return FileFault("file-missing", "does not exist")
    reason = reason_of(error) if isinstance(error, OSError) else str(error)
    return FileFault("file-unreadable", f"cannot be read: {reason}")
