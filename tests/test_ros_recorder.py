"""Recordings of topics: all that came is in them, whatever becomes of the recorder, and other programs read them."""

from __future__ import annotations

import errno
import os
import resource
import signal
import struct
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
import rosbags.rosbag1
import rosbags.rosbag2
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from neurovis_spec.ros import recorder as recorder_module
from neurovis_spec.ros.accept import ARRAY, STRING, Stream, anything, arrays
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.definitions import definition, written
from neurovis_spec.ros.files import Files, Rotation, refusal
from neurovis_spec.ros.logs import BagLog, McapLog, Stored, Topic, topic_of
from neurovis_spec.ros.middleware import Arrival, Ros
from neurovis_spec.ros.recorder import Recorder
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.wire import ENCODINGS, ArrayForm, text_message

HASH, N = "0123456789abcdef", 12
LABEL, TOPIC = f"neurovis/1:{HASH}", "/neurovis/x/activity"
START = 1_700_000_000_000_000_000
KINDS = pytest.mark.parametrize(("name", "ros"), [("x.mcap", 1), ("x.mcap", 2), ("x.bag", 1), ("x", 2)])


def text_of_type(type_: str, ros: Ros) -> str:
    text = definition(type_, ros)
    assert text is not None
    return text


def files(path: Path, ros: Ros, rotation: Rotation | None = None, force: bool = False) -> Files:
    spec = topic_of("/neurovis/x/spec", STRING, text_of_type(STRING, ros), ros)
    first = [(spec, text_message("neurovis: 1\n", ENCODINGS[ros]))]
    about = {"network": "x", "hash": HASH, "dt": "0.01", "version": "1"}
    return Files(path, ros, about, first, rotation or Rotation(), force)


def stream(ros: Ros) -> Stream:
    return Stream("activity", TOPIC, ARRAY, ENCODINGS[ros], arrays(HASH, N))


def sent(ros: Ros, steps: range) -> list[bytes]:
    form = ArrayForm.of(LABEL, N, ENCODINGS[ros])
    return [form.message(step, step / 100, np.arange(float(N)) + step) for step in steps]


def record(recorder: Recorder, one: Stream, messages: list[bytes], start: int = START) -> None:
    for number, data in enumerate(messages):
        recorder.put(one, Arrival(data, start + number * 1_000_000, None, ARRAY))


def made(path: Path, ros: Ros, count: int = 2000, rotation: Rotation | None = None) -> list[bytes]:
    """A recording of so many messages."""
    lines = list[str]()
    recorder = Recorder(files(path, ros, rotation), {ARRAY: text_of_type(ARRAY, ros)}, lines.append)
    one, messages = stream(ros), sent(ros, range(count))
    recorder.start()
    record(recorder, one, messages)
    recorder.end()
    assert (one.counts.received, one.counts.recorded, one.counts.lost, lines) == (count, count, 0, [])
    return messages


def arrays_in(path: Path) -> list[bytes]:
    return [one.data for one in read_bag(path).messages() if one.topic.name == TOPIC]


@KINDS
def test_what_was_recorded_is_read_as_it_came(name: str, ros: Ros, tmp_path: Path) -> None:
    messages = made(tmp_path / name, ros)
    bag = read_bag(tmp_path / name)
    assert bag.ros == ros
    assert bag.about["network"] == "x"
    assert {topic.name: topic.type for topic in bag.topics} == {"/neurovis/x/spec": STRING, TOPIC: ARRAY}
    first, *rest = bag.messages()
    assert first.topic.name == "/neurovis/x/spec"
    assert [one.data for one in rest] == messages
    assert [one.log_time for one in rest] == [START + k * 1_000_000 for k in range(2000)]
    if not name.endswith(".bag"):
        assert [one.publish_time for one in rest[:3]] == [0, 10_000_000, 20_000_000]
        assert [one.sequence for one in rest] == list(range(2000))
    assert rest[0].topic.definition == definition(ARRAY, ros)


