"""``neurovis ros run`` with real ROS: what it computes, what it listens to and sends, and how it ends."""

from __future__ import annotations

import asyncio
import json
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import numpy as np
import pytest
from mcap.reader import make_reader
from ros_worlds import NEWCOMER, PATIENCE, World, world

import neurovis_spec

pytestmark = pytest.mark.ros

ARRAY = "std_msgs/Float64MultiArray"
ARM = """
neurovis: 1
name: arm
time: {dt: 0.01, steps: 100}
parameters:
  gain: {value: 0.5, min: 0, max: 2, description: How strongly it follows.}
  count: 2
inputs: {target: {}, torque: {size: 2}}
neurons:
  A: {input: target, activation: identity}
  M: {count: count, input: torque, activation: identity}
  B: {activation: identity}
connections: {A -> B: gain}
outputs: {signal: B, motors: M}
ros:
  rate: 100
  qos: {depth: 2000}
  subscribe:
    target: {topic: /target, type: std_msgs/Float64, timeout: 0.4, on_timeout: ON_TIMEOUT}
    torque: {topic: joints, type: sensor_msgs/JointState, field: effort, names: [hip, knee], timeout: 0.4}
  publish:
    signal: {topic: /cmd_vel, type: geometry_msgs/Twist, field: linear.x, safe: -1}
    motors: {topic: ~/motors, type: std_msgs/Float64MultiArray, safe: 0}
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    return written(tmp_path)


def written(folder: Path, on_timeout: str = "zero") -> Path:
    path = folder / "arm.yaml"
    path.write_text(ARM.replace("ON_TIMEOUT", on_timeout))
    return path


def targets(value: float, count: int, **more: object) -> dict[str, object]:
    return {"topic": "/target", "type": "std_msgs/Float64", "values": {"data": value}, "count": count, **more}


COMMANDS = {"topic": "/cmd_vel", "type": "geometry_msgs/Twist", "fields": ["linear.x", "angular.z"]}
MOTORS = {"topic": "/neurovis/arm/motors", "type": ARRAY, "fields": ["data"]}


def test_what_is_published_is_the_offline_run_bit_for_bit(ros: World, tmp_path: Path) -> None:
    text = (Path(__file__).parent.parent / "specs" / "hebbian.yaml").read_text()
    spec = tmp_path / "spec.yaml"
    spec.write_text(f"{text}\nros: {{rate: 100, qos: {{depth: 2000}}}}\n")
    network = neurovis_spec.compile(spec)
    base = f"/neurovis/{network.name}"
    arrays = [
        {"topic": f"{base}/{kind}", "type": ARRAY, "fields": ["data", "layout.dim.0.label", "layout.dim.0.size"]}
        for kind in ("activity", "weights")
    ]
    steps = 150
    peer = ros.peer(listen=arrays, until={f"{base}/activity": steps, f"{base}/weights": steps})
    run = ros.neurovis(
        *("ros", "run", spec, "--steps", str(steps), "--wait", "30", "--backend", "reference", "--format", "json")
    )
    assert run.wait_for("ready").startswith("ready")
    assert run.end() == 0
    assert peer.end() == 0
    summary = run.json()
    assert summary["steps"] == steps
    assert summary["hash"] == network.hash
    recording = network.run(steps, backend="reference")
    for topic, rows in ((f"{base}/activity", recording.activity), (f"{base}/weights", recording.weights)):
        came = peer.json()[topic]
        assert [one[0][0] for one in came] == list(range(steps))
        np.testing.assert_array_equal([one[0][2:] for one in came], rows)
        assert {(one[1], one[2]) for one in came} == {(f"neurovis/1:{network.hash}", rows.shape[1])}
        stamps = [one[0][1] for one in came]
        assert abs(stamps[0] - time.time()) < 600
        assert stamps == sorted(stamps)


def test_activities_come_by_name_where_there_are_messages_for_that(ros: World, arm: Path) -> None:
    known = ros.python("import importlib.util as u; print(u.find_spec('diagnostic_msgs') is not None)")
    assert known.end() == 0
    fields = ["status.0.name", *(f"status.0.values.{n}.{part}" for n in range(4) for part in ("key", "value"))]
    named = {"topic": "/neurovis/arm/values", "type": "diagnostic_msgs/DiagnosticArray", "fields": fields}
    is_known = known.out == ["True"]
    run = ros.neurovis("ros", "run", arm)
    run.wait_for("ready")
    listen = [MOTORS, *([named] if is_known else [])]
    awaited = {str(one["topic"]): 100 for one in listen}
    peer = ros.peer(listen=listen, send=[targets(1.5, 200)], until=awaited)
    assert peer.end() == 0
    assert run.stop() == 0
    if is_known:  # else the run goes on without
        came = peer.json()["/neurovis/arm/values"]
        assert ["arm", "A", "1.5", "M1", "0", "M2", "0", "B", "0.75"] in came


def test_inputs_become_outputs_and_the_end_is_safe(ros: World, arm: Path) -> None:
    run = ros.neurovis("ros", "run", arm, "--format", "json")
    run.wait_for("ready")
    joints = {"name": ["knee", "elbow", "hip"], "effort": [4.0, 9.0, 3.0]}
    sent = {"topic": "/neurovis/joints", "type": "sensor_msgs/JointState", "values": joints, "count": 60}
    peer = ros.peer(listen=[COMMANDS, MOTORS], send=[targets(1.5, 60), sent], seconds=2.5)
    peer.wait_for("ready")
    time.sleep(1.5)
    assert run.stop() == 0
    assert peer.end() == 0
    came = peer.json()
    signals = [one[0] for one in came["/cmd_vel"]]
    assert {one[1] for one in came["/cmd_vel"]} == {0.0}
    assert set(signals) == {0.0, 0.75, -1.0}
    assert signals[-1] == -1.0
    motors = [tuple(one[0]) for one in came["/neurovis/arm/motors"]]
    assert (3.0, 4.0) in motors
    assert motors[-1] == (0.0, 0.0)
    summary = run.json()["topics"]
    assert summary["/target"]["received"] == 60
    assert summary["/neurovis/joints"]["received"] == 60


def test_messages_that_cannot_be_used_are_counted_and_survived(ros: World, arm: Path) -> None:
    run = ros.neurovis("ros", "run", arm, "--format", "json")
    run.wait_for("ready")
    name = {"name": ["knee", "hip"]}
    odd = [
        {**name, "effort": [1.0]},
        {**name, "effort": [float("nan"), 1.0]},
        {"name": ["ankle", "hip"], "effort": [1.0, 2.0]},
        {"effort": [1.0, 2.0]},
        {**name, "effort": [float("inf"), 1.0]},
    ]
    good = {**name, "effort": [2.0, 1.0]}
    sent = {"topic": "/neurovis/joints", "type": "sensor_msgs/JointState", "values": [*odd, good, *odd], "rate": 100}
    peer = ros.peer(listen=[MOTORS], send=[sent, targets(float("nan"), 5)], seconds=1.0)
    assert peer.end() == 0
    assert run.stop() == 0
    motors = {tuple(one[0]) for one in peer.json()["/neurovis/arm/motors"]}
    assert motors <= {(0.0, 0.0), (1.0, 2.0)}
    assert (1.0, 2.0) in motors
    topics = run.json()["topics"]
    assert topics["/neurovis/joints"]["received"] == 11
    rejected = topics["/neurovis/joints"]["rejected"]
    assert (rejected["length"], rejected["names"]) == (4, 2)
    assert topics["/neurovis/joints"]["not_finite"] == 4
    assert topics["/target"]["not_finite"] == 5
    assert any("of another length on /neurovis/joints" in line for line in run.err)
    told = "the input 'torque': there is no 'knee' in a message on /neurovis/joints; its names are 'ankle', 'hip'"
    assert told in run.err


@pytest.mark.parametrize(("on_timeout", "after"), [("hold", 0.75), ("zero", 0.0)])
def test_an_input_that_falls_silent(ros: World, tmp_path: Path, on_timeout: str, after: float) -> None:
    run = ros.neurovis("ros", "run", written(tmp_path, on_timeout), "--format", "json")
    run.wait_for("ready")
    peer = ros.peer(listen=[COMMANDS], send=[targets(1.5, 10)], seconds=1.5)
    assert peer.end() == 0
    assert run.stop() == 0
    signals = [one[0] for one in peer.json()["/cmd_vel"]]
    assert 0.75 in signals
    assert signals[-1] == after


def test_a_run_stops_safely_when_an_input_falls_silent(ros: World, tmp_path: Path) -> None:
    run = ros.neurovis("ros", "run", written(tmp_path, "stop"), "--format", "json")
    run.wait_for("ready")
    peer = ros.peer(listen=[COMMANDS], send=[targets(1.5, 10)], seconds=2.0)
    assert run.end() == 1
    assert peer.end() == 0
    signals = [one[0] for one in peer.json()["/cmd_vel"]]
    assert 0.75 in signals
    assert signals[-1] == -1.0
    assert any("the input 'target' has fallen silent" in line for line in run.err)
    assert run.json()["steps"] > 0


def test_sigterm_ends_it_and_so_do_seconds(ros: World, arm: Path) -> None:
    run = ros.neurovis("ros", "run", arm, "--format", "json", "--seconds", "1")
    assert run.end() == 0
    assert run.json()["seconds"] >= 1
    run = ros.neurovis("ros", "run", arm)
    run.wait_for("ready")
    run.signal(signal.SIGTERM)
    assert run.end() == 0
    assert run.out[0].startswith("arm: ")


SHUTDOWN = """
import contextlib, rosgraph, xmlrpc.client
uri = rosgraph.Master("/killer").lookupNode("/neurovis/arm")
with contextlib.suppress(OSError):  # it may be gone before it answers
    xmlrpc.client.ServerProxy(uri).shutdown("/killer", "enough")
