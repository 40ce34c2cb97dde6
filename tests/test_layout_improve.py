"""Routes that wind are drawn anew, gently; what is measured of many lines at once is what plain Python says of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import layout_conformance as suite
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.routing import RoutePlan, Surroundings, route_all, route_cost
from neurovis_layouts.routing.corners import corners, smooth, smoothed
from neurovis_layouts.routing.images import Images
from neurovis_layouts.routing.improve import improved
from neurovis_layouts.routing.obstacles import TOUCH, Frame, Obstacles, Walls
from neurovis_layouts.routing.polylines import Polylines, close_segments, polylines
from neurovis_layouts.routing.route_cost import Drawn, RouteCost

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import distance, sampled, straight
from neurovis_spec.layout.model import LayoutEdge, Point, Route
from neurovis_spec.layout.problem import problem_of

number = st.integers(-40, 40).map(lambda at: at / 4)
point = st.tuples(number, number)


@st.composite
def routes(draw: st.DrawFn) -> Route:
    """A route of straight pieces and curves."""
    line = draw(st.lists(point, min_size=2, max_size=5, unique=True))
    found: list[Point] = [line[0]]
    for a, b in pairwise(line):
        curved = draw(st.booleans())
        found += [draw(point), draw(point), b] if curved else straight(a, b)[1:]
    return tuple(found)


def segment_distance(place: Point, a: Point, b: Point) -> float:
    """From a point to the segment from ``a`` to ``b``."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    t = ((place[0] - a[0]) * ux + (place[1] - a[1]) * uy) / max(ux * ux + uy * uy, 1e-300)
    t = max(0.0, min(1.0, t))
    return distance(place, (a[0] + t * ux, a[1] + t * uy))


def kink(*line: Point) -> Route:
    """A route with sharp corners."""
    return line[0], *(p for a, b in pairwise(line) for p in straight(a, b)[1:])


def edge(source: int, target: int) -> LayoutEdge:
    return LayoutEdge(f"{source} -> {target}", source, target, 1)


def points_of(route: Route) -> list[Point]:
    lines = polylines([route])
    return [(x, y) for x, y in lines.points.tolist()]


@given(st.lists(routes(), min_size=1, max_size=6))
@settings(max_examples=40, deadline=None)
def test_lines_are_measured_at_once_as_one_by_one(drawn: list[Route]) -> None:
    lines = polylines(drawn)
    bends, tight = lines.bends()
    low, high = lines.extents()
    for k, route in enumerate(drawn):
        line = points_of(route)
        steps = [distance(a, b) for a, b in pairwise(line)]
        assert line[0] == route[0]
        assert line[-1] == pytest.approx(route[-1])
        assert lines.lengths()[k] == pytest.approx(math.fsum(steps))
        ways = [
            ((b[0] - a[0]) / far, (b[1] - a[1]) / far, far)
            for (a, b), far in zip(pairwise(line), steps, strict=True)
            if far > 1e-9
        ]
        chords = [math.hypot(v[0] - u[0], v[1] - u[1]) for u, v in pairwise(ways)]
        assert bends[k] == pytest.approx(math.fsum(chords), abs=1e-9)
        near = [max(min(u[2], v[2]), 0.05) for u, v in pairwise(ways)]
        assert tight[k] == pytest.approx(
            math.fsum(chord * min(chord / by, 4.0) for chord, by in zip(chords, near, strict=True)), abs=1e-9
        )
        assert tuple(low[k]) == (min(x for x, _ in line), min(y for _, y in line))
        assert tuple(high[k]) == (max(x for x, _ in line), max(y for _, y in line))
        back = (math.fsum(abs(b[1] - a[1]) for a, b in pairwise(line)) - abs(line[-1][1] - line[0][1])) / 2
        assert lines.backward()[k] == pytest.approx(back, abs=1e-9)
        # a line of few points follows its route
        ends = list(pairwise(line))
        assert all(min(segment_distance(p, a, b) for a, b in ends) < 0.6 for p in sampled(route))


