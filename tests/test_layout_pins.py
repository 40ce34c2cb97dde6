"""Pins anywhere: in and of instances, carried over by mirrors; the rest gives way, and frames lie on no other."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from unittest.mock import patch

import layout_conformance as suite
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.occupancy import Occupancy

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.clashes import clashes
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem, problem_of

LEGS = """
neurovis: 1
name: legs
modules:
  leg:
    neurons: {S: {count: 3, bias: 1}, T: {}}
    connections: {S1 -> T: 1, S2 -> T: 1}
instances: {left: {module: leg, count: 2}, right: {module: leg, count: 2}}
connections: {left1.T -> right1.S: 1}
layout: LAYOUT
"""


def legs(layout: str) -> nv.CompiledNetwork:
    return nv.compile_text(LEGS.replace("LAYOUT", layout))


@pytest.mark.parametrize("x", [-6, -4.5, -3, -2, 2, 3.5, 6])
@pytest.mark.parametrize("y", [-5, 0, 2.5])
def test_an_axis_is_found_at_which_no_frames_lie_on_each_other(x: float, y: float) -> None:
    """Of two instances a neuron is pinned: the mirror's axis is where the images of these have room as well."""
    network = legs(f"{{mirror: [[left, right]], positions: {{left1.T: [0, 0], right2.S1: [{x}, {y}]}}}}")
    layout, problem = network.layout("layered").value, problem_of(network.network)
    assert (layout.positions["left1.T"], layout.positions["right2.S1"]) == ((0, 0), (x, y))
    assert not suite.frames_meet(layout, problem)
    found = metrics(layout, problem)
    assert (found["symmetry"], found["overlaps"]) == (1, 0)


def test_a_refusal_speaks_of_what_is_pinned_itself() -> None:
    with pytest.raises(LayoutRefusalError) as caught:
        legs("{mirror: [[left, right]], positions: {left1.S1: [0, 0], left1.T: [0, 4], right2.S1: [0, 2]}}").layout(
            "layered"
        )
    assert caught.value.code == "pin-in-frame"
    assert {name.partition(".")[0] for name in caught.value.about} == {"left1", "right2"}


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
@pytest.mark.parametrize(
    ("pins", "mirror", "apart"),
    [
        ("left1.S1: [0, 0], right1.T: [1, 1]", False, False),
        ("left1.S2: [0, 0], right1.T: [1, 1], left2.T: [-1, 1.5]", False, False),
        ("left1.S2: [0, 0], right1.T: [1.75, 0], left2.T: [-1.75, 0], right2.S1: [0, 2.25]", False, True),
        ("left1.T: [0, 0], right2.S1: [-1, -2]", True, True),
    ],
)
def test_instances_whose_drawings_lie_on_each_other_are_bent_so_that_both_have_room(
    pins: str, mirror: bool, apart: bool, direction: str
) -> None:
    """Pins that are not in the frames around each other are kept; these frames lie on each other only if they must."""
    mirrored = "mirror: [[left, right]], " if mirror else ""
    network = legs(f"{{{mirrored}direction: {direction}, positions: {{{pins}}}}}")
    assert network.refusal() is None
    layout, problem = network.layout("layered").value, problem_of(network.network)
    check_pins(problem, layout)
    assert not any("stands in" in clash.message for clash in clashes(problem, layout))
    assert not (apart and clashes(problem, layout))


@pytest.mark.parametrize("engine", ["layered", "grid"])
def test_pins_of_an_instance_may_be_as_far_apart_as_pins_may_be(engine: str) -> None:
    """What is looked up by place is so by the number of things, not by the area of the frame around them."""
    pins = {"left1.S1": (-900_000.0, -900_000.0), "left1.T": (900_000.0, 900_000.0)}
    said = ", ".join(f"{name}: [{x}, {y}]" for name, (x, y) in pins.items())
    drawn = legs(f"{{positions: {{{said}}}}}").layout(engine)
    assert {name: drawn.positions[name] for name in pins} == pins
    assert drawn.metrics()["overlaps"] == 0


