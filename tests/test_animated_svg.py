"""The animated SVG: what each frame shows, read from its animations; its size; and that it can stand still."""

from __future__ import annotations

import gzip
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hand_networks import use_case_1
from hypothesis import given
from hypothesis import strategies as st
from neurovis_renderers.animated_svg import LETTERS, LEVELS, AnimatedSvgRenderer, animation
from neurovis_renderers.svg import SvgRenderer

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import Film, still
from neurovis_spec.scene.film import film
from neurovis_spec.scene.gains import choose_gains
from neurovis_spec.scene.themes import channels, colours

NS = "{http://www.w3.org/2000/svg}"
CASE = use_case_1(300)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)


def make(frames: int = 128, start: int = 100, fps: float = 40.0) -> Film:
    steps = [CASE.snapshot(k) for k in range(start, start + frames)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(), fps)


FILM = make()
BYTES = AnimatedSvgRenderer().animate(FILM, ".svg")
ROOT = ET.fromstring(BYTES)
STYLE = ROOT.findtext(NS + "style") or ""


def tokens_at(element: ET.Element, frames: int) -> list[str]:
    """The class in each frame, as SMIL's discrete mode says."""
    moving = element.find(NS + "animate")
    if moving is None:
        return [element.attrib["class"]] * frames
    values = moving.attrib["values"].split(";")
    if "keyTimes" in moving.attrib:
        times = [float(t) for t in moving.attrib["keyTimes"].split(";")]
    else:
        times = [k / len(values) for k in range(len(values))]
    assert len(times) == len(values)
    assert times[0] == 0
    result = []
    for frame in range(frames):
        at = (frame + 1e-9) / frames
        result.append(values[max(place for place, t in enumerate(times) if t <= at)])
    return result


def rule(token: str, name: str) -> str:
    """What the style sheet says of a class."""
    found = re.search(rf"\.{token}{{([^}}]*)}}", STYLE)
    assert found, token
    return dict(part.split(":", 1) for part in found[1].split(";"))[name]


def test_each_frame_has_the_colours_of_its_step_within_half_a_level() -> None:
    theme = FILM.scene.theme
    for g in ROOT.iter(NS + "g"):
        if "data-neuron" not in g.attrib:
            continue
        place = CASE.network.neuron_index[g.attrib["data-neuron"]]
        for frame, token in enumerate(tokens_at(g, FILM.frames)):
            (wanted,) = colours(theme, FILM.fill_values[frame, place : place + 1])
            off = np.abs(np.subtract(channels(rule(token, "color")), channels(wanted)))
            assert off.max() <= 150 / (LEVELS - 1) + 1


def test_each_frame_has_the_widths_and_glows_of_its_step() -> None:
    seen = 0
    for g in ROOT.iter(NS + "g"):
        if g.attrib.get("data-to") != "O":
            continue
        place = CASE.network.connection_index[g.attrib["data-connection"]]
        if not FILM.changing[place]:
            continue
        for frame, token in enumerate(tokens_at(g, FILM.frames)):
            _, width, glow, *_ = token.split()
            assert float(rule(width, "--w")) == pytest.approx(FILM.line_widths[frame, place], abs=0.031)
            assert float(rule(glow, "--g")) == pytest.approx(FILM.glow_widths[frame, place], abs=0.04)
            seen += 1
    assert seen == FILM.changing.sum() * 128 >= 6 * 128


def test_it_lasts_its_frames_and_starts_over() -> None:
    moving = list(ROOT.iter(NS + "animate"))
    assert moving
    assert {a.attrib["dur"] for a in moving} == {"3.2s"}
    assert {a.attrib["repeatCount"] for a in moving} == {"indefinite"}
    assert {a.attrib["calcMode"] for a in moving} == {"discrete"}


