"""Large networks: what is left out and said, focus and paths, labels by importance, lines no thicker than neurons."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from large_networks import connectome
from scenes import film_of, scene_of

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import Disc, Group, Rectangle, Scene, Spline, Text
from neurovis_spec.scene.renderers import RendererError
from neurovis_spec.scene.shown import LeftOut
from neurovis_spec.scene.texts import Cut

GAINS = "render: {gain: {activity: 2, signal: 3, thickness: 5, change: 1}}"
LARGE = "layout: {engine: large}"
WORM = connectome(90, 2600, 4, more=f"{GAINS}\n{LARGE}")


def scene_at(network: CompiledNetwork, settings: RenderSettings | None = None, step: int = 2) -> Scene:
    return scene_of(network, network.run(step + 1).snapshot(step), settings=settings)


def of_kind(scene: Scene, kind: str) -> dict[str, Group]:
    return {group.data[kind]: group for group in scene.groups if kind in group.data}


def line(group: Group) -> Spline:
    return next(shape for shape in group.shapes if isinstance(shape, Spline) and not shape.glow)


def label(group: Group) -> str:
    return "".join(shape.text + shape.subscript for shape in group.shapes if isinstance(shape, Text))


def widths(scene: Scene) -> list[float]:
    return [line(group).width for group in scene.groups if "connection" in group.data]


def test_of_too_many_connections_some_are_drawn_the_thick_ones_last_and_the_rest_is_said() -> None:
    scene, whole = scene_at(WORM), WORM.network
    drawn = widths(scene)
    assert len(drawn) == 1000
    assert drawn == sorted(drawn)
    said = "1,600 of 2,600 connections are left out, the weakest that arrive at each neuron, to keep the rest readable"
    assert scene.notes == (f"{said}; all: --full",)
    bundles = of_kind(scene, "pathway")
    assert len(bundles) == 16
    assert sum(int(group.data["count"]) for group in bundles.values()) == 1600
    shown = [shape.text for group in scene.groups for shape in group.shapes if isinstance(shape, Text)]
    assert set(scene.notes) <= set(shown)
    assert len(widths(scene_at(WORM, replace(whole.render, full=True)))) == 2600
    full = scene_at(WORM, replace(whole.render, full=True))
    assert not full.notes
    assert not of_kind(full, "pathway")
    assert len(of_kind(scene, "neuron")) == 90


def test_what_has_no_more_connections_than_can_be_read_is_drawn_whole() -> None:
    assert len(widths(scene_at(connectome(60, 2500, 3, more=LARGE)))) == 2500


def test_of_connections_that_are_equally_thick_the_longest_are_left_out() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {N: {count: 60}}\nlayout: {engine: circular}\n"
        "connections: {N -> N: {pattern: all_to_all, weight: 0.1}}\n"
    )
    scene = scene_at(network)
    far = Counter(
        min(apart, 60 - apart)
        for name in of_kind(scene, "connection")
        for a, b in [re.findall(r"\d+", name)]
        for apart in [abs(int(a) - int(b))]
    )
    assert sum(far.values()) == 1000
    assert set(far) == set(range(1, 10))  # 120 of each distance
    assert all(far[apart] == 120 for apart in range(1, 7))


@pytest.mark.parametrize("least", [0.0, 0.2, 1.0])
def test_min_weight_leaves_out_what_is_weaker_and_nothing_else(least: float) -> None:
    scene = scene_at(WORM, replace(WORM.network.render, min_weight=least))
    weights = np.abs(WORM.network.connections.weights.whole())
    assert len(widths(scene)) == np.count_nonzero(weights >= least)
    weak = np.count_nonzero(weights < least)
    words = f"{weak:,} of 2,600 connections are left out: those with |w| < {least:g}"
    assert scene.notes == ((words,) if weak else ())


def test_min_weight_stands_in_the_spec_as_well_and_a_film_keeps_what_gets_strong() -> None:
    spec = """
neurovis: 1
name: learner
time: {steps: 6}
neurons: {A: {bias: 1}, B: {count: 3}}
connections:
  A -> B: {matrix: [[0, 0.05, 0.5]]}
  A + B1 -> B2: {weight: 0, plasticity: {hebbian: {rate: 1}}}