"""


def test_a_node_that_others_shut_down_is_safe_before(arm: Path) -> None:
    with world("one") as ros:
        run = ros.neurovis("ros", "run", arm, "--format", "json")
        run.wait_for("ready")
        peer = ros.peer(listen=[COMMANDS], send=[targets(1.5, 200)], seconds=3)
        peer.wait_for("ready")
        time.sleep(1)
        assert ros.python(SHUTDOWN).end() == 0
        assert run.end() == 0
        assert len(run.out) == 1
        assert run.json()["steps"] > 0
        assert peer.end() == 0
        signals = [one[0] for one in peer.json()["/cmd_vel"]]
        assert 0.75 in signals
        assert signals[-1] == -1.0


def test_the_spec_waits_for_who_comes_late(ros: World, arm: Path) -> None:
    run = ros.neurovis("ros", "run", arm)
    run.wait_for("ready")
    time.sleep(0.5)
    spec = {"topic": "/neurovis/arm/spec", "type": "std_msgs/String", "fields": ["data"], "latched": True}
    peer = ros.peer(listen=[spec], until={"/neurovis/arm/spec": 1})
    assert peer.end() == 0
    assert run.stop() == 0
    ((text,),) = peer.json()["/neurovis/arm/spec"]
    assert neurovis_spec.compile_text(text).hash == neurovis_spec.compile(arm).hash


def test_steps_that_are_late_are_counted_and_made(ros: World, arm: Path) -> None:
    run = ros.neurovis("ros", "run", arm, "--rate", "1e6", "--steps", "400", "--format", "json")
    assert run.end() == 0
    assert run.json()["steps"] == 400
    assert run.json()["late"] > 300


@pytest.mark.parametrize("asked", ["here", "by ROS"])
def test_time_can_be_simulated(ros: World, arm: Path, asked: str) -> None:
    words = ["--sim-time"]
    if asked == "by ROS":
        words = ["--ros-args", "-p", "use_sim_time:=true"] if ros.ros == 2 else []
        if ros.ros == 1:
            told = ros.python('import rosgraph; rosgraph.Master("/simulator").setParam("/use_sim_time", True)')
            assert told.end() == 0
    run = ros.neurovis("ros", "run", arm, "--steps", "30", "--format", "json", *words)
    run.wait_for("ready")
    time.sleep(0.5)
    assert run.running
    if ros.ros == 2:
        ticks = [{"clock.sec": 100 + n // 10, "clock.nanosec": n % 10 * 100_000_000} for n in range(10)]
    else:
        ticks = [{"clock.secs": 100 + n // 10, "clock.nsecs": n % 10 * 100_000_000} for n in range(10)]
    clock = {"topic": "/clock", "type": "rosgraph_msgs/Clock", "values": ticks, "rate": 10}
    activity = {"topic": "/neurovis/arm/activity", "type": ARRAY, "fields": ["data"]}
    peer = ros.peer(send=[clock], listen=[activity], seconds=1.5)
    assert run.end() == 0
    assert peer.end() == 0
    stamps = [one[0][1] for one in peer.json()["/neurovis/arm/activity"]]
    assert len(stamps) > 10
    assert all(100 <= stamp < 101 for stamp in stamps)
    assert run.json()["steps"] == 30


def test_diagnostics_are_sent_where_there_is_a_package_for_them(arm: Path) -> None:
    with world("kilted") as ros:
        run = ros.neurovis("ros", "run", arm)
        fields = ["status.0.name", "status.0.message", "status.0.hardware_id", "header.stamp.sec"]
        told = ("rate", "seconds", "steps", "late", "reconnects", "shown", "skipped")
        fields += [f"status.0.values.{number}.key" for number in range(len(told))]
        wish = {"topic": "/diagnostics", "type": "diagnostic_msgs/DiagnosticArray", "fields": fields}
        peer = ros.peer(listen=[wish], until={"/diagnostics": 2})
        assert peer.end() == 0
        assert run.stop() == 0
        for name, message, about, stamp, *keys in peer.json()["/diagnostics"]:
            assert tuple(keys) == told
            assert name == "neurovis/arm: network"
            assert message
            assert about == "arm"
            assert abs(stamp - time.time()) < 600


def test_nothing_is_said_of_diagnostics_where_there_is_none(arm: Path) -> None:
    with world("one") as ros:
        run = ros.neurovis("ros", "run", arm, "--seconds", "1.5")
        assert run.end() == 0
        assert len(run.err) == 1


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
def test_another_quality_of_service_is_told(name: str, tmp_path: Path) -> None:
    spec = tmp_path / "arm.yaml"
    spec.write_text(ARM.replace("ON_TIMEOUT", "zero").replace("{depth: 2000}", "{reliability: best_effort}"))
    with world(name) as ros:
        run = ros.neurovis("ros", "run", spec)
        run.wait_for("ready")
        peer = ros.peer(listen=[COMMANDS])
        line = run.wait_for("another quality of service")
        assert line.startswith("/cmd_vel: ")
        assert "RELIABILITY" in line
        peer.kill()
        assert run.stop() == 0


PARAMETERS = """
import json, sys, time
import rclpy
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
rclpy.init()
node = rclpy.create_node("setter")
def call(type_, name, request):
    client = node.create_client(type_, f"/neurovis/arm/{name}")
    assert client.wait_for_service(30)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=30)
    return future.result()
