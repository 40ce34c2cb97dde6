"""Lines end as the sign of their weight says: in an arrowhead, or in a bar; in stills, films and rasters alike."""

from __future__ import annotations

import io
import math
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hand_networks import C, Case, numbered, plain_gains, straight_layout, use_case_1
from hand_networks import network as made_of
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.raster import PillowRenderer
from neurovis_renderers.svg import SvgRenderer
from PIL import Image
from test_animated_svg import tokens_at

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import Arrowhead, Film, Scene, Spline, Text, still
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.gains import choose_gains
from neurovis_spec.scene.model import ended

NS = "{http://www.w3.org/2000/svg}"
CASE = use_case_1(140)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)
#: lines of the film whose weight is below 0 in some of its frames only
TURNING = [
    name
    for name, weights in zip(CASE.network.connection_names, CASE.weights.T, strict=True)
    if (weights < 0).any() and (weights >= 0).any()
]


def moving() -> Film:
    steps = [CASE.snapshot(k) for k in range(140)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(), 40)


def ends(scene: Scene) -> dict[str, Arrowhead]:
    return {
        group.data["connection"]: shape
        for group in scene.groups
        if "connection" in group.data
        for shape in group.shapes
        if isinstance(shape, Arrowhead)
    }


def drawn(weights: list[float]) -> Scene:
    count = len(weights)
    names = [f"A{i + 1}" for i in range(count + 1)]
    wires = [C("A1", name, w) for name, w in zip(names[1:], weights, strict=True)]
    network = made_of([numbered("A", count + 1)], wires)
    layout = straight_layout(network, {name: (float(i), 2.0 * (i > 0)) for i, name in enumerate(names)})
    w = np.array(weights)
    case = Case(network, layout, np.ones((1, count + 1)), w[None])
    return scene_of_step(network, layout, case.snapshot(0), plain_gains(network, 1, 1, 2, 1), RenderSettings())


def test_a_bar_means_less_than_nothing() -> None:
    found = ends(drawn([2.0, -2.0, 0.0, -0.0, -1e-300, math.nan, -math.inf]))
    assert [found[name].kind for name in sorted(found)] == ["arrow", "bar", "arrow", "arrow", "bar", "arrow", "bar"]


@pytest.mark.parametrize("length", [2.5, 4.0, 10.0])
@pytest.mark.parametrize("width", [0.6, 2.0, 9.0, 40.0])
def test_a_bar_is_flat_where_an_arrow_is_pointed(length: float, width: float) -> None:
    """Near its tip a bar is wider than its line by a pixel and more, and an arrow next to nothing."""
    head = Arrowhead((100.0, 50.0), (0.0, 1.0), length, 0.0, "#000000")
    arrow, bar = (np.array(ended(head, width, "#123456", end).points) for end in (1, -1))
    for corners in (arrow, bar):
        assert corners[:, 1].max() == pytest.approx(50)
    at_tip = [corners[np.isclose(corners[:, 1], 50)][:, 0] for corners in (arrow, bar)]
    assert np.ptp(at_tip[0]) == 0
    assert np.ptp(at_tip[1]) > width + 1.2
    assert bar[:, 1].min() < 50 - head.NOTCH * length  # its stem reaches back to the line
    stem = bar[bar[:, 1] < 50 - 0.5 * length]
    assert np.ptp(stem[:, 0]) == pytest.approx(width)


def test_a_films_frames_end_as_the_stills_do() -> None:
    made = moving()
    assert len(TURNING) >= 4
    for frame in (0, 1, 60, 100, 139):
        alone = scene_of_step(CASE.network, CASE.layout, CASE.snapshot(frame), GAINS, RenderSettings())
        assert ends(still(made, frame)) == ends(alone)
        for name, end in ends(alone).items():
            weight = CASE.weights[frame, CASE.network.connection_index[name]]
            assert end.kind == ("bar" if weight < 0 else "arrow")


def test_an_animated_svg_changes_ends_with_the_signs() -> None:
    root = ET.fromstring(AnimatedSvgRenderer().animate(moving(), ".svg"))
    style = root.findtext(NS + "style") or ""
    for rule in (".less>.both>.bar{display:inline}", ".less>.both>.arrow{display:none}"):
        assert rule in style
    groups = {g.attrib["data-connection"]: g for g in root.iter(NS + "g") if "data-connection" in g.attrib}
    assert [name for name, g in groups.items() if g.find(f"{NS}g[@class='both']") is not None] == sorted(
        TURNING, key=list(groups).index
    )
    for name, group in groups.items():
        weights = CASE.weights[:, CASE.network.connection_index[name]]
        tokens = tokens_at(group, 140)
        assert ["less" in token.split() for token in tokens] == [name in TURNING and w < 0 for w in weights]
        first = [g.attrib for g in group.iter() if g.attrib.get("class") in ("arrow", "bar")]
        hidden = [a["class"] for a in first if a.get("display") == "none"]
        assert hidden == (["bar" if weights[0] >= 0 else "arrow"] if name in TURNING else [])


def test_an_svg_says_which_polygons_are_bars() -> None:
    scene = drawn([2.0, -2.0])
    root = ET.fromstring(SvgRenderer().draw(scene, ".svg"))
    groups = [g for g in root.iter(NS + "g") if "data-connection" in g.attrib]
    assert [next(g.iter(NS + "polygon")).attrib.get("class") for g in groups] == [
        "bar" if end.kind == "bar" else None for end in ends(scene).values()
    ]


def test_a_raster_shows_the_bar() -> None:
    scene = drawn([1.0, -1.0])
    pixels = np.asarray(Image.open(io.BytesIO(PillowRenderer().draw(scene, ".png"))).convert("RGB"), float)
    for end in ends(scene).values():
        (x, y), (dx, dy) = end.tip, end.direction
        at = np.array([x - dx, y - dy])  # a unit behind the tip
        side = 0.8 * end.half_width * np.array([-dy, dx])
        seen = [pixels[tuple(np.floor(scene.density * (at + s)[::-1]).astype(int))] for s in (side, -side)]
        coloured = [np.abs(colour - 255).max() > 60 for colour in seen]
        assert coloured == [end.kind == "bar"] * 2


def test_the_legend_explains_ends_where_a_weight_is_negative_or_may_become_so() -> None:
    def words(scene: Scene) -> set[str]:
        return {shape.text for shape in scene.shapes() if isinstance(shape, Text)}

    assert {"End", "w ≥ 0", "w < 0"} <= words(drawn([1.0, -1.0]))
    assert {"End", "w ≥ 0", "w < 0"} <= words(still(moving(), 0))
    assert "End" not in words(drawn([1.0, 0.5]))
    legend = next(group for group in drawn([-1.0]).groups if group.id == "legend")
    assert [shape.kind for shape in legend.shapes if isinstance(shape, Arrowhead)] == ["arrow", "bar"]
    assert sum(isinstance(shape, Spline) for shape in legend.shapes) >= 2
