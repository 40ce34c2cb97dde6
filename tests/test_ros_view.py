"""``neurovis ros view``, ``play`` and ``legacy`` with real ROS: nothing is lost, whatever becomes of the others."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from ros_worlds import BIG, BIG_ACTIVITY, NAMES, PATIENCE, World, in_each, world

import neurovis_spec as nv
from neurovis_spec.ros.accept import ARRAY
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.convert import Converter
from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.files import Files
from neurovis_spec.ros.logs import Stored, topic_of
from neurovis_spec.runtime.wire import ArrayForm, label_of, text_message

pytestmark = pytest.mark.ros

NETWORK = nv.compile_text(BIG).network
FORM = ArrayForm.of(label_of(NETWORK.hash), 150, "cdr")
START = 1_700_000_000_000_000_000


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "big.yaml"
    path.write_text(BIG)
    return path


def step(number: float) -> bytes:
    return FORM.message(number, number / 1000, np.full(150, float(number)))


def recording(path: Path, messages: Sequence[bytes], rate: int = 1000) -> Path:
    """A recording of ROS 2 of these messages, with their spec."""
    spec, text = topic_of("/neurovis/big/spec", "std_msgs/String", "string data\n", 2), text_message(BIG, "cdr")
    activity = topic_of(BIG_ACTIVITY, ARRAY, str(definition(ARRAY, 2)), 2)
    files = Files(path, 2, {"network": "big", "hash": NETWORK.hash}, [(spec, text)])
    for number, data in enumerate(messages):
        time_ = START + number * 10**9 // rate
        files.write([Stored(activity, number, time_, time_, data)])
    files.close()
    return path


def arrays_in(path: Path) -> list[bytes]:
    """The activities in a recording, as ROS 2 has them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bag = read_bag(path)
    found = [one.data for one in bag.messages() if one.topic.name == BIG_ACTIVITY]
    if bag.ros == 2:
        return found
    converter = Converter(ARRAY, str(definition(ARRAY, 1)), "ros1")
    return [converter.convert(data) for data in found]


def grown(path: Path, size: int) -> None:
    """Wait until a recording has so many bytes."""
    deadline = time.monotonic() + PATIENCE
    while True:
        files = [one for one in (path, *path.glob("*")) if one.is_file()]
        if sum(one.stat().st_size for one in files) >= size:
            return
        assert time.monotonic() < deadline, files
        time.sleep(0.05)


def name_of(ros: World) -> str:
    return "x.bag" if ros.ros == 1 else "x"


def test_a_kilohertz_of_150_neurons_is_recorded_whole_beside_a_page(ros: World, spec: Path, tmp_path: Path) -> None:
    """Play equals live: what is played is what is recorded, byte for byte, also from one ROS to the other."""
    messages = [step(number) for number in range(8000)]
    file, out = recording(tmp_path / "played.mcap", messages), tmp_path / name_of(ros)
    view = ros.neurovis("ros", "view", spec, "--record", out, "--live", "0", "--format", "json")
    view.wait_for("ready")
    play = ros.neurovis("ros", "play", file, "--wait", "20", "--format", "json")
    assert play.end() == 0
    assert play.json()["topics"][BIG_ACTIVITY]["received"] == 8000
    time.sleep(1)
    assert view.stop() == 0
    counts = view.json()["topics"]["activity"]
    assert (counts["received"], counts["recorded"], counts["lost"]) == (8000, 8000, 0)
    assert arrays_in(out) == messages


def test_the_network_that_announces_itself_is_viewed(tmp_path: Path) -> None:
    file = recording(tmp_path / "played.mcap", [step(number) for number in range(20)], rate=10)

    def check(ros: World, folder: Path) -> None:
        play = ros.neurovis("ros", "play", file, "--loop")
        view = ros.neurovis("ros", "view", "--record", folder / "x.mcap", "--format", "json")
        view.wait_for("ready: big")
        time.sleep(1.5)
        assert view.stop() == 0
        found = view.json()
        assert (found["network"], found["hash"]) == ("big", NETWORK.hash)
        assert found["topics"]["activity"]["recorded"] > 5
        assert found["topics"]["activity"]["lost"] == 0  # beginning anew is no loss
        assert play.stop() == 0
        (first, *_) = read_bag(folder / "x.mcap").messages()
        assert first.topic.name == "/neurovis/big/spec"

    in_each(tmp_path, check)


