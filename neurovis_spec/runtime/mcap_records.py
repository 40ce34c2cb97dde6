"""Records of MCAP files: written so that a file can be read at any moment, and checked while they are read.

In: messages; or a file. Out: bytes of records; or the records of a file as far as it is whole. A chunk goes to the
system by one write. The index at a file's end is made of the records that the file holds, so that nothing grows while
it is written, and a file that breaks off gets one in the same way.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from io import FileIO
from typing import BinaryIO, Final, NamedTuple
from zlib import crc32

from neurovis_spec.runtime.errors import RecordingError

MAGIC: Final = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
_HEAD, _MESSAGE, _CHUNK = struct.Struct("<BQ"), struct.Struct("<HIQQ"), struct.Struct("<QQQI")
_LAST: Final = (1 << 64) - 1
#: about the bytes of the messages of a chunk, unless a single one has more
LARGEST_CHUNK: Final = 64 << 10
#: the kinds of records at the end of a file (its summary), in their order
_GROUPS: Final = (SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX)


class DamagedError(RecordingError):
    """A chunk whose checksum does not agree: what comes before it is as it was written."""


class Schema(NamedTuple):
    """What messages of a type look like; ``encoding`` is that of the text."""

    name: str
    text: str
    encoding: str = "ros2msg"


class Channel(NamedTuple):
    """A topic, and the number of its schema, from 1; ``encoding`` is that of its messages."""

    schema: int
    topic: str
    encoding: str = "cdr"


class Message(NamedTuple):
    """A message of a channel (from 1); times in nanoseconds."""

    channel: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


def record(opcode: int, *parts: bytes) -> bytes:
    """A record of these parts."""
    content = b"".join(parts)
    return _HEAD.pack(opcode, len(content)) + content


def text(value: str) -> bytes:
    """A string, with its length."""
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def mapping(values: Mapping[str, str]) -> bytes:
    """A map of strings, with its length."""
    data = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(data)) + data


def head(profile: str, library: str) -> bytes:
    """The beginning of a file."""
    return MAGIC + record(HEADER, text(profile), text(library))


def schemas_and_channels(schemas: Iterable[Schema], channels: Iterable[Channel]) -> bytes:
    """The records that name topics and types, numbered from 1."""
    parts = [schema_record(number, schema) for number, schema in enumerate(schemas, 1)]
    return b"".join([*parts, *(channel_record(number, channel) for number, channel in enumerate(channels, 1))])


def schema_record(number: int, schema: Schema) -> bytes:
    """The record that says what messages of a type look like."""
    data = schema.text.encode()
    size = struct.pack("<I", len(data))
    return record(SCHEMA, struct.pack("<H", number), text(schema.name), text(schema.encoding), size, data)


def channel_record(number: int, channel: Channel) -> bytes:
    """The record that names a topic."""
    ends = struct.pack("<HH", number, channel.schema)
    return record(CHANNEL, ends, text(channel.topic), text(channel.encoding), mapping({}))


def attachment(name: str, data: bytes) -> bytes:
    """A file within the file."""
    size = struct.pack("<Q", len(data))
    content = bytes(16) + text(name) + text("application/octet-stream") + size + data
    return record(ATTACHMENT, content, struct.pack("<I", crc32(content)))


def metadata(name: str, values: Mapping[str, str]) -> bytes:
    """Strings by name."""
    return record(METADATA, text(name), mapping(values))


def chunk(messages: Iterable[Message]) -> bytes:
    """A chunk of messages, uncompressed, and the indices that follow it."""
    parts: list[bytes] = []
    indices: dict[int, list[tuple[int, int]]] = {}
    first, last, offset = _LAST, 0, 0
    for message in messages:
        made = record(MESSAGE, _MESSAGE.pack(*message[:2], *message[2:4]), message.data)
        indices.setdefault(message.channel, []).append((message.log_time, offset))
        first, last, offset = min(first, message.log_time), max(last, message.log_time), offset + len(made)
        parts.append(made)
    data = b"".join(parts)
    start = _CHUNK.pack(0 if first == _LAST else first, last, len(data), crc32(data))
    result = [record(CHUNK, start, text(""), struct.pack("<Q", len(data)), data)]
    for channel, entries in indices.items():
        packed = b"".join(struct.pack("<QQ", *entry) for entry in entries)
        result.append(record(MESSAGE_INDEX, struct.pack("<HI", channel, len(packed)), packed))
    return b"".join(result)


def chunks(messages: Iterable[Message]) -> Iterator[bytes]:
    """Messages in chunks of at most 64 KiB."""
    together: list[Message] = []
    size = 0
    for message in messages:
        length = len(message.data) + 32  # with the head of its record
        if together and size + length > LARGEST_CHUNK:
            yield chunk(together)
            together, size = [], 0
        together.append(message)
        size += length
    if together:
        yield chunk(together)


class Found(NamedTuple):
    """A whole record of a file: where it begins, and where and how long its content is."""

    opcode: int
    start: int
    content: int
    length: int

    @property
    def end(self) -> int:
        """Where the next one begins."""
        return self.content + self.length


def scan(file: FileIO | BinaryIO) -> Iterator[Found]:
    """The whole records of a file, in order, without their contents. Raises RecordingError where it is no MCAP."""
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        raise RecordingError("not an MCAP file")
    offset = len(MAGIC)
    while offset + _HEAD.size <= size:
        file.seek(offset)
        opcode, length = _HEAD.unpack(file.read(_HEAD.size))
        found = Found(opcode, offset, offset + _HEAD.size, length)
        if found.end > size or opcode == 0:
            return
        yield found
        offset = found.end


def content_of(file: FileIO | BinaryIO, found: Found, most: int | None = None) -> Reader:
    """The content of a record, or its first bytes."""
    file.seek(found.content)
    wanted = found.length if most is None else min(found.length, most)
    pieces: list[bytes] = []
    while wanted:
        piece = file.read(wanted)
        if not piece:
            raise RecordingError("a record breaks off")
        pieces.append(piece)
        wanted -= len(piece)
    return Reader(b"".join(pieces))


@dataclass
class Reader:
    """Reads values from bytes, and never behind their end. Raises RecordingError."""

    data: bytes
    at: int = 0

    def take(self, count: int) -> bytes:
        """The next bytes."""
        if count > len(self.data) - self.at:
            raise RecordingError("a record is shorter than it says")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, size: int) -> int:
        """The next number of so many bytes."""
        return int.from_bytes(self.take(size), "little")

    def text(self) -> str:
        """The next string."""
        return self.take(self.number(4)).decode()

    def mapping(self) -> dict[str, str]:
        """The next map of strings."""
        inner = Reader(self.take(self.number(4)))
        result = {}
        while inner.at < len(inner.data):
            key = inner.text()
            result[key] = inner.text()
        return result


def expanded_size(content: Reader) -> int:
    """How many bytes a chunk says that its messages are."""
    return int.from_bytes(content.data[16:24], "little")


class Topic(NamedTuple):
    """The number of a channel, its topic, the number of its schema (0: none), and the encoding of its messages."""

    channel: int
    topic: str
    schema: int
    encoding: str


def topic_of(reader: Reader) -> Topic:
    """What the record of a channel says."""
    number, schema = reader.number(2), reader.number(2)
    return Topic(number, reader.text(), schema, reader.text())


class Described(NamedTuple):
    """The number of a schema, and the schema."""

    number: int
    schema: Schema


def schema_of(reader: Reader) -> Described:
    """What the record of a schema says."""
    number, name, encoding = reader.number(2), reader.text(), reader.text()
    return Described(number, Schema(name, reader.take(reader.number(4)).decode(errors="replace"), encoding))


def messages_of(content: Reader) -> Iterator[Message | Topic | Described]:
    """The messages of a chunk, whose checksum must agree, and the channels and schemas that stand in it. Raises
    RecordingError."""
    content.take(16)
    size, checksum, compression = content.number(8), content.number(4), content.text()
    data = content.take(content.number(8))
    if compression:
        data = _expanded(data, compression, size)
    if len(data) != size or (checksum and crc32(data) != checksum):
        raise DamagedError("a chunk is damaged")
    reader, named = Reader(data), 0
    while reader.at < len(data):
        opcode, length = reader.number(1), reader.number(8)
        inner = reader.take(length)
        if opcode != MESSAGE:
            named += 1
            if opcode not in (SCHEMA, CHANNEL) or named > MOST_NAMED:
                raise RecordingError("a chunk holds what is no message")
        if opcode == CHANNEL:
            yield topic_of(Reader(inner))
        elif opcode == SCHEMA:
            yield schema_of(Reader(inner))
        elif opcode == MESSAGE:
            yield message_of(inner)


def message_of(content: bytes) -> Message:
    """What the record of a message says. Raises RecordingError."""
    if len(content) < _MESSAGE.size:
        raise RecordingError("a message is shorter than it says")
    channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(content)
    return Message(channel, sequence, log_time, publish_time, content[_MESSAGE.size :])


#: the most bytes that a compressed chunk may grow to
_MOST_EXPANDED = 32 << 20
#: channels of a file, and records of a chunk besides messages: a channel's number has two bytes
MOST_NAMED: Final = 1 << 16


def _expanded(data: bytes, compression: str, size: int) -> bytes:
    """What a compressed chunk of another program holds; the extra ``bags`` brings what it takes."""
    if size > _MOST_EXPANDED or compression not in ("zstd", "lz4"):
        raise RecordingError(f"a chunk is compressed in a way that is not read ('{compression[:20]}')")
    try:
        if compression == "zstd":
            import zstandard

            return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
        from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

        found: bytes = LZ4FrameDecompressor().decompress(data, max_length=size)
        return found
    except ImportError:
        raise RecordingError(
            f"its chunks are compressed ({compression}), which needs: pip install 'neurovis-spec[bags]'"
        ) from None


@dataclass
class _Summary:
    """What the end of a file says of its records, but for the chunks, of which there are many."""

    groups: dict[int, list[bytes]] = field(default_factory=lambda: {number: [] for number in _GROUPS})
    counts: dict[int, int] = field(default_factory=dict)
    chunks: int = 0
    first: int = _LAST
    last: int = 0

    def take(self, file: FileIO, found: Found) -> None:
        """Add a record to the index."""
        place = struct.pack("<QQ", found.start, found.end - found.start)
        if found.opcode in (SCHEMA, CHANNEL):
            self.groups[found.opcode].append(record(found.opcode, content_of(file, found).data))
        elif found.opcode == CHUNK:
            reader = content_of(file, found, 16)
            self.first, self.last = min(self.first, reader.number(8)), max(self.last, reader.number(8))
            self.chunks += 1
        elif found.opcode == MESSAGE_INDEX:
            reader = content_of(file, found, 6)
            channel, size = reader.number(2), reader.number(4)
            self.counts[channel] = self.counts.get(channel, 0) + size // 16
        elif found.opcode == ATTACHMENT:
            reader = content_of(file, found, 4096)
            times, name, media, length = reader.take(16), reader.text(), reader.text(), reader.take(8)
            made = record(ATTACHMENT_INDEX, place, times, length, text(name), text(media))
            self.groups[ATTACHMENT_INDEX].append(made)
        elif found.opcode == METADATA:
            name = content_of(file, found, 4096).text()
            self.groups[METADATA_INDEX].append(record(METADATA_INDEX, place, text(name)))

    def statistics(self) -> bytes:
        """How much there is of everything."""
        counts = b"".join(struct.pack("<HQ", *item) for item in self.counts.items())
        numbers = struct.pack(
            "<QHIIIIQQ",
            sum(self.counts.values()),
            *(len(self.groups[opcode]) for opcode in (SCHEMA, CHANNEL, ATTACHMENT_INDEX, METADATA_INDEX)),
            self.chunks,
            0 if self.first == _LAST else self.first,
            self.last,
        )
        return record(STATISTICS, numbers, struct.pack("<I", len(counts)), counts)


def _chunk_indices(file: FileIO, end: int) -> Iterator[bytes]:
    """A record for each chunk before a place, with where the message indices behind it are."""
    chunk: Found | None = None
    places: list[tuple[int, int]] = []

    def made() -> Iterator[bytes]:
        if chunk is not None:
            reader = content_of(file, chunk, 64)
            times, size = reader.take(16), reader.take(8)
            reader.take(4)
            compression, compressed = reader.text(), reader.take(8)
            where = struct.pack("<QQ", chunk.start, chunk.end - chunk.start)
            packed = b"".join(struct.pack("<HQ", *place) for place in places)
            behind = struct.pack("<I", len(packed)) + packed + struct.pack("<Q", last - chunk.end)
            yield record(CHUNK_INDEX, times, where, behind, text(compression), compressed, size)

    last = 0
    for found in scan(file):
        if found.start >= end:
            break
        if found.opcode == MESSAGE_INDEX:
            places.append((content_of(file, found, 2).number(2), found.start))
            last = found.end
        else:
            yield from made()
            chunk, places, last = (found if found.opcode == CHUNK else None), [], found.end
    yield from made()


def finish(file: FileIO) -> None:
    """End a file, of which all behind the last whole record is cut off: index, statistics, footer. Raises
    RecordingError, OSError."""
    summary, end = _Summary(), len(MAGIC)
    for found in scan(file):
        if found.opcode == DATA_END:
            break
        summary.take(file, found)
        end = found.end
    summary.groups[STATISTICS] = [summary.statistics()]
    file.truncate(end)
    file.seek(end)
    put(file, record(DATA_END, bytes(4)))
    start = at = file.tell()
    checksum, offsets = 0, b""
    for opcode, few in summary.groups.items():
        begin = at
        for made in _chunk_indices(file, end) if opcode == CHUNK_INDEX else few:
            file.seek(at)
            put(file, made)
            checksum, at = crc32(made, checksum), at + len(made)
        if at > begin:
            offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, begin, at - begin))
    places = struct.pack("<QQ", start, at)
    checksum = crc32(offsets + _HEAD.pack(FOOTER, 20) + places, checksum)
    file.seek(at)
    put(file, offsets + record(FOOTER, places, struct.pack("<I", checksum)) + MAGIC)


def put(file: FileIO, data: bytes) -> None:
    """Write all of it: a full disk takes some, and refuses the rest. Raises OSError."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
