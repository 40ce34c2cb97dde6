"""Messages of one ROS become messages of the other, as another library makes them."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import cast

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys import Stores, get_typestore

from neurovis_spec.language.ros_types import all_types
from neurovis_spec.ros.convert import ConversionError, Converter
from neurovis_spec.ros.definitions import written
from neurovis_spec.runtime.wire import WireError

STORES = {1: get_typestore(Stores.ROS1_NOETIC), 2: get_typestore(Stores.ROS2_KILTED)}
SIZES = {"float32": "f4", "float64": "f8", "bool": "?", "byte": "u1", "char": "u1", "octet": "u1"}
TYPES = [
    *(type_ for type_ in all_types() if type_ not in ("std_msgs/Time", "std_msgs/Duration")),
    *("sensor_msgs/Image", "sensor_msgs/PointCloud2", "nav_msgs/Path", "diagnostic_msgs/DiagnosticArray"),
    *("trajectory_msgs/JointTrajectory", "sensor_msgs/MultiDOFJointState", "std_msgs/Empty"),
]


def text_of(type_: str, ros: int) -> str:
    return STORES[ros].generate_msgdef(written(type_, 2), ros_version=ros)[0]


def drawn(type_: str, ros: int, draw: random.Random) -> object:
    """A message of ROS with random values; numbers of headers are 0, which ROS 2 does not have."""
    store, made = STORES[ros], {}
    for name, kind in store.fielddefs[type_][1]:
        made[name] = 0 if type_.endswith("/Header") and name == "seq" else value(kind, ros, draw)
    make = cast("Callable[..., object]", store.types[type_])
    return make(**made)


def value(kind: FieldDesc, ros: int, draw: random.Random) -> object:
    if kind[0] == Nodetype.NAME:
        return drawn(kind[1], ros, draw)
    if kind[0] == Nodetype.BASE:
        return base(kind[1][0], draw)
    inner, fixed = kind[1]
    count = fixed if kind[0] == Nodetype.ARRAY else draw.randrange(4)
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        name = inner[1][0]
        dtype = SIZES.get(name) or np.dtype(name).str
        return np.array([base(name, draw) for _ in range(count)], dtype=dtype)
    return [value(inner, ros, draw) for _ in range(count)]


def base(name: str, draw: random.Random) -> object:
    if name == "string":
        return "".join(draw.choice("abcü ") for _ in range(draw.randrange(9)))
    if name == "bool":
        return draw.random() < 0.5
    return draw.choice([-0.5, 2.25]) if name.startswith("float") else draw.randrange(100)


@pytest.mark.parametrize("type_", TYPES)
def test_every_type_is_converted_as_another_library_does(type_: str) -> None:
    draw, name = random.Random(1), written(type_, 2)
    there = Converter(type_, text_of(type_, 1), "ros1", text_of(type_, 2))
    back = Converter(type_, text_of(type_, 2), "cdr", text_of(type_, 1))
    for _ in range(5):
        one = bytes(STORES[1].serialize_ros1(drawn(name, 1, draw), name))
        two = there.convert(one)
        assert two == bytes(STORES[2].ros1_to_cdr(one, name))
        assert back.convert(two) == one
        swapped = bytes(STORES[2].serialize_cdr(STORES[2].deserialize_cdr(two, name), name, little_endian=False))
        assert back.convert(swapped) == one
        for size in range(len(one)):
            if type_ != "std_msgs/Empty":
                with pytest.raises(WireError):
                    there.convert(one[:size])


def test_what_is_not_the_same_in_both_is_refused() -> None:
    with pytest.raises(ConversionError, match="sensor_msgs/Range is not the same in ROS 1 and ROS 2"):
        Converter("sensor_msgs/Range", text_of("sensor_msgs/Range", 1), "ros1", text_of("sensor_msgs/Range", 2))
    with pytest.raises(ConversionError, match="wide characters"):
        Converter("my_msgs/Mine", "wstring text\n", "cdr")
    with pytest.raises(ConversionError, match="does not say what my_msgs/Other is"):
        Converter("my_msgs/Mine", "Other other\n", "cdr")


def test_definitions_without_an_end_are_refused() -> None:
    with pytest.raises(ConversionError):
        Converter("a/A", "A a\n", "ros1")
    doubled = "".join(f"{'=' * 80}\nMSG: a/A{k}\nA{k + 1} x\nA{k + 1} y\n" for k in range(40))
    with pytest.raises(ConversionError):
        Converter("a/A", f"A0 a\n{doubled}", "ros1")


def test_a_count_that_lies_is_refused() -> None:
    with pytest.raises(WireError):
        Converter("a/A", f"B[] b\n{'=' * 80}\nMSG: a/B\n", "ros1").convert(b"\xff" * 4)


def test_types_of_ones_own_are_converted_by_their_definition() -> None:
    text = f"int8 A=1\nint8 a # c\nfloat64[2] b\nIn[<=3] c\nstring<=9 d\n{'=' * 80}\nMSG: my/In\nuint16 x\n"
    one = b"\7" + np.array([1.0, 2.0]).tobytes() + b"\1\0\0\0\5\0" + b"\2\0\0\0hi"
    two = Converter("my/Mine", text, "ros1").convert(one)
    assert two == (b"\0\1\0\0\7" + bytes(7) + np.array([1.0, 2.0]).tobytes() + b"\1\0\0\0\5\0\0\0" + b"\3\0\0\0hi\0")
    assert Converter("my/Mine", text, "cdr").convert(two) == one