def test_the_structure_is_that_of_the_still() -> None:
    alone = ET.fromstring(SvgRenderer().draw(still(FILM, 0), ".svg"))
    for key in ("data-neuron", "data-connection"):
        told, other = ([g.attrib[key] for g in r.iter(NS + "g") if key in g.attrib] for r in (ROOT, alone))
        assert told == other
    for one, other_root in ((ROOT, alone), (alone, ROOT)):
        del other_root
        for g in one.iter(NS + "g"):
            if "data-connection" in g.attrib:
                line = next(p for p in g.iter(NS + "path") if p.attrib.get("class") != "glow")
                assert float(line.attrib["stroke-width"]) >= 0.6
    stills = {g.attrib["data-neuron"]: g for g in alone.iter(NS + "g") if "data-neuron" in g.attrib}
    for g in ROOT.iter(NS + "g"):
        if "data-neuron" in g.attrib:
            circle, twin = next(g.iter(NS + "circle")), next(stills[g.attrib["data-neuron"]].iter(NS + "circle"))
            assert circle.attrib == twin.attrib


def test_it_is_small() -> None:
    assert len(BYTES) <= 80 * 1024
    assert len(gzip.compress(BYTES)) <= 16 * 1024


def test_there_are_enough_levels_of_colour() -> None:
    assert LEVELS >= 17
    assert LEVELS % 2 == 1
    assert len({letter.lower() for letter in LETTERS}) >= LEVELS  # pages in quirks mode do not tell case apart
    assert not {"on", "glow", "caption"} & set(LETTERS)


def test_two_films_in_one_page_do_not_share_their_rules() -> None:
    other = ET.fromstring(AnimatedSvgRenderer().animate(make(8, 20), ".svg"))
    assert other.attrib["class"] != ROOT.attrib["class"]
    for root in (ROOT, other):
        rules = re.findall(r"[{},]([^{},]+)(?=[,{][^}]*})", (root.findtext(NS + "style") or "").split("{", 1)[1])
        selectors = [part for part in rules if ":" not in part.split(" ")[0]]
        assert selectors
        assert all(part.startswith(f".{root.attrib['class']} ") for part in selectors)
    assert len(set(re.findall(r"\{color:(#\w{6})", STYLE))) >= 17


def test_all_that_moves_holds_only_without_reduced_motion() -> None:
    assert STYLE.startswith("@media (prefers-reduced-motion:no-preference){")
    assert STYLE.endswith("}}")
    assert {a.attrib["attributeName"] for a in ROOT.iter(NS + "animate")} == {"class"}


def test_no_script_and_no_reference() -> None:
    assert not re.search(rb"<script|href|url\(|@import|\bon\w+=", BYTES)


def test_the_caption_follows() -> None:
    caption = next(g for g in ROOT.iter(NS + "g") if g.attrib.get("class") == "caption")
    (inner,) = caption.findall(NS + "g")
    lines = [t.text for t in inner.findall(NS + "text")]
    shown = [lines[int(token[1:])] for token in tokens_at(inner, FILM.frames)]
    assert shown == list(FILM.captions)
    assert shown[60].startswith("step 160 · 8.00 s · error ")  # type: ignore[union-attr]


def test_a_film_of_one_frame_stands_still() -> None:
    root = ET.fromstring(AnimatedSvgRenderer().animate(make(1), ".svg"))
    assert not list(root.iter(NS + "animate"))


def test_the_same_film_gives_the_same_bytes_and_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    again = AnimatedSvgRenderer().animate(make(), ".svg", lambda done, total: told.append((done, total)))
    assert again == BYTES
    assert told[-1][0] == told[-1][1] > 0


@given(st.lists(st.sampled_from(["a", "b w3 g1", "c"]), min_size=1, max_size=300))
def test_an_animation_shows_each_token_in_its_frame(tokens: list[str]) -> None:
    text = animation(tokens, 2.0)
    element = ET.fromstring(f'<g xmlns="{NS[1:-1]}" class="{tokens[0]}">{text}</g>')
    assert tokens_at(element, len(tokens)) == tokens