def set_(name, value, kind=3):
    value = ParameterValue(type=kind, **({"double_value": value} if kind == 3 else {"string_value": value}))
    given = Parameter(name=name, value=value)
    result = call(SetParameters, "set_parameters", SetParameters.Request(parameters=[given]))
    return result.results[0].successful
def get():
    return call(GetParameters, "get_parameters", GetParameters.Request(names=["gain"])).values[0].double_value
about = call(DescribeParameters, "describe_parameters", DescribeParameters.Request(names=["gain"])).descriptors[0]
bounds = about.floating_point_range[0]
done = [get(), set_("gain", 1.5), get(), set_("gain", 3.0), set_("gain", "much", 4), set_("count", 3.0), get()]
print(json.dumps([about.description, bounds.from_value, bounds.to_value, done]), flush=True)
import os; os._exit(0)
"""


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
def test_parameters_of_ros_2(name: str, tmp_path: Path) -> None:
    with world(name) as ros:
        run = ros.neurovis("ros", "run", written(tmp_path, "hold"))
        run.wait_for("ready")
        setter = ros.python(PARAMETERS)
        assert setter.end() == 0, setter.err
        about, low, high, done = json.loads(setter.out[-1])
        assert (about, low, high) == ("How strongly it follows.", 0, 2)
        assert done == [0.5, True, 1.5, False, False, False, 1.5]
        peer = ros.peer(listen=[COMMANDS], send=[targets(2.0, 20)], until={"/cmd_vel": 400})
        assert peer.end() == 0
        assert 3.0 in [one[0] for one in peer.json()["/cmd_vel"]]
        assert run.stop() == 0


def test_parameters_of_ros_1(tmp_path: Path) -> None:
    with world("one") as ros:
        run = ros.neurovis("ros", "run", written(tmp_path, "hold"))
        run.wait_for("ready")
        code = """