@given(st.lists(routes(), min_size=1, max_size=5), st.lists(routes(), min_size=1, max_size=5))
@settings(max_examples=40, deadline=None)
def test_crossings_are_counted_as_metrics_count_them(drawn: list[Route], others: list[Route]) -> None:
    lines, rest = polylines(drawn), polylines(others)
    found = lines.crossed(rest.a, rest.b)
    for k in range(len(drawn)):
        points = lines.points[lines.starts[k] : lines.starts[k + 1]].tolist()
        ends = [points[0], points[-1]]
        count = 0
        for a, b in pairwise(points):
            for c, d in zip(rest.a.tolist(), rest.b.tolist(), strict=True):
                where = meeting(a, b, c, d)
                count += where is not None and all(math.dist(where, end) >= 0.4 for end in ends)
        assert found[k] == count


def meeting(a: list[float], b: list[float], c: list[float], d: list[float]) -> Point | None:
    """Where two segments cross, their last points left out."""
    ux, uy, vx, vy, wx, wy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1], c[0] - a[0], c[1] - a[1]
    cross = ux * vy - uy * vx
    if cross == 0:
        return None
    sign = math.copysign(1.0, cross)
    t, s, whole = (wx * vy - wy * vx) * sign, (wx * uy - wy * ux) * sign, abs(cross)
    return (a[0] + t / whole * ux, a[1] + t / whole * uy) if 0 <= t < whole and 0 <= s < whole else None


def test_a_loop_is_as_long_as_it_is_drawn_and_can_be_crossed() -> None:
    loop: Route = ((0.0, 0.0), (-1.05, -0.62), (-1.05, 0.62), (0.0, 0.0))
    lines = polylines([loop, straight((0.0, 0.0), (0.0, 0.0))])
    steps = [distance(a, b) for a, b in pairwise(sampled(loop, 0.05))]
    assert lines.lengths() == pytest.approx([math.fsum(steps), 0.0], rel=0.05)
    other = polylines([straight((-0.6, -2.0), (-0.6, 2.0))])
    assert other.crossed(lines.a, lines.b).tolist() == [2]


def test_where_nothing_is_drawn_nothing_is_improved() -> None:
    for frames in ([], [(frozenset({0}), (-1.0, -1.0, 1.0, 1.0))]):
        assert improved(Drawn([], [(0.0, 0.0)], {}, frames), set()) == {}


def test_a_route_along_a_border_is_led_off_it() -> None:
    """Of the frame that it leads out of, too."""
    frames: list[Frame] = [(frozenset({0, 2}), (-1.0, -1.0, 4.0, 0.8)), (frozenset({1}), (5.0, -1.0, 7.0, 0.8))]
    centres: list[Point] = [(0.0, 0.0), (6.0, 0.0), (3.0, 0.0)]
    along: Route = ((0.0, 0.0), (0.4, 0.6), (0.6, 0.8), (1.0, 0.8), *straight((1.0, 0.8), (5.0, 0.8))[1:])
    along = (*along, (5.4, 0.8), (5.6, 0.6), centres[1])
    before = Drawn([edge(0, 1)], centres, {0: along}, frames)
    assert before.unclear({0})[0].winds
    found = improved(before, {0})[0]
    assert Drawn([edge(0, 1)], centres, {0: found}, frames).unclear({0}) == {}
    assert Drawn([edge(0, 1)], centres, {0: found}, []).unclear({0}) == {}


ALONG = """
neurovis: 1
name: along
modules:
  osc: {neurons: {A: {bias: 1}, B: {}, C: {}, D: {}}, connections: {INNER}}
instances: {o: {module: osc, count: 3}}
connections: {COUPLINGS}
layout: {engine: layered, direction: DIRECTION}
"""
LINE = "A -> A: 1, B -> B: 1, C -> C: 1, C -> A: 1, C -> B: 1", "o1.B -> o2.B: 1, o2.C -> o3.A: 1", "down"
MANY = "A -> A: 1, A -> C: 1, A -> D: 1, B -> B: 1, B -> D: 1, C -> B: 1, C -> C: 1, D -> B: 1, D -> C: 1, D -> D: 1"


