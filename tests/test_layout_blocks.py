"""Instances as frames in `grid` and `circular`: one drawing for each make, exactly, that nothing foreign enters."""

from __future__ import annotations

from itertools import combinations

import layout_conformance as suite
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples

import neurovis_spec as nv
from neurovis_spec.layout import Direction, Layout, LayoutProblem, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.clashes import clashes
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem, problem_of


@st.composite
def bodies(draw: st.DrawFn, pinned: bool = False) -> LayoutProblem:
    """Legs with knees in them perhaps, neurons between them, connections anywhere."""
    count, size, knees = draw(st.integers(1, 5)), draw(st.integers(0, 5)), draw(st.booleans())
    own = suite.members("S", size) + ([f"knee.{name}" for name in suite.members("K", 3)] if knees or not size else [])
    legs = [f"leg{i + 1}" for i in range(count)]
    names = [f"{leg}.{name}" for leg in legs for name in own] + suite.members("C", draw(st.integers(0, 6)))
    inner = draw(st.lists(st.tuples(st.sampled_from(own), st.sampled_from(own)), max_size=8))
    pairs = [(f"{leg}.{a}", f"{leg}.{b}") for leg in legs for a, b in inner]
    pairs += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=20))
    modules = [(leg, "leg") for leg in legs] + ([(f"{leg}.knee", "knee") for leg in legs] if "knee.K1" in own else [])
    relative: dict[str, dict[str, Point]] = {}
    if draw(st.booleans()):
        relative = {leg: {f"{leg}.{own[0]}": (0.25, -1.5), f"{leg}.{own[-1]}": (3.0, 0.5)} for leg in legs}
    pins: dict[str, Point] = {}
    if pinned:
        spots = draw(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), unique=True, min_size=1, max_size=3))
        chosen = draw(st.lists(st.sampled_from(names), unique=True, max_size=3))
        pins = {name: (0.7 * x, 0.9 * y) for name, (x, y) in zip(chosen, spots, strict=False)}
    directions: tuple[Direction, ...] = ("down", "up", "right", "left")
    return NamedProblem(
        "body",
        names,
        edges=suite.named(pairs),
        pins=pins,
        direction=draw(st.sampled_from(directions)),
        modules=modules,
        relative=relative,
    ).canonical()


def drawn(layout: Layout, problem: LayoutProblem, number: int) -> tuple[list[Point], dict[str, list[Point]]]:
    """The neurons of an instance and the routes within it, from its first neuron."""
    module = problem.modules[number]
    points = [layout.positions[problem.neurons[m]] for m in module.members]
    (x, y), own = points[0], set(module.members)
    routes = {
        edge.name.replace(f"{module.path}.", ""): [(a - x, b - y) for a, b in layout.routes[edge.name]]
        for edge in problem.edges
        if edge.source in own and edge.target in own
    }
    return [(a - x, b - y) for a, b in points], routes


@pytest.mark.parametrize("engine", ["grid", "circular"])
@examples(10)
@given(problem=bodies())
def test_instances_of_one_make_are_one_drawing_and_walls(engine: str, problem: LayoutProblem) -> None:
    layout = suite.check(problem, engine)
    assert layout is not None
    if not any(module.pins for module in problem.modules):
        assert suite.through_frames(layout, problem) == []
        assert not suite.frames_meet(layout, problem)
    for one, other in combinations(range(len(problem.modules)), 2):
        if problem.modules[one].template == problem.modules[other].template:
            assert drawn(layout, problem, one) == drawn(layout, problem, other)
    for module in problem.modules:
        if len(module.pins) > 1:
            apart = {
                (layout.positions[problem.neurons[m]][0] - x, layout.positions[problem.neurons[m]][1] - y)
                for m, (x, y) in module.pins.items()
            }
            assert len(apart) == 1, "pins of a module are relative to the origin of its instances"


@pytest.mark.parametrize("engine", ["grid", "circular"])
@examples(10)
@given(problem=bodies(pinned=True))
def test_pins_bend_only_the_instances_that_they_are_in(engine: str, problem: LayoutProblem) -> None:
    layout = suite.check(problem, engine)
    assert layout is not None
    assert metrics(layout, problem)["overlaps"] == 0


def test_an_instance_that_no_pin_touches_keeps_its_drawing() -> None:
    names = [f"m{i}.N{j}" for i in range(1, 5) for j in range(1, 5)]
    pairs = suite.named((f"m{i}.N{j}", f"m{i}.N{j + 1}") for i in range(1, 5) for j in range(1, 4))
    modules = [(f"m{i}", "m") for i in range(1, 5)]
    free = NamedProblem("x", names, edges=pairs, modules=modules).canonical()
    pinned = NamedProblem("x", names, edges=pairs, modules=modules, pins={"m2.N1": (40.0, 40.0)}).canonical()
    for engine in ("grid", "circular"):
        before, now = lay_out_problem(free, engine), lay_out_problem(pinned, engine)
        assert now.positions["m2.N1"] == (40.0, 40.0)
        for number in (0, 2, 3):
            assert drawn(now, pinned, number) == drawn(before, free, number)


@pytest.mark.parametrize("engine", ["grid", "circular"])
def test_the_rest_stands_around_what_is_pinned_and_in_no_frame(engine: str) -> None:
    text = """\
neurovis: 1
name: around
modules:
  col: {neurons: {a: {bias: 1}, b: {}, c: {}}, connections: {a -> b: 1, b -> c: 1, c -> a: 0.3}}
instances: {x: {module: col, count: 4}}
neurons: {O: {}, I: {}, Z: {count: 3}}
connections: {I -> x.a: 1, x.c -> O: 1, x1.c -> x2.a: 1, Z -> O: 1}
layout: {positions: {x2: [10, 3], x3.b: [-3, 1], x4.a: [0, 10], x4.c: [2, 10], O: [20, 20], Z2: [5, 8]}}
"""
    network = nv.compile_text(text)
    problem = problem_of(network.network)
    layout = lay_out_problem(problem, engine)
    assert clashes(problem, layout) == []
    assert all(layout.positions[problem.neurons[i]] == point for i, point in problem.pins.items())
    shapes = [drawn(layout, problem, number) for number in range(3)]
    assert shapes[0] == shapes[1] == shapes[2], "one pin in an instance takes the rest of it along"