import json, time, rosgraph
master = rosgraph.Master("/setter")
prefix = "/neurovis/arm/parameters"
def set_(name, value):
    master.setParam(f"{prefix}/{name}", value)
    time.sleep(1)
    return master.getParam(prefix).get("gain")
print(json.dumps([master.getParam(prefix), set_("gain", 1.5), set_("gain", 3.0), set_("gain", "much")]))
"""
        setter = ros.python(code)
        assert setter.end() == 0, setter.err
        assert json.loads(setter.out[-1]) == [{"gain": 0.5}, 1.5, 1.5, 1.5]
        peer = ros.peer(listen=[COMMANDS], send=[targets(2.0, 20)], until={"/cmd_vel": 400})
        assert peer.end() == 0
        assert 3.0 in [one[0] for one in peer.json()["/cmd_vel"]]
        assert run.stop() == 0
        assert any("above its bound" in line or "at most" in line or "gain" in line for line in run.err)
        assert any("takes a number" in line for line in run.err)


def test_messages_flow_again_five_seconds_after_the_return_of_the_master(arm: Path) -> None:
    """In both directions, with a node that has come since; by the stamps of the steps."""
    with world("one") as ros:
        run = ros.neurovis("ros", "run", arm, "--format", "json")
        run.wait_for("ready")
        newcomer = ros.python(NEWCOMER.replace("SEEN", "2"))
        newcomer.wait_for("here")
        ros.stop_core()
        run.wait_for("is away")
        ros.start_core()
        assert newcomer.end() == 0, newcomer.err
        out, into = json.loads(newcomer.out[-1])
        assert out <= into <= 5
        assert run.stop() == 0
        assert run.json()["reconnects"] == 1
        assert any("is back" in line for line in run.err)


def test_what_becomes_of_the_parameters_on_the_server_is_mended(tmp_path: Path) -> None:
    """Whatever others write there, or take away: the node goes on, and shows what it has."""
    with world("one") as ros:
        run = ros.neurovis("ros", "run", written(tmp_path, "hold"))
        run.wait_for("ready")
        code = """
