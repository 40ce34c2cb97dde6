"""The ``ros`` section as a value of the network, and what is known of message types. Findings: ``errors/ros*.yaml``."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.ros_settings import Publication, RosSettings, Subscription
from neurovis_spec.language.ros_types import Field, all_types, fields_of, numbers_of

SPEC = """
neurovis: 1
name: x
time: {dt: 0.025}
parameters: {wait: 0.5}
inputs: {target: {}, torque: {size: 3}, sensed: {size: 2}, far: {size: 9}}
neurons:
  A: {input: target}
  B: {count: 3, input: torque}
  C: {count: 2, input: sensed}
  D: {count: 9, input: far}
outputs: {signal: A, motors: B}
"""
ROS = """
ros:
  namespace: robot/left
  rate: 2*20
  qos: {reliability: best_effort, durability: transient_local, depth: 2*wait}
  subscribe:
    target: {topic: target, timeout: wait, on_timeout: stop}
    torque: {topic: ~/torque, type: my_msgs/msg/Torques, field: own.values}
    sensed: {topic: /joint_states, type: sensor_msgs/msg/JointState, field: effort, names: [left knee, hip], timeout: 1}
    far: {topic: /imu, type: sensor_msgs/Imu, field: orientation_covariance}
  publish:
    motors: {topic: /motor/command}
    signal: {topic: /cmd_vel, type: geometry_msgs/msg/Twist, field: linear.x, safe: -wait}
"""


def network(text: str) -> Network:
    return nv.compile_text(text).network


def test_the_section_is_a_value_of_the_network() -> None:
    assert network(SPEC + ROS).ros == RosSettings(
        namespace="/robot/left",
        rate=40.0,
        reliability="best_effort",
        durability="transient_local",
        depth=1,
        subscribe=(
            Subscription("target", "target", "std_msgs/Float64", timeout=0.5, on_timeout="stop"),
            Subscription("torque", "~/torque", "my_msgs/Torques", "own.values"),
            Subscription("sensed", "/joint_states", "sensor_msgs/JointState", "effort", ("left knee", "hip"), 1.0),
            Subscription("far", "/imu", "sensor_msgs/Imu", "orientation_covariance"),
        ),
        publish=(
            Publication("motors", "/motor/command", "std_msgs/Float64MultiArray"),
            Publication("signal", "/cmd_vel", "geometry_msgs/Twist", "linear.x", -0.5),
        ),
    )


def test_without_the_section_there_are_defaults() -> None:
    assert network(SPEC).ros == RosSettings(rate=40.0) == network(SPEC + "ros: {}").ros
    assert network(SPEC).ros.namespace == "/neurovis"


def test_the_hash_does_not_see_it() -> None:
    assert network(SPEC).hash == network(SPEC + ROS).hash


def test_an_input_of_an_instance_comes_from_a_topic_of_its_own() -> None:
    text = (
        "neurovis: 1\nname: x\nmodules: {leg: {inputs: {load: {}}, neurons: {S: {input: load}}}}\n"
        "instances: {left: {module: leg, count: 2}}\nros: {subscribe: {left2.load: {topic: /load}}}\n"
    )
    (found,) = network(text).ros.subscribe
    assert (found.input, found.topic, found.on_timeout) == ("left2.load", "/load", "zero")


@pytest.mark.parametrize(
    ("name", "path", "field"),
    [
        ("std_msgs/Float64", "data", Field("number", False, 1)),
        ("std_msgs/msg/UInt8MultiArray", "data", Field("number", True, None)),
        ("sensor_msgs/JointState", "name", Field("text", True)),
        ("sensor_msgs/JointState", "effort", Field("number", True, None)),
        ("sensor_msgs/Imu", "orientation.w", Field("number", False, 1)),
        ("sensor_msgs/Imu", "orientation_covariance", Field("number", True, 9)),
        ("sensor_msgs/Imu", "header", Field("opaque")),
        ("nav_msgs/Odometry", "twist.twist.angular.z", Field("number", False, 1)),
        ("nav_msgs/Odometry", "pose.covariance", Field("number", True, 36)),
        ("geometry_msgs/Wrench", "force", Field("message")),
    ],
)
def test_fields_of_the_usual_types(name: str, path: str, field: Field) -> None:
    fields = fields_of(name)
    assert fields is not None
    assert fields[path] == field


def test_every_type_of_the_table_can_be_read() -> None:
    without = {name for name in all_types() if not numbers_of(name)}
    assert without == {f"std_msgs/{name}" for name in ("Duration", "Empty", "Header", "String", "Time")}
    assert fields_of("my_msgs/Own") is None


@pytest.mark.parametrize(
    ("written", "rate", "kept"),
    [("", 1000, 2000), ("", 100, 200), ("", 1, 10), ("", 1e9, 1_000_000), ("qos: {depth: 3}", 1000, 3)],
)
def test_what_a_recorder_may_miss_its_turn_for_is_kept_for_it(written: str, rate: float, kept: int) -> None:
    spec = f"neurovis: 1\nname: x\nneurons: {{A: {{}}}}\nros: {{rate: {rate}, {written}}}\n"
    assert nv.compile_text(spec).network.ros.depth_at(rate) == kept
