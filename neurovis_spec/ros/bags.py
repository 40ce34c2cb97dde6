"""Recordings of both ROS are read: MCAP files, bags of ROS 1, folders and databases of ``ros2 bag``.

In: a path. Out: a Bag: its topics, and its messages one after the other, in the order of the file. Files that break
off are read to their last whole chunk. Nothing that a file says is believed before it is checked, and none is held in
memory.
"""

from __future__ import annotations

import re
import sqlite3
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final, Protocol
from urllib.parse import quote

import yaml

from neurovis_spec.language.ros_types import plain
from neurovis_spec.real_paths import CIRCLE, is_circular, real_path
from neurovis_spec.ros import bag1
from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.files import METADATA
from neurovis_spec.ros.logs import ABOUT, BAG_MAGIC, Stored, Topic
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.mcap_file import following
from neurovis_spec.runtime.named_values import SCHEMA as BY_NAME
from neurovis_spec.runtime.wire import Encoding

_SQLITE: Final = b"SQLite format 3\0"
#: a chunk of more bytes is none
_LARGEST: Final = 1 << 30
_ENCODINGS: Final[Mapping[str, tuple[Ros, Encoding]]] = {"ros1": (1, "ros1"), "cdr": (2, "cdr")}
_METADATA_SIZE: Final = 8 << 20
_NUMBERED: Final = re.compile(r"(.*_)([0-9]{1,9})(\.\w+)", re.DOTALL)


class Part(Protocol):
    """One file of a recording. ``whole`` is whether it has come to its end, ``left_out`` are topics that are not read,
    and why."""

    path: Path
    ros: Ros
    about: Mapping[str, str]
    topics: tuple[Topic, ...]
    whole: bool
    left_out: dict[str, str]

    def messages(self) -> Iterator[Stored]:
        """The messages. Raises RecordingError."""
        ...


@dataclass(frozen=True)
class Bag:
    """A recording. ``about`` is what it says of the network, if it is one of ours."""

    parts: tuple[Part, ...]

    @property
    def ros(self) -> Ros:
        """Of which ROS its messages are."""
        return self.parts[0].ros

    @property
    def about(self) -> Mapping[str, str]:
        """What it says of the network, if it is one of ours."""
        return self.parts[0].about

    @property
    def topics(self) -> tuple[Topic, ...]:
        """Each topic once; one may be there several times, with different definitions."""
        return tuple(dict.fromkeys(topic for part in self.parts for topic in part.topics))

    def messages(self) -> Iterator[Stored]:
        """The messages, in the order of the files. Raises RecordingError."""
        for part in self.parts:
            yield from part.messages()


def read_bag(path: Path) -> Bag:
    """A recording, with the files that go on where the first ends. Warns of those that break off. Raises
    RecordingError, OSError."""
    parts = tuple(_folder(path) if path.is_dir() else _files(path))
    if any(part.ros != parts[0].ros for part in parts):
        raise RecordingError(f"{path}: its files hold messages of different ROS")
    for part in parts:
        if not part.whole:
            warnings.warn(f"{part.path} breaks off: it is read to its last whole chunk", stacklevel=2)
        for topic, why in part.left_out.items():
            warnings.warn(f"{part.path}: the messages on {topic} are left out: {why}", stacklevel=2)
    return Bag(parts)


def _files(path: Path) -> Iterator[Part]:
    first = _part(path)
    yield first
    for further in following(path, first.about, lambda one: _part(one).about):
        yield _part(further)


def _folder(path: Path) -> Iterator[Part]:
    """The files that ``metadata.yaml`` names, and those that go on behind them; without one, all that there are. Raises
    RecordingError where these are several recordings."""
    known = sorted(
        (one for one in path.iterdir() if one.suffix in (".mcap", ".db3")),
        key=lambda one: [int(text) if text.isdigit() else text for text in re.split(r"(\d+)", one.name)],
    )
    parts = [_part(path / name) for name in _named(path / METADATA)]
    is_named, paths = bool(parts), [part.path for part in parts]
    others = sorted((_part(one) for one in known if one not in paths), key=_place)
    if not parts and not others:
        raise RecordingError(f"{path}: a folder without a recording of ros2 bag")
    for part in others:
        if not parts or _goes_on(parts[-1], part):
            parts.append(part)
        elif not is_named:
            names = ", ".join(one.path.name for one in others[:4]) + (", …" if len(others) > 4 else "")
            raise RecordingError(f"{path}: its {len(others)} files are not one recording: name one of them ({names})")
    yield from parts


