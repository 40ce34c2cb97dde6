"""Lines bind the neurons that they name: what is declared with these finds its own rank."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from itertools import combinations

import layout_conformance as suite
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples

import neurovis_spec as nv
from neurovis_spec.layout import Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.problem import NamedProblem

LAYERS = """\
neurovis: 1
name: layers
neurons: {A: {count: 4, bias: 1}, B: {count: 4}, C: {count: 4}}
connections: {A -> B: {weight: 1, pattern: one_to_one}, B -> C: {weight: 1, pattern: one_to_one}}
"""
TWO_LEGS = """\
neurovis: 1
name: legs
modules:
  leg:
    neurons: {A: {count: 3}, B: {count: 3}}
    connections: {A -> B: {weight: 1, pattern: one_to_one}}
    layout: {align: [[A3, B1]]}
instances: {left: {module: leg}, right: {module: leg}}
neurons: {S: {bias: 1}}
connections: {S -> left.A: 1, S -> right.A: 1}
"""


def places(text: str) -> Mapping[str, Point]:
    return nv.compile_text(text).layout().positions


def heights(at: Mapping[str, Point], names: Sequence[str]) -> set[float]:
    return {at[name][1] for name in names}


def test_a_line_through_a_part_of_two_groups_leaves_the_others_in_their_layers() -> None:
    layout = nv.compile_text(f"{LAYERS}layout: {{align: [[A4, B1]]}}\n").layout()
    at = layout.positions
    assert at["A4"][1] == at["B1"][1]
    assert all(at[f"A{i}"][1] < at[f"B{i}"][1] < at[f"C{i}"][1] for i in (1, 2, 3, 4))
    measured = layout.metrics()
    assert (measured["flow"], measured["crossings"], measured["overlaps"]) == (1.0, 0, 0)


@pytest.mark.parametrize("line", ["[A, D]", "[A1..A4, D]", "[A1, A2]"])
def test_a_group_that_is_wholly_on_a_line_or_has_its_line_in_itself_shares_its_rank(line: str) -> None:
    text = LAYERS.replace("C: {count: 4}}", "C: {count: 4}, D: {}}").replace(
        "connections: {", "connections: {D -> B: 1, "
    )
    at = places(f"{text}layout: {{align: [{line}]}}\n")
    for group in "ABC":
        assert len(heights(at, [f"{group}{i}" for i in (1, 2, 3, 4)])) == 1
    assert heights(at, ["A1", "D"]) == heights(at, ["A1"])


def test_lines_over_a_loop_do_not_gather_groups_in_one_row() -> None:
    at = places(
        "neurovis: 1\nname: loop\nneurons: {A: {count: 3, bias: 1}, B: {count: 3}, C: {}}\n"
        "connections: {A -> B: {weight: 1, pattern: one_to_one}, B -> C: 1, C -> A1: 1}\n"
        "layout: {align: [[A1, B2], [B1, C]]}\n"
    )
    assert at["A1"][1] == at["B2"][1]
    assert at["B1"][1] == at["C"][1]
    assert at["A2"][1] < at["B2"][1] < at["C"][1]


def test_a_line_through_a_group_within_a_module_splits_it_in_every_instance() -> None:
    at = places(TWO_LEGS)
    for side in ("left", "right"):
        assert at[f"{side}.A3"][1] == at[f"{side}.B1"][1]
        assert all(at[f"{side}.A{i}"][1] < at[f"{side}.B{i}"][1] for i in (1, 2, 3))
    shapes = [
        [(at[f"{side}.{n}{i}"][0] - at[f"{side}.A1"][0], at[f"{side}.{n}{i}"][1]) for n in "AB" for i in (1, 2, 3)]
        for side in ("left", "right")
    ]
    assert shapes[0] == shapes[1]


@pytest.mark.parametrize("named", ["L4", "R4"])
def test_a_line_through_one_side_of_a_mirror_splits_both(named: str) -> None:
    at = places(
        "neurovis: 1\nname: sides\nneurons: {S: {bias: 1}, L: {count: 4}, R: {count: 4}, M: {}}\n"
        "connections: {S -> L: 1, S -> R: 1, L1 -> M: 1, R1 -> M: 1}\n"
        f"layout: {{mirror: [[L, R]], align: [[{named}, M]]}}\n"
    )
    assert at["L4"][1] == at["R4"][1] == at["M"][1]
    assert len(heights(at, ["L1", "L2", "L3", "R1", "R2", "R3"])) == 1
    assert at["L1"][1] < at["M"][1]


def test_what_is_put_on_the_line_of_a_pin_stands_on_nobody() -> None:
    at = places(
        "neurovis: 1\nname: held\nneurons: {A: {count: 3, bias: 1}, B: {count: 3}, C: {}}\n"
        "connections: {A -> B: {weight: 1, pattern: one_to_one}, B -> C: 1, C -> A1: 1}\n"
        "layout: {align: [[A1, B2], [B1, C]], positions: {C: [5, 5], A1: [0, 0]}}\n"
    )
    assert (at["A1"], at["C"], at["B2"][1], at["B1"][1]) == ((0, 0), (5, 5), 0, 5)
    assert all(distance(a, b) >= 0.6 for a, b in combinations(at.values(), 2))


@pytest.mark.parametrize(
    "lines",
    [[["C1", "C2", "C3"]], [["A1", "A2", "A3", "C1", "C2", "C3"]], [["C1", "C2"]], [["A1", "C1"], ["A1", "C3"]]],
)
def test_a_line_undoes_a_ring_that_nobody_asked_for(lines: list[list[str]]) -> None:
    names = {group: suite.members(group, 3) for group in "AC"}
    pairs = [(a, c) for c in names["C"] for a in (*names["A"], *names["C"]) if a != c]
    every = [*names["A"], *names["C"]]
    at = lay_out_problem(
        NamedProblem("ring", every, names.items(), suite.named(pairs), align=lines).canonical(), "layered"
    ).positions
    for line in lines:
        assert len(heights(at, line)) == 1
    assert all(distance(a, b) >= 0.6 for a, b in combinations(at.values(), 2))


def test_rings_that_two_lines_hold_at_different_heights_give_way() -> None:
    names = {group: suite.members(group, 5) for group in "CD"}
    pairs = [(a, b) for of in names.values() for a in of for b in of if a != b]
    every = [*names["C"], *names["D"]]
    lines = [["C1", "D2"], ["C3", "D5"]]
    at = lay_out_problem(
        NamedProblem("rings", every, names.items(), suite.named(pairs), align=lines).canonical(), "layered"
    ).positions
    assert all(len(heights(at, line)) == 1 for line in lines)


@examples(10)
@given(st.data())
def test_lines_hold_in_any_network_and_the_order_of_the_spec_does_not_show(data: st.DataObject) -> None:
    sizes = {group: data.draw(st.integers(1, 4)) for group in "ABC"}
    names = {group: suite.members(group, size) for group, size in sizes.items()}
    every = [name for members in names.values() for name in members]
    pairs = data.draw(st.lists(st.tuples(st.sampled_from(every), st.sampled_from(every)), max_size=12))
    lines = data.draw(st.lists(st.lists(st.sampled_from(every), min_size=2, max_size=3, unique=True), max_size=2))
    edges = suite.named(pairs, 1)

    def laid(groups: Sequence[str], shuffled: random.Random) -> Mapping[str, Point]:
        parts = [(group, names[group]) for group in groups]
        some, order, on = list(edges), list(every), [line[::-1] for line in lines]
        for of in (some, order, on):
            shuffled.shuffle(of)
        # never refused: nobody asked for what could hold these apart
        return lay_out_problem(NamedProblem("any", order, parts, some, align=on).canonical(), "layered").positions

    at = laid("ABC", random.Random(1))
    assert laid("CBA", random.Random(2)) == at
    for line in lines:
        assert len(heights(at, line)) == 1
    assert all(distance(a, b) >= 0.6 for a, b in combinations(at.values(), 2))
