"""Which messages count, in both encodings, whoever sent them."""

from __future__ import annotations

import struct
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from neurovis_spec.language.ros_types import all_types
from neurovis_spec.ros.accept import ARRAY, STRING, Accepted, Stream, anything, arrays, headed, texts, time_of
from neurovis_spec.ros.definitions import definition, md5sum, written
from neurovis_spec.ros.middleware import Arrival, Ros
from neurovis_spec.ros.summary import Teller
from neurovis_spec.runtime.wire import ENCODINGS, ArrayForm, Encoding, WireError, array_of, text_message, text_of

HASH = "0123456789abcdef"
LABEL = f"neurovis/1:{HASH}"
BOTH = pytest.mark.parametrize("encoding", ["ros1", "cdr"])


def message(
    encoding: Encoding, data: list[float], label: str | None = LABEL, offset: int = 2, order: str = "<"
) -> bytes:
    """An array as any controller might send it, field by field."""
    out = b"" if encoding == "ros1" else (b"\0\1\0\0" if order == "<" else b"\0\0\0\0")

    def align(size: int) -> None:
        nonlocal out
        if encoding == "cdr":
            out += bytes(-(len(out) - 4) % size)

    def number(value: int) -> None:
        nonlocal out
        align(4)
        out += struct.pack(f"{order}I", value)

    number(0 if label is None else 1)
    if label is not None:
        text = label.encode() + (b"\0" if encoding == "cdr" else b"")
        number(len(text))
        out += text
        number(len(data))
        number(len(data))
    number(offset)
    number(len(data))
    if data:
        align(8)
        out += struct.pack(f"{order}{len(data)}d", *data)
    return out


def stream(encoding: Encoding = "cdr", size: int = 3) -> Stream:
    return Stream("activity", "/neurovis/x/activity", ARRAY, encoding, arrays(HASH, size))


def take(one: Stream, data: bytes, type_: str = ARRAY) -> Accepted | None:
    taken = one.take(Arrival(data, 10, None, type_), Teller(lambda line: None))
    return taken[-1][1] if taken else None


@BOTH
def test_an_array_of_ours_is_accepted_with_its_step_and_time(encoding: Encoding) -> None:
    form = ArrayForm.of(LABEL, 3, encoding)
    data = form.message(7, 1.5, np.array([1.0, 2.0, 3.0]))
    found = take(stream(encoding), data)
    assert found is not None
    assert (found.seq, found.stamp, found.numbers.tolist()) == (7, 1_500_000_000, [1, 2, 3])


@pytest.mark.parametrize("label", ["", "x", LABEL, LABEL + "é"])
@pytest.mark.parametrize("ros", [1, 2])
def test_what_we_send_is_what_other_libraries_read_and_send(label: str, ros: Ros) -> None:
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_KILTED)
    ours = ArrayForm.of(label, 2, ENCODINGS[ros]).message(7, 1.5, np.array([1.0, 2.0]))
    name = "std_msgs/msg/Float64MultiArray"
    read = store.deserialize_ros1(ours, name) if ros == 1 else store.deserialize_cdr(ours, name)
    theirs = store.serialize_ros1(read, name) if ros == 1 else store.serialize_cdr(read, name)
    assert bytes(theirs) == ours
    assert array_of(ours, ENCODINGS[ros]).label.decode() == label
    text = text_message(label, ENCODINGS[ros])
    said = (
        store.deserialize_ros1(text, "std_msgs/msg/String")
        if ros == 1
        else store.deserialize_cdr(text, "std_msgs/msg/String")
    )
    assert said.data == label == text_of(text, ENCODINGS[ros])  # type: ignore[attr-defined]


