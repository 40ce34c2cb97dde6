"""A run as it is recorded before it becomes a ``.npz``: chunks of rows one behind the other, each with its checksum.

In: rows as they come, a file. Out: at any time a file that can be read up to its last whole chunk; its rows.

    MAGIC, _FRAME: bytes of the frame, every, first step, checksum
    frame: all that does not grow with the steps, as its caller writes it (``npz_file.frame_bytes``)
    a chunk for each ``write``:
        _CHUNK: "rows", rows, bytes of the text, checksum of the rest
        the rows, one kind after the other; the changing weights after the last step; a text: what else is true then

What breaks off or does not agree ends the file.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import FileIO
from typing import Final
from zlib import crc32

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.rows import KINDS, After, Rows, Steps, Widths
from neurovis_spec.runtime.spikes import Fired, SpikeLog

MAGIC: Final = b"neurovis run 2\n"
#: the heads of the frame and of a chunk
_FRAME, _CHUNK = struct.Struct("<QQQI"), struct.Struct("<4sQQI")
_MARK = b"rows"
#: of a chunk's text: the spikes since the chunk before
_FIRED = "fired"
_NUMBER, _PIECE = 8, 1 << 20


class JournalWriter:
    """Writes a journal. After ``write`` a whole chunk more is with the system, so that it outlives this process."""

    def __init__(self, file: FileIO, frame: bytes, steps: Steps) -> None:
        self._file = file
        _write(file, MAGIC + _FRAME.pack(len(frame), steps.every, steps.first, crc32(frame)), frame)

    def write(self, rows: Rows, after: After) -> None:
        """A chunk of rows. Raises OSError."""
        text = json.dumps(
            {
                "reached": after.reached,
                "set_parameters": dict(after.set_parameters),
                "lesioned_neurons": after.lesioned_neurons.tolist(),
                "lesioned_connections": after.lesioned_connections.tolist(),
                **_told(after.fired),
            }
        ).encode()
        parts = [*(_bytes(array) for array in rows), _bytes(after.weights), memoryview(text)]
        total = 0
        for part in parts:
            total = crc32(part, total)
        _write(self._file, _CHUNK.pack(_MARK, len(rows.activity), len(text), total), *parts)


def _told(fired: Fired) -> dict[str, object]:
    """What fired since the chunk before, where steps were made in which that was looked for."""
    if fired.stop <= fired.first:
        return {}
    steps, neurons, first, stop = fired
    return {_FIRED: [steps.tolist(), neurons.tolist(), first, stop]}


def _fired(text: bytes, log: SpikeLog) -> None:
    """Put what fired since the chunk before to the rest."""
    if _FIRED.encode() in text:
        steps, neurons, first, stop = json.loads(text)[_FIRED]
        log.extend(Fired(np.array(steps, np.int64), np.array(neurons, np.int64), int(first), int(stop)))


def _bytes(numbers: FloatArray) -> memoryview:
    return np.ascontiguousarray(numbers, dtype="<f8").reshape(-1).view(np.uint8).data


def _write(file: FileIO, *parts: bytes | memoryview) -> None:
    """Write all of it: a full disk takes some, and refuses the rest."""
    for part in parts:
        left = memoryview(part)
        while left:
            left = left[file.write(left) or 0 :]


@dataclass(frozen=True)
class _Chunk:
    """Where a chunk's numbers begin, and how many rows they are."""

    offset: int
    rows: int