@KINDS
def test_other_programs_read_it_through_the_index(name: str, ros: Ros, tmp_path: Path) -> None:
    messages, path = made(tmp_path / name, ros), tmp_path / name
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_KILTED)
    found: list[tuple[int, bytes]] = []
    if name.endswith(".bag"):
        with rosbags.rosbag1.Reader(path) as one:
            found = [(time, bytes(data)) for c, time, data in one.messages() if c.topic == TOPIC]
            sums = {connection.digest for connection in one.connections}
            assert sums == {store.generate_msgdef(written(type_, 2))[1] for type_ in (ARRAY, STRING)}
    elif not path.suffix:
        with rosbags.rosbag2.Reader(path) as two:
            found = [(time, bytes(data)) for c, time, data in two.messages() if c.topic == TOPIC]
            assert two.message_count == 2001
        with AnyReader([path]) as three:
            last = list(three.messages())[-1]
            assert three.deserialize(last[2], last[0].msgtype).data[2] == 1999  # type: ignore[attr-defined]
    else:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            assert reader.get_header().profile == f"ros{ros}"
            summary = reader.get_summary()
            assert summary is not None
            assert summary.statistics is not None
            assert summary.statistics.message_count == 2001
            found = [(m.log_time, m.data) for _, c, m in reader.iter_messages() if c.topic == TOPIC]
            assert {schema.name for schema in summary.schemas.values()} == {written(t, ros) for t in (ARRAY, STRING)}
            (about,) = list(reader.iter_metadata())
            assert about.name == "neurovis"
            assert about.metadata["hash"] == HASH
    assert found == [(START + k * 1_000_000, data) for k, data in enumerate(messages)]


def test_the_header_of_a_bag_is_as_large_as_rosbag_counts_on(tmp_path: Path) -> None:
    """Which writes its own over it, while what comes behind stays where it is."""
    made(tmp_path / "x.bag", 1, 1)
    data = (tmp_path / "x.bag").read_bytes()
    (fields,) = struct.unpack_from("<I", data, 13)
    (filled,) = struct.unpack_from("<I", data, 17 + fields)
    assert fields == 4 + 4 + 4 + 4 + len(b"op=.index_pos=........conn_count=....chunk_count=....")
    assert fields + filled == 4096
    assert data[21 + 4096 + 8 : 21 + 4096 + 12] == b"op=\5", "the first chunk follows"


def test_a_bag_of_an_earlier_version_is_read() -> None:
    """Its header was shorter, and said of which network it is."""
    bag = read_bag(Path(__file__).parent / "golden" / "earlier.bag")
    assert bag.about["hash"] == HASH
    first, *rest = bag.messages()
    assert first.topic.name == "/neurovis/x/spec"
    assert [one.data for one in rest] == sent(1, range(3))


def test_chunks_have_64_kib_at_most_and_end_after_a_tenth_of_a_second(tmp_path: Path) -> None:
    made(tmp_path / "x.mcap", 2, 3000)
    with (tmp_path / "x.mcap").open("rb") as file:
        chunks = [found.length for found in records.scan(file) if found.opcode == records.CHUNK]
    assert len(chunks) > 8
    assert max(chunks) <= (64 << 10) + 100
    recorder = Recorder(files(tmp_path / "y.mcap", 2), {ARRAY: text_of_type(ARRAY, 2)}, print)
    recorder.start()
    one = stream(2)
    record(recorder, one, sent(2, range(1)))
    until = time.monotonic() + 20
    while one.counts.recorded == 0 and time.monotonic() < until:
        time.sleep(0.005)
    with warnings.catch_warnings(record=True) as caught:  # while it is being written
        warnings.simplefilter("always")
        assert arrays_in(tmp_path / "y.mcap") == sent(2, range(1))
    assert ["breaks off" in str(one.message) for one in caught] == [True]
    recorder.end()


