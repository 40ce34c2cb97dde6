"""Connections there and back are two lines, apart where they can be seen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations, pairwise

import layout_conformance as suite
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.routing.improve import improved
from neurovis_layouts.routing.route_cost import Drawn
from test_layout_compound import attempt, walkers

import neurovis_spec as nv
from neurovis_spec.layout import Direction, LayoutEdge, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance, sampled, straight
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import Point, Route
from neurovis_spec.layout.problem import NamedProblem, problem_of

HEAD = "neurovis: 1\nname: pair\nneurons: {L: {count: 2, bias: 1}, R: {count: 2}, M: {}}\n"
DIRECTIONS: tuple[Direction, ...] = ("down", "up", "right", "left")


def between_discs(route: Route, step: float) -> list[tuple[float, float]]:
    return [point for point in sampled(route, step) if min(distance(point, route[0]), distance(point, route[-1])) > 0.4]


def together(one: Route, other: Route, near: float) -> float:
    """Share of the one, between the discs, that is closer to the other than this."""
    line, points = sampled(other, 0.03), between_discs(one, 0.03)
    return sum(min(distance(p, q) for q in line) < near for p in points) / max(1, len(points))


def pairs(routes: Iterable[str]) -> list[tuple[str, str]]:
    """Names of connections that share both ends, in either direction."""

    def ends(name: str) -> frozenset[str]:
        return frozenset(name.split(" (")[0].split(" -> "))

    return [(a, b) for a, b in combinations(sorted(routes), 2) if ends(a) == ends(b) and len(ends(a)) == 2]


@pytest.mark.parametrize(("direction", "across"), [("down", 0), ("right", 1)])
def test_two_chains_that_inhibit_each_other_stand_side_by_side(direction: str, across: int) -> None:
    compiled = nv.compile_text(
        "neurovis: 1\nname: swimmer\nneurons: {L: {count: 5, bias: 1}, R: {count: 5}}\nconnections:\n"
        "  L -> R: {weight: -1, pattern: one_to_one}\n  R -> L: {weight: -1, pattern: one_to_one}\n"
        + "".join(f"  {s}{a} -> {s}{b}: 1\n" for s in "LR" for i in range(1, 5) for a, b in ((i, i + 1), (i + 1, i)))
        + f"layout: {{direction: {direction}, mirror: [[L, R]]}}\n"
    )
    problem = problem_of(compiled.network)
    layout = lay_out_problem(problem, "layered")
    for i in range(1, 6):
        left, right = layout.positions[f"L{i}"], layout.positions[f"R{i}"]
        assert left[1 - across] == right[1 - across]
        assert left[across] == layout.positions["L1"][across]
        assert left[across] < right[across]
    assert metrics(layout, problem)["crossings"] == 0


def test_a_half_centre_has_an_arc_above_and_one_below() -> None:
    for extra in ("", ", L1 -> L2: 1, R1 -> R2: 1, L2 -> M: 1, R2 -> M: 1"):
        text = (
            HEAD + f"connections: {{L1 -> R1: 1, R1 -> L1: -1{extra}}}\nlayout: {{engine: layered, mirror: [[L, R]]}}"
        )
        layout = nv.compile_text(text).layout()
        there, back = layout.routes["L1 -> R1"], layout.routes["R1 -> L1"]
        level = layout.positions["L1"][1]
        assert all((y - level) * (h - level) < 0 for (_, y), (_, h) in zip(there[1:-1], back[1:-1], strict=True))
        assert together(there, back, 0.15) == 0.0
        for route in (there, back):
            assert [y for _, y in route] == [y for _, y in route[::-1]]


SWINGING = """\
neurovis: 1
name: swinging
modules:
  centre:
    neurons: {L: {bias: 1}, R: {}, E: {}}
    connections: {L -> R: -1, R -> L: -1, L -> E: 1, R -> E: 1}
    layout: {mirror: [[L, R]]}
