"""The view of a body: what its pose looks like from above and from its side, still and moving, and when it is shown."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from bodies_by_hand import HEIGHT, hexapod, posed
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.frames import frames
from neurovis_renderers.svg import SvgRenderer
from PIL import Image as Pillow
from toy_bodies import carted, registered

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import Link, Skeleton, Solid
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.drawing.drawing_settings import Panel
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene import THEMES, Disc, Film, Polygon, Polyline, Rectangle, Scene, Shape, Text, still
from neurovis_spec.scene.body import PLOT, outline
from neurovis_spec.scene.figure import PageGains, figure
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.panels import ViewError
from neurovis_spec.scene.shots import Shots

NS = "{http://www.w3.org/2000/svg}"
SPEC = """
neurovis: 1
name: walker
title: A walker
time: {dt: 0.05, steps: 60}
neurons:
  C1: {initial: 0.2}
  C2: {}
connections:
  C1 -> C1: 1.2
  C2 -> C2: 1.2
  C1 -> C2: -0.3
  C2 -> C1: 0.3
"""
WALKER = nv.compile_text(SPEC)
RUN = WALKER.run()
SOLIDS = (Solid((-9, -9, -1), (9, 9, 0)), Solid((0.3, -0.4, 0), (0.5, 0.3, 0.03)), Solid((40, 40, 0), (41, 41, 1)))
SIDES = ("above", "side")


def walked(turn: float = 0.0, solids: tuple[Solid, ...] = SOLIDS) -> Recording:
    return posed(RUN, *hexapod(len(RUN), turn, solids))


def film(
    recording: Recording, theme: str = "default", rows: int | None = None, size: tuple[int, int] | None = None
) -> Film:
    """The body alone, a frame a row."""
    settings = replace(WALKER.settings_for(theme), size=size)
    steps = np.arange(len(recording) if rows is None else rows)
    look = Look(settings, (Panel("body"),), fps=20.0)
    return figure(WALKER.network, None, look, Shots(recording, steps, steps), PageGains(None, None))


def shapes(scene: Scene, name: str) -> tuple[Shape, ...]:
    return next(group.shapes for group in scene.groups if group.id == name)


def plot(scene: Scene, side: str) -> tuple[float, float, float, float]:
    """Left, top, right, bottom of a drawing."""
    frame = shapes(scene, f"p0:{side}:ground")[0]
    assert isinstance(frame, Rectangle)
    (left, top), wide, high = frame.corner, frame.width, frame.height
    return left, top, left + wide, top + high


def scale(scene: Scene) -> float:
    """User units of a metre, by the scale bar."""
    line, text = shapes(scene, "p0:above:bar")
    assert isinstance(line, Polyline)
    assert isinstance(text, Text)
    return (line.points[-1][0] - line.points[0][0]) / float(text.text.removesuffix(" m"))


def feet(scene: Scene, side: str) -> list[Disc]:
    return [shape for shape in shapes(scene, f"p0:{side}:links") if isinstance(shape, Disc)]


def links(scene: Scene, side: str) -> list[Polyline]:
    """Without what lies around them."""
    return [shape for shape in shapes(scene, f"p0:{side}:links") if isinstance(shape, Polyline)][1::2]


def words(scene: Scene) -> list[str]:
    return [shape.text for shape in scene.shapes() if isinstance(shape, Text)]


# --- what is drawn ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", SIDES)
def test_points_lie_where_the_pose_says_in_metres_of_the_scale_bar(side: str) -> None:
    run = walked()
    scene = still(film(run), 17)
    assert run.pose is not None
    assert run.skeleton is not None
    points = run.pose[17, : 3 * len(run.skeleton.points)].reshape(-1, 3)
    deep = 1 if side == "above" else 2
    metre, (left, _, right, _) = scale(scene), plot(scene, side)
    middle = points[run.skeleton.middle]
    torso = next(line for line in links(scene, side) if line.width == pytest.approx(2 * 0.04 * metre))
    origin_x, origin_y = (left + right) / 2, torso.points[0][1]  # the torso is level and straight ahead
    wanted = {
        tuple(np.round((origin_x + metre * (p[0] - middle[0]), origin_y - metre * (p[deep] - middle[deep])), 6))
        for p in points[list(run.skeleton.feet)]
    }
    assert {tuple(np.round(foot.centre, 6)) for foot in feet(scene, side)} == wanted
    assert len(links(scene, side)) == len(run.skeleton.links) == 19
    assert sorted(line.width / metre / 2 for line in links(scene, side)) == pytest.approx(
        sorted(link.radius for link in run.skeleton.links)
    )


@pytest.mark.parametrize("side", SIDES)
def test_a_wide_link_covers_what_lies_between_its_lines_and_no_more(side: str) -> None:
    """A box of 30 by 10 by 2 cm, turned: as wide and as high on the page, without a gap."""
    run = walked(1.5)
    assert run.pose is not None
    assert run.skeleton is not None
    box = np.array([[x, y, 0.0] for y in (-0.04, 0.04) for x in (-0.14, 0.14)])
    turns = 1.5 * 0.05 * np.arange(len(run))
    turned = np.stack([[np.cos(turns), np.sin(turns), 0 * turns], [-np.sin(turns), np.cos(turns), 0 * turns]])
    corners = np.einsum("ci,ixr->rcx", box[:, :2], turned)
    middles = run.pose[:, :3]
    skeleton = replace(
        run.skeleton,
        points=(*run.skeleton.points, "a", "b", "c", "d"),
        links=(Link(27, 28, 0.01, ((29, 30),)),),
        feet=(),
    )
    pose = np.concatenate([run.pose[:, :81], (corners + middles[:, None]).reshape(len(run), -1)], axis=1)
    scene = still(film(replace(run, pose=pose, skeleton=skeleton)), 20)
    metre = scale(scene)
    around, inside = [shape for shape in shapes(scene, f"p0:{side}:links") if isinstance(shape, Polygon)]
    assert around.points == inside.points
    assert inside.fill == THEMES["default"].zero
    assert inside.margin == pytest.approx(0.01 * metre)
    assert around.margin > inside.margin
    wanted = (corners[20] + middles[20])[:, [0, 1 if side == "above" else 2]] * metre
    drawn = np.array(inside.points)
    assert np.ptp(drawn, axis=0) == pytest.approx(np.ptp(wanted, axis=0), abs=1e-6)
    assert len(drawn) == (4 if side == "above" else 2)


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=24))
def test_an_outline_is_convex_and_holds_all_points(places: list[tuple[int, int]]) -> None:
    found = outline([(float(x), float(y)) for x, y in places])
    assert set(found) <= set(places)
    for (x0, y0), (x1, y1) in zip(found, (*found[1:], found[0]), strict=True):
        turns = [(x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) for x, y in places]
        assert min(turns) >= 0
    if len(found) > 2:
        assert len(set(found)) == len(found)


# --- the way that it took ---------------------------------------------------------------------------------------------


def way(scene: Scene) -> FloatArray:
    (line,) = shapes(scene, "p0:above:way")
    assert isinstance(line, Polyline)
    return np.array(line.points)


def test_from_above_the_way_so_far_lies_on_the_ground() -> None:
    run = walked(2.0)
    made, pose = film(run), run.pose
    assert pose is not None
    left, top, right, bottom = plot(made.scene, "above")
    for frame in (1, 20, 59):
        scene = still(made, frame)
        middle, metre = np.array([(left + right) / 2, (top + bottom) / 2]), scale(scene)
        passed = middle + (pose[: frame + 1, :2] - pose[frame, :2]) * (metre, -metre)
        drawn = way(scene)
        assert drawn[-1] == pytest.approx(middle)
        assert drawn[0] == pytest.approx(passed[0]), "it began within the frame"
        assert all(np.hypot(*(passed - point).T).min() < 1e-6 for point in drawn)
    assert len(way(still(made, 59))) > 10


def test_a_way_is_of_the_whole_run_whatever_frames_are_shown_and_of_one_episode() -> None:
    run = walked()
    assert run.pose is not None
    alone = way(still(film(run), 40))
    settings, steps = replace(WALKER.settings_for("default"), size=None), np.array([40])
    look = Look(settings, (Panel("body"),), fps=20.0)
    made = figure(WALKER.network, None, look, Shots(run, steps, steps), PageGains(None, None))
    shown = way(still(made, 0))
    assert np.ptp(shown, axis=0) / scale(still(made, 0)) == pytest.approx(
        np.ptp(alone, axis=0) / scale(still(film(run), 40))
    )
    pose = run.pose.copy()
    pose[30:, 0 : 3 * 27 : 3] -= 9.0  # it begins again elsewhere
    parted = still(film(replace(run, pose=pose)), 40)
    went = (pose[40, :2] - pose[30, :2]) * (1, -1) * scale(parted)
    assert np.ptp(way(parted), axis=0) == pytest.approx(np.abs(went), abs=1e-6)


def test_a_network_that_is_low_keeps_half_of_the_page() -> None:
    low = nv.compile_text(SPEC + "layout: {engine: grid}\n")
    run, rows = posed(low.run(), *hexapod(len(RUN), 0.0, ())), np.arange(2)
    look = Look(low.settings_for("default"), (Panel("network"), Panel("body")), fps=20.0)
    page = figure(low.network, low.placed(), look, Shots(run, rows, rows), PageGains(low.gains, low.gains)).scene
    frame = next(group for group in page.groups if group.data.get("view") == "body").shapes[0]
    assert isinstance(frame, Rectangle)
    assert page.height - frame.corner[1] <= page.height / 2
    assert 0.35 * PLOT < frame.height < PLOT


def test_from_the_side_the_ground_is_where_feet_that_touch_are() -> None:
    scene = still(film(walked()), 9)
    ground = shapes(scene, "p0:side:world")
    level = next(s.points[0][1] for s in ground if isinstance(s, Polyline) and s.points[0][1] == s.points[1][1])
    lowest = max(foot.centre[1] for foot in feet(scene, "side"))
    assert lowest == pytest.approx(level - scale(scene) * (HEIGHT - 0.1))


@pytest.mark.parametrize("theme", sorted(THEMES))
@pytest.mark.parametrize("side", SIDES)
def test_a_foot_that_touches_is_filled_and_one_in_the_air_hollow(theme: str, side: str) -> None:
    run = walked()
    made, colours = film(run, theme), THEMES[theme]
    assert run.pose is not None
    for frame in (0, 3, 11, 40):
        touching = run.pose[frame, -6:] > 0
        fills = [foot.fill for foot in feet(still(made, frame), side)]
        assert fills.count(colours.box_fill) == (~touching).sum()
        assert 0 < touching.sum() <= 6
        if side == "above":  # from the side those beyond the body are paler
            assert fills == [colours.positive if one else colours.box_fill for one in sorted(touching)]
    said = words(made.scene)
    assert {"touching", "in the air", "from above, forward →"} <= set(said)


@pytest.mark.parametrize("side", SIDES)
def test_a_foot_that_touches_is_seen_where_another_of_its_leg_is_in_the_air(side: str) -> None:
    """As one sensor at the foot, and one at the shin above it."""
    run = walked()
    assert run.pose is not None
    assert run.skeleton is not None
    twice = replace(run.skeleton, feet=run.skeleton.feet * 2)
    pose = np.concatenate([run.pose, np.zeros((len(run), 6))], axis=1)
    scene = still(film(replace(run, pose=pose, skeleton=twice)), 17)
    uppermost = {foot.centre: foot for foot in feet(scene, side)}
    hollow = THEMES["default"].box_fill
    assert sorted(foot.fill != hollow for foot in uppermost.values()) == sorted(run.pose[17, -6:] > 0)


def test_from_the_side_what_is_right_of_the_body_is_drawn_over_what_is_left_of_it_also_after_a_turn() -> None:
    run = walked(turn=np.pi / 2.95)  # at the end it has turned round
    made = film(run)
    for frame in (0, len(RUN) - 1):
        scene = still(made, frame)
        near = [line.stroke == made.scene.theme.zero for line in links(scene, "side")]
        assert near == sorted(near)
        assert near.count(False) == 9
    assert run.pose is not None
    assert np.sign(run.pose[0, 10]) != np.sign(run.pose[-1, 10])


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_the_drawing_follows_the_middle_over_a_ground_that_says_how_far_it_has_come(turn: float) -> None:
    made = film(walked(turn))
    for side in SIDES:
        left, top, right, bottom = plot(made.scene, side)
        for frame in (0, 20, 59):
            scene = still(made, frame)
            metre = scale(scene)
            if turn == 0:
                torso = max(links(scene, side), key=lambda line: line.width)
                assert np.mean(torso.points, axis=0)[0] == pytest.approx((left + right) / 2)
            marks = [shape for shape in shapes(scene, f"p0:{side}:world") if isinstance(shape, Text) and shape.text]
            assert len(marks) >= 3
            for mark in marks:
                at = float(mark.text.removesuffix(" m").replace("−", "-"))
                assert mark.point[0] == pytest.approx((left + right) / 2 + metre * (at - 0.12 * 0.05 * frame))
                assert left <= mark.point[0] <= right
        assert top < bottom
    said = [text for frame in (0, 59) for text in words(still(made, frame)) if "right side" in text]
    assert said == ["from its right side · 0.00 m forward", "from its right side · 0.35 m forward"]


def test_who_walks_backward_is_told_so_and_a_run_counts_from_where_it_began() -> None:
    skeleton, poses = hexapod(len(RUN))
    poses[:, : 3 * len(skeleton.points) : 3] += 7.0
    made = film(posed(RUN, skeleton, poses[::-1].copy()))
    assert "from its right side · 0.35 m back" in words(still(made, len(RUN) - 1))


@pytest.mark.parametrize("turn", [0.0, 2.0])
@pytest.mark.parametrize("size", [None, (900, 260), (300, 500)])
def test_nothing_leaves_its_frame(turn: float, size: tuple[int, int] | None) -> None:
    made = film(walked(turn), size=size)
    for frame in range(0, len(RUN), 7):
        scene = still(made, frame)
        for side in SIDES:
            left, top, right, bottom = plot(scene, side)
            for shape in (*shapes(scene, f"p0:{side}:world"), *shapes(scene, f"p0:{side}:links")):
                match shape:
                    case Polyline():
                        corners = list(shape.points)
                    case Disc():
                        corners = [shape.centre]
                    case Rectangle():
                        x, y = shape.corner
                        corners = [shape.corner, (x + shape.width, y + shape.height)]
                    case _:
                        continue
                for x, y in corners:
                    assert left - 0.01 <= x <= right + 0.01
                    assert top - 0.01 <= y <= bottom + 0.01


def test_of_solids_is_seen_what_stands_in_the_window() -> None:
    made = film(walked())
    for side in SIDES:
        boxes = [s for s in shapes(still(made, 30), f"p0:{side}:world") if isinstance(s, Rectangle)]
        assert len(boxes) == 3
        seen = [box for box in boxes if box.width > 0]
        assert len(seen) == 1  # what is no higher than the ground is the ground
        assert all(box.stroke_width == 0 for box in boxes if box not in seen)
    metre = scale(made.scene)
    (box,) = [s for s in shapes(still(made, 30), "p0:above:world") if isinstance(s, Rectangle) and s.width > 0]
    left, _, right, _ = plot(made.scene, "above")
    assert box.corner[0] == pytest.approx((left + right) / 2 + metre * (0.3 - 0.18))


# --- moving -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_group_has_shapes_of_the_same_kinds_in_all_frames(turn: float) -> None:
    made = film(walked(turn))
    assert len(made.redrawn) == 7
    for redrawn in made.redrawn.values():
        kinds = [[type(shape) for shape in redrawn(frame)] for frame in range(made.frames)]
        assert all(one == other for one, other in pairwise(kinds))


def test_the_animated_svg_shows_in_each_frame_what_its_still_shows() -> None:
    made = film(walked(2.0), rows=25)
    root = ET.fromstring(AnimatedSvgRenderer().animate(made, ".svg"))
    moving = [group for group in root.iter(NS + "g") if group.attrib.get("class") == "moving"]
    assert len(moving) == 7
    for frame in (0, 9, 24):
        drawn = ET.fromstring(SvgRenderer().draw(still(made, frame), ".svg"))
        seen = [shape for group in moving for shape in group if now(shape, "display", frame, 25) != "none"]
        there = [shape for shape in drawn.iter() if shape.tag in {NS + "path", NS + "circle", NS + "text"}]
        by_look = {look(shape, 0, 1) for shape in there}
        for shape in seen:
            if shape.tag != NS + "rect":
                assert look(shape, frame, 25) in by_look
        assert sum(shape.tag == NS + "circle" for shape in seen) == 12
        assert any((shape.text or "").startswith("from its right side") for shape in seen)
    assert ".moving{display:none}" in (style := root.findtext(NS + "style") or "")
    assert ".standing{display:inline}" in style


def now(shape: ET.Element, name: str, frame: int, count: int) -> str | None:
    """An attribute at a frame."""
    for one in shape.findall(NS + "animate"):
        if one.attrib["attributeName"] == name:
            values = one.attrib["values"].split(";")
            if "keyTimes" not in one.attrib:
                return values[frame]
            times = [float(time) for time in one.attrib["keyTimes"].split(";")]
            return next(v for v, t in reversed(list(zip(values, times, strict=True))) if t <= (frame + 0.5) / count)
    return shape.attrib.get(name)


def look(shape: ET.Element, frame: int, count: int) -> tuple[str | None, ...]:
    names = ("d", "cx", "cy", "x", "y", "fill", "stroke", "stroke-width", "stroke-linecap")
    return (shape.tag, shape.text, *(now(shape, name, frame, count) for name in names))


def test_the_pixels_of_a_frame_are_those_of_its_still() -> None:
    made = film(walked(2.0), "dark", rows=4)
    for frame, picture in enumerate(frames(made)):
        assert np.abs(picture.astype(int) - paint(still(made, frame))).max() <= 2


def test_pixels_have_the_colours_of_feet_and_links() -> None:
    made = film(walked(), "dark")
    scene, theme = still(made, 6), THEMES["dark"]
    pixels = paint(scene)
    for shape in feet(scene, "above"):
        x, y = (round(scene.density * value) for value in shape.centre)
        assert tuple(pixels[y, x]) == tuple(int(shape.fill[at : at + 2], 16) for at in (1, 3, 5))
    torso = max(links(scene, "above"), key=lambda line: line.width)
    (x0, y0), (x1, _) = torso.points
    beyond = max(x0, x1) + 0.3 * torso.width  # its ends are round
    assert tuple(pixels[round(scene.density * y0), round(scene.density * beyond)]) == tuple(
        int(theme.zero[at : at + 2], 16) for at in (1, 3, 5)
    )


# --- what may be odd --------------------------------------------------------------------------------------------------


def test_of_a_pose_that_is_not_known_nothing_is_drawn_and_it_is_said() -> None:
    skeleton, poses = hexapod(len(RUN))
    poses[20:30] = np.nan
    poses[40, 5] = np.inf
    made = film(posed(RUN, skeleton, poses))
    for frame, known in ((5, True), (25, False), (40, False), (50, True)):
        scene = still(made, frame)
        numbers = [value for s in scene.shapes() if isinstance(s, Polyline) for point in s.points for value in point]
        assert np.isfinite(numbers).all()
        assert ("its pose is not known" in words(scene)) != known
        inside = [foot for foot in feet(scene, "above") if foot.centre[0] > 0]
        assert len(inside) == (6 if known else 0)
    assert "nan" not in AnimatedSvgRenderer().animate(made, ".svg").decode()


@pytest.mark.parametrize(
    ("skeleton", "pose"),
    [
        (Skeleton(("point",), ()), [1.0, 2.0, 3.0]),
        (Skeleton(("a", "b"), (Link(0, 1, 0.0),)), [0.0] * 6),
        (Skeleton(("a", "b"), (Link(0, 1, 1e3),), (1,)), [-1e6, 0, 0, 1e6, 0, 0, 1]),
        (Skeleton(("a", "b"), (Link(0, 1, 1e-4),), (1,)), [0, 0, 0.001, 0.001, 0, 0, 1]),
    ],
)
def test_a_body_may_be_a_point_or_of_any_size(skeleton: Skeleton, pose: list[float], tmp_path: Path) -> None:
    run = posed(RUN, skeleton, np.tile(np.array(pose, float), (len(RUN), 1)))
    WALKER.render(tmp_path / "x.svg", recording=run)
    WALKER.render(tmp_path / "x.png", recording=run, view="body")
    numbers = [value for element in ET.parse(tmp_path / "x.svg").iter() for value in element.attrib.values()]
    assert not any("nan" in value or "inf" in value for value in numbers if value != "infinite")


# --- when it is shown -------------------------------------------------------------------------------------------------


def views(path: Path) -> list[str]:
    found = [element.attrib.get("data-view", "") for element in ET.parse(path).iter(NS + "g")]
    return [view for view in found if view]


def test_a_recording_with_poses_is_drawn_with_its_body_below_the_network(tmp_path: Path) -> None:
    target, run = tmp_path / "x.svg", walked()
    WALKER.render(target, recording=run)
    assert views(target) == ["body"]
    assert len([e for e in ET.parse(target).iter() if "data-neuron" in e.attrib]) == 2
    WALKER.render(target, recording=run, view="network")
    assert views(target) == []
    WALKER.render(target, recording=RUN)
    assert views(target) == []
    WALKER.animate(target, recording=run, steps=4)
    assert views(target) == ["body"]
    WALKER.render(target, recording=run, view=["body", "traces"])
    assert views(target) == ["body", "traces"]


def test_the_figure_of_a_spec_says_whether_the_body_is_in_it(tmp_path: Path) -> None:
    target, run = tmp_path / "x.svg", walked()
    for wanted in (["traces"], ["body", "traces"]):
        network = nv.compile_text(f"{SPEC}render: {{figure: [{', '.join(wanted)}]}}\n")
        network.render(target, recording=run)
        assert views(target) == wanted


def test_without_poses_the_view_says_that_there_are_none(tmp_path: Path) -> None:
    WALKER.render(tmp_path / "x.svg", recording=RUN, view="body")
    said = [element.text or "" for element in ET.parse(tmp_path / "x.svg").iter(NS + "text")]
    assert "there is no body to show: the recording holds no poses of one" in said


def test_the_view_takes_no_references() -> None:
    with pytest.raises(ViewError, match="the view 'body' shows the whole body: it takes no references"):
        WALKER.render("x.svg", recording=RUN, view="body: C1")


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf", "webp", "gif"])
def test_a_still_of_every_kind_shows_it(suffix: str, tmp_path: Path) -> None:
    run, target = walked(), tmp_path / f"x.{suffix}"
    WALKER.render(target, recording=run, view="body", theme="dark")
    alone = target.stat().st_size
    WALKER.render(target, recording=RUN, view="body", theme="dark")
    assert target.stat().st_size < alone - 2000


def test_a_film_in_pixels_moves(tmp_path: Path) -> None:
    WALKER.animate(tmp_path / "x.gif", recording=walked(), view="body", steps=3)
    with Pillow.open(tmp_path / "x.gif") as picture:
        seen = []
        for frame in range(3):
            picture.seek(frame)
            seen.append(np.asarray(picture.convert("RGB"), int))
    assert all((one != other).any() for one, other in pairwise(seen))


def test_a_page_of_a_stated_size_keeps_it_with_the_body_in_it() -> None:
    run = walked()
    settings = replace(WALKER.settings_for("default"), size=(1000, 900))
    rows = np.arange(3)
    look, gains = Look(settings, (Panel("network"), Panel("body")), fps=20.0), WALKER.gains_for(run)
    made = figure(WALKER.network, WALKER.placed(), look, Shots(run, rows, rows), PageGains(gains, gains))
    assert made.scene.pixels == (1000, 900)


def test_of_a_long_film_no_connection_is_left_out_for_the_room_that_the_body_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "x.svg"
    monkeypatch.setattr("neurovis_spec.scene.files._LARGEST_SVG", 60_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        WALKER.animate(target, recording=walked())
    assert target.stat().st_size > 60_000
    assert len([e for e in ET.parse(target).iter() if "data-connection" in e.attrib]) == 4


def test_the_command_names_the_view(tmp_path: Path) -> None:
    (tmp_path / "walker.yaml").write_text(SPEC)
    given = ["render", str(tmp_path / "walker.yaml"), "-o", str(tmp_path / "x.svg"), "--view"]
    assert CliRunner().invoke(neurovis, [*given, "body"]).exit_code == 0
    assert "body" in CliRunner().invoke(neurovis, [*given, "bodi"]).output


@pytest.mark.parametrize(("given", "wanted"), [("plain", ["body"]), ("bare", [])])
def test_a_network_with_a_body_is_drawn_with_it_where_it_can_be(
    given: str, wanted: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registered(monkeypatch)
    network, target = carted(given), tmp_path / "x.svg"
    network.render(target, step=20)
    assert views(target) == wanted
    network.animate(target, steps=5)
    assert views(target) == wanted
    network.render(target, step=20, view="network")
    assert views(target) == []
    network.render(target, step=20, recording=network.run(30))
    assert views(target) == wanted
