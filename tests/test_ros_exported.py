"""What ``neurovis ros export`` writes, with real ROS: packages are launched, nodes and publishers built and run."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from ros_worlds import NAMES, NEWCOMER, Process, World, world
from rosbags.typesys import Stores, get_typestore

import neurovis_spec as nv
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.export import Form, save, texts
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.wire import ENCODINGS, array_of

pytestmark = pytest.mark.ros

ARRAY = "std_msgs/Float64MultiArray"
STEPS = 120
ARM = """
neurovis: 1
name: arm
seed: 3
time: {dt: 0.01, steps: 100}
parameters: {gain: {value: 0.5, min: 0, max: 2}, turn: 0.3}
inputs: {target: {expression: sin(3*t)}, torque: {size: 2}, alive: {}, own: {expression: 0.1*cos(t)}}
neurons:
  C: {count: 2, activation: tanh, bias: 0.01, noise: "normal(0, 0.01)"}
  A: {input: target, activation: identity}
  M: {count: 2, input: torque, activation: identity}
  B: {input: own, activation: tanh}
  L: {input: alive, activation: identity}
connections:
  C -> C: {matrix: [[1.4, turn], ["-turn", 1.4]]}
  C1 -> B: {weight: 0.3, plasticity: {oja: {rate: 0.05}}}
  A -> B: gain
outputs: {signal: B, motors: M, on: A}
events: [{at: 50, set: {turn: 0.2}}]
ros:
  rate: 100
  qos: {depth: 2000}
  subscribe:
    target: {topic: /target, type: std_msgs/Float64, timeout: 0.4}
    torque:
      {topic: joints, type: sensor_msgs/JointState, field: effort, names: [hip, knee], timeout: 0.4, on_timeout: hold}
    alive: {topic: /alive, timeout: 0.4, on_timeout: stop}
  publish:
    signal: {topic: /cmd_vel, type: geometry_msgs/TwistStamped, field: twist.linear.x, safe: -1}
    motors: {topic: ~/motors, type: std_msgs/Float64MultiArray, safe: 0}
    on: {topic: on, type: std_msgs/Bool, safe: 0}