@BOTH
def test_what_is_rejected_is_counted_by_the_first_reason(encoding: Encoding) -> None:
    one = stream(encoding)
    good = message(encoding, [0, 0, 1, 2, 3])
    assert take(one, good, "std_msgs/Float32MultiArray") is None
    assert take(one, good[:-1]) is None
    assert take(one, message(encoding, [0, 1, 2, 3], offset=1)) is None
    assert take(one, message(encoding, [0, 1, 2, 3], "neurovis/1:other", offset=1)) is None
    assert take(one, message(encoding, [0, 0, 1, 2], "neurovis/1:other")) is None
    assert take(one, message(encoding, [0, 0, 1, 2])) is None
    assert take(one, message(encoding, [1, 2, 3], offset=2)) is None
    assert one.counts.rejected == {"type": 1, "parse": 3, "hash": 1, "length": 2, "names": 0, "publisher": 0}
    assert one.counts.received == 7


@BOTH
def test_messages_without_a_label_count_on_their_length(encoding: Encoding) -> None:
    one = stream(encoding)
    for label in (None, ""):
        found = take(one, message(encoding, [1, 2, 3], label, offset=0))
        assert found is not None
        assert (found.seq, found.numbers.tolist()) == (None, [1, 2, 3])
    assert take(one, message(encoding, [1, 2], None, offset=0)) is None
    assert one.counts.unlabelled == 2


def test_big_endian_messages_and_filled_ones_are_read() -> None:
    assert take(stream(), message("cdr", [4, 0, 1, 2, 3], order=">")) is not None
    assert take(stream(), message("cdr", [4, 0, 1, 2, 3]) + b"\0\0\0") is not None
    assert take(stream(), message("cdr", [4, 0, 1, 2, 3]) + b"\0\0\0\0") is None
    assert take(stream("ros1"), message("ros1", [4, 0, 1, 2, 3]) + b"\0") is None


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -1.0, 2.0**64])
def test_a_prelude_that_cannot_be_one_counts_as_none(bad: float) -> None:
    found = take(stream(), message("cdr", [bad, bad, 1, 2, 3]))
    assert found is not None
    assert (found.seq, found.stamp) == (None, None)
    assert time_of(found, Arrival(b"", 10, 8, ARRAY)) == 8
    assert time_of(found, Arrival(b"", 10, None, ARRAY)) == 10


def test_values_that_are_not_finite_are_kept_and_counted() -> None:
    one = stream()
    found = take(one, message("cdr", [0, 0, 1, float("nan"), float("inf")]))
    assert found is not None
    assert np.isnan(found.numbers[1])
    assert one.counts.not_finite == 1


def test_gaps_are_lost_and_beginning_anew_is_not() -> None:
    one = stream()
    for seq in (5, 6, 9, 9, 3, 4, 10):
        take(one, message("cdr", [seq, 0, 1, 2, 3]))
    assert one.counts.lost == 2 + 5
    one.anew()
    take(one, message("cdr", [100, 0, 1, 2, 3]))
    assert one.counts.lost == 7


def test_what_the_queue_missed_is_not_counted_twice() -> None:
    one = stream()
    take(one, message("cdr", [1, 0, 1, 2, 3]))
    one.miss(3)
    take(one, message("cdr", [5, 0, 1, 2, 3]))
    assert one.counts.lost == 3
    one.miss(2)
    one.end(Teller(lambda line: None))
    assert one.counts.lost == 5


@BOTH
def test_the_time_of_a_header_comes_first(encoding: Encoding) -> None:
    ros: Ros = 1 if encoding == "ros1" else 2
    begin = struct.pack("<I", 9) if ros == 1 else b"\0\1\0\0"
    one = Stream("joints", "/joint_states", "sensor_msgs/JointState", encoding, headed)
    found = take(one, begin + struct.pack("<II", 12, 34), "sensor_msgs/JointState")
    assert found is not None
    assert found.stamp == 12_000_000_034
    unset = take(one, begin + struct.pack("<II", 0, 0), "sensor_msgs/JointState")
    assert unset is not None
    assert unset.stamp is None
    assert take(one, begin, "sensor_msgs/JointState") is None
    assert one.counts.rejected["parse"] == 1