def _place(part: Part) -> int:
    """The number of a file in its recording, where it says so."""
    number = part.about.get("part", "")
    return int(number) if re.fullmatch(r"[0-9]{1,9}", number) else 0


def _goes_on(before: Part, part: Part) -> bool:
    """Whether a file is of the recording of another: it says so, or has the next number, as ``ros2 bag`` has it."""
    if before.about or part.about:
        return "recording" in part.about and before.about.get("recording") == part.about["recording"]
    numbered = _NUMBERED.fullmatch(before.path.name)
    if numbered is None:
        return False
    stem, number, suffix = numbered.groups()
    return part.path.name == f"{stem}{int(number) + 1}{suffix}"


def _named(path: Path) -> list[str]:
    if not path.is_file():
        return []
    if path.stat().st_size > _METADATA_SIZE:
        raise RecordingError(f"{path}: it is too large")
    try:
        about = yaml.safe_load(path.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        names = [str(name) for name in about["relative_file_paths"]]
        compression = str(about.get("compression_mode") or "").lower()
    except (yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError, AttributeError, RecursionError):
        return []
    if compression not in ("", "none"):
        raise RecordingError(f"{path}: its {compression}s are compressed one by one: 'ros2 bag convert' unpacks them")
    # older ones name them with their folder
    return [name for name in (name.rpartition("/")[2] for name in names) if (path.parent / name).is_file()]


def _part(path: Path) -> Part:
    if not path.is_file():
        if not path.exists():
            what = CIRCLE if is_circular(path) else "there is no such file"
            raise RecordingError(f"{path}: {what}")
        raise RecordingError(f"{path}: not a regular file")
    with path.open("rb") as file:
        magic = file.read(16)
    try:
        if magic.startswith(records.MAGIC):
            return _Mcap(path)
        if magic.startswith(BAG_MAGIC):
            return _Bag(path)
        if magic == _SQLITE:
            return _Database(path)
    except (RecordingError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: {error}") from None
    raise RecordingError(f"{path}: not a recording: neither MCAP nor a bag of ROS 1 or ROS 2")


def _playable(path: Path, topics: Iterable[Topic | None]) -> tuple[Topic, ...]:
    found = tuple(dict.fromkeys(topic for topic in topics if topic is not None))
    if len({topic.encoding for topic in found}) > 1:
        raise RecordingError("it holds messages of different ROS")
    return found


class _Mcap:
    """An MCAP file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about: Mapping[str, str] = {}
        self.whole = False
        self.left_out: dict[str, str] = {}
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, Topic | None] = {}
        profile = ""
        with path.open("rb") as file:
            for found in records.scan(file):
                if found.opcode == records.HEADER:
                    profile = records.content_of(file, found).text()
                elif found.opcode == records.METADATA and not self.about:
                    content = records.content_of(file, found, _METADATA_SIZE)
                    self.about = content.mapping() if content.text() == ABOUT else {}
                elif found.opcode in (records.DATA_END, records.FOOTER):
                    self.whole = True
                self._name(file, found)
            if not self.whole or not self._channels:
                for found in records.scan(file):
                    if found.opcode == records.CHUNK:
                        with suppress(records.DamagedError):
                            for item in self._chunk(file, found):
                                self._learn(item)
        self.topics = _playable(path, self._channels.values())
        self.ros: Ros = _ENCODINGS[self.topics[0].encoding][0] if self.topics else 1 if profile == "ros1" else 2

    def _name(self, file: BinaryIO, found: records.Found) -> None:
        if found.opcode == records.SCHEMA:
            self._learn(records.schema_of(records.content_of(file, found)))
        elif found.opcode == records.CHANNEL:
            self._learn(records.topic_of(records.content_of(file, found)))

    def _learn(self, item: records.Message | records.Topic | records.Described) -> None:
        if isinstance(item, records.Described):
            self._schemas[item.number] = item.schema
        elif isinstance(item, records.Topic) and item.channel not in self._channels:
            self._channels[item.channel] = self._topic(item)
            if len(self._channels) > records.MOST_NAMED:
                raise RecordingError("it holds more channels than there are numbers for")

    def _topic(self, item: records.Topic) -> Topic | None:
        schema, known = self._schemas.get(item.schema), _ENCODINGS.get(item.encoding)
        if schema is not None and schema.name == BY_NAME:
            return None  # the activities again, which nobody misses
        if schema is None or known is None or "/" not in schema.name:
            why = "their type is not named" if known else f"they are encoded as '{item.encoding[:20]}'"
            self.left_out[item.topic] = why
            return None
        text = schema.text if schema.encoding == f"ros{known[0]}msg" else ""
        return Topic(item.topic, plain(schema.name), known[1], text)

    def _chunk(
        self, file: BinaryIO, found: records.Found
    ) -> Iterator[records.Message | records.Topic | records.Described]:
        if found.length > _LARGEST:
            raise RecordingError("a chunk is larger than any can be")
        return records.messages_of(records.content_of(file, found))

    def messages(self) -> Iterator[Stored]:
        with self.path.open("rb") as file:
            try:
                for found in records.scan(file):
                    if found.opcode == records.DATA_END:
                        return
                    if found.opcode == records.CHUNK:
                        for item in self._chunk(file, found):
                            yield from self._stored(item)
                    elif found.opcode == records.MESSAGE and found.length <= _LARGEST:
                        yield from self._stored(records.message_of(records.content_of(file, found).data))
            except records.DamagedError:
                warnings.warn(f"{self.path}: a chunk is damaged: it is read to the one before it", stacklevel=2)
            except (RecordingError, UnicodeDecodeError) as error:
                raise RecordingError(f"{self.path}: {error}") from None

    def _stored(self, item: records.Message | records.Topic | records.Described) -> Iterator[Stored]:
        if not isinstance(item, records.Message):
            return
        if item.channel not in self._channels:
            raise RecordingError("a message is of a channel that there is not")
        topic = self._channels[item.channel]
        if topic is not None:
            yield Stored(topic, item.sequence, item.log_time, item.publish_time, item.data)


class _Bag:
    """A bag of ROS 1."""

    ros: Ros = 1

    def __init__(self, path: Path) -> None:
        self.path = path
        self.left_out: dict[str, str] = {}
        with path.open("rb") as file:
            head = bag1.head_of(file)
            self._connections, self.about = bag1.connections_of(file, head)
        self.whole = head.whole
        self.topics = tuple(dict.fromkeys(self._connections.values()))

    def messages(self) -> Iterator[Stored]:
        with self.path.open("rb") as file:
            try:
                for sequence, one in enumerate(bag1.messages_of(file)):
                    topic = self._connections.get(one.connection)
                    if topic is None:
                        raise RecordingError("a message is of a connection that there is not")
                    yield Stored(topic, sequence % (1 << 32), one.time, one.time, one.data)
            except (RecordingError, UnicodeDecodeError) as error:
                raise RecordingError(f"{self.path}: {error}") from None


class _Database:
    """A database of ``ros2 bag``."""

    ros: Ros = 2
    about: Mapping[str, str] = {}
    whole = True

    def __init__(self, path: Path) -> None:
        self.path = path
        self.left_out: dict[str, str] = {}
        self._topics: dict[int, Topic] = {}
        try:
            with closing(self._open()) as database:
                tables = {row[0] for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
                if not tables.issuperset(("topics", "messages")):
                    raise RecordingError("not a recording: a database of something else")
                texts = self._texts(database) if "message_definitions" in tables else {}
                rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
                for number, name, type_, format_ in rows.fetchmany(records.MOST_NAMED):
                    if format_ != "cdr" or "/" not in str(type_):
                        self.left_out[str(name)] = f"they are encoded as '{str(format_)[:20]}'"
                        continue
                    text = texts.get(str(type_)) or definition(str(type_), 2) or ""
                    self._topics[int(number)] = Topic(str(name), plain(str(type_)), "cdr", text)
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise RecordingError(f"not a recording ({error})") from None
        self.topics = tuple(self._topics.values())

    @staticmethod
    def _texts(database: sqlite3.Connection) -> dict[str, str]:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        rows = database.execute(query).fetchmany(records.MOST_NAMED)
        return {str(type_): str(text) for type_, encoding, text in rows if encoding == "ros2msg"}

    def _open(self) -> sqlite3.Connection:
        database = sqlite3.connect(f"file:{quote(str(real_path(self.path)))}?mode=ro", uri=True)
        database.execute("PRAGMA trusted_schema = OFF")
        return database

    def messages(self) -> Iterator[Stored]:
        query = "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id"
        try:
            with closing(self._open()) as database:
                for sequence, (number, time, data) in enumerate(database.execute(query)):
                    topic = self._topics.get(number)
                    if topic is not None and isinstance(data, bytes) and isinstance(time, int) and time >= 0:
                        yield Stored(topic, sequence % (1 << 32), time, time, data)
        except sqlite3.Error as error:
            raise RecordingError(f"{self.path}: {error}") from None
