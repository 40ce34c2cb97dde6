"""Ranks: as short as can be by trying all, forward outside loops, the same whatever the order of the input."""

from __future__ import annotations

from itertools import product
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from layout_conformance import members, named
from neurovis_layouts.layered.ranks import ranks_of, shortened

import neurovis_spec as nv
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem

Arcs = dict[tuple[int, int], float]


@st.composite
def connected_arcs(draw: st.DrawFn, most: int = 6) -> tuple[int, list[tuple[int, int, int]]]:
    """A connected graph whose arcs lead from lower to higher numbers, with weights."""
    count = draw(st.integers(2, most))
    weight = st.integers(1, 4)
    arcs = {(draw(st.integers(0, i - 1)), i): draw(weight) for i in range(1, count)}
    for a, b in draw(st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=6)):
        if a != b:
            arcs[min(a, b), max(a, b)] = draw(weight)
    return count, [(a, b, w) for (a, b), w in arcs.items()]


def length(rank: list[int] | tuple[int, ...], arcs: list[tuple[int, int, int]]) -> int:
    return sum(w * (rank[b] - rank[a]) for a, b, w in arcs)


@given(connected_arcs())
@settings(deadline=None)
def test_connections_are_as_short_as_can_be(graph: tuple[int, list[tuple[int, int, int]]]) -> None:
    count, arcs = graph
    found = shortened(list(range(count)), arcs)
    assert min(found) == 0
    assert all(found[b] > found[a] for a, b, _ in arcs)
    every = (rank for rank in product(range(count), repeat=count) if all(rank[b] > rank[a] for a, b, _ in arcs))
    assert length(found, arcs) == min(length(rank, arcs) for rank in every)


@given(connected_arcs(most=12))
@settings(deadline=None)
def test_the_order_of_arcs_does_not_show(graph: tuple[int, list[tuple[int, int, int]]]) -> None:
    count, arcs = graph
    given_arcs: Arcs = {(a, b): float(w) for a, b, w in arcs}
    turned: Arcs = dict(reversed(given_arcs.items()))
    found = ranks_of(count, given_arcs, set(), set())
    assert found == ranks_of(count, turned, set(), set())
    assert all(found[b] > found[a] for a, b, _ in arcs)
    assert length(found, arcs) == length(shortened(list(range(count)), arcs), arcs)


def test_parts_that_nothing_joins_begin_at_the_first_rank() -> None:
    arcs: Arcs = {(0, 1): 1.0, (1, 2): 1.0, (4, 3): 1.0}
    assert ranks_of(6, arcs, set(), set()) == [0, 1, 2, 1, 0, 0]


def test_a_tie_stands_early() -> None:
    arcs: Arcs = {(0, 1): 1.0, (1, 2): 1.0, (2, 3): 1.0, (0, 4): 1.0, (4, 3): 1.0}
    assert ranks_of(5, arcs, set(), set()) == [0, 1, 2, 3, 1]


def test_what_runs_within_a_step_is_never_turned() -> None:
    arcs: Arcs = {(0, 1): 1000.0, (1, 2): 1000.0, (2, 0): 1.0}
    assert ranks_of(3, arcs, set(), set()) == [0, 1, 2]


def test_what_is_in_no_loop_of_neurons_is_not_turned_for_one_of_units() -> None:
    arcs: Arcs = {(0, 1): 3.0, (1, 2): 3.0, (2, 0): 1.0}
    assert ranks_of(3, arcs, set(), set()) == [0, 1, 2]
    assert ranks_of(3, arcs, set(), set(), {(2, 0)}) == [1, 2, 0]


def test_a_group_shares_no_rank_where_a_connection_would_run_back_for_it() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 1}, D: {}, O: {}}\n"
        "connections: {A1 -> D: 1, D -> A2: 1, A1 -> O: 1, O -> A1: 1}\n"
    )
    assert network.layout("layered").metrics()["flow"] == 1


