"""Views: what a picture shows beside the network or in its place, still and moving, of all that a run may hold."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from click.testing import CliRunner
from colour_vision import VISIONS, difference
from PIL import Image as Pillow

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.drawing.drawing_settings import Panel
from neurovis_spec.language.words import VIEWS
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene import THEMES, Disc, Film, Group, Image, Polyline, Rectangle, Scene, Text, colours, still
from neurovis_spec.scene.figure import PageGains, figure
from neurovis_spec.scene.heat import strongest
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.matrix import order_of
from neurovis_spec.scene.panels import ViewError, panels_of
from neurovis_spec.scene.series import chosen, full_name
from neurovis_spec.scene.shots import Shots, shots_of
from neurovis_spec.scene.shown import LeftOut
from neurovis_spec.scene.texts import SUBSCRIPT_DROP, width
from neurovis_spec.scene.themes import MOST_DISTINCT, contrast, distinct

NS = "{http://www.w3.org/2000/svg}"
SPEC = """
neurovis: 1
name: pair
title: A pair
time: {dt: 0.1, steps: 120}
inputs: {drive: {expression: sin(k/9)}}
neurons:
  A: {count: 3, model: leaky_integrator, bias: 0.2}
  S: {model: integrate_and_fire, bias: 0.3}
  B: {role: output}
  I: {input: drive}
connections:
  I -> A: 0.8
  S -> B: -0.5
  A -> B: {weight: 0.1, plasticity: {hebbian: {rate: 0.01}}}
outputs: {out: B, membrane: S.v}
"""
FIGURE = """
render:
  figure: [network, traces: [A1..A2, out, membrane, drive], weights: A -> B, raster: [A, S], matrix]