@pytest.mark.parametrize(
    ("inner", "couplings", "direction"), [LINE, (MANY, "o1.C -> o2.D: 1, o2.A -> o3.A: 1", "right")]
)
def test_no_coupling_runs_along_the_border_of_a_frame(inner: str, couplings: str, direction: str) -> None:
    text = ALONG.replace("INNER", inner).replace("COUPLINGS", couplings).replace("DIRECTION", direction)
    network = nv.compile_text(text)
    layout, problem = network.layout().value, problem_of(network.network)
    routes = {i: layout.routes[e.name] for i, e in enumerate(problem.edges)}
    rects = Frames(problem).rects({i: layout.positions[name] for i, name in enumerate(problem.neurons)}, routes)
    for route in routes.values():
        for x0, y0, x1, y1 in (rect for rect in rects if rect is not None):
            beside = [
                (min(abs(x - x0), abs(x - x1)) < 0.1 and y0 < y < y1)
                or (min(abs(y - y0), abs(y - y1)) < 0.1 and x0 < x < x1)
                for x, y in sampled(route, 0.02)
            ]
            assert sum(beside) / len(beside) * polylines([route]).lengths()[0] < 0.6


def test_a_route_through_a_loop_is_led_around_it() -> None:
    """Though it does not wind."""
    through, loop = straight((-3.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (-1.05, -0.62), (-1.05, 0.62), (0.0, 0.0))
    before, drawn = Drawn([edge(0, 1)], [(-3.0, 0.0), (0.0, 0.0)], {0: through}, drawn=[loop]), polylines([loop])
    assert before.unclear({0})[0].winds
    route = improved(before, {0})[0]
    assert polylines([route]).crossed(drawn.a, drawn.b).tolist() == [0]


@given(st.lists(routes(), min_size=1, max_size=5), st.lists(point, max_size=6), st.tuples(point, point))
@settings(max_examples=40, deadline=None)
def test_what_is_in_the_way_of_lines_is_found(
    drawn: list[Route], centres: list[Point], corner: tuple[Point, Point]
) -> None:
    lines = polylines(drawn)
    clear = lines.clearances(np.array(centres, dtype=np.float64).reshape(-1, 2), 0.45)
    (x0, y0), (x1, y1) = corner[0], (corner[0][0] + abs(corner[1][0]), corner[0][1] + abs(corner[1][1]))
    entering = lines.enter(np.array([(x0, y0, x1, y1)]))
    for k in range(len(drawn)):
        line = list(pairwise(lines.points[lines.starts[k] : lines.starts[k + 1]].tolist()))
        far = [segment_distance(centre, (a[0], a[1]), (b[0], b[1])) for centre in centres for a, b in line]
        assert clear[k] == pytest.approx(min([0.45, *far]))
        dense = [(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])) for a, b in line for s in np.linspace(0, 1, 60)]
        if any(x0 < x < x1 and y0 < y < y1 for x, y in dense):
            assert entering[k]
        elif all(max(x0 - x, x - x1, y0 - y, y - y1) > 0.5 for x, y in dense):
            assert not entering[k]


@given(st.lists(routes(), min_size=2, max_size=5), st.data())
@settings(max_examples=40, deadline=None)
def test_some_lines_are_those(drawn: list[Route], data: st.DataObject) -> None:
    chosen = data.draw(st.lists(st.integers(0, len(drawn) - 1), max_size=4))
    some, alone = polylines(drawn).some(np.array(chosen, dtype=np.int64)), polylines([drawn[k] for k in chosen])
    assert some.points.tolist() == alone.points.tolist()
    assert some.starts.tolist() == alone.starts.tolist()


def test_lines_are_seen_where_they_leave_a_ring_and_where_they_enter_one() -> None:
    lines = polylines([straight((0, 0), (4, 0)), kink((0, 0), (0, 2), (4, 2)), straight((1, 1), (1.1, 1))])
    assert lines.leave(0.5).tolist() == [[0.5, 0], [0, 0.5], [1.1, 1]]
    assert lines.arrive(0.5).tolist() == [[3.5, 0], [3.5, 2], [1, 1]]


