from __future__ import annotations

from itertools import pairwise
from random import Random

import layout_conformance as suite
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.apart import LEAST, apart, jitter
from neurovis_layouts.organic import LargeEngine
from neurovis_layouts.organic.field import GridField, pair_field
from neurovis_layouts.organic.flow import in_flow
from neurovis_layouts.organic.levels import levels_of
from neurovis_layouts.packing import packed
from neurovis_layouts.wiring import parts_of, wiring_of

from neurovis_spec.layout import Direction, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import near_pairs
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem

SIZE = 20


def clusters(count: int, direction: Direction = "down", modules: bool = False) -> LayoutProblem:
    """Modules of 20 in which each neuron drives the three after it, one connection in ten leads anywhere later."""
    random = Random(1)
    total = count * SIZE
    pairs: dict[tuple[int, int], None] = {}
    for i in range(total):
        for step in (1, 2, 3):
            j = random.randrange(total) if random.random() < 0.1 else i - i % SIZE + (i % SIZE + step) % SIZE
            if i != j:
                pairs[min(i, j), max(i, j)] = None
    names = [f"M{i // SIZE}.N{i % SIZE}" for i in range(total)]
    edges = suite.named((names[a], names[b]) for a, b in sorted(pairs))
    paths = [(f"M{i}", "m") for i in range(count)] if modules else []
    return NamedProblem("clusters", names, edges=edges, direction=direction, modules=paths).canonical()


@pytest.mark.parametrize("direction", ["down", "left"])
def test_clusters_show_and_connections_run_along_the_direction(direction: Direction) -> None:
    problem = clusters(20, direction)
    layout = lay_out_problem(problem, "large")
    suite.check_positions(problem, layout)
    measured = metrics(layout, problem)
    assert measured["flow"] > 0.95
    assert measured["crossings"] < 30_000
    places = np.array([layout.positions[f"M{i // SIZE}.N{i % SIZE}"] for i in range(400)]).reshape(20, SIZE, 2)
    own = np.sqrt(((places - places.mean(axis=1, keepdims=True)) ** 2).sum(axis=2)).mean()
    whole = np.sqrt(((places.reshape(-1, 2) - places.mean(axis=(0, 1))) ** 2).sum(axis=1)).mean()
    assert own < whole / 4


def along(kind: str) -> list[tuple[int, int]]:
    """Connections of a sparse network in which every one can run along the direction."""
    random = Random(2)
    if kind == "tree":
        pairs = [(int(random.random() * i), i) for i in range(1, 400)]
        return [pair if random.random() < 0.5 else (pair[1], pair[0]) for pair in pairs]
    if kind == "ladder":
        return [(i, i + 2) for i in range(398)] + [(i, i + 1) for i in range(0, 400, 2)]
    return [(i, i + 1) for i in range(800)] + [(i, i + 40) for i in range(0, 760, 20) if kind == "skips"]


@pytest.mark.parametrize("kind", ["chain", "skips", "ladder", "tree"])
def test_all_connections_of_sparse_networks_run_along_the_direction(kind: str) -> None:
    pairs = along(kind)
    names = [f"N{i}" for i in range(max(max(pair) for pair in pairs) + 1)]
    problem = NamedProblem(kind, names, edges=suite.named((names[a], names[b]) for a, b in pairs)).canonical()
    layout = lay_out_problem(problem, "large")
    suite.check_positions(problem, layout)
    assert metrics(layout, problem)["flow"] == 1


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=30), st.lists(st.floats(-9, 9), min_size=10))
def test_heights_in_flow_are_the_given_ones_where_these_are(pairs: list[tuple[int, int]], high: list[float]) -> None:
    ends = np.array([(min(pair), max(pair)) for pair in pairs if pair[0] != pair[1]], dtype=np.int64).reshape(-1, 2)
    found = in_flow(np.array(high[:10]), ends[:, 0], ends[:, 1], 0.5)
    assert all(found[b] >= found[a] + 0.5 - 1e-9 for a, b in ends.tolist())
    assert in_flow(found, ends[:, 0], ends[:, 1], 0.5 - 1e-9) == pytest.approx(found)