render: {min_weight: 0.2, gain: {activity: 1, signal: 1, thickness: 1, change: 1}}
"""
    network = nv.compile_text(spec)
    first, last = (of_kind(scene_at(network, step=step), "connection") for step in (0, 5))
    assert "A -> B3" in first
    assert len(first) == 1
    recording = network.run(6)
    snapshots = [recording.snapshot(step) for step in range(6)]
    moving = film_of(network, snapshots, fps=5)
    assert set(of_kind(moving.scene, "connection")) == set(last) | set(first)


def test_focus_shows_neurons_with_all_that_they_are_connected_to() -> None:
    whole = WORM.network
    chosen = whole.neuron_index["class1_neuron_1"]
    scene = scene_at(WORM, replace(whole.render, focus=("class1_neuron_1", (chosen,))))
    ends = [(a, b) for a, b in zip(whole.connections.sources.whole(), whole.connections.targets.whole(), strict=True)]
    names = whole.neurons.names
    assert set(of_kind(scene, "connection")) == {f"{names[a]} -> {names[b]}" for a, b in ends if chosen in (a, b)}
    near = {names[chosen]} | {names[end] for pair in ends if chosen in pair for end in pair}
    radii = {n: s.radius for n, g in of_kind(scene, "neuron").items() for s in g.shapes if isinstance(s, Disc)}
    assert {name for name, radius in radii.items() if radius == max(radii.values())} == near
    assert all(not label(group) for name, group in of_kind(scene, "neuron").items() if name not in near)
    sources, targets = (len({p[1 - k] for p in ends if p[k] == chosen}) for k in (1, 0))
    assert scene.notes == (
        f"focus on class1_neuron_1: {sources} sources, {targets} targets; "
        f"{90 - len(near)} other neurons small, without connections",
    )


PATHS = """
neurovis: 1
name: paths
neurons: {A: {}, B: {count: 2}, C: {}, D: {}, E: {}, X: {}}
connections: {A -> B: 1, B -> C: 1, C -> D: 1, D -> E: 1, A -> X: 1, X -> A: 0.5, X -> X: 1}
"""


def drawn(tmp_path: Path, text: str, **asked: object) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LeftOut)
        nv.compile_text(text).render(tmp_path / "x.svg", **asked)  # type: ignore[arg-type]
    return (tmp_path / "x.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("path", "lines"),
    [
        ("A -> C", {"A -> B1", "A -> B2", "B1 -> C", "B2 -> C"}),
        ("A->D", {"A -> B1", "A -> B2", "B1 -> C", "B2 -> C", "C -> D"}),
        ("B1 + C -> D + E", {"C -> D", "D -> E"}),
        ("B1 -> B1 + D", {"B1 -> C", "C -> D"}),
        ("A -> A", {"A -> X", "X -> A"}),
        ("X -> X", {"X -> X"}),
        ("X -> B", {"X -> A", "A -> B1", "A -> B2"}),
    ],
)
def test_a_path_shows_the_shortest_ways(tmp_path: Path, path: str, lines: set[str]) -> None:
    svg = drawn(tmp_path, PATHS, paths=path)
    assert set(re.findall('data-connection="([^"]+)"', svg.replace("&gt;", ">"))) == lines
    assert "shortest paths " in svg


@pytest.mark.parametrize(
    ("asked", "message", "hint"),
    [
        ({"paths": "E -> A"}, "there is no path E -> A", "there is one the other way round"),
        ({"paths": "E -> B1"}, "there is no path E -> B1", "there is one the other way round"),
        ({"paths": "B1 -> B2"}, "there is no path B1 -> B2", "nothing leads there"),
        ({"paths": "A"}, "'A' is no path", "write 'A -> B'"),
        ({"focus": "F"}, "no neuron, group or output 'F'", None),
        ({"collapse": ["B", "B1"]}, "'B1' is in 'B' and in 'B1': collapse one", None),
        ({"min_weight": -1}, "the least weight is a number that is not negative", None),
    ],
)
def test_what_cannot_be_shown_is_said_before_anything_runs(
    tmp_path: Path, asked: dict[str, object], message: str, hint: str | None
) -> None:
    with pytest.raises(RendererError, match=re.escape(message)) as caught:
        drawn(tmp_path, PATHS, **asked)
    assert hint is None or (caught.value.hint or "").startswith(hint)
    assert not list(tmp_path.iterdir())


@pytest.mark.filterwarnings("ignore:left out")
def test_a_large_svg_leaves_out_the_weakest_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.scene.files._LARGEST_SVG", 60_000)
    path, network = tmp_path / "x.svg", connectome(20, 150, 2, more=LARGE)
    with pytest.warns(
        LeftOut,
        match=r"^\d+ of 150 connections are left out, the weakest that arrive at .*, to keep the file below 5 MB",
    ):
        network.render(path)
    few = path.read_text(encoding="utf-8")
    assert 50_000 < len(few.encode()) <= 60_000
    assert few.count("data-connection=") in range(20, 150)
    assert "to keep the file below 5 MB" in few
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        network.render(path, full=True)
    assert path.read_text(encoding="utf-8").count("data-connection=") == 150
    with pytest.warns(LeftOut, match="to keep the file below 5 MB"):
        network.animate(path, steps=3)
    assert len(path.read_bytes()) <= 60_000


@pytest.mark.parametrize(("count", "edges", "classes"), [(40, 200, 2), (150, 1100, 6), (600, 700, 3)])
def test_lines_are_never_thicker_than_their_neurons_and_as_thick_as_eq_4_says(
    count: int, edges: int, classes: int
) -> None:
    network = connectome(
        count, edges, classes, more=f"{LARGE}\n{GAINS}".replace("render: {", "render: {size: [320, 240], ")
    )
    scene, whole = scene_at(network), network.network
    discs = [s.radius for g in of_kind(scene, "neuron").values() for s in g.shapes if isinstance(s, Disc)]
    assert max(widths(scene)) <= 2 * min(discs)
    weights = np.abs(whole.connections.weights.whole())
    assert sorted(widths(scene)) == np.sort(np.maximum(0.6, 5 * weights))[-len(widths(scene)) :].tolist()
    assert scene.pixels == (320, 240)
    for group in scene.groups:
        for shape in group.shapes:
            if isinstance(shape, Text):  # texts keep their size in pixels
                assert shape.size * scene.density >= 5.9


LADDER = [(300, 260), (480, 400), (800, 700), (1280, 960), (1800, 1500), (3000, 2600)]


@pytest.mark.parametrize(
    "network",
    [
        connectome(150, 300, 5, more=LARGE),
        connectome(40, 60, 3, seed=2, more=LARGE),
        nv.compile_text("neurovis: 1\nname: c\nneurons: {N: {count: 20}}\nconnections: {N -> N: {pattern: chain}}\n"),
        nv.compile_text(
            "neurovis: 1\nname: m\nneurons: {left_hand: {count: 9}, right_hand: {count: 9}, a_long_name: {}}\n"
            "connections: {left_hand -> left_hand: {pattern: ring}, right_hand -> right_hand: {pattern: ring},"
            " left_hand3 -> a_long_name: 1, right_hand3 -> a_long_name: 1}\n"
            "layout: {mirror: [[left_hand, right_hand]], direction: right}\n"
        ),
    ],
    ids=["150", "40", "chain", "mirror"],
)
def test_a_larger_picture_shows_every_name_that_a_smaller_one_shows(network: CompiledNetwork) -> None:
    """But for two, or two of a hundred, that give way to the title of a box, which stands a little elsewhere there."""
    names = set(network.network.neurons.labels)
    before: set[str] = set()
    labelled: set[str] = set()
    for size in LADDER:
        scene = scene_at(network, replace(network.network.render, size=size), step=0)
        shown = {name for name, group in of_kind(scene, "neuron").items() if label(group).rpartition("…")[2] in names}
        now = {name for name, group in of_kind(scene, "neuron").items() if label(group)}
        titles = [group for group in scene.groups if (group.id or "").startswith("title:")]
        few = max(2, 0.02 * len(names)) if titles else 0
        assert len(before - shown) <= few
        assert len(labelled - now) <= few
        before, labelled = shown, now
    assert len(before) > 0.5 * len(names)


def test_every_neuron_of_a_chain_of_twenty_has_its_label() -> None:
    chain = nv.compile_text(
        "neurovis: 1\nname: c\nneurons: {N: {count: 20}}\nconnections: {N -> N: {pattern: chain}}\n"
    )
    assert all(label(group) for group in of_kind(scene_at(chain), "neuron").values())


@pytest.mark.parametrize("hub", [4, 5])
def test_where_there_is_room_for_few_names_hubs_keep_theirs(hub: int) -> None:
    names = [f"interneuron_{k}" for k in range(9)]
    others = [name for place, name in enumerate(names) if place != hub]
    places = ", ".join(f"{name}: [{0.7 * place}, 0]" for place, name in enumerate(names))
    network = nv.compile_text(
        f"neurovis: 1\nname: row\nneurons: {{N: {{names: [{', '.join(names)}]}}}}\n"
        f"connections: {{{' + '.join(others)} -> {names[hub]}: 1}}\nlayout: {{positions: {{{places}}}}}\n"
        "render: {title: false, legend: false}\n"
    )
    for size in [(300, 100), (400, 150), (500, 150)]:
        scene = scene_at(network, replace(network.network.render, size=size), step=0)
        said = {name: label(group) for name, group in of_kind(scene, "neuron").items() if label(group)}
        assert said[names[hub]] == names[hub]
        assert sum(said.get(name) == name for name in names) < 9


@pytest.mark.parametrize("direction", ["down", "right"])
@pytest.mark.parametrize("size", [(200, 200), (400, 300), (700, 500)])
def test_both_of_a_mirrored_pair_are_labelled_alike(direction: str, size: tuple[int, int]) -> None:
    spec = f"""