def test_cells_are_those_that_a_line_runs_through_but_near_its_ends() -> None:
    cells, owner = polylines([straight((0, 0), (0.5, 0)), straight((0, 0.01), (3, 0.01))]).cells()
    assert set(owner.tolist()) == {1}
    again, _ = polylines([straight((0.05, 0.02), (3.05, 0.02))]).cells()
    other, _ = polylines([straight((0, 0.5), (3, 0.5))]).cells()
    assert len(set(cells.tolist()) & set(again.tolist())) > 10
    assert not set(cells.tolist()) & set(other.tolist())


def test_lines_share_cells_with_those_of_their_number() -> None:
    lines = polylines([straight((0, 0), (3, 0)), straight((0, 1), (3, 1)), straight((0, 2), (3, 2))])
    others = polylines([straight((1, 0), (6, 0)), straight((0, 2), (3, 2)), straight((0, 2), (3, 2))])
    few, none, every = lines.shared(others).tolist()
    assert (none, every) == (0, sum(lines.cells()[1] == 2))
    assert 0 < few < every


@given(st.lists(point, min_size=2, max_size=8, unique=True), st.sampled_from([0.2, 1.0, 4.0]))
@settings(max_examples=40, deadline=None)
def test_a_smooth_line_stays_beside_its_corners(line: list[Point], cut: float) -> None:
    route = smooth(line, cut)
    assert route[0] == line[0]
    assert route[-1] == line[-1]
    assert len(route) % 3 == 1
    assert len(route) >= 4
    assert all(x * 1024 == round(x * 1024) and y * 1024 == round(y * 1024) for x, y in route[1:-1])
    # within what a round corner can be off a sharp one
    assert all(min(segment_distance(p, a, b) for a, b in pairwise(line)) <= cut + 0.01 for p in sampled(route))


@given(routes())
@settings(max_examples=40, deadline=None)
def test_corners_are_few_and_on_the_route(route: Route) -> None:
    line = corners(route)
    assert line[0] == route[0]
    assert line[-1] == route[-1]
    assert len(line) <= 11
    samples = sampled(route, 0.02)
    assert all(min(distance(p, q) for q in samples) < 0.3 for p in line)


def segments(route: Route) -> tuple[FloatArray, FloatArray]:
    line = polylines([route])
    return line.a, line.b


HOOKED = kink((0, 0), (0, 3), (2, 3), (2, 1), (4, 1), (4, 6))


def fenced(frames: list[Frame], *more: tuple[Point, Point], first: Route = HOOKED) -> Drawn:
    """A winding route among others, all straight."""
    centres = [first[0], first[-1], *(p for ends in more for p in ends)]
    edges = [edge(k, k + 1) for k in range(0, len(centres), 2)]
    return Drawn(edges, centres, {0: first, **{k + 1: straight(*ends) for k, ends in enumerate(more)}}, frames)


def test_a_hook_becomes_a_straight_line() -> None:
    found = improved(fenced([]), {0})
    assert found.keys() == {0}
    assert corners(found[0]) == ((0, 0), (4, 6))


def test_what_is_not_free_stays_and_what_does_not_wind() -> None:
    assert improved(fenced([]), set()) == {}
    assert improved(fenced([], ((9, 0), (9, 6))), {1}) == {}


def test_an_eased_route_keeps_off_frames_and_discs() -> None:
    walled = fenced([(frozenset({2, 3}), (1.0, 2.0, 3.0, 4.0))], ((1.5, 3.0), (2.5, 3.0)))
    route = improved(walled, {0})[0]
    assert not walled.walls.entered([route], [(0, 1)])[0]
    assert walled.obstacles.clearance(route, (0, 1)) >= 0.4
    assert polylines([route]).lengths()[0] < 9


