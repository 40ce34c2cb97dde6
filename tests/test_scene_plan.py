"""What a picture holds and where: lines end at discs, texts do not touch, everything lies inside."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
from hand_networks import C, Case, G, loop, network, numbered, plain_gains, straight, straight_layout, use_case_1
from hypothesis import given
from hypothesis import strategies as st
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.arrays import IntColumn, integers
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import parts_of
from neurovis_spec.layout.model import Layout, Point
from neurovis_spec.scene import Arrowhead, Disc, Group, Rectangle, Scene, Spline, Text, legend, still, texts
from neurovis_spec.scene.called import names_of
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.gains import choose_gains
from neurovis_spec.scene.geometry import sample, samples
from neurovis_spec.scene.labels import Label
from neurovis_spec.scene.legend_scales import LegendEntry, nice_weights
from neurovis_spec.scene.lines import Line, trimmed
from neurovis_spec.scene.model import Shape
from neurovis_spec.scene.scaling import _MEASURED

CASE = use_case_1(400)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)
PLAIN = (1.0, 1.0, 4.0, 100.0)


def picture(case: Case = CASE, step: int = 160, settings: RenderSettings | None = None) -> Scene:
    return scene_of_step(case.network, case.layout, case.snapshot(step), GAINS, settings or RenderSettings())


def small(made: Network, layout: Layout, settings: RenderSettings | None = None) -> Scene:
    weights = made.connections.weights.whole()
    case = Case(made, layout, np.full((1, len(made.neurons)), 0.5), weights[None])
    return scene_of_step(made, layout, case.snapshot(0), plain_gains(made, *PLAIN), settings or RenderSettings())


def with_data(scene: Scene, key: str) -> dict[str, Group]:
    return {g.data[key] + g.data.get("index", ""): g for g in scene.groups if key in g.data}


def text_rect(text: Text) -> Rect:
    width = texts.width(text.text, text.size, text.weight, text.subscript)
    left = text.point[0] - {"start": 0.0, "middle": width / 2, "end": width}[text.anchor]
    return left, text.point[1] - 0.75 * text.size, left + width, text.point[1] + 0.2 * text.size


def all_texts(scene: Scene) -> list[Text]:
    return [s for s in scene.shapes() if isinstance(s, Text)]


def check_texts(scene: Scene) -> None:
    """No text touches another or leaves the picture; those on no disc touch none."""
    rects = [(t, text_rect(t)) for t in all_texts(scene)]
    for place, (_, one) in enumerate(rects):
        assert one[0] >= 0
        assert one[1] >= 0
        assert one[2] <= scene.width
        assert one[3] <= scene.height
        assert not [t.text for t, other in rects[place + 1 :] if meet(one, other)]
    for shape in scene.shapes():
        if isinstance(shape, Disc):
            (x, y), r = shape.centre, shape.radius
            for text, (x0, y0, x1, y1) in rects:
                if not text.on_disc:
                    assert math.hypot(x - min(max(x, x0), x1), y - min(max(y, y0), y1)) > r, text.text


def check_inside(scene: Scene) -> None:
    dots = []
    for shape in scene.shapes():
        match shape:
            case Spline():
                line = sample(shape.points, 16)
                dots += [line - shape.width / 2, line + shape.width / 2]
            case Disc():
                reach = shape.radius + shape.stroke_width / 2
                dots += [np.array([shape.centre]) - reach, np.array([shape.centre]) + reach]
            case Arrowhead():
                dots.append(np.array(shape.points))
            case Rectangle():
                far = (shape.corner[0] + shape.width, shape.corner[1] + shape.height)
                dots.append(np.array([shape.corner, far]))
            case _:
                pass
    everything = np.concatenate(dots)
    assert everything.min() >= 0
    assert everything[:, 0].max() <= scene.width
    assert everything[:, 1].max() <= scene.height


@pytest.mark.parametrize("settings", [RenderSettings(), RenderSettings(size=(500, 700)), RenderSettings(title=False)])
def test_use_case_1_lies_inside_and_no_text_touches_another(settings: RenderSettings) -> None:
    scene = picture(settings=settings)
    check_texts(scene)
    check_inside(scene)


def test_each_neuron_and_connection_is_there_once_with_its_attributes() -> None:
    scene = picture()
    assert set(with_data(scene, "neuron")) == set(CASE.network.neurons.names)
    lines = with_data(scene, "connection")
    assert set(lines) == set(CASE.network.connection_names)
    assert lines["K1 -> O"].data == {"connection": "K1 -> O", "from": "K1", "to": "O", "delay": "0"}
    assert lines["C1 -> C2"].data["delay"] == "1"
    assert len([g for g in scene.groups if "connection" in g.data]) == 28


def test_titles_say_name_value_and_rule() -> None:
    scene = picture(step=300)
    weight = CASE.weights[300, 21]
    title = with_data(scene, "connection")["K2 -> O"].title
    assert "K2 → O" in title
    assert texts.number(weight, 4) in title
    assert "delta(rate=0.01)" in title
    assert texts.number(CASE.activity[300, 0], 4) in with_data(scene, "neuron")["C1"].title


def test_lines_run_from_rim_to_rim_and_heads_point_at_their_targets() -> None:
    scene = picture()
    discs = {name: g.shapes[0] for name, g in with_data(scene, "neuron").items()}
    for group in with_data(scene, "connection").values():
        line = next(s for s in group.shapes if isinstance(s, Spline) and not s.glow)
        head = next(s for s in group.shapes if isinstance(s, Arrowhead))
        source, target = discs[group.data["from"]], discs[group.data["to"]]
        assert isinstance(source, Disc)
        assert isinstance(target, Disc)
        assert source.radius < math.dist(line.points[0], source.centre) < source.radius + 4
        assert target.radius < math.dist(head.tip, target.centre) < target.radius + 4
        assert math.dist(line.points[-1], head.notch) < 0.6
        dots = sample(line.points, 40)
        for disc in (source, target):
            assert np.hypot(*(dots - np.array(disc.centre)).T).min() > disc.radius


def test_trimming_keeps_the_curve() -> None:
    """Every point of what is drawn lies on the route of the layout."""
    scene = picture()
    discs = {name: g.shapes[0] for name, g in with_data(scene, "neuron").items()}
    one, other = discs["C1"], discs["K8"]
    assert isinstance(one, Disc)
    assert isinstance(other, Disc)
    scale = (other.centre[0] - one.centre[0]) / 4.5
    route = sample(CASE.layout.routes["C1 -> K8"], 4000)
    drawn = next(s for s in with_data(scene, "connection")["C1 -> K8"].shapes if isinstance(s, Spline))
    positions = CASE.layout.positions["C1"]
    for x, y in sample(drawn.points, 10).tolist():
        at = ((x - one.centre[0]) / scale + positions[0], (y - one.centre[1]) / scale + positions[1])
        assert np.hypot(*(route - np.array(at)).T).min() < 2e-3


def test_no_line_crosses_the_title_of_a_box() -> None:
    scene = picture()
    titles = [g.shapes[0] for g in scene.groups if g.id.startswith("title:")]
    assert {t.text.split(" ·")[0] for t in titles if isinstance(t, Text)} == {"rhythm", "kernels"}
    for title in titles:
        assert isinstance(title, Text)
        x0, y0, x1, y1 = text_rect(title)
        for shape in scene.shapes():
            if isinstance(shape, Spline):
                dots = sample(shape.points, 60)
                inside = (dots[:, 0] > x0) & (dots[:, 0] < x1) & (dots[:, 1] > y0) & (dots[:, 1] < y1)
                assert not inside.any()


def test_a_teacher_has_a_dotted_line_and_a_place_in_the_legend() -> None:
    scene = picture()
    taught = [g for g in scene.groups if "signal" in g.data]
    assert [g.data["signal"] for g in taught] == ["T -> O"]
    line = taught[0].shapes[0]
    assert isinstance(line, Spline)
    assert line.dash
    assert "target of delta" in [t.text for t in all_texts(scene)]
    assert "T is the target of delta" in taught[0].title


@pytest.mark.parametrize(
    ("delays", "marked", "words"),
    [
        ((0, 1, 20), (0, 1, 1), "delay 1 … 20, else 0"),
        ((0, 0, 1), (0, 0, 1), "delay 1, else 0"),
        ((1, 1, 20), (0, 0, 1), "delay 20, else 1"),
        ((3, 3, 3), (1, 1, 1), "delay 3"),
        ((1, 1, 1), (0, 0, 0), ""),
        ((0, 0, 0), (0, 0, 0), ""),
    ],
)
def test_signals_that_arrive_later_than_others_have_a_bead_and_a_place_in_the_legend(
    delays: tuple[int, int, int], marked: tuple[int, int, int], words: str
) -> None:
    ends = [("A1", "A2"), ("A2", "A3"), ("A1", "A3")]
    made = network([numbered("A", 3)], [C(a, b, 1.0, delay) for (a, b), delay in zip(ends, delays, strict=True)])
    scene = small(made, straight_layout(made, {"A1": (0, 0), "A2": (1, 2), "A3": (0, 4)}))
    lines = with_data(scene, "connection")
    beads = {name: [s for s in g.shapes if isinstance(s, Rectangle)] for name, g in lines.items()}
    assert [len(beads[f"{a} -> {b}"]) for a, b in ends] == list(marked)
    said = {t.text for t in all_texts(scene)}
    assert ("Bead" in said) == bool(words)
    assert not words or words in said


def test_a_bead_lies_on_the_middle_of_its_line() -> None:
    made = network([numbered("A", 3)], [C("A1", "A2", 1.0, 0), C("A2", "A3", 1.0, 0), C("A1", "A3", 1.0, 20)])
    scene = small(made, straight_layout(made, {"A1": (0, 0), "A2": (1, 2), "A3": (0, 4)}))
    lines = with_data(scene, "connection")
    (bead,) = [s for s in lines["A1 -> A3"].shapes if isinstance(s, Rectangle)]
    line = next(s for s in lines["A1 -> A3"].shapes if isinstance(s, Spline))
    middle = sample(line.points, 2)[1]
    assert (bead.corner[0] + bead.radius, bead.corner[1] + bead.radius) == pytest.approx(tuple(middle))
    assert bead.width == bead.height == 2 * bead.radius


def test_beads_that_are_too_small_to_be_seen_are_not_explained() -> None:
    case = grid(100, 60)
    made = replace(case.network, connections=replace(case.network.connections, delays=_some_delayed(case.network)))
    scene = small(made, case.layout)
    assert not [s for g in scene.groups if "connection" in g.data for s in g.shapes if isinstance(s, Rectangle)]
    assert "Bead" not in {t.text for t in all_texts(scene)}


def _some_delayed(made: Network) -> IntColumn:
    delays = np.ones(len(made.connections), np.int64)
    delays[:5] = 4
    return integers(delays)


def test_a_title_that_lines_have_to_cross_keeps_them_away_from_its_letters() -> None:
    boxed = replace(numbered("B", 2), box="b")
    lines = [C(f"A{i}", f"B{j}", 6.0) for i in range(1, 10) for j in (1, 2)]
    made = network(
        [numbered("A", 9), numbered("D", 9), boxed],
        lines + [C(f"B{j}", f"D{i}", 6.0) for i in range(1, 10) for j in (1, 2)],
    )
    places: dict[str, Point] = {f"{name}{i}": (0.7 * i, y) for name, y in (("A", 0), ("D", 2)) for i in range(1, 10)}
    scene = small(made, straight_layout(made, places | {"B1": (3, 1), "B2": (4, 1)}))
    (title,) = next(g for g in scene.groups if g.id.startswith("title:")).shapes
    assert isinstance(title, Text)
    x0, y0, x1, y1 = text_rect(title)
    dots = np.concatenate([sample(s.points, 60) for s in scene.shapes() if isinstance(s, Spline)])
    crossed = bool(((dots[:, 0] > x0) & (dots[:, 0] < x1) & (dots[:, 1] > y0) & (dots[:, 1] < y1)).any())
    assert not crossed or title.halo == scene.theme.box_fill
    header = next(g for g in scene.groups if g.id == "title").shapes[0]
    assert isinstance(header, Text)
    assert not header.halo


def test_a_title_that_finds_no_room_is_shortened_rather_than_crossed() -> None:
    boxed = replace(numbered("B", 3), box="a box with quite a long name that nobody can place")
    made = network([G("A", ("A",)), boxed], [C("A", f"B{i}") for i in (1, 2, 3)])
    scene = small(made, straight_layout(made, {"A": (1, 0), "B1": (0, 2), "B2": (1, 2), "B3": (2, 2)}))
    (title,) = next(g for g in scene.groups if g.id.startswith("title:")).shapes
    assert isinstance(title, Text)
    assert title.text.startswith("a box")
    x0, y0, x1, y1 = text_rect(title)
    for shape in scene.shapes():
        if isinstance(shape, Spline):
            dots = sample(shape.points, 60)
            assert not ((dots[:, 0] > x0) & (dots[:, 0] < x1) & (dots[:, 1] > y0) & (dots[:, 1] < y1)).any()


def test_the_legend_explains_what_there_is_and_nothing_else() -> None:
    words = {t.text for t in all_texts(picture())}
    assert {"Neurons: activity", "Lines: signal w·a", "Thickness: weight |w|", "Glow", "Dotted"} <= words
    made = network([numbered("A", 2)], [C("A1", "A2", 2.0)])
    layout = straight_layout(made, {"A1": (0, 0), "A2": (0, 2)})
    words = {t.text for t in all_texts(small(made, layout))}
    assert {"Colour", "Thickness"} <= words
    assert not {"Glow", "Dotted", "Bead"} & words
    assert not all_texts(small(made, layout, RenderSettings(legend=False, labels=False, title=False)))


def test_the_rows_of_a_legend_are_even() -> None:
    items = [LegendEntry((), float(width)) for width in (250, 250, 100, 100, 100, 100)]
    made = legend.flow([replace(one, shapes=(Text((0, 0), str(one.width), 9, "#000000"),)) for one in items], 890, 0, 0)
    rows = [shape.point[1] for shape in made.shapes if isinstance(shape, Text)]
    assert [rows.count(row) for row in sorted(set(rows))] == [2, 4]  # not 5 and 1, which 890 would hold
    assert legend.height(items, 890) == 2 * items[0].height + 10
    assert legend.height(items, 1020) == items[0].height


def test_the_legend_states_the_gains() -> None:
    made = use_case_1(3)
    gains = plain_gains(made.network, 2.0, 4.0, 5.0, 200.0)
    scene = scene_of_step(made.network, made.layout, made.snapshot(2), gains, RenderSettings())
    words = [t.text for t in all_texts(scene)]
    assert {"−0.5", "+0.5", "−0.25", "+0.25", "|Δw| 0.005 a step"} <= set(words)
    legend = next(g for g in scene.groups if g.id == "legend")
    strokes = [s.width for s in legend.shapes if isinstance(s, Spline) and s.width in (1.0, 2.5, 5.0)]
    assert strokes
    for width in strokes:
        assert texts.number(width / 5.0) in words


def test_a_small_picture_has_a_brief_legend_and_a_smaller_one_has_none() -> None:
    brief, none = (
        {t.text for t in all_texts(picture(settings=RenderSettings(size=size)))} for size in ((560, 420), (200, 150))
    )
    assert "Colour" in brief
    assert any("C → C, …" in words for words in brief)
    assert not {"Colour", "Lines: signal w·a"} & none


def test_the_caption_says_step_time_and_error() -> None:
    (caption,) = next(g for g in picture().groups if g.id == "caption").shapes
    assert isinstance(caption, Text)
    error = CASE.activity[160, 11] - CASE.activity[160, 10]
    assert caption.text == f"step 160 · 8.00 s · error {error:+.2f}".replace("-", "−")


def test_without_a_written_dt_there_are_no_seconds() -> None:
    scene = scene_of_step(replace(CASE.network, dt_given=False), CASE.layout, CASE.snapshot(7), GAINS, RenderSettings())
    assert any(t.text.startswith("step 7 · error") for t in all_texts(scene))


def test_title_true_false_or_a_text() -> None:
    assert "Function approximation" in {t.text for t in all_texts(picture())}
    assert "Other" in {t.text for t in all_texts(picture(settings=RenderSettings(title="Other")))}
    words = {t.text for t in all_texts(picture(settings=RenderSettings(title=False)))}
    assert not {w for w in words if w.startswith(("Function", "step"))}


@pytest.mark.parametrize("size", [None, (420, 600), (900, 300)])
def test_a_long_title_is_in_lines_and_all_else_below_them(size: tuple[int, int] | None) -> None:
    title = "A title of many words that says at length what this network is about, who made it, when, " * 2 + "x" * 90
    scene = picture(settings=RenderSettings(title=title, size=size))
    lines = [s for g in scene.groups if g.id == "title" for s in g.shapes if isinstance(s, Text)]
    assert "".join(line.text for line in lines).replace(" ", "") == title.replace(" ", "")
    assert all(text_rect(line)[2] <= scene.width for line in lines)
    below = [text_rect(s) for g in scene.groups if g.id != "title" for s in g.shapes if isinstance(s, Text)]
    assert min(rect[1] for rect in below) > text_rect(lines[-1])[3] - 1
    discs = [s.centre[1] - s.radius for s in scene.shapes() if isinstance(s, Disc)]
    assert min(discs) > text_rect(lines[-1])[3]


def test_a_title_that_would_take_most_of_a_picture_is_left_out() -> None:
    scene = picture(settings=RenderSettings(title="many words " * 40, size=(300, 260)))
    assert not [g for g in scene.groups if g.id == "title"]


@given(st.text(alphabet="ab cdefw ", max_size=60), st.floats(3, 90))
def test_lines_hold_all_words_and_are_no_wider_than_their_room(text: str, room: float) -> None:
    lines = texts.wrapped(text, 10, room)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert all(texts.width(line, 10) <= room or len(line) == 1 for line in lines)


def test_the_size_is_what_the_author_says() -> None:
    for size in ((300, 200), (1920, 1080), (64, 64)):
        scene = picture(settings=RenderSettings(size=size))
        assert scene.pixels == size
        check_inside(scene)


def test_a_picture_with_room_to_spare_has_more_pixels_for_each_unit() -> None:
    natural = picture(settings=RenderSettings(legend=False))
    assert natural.density > 1
    assert natural.pixels == (natural.width * natural.density, natural.height * natural.density)
    large = picture(settings=RenderSettings(size=(1920, 1080), legend=False))
    assert large.density > 1.8
    assert large.height == pytest.approx(natural.height, abs=8)  # its texts have grown with it
    assert picture(settings=RenderSettings(size=(300, 200))).density == 1  # rather smaller discs than smaller texts


def grid(columns: int, rows: int) -> Case:
    count = columns * rows
    made = network(
        [numbered("N", count)],
        [C(f"N{i + 1}", f"N{(i * 7) % count + 1}") for i in range(count) if (i * 7) % count != i],
    )
    places: dict[str, Point] = {f"N{i + 1}": (float(i % columns), 2.0 * (i // columns)) for i in range(count)}
    return Case(made, straight_layout(made, places), np.full((1, count), 0.5), made.connections.weights.whole()[None])


def test_a_large_network_stays_within_1280_by_960_and_drops_labels_rather_than_piling_them() -> None:
    case = grid(60, 12)
    scene = scene_of_step(
        case.network, case.layout, case.snapshot(0), plain_gains(case.network, *PLAIN), RenderSettings()
    )
    assert scene.pixels <= (1280, 960)
    assert scene.pixels[1] <= 960
    assert len(with_data(scene, "neuron")) == 720
    check_texts(scene)
    check_inside(scene)


def test_long_labels_find_room_or_are_shortened_and_are_whole_in_the_title() -> None:
    long = "a very long label that nobody can draw on a disc"
    made = network([G("A", ("A1", "A2", "A3"), labels=("K1", "knee flexor", long))], [C("A1", "A2"), C("A2", "A3")])
    layout = straight_layout(made, {"A1": (0, 0), "A2": (1, 0), "A3": (2, 0)})
    scene = small(made, layout)
    check_texts(scene)
    groups = with_data(scene, "neuron")
    drawn = {name: [s.text for s in g.shapes if isinstance(s, Text)] for name, g in groups.items()}
    assert [(s.text, s.subscript) for s in groups["A1"].shapes if isinstance(s, Text)] == [("K", "1")]
    assert drawn["A2"] == ["knee flexor"]
    assert " ".join(drawn["A3"]) == long or drawn["A3"][0].endswith("…")
    assert long in groups["A3"].title


def test_numbered_neurons_have_subscripts() -> None:
    label = with_data(picture(), "neuron")["K3"].shapes[1]
    assert isinstance(label, Text)
    assert (label.text, label.subscript) == ("K", "3")


def test_the_subscript_is_the_number_in_the_group_alone() -> None:
    """Whatever the group's own name ends in; so the legend speaks of the whole group."""
    network = nv.compile_text("""
neurovis: 1
name: digits
modules: {leg: {neurons: {CA3: {count: 2, bias: 1}, Ia1: {}}, connections: {CA3 -> Ia1: 1}}}
instances: {left: {module: leg}}
neurons: {StrD2: {count: 12, bias: 1}, K_: {count: 2}, Delta7: {}, D: {count: 2, label: "d{i}"}}
connections: {StrD2 -> Delta7: 1, StrD2 -> K_: {pattern: all_to_all}, Delta7 -> D: 1}
""").network
    said = dict(zip(network.neurons.names, parts_of(network.neurons), strict=True))
    assert (said["StrD21"], said["StrD212"]) == (("StrD2", "1"), ("StrD2", "12"))
    assert (said["K_2"], said["left.CA31"], said["D1"]) == (("K", "2"), ("CA3", "1"), ("d", "0"))
    assert (said["Delta7"], said["left.Ia1"]) == (("Delta", "7"), ("Ia", "1"))  # as the paper's C₀ and C₁
    groups = {"StrD2": "StrD2", "K_": "K", "Delta7": "Delta7", "D": "d", "leg.CA3": "leg.CA3", "leg.Ia1": "leg.Ia1"}
    assert groups.items() <= names_of(network).called.items()


