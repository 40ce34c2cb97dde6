"""What may change in a film (fills, lines, shifts): the same in a frame as a scene, in the animated SVG, in pixels."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from types import ModuleType
from typing import Literal
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from neurovis_renderers import apart, moving
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.frames import frames
from neurovis_renderers.moving import Moving, Painter
from neurovis_renderers.raster import PillowRenderer
from neurovis_renderers.svg import SvgRenderer, png
from PIL import Image as Pillow

from neurovis_spec.scene import (
    THEMES,
    Arrowhead,
    Disc,
    Film,
    Group,
    Image,
    Polyline,
    Ramp,
    Rectangle,
    Scene,
    Shape,
    Spline,
    Text,
    channels,
    colours,
    part,
    shifted,
    still,
)

NS = "{http://www.w3.org/2000/svg}"
THEME = THEMES["default"]
INK, EDGE = "#101010", "#202020"

LINE = ((20.0, 10.0), (20.0, 30.0), (20.0, 60.0), (20.0, 90.0))
SCENE = Scene(
    200,
    100,
    THEME,
    "things that change",
    (
        Group((Disc((60, 50), 12, "#969696", EDGE, 1), Disc((60, 50), 4, INK, EDGE, 1)), "disc", {"part": "disc"}),
        Group(
            (Rectangle((100, 40), 20, 20, 0, "#969696", EDGE, 1), Rectangle((105, 45), 5, 5, 0, INK, EDGE, 1)),
            "cell",
            {"part": "cell"},
        ),
        Group((Spline(LINE, INK, 2.0), Text((22, 12), "now", 10, INK)), "cursor", {"part": "cursor"}),
        Group((Text((5, 95), "step 0", 10, INK),), "caption"),
    ),
)
FILM = Film(
    SCENE,
    10.0,
    fills=("disc", "cell"),
    lines=(),
    fill_values=np.array([[0, 0], [1, -1], [-0.5, 0.5]], float),
    line_values=np.zeros((3, 0)),
    line_widths=np.zeros((3, 0)),
    glow_widths=np.zeros((3, 0)),
    line_ends=np.zeros((3, 0), np.int8),
    caption="caption",
    captions=("step 0", "step 1", "step 2"),
    shifts=("cursor",),
    shift_values=np.array([[[0, 0]], [[50, 0]], [[100.5, -4]]], float),
)


def leg(frame: int) -> tuple[Shape, ...]:
    """What is another line, disc and text in each frame."""
    x = 30.0 + 10 * frame
    line = Polyline(((20, 20), (x, 40 + frame)), EDGE if frame else INK, 4.0, round=True)
    return line, Disc((x, 60), 3.0 + frame, INK, EDGE, 1), Text((x, 80), f"{frame // 2} m", 10, INK)


REDRAWN = replace(
    FILM,
    scene=replace(SCENE, groups=(*SCENE.groups[:2], Group(leg(0), "leg", {"part": "leg"}), SCENE.groups[3])),
    shifts=(),
    shift_values=np.zeros((3, 0, 2)),
    redrawn={"leg": leg},
)


def shapes(scene: Scene, name: str) -> tuple[Shape, ...]:
    return next(group.shapes for group in scene.groups if group.id == name)


@pytest.mark.parametrize("frame", range(3))
def test_the_first_disc_or_rectangle_of_a_group_is_filled_and_nothing_else_of_it(frame: int) -> None:
    drawn = still(FILM, frame)
    wanted = colours(THEME, FILM.fill_values[frame])
    for name, fill in zip(("disc", "cell"), wanted, strict=True):
        first, second = shapes(drawn, name)
        assert isinstance(first, Disc | Rectangle)
        assert isinstance(second, Disc | Rectangle)
        assert (first.fill, first.stroke) == (fill, EDGE)
        assert second.fill == INK


@pytest.mark.parametrize("frame", range(3))
def test_a_group_that_is_shifted_moves_as_a_whole(frame: int) -> None:
    line, text = shapes(still(FILM, frame), "cursor")
    x, y = FILM.shift_values[frame, 0]
    assert isinstance(line, Spline)
    assert isinstance(text, Text)
    assert line.points == tuple((a + x, b + y) for a, b in LINE)
    assert text.point == (22 + x, 12 + y)
    assert line.width == 2.0


@pytest.mark.parametrize("frame", range(3))
def test_a_group_that_is_redrawn_has_the_shapes_of_the_frame(frame: int) -> None:
    assert shapes(still(REDRAWN, frame), "leg") == leg(frame)
    assert set(part(REDRAWN, {"leg"}).redrawn) == {"leg"}
    assert not part(REDRAWN, {"disc"}).redrawn


def test_the_frames_of_what_is_redrawn_are_those_of_its_stills() -> None:
    for frame, picture in enumerate(frames(REDRAWN)):
        assert np.abs(picture.astype(int) - paint(still(REDRAWN, frame))).max() <= 1


def test_the_animated_svg_animates_what_changes_of_what_is_redrawn() -> None:
    root = ET.fromstring(AnimatedSvgRenderer().animate(REDRAWN, ".svg"))
    moving, standing = group_of(root, "leg").findall(NS + "g")
    line, disc, first, second = list(moving)
    found = [{one.attrib["attributeName"]: one.attrib["values"] for one in shape} for shape in moving]
    assert set(found[0]) == {"d", "stroke"}
    assert found[1] == {"cx": "30;40;50", "r": "3;4;5"}
    assert (first.text, found[2]["display"], found[2]["x"]) == ("0 m", "inline;inline;none", "30;40;40")
    assert (second.text, found[3]) == ("1 m", {"display": "none;none;inline"})
    assert second.attrib["display"] == "none"
    assert [shape.tag for shape in standing] == [line.tag, disc.tag, first.tag]
    assert standing.attrib["display"] == "none"
    style = root.findtext(NS + "style") or ""
    assert "@media (prefers-reduced-motion:reduce){." in style
    assert ".moving{display:none}" in style


def test_a_polyline_ends_round_where_it_says_so() -> None:
    def drawn(round_: bool) -> Scene:
        line = Polyline(((40, 50), (160, 50)), INK, 20.0, round=round_)
        return replace(SCENE, groups=(Group((line,)),))

    for round_ in (False, True):
        pixels = paint(drawn(round_))
        assert tuple(pixels[50, 100]) == channels(INK)
        for x, y, inside in ((33, 50, True), (166, 50, True), (33, 42, False), (28, 50, False)):
            assert (tuple(pixels[y, x]) == channels(INK)) == (round_ and inside)
        assert (b'stroke-linecap="round"' in SvgRenderer().draw(drawn(round_), ".svg")) == round_


@pytest.mark.parametrize(
    "shape",
    [
        Disc((1, 2), 3, INK, EDGE, 1),
        Spline(((1, 2), (2, 3), (3, 4), (4, 5)), INK, 1),
        Polyline(((1, 2), (2, 3)), INK, 1),
        Arrowhead((1, 2), (0, 1), 8, 3, INK),
        Rectangle((1, 2), 3, 4, 0, INK, EDGE, 1),
        Ramp((1, 2), 3, 4, (INK, EDGE)),
        Image((1, 2), 3, 4, 1, 1, b"abc"),
        Text((1, 2), "a", 10, INK, subscript="1", halo=EDGE),
    ],
)
def test_every_shape_can_be_moved_and_moved_back(shape: Shape) -> None:
    moved = shifted(shape, (2, -1))
    assert moved != shape
    assert shifted(moved, (-2, 1)) == shape


def group_of(root: ET.Element, name: str) -> ET.Element:
    return next(g for g in root.iter(NS + "g") if g.attrib.get("data-part") == name)


def test_the_animated_svg_fills_and_moves_the_same() -> None:
    root = ET.fromstring(AnimatedSvgRenderer().animate(FILM, ".svg"))
    for name, element in (("disc", "circle"), ("cell", "rect")):
        group = group_of(root, name)
        first, second = group.findall(NS + element)
        assert "class" not in first.attrib  # it has the colour of its group's class
        assert second.attrib["class"] == "fixed"
        moving = group.find(NS + "animate")
        assert moving is not None
        assert len(set(moving.attrib["values"].split(";"))) == 3
    cursor = group_of(root, "cursor")
    moving = cursor.find(NS + "animateTransform")
    assert moving is not None
    assert moving.attrib["attributeName"] == "transform"
    assert moving.attrib["type"] == "translate"
    assert moving.attrib["values"] == "0;50;100.5 -4"
    assert (moving.attrib["calcMode"], moving.attrib["dur"]) == ("discrete", "0.3s")
    assert "shifted" in cursor.attrib["class"]
    style = root.findtext(NS + "style") or ""
    assert "@media (prefers-reduced-motion:reduce){." in style
    assert ".shifted{transform:none!important}" in style


def test_a_still_of_the_film_has_its_frames_pixels() -> None:
    for frame in range(3):
        pixels = paint(still(FILM, frame))
        x = int(20 + FILM.shift_values[frame, 0, 0])
        assert tuple(pixels[45, x]) == channels(INK)
        for at, value in ((52, 0), (117, 1)):
            fill = colours(THEME, FILM.fill_values[frame])[value]
            assert tuple(pixels[50 if value == 0 else 57, at]) == channels(fill)


def test_the_frames_of_what_moves_are_those_of_its_stills() -> None:
    upward = Text((150, 90), "up", 12, INK, upward=True)
    more = Group((Rectangle((10, 70), 9, 9, 2, EDGE, INK, 1), Arrowhead((40, 80), (0, 1), 8, 3, INK), upward), "more")
    scene = replace(SCENE, groups=(*SCENE.groups, more))
    shifts = np.concatenate([FILM.shift_values, -0.3 * FILM.shift_values], axis=1)
    film = replace(FILM, scene=scene, shifts=("cursor", "more"), shift_values=shifts)
    for frame, picture in enumerate(frames(film)):
        assert np.abs(picture.astype(int) - paint(still(film, frame))).max() <= 1


@pytest.mark.parametrize(("module", "limit"), [(moving, "FRAMES"), (apart, "_MOST_PIXELS"), (apart, "_MOST")])
def test_what_stands_apart_is_the_same_whatever_is_drawn_at_once(
    module: ModuleType, limit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where it leaves the page, at each side, fades and lies over what moves otherwise."""
    moves = np.array([[[0, 0], [0, 0]], [[-15, 50], [-70, -90]], [[120, -4], [500, 0]]], float)
    dashed = Spline(((25.0, 10.0), (30.0, 30.0), (20.0, 60.0), (29.0, 90.0)), INK, 2.0, dash=(6.0, 3.0))
    there = Group((*leg(2), dashed, *SCENE.groups[1].shapes), "there")
    groups = (SCENE.groups[2], there, Group(leg(0), "leg"), SCENE.groups[3])
    made = replace(
        FILM,
        scene=replace(SCENE, groups=groups),
        fills=(),
        fill_values=np.zeros((3, 0)),
        shifts=("cursor", "there"),
        shift_values=moves,
        redrawn={"leg": lambda frame: tuple(shifted(shape, (-40.0 * frame, 0.0)) for shape in leg(frame))},
        faint={"there": 1},
        faintness=0.3,
    )
    at_once = list(frames(made))
    assert all(np.abs(picture.astype(int) - paint(still(made, at))).max() <= 2 for at, picture in enumerate(at_once))
    monkeypatch.setattr(module, limit, 1)
    painter = Painter(Moving(made))
    assert all(np.array_equal(painter.paint(at), picture) for at, picture in enumerate(at_once))


