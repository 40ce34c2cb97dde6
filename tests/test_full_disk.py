"""A full disk: every command says for which file there was no room, and nothing that does not help."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from neurovis_spec.cli.commands import neurovis

SPEC = """neurovis: 1
name: x
inputs: {u: {expression: sin(k)}}
neurons: {A: {input: u}, B: {}}
connections: {A -> B: {weight: 1, plasticity: hebbian}}
outputs: {y: B}
"""
NO_ROOM = os.strerror(errno.ENOSPC)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.yaml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def filled(monkeypatch: pytest.MonkeyPatch, word: str) -> None:
    """There is no room any more for files that have a word in their path."""
    real = os.fsync

    def fsync(number: int) -> None:
        if word in os.readlink(f"/proc/self/fd/{number}"):  # noqa: PTH115
            raise OSError(errno.ENOSPC, NO_ROOM)
        real(number)

    monkeypatch.setattr(os, "fsync", fsync)


def call(arguments: str) -> Result:
    return CliRunner().invoke(neurovis, arguments.split())


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ("run x.yaml --steps 3 -o FULL.npz", "FULL.npz"),
        ("run x.yaml --steps 3 -o FULL.csv", "FULL.csv"),
        ("run x.yaml --steps 3 -o FULL.mcap", "FULL.mcap"),
        ("run x.yaml --steps 3 -o y.npz --checkpoint FULL.state", "FULL.state"),
        ("run x.yaml --steps 3 --checkpoint FULL.state", "FULL.state"),
        ("render x.yaml -o FULL.svg", "FULL.svg"),
        ("animate x.yaml --steps 2 -o FULL.svg", "FULL.svg"),
        ("layout x.yaml -o FULL.yaml", "FULL.yaml"),
        ("fmt FULL.yaml", "FULL.yaml"),
        ("sweep x.yaml --over seed=1 --metric mean(B) --steps 3 --jobs 1 -o FULL.csv", "FULL.csv"),
        ("analyze x.yaml -o measures", "measures/FULL"),
        ("export x.yaml --to c -o exported", "exported/FULL"),
    ],
)
def test_it_names_the_file(folder: Path, monkeypatch: pytest.MonkeyPatch, arguments: str, name: str) -> None:
    if arguments.startswith("fmt"):
        (folder / "FULL.yaml").write_text(SPEC.replace("u}", "u }"), encoding="utf-8")
    word = "FULL"
    if "/" in name:  # every file within a folder
        word, name = name.partition("/")[0], name.partition("/")[0] + "/"
    filled(monkeypatch, word)
    result = call(arguments)
    assert result.exit_code == 1, result.output
    assert result.stderr.splitlines()[-1].startswith(f"error: {name}")
    assert NO_ROOM in result.stderr.splitlines()[-1]
    assert "help:" not in result.stderr
    if not arguments.startswith(("fmt", "sweep")):  # a table grows where it is
        assert not (folder / name).is_file()


def test_a_device_that_is_full_is_named(folder: Path) -> None:
    for name in ("full.npz", "full.svg"):
        (folder / name).symlink_to("/dev/full")
    for arguments, name in (("run x.yaml --steps 3", "full.npz"), ("render x.yaml", "full.svg")):
        result = call(f"{arguments} -o {name}")
        assert (result.exit_code, result.stderr) == (1, f"error: {name} cannot be written: {NO_ROOM}\n")


def test_a_film_for_which_there_is_no_room_needs_no_other_ffmpeg(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = folder / "ffmpeg"
    program.write_text(f"#!/bin/sh\ncat > /dev/null\necho 'av_interleaved_write_frame(): {NO_ROOM}' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr("neurovis_renderers.video.ffmpeg", lambda: str(program))
    result = call("animate x.yaml --steps 2 -o film.mp4")
    assert (result.exit_code, result.stderr) == (1, f"error: film.mp4 cannot be written: {NO_ROOM}\n")


def test_an_ffmpeg_without_the_encoder_is_to_be_replaced(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = folder / "ffmpeg"
    program.write_text("#!/bin/sh\ncat > /dev/null\necho \"Unknown encoder 'libx264'\" >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr("neurovis_renderers.video.ffmpeg", lambda: str(program))
    result = call("animate x.yaml --steps 2 -o film.mp4")
    assert "ffmpeg failed: Unknown encoder 'libx264'\nhelp: install ffmpeg" in result.stderr