def test_connections_that_share_both_ends_have_an_index() -> None:
    made = network([numbered("A", 2)], [C("A1", "A2", 0.5, 3), C("A1", "A2", 0.7, 1), C("A2", "A1")])
    lines = with_data(small(made, straight_layout(made, {"A1": (0, 0), "A2": (2, 0)})), "connection")
    assert set(lines) == {"A1 -> A21", "A1 -> A22", "A2 -> A1"}
    first = next(s for s in lines["A1 -> A21"].shapes if isinstance(s, Spline))
    assert first.width == 4.0 * 0.7  # by delay first
    assert "index" not in lines["A2 -> A1"].data
    assert lines["A1 -> A22"].data["connection"] == "A1 -> A2"


def test_discs_that_touch_still_have_a_line_and_a_head() -> None:
    made = network([numbered("A", 2)], [C("A1", "A2"), C("A1", "A1")])
    layout = Layout(
        "x", "x", {"A1": (0, 0), "A2": (0.6, 0)}, {"A1 -> A2": straight((0, 0), (0.6, 0)), "A1 -> A1": loop((0, 0), -1)}
    )
    scene = small(made, layout)
    check_inside(scene)
    for group in with_data(scene, "connection").values():
        assert any(isinstance(s, Spline) for s in group.shapes)
        assert any(isinstance(s, Arrowhead) for s in group.shapes)