"""
BASE = "/neurovis/arm"
ACTIVITY = {"topic": f"{BASE}/activity", "type": ARRAY, "fields": ["data", "layout.dim.0.label"]}
WEIGHTS = {"topic": f"{BASE}/weights", "type": ARRAY, "fields": ["data", "layout.dim.0.size"]}
SPEC = {"topic": f"{BASE}/spec", "type": "std_msgs/String", "fields": ["data"], "latched": True}
COMMANDS = {"topic": "/cmd_vel", "type": "geometry_msgs/TwistStamped", "fields": ["twist.linear.x", "twist.angular.z"]}
MOTORS = {"topic": f"{BASE}/motors", "type": ARRAY, "fields": ["data"]}
ON = {"topic": "/neurovis/on", "type": "std_msgs/Bool", "fields": ["data"]}


def compiled(published: bool = True) -> nv.CompiledNetwork:
    return nv.compile_text(ARM if published else re.sub(r"(?s)  subscribe:.*", "", ARM))


def exported(folder: Path, network: nv.CompiledNetwork, form: Form, ros: Ros = 1) -> Path:
    save(folder, texts(network, form, ros))
    return folder


def expected(network: nv.CompiledNetwork, steps: int = STEPS) -> Recording:
    """The run offline; inputs that no message came for are 0."""
    size = {entry.name: entry.size for entry in network.network.inputs}
    heard = {one.input: np.zeros((1, size[one.input])) for one in network.network.ros.subscribe}
    return network.run(steps, heard, backend="reference")


def check_bits(came: dict[str, list[list[list[float]]]], network: nv.CompiledNetwork) -> None:
    recording = expected(network)
    for topic, rows in (("activity", recording.activity), ("weights", recording.weights)):
        data = [one[0] for one in came[f"{BASE}/{topic}"]][:STEPS]
        assert [one[0] for one in data] == list(range(STEPS))
        np.testing.assert_array_equal([one[2:] for one in data], rows)
        assert abs(data[0][1] - time.time()) < 600
    assert {str(one[1]) for one in came[f"{BASE}/activity"]} == {f"neurovis/1:{network.network.hash}"}


def listening(ros: World) -> Process:
    until = {f"{BASE}/activity": STEPS, f"{BASE}/weights": STEPS}
    return ros.peer(listen=[ACTIVITY, WEIGHTS], until=until)


def launched(ros: World, packages: Path, *words: str, **environment: str) -> Process:
    """``roslaunch``, as somebody calls it who has sourced ROS 1: with the interpreter of the system."""
    command = ["/usr/bin/python3", "/usr/bin/roslaunch", "neurovis_arm", "network.launch", *words]
    return ros.started(command, ROS_IP="127.0.0.1", ROS_PACKAGE_PATH=str(packages), **environment)


# ---- packages ------------------------------------------------------------------------------------------------------


def test_a_package_of_ros_1_is_launched(tmp_path: Path) -> None:
    network = compiled(published=False)
    folder = exported(tmp_path / "neurovis_arm", network, "package", 1)
    settings = folder / "config" / "parameters.yaml"
    settings.write_text(settings.read_text().replace('"gain": 0.5', '"gain": 0.25'))
    file = folder / "launch" / "network.launch"
    more = f"--steps {STEPS + 50} --wait 60 --backend reference --rate"
    file.write_text(file.read_text().replace("--rate", more))
    with world("one") as ros:
        peer = listening(ros)
        launch = launched(ros, tmp_path, "rate:=200", PATH=f"{ros.bin}:{os.environ['PATH']}")
        launch.wait_for("ready: /neurovis/arm, ROS 1, 200 steps a second")
        assert peer.end() == 0
        launch.stop()
        quarter = nv.compile_text(network.text(), gain=0.25)
        came = peer.json()
        label = came[f"{BASE}/activity"][0][1]
        assert label == f"neurovis/1:{network.network.hash}"
        rows = [one[0][2:] for one in came[f"{BASE}/activity"]][:STEPS]
        np.testing.assert_array_equal(rows, expected(quarter).activity)


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
def test_a_package_of_ros_2_is_installed_and_run_as_its_launch_file_says(name: str, tmp_path: Path) -> None:
    network = compiled(published=False)
    folder = exported(tmp_path / "src", network, "package", 2)
    settings = folder / "config" / "parameters.yaml"
    settings.write_text(settings.read_text().replace('"gain": 0.5', '"gain": 0.25'))
    prefix = tmp_path / "install"
    with world(name) as ros:
        # as colcon installs a package of ament_python
        record = ("--single-version-externally-managed", "--record", tmp_path / "record")
        install: list[str | Path] = [sys.executable, "setup.py", "-q", "install", "--prefix", prefix, *record]
        subprocess.run(install, cwd=folder, check=True, capture_output=True, timeout=60)
        assert (prefix / "share" / "ament_index" / "resource_index" / "packages" / "neurovis_arm").is_file()
        share = prefix / "share" / "neurovis_arm"
        text = (share / "launch" / "network.launch.xml").read_text()
        text = text.replace("$(var rate)", "200").replace("$(find-pkg-share neurovis_arm)", str(share))
        assert "$(" not in text
        launch = ElementTree.fromstring(text)
        (node,) = launch.iter("node")
        assert set(node.attrib) == {"pkg", "exec", "output", "args"}
        assert [(arg.get("name"), arg.get("default")) for arg in launch.iter("arg")] == [("rate", "100.0")]
        (given,) = node.iter("param")
        assert set(given.attrib) == {"from"}
        program = prefix / "lib" / str(node.get("pkg")) / str(node.get("exec"))
        (library,) = prefix.glob("lib/python*/site-packages")
        peer = listening(ros)
        words = [*str(node.get("args")).split(), "--steps", str(STEPS), "--wait", "60", "--backend", "reference"]
        words += ["--ros-args", "--params-file", str(given.get("from"))]
        path = f"{ros.bin}:{os.environ['PATH']}"
        run = ros.started([program, *words], PATH=path, PYTHONPATH=str(library))
        assert run.end() == 0, run.err
        assert peer.end() == 0
        rows = [one[0][2:] for one in peer.json()[f"{BASE}/activity"]][:STEPS]
        np.testing.assert_array_equal(rows, expected(nv.compile_text(network.text(), gain=0.25)).activity)


@pytest.mark.parametrize("name", NAMES)
def test_a_node_takes_the_arguments_of_ros(name: str, tmp_path: Path) -> None:
    spec = tmp_path / "arm.yaml"
    spec.write_text(compiled(published=False).text())
    with world(name) as ros:
        given = ["_gain:=9.0", "_turn:=0.1", "/neurovis/arm/activity:=/seen", "__name:=other", "__ns:=/left"]
        if ros.ros == 2:
            given = ["--ros-args", "-p", "turn:=0.1", "-r", "/neurovis/arm/activity:=/seen", "-r", "__node:=other"]
            given += ["-r", "__ns:=/left"]
        peer = ros.peer(listen=[{**ACTIVITY, "topic": "/seen"}], until={"/seen": 20})
        peer.wait_for("ready")
        words = ["--steps", "20", "--wait", "6", "--backend", "reference"]
        run = ros.neurovis("ros", "run", spec, *words, *given)
        assert "/left/other" in run.wait_for("ready")
        assert run.end() == 0
        assert peer.end() == 0
        rows = [one[0][2:] for one in peer.json()["/seen"]]
        np.testing.assert_array_equal(rows, expected(nv.compile(spec, turn=0.1), 20).activity)
        if ros.ros == 1:
            assert any("the parameter 'gain' stays 0.5" in line for line in run.err)
        wrong = ros.neurovis("ros", "run", spec, *(["--ros-args"] if ros.ros == 1 else ["a:=b"]))
        assert wrong.end() == 1
        assert any("does not take" in line for line in wrong.err)


# ---- a node in C++ -------------------------------------------------------------------------------------------------


def built(folder: Path) -> Path:
    """Build a node as its README says for Debian."""
    if shutil.which("g++") is None or not Path("/usr/include/ros/ros.h").exists():
        pytest.fail("this test needs g++ and roscpp: apt-get install g++ pkg-config libroscpp-dev libsensor-msgs-dev")
    page = (folder / "README.md").read_text()
    commands = re.findall(r"^    ((?:gcc|g\+\+) .*)$", page, re.MULTILINE)
    assert len(commands) == 2
    for command in commands:
        strict = command.replace(" -O2 ", " -O1 -Wall -Wextra ")
        done = subprocess.run(strict, shell=True, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        assert "_node." not in done.stderr, done.stderr
    return folder / "arm_node"


@pytest.fixture(scope="module")
def node(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(exported(tmp_path_factory.mktemp("made") / "arm", compiled(), "cpp"))


def start(ros: World, node: Path, *words: str) -> Process:
    run = ros.started([node, *words], ROS_IP="127.0.0.1")
    run.wait_for("ready: /neurovis/arm, ROS 1")
    return run


def test_a_node_in_cpp_publishes_the_offline_run_bit_for_bit(one: World, node: Path) -> None:
    network = compiled()
    wanted = {f"{BASE}/activity": STEPS, f"{BASE}/weights": STEPS, f"{BASE}/spec": 1}
    peer = one.peer(listen=[ACTIVITY, WEIGHTS, SPEC, COMMANDS, MOTORS, ON], until=wanted)
    run = start(one, node, "--steps", str(STEPS), "--wait", "60")
    assert run.end() == 0
    assert re.fullmatch(rf"arm: \d+\.\d s, {STEPS} steps, \d+ late", run.out[0])
    assert peer.end() == 0
    came = peer.json()
    check_bits(came, network)
    assert nv.compile_text(came[f"{BASE}/spec"][0][0]).network.hash == network.network.hash


def test_inputs_become_outputs_of_a_node_in_cpp_and_its_end_is_safe(one: World, node: Path) -> None:
    run = start(one, node)
    name = {"name": ["knee", "elbow", "hip"]}
    nan = float("nan")
    joints = [{**name, "effort": [4.0, 9.0, 3.0]}] * 40
    joints += [{**name, "effort": [nan, 1.0, 2.0]}, {**name, "effort": [1.0]}, {"effort": [1.0, 2.0, 3.0]}] * 3
    joints += [{"name": ["hip", "ankle\33[2J"], "effort": [5.0, 6.0]}, {}] * 2
    sent = {"topic": "/neurovis/joints", "type": "sensor_msgs/JointState", "values": joints}
    target = {"topic": "/target", "type": "std_msgs/Float64", "values": {"data": 1.5}, "count": 50}
    peer = one.peer(listen=[COMMANDS, MOTORS, ON], send=[sent, target], seconds=3.0)
    peer.wait_for("ready")
    time.sleep(2.2)
    assert run.stop() == 0
    assert peer.end() == 0
    came = peer.json()
    motors = [tuple(one[0]) for one in came[f"{BASE}/motors"]]
    assert set(motors) == {(0.0, 0.0), (3.0, 4.0)}
    assert motors[-1] == (0.0, 0.0)
    assert came["/cmd_vel"][-1] == [-1.0, 0.0]
    assert 0.5 < max(one[0] for one in came["/cmd_vel"]) <= 1.0
    on = [one[0] for one in came["/neurovis/on"]]
    assert True in on
    assert on[-1] is False
    assert (
        "/neurovis/joints: 53 received, 3 not finite, 6 rejected for their length, 4 rejected for their names"
        in run.out
    )
    assert "/target: 50 received" in run.out
    told = [line for line in run.err if "there is no" in line]
    assert len(told) == 2, "each once"
    for missed, listed in (("knee", "'hip', 'ankle\\x1b[2J'"), ("hip", "none")):
        missing = f"the input 'torque': there is no '{missed}' in a message on /neurovis/joints; its names are {listed}"
        assert any("WARN" in line and missing in line for line in told), told


def test_parameters_of_a_node_in_cpp_are_set_within_their_bounds(one: World, node: Path) -> None:
    code = """
