"""Frames are walls: a route enters one only to reach one of its ends."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import layout_conformance as suite
import numpy as np
import pytest
from examples import shipped
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.routing import Surroundings, detours, route_all
from neurovis_layouts.routing.corners import rounded
from neurovis_layouts.routing.detours import Detours, detoured
from neurovis_layouts.routing.obstacles import Barriers, Obstacles, Walls, meet

import neurovis_spec as nv
from neurovis_spec.layout import Direction, Layout, LayoutEdge, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import Rect, distance, sampled, straight
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem, problem_of

ROOT = Path(__file__).parent.parent
SPECS = sorted(p for p in (ROOT / "specs").rglob("*.yaml") if "neurons:" in p.read_text() and "modules" not in p.parts)


@st.composite
def bodies(draw: st.DrawFn, pinned: bool = False, named: bool = False) -> LayoutProblem:
    """Legs with knees in them perhaps, boxes, neurons between them, connections anywhere, mirrors."""
    count, size, knees = draw(st.integers(1, 4)), draw(st.integers(1, 4)), draw(st.booleans())
    own = suite.members("S", size) + ([f"knee.{name}" for name in suite.members("K", 2)] if knees else [])
    legs = [f"{side}{i + 1}" for side in ("left", "right") for i in range(count)]
    middle = suite.members("C", draw(st.integers(0, 6)))
    names = [f"{leg}.{name}" for leg in legs for name in own] + middle
    inner = draw(st.lists(st.tuples(st.sampled_from(own), st.sampled_from(own)), max_size=8))
    pairs = [(f"{leg}.{a}", f"{leg}.{b}") for leg in legs for a, b in inner]
    pairs += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=30))
    modules = [(leg, "leg") for leg in legs] + ([(f"{leg}.knee", "knee") for leg in legs] if knees else [])
    mirrors = []
    if draw(st.booleans()):
        sides = [(f"left{i + 1}", f"right{i + 1}") for i in range(count)]
        mirrors = [("", [(f"{a}.{name}", f"{b}.{name}") for a, b in sides for name in own], sides)]
    pins: dict[str, Point] = {}
    if pinned:
        spots = draw(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), unique=True, min_size=1, max_size=3))
        chosen = draw(st.lists(st.sampled_from(names), unique=True, max_size=3))
        pins = {name: (1.5 * x, 1.25 * y) for name, (x, y) in zip(chosen, spots, strict=False)}
    boxes = [("frame", middle[: len(middle) // 2])] if len(middle) > 3 and draw(st.booleans()) else []
    groups = [("C", middle)] if middle else []
    edges = suite.named(pairs, draw(st.integers(0, 1)))
    directions: tuple[Direction, ...] = ("down", "up", "right", "left")
    direction = draw(st.sampled_from(directions))
    wide = set(draw(st.lists(st.sampled_from(own + middle), max_size=3))) if named else set[str]()
    labels = {name: (1.8, 0.3) for name in names if name in wide or name.partition(".")[2] in wide}
    return NamedProblem(
        "body", names, groups, edges, pins, direction, boxes=boxes, modules=modules, mirrors=mirrors, labels=labels
    ).canonical()


def attempt(problem: LayoutProblem) -> tuple[Layout | None, str]:
    try:
        return lay_out_problem(problem, "layered"), ""
    except LayoutRefusalError as refusal:
        return None, refusal.code


def check(layout: Layout, problem: LayoutProblem) -> None:
    assert suite.through_frames(layout, problem) == []
    assert metrics(layout, problem)["edges_over_neurons"] == 0


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_no_route_of_a_shipped_spec_runs_through_a_foreign_frame(path: Path) -> None:
    check(shipped(path).drawn("layered").value, problem_of(shipped(path).network))


@settings(max_examples=25, deadline=None)
@given(problem=bodies())
def test_no_route_runs_through_a_foreign_frame(problem: LayoutProblem) -> None:
    layout = suite.check(problem, "layered")
    assert layout is not None
    check(layout, problem)


@settings(max_examples=25, deadline=None)
@given(problem=bodies(named=True))
def test_no_route_runs_through_a_disc_beside_a_long_name(problem: LayoutProblem) -> None:
    check(lay_out_problem(problem, "layered"), problem)


@settings(max_examples=25, deadline=None)
@given(problem=bodies(pinned=True))
def test_with_pins_only_what_pins_put_into_each_other_is_run_through(problem: LayoutProblem) -> None:
    layout, _ = attempt(problem)
    if layout is not None and not suite.frames_meet(layout, problem):
        assert suite.through_frames(layout, problem) == []


@settings(max_examples=30, deadline=None)
@given(problem=bodies(pinned=True), data=st.data())
def test_pins_off_the_grid_and_their_mirror_images_are_exact(problem: LayoutProblem, data: st.DataObject) -> None:
    fractions = st.integers(-700, 700).map(lambda n: n / 1024)
    pins = {i: (x + data.draw(fractions), y + data.draw(fractions)) for i, (x, y) in problem.pins.items()}
    problem = replace(problem, pins=pins)
    layout, code = attempt(problem)
    if layout is None:
        assert code in {"mirror-pins", "pin-in-frame", "pins-too-close"}
        return
    suite.check_positions(problem, layout)
    axis = 0 if problem.direction in ("down", "up") else 1
    at = [layout.positions[name] for name in problem.neurons]
    pairs = [pair for mirror in problem.mirrors for pair in mirror.pairs]
    assert len({at[a][axis] + at[b][axis] for a, b in pairs}) <= 1
    assert all(at[a][1 - axis] == at[b][1 - axis] for a, b in pairs)


def test_frames_in_a_row_are_gone_round_above_or_below() -> None:
    names = [f"m{i}.N{j}" for i in range(1, 6) for j in (1, 2)]
    pairs = [(f"m{i}.N1", f"m{i}.N2") for i in range(1, 6)] + [("m1.N1", "m5.N1"), ("m5.N2", "m1.N2")]
    pins = {f"m{i}.N{j}": (3.0 * i, 1.5 * j) for i in range(1, 6) for j in (1, 2)}
    problem = NamedProblem(
        "row", names, edges=suite.named(pairs), pins=pins, modules=[(f"m{i}", "m") for i in range(1, 6)]
    ).canonical()
    layout = lay_out_problem(problem, "layered")
    check(layout, problem)
    over = [y for x, y in sampled(layout.routes["m1.N1 -> m5.N1"]) if 5 < x < 13]
    assert max(over) < 0.9 or min(over) > 3.5


def test_edges_between_the_same_neurons_take_detours_of_their_own() -> None:
    centres = [(0.0, 0.0), (10.0, 0.0), (5.0, 0.0)]
    edges = [LayoutEdge("a", 0, 1, 1), LayoutEdge("b", 0, 1, 1), LayoutEdge("c", 1, 0, 1)]
    wall = (frozenset({2}), (3.0, -1.0, 7.0, 1.5))
    lines = [sampled(route, 0.05) for route in route_all(edges, centres, around=Surroundings([wall]))]
    for i, one in enumerate(lines):
        assert all(not (3 < x < 7 and -1 < y < 1.5) for x, y in one)
        for other in lines[:i]:
            assert suite.farthest(one, other) > 0.1


def test_where_there_is_no_way_round_there_is_no_detour() -> None:
    shut = Walls([(frozenset({1}), (-2.0, y, 12.0, y + 4.0)) for y in (-5.0, -1.0, 3.0)], 3)
    assert Detours(shut, [(0.0, 0.0), (5.0, 0.0), (10.0, 0.0)], None).route(0, 2, True) is None


def test_a_loop_keeps_out_of_the_frame_beside_it() -> None:
    centres = [(0.0, 0.0), (1.5, 0.0), (1.5, 1.0)]
    wall = (frozenset({1, 2}), (0.5, -1.0, 2.2, 1.65))
    (route,) = route_all([LayoutEdge("a", 0, 0, 1)], centres, around=Surroundings([wall]))
    assert max(x for x, _ in sampled(route, 0.05)) < 0.5


rects = st.tuples(*(st.integers(-6, 6) for _ in range(4))).map(
    lambda r: (min(r[0], r[2]) - 0.5, min(r[1], r[3]) - 0.5, max(r[0], r[2]) + 0.5, max(r[1], r[3]) + 0.5)
)
spots = st.tuples(st.integers(-8, 8), st.integers(-8, 8)).map(lambda at: (float(at[0]), float(at[1])))


@given(a=spots, b=spots, rect=rects)
def test_segments_meet_rectangles_where_points_on_them_do(a: Point, b: Point, rect: Rect) -> None:
    line = [(a[0] + (b[0] - a[0]) * i / 400, a[1] + (b[1] - a[1]) * i / 400) for i in range(401)]
    one, other = np.array([a]), np.array([b])
    inside = any(rect[0] + 0.05 < x < rect[2] - 0.05 and rect[1] + 0.05 < y < rect[3] - 0.05 for x, y in line)
    near = any(rect[0] - 0.05 < x < rect[2] + 0.05 and rect[1] - 0.05 < y < rect[3] + 0.05 for x, y in line)
    found = bool(meet(one, other, np.array([rect]))[0, 0])
    assert found or not inside
    assert near or not found


def test_rounded_lines_run_from_end_to_end_and_stay_within_their_corners() -> None:
    line = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (9.0, 3.0)]
    route = rounded(line, np.zeros((0, 4)))
    assert (route[0], route[-1], len(route) % 3) == (line[0], line[-1], 1)
    sharp = rounded(line, np.array([(-1.0, -1.0, 10.0, 4.0)]))
    for corner in line[1:-1]:
        assert min(distance(corner, p) for p in sampled(route, 0.02)) > 0.2
        assert min(distance(corner, p) for p in sampled(sharp, 0.02)) < 0.05
    steps = [distance(a, b) for a, b in pairwise(sampled(route, 0.05))]
    assert max(steps) < 0.2


def test_what_is_planned_through_a_frame_that_is_foreign_now_goes_round_it() -> None:
    """And so sends no other connection round."""
    ways = "A1 -> B1: 1, A2 -> B2: 1, A3 -> B3: 1, B1 -> C1: 1, B2 -> C2: 1, B3 -> C3: 1, A1 -> X: 1, X -> C3: 1"
    text = f"""neurovis: 1
