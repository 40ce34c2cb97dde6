"""What we record is what Foxglove's libraries read."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from test_mcap import SPEC
from test_ros_recorder import LABEL, START, TOPIC, N, made

import neurovis_spec as nv
from neurovis_spec.ros.middleware import Ros

pytestmark = pytest.mark.node
HERE = Path(__file__).parent


def read(path: Path) -> tuple[str, list[dict[str, object]]]:
    done = subprocess.run(
        ["node", HERE / "read_recording.mjs", path], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    return found["profile"], found["messages"]


@pytest.mark.parametrize("ros", [1, 2])
def test_they_read_what_the_recorder_writes(ros: Ros, tmp_path: Path) -> None:
    made(tmp_path / "x.mcap", ros, 700)
    profile, (spec, *messages) = read(tmp_path / "x.mcap")
    assert profile == f"ros{ros}"
    assert (spec["topic"], spec["data"]) == ("/neurovis/x/spec", "neurovis: 1\n")
    assert len(messages) == 700
    for step, message in enumerate(messages):
        assert message["topic"] == TOPIC
        assert message["label"] == LABEL
        assert (message["sequence"], message["time"]) == (step, str(START + step * 1_000_000))
        assert message["data"] == [step, step / 100, *(np.arange(N) + step).tolist()]


def test_they_read_what_run_writes(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC)
    network.run_to(tmp_path / "x.mcap")
    recording = network.run()
    profile, messages = read(tmp_path / "x.mcap")
    assert profile == "ros2"
    activity = [message["data"] for message in messages if message["topic"] == "/robot/bag/activity"]
    assert activity == [[k, k * 0.025, *row] for k, row in enumerate(recording.activity.tolist())]
