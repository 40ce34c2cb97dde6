"""Files of messages: an MCAP file and a bag of ROS 1, written so that they can be read whatever happens.

In: messages, as chunks. Out: a file which holds every chunk when ``write`` returns, whatever becomes of the process;
``finish`` adds what lets readers go to any place. Of a chunk that the disk does not take nothing stays.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping, Sequence
from io import FileIO
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from neurovis_spec.ros.definitions import md5sum, written
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.mcap_file import FRAME
from neurovis_spec.runtime.wire import ENCODINGS, Encoding
from neurovis_spec.version import __version__

#: the metadata record of an MCAP file, and the field of a bag's connections
ABOUT: Final = "neurovis"


class Topic(NamedTuple):
    """A topic of a recording: its type (``package/Name``), how its messages are encoded, and their definition."""

    name: str
    type: str
    encoding: Encoding
    definition: str


class Stored(NamedTuple):
    """A message of a recording; times in nanoseconds."""

    topic: Topic
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class Log(Protocol):
    """A file of messages that is being written."""

    path: Path
    #: bytes that it has
    size: int

    def write(self, messages: Sequence[Stored]) -> None:
        """Add a chunk. Raises OSError, and then nothing of it is in the file."""
        ...

    def sync(self) -> None:
        """Have the disk hold all of it. Raises OSError."""
        ...

    def finish(self) -> None:
        """Add the index and close it. Raises OSError; the file is closed all the same, and can be read."""
        ...


class _Whole:
    """A file to which bytes are added wholly or not at all."""

    def __init__(self, path: Path, start: bytes) -> None:
        self.path, self.size = path, 0
        self.file = FileIO(os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), "r+")
        try:
            self.put(start)
        except OSError:
            self.file.close()
            path.unlink()
            raise

    def put(self, data: bytes) -> None:
        """Add bytes: what does not get in wholly is taken out again. Raises OSError."""
        try:
            records.put(self.file, data)
        except OSError:
            self.file.truncate(self.size)
            self.file.seek(self.size)
            raise
        self.size += len(data)

    def sync(self) -> None:
        """Have the disk hold all of it. Raises OSError."""
        os.fdatasync(self.file.fileno()) if hasattr(os, "fdatasync") else os.fsync(self.file.fileno())


class McapLog(_Whole):
    """An MCAP file; ``about`` is its metadata record, ``frame`` what makes recordings of its messages."""

    def __init__(self, path: Path, ros: Ros, about: Mapping[str, str], frame: bytes = b"") -> None:
        self._ros: Ros = ros
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels: dict[Topic, int] = {}
        head = records.head(f"ros{ros}", f"neurovis {__version__}")
        attached = records.attachment(FRAME, frame) if frame else b""
        super().__init__(path, head + records.metadata(ABOUT, about) + attached)

    def write(self, messages: Sequence[Stored]) -> None:
        """Add a chunk, and what names its topics where they are new. Raises OSError."""
        schemas, channels, parts = dict(self._schemas), dict(self._channels), list[bytes]()
        for topic in {message.topic: None for message in messages}:
            if topic in channels:
                continue
            kind = written(topic.type, self._ros), topic.definition
            if kind not in schemas:
                schemas[kind] = len(schemas) + 1
                parts.append(records.schema_record(schemas[kind], records.Schema(*kind, f"ros{self._ros}msg")))
            channels[topic] = len(channels) + 1
            parts.append(
                records.channel_record(channels[topic], records.Channel(schemas[kind], topic.name, topic.encoding))
            )
        parts.append(
            records.chunk(
                records.Message(channels[one.topic], one.sequence % (1 << 32), one.log_time, one.publish_time, one.data)
                for one in messages
            )
        )
        self.put(b"".join(parts))
        self._schemas, self._channels = schemas, channels

    def finish(self) -> None:
        """Add index, statistics and footer, and close it. Raises OSError."""
        with self.file:
            try:
                records.finish(self.file)
            except OSError:
                self.file.truncate(self.size)
                raise
            os.fsync(self.file.fileno())


BAG_MAGIC: Final = b"#ROSBAG V2.0\n"
#: operations of the records of a bag
MESSAGE_DATA, BAG_HEADER, INDEX_DATA, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
#: of the header's fields and of what fills it up: rosbag writes it anew in its place, and counts on that size
_HEADER_SIZE: Final = 4096


def bag_time(nanoseconds: int) -> bytes:
    """A time as bags have it."""
    seconds, rest = divmod(nanoseconds, 10**9)
    return struct.pack("<II", min(seconds, (1 << 32) - 1), rest)


def _fields(fields: Mapping[str, bytes]) -> bytes:
    parts = [key.encode() + b"=" + value for key, value in fields.items()]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def _record(fields: Mapping[str, bytes], data: bytes) -> bytes:
    header = _fields(fields)
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


class _ChunkInfo(NamedTuple):
    place: int
    first: int
    last: int
    counts: Mapping[int, int]


class BagLog(_Whole):
    """A bag of ROS 1, format 2.0; ``about`` stands in a field of its connections: others pass over it, and rosbag keeps
    it where it writes a bag anew."""

    def __init__(self, path: Path, ros: Ros, about: Mapping[str, str], frame: bytes = b"") -> None:
        if ros != 1:
            raise ValueError("a .bag holds messages of ROS 1")
        self._about = records.mapping(about)
        self._connections: dict[Topic, int] = {}
        self._infos: list[_ChunkInfo] = []
        super().__init__(path, BAG_MAGIC + self._header(0))

    def _header(self, index: int) -> bytes:
        """The first record, to the byte as rosbag's are."""
        fields = {
            "op": bytes([BAG_HEADER]),
            "index_pos": struct.pack("<Q", index),
            "conn_count": struct.pack("<I", len(self._connections)),
            "chunk_count": struct.pack("<I", len(self._infos)),
        }
        return _record(fields, b" " * (_HEADER_SIZE - len(_fields(fields))))

    def _connection(self, topic: Topic, number: int) -> bytes:
        data = {
            "topic": topic.name.encode(),
            "type": topic.type.encode(),
            "md5sum": md5sum(topic.type, topic.definition).encode(),
            "message_definition": topic.definition.encode(),
            ABOUT: self._about,
        }
        fields = {"op": bytes([CONNECTION]), "conn": struct.pack("<I", number), "topic": topic.name.encode()}
        return _record(fields, _fields(data))

    def write(self, messages: Sequence[Stored]) -> None:
        """Add a chunk, and the connections that are new in it. Raises OSError."""
        connections, parts, at = dict(self._connections), list[bytes](), 0
        index: dict[int, list[bytes]] = {}
        for one in messages:
            if one.topic not in connections:
                connections[one.topic] = len(connections)
                parts.append(self._connection(one.topic, connections[one.topic]))
                at += len(parts[-1])
            number, time = connections[one.topic], bag_time(one.log_time)
            index.setdefault(number, []).append(time + struct.pack("<I", at))
            fields = {"op": bytes([MESSAGE_DATA]), "conn": struct.pack("<I", number), "time": time}
            parts.append(_record(fields, one.data))
            at += len(parts[-1])
        data = b"".join(parts)
        start = {"op": bytes([CHUNK]), "compression": b"none", "size": struct.pack("<I", len(data))}
        result = [_record(start, data)]
        for number, entries in index.items():
            fields = {
                "op": bytes([INDEX_DATA]),
                "ver": struct.pack("<I", 1),
                "conn": struct.pack("<I", number),
                "count": struct.pack("<I", len(entries)),
            }
            result.append(_record(fields, b"".join(entries)))
        place = self.size
        self.put(b"".join(result))
        times = [one.log_time for one in messages]
        counts = {number: len(entries) for number, entries in index.items()}
        self._connections = connections
        self._infos.append(_ChunkInfo(place, min(times), max(times), counts))

    def finish(self) -> None:
        """Add the index, say in the header where it is, and close it. Raises OSError."""
        with self.file:
            index = self.size
            self.put(b"".join(self._connection(topic, number) for topic, number in self._connections.items()))
            for info in self._infos:
                fields = {
                    "op": bytes([CHUNK_INFO]),
                    "ver": struct.pack("<I", 1),
                    "chunk_pos": struct.pack("<Q", info.place),
                    "start_time": bag_time(info.first),
                    "end_time": bag_time(info.last),
                    "count": struct.pack("<I", len(info.counts)),
                }
                self.put(_record(fields, b"".join(struct.pack("<II", *one) for one in info.counts.items())))
            self.file.seek(len(BAG_MAGIC))
            records.put(self.file, self._header(index))
            os.fsync(self.file.fileno())


def topic_of(name: str, type_: str, definition: str, ros: Ros) -> Topic:
    """A topic of a ROS."""
    return Topic(name, type_, ENCODINGS[ros], definition)
