"""Groups and instances as one glyph: means of activities, sums of weights and signals, where glyphs stand."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import file_of, film_of, scene_of

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.scene import THEMES, Scene, colours, still
from neurovis_spec.scene.collapse import gathered
from neurovis_spec.scene.gathered_layout import standing
from neurovis_spec.scene.look import Excerpt, excerpted
from neurovis_spec.scene.teachers import drawn_teachers

SPEC = """
neurovis: 1
name: small
time: {steps: 5}
parameters: {w: 0.4}
neurons:
  A: {count: 3, activation: tanh, bias: [0.2, -0.7, 0.4]}
  B: {count: 2, bias: 0.5}
  C: {}
connections:
  A -> A: {pattern: ring, weight: 0.3}
  A -> B: {matrix: [[0.5, -0.2], [w, 0.1], [-0.6, 0.3]], delay: 2}
  B -> C: {weight: 0.25, plasticity: {hebbian: {rate: 0.1}}}
  C -> A: -0.3
  C -> C: 0.1
render: {gain: {activity: 1, signal: 2, thickness: 8, change: 5}, collapse: [A, B]}
"""
MODULES = """
neurovis: 1
name: walker
time: {steps: 3}
modules:
  leg:
    neurons: {S: {bias: 0.5}, M: {count: 3}}
    connections: {S -> M: 0.5}
instances: {left: {module: leg, count: 2}, right: {module: leg, count: 2}}
neurons: {P: {bias: 1}}
connections: {P -> left.S: 0.5, P -> right.S: 0.5, left1.M -> left2.S: 0.2, right1.M -> right2.S: 0.2}
layout: {mirror: [[left, right]]}
"""


def scene_at(network: CompiledNetwork, step: int) -> Scene:
    return scene_of(network, network.run(step + 1).snapshot(step))


def groups(network: CompiledNetwork, step: int, kind: str) -> dict[str, ET.Element]:
    root = ET.fromstring(file_of(scene_at(network, step), ".svg"))
    return {name: group for group in root.iter() if (name := group.get(f"data-{kind}")) is not None}


def child(group: ET.Element, tag: str) -> ET.Element:
    return next(e for e in group if e.tag.endswith(tag) and "glow" not in e.get("class", ""))


def words(group: ET.Element) -> str:
    return "".join(text for e in group if e.tag.endswith("text") for text in e.itertext())


@pytest.mark.parametrize("step", [0, 2, 4])
def test_a_glyph_has_the_mean_and_a_bundle_the_sums(step: int) -> None:
    network = nv.compile_text(SPEC)
    whole = network.network
    snapshot = network.run(step + 1).snapshot(step)
    neurons, bundles = groups(network, step, "neuron"), groups(network, step, "connection")
    assert set(neurons) == {"A", "B", "C"}
    assert set(bundles) == {"A -> B", "B -> C", "C -> A", "C -> C"}
    theme = THEMES["default"]
    for name, count in (("A", 3), ("B", 2)):
        members = list(whole.group_index[name].indices)
        (fill,) = colours(theme, np.clip([snapshot.activity[members].mean()], -1, 1))
        assert child(neurons[name], "circle").get("fill") == fill
        assert neurons[name].get("data-size") == str(count)
        assert words(neurons[name]) in (f"×{count}{name}", f"{name}×{count}")
        assert f"the mean of {count} neurons" in (neurons[name].findtext("{*}title") or "")
        assert "A1, A2, A3" in (neurons["A"].findtext("{*}title") or "")
    assert neurons["C"].get("data-size") is None
    ends = whole.connections
    names = ["A"] * 3 + ["B"] * 2 + ["C"]
    for name, group in bundles.items():
        source, target = name.split(" -> ")
        own = [k for k in range(len(ends)) if (names[ends.sources[k]], names[ends.targets[k]]) == (source, target)]
        assert group.get("data-size") == (None if name == "C -> C" else str(len(own)))
        total = float(snapshot.weights[own].sum())
        signal = float((snapshot.weights[own] * snapshot.activity[ends.sources[np.array(own)]]).sum())
        path = child(group, "path")
        assert float(path.attrib["stroke-width"]) == pytest.approx(max(0.6, abs(8 * total)))
        assert path.get("stroke") == colours(theme, np.clip([2 * signal], -1, 1))[0]


def test_a_film_of_glyphs_is_the_same_as_its_stills() -> None:
    network = nv.compile_text(SPEC)
    recording = network.run(5)
    moving = film_of(network, [recording.snapshot(step) for step in range(5)])
    for frame in range(5):
        one, other = still(moving, frame), scene_at(network, frame)
        for a, b in zip(one.groups, other.groups, strict=True):
            assert a.data == b.data
            if a.id != "caption":
                assert a.shapes == b.shapes


def test_instances_named_together_are_glyphs_each_by_itself_and_stay_mirrored() -> None:
    network = nv.compile_text(MODULES + "render: {collapse: [left, right]}\n")
    neurons = groups(network, 2, "neuron")
    assert set(neurons) == {"left1", "left2", "right1", "right2", "P"}
    assert all(neurons[name].get("data-size") == "4" for name in neurons if name != "P")
    where = {
        n: (float(c.attrib["cx"]), float(c.attrib["cy"])) for n, g in neurons.items() for c in [child(g, "circle")]
    }
    axis = where["P"][0]
    for number in (1, 2):
        (lx, ly), (rx, ry) = where[f"left{number}"], where[f"right{number}"]
        assert axis - lx == pytest.approx(rx - axis, abs=0.03)
        assert ly == ry
    assert set(groups(network, 2, "connection")) == {
        "P -> left1",
        "P -> left2",
        "P -> right1",
        "P -> right2",
        "left1 -> left2",
        "right1 -> right2",
    }


def test_a_glyph_stands_at_the_centre_of_its_neurons_and_the_rest_stays() -> None:
    row = ", ".join(f"K{k}: [{2 * k}, 2]" for k in range(1, 5))
    spec = f"""
