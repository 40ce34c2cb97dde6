"""Bags of ROS 1 (format 2.0), read record by record and checked, also those that break off and have no index.

In: an open file. Out: what its header says, its connections, its messages, to the last whole chunk.
"""

from __future__ import annotations

import io
import struct
from bz2 import BZ2Decompressor
from collections.abc import Iterator, Mapping
from typing import BinaryIO, Final, NamedTuple

from neurovis_spec.language.ros_types import plain
from neurovis_spec.ros.logs import ABOUT, BAG_HEADER, BAG_MAGIC, CHUNK, CONNECTION, MESSAGE_DATA, Topic
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.mcap_records import MOST_NAMED, Reader

#: bytes of the header of a record
_LARGEST_HEADER: Final = 1 << 20
#: bytes of a chunk, as it is and as it may grow to
_LARGEST: Final = 1 << 30


class Record(NamedTuple):
    """A record of a bag: its operation, its fields, and where and how long its data is."""

    op: int
    fields: Mapping[str, bytes]
    start: int
    length: int

    def number(self, name: str) -> int:
        """The field of this name as a number. Raises RecordingError."""
        value = self.fields.get(name, b"")
        if len(value) not in (4, 8):
            raise RecordingError(f"a record has no '{name}'")
        return int.from_bytes(value, "little")


class Head(NamedTuple):
    """What the header of a bag says: where its index is, and of which network it is, where an earlier version of ours
    wrote it."""

    place: int
    whole: bool
    about: Mapping[str, str]


class Connections(NamedTuple):
    """The connections of a bag, by their numbers, and what they say of the network, if it is a bag of ours."""

    topics: Mapping[int, Topic]
    about: Mapping[str, str]


class Found(NamedTuple):
    """A message of a connection; the time in nanoseconds."""

    connection: int
    time: int
    data: bytes


def _fields(data: bytes) -> dict[str, bytes]:
    reader, result = Reader(data), {}
    while reader.at < len(data):
        name, equals, value = reader.take(reader.number(4)).partition(b"=")
        if not equals:
            raise RecordingError("a field has no value")
        result[name.decode(errors="replace")] = value
    return result


def _scan(file: BinaryIO, start: int, size: int) -> Iterator[Record]:
    """The whole records from a place on, without their data."""
    at = start
    while at + 8 <= size:
        file.seek(at)
        (length,) = struct.unpack("<I", file.read(4))
        if at + 8 + length > size:
            return
        if length > _LARGEST_HEADER:
            raise RecordingError("a record's header is larger than any can be")
        header = file.read(length + 4)
        fields = _fields(header[:length])
        (data,) = struct.unpack_from("<I", header, length)
        begin = at + 8 + length
        if begin + data > size:
            return
        op = fields.get("op", b"")
        if len(op) != 1:
            raise RecordingError("a record does not say what it is")
        yield Record(op[0], fields, begin, data)
        at = begin + data


def _data(file: BinaryIO, record: Record) -> bytes:
    if record.length > _LARGEST:
        raise RecordingError("a record is larger than any can be")
    file.seek(record.start)
    data = file.read(record.length)
    if len(data) != record.length:
        raise RecordingError("a record breaks off")
    return data


def _size(file: BinaryIO) -> int:
    return file.seek(0, io.SEEK_END)


def head_of(file: BinaryIO) -> Head:
    """What the header says. Raises RecordingError."""
    size = _size(file)
    first = next(_scan(file, len(BAG_MAGIC), size), None)
    if first is None or first.op != BAG_HEADER:
        raise RecordingError("not a bag: it has no header")
    if first.fields.get("encryptor"):
        raise RecordingError("its messages are encrypted")
    index = first.number("index_pos")
    return Head(index, 0 < index <= size, _about(first.fields))


def connections_of(file: BinaryIO, head: Head) -> Connections:
    """The connections: those of the index, else of all chunks. Raises RecordingError."""
    topics: dict[int, Topic] = {}
    about = head.about
    for record, data in _connections(file, head):
        number, fields = record.number("conn"), {**_fields(data), **record.fields}
        if number in topics:
            continue
        if len(topics) >= MOST_NAMED:
            raise RecordingError("it holds more connections than there can be")
        topics[number] = _topic(fields)
        about = about or _about(fields)
    return Connections(topics, about)


def _connections(file: BinaryIO, head: Head) -> Iterator[tuple[Record, bytes]]:
    """The records of connections, with their data; each may come several times."""
    size = _size(file)
    for record in _scan(file, head.place if head.whole else len(BAG_MAGIC), size):
        if record.op == CONNECTION:
            yield record, _data(file, record)
        elif record.op == CHUNK and not head.whole:
            content = io.BytesIO(_expanded(record, _data(file, record)))
            for inner in _scan(content, 0, len(content.getbuffer())):
                if inner.op == CONNECTION:
                    yield inner, _data(content, inner)


def _topic(fields: Mapping[str, bytes]) -> Topic:
    names = ("topic", "type", "message_definition")
    topic, type_, text = (fields.get(name, b"").decode(errors="replace") for name in names)
    if not topic or "/" not in type_:
        raise RecordingError("a connection does not say of which type its messages are")
    return Topic(topic, plain(type_), "ros1", text)


def _about(fields: Mapping[str, bytes]) -> Mapping[str, str]:
    about = fields.get(ABOUT)
    return {} if about is None else Reader(about).mapping()


def messages_of(file: BinaryIO) -> Iterator[Found]:
    """The messages, in the order of the file. Raises RecordingError."""
    for record in _scan(file, len(BAG_MAGIC), _size(file)):
        if record.op == CHUNK:
            content = io.BytesIO(_expanded(record, _data(file, record)))
            for inner in _scan(content, 0, len(content.getbuffer())):
                if inner.op == MESSAGE_DATA:
                    yield _message(inner, _data(content, inner))
        elif record.op == MESSAGE_DATA:
            yield _message(record, _data(file, record))


def _message(record: Record, data: bytes) -> Found:
    nanoseconds, seconds = divmod(record.number("time"), 1 << 32)
    return Found(record.number("conn"), seconds * 10**9 + nanoseconds, data)


def _expanded(record: Record, data: bytes) -> bytes:
    """What a chunk holds."""
    compression, size = record.fields.get("compression", b""), record.number("size")
    if size > _LARGEST:
        raise RecordingError("a chunk is larger than any can be")
    if compression == b"none":
        found = data
    elif compression == b"bz2":
        try:
            found = BZ2Decompressor().decompress(data, size)
        except OSError:
            raise RecordingError("a chunk is damaged") from None
    elif compression == b"lz4":
        found = _unpacked(data, size)
    else:
        raise RecordingError(f"a chunk is compressed in a way that is not read ({compression[:20]!r})")
    if len(found) != size:
        raise RecordingError("a chunk is not as large as it says")
    return found


def _unpacked(data: bytes, size: int) -> bytes:
    try:
        from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
    except ImportError:
        raise RecordingError("its chunks are compressed (lz4), which needs: pip install 'neurovis-spec[ros]'") from None
    try:
        found: bytes = LZ4FrameDecompressor().decompress(data, max_length=size)
    except RuntimeError:
        raise RecordingError("a chunk is damaged") from None
    return found
