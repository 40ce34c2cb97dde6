"""What we record is what Foxglove's libraries read."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_mcap import SPEC
from test_ros_recorder import LABEL, START, TOPIC, N, made

import neurovis_spec as nv
from neurovis_spec.ros.middleware import Ros

pytestmark = pytest.mark.node
HERE = Path(__file__).parent


def read(path: Path) -> tuple[str, list[dict[str, object]]]:
    found = all_of(path)
    return found["profile"], found["messages"]


def all_of(path: Path) -> dict[str, Any]:
    """What is in a file."""
    done = subprocess.run(
        ["node", HERE / "read_recording.mjs", path], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


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


def test_they_find_the_neurons_by_name(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC)
    network.run_to(tmp_path / "x.mcap")
    found = all_of(tmp_path / "x.mcap")
    assert found["properties"] == {"neurovis.Values": {name: {"type": "number"} for name in ("A1", "A2", "A3", "O")}}
    values = [message for message in found["messages"] if message["topic"] == "/robot/bag/values"]
    activity = network.run().activity
    assert [(message["sequence"], message["time"]) for message in values] == [
        (k, str(round(k * 0.025 * 1e9))) for k in range(40)
    ]
    for message, row in zip(values, activity, strict=True):
        assert list(message["data"].values()) == pytest.approx(row.tolist(), rel=1e-8)