@dataclass(frozen=True)
class Journal:
    """What can be read of a journal."""

    file: FileIO
    frame: bytes
    #: one step in so many has a row
    every: int
    #: the step at which the run began, whether it has a row or not
    first: int
    #: how many columns a row has of each kind
    columns: Widths
    chunks: tuple[_Chunk, ...]
    #: what is true after the last step, as the text of the last chunk says; {} without a chunk
    after: dict[str, object]
    #: (p,) the changing weights after the last step; none without a chunk
    weights: FloatArray
    #: the spikes of all chunks
    fired: Fired

    @property
    def rows(self) -> int:
        """How many rows it holds."""
        return sum(chunk.rows for chunk in self.chunks)

    @property
    def steps(self) -> Steps:
        """The steps of its rows."""
        begin = -(-self.first // self.every) * self.every
        return Steps(self.rows * self.every, self.every, begin)

    def pieces(self, place: int) -> Iterator[bytes]:
        """The bytes of all rows of a kind (a place in KINDS), in order, some at a time."""
        columns_before, width = sum(self.columns[:place]), self.columns[place]
        for chunk in self.chunks:  # in which all rows of a kind lie together
            yield from _pieces(
                self.file, chunk.offset + chunk.rows * columns_before * _NUMBER, chunk.rows * width * _NUMBER
            )

    @property
    def all_rows(self) -> Rows:
        """The same as arrays."""
        read = (np.frombuffer(b"".join(self.pieces(place)), dtype="<f8") for place in range(len(KINDS)))
        return Rows(*(
            numbers.astype(np.float64).reshape(self.rows, width)
            for numbers, width in zip(read, self.columns, strict=True)
        ))  # fmt: skip


def is_begun(file: FileIO) -> bool:
    """Whether a file is a journal, or was to become one."""
    file.seek(0)
    return MAGIC.startswith(file.read(len(MAGIC)))


def read_journal(file: FileIO, columns: Callable[[bytes], tuple[Widths, int]]) -> Journal:
    """Read a journal as far as it is whole. ``columns`` gives, for the bytes of a frame, how many columns the rows have
    and how many changing weights a chunk ends with. Raises RecordingError, OSError."""
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    head = file.read(len(MAGIC) + _FRAME.size)
    if len(head) < len(MAGIC) + _FRAME.size or not head.startswith(MAGIC):
        raise RecordingError("not a recording in progress")
    length, every, first, checksum = _FRAME.unpack(head[len(MAGIC) :])
    frame = b"".join(_pieces(file, len(head), length)) if length <= size else b""
    if len(frame) != length or crc32(frame) != checksum or every < 1 or first >= 2**62:
        raise RecordingError("not a recording in progress: its beginning is damaged")
    widths, p = columns(frame)
    width = sum(widths)
    chunks: list[_Chunk] = []
    offset, text, last, log = len(head) + length, b"{}", b"", SpikeLog(first)
    while offset + _CHUNK.size <= size:
        file.seek(offset)
        mark, rows, text_length, checksum = _CHUNK.unpack(file.read(_CHUNK.size))
        begin = offset + _CHUNK.size
        numbers = (rows * width + p) * _NUMBER
        end = begin + numbers + text_length
        if mark != _MARK or end > size or _checksum(file, begin, end) != checksum:
            break
        chunks.append(_Chunk(begin, rows))
        last = b"".join(_pieces(file, begin + numbers - p * _NUMBER, p * _NUMBER))
        text = b"".join(_pieces(file, begin + numbers, text_length))
        _fired(text, log)
        offset = end
    after = json.loads(text)
    if not isinstance(after, dict):
        raise RecordingError("not a recording in progress")
    weights: npt.NDArray[np.float64] = np.frombuffer(last, dtype="<f8").astype(np.float64)
    return Journal(file, frame, every, first, widths, tuple(chunks), after, weights, log.all)


def _checksum(file: FileIO, begin: int, end: int) -> int:
    total = 0
    for piece in _pieces(file, begin, end - begin):
        total = crc32(piece, total)
    return total


def _pieces(file: FileIO, offset: int, length: int) -> Iterator[bytes]:
    """So many bytes from a place on, or as many as there are."""
    while length > 0:
        file.seek(offset)
        piece = file.read(min(length, _PIECE))
        if not piece:
            return
        yield piece
        offset += len(piece)
        length -= len(piece)
