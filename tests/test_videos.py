"""Films as files that are written while they are made: their frames, colours and lengths, killed, without ffmpeg."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner
from neurovis_renderers import video
from neurovis_renderers.canvas import paint
from neurovis_renderers.video import VideoRenderer, ffmpeg
from PIL import Image
from test_raster import short_film

from neurovis_spec import api, compiled, pipeline
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Layout
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene import Film, film, still
from neurovis_spec.scene import film as scene_film
from neurovis_spec.scene import plan as scene_plan
from neurovis_spec.scene.film_size import thinned
from neurovis_spec.scene.renderers import RendererError

SPEC = """neurovis: 1
name: film
time: {steps: 60, dt: 0.1}
inputs: {touch: {expression: 0}}
neurons: {A: {activation: tanh, initial: 0.5}, B: {activation: tanh, input: touch}}
connections: {A -> B: {weight: 1, plasticity: hebbian}, B -> A: {weight: -1.5}, A -> A: {weight: 0.9}}
render: {size: [241, 199]}
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "film.yaml"
    path.write_text(SPEC, encoding="utf-8")
    return path


def described(path: Path) -> str:
    """What ffmpeg says of a file."""
    program = ffmpeg()
    assert program is not None
    command = [program, "-hide_banner", "-i", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr


def decoded(path: Path) -> npt.NDArray[np.uint8]:
    """The frames of a video, (frames, height, width, 3); what is broken at its end is left out."""
    program = ffmpeg()
    assert program is not None
    said = subprocess.run(
        [program, "-hide_banner", "-i", str(path)], capture_output=True, text=True, check=False
    ).stderr
    found = re.search(r", (\d+)x(\d+)[, ]", said)
    assert found, said
    wide, high = int(found[1]), int(found[2])
    command = [program, "-v", "quiet", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]
    data = subprocess.run(command, capture_output=True, check=False).stdout
    return np.frombuffer(data, np.uint8).reshape(-1, high, wide, 3)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_video_has_the_films_frames_in_their_colours(suffix: str, tmp_path: Path) -> None:
    filmed, told = short_film(), list[int]()
    path = tmp_path / f"film{suffix}"
    path.write_bytes(VideoRenderer().animate(filmed, suffix, lambda done, total: told.append(done)))
    seen = decoded(path)
    assert told == [1, 2, 3, 4, 5, 6]
    assert len(seen) == filmed.frames
    for frame in (0, 3, 5):
        meant = paint(still(filmed, frame)).astype(int)
        shown = seen[frame, : meant.shape[0], : meant.shape[1]]
        assert np.abs(shown - meant).mean() < 2
        disc = next(s for g in filmed.scene.groups if g.id == filmed.fills[0] for s in g.shapes)
        x, y = (round(filmed.scene.density * side) for side in (disc.centre[0], disc.centre[1] + 0.6 * disc.radius))  # type: ignore[union-attr]
        assert np.abs(shown[y, x] - meant[y, x]).max() < 20


def test_a_video_has_an_even_number_of_rows_and_columns(tmp_path: Path) -> None:
    assert video._even(np.zeros((7, 9, 3), np.uint8)).shape == (8, 10, 3)
    assert video._even(np.zeros((8, 10, 3), np.uint8)).shape == (8, 10, 3)


def test_a_video_says_its_colours_and_its_fragments(spec: Path, tmp_path: Path) -> None:
    path = tmp_path / "film.MP4"
    api.compile(spec).animate(path, inputs={"touch": 0.2})
    data = path.read_bytes()
    assert data.count(b"moof") >= 3  # 6 s, two a fragment
    assert data.index(b"moov") < data.index(b"moof")
    program = ffmpeg()
    assert program is not None
    said = subprocess.run(
        [program, "-hide_banner", "-i", str(path)], capture_output=True, text=True, check=False
    ).stderr
    assert "yuv420p(tv, bt709" in said
    assert "10 fps" in said
    assert len(decoded(path)) == 60


def test_a_film_that_is_killed_can_be_played(spec: Path, tmp_path: Path) -> None:
    (tmp_path / "touch.csv").write_text("touch\n0.1\n", encoding="utf-8")
    command = [sys.executable, "-m", "neurovis_spec", "animate", str(spec), "-o", "film.mp4", "--steps", "100000"]
    command += ["--every", "1", "--input", "touch=touch.csv"]
    running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    part, end = tmp_path / ".film.mp4.part", time.monotonic() + 60
    while not (part.exists() and part.read_bytes().count(b"moof") >= 3):
        assert running.poll() is None
        assert time.monotonic() < end
        time.sleep(0.05)
    os.kill(running.pid, signal.SIGKILL)
    running.wait()
    assert not (tmp_path / "film.mp4").exists()
    shutil.copy(part, tmp_path / "left.mp4")
    assert len(decoded(tmp_path / "left.mp4")) >= 2 * 10  # a second each


@pytest.mark.parametrize(("suffix", "mark"), [(".mp4", b"moof"), (".webm", b"\x1f\x43\xb6\x75")])
def test_what_there_is_of_a_film_can_be_played_when_the_encoder_is_killed(
    suffix: str, mark: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it has not written by then is lost, and nothing else."""
    started: list[subprocess.Popen[bytes]] = []

    class Seen(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *given: object, **more: object) -> None:
            super().__init__(*given, **more)  # type: ignore[call-overload]
            started.append(self)

    filmed, path = replace(short_film(), fps=3.0), tmp_path / f"film{suffix}"

    def parts() -> Iterator[Film]:
        for _ in range(12):
            yield filmed
        end = time.monotonic() + 60
        while path.read_bytes().count(mark) < 8:
            assert time.monotonic() < end
            time.sleep(0.02)
        started[-1].kill()
        yield filmed

    assert ffmpeg() is not None  # found before the starts are counted
    monkeypatch.setattr(subprocess, "Popen", Seen)
    with path.open("wb") as file, pytest.raises(RendererError, match="ffmpeg failed"):
        VideoRenderer().stream(parts(), 13 * 6, suffix, file)
    assert 7 * 6 <= len(decoded(path)) < 13 * 6


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_video_begins_at_0_and_says_how_long_it_is_and_what_its_colours_are(suffix: str, tmp_path: Path) -> None:
    """So that players show it whole, can go to any place, and need not guess."""
    filmed = replace(short_film(), fps=3.0)
    with (tmp_path / f"film{suffix}").open("wb") as file:
        VideoRenderer().stream(iter([filmed] * 3), 18, suffix, file)
    (tmp_path / f"held{suffix}").write_bytes(VideoRenderer().animate(filmed, suffix))
    for name, seconds in (("film", "06.00"), ("held", "02.00")):
        said = described(tmp_path / f"{name}{suffix}")
        assert f"Duration: 00:00:{seconds}, start: 0.000000" in said
        assert "yuv420p(tv, bt709, " in said  # not bt709/unknown/unknown
    assert suffix == ".mp4" or b"\x1c\x53\xbb\x6b" in (tmp_path / "film.webm").read_bytes()  # an index


def test_ctrl_c_ends_a_film_and_leaves_nothing(spec: Path, tmp_path: Path) -> None:
    """The signal reaches all processes of a terminal; what was there before stays."""
    (tmp_path / "film.mp4").write_bytes(b"before")
    command = [sys.executable, "-m", "neurovis_spec", "animate", str(spec), "-o", "film.mp4", "--steps", "100000"]
    running = subprocess.Popen(
        [*command, "--every", "1"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    )
    part, end = tmp_path / ".film.mp4.part", time.monotonic() + 60
    while not (part.exists() and part.read_bytes().count(b"moof") >= 3):
        assert time.monotonic() < end
        time.sleep(0.05)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert (running.returncode, said) == (130, b"\nstopped\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.mp4", "film.yaml"]
    assert (tmp_path / "film.mp4").read_bytes() == b"before"


def test_without_ffmpeg_a_video_is_refused_before_anything_is_run(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video, "find_spec", lambda name: None)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(compiled.CompiledNetwork, "run", lambda *_, **__: pytest.fail("a run"))
    done = CliRunner().invoke(neurovis, ["animate", str(spec), "-o", str(tmp_path / "film.mp4")])
    assert done.exit_code == 1
    assert "'.mp4' is not installed" in done.stderr
    assert 'pip install "neurovis-spec[video]"' in done.stderr
    assert not list(tmp_path.glob("*film.mp4*"))


def test_an_ffmpeg_that_fails_is_quoted_and_leaves_nothing(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 1\n", encoding="utf-8")
    fake.chmod(0o755)
    monkeypatch.setattr(video, "ffmpeg", lambda: str(fake))
    with pytest.raises(RendererError, match="Unknown encoder"):
        api.compile(spec).animate(tmp_path / "film.mp4")
    assert not list(tmp_path.glob("*film.mp4*"))


@pytest.mark.parametrize("suffix", [".mp4", ".gif", ".webp"])
def test_a_film_is_made_of_parts_that_hold_few_frames(
    suffix: str, spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So memory does not grow with the frames; what is shown is the same, from a run and from a recording."""
    network, held = api.compile(spec), list[int]()
    network.animate(tmp_path / f"whole{suffix}", fps=50, steps=40)
    moving = scene_film.films

    def seen(parts: Iterable[Collection[Snapshot]]) -> Iterator[Collection[Snapshot]]:
        for part in parts:
            held.append(len(part))
            yield part

    def counted(network: Network, layout: Layout, parts: Iterable[Collection[Snapshot]], *more: object) -> object:
        return moving(network, layout, seen(parts), *more)  # type: ignore[arg-type]

    monkeypatch.setattr(scene_film, "films", counted)
    monkeypatch.setattr(pipeline, "_MOST_AT_ONCE", 25)
    network.animate(tmp_path / f"parts{suffix}", fps=50, steps=40)
    assert held == [25, 15]
    whole, parts = ((tmp_path / f"{name}{suffix}").read_bytes() for name in ("whole", "parts"))
    assert len(parts) == pytest.approx(len(whole), rel=0.03)
    network.animate(tmp_path / f"recorded{suffix}", fps=50, recording=network.run(40))
    # gains of a recording are its own, so that numbers in the legend differ
    assert (tmp_path / f"recorded{suffix}").stat().st_size == pytest.approx(len(whole), rel=0.05)


def test_films_that_nobody_asked_to_be_long_are_thinned_and_it_is_said(spec: Path, tmp_path: Path) -> None:
    network = api.compile(spec)
    said = r"of 7,000 steps one in 3 is drawn: 2,334 frames, 233.4 s at 10 a second .*--every 1"
    with pytest.warns(UserWarning, match=said):
        network.animate(tmp_path / "film.svg", steps=7000)
    assert 'dur="233.4s"' in (tmp_path / "film.svg").read_text(encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        network.animate(tmp_path / "film.gif", steps=70, frames=20)
        network.animate(tmp_path / "film.webp", steps=70, every=30)
    for name, frames in (("film.gif", 18), ("film.webp", 3)):
        with Image.open(tmp_path / name) as film:
            assert film.n_frames == frames  # type: ignore[attr-defined]
    assert thinned(3000, None, None) == 1
    assert thinned(3001, None, None) == 2
    assert thinned(100_000, 1, None) == 1


def test_the_command_thins_and_says_so(spec: Path, tmp_path: Path) -> None:
    target = str(tmp_path / "film.svg")
    done = CliRunner().invoke(neurovis, ["animate", str(spec), "-o", target, "--steps", "4000"])
    assert done.exit_code == 0
    assert "of 4,000 steps one in 2 is drawn" in done.stderr
    done = CliRunner().invoke(neurovis, ["animate", str(spec), "-o", target, "--every", "2", "--frames", "9"])
    assert done.exit_code == 2


@pytest.mark.parametrize(
    ("name", "kind"),
    [("a.PNG", "PNG"), ("a.Gif", "GIF"), ("a.WEBP", "WEBP"), ("film.GIF", "GIF"), ("film.WebP", "WEBP")],
)
def test_suffixes_count_in_any_case(name: str, kind: str, spec: Path, tmp_path: Path) -> None:
    command = "animate" if name.startswith("film") else "render"
    more = ["--steps", "3"] if command == "animate" else []
    done = CliRunner().invoke(neurovis, [command, str(spec), "-o", str(tmp_path / name), *more])
    assert done.exit_code == 0, done.output
    with Image.open(tmp_path / name) as picture:
        assert picture.format == kind


def test_inputs_and_engines_are_those_of_a_run(spec: Path, tmp_path: Path) -> None:
    """A picture with an input is that of the recording with it."""
    (tmp_path / "touch.csv").write_text("touch\n" + "0.3\n" * 60, encoding="utf-8")
    given = ["--input", f"touch={tmp_path / 'touch.csv'}"]
    record = str(tmp_path / "run.npz")
    assert CliRunner().invoke(neurovis, ["run", str(spec), "-o", record, *given]).exit_code == 0
    for command in ("render", "animate"):
        made = list[bytes]()
        for more in (given, ["--recording", record], []):
            target = tmp_path / f"{command}{len(made)}.svg"
            done = CliRunner().invoke(neurovis, [command, str(spec), "-o", str(target), "--engine", "circular", *more])
            assert done.exit_code == 0, done.output
            made.append(target.read_bytes())
        assert made[0] == made[1] != made[2]
        both = CliRunner().invoke(neurovis, [command, str(spec), "-o", "x.svg", *given, "--recording", record])
        assert both.exit_code == 2
        assert "give one of the two" in both.stderr


def test_a_png_states_its_dots_an_inch(spec: Path, tmp_path: Path) -> None:
    network = api.compile(spec)
    network.render(tmp_path / "a.png")
    network.render(tmp_path / "b.png", dpi=300)
    with Image.open(tmp_path / "a.png") as a, Image.open(tmp_path / "b.png") as b:
        across = [picture.width / picture.info["dpi"][0] for picture in (a, b)]
        assert b.info["dpi"][0] == pytest.approx(300, abs=0.1)
        assert across[0] == pytest.approx(across[1], rel=0.01)  # as many inches
    with pytest.raises(RendererError, match="too large"):
        network.render(tmp_path / "c.png", dpi=9600)
    with pytest.raises(ValueError, match="above 0"):
        network.render(tmp_path / "c.png", dpi=0)


def test_a_film_in_memory_is_the_one_in_a_file() -> None:
    filmed, file = short_film(), io.BytesIO()
    VideoRenderer().stream(iter([filmed]), filmed.frames, ".mp4", file)
    assert len(file.getvalue()) == pytest.approx(len(VideoRenderer().animate(filmed, ".mp4")), rel=0.01)


@pytest.mark.parametrize(("changes", "plans"), [("", 1), (", plasticity: {oja: {rate: 0.1}}", 3)])
def test_what_stays_the_same_is_planned_anew_only_where_other_weights_are_reached(
    changes: str, plans: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {}}\n"
    network = api.compile_text(f"{text}connections: {{A -> B: {{weight: 0.5{changes}}}}}\n")
    whole, calls = network.network, list[object]()
    plan = scene_plan.plan
    monkeypatch.setattr(film, "plan", lambda *given: calls.append(given) or plan(*given))  # type: ignore[func-returns-value]
    steps = [network.run(9).snapshot(step) for step in range(9)]
    parts = [steps[:3], steps[3:6], steps[6:]]
    made = list(film.films(whole, network.layout().value, parts, network.gains, whole.render, 10.0))
    assert len(calls) == plans
    alone = [film.film(whole, network.layout().value, part, network.gains, whole.render, 10.0) for part in parts]
    assert [one.scene for one in made] == [one.scene for one in alone]
