"""A controller in C++ and ROS 1's own recorder: what they send and record is what is recorded and read here."""

from __future__ import annotations

import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from ros_worlds import BIG, BIG_ACTIVITY, PATIENCE, world

import neurovis_spec as nv
from neurovis_spec.ros.accept import ARRAY, arrays
from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.convert import Converter
from neurovis_spec.ros.definitions import definition
from neurovis_spec.runtime.wire import label_of

pytestmark = pytest.mark.ros

HASH = nv.compile_text(BIG).hash
SOURCE = Path(__file__).parent / "ros_controller.cpp"


def built(folder: Path) -> Path:
    """The controller, compiled."""
    assert shutil.which("g++"), "this test needs g++"
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "roscpp"], capture_output=True, text=True, check=False)
    assert flags.returncode == 0, f"this test needs pkg-config and libroscpp-dev: {flags.stderr}"
    program = folder / "controller"
    subprocess.run(["g++", "-O1", "-Wall", SOURCE, "-o", program, *flags.stdout.split()], check=True)
    return program


def messages(path: Path) -> list[bytes]:
    return [one.data for one in read_bag(path).messages() if one.topic.name == BIG_ACTIVITY]


def test_a_controller_in_cpp_is_recorded_whole_at_a_kilohertz_beside_rosbag(tmp_path: Path) -> None:
    spec, ours, theirs = tmp_path / "big.yaml", tmp_path / "ours.bag", tmp_path / "theirs.bag"
    spec.write_text(BIG)
    program = built(tmp_path)
    with world("one") as ros:
        view = ros.neurovis("ros", "view", spec, "--record", ours, "--live", "0", "--format", "json")
        record = ros.program("rosbag", "record", "-O", theirs, BIG_ACTIVITY)
        view.wait_for("ready")
        controller = ros.program(program, BIG_ACTIVITY, label_of(HASH), "150", "8000", "1000", "2")
        assert controller.end() == 0
        deadline = time.monotonic() + PATIENCE
        while ours.stat().st_size < 8000 * 1200:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        time.sleep(1)
        assert view.stop() == 0
        record.stop()
        counts = view.json()["topics"]["activity"]
        assert (counts["received"], counts["recorded"], counts["lost"]) == (8000, 8000, 0)
        info = ros.program("rosbag", "info", "-y", "-k", "topics", ours)
        assert info.end() == 0
        told = " ".join(" ".join(info.out).split())
        assert f"topic: {BIG_ACTIVITY} type: std_msgs/Float64MultiArray messages: 8000" in told
    with world("kilted") as ros:  # and now into the other ROS
        view = ros.neurovis("ros", "view", spec, "--record", tmp_path / "two", "--format", "json")
        view.wait_for("ready")
        play = ros.neurovis("ros", "play", theirs, "--speed", "2", "--wait", "20", "--format", "json")
        assert play.end() == 0
        assert play.json()["topics"][BIG_ACTIVITY]["received"] == len(messages(theirs))
        time.sleep(1)
        assert view.stop() == 0
    converter = Converter(ARRAY, str(definition(ARRAY, 1)), "ros1")
    assert messages(tmp_path / "two") == [converter.convert(data) for data in messages(theirs)]
    found, judge = messages(ours), arrays(HASH, 150)
    assert len(messages(theirs)) > 4000  # of which rosbag keeps a hundred waiting, and no more
    others = iter(found)
    assert all(data in others for data in messages(theirs))
    for number in range(0, 8000, 499):
        accepted = judge(found[number], "ros1")
        assert not isinstance(accepted, str)
        assert accepted.seq == number
        assert np.array_equal(accepted.numbers, np.full(150, float(number)))
