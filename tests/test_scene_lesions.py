"""What an event removes stays in the picture, faintly, from its step on; in films, too."""

from __future__ import annotations

import io
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.raster import PillowRenderer
from neurovis_renderers.svg import SvgRenderer
from PIL import Image
from scenes import file_of, film_of, scene_of

import neurovis_spec as nv
from neurovis_spec.scene import Disc, Film, Scene, Text, channels, still
from neurovis_spec.scene.lesions import FAINT, lesions_of

SPEC = """
neurovis: 1
name: cut
neurons: {A: {count: 3, bias: 0.5}, B: {count: 2}, C: {bias: 1}}
connections:
  A -> B: {weight: 1, pattern: all_to_all}
  B1 -> B2: 0.5
events:
  - {at: 4, lesion: [A2, A1 -> B2]}
  - {from: 6, clamp: {A3: 0, C: 0}}
  - {at: 8, lesion: [B1 -> B2]}
"""
NETWORK = nv.compile_text(SPEC)
GONE_AT_4 = {"A1 -> B2", "A2 -> B1", "A2 -> B2", "A2"}


def scene_at(step: int) -> Scene:
    return scene_of(NETWORK, NETWORK.run(step + 1).snapshot(step))


def film_from(start: int, frames: int) -> Film:
    recording = NETWORK.run(start + frames)
    return film_of(NETWORK, [recording.snapshot(step) for step in range(start, start + frames)])


def faint(scene: Scene) -> set[str]:
    found = [g for g in scene.groups if g.opacity != 1]
    assert {g.opacity for g in found} <= {FAINT}
    return {g.data.get("neuron", g.data.get("connection", "")) for g in found}


def test_lesions_are_found_with_their_steps() -> None:
    names, found = NETWORK.network.connection_names, lesions_of(NETWORK.network)
    assert {names[i]: step for i, step in found.connections.items()} == {
        "A1 -> B2": 4, "A2 -> B1": 4, "A2 -> B2": 4, "B1 -> B2": 8,
    }  # fmt: skip
    assert found.neurons == {1: 4}  # a neuron that is only held at 0 is not


@pytest.mark.parametrize(("step", "gone"), [(3, set()), (4, GONE_AT_4), (7, GONE_AT_4), (8, GONE_AT_4 | {"B1 -> B2"})])
def test_what_is_lesioned_is_faint_from_its_step_on(step: int, gone: set[str]) -> None:
    scene = scene_at(step)
    assert faint(scene) == gone
    for group in scene.groups:
        assert ("lesioned at step" in group.title) == (group.opacity != 1)
    assert "Faint" in {t.text for t in scene.shapes() if isinstance(t, Text)}


def test_a_network_without_lesions_has_nothing_faint() -> None:
    plain = nv.compile_text(SPEC.split("events:")[0])
    assert not lesions_of(plain.network)
    drawn = file_of(scene_of(plain, plain.run(9).snapshot(8)), ".svg")
    assert b"opacity" not in drawn
    assert b"Faint" not in drawn


def test_a_lesioned_connection_keeps_its_width_and_says_its_colour() -> None:
    root = ET.fromstring(SvgRenderer().draw(scene_at(5), ".svg"))
    for step in (3, 5):
        root = ET.fromstring(SvgRenderer().draw(scene_at(step), ".svg"))
        (group,) = [g for g in root.iter() if g.get("data-connection") == "A1 -> B2"]
        path = next(e for e in group if e.tag.endswith("path"))
        place = NETWORK.network.connection_index["A1 -> B2"]
        assert float(path.attrib["stroke-width"]) == NETWORK.gains.thickness[place] * 1
        assert path.attrib["stroke"].startswith("#")
        assert group.get("opacity") == (None if step < 4 else f"{FAINT:.1f}".lstrip("0"))


def test_a_film_shows_the_same_as_its_stills() -> None:
    film = film_from(2, 8)
    for frame in range(8):
        assert faint(still(film, frame)) == faint(scene_at(2 + frame))


def test_an_animation_gives_the_class_from_the_frame_of_the_lesion_on() -> None:
    root = ET.fromstring(AnimatedSvgRenderer().animate(film_from(2, 8), ".svg"))
    (group,) = [g for g in root.iter() if g.get("data-connection") == "B1 -> B2"]
    moving = next(e for e in group if e.tag.endswith("animate"))
    times = [float(t) for t in moving.get("keyTimes", "").split(";") if t]
    values = moving.attrib["values"].split(";")
    shown = [
        values[max(i for i, t in enumerate(times) if t <= (f + 1e-3) / 8)] if times else values[f] for f in range(8)
    ]
    assert ["lesioned" in token.split() for token in shown] == [False] * 6 + [True] * 2
    style = next(e for e in root.iter() if e.tag.endswith("style")).text or ""
    assert f".lesioned{{opacity:{f'{FAINT:.1f}'.lstrip('0')}}}" in style


def test_the_raster_draws_a_faint_group_as_one() -> None:
    """The disc and its label: the background shows through both by as much."""
    scene = scene_at(4)
    picture = np.asarray(Image.open(io.BytesIO(PillowRenderer().draw(scene, ".png"))).convert("RGB"), float)
    (group,) = [g for g in scene.groups if g.data.get("neuron") == "A2"]
    disc = group.shapes[0]
    assert isinstance(disc, Disc)
    x, y = (round(v * scene.density) for v in (disc.centre[0] - 0.7 * disc.radius, disc.centre[1]))
    wanted = 255 + FAINT * (np.array(channels(disc.fill), float) - 255)
    assert np.abs(picture[y, x] - wanted).max() <= 1