def test_a_route_that_only_grazes_a_frame_is_not_led_through_it() -> None:
    # along the frame, closer than it should be, and back and forth; through it would be shorter and cross nothing
    grazing = kink((0, 0), (0.98, 0), (0.98, 5), (5, 5), (5, 6.5), (2, 6.5), (2, 8))
    fence = [((-0.5 - 0.5 * k, 2.5), (0.99, 2.5 + 0.2 * k)) for k in range(4)]
    frames: list[Frame] = [(frozenset({2}), (1.0, 1.0, 4.0, 4.0)), (frozenset({4}), (-9.0, 1.0, -7.0, 4.0))]
    walled = fenced(frames, *fence, first=grazing)
    route = improved(walled, {0}).get(0, grazing)
    lines = polylines([grazing, route])
    assert lines.enter(np.array([(1.0, 1.0, 4.0, 4.0)])).tolist() == [False, False]


def test_two_lines_from_one_neuron_do_not_cross_for_a_shorter_way() -> None:
    centres: list[Point] = [(0, 0), (4, 8), (0.5, 8)]
    known = {0: kink((0, 0), (-3, 2), (-3, 4), (4, 4), (4, 8)), 1: straight((0, 0), (0.5, 8))}
    route = improved(Drawn([edge(0, 1), edge(0, 2)], centres, known), {0})[0]
    assert polylines([known[0], route]).crossed(*segments(known[1])).tolist() == [1, 0]


def test_an_eased_route_crosses_less_even_if_it_is_longer() -> None:
    # a fence of lines, open at one end
    fence = [((1.5 + 0.5 * k, -1.0), (1.5 + 0.5 * k, 9.0)) for k in range(6)]
    through = fenced([], *fence, first=kink((0, 0), (0, 3), (-1, 3), (-1, 5), (6, 5), (6, 0)))
    route = improved(through, {0})[0]
    lines = polylines([straight(*ends) for ends in fence])
    assert polylines([route]).crossed(lines.a, lines.b).sum() == 0


def test_a_line_that_runs_along_does_not_run_back_for_a_crossing() -> None:
    fence = [((1.6 + 0.3 * k, -0.8), (1.6 + 0.3 * k, 9.0)) for k in range(4)]
    winding = kink((0, 0), (3, 0.5), (0, 1), (3, 1.5), (4, 2))
    wandering = kink((0, 0), (3, 1.5), (0, 1), (3, 0.5), (4, 2))
    for first in (winding, wandering):
        route = improved(fenced([], *fence, first=first), {0})[0]
        assert polylines([route]).backward()[0] < 0.05


def test_the_image_of_an_eased_route_is_its_reflection() -> None:
    left: Route = tuple((x - 10, y) for x, y in HOOKED)
    right: Route = tuple((10 - x, y) for x, y in HOOKED)
    centres = [left[0], left[-1], right[0], right[-1]]
    both = Drawn([edge(0, 1), edge(2, 3)], centres, {0: left, 1: right}, images=Images({0: 1}))
    found = improved(both, {0})
    assert found.keys() == {0, 1}
    assert found[1] == tuple((0.0 - x, y) for x, y in found[0])


def test_a_route_that_meets_its_own_image_pays_for_it() -> None:
    over: Route = straight((-3, 0), (3, 4))
    apart: Route = straight((-3, 0), (-1, 4))
    for route, crossings in ((over, 1), (apart, 0)):
        image: Route = tuple((0.0 - x, y) for x, y in route)
        centres = [route[0], route[-1], image[0], image[-1]]
        known = {0: route, 1: image}
        alone = Drawn([edge(0, 1), edge(2, 3)], centres, {0: route, 1: straight((9, 9), (9, 12))})
        paired = Drawn([edge(0, 1), edge(2, 3)], centres, known, images=Images({0: 1}))
        assert RouteCost(paired, 0).cost() - RouteCost(alone, 0).cost() == pytest.approx(1.2 * crossings, abs=1e-6)


