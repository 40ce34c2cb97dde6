"""Mirror images that drive each other are joined by arcs: clear of discs, of foreign frames, and of each other. What no
arc gets round takes a detour."""

from __future__ import annotations

import layout_conformance as suite
import pytest
from hypothesis import given
from laws import examples
from test_layout_compound import attempt, walkers
from test_layout_reciprocal import pairs, together

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.problem import problem_of


def spec(modules: str, neurons: str, connections: str, layout: str = "", count: int = 1) -> str:
    return (
        f"neurovis: 1\nname: arcs\nmodules: {modules}\n"
        f"instances: {{l: {{module: leaf, count: {count}}}, r: {{module: leaf, count: {count}}}}}\n"
        f"neurons: {neurons}\nconnections: {{{connections}}}\nlayout: {{mirror: [[l, r]]{layout}}}\n"
    )


#: a neuron on the axis, in the way of the upper arc
ON_THE_AXIS = spec(
    "{leaf: {neurons: {t: {}, u: {}, v: {}}, connections: {t -> v: 1}}}",
    "{A: {}, B: {count: 2}}",
    "A -> B1: 1, l1.u -> r1.u: 1, r1.u -> l1.u: 1",
)
#: two of their own frames' neurons in the way of the straight line
IN_A_RANK = spec(
    "{leaf: {neurons: {s: {}, t: {}, u: {}, v: {}}, connections: {s -> v: 1, t -> u: 1, t -> v: 1}}}",
    "{A: {}, B: {count: 2}, O: {}}",
    "A -> B1: 1, A -> O: 1, B1 -> O: 1, l1.u -> r1.u: 1, r1.u -> l1.u: -1, l1.v -> B2: 1, r1.v -> B2: 1, r1.s -> B2: 1,"
    " l1.s -> B2: 1, r1.u -> B2: 1, l1.u -> B2: 1, O -> r1.u: 1, O -> l1.u: 1",
)
#: foreign frames between them
BEYOND_FRAMES = spec(
    "{knee: {neurons: {s: {}, u: {}}}, leaf: {neurons: {x: {}, y: {}}, instances: {p: {module: knee},"
    " q: {module: knee}}, connections: {x -> p.s: 1, q.s -> p.u: 1, q.s -> y: 1, q.u -> y: 1},"
    " layout: {mirror: [[p, q]]}}}",
    "{A: {}, B: {}, O: {}}",
    "l1.p.s -> r1.p.s: 1, r1.p.s -> l1.p.s: 1, l1.y -> r2.x: 1, r2.x -> l2.p.s: 1, l2.x -> r1.p.s: 1",
    ", direction: up",
    count=2,
)
#: a neuron on the axis at the height of both
BETWEEN = spec(
    "{leaf: {neurons: {s: {}, t: {}, u: {}}, connections: {s -> t: 1, t -> u: 1}}}",
    "{A: {}, B: {count: 2}}",
    "A -> B2: 1, r1.t -> l1.t: 1, l1.t -> r1.t: 1",
    ", direction: left",
)
#: pairs in a row of frames
IN_A_ROW = spec(
    "{leaf: {neurons: {E: {}, F: {}}, connections: {E -> F: -1, F -> E: -1, E -> E: 1}}}",
    "{O: {count: 2}, Q: {}}",
    "l1.F -> r1.F: 1, r1.F -> l1.F: 1, l2.F -> r2.F: 1, r2.F -> l2.F: 1, l1.E -> l2.E: 1, l2.E -> l3.E: 1,"
    " l3.E -> l4.E: 1, r1.E -> r2.E: 1, r2.E -> r3.E: 1, r3.E -> r4.E: 1, l4.E -> O1: 1, r4.E -> O2: 1, Q -> l1.E: 1,"
    " Q -> r1.E: 1, l4.F -> r1.E: 1",
    count=4,
)
HALVES = {
    "on the axis": ON_THE_AXIS,
    "in a rank": IN_A_RANK,
    "beyond frames": BEYOND_FRAMES,
    "between": BETWEEN,
    "in a row": IN_A_ROW,
}


def over_discs(layout: Layout) -> list[tuple[str, str]]:
    """Connections and the neurons that they run over."""
    return [
        (name, neuron)
        for name, route in layout.routes.items()
        for neuron, place in layout.positions.items()
        if neuron not in name.split(" (")[0].split(" -> ")
        and min(distance(place, point) for point in sampled(route, 0.05)) < 0.3
    ]


def halves(layout: Layout, problem: LayoutProblem) -> list[tuple[str, str]]:
    """Connections there and back between mirror images."""
    images = {
        frozenset((problem.neurons[a], problem.neurons[b])) for mirror in problem.mirrors for a, b in mirror.pairs
    }
    return [
        (one, other) for one, other in pairs(layout.routes) if frozenset(one.split(" (")[0].split(" -> ")) in images
    ]


@pytest.mark.parametrize("text", HALVES.values(), ids=HALVES)
def test_arcs_are_clear_of_what_is_in_the_way_and_of_each_other(text: str) -> None:
    problem = problem_of(nv.compile_text(text).network)
    layout = lay_out_problem(problem, "layered")
    across = 1 if problem.direction in ("left", "right") else 0
    assert over_discs(layout) == []
    assert suite.through_frames(layout, problem) == []
    assert halves(layout, problem)
    for one, other in halves(layout, problem):
        there, back = layout.routes[one], layout.routes[other]
        assert together(there, back, 0.1) == 0.0, (one, other)
        level = there[0][1 - across]
        middles = [sampled(route, 0.05)[len(sampled(route, 0.05)) // 2][1 - across] - level for route in (there, back)]
        assert middles[0] * middles[1] < 0, (one, other)
        for route in (there, back):
            twice = route[0][across] + route[-1][across]
            assert [point[across] for point in route] == [twice - point[across] for point in route[::-1]]
            assert [point[1 - across] for point in route] == [point[1 - across] for point in route[::-1]]


@pytest.mark.parametrize("direction", ["left", "right"])
def test_what_no_bow_gets_round_takes_a_detour(direction: str) -> None:
    """Grids, rings and columns, where ranks hold discs at all heights."""
    sparse = "{pattern: {random: {probability: 0.3}}, weight: 1}"
    text = f"""neurovis: 1
name: arr{direction}
neurons: {{A: {{count: 4, bias: 1}}, B: {{count: 6}}, C: {{count: 9}}, D: {{count: 7}}, E: {{count: 5}}, O: {{}}}}
connections:
  A -> B: {{pattern: all_to_all, weight: 1}}
  B -> C: {sparse}
  C -> D: {sparse}
  D -> E: {sparse}
  E -> O: 1
layout: {{direction: {direction}, arrange: {{A: row, B: column, C: grid, D: ring, E: arc}}}}
"""
    assert over_discs(lay_out_problem(problem_of(nv.compile_text(text).network), "layered")) == []


@examples(10)
@given(problem=walkers(mirrored=True))
def test_arcs_between_images_are_never_on_each_other(problem: LayoutProblem) -> None:
    layout, _ = attempt(problem)
    if layout is None:
        return
    for one, other in halves(layout, problem):
        if len([name for name in layout.routes if {*name.split(" (")[0].split(" -> ")} == {*one.split(" -> ")}]) == 2:
            assert together(layout.routes[one], layout.routes[other], 0.08) <= 0.2, (one, other)