instances: {a: {module: centre, count: COUNT}}
connections: {a1.E -> a2.E: 1MORE}
"""


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
@pytest.mark.parametrize("moved", ["L", "R"])
def test_there_and_back_between_mirror_images_stay_two_lines_when_one_is_moved(moved: str, direction: str) -> None:
    text = "neurovis: 1\nname: pair\nneurons: {L: {bias: 1}, R: {}}\nconnections: {L -> R: -1, R -> L: -1}\n"
    network = nv.compile_text(text + f"layout: {{direction: {direction}, mirror: [[L, R]]}}")
    earlier = network.layout().value
    across = 0 if direction in ("down", "up") else 1
    apart = -1.0 if earlier.positions[moved] == min(earlier.positions.values()) else 1.0
    for dx, dy in ((apart, apart), (2 * apart, 0.0), (0.0, 2 * apart)):
        x, y = earlier.positions[moved]
        edited = replace(earlier, positions={**earlier.positions, moved: (x + dx, y + dy)})
        layout = network.layout(earlier=edited).value
        assert layout.positions[moved] == (x + dx, y + dy)
        there, back = layout.routes["L -> R"], layout.routes["R -> L"]
        assert together(there, back, 0.08) <= 0.1
        axis = sum(layout.positions[name][across] for name in "LR")
        for route in (there, back):
            for one, other in zip(route, route[::-1], strict=True):
                assert one[across] == pytest.approx(axis - other[across])


@pytest.mark.parametrize("direction", ["down", "right"])
def test_there_and_back_between_all_of_two_sides_stay_two_lines_when_one_is_moved(direction: str) -> None:
    text = (
        "neurovis: 1\nname: sides\nneurons: {L: {count: 2, bias: 1}, R: {count: 2}}\nconnections:\n"
        "  L -> R: {weight: -1, pattern: all_to_all}\n  R -> L: {weight: -1, pattern: all_to_all}\n"
    )
    network = nv.compile_text(text + f"layout: {{direction: {direction}, mirror: [[L, R]]}}")
    earlier = network.layout().value
    by = (-1.0, 2.0) if direction == "down" else (2.0, -1.0)
    x, y = earlier.positions["L1"]
    edited = replace(earlier, positions={**earlier.positions, "L1": (x + by[0], y + by[1])})
    layout = network.layout(earlier=edited).value
    assert layout.positions["L1"] != earlier.positions["L1"]
    for one, other in pairs(layout.routes):
        assert together(layout.routes[one], layout.routes[other], 0.08) <= 0.1, (one, other)


def test_there_and_back_between_mirror_images_are_two_lines_in_new_instances() -> None:
    before = nv.compile_text(SWINGING.replace("COUNT", "2").replace("MORE", ""))
    after = nv.compile_text(SWINGING.replace("COUNT", "3").replace("MORE", ", a2.E -> a3.E: 1"))
    layout = after.layout(earlier=before.layout().value)
    for one, other in pairs(layout.routes):
        assert together(layout.routes[one], layout.routes[other], 0.08) <= 0.1, (one, other)


def test_pairs_crosswise_over_the_axis_do_not_lie_on_each_other() -> None:
    pair = "L1 -> R2: 1, R2 -> L1: -1, L2 -> R1: 1, R1 -> L2: -1"
    for extra in ("", ", L1 -> L2: 1, R1 -> R2: 1, L2 -> M: 1, R2 -> M: 1"):
        layout = nv.compile_text(HEAD + f"connections: {{{pair}{extra}}}\nlayout: {{mirror: [[L, R]]}}").layout()
        assert pairs(layout.routes)
        for one, other in pairs(layout.routes):
            assert together(layout.routes[one], layout.routes[other], 0.08) <= 0.4, (one, other)


def test_connections_there_and_back_are_apart_where_they_could_run_on_each_other() -> None:
    """Parallel to a curve that a disc has pushed aside, and on detours round frames."""
    rings = "A -> A: {weight: 1, pattern: ring}, A -> B: {weight: 1, pattern: one_to_one}"
    back = "B -> A: {weight: 1, delay: 3, pattern: one_to_one}"
    text = f"""neurovis: 1
name: pushed
neurons: {{A: {{count: 6}}, B: {{count: 6}}, S: {{}}}}
connections: [{{{rings}}}, {{{back}}}, B -> S: 1, A1 -> B1: {{weight: 1, delay: 2}}]
"""
    leg = "{neurons: {m0: {}, m1: {}}, connections: {m0 -> m1: 1, m1 -> m0: 1}}"
    ways = "C1 -> D1: 1, C1 -> r1.m0: 1, C1 -> r1.m1: 1, D1 -> C1: 1, D2 -> D3: 1, D3 -> r1.m0: 1, l1.m0 -> C1: 1"
    more = "l1.m1 -> D3: 1, r1.m0 -> C1: 1, r1.m0 -> l1.m0: 1, r1.m1 -> C1: 1"
    framed = f"""neurovis: 1
