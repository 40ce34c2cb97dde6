"""Instances as frames, drawn alike; mirrors; lines; pins among them: exactly, for any network."""

from __future__ import annotations

from itertools import combinations

import layout_conformance as suite
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.layout import Direction, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import canonical

Rect = tuple[float, float, float, float]


@st.composite
def walkers(draw: st.DrawFn, pinned: bool = False, mirrored: bool | None = None) -> LayoutProblem:
    """Legs on two sides, each with a knee in it perhaps, neurons between them, connections anywhere."""
    count, size, knees = draw(st.integers(1, 3)), draw(st.integers(1, 4)), draw(st.booleans())
    own = suite.members("S", size) + ([f"knee.{name}" for name in suite.members("K", 2)] if knees else [])
    legs = [f"{side}{i + 1}" for side in ("left", "right") for i in range(count)]
    middle = suite.members("C", draw(st.integers(0, 4)))
    names = [f"{leg}.{name}" for leg in legs for name in own] + middle
    inner = draw(st.lists(st.tuples(st.sampled_from(own), st.sampled_from(own)), max_size=8))
    pairs = [(f"{leg}.{a}", f"{leg}.{b}") for leg in legs for a, b in inner]
    pairs += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=14))
    modules = [(leg, "leg") for leg in legs] + ([(f"{leg}.knee", "knee") for leg in legs] if knees else [])
    mirrors = []
    if draw(st.booleans()) if mirrored is None else mirrored:
        sides = [(f"left{i + 1}", f"right{i + 1}") for i in range(count)]
        mirrors = [("", [(f"{a}.{name}", f"{b}.{name}") for a, b in sides for name in own], sides)]
        if len(middle) > 1 and draw(st.booleans()):
            mirrors.append(("", [(middle[0], middle[1])], []))
    pins: dict[str, Point] = {}
    if pinned:
        chosen = draw(st.lists(st.sampled_from(names), unique=True, max_size=3))
        spots = draw(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), unique=True, min_size=3, max_size=3))
        pins = {name: (1.5 * x, 1.25 * y) for name, (x, y) in zip(chosen, spots, strict=False)}
    boxes = [("frame", middle[:2])] if len(middle) > 2 and draw(st.booleans()) else []
    groups = [("C", middle)] if middle else []
    groups += [(f"{leg}.S", [f"{leg}.{name}" for name in suite.members("S", size)]) for leg in legs]
    directions: tuple[Direction, ...] = ("down", "up", "right", "left")
    direction = draw(st.sampled_from(directions))
    edges = suite.named(pairs, draw(st.integers(0, 1)))
    return canonical("walker", names, groups, edges, pins, direction, boxes=boxes, modules=modules, mirrors=mirrors)


def offsets(layout: Layout, problem: LayoutProblem, number: int) -> tuple[Point, ...]:
    points = [layout.positions[problem.neurons[m]] for m in problem.modules[number].members]
    return tuple((x - points[0][0], y - points[0][1]) for x, y in points)


def inner_routes(layout: Layout, problem: LayoutProblem, number: int) -> dict[str, tuple[Point, ...]]:
    """Routes between neurons of an instance, relative to its first neuron."""
    module = problem.modules[number]
    x, y = layout.positions[problem.neurons[module.members[0]]]
    own = set(module.members)
    return {
        edge.name.replace(f"{module.path}.", ""): tuple((a - x, b - y) for a, b in layout.routes[edge.name])
        for edge in problem.edges
        if edge.source in own and edge.target in own
    }


def across(problem: LayoutProblem) -> int:
    return 0 if problem.direction in ("down", "up") else 1


def reflected(points: tuple[Point, ...], axis: int) -> tuple[Point, ...]:
    return tuple((-x, y) if axis == 0 else (x, -y) for x, y in points)


def frame(layout: Layout, problem: LayoutProblem, members: tuple[int, ...], pad: float = 0.3) -> Rect:
    xs, ys = zip(*(layout.positions[problem.neurons[m]] for m in members), strict=True)
    return min(xs) - pad, min(ys) - pad, max(xs) + pad, max(ys) + pad


