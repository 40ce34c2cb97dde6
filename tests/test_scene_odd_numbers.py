"""Pictures of numbers that are hard to draw: huge, tiny, infinite, none. Each is drawn, in bounded memory."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.recording import Recording, Snapshot
from neurovis_spec.scene import Disc, RendererCapabilities, Spline, encoding
from neurovis_spec.scene.film import film, still
from neurovis_spec.scene.film_size import MOST_COLOURS, check_film
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.reached import reached
from neurovis_spec.scene.renderers import RendererError, renderer_for
from neurovis_spec.scene.shots import shots_of

TEXT = """neurovis: 1
name: x
time: {{steps: 6}}
neurons: {{A: {{bias: {bias}, activation: identity}}, B: {{count: 2}}}}
connections:
  A -> B: {{weight: {weight}, plasticity: {{hebbian: {{rate: 0.5}}}}}}
  B1 -> B1: {{weight: {weight}}}
  B2 -> A: {{weight: {weight}}}
render: {{size: [320, 240], gain: {{{gain}}}}}
"""
GAINS = (
    "",
    "thickness: 1",
    "thickness: 1e308",
    "thickness: 5e-324",
    "thickness: 0, change: 0, signal: 0, activity: 0",
    "change: 1e308, signal: 1e308, activity: 1e308",
    "change: 5e-324, signal: 5e-324, activity: 5e-324",
)


@pytest.mark.parametrize(("weight", "bias"), [*itertools.product(("1000", "-1e308", "5e-324"), ("0.3", "1e308"))])
def test_every_number_can_be_drawn_without_a_warning_of_numpy(weight: str, bias: str, tmp_path: Path) -> None:
    for place, gain in enumerate(GAINS):
        network = nv.compile_text(TEXT.format(weight=weight, bias=bias, gain=gain))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", message=r".* is (inf|-inf|nan) (at|after) step \d+, in 'x'")
            network.render(tmp_path / f"{place}.svg")
            network.animate(tmp_path / f"m{place}.svg", steps=4)
            network.render(tmp_path / f"{place}.webp")
        content = (tmp_path / f"{place}.svg").read_text(encoding="utf-8")
        assert not re.search(r'"[^"]*\b(nan|inf)\b', content)
        width, height = map(float, re.findall(r'viewBox="0 0 ([^ "]*) ([^ "]*)"', content)[0])
        assert max(map(float, re.findall(r'stroke-width="([^"]*)"', content))) <= 2.1 * np.hypot(width, height)


def test_widths_follow_equation_4_until_they_cover_the_picture() -> None:
    weights, widest = np.array([-3.0, 0.01, 900.0, 1e9, -1e308, np.inf, np.nan]), 2500.0
    widths = encoding.line_width(weights, 2.0, widest)
    assert widths.tolist() == [6.0, encoding.THINNEST, 1800.0, widest, widest, encoding.THINNEST, encoding.THINNEST]
    network = nv.compile_text(TEXT.format(weight=1e6, bias=0, gain="thickness: 1"))
    scene = scene_of(network, network.run(1).snapshot(0))
    lines = [shape.width for group in scene.groups if "connection" in group.data for shape in group.shapes
             if isinstance(shape, Spline)]  # fmt: skip
    assert set(lines) == {2 * np.hypot(scene.width, scene.height)}


_BOUNDED = """
import resource, sys
import neurovis_spec as nv
from neurovis_renderers.raster import PillowRenderer
text, path = sys.argv[1:]
nv.compile_text("{neurovis: 1, name: w, neurons: {A: {}}}").render(path)
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (300 << 20), -1))
nv.compile_text(text).render(path)
"""


@pytest.mark.parametrize(
    "more",
    ["connections: {A -> B: 1000, B -> A: 1e308}", "connections: {A -> B: 3}\nrender: {size: [4096, 3072]}"],
    ids=["wide lines", "many pixels"],
)
def test_a_picture_takes_the_memory_of_its_pixels(more: str, tmp_path: Path) -> None:
    """Not that of a line's pixels for each point along the line, nor that of numbers for all pixels at once."""
    gain = "gain: {thickness: 1}"
    more = more.replace("render: {", "render: {" + gain + ", ") if "render" in more else f"{more}\nrender: {{{gain}}}"
    text = f"neurovis: 1\nname: x\nneurons: {{A: {{bias: 1}}, B: {{}}}}\n{more}\n"
    command = [sys.executable, "-W", "ignore", "-c", _BOUNDED, text, str(tmp_path / "x.png")]
    threads = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, env=threads)
    assert done.returncode == 0, done.stderr