def test_instances_of_modules_are_drawn_together_even_if_nothing_connects_them() -> None:
    names = [f"{m}.N{i}" for m in ("a", "b") for i in range(10)]
    layout = lay_out_problem(NamedProblem("x", names, modules=[("a", "m"), ("b", "m")]).canonical(), "large")
    a, b = (np.array([layout.positions[f"{m}.N{i}"] for i in range(10)]) for m in ("a", "b"))
    assert (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any()


def test_pins_stay_and_pull_the_rest_along() -> None:
    problem = clusters(6)
    pins = {0: (100.0, 50.0), 60: (140.0, 52.0)}
    pinned = LayoutProblem("x", problem.neurons, problem.groups, problem.edges, pins)
    layout = suite.check(pinned, "large")
    assert layout is not None
    xs = [x for x, _ in layout.positions.values()]
    assert 60 < min(xs) < max(xs) < 180


def test_progress_never_goes_back_and_comes_to_an_end() -> None:
    problem = clusters(20)
    seen: list[tuple[int, int]] = []
    with_progress = lay_out_problem(problem, "large", lambda done, total: seen.append((done, total)))
    assert with_progress == lay_out_problem(problem, "large")
    assert len(seen) > 100
    assert all(a[0] <= b[0] and a[1] == b[1] for a, b in pairwise(seen))
    assert seen[-1][0] == seen[-1][1] == 400
    assert LargeEngine.capabilities.progress


def test_levels_halve_a_network_and_lose_nothing() -> None:
    wiring = wiring_of(clusters(20), np.arange(400))
    levels, coarsest = levels_of(wiring)
    counts = [level.wiring.count for level in levels] + [coarsest.count]
    assert all(b <= 0.7 * a for a, b in pairwise(counts))
    assert counts[-1] <= 30
    assert coarsest.mass.sum() == pytest.approx(wiring.mass.sum()) == 400
    star = wiring_of(NamedProblem("star", suite.members("N", 500), edges=suite.named(
        ("N1", f"N{i}") for i in range(2, 501)
    )).canonical(), np.arange(500))  # fmt: skip
    assert levels_of(star)[1].count < 30


def test_the_grid_gives_nearly_the_field_of_all_pairs() -> None:
    places, mass = 30 * jitter(400), 1 + jitter(400)[:, 0]
    one, other = np.triu_indices(400, 1)
    exact, gridded = pair_field(mass, one, other)(places), GridField(mass)(places)
    assert np.abs(exact - gridded).mean() < 0.15 * np.abs(exact).mean()
    assert np.abs(exact.sum(axis=0)).max() < 1e-9


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), max_size=40))
def test_near_pairs_are_all_pairs_that_are_near(points: list[tuple[float, float]]) -> None:
    places = np.array(points, dtype=np.float64).reshape(-1, 2)
    one, other, _, _ = near_pairs(places, 1.3)
    found = sorted(tuple(sorted(pair)) for pair in zip(one.tolist(), other.tolist(), strict=True))
    squared = ((places[:, None] - places[None]) ** 2).sum(axis=2)
    n = len(places)
    assert found == [(i, j) for i in range(n) for j in range(i + 1, n) if squared[i, j] < 1.3 * 1.3]


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=60))
def test_discs_are_kept_apart_and_arcs_down(points: list[tuple[float, float]]) -> None:
    places = np.array(points)
    moved = apart(places, 0.75, np.arange(0))
    one, _, _, far = near_pairs(moved, 1.0)
    assert not len(one) or far.min() >= LEAST


def test_where_there_is_no_room_between_pins_arcs_give_way_to_discs() -> None:
    row = [(0.7 * i, 0.15) for i in range(-40, 41)]
    places = np.array([*row, (-40.0, 0.1), (-40.0, 0.2), (0.35, 0.15)])
    arcs = np.array([81, 83]), np.array([83, 82])
    moved = apart(places, 0.75, np.arange(83), arcs)
    assert (moved[:83] == places[:83]).all()
    assert np.sqrt(((moved[:83] - moved[83]) ** 2).sum(axis=1)).min() >= LEAST


def test_what_is_far_apart_already_stays() -> None:
    places = 2.0 * np.array([(i, j) for i in range(5) for j in range(5)], dtype=np.float64)
    assert np.abs(apart(places, 0.75, np.arange(0)) - places).max() < 0.001


def test_parts_are_numbered_by_their_first_point() -> None:
    a, b = np.array([4, 1, 5]), np.array([2, 3, 4])
    assert parts_of(7, a, b).tolist() == [0, 1, 2, 1, 2, 2, 3]
    chain = np.arange(5000)
    assert not parts_of(5001, chain, chain + 1).any()


@given(st.lists(st.tuples(st.floats(0, 9), st.floats(0, 9)), max_size=12))
def test_packed_parts_do_not_overlap(sizes: list[tuple[float, float]]) -> None:
    corners = packed(sizes, 1.0)
    for i, ((x, y), (w, h)) in enumerate(zip(corners, sizes, strict=True)):
        for (p, q), (v, g) in list(zip(corners, sizes, strict=True))[:i]:
            slack = 1 - 1e-9
            assert x + w + slack <= p or p + v + slack <= x or y + h + slack <= q or q + g + slack <= y


@pytest.mark.parametrize("tail", [30, 100])
def test_what_hangs_on_one_connection_leaves_the_rest_its_room(tail: int) -> None:
    random = Random(1)
    pairs = {(i, j) for i in range(300) for j in random.sample(range(300), 4) if i != j}
    pairs |= {(299 + i, 300 + i) for i in range(tail)}
    names = [f"N{i}" for i in range(300 + tail)]
    problem = NamedProblem("tail", names, edges=suite.named((names[a], names[b]) for a, b in sorted(pairs))).canonical()
    places = np.array(list(lay_out_problem(problem, "large").positions.values()))
    core, whole = np.ptp(np.quantile(places[:300], [0.05, 0.95], axis=0), axis=0), np.ptp(places, axis=0)
    assert (core > whole / 4).all()
    assert whole.prod() < 12 * len(places)


def test_many_clusters_with_few_connections_between_them_stay_close() -> None:
    random = Random(1)
    pairs: set[tuple[int, int]] = set()
    while len(pairs) < 2400:
        i = random.randrange(600)
        j = random.randrange(600) if random.random() < 0.01 else i - i % 30 + random.randrange(30)
        pairs |= {(i, j)} if i != j else set()
    names = [f"N{i}" for i in range(600)]
    problem = NamedProblem(
        "clusters", names, edges=suite.named((names[a], names[b]) for a, b in sorted(pairs))
    ).canonical()
    places = np.array(list(lay_out_problem(problem, "large").positions.values()))
    assert np.ptp(places, axis=0).prod() < 21 * len(places)
