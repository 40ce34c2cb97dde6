"""Files beside a file that is being written (``.x.npz.part``), each locked by whoever writes it.

In: the file that is to be written. Out: a file beside it, of which nobody else takes the name; those that are there. A
lock ends with its process, however that ends, so a file beside that nobody has locked is of a writer that is gone.
"""

from __future__ import annotations

import os
import re
import stat
import sys
from collections.abc import Iterator
from contextlib import suppress
from hashlib import sha256
from io import FileIO
from itertools import count
from pathlib import Path
from typing import Literal, TypeAlias

if sys.platform != "win32":
    import fcntl

#: ``part``: rows of a recording whose run has not come to its end, which can be read at any time; the other: a file of
#: use to nobody before it is whole, of a name that nobody else gives a file
Kind: TypeAlias = Literal["part", "neurovis-new"]

#: bytes of a name up to which it stands as it is in the name of a file beside
_LONGEST = 200
_PART = re.compile(r"\.(?P<name>.+?)(?:\.[0-9]+)?\.part")


def open_beside(target: Path, kind: Kind) -> tuple[Path, FileIO]:
    """An empty file beside ``target``, locked, with its permissions if it is there. Raises OSError."""
    for number in count(1):
        path = _beside(target, kind, number)
        try:
            file = FileIO(path, "x+")
        except FileExistsError:
            continue
        if _lock(file) is False or not _is_at(file, path):  # somebody has taken it for one that was left
            file.close()
            continue
        _liken(file, target)
        break
    return path, file


def files_beside(target: Path, kind: Kind) -> list[Path]:
    """The files of this kind beside ``target``, the one written last first."""
    pattern = re.compile(re.escape(f".{short(target.name)}") + rf"(?:\.[0-9]+)?\.{kind}")
    found: list[tuple[int, Path]] = []
    with suppress(OSError):
        for name in os.listdir(target.parent):  # noqa: PTH208
            if pattern.fullmatch(name):
                with suppress(OSError):
                    status = (target.parent / name).lstat()
                    if stat.S_ISREG(status.st_mode):
                        found.append((status.st_mtime_ns, target.parent / name))
    return [path for _, path in sorted(found, reverse=True)]


def lock_abandoned(path: Path) -> FileIO | None:
    """Open and lock a part whose writer has ended; None if it is still being written, or if that is not known."""
    if sys.platform == "win32":
        return None
    try:
        file = FileIO(path, "r+")
    except OSError:
        return None
    if _lock(file) and _is_at(file, path):
        return file
    file.close()
    return None


def is_written(path: Path) -> bool:
    """Whether somebody is writing a file beside."""
    file = lock_abandoned(path)
    if file is None:
        return True
    file.close()
    return False


def target_of(path: Path) -> Path | None:
    """The file that a part was to become, None for a path that is no part.

    >>> target_of(Path("runs/.x.npz.2.part")), target_of(Path("x.npz"))
    (PosixPath('runs/x.npz'), None)
    """
    match = _PART.fullmatch(path.name)
    return path.with_name(match["name"]) if match else None


def path_shown(part: Path, path: Path) -> Path:
    """A file beside as one names it who names its target by a path."""
    return part if path.is_symlink() else path.with_name(part.name)


def _beside(target: Path, kind: Kind, number: int) -> Path:
    return target.with_name(f".{short(target.name)}{f'.{number}' if number > 1 else ''}.{kind}")


def short(name: str) -> str:
    """The name of a file, or one in its place where that with a little more would be too long for a file system."""
    if len(os.fsencode(name)) <= _LONGEST:
        return name
    return f"{name[:40]}~{sha256(os.fsencode(name)).hexdigest()[:16]}{Path(name).suffix[:8]}"


def _lock(file: FileIO) -> bool | None:
    """Lock a file: False if another one has, None where there are no locks."""
    if sys.platform == "win32":
        return None
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(file: FileIO, path: Path) -> bool:
    """Whether an open file is the one that is there now."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.lstat())
    except OSError:
        return False


def _liken(file: FileIO, target: Path) -> None:
    """Give a file the permissions of the one whose place it will take, and its owner where that is allowed."""
    try:
        wanted = target.stat()
    except OSError:
        return
    if sys.platform == "win32":
        return
    now = os.fstat(file.fileno())
    for owner in ((wanted.st_uid, -1), (-1, wanted.st_gid)):  # −1: leave it as it is
        if owner not in ((now.st_uid, -1), (-1, now.st_gid)):
            with suppress(OSError):
                os.fchown(file.fileno(), *owner)
    with suppress(OSError):  # a file system without permissions
        os.fchmod(file.fileno(), stat.S_IMODE(wanted.st_mode))


def clear(target: Path, kind: Kind) -> None:
    """Remove the files of this kind whose writer has ended."""
    for path in files_beside(target, kind):
        file = lock_abandoned(path)
        if file is not None:
            with file, suppress(OSError):
                path.unlink()


def abandoned_parts(target: Path) -> Iterator[tuple[Path, FileIO]]:
    """The parts of runs that are gone, each locked while it is looked at."""
    for path in files_beside(target, "part"):
        file = lock_abandoned(path)
        if file is not None:
            with file:
                yield path, file