def test_one_neuron_alone_is_a_picture() -> None:
    made = network([G("A", ("A",))], [])
    scene = small(made, Layout("x", "x", {"A": (0, 0)}, {}))
    check_inside(scene)
    check_texts(scene)


def test_glows_lie_beneath_the_lines_that_cannot_glow() -> None:
    lines = [g for g in picture().groups if "connection" in g.data]
    plastic = [place for place, g in enumerate(lines) if g.data["to"] == "O"]
    assert plastic == list(range(8))


def test_strong_lines_lie_above_weak_ones() -> None:
    made = network([numbered("A", 4)], [C("A1", "A2", -3.0), C("A1", "A3", 0.5), C("A1", "A4", 1.0)])
    scene = small(made, straight_layout(made, {"A1": (0, 0), "A2": (0, 2), "A3": (1, 2), "A4": (2, 2)}))
    assert [g.data["to"] for g in scene.groups if "connection" in g.data] == ["A3", "A4", "A2"]


def test_the_legend_shows_no_weight_heavier_than_the_networks() -> None:
    assert nice_weights(4.0, 1.01) == [0.2, 0.5, 1.0]
    assert nice_weights(-4.0) == [0.5, 1.0, 2.0]
    assert nice_weights(15.0, 0.1) == [0.05, 0.1]
    assert nice_weights(1.0, 0.01) == [0.01]  # all lines are as thin as can be


