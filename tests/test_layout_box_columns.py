"""Columns: boxes that drive each other to and fro stand beside each other, and everything still runs along."""

from __future__ import annotations

import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.layered.box_columns import Strips, spined, straightened, tied
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.order import ordered
from neurovis_layouts.layered.units import Unit

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutEdge, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import LayoutGroup, LayoutModule

HEXAPOD = Path(__file__).resolve().parent.parent / "specs" / "hexapod" / "hexapod.yaml"


def boxed(edges: list[tuple[int, int]], *boxes: tuple[int, ...]) -> LayoutProblem:
    """A problem of single neurons n0, n1, …; delay 1 throughout."""
    count = 1 + max(max(edge) for edge in edges)
    names = [f"n{i:02}" for i in range(count)]
    return LayoutProblem(
        "columns",
        tuple(names),
        (),
        tuple(LayoutEdge(f"{names[a]} -> {names[b]}", a, b, 1) for a, b in sorted(edges)),
        boxes=tuple((f"box {k}", members) for k, members in enumerate(boxes)),
    )


def strip(layout: Layout, problem: LayoutProblem, box: int) -> tuple[float, float, float, float]:
    at = [layout.positions[problem.neurons[m]] for m in problem.boxes[box][1]]
    return min(x for x, _ in at), min(y for _, y in at), max(x for x, _ in at), max(y for _, y in at)


def test_boxes_that_drive_each_other_to_and_fro_stand_side_by_side() -> None:
    problem = boxed([(0, 1), (1, 2), (2, 3), (3, 4), (4, 5)], (0, 2, 4), (1, 3, 5))
    layout = lay_out_problem(problem, "layered")
    found = metrics(layout, problem)
    assert found["flow"] == 1
    assert found["edges_over_neurons"] == 0
    left, right = sorted((strip(layout, problem, 0), strip(layout, problem, 1)))
    assert left[2] + 1.2 <= right[0]  # the lines of two boxes, each 0.6 from its neurons
    assert left[1] < right[3]  # beside each other, not one after the other
    assert right[1] < left[3]


def test_a_box_left_and_entered_again_is_one_column() -> None:
    # from the box to the hidden neurons and back, twice; in blocks one of these would run against the direction
    problem = boxed([(0, 1), (1, 2), (2, 3), (3, 4), (0, 5), (5, 4)], (0, 2, 4))
    layout = lay_out_problem(problem, "layered")
    assert metrics(layout, problem)["flow"] == 1
    x0, y0, x1, y1 = strip(layout, problem, 0)
    for i, name in enumerate(problem.neurons):
        x, y = layout.positions[name]
        if i not in (0, 2, 4) and y0 <= y <= y1:
            assert x < x0 - 0.6 or x > x1 + 0.6, name


def test_a_box_that_holds_some_of_a_ring_is_no_column() -> None:
    group = LayoutGroup("C", (0, 1, 2))
    legs = tuple(LayoutModule(name, "leg", -1, (n,), "leg", {}, None) for n, name in ((3, "left1"), (4, "right1")))
    problem = LayoutProblem(
        "ring",
        ("C1", "C2", "C3", "left1.S1", "right1.S1"),
        (group, LayoutGroup("left1.S", (3,)), LayoutGroup("right1.S", (4,))),
        (LayoutEdge("C1 -> C3", 0, 2, 0), LayoutEdge("C2 -> C3", 1, 2, 0), LayoutEdge("C3 -> C1", 2, 0, 0)),
        boxes=(("frame", (0, 1)),),
        modules=legs,
    )
    layout = lay_out_problem(problem, "layered")
    assert metrics(layout, problem)["overlaps"] == 0
    x0, y0, x1, y1 = strip(layout, problem, 0)
    x, y = layout.positions["C3"]
    assert not (x0 - 0.6 < x < x1 + 0.6 and y0 - 0.6 < y < y1 + 0.6)