import sys, time, xmlrpc.client, os
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
key = "/neurovis/arm/parameters"
def until(name, value):
    end = time.monotonic() + 20
    while master.getParam("/x", f"{key}/{name}")[2] != value:
        assert time.monotonic() < end, master.getParam("/x", key)
        time.sleep(0.02)
until("gain", 1.5); until("turn", 0.2)
master.setParam("/x", f"{key}/gain", 9.0); until("gain", 1.5)
master.setParam("/x", f"{key}/gain", 2); until("gain", 2)
print("done")
"""
    settings = node.parent / "config" / "parameters.yaml"
    settings.write_text(settings.read_text().replace('"gain": 0.5', '"gain": 1.5'))
    run = launched(one, node.parent, "rate:=200")
    run.wait_for("ready: /neurovis/arm, ROS 1, 200 steps a second")
    asked = one.python(code)
    assert asked.end() == 0, asked.err
    run.wait_for("the parameter 'gain' cannot be 9")
    assert run.stop() == 0


def test_rosnode_kill_ends_a_node_in_cpp_safely(one: World, node: Path) -> None:
    run = start(one, node)
    peer = one.peer(listen=[COMMANDS], seconds=2.5)
    peer.wait_for("ready")
    time.sleep(0.8)
    alone = {**one.environment, "ROS_IP": "127.0.0.1"}
    killed = ["/usr/bin/python3", "/usr/bin/rosnode", "kill", "/neurovis/arm"]
    subprocess.run(killed, env=alone, check=True, capture_output=True, timeout=30)
    assert run.end() == 0
    assert peer.end() == 0
    assert peer.json()["/cmd_vel"][-1] == [-1.0, 0.0]


def test_an_input_of_a_node_in_cpp_falls_silent(one: World, node: Path) -> None:
    """``target`` is to fall to zero, ``torque`` to stay, and the run to end without ``alive``."""
    run = start(one, node)
    joints = {"topic": "/neurovis/joints", "type": "sensor_msgs/JointState", "count": 10}
    joints["values"] = {"name": ["hip", "knee"], "effort": [3.0, 4.0]}
    target = {"topic": "/target", "type": "std_msgs/Float64", "values": {"data": 1.5}, "count": 10}
    alive = {"topic": "/alive", "type": "std_msgs/Float64", "values": {"data": 1.0}, "count": 75}
    peer = one.peer(listen=[COMMANDS, MOTORS, ON], send=[joints, target, alive], seconds=3.0)
    assert run.end() == 1
    assert peer.end() == 0
    came = peer.json()
    on = [one[0] for one in came["/neurovis/on"]]
    motors = [tuple(one[0]) for one in came[f"{BASE}/motors"]]
    silent = len(on) - on[::-1].index(True)  # the first step with zero
    assert on[silent - 1 :] == [True, *[False] * (len(on) - silent)]
    assert len(on) - silent > 50
    assert set(motors[-len(on) + silent : -1]) == {(3.0, 4.0)}
    assert motors[-1] == (0.0, 0.0)
    assert came["/cmd_vel"][-1] == [-1.0, 0.0]
    silence = {"target": "/target", "torque": "/neurovis/joints", "alive": "/alive"}
    for name, topic in silence.items():
        told = f"the input '{name}' has fallen silent: no message on {topic} for 0.4 s"
        assert sum(told in line for line in run.err) == 1
    assert not any("heard again" in line for line in run.err)


def test_a_node_in_cpp_warns_of_an_input_that_falls_silent_and_is_heard_again(one: World, node: Path) -> None:
    run = start(one, node)
    target = {"topic": "/target", "type": "std_msgs/Float64", "values": {"data": 1.5}}
    assert one.peer(send=[{**target, "count": 2}], seconds=0.1).end() == 0
    assert "WARN" in run.wait_for("the input 'target' has fallen silent: no message on /target for 0.4 s")
    one.peer(send=[{**target, "count": 5000}])
    assert "WARN" in run.wait_for("the input 'target' is heard again")
    assert run.stop() == 0
    assert sum("the input" in line for line in run.err) == 2


def test_a_node_in_cpp_says_once_a_second_how_it_goes(one: World, node: Path) -> None:
    run = start(one, node, "--rate", "50", "/target:=/aim")
    wish = {"topic": "/diagnostics", "type": "diagnostic_msgs/DiagnosticArray", "raw": True}
    target = {"topic": "/aim", "type": "std_msgs/Float64", "values": {"data": 1.5}, "count": 5, "rate": 50}
    peer = one.peer(listen=[wish], send=[target], until={"/diagnostics": 3})
    assert peer.end() == 0
    assert run.stop() == 0
    store = get_typestore(Stores.ROS1_NOETIC)
    came: list[Any] = [
        store.deserialize_ros1(bytes.fromhex(one[0]), "diagnostic_msgs/msg/DiagnosticArray")
        for one in peer.json()["/diagnostics"]
    ]
    values = [{pair.key: pair.value for pair in one.status[0].values} for one in came]
    steps = [int(one["steps"]) for one in values]
    assert steps == sorted(set(steps))
    assert values[-1]["rate"] == "50"
    assert values[-1]["/aim: received"] == "5"
    last = came[-1]
    assert (last.status[0].name, last.status[0].hardware_id) == ("neurovis/arm: network", "arm")
    assert last.status[0].level == 1
    assert "no messages for target" in last.status[0].message
    assert abs(last.header.stamp.sec - time.time()) < 600


def test_a_node_in_cpp_ends_while_it_waits(one: World, node: Path) -> None:
    """For who listens, to all of it; and for a master."""
    run = start(one, node, "--wait", "1000")
    peer = one.peer(listen=[ACTIVITY, COMMANDS, MOTORS, ON], seconds=1.0)
    assert peer.end() == 0
    assert peer.json()[f"{BASE}/activity"] == []  # nobody listened to the weights
    assert run.stop() == 0
    for number in (signal.SIGINT, signal.SIGTERM):
        run = start(one, node, "--wait", "1000")
        run.signal(number)
        assert run.end() == 0
    one.stop_core()
    run = one.started([node], ROS_IP="127.0.0.1")
    run.wait_for("waiting for the master of ROS 1 at http://127.0.0.1:")
    run.signal(signal.SIGINT)
    assert run.end() == 1


def test_a_node_in_cpp_outlives_its_master(one: World, node: Path) -> None:
    run = start(one, node)
    newcomer = one.python(NEWCOMER.replace("SEEN", "4"))
    newcomer.wait_for("here")
    one.stop_core()
    time.sleep(1.5)
    one.start_core()
    assert newcomer.end() == 0, newcomer.err
    out, into = json.loads(newcomer.out[-1])
    assert out <= into <= 5
    asked = one.python("""
