"""Messages of ROS as recordings of a network hold them: ``std_msgs/msg/Float64MultiArray`` and ``String``.

In: bytes, in the encoding of either ROS. Out: the step and the numbers of an array, all of it checked. An array has one
dimension, whose label says whose numbers they are, and begins with two numbers of its own: the step and its seconds.
"""

from __future__ import annotations

from typing import Final

from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.wire import Encoding, array_of

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