"""
PAIR = nv.compile_text(SPEC)
LAYOUT = PAIR.drawn().value
RUN = PAIR.run()


def film(
    view: object,
    frames: list[int] | None = None,
    size: tuple[int, int] | None = None,
    rows: slice = slice(None),
    network: nv.CompiledNetwork = PAIR,
    recording: Recording | None = None,
    theme: str = "default",
) -> Film:
    """The views of a run as a film of these steps, by default of the last."""
    run = recording or (RUN if network is PAIR else network.run())
    panels = panels_of(network.network, view) or (Panel("network"),)  # type: ignore[arg-type]
    look = Look(replace(network.network.render, size=size, theme=theme), panels, fps=10.0)
    shots = Shots(run, np.arange(len(run))[rows], np.array(frames or [len(run) - 1]))
    gains = PageGains(network.gains, network.gains)
    return figure(network.network, network.drawn().value, look, shots, gains)


def groups(scene: Scene, key: str) -> dict[str, Group]:
    return {group.data[key]: group for group in scene.groups if key in group.data}


def texts(scene: Scene) -> list[str]:
    return [shape.text + shape.subscript for shape in scene.shapes() if isinstance(shape, Text)]


def line(group: Group) -> list[tuple[float, float]]:
    """The points of a curve, without the lead to its name."""
    pieces = [shape.points for shape in group.shapes if isinstance(shape, Polyline) and shape.width > 1]
    return [point for piece in pieces for point in piece]


def cursor(scene: Scene) -> float:
    """Where the cursor stands; in all views at the same place."""
    lines = [group.shapes[0] for group in scene.groups if "cursor" in group.data]
    (x,) = {round(one.points[0][0], 6) for one in lines if isinstance(one, Polyline)}
    return x


# --- what is shown ---------------------------------------------------------------------------------------------------


def test_a_figure_of_a_spec_holds_its_views_from_top_to_bottom(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC + FIGURE)
    network.render(tmp_path / "x.svg")
    root = ET.fromstring((tmp_path / "x.svg").read_bytes())
    found = [
        (key, g.attrib[f"data-{key}"])
        for g in root.iter(NS + "g")
        for key in ("view", "trace")
        if f"data-{key}" in g.attrib
    ]
    assert found == [
        ("view", "traces"),
        *(("trace", name) for name in ("A1", "A2", "B", "S.v", "I")),
        ("view", "weights"),
        *(("trace", f"A{number} -> B") for number in (1, 2, 3)),
        ("view", "raster"),
        ("view", "matrix"),
    ]
    neurons = [g.attrib["data-neuron"] for g in root.iter(NS + "g") if "data-neuron" in g.attrib]
    assert sorted(neurons) == sorted(network.network.neurons.names)
    cells = {g.attrib["data-cell"] for g in root.iter(NS + "g") if "data-cell" in g.attrib}
    assert cells == set(network.network.connection_names)
    assert all((g.findtext(NS + "title") or "") for g in root.iter(NS + "g") if "data-trace" in g.attrib)


def test_a_view_that_names_nothing_shows_what_the_figure_has_of_its_kind_else_what_it_chooses() -> None:
    network = nv.compile_text(SPEC + FIGURE).network
    names = {panel.view: [full_name(one, network) for one in panel.shown or ()] for panel in panels_of(network, None)}
    assert names["traces"] == ["A1", "A2", "B", "S.v", "I"]
    (own,) = panels_of(network, "traces")
    assert [full_name(one, network) for one in own.shown or ()] == names["traces"]
    assert panels_of(network, "network") == ()
    assert panels_of(PAIR.network, "traces") == (Panel("traces"),)
    assert [full_name(one, network) for one in chosen("traces", network)] == ["B", "S.v", "I"]
    assert [full_name(one, network) for one in chosen("weights", network)] == ["A1 -> B", "A2 -> B", "A3 -> B"]
    assert len(chosen("raster", network)) == len(network.neurons)


@pytest.mark.parametrize(
    ("view", "names"),
    [
        ("traces: A, out", ["A1", "A2", "A3", "B"]),
        ({"traces": ["drive", "S.v"]}, ["I", "S.v"]),
        ({"traces": "A1 + A3"}, ["A1", "A3"]),
        (["weights: I + S -> A + B"], ["I -> A1", "I -> A2", "I -> A3", "S -> B"]),
        ("weights: A2 -> B", ["A2 -> B"]),
        ("matrix: A -> B", ["A1 -> B", "A2 -> B", "A3 -> B"]),
        ("raster: A1..A2, B", ["A1", "A2", "B"]),
        ("traces: membrane, membrane", ["S.v"]),
    ],
)
def test_references_of_a_caller(view: object, names: list[str]) -> None:
    (panel,) = panels_of(PAIR.network, view)  # type: ignore[arg-type]
    assert panel.shown is not None
    assert [full_name(one, PAIR.network) for one in panel.shown] == names


@pytest.mark.parametrize(
    ("view", "error", "words"),
    [
        ("rastr", ViewError, "there is no view 'rastr'"),
        ("network: A", ViewError, "takes no references"),
        ("traces: [A, S]", ViewError, "brackets and quotes belong to no view: 'traces: [A, S]'"),
        ("traces: 'A'", ViewError, "brackets and quotes belong to no view"),
        ("traces=A", ViewError, "there is no view 'traces=A'"),
        ("traces: A7", KeyError, "no neuron, group or output 'A7'"),
        ("weights: A", ViewError, "'A' is no connection"),
        ("weights: B -> A", KeyError, "no connection 'B -> A'"),
        ("raster: S.v", ViewError, "a raster shows neurons"),
        ("traces: S.w", KeyError, "no state 'w'"),
    ],
)
def test_what_a_caller_cannot_have_is_refused_before_anything_is_run(
    view: str, error: type[Exception], words: str, tmp_path: Path
) -> None:
    with pytest.raises(error, match=re.escape(words)):
        PAIR.render(tmp_path / "x.svg", view=view)
    (tmp_path / "pair.yaml").write_text(SPEC)
    result = CliRunner().invoke(
        neurovis, ["render", str(tmp_path / "pair.yaml"), "-o", str(tmp_path / "x.svg"), "--view", view]
    )
    assert result.exit_code == 1
    assert words in result.output
    assert not (tmp_path / "x.svg").exists()


def test_the_commands_draw_views_still_and_moving(tmp_path: Path) -> None:
    (tmp_path / "pair.yaml").write_text(SPEC)
    for command, more in (("render", ["--window", "30"]), ("animate", ["--steps", "5"])):
        words = [
            command,
            str(tmp_path / "pair.yaml"),
            "-o",
            str(tmp_path / "x.svg"),
            "--view",
            "traces: out",
            "--view",
            "matrix",
        ]
        result = CliRunner().invoke(neurovis, [*words, *more])
        assert result.exit_code == 0, result.output
        root = ET.fromstring((tmp_path / "x.svg").read_bytes())
        views = [g.attrib["data-view"] for g in root.iter(NS + "g") if "data-view" in g.attrib]
        assert views == ["traces", "matrix"]
        assert bool(list(root.iter(NS + "animateTransform"))) == (command == "animate")


# --- curves ----------------------------------------------------------------------------------------------------------


def test_a_curve_runs_through_its_values_and_ends_at_its_name() -> None:
    scene = film("traces: A1, B").scene
    ground = groups(scene, "view")["traces"]
    (frame,) = (shape for shape in ground.shapes if isinstance(shape, Rectangle))
    for name in ("A1", "B"):
        group = groups(scene, "trace")[name]
        points = np.array(line(group))
        assert len(points) == len(RUN)
        assert (np.diff(points[:, 0]) > 0).all()
        values = RUN[name]
        # one scale for all: higher values stand higher, in proportion
        slope = np.polyfit(values, points[:, 1], 1)
        assert slope[0] < 0
        assert np.abs(np.polyval(slope, values) - points[:, 1]).max() < 1e-6
        assert frame.corner[1] <= points[:, 1].min() <= points[:, 1].max() <= frame.corner[1] + frame.height
        (label,) = (shape for shape in group.shapes if isinstance(shape, Text))
        (curve,) = {shape.stroke for shape in group.shapes if isinstance(shape, Polyline)}
        assert label.fill == curve
        assert label.text + label.subscript == name
        assert label.point[0] > frame.corner[0] + frame.width


def test_names_at_the_ends_do_not_overlap_and_lie_within_the_page() -> None:
    flat = "neurovis: 1\nname: flat\ntime: {steps: 20}\nneurons: {N: {count: 6, first: 10, bias: 1}}\n"
    scene = film("traces: N", network=nv.compile_text(flat)).scene
    labels = [s for g in groups(scene, "trace").values() for s in g.shapes if isinstance(s, Text)]
    assert len(labels) == 6
    for one, other in combinations(labels, 2):
        assert abs(one.point[1] - other.point[1]) >= 0.8 * one.size
    assert all(s.point[0] + width(s.text, s.size, s.weight, s.subscript) <= scene.width for s in labels)


@pytest.mark.parametrize("count", [2, 15, 20, 30, 31])
def test_names_of_rows_stand_clear_of_one_another(count: int) -> None:
    """A subscript ends well above the capitals of the row beneath; of more rows the groups alone have names."""
    spec = f"neurovis: 1\nname: rows\ntime: {{steps: 5}}\nneurons: {{N: {{count: {count}, bias: 1}}}}\n"
    ground = groups(film("raster", network=nv.compile_text(spec)).scene, "view")["raster"]
    rows = [s for s in ground.shapes if isinstance(s, Text) and s.subscript]
    assert len(rows) == (count if count <= 30 else 0)
    for row, beneath in pairwise(rows):
        lowest = row.point[1] + SUBSCRIPT_DROP * row.size
        assert beneath.point[1] - 0.73 * beneath.size - lowest > 0.35 * row.size


def test_every_view_lowers_the_number_in_the_group_alone() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\ntime: {steps: 9}\nmodules: {leg: {neurons: {Tm3: {count: 2, bias: 1}}}}\n"
        "instances: {left: {module: leg}}\nneurons: {CA3: {count: 2, bias: 1}, O: {}}\n"
        "connections: {CA3 -> O: 1, left.Tm31 -> O: 1}\n"
    )
    for view, paths in (("traces: CA3, left.Tm3", "left."), ("raster: CA3, left.Tm3", "left."), ("matrix", "")):
        scene = film(view, network=network).scene
        said = {(s.text, s.subscript) for s in scene.shapes() if isinstance(s, Text) and s.subscript}
        assert {("CA3", "1"), ("CA3", "2"), (f"{paths}Tm3", "1")} <= said


def test_more_curves_than_colours_stand_in_several_strips_with_one_scale() -> None:
    many = "neurovis: 1\nname: many\ntime: {steps: 20}\nneurons: {N: {count: 8, bias: i}}\n"
    scene = film("traces: N", network=nv.compile_text(many)).scene
    strips = [s for g in scene.groups for s in g.shapes if isinstance(s, Rectangle)]
    assert len(strips) == 2
    drawn = [
        (line(g)[0][1], shape.stroke)
        for g in groups(scene, "trace").values()
        for shape in g.shapes[:1]
        if isinstance(shape, Polyline)
    ]
    assert len(drawn) == 8
    offsets = [y - strips[number // 4].corner[1] for number, (y, _) in enumerate(drawn)]
    steps = np.diff(offsets)
    assert steps == pytest.approx([steps[0]] * 7)  # values 0 … 7 on one scale, whatever the strip
    assert len({colour for _, colour in drawn[:4]}) == 4


def test_what_a_view_leaves_out_is_said() -> None:
    many = "neurovis: 1\nname: many\ntime: {steps: 5}\nneurons: {N: {count: 40}}\nconnections:\n"
    many += "  N -> N: {pattern: ring, weight: 0.5, plasticity: {hebbian: {rate: 0.1}}}\n"
    network = nv.compile_text(many)
    assert any(f"{MOST_DISTINCT} of 40" in text for text in texts(film("traces", network=network).scene))
    assert any("24 of 40" in text for text in texts(film("traces: N", network=network).scene))
    assert any("12 of 40, those that change most" in text for text in texts(film("weights", network=network).scene))
    assert len(groups(film("traces", network=network).scene, "trace")) == MOST_DISTINCT


def test_of_a_long_run_each_extreme_is_drawn_and_the_svg_stays_small(tmp_path: Path) -> None:
    long = (
        "neurovis: 1\nname: long\ntime: {steps: 40000}\ninputs: {x: {expression: sin(k) + (5 if k == 31234 else 0)}}\n"
    )
    network = nv.compile_text(long + "neurons: {A: {input: x}}\n")
    run = network.run()
    points = np.array(line(groups(film("traces: A", network=network, recording=run).scene, "trace")["A"]))
    assert len(points) < 4 * 760
    values = run["A"]
    low, high = values.min(), values.max()
    y = points[:, 1]
    assert high > 4
    # the peak of one step stands as high as the scale says, where it is
    peak = y.argmin()
    whole = points[:, 0].max() - points[:, 0].min()
    assert (points[peak, 0] - points[:, 0].min()) / whole == pytest.approx(31234 / 39999, abs=0.002)
    bottom = y.max()
    middle = bottom - (np.median(values) - low) / (high - low) * (bottom - y[peak])
    assert np.median(y) == pytest.approx(middle, abs=0.15 * (bottom - y[peak]))
    network.render(tmp_path / "x.svg", recording=run, view="traces: A")
    assert (tmp_path / "x.svg").stat().st_size < 40_000


def test_a_gap_is_where_there_is_no_number() -> None:
    odd = "neurovis: 1\nname: odd\ntime: {steps: 30}\ninputs: {x: {expression: 1/(k - 10) if k != 20 else log(-1)}}\n"
    network = nv.compile_text(odd + "neurons: {A: {input: x}, B: {}}\nconnections: {B -> A: 1}\n")
    with pytest.warns(RuntimeWarning):
        run = network.run()
    assert not np.isfinite(run["A"]).all()
    for view in ("traces: A", "raster", "matrix", ["network", "traces"]):
        scene = still(film(view, [3, 25], network=network, recording=run), 1)
        assert all(np.isfinite(point).all() for s in scene.shapes() if isinstance(s, Polyline) for point in s.points)
    curve = groups(film("traces: A", network=network, recording=run).scene, "trace")["A"]
    assert len([s for s in curve.shapes if isinstance(s, Polyline) and s.width > 1]) >= 2


@pytest.mark.parametrize(
    "more",
    ["", "connections: {A -> A: 1e300}\n", "connections: {A -> A: {weight: 0, plasticity: {hebbian: {rate: 0}}}}\n"],
)
def test_one_neuron_and_one_step_are_drawn(more: str, tmp_path: Path) -> None:
    network = nv.compile_text("neurovis: 1\nname: one\ntime: {steps: 1}\nneurons: {A: {bias: 1e300}}\n" + more)
    together = [view for view in VIEWS if view != "pathways"]
    network.render(tmp_path / "x.svg", view=together)
    network.render(tmp_path / "x.png", view=together)
    numbers = re.findall(r'="[^"]*(?:nan|inf)[^"]*"', (tmp_path / "x.svg").read_text())
    assert numbers == []
    for view in VIEWS:
        network.animate(tmp_path / "y.svg", view=view, steps=1)


def test_a_view_with_nothing_to_show_says_so() -> None:
    network = nv.compile_text("neurovis: 1\nname: one\nneurons: {A: {}}\n")
    assert "no weight of this network changes" in texts(film("weights", network=network).scene)
    assert "there is no connection to show" in texts(film("matrix", network=network).scene)


# --- colours that tell curves apart ----------------------------------------------------------------------------------


@pytest.mark.parametrize("theme", sorted(THEMES))
def test_curves_are_told_apart_and_from_the_background_with_any_vision(theme: str) -> None:
    found = distinct(THEMES[theme])
    assert len(set(found)) == MOST_DISTINCT == 6
    for colour in found:
        assert contrast(colour, THEMES[theme].background) >= 3
    for one, other in combinations(found, 2):
        assert min(difference(one, other, vision) for vision in VISIONS) >= 17


# --- raster ----------------------------------------------------------------------------------------------------------


def cells(group: Group) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    (image,) = (shape for shape in group.shapes if isinstance(shape, Image))
    return np.frombuffer(image.pixels, np.uint8).reshape(image.rows, image.columns, 3)


def test_a_raster_has_the_colours_of_the_network_and_marks_for_spikes() -> None:
    scene = film("raster: A, S").scene
    drawn = cells(groups(scene, "view")["raster"])
    assert drawn.shape == (4, len(RUN), 3)
    theme = THEMES["default"]
    gains, index = PAIR.gains, PAIR.network.neuron_index
    for row, name in enumerate(("A1", "A2", "A3")):
        wanted = colours(theme, np.clip(gains.activity[index[name]] * (RUN[name] - gains.centre[index[name]]), -1, 1))
        assert ["#{:02x}{:02x}{:02x}".format(*cell) for cell in drawn[row].tolist()] == wanted
    spikes = RUN["S"] == 1
    assert 5 < spikes.sum() < len(RUN) / 2
    ink, ground = ([int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in (theme.ink, theme.box_fill))
    assert (drawn[3][spikes] == ink).all()
    assert (drawn[3][~spikes] == ground).all()


def test_of_many_steps_and_neurons_a_cell_has_the_strongest_colour() -> None:
    values = np.array([[0.1, -0.9, 0.2, np.nan, 0.3]])
    assert strongest(values, np.array([0, 2, 4, 5]), 1).tolist() == [[-0.9, 0.2, 0.3]]
    big = "neurovis: 1\nname: big\ntime: {steps: 3000}\ninputs: {x: {expression: 1 if k == 1777 else 0}}\n"
    network = nv.compile_text(big + "neurons: {N: {count: 700}, Z: {input: x, activation: tanh}}\n")
    drawn = cells(groups(film("raster", network=network).scene, "view")["raster"])
    assert drawn.shape[0] <= 600
    assert drawn.shape[1] <= 760
    grey = np.array([0x96] * 3)
    awake = np.argwhere((drawn != grey).any(axis=2))
    assert len(awake) == 1  # a step of a neuron among 3,000 steps of 701
    assert awake[0, 0] == drawn.shape[0] - 1
    assert awake[0, 1] / drawn.shape[1] == pytest.approx(1777 / 3000, abs=0.002)


# --- matrix ----------------------------------------------------------------------------------------------------------


def test_a_matrix_has_sources_as_rows_and_targets_as_columns_groups_in_the_order_of_the_spec() -> None:
    scene = film("matrix").scene
    found = groups(scene, "cell")
    assert set(found) == set(PAIR.network.connection_names)
    corner = {name: group.shapes[0].corner for name, group in found.items() if isinstance(group.shapes[0], Rectangle)}
    for one, other in combinations(found, 2):
        (s1, t1), (s2, t2) = one.split(" -> "), other.split(" -> ")
        assert (corner[one][1] == corner[other][1]) == (s1 == s2)
        assert (corner[one][0] == corner[other][0]) == (t1 == t2)
    x = {name: LAYOUT.positions[name][0] for name in ("A1", "A2", "A3")}
    by_place = sorted(x, key=lambda name: x[name])
    assert sorted(x, key=lambda name: corner[f"{name} -> B"][1]) == by_place
    rows = {name.split(" -> ")[0]: place[1] for name, place in corner.items()}
    group_of = {index: group.name for group in PAIR.network.neurons.groups for index in group.indices}
    ordered = [group_of[PAIR.network.neurons.names.index(name)] for name in sorted(rows, key=lambda name: rows[name])]
    written = [group.name for group in PAIR.network.neurons.groups]
    assert list(dict.fromkeys(ordered)) == [name for name in written if name in ordered]
    fill = {name: group.shapes[0].fill for name, group in found.items() if isinstance(group.shapes[0], Rectangle)}
    assert fill["I -> A1"] == fill["I -> A2"] == THEMES["default"].positive
    assert [fill["S -> B"]] == colours(THEMES["default"], [-0.5 / 0.8])
    assert "weight" in found["S -> B"].title


def test_neurons_of_a_ring_stay_in_their_own_order_and_instances_together() -> None:
    ring = nv.compile(Path(__file__).parents[1] / "specs" / "ring.yaml")
    names = ring.network.neurons.names
    order = order_of(ring.network, ring.drawn().value, range(len(names)))
    assert [names[index] for index in order.neurons.tolist()] == [*(f"R{k}" for k in range(1, 9)), "A", "B"]
    legs = (
        "neurovis: 1\nname: legs\nmodules:\n  leg:\n    neurons: {A: {bias: 1}, B: {}}\n    connections: {A -> B: 1}\n"
    )
    walker = nv.compile_text(
        legs + "instances: {left: {module: leg}, right: {module: leg}}\nlayout: {mirror: [[left, right]]}\n"
    )
    order = order_of(walker.network, walker.drawn().value, range(4))
    assert [(band.name, band.count) for band in order.levels[0]] == [("left", 2), ("right", 2)]


def test_cells_of_weights_that_change_do_so_in_a_film() -> None:
    made = film("matrix", [0, 60, 119])
    ids = {group.id: name for name, group in groups(made.scene, "cell").items()}
    assert sorted(ids[name] for name in made.fills) == ["A1 -> B", "A2 -> B", "A3 -> B"]
    shown = [groups(still(made, frame), "cell")["A1 -> B"].shapes[0] for frame in range(3)]
    fills = [one.fill for one in shown if isinstance(one, Rectangle)]
    assert len(set(fills)) == 3
    values = [
        made.fill_values[frame, made.fills.index(next(k for k, v in ids.items() if v == "A1 -> B"))]
        for frame in range(3)
    ]
    weights = RUN.weight("A1 -> B")[[0, 60, 119]]
    assert np.array(values) / values[1] == pytest.approx(np.minimum(weights / weights[1], 1 / values[1]), rel=1e-6)


def test_thousands_of_cells_are_one_image(tmp_path: Path) -> None:
    big = "neurovis: 1\nname: big\ntime: {steps: 2}\nneurons: {N: {count: 50}, M: {count: 50}}\n"
    network = nv.compile_text(
        big + "connections: {N -> M: {weight: i - j, pattern: all_to_all}}\nlayout: {engine: grid}\n"
    )
    network.render(tmp_path / "x.svg", view="matrix")
    root = ET.fromstring((tmp_path / "x.svg").read_bytes())
    assert (tmp_path / "x.svg").stat().st_size < 60_000
    (image,) = root.iter(NS + "image")
    content = base64.b64decode(image.attrib["href"].removeprefix("data:image/png;base64,"))
    with Pillow.open(io.BytesIO(content)) as picture:
        assert picture.size == (100, 100)
    (group,) = (g for g in root.iter(NS + "g") if "data-cells" in g.attrib)
    assert group.findtext(NS + "title") == "2,500 connections"


# --- films, sizes, recordings ----------------------------------------------------------------------------------------


def test_the_cursor_stands_at_the_step_of_the_frame_and_dots_on_their_curves() -> None:
    steps = [0, 30, 77, 119]
    made = film(["network", "traces: A1, B", "raster: A"], steps)
    for frame, step in enumerate(steps):
        scene = still(made, frame)
        for name in ("A1", "B"):
            x, y = line(groups(scene, "trace")[name])[step]
            assert cursor(scene) == pytest.approx(x)
            (dot,) = groups(scene, "moment")[name].shapes
            assert isinstance(dot, Disc)
            assert dot.centre == pytest.approx((x, y))
        raster = groups(scene, "view")["raster"]
        (image,) = (shape for shape in raster.shapes if isinstance(shape, Image))
        assert cursor(scene) == pytest.approx(image.corner[0] + (step + 0.5) / len(RUN) * image.width)
    assert made.captions[2].startswith("step 77 · 7.70 s")


def test_a_frame_is_the_picture_of_its_step() -> None:
    view = ["network", "traces: A1, B", "weights", "matrix: A -> B"]
    made = film(view, [20, 60])
    alone = film(view, [60]).scene
    moved = still(made, 1)
    for key in ("neuron", "trace", "moment"):
        assert groups(moved, key).keys() == groups(alone, key).keys()
        for name, group in groups(alone, key).items():
            other = groups(moved, key)[name]
            assert [type(shape) for shape in group.shapes] == [type(shape) for shape in other.shapes]
            for one, two in zip(group.shapes, other.shapes, strict=True):
                if isinstance(one, Disc) and isinstance(two, Disc):
                    assert two.centre == pytest.approx(one.centre)
                    assert two.fill == one.fill
    assert cursor(moved) == pytest.approx(cursor(alone))


@pytest.mark.parametrize("size", [(1000, 1400), (320, 240), (64, 64), (1600, 200)])
@pytest.mark.parametrize("view", [["network", "traces", "raster", "weights", "matrix"], ["traces"], ["matrix"]])
def test_a_stated_size_is_kept_and_nothing_lies_outside(size: tuple[int, int], view: list[str]) -> None:
    scene = film(view, size=size).scene
    assert scene.pixels == size
    for group in scene.groups:
        for shape in group.shapes:
            match shape:
                case Rectangle() | Image():
                    assert -0.01 <= shape.corner[0] <= shape.corner[0] + shape.width <= scene.width + 0.01
                    assert -0.01 <= shape.corner[1] <= shape.corner[1] + shape.height <= scene.height + 0.01
                case Polyline():
                    assert all(-0.01 <= x <= scene.width + 0.01 and -0.01 <= y <= scene.height for x, y in shape.points)
                case Text():
                    assert 0 <= shape.point[1] <= scene.height


@pytest.mark.parametrize("theme", sorted(THEMES))
def test_pixels_have_the_colours_of_the_scene(theme: str) -> None:
    made = film(["traces: A1, B", "raster: A"], theme=theme, size=(760, 400)).scene
    from neurovis_renderers.canvas import paint

    pixels = paint(made)
    assert pixels.shape == (400, 760, 3)
    (image,) = (shape for shape in made.shapes() if isinstance(shape, Image))
    x, y = int(made.density * (image.corner[0] + 3)), int(made.density * (image.corner[1] + 3))
    assert pixels[y, x].tolist() == np.frombuffer(image.pixels, np.uint8)[:3].tolist()
    assert made.theme.name == theme


def test_a_theme_of_the_spec_is_that_of_its_views(tmp_path: Path) -> None:
    own = nv.compile_text(SPEC + 'render: {theme: {base: dark, positive: "#00ffff"}}\n')
    own.render(tmp_path / "x.svg", view=["raster: I", "matrix"])
    text = (tmp_path / "x.svg").read_text()
    assert f'fill="{THEMES["dark"].background}"' in text
    assert 'fill="#00ffff"' in text  # a full cell of the matrix


def test_a_window_shows_the_steps_around_the_one_that_is_drawn() -> None:
    for step, window, wanted in (
        (60, 20, range(50, 70)),
        (2, 20, range(20)),
        (119, 20, range(100, 120)),
        (5, None, range(120)),
    ):
        look = Look(replace(PAIR.network.render, window=window), first=step)
        shots = shots_of(PAIR.network, RUN, look)
        assert shots.rows.tolist() == list(wanted)
        assert shots.frames.tolist() == [step]


def test_states_that_a_view_shows_are_recorded_for_it_and_a_recording_without_them_is_refused(tmp_path: Path) -> None:
    PAIR.render(tmp_path / "x.svg", view="traces: A.v")
    root = ET.fromstring((tmp_path / "x.svg").read_bytes())
    assert [g.attrib["data-trace"] for g in root.iter(NS + "g") if "data-trace" in g.attrib] == ["A1.v", "A2.v", "A3.v"]
    with pytest.raises(RecordingError, match=r"does not hold the state 'A1\.v'.*run --states"):
        PAIR.render(tmp_path / "y.svg", view="traces: A.v", recording=RUN)


def test_a_partial_recording_serves_the_views_that_it_holds(tmp_path: Path) -> None:
    part = PAIR.run(neurons=["A"], weights="none")
    PAIR.render(tmp_path / "x.svg", view="traces: A", recording=part)
    assert (tmp_path / "x.svg").exists()
    for view in ("traces: B", "weights", "network", "raster", "matrix"):
        with pytest.raises(RecordingError, match="partial"):
            PAIR.render(tmp_path / "y.svg", view=view, recording=part)


def test_traces_alone_need_no_layout() -> None:
    assert not PAIR.needs_layout(["traces", "raster", "weights"])
    assert PAIR.needs_layout("matrix")
    assert PAIR.needs_layout()


def test_views_over_time_show_the_steps_between_the_frames_of_a_film(tmp_path: Path) -> None:
    """A spike of one step is in the traces, wherever the frames are; the cursor stands at the frames."""
    text = "neurovis: 1\nname: x\ntime: {dt: 0.1, steps: 81}\ninputs: {push: {expression: 1 if k == 13 else 0}}\n"
    network = nv.compile_text(text + "neurons: {A: {input: push, activation: identity}}\n")
    lines, cursors = [], []
    for every in (1, 8):
        path = tmp_path / f"{every}.svg"
        network.animate(path, every=every, view="traces: A")
        root = ET.parse(path).getroot()
        lines.append([line.get("d") for line in root.iter(NS + "path")])
        moves = next(root.iter(NS + "animateTransform")).get("values") or ""
        cursors.append([float(place.split()[0]) for place in moves.split(";")])
    assert lines[0] == lines[1]
    assert (len(cursors[0]), len(cursors[1])) == (81, 11)
    assert cursors[1] == pytest.approx(cursors[0][::8], abs=0.02)


def test_the_picture_of_the_network_in_a_figure_is_that_which_stands_alone(tmp_path: Path) -> None:
    """With its glyphs, their gains and what is left out."""
    spec = "neurovis: 1\nname: x\ntime: {steps: 20}\nneurons: {A: {count: 4, bias: 3}, B: {count: 2}, O: {}}\n"
    spec += "connections: {A -> B: {weight: 40, pattern: all_to_all}, B -> O: {weight: 0.5}, A1 -> O: 0.01}\n"
    network = nv.compile_text(spec)
    alone, page = tmp_path / "alone.svg", tmp_path / "page.svg"
    for draw in (network.render, partial(network.animate, steps=5)):
        for path, view in ((alone, "network"), (page, ["network", "raster", "matrix"])):
            with pytest.warns(LeftOut, match=r"1 of 3 connections are left out: those with \|w\| < 0\.1"):
                draw(path, view=view, collapse=["A", "B"], min_weight=0.1)
        found = []
        for path in (alone, page):
            root = ET.fromstring(path.read_bytes())
            lines = [g for g in root.iter(NS + "g") if "data-connection" in g.attrib]
            widths = {g.attrib["data-connection"]: next(g.iter(NS + "path")).attrib["stroke-width"] for g in lines}
            discs = {
                g.attrib["data-neuron"]: circle.attrib["fill"]
                for g in root.iter(NS + "g")
                if "data-neuron" in g.attrib
                for circle in g.findall(NS + "circle")[:1]
            }
            found.append((widths, discs))
        assert found[0] == found[1]
        assert set(found[0][0]) == {"A -> B", "B -> O"}


def test_names_that_begin_alike_are_told_apart_in_every_view(tmp_path: Path) -> None:
    name = "the_central_pattern_generator_of_the_leg"
    text = f"neurovis: 1\nname: x\nneurons: {{{name}: {{count: 2, bias: i}}, O: {{}}}}\n"
    network = nv.compile_text(f"{text}connections: {{{name} -> O: {{weight: 1, plasticity: decay}}}}\n")
    for view in (f"traces: {name}", "weights", "raster", "matrix"):
        network.render(tmp_path / "x.svg", step=5, view=view)
        root = ET.parse(tmp_path / "x.svg").getroot()
        said = ["".join(text.itertext()) for text in root.iter(NS + "text")]
        cut = [words for words in said if "…" in words and "±" not in words]
        assert len(set(cut)) == 2, (view, said)


def test_a_matrix_leaves_out_weak_connections_and_says_so(tmp_path: Path) -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 3, bias: 1}, O: {}}\n"
    network = nv.compile_text(f"{text}connections: {{A1 -> O: 0.5, A2 -> O: 0.01, A3 -> O: -0.02}}\n")
    network.render(tmp_path / "x.svg", step=2, view="matrix", min_weight=0.1)
    root = ET.parse(tmp_path / "x.svg").getroot()
    said = " ".join("".join(words.itertext()) for words in root.iter(NS + "text"))
    assert "without 2 of 3 connections with |w| < 0.1" in said
    assert [g.attrib["data-cell"] for g in root.iter(NS + "g") if "data-cell" in g.attrib] == ["A1 -> O"]
    network.render(tmp_path / "x.svg", step=2, view="matrix", min_weight=1)
    assert "every |w| is below 1" in (tmp_path / "x.svg").read_text().replace("&lt;", "<")