def test_hostile_messages_are_counted_and_survived(ros: World, spec: Path, tmp_path: Path) -> None:
    good = [step(number) for number in range(100)]
    other = ArrayForm.of("neurovis/1:other", 150, "cdr").message(0, 0, np.zeros(150))
    short = ArrayForm.of(label_of(NETWORK.hash), 149, "cdr").message(0, 0, np.zeros(149))
    bare = ArrayForm.of("", 150, "cdr").message(float("nan"), -1, np.full(150, float("nan")))
    odd = bytearray(good[0])
    odd[good[0].index(b"\x02\0\0\0\x98\0\0\0")] = 7  # data_offset
    messages = [data for one in good for data in (one, other, short, bare, bytes(odd))] * 10
    file, out = recording(tmp_path / "played.mcap", messages, rate=2000), tmp_path / "x.mcap"
    view = ros.neurovis("ros", "view", spec, "--record", out, "--format", "json")
    view.wait_for("ready")
    assert ros.neurovis("ros", "play", file, "--wait", "20").end() == 0
    time.sleep(1)
    assert view.stop() == 0
    counts = view.json()["topics"]["activity"]
    assert counts["received"] == 5000
    assert counts["rejected"] == {"type": 0, "parse": 1000, "hash": 1000, "length": 1000, "names": 0, "publisher": 0}
    assert (counts["recorded"], counts["unlabelled"], counts["not_finite"]) == (2000, 1000, 1000)
    assert len(arrays_in(out)) == 2000


def test_messages_of_another_type_and_quality_of_ros_2_are_told(spec: Path) -> None:
    """ROS 2 delivers nothing of these, so that nothing can be counted."""
    words = {"type": "std_msgs/String", "values": {"data": "x"}, "count": 1000, "rate": 20}
    with world("kilted") as ros:
        view = ros.neurovis("ros", "view", spec, "--live", "0")
        view.wait_for("ready")
        announced = ros.neurovis("ros", "view", "--live", "0")
        announced.wait_for("waiting")
        activity = {"topic": "/neurovis/other/activity", "type": ARRAY, "values": {}, "count": 1}
        ros.peer(send=[{"topic": BIG_ACTIVITY, **words}, {"topic": "/neurovis/other/spec", **words}, activity], wait=1)
        assert view.wait_for("a publisher sends").startswith(
            f"{BIG_ACTIVITY}: a publisher sends std_msgs/String, not {ARRAY}"
        )
        line = announced.wait_for("another quality of service")
        assert line.startswith("/neurovis/other/spec: a publisher offers")
        assert "DURABILITY" in line
        assert view.stop() == 0
        assert announced.stop() == 1


def test_messages_of_another_type_of_ros_1_are_counted(spec: Path) -> None:
    with world("one") as ros:
        view = ros.neurovis("ros", "view", spec, "--live", "0", "--format", "json")
        view.wait_for("ready")
        sender = {"topic": BIG_ACTIVITY, "type": "std_msgs/String", "values": {"data": "x"}, "count": 20}
        assert ros.peer(send=[sender], seconds=1).end() == 0
        view.wait_for("of another type")
        assert view.stop() == 0
        counts = view.json()["topics"]["activity"]
        assert (counts["received"], counts["rejected"]["type"]) == (20, 20)


def test_of_several_networks_the_one_that_is_named_is_viewed(spec: Path, tmp_path: Path) -> None:
    """With a master: without one a node may hear of another after seconds only."""
    other = tmp_path / "small.yaml"
    other.write_text("neurovis: 1\nname: small\nneurons: {A: {}}\n")
    with world("one") as ros:
        for path in (spec, other):
            ros.neurovis("ros", "run", path, "--rate", "20").wait_for("ready")
        view = ros.neurovis("ros", "view", "--live", "0")
        assert view.end() == 1
        assert view.err[-2:] == [
            "error: several networks announce themselves: big, small",
            "help: say which with --network NAME",
        ]
        view = ros.neurovis("ros", "view", "--network", "small", "--live", "0", "--format", "json")
        view.wait_for("ready: small")
        assert view.stop() == 0
        assert view.json()["network"] == "small"