def test_the_hexapod_without_hints_runs_along(tmp_path: Path) -> None:
    folder = shutil.copytree(HEXAPOD.parent, tmp_path / "hexapod")
    leg = folder / "modules" / "leg.yaml"
    leg.write_text(leg.read_text().partition("    layout:")[0])
    before, _, rest = HEXAPOD.read_text().partition("  mirror:")
    boxes = rest.partition("  boxes:")[2]
    network = nv.compile_text(f"{before}  boxes:{boxes}", folder=folder)
    found = network.layout(engine="layered").metrics()
    assert found["flow"] >= 0.95  # from leg to leg sideways
    assert found["edges_over_neurons"] == found["overlaps"] == 0
    assert found["crossings"] <= 80


@st.composite
def cases(draw: st.DrawFn) -> tuple[LayoutProblem, list[int], list[Unit]]:
    """Up to three columns and neurons in none, in up to six ranks, connected from each rank to the next."""
    count = draw(st.integers(3, 12))
    rank = [draw(st.integers(0, 5)) for _ in range(count)]
    heights = sorted(set(rank))
    rank = [heights.index(r) for r in rank]
    pairs = [(a, b) for a in range(count) for b in range(count) if rank[b] > rank[a]]
    edges = draw(st.lists(st.sampled_from(pairs), unique=True, max_size=14)) if pairs else []
    owner = [draw(st.integers(-1, 2)) for _ in range(count)]
    boxes = [tuple(i for i in range(count) if owner[i] == box) for box in range(3)]
    problem = boxed([*edges, (count - 1, count - 1)], *(box for box in boxes if box))
    return problem, rank, [Unit((i,)) for i in range(count)]


def built(problem: LayoutProblem, rank: list[int], units: list[Unit]) -> tuple[Levels, list[list[int]], set[int]]:
    columns = set(range(len(problem.boxes)))
    levels = levels_of(problem, units, rank, range(len(problem.edges)), columns)
    spined(problem, levels, columns)
    order = straightened(levels, ordered(levels)[1], columns)
    return (levels, order or [], columns)


@examples(25)
@given(cases())
def test_what_hangs_together_is_on_one_side_of_a_column(case: tuple[LayoutProblem, list[int], list[Unit]]) -> None:
    levels, order, columns = built(*case)
    side: dict[tuple[int, int], int] = {}
    for box in columns:
        for rank in order:
            own = [i for i, n in enumerate(rank) if levels.nodes[n].box == box]
            assert own == list(range(own[0], own[-1] + 1)) if own else True
            for i, n in enumerate(rank):
                if own and i not in own:
                    side[box, n] = -1 if i < own[0] else 1
    for gap in levels.segments:
        for segment in gap:
            for box in columns:
                ends = side.get((box, segment.upper)), side.get((box, segment.lower))
                assert None in ends or ends[0] == ends[1]


@examples(25)
@given(cases(), st.lists(st.floats(-20, 20), min_size=60, max_size=60))
def test_strips_keep_every_distance(case: tuple[LayoutProblem, list[int], list[Unit]], wishes: list[float]) -> None:
    levels, order, columns = built(*case)
    if not order:
        return
    levels, order = tied(levels, order, columns)
    gaps = [[0.7] * max(0, len(rank) - 1) for rank in order]
    strips = Strips(levels, order, gaps, columns)
    if not strips.fit():
        return
    wish = (wishes * (1 + len(levels.nodes) // len(wishes)))[: len(levels.nodes)]
    x = strips.kept(wish, {})
    for rank in order:
        for a, b in pairwise(rank):
            assert x[b] - x[a] >= 0.7 - 1e-9
    for box in columns:
        ranks = [rank for rank in order if any(levels.nodes[n].box == box for n in rank)]
        own = [x[n] for rank in ranks for n in rank if levels.nodes[n].box == box and levels.nodes[n].members]
        for rank in ranks:
            for n in rank:
                if levels.nodes[n].box != box and levels.nodes[n].members:
                    assert not min(own) - 1.1 < x[n] < max(own) + 1.1


@pytest.mark.parametrize("turn", [False, True])
def test_columns_come_out_the_same_in_any_order_of_the_boxes(turn: bool) -> None:
    edges = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (1, 5)]
    boxes = [(0, 2, 4), (1, 3, 5)]
    plain = lay_out_problem(boxed(edges, *boxes), "layered")
    other = lay_out_problem(boxed(edges, *(boxes[::-1] if turn else boxes)), "layered")
    assert plain.positions == other.positions
    assert plain.routes == other.routes
