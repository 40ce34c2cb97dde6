"""Recordings that others have made are read: of ROS 1 and ROS 2, compressed or not, whole or not."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType as Compression
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as OneWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as TwoWriter
from rosbags.typesys import Stores, get_typestore

import neurovis_spec as nv
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.files import Files, Rotation
from neurovis_spec.ros.logs import Stored, Topic
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.wire import ArrayForm, text_message

ARRAY, STRING = "std_msgs/msg/Float64MultiArray", "std_msgs/msg/String"
ONE, TWO = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_KILTED)
START = 1_700_000_000_123_456_789


def sent(ros: int) -> list[tuple[str, str, bytes]]:
    form = ArrayForm.of("", 3, "ros1" if ros == 1 else "cdr")
    arrays = [("/a", ARRAY, form.message(k, k, np.full(3, float(k)))) for k in range(300)]
    return [("/s", STRING, text_message("hello", "ros1" if ros == 1 else "cdr")), *arrays]


def check(path: Path, ros: int) -> None:
    bag = read_bag(path)
    assert bag.ros == ros
    found = list(bag.messages())
    assert [(m.topic.name, m.topic.type.replace("/", "/msg/"), m.data) for m in found] == sent(ros)
    assert [m.log_time for m in found] == [START + k * 1000 for k in range(301)]
    store = ONE if ros == 1 else TWO
    assert {m.topic.type: m.topic.definition for m in found} == {
        type_.replace("/msg/", "/"): store.generate_msgdef(type_, ros_version=ros)[0] for type_ in (STRING, ARRAY)
    }


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_bags_of_ros_1(compression: str, tmp_path: Path) -> None:
    writer = OneWriter(tmp_path / "x.bag")
    if compression != "none":
        writer.set_compression(OneWriter.CompressionFormat[compression.upper()])
    writer.chunk_threshold = 5000
    with writer:
        known = {}
        for number, (topic, type_, data) in enumerate(sent(1)):
            if topic not in known:
                known[topic] = writer.add_connection(topic, type_, typestore=ONE)
            writer.write(known[topic], START + number * 1000, data)
    check(tmp_path / "x.bag", 1)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("version", [8, 9])
def test_folders_of_ros2_bag(plugin: StoragePlugin, version: int, tmp_path: Path) -> None:
    with TwoWriter(tmp_path / "x", version=9 if version == 9 else 8, storage_plugin=plugin) as writer:
        known = {}
        for number, (topic, type_, data) in enumerate(sent(2)):
            if topic not in known:
                known[topic] = writer.add_connection(topic, type_, typestore=TWO)
            writer.write(known[topic], START + number * 1000, data)
    check(tmp_path / "x", 2)
    (file,) = [one for one in (tmp_path / "x").iterdir() if one.suffix != ".yaml"]
    check(file, 2)
    (tmp_path / "x" / "metadata.yaml").unlink()
    check(tmp_path / "x", 2)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_folders_that_are_compressed_as_a_whole_are_refused(mode: CompressionMode, tmp_path: Path) -> None:
    writer = TwoWriter(tmp_path / "x", version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/s", STRING, typestore=TWO)
        writer.write(connection, START, text_message("hello", "cdr"))
    with pytest.raises(RecordingError, match="compressed one by one: 'ros2 bag convert' unpacks them"):
        read_bag(tmp_path / "x")


@pytest.mark.parametrize("compression", list(Compression))
@pytest.mark.parametrize("chunked", [True, False])
@pytest.mark.parametrize("ros", [1, 2])
def test_mcap_files(ros: int, chunked: bool, compression: Compression, tmp_path: Path) -> None:
    """As rosbag2 and others write them: schemas and channels in the chunks."""
    path, store = tmp_path / "x.mcap", ONE if ros == 1 else TWO
    with path.open("wb") as file:
        writer = McapWriter(file, chunk_size=3000, compression=compression, use_chunking=chunked)
        writer.start(f"ros{ros}")
        known: dict[str, int] = {}
        for number, (topic, type_, data) in enumerate(sent(ros)):
            if topic not in known:
                name = type_ if ros == 2 else type_.replace("/msg/", "/")
                text = store.generate_msgdef(type_, ros_version=ros)[0].encode()
                schema = writer.register_schema(name, f"ros{ros}msg", text)
                known[topic] = writer.register_channel(topic, "ros1" if ros == 1 else "cdr", schema)
            time = START + number * 1000
            writer.add_message(known[topic], time, data, time, number)
        writer.finish()  # type: ignore[no-untyped-call]
    check(path, ros)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.warns(UserWarning, match="breaks off"):
        found = list(read_bag(path).messages())
    assert 20 < len(found) < 300
    assert [m.data for m in found] == [data for _, _, data in sent(ros)][: len(found)]


def test_topics_in_other_encodings_are_left_out_and_named(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/j", "json", schema)
        writer.add_message(channel, START, b"{}", START)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.warns(UserWarning, match=r"x\.mcap: the messages on /j are left out: they are encoded as 'json'"):
        bag = read_bag(path)
    assert (bag.topics, list(bag.messages())) == ((), [])


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.bag").write_text("#ROSBAG V1.2\n")
    (tmp_path / "empty").mkdir()
    with sqlite3.connect(tmp_path / "x.db3") as database:
        database.execute("CREATE TABLE other (x)")
    with sqlite3.connect(tmp_path / "view.db3") as database:
        database.execute("CREATE VIEW topics AS SELECT 1 AS id")
        database.execute("CREATE VIEW messages AS SELECT 1 AS id")
    for name in ("x.bag", "empty", "x.db3", "view.db3", "missing"):
        with pytest.raises(RecordingError, match=name):
            read_bag(tmp_path / name)


def written(path: Path, texts: list[str]) -> None:
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        schema = writer.register_schema(STRING, "ros2msg", b"string data\n")
        channel = writer.register_channel("/s", "cdr", schema)
        for number, text in enumerate(texts):
            writer.add_message(channel, START + number, text_message(text, "cdr"), START + number, number)
        writer.finish()  # type: ignore[no-untyped-call]


def texts(path: Path) -> list[bytes]:
    return [message.data for message in read_bag(path).messages()]


def test_a_folder_without_metadata_is_a_recording_where_its_files_follow_each_other(tmp_path: Path) -> None:
    """As ros2 bag numbers them; where the recorder was killed, nothing says what there is."""
    expected = [text_message(name, "cdr") for name in "abc"]
    for number, name in ((9, "a"), (10, "b"), (11, "c")):
        written(tmp_path / f"x_{number}.mcap", [name])
    assert texts(tmp_path) == expected
    written(tmp_path / "another.mcap", ["d"])
    with pytest.raises(RecordingError, match="its 4 files are not one recording: name one of them"):
        read_bag(tmp_path)
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {relative_file_paths: [x_9.mcap]}")
    assert texts(tmp_path) == expected  # and those that go on behind what is named


def test_files_of_ours_follow_each_other_where_they_say_so(tmp_path: Path) -> None:
    """Whatever they are called, and runs of a network that lie side by side do not."""
    for place, recording in (("one", "x"), ("two", "y"), ("both", "x"), ("both", "y")):
        (tmp_path / place).mkdir(exist_ok=True)
        made = Files(tmp_path / place / f"{recording}.mcap", 2, {"network": "x"}, rotation=Rotation(size=1))
        topic = Topic("/s", "std_msgs/String", "cdr", "string data\n")
        for number, text in enumerate("abc"):
            made.write([Stored(topic, number, START + number, START + number, text_message(text, "cdr"))])
        made.close()
    for place in ("one", "two"):
        assert len(list((tmp_path / place).iterdir())) == 3
        assert texts(tmp_path / place) == [text_message(name, "cdr") for name in "abc"]
    with pytest.raises(RecordingError, match="its 6 files are not one recording"):
        read_bag(tmp_path / "both")
    compiled = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 2}}\ntime: {steps: 5}\n")
    (tmp_path / "runs").mkdir()
    for number in range(2):
        compiled.run(5).save(tmp_path / "runs" / f"run_{number}.mcap")
    with pytest.raises(RecordingError, match=r"its 2 files are not one recording: .*\(run_0.mcap, run_1.mcap\)"):
        nv.load(tmp_path / "runs")


def test_metadata_that_leads_elsewhere_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    (tmp_path / "secret.mcap").write_bytes(b"secret")
    about = "rosbag2_bagfile_information: {relative_file_paths: [../secret.mcap, /etc/passwd], compression_mode: ''}"
    (tmp_path / "x" / "metadata.yaml").write_text(about)
    with pytest.raises(RecordingError, match="a folder without a recording"):
        read_bag(tmp_path / "x")
