"""The commands of ``neurovis ros`` beside a node that is none: when they end, and what they say."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live.live import listen
from neurovis_spec.ros import middleware
from neurovis_spec.ros.accept import ARRAY
from neurovis_spec.ros.announced import Others, find
from neurovis_spec.ros.definitions import definition
from neurovis_spec.ros.listening import Listening, Wanted
from neurovis_spec.ros.middleware import Arrival, Node
from neurovis_spec.runtime.wire import text_message

OPENING = 0.5


class Quiet:
    """A node to which nothing comes, and which takes a while to be made. Notes when it listened, and for how long."""

    ros, encoding, name, reconnects, ended = 2, "cdr", "/neurovis_view", 0, False

    def __init__(self) -> None:
        self.listened: list[float] = []

    def opened(self, *_: object) -> Quiet:
        time.sleep(OPENING)
        return self

    def subscription(self, topic: str, *_: object) -> SimpleNamespace:
        begun = time.monotonic()
        return SimpleNamespace(topic=topic, close=lambda: self.listened.append(time.monotonic() - begun))

    def definition(self, type_: str) -> str:
        return str(definition(type_, 2))

    def close(self) -> None: ...


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> Quiet:
    node = Quiet()
    opened: Callable[..., Quiet] = node.opened
    monkeypatch.setattr(middleware, "open_node", opened)
    return node


def test_the_seconds_of_a_view_are_those_in_which_it_listens(quiet: Quiet, tmp_path: Path) -> None:
    spec = tmp_path / "a.yaml"
    spec.write_text("neurovis: 1\nname: a\nneurons: {A: {}}\n")
    out = tmp_path / "a.mcap"
    found = CliRunner().invoke(neurovis, ["ros", "view", str(spec), "--record", str(out), "--seconds", "0.3"])
    assert found.exit_code == 0, found.output
    assert min(quiet.listened) >= 0.3
    assert "nothing came on /neurovis/a/activity" in found.output


def test_the_summary_in_json_is_one_object_on_one_line(quiet: Quiet, tmp_path: Path) -> None:
    """To this command nothing came: it has made no file."""
    spec, out = tmp_path / "a.yaml", tmp_path / "a.mcap"
    spec.write_text("neurovis: 1\nname: a\nneurons: {A: {}}\n")
    asked = ["ros", "view", str(spec), "--record", str(out), "--seconds", "0.1", "--format", "json"]
    found = CliRunner().invoke(neurovis, asked)
    (line,) = found.stdout.splitlines()
    summary = json.loads(line)
    assert summary.pop("seconds") > 0
    nothing = {
        **dict.fromkeys(("received", "recorded", "lost", "unlabelled", "not_finite"), 0),
        "rejected": dict.fromkeys(("length", "hash", "type", "parse", "names", "publisher"), 0),
    }
    assert summary == {
        **{"network": "a", "hash": nv.compile(spec).hash, "ros": 2, "steps": 0, "late": 0, "reconnects": 0},
        **{"shown": 0, "skipped": 0, "files": [], "topics": {"activity": nothing}},
    }
    assert not out.exists()


@pytest.mark.parametrize("command", ["view", "legacy"])
def test_files_that_are_in_the_way_are_told_before_anything_is_waited_for(
    quiet: Quiet, tmp_path: Path, command: str
) -> None:
    recording, film = tmp_path / "a.mcap", tmp_path / "a.mp4"
    for option, path in (("--record", recording), ("--video", film)):
        path.write_text("mine")
        found = CliRunner().invoke(neurovis, ["ros", command, option, str(path), "--seconds", "0.1"])
        assert found.exit_code == 1
        assert f"{path} exists" in found.stderr
        assert "ready" not in found.stderr
        assert "waiting" not in found.stderr
        path.unlink()
    with closing(listen("127.0.0.1", 0)) as taken:
        taken.listen()
        for option, value, said in (
            ("--record", tmp_path / "no" / "a.mcap", "there is no folder"),
            ("--record", tmp_path / "a.txt", "recordings are '.mcap'"),
            ("--live", taken.getsockname()[1], "is in use"),
        ):
            found = CliRunner().invoke(neurovis, ["ros", command, option, str(value)])
            assert (found.exit_code, said in found.stderr) == (1, True)


def test_networks_that_announce_themselves_later_are_told_of_once() -> None:
    there, told = {"/a/one/spec": ("std_msgs/String",), "/a/one/activity": (ARRAY,)}, list[str]()
    node = SimpleNamespace(topics=lambda: there)
    others = Others(cast(Node, node), "/a/one/spec", told.append)
    others.look()
    assert told == []
    there |= {"/a/two/spec": ("std_msgs/String",), "/a/two/activity": (ARRAY,), "/a/three/spec": ("std_msgs/String",)}
    others.look()
    others.look()
    assert told == ["another network announces itself, on /a/two/spec: --network two shows it"]


def test_a_recording_that_is_played_is_not_written_over(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.write_bytes(b"mine")
    found = CliRunner().invoke(neurovis, ["ros", "play", str(file), "--record", str(file), "--force"])
    assert found.exit_code != 0
    assert "the recording that is played" in found.stderr
    assert file.read_bytes() == b"mine"


def test_a_spec_that_cannot_be_written_at_the_end_is_refused_at_the_beginning(quiet: Quiet, tmp_path: Path) -> None:
    found = CliRunner().invoke(neurovis, ["ros", "legacy", "-o", str(tmp_path / "no" / "a.yaml"), "--seconds", "0.1"])
    assert found.exit_code == 1
    assert "there is no folder" in found.stderr
    assert "ready" not in found.stderr


def test_a_network_is_listened_to_where_it_announces_itself() -> None:
    """Its topics may have been given other names."""
    text = text_message("neurovis: 1\nname: a\nneurons: {A: {}}\n", "cdr")
    there = {"/robot/left/spec": ("std_msgs/String",), "/robot/left/activity": (ARRAY,)}

    def subscription(topic: str, type_: str, quality: object, arrived: Callable[[Arrival], None]) -> SimpleNamespace:
        assert topic == "/robot/left/spec"
        arrived(Arrival(text, 0, None, type_))
        return SimpleNamespace(close=lambda: None)

    node = SimpleNamespace(topics=lambda: there, subscription=subscription, encoding="cdr")
    found = find(cast(Node, node), "left", lambda: False)
    assert found is not None
    assert (found.compiled.name, found.base) == ("a", "/robot/left")
    listening = Listening(found.compiled, 2, Wanted(), print, base=found.base)
    assert list(listening.streams) == ["/robot/left/activity"]