def test_a_route_that_lies_on_its_own_image_pays_for_it() -> None:
    """As a way under a row of frames does, level where it crosses the axis; one aslant crosses there."""
    level: list[Point] = [(-6.0, 2.0), (-5.0, 0.0), (5.0, 0.0), (6.0, 3.0)]
    aslant: list[Point] = [(-6.0, 2.0), (-5.0, 0.0), (5.0, 1.0), (6.0, 3.0)]
    paid: list[float] = []
    for line in (level, aslant):
        route = (line[0], *(p for a, b in pairwise(line) for p in straight(a, b)[1:]))
        image: Route = tuple((0.0 - x, y) for x, y in route)
        centres = [route[0], route[-1], image[0], image[-1]]
        alone = Drawn([edge(0, 1), edge(2, 3)], centres, {0: route, 1: straight((9, 9), (9, 12))})
        paired = Drawn([edge(0, 1), edge(2, 3)], centres, {0: route, 1: image}, images=Images({0: 1}))
        paid.append(RouteCost(paired, 0).cost() - RouteCost(alone, 0).cost())
    assert paid[0] > 10
    assert paid[1] < 5


def test_mirrored_routes_keep_off_what_has_no_image() -> None:
    """A frame, or a disc, on the way of the second alone: the first keeps off where that would be reflected."""
    centres = [(0.0, 0.0), (-6.0, 9.0), (6.0, 9.0), (3.0, 4.5)]
    edges, images = [edge(0, 1), edge(0, 2)], Images({0: 1})
    walls: list[Frame] = [(frozenset({3}), (2.0, 2.0, 6.0, 5.0))]
    for frames in (walls, []):
        found = route_all(edges, centres, RoutePlan(images=images), Surroundings(frames))
        assert found[1] == tuple((0.0 - x, y) for x, y in found[0])
        assert not Walls(frames, 4).entered([found[1]], [(0, 2)])[0]
        assert Obstacles(centres).clearance(found[1], (0, 2)) >= TOUCH
        bent = {0: kink((0, 0), (-7, 1), (-6, 9)), 1: kink((0, 0), (7, 1), (6, 9))}
        better = improved(Drawn(edges, centres, bent, frames, images=images), {0}).get(1, bent[1])
        assert not Walls(frames, 4).entered([better], [(0, 2)])[0]
        assert Obstacles(centres).clearance(better, (0, 2)) >= TOUCH


def test_a_route_that_may_not_be_gives_way_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    there, back = straight((0.0, 0.0), (6.0, 0.0)), straight((6.0, 0.0), (0.0, 0.0))
    refused: list[Route] = []

    def trespasses(_: RouteCost, route: Route) -> bool:
        refused.append(route)
        return len(refused) <= 3

    monkeypatch.setattr(RouteCost, "trespasses", trespasses)
    found = improved(Drawn([edge(0, 1), edge(1, 0)], [there[0], back[0]], {0: there, 1: back}), {1})
    assert found[1] not in refused[:3]


#: the way of `r2.y -> l1.x` is only just clear of the frame of `l2`
ASIDE = """
neurovis: 1
name: aside
modules:
  leaf: {neurons: {s: {}, t: {}, u: {}}, connections: {s -> t: 1, u -> s: {weight: -1, delay: 3}}}
  mid:
    neurons: {x: {}, y: {}}
    instances: {p: {module: leaf}, q: {module: leaf}}
    connections: {x -> q.s: 1, p.s -> q.u: 1, q.u -> p.s: 1, q.u -> y: 1}
    layout: {mirror: [[p, q]]}
instances: {l: {module: mid, count: 2}, r: {module: mid, count: 2}}
neurons: {A: {bias: 0.1}, B: {count: 2}, O: {}}
layout: {mirror: [[l, r]]}
connections:
  A -> B2: 1
  B1 -> l2.y: 1
  r1.x -> A: {weight: -1, delay: 3}
  l2.p.s -> B2: 1
  l2.y -> O: 1
  r2.y -> B1: 1
  r2.y -> l1.x: 1
"""


def test_no_route_is_eased_into_a_frame() -> None:
    network = nv.compile_text(ASIDE)
    assert suite.through_frames(network.layout("layered").value, problem_of(network.network)) == []