def test_publishers_of_one_network_are_told_apart(spec: Path, tmp_path: Path) -> None:
    """One that begins anew with a higher number has lost nothing; of two at once the second one is left out."""
    first, second = ([step(number) for number in range(begin, begin + 100)] for begin in (0, 5000))
    files = [recording(tmp_path / f"{k}.mcap", one, rate=200) for k, one in enumerate((first, second))]

    def check(ros: World, folder: Path) -> None:
        play = ros.neurovis("ros", "play", files[0], "--wait", "60")
        view = ros.neurovis("ros", "view", spec, "--record", folder / "x.mcap", "--format", "json")
        assert play.end() == 0
        steady = ros.neurovis("ros", "play", files[1], "--wait", "20", "--loop")
        view.wait_for(f"{BIG_ACTIVITY}: another publisher goes on")
        assert ros.neurovis("ros", "play", files[0], "--wait", "20").end() == 0
        view.wait_for("sends at the same time: its messages are left out")
        time.sleep(0.5)
        assert view.stop() == 0
        assert steady.stop() == 0
        counts = view.json()["topics"]["activity"]
        assert (counts["lost"], counts["rejected"]["publisher"]) == (0, 100), "\n".join(view.err)
        assert counts["received"] == counts["recorded"] + 100

    in_each(tmp_path, check)
    for name in NAMES:
        found = arrays_in(tmp_path / name / "x.mcap")
        assert found[:200] == first + second
        assert set(found[200:]) == set(second)


def test_kill_9_of_the_recorder_and_of_the_publisher(ros: World, spec: Path, tmp_path: Path) -> None:
    messages = [step(number) for number in range(20_000)]
    file, out = recording(tmp_path / "played.mcap", messages), tmp_path / name_of(ros)
    first = ros.neurovis("ros", "view", spec, "--record", out)
    pieces = tmp_path / "y.mcap"
    second = ros.neurovis("ros", "view", spec, "--record", pieces, "--rotate", "500kB", "--format", "json")
    first.wait_for("ready")
    second.wait_for("ready")
    play = ros.neurovis("ros", "play", file, "--wait", "20")
    play.wait_for("ready")
    grown(out, 1 << 20)
    first.kill()
    found = arrays_in(out)
    assert len(found) > 100
    start = messages.index(found[0])
    assert found == messages[start : start + len(found)]
    play.kill()
    again = ros.neurovis("ros", "play", file, "--wait", "20", "--seconds", "1")
    assert again.end() == 0
    time.sleep(1)
    assert second.stop() == 0
    counts = second.json()["topics"]["activity"]
    assert counts["lost"] == 0
    assert counts["received"] == counts["recorded"] > len(found)
    files = second.json()["files"]
    assert files[:3] == [str(tmp_path / name) for name in ("y.mcap", "y-1.mcap", "y-2.mcap")]
    assert counts["recorded"] == len(arrays_in(pieces))  # and what comes next


def test_the_master_of_ros_1_may_begin_anew(spec: Path, tmp_path: Path) -> None:
    file = recording(tmp_path / "played.mcap", [step(number) for number in range(1000)])
    with world("one") as ros:
        view = ros.neurovis("ros", "view", spec, "--record", tmp_path / "x.bag", "--format", "json")
        view.wait_for("ready")
        assert ros.neurovis("ros", "play", file, "--wait", "20").end() == 0
        ros.stop_core()
        view.wait_for("away")
        ros.start_core()
        view.wait_for("is back")
        assert ros.neurovis("ros", "play", file, "--wait", "20").end() == 0
        time.sleep(1)
        assert view.stop() == 0
        found = view.json()
        assert found["reconnects"] == 1
        assert found["topics"]["activity"]["recorded"] == 2000
        assert found["topics"]["activity"]["lost"] == 0


def test_a_run_records_what_it_publishes_and_its_inputs(tmp_path: Path) -> None:
    spec = tmp_path / "run.yaml"
    spec.write_text(
        "neurovis: 1\nname: run\ntime: {dt: 0.01}\ninputs: {target: {}}\nneurons: {A: {input: target}, B: {initial: 1}}"
        "\nconnections: {B -> A: 0.5, A -> B: {weight: -0.5, plasticity: {oja: {rate: 0.01}}}}\n"
        "ros: {subscribe: {target: {topic: /target}}}\n"
    )

    def check(ros: World, folder: Path) -> None:
        out = folder / "x.mcap"
        run = ros.neurovis("ros", "run", spec, "--record", out, "--format", "json")
        run.wait_for("ready")
        send = [{"topic": "/target", "type": "std_msgs/Float64", "values": {"data": 2.5}, "count": 20, "rate": 20}]
        ros.peer(send=send, seconds=2).end()
        time.sleep(1)
        assert run.stop() == 0
        counts = run.json()["topics"]
        steps = counts["activity"]["recorded"]
        assert steps == counts["weights"]["recorded"] == run.json()["steps"] > 100
        assert counts["/target"]["recorded"] == 20
        names = [one.topic.name for one in read_bag(out).messages()]
        assert names[0] == "/neurovis/run/spec"
        assert (names.count("/neurovis/run/activity"), names.count("/target")) == (steps, 20)

    in_each(tmp_path, check)


