"""The SVG of a step: what programs read from it, exactly; and that it is well-formed and keeps to itself."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hand_networks import C, Case, G, network, plain_gains, straight_layout, use_case_1
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_renderers.svg import SvgRenderer, escape, exact, num, path

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import encoding
from neurovis_spec.scene.film import scene_of_step
from neurovis_spec.scene.themes import THEMES, channels

NS = "{http://www.w3.org/2000/svg}"
CASE = use_case_1(400)
ACTIVITY, SIGNAL, THICKNESS, CHANGE = 2.5, 3.5, 5.3, 310.0


def drawn(case: Case = CASE, step: int = 160, theme: str = "default") -> bytes:
    gains = plain_gains(case.network, ACTIVITY, SIGNAL, THICKNESS, CHANGE)
    scene = scene_of_step(case.network, case.layout, case.snapshot(step), gains, RenderSettings(theme=theme))
    return SvgRenderer().draw(scene, ".svg")


def plain_colour(theme: str, value: float) -> str:
    """Eqs. 2 and 3 by hand: clipped, linear in sRGB, rounded."""
    value = max(-1.0, min(1.0, value))
    chosen = THEMES[theme]
    end, middle = channels(chosen.negative if value < 0 else chosen.positive), channels(chosen.zero)
    return "#" + "".join(f"{round(m + (e - m) * abs(value)):02x}" for m, e in zip(middle, end, strict=True))


def groups(root: ET.Element, key: str) -> list[ET.Element]:
    return [g for g in root.iter(NS + "g") if key in g.attrib]


@pytest.mark.parametrize("theme", sorted(THEMES))
@pytest.mark.parametrize("step", [0, 1, 160, 399])
def test_fill_stroke_and_width_follow_equations_2_to_5(theme: str, step: int) -> None:
    root = ET.fromstring(drawn(step=step, theme=theme))
    names, wires = CASE.network.neurons.names, CASE.network.connections
    circles = {g.attrib["data-neuron"]: next(g.iter(NS + "circle")) for g in groups(root, "data-neuron")}
    assert list(circles) == list(names)
    for index, name in enumerate(names):
        assert circles[name].attrib["fill"] == plain_colour(theme, ACTIVITY * CASE.activity[step, index])
    lines = {g.attrib["data-connection"]: g for g in groups(root, "data-connection")}
    assert len(lines) == len(wires)
    for index, name in enumerate(CASE.network.connection_names):
        paths = list(lines[name].iter(NS + "path"))
        line = next(p for p in paths if p.attrib.get("class") != "glow")
        a, w = float(CASE.activity[step, wires.sources[index]]), float(CASE.weights[step, index])
        assert line.attrib["stroke"] == plain_colour(theme, SIGNAL * a * w)
        assert float(line.attrib["stroke-width"]) == max(0.6, abs(THICKNESS * w))
        before = float(CASE.weights[step - 1, index]) if step else w
        light = abs(CHANGE * (w - before))
        glows = [p for p in paths if p.attrib.get("class") == "glow"]
        assert len(glows) == (light >= encoding.FAINTEST)
        if glows:
            assert glows[0].attrib["stroke"] == THEMES[theme].glow
            assert float(glows[0].attrib["stroke-width"]) > float(line.attrib["stroke-width"])


def test_every_item_has_a_title_and_the_ends_as_data() -> None:
    root = ET.fromstring(drawn())
    for g in groups(root, "data-connection"):
        assert g.attrib["data-connection"] == f"{g.attrib['data-from']} -> {g.attrib['data-to']}"
        title = g[0]
        assert title.tag == NS + "title"
        assert "weight" in (title.text or "")
    for g in groups(root, "data-neuron"):
        assert g[0].tag == NS + "title"
        assert (g[0].text or "").startswith(g.attrib["data-neuron"])
    whole = root.find(NS + "title")
    assert whole is not None
    assert (whole.text or "").startswith("Function approximation")


def test_one_file_without_script_link_or_reference() -> None:
    text = drawn().decode()
    assert not re.search(r"<script|<a\b|href|url\(|@import|<foreignObject|<image|\bon\w+=", text, re.IGNORECASE)
    assert re.findall(r"https?://[^\"]+", text) == ["http://www.w3.org/2000/svg"]


def test_the_background_is_opaque_and_covers_everything() -> None:
    root = ET.fromstring(drawn(theme="dark"))
    first = next(root.iter(NS + "rect"))
    _, _, width, height = root.attrib["viewBox"].split()
    assert (first.attrib["width"], first.attrib["height"], first.attrib["fill"]) == (width, height, "#0d1117")


def test_the_same_scene_gives_the_same_bytes_and_few_of_them() -> None:
    assert drawn() == drawn()
    assert len(drawn()) < 24 * 1024


def test_connections_that_share_both_ends_are_told_apart_by_data_index() -> None:
    made = network([G("A", ("A", "B"))], [C("A", "B", 0.5, 2), C("A", "B", 0.7, 1), C("B", "A")])
    layout = straight_layout(made, {"A": (0, 0), "B": (2, 0)})
    case = Case(made, layout, np.zeros((1, 2)), made.connections.weights.whole()[None])
    root = ET.fromstring(drawn(case, 0))
    told = {(g.attrib["data-connection"], g.attrib.get("data-index")) for g in groups(root, "data-connection")}
    assert told == {("A -> B", "1"), ("A -> B", "2"), ("B -> A", None)}


HOSTILE = [
    "<script>x</script>",
    'a"b',
    "x\x00\x1b\ufffe",
    "&amp;&#0;",
    "]]>",
    "\n\t",
    "é中\U0001f600",
    "A" * 500,
]


@pytest.mark.parametrize("words", HOSTILE)
def test_hostile_texts_give_valid_xml_that_says_the_same(words: str) -> None:
    made = network([G("A", ("A",), labels=(words,), box=words)], [C("A", "A")], title=words)
    layout = straight_layout(made, {"A": (0, 0)})
    case = Case(made, layout, np.zeros((1, 1)), made.connections.weights.whole()[None])
    root = ET.fromstring(drawn(case, 0))
    title = root.find(NS + "title")
    assert title is not None
    clean = re.sub("[\x00\x1b\ufffe]", "\ufffd", words)
    assert (title.text or "").startswith(clean)


@settings(max_examples=100, deadline=None)
@given(st.text())
def test_any_text_reads_back(text: str) -> None:
    if any("\ud800" <= c <= "\udfff" for c in text):
        return
    read = ET.fromstring(f"<t>{escape(text)}</t>").text or ""
    allowed = [c if c in "\t\n\r" or (c >= " " and c not in "\ufffe\uffff") else "\ufffd" for c in text]
    assert read == "".join(allowed)


@given(st.floats(0, 1e6))
def test_widths_read_back_exactly(value: float) -> None:
    assert float(exact(value)) == value


@given(st.floats(-1e5, 1e5))
def test_lengths_are_short_and_close(value: float) -> None:
    assert abs(float(num(value)) - value) <= 0.00501
    assert re.fullmatch(r"-?(\d+(\.\d{1,2})?|\.\d{1,2})", num(value))


def test_path_data_is_unambiguous() -> None:
    assert path([(0.5, -1), (2, 0.25), (-3, -0.5), (1, 1)]) == "M.5-1C2 .25-3-.5 1 1"


def test_values_that_are_no_numbers_are_drawn() -> None:
    case = replace(CASE, activity=np.full_like(CASE.activity, np.nan), weights=np.full_like(CASE.weights, np.inf))
    root = ET.fromstring(drawn(case))
    for circle in (next(g.iter(NS + "circle")) for g in groups(root, "data-neuron")):
        assert circle.attrib["fill"] == "#1f2328", "the colour of texts, which no activity has"
    assert "nan" not in ET.tostring(root, "unicode").replace("data-", "").lower()


def test_films_are_another_renderers() -> None:
    assert ".svg" not in SvgRenderer.capabilities.films