def inside(rect: Rect, point: Point) -> bool:
    return rect[0] < point[0] < rect[2] and rect[1] < point[1] < rect[3]


def check_frames(layout: Layout, problem: LayoutProblem) -> None:
    """Nothing foreign in a frame, and frames in each other or apart."""
    framed = [module.members for module in problem.modules] + [members for _, members in problem.boxes]
    for members in framed:
        rect = frame(layout, problem, members)
        for i, name in enumerate(problem.neurons):
            assert i in members or not inside(rect, layout.positions[name]), name


def check_mirror(layout: Layout, problem: LayoutProblem) -> None:
    """Images to the last bit, those of routes as well."""
    axis = across(problem)
    image = {a: b for mirror in problem.mirrors for pair in mirror.pairs for a, b in (pair, pair[::-1])}
    at = [layout.positions[name] for name in problem.neurons]
    sums = {at[a][axis] + at[b][axis] for a, b in image.items()}
    assert len(sums) <= 1
    assert all(at[a][1 - axis] == at[b][1 - axis] for a, b in image.items())
    if not sums:
        return
    twice = sums.pop()
    keys: dict[tuple[int, int, int], str] = {}
    times: dict[tuple[int, int], int] = {}
    for edge in problem.edges:
        number = times[edge.source, edge.target] = times.get((edge.source, edge.target), 0) + 1
        keys[edge.source, edge.target, number] = edge.name
    for (a, b, number), name in keys.items():
        ends = [image.get(n, n if 2 * at[n][axis] == twice else -1) for n in (a, b)]
        other = keys.get((ends[0], ends[1], number))
        if other is None or other == name:
            continue
        expected = tuple((twice - x, y) if axis == 0 else (x, twice - y) for x, y in layout.routes[name])
        assert layout.routes[other] == expected, name


def attempt(problem: LayoutProblem) -> tuple[Layout | None, str]:
    try:
        return lay_out_problem(problem, "layered"), ""
    except LayoutRefusalError as refusal:
        return None, refusal.code


@settings(max_examples=80, deadline=None)
@given(problem=walkers())
def test_instances_of_one_make_are_one_drawing(problem: LayoutProblem) -> None:
    layout = suite.check(problem, "layered")
    assert layout is not None
    check_frames(layout, problem)
    axis = across(problem)
    for one, other in combinations(range(len(problem.modules)), 2):
        if problem.modules[one].template != problem.modules[other].template:
            continue
        first, second = offsets(layout, problem, one), offsets(layout, problem, other)
        ours, theirs = inner_routes(layout, problem, one), inner_routes(layout, problem, other)
        turned = {name: reflected(route, axis) for name, route in ours.items()}
        assert (first, ours) == (second, theirs) or (reflected(first, axis), turned) == (second, theirs)


@settings(max_examples=80, deadline=None)
@given(problem=walkers(mirrored=True))
def test_mirror_images_are_exact(problem: LayoutProblem) -> None:
    layout = lay_out_problem(problem, "layered")
    check_mirror(layout, problem)
    check_frames(layout, problem)
    suite.check_positions(problem, layout)
    assert metrics(layout, problem)["symmetry"] == 1


@settings(max_examples=120, deadline=None)
@given(problem=walkers(pinned=True))
def test_pins_hold_and_everything_else_gives_way(problem: LayoutProblem) -> None:
    layout, refusal = attempt(problem)
    if layout is None:
        assert refusal in {"pin-in-frame", "mirror-pins", "pins-too-close"}
        return
    suite.check_routes(problem, layout)
    check_frames(layout, problem)
    check_mirror(layout, problem)
    points = [layout.positions[name] for name in problem.neurons]
    assert all(points[i] == pin for i, pin in problem.pins.items())
    assert all(distance(a, b) >= 0.6 - 1e-9 for a, b in combinations(points, 2))
