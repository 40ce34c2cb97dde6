"""The view of pathways: each group as one glyph, what runs from one to another as one line, and the same in words."""

from __future__ import annotations

import gzip
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from test_scene_thinned import ENTRY, network_of

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compilation import Compilation
from neurovis_spec.keywords import STILL, still_of
from neurovis_spec.live.commands import Draw
from neurovis_spec.live.protocol import command_of
from neurovis_spec.live.show import Show
from neurovis_spec.scene.collapse import gathered
from neurovis_spec.scene.panels import ViewError
from neurovis_spec.scene.probe import probe

SPEC = """
neurovis: 1
name: balance
time: {dt: 0.5 ms, steps: 4}
neurons:
  E: {count: 4, activation: tanh, bias: 0.5}
  I: {count: 2, bias: 0.1}
  O: {bias: 0.2}
connections:
  E -> I: {pattern: all_to_all, weight: 0.5}
  I -> E: {pattern: all_to_all, weight: -1}
  E -> E: {edges: [[E1, E2, 1], [E2, E3, 1], [E3, E4, -2], [E4, E1, 0.5]], delay: 3}
  E -> O: {pattern: all_to_all, weight: 0, plasticity: {hebbian: {rate: 0.1}}}
"""
SENTENCES = [
    "E excites itself: 3 connections, sum 2.5, delay 1.5 ms",
    "E inhibits itself: 1 connection, sum −2, delay 1.5 ms",
    "E excites I: 8 connections, sum 4, delay 0.5 ms",
    "E acts on O: 4 connections, sum 0, delay 0.5 ms, learns by hebbian",
    "I inhibits E: 8 connections, sum −8, delay 0.5 ms",
]


def picture(path: Path, spec: str = SPEC, **options: object) -> ET.Element:
    nv.compile_text(spec).render(path / "x.svg", **{"view": "pathways", **options})  # type: ignore[arg-type]
    return ET.parse(path / "x.svg").getroot()


def parts(root: ET.Element, kind: str) -> dict[str, ET.Element]:
    """The groups of neurons, or of lines, with their index where several share both ends."""
    found = {}
    for group in root.iter():
        if (name := group.get(f"data-{kind}")) is not None:
            found[name + group.get("data-index", "")] = group
    return found


def described(root: ET.Element) -> list[str]:
    return (root.findtext("{*}desc") or "").splitlines()


def written(root: ET.Element) -> list[str]:
    return ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]


def test_each_pathway_is_a_sentence() -> None:
    assert nv.compile_text(SPEC).pathways() == SENTENCES
    plain = SPEC.replace("dt: 0.5 ms, ", "").replace(
        "E -> I: {pattern: all_to_all,", "E -> I: {pattern: all_to_all, delay: 0,"
    )
    assert nv.compile_text(plain).pathways()[1:3] == [
        "E inhibits itself: 1 connection, sum −2, delay 3 steps",
        "E excites I: 8 connections, sum 4, no delay",
    ]


def test_tied_weights_learn_with_others() -> None:
    spec = "neurovis: 1\nname: tied\nneurons: {A: {bias: 1}, B: {count: 2}, C: {}}\nconnections:\n"
    spec += "  A -> B: {pattern: all_to_all, weight: 0.5, plasticity: [oja, {decay: {rate: 0.1}}]}\n"
    spec += "  C -> B: {weight: {same_as: A -> B}}\n"
    assert nv.compile_text(spec).pathways() == [
        "A excites B: 2 connections, sum 1, delay 1 step, learns by oja + decay",
        "C excites B: 2 connections, sum 1, delay 1 step, learns with others, whose weights these are",
    ]