neurovis: 1
name: pairs
neurons:
  left: {{names: [shoulder_l, elbow_l, wrist_l]}}
  right: {{names: [shoulder_r, elbow_r, wrist_r]}}
  spine: {{}}
connections:
  spine -> left: 1
  spine -> right: 1
  left -> left: {{pattern: chain}}
  right -> right: {{pattern: chain}}
  spine -> spine: 1
  wrist_l -> spine: 1
layout: {{mirror: [[left, right]], direction: {direction}}}
"""
    network = nv.compile_text(spec)
    groups = of_kind(scene_at(network, replace(network.network.render, size=size)), "neuron")
    for part in ("shoulder", "elbow", "wrist"):
        one, other = ([s for s in groups[f"{part}_{side}"].shapes if isinstance(s, Text)] for side in ("l", "r"))
        assert len(one) == len(other)
        assert [s.on_disc for s in one] == [s.on_disc for s in other]
        assert [len(s.text) for s in one] == [len(s.text) for s in other]


def test_names_that_begin_alike_are_cut_in_front() -> None:
    cut = Cut(["descending_left_1", "descending_left_2", "descending_right_1", "photoreceptor"])
    assert cut.shorten("descending_left_2", 10, 70) == "…ing_left_2"
    assert cut.shorten("photoreceptor", 10, 70) == "photorece…"
    assert cut.shorten("photoreceptor", 10, 700) == "photoreceptor"


@pytest.mark.parametrize("engine", ["auto", "organic"])
def test_a_box_has_its_frame_its_title_and_its_tint_in_every_engine(engine: str) -> None:
    network = connectome(30, 80, 5, seed=4, more=f"layout: {{engine: {engine}}}")
    scene = scene_at(network)
    frames = [group for group in scene.groups if group.id.startswith("box:")]
    titles = {group.id for group in scene.groups if group.id.startswith("title:")}
    assert titles == {f"title:class{k}" for k in range(5)}
    fills = {shape.fill for group in frames for shape in group.shapes if isinstance(shape, Rectangle)}
    assert len(frames) == len(fills) == 5


def test_the_commands_say_what_they_leave_out(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(PATHS, encoding="utf-8")
    runner = CliRunner()
    for command in (["render"], ["animate", "--steps", "2"]):
        out = str(tmp_path / "x.svg")
        asked = [command[0], str(tmp_path / "x.yaml"), "-o", out, *command[1:]]
        done = runner.invoke(neurovis, [*asked, "--min-weight", "1"])
        assert done.exit_code == 0, done.output
        assert "note: 1 of 9 connections are left out: those with |w| < 1\n" in done.stderr
        missing = runner.invoke(neurovis, [*asked, "--path", "E -> A"])
        assert missing.exit_code == 1
        assert "error: there is no path E -> A\nhelp: there is one the other way round" in missing.stderr
