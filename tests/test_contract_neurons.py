"""Neurons (§3): what is left of the table and of the sentences around it."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from small_specs import answer, codes, compiled, network_of, wires


def titles(text: str, folder: Path) -> dict[str, str]:
    """What a pointer shows on each neuron and each connection of a picture."""
    path = folder / "x.svg"
    compiled(text).render(path, step=0)
    svg = path.read_text(encoding="utf-8")
    shown = re.findall(r'data-(?:neuron|connection)="([^"]*)"[^>]*><title>([^<]*)</title>', svg)
    return {name.replace("&gt;", ">"): title for name, title in shown}


def test_the_defaults_of_a_group() -> None:
    """A single neuron, identity, static, sum, no bias; without anything it stays at 0."""
    network = compiled("neurons: {A: {}}")
    assert network.describe()["neurons"] == [
        {
            "name": "A", "group": "A", "module": None,
            "activation": "identity", "model": "static", "combine": "sum", "bias": 0,
        }
    ]  # fmt: skip
    assert np.isnan(network.network.neurons.initial).all()
    assert network.run(3)["A"].tolist() == [0, 0, 0]


@pytest.mark.parametrize(("combine", "expected"), [("sum", 2 * 3 - 1 * 5), ("product", -30), ("distance", 5.0)])
def test_what_arrives_is_combined(combine: str, expected: float) -> None:
    """By the sum or the product of w·a, or by √Σ (w·a − c)²; the bias and the input are added to it."""
    centre = ", centre: [[3], [-1]]" if combine == "distance" else ""  # 2·3 − 3 and −1·5 + 1: 3 and −4
    body = f"{{matrix: [[2], [-1]]{centre}}}"
    text = (
        "inputs: {s: {expression: 100}}\n"
        f"neurons: {{A: {{count: 2, bias: [3, 5]}}, B: {{combine: {combine}, bias: 10, input: s}}}}\n"
        f"connections: {{A -> B: {body}}}"
    )
    assert compiled(text).run(2)["B"][1] == pytest.approx(expected + 110)


def test_initial_is_the_activity_at_step_0() -> None:
    """Without it step 0 is computed like any other."""
    run = compiled("neurons: {A: {bias: 2, initial: 7}, B: {bias: 2}}").run(2)
    assert (run["A"].tolist(), run["B"].tolist()) == ([7, 2], [2, 2])


def test_an_input_of_size_1_goes_to_all_and_one_of_size_n_to_one_each() -> None:
    """It is added to the combined input; other sizes are findings that name both."""
    groups = "A: {count: 3, input: one, bias: i}, B: {count: 3, input: three}"
    text = f"inputs: {{one: {{}}, three: {{size: 3}}}}\nneurons: {{{groups}}}"
    simulation = compiled(text).simulator()
    simulation.step(one=10, three=[1, 2, 3])
    assert simulation.activity.tolist() == [10, 11, 12, 1, 2, 3]
    code, message, _ = answer("inputs: {v: {size: 2}}\nneurons: {A: {count: 3, input: v}}")
    assert code == "wrong-size"
    assert "2" in message
    assert "3" in message


def test_where_a_number_is_drawn_once_it_may_hold_normal_and_uniform() -> None:
    """Bias, initial and weight, each neuron and connection its own; nowhere else, but in centres, delays and noise."""
    group = "{count: 3, bias: 'normal(0, 1)', initial: 'uniform(0, 1)', noise: 'normal(0, 1)'}"
    text = (
        f"neurons: {{A: {group}, B: {{combine: distance}}}}\n"
        "connections: {A -> A: {pattern: ring, weight: 'normal(0, 1)'}, A -> B: {centre: 'uniform(0, 1)'}}"
    )
    network = network_of(text)
    assert len(set(network.neurons.bias[:3])) == len(set(network.neurons.initial[:3])) == 3
    assert len(set(network.connections.weights[:3])) == len(set(network.connections.centres[3:])) == 3
    draw = '"uniform(1, 2)"'
    for elsewhere in (
        f"neurons: {{A: {{count: {draw}}}}}",
        f"neurons: {{A: {{count: 2, first: {draw}}}}}",
        f"neurons: {{A: {{activation: {{gaussian: {{sigma: {draw}}}}}}}}}",
        f"neurons: {{A: {{model: {{leaky_integrator: {{leak: {draw}}}}}}}}}",
        f"neurons: {{A: {{}}}}\nconnections: {{A -> A: {{plasticity: {{hebbian: {{rate: {draw}}}}}}}}}",
        f"neurons: {{A: {{}}}}\nconnections: {{A -> A: {{plasticity: hebbian, bounds: [-9, {draw}]}}}}",
        f"neurons: {{A: {{count: 3}}}}\nconnections: {{A -> A: {{pattern: {{random: {{probability: {draw}}}}}}}}}",
        f"neurons: {{A: {{}}}}\nparameters: {{p: {draw}}}",
        f"neurons: {{A: {{}}}}\ntime: {{steps: {draw}}}",
        f"neurons: {{A: {{}}}}\nevents: [{{at: {draw}, lesion: A}}]",
        f"neurons: {{A: {{}}}}\nevents: [{{from: 1, clamp: {{A: {draw}}}}}]",
    ):
        assert codes(elsewhere) == ["draw-not-allowed"], elsewhere


def test_a_position_is_data_and_no_pin() -> None:
    """``distance`` and ``nearest`` use it, the engine ``spatial`` draws by it, others do not care."""
    places = "position: [[9, 0], [0, 0], [5, 0]]"
    text = (
        "neurons: {{A: {{count: 3, bias: 1{0}}}}}\nconnections: {{A -> A: {{pattern: chain}}}}\nlayout: {{engine: {1}}}"
    )
    plain = compiled(text.format("", "layered")).layout().positions
    placed = compiled(text.format(f", {places}", "layered"))
    assert placed.layout().positions == plain
    assert placed.network.layout.positions == {}
    spatial = compiled(text.format(f", {places}", "spatial")).layout().positions
    assert spatial["A2"][0] < spatial["A3"][0] < spatial["A1"][0]
    near = f"neurons: {{A: {{count: 3, bias: 1, {places}}}}}\nconnections: {{A -> A: "
    assert [wire[:2] for wire in wires(network_of(near + "{pattern: {nearest: {count: 1}}}}"))] == [
        ("A1", "A3"), ("A2", "A3"), ("A3", "A1"),
    ]  # fmt: skip
    assert [wire[2] for wire in wires(network_of(near + "{pattern: chain, weight: distance}}"))] == [9, 5]


def test_labels_titles_and_boxes_are_free_texts(tmp_path: Path) -> None:
    """With whatever characters (in a label a brace is written twice); names are not."""
    free = "a, b: {c} <d> & \u00fc # e"
    label = free.replace("{", "{{").replace("}", "}}")
    text = f'title: "{free}"\nneurons: {{A: {{label: "{label}", box: "{free}"}}, B: {{box: "{free}"}}}}'
    network = network_of(text)
    assert (network.title, network.neurons.labels[0]) == (free, free)
    assert [name for name, _ in network.layout.boxes] == [free] or {group.box for group in network.neurons.groups} == {
        free
    }
    compiled(text).render(tmp_path / "x.svg", step=0)
    assert codes(f'neurons: {{A: {{names: ["{free}"]}}}}') == ["bad-name"]


def test_a_description_is_shown_where_a_pointer_stands(tmp_path: Path) -> None:
    """On every neuron of the group, and on every connection of the entry."""
    text = (
        "neurons: {A: {count: 2, bias: 1, description: what A is}, B: {description: what B is}}\n"
        "connections: {A -> B: {description: how it goes}}"
    )
    shown = titles(text, tmp_path)
    assert sorted(name for name, title in shown.items() if "what A is" in title) == ["A1", "A2"]
    assert "what B is" in shown["B"]
    assert sorted(name for name, title in shown.items() if "how it goes" in title) == ["A1 -> B", "A2 -> B"]


def test_a_role_is_input_hidden_or_output() -> None:
    """Another word is answered with these."""
    for role in ("input", "hidden", "output"):
        assert compiled(f"neurons: {{A: {{role: {role}}}}}").warnings == ()
    code, message, _ = answer("neurons: {A: {role: sensor}}")
    assert code == "unknown-value"
    assert "input, hidden, output" in message


def test_a_name_is_unique_in_its_scope_and_scopes_are_their_own() -> None:
    """The same name in the spec and in a module are two neurons."""
    text = "modules: {m: {neurons: {A: {bias: 2}}}}\nneurons: {A: {bias: 1}}\ninstances: {i: {module: m}}"
    assert compiled(text).run(1).activity.tolist() == [[1, 2]]


MANY = "neurons: {A: {count: 4000, bias: 1}}\nconnections: {A -> A: {pattern: "


@pytest.mark.parametrize(
    "text",
    [
        "neurons: {A: {count: 1000001}}",
        "neurons: {A: {count: 9e15}}",
        "modules: {m: {neurons: {K: {count: 1000001}}}}\ninstances: {i: {module: m, count: 2}}",
        "modules: {m: {neurons: {K: {count: 10000}}}}\ninstances: {i: {module: m, count: 10000}}",
        MANY + "all_to_all}}",
        MANY + "{random: {probability: 0.7}}}}",
        MANY + "{fixed_indegree: {count: 2501}}}}",
        MANY + "{nearest: {count: 2501}}}}",
        MANY + "{small_world: {degree: 2502, rewire: 0}}}}",
        MANY + "{band: {width: 1600}}}}",
    ],
)
def test_limits_are_checked_before_memory_is_taken(text: str) -> None:
    """A million neurons and ten million connections: what would go beyond is refused while it is still small."""
    tracemalloc.start()
    try:
        assert codes(text) == ["too-many"]
        assert tracemalloc.get_traced_memory()[1] < 64 << 20  # ten million connections alone would take 400 MB
    finally:
        tracemalloc.stop()