@given(st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=20)
def test_all_that_is_in_no_loop_runs_along_whatever_groups_there_are(random: Random) -> None:
    groups = [(name, members(name, random.randint(2, 4))) for name in "ABCD"]
    names = [name for _, own in groups for name in own]
    random.shuffle(names)
    ends = [sorted(random.sample(range(len(names)), 2)) for _ in range(16)]
    ends += [[b, a] for a, b in ends[:2]]
    edges = named(sorted({(names[a], names[b]) for a, b in ends}))
    problem = NamedProblem("x", names, groups, edges).canonical()
    assert metrics(lay_out_problem(problem, "layered"), problem)["flow"] == 1


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=14))
@settings(deadline=None)
def test_no_unit_of_a_loop_could_move_so_that_fewer_arcs_run_back(pairs: list[tuple[int, int]]) -> None:
    arcs: Arcs = {(a, b): 1.0 for a, b in pairs if a != b}
    rank = ranks_of(6, arcs, set(), set())

    def back(place: list[float]) -> int:
        return sum(place[a] >= place[b] for a, b in arcs)

    for unit in range(6):
        for there in range(-1, 7):
            moved = [float(level) for level in rank]
            moved[unit] = there + 0.5
            assert back(moved) >= back([float(level) for level in rank])


def fan(hidden: int, layout: str = "{}") -> nv.CompiledNetwork:
    return nv.compile_text(f"""\
neurovis: 1
name: fan
neurons: {{I: {{bias: 1}}, H: {{count: {hidden}}}, O: {{}}}}
connections: {{I -> H: {{pattern: all_to_all}}, H -> O: {{pattern: all_to_all}}}}
layout: {layout}
""")


@pytest.mark.parametrize("direction", ["down", "right"])
def test_a_rank_much_wider_than_a_page_stands_in_two_rows_with_lines_in_the_gaps(direction: str) -> None:
    layout = fan(64, f"{{direction: {direction}}}").layout()
    found = layout.metrics()
    assert (found["crossings"], found["edges_over_neurons"], found["overlaps"], found["flow"]) == (0, 0, 0, 1)
    at = {name: point if direction == "down" else point[::-1] for name, point in layout.positions.items()}
    assert len({at[f"H{i}"][1] for i in range(1, 65)}) == 2
    assert max(x for x, _ in at.values()) - min(x for x, _ in at.values()) < 40


@pytest.mark.parametrize(("hidden", "layout"), [(12, "{}"), (64, "{align: [[H]]}")])
def test_a_rank_that_fits_or_is_a_line_stays_level(hidden: int, layout: str) -> None:
    at = fan(hidden, layout).layout().positions
    assert len({at[f"H{i}"][1] for i in range(1, hidden + 1)}) == 1


def test_what_is_driven_from_outside_comes_first_in_a_loop() -> None:
    # the loop 0 → 1 → 2 → 0 may be cut anywhere; 3 drives 1, and 0 drives 4
    arcs = {(0, 1): 1.0, (1, 2): 1.0, (2, 0): 1.0, (3, 1): 1.0, (0, 4): 1.0}
    assert ranks_of(5, arcs, frozenset(), frozenset(), entered=0.25) == [3, 1, 2, 0, 4]
    # what leads back is one arc whatever counts
    for entered in (0.0, -0.25):
        ranks = ranks_of(5, arcs, frozenset(), frozenset(), entered=entered)
        assert sum(ranks[a] > ranks[b] for a, b in arcs) == 1


COLUMN = """
neurovis: 1
name: column
neurons:
  Th: {bias: 1}
  E4: {box: L4}
  I4: {box: L4}
  E2: {box: L2}
  I2: {box: L2}
  E5: {box: L5}
connections:
  Th -> E4 + I4: 1
  E4 -> I4 + E2: 1
  I4 -> E4: -1
  E2 -> I2 + E5 + I4: 1
  I2 -> E2: -1
"""


def test_a_few_that_drive_each_other_in_a_box_share_a_rank() -> None:
    layout = nv.compile_text(COLUMN).layout()
    heights = {name: y for name, (_, y) in layout.positions.items()}
    assert heights["Th"] < heights["E4"] == heights["I4"] < heights["E2"] == heights["I2"] < heights["E5"]
    # without boxes the one that comes first stands first
    plain = nv.compile_text(COLUMN.replace("{box: L4}", "{}").replace("{box: L2}", "{}")).layout().positions
    assert plain["E4"][1] < plain["I4"][1]