SPEC = """
neurovis: 1
name: around
modules: {{leg: {{neurons: {{s: {{}}, t: {{}}, u: {{}}}}, connections: {{s -> t: 1, t -> u: 1}}}}}}
instances: {{l: {{module: leg, count: 3}}, r: {{module: leg, count: 3}}}}
neurons: {{A: {{bias: 1}}, B: {{}}, O: {{}}}}
connections:
  A -> l1.s + l3.t + r1.s + r3.t + B: 1
  B -> l2.u + r2.u: 1
  l1.u -> l3.s: 1
  r1.u -> r3.s: 1
  l2.t -> r1.s + O: 1
  r2.t -> l1.s + O: 1
  l3.u -> l1.t: 1
  r3.u -> r1.t: 1
layout: {{direction: {direction}{mirror}}}
"""


@pytest.mark.parametrize("mirror", ["", ", mirror: [[l, r]]"])
@pytest.mark.parametrize("direction", ["down", "right"])
def test_a_layout_has_no_route_left_that_easing_would_change_much(direction: str, mirror: str) -> None:
    laid = nv.compile_text(SPEC.format(direction=direction, mirror=mirror)).layout("layered")
    measures = laid.metrics()
    assert measures["edges_over_neurons"] == 0
    assert measures["symmetry"] == 1
    lines = polylines([route for route in laid.routes.values() if route[0] != route[-1]])
    ends = lines.points[lines.starts[1:] - 1] - lines.points[lines.starts[:-1]]
    straightest = np.sqrt((ends**2).sum(axis=1))
    # nothing goes round all of it
    assert float((lines.lengths() / straightest).max()) < 3.0
    assert float(lines.bends()[0].max()) < 6.5


@pytest.mark.parametrize("engine", ["layered", "circular", "grid"])
def test_routes_between_pins_far_apart_are_looked_at_within_memory(engine: str) -> None:
    text = (
        "neurovis: 1\nname: far\nneurons: {A: {bias: 1, count: 3}, B: {}}\n"
        "connections: {A -> B: {pattern: all_to_all, weight: 1}, B -> A1: 1}\n"
        f"layout: {{engine: {engine}, positions: {{A1: [-1000000, 0], B: [1000000, 5]}}}}\n"
    )
    measures = nv.compile_text(text).layout().metrics()
    assert measures["pins_moved"] == 0
    assert measures["overlaps"] == 0


def test_in_a_fan_of_many_each_stays_where_it_is() -> None:
    fan = [straight((0, 0), (0, 8)), *(kink((0, 0), (k, 1), (k, 7), (0, 8)) for k in (2, 4, -3))]
    edges = [LayoutEdge(f"fan ({k})", 0, 1, 1) for k in range(4)]
    drawn_all = Drawn(edges, [(0, 0), (0, 8)], dict(enumerate(fan)))
    assert not any(how.winds for how in drawn_all.unclear({0, 1, 2, 3}).values())
    moved = improved(drawn_all, {0, 1, 2, 3})
    assert all(max(map(distance, route, fan[k])) < 1 for k, route in moved.items())
    assert improved(Drawn(edges[:2], [(0, 0), (0, 8)], dict(enumerate(fan[:2]))), {0, 1}).keys() == {1}


@given(st.lists(routes(), min_size=2, max_size=5), st.data())
@settings(max_examples=40, deadline=None)
def test_a_route_that_is_drawn_anew_is_known_as_if_it_had_been_there(drawn: list[Route], data: st.DataObject) -> None:
    ends = sorted({end for route in drawn for end in (route[0], route[-1])})
    edges = [edge(ends.index(route[0]), ends.index(route[-1])) for route in drawn]
    known = Drawn(edges, ends, dict(enumerate(drawn[:-1])), drawn=drawn[-1:])
    for k in range(len(drawn) - 1):
        middle = data.draw(st.lists(point, max_size=2, unique=True))
        known.draw(k, kink(drawn[k][0], *middle, drawn[k][-1]))
    anew = Drawn(edges, ends, known.routes, drawn=drawn[-1:])
    for k in known.routes:
        assert RouteCost(known, k).cost() == pytest.approx(RouteCost(anew, k).cost(), abs=1e-9)
    unclear, anew_unclear = known.unclear(known.routes.keys()), anew.unclear(known.routes.keys())
    assert {k: how.winds for k, how in unclear.items()} == {k: how.winds for k, how in anew_unclear.items()}
    assert [how.cost for how in unclear.values()] == pytest.approx([how.cost for how in anew_unclear.values()])