def test_many_pinned_instances_that_cannot_stay_alike_are_each_drawn_as_there_is_room() -> None:
    """To look for one place that suits all of them took as long as there are places, times as many as they are."""
    paths = [f"x{i}" for i in range(1, 21)]
    pairs = [(f"{path}.{a}", f"{path}.{b}") for path in paths for a, b in ("ab", "bc", "ca")]
    pins = {f"{path}.a": (1.6 * (i % 5), 1.5 * (i // 5)) for i, path in enumerate(paths[:10])}
    modules = [(path, "col") for path in paths]
    names = [f"{path}.{n}" for path in paths for n in "abc"]
    problem = NamedProblem("x", names, edges=suite.named(pairs), pins=pins, modules=modules).canonical()
    with patch.object(Occupancy, "_free", autospec=True, side_effect=Occupancy._free) as looked:
        layout = lay_out_problem(problem, "grid")
    check_pins(problem, layout)
    assert looked.call_count < 20_000


def corner(layout: Layout, path: str) -> Point:
    """The smallest x and y of an instance's neurons."""
    own = [point for name, point in layout.positions.items() if name.startswith(f"{path}.")]
    return min(x for x, _ in own), min(y for _, y in own)


@pytest.mark.parametrize("engine", ["layered", "grid", "circular", "organic"])
@pytest.mark.parametrize("pins", ["", ", right2.T: [45, 4]"])
def test_every_engine_places_the_origin_of_an_instance(engine: str, pins: str) -> None:
    drawn = legs(f"{{positions: {{left1: [50, 20], right1: [40, -8]{pins}}}}}").layout(engine)
    assert (corner(drawn.value, "left1"), corner(drawn.value, "right1")) == ((50, 20), (40, -8))
    assert drawn.metrics()["overlaps"] == 0
    assert drawn.positions["right2.T"] == (45, 4) or not pins


@pytest.mark.parametrize("engine", ["layered", "grid", "circular"])
def test_a_pin_on_an_instance_goes_before_what_a_file_remembers(engine: str) -> None:
    before = legs("{}").layout(engine).value
    x, y = corner(before, "left2")
    network = legs(f"{{positions: {{left1: [{x + 0.5}, {y + 0.25}]}}}}")
    drawn = network.layout(engine, earlier=before)
    assert corner(drawn.value, "left1") == (x + 0.5, y + 0.25)
    assert corner(drawn.value, "left2") != (x, y)  # it gives way, as a whole
    offset = [
        {name[6:]: (a - x, b - y) for name, (a, b) in layout.positions.items() if name.startswith("left2.")}
        for layout, (x, y) in ((before, (x, y)), (drawn.value, corner(drawn.value, "left2")))
    ]
    assert offset[0] == offset[1]
    for name, point in before.positions.items():
        assert drawn.positions[name] == point or name.startswith("left")
    assert drawn.metrics()["overlaps"] == 0
    assert drawn.warnings == ()
    assert network.layout(engine, earlier=drawn.value).positions == drawn.positions


@st.composite
def walkers(draw: st.DrawFn, most: int) -> LayoutProblem:
    """Legs on two sides, perhaps mirror images, with knees in them, boxes, and up to ``most`` pins: of neurons
    anywhere, of whole legs, and, where there may be several, of neurons in the module."""
    count, size = draw(st.integers(1, 3)), draw(st.integers(1, 4))
    knees = suite.members("K", 2) if draw(st.booleans()) else []
    own = [*suite.members("S", size), *(f"knee.{name}" for name in knees)]
    legs = [f"{side}{i + 1}" for side in ("left", "right") for i in range(count)]
    middle = suite.members("C", draw(st.integers(0, 4)))
    names = [f"{leg}.{name}" for leg in legs for name in own] + middle
    inner = draw(st.lists(st.tuples(st.sampled_from(own), st.sampled_from(own)), max_size=8))
    pairs = [(f"{leg}.{a}", f"{leg}.{b}") for leg in legs for a, b in inner]
    pairs += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=14))
    mirrors = []
    if draw(st.booleans()):
        sides = [(f"left{i + 1}", f"right{i + 1}") for i in range(count)]
        mirrors = [("", [(f"{a}.{name}", f"{b}.{name}") for a, b in sides for name in own], sides)]
        if len(middle) > 1 and draw(st.booleans()):
            mirrors.append(("", [(middle[0], middle[1])], []))
    lattice = st.tuples(st.integers(-9, 9), st.integers(-9, 9))
    spots = [(1.5 * x, 1.25 * y) for x, y in draw(st.lists(lattice, unique=True, min_size=1, max_size=most))]
    chosen = draw(st.lists(st.sampled_from([*names, *legs]), unique=True, min_size=1, max_size=most))
    pins = {name: spot for name, spot in zip(chosen, spots, strict=False) if name in names}
    origins = {name: spot for name, spot in zip(chosen, spots, strict=False) if name in legs}
    relative: dict[str, Mapping[str, Point]] = {}
    if most > 1 and draw(st.integers(0, 3)) == 0:
        relative = {leg: {f"{leg}.{name}": (1.5 * k, 0.75 * k) for k, name in enumerate(own[:2])} for leg in legs}
    groups = [("C", middle)] if middle else []
    groups += [(f"{leg}.S", [f"{leg}.{name}" for name in suite.members("S", size)]) for leg in legs]
    return NamedProblem(
        "walker",
        names,
        groups,
        suite.named(pairs, draw(st.integers(0, 1))),
        pins,
        draw(st.sampled_from(["down", "up", "right", "left"])),
        boxes=[("frame", middle[:2])] if len(middle) > 2 and draw(st.booleans()) else [],
        modules=[(leg, "leg") for leg in legs] + ([(f"{leg}.knee", "knee") for leg in legs] if knees else []),
        relative=relative,
        origins=origins,
        mirrors=mirrors,
    ).canonical()


def attempt(problem: LayoutProblem) -> tuple[Layout | None, str]:
    try:
        return lay_out_problem(problem, "layered"), ""
    except LayoutRefusalError as refusal:
        return None, refusal.code


def check_pins(problem: LayoutProblem, layout: Layout) -> None:
    """Pins and origins exact, mirror images to the last bit, instances alike unless pins bend them, discs apart."""
    at = [layout.positions[name] for name in problem.neurons]
    assert all(at[i] == pin for i, pin in problem.pins.items())
    assert all(distance(a, b) >= 0.6 - 1e-9 for a, b in combinations(at, 2))
    across = 0 if problem.direction in ("down", "up") else 1
    image = {a: b for mirror in problem.mirrors for pair in mirror.pairs for a, b in (pair, pair[::-1])}
    assert len({at[a][across] + at[b][across] for a, b in image.items()}) <= 1
    assert all(at[a][1 - across] == at[b][1 - across] for a, b in image.items())
    bent = problem.pins.keys() | {image[i] for i in problem.pins if i in image}
    shapes: dict[str, set[tuple[Point, ...]]] = {}
    for module in problem.modules:
        if not bent.isdisjoint(module.members):
            continue
        (x, y), own = at[module.members[0]], [at[member] for member in module.members]
        if module.origin is not None and not module.pins:
            assert (min(a for a, _ in own), min(b for _, b in own)) == module.origin
        shape = [(a - x, b - y) for a, b in own]
        turned = [(-a + 0.0, b) if across == 0 else (a, -b + 0.0) for a, b in shape]
        shapes.setdefault(module.template, set()).add(tuple(min(shape, turned)))
    assert all(len(alike) == 1 for alike in shapes.values())


@examples(12)
@given(problem=walkers(most=1))
def test_everything_gives_way_to_one_pin(problem: LayoutProblem) -> None:
    layout = lay_out_problem(problem, "layered")
    check_pins(problem, layout)
    assert clashes(problem, layout) == []
    assert not suite.frames_meet(layout, problem)


@examples(12)
@given(problem=walkers(most=4))
def test_pins_are_kept_and_what_they_put_on_each_other_is_told(problem: LayoutProblem) -> None:
    layout, refusal = attempt(problem)
    if layout is None:
        assert refusal in {"pin-in-frame", "mirror-pins", "pins-too-close"}
        return
    check_pins(problem, layout)
    assert clashes(problem, layout) or not suite.frames_meet(layout, problem)


def test_instances_without_a_pin_keep_off_the_frames_of_those_that_have_one() -> None:
    names = [f"x{i}.{n}" for i in range(1, 5) for n in "abc"]
    loops = [(f"x{i}.{a}", f"x{i}.{b}") for i in range(1, 5) for a, b in ("ab", "bc", "ca")]
    pairs = [
        *loops,
        *(("I", f"x{i}.a") for i in range(1, 5)),
        *((f"x{i}.c", "O") for i in range(1, 5)),
        ("x1.c", "x2.a"),
    ]
    paths = [(f"x{i}", "col") for i in range(1, 5)]
    pins = {"x2.a": (10.0, 3.0), "x3.b": (-3.0, 1.0), "x4.a": (0.0, 10.0), "x4.c": (2.0, 10.0), "O": (20.0, 20.0)}
    problem = NamedProblem("x", [*names, "I", "O"], edges=suite.named(pairs), pins=pins, modules=paths).canonical()
    layout = suite.check(problem, "organic")
    assert layout is not None
    assert not clashes(problem, layout)


@pytest.mark.parametrize("inner", [False, True])
def test_a_module_with_pins_is_not_reflected_for_its_connections(inner: bool) -> None:
    pinned = "pinned: {neurons: {A: {}, B: {}}, layout: {positions: {A: [0, 0], B: [3, 0]}}}"
    around = "around: {neurons: {C: {}}, instances: {m: {module: pinned}}, connections: {m.A -> C: 1}}"
    module, one = ("around", "one.m") if inner else ("pinned", "one")
    layout = nv.compile_text(
        f"neurovis: 1\nname: x\nmodules: {{{pinned}, {around}}}\n"
        f"neurons: {{R: {{bias: 1}}, p: {{}}, q: {{}}, p1: {{}}, q1: {{}}}}\ninstances: {{one: {{module: {module}}}}}\n"
        f"connections: {{R -> p + q: 1, p -> p1: 1, q -> q1: 1, p1 -> {one}.B: 1, q1 -> {one}.A: 1}}"
    ).layout("layered")
    assert layout.positions[f"{one}.B"][0] - layout.positions[f"{one}.A"][0] == 3
