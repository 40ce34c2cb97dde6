"""Memory, and room on a disk: what a recording takes, and a refusal before it is taken.

In: numbers of rows and columns. Out: nothing, or RecordingError that says the size and the way out. An operating system
may promise more memory than there is and end the process much later, so what is free is asked beforehand.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from neurovis_spec.runtime.recording import RecordingError

_MEMORY = Path("/proc/meminfo")
_LIMIT, _TAKEN = Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")
_UNITS = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB")
_NUMBER = 8


class TooLargeError(RecordingError):
    """A recording for which there is not the memory, or not the room on the disk."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


def check_room(steps: int, every: int, columns: int) -> None:
    """Refuse a recording of ``steps`` steps, every ``every``-th kept, with ``columns`` numbers a step, if it takes more
    memory than is free. Raises TooLargeError."""
    rows, row = -(-steps // every), (columns + 1) * _NUMBER
    room = available()
    if room is not None and rows * row > room:
        raise _too_large(steps, every, rows * row, room, "memory")


def check_disk(path: Path, steps: int, every: int, size: int) -> None:
    """Refuse a recording for which the disk has not the room before anything is run. Raises TooLargeError."""
    try:
        room = shutil.disk_usage(path.resolve().parent).free
    except OSError:  # what is wrong with the folder is said when the file is opened
        return
    if size > room:
        raise _too_large(steps, every, size, room, "the disk")


def _too_large(steps: int, every: int, size: int, room: int, where: str) -> TooLargeError:
    fewer = _round_up(-(-every * size // max(room // 2, 1)))
    message = f"a recording of {-(-steps // every):,} steps takes {shown(size)} of {where}, and {shown(room)} are free"
    ways = f"neurovis run --every {fewer}, in Python every={fewer}"
    return TooLargeError(message, f"run fewer steps, or record every {fewer:,}th step only ({ways})")


def available() -> int | None:
    """Bytes of memory that are free for this process, as far as the system tells."""
    found = [room for room in (_free(), _allowed()) if room is not None]
    return min(found) if found else None


def _free() -> int | None:
    try:
        for line in _MEMORY.read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):  # another operating system
        return None


def _allowed() -> int | None:
    """What a container's limit leaves."""
    try:
        return max(0, int(_LIMIT.read_text(encoding="ascii")) - int(_TAKEN.read_text(encoding="ascii")))
    except (OSError, ValueError):  # no container, or "max"
        return None


def _round_up(number: int) -> int:
    """The next of 1, 2, 5, 10, 20, …

    >>> _round_up(1), _round_up(3), _round_up(1001)
    (1, 5, 2000)
    """
    scale = int("1" + "0" * (len(str(number)) - 1))
    return next(step * scale for step in (1, 2, 5, 10) if step * scale >= number)


def shown(size: float) -> str:
    """A number of bytes as people read it.

    >>> shown(1536), shown(8 * 10**12)
    ('1.5 KiB', '7.3 TiB')
    """
    for unit in _UNITS:
        if size < 1024 or unit == _UNITS[-1]:
            break
        size /= 1024
    return f"{size:.0f} {unit}" if unit == _UNITS[0] else f"{size:,.1f} {unit}"