import json, time, rosgraph
master = rosgraph.Master("/vandal")
prefix = "/neurovis/arm/parameters"
def mended():
    end = time.monotonic() + 20
    while time.monotonic() < end:
        try:
            found = master.getParam(prefix)
        except rosgraph.MasterError:
            found = None
        if found == {"gain": 0.5}:
            return True
        time.sleep(0.05)
    return found
done = [mended()]
for what in (lambda: master.deleteParam(f"{prefix}/gain"), lambda: master.deleteParam(prefix),
             lambda: master.setParam(prefix, 5), lambda: master.setParam(f"{prefix}/gain", {"a": 1})):
    what()
    time.sleep(0.5)
    done.append(mended())
print(json.dumps(done))
"""
        vandal = ros.python(code)
        assert vandal.end() == 0, vandal.err
        assert json.loads(vandal.out[-1]) == [True] * 5
        assert run.stop() == 0
        assert len(run.err) < 10


def test_a_node_that_waits_for_others_ends_when_it_is_asked_to(arm: Path) -> None:
    with world("one") as ros:
        for ask in (
            lambda run: ros.python(SHUTDOWN).end(),
            lambda run: run.signal(signal.SIGTERM),
            lambda run: run.interrupt(),
        ):
            run = ros.neurovis("ros", "run", arm, "--wait", "1000", "--format", "json")
            run.wait_for("ready")
            ask(run)
            assert run.end() == 0
            assert run.json()["steps"] == 0


def test_a_master_that_never_comes_is_not_waited_for_longer_than_seconds(arm: Path) -> None:
    with world("one") as ros:
        ros.stop_core()
        run = ros.neurovis("ros", "run", arm, "--seconds", "0.5")
        assert run.end() == 1
        assert run.err[0].startswith("waiting for the master of ROS 1 at ")
        assert run.err[1].startswith("error: there is no master of ROS 1 at ")
        for uri in ("nonsense", "http://"):
            run = ros.neurovis("ros", "run", arm, ROS_MASTER_URI=uri)
            assert run.end() == 1
            assert run.err[0] == f"error: ROS_MASTER_URI is no address: '{uri}'"


def test_topics_bear_the_names_that_they_are_moved_to(ros: World, arm: Path, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    moved = ["/target:=/aim", "/cmd_vel:=/wheels"]
    given = moved if ros.ros == 1 else ["--ros-args", *(word for one in moved for word in ("-r", one))]
    run = ros.neurovis("ros", "run", arm, "--record", file, "--format", "json", *given)
    run.wait_for("ready")
    peer = ros.peer(send=[{**targets(1.5, 10), "topic": "/aim"}], listen=[{**COMMANDS, "topic": "/wheels"}], seconds=1)
    assert peer.end() == 0
    assert run.stop() == 0
    assert 0.75 in [one[0] for one in peer.json()["/wheels"]]
    topics = run.json()["topics"]
    assert topics["/aim"]["received"] == topics["/aim"]["recorded"] == 10
    assert {"/target", "/cmd_vel"}.isdisjoint(topics)
    with file.open("rb") as opened:
        assert "/aim" in {channel.topic for _, channel, _ in make_reader(opened).iter_messages()}


def test_a_network_can_listen_to_itself(ros: World, tmp_path: Path) -> None:
    spec, file = tmp_path / "loop.yaml", tmp_path / "run.mcap"
    spec.write_text("""
