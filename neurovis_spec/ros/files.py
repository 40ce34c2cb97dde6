"""A recording as files: one after the other, each of which can be read alone.

In: chunks of messages. Out: ``NAME.mcap``, ``NAME-1.mcap``, … or bags, or a folder as ``ros2 bag`` writes them. Each
file begins with the messages that are needed to read it.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Final
from uuid import uuid4

import yaml

from neurovis_spec.ros.definitions import written
from neurovis_spec.ros.logs import BagLog, Log, McapLog, Stored, Topic
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.runtime.mcap_file import numbered
from neurovis_spec.runtime.parts import short

_FORMATS: Final[Mapping[str, tuple[type[McapLog | BagLog], Ros | None]]] = {
    ".mcap": (McapLog, None),
    ".bag": (BagLog, 1),
    "": (McapLog, 2),
}
_UNITS: Final = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "ki": 1 << 10, "mi": 1 << 20, "gi": 1 << 30}
_ROTATE: Final = re.compile(r"(\d+(?:\.\d+)?)\s*(?:((?:[kmg]i?)?)b|(s|min|h)?)", re.IGNORECASE)
METADATA: Final = "metadata.yaml"


@dataclass(frozen=True, slots=True)
class Rotation:
    """When a file is closed and the next one begun: at so many bytes, or after so many seconds."""

    size: float = 1 << 30
    seconds: float = float("inf")


def rotation(text: str) -> Rotation | None:
    """What ``--rotate`` says; None where it says nothing that is known.

    >>> rotation("500MB"), rotation("1GiB").size, rotation("60").seconds, rotation("2 min").seconds, rotation("x")
    (Rotation(size=500000000.0, seconds=inf), 1073741824.0, 60.0, 120.0, None)
    """
    matched = _ROTATE.fullmatch(text.strip())
    if matched is None or not float(matched[1]):
        return None
    value = float(matched[1])
    if matched[2] is not None:
        return Rotation(size=value * _UNITS[matched[2].lower()])
    return Rotation(float("inf"), value * {"s": 1, "min": 60, "h": 3600}[(matched[3] or "s").lower()])


def refusal(path: Path, ros: Ros | None = None) -> str | None:
    """Why no recording for this ROS (None: for any) can be written to a path; None where one can."""
    known = _FORMATS.get(path.suffix.lower())
    if known is None:
        return f"recordings are '.mcap', '.bag' or a folder without suffix, not '{path.suffix}'"
    if ros is not None and known[1] not in (None, ros):
        return f"a recording of ROS {ros} cannot be {'a .bag' if ros == 2 else 'a folder'}: name it .mcap"
    return None


def in_the_way(path: Path, force: bool) -> list[Path]:
    """The files of an earlier recording at a path. Raises OSError where none can be written, and without ``force``
    FileExistsError where there is one."""
    folder = path.parent
    if not folder.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(folder))
    if not os.access(folder, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    if not path.suffix and path.exists() and not path.is_dir():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    old = [numbered(path, 0)] if path.suffix else [path / METADATA]
    number = 0
    while numbered(path, number).exists():
        old.append(numbered(path, number))
        number += 1
    # the first may have been moved away
    if path.suffix and numbered(path, 1).exists() and not numbered(path, 0).exists():
        old.append(numbered(path, 1))
    there = [one for one in dict.fromkeys(old) if one.exists()]
    if there and not force:
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(there[0]))
    return there


@contextmanager
def _out_of_the_way(paths: Iterable[Path]) -> Iterator[None]:
    """The files have other names meanwhile. They are removed then, or are back where there was an error."""
    moved: list[tuple[Path, Path]] = []
    try:
        for path in (path for path in paths if path.exists()):
            moved.append((path, path.rename(path.with_name(f".{short(path.name)}.old"))))
        yield
    except BaseException:
        for path, aside in moved:
            aside.replace(path)
        raise
    for _, aside in moved:
        aside.unlink(missing_ok=True)


@dataclass(eq=False)
class Files:
    """The files of a recording. ``first`` are the messages with which each file begins, at the time of its first one;
    ``frame`` is the record in an MCAP file from which a ``Recording`` of the network can be made."""

    path: Path
    ros: Ros
    about: Mapping[str, str]
    first: Sequence[tuple[Topic, bytes]] = ()
    rotation: Rotation = field(default_factory=Rotation)
    force: bool = False
    frame: bytes = b""
    clock: Callable[[], float] = monotonic

    def __post_init__(self) -> None:
        #: the files of an earlier recording, which stay until this one has something in their place
        self._old = in_the_way(self.path, self.force)
        self._id = uuid4().hex
        self._number, self._since = 0, 0.0
        self._log: Log | None = None
        #: of the closed files and the open one: the messages of each topic, and the first and last times
        self._held: list[_Held] = []
        if not self.path.suffix:
            self.path.mkdir(exist_ok=True)

    @property
    def paths(self) -> list[Path]:
        """The files that there are."""
        return [held.path for held in self._held]

    def write(self, messages: Sequence[Stored]) -> None:
        """Add a chunk, in a new file where it is time for one. Raises OSError; nothing of the chunk is held then."""
        if self._log is not None and self._due(self._log):
            self._end()
            self._number += 1
        if self._log is None:
            self._begin(messages[0])
        assert self._log is not None
        self._log.write(messages)
        self._held[-1].add(messages)

    def _due(self, log: Log) -> bool:
        return log.size >= self.rotation.size or self.clock() - self._since >= self.rotation.seconds

    def _begin(self, message: Stored) -> None:
        format_, _ = _FORMATS[self.path.suffix.lower()]
        path = numbered(self.path, self._number)
        held = _Held(path)
        first = [Stored(topic, 0, message.log_time, message.publish_time, data) for topic, data in self.first]
        about = {**self.about, "recording": self._id, "part": str(self._number)}
        with _out_of_the_way(self._old):
            log: Log = format_(path, self.ros, about, self.frame)
            if first:
                try:
                    log.write(first)
                except OSError:  # a file without them is of no use
                    log.finish()
                    path.unlink()
                    raise
                held.add(first)
        self._old = []
        self._log, self._since = log, self.clock()
        self._held.append(held)
        self._describe()

    def sync(self) -> None:
        """Have all of it written to the disk. Raises OSError."""
        if self._log is not None:
            self._log.sync()

    def close(self) -> None:
        """End the last file. Raises OSError."""
        if self._log is not None:
            self._end()

    def _end(self) -> None:
        log, self._log = self._log, None
        assert log is not None
        try:
            log.finish()
        finally:
            self._describe()

    def _describe(self) -> None:
        """Write what ``ros2 bag`` reads first of a folder."""
        if self.path.suffix:
            return
        beside = self.path / f".{METADATA}.new"
        beside.write_text(yaml.safe_dump(_metadata(self._held), sort_keys=False), encoding="utf-8")
        with suppress(OSError):
            beside.replace(self.path / METADATA)


class _Held:
    """What a file holds."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.counts: dict[Topic, int] = {}
        self.first, self.last = 1 << 64, 0

    def add(self, messages: Sequence[Stored]) -> None:
        for one in messages:
            self.counts[one.topic] = self.counts.get(one.topic, 0) + 1
            self.first, self.last = min(self.first, one.log_time), max(self.last, one.log_time)


def _metadata(held: Sequence[_Held]) -> dict[str, object]:
    counts: dict[Topic, int] = {}
    for one in held:
        for topic, count in one.counts.items():
            counts[topic] = counts.get(topic, 0) + count
    topics = [
        {
            "topic_metadata": {
                "name": topic.name,
                "type": written(topic.type, 2),
                "serialization_format": "cdr",
                "offered_qos_profiles": "",
            },
            "message_count": count,
        }
        for topic, count in counts.items()
    ]
    first = min((one.first for one in held if one.counts), default=0)
    last = max((one.last for one in held), default=0)
    files = [
        {
            "path": one.path.name,
            "starting_time": {"nanoseconds_since_epoch": one.first if one.counts else 0},
            "duration": {"nanoseconds": max(0, one.last - one.first)},
            "message_count": sum(one.counts.values()),
        }
        for one in held
    ]
    about = {
        "version": 5,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": last - first},
        "starting_time": {"nanoseconds_since_epoch": first},
        "message_count": sum(counts.values()),
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [one.path.name for one in held],
        "files": files,
    }
    return {"rosbag2_bagfile_information": about}