def test_no_more_than_a_line_a_second_tells_of_it() -> None:
    lines, now = list[str](), [0.0]
    teller = Teller(lines.append, lambda: now[0])
    one = stream()
    for _ in range(5):
        one.take(Arrival(b"", 0, None, ARRAY), teller)
    now[0] = 0.99
    teller.look()
    assert lines == ["1 that cannot be read on /neurovis/x/activity"]
    now[0] = 1.0
    teller.look()
    assert lines[1:] == ["4 that cannot be read on /neurovis/x/activity"]


def test_a_length_that_lies_allocates_nothing() -> None:
    for lie in (
        b"\0\1\0\0" + b"\xff" * 4,
        message("cdr", [])[:-4] + b"\xff" * 4,
        b"\0\1\0\0" + b"\1\0\0\0" + b"\xff" * 8,
    ):
        with pytest.raises(WireError):
            array_of(lie, "cdr")


def test_definitions_are_those_of_both_ros() -> None:
    stores: dict[Ros, object] = {}
    for ros, store in ((1, Stores.ROS1_NOETIC), (2, Stores.ROS2_KILTED)):
        known = get_typestore(store)
        stores[1 if ros == 1 else 2] = known
        for type_ in all_types():
            if ros == 2 and type_ in ("std_msgs/Time", "std_msgs/Duration"):  # which ROS 2 has no more
                continue
            text, sum_ = known.generate_msgdef(written(type_, 2), ros_version=ros)
            assert definition(type_, 1 if ros == 1 else 2) == text, type_
            assert ros == 2 or md5sum(type_, text) == sum_


def test_types_of_ros_that_are_not_in_the_table_are_known_with_the_extra() -> None:
    assert "float32 variance" in (definition("sensor_msgs/Range", 2) or "")
    assert "float32 variance" not in (definition("sensor_msgs/msg/Range", 1) or "variance")
    assert definition("my_msgs/Mine", 1) is definition("std_msgs/None", 2) is None


VALUES = st.lists(st.floats(width=64, allow_nan=True, allow_infinity=True), max_size=7)
LABELS = st.sampled_from([None, "", LABEL, "neurovis/1:other", "ü" * 40]) | st.text(max_size=9)


@st.composite
def hostile(draw: st.DrawFn, encoding: Encoding) -> bytes:
    """A message, perhaps a good one, perhaps with bytes changed, cut off or added."""
    data = message(encoding, draw(VALUES), draw(LABELS), draw(st.sampled_from([0, 1, 2, 2, 2, 1 << 31])))
    match draw(st.integers(0, 5)):
        case 0:
            return data[: draw(st.integers(0, len(data)))]
        case 1:
            return data + draw(st.binary(min_size=1, max_size=9))
        case 2:
            place = draw(st.integers(0, len(data) - 1))
            return data[:place] + draw(st.binary(min_size=1, max_size=4)) + data[place + 1 :]
        case 3:
            return draw(st.binary(max_size=60))
    return data


@BOTH
@settings(max_examples=25, deadline=None)
@given(st.data())
def test_hostile_messages_are_counted_and_survived(encoding: Encoding, data: st.DataObject) -> None:
    """100 messages each time: 5,000 in all."""
    one, judged = stream(encoding), Counter[bool]()
    headers = Stream("joints", "/joints", "sensor_msgs/JointState", encoding, headed)
    words = Stream("spec", "/spec", STRING, encoding, texts)
    others = Stream("other", "/other", "my_msgs/Mine", encoding, anything)
    for sent in data.draw(st.lists(hostile(encoding), min_size=100, max_size=100)):
        found = take(one, sent)
        judged[found is not None] += 1
        if found is not None:
            assert len(found.numbers) == 3
            assert found.seq is None or 0 <= found.seq < 1 << 64
            assert found.stamp is None or 0 <= found.stamp < 1 << 64
        for other in (headers, words, others):
            take(other, sent, other.type)
    assert one.counts.received == 100
    assert sum(one.counts.rejected.values()) == judged[False]