neurovis: 1
name: loop
time: {dt: 0.01}
inputs: {before: {}}
neurons: {A: {input: before, activation: identity, bias: 1}}
outputs: {after: A}
ros: {subscribe: {before: {topic: /own}}, publish: {after: {topic: /own}}}
""")
    run = ros.neurovis("ros", "run", spec, "--steps", "50", "--record", file, "--format", "json")
    assert run.end() == 0
    counts = run.json()["topics"]["/own"]
    assert 0 < counts["received"] <= 50
    assert counts["received"] == counts["recorded"]


def test_a_topic_of_two_types_is_told(ros: World, tmp_path: Path) -> None:
    moved = "/neurovis/arm/motors:=/cmd_vel"
    given = [moved] if ros.ros == 1 else ["--ros-args", "-r", moved]
    run = ros.neurovis("ros", "run", written(tmp_path), "--steps", "5", *given)
    assert run.end() == 1
    assert run.err[0].startswith("error: ")
    assert "/cmd_vel" in run.err[0]
    assert not any("Traceback" in line for line in run.err)


@pytest.mark.parametrize(("given", "gain"), [("9.0", 0.5), ("1", 1.0), (".nan", 0.5), ("much", 0.5)])
def test_a_parameter_of_ros_2_that_it_cannot_start_with_stays_and_is_offered(
    given: str, gain: float, tmp_path: Path
) -> None:
    with world("kilted") as ros:
        run = ros.neurovis("ros", "run", written(tmp_path), "--ros-args", "-p", f"gain:={given}")
        run.wait_for("ready")
        setter = ros.python(PARAMETERS)
        assert setter.end() == 0, setter.err
        *_, done = json.loads(setter.out[-1])
        assert done == [gain, True, 1.5, False, False, False, 1.5]
        assert run.stop() == 0
        assert any("the parameter 'gain' stays 0.5" in line for line in run.err) == (gain == 0.5)


def test_a_master_elsewhere_needs_an_address(arm: Path) -> None:
    with world("one") as ros:
        run = ros.neurovis("ros", "run", arm, ROS_MASTER_URI="http://robot.example:11311")
        assert run.end() == 1
        assert "robot.example" in run.err[0]
        assert "--remote" in run.err[1]


def test_the_ros_that_is_asked_for_must_be_there(arm: Path) -> None:
    with world("kilted") as ros:
        run = ros.neurovis("ros", "run", arm, "--ros", "1")
        assert run.end() == 1
        assert "'rospy'" in run.err[0]


def test_a_type_whose_package_is_missing_is_named(tmp_path: Path) -> None:
    spec = tmp_path / "arm.yaml"
    spec.write_text(ARM.replace("ON_TIMEOUT", "zero").replace("std_msgs/Float64,", "acme_msgs/Float64,"))
    for name in ("kilted", "one"):
        with world(name) as ros:
            run = ros.neurovis("ros", "run", spec)
            assert run.end() == 1
            assert "'acme_msgs'" in "".join(run.err)


def test_a_run_is_recorded_and_shown(ros: World, arm: Path, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    run = ros.neurovis("ros", "run", arm, "--record", file, "--live", "0", "--format", "json")
    assert run.wait_for("live: ").startswith("live: http://127.0.0.1:")
    run.wait_for("ready")
    peer = ros.peer(send=[targets(1.5, 30), targets(float("nan"), 3)], seconds=1.0)
    assert peer.end() == 0
    assert run.stop() == 0
    summary = run.json()
    steps = summary["steps"]
    assert steps > 30
    assert summary["files"] == [str(file)]
    assert summary["topics"]["activity"]["received"] == summary["topics"]["activity"]["recorded"] == steps
    assert summary["topics"]["/target"]["recorded"] == 33
    assert summary["shown"] + summary["skipped"] == steps
    with file.open("rb") as opened:
        messages = list(make_reader(opened).iter_messages())
    topics = [channel.topic for _, channel, _ in messages]
    assert topics[0] == "/neurovis/arm/spec"
    assert topics.count("/target") == 33
    activity = [message for _, channel, message in messages if channel.topic == "/neurovis/arm/activity"]
    assert [message.sequence for message in activity] == list(range(steps))
    assert {channel.message_encoding for _, channel, _ in messages} == {"ros1" if ros.ros == 1 else "cdr"}
    again = ros.neurovis("ros", "run", arm, "--record", file)
    assert again.end() == 1
    assert "--force" in again.err[-1]


def ask(page: str, asked: Mapping[str, object], until: Callable[[Mapping[str, Any]], bool]) -> None:
    """Ask a live page for something, until what it tells is what is wanted."""
    url = urlsplit(page.removeprefix("live: "))
    token = (url.query or url.fragment).partition("=")[2]

    async def turn() -> None:
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"http://{url.netloc}/live?token={token}", max_msg_size=1 << 24) as stream,
        ):
            await stream.send_str(json.dumps(asked))
            async with asyncio.timeout(PATIENCE):
                async for message in stream:
                    if message.type is aiohttp.WSMsgType.TEXT and until(json.loads(message.data)):
                        return

    asyncio.run(turn())


def gain_is(value: float) -> Callable[[Mapping[str, Any]], bool]:
    return lambda told: bool(told.get("parameters", {}).get("gain") == value)


def test_the_live_page_turns_the_run(ros: World, tmp_path: Path) -> None:
    run = ros.neurovis("ros", "run", written(tmp_path, "hold"), "--live", "0")
    page = run.wait_for("live: ")
    run.wait_for("ready")
    ask(page, {"type": "set", "values": {"gain": 1.5}}, gain_is(1.5))
    peer = ros.peer(listen=[COMMANDS], send=[targets(2.0, 20)], until={"/cmd_vel": 400})
    assert peer.end() == 0
    assert 3.0 in [one[0] for one in peer.json()["/cmd_vel"]]
    assert run.stop() == 0


def test_the_live_page_of_who_views_sets_the_parameters_of_the_run(ros: World, tmp_path: Path) -> None:
    run = ros.neurovis("ros", "run", written(tmp_path, "hold"))
    run.wait_for("ready")
    view = ros.neurovis("ros", "view", "--live", "0")
    page = view.wait_for("live: ")
    view.wait_for("ready")
    ask(page, {"type": "play"}, lambda told: gain_is(0.5)(told) and "set" in told["can"]["takes"])
    ask(page, {"type": "set", "values": {"gain": 1.5}}, gain_is(1.5))
    for asked, why in (
        ({"type": "set", "values": {"gain": 3.0}}, "gain"),
        ({"type": "lesion", "part": "A"}, "its parameters can be set, and nothing else"),
    ):
        ask(page, asked, lambda told, why=why: why in told.get("reason", ""))  # type: ignore[misc]
    peer = ros.peer(listen=[COMMANDS], send=[targets(2.0, 20)], until={"/cmd_vel": 400})
    assert peer.end() == 0
    assert 3.0 in [one[0] for one in peer.json()["/cmd_vel"]]
    assert run.stop() == 0
    assert view.stop() == 0