def test_only_what_is_drawn_anew_is_measured_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[int] = []

    def counted(routes: Sequence[Route]) -> Polylines:
        measured.append(len(routes))
        return polylines(routes)

    monkeypatch.setattr(route_cost, "polylines", counted)
    centres: list[Point] = [(float(x), 4.0 * y) for x in range(20) for y in range(2)]
    edges = [edge(2 * k, 2 * k + 1) for k in range(20)]
    known = Drawn(edges, centres, {k: straight(centres[2 * k], centres[2 * k + 1]) for k in range(20)})
    measured.clear()
    for k in range(20):
        known.draw(k, kink(centres[2 * k], (k + 0.5, 2.0), centres[2 * k + 1]))
    assert sum(measured) == 20


@given(st.lists(st.tuples(point, point), max_size=8), st.lists(st.tuples(point, point), min_size=1, max_size=8))
def test_segments_are_close_whose_rectangles_are(
    ones: list[tuple[Point, Point]], others: list[tuple[Point, Point]]
) -> None:
    a, b = np.array(ones, dtype=np.float64).reshape(-1, 2, 2).transpose(1, 0, 2)
    c, d = np.array(others, dtype=np.float64).reshape(-1, 2, 2).transpose(1, 0, 2)
    i, j = close_segments(a, b, c, d, 0.5)
    found = list(zip(i.tolist(), j.tolist(), strict=True))
    assert found == [
        (i, j)
        for i, one in enumerate(ones)
        for j, other in enumerate(others)
        if all(
            min(p[axis] for p in other) <= max(p[axis] for p in one) + 0.5
            and max(p[axis] for p in other) >= min(p[axis] for p in one) - 0.5
            for axis in (0, 1)
        )
    ]


@given(
    st.lists(st.tuples(st.lists(point, min_size=2, max_size=6, unique=True), st.sampled_from((4.0, 1.0))), min_size=1)
)
@settings(max_examples=40, deadline=None)
def test_many_lines_are_smoothed_at_once_as_one_by_one(ways: list[tuple[list[Point], float]]) -> None:
    pieces, owner = smoothed(ways)
    for k, way in enumerate(ways):
        own, route = pieces[owner == k].tolist(), smooth(*way)
        assert [tuple(own[0][0]), *(tuple(place) for piece in own for place in piece[1:])] == list(route)


def layers(*sizes: int) -> str:
    """Fully connected layers, each in a box."""
    groups = "".join(f"  {chr(97 + k)}: {{count: {size}, box: layer {k}}}\n" for k, size in enumerate(sizes))
    links = "".join(
        f"  {chr(97 + k)} -> {chr(98 + k)}: {{weight: 1, pattern: all_to_all}}\n" for k in range(len(sizes) - 1)
    )
    return f"neurovis: 1\nname: layers\nneurons:\n{groups}connections:\n{links}"


#: Two layers in one rank, one of which is driven by what it drives.
ELMAN = """
neurovis: 1
name: elman
neurons:
  in: {count: 4, box: input}
  context: {count: 5, box: context}
  hidden: {count: 5, box: hidden}
  out: {count: 3}
connections:
  in -> hidden: {weight: 1, pattern: all_to_all}
  context -> hidden: {weight: 1, pattern: all_to_all}
  hidden -> context: {weight: 1, pattern: one_to_one}
  hidden -> out: {weight: 1, pattern: all_to_all}
"""


@pytest.mark.parametrize(
    "text", [layers(6, 8, 3), layers(8, 12, 4, 8), f"{layers(6, 8, 3)}layout: {{direction: right}}\n", ELMAN]
)
def test_no_line_leaves_a_bundle_to_cross_fewer(text: str) -> None:
    for route in nv.compile_text(text).layout().routes.values():
        line = sampled(route, 0.05)
        assert sum(distance(a, b) for a, b in pairwise(line)) < 1.4 * distance(route[0], route[-1])
