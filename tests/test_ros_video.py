"""Films of what arrives: drawn by another process, at a steady pace, and played whatever becomes of either."""

from __future__ import annotations

import os
import pickle
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from neurovis_renderers.video import ffmpeg
from ros_worlds import PATIENCE, world
from test_videos import decoded

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.ros.filming import film
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.ros.video import Shooting, Video, shooting
from neurovis_spec.runtime.recording import Snapshot

SPEC = """
neurovis: 1
name: seen
time: {dt: 0.01}
neurons: {A: {count: 3, initial: 0.3}, O: {initial: 0}}
connections: {A -> O: {weight: 0.5, plasticity: {oja: {rate: 0.01}}}, O -> A1: 0.25}
render: {size: [240, 180]}
"""
COMPILED = nv.compile_text(SPEC)
NETWORK = COMPILED.network


def how(path: Path, fps: float = 25.0) -> Shooting:
    return shooting(COMPILED, path, fps, None, None)


def snapshot(step: int, value: float) -> Snapshot:
    return Snapshot(step, np.full(4, value), NETWORK.connections.weights.whole() * (1 + step), None)


def fragments(path: Path, count: int) -> None:
    """Wait until a film has so many fragments."""
    deadline = time.monotonic() + PATIENCE
    while not (path.exists() and path.read_bytes().count(b"moof") >= count):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_frames_that_were_left_out_repeat_the_one_before_them(tmp_path: Path) -> None:
    path, frames = tmp_path / "x.mp4", tmp_path / "frames"
    values = {0: 0.0, 1: 1.0, 30: float("nan"), 31: float("inf"), 40: 0.5}
    frames.write_bytes(b"".join(pickle.dumps((number, snapshot(number, value))) for number, value in values.items()))
    with frames.open("rb") as pipe:
        film(how(path), pipe)
    seen = decoded(path)
    assert len(seen) == 41
    stills = np.array([np.abs(one.astype(int) - other).max() for one, other in zip(seen[1:], seen, strict=False)])
    assert stills[0] > 60
    assert stills[2:24].max() < 20  # the next part's scale of weights may be another
    assert stills[32:39].max() < 20


def test_of_nothing_there_is_no_film(tmp_path: Path) -> None:
    source, told = ReceivedSource(NETWORK), list[str]()
    video = Video(how(tmp_path / "x.mp4"), source, told.append)
    video.start()
    video.end()
    assert (video.begun, told, list(tmp_path.iterdir())) == (False, [], [])


def test_a_film_is_there_when_its_process_is_killed(tmp_path: Path) -> None:
    source, told, path = ReceivedSource(NETWORK), list[str](), tmp_path / "x.mp4"
    video = Video(how(path), source, told.append)
    video.start()
    for step in range(10):
        source.hear_activity(step, step, np.full(4, step / 10))
    fragments(path, 2)
    os.kill(video._process.pid, signal.SIGKILL)
    video.end()
    assert video.begun
    fragments(path, 2)
    assert len(decoded(path)) >= 25
    assert source.shown == 1  # whoever looks on takes the newest


def test_a_film_that_cannot_be_made_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, told = ReceivedSource(NETWORK), list[str]()
    video = Video(how(tmp_path / "no" / "x.mp4"), source, told.append)
    video.start()
    source.hear_activity(0, 0, np.zeros(4))
    deadline = time.monotonic() + PATIENCE
    while not told:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    video.end()
    assert len(told) == 1
    assert "No such file" in told[0]


def test_a_film_ends_in_mp4(tmp_path: Path) -> None:
    """So that what was meant as the spec is not written over."""
    spec = tmp_path / "x.yaml"
    spec.write_text(SPEC)
    for command in ("run", "view"):
        result = CliRunner().invoke(neurovis, ["ros", command, "--video", str(spec)])
        assert result.exit_code == 2
        assert (
            "--video takes a file that ends in .mp4" in re.sub(r"\s+", " ", result.output) or "Missing" in result.output
        )
    assert spec.read_text() == SPEC


@pytest.fixture
def encoder(tmp_path: Path) -> str:
    """A PATH on which there is ffmpeg."""
    program = ffmpeg()
    assert program is not None
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "ffmpeg").symlink_to(program)
    return f"{folder}:{os.environ['PATH']}"


@pytest.mark.ros
@pytest.mark.parametrize("name", ["kilted", "one"])
def test_a_run_is_filmed_beside_one_who_views_and_is_killed(name: str, tmp_path: Path, encoder: str) -> None:
    spec, own, seen = tmp_path / "x.yaml", tmp_path / "own.mp4", tmp_path / "seen.mp4"
    spec.write_text(SPEC)
    with world(name) as ros:
        view = ros.neurovis("ros", "view", spec, "--video", seen, PATH=encoder)
        view.wait_for("ready")
        run = ros.neurovis("ros", "run", spec, "--video", own, "--fps", "10", "--format", "json", PATH=encoder)
        fragments(seen, 3)
        fragments(own, 3)
        view.kill()
        assert run.stop() == 0
        assert run.json()["files"] == [str(own)]
        assert run.json()["shown"] > 20
        assert ros.neurovis("ros", "run", spec, "--video", own, PATH=encoder).end() == 1
    assert len(decoded(own)) >= 30
    assert len(decoded(seen)) >= 50
