"""Trees in the engine ``large``: no crossing, no connection over a disc, and all runs along the direction."""

from __future__ import annotations

from random import Random

import layout_conformance as suite
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.layout import Direction, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem

Pairs = list[tuple[int, int]]


def made(pairs: Pairs, direction: Direction = "down", spacing: float = 1.0) -> LayoutProblem:
    names = [f"N{i}" for i in range(1 + max((max(pair) for pair in pairs), default=0))]
    edges = suite.named((names[a], names[b]) for a, b in pairs)
    return NamedProblem("tree", names, edges=edges, direction=direction, spacing=(spacing, 2.0)).canonical()


def check(problem: LayoutProblem) -> dict[str, float | int]:
    layout = suite.check(problem, "large")
    assert layout is not None
    measured = metrics(layout, problem)
    assert measured["crossings"] == measured["edges_over_neurons"] == 0
    assert measured["flow"] == 1
    return measured


@st.composite
def forests(draw: st.DrawFn) -> Pairs:
    """Each neuron is linked with one before it, if with any, either way round; those that recur are stars."""
    count = draw(st.integers(1, 60))
    mates = [draw(st.one_of(st.integers(-1, i - 1), st.integers(0, min(i - 1, 2)))) for i in range(1, count)]
    ways = draw(st.sampled_from([(True,), (False,), (True, False)]))
    pairs = [(mate, i) for i, mate in enumerate(mates, 1) if mate >= 0]
    return [(a, b) if draw(st.sampled_from(ways)) else (b, a) for a, b in pairs]


@settings(max_examples=12, deadline=None)
@given(forests(), st.sampled_from(["down", "right"]), st.sampled_from([0.2, 1.0, 3.0]))
def test_trees_have_no_crossing_and_all_runs_along(pairs: Pairs, direction: Direction, spacing: float) -> None:
    check(made(pairs, direction, spacing))


@pytest.mark.parametrize("ways", ["down", "up", "both"])
def test_large_trees_have_no_crossing(ways: str) -> None:
    random = Random(1)
    pairs = [(int(random.random() * i), i) for i in range(1, 800)]
    up = {"down": 0.0, "up": 1.0, "both": 0.5}[ways]
    check(made([(b, a) if random.random() < up else (a, b) for a, b in pairs]))


@pytest.mark.parametrize("ups", [0, 100, 300])
def test_a_star_is_a_fan(ups: int) -> None:
    problem = made([(i, 0) if i <= ups else (0, i) for i in range(1, 301)])
    layout = lay_out_problem(problem, "large")
    check(problem)
    x, y = layout.positions["N0"]
    far = [((a - x) ** 2 + (b - y) ** 2) ** 0.5 for name, (a, b) in layout.positions.items() if name != "N0"]
    assert max(far) < 36
    assert sum(b < y for _, b in layout.positions.values()) == ups


def test_chains_and_small_trees_stand_side_by_side() -> None:
    pairs = [(8 * k + i, 8 * k + i + 1) for k in range(300) for i in range(7)]
    problem = made(pairs)
    measured = check(problem)
    assert measured["area"] < 2.5 * 2400
    layout = lay_out_problem(problem, "large")
    places = [layout.positions[f"N{i}"] for i in range(8)]
    assert len({x for x, _ in places}) == 1
    assert [y for _, y in places] == sorted(y for _, y in places)


def test_a_long_chain_fills_the_plane() -> None:
    problem = made([(i, i + 1) for i in range(499)])
    places = lay_out_problem(problem, "large").positions.values()
    width, height = (max(c) - min(c) for c in zip(*places, strict=True))
    assert height < 4 * width


def test_links_there_and_back_and_loops_of_one_leave_a_tree_a_tree() -> None:
    problem = made([(0, 1), (1, 0), (1, 2), (2, 2), (3, 2), (3, 3)])
    layout = suite.check(problem, "large")
    assert layout is not None
    assert metrics(layout, problem)["crossings"] == 0