def test_a_film_in_which_only_a_group_moves_has_its_frames() -> None:
    alone = replace(FILM, fills=(), fill_values=np.zeros((3, 0)))
    assert alone.frames == 3
    with Pillow.open(io.BytesIO(PillowRenderer().animate(alone, ".gif"))) as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]


RNG = np.random.default_rng(7)


@pytest.mark.parametrize("shades", [2, 256, 1000])
def test_cells_are_the_same_in_the_svgs_png_and_in_pixels(shades: int) -> None:
    palette = RNG.integers(0, 256, (shades, 3), np.uint8)
    cells = palette[RNG.integers(0, shades, (30, 50))]
    with Pillow.open(io.BytesIO(png(50, 30, cells.tobytes()))) as picture:
        assert np.array_equal(np.asarray(picture.convert("RGB")), cells)
    image = Image((20, 10), 150, 60, 50, 30, cells.tobytes())
    scene = Scene(200, 100, THEME, "cells", (Group((image,)),))
    pixels = paint(scene)
    assert np.array_equal(pixels[10:70, 20:170], cells.repeat(2, axis=0).repeat(3, axis=1))
    assert (pixels[:10] == 255).all()
    assert (pixels[:, 170:] == 255).all()
    root = ET.fromstring(SvgRenderer().draw(scene, ".svg"))
    element = root.find(NS + "image")
    assert element is not None
    assert element.attrib["href"].startswith("data:image/png;base64,")
    assert (element.attrib["x"], element.attrib["width"]) == ("20", "150")
    assert element.attrib["image-rendering"] == "pixelated"