neurovis: 1
name: pins
neurons: {{A: {{}}, K: {{count: 4}}, B: {{}}}}
connections: {{A -> K: 1, K -> B: 1, A -> B: 1}}
layout: {{positions: {{A: [5, 0], {row}, B: [4, 4]}}}}
render: {{collapse: K}}
"""
    network = nv.compile_text(spec)
    neurons = groups(network, 0, "neuron")
    where = {
        n: (float(c.attrib["cx"]), float(c.attrib["cy"])) for n, g in neurons.items() for c in [child(g, "circle")]
    }
    (ax, ay), (kx, ky), (bx, by) = where["A"], where["K"], where["B"]
    assert kx == pytest.approx(ax, abs=0.05)  # (2 + 4 + 6 + 8) / 4 = 5
    assert (by - ky) / (ky - ay) == pytest.approx(1, abs=0.01)
    assert (ax - bx) / (ky - ay) == pytest.approx(0.5, abs=0.01)


def test_boxes_rules_lesions_and_gains_follow_what_is_drawn() -> None:
    spec = (
        SPEC.replace("B: {count: 2, bias: 0.5}", "B: {count: 2, bias: 0.5, box: b}")
        .replace("C: {}", "C: {box: b}")
        .replace("gain: {activity: 1, signal: 2, thickness: 8, change: 5}, ", "")
    )
    network = nv.compile_text(spec + "events: [{at: 2, lesion: [A1]}, {at: 3, lesion: [A2, A3]}]\n")
    scene = scene_at(network, 4)
    assert {group.id for group in scene.groups if group.id.startswith("box:")} == {"box:b"}
    faint = {group.data["neuron"] for group in scene.groups if group.opacity < 1 and "neuron" in group.data}
    assert faint == {"A"}
    assert "lesioned at step 3" in next(g.title for g in scene.groups if g.data.get("neuron") == "A")
    assert any("added up" in str(shape) for g in scene.groups if g.id == "legend" for shape in g.shapes)
    whole = network.network
    gains = network.gains
    assert len(gains.activity) == 3
    assert len(set(gains.thickness[:1])) == 1
    assert whole.render.collapse == (("A", (0, 1, 2)), ("B", (3, 4)))


def test_the_reader_collapses_as_the_spec_does(tmp_path: Path) -> None:
    plain = nv.compile_text(SPEC.replace(", collapse: [A, B]", ""))
    folder = tmp_path
    plain.render(folder / "one.svg", step=3, collapse=["A", "B", "A"])
    nv.compile_text(SPEC).render(folder / "other.svg", step=3)
    one, other = ((folder / name).read_text(encoding="utf-8") for name in ("one.svg", "other.svg"))
    assert one == other
    plain.render(folder / "one.svg", step=3, collapse="A + B")
    assert set(re.findall('data-neuron="([^"]+)"', (folder / "one.svg").read_text(encoding="utf-8"))) == {"A + B", "C"}


def test_what_is_drawn_by_default_is_the_network_itself() -> None:
    network = nv.compile_text(SPEC.replace(", collapse: [A, B]", ""))
    assert len(groups(network, 0, "neuron")) == 6
    assert replace(network.network.render, collapse=()) == network.network.render


def test_instances_that_are_not_collapsed_keep_their_frames_where_all_is_laid_out_anew(tmp_path: Path) -> None:
    network = nv.compile_text(MODULES.replace("module: leg, count: 2", "module: leg, count: 3"))
    network.render(tmp_path / "x.svg", step=1, collapse=["left", "right2", "P"])
    said = {"".join(text.itertext()) for text in ET.parse(tmp_path / "x.svg").iterfind(".//{*}text")}
    assert {"right1", "right3"} <= said


def test_a_glyph_says_how_many_neurons_it_holds_however_small_it_is(tmp_path: Path) -> None:
    groups = "\n".join(f"  G{k}x: {{count: {12 + 300 * (k % 2)}, bias: 1}}" for k in range(12))
    lines = "\n".join(f"  G{k}x1 -> G{k + 1}x1: 1" for k in range(11))
    spec = f"neurovis: 1\nname: chain\nneurons:\n{groups}\nconnections:\n{lines}\nrender: {{size: [240, 200]}}\n"
    network = nv.compile_text(spec)
    network.render(tmp_path / "x.svg", step=0, view="pathways")
    found = {name: g for g in ET.parse(tmp_path / "x.svg").iter() if (name := g.get("data-neuron")) is not None}
    assert len(found) == 12
    for name, group in found.items():
        assert f"×{network.network.group_index[name].count}" in words(group)


@pytest.mark.parametrize("collapse", [["left", "right"], ["left", "right2"], ["left", "right", "P"]])
def test_the_plan_of_the_page_holds_where_glyphs_are_laid_out_anew(collapse: list[str]) -> None:
    plan = "right]], plan: [[left1, P, right1], [left2, null, right2]]}"
    network = nv.compile_text(MODULES.replace("right]]}", plan))
    settings = excerpted(network.network, network.network.render, Excerpt(collapse))
    there = network.placed()
    together = replace(there, positions=dict.fromkeys(there.positions, (0.0, 0.0)))
    where: dict[str, list[tuple[float, float]]] = {}
    for name, point in standing(network.network, together, settings)[1].positions.items():
        where.setdefault(name.partition(".")[0], []).append(point)
    x, y = ({name: np.mean(places, axis=0)[axis] for name, places in where.items()} for axis in (0, 1))
    for row in "12":
        assert x[f"left{row}"] < x["P"] < x[f"right{row}"]
        assert abs(y[f"left{row}"] - y[f"right{row}"]) <= 1
    assert abs(y["P"] - y["left1"]) < (y["left2"] - y["left1"]) / 2


def test_a_neuron_that_is_named_twice_is_one_glyph(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC.replace(", collapse: [A, B]", ""))
    for again, file in ((["C"], "one.svg"), (["C", "C"], "other.svg")):
        network.render(tmp_path / file, step=3, collapse=again)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "other.svg").read_bytes()


#: a rule that learns from a state of one neuron, and from one value for each source
STATES_TAUGHT = """
neurovis: 1
name: taught
time: {dt: 0.1}
models: {cell: {state: {v: {derivative: drive - v}}, activity: v}}
rules: {rls: {signals: [error, p], weight: {each_step: weight - 0.1*error*p}}}
neurons: {A: {count: 3, model: cell}, K: {count: 3, model: cell}, E: {model: cell}, O: {model: cell}}
connections:
  A -> K: {weight: 1, pattern: one_to_one}
  K -> O: {weight: 1, plasticity: {rls: {error: E.v, p: {from: K}}}}
  O -> E: 1
