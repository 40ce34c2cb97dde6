"""Memory, and room on a disk: the size of a recording, and a refusal of one that does not fit.

In: numbers of rows and columns. Out: nothing, or RecordingError that says the size and the way out. An operating system
may promise more memory than there is and end the process much later, so what is free is asked beforehand.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from neurovis_spec.real_paths import real_path
from neurovis_spec.runtime.errors import RecordingError

_MEMORY, _CGROUPS_FILE, _CGROUP_MOUNT = Path("/proc/meminfo"), Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
#: a recording of so many bytes is never refused: what is free is an estimate
SMALL = 64 << 20
_UNITS = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB")
_NUMBER = 8


class TooLargeError(RecordingError):
    """A recording for which there is not the memory, or not the room on the disk."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


def check_room(steps: int, every: int, columns: int) -> None:
    """Refuse a recording of ``steps`` steps, every ``every``-th kept, with ``columns`` numbers a step, if it takes more
    memory than is free and is not small. Raises TooLargeError."""
    rows, row_bytes = -(-steps // every), (columns + 1) * _NUMBER  # its columns, and its step
    if rows * row_bytes <= SMALL:  # what is free need not be asked
        return
    room = available()
    if room is not None and rows * row_bytes > room:
        raise _too_large(steps, every, rows * row_bytes, room, "memory")


def check_disk(path: Path, steps: int, every: int, size: int) -> None:
    """Refuse a recording for which the disk has not the room before anything is run. Raises TooLargeError."""
    try:
        room = shutil.disk_usage(real_path(path).parent).free
    except OSError:  # what is wrong with the folder is said when the file is opened
        return
    if size > room:
        raise _too_large(steps, every, size, room, "the disk while it is written")


def _too_large(steps: int, every: int, size: int, room: int, where: str) -> TooLargeError:
    # what is suggested fills half of what is free
    fewer = _round_up(-(-every * size // max(room // 2, 1)))
    message = f"a recording of {-(-steps // every):,} steps takes {shown(size)} of {where}, and {shown(room)} are free"
    ways = f"neurovis run --every {fewer}, in Python every={fewer}"
    return TooLargeError(message, f"run fewer steps, or record every {fewer:,}th step only ({ways})")


def available() -> int | None:
    """Bytes of memory that are free for this process, as far as the system tells."""
    rooms = [room for room in (_free(), _allowed()) if room is not None]
    return min(rooms, default=None)


def _free() -> int | None:
    """What the machine has free, or its whole memory where it does not say that; None where it says neither."""
    try:
        for line in _MEMORY.read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):  # another operating system
        return None


def _allowed() -> int | None:
    """What the limits of this process's control groups leave (a container's, a service's), None without any. The page
    cache counts as free: the system gives it up before it refuses memory."""
    try:
        lines = _CGROUPS_FILE.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):  # another operating system
        return None
    rooms: list[int] = []
    for line in lines:  # "5:memory:/path" (version 1), or "0::/path" (version 2)
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        if not controllers:
            rooms += _left_in_group(_CGROUP_MOUNT, path, "memory.max", "memory.current", "")
        elif "memory" in controllers.split(","):
            rooms += _left_in_group(
                _CGROUP_MOUNT / "memory", path, "memory.limit_in_bytes", "memory.usage_in_bytes", "total_"
            )
    return min(rooms, default=None)


def _left_in_group(mount: Path, path: str, limit: str, taken: str, prefix: str) -> list[int]:
    """What the group at a path and all around it leave; a container sees its own at the mount."""
    own = mount / path.strip("/")
    left = []
    for group in (own, *own.parents):
        if group.is_relative_to(mount):
            try:
                room = int((group / limit).read_text("ascii")) - int((group / taken).read_text("ascii"))
                counts = dict(line.split() for line in (group / "memory.stat").read_text("ascii").splitlines())
                cache = sum(int(counts[f"{prefix}{kind}_file"]) for kind in ("active", "inactive"))
            except (OSError, ValueError, KeyError):  # no such group, or the limit "max"
                continue
            left.append(max(0, room + cache))
    return left


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