@KINDS
def test_rotation_makes_files_that_can_be_read_alone_and_together(name: str, ros: Ros, tmp_path: Path) -> None:
    path = tmp_path / name
    messages = made(path, ros, 3000, Rotation(size=150_000))
    names = sorted(one.name for one in (path if path.is_dir() else tmp_path).iterdir())
    expected = {"x.mcap": ["x-1.mcap", "x.mcap"], "x.bag": ["x-1.bag", "x.bag"], "x": ["metadata.yaml", "x_0.mcap"]}
    assert set(expected[name]) <= set(names)
    assert arrays_in(path) == messages
    second = path / "x_1.mcap" if path.is_dir() else path.with_stem("x-1")
    alone = list(read_bag(second).messages())
    assert alone[0].topic.type == STRING
    assert [one.data for one in alone[1:]] == messages[messages.index(alone[1].data) :][: len(alone) - 1]
    if path.is_dir():
        with rosbags.rosbag2.Reader(path) as reader:
            assert sum(1 for _ in reader.messages()) == 3000 + len(names) - 1


def test_a_file_of_another_recording_is_not_taken_along(tmp_path: Path) -> None:
    messages = made(tmp_path / "x.mcap", 2, 10)
    made(tmp_path / "x-1.mcap", 2, 10)
    assert arrays_in(tmp_path / "x.mcap") == messages


@KINDS
def test_an_existing_file_is_an_error_unless_forced(name: str, ros: Ros, tmp_path: Path) -> None:
    made(tmp_path / name, ros, 3000, Rotation(size=150_000))
    with pytest.raises(FileExistsError):
        files(tmp_path / name, ros)
    forced = files(tmp_path / name, ros, force=True)
    assert len(arrays_in(tmp_path / name)) == 3000, "it stays until something comes in its place"
    forced.write(
        [Stored(topic_of(TOPIC, ARRAY, text_of_type(ARRAY, ros), ros), 0, START, START, sent(ros, range(1))[0])]
    )
    left = [one for one in tmp_path.rglob("*") if one.is_file() and one.name != "metadata.yaml"]
    assert len(left) == 1