name: nested
neurons: {{A: {{count: 3, bias: 1}}, B: {{count: 3}}, C: {{count: 3}}, X: {{}}}}
connections: {{{ways}, C1 -> A1: 0.5}}
layout: {{engine: layered, boxes: {{outer: [A, B, C], inner: [B], mid: [X]}}}}
"""
    problem = problem_of(nv.compile_text(text).network)
    layout = lay_out_problem(problem, "layered")
    check(layout, problem)
    for one, other in (("A2", "B2"), ("B2", "C2")):
        ends = sorted((layout.positions[one][0], layout.positions[other][0]))
        assert all(ends[0] - 0.4 < x < ends[1] + 0.4 for x, _ in sampled(layout.routes[f"{one} -> {other}"]))


def test_a_detour_that_gives_way_to_another_stays_off_discs() -> None:
    inner = "m0 -> m1: 1, m1 -> m2: 1, m2 -> m0: 1, m2 -> m1: 1"
    ways = "C2 -> left1.m0: 1, C2 -> left1.m2: 1, D3 -> left1.m2: 1, left1.m0 -> C2: 1, left1.m2 -> C2: 1"
    text = f"""neurovis: 1
name: pairs
modules: {{leg: {{neurons: {{m0: {{}}, m1: {{}}, m2: {{}}}}, connections: {{{inner}}}}}}}
instances: {{left: {{module: leg, count: 2}}, right: {{module: leg, count: 2}}}}
neurons: {{C: {{count: 2}}, D: {{count: 3}}}}
connections: {{{ways}, left1.m2 -> D3: 1, left2.m1 -> D1: 1, right2.m2 -> D1: 1}}
layout: {{engine: layered, mirror: [[left, right], [C1, C2]], direction: left}}
"""
    problem = problem_of(nv.compile_text(text).network)
    check(lay_out_problem(problem, "layered"), problem)


def test_a_disc_is_gone_round_as_a_frame_of_its_size_is() -> None:
    ends = [(0.0, 0.0), (10.0, 0.5)]
    disc = Detours(Walls((), 3), [*ends, (5.0, 0.2)], None)
    frame = Detours(Walls([(frozenset({2}), (4.7, -0.1, 5.3, 0.5))], 3), [*ends, (90.0, 90.0)], None)
    for _ in range(3):  # each in a lane of its own
        found = disc.route(0, 1, False)
        assert found is not None
        assert len(found) > 4
        assert found == frame.route(0, 1, False)
        assert min(distance(point, (5.0, 0.2)) for point in sampled(found, 0.05)) > 0.35


def test_a_disc_beside_its_label_is_gone_round_with_it() -> None:
    ends, disc = [(0.0, 0.5), (10.0, 0.5)], (5.0, 0.0)
    label = frozenset({2}), (4.2, 0.4, 5.8, 0.7)
    found = Detours(Walls([label], 3), [*ends, disc], None).route(0, 1, True)
    assert found is not None
    line = sampled(found, 0.05)
    assert min(distance(point, disc) for point in line) > 0.3
    assert all(not (4.2 < x < 5.8 and 0.4 < y < 0.7) for x, y in line)


def test_a_detour_keeps_to_the_way_that_was_found() -> None:
    edges, centres = [LayoutEdge("a", 0, 1, 1)], [(0.0, 0.0), (0.0, 10.0), (3.0, 5.0)]
    walls = Walls([(frozenset({2}), (-2.0, 4.0, 8.0, 6.0))], 3)
    routes, ways = {0: straight(*centres[:2])}, {0: [(8.5, 3.5), (8.5, 6.5)]}
    with_way, without = (
        detoured(edges, centres, routes, Barriers(Obstacles(centres), walls), line, (), 300)[0] for line in (ways, {})
    )
    assert max(x for x, _ in sampled(with_way)) > 8
    assert min(x for x, _ in sampled(without)) < -2


def test_a_detour_goes_the_longer_way_round_where_that_crosses_less() -> None:
    edges, centres = [LayoutEdge("a", 0, 1, 1)], [(0.0, 0.0), (0.0, 10.0), (3.0, 5.0)]
    walls = Walls([(frozenset({2}), (-2.0, 4.0, 8.0, 6.0))], 3)
    routes = {0: straight(*centres[:2])}
    for count, longer in ((0, False), (1, False), (4, True)):
        drawn = [straight((-20.0, 4.3 + i * 0.45), (-2.05, 4.3 + i * 0.45)) for i in range(count)]
        found = detoured(edges, centres, routes, Barriers(Obstacles(centres), walls), {}, drawn, 300)[0]
        assert (max(x for x, _ in sampled(found)) > 8) is longer


def test_nobody_counts_what_detours_cross_once_many_corners_were_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    centres = [(0.0, 0.0), (0.0, 10.0), (3.0, 5.0)]
    walls = Walls([(frozenset({2}), (-2.0, 4.0, 8.0, 6.0))], 3)
    lines = [straight((-20.0, 4.3 + i * 0.45), (-2.05, 4.3 + i * 0.45)) for i in range(4)]
    for most, longer in ((1000, True), (-1, False)):
        monkeypatch.setattr(detours, "_MOST_SEEN_FROM", most)
        found = Detours(walls, centres, lines).route(0, 1, True)
        assert found is not None
        assert (max(x for x, _ in sampled(found)) > 8) is longer


def test_a_detour_goes_a_little_farther_where_it_turns_less(monkeypatch: pytest.MonkeyPatch) -> None:
    centres = [(0.0, 0.0), (0.0, 10.0), (3.0, 4.3), (-5.0, 5.5)]
    walls = Walls([(frozenset({2}), (-0.5, 4.0, 4.2, 4.6)), (frozenset({3}), (-8.0, 5.2, 1.5, 5.8))], 4)
    for turning, farther in ((1.0, True), (0.0, False)):
        monkeypatch.setattr(detours, "_TURNING", turning)
        found = Detours(walls, centres, None).route(0, 1, True)
        assert found is not None
        assert (max(x for x, _ in sampled(found)) > 4.2) is farther


def test_a_detour_does_not_turn_back_between_two_corners() -> None:
    centres = [(11.24, 7.2), (2.56, 18.1), (2.5, 14.0), (4.76, 10.9), (4.15, 16.9)]
    sides = (3.8, 12.0), (-9.0, 1.3)  # lines on either side, that stop short of the frame
    lines = [straight((one, 12 + i / 2), (other, 12 + i / 2)) for one, other in sides for i in range(3)]
    walls = Walls([(frozenset({2}), (1.35, 10.3, 3.54, 17.5))], len(centres))
    found = Detours(walls, centres, lines).route(0, 1, True)
    assert found is not None
    assert min(x for x, _ in found) == 2.56


def test_in_a_crowd_routes_go_round_frames_alone() -> None:
    edges = [LayoutEdge("over a disc", 0, 1, 1), LayoutEdge("into a frame", 3, 4, 1)]
    centres = [(0.0, 0.0), (0.0, 10.0), (0.0, 5.0), (9.0, 0.0), (9.0, 10.0), (9.0, 5.0)]
    walls = Walls([(frozenset({5}), (8.0, 4.0, 10.0, 6.0))], 6)
    routes = {0: straight(*centres[:2]), 1: straight(*centres[3:5])}
    for most, gone_round in ((1, [0, 1]), (0, [1])):
        found = detoured(edges, centres, routes, Barriers(Obstacles(centres), walls), {}, (), most)
        assert sorted(found) == gone_round


@pytest.mark.parametrize(("sources", "targets"), [(4, 8), (3, 5), (5, 5), (8, 4)])
def test_full_layers_beside_a_frame_run_as_if_there_were_none(sources: int, targets: int) -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nmodules: {m: {neurons: {a: {}}}}\ninstances: {x: {module: m}}\n"
        f"neurons: {{I: {{count: {sources}, bias: 1}}, H: {{count: {targets}}}}}\n"
        "connections: {I -> H: {pattern: all_to_all, weight: 1}, H -> x.a: 1}\n"
    )
    layout = network.layout("layered")
    for name, route in layout.routes.items():
        if not name.endswith("x.a"):
            high, low = route[0][1], route[-1][1]
            assert all(high - 0.5 <= y <= low + 0.5 for _, y in sampled(route, 0.1)), name
