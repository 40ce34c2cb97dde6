"""Recordings as .mcap: what the tools of robots read in them, and what becomes of files that break off or lie."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from time import sleep
from typing import Any

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.runtime import mcap_records as records
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.named_values import NamedValues
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.wire import label_of, step_of, text_of

SPECS = Path(__file__).parents[1] / "specs"
SPEC = """\
neurovis: 1
name: bag
time: {dt: 0.025, steps: 40}
neurons: {A: {count: 3, bias: 1 + i, model: leaky_integrator}, O: {}}
connections:
  A -> O: {weight: 0.1, plasticity: {oja: {rate: 0.01}}}
outputs: {membrane: A.v}
ros: {namespace: /robot}
"""


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


@pytest.fixture
def path(network: nv.CompiledNetwork, tmp_path: Path) -> Path:
    network.run_to(tmp_path / "x.mcap")
    return tmp_path / "x.mcap"


def assert_same(one: Recording, other: Recording) -> None:
    for name in ("step", "activity", "weights", "states", "weights_after", "weights_static", "plastic", "sources"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert (one.neurons, one.views, one.hash, one.reached) == (other.neurons, other.views, other.hash, other.reached)


def test_it_comes_back_whole(network: nv.CompiledNetwork, path: Path) -> None:
    read, made = nv.load(path), network.run()
    assert_same(read, made)
    assert np.array_equal(read["membrane"], made["membrane"])
    read.save(path.with_name("again.mcap"))
    assert_same(nv.load(path.with_name("again.mcap")), made)


def test_other_programs_read_it(network: nv.CompiledNetwork, path: Path) -> None:
    made = network.run()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 1 + 4 * 40
        messages = list(reader.iter_messages())
        about = {item.name: item.metadata for item in reader.iter_metadata()}["neurovis"]
    assert about["hash"] == network.hash
    assert (about["network"], about["dt"]) == ("bag", "0.025")
    schema, channel, first = messages[0]
    assert (schema and schema.name, channel.topic) == ("std_msgs/msg/String", "/robot/bag/spec")
    assert nv.compile_text(text_of(first.data, "cdr")).hash == network.hash
    topics = {c.topic for _, c, _ in messages}
    assert topics == {f"/robot/bag/{name}" for name in ("spec", "activity", "weights", "states", "values")}
    for schema, channel, message in messages[1:]:
        assert schema is not None
        if channel.topic.endswith("/values"):
            continue
        assert (schema.name, schema.encoding) == ("std_msgs/msg/Float64MultiArray", "ros2msg")
        assert "MSG: std_msgs/MultiArrayDimension" in schema.data.decode()
        assert channel.message_encoding == "cdr"
        t = message.sequence
        assert message.log_time == message.publish_time == round(t * 0.025 * 1e9)
        if channel.topic.endswith("activity"):
            assert np.array_equal(step_of(message.data, "cdr", label_of(network.hash), 4)[1], made.activity[t])
            assert struct.unpack_from("<dd", message.data, len(message.data) - 48) == (t, t * 0.025)
    with path.open("rb") as file:
        kinds = [type(record).__name__ for record in StreamReader(file, validate_crcs=True, emit_chunks=True).records]
    assert kinds[-1] == "Footer"
    assert kinds.count("Chunk") == summary.statistics.chunk_count


def by_name(path: Path) -> list[tuple[int, dict[str, Any]]]:
    """The steps and the messages with names, and whether each is as its schema says."""
    found = []
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic.endswith("/values"):
                assert schema is not None
                assert (schema.name, schema.encoding, channel.message_encoding) == (
                    "neurovis.Values",
                    "jsonschema",
                    "json",
                )
                found.append((message.sequence, json.loads(message.data)))
                jsonschema.validate(found[-1][1], json.loads(schema.data))
    return found


def test_tools_find_neurons_by_their_names(network: nv.CompiledNetwork, path: Path) -> None:
    made, found = network.run(), by_name(path)
    assert [step for step, _ in found] == list(range(40))
    for step, message in found:
        assert list(message) == ["A1", "A2", "A3", "O"]
        assert list(message.values()) == pytest.approx(made.activity[step].tolist(), rel=1e-8)


LEGS = """\
neurovis: 1
name: legs
time: {steps: 4}
modules: {leg: {neurons: {K: {count: 2, bias: 1 + i}, O: {}}}}
neurons: {A: {bias: 0.5}}
instances: {left: {module: leg}, right: {module: leg}}
"""


@pytest.mark.parametrize(
    ("key", "found"),
    [
        ("", {"A": 0.5, "left": {"K1": 1, "K2": 2, "O": 0}, "right": {"K1": 1, "K2": 2, "O": 0}}),
        ("ros: {values: [right.K, A]}", {"right": {"K1": 1, "K2": 2}, "A": 0.5}),
        ("ros: {values: left}", {"left": {"K1": 1, "K2": 2, "O": 0}}),
        ("ros: {values: false}", None),
    ],
)
def test_the_spec_says_whose_names_there_are(key: str, found: dict[str, Any] | None, tmp_path: Path) -> None:
    network = nv.compile_text(f"{LEGS}{key}\n")
    network.run_to(tmp_path / "x.mcap")
    assert [message for _, message in by_name(tmp_path / "x.mcap")] == [found] * 4 * (found is not None)
    assert network.hash == nv.compile_text(LEGS).hash
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        played = read_bag(tmp_path / "x.mcap")
    assert [topic.name.rpartition("/")[2] for topic in played.topics] == ["spec", "activity"]
    assert_same(nv.load(tmp_path / "x.mcap"), network.run())


def test_of_many_neurons_no_numbers_are_written_twice(tmp_path: Path) -> None:
    for count, key, held in ((256, "", 2), (257, "", 0), (257, "ros: {values: true}", 2)):
        spec = f"neurovis: 1\nname: many\nneurons: {{A: {{count: {count}}}}}\n{key}\n"
        nv.compile_text(spec).run_to(tmp_path / "x.mcap", 2)
        assert len(by_name(tmp_path / "x.mcap")) == held


def test_what_is_not_finite_has_no_number() -> None:
    values = NamedValues.of(["A", "b.K", "b.c.K", "b.O"], [3, 0, 2, 1])
    row = np.array([np.nan, 1e300, -np.inf, -0.0])
    assert json.loads(values.message(row)) == {"b": {"O": 0, "c": {}, "K": 1e300}}
    assert json.loads(values.message(np.arange(4.0))) == {"b": {"O": 3, "c": {"K": 2}, "K": 1}, "A": 0}


def test_names_that_no_spec_has_are_whole() -> None:
    values = NamedValues.of(["A", "A.b", 'x"%d'], [0, 1, 2])
    assert json.loads(values.message(np.arange(3.0))) == {"A": 0, "A.b": 1, 'x"%d': 2}


def test_chunks_are_small(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC.replace("count: 3, bias: 1 + i", "count: 300, bias: 0.001"))
    network.run_to(tmp_path / "x.mcap", 60)
    with (tmp_path / "x.mcap").open("rb") as file:
        sizes = [found.length for found in records.scan(file) if found.opcode == records.CHUNK]
    assert max(sizes) <= records.LARGEST_CHUNK + 64
    assert len(sizes) > 4


@pytest.mark.parametrize("spec", ["cpg_rbf.yaml", "hexapod/hexapod.yaml"])
def test_the_spec_in_it_needs_no_other_file(tmp_path: Path, spec: str) -> None:
    network = nv.compile(SPECS / spec, seed=5)
    text = network.text()
    (tmp_path / "alone.yaml").write_text(text, encoding="utf-8")
    assert nv.compile(tmp_path / "alone.yaml").hash == network.hash


def test_a_spec_without_files_stays_as_it_was_written(network: nv.CompiledNetwork) -> None:
    assert network.text() == SPEC
    given = nv.compile_text(SPEC.replace("neurons:", "parameters: {g: {value: 1, max: 5}}\nneurons:", 1), g=3)
    assert nv.compile_text(given.text()).parameters == {"g": 3}


def test_it_breaks_off_anywhere(network: nv.CompiledNetwork, path: Path) -> None:
    data, made, last = path.read_bytes(), network.run(), 40
    for cut in range(len(data) - 1, 0, -max(1, len(data) // 90)):
        path.write_bytes(data[:cut])
        try:
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                read = nv.load(path)
        except RecordingError:
            last = 0
            continue
        assert len(read) <= last
        last = len(read)
        assert np.array_equal(read.activity, made.activity[:last])
        if last < 40:
            assert "breaks off: it is read to its last whole chunk" in str(told[0].message)
    assert last == 0


def test_it_outlives_a_kill(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(SPEC, encoding="utf-8")
    command = [sys.executable, "-m", "neurovis_spec", "run", "x.yaml", "--steps", "10000000", "-o", "x.mcap"]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    part = tmp_path / ".x.mcap.part"
    for _ in range(400):
        if part.exists() and part.stat().st_size > 200_000:
            break
        sleep(0.05)
    process.kill()
    process.wait()
    with pytest.warns(UserWarning, match="did not come to its end"):
        read = nv.load(tmp_path / "x.mcap")
    assert len(read) > 100
    made = nv.compile_text(SPEC).run(len(read))
    assert np.array_equal(read.activity, made.activity)
    with pytest.warns(UserWarning, match="is in it until this run is at its end"):
        nv.compile_text(SPEC).run_to(tmp_path / "x.mcap", 3)
    assert len(nv.load(tmp_path / "x.mcap")) == 3


def test_a_run_goes_on_from_it_and_pictures_are_drawn_of_it(path: Path) -> None:
    spec = path.with_name("x.yaml")
    spec.write_text(SPEC, encoding="utf-8")
    network = nv.compile(spec)
    run = ["run", str(spec), "--steps", "5", "--from", str(path), "-o", str(path.with_name("y.npz"))]
    assert CliRunner().invoke(neurovis, run).exit_code == 0
    wanted = network.run(5, start=network.run())
    assert np.array_equal(nv.load(path.with_name("y.npz")).weights, wanted.weights)
    render = ["render", str(spec), "--step", "7", "--recording", str(path), "-o", str(path.with_name("y.svg"))]
    assert CliRunner().invoke(neurovis, render).exit_code == 0
    network.render(path.with_name("z.svg"), step=7, recording=network.run())
    assert path.with_name("y.svg").read_bytes() == path.with_name("z.svg").read_bytes()


def test_a_part_of_a_network_is_refused(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="holds the activities of all neurons"):
        network.run_to(tmp_path / "x.mcap", neurons="O")
    assert list(tmp_path.iterdir()) == []
    network.run_to(tmp_path / "x.mcap", weights="none", every=7)
    assert nv.load(tmp_path / "x.mcap").missing == "the changing weights"
    assert nv.load(tmp_path / "x.mcap").step.tolist() == [0, 7, 14, 21, 28, 35]


def changed(data: bytes, change: Callable[[bytearray], None]) -> bytes:
    copy = bytearray(data)
    change(copy)
    return bytes(copy)


def test_every_byte_may_be_another(network: nv.CompiledNetwork, path: Path) -> None:
    data, made = path.read_bytes(), network.run()
    random = np.random.default_rng(1)
    for place in random.integers(0, len(data), 250).tolist():
        path.write_bytes(changed(data, lambda copy, at=place: copy.__setitem__(at, copy[at] ^ 0x55)))  # type: ignore[misc]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read = nv.load(path)
        except RecordingError:
            continue
        assert len(read) <= 40
        if read.hash == made.hash and len(read):
            assert np.array_equal(read.activity, made.activity[: len(read)])


def test_lengths_that_lie_take_no_memory(path: Path) -> None:
    data = path.read_bytes()
    with path.open("rb") as file:
        starts = [found.start for found in records.scan(file)]
    for start in starts[:12]:
        for length in (2**63, 2**40, len(data) * 2, 0):
            lying = data[: start + 1] + struct.pack("<Q", length) + data[start + 9 :]
            path.write_bytes(lying)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                with pytest.raises((RecordingError, UserWarning)):
                    nv.load(path)
    path.write_bytes(records.MAGIC + os.urandom(5000))
    with pytest.raises(RecordingError):
        nv.load(path)


def test_there_are_no_more_channels_than_numbers_for_them(path: Path) -> None:
    with path.open("rb") as file:
        first = next(found.start for found in records.scan(file) if found.opcode == records.CHUNK)
    channel = records.schemas_and_channels([], [records.Channel(1, "/x")])
    path.write_bytes(path.read_bytes()[:first] + channel * 70_000)
    with pytest.raises(RecordingError, match="more channels than"):
        nv.load(path)


def test_a_file_of_another_program_is_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/other/activity", "cdr", schema)
        for number in range(200):
            writer.add_message(channel, number, bytes(100), number)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(RecordingError, match=r"x\.mcap: not a recording"):
        nv.load(path)


@pytest.mark.parametrize("content", [bytes(30 << 20), b"\x04" + bytes(8) * (1 << 20)])
def test_a_bomb_is_refused(path: Path, content: bytes) -> None:
    import zstandard

    data = zstandard.ZstdCompressor().compress(content)
    start = struct.pack("<QQQI", 0, 0, len(content), 0)
    bomb = records.record(records.CHUNK, start, records.text("zstd"), struct.pack("<Q", len(data)), data)
    with path.open("rb") as file:
        first = next(found.start for found in records.scan(file) if found.opcode == records.CHUNK)
    path.write_bytes(path.read_bytes()[:first] + bomb * 3)
    with pytest.raises(RecordingError):
        nv.load(path)


def test_compressed_chunks_are_read(network: nv.CompiledNetwork, path: Path) -> None:
    """As other tools write a file anew (`mcap compress`)."""
    other = path.with_name("y.mcap")
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        with path.open("rb") as file, other.open("wb") as out:
            reader, writer = make_reader(file), Writer(out, compression=compression)
            writer.start("ros2")
            for attachment in reader.iter_attachments():
                writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
            for item in reader.iter_metadata():
                writer.add_metadata(item.name, item.metadata)
            numbers: dict[str, int] = {}
            for schema, channel, message in reader.iter_messages():
                assert schema is not None
                if channel.topic not in numbers:
                    made = writer.register_schema(schema.name, schema.encoding, schema.data)
                    numbers[channel.topic] = writer.register_channel(channel.topic, "cdr", made)
                t = message.log_time
                writer.add_message(numbers[channel.topic], t, message.data, t, message.sequence)
            writer.finish()  # type: ignore[no-untyped-call]
        assert_same(nv.load(other), network.run())