import rosgraph, time
end = time.monotonic() + 20
master = rosgraph.Master("/asker")
while not master.hasParam("/neurovis/arm/parameters/gain") and time.monotonic() < end:
    time.sleep(0.05)
master.setParam("/neurovis/arm/parameters/gain", 9.0)
while master.getParam("/neurovis/arm/parameters/gain") != 0.5 and time.monotonic() < end:
    time.sleep(0.05)
assert time.monotonic() < end
""")
    assert asked.end() == 0, asked.err
    assert run.stop() == 0
    assert ", 1 reconnects" in run.out[0]


# ---- publishers ----------------------------------------------------------------------------------------------------

CONTROLLER = """
import sys, time
sys.path.insert(0, sys.argv[1])
from arm_publisher import NETWORK, Publisher
shown = Publisher(NETWORK)
while not shown.heard:
    time.sleep(0.01)
for step in range(200):
    time.sleep(0.002)
    shown.publish([step + number for number in range(7)], [step / 10, 1, 2])
try:
    shown.publish([1.0])
except ValueError as error:
    print(error, flush=True)
time.sleep(1)
"""
CONTROLLER_CPP = """
#include "arm_publisher.hpp"
#include <iostream>
int main(int argc, char **argv) {
  ros::init(argc, argv, "controller");
  ros::NodeHandle node;
  neurovis::Publisher shown(node, neurovis::arm_network());
  while (!shown.heard()) ros::Duration(0.01).sleep();
  std::vector<double> activity(7), weights(3);
  for (int step = 0; step < 200; ++step) {
    ros::Duration(0.002).sleep();
    for (int number = 0; number < 7; ++number) activity[number] = step + number;
    weights[0] = step / 10.0, weights[1] = 1, weights[2] = 2;
    shown.publish(activity, weights);
  }
  try {
    shown.publish(std::vector<double>(1));
  } catch (const std::invalid_argument &error) {
    std::cout << error.what() << std::endl;
  }
  ros::Duration(1).sleep();
}
"""


def check_shown(ros: World, view: Process, controller: Process, recording: Path) -> None:
    """What ``neurovis ros view`` has seen and recorded of a controller."""
    assert controller.end() == 0, controller.err
    assert controller.out[-1] == "arm has 7 activities, not 1"
    assert view.stop() == 0
    counts = view.json()["topics"]
    for topic in ("activity", "weights"):
        assert counts[topic]["recorded"] == counts[topic]["received"] == 200, view.err
        assert counts[topic]["lost"] == counts[topic]["unlabelled"] == 0
    assert view.json()["hash"] == compiled().network.hash
    messages = {topic: list[list[float]]() for topic in ("activity", "weights")}
    bag = read_bag(recording)
    for one in bag.messages():
        topic = one.topic.name.rpartition("/")[2]
        if topic in messages:
            messages[topic].append(array_of(one.data, ENCODINGS[ros.ros]).data.tolist())
    for topic, size in (("activity", 7), ("weights", 3)):
        assert [one[0] for one in messages[topic]] == list(range(200))
        assert all(0 < one[1] - messages[topic][0][1] < 60 for one in messages[topic][1:])
        assert {len(one) for one in messages[topic]} == {size + 2}
    assert [one[2:] for one in messages["activity"]] == [[k + i for i in range(7)] for k in range(200)]
    assert [one[2:] for one in messages["weights"]] == [[k / 10, 1, 2] for k in range(200)]


@pytest.mark.parametrize("name", NAMES)
def test_a_controller_in_python_shows_itself(name: str, tmp_path: Path) -> None:
    exported(tmp_path / "given", compiled(), "publisher")
    recording = tmp_path / "seen.mcap"
    with world(name) as ros:
        controller = ros.python(CONTROLLER, str(tmp_path / "given"))
        view = ros.neurovis("ros", "view", "--record", recording, "--format", "json")
        view.wait_for("ready")
        check_shown(ros, view, controller, recording)


def test_a_controller_in_cpp_shows_itself(one: World, tmp_path: Path) -> None:
    folder = exported(tmp_path / "given", compiled(), "publisher")
    (folder / "controller.cpp").write_text(CONTROLLER_CPP)
    build = "g++ -std=c++17 -Wall -Wextra controller.cpp -o controller $(pkg-config --cflags --libs roscpp)"
    subprocess.run(build, shell=True, cwd=folder, check=True, timeout=300)
    recording = tmp_path / "seen.mcap"
    controller = one.started([folder / "controller"], ROS_IP="127.0.0.1")
    view = one.neurovis("ros", "view", "--record", recording, "--format", "json")
    view.wait_for("ready")
    check_shown(one, view, controller, recording)