name: framed
modules: {{leg: {leg}}}
instances: {{l: {{module: leg, count: 1}}, r: {{module: leg, count: 1}}}}
neurons: {{C: {{count: 2}}, D: {{count: 3}}}}
connections: {{{ways}, {more}}}
layout: {{mirror: [[l, r], [C1, C2]], boxes: {{q: [D]}}}}
"""
    for spec in (text, framed):
        routes = nv.compile_text(spec).layout(engine="layered").routes
        assert len(pairs(routes)) > 4
        for one, other in pairs(routes):
            assert together(routes[one], routes[other], 0.11) <= 0.2, (one, other)


def test_long_ways_there_and_back_do_not_share_a_stretch() -> None:
    """A small part of a long way is a line to look at."""
    corners: list[Point] = [(40.0, 0.0), (36.0, 3.0), (10.0, 3.0), (5.0, 0.0), (0.0, 0.0)]
    back = (corners[0], *(p for a, b in pairwise(corners) for p in straight(a, b)[1:]))
    there = straight((0.0, 0.0), (40.0, 0.0))
    assert 0.1 < together(back, there, 0.08) < 0.2
    edges = [LayoutEdge("A -> B", 0, 1, 0), LayoutEdge("B -> A", 1, 0, 0)]
    routes = {0: there, 1: back}
    routes.update(improved(Drawn(edges, [there[0], there[-1]], routes), {0, 1}))
    assert together(routes[1], routes[0], 0.08) == 0.0


def test_bows_over_a_row_are_nested() -> None:
    """What leads over a neuron in a row is not on what leads to the next one."""
    pins = {name: (float(x), 0.0) for x, name in enumerate("ABCD")}
    wired = [("A", "B"), ("B", "C"), ("A", "C"), ("A", "D"), ("D", "A"), ("C", "C"), ("C", "A")]
    problem = NamedProblem("row", list("ABCD"), edges=suite.named(wired), pins=pins).canonical()
    routes = lay_out_problem(problem, "manual").routes
    for one, other in (("A -> D", "A -> C"), ("D -> A", "C -> A")):
        assert together(routes[other], routes[one], 0.08) == 0.0
    assert metrics(lay_out_problem(problem, "manual"), problem)["edges_over_neurons"] == 0


def test_a_bow_is_not_raised_on_to_another_between_the_same_ends() -> None:
    wired = [("A", "A")] * 2 + [("A", "B")] * 2 + [("A", "C"), ("A", "D")] + [("B", "A")] * 5 + [("C", "B")] * 2
    wired += [("C", "C")] * 2 + [("D", "A")] * 3
    pins = {"A": (0.0, -0.9), "C": (0.0, 2.7)}
    problem = NamedProblem(
        "raised", list("ABCD"), edges=suite.named(wired), pins=pins, boxes=[("frame", list("ABCD"))]
    ).canonical()
    suite.check(problem, "large")


@st.composite
def sheaves(draw: st.DrawFn) -> LayoutProblem:
    """Up to six connections between two neurons, there and back, among others."""
    names = suite.members("N", draw(st.integers(2, 9)))
    one, other = draw(st.permutations(names))[:2]
    there, back = draw(st.integers(0, 6)), draw(st.integers(0, 6))
    pairs = [(one, other)] * there + [(other, one)] * min(back, 6 - there)
    pairs += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=10))
    lattice = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
    spots = draw(st.lists(lattice, unique=True, max_size=3))
    pins = {name: (0.7 * x, 0.9 * y) for name, (x, y) in zip(names, spots, strict=False)}
    return NamedProblem(
        "sheaf", names, edges=suite.named(pairs), pins=pins, direction=draw(st.sampled_from(DIRECTIONS))
    ).canonical()


@pytest.mark.parametrize("engine", ["layered", "circular"])
def test_a_sheaf_of_six_is_six_lines(engine: str) -> None:
    for pairs in ([("A", "B")] * 6, [("A", "B")] * 5 + [("B", "A")], [("A", "B"), ("B", "A")] * 3):
        problem = NamedProblem(
            "sheaf", ["A", "B", "C"], edges=suite.named([*pairs, ("A", "C"), ("B", "C")])
        ).canonical()
        routes = lay_out_problem(problem, engine).routes
        between = [name for name in routes if "C" not in name]
        for one, other in combinations(between, 2):
            assert together(routes[one], routes[other], 0.08) <= 0.2, (one, other)


@settings(max_examples=25, deadline=None)
@given(problem=st.one_of(suite.problems(), walkers(pinned=True), walkers(mirrored=True), sheaves()))
def test_connections_that_share_both_ends_are_apart(problem: LayoutProblem) -> None:
    """Up to six; a sheaf of more has no room everywhere, nor has one between discs that pins put close together."""
    layout, _ = attempt(problem)
    if layout is None:
        return
    between: dict[frozenset[int], list[str]] = {}
    for edge in problem.edges:
        between.setdefault(frozenset((edge.source, edge.target)), []).append(edge.name)
    for ends, names in between.items():
        if len(ends) == 2 and len(names) <= 6 and distance(*(layout.positions[problem.neurons[n]] for n in ends)) >= 1:
            for one, other in combinations(names, 2):
                assert together(layout.routes[one], layout.routes[other], 0.08) <= 0.4, (one, other)