@KINDS
def test_an_earlier_recording_stays_where_none_can_be_begun(
    name: str, ros: Ros, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made(tmp_path / name, ros, 3000, Rotation(size=150_000))
    before = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
    forced = files(tmp_path / name, ros, force=True)

    def full(log: McapLog | BagLog, messages: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    for kind in (McapLog, BagLog):
        monkeypatch.setattr(kind, "write", full)
    message = Stored(topic_of(TOPIC, ARRAY, text_of_type(ARRAY, ros), ros), 0, START, START, sent(ros, range(1))[0])
    with pytest.raises(OSError, match="No space"):
        forced.write([message])
    assert {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()} == before


def test_an_earlier_recording_of_which_one_file_cannot_be_moved_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made(tmp_path / "x.mcap", 2, 3000, Rotation(size=150_000))
    before = {one: one.read_bytes() for one in tmp_path.iterdir()}
    assert len(before) > 1
    forced, rename = files(tmp_path / "x.mcap", 2, force=True), Path.rename

    def stuck(path: Path, target: Path) -> Path:
        if path.name == "x-1.mcap":
            raise PermissionError(errno.EACCES, "Permission denied")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", stuck)
    message = Stored(topic_of(TOPIC, ARRAY, text_of_type(ARRAY, 2), 2), 0, START, START, sent(2, range(1))[0])
    with pytest.raises(PermissionError):
        forced.write([message])
    assert {one: one.read_bytes() for one in tmp_path.iterdir()} == before


@KINDS
def test_a_folder_that_is_not_there_is_an_error_at_once(name: str, ros: Ros, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        files(tmp_path / "missing" / name, ros)


def test_what_cannot_be_recorded_is_refused_before() -> None:
    assert refusal(Path("x.mcap"), 1) is refusal(Path("x.mcap"), 2) is refusal(Path("x"), 2) is None
    assert "ROS 2" in str(refusal(Path("x.bag"), 2))
    assert "folder" in str(refusal(Path("x"), 1))
    assert "'.mp4'" in str(refusal(Path("x.mp4"), 2))


def test_what_a_full_queue_does_not_take_is_lost_and_counted(tmp_path: Path) -> None:
    lines = list[str]()
    texts = {ARRAY: text_of_type(ARRAY, 2)}
    recorder = Recorder(files(tmp_path / "x.mcap", 2), texts, lines.append, room=10_000)
    one = stream(2)
    record(recorder, one, sent(2, range(100)))  # nobody takes them out yet
    recorder.start()
    recorder.end()
    assert one.counts.received == one.counts.recorded == len(arrays_in(tmp_path / "x.mcap"))
    assert one.counts.lost == 100 - one.counts.received > 0
    assert lines == [f"{one.counts.lost} lost on {TOPIC}"]


class FullDisk(Files):
    """Takes nothing of a chunk now and then."""

    def write(self, messages: object) -> None:
        self.tries = getattr(self, "tries", 0) + 1
        if self.tries in (2, 3):
            raise OSError(28, "No space left on device")
        super().write(messages)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["x.mcap", "x.bag"])
def test_what_a_full_disk_does_not_take_is_lost_and_said_once(name: str, tmp_path: Path) -> None:
    lines = list[str]()
    held = FullDisk(tmp_path / name, 1, {}, ())
    recorder = Recorder(held, {ARRAY: text_of_type(ARRAY, 1)}, lines.append)
    recorder.start()
    one = stream(1)
    record(recorder, one, sent(1, range(3000)))
    recorder.end()
    assert one.counts.received == 3000 == one.counts.recorded + one.counts.lost
    assert one.counts.lost > 0
    assert len(arrays_in(tmp_path / name)) == one.counts.recorded
    assert lines[0] == "the recording cannot be written: No space left on device; messages are lost"
    assert sum("cannot be written" in line for line in lines) == 1
    assert "the recording is written again" in lines


class NoRoom(Files):
    """The disk has room for the first chunk alone."""

    def write(self, messages: object) -> None:
        if self.paths:
            raise OSError(28, "No space left on device")
        super().write(messages)  # type: ignore[arg-type]


def test_a_disk_that_stays_full_is_told_of_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Having the disk hold what there is goes well all the same."""
    monkeypatch.setattr(recorder_module, "_SYNC_TIME", 0.0)
    lines = list[str]()
    recorder = Recorder(NoRoom(tmp_path / "x.mcap", 1, {}, ()), {ARRAY: text_of_type(ARRAY, 1)}, lines.append)
    recorder.start()
    one = stream(1)
    for first in range(0, 3000, 300):
        record(recorder, one, sent(1, range(first, first + 300)))
        time.sleep(0.02)
    recorder.end()
    assert one.counts.recorded + one.counts.lost == 3000
    told = [line for line in lines if "recording" in line]
    assert told == ["the recording cannot be written: No space left on device; messages are lost"]


@pytest.mark.parametrize("name", ["x.mcap", "x.bag"])
def test_a_chunk_that_gets_in_partly_is_taken_out_again(name: str, tmp_path: Path) -> None:
    """A limit on the size of files stands for a full disk."""
    recorder = Recorder(files(tmp_path / name, 1), {ARRAY: text_of_type(ARRAY, 1)}, list[str]().append)
    one, messages = stream(1), sent(1, range(3000))
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, most))  # Python ignores the signal that comes with it
    try:
        recorder.start()
        record(recorder, one, messages)
        recorder.end()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    recorded = one.counts.recorded
    assert recorded + one.counts.lost == 3000
    assert 500 < recorded < 3000
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kept = arrays_in(tmp_path / name)
    rest = iter(messages)  # a smaller chunk may still get in after one that did not
    assert len(kept) == recorded
    assert all(one in rest for one in kept)


@KINDS
def test_all_of_the_whole_chunks_is_there_after_kill_9(name: str, ros: Ros, tmp_path: Path) -> None:
    code = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_ros_recorder import *
ros = int(sys.argv[2])
recorder = Recorder(files(Path(sys.argv[1]), ros, Rotation(size=300_000)), {{ARRAY: text_of_type(ARRAY, ros)}}, print)
recorder.start()
one = stream(ros)
for step in range(10**9):
    record(recorder, one, sent(ros, range(step, step + 1)))
    time.sleep(0.0002)
    if step % 100 == 99:
        print(step, one.counts.recorded, flush=True)
"""
    child = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / name), str(ros)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    recorded = 0
    for line in child.stdout:
        recorded = int(line.split()[1])
        if recorded > 2500:
            break
    os.kill(child.pid, signal.SIGKILL)
    child.wait(20)
    child.stdout.close()
    with pytest.warns(UserWarning, match="breaks off: it is read to its last whole chunk"):
        found = arrays_in(tmp_path / name)
    assert len(found) >= recorded
    assert found == sent(ros, range(len(found)))


@KINDS
def test_every_beginning_of_a_file_is_read_or_refused(name: str, ros: Ros, tmp_path: Path) -> None:
    made(tmp_path / name, ros, 500)
    path = tmp_path / name
    file = path / "x_0.mcap" if path.is_dir() else path
    whole, all_of_it = file.read_bytes(), arrays_in(path)
    for size in [*range(0, 5000, 97), *range(5000, len(whole), 9973)]:
        file.write_bytes(whole[:size])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                found = arrays_in(path)
            except RecordingError:
                assert size < 5000
                continue
        assert found == all_of_it[: len(found)]


@pytest.mark.parametrize(("name", "ros"), [("x.mcap", 2), ("x.bag", 1)])
def test_a_file_with_a_byte_changed_is_read_or_refused(name: str, ros: Ros, tmp_path: Path) -> None:
    made(tmp_path / name, ros, 60)
    path = tmp_path / name
    whole = path.read_bytes()
    draw, refused = np.random.default_rng(1), list[str]()
    for place in (*range(0, 700, 3), *draw.integers(700, len(whole), 150).tolist()):
        changed = bytearray(whole)
        changed[place] ^= int(draw.integers(1, 256))
        path.write_bytes(changed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                assert len(list(read_bag(path).messages())) <= 200
            except RecordingError as error:
                refused.append(str(error))
    assert 0 < len(refused) < 300
    assert all(text.startswith(str(path)) for text in refused)


def test_8000_messages_at_once_of_150_neurons_beside_a_listener_are_all_recorded(tmp_path: Path) -> None:
    judge = Stream("activity", TOPIC, ARRAY, "cdr", arrays(HASH, 150))
    shown = list[int]()
    recorder = Recorder(
        files(tmp_path / "x.mcap", 2),
        {ARRAY: text_of_type(ARRAY, 2)},
        print,
        lambda s, a, found: shown.append(found.seq or 0),
    )
    recorder.start()
    form = ArrayForm.of(LABEL, 150, "cdr")
    record(recorder, judge, [form.message(step, step, np.zeros(150)) for step in range(8000)])
    recorder.end()
    assert judge.counts.recorded == 8000
    assert shown == list(range(8000))
    assert len(arrays_in(tmp_path / "x.mcap")) == 8000


def test_messages_of_types_that_are_not_looked_into_are_recorded_too(tmp_path: Path) -> None:
    one = Stream("mine", "/mine", "my_msgs/Mine", "cdr", anything)
    recorder = Recorder(files(tmp_path / "x.mcap", 2), {"my_msgs/Mine": "int8 x\n"}, print)
    recorder.start()
    recorder.put(one, Arrival(b"\0\1\0\0\7", START, START - 5, "my_msgs/Mine"))
    recorder.end()
    *_, last = read_bag(tmp_path / "x.mcap").messages()
    assert last == Stored(Topic("/mine", "my_msgs/Mine", "cdr", "int8 x\n"), 0, START, START - 5, b"\0\1\0\0\7")
