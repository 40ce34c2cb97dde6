"""Messages of ROS as recordings hold them: ``std_msgs/msg/Float64MultiArray`` and ``String`` in CDR, little-endian.

In: numbers or a text. Out: bytes; and back, with suspicion. An array has one dimension, whose label says whose numbers
they are, and begins with two numbers of its own: the step and its seconds.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.runtime.mcap_records import Reader
from neurovis_spec.runtime.recording import RecordingError

_LITTLE: Final = b"\x00\x01\x00\x00"
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


def label_of(hash_: str) -> str:
    """The label of the arrays of a network."""
    return f"neurovis/1:{hash_}"


def array_prefix(label: str, size: int) -> bytes:
    """The bytes of every array of so many numbers, up to its data."""
    name = label.encode() + b"\0"
    body = struct.pack("<II", 1, len(name)) + name
    body += bytes(-len(body) % 4)
    body += struct.pack("<IIII", size, size, 2, size + 2)
    return _LITTLE + body + bytes(-len(body) % 8)


def array_message(prefix: bytes, step: int, seconds: float, numbers: FloatArray) -> bytes:
    """An array of one step."""
    return prefix + struct.pack("<dd", step, seconds) + np.ascontiguousarray(numbers, dtype="<f8").tobytes()


def array_of(data: bytes, label: str, size: int) -> tuple[int, FloatArray]:
    """The step and the numbers of an array with this label and size. Raises RecordingError for any other."""
    prefix = array_prefix(label, size)
    if not data.startswith(prefix) or len(data) != len(prefix) + (size + 2) * 8:
        raise RecordingError("a message is not one of this network's arrays")
    values = np.frombuffer(data, dtype="<f8", offset=len(prefix))
    step = float(values[0])
    if not (0 <= step < 2.0**53 and step.is_integer()):
        raise RecordingError("a message has no step")
    return int(step), values[2:].astype(np.float64)


def text_message(text: str) -> bytes:
    """A text."""
    data = text.encode() + b"\0"
    return _LITTLE + struct.pack("<I", len(data)) + data


def text_of(data: bytes) -> str:
    """The text of a message. Raises RecordingError."""
    reader = Reader(data)
    if reader.take(4) != _LITTLE:
        raise RecordingError("a message is not encoded as CDR, little-endian")
    return reader.take(reader.number(4)).removesuffix(b"\0").decode()
