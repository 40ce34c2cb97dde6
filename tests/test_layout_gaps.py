"""Gaps: what is small and connected to nothing else stands in a gap of what is large; instances of one kind stand
beside each other where the whole becomes shorter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from layout_conformance import named
from neurovis_layouts.layered.ranks import levelled
from neurovis_layouts.packing import gap_in

import neurovis_spec as nv
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem, problem_of

corners = st.tuples(*(st.integers(0, 20) for _ in range(4)))
pieces = st.lists(
    corners.map(lambda r: (min(r[0], r[2]) / 4, min(r[1], r[3]) / 4, max(r[0], r[2]) / 4, max(r[1], r[3]) / 4)),
    min_size=1,
    max_size=8,
)
sizes = st.tuples(st.integers(0, 12), st.integers(0, 12)).map(lambda size: (size[0] / 4, size[1] / 4))


@given(pieces, sizes)
def test_a_gap_is_the_first_place_that_is_free(rects: list[Rect], size: tuple[float, float]) -> None:
    low = [min(rect[k] for rect in rects) for k in (0, 1)]
    high = [max(rect[k + 2] for rect in rects) for k in (0, 1)]
    wide, down = size
    free = [
        (x, y)
        for y in np.arange(low[1], high[1] - down + 1e-9, 0.5).tolist()
        for x in np.arange(low[0], high[0] - wide + 1e-9, 0.5).tolist()
        if not any(meet((x, y, x + wide, y + down), rect, 1.0) for rect in rects)
    ]
    assert gap_in(np.array(rects), size, 1.0) == next(iter(free), None)


def test_a_pair_that_nothing_connects_stands_in_a_gap() -> None:
    wide = [("a", f"w{i}") for i in range(6)]
    long = [(f"w{i}", f"w{i}.{k}") if k == 0 else (f"w{i}.{k - 1}", f"w{i}.{k}") for i in (0, 5) for k in range(8)]
    pairs = [*wide, *long, ("p", "q")]
    problem = NamedProblem(
        "x", list(dict.fromkeys(name for pair in pairs for name in pair)), edges=named(pairs)
    ).canonical()
    layout = lay_out_problem(problem, "layered")
    rest = [place for name, place in layout.positions.items() if name not in "pq"]
    for k in (0, 1):
        for name in "pq":
            assert min(place[k] for place in rest) <= layout.positions[name][k] <= max(place[k] for place in rest)
    assert metrics(layout, problem)["crossings"] == 0


def test_instances_stand_beside_those_of_their_kind() -> None:
    legs = "m: {neurons: {x: {}, y: {count: 6}}, connections: {x -> y1: 1, "
    legs += ", ".join(f"y{k} -> y{k + 1}: 1" for k in range(1, 6)) + "}}"
    compiled = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {d: {count: 6}}\n"
        f"modules: {{{legs}}}\ninstances: {{a: {{module: m}}, b: {{module: m}}, c: {{module: m}}}}\n"
        "connections: {" + ", ".join(f"d{k} -> d{k + 1}: 1" for k in range(1, 6)) + ", "
        "d1 -> a.x: 1, d3 -> b.x: 1, d6 -> c.x: 1}\n"
        "render: {size: [300, 1500]}\n"  # on which nothing has to stand in bands
    )
    layout = lay_out_problem(problem_of(compiled.network), "layered")
    assert len({layout.positions[f"{leg}.x"][1] for leg in "abc"}) == 1
    assert metrics(layout, problem_of(compiled.network))["flow"] == 1


@pytest.mark.parametrize(
    ("arcs", "expected"),
    [
        ([(0, 1), (0, 2), (2, 3)], [0, 2, 1, 2]),
        ([(0, 1), (1, 4), (0, 2), (2, 3)], [0, 1, 1, 2, 2]),  # it drives what is there
        ([(0, 1), (0, 4), (0, 2), (2, 3)], [0, 1, 1, 2, 1]),  # another kind stays, so the rank is as high as before
    ],
)
def test_only_a_rank_that_becomes_flat_gives_up_its_instances(arcs: list[tuple[int, int]], expected: list[int]) -> None:
    rank = [0, 1, 1, 2, *([2 if (1, 4) in arcs else 1] if len(expected) > 4 else [])]
    assert levelled(rank, arcs, {1: "leg", 3: "leg", **({4: "other"} if len(expected) > 4 else {})}) == expected
