"""The user's cache: folders of what takes long to make, kept by the hash of all that it is made of.

In: the name of a folder, a key, bytes. Out: the bytes that were kept by this key, or None. Whatever is wrong with the
cache is as if nothing were kept: a folder that others may write to, a file that is torn or foreign, a full disk. Each
file is written beside its place and moved there. The folder holds a bounded number of bytes: what was used longest ago
goes first. Where ``NEUROVIS_CACHE`` is ``off`` nothing is read or kept here.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import zlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

#: Names what turns the cache off.
ENVIRONMENT_VARIABLE: Final = "NEUROVIS_CACHE"
#: A folder holds at most so many bytes.
MOST_BYTES: Final = 64 << 20
#: What a file begins with, before the checksum of the rest.
_MAGIC: Final = b"neurovis cache 1\n"
_CHECKSUM: Final = hashlib.sha256().digest_size


def folder(name: str) -> Path:
    """Where what is called so is kept, which need not be there."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(named) if named and Path(named).is_absolute() else Path.home() / ".cache"
    except RuntimeError:  # there is no home
        base = Path(tempfile.gettempdir()) / "neurovis-no-home"
    return base / "neurovis" / name


def is_ours(cache: Path) -> bool:
    """Whether nobody else can have put anything there, which would be taken as this user's. Raises OSError."""
    if sys.platform == "win32":
        return True
    status = cache.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022


def trim(cache: Path, newest: Path, most: int = MOST_BYTES) -> None:
    """Remove what was used longest ago of the files of the kind of ``newest``, where they hold more than so many
    bytes."""
    found: list[tuple[float, int, Path]] = []
    for path in _entries(cache, newest.suffix):
        with suppress(OSError):
            status = path.stat()
            found.append((status.st_mtime, status.st_size, path))
    total = sum(size for _, size, _ in found)
    for _, size, path in sorted(found):
        if total <= most:
            return
        if path != newest:
            try:
                path.unlink()
            except OSError:
                continue
            total -= size


def _entries(cache: Path, suffix: str) -> Iterable[Path]:
    try:
        return [path for path in cache.iterdir() if path.suffix == suffix]
    except OSError:
        return ()


@dataclass(frozen=True, slots=True)
class UserCache:
    """What is kept in the folder of this name."""

    name: str
    most: int = MOST_BYTES

    @property
    def on(self) -> bool:
        """Whether anything is kept."""
        return os.environ.get(ENVIRONMENT_VARIABLE, "").strip().lower() != "off"

    def read(self, key: str) -> bytes | None:
        """What was kept by this key."""
        if not self.on:
            return None
        path = self._path(key)
        try:
            if not is_ours(path.parent) or not path.is_file():  # who opens a pipe waits for ever
                return None
            data = path.read_bytes()
        except OSError:
            return None
        begin = len(_MAGIC) + _CHECKSUM
        body = data[begin:]
        if data[:begin] != _MAGIC + hashlib.sha256(key.encode() + body).digest():
            return None
        with suppress(OSError):
            os.utime(path)
        try:
            return zlib.decompress(body)
        except zlib.error:
            return None

    def keep(self, key: str, data: bytes) -> None:
        """Keep this, where it can be kept, and is not so large that little else would be."""
        if not self.on:
            return
        body = zlib.compress(data, 1)
        if len(body) > self.most // 4:
            return
        path = self._path(key)
        with suppress(OSError):
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            if is_ours(path.parent):
                self._write(path, _MAGIC + hashlib.sha256(key.encode() + body).digest() + body)
                trim(path.parent, path, self.most)

    @staticmethod
    def _write(path: Path, data: bytes) -> None:
        """Write a file as a whole; no half of one is ever seen."""
        handle, beside = tempfile.mkstemp(dir=path.parent, prefix=".making")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            Path(beside).replace(path)
        except BaseException:
            Path(beside).unlink(missing_ok=True)
            raise

    def _path(self, key: str) -> Path:
        return folder(self.name) / (hashlib.sha256(key.encode()).hexdigest()[:40] + ".kept")