def alone(*drawn: Shape) -> Scene:
    return Scene(200, 100, THEME, "alone", (Group(drawn),))


def dark(scene: Scene) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """How dark each pixel is, 0 … 1."""
    result: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = 1 - paint(scene).mean(axis=2) / 255
    return result


def test_a_polyline_is_drawn_straight_in_pixels_and_reads_back_from_the_svg() -> None:
    corners = ((10.0, 50.04), (10.44, 20.0), (11.3, 80.0), (60.0, 80.0))
    scene = alone(Polyline(corners, "#000000", 2.0))
    seen = dark(scene)
    assert seen[80, 20:59].min() > 0.4
    assert seen[78:82, 30].sum() == pytest.approx(2, abs=0.05)
    assert seen[:18].max() == 0
    root = ET.fromstring(SvgRenderer().draw(scene, ".svg"))
    path = root.find(NS + "path")
    assert path is not None
    start, steps = path.attrib["d"][1:].split("l")
    numbers = [float(word) for word in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", start + " " + steps)]
    places = np.cumsum(np.array(numbers).reshape(-1, 2), axis=0)
    assert np.abs(places - corners).max() <= 0.051


@pytest.mark.parametrize("anchor", ["start", "middle", "end"])
def test_a_text_that_reads_upward_is_the_level_one_turned(anchor: Literal["start", "middle", "end"]) -> None:
    level = dark(alone(Text((50.25, 60.5), "Ky", 20, "#000000", anchor, subscript="2")))
    turned = dark(alone(Text((60.5, 49.75), "Ky", 20, "#000000", anchor, subscript="2", upward=True)))
    assert level.sum() > 50
    # about (0, 100): (x, y) goes to (y, 100 - x)
    assert np.abs(np.rot90(level)[100:200, 0:100] - turned[:, 0:100]).max() < 1e-9


def test_what_stands_still_is_drawn_in_a_film_as_in_a_still() -> None:
    """Also ends of lines that no connection has: the bar in a legend."""
    ends = (
        Arrowhead((150, 90), (1, 0), 14, 6, INK),
        Arrowhead((180, 90), (1, 0), 14, 6, INK, "bar", 3),
    )
    filmed = replace(FILM, scene=replace(SCENE, groups=(*SCENE.groups, Group(ends, "legend"))))
    for frame, pixels in enumerate(frames(filmed)):
        assert np.abs(pixels.astype(int) - paint(still(filmed, frame))).max() <= 2
