"""Numbers and texts at fields of messages: read from the bytes of either ROS, and written."""

from __future__ import annotations

import struct
import tracemalloc
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec.ros import definitions
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.fields import Form, Value, encode, numbers_at, texts_at
from neurovis_spec.runtime.wire import ENCODINGS, Encoding, WireError

ROS: tuple[Literal[1, 2], ...] = (1, 2)
ENCODED = tuple(ENCODINGS.values())
MIXED = """
string label
Inner[] inner
bool flag
uint8[3] three
float32 single
int64 large
Nothing nothing
float64[] data
================================================================================
MSG: test/Inner
string text
float64 x
================================================================================
MSG: test/Nothing
"""


def usual(type_: str, ros: Literal[1, 2]) -> Definition:
    text = definitions.definition(type_, ros)
    assert text is not None
    return Definition.parse(type_, text)


MESSAGE = Definition.parse("test/Mixed", MIXED)


@pytest.mark.parametrize("ros", ROS)
def test_joints_are_read_with_their_names(ros: Literal[1, 2]) -> None:
    joints = usual("sensor_msgs/JointState", ros)
    data = encode(joints, {"name": ["hip", "knee"], "position": [1, 2], "effort": [0.5, -0.25]}, ENCODINGS[ros])
    assert list(numbers_at(joints, "effort", ENCODINGS[ros])(data)) == [0.5, -0.25]
    assert list(numbers_at(joints, "velocity", ENCODINGS[ros])(data)) == []
    assert list(texts_at(joints, "name", ENCODINGS[ros])(data)) == ["hip", "knee"]


def test_bytes_are_those_of_ros_1() -> None:
    twist = usual("geometry_msgs/Twist", 1)
    data = encode(twist, {"linear": {"y": 2.0}, "angular": {"z": -1.0}}, "ros1")
    assert data == struct.pack("<6d", 0, 2, 0, 0, 0, -1)


def test_bytes_are_aligned_in_ros_2() -> None:
    data = encode(MESSAGE, {"label": "ab", "flag": 1, "data": [1.0]}, "cdr")
    text = struct.pack("<I", 3) + b"ab\0" + b"\0" + struct.pack("<I", 0)
    rest = b"\1" + bytes(3) + struct.pack("<f", 0) + bytes(4) + struct.pack("<q", 0) + b"\0" + bytes(3)
    assert data == b"\0\1\0\0" + text + rest + struct.pack("<I", 1) + struct.pack("<d", 1.0)


@given(
    st.sampled_from(ENCODED),
    st.text(max_size=9).map(lambda text: text.replace("\0", "")),
    st.lists(st.tuples(st.text(max_size=5).map(lambda text: text.replace("\0", "")), st.floats(allow_nan=False))),
    st.lists(st.floats(allow_nan=False), max_size=9),
)
def test_what_is_written_is_read(
    encoding: Encoding, label: str, inner: list[tuple[str, float]], numbers: list[float]
) -> None:
    values: list[Value] = [{"text": text, "x": x} for text, x in inner]
    data = encode(MESSAGE, {"label": label, "inner": values, "large": -5, "single": 0.5, "data": numbers}, encoding)
    assert list(numbers_at(MESSAGE, "data", encoding)(data)) == numbers
    assert list(numbers_at(MESSAGE, "large", encoding)(data)) == [-5]
    assert list(numbers_at(MESSAGE, "single", encoding)(data)) == [0.5]
    assert list(texts_at(MESSAGE, "label", encoding)(data)) == [label]


@given(st.sampled_from(ENCODED), st.binary(max_size=80))
def test_any_bytes_are_read_or_refused(encoding: Encoding, data: bytes) -> None:
    for read in (numbers_at(MESSAGE, "data", encoding), texts_at(MESSAGE, "label", encoding)):
        try:
            found = read(data)
        except WireError:
            continue
        assert len(found) <= max(1, len(data))


@pytest.mark.parametrize("encoding", ENCODED)
def test_nothing_is_made_of_a_length_alone(encoding: Encoding) -> None:
    many = Definition.parse("test/Many", "float64[] data\n")
    head = b"\0\1\0\0" if encoding == "cdr" else b""
    tracemalloc.start()
    with pytest.raises(WireError):
        numbers_at(many, "data", encoding)(head + struct.pack("<I", 0xFFFFFFFF) + bytes(64))
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


@pytest.mark.parametrize("ros", ROS)
def test_a_form_is_filled_with_numbers_and_a_time(ros: Literal[1, 2]) -> None:
    stamped, encoding = usual("sensor_msgs/JointState", ros), ENCODINGS[ros]
    form = Form(stamped, "position", 2, encoding)
    data = form.fill([1.5, -2.5], 3_000_000_007)
    assert list(numbers_at(stamped, "position", encoding)(data)) == [1.5, -2.5]
    names = ("secs", "nsecs") if "secs" in str(stamped.types) else ("sec", "nanosec")
    stamp = [numbers_at(stamped, f"header.stamp.{name}", encoding)(data)[0] for name in names]
    assert stamp == [3, 7]
    assert list(numbers_at(stamped, "position", encoding)(form.fill([0, 0], 0))) == [0, 0]
    assert list(numbers_at(stamped, "position", encoding)(data)) == [1.5, -2.5]


@pytest.mark.parametrize("encoding", ENCODED)
def test_numbers_are_kept_within_their_type_and_integers_rounded(encoding: Encoding) -> None:
    for type_, values, expected in (
        ("int8", [300.0, -300.0, 2.6], [127, -128, 3]),
        ("uint16", [-1.0, 70000.0, 5.4], [0, 65535, 5]),
        ("bool", [2.0, 0.0, 0.6], [1, 0, 1]),
        ("int64", [1e300, -1e300, 0.0], [np.nextafter(2.0**63, 0), -(2.0**63), 0]),
        ("float32", [1e300, -1e300, 0.5], [np.finfo(np.float32).max, -np.finfo(np.float32).max, 0.5]),
    ):
        some = Definition.parse("test/Some", f"{type_}[] data\n")
        form = Form(some, "data", 3, encoding)
        assert list(numbers_at(some, "data", encoding)(form.fill(values, 0))) == expected
        if type_ == "float32":
            continue
        with pytest.raises(WireError, match="not finite"):
            form.fill([float("nan"), 0, 0], 0)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(WireError, match="no numbers at 'label'"):
        numbers_at(MESSAGE, "label", "cdr")
    with pytest.raises(WireError, match="no texts at 'data'"):
        texts_at(MESSAGE, "data", "cdr")
    with pytest.raises(WireError, match="'single' of test/Mixed is one number, not 2"):
        Form(MESSAGE, "single", 2, "cdr")
    with pytest.raises(WireError, match="'three' holds 3 values, not 4"):
        Form(MESSAGE, "three", 4, "cdr")
    with pytest.raises(WireError, match="no field 'labl'"):
        encode(MESSAGE, {"labl": ""}, "ros1")
    with pytest.raises(WireError, match="refers to itself"):
        Definition.parse("test/Loop", "Loop again\n")
    with pytest.raises(WireError, match="does not say what test/Other is"):
        Definition.parse("test/Open", "Other other\n")
