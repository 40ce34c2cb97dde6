"""Arrays and texts as bytes, in the encodings of both ROS: ``std_msgs`` multi-arrays of floats, and ``String``.

In: the bytes of a message that anybody may have sent. Out: what is in them, or WireError; and back. Nothing is
allocated for what a message only says that it has. ROS 1 packs values little-endian; CDR (ROS 2) aligns them behind
four bytes that say their order. As recordings of a network hold them, an array has one dimension, whose label says
whose numbers they are, and begins with two numbers of its own: the step and its seconds.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.errors import RecordingError

#: the encodings, as MCAP calls them
Encoding: TypeAlias = Literal["ros1", "cdr"]
ENCODINGS: Final[dict[int, Encoding]] = {1: "ros1", 2: "cdr"}

_ORDERS: Final[dict[bytes, Literal["<", ">"]]] = {b"\0\0": ">", b"\0\1": "<"}
_LITTLE: Final = b"\0\1\0\0"
#: dimensions of an array that are read; a layout of more describes no array
_MOST_DIMENSIONS: Final = 64

_SEPARATOR: Final = "=" * 80
_DIMENSION: Final = "string label\nuint32 size\nuint32 stride\n"
_LAYOUT: Final = "MultiArrayDimension[] dim\nuint32 data_offset\n"
#: schemas: name and text
ARRAY: Final = (
    "std_msgs/msg/Float64MultiArray",
    f"MultiArrayLayout layout\nfloat64[] data\n{_SEPARATOR}\nMSG: std_msgs/MultiArrayLayout\n{_LAYOUT}"
    f"{_SEPARATOR}\nMSG: std_msgs/MultiArrayDimension\n{_DIMENSION}",
)
STRING: Final = ("std_msgs/msg/String", "string data\n")


class WireError(ValueError):
    """Bytes that are no message of the type."""


class Cursor:
    """Reads values from the bytes of a message, and never behind their end. Raises WireError."""

    def __init__(self, data: bytes, encoding: Encoding) -> None:
        self.data, self.at = data, 0
        self.order: Literal["<", ">"] = "<"
        #: where alignment counts from; None where nothing is aligned
        self.origin: int | None = None
        if encoding == "cdr":
            order = _ORDERS.get(data[:2])
            if order is None or len(data) < 4:
                raise WireError("not CDR")
            self.order, self.at, self.origin = order, 4, 4

    def align(self, size: int) -> None:
        """Go to where a value of this size begins."""
        if self.origin is not None:
            self.at += -(self.at - self.origin) % size

    def take(self, count: int) -> bytes:
        """The next bytes."""
        start = self.at
        if count > len(self.data) - start:
            raise WireError("it breaks off")
        self.at = start + count
        return self.data[start : self.at]

    def integer(self) -> int:
        """The next ``uint32``."""
        self.align(4)
        return int.from_bytes(self.take(4), "little" if self.order == "<" else "big")

    def string(self) -> bytes:
        """The next string, without the zero at its end."""
        data = self.take(self.integer())
        return data.removesuffix(b"\0") if self.origin is not None else data

    def numbers(self, count: int, kind: Literal["f4", "f8"]) -> FloatArray:
        """So many floats."""
        size = int(kind[1])
        if not count:
            return np.zeros(0)
        self.align(size)
        if count > (len(self.data) - self.at) // size:
            raise WireError("it breaks off")
        found: npt.NDArray[np.float64] = np.frombuffer(self.data, self.order + kind, count, self.at).astype(np.float64)
        self.at += count * size
        return found

    def end(self) -> None:
        """There must be no more; CDR may be filled up to four bytes."""
        if len(self.data) - self.at > (0 if self.origin is None else 3):
            raise WireError("it goes on behind its end")


@dataclass(frozen=True, slots=True, eq=False)
class Array:
    """An array as it came: the label of its first dimension, "" where it has none, its offset, and all its numbers."""

    label: bytes
    offset: int
    data: FloatArray


def array_of(data: bytes, encoding: Encoding, kind: Literal["f4", "f8"] = "f8") -> Array:
    """A ``Float64MultiArray`` (``f8``) or ``Float32MultiArray`` (``f4``). Raises WireError."""
    cursor = Cursor(data, encoding)
    dimensions = cursor.integer()
    if dimensions > _MOST_DIMENSIONS:
        raise WireError("it has too many dimensions")
    label = b""
    for number in range(dimensions):
        name = cursor.string()
        label = label if number else name
        cursor.integer(), cursor.integer()
    offset = cursor.integer()
    found = Array(label, offset, cursor.numbers(cursor.integer(), kind))
    cursor.end()
    return found


def text_of(data: bytes, encoding: Encoding) -> str:
    """A ``String``. Raises WireError."""
    cursor = Cursor(data, encoding)
    try:
        found = cursor.string().decode()
    except UnicodeDecodeError:
        raise WireError("it is not UTF-8") from None
    cursor.end()
    return found


def stamp_of(data: bytes, encoding: Encoding) -> int | None:
    """Nanoseconds of the stamp of a message that begins with a ``Header``; None where it was not set. Raises
    WireError."""
    cursor = Cursor(data, encoding)
    if encoding == "ros1":
        cursor.integer()
    seconds, nanoseconds = cursor.integer(), cursor.integer()
    if seconds >= 1 << 31 or nanoseconds >= 10**9:
        return None
    return seconds * 10**9 + nanoseconds or None


@dataclass(frozen=True, slots=True)
class ArrayForm:
    """All arrays of so many numbers with one label: what they begin with is made once."""

    prefix: bytes

    @classmethod
    def of(cls, label: str, size: int, encoding: Encoding) -> ArrayForm:
        """With the two numbers before the others: the sequence number and the seconds."""
        name = label.encode()
        counts = struct.pack("<IIII", size, size, 2, size + 2)
        if encoding == "ros1":
            return cls(struct.pack("<II", 1, len(name)) + name + counts)
        body = struct.pack("<II", 1, len(name) + 1) + name + b"\0"
        body += bytes(-len(body) % 4) + counts
        return cls(_LITTLE + body + bytes(-len(body) % 8))

    def message(self, seq: float, seconds: float, numbers: FloatArray) -> bytes:
        """An array of this form."""
        return self.prefix + struct.pack("<dd", seq, seconds) + np.ascontiguousarray(numbers, dtype="<f8").tobytes()


def text_message(text: str, encoding: Encoding) -> bytes:
    """A ``String``."""
    data = text.encode()
    if encoding == "ros1":
        return struct.pack("<I", len(data)) + data
    return _LITTLE + struct.pack("<I", len(data) + 1) + data + b"\0"


def label_of(hash_: str) -> str:
    """The label of the arrays of a network."""
    return f"neurovis/1:{hash_}"


def step_of(data: bytes, encoding: Encoding, label: str, size: int) -> tuple[int | None, FloatArray]:
    """The step (None where it does not say one) and the numbers of an array with this label, or none, and this size.
    Raises RecordingError for any other, and WireError."""
    found = array_of(data, encoding)
    if found.label not in (label.encode(), b"") or found.offset not in (0, 2) or len(found.data) != found.offset + size:
        raise RecordingError("a message is not one of this network's arrays")
    numbers = found.data[found.offset :]
    if not found.offset:
        return None, numbers
    step = float(found.data[0])
    if not (0 <= step < 2.0**53 and step.is_integer()):
        if found.label:
            raise RecordingError("a message has no step")
        return None, numbers
    return int(step), numbers
