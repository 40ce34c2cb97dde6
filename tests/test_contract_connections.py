"""Connections (§4): what is left of the table, the list below it and the paragraph about randomness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_specs import answer, codes, compiled, network_of, pairs, weights, wires

from neurovis_spec.compiler.values.draws import Stream

ABD = "neurons: {A: {count: 2, bias: 1}, B: {count: 3}, O: {}, D: {count: 2, combine: distance}}\nconnections: "


def test_the_defaults_of_a_connection() -> None:
    """Weight 1, delay 1, centre 0, no rule, no bounds."""
    network = network_of(ABD + "{A1 -> O: , A1 -> D1: }")
    lines = network.connections
    assert wires(network) == [("A1", "O", 1, 1), ("A1", "D1", 1, 1)]
    assert lines.centres.tolist() == [0, 0]
    assert lines.rules.tolist() == [-1, -1]
    assert (lines.low.tolist(), lines.high.tolist()) == ([-np.inf] * 2, [np.inf] * 2)


def test_a_mapping_and_a_list_of_mappings_say_the_same() -> None:
    """The list is there for connections that share their ends."""
    one = network_of(ABD + "{A1 -> O: 2, A2 -> O: 3}")
    other = network_of(ABD + "[{A1 -> O: 2, A2 -> O: 3}]")
    third = network_of(ABD + "[{A1 -> O: 2}, {A2 -> O: 3}]")
    assert one.hash == other.hash == third.hash
    assert wires(network_of(ABD + "[{A1 -> O: 2}, {A1 -> O: 3}]")) == [("A1", "O", 2, 1), ("A1", "O", 3, 1)]


def test_a_scale_is_applied_when_weights_are_made() -> None:
    """What a rule makes of them afterwards is not scaled again."""
    text = (
        "neurons: {A: {count: 2, bias: 1}, O: {}}\nconnections: "
        "{A -> O: {weight: i + 3, delay: 0, scale: {norm: 10}, plasticity: {decay: {rate: 0.5}}}}"
    )
    assert compiled(text).run(3).weights.tolist() == [[6, 8], [3, 4], [1.5, 2]]


def test_a_scale_is_that_of_its_entry_alone() -> None:
    """Other connections into the same target do not count."""
    text = ABD + "{A -> O: {weight: 3, scale: {indegree: true}}, B -> O: 3}"
    assert weights(text) == [1.5, 1.5, 3, 3, 3]


def test_a_centre_may_use_all_that_a_weight_may() -> None:
    """And a matrix of centres gives the shape, too."""
    places = "position: [[0, 0], [3, 4]]"
    text = f"neurons: {{A: {{count: 2, bias: 1, {places}}}, D: {{combine: distance, position: [0, 0]}}}}\nconnections: "
    found = network_of(text + "{A -> D: {centre: 10*i + 100*j + n_from + 1000*n_to + distance}}").connections
    assert found.centres.tolist() == [1002, 1017]
    assert pairs(text + "{A -> D: {centre: [[7], [null]]}}") == ["A1 D"]


def test_an_empty_cell_is_null_in_a_matrix_and_an_error_in_an_input(tmp_path: Path) -> None:
    """A header is a first row of texts."""
    (tmp_path / "w.csv").write_text("x,y,z\n1,,3\n,5,\n", encoding="utf-8")
    found = wires(network_of(ABD + "{A -> B: {matrix: {file: w.csv}}}", tmp_path))
    assert found == [("A1", "B1", 1, 1), ("A1", "B3", 3, 1), ("A2", "B2", 5, 1)]
    for place in (
        "inputs: {s: {file: w.csv}}\nneurons: {A: {count: 3, input: s}}",
        "neurons: {A: {count: 2, position: {file: w.csv}}}",
    ):
        assert len(codes(place, tmp_path)) == 1


@pytest.mark.parametrize(
    ("body", "place"),
    [
        ("{weight: 3, bounds: [0, 1], plasticity: hebbian}", "3"),
        ("{weight: 'uniform(2, 3)', bounds: [0, 1], plasticity: hebbian}", "2."),
        ("{matrix: [[0.5], [7]], bounds: [0, 1], plasticity: hebbian}", "7"),
        ("{edges: [[A1, O, 0.5], [A2, O, -2]], bounds: [0, 1], plasticity: hebbian}", "-2"),
        ("{bounds: [2, 3], plasticity: hebbian}", "1"),
    ],
)
def test_a_first_weight_outside_bounds_is_an_error(body: str, place: str) -> None:
    """However it is made; also the default of 1."""
    code, message, _ = answer(f"{ABD}{{A -> O: {body}}}")
    assert code == "weight-outside"
    assert place in message


PURPOSES = """\
seed: 11
neurons:
  A: {count: 3, bias: "normal(0, 1) + uniform(0, 1)", initial: "uniform(0, 1)", noise: "uniform(0, 1)"}
  D: {count: 2, combine: distance}
connections:
  - A -> D: {pattern: all_to_all, centre: "normal(0, 1)", weight: "uniform(0, 1)"}
  - A -> D: {pattern: {random: {probability: 0.5}}}
"""


def test_a_draw_goes_by_seed_purpose_name_and_the_counter() -> None:
    """Weight and centre by (i, j, 0, number), bias and initial by (i, 0, 0, number), noise with the step."""
    network = compiled(PURPOSES).network
    i, j = np.repeat(np.arange(3), 2), np.tile(np.arange(2), 3)
    lines, n = network.connections, np.arange(3)
    assert lines.weights[:6].tolist() == Stream(11, "weight", "A -> D").uniform(i, j, 0, 0).tolist()
    assert lines.centres[:6].tolist() == Stream(11, "centre", "A -> D").normal(i, j, 0, 0).tolist()
    bias = Stream(11, "bias", "A")
    assert network.neurons.bias[:3].tolist() == (bias.normal(n, 0, 0, 0) + bias.uniform(n, 0, 0, 1)).tolist()
    assert network.neurons.initial[:3].tolist() == Stream(11, "initial", "A").uniform(n, 0, 0, 0).tolist()
    s, t = Stream(11, "edges", "A -> D (2)").random_pairs(3, 2, 0.5)
    assert [(a, b - 3) for a, b in zip(lines.sources[6:], lines.targets[6:], strict=True)] == list(
        zip(s, t, strict=True)
    )
    noise = Stream(11, "noise", "A")
    for k in (1, 2):
        expected = network.neurons.bias[:3] + noise.uniform(n, 0, k, 0)
        np.testing.assert_array_equal(compiled(PURPOSES).run(3)["A"][k], expected)
