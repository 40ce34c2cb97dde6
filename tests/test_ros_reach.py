"""What is set so that this machine alone meets a node: what needs no ROS. With ROS: ``test_ros_machines``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import pytest

from neurovis_spec.ros.middleware import MiddlewareError, NodeOptions
from neurovis_spec.ros.reach import Carrier, Reach, reach_1, reach_2

JAZZY, KILTED, OTHER = (
    Carrier("rmw_fastrtps_cpp", 2),
    Carrier("rmw_fastrtps_cpp", 3),
    Carrier("rmw_cyclonedds_cpp", None),
)
PROFILE = {JAZZY: "FASTRTPS_DEFAULT_PROFILES_FILE", KILTED: "FASTDDS_DEFAULT_PROFILES_FILE"}
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
FAST_DDS = pytest.mark.parametrize("carrier", [JAZZY, KILTED])


def reach(carrier: Carrier, folder: Path, environment: Mapping[str, str] | None = None, remote: bool = False) -> Reach:
    return reach_2(NodeOptions("a", remote=remote, environment=environment or {}), carrier, folder)


def test_a_node_of_ros_1_is_at_the_loopback() -> None:
    assert reach_1(NodeOptions("a", environment={})) == Reach({"ROS_IP": "127.0.0.1"})
    here = {"ROS_MASTER_URI": "http://localhost:1", RANGE: "SUBNET"}
    assert reach_1(NodeOptions("a", environment=here)) == Reach({"ROS_IP": "127.0.0.1"})
    elsewhere = {"ROS_MASTER_URI": "http://robot:11311"}
    with pytest.raises(MiddlewareError, match="another machine, 'robot'"):
        reach_1(NodeOptions("a", environment=elsewhere))
    assert reach_1(NodeOptions("a", remote=True, environment=elsewhere)) == Reach()
    for name in ("ROS_IP", "ROS_HOSTNAME"):
        assert reach_1(NodeOptions("a", environment={**elsewhere, name: "10.0.0.1"})) == Reach()


@FAST_DDS
def test_a_node_of_ros_2_looks_near_and_listens_near(carrier: Carrier, tmp_path: Path) -> None:
    found = reach(carrier, tmp_path)
    assert found.told == ()
    profile = found.environment[PROFILE[carrier]]
    assert found.environment == {RANGE: "LOCALHOST", PROFILE[carrier]: profile}
    assert profile is not None
    root = ElementTree.parse(profile).getroot()
    name = "{http://www.eprosima.com}"
    assert [one.text for one in root.iter(f"{name}address")] == ["127.0.0.1"]
    assert [one.text for one in root.iter(f"{name}useBuiltinTransports")] == ["false"]
    assert [one.get("is_default_profile") for one in root.iter(f"{name}participant")] == ["true"]


@FAST_DDS
def test_ros_decides_where_it_is_told_to(carrier: Carrier, tmp_path: Path) -> None:
    peers = {"ROS_STATIC_PEERS": "10.0.0.2"}
    assert reach(carrier, tmp_path, peers, remote=True) == Reach()
    for far in ("SUBNET", "SYSTEM_DEFAULT"):
        assert reach(carrier, tmp_path, {RANGE: far, **peers}) == Reach()
    for near in ("LOCALHOST", "OFF"):
        assert set(reach(carrier, tmp_path, {RANGE: near}).environment) == {PROFILE[carrier]}
    # which is of ROS 1
    assert RANGE in reach(carrier, tmp_path, {"ROS_IP": "10.0.0.1"}).environment


@pytest.mark.parametrize(
    ("name", "there", "here"),
    [
        ("ROS_STATIC_PEERS", "10.0.0.2", "127.0.0.1;localhost"),
        ("ROS_STATIC_PEERS", "localhost;robot.example", ""),
        ("ROS_DISCOVERY_SERVER", "10.0.0.2:11811", "127.0.0.1:11811;;localhost:42"),
        ("ROS_DISCOVERY_SERVER", ";UDPv4:[10.0.0.2]:11811", "TCPv4:[127.0.0.1]:11811"),
        ("ROS2_EASY_MODE", "10.0.0.2", "127.0.0.1"),
    ],
)
def test_peers_elsewhere_are_left_out_and_told(name: str, there: str, here: str, tmp_path: Path) -> None:
    found = reach(KILTED, tmp_path, {name: there})
    assert found.environment[name] is None
    assert found.told == (f"{name} names other machines: with --remote they are met",)
    found = reach(KILTED, tmp_path, {name: here})
    assert name not in found.environment
    assert found.told == ()


@FAST_DDS
def test_a_profile_of_the_user_is_kept_and_told(carrier: Carrier, tmp_path: Path) -> None:
    own = {PROFILE[carrier]: "mine.xml"}
    found = reach(carrier, tmp_path, own)
    assert found.environment == {RANGE: "LOCALHOST"}
    assert [line.split()[0] for line in found.told] == [PROFILE[carrier]]
    assert reach(carrier, tmp_path, {"FASTDDS_ENVIRONMENT_FILE": "mine.json"}).told
    file = "DEFAULT_FASTRTPS_PROFILES.xml" if carrier is JAZZY else "DEFAULT_FASTDDS_PROFILES.xml"
    (tmp_path / file).write_text("<profiles/>")
    found = reach(carrier, tmp_path)
    assert found.environment == {RANGE: "LOCALHOST"}
    assert [line.split()[0] for line in found.told] == [file]
    assert reach(carrier, tmp_path, {"SKIP_DEFAULT_XML_FILE": "1"}).told == ()


def test_what_names_a_profile_of_another_fast_dds_is_none(tmp_path: Path) -> None:
    assert reach(JAZZY, tmp_path, {"FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml"}).told == ()
    assert reach(KILTED, tmp_path, {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}).told != ()


def test_another_middleware_is_told(tmp_path: Path) -> None:
    found = reach(OTHER, tmp_path)
    assert found.environment == {RANGE: "LOCALHOST"}
    (line,) = found.told
    assert line.startswith("rmw_cyclonedds_cpp may let other machines listen")
    assert reach(OTHER, tmp_path, remote=True) == Reach()


def test_the_environment_is_that_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "environ", {"ROS_STATIC_PEERS": "robot", "HOME": "/"})
    lines = list[str]()
    Reach({"ROS_STATIC_PEERS": None, "ROS2_EASY_MODE": None, RANGE: "LOCALHOST"}, ("so",)).take(lines.append)
    assert os.environ == {"HOME": "/", RANGE: "LOCALHOST"}
    assert lines == ["so"]