@pytest.mark.parametrize("name", ["kilted", "one"])
def test_a_hostile_controller_of_the_first_neurovis_is_survived(name: str, tmp_path: Path) -> None:
    texts = {
        "neuronPos": ["A-B_C_0_0_1/nothing", "A_B_1_2/A_B_x_y", "A_B-C_1_2_3/_-_", "////", "é_1_1"],
        "connectionsLayers": ["A-B", "A-B-C/A_B-A-B", "--", "-", "A_B-C-A-B_C"],
        "connections": ["nan,inf,1", "1,2,3,4", "x", "1e400 0 0 0 0 0 0 0 0", ""],
        "activity": ["1;2;3", "nan,inf,-inf", "1", "eins,zwei,drei", "0x10,0,0"],
        "weightsAll": ["1/2", ",,,", "", "1,1,1,1,1,1,1,1,1", "\t"],
    }
    names = {"values": {"data": "A_B/A-B_C/A_B-C/"}, "count": 100, "rate": 50, "topic": "/neurovis/neuronName"}
    send = [{"type": "std_msgs/String", **names}] + [
        {"topic": f"/neurovis/{kind}", "type": "std_msgs/String", "values": [{"data": one} for one in every],
         "count": 1000, "rate": 500}
        for kind, every in texts.items()
    ]  # fmt: skip
    spec = tmp_path / "old.yaml"
    with world(name) as ros:
        legacy = ros.neurovis("ros", "legacy", "-o", spec, "--format", "json")
        legacy.wait_for("ready")
        assert ros.peer(send=send, seconds=4).end() == 0
        time.sleep(1)
        assert legacy.stop() == 0
        counts = legacy.json()["topics"]
    assert nv.compile(spec).network.neurons.labels == ("A_B", "A-B_C", "A_B-C")
    assert sum(counts[kind]["received"] for kind in texts) > 1000
    for kind in texts.keys() - {"connectionsLayers"}:  # what "connections" says stands in its place
        rejected = counts[kind]["rejected"]
        assert rejected["parse"] + rejected["length"] > 0
        assert rejected["type"] == rejected["hash"] == 0


def test_a_controller_of_the_first_neurovis_is_recorded_and_described(tmp_path: Path) -> None:
    texts = {"neuronName": "A_1/B-2/", "neuronPos": "A_1_1_0_0/B-2_2_1_0/", "connections": "0,0.5,0.25,0"}
    send = [
        {"topic": f"/neurovis/{kind}", "type": "std_msgs/String", "values": {"data": text}, "count": 100, "rate": 10}
        for kind, text in texts.items()
    ]
    activity = [{"data": [float(number), -1.0]} for number in range(100)]
    type_ = "std_msgs/Float32MultiArray"
    send.append({"topic": "/neurovis/activity", "type": type_, "values": activity, "count": 100, "rate": 10})

    def check(ros: World, folder: Path) -> None:
        out, spec = folder / "x.mcap", folder / "old.yaml"
        legacy = ros.neurovis("ros", "legacy", "-o", spec, "--record", out, "--network", "old", "--format", "json")
        legacy.wait_for("ready")
        ros.peer(send=send)
        legacy.wait_for("2 neurons, 2 connections")
        time.sleep(2)
        assert legacy.stop() == 0
        network = nv.compile(spec).network
        assert (network.name, network.neurons.labels) == ("old", ("A_1", "B-2"))
        assert network.connections.weights.tolist() == [0.5, 0.25]
        counts = legacy.json()["topics"]["activity"]
        names = [one.topic.name for one in read_bag(out).messages()]
        assert counts["recorded"] == names.count("/neurovis/old/activity") > 5
        assert counts["received"] == counts["recorded"], "what came before the network was known, too"
        assert read_bag(out).about["hash"] == network.hash == legacy.json()["hash"]

    in_each(tmp_path, check)