def test_inspect_prints_the_sentences(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(SPEC, encoding="utf-8")
    told = CliRunner().invoke(neurovis, ["inspect", str(tmp_path / "x.yaml"), "--pathways"])
    assert told.stdout.splitlines() == SENTENCES
    told = CliRunner().invoke(neurovis, ["inspect", str(tmp_path / "x.yaml"), "--pathways", "--format", "json"])
    assert json.loads(told.stdout) == SENTENCES


def test_a_group_is_a_glyph_and_what_excites_and_what_inhibits_a_line_each(tmp_path: Path) -> None:
    root = picture(tmp_path, step=0)
    neurons, lines = parts(root, "neuron"), parts(root, "connection")
    assert {name: group.get("data-size") for name, group in neurons.items()} == {"E": "4", "I": "2", "O": None}
    assert {name: group.get("data-size") for name, group in lines.items()} == {
        "E -> E1": "1",  # ordered by delay, rule, weight
        "E -> E2": "3",
        "E -> I": "8",
        "E -> O": "4",
        "I -> E": "8",
    }
    assert {"8 · Σ 4", "8 · Σ −8", "3 · Σ 2.5 · 1.5 ms", "4 · hebbian", "×4", "×2"} <= set(written(root))
    assert described(root) == SENTENCES


def test_the_sentences_are_of_the_steps_that_are_shown(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC)
    later = network.run(4).snapshot(3).weights[-4:].sum()
    assert f"E excites O: 4 connections, sum {later:.3g}, delay 0.5 ms, learns by hebbian" in described(
        picture(tmp_path, step=3)
    )
    network.animate(tmp_path / "x.svg", view="pathways", steps=4)
    moving = described(ET.parse(tmp_path / "x.svg").getroot())
    assert f"E excites O: 4 connections, sum 0 … {later:.3g}, delay 0.5 ms, learns by hebbian" in moving
    network.render(tmp_path / "x.svg", view="network")
    assert described(ET.parse(tmp_path / "x.svg").getroot()) == []


def test_what_is_lesioned_by_then_is_counted_and_told(tmp_path: Path) -> None:
    spec = SPEC + "events: [{at: 2, lesion: [E1, E2 -> I1]}]\n"
    whole = "E excites I: 8 connections, sum 4, delay 0.5 ms"
    assert nv.compile_text(spec).pathways()[2] == whole
    assert whole in described(picture(tmp_path, spec, step=1))
    root = picture(tmp_path, spec, step=2)
    assert whole.replace("connections,", "connections (3 lesioned),") in described(root)
    assert "8 · Σ 4 · 3 lesioned" in written(root)


def test_other_views_beside_it_show_all_neurons_and_collapsed_instances_are_one(tmp_path: Path) -> None:
    root = picture(tmp_path, view=["pathways", "matrix"])
    assert len(parts(root, "cell")) == 8 + 8 + 4 + 4
    assert set(parts(root, "neuron")) == {"E", "I", "O"}
    assert described(root)
    leg = (
        "neurovis: 1\nname: legs\nmodules: {leg: {neurons: {S: {bias: 1}, M: {count: 3}}, connections: {S -> M: 1}}}\n"
    )
    leg += "instances: {a: {module: leg}, b: {module: leg}}\nconnections: {a.M -> b.S: 0.5}\n"
    root = picture(tmp_path, leg, collapse="b")
    assert set(parts(root, "neuron")) == {"a.S", "a.M", "b"}
    assert described(root) == [
        "a.S excites a.M: 3 connections, sum 3, delay 1 step",
        "a.M excites b: 3 connections, sum 1.5, delay 1 step",
        "b excites itself: 3 connections, sum 3, delay 1 step",
    ]
    assert {"S", "M"} <= set(written(root))


def test_the_spec_asks_for_it_as_the_reader_does() -> None:
    spec = nv.compile_text(SPEC + "render: {figure: pathways}\n")
    for network, view in ((spec, None), (nv.compile_text(SPEC), "pathways")):
        look = still_of(network, Path("x.svg"), {**STILL, "view": view})
        assert (look.settings.pathways, look.panels) == (True, ())


def test_a_page_has_the_network_once_and_pathways_take_no_references(tmp_path: Path) -> None:
    with pytest.raises(ViewError, match="a page has the network once"):
        picture(tmp_path, view=["network", "pathways"])
    with pytest.raises(ViewError, match="the view 'pathways' shows all pathways: it takes no references"):
        picture(tmp_path, view="pathways: E")


def test_what_is_too_weak_for_the_picture_of_the_network_is_no_pathway_less(tmp_path: Path) -> None:
    spec = SPEC + "render: {min_weight: 0.75}\n"
    assert len(parts(picture(tmp_path, spec, step=0), "connection")) == 5
    with pytest.warns(UserWarning, match=r"2 of 5 pathways are left out: those with \|w\| < 2\.25"):
        assert len(parts(picture(tmp_path, spec, min_weight=2.25, step=0), "connection")) == 3


def test_what_its_author_has_placed_stays_there(tmp_path: Path) -> None:
    places = ", ".join(f"E{k}: [{k}, 0]" for k in range(1, 5))
    spec = SPEC + f"layout: {{positions: {{{places}, I1: [0, 4], I2: [1, 4], O: [8.5, 4]}}}}\n"
    discs = {name: group.find("{*}circle") for name, group in parts(picture(tmp_path, spec), "neuron").items()}
    where = {
        name: [float(disc.attrib[key]) for key in ("cx", "cy")] for name, disc in discs.items() if disc is not None
    }
    across, down = (np.subtract(where[name], where["E"]) for name in ("O", "I"))
    assert across[0] / down[1] == pytest.approx(6 / 4, abs=0.01)
    assert down[0] / down[1] == pytest.approx(-2 / 4, abs=0.01)


def test_a_live_page_shows_them_when_it_is_asked_to() -> None:
    compiled = nv.compile_text(SPEC)
    asked = {"activity": 2, "signal": 1, "thickness": 1, "change": 1, "pathways": True}
    command = command_of(json.dumps({"type": "draw", **asked}))
    assert isinstance(command, Draw)
    plain = Show().view(compiled)
    view = plain.otherwise(command.appearance)
    scene = json.loads(gzip.decompress(view.content))
    assert scene["told"] == SENTENCES
    assert [group["data"]["neuron"] for group in scene["groups"] if "neuron" in group["data"]] == ["E", "I", "O"]
    assert view.gains.activity.tolist() == (2 * pathway_gains(compiled)).tolist()
    members = view.members("n0")
    assert members is not None
    assert members.indices.tolist() == [0, 1, 2, 3]
    back = view.otherwise(plain.appearance)
    assert (back.content, json.loads(gzip.decompress(plain.content))["told"]) == (plain.content, [])


def pathway_gains(compiled: Compilation) -> FloatArray:
    """How much of each group's activity is full colour."""
    network = compiled.network
    return probe(replace(network, render=replace(network.render, pathways=True))).activity


@given(
    st.lists(st.integers(1, 6), min_size=4, max_size=4),
    st.lists(ENTRY, min_size=1, max_size=5, unique_by=lambda entry: entry[:2]),
)
@settings(max_examples=8, deadline=None)
def test_no_pathway_is_missing_and_none_says_what_is_not_true(
    counts: list[int], entries: list[tuple[str, str, str, str]]
) -> None:
    network = network_of(counts, entries).network
    drawn, ends = gathered(network, (), pathways=True), network.connections
    assert (drawn.bundle >= 0).all()
    assert drawn.counts.sum() == len(ends)
    group = [one.name for one in network.neurons.groups for _ in one.indices]
    lines, names = drawn.network.connections, [one.name for one in drawn.network.neurons.groups]
    weights = ends.weights.whole()
    for line in range(len(lines)):
        own = np.flatnonzero(drawn.bundle == line).tolist()
        between = names[lines.sources[line]], names[lines.targets[line]]
        assert {(group[ends.sources[index]], group[ends.targets[index]]) for index in own} == {between}
        assert len({bool(weights[index] < 0) for index in own}) == 1
        assert lines.weights[line] == pytest.approx(weights[own].sum())
