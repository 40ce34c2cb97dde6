"""No connection arrives at a disc where another leaves it: an arrowhead on the start of a line makes both one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import layout_conformance as suite
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.routing.bows import bow
from neurovis_layouts.routing.improve import improved
from neurovis_layouts.routing.route_cost import Drawn
from test_layout_compound import attempt, walkers

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutEdge, LayoutProblem, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance, sampled, turn
from neurovis_spec.layout.model import Route
from neurovis_spec.layout.problem import problem_of

#: Where arrowheads lie.
AT = 0.45

BOXES = """neurovis: 1
name: boxes
neurons: {A: {count: 4, bias: 1}, B: {count: 4}, C: {count: 4}, D: {}}
connections: {A1 -> B1: 1, B1 -> C1: 1, C1 -> A2: 1, A2 -> C2: 1, C2 -> B2: 1, B2 -> A3: 1, A3 -> B3: 1, B3 -> C3: 1,
  C3 -> D: 1, A1 -> D: 1, A4 -> B4: 1, B4 -> C4: 1, C4 -> A4: 1}
layout: {boxes: {a: [A], b: [B], c: [C]}}
"""
PAIRS = """neurovis: 1
name: pairs
neurons: {A: {bias: 1}, B: {}, C: {}, D: {}, E: {}}
connections:
  - {A -> B: 1, B -> A: 1, B -> C: 1, C -> B: 0.5, C -> D: 1, D -> C: 1, A -> D: 1, D -> A: 0.5, A -> E: 1, E -> A: 1}
  - {E -> D: {weight: 1, delay: 2}, D -> E: 1, B -> B: 0.4}
  - {E -> D: {weight: 0.4, delay: 6}}
"""
MIRRORED = """neurovis: 1
name: mirrored
modules: {leg: {neurons: {m0: {}, m1: {}, m2: {}}, connections: {m0 -> m1: 1, m1 -> m2: 1}}}
instances: {left: {module: leg, count: 2}, right: {module: leg, count: 2}}
neurons: {C: {count: 2}, D: {count: 3}}
connections: {C1 -> left1.m0: 1, C2 -> right1.m0: 1, right1.m0 -> C2: 1, left1.m1 -> left2.m0: 1, right2.m1 -> D2: 1,
  left2.m1 -> left1.m1: 1, right1.m1 -> right2.m1: 1, D2 -> C1: 1, right2.m1 -> right1.m1: 1, C1 -> D1: 1, D1 -> C1: 1}
layout: {mirror: [[left, right], [C1, C2]]}
"""


def seen_at(route: Route) -> Point:
    """Where a route is beside its first disc."""
    return next((point for point in sampled(route, 0.02) if distance(point, route[0]) >= AT), route[-1])


def meetings(layout: Layout, problem: LayoutProblem, most: int) -> list[tuple[float, str, str]]:
    """How far departures and arrivals are from each other, at discs with so many ends at most."""
    ends: dict[int, list[tuple[bool, str, Point]]] = {}
    for edge in problem.edges:
        if edge.source != edge.target:
            route = layout.routes[edge.name]
            ends.setdefault(edge.source, []).append((True, edge.name, seen_at(route)))
            ends.setdefault(edge.target, []).append((False, edge.name, seen_at(route[::-1])))
    return [
        (distance(a[2], b[2]), a[1], b[1])
        for there in ends.values()
        for a, b in combinations(there, 2)
        if a[0] != b[0] and len(there) <= most
    ]


@pytest.mark.parametrize("engine", ["layered", "organic", "circular", "grid"])
@pytest.mark.parametrize("text", [BOXES, PAIRS, MIRRORED], ids=["boxes", "pairs", "mirrored"])
def test_no_connection_arrives_where_another_leaves(text: str, engine: str) -> None:
    problem = problem_of(nv.compile_text(text).network)
    problem = problem if engine == "layered" else replace(problem, mirrors=())
    assert min(meetings(lay_out_problem(problem, engine), problem, 8)) >= (0.12,)


def test_a_new_connection_arrives_where_no_old_one_leaves() -> None:
    text = "neurovis: 1\nname: more\nneurons: {A: {bias: 1}, B: {}, C: {}}\nconnections: {A -> B: 1, B -> C: 1"
    earlier = nv.compile_text(text + "}").layout(engine="layered")
    network = nv.compile_text(text + ", C -> B: 1, B -> A: 1, C -> A: 1}")
    later = network.layout(engine="layered", earlier=earlier.value)
    assert later.routes["A -> B"] == earlier.routes["A -> B"]
    assert min(meetings(later.value, problem_of(network.network), 8)) >= (0.12,)


@examples(10)
@given(problem=st.one_of(suite.problems(), walkers(mirrored=True)))
def test_where_ends_are_few_none_arrives_where_another_leaves(problem: LayoutProblem) -> None:
    layout, _ = attempt(problem)
    if layout is not None:
        assert min(meetings(layout, problem, 4), default=(1.0,)) >= (0.05,)


def test_where_ends_are_many_they_stay_as_even_as_they_are() -> None:
    """Such as those of a ring, whose lines are images of each other."""
    for count, high, turned in ((3, 0.4, True), (8, 0.8, False)):
        centres = [(6 * x, 6 * y) for x, y in (turn(i / count) for i in range(count))]
        pairs = [(a, b) for a in range(count) for b in range(count) if a != b]
        edges = [LayoutEdge(f"{a} -> {b}", a, b, 1) for a, b in pairs]
        routes = {i: bow(centres[a], centres[b], high, 0.3) for i, (a, b) in enumerate(pairs)}
        found = improved(Drawn(edges, centres, routes), routes.keys())
        assert bool(found) == turned