def test_every_step_has_the_same_geometry_and_a_films_frames_are_the_stills() -> None:
    steps = range(150, 158)
    moving = film(CASE.network, CASE.layout, [CASE.snapshot(k) for k in steps], GAINS, RenderSettings(), 40)
    assert moving.frames == 8
    for frame, step in enumerate(steps):
        frozen, alone = still(moving, frame), picture(step=step)
        assert [g.shapes for g in frozen.groups] == [g.shapes for g in alone.groups]


def test_a_film_needs_a_frame() -> None:
    with pytest.raises(ValueError, match="at least one frame"):
        film(CASE.network, CASE.layout, [], GAINS, RenderSettings(), 40)


def test_curves_are_cut_together_as_they_are_one_by_one() -> None:
    chooser = np.random.default_rng(3)
    routes = [chooser.uniform(0, 9, (1 + 3 * k, 2)) + np.linspace(0, 90, 1 + 3 * k)[:, None] for k in (1, 1, 2, 1, 3)]
    together, alone = trimmed(routes, 4.0, 4.0, air=0.6), [trimmed([route], 4.0, 4.0, air=0.6)[0] for route in routes]
    for one, other, route in zip(together, alone, routes, strict=True):
        assert one == other
        start, end = np.array(one.points[0]), np.array(one.tip)
        assert math.dist(start, route[0]) == pytest.approx(5)
        assert math.dist(end, route[-1]) == pytest.approx(5)
        dots = sample([(x, y) for x, y in route.tolist()], 4000)
        for x, y in one.points[:: len(one.points) - 1]:
            assert np.hypot(dots[:, 0] - x, dots[:, 1] - y).min() < 0.02
    dots = np.concatenate(samples(routes, 8))
    assert np.array_equal(dots, np.concatenate([sample(route, 8) for route in routes]))


def test_beads_of_lines_that_cross_are_apart() -> None:
    network = nv.compile(Path(__file__).parent.parent / "specs" / "sound.yaml")
    scene = scene_of(network, network.run(3).snapshot(2))
    beads = [
        shape
        for group in scene.groups
        if "connection" in group.data
        for shape in group.shapes
        if isinstance(shape, Rectangle)
    ]
    assert len(beads) == 8
    middles = [(bead.corner[0] + bead.width / 2, bead.corner[1] + bead.height / 2) for bead in beads]
    assert all(math.dist(one, other) > beads[0].width for one, other in combinations(middles, 2))


@pytest.mark.parametrize("kind", [*get_args(Shape), Line, Label], ids=lambda kind: kind.__name__)
def test_all_lengths_of_a_shape_are_scaled(kind: type) -> None:
    """A field that holds numbers is a length or a place, but for directions and shares."""
    measures = float, Point, tuple[Point, ...], tuple[float, ...]
    names = {name for name, said in get_type_hints(kind).items() if said in measures}
    assert names - {"direction", "back", "opacity"} == names & _MEASURED
