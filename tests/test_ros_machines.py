"""Who may listen: two machines with real ROS, of which one knows the other and is let in only by ``--remote``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_machines import Machine, two_machines
from ros_worlds import Process, World, claimed_domain, free_port, world

pytestmark = pytest.mark.ros

ARM = """
neurovis: 1
name: arm
time: {dt: 0.01}
parameters: {gain: {value: 0.5, min: 0, max: 2}}
inputs: {target: {}}
neurons: {A: {input: target, activation: identity}, M: {activation: identity}}
connections: {A -> M: gain}
"""
#: listens to the activities, sets the parameter, and says which nodes there are, as soon as all of it is done or
#: nothing more can come: another program says when, by a file
DESK = """
import json, os, sys, time
import rclpy
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import Float64MultiArray
rclpy.init()
node, came, asked = rclpy.create_node("desk"), [], None
node.create_subscription(Float64MultiArray, "/neurovis/arm/activity", came.append, 10)
client = AsyncParameterClient(node, "/neurovis/arm")
print("here", flush=True)
while not os.path.exists(sys.argv[1]):
    rclpy.spin_once(node, timeout_sec=0.05)
    if asked is None and client.services_are_ready():
        asked = client.set_parameters([Parameter("gain", value=1.5)])
    nodes = sorted(set(node.get_node_names()) - {"desk"})
    if len(came) > 20 and asked is not None and asked.done() and len(nodes) == int(sys.argv[2]):
        break
print(json.dumps([bool(came), asked is not None and asked.done(), nodes]), flush=True)
os._exit(0)
"""
#: listens to both networks, of which one can be heard: whether anything came of each
DESK_1 = """
import json, os, time
import rospy
from std_msgs.msg import Float64MultiArray
rospy.init_node("desk", disable_signals=True)
came = {name: [] for name in ("arm", "free")}
for name, to in came.items():
    rospy.Subscriber(f"/neurovis/{name}/activity", Float64MultiArray, to.append)
while len(came["free"]) < 50:
    time.sleep(0.01)
print(json.dumps([bool(came["arm"]), bool(came["free"])]), flush=True)
os._exit(0)
"""
#: asks a master for its process, as soon as it can be reached where it runs
MASTER = """
import sys, time
from xmlrpc.client import ServerProxy
for left in reversed(range(100 if "//127." in sys.argv[1] else 1)):
    try:
        assert ServerProxy(sys.argv[1]).getPid("/desk")[0] == 1
        break
    except OSError:
        if not left:
            raise
        time.sleep(0.1)
"""


@pytest.fixture
def machines() -> Iterator[tuple[Machine, Machine]]:
    with two_machines() as made:
        yield made


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM)
    return path


def on(ros: World, machine: Machine, *words: str | Path, **environment: str) -> Process:
    """A program of an environment, on a machine."""
    return ros.started([*machine.inside, ros.bin / words[0], *words[1:]], **environment)


def come(desk: Process) -> object:
    """Whether activities came, whether the parameter was set, and which other nodes are known."""
    assert desk.end() == 0, desk.err
    return desk.json()


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
def test_a_node_of_ros_2_is_met_by_another_machine_with_remote_alone(
    name: str, machines: tuple[Machine, Machine], arm: Path, tmp_path: Path
) -> None:
    """Both know each other (``ROS_STATIC_PEERS``). All is done twice at once, in two domains: what comes with
    ``--remote`` says by when it would have come without."""
    robot, desk = machines
    enough = tmp_path / "enough"
    claim, other = claimed_domain()
    with world(name) as ros, claim:
        near = {"ROS_STATIC_PEERS": desk.address}
        far = {**near, "ROS_DOMAIN_ID": str(other)}
        view = ["view", arm, "--record", tmp_path / "x.mcap"]
        closed = [on(ros, robot, "neurovis", "ros", *words, **near) for words in (["run", arm], view, ["legacy"])]
        opened = on(ros, robot, "neurovis", "ros", "run", arm, "--remote", **far)
        for one in (*closed, opened):
            one.wait_for("ready")
        known = {"ROS_STATIC_PEERS": robot.address}
        locked = on(ros, desk, "python", "-c", DESK, enough, "3", **known)
        let_in = on(ros, desk, "python", "-c", DESK, enough, "1", **known, ROS_DOMAIN_ID=str(other))
        beside = on(ros, robot, "python", "-c", DESK, enough, "3")
        locked.wait_for("here")
        assert come(let_in) == [True, True, ["arm"]]
        assert come(beside) == [True, True, ["arm", "neurovis_legacy", "neurovis_view"]]
        enough.touch()
        assert come(locked) == [False, False, []]
        for one in closed:
            assert "ROS_STATIC_PEERS names other machines: with --remote they are met" in one.err


def test_a_node_of_ros_1_is_met_by_another_machine_where_its_address_is_given(
    machines: tuple[Machine, Machine], arm: Path, tmp_path: Path
) -> None:
    """The master of one machine is known to the other; it, too, is met by nobody where docs/ros.md says how."""
    robot, desk = machines
    free = tmp_path / "free.yaml"
    free.write_text(ARM.replace("arm", "free"))
    with world("one") as ros:
        core = ["/usr/bin/python3", "/usr/bin/rosmaster", "--core", "-p"]
        known, hidden = free_port(), free_port()
        ros.started([*robot.inside, *core, str(known)])
        ros.started([*robot.inside, *core, str(hidden)], ROS_IP="127.0.0.1")
        here = {"ROS_MASTER_URI": f"http://127.0.0.1:{known}"}
        closed = on(ros, robot, "neurovis", "ros", "run", arm, **here)
        opened = on(ros, robot, "neurovis", "ros", "run", free, ROS_IP=robot.address, **here)
        for one in (closed, opened):
            one.wait_for("ready")
        on(ros, robot, "python", "-c", MASTER, f"http://127.0.0.1:{hidden}").end()
        away = {"ROS_MASTER_URI": f"http://{robot.address}:{known}", "ROS_IP": desk.address}
        heard = on(ros, desk, "python", "-c", DESK_1, **away)
        assert heard.end() == 0, heard.err
        assert heard.json() == [False, True]
        tried = on(ros, desk, "python", "-c", MASTER, f"http://{robot.address}:{hidden}")
        assert tried.end() == 1
        assert "ConnectionRefusedError" in tried.err[-1]
