from __future__ import annotations

import math
from itertools import pairwise
from unittest.mock import patch

import layout_conformance as suite
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.layout import Direction, Layout, LayoutProblem, Point, Route
from neurovis_spec.layout import metrics as measures
from neurovis_spec.layout.geometry import cubic, distance, pieces_of, snap, straight, turn
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem


def drawn(
    places: dict[str, Point],
    pairs: list[tuple[str, str]],
    direction: Direction = "down",
    pins: dict[str, Point] | None = None,
    routes: dict[str, Route] | None = None,
) -> tuple[Layout, LayoutProblem]:
    problem = NamedProblem("x", places, edges=suite.named(pairs), pins=pins or {}, direction=direction).canonical()
    lines = {
        e.name: straight(places[problem.neurons[e.source]], places[problem.neurons[e.target]]) for e in problem.edges
    }
    return Layout("x", "manual", places, lines | (routes or {})), problem


SQUARE = {"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (0.0, 2.0), "D": (2.0, 2.0)}


def test_a_cross_is_one_crossing() -> None:
    assert metrics(*drawn(SQUARE, [("A", "D"), ("B", "C")]))["crossings"] == 1
    assert metrics(*drawn(SQUARE, [("A", "C"), ("B", "D")]))["crossings"] == 0


def test_meeting_at_a_shared_neuron_is_no_crossing_but_meeting_elsewhere_is() -> None:
    assert metrics(*drawn(SQUARE, [("A", "D"), ("A", "C"), ("D", "C")]))["crossings"] == 0
    bent: Route = ((0.0, 0.0), (4.0, 0.0), (-2.0, 2.0), (2.0, 2.0))  # S-shaped: crosses the straight one half-way
    layout, problem = drawn(SQUARE, [("A", "D"), ("A", "D")], routes={"A -> D (2)": bent})
    assert metrics(layout, problem)["crossings"] == 1


def test_nearly_level_routes_are_counted_like_others() -> None:
    """Cells are flat here, and steep routes run through many of them."""
    places: dict[str, Point] = {f"A{i}": (0.0, i / 8) for i in range(40)}
    places |= {f"B{i}": (200.0, (39 - i) / 8) for i in range(40)}
    places |= {"C": (50.03, -3.0), "D": (50.03, 9.0), "E": (151.07, -3.0), "F": (151.07, 9.0)}
    pairs = [(f"A{i}", f"B{i}") for i in range(40)]
    assert metrics(*drawn(places, pairs))["crossings"] == 40 * 39 // 2
    assert metrics(*drawn(places, [*pairs, ("C", "D"), ("F", "E")]))["crossings"] == 40 * 39 // 2 + 80


def test_two_routes_may_cross_more_than_once() -> None:
    wave: Route = ((0.0, 0.0), (0.0, 8.0), (2.0, -8.0), (2.0, 0.0))
    places = {"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (-1.0, 0.5), "D": (3.0, 0.5)}
    layout, problem = drawn(places, [("A", "B"), ("C", "D")], routes={"A -> B": wave})
    line = [(x, y) for x, y in cubic(pieces_of([wave])[0], np.arange(1001) / 1000).tolist()]
    times = sum((a[1] < 0.5) != (b[1] < 0.5) for a, b in pairwise(line))
    assert times == 2
    assert metrics(layout, problem)["crossings"] == times


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 40)] * 4), min_size=2, max_size=9))
def test_crossings_are_those_found_by_trying_all_pairs(lines: list[tuple[int, int, int, int]]) -> None:
    # irrational stretches keep lines in general position
    ends = [((a * 1.0, b * math.sqrt(2) / 2), (c * math.sqrt(3) / 2, d + 0.123)) for a, b, c, d in lines]
    places = {f"N{i}": p for i, pair in enumerate(ends) for i, p in ((2 * i, pair[0]), (2 * i + 1, pair[1]))}
    pairs = [(f"N{2 * i}", f"N{2 * i + 1}") for i in range(len(ends))]

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    expected = sum(
        side(a, b, c) * side(a, b, d) < -1e-9 and side(c, d, a) * side(c, d, b) < -1e-9
        for i, (a, b) in enumerate(ends)
        for c, d in ends[:i]
    )
    close = any(
        0 < abs(side(*three)) <= 1e-6 or side(*three) == 0
        for i, (a, b) in enumerate(ends)
        for c, d in ends[:i]
        for three in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    )
    if not close:
        assert metrics(*drawn(places, pairs))["crossings"] == expected