def test_a_film_that_is_too_long_is_refused_before_anything_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {}, B: {}}\nconnections: {A -> B: 1}")
    monkeypatch.setattr(NumpyBackend, "prepare", lambda *_: pytest.fail("it was run"))
    with pytest.raises(RendererError, match=r"20,000 frames of 1280 × 960 pixels is too long: 13,981") as caught:
        network.animate(tmp_path / "x.webp", steps=20_000, every=1)
    for way in ("--steps 13981", "--frames 13981", "'.gif'", "'.mp4'"):
        assert way in str(caught.value.hint)
    with pytest.raises(RendererError, match="of 3 neurons and connections is too long") as caught:
        network.animate(tmp_path / "x.svg", steps=MOST_COLOURS // 3 + 1, every=1)
    for way in (f"--steps {MOST_COLOURS // 3}", f"--frames {MOST_COLOURS // 3}", "'.mp4'"):
        assert way in str(caught.value.hint)
    check_film(network.network, MOST_COLOURS // 3, ".svg", RendererCapabilities())
    for suffix in (".gif", ".mp4"):  # written while they are made
        check_film(network.network, 10**9, suffix, renderer_for(suffix, moving=True).capabilities)
    assert not list(tmp_path.iterdir())


def test_a_film_takes_snapshots_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {}, B: {}}\nconnections: {A -> B: 1}")
    made: list[int] = []
    take = Recording.snapshot

    def counted(recording: Recording, step: int) -> Snapshot:
        made.append(step)
        return take(recording, step)

    monkeypatch.setattr(Recording, "snapshot", counted)
    look = Look(network.network.render, first=2, count=5, fps=1.0)
    found = shots_of(network.network, network.run(7), look).snapshots(network.network)
    assert (len(found), made) == (5, [])
    assert [snapshot.step for snapshot, _ in zip(found, range(3), strict=False)] == [2, 3, 4]
    assert len(made) <= 4


def test_weights_and_activities_of_any_size_have_scales_of_their_own() -> None:
    spec = """neurovis: 1
name: x
time: {steps: 20}
neurons: {S: {bias: 0.5}, H: {count: 3}, Q: {activation: tanh}, E: {initial: 1}, F: {}}
connections: {S -> H: 1e12, H -> Q: 1e-11, S -> Q: 1, Q -> S: -1e30, E -> E: 1e200, E -> F: 1e250}
"""
    network = nv.compile_text(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gains = network.gains
    for index, name in enumerate(network.network.connection_names):
        assert gains.thickness[index] * abs(network.network.connections.weights[index]) < 6, name
    peaks = reached(network.network, network.run(2)).activity
    assert (gains.activity > 0).all()
    assert ((gains.activity * peaks)[:5] < 10).all()


@pytest.mark.filterwarnings("ignore:the activity of A is inf")
def test_a_neuron_without_a_finite_activity_has_a_colour_that_no_number_has(tmp_path: Path) -> None:
    """Also in every frame of a film; the lines from it are those of nothing."""
    spec = "neurovis: 1\nname: x\nneurons: {A: {initial: 1e300}, B: {}}\nconnections: {A -> A: 1e300, A -> B: 0}\n"
    network = nv.compile_text(spec)
    values = encoding.neuron_colour(np.array([-2.0, 0.5, np.inf, -np.inf, np.nan]), 1.0)
    assert np.array_equal(values, [-1, 0.5, np.nan, np.nan, np.nan], equal_nan=True)
    sent, weights = np.array([np.nan, np.inf, 2.0]), np.array([1.0, 0.0, 1.0])
    assert encoding.connection_colour(sent, weights, 1.0).tolist() == [0, 0, 1]
    run, ink = network.run(4), network.settings_for(None)
    made = film(network.network, network.drawn().value, list(map(run.snapshot, range(4))), network.gains, ink, 25.0)
    for step, undefined in enumerate(("", "A", "AB", "AB")):
        picture = scene_of(network, run.snapshot(step), settings=ink)
        for scene in (picture, still(made, step)):
            fills = {group.data["neuron"]: disc.fill for group in scene.groups for disc in group.shapes
                     if isinstance(disc, Disc) and "neuron" in group.data}  # fmt: skip
            assert {name for name, fill in fills.items() if fill == scene.theme.ink} == set(undefined), step
    for suffix in (".svg", ".gif"):
        network.animate(tmp_path / f"x{suffix}", steps=4)
    moving = (tmp_path / "x.svg").read_text()
    assert f"color:{made.scene.theme.ink}" in moving
