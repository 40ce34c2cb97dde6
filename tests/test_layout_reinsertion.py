"""Reinsertion: what it counts is what there is, what leads down leads down, and crossings become fewer."""

from __future__ import annotations

from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.layered.insertion import CROSSING, Insertion
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.order import crossings, ordered
from neurovis_layouts.layered.ranks import ranks_of
from neurovis_layouts.layered.reinsertion import levels_in, reinserted
from neurovis_layouts.layered.units import Unit
from test_layout_order import assert_symmetric, halves_of, symmetric_levels

from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import LayoutEdge, LayoutGroup, LayoutProblem

Pairs = list[tuple[int, int]]


def problem(count: int, pairs: Pairs, *groups: tuple[int, ...]) -> LayoutProblem:
    """Neurons N0, N1, …, each a group of its own where no other is asked for."""
    names = tuple(f"N{i}" for i in range(count))
    edges = tuple(LayoutEdge(f"{names[a]} -> {names[b]}", a, b, 1) for a, b in pairs)
    wanted = groups or tuple((i,) for i in range(count))
    return LayoutProblem("test", names, tuple(LayoutGroup(f"G{m[0]}", m) for m in wanted), edges)


def levels(count: int, pairs: Pairs) -> Levels:
    rank = ranks_of(count, dict.fromkeys(pairs, 1.0), set(), set())
    return levels_of(problem(count, pairs), [Unit((i,)) for i in range(count)], rank, range(len(pairs)))


@st.composite
def downward(draw: st.DrawFn, most: int = 12) -> tuple[int, Pairs]:
    """A connected graph whose connections lead from lower to higher numbers."""
    count = draw(st.integers(3, most))
    pairs = {(draw(st.integers(0, i - 1)), i) for i in range(1, count)}
    more = draw(st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=14))
    pairs |= {(min(a, b), max(a, b)) for a, b in more if a != b}
    return count, sorted(pairs)


def cost_of(found: Levels, state: Insertion) -> int:
    """Counted in the levels that a state stands for."""
    length = sum(state.rank[link.lower] - state.rank[link.upper] for link in state.links if not link.idle)
    return crossings(*levels_in(found, state)) * CROSSING + length


@given(downward(), st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=60)
def test_what_is_taken_out_and_put_back_costs_what_is_counted(graph: tuple[int, Pairs], random: Random) -> None:
    found = levels(*graph)
    order = [random.sample(rank, len(rank)) for rank in found.ranks]
    state = Insertion(found, order, False, frozenset(range(graph[0])))
    cost = state.cost
    assert cost == cost_of(found, state)
    for _ in range(6):
        kept = state.keep()
        gone = random.sample(range(graph[0]), random.randint(1, graph[0] - 1))
        saved = state.take(gone)
        again = sum(state.put(node, random.getrandbits(20), 1 << 30) for node in gone)
        assert cost_of(found, state) == cost - saved + again
        assert all(state.rank[link.upper] < state.rank[link.lower] for link in state.links)
        if random.random() < 0.3:
            state.restore(kept)
        cost = cost_of(found, state)


@given(symmetric_levels(), st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=60)
def test_mirror_images_are_taken_out_and_put_back_together(found: Levels, random: Random) -> None:
    order = [list(random.choice(halves_of(found, rank))) for rank in found.ranks]
    state = Insertion(found, order, False)
    cost = state.cost
    assert cost == cost_of(found, state)
    for _ in range(6):
        leads = sorted(set(state.lead))
        gone = random.sample(leads, random.randint(1, len(leads)))
        saved = state.take(gone)
        again = sum(state.put(node, random.getrandbits(20), 1 << 30) for node in gone)
        assert cost_of(found, state) == cost - saved + again
        assert_symmetric(found, levels_in(found, state)[1])
        cost = cost_of(found, state)


def test_a_neuron_moves_to_a_rank_in_which_nothing_crosses() -> None:
    pairs = [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (1, 2), (1, 4), (1, 5), (2, 3)]
    found = levels(6, pairs)
    assert crossings(*ordered(found)) == 1  # in ranks that make the connections as short as can be
    moved, order = ordered(found, frozenset(range(6)))
    assert crossings(moved, order) == 0
    layout = metrics(lay_out_problem(problem(6, pairs), "layered"), problem(6, pairs))
    assert (layout["crossings"], layout["flow"]) == (0, 1)


@given(downward())
@settings(deadline=None, max_examples=40)
def test_levels_in_new_ranks_are_whole(graph: tuple[int, Pairs]) -> None:
    found = levels(*graph)
    count, moved, order = reinserted(found, found.ranks, False, frozenset(range(graph[0])))
    assert count == crossings(moved, order) <= crossings(found, found.ranks)
    assert sorted(node for rank in order for node in rank) == list(range(len(moved.nodes)))
    assert all(moved.nodes[node].rank == r for r, rank in enumerate(order) for node in rank)
    assert all(any(moved.nodes[node].members for node in rank) for rank in order)
    ends = {i: (upper, lower) for i, (upper, _, lower, _) in moved.ends.items()}
    assert ends == dict(enumerate(graph[1]))
    for i, (upper, lower) in ends.items():
        between = [moved.nodes[node].rank for node in moved.passages.get(i, [])]
        assert between == list(range(moved.nodes[upper].rank + 1, moved.nodes[lower].rank))


@given(downward(9))
@settings(deadline=None, max_examples=12)
def test_a_group_that_only_names_changes_nothing(graph: tuple[int, Pairs]) -> None:
    alone, grouped = problem(*graph), problem(*graph, tuple(range(graph[0])))
    assert lay_out_problem(alone, "layered") == lay_out_problem(grouped, "layered")


def test_a_loop_in_a_group_that_names_more_is_drawn_as_if_it_were_in_none() -> None:
    pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (4, 5), (5, 6), (0, 6), (6, 7)]
    alone, grouped = problem(8, pairs), problem(8, pairs, tuple(range(8)))
    assert lay_out_problem(alone, "layered") == lay_out_problem(grouped, "layered")


def test_more_effort_never_leaves_more_crossings() -> None:
    random = Random(5)
    pairs = sorted({(min(a, b), max(a, b)) for a, b in (random.sample(range(24), 2) for _ in range(60))})
    found = levels(24, pairs)
    free = frozenset(range(24))
    quick, normal = (crossings(*ordered(found, free, effort)) for effort in ("quick", "normal"))
    assert normal < quick