"""


@pytest.mark.parametrize(
    ("collapse", "taught"),
    [
        ([], ["E.v is the error of rls", *(f"K{i} is the p of rls" for i in (1, 2, 3))]),
        (["A"], ["E.v is the error of rls", *(f"K{i} is the p of rls" for i in (1, 2, 3))]),
        (["K"], ["E.v is the error of rls"]),
        (["O"], []),
    ],
)
def test_who_teaches_by_a_state_has_a_dotted_line_where_it_and_its_pupil_are_drawn(
    collapse: list[str], taught: list[str]
) -> None:
    network = nv.compile_text(STATES_TAUGHT)
    members = {group.name: tuple(group.indices) for group in network.network.neurons.groups}
    drawn = gathered(network.network, [(name, members[name]) for name in collapse])
    names = drawn.network.neurons.names
    found = [
        f"{names[one.source]}{'.' * bool(one.state)}{one.state} is the {one.signal} of {one.rule}"
        for one in drawn_teachers(drawn)
    ]
    assert found == taught
    pictured = nv.compile_text(STATES_TAUGHT + (f"render: {{collapse: [{collapse[0]}]}}\n" if collapse else ""))
    scene = scene_of(pictured, pictured.run(1).snapshot(0))
    assert [group.title.split("\n")[1] for group in scene.groups if "signal" in group.data] == taught