def test_overlaps_are_pairs_closer_than_a_disc() -> None:
    places = {"A": (0.0, 0.0), "B": (0.59, 0.0), "C": (1.19, 0.0), "D": (-0.3, 0.3)}
    assert metrics(*drawn(places, []))["overlaps"] == 2


def test_routes_over_foreign_neurons_are_counted_once() -> None:
    row = {"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (2.0, 0.29), "D": (3.0, 0.31), "E": (9.0, 0.0)}
    assert metrics(*drawn(row, [("A", "E")]))["edges_over_neurons"] == 1
    assert metrics(*drawn(row, [("A", "B")]))["edges_over_neurons"] == 0
    assert metrics(*drawn({"A": row["A"], "D": row["D"], "E": row["E"]}, [("A", "E")]))["edges_over_neurons"] == 0


def test_flow_leaves_loops_out() -> None:
    pairs = [("A", "B"), ("B", "A"), ("A", "C"), ("D", "B")]
    assert metrics(*drawn(SQUARE, pairs))["flow"] == 0.5
    assert metrics(*drawn(SQUARE, pairs, "up"))["flow"] == 0.5
    assert metrics(*drawn(SQUARE, pairs, "right"))["flow"] == 0
    assert metrics(*drawn(SQUARE, [("A", "B"), ("B", "A")]))["flow"] == 1


def test_area_symmetry_pins_and_counts() -> None:
    found = metrics(*drawn(SQUARE, [("A", "D")], pins={"A": (0.0, 0.0), "B": (2.0, 0.5)}))
    assert math.isclose(float(found["area"]), 2.6 * 2.6)
    assert (found["neurons"], found["edges"], found["symmetry"], found["pins_moved"]) == (4, 1, 1, 1)
    assert set(found) == {
        "neurons", "edges", "crossings", "overlaps", "edges_over_neurons", "flow", "symmetry", "area", "pins_moved"
    }  # fmt: skip


def test_an_empty_layout_has_metrics() -> None:
    found = metrics(Layout("x", "grid", {}, {}), NamedProblem("x", []).canonical())
    assert found["area"] == 0
    assert found["flow"] == 1


@given(st.floats(-3, 3))
def test_turn_is_cosine_and_sine(part: float) -> None:
    cosine, sine = turn(part)
    assert math.isclose(cosine, math.cos(2 * math.pi * part), abs_tol=1e-14)
    assert math.isclose(sine, math.sin(2 * math.pi * part), abs_tol=1e-14)


@given(st.floats(-1e6, 1e6))
def test_snapping_is_odd_and_near(value: float) -> None:
    assert snap(-value) == -snap(value)
    assert abs(snap(value) - value) <= 1 / 2048
    assert distance((snap(value), 0), (value, 0)) <= 1 / 2048


def test_of_too_many_pairs_a_sample_of_the_routes_is_compared_which_is_said() -> None:
    places: dict[str, Point] = {f"A{i}": (math.cos(i), math.sin(i)) for i in range(60)}
    pairs = [(f"A{i}", f"A{(i * 7 + j * j + 1) % 60}") for i in range(60) for j in range(12)]
    layout, problem = drawn(places, [(a, b) for a, b in pairs if a != b])
    whole = metrics(layout, problem)
    assert "sampled" not in whole
    with patch.object(measures, "_MOST_PAIRS", 20_000):
        part = metrics(layout, problem)
    assert part["sampled"] < len(pairs) / 2
    assert abs(part["crossings"] / whole["crossings"] - 1) < 0.1


def test_images_in_an_instance_that_a_plan_turns_are_images() -> None:
    layout = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 2}}\nmodules: {m: {neurons: {L: {bias: 1}, R: {bias: 1}, O: {}}, "
        "connections: {L -> O: 1, R -> O: 1}, layout: {mirror: [[L, R]]}}}\ninstances: {x: {module: m}}\n"
        "connections: {x.O -> A1: 1, x.O -> A2: 1}\nlayout: {plan: [[A, x]]}\n"
    ).layout()
    assert layout.positions["x.L"][0] == layout.positions["x.R"][0]
    assert layout.metrics()["symmetry"] == 1
