"""A plan of the page: what a cell names stands in its row and column; mirror images, copies and pins are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import layout_conformance as suite
import pytest
from examples import SPECS, shipped
from hypothesis import example, given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.layout import Direction, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import Seat
from neurovis_spec.layout.problem import NamedProblem, problem_of

LEG = """\
  leg:
    neurons: {A: {}, B: {count: 2}, C: {}, D: {}}
    connections: {A -> B: 1, B -> C: 1, C -> D: 1}
"""
BODY = f"""\
neurovis: 1
name: body
modules:
{LEG}instances:
  left: {{module: leg, count: 2}}
  right: {{module: leg, count: 2}}
neurons: {{R: {{count: 2, bias: 1, box: rhythm}}, T: {{count: 2}}, Z: {{}}}}
connections:
  R1 -> left.A: 1
  R2 -> right.A: 1
  T1 -> left1.B: 1
  T2 -> right1.B: 1
layout:
  direction: DIRECTION
  mirror: [[left, right], [R1, R2], [T1, T2]]
  plan: PLAN
"""
ROWS = "[[left1, ~, right1], [left2, rhythm, right2]]"


def body(plan: str = ROWS, direction: Direction = "down") -> nv.CompiledNetwork:
    return nv.compile_text(BODY.replace("PLAN", plan).replace("DIRECTION", direction))


def span(at: Mapping[str, Point], names: Sequence[str], axis: int) -> tuple[float, float]:
    values = [point[axis] for name, point in at.items() if name.startswith(tuple(names))]
    return min(values), max(values)


def in_order(at: Mapping[str, Point], cells: Sequence[Sequence[str]], axis: int) -> bool:
    spans = [span(at, names, axis) for names in cells]
    return all(one[1] < other[0] for one, other in pairwise(spans))


@pytest.mark.parametrize("direction", ["down", "up"])
def test_rows_and_columns_are_those_of_the_page_in_either_direction(direction: Direction) -> None:
    at = body(direction=direction).layout().positions
    assert in_order(at, [["left"], ["R"], ["right"]], 0)
    assert in_order(at, [["left1", "right1"], ["left2", "right2"]], 1)


@pytest.mark.parametrize("direction", ["right", "left"])
def test_where_signals_go_sideways_images_are_above_each_other(direction: Direction) -> None:
    at = body("[[left1, left2], [rhythm, rhythm], [right1, right2]]", direction).layout().positions
    assert in_order(at, [["left"], ["R"], ["right"]], 1)
    assert in_order(at, [["left1", "right1"], ["left2", "right2"]], 0)


def test_mirror_images_are_exact_and_copies_alike() -> None:
    layout = body().layout()
    at = layout.positions
    axis = at["R1"][0] + at["R2"][0]
    for name, (x, y) in at.items():
        if name.startswith("left"):
            image = name.replace("left", "right")
            assert at[image] == (axis - x, y)
            for edge in (edge for edge in layout.routes if edge.startswith(f"{name} ->")):
                mirrored = tuple((axis - px, py) for px, py in layout.routes[edge])
                assert layout.routes[edge.replace("left", "right")] == mirrored
    shifts = {
        (at[f"left2.{n}"][0] - at[f"left1.{n}"][0], at[f"left2.{n}"][1] - at[f"left1.{n}"][1])
        for n in ("A", "B1", "B2", "C", "D")
    }
    assert len(shifts) == 1


def test_each_part_faces_what_it_is_connected_to() -> None:
    at = body().layout().positions
    assert at["left1.A"][0] > at["left1.C"][0] > at["left1.D"][0], "the rhythm between the legs drives A"


@pytest.mark.parametrize("direction", ["down", "right"])
@pytest.mark.parametrize(("plan", "axis"), [("[[A, M, B]]", 0), ("[[A], [M], [B]]", 1)])
def test_layers_that_are_fully_connected_face_each_other(plan: str, axis: int, direction: str) -> None:
    text = f"""\
neurovis: 1
name: layers
neurons: {{A: {{count: 3}}, M: {{count: 4, bias: 1}}, B: {{count: 5}}}}
connections: {{M -> A: {{pattern: all_to_all}}, M -> B: {{pattern: all_to_all}}}}
layout: {{plan: {plan}, direction: {direction}}}
"""
    at = nv.compile_text(text).layout().positions
    for group in "AMB":
        assert len({point[axis] for name, point in at.items() if name.startswith(group)}) == 1
    assert in_order(at, [["A"], ["M"], ["B"]], axis)


def test_streets_tell_groups_without_frames_apart() -> None:
    grids = ", ".join(f"G{k}: {{count: 4, bias: 1}}" for k in range(9))
    arranged = ", ".join(f"G{k}: grid" for k in range(9))
    text = f"""\
neurovis: 1
name: field
neurons: {{{grids}}}
layout: {{plan: [[G0, G1, G2], [G3, G4, G5], [G6, G7, G8]], arrange: {{{arranged}}}}}
"""
    at = nv.compile_text(text).layout().positions
    for axis in (0, 1):
        lines = sorted({point[axis] for point in at.values()})
        steps = [b - a for a, b in pairwise(lines)]
        assert len(steps) == 5
        assert min(steps[1], steps[3]) >= 1.5 * max(steps[0], steps[2], steps[4])


def test_what_no_cell_names_is_beside_what_it_is_connected_to() -> None:
    at = body().layout().positions
    legs = {name: span(at, [name], 0) for name in ("left1", "right1")}
    for taps, leg in (("T1", "left1"), ("T2", "right1")):
        assert legs[leg][0] <= at[taps][0] <= legs[leg][1]
        assert at[taps][1] < span(at, ["left2"], 1)[0]
    assert at["Z"][1] > max(y for name, (_, y) in at.items() if name != "Z"), "connected to nothing: below all"


def test_a_name_in_neighbouring_cells_spans_them() -> None:
    at = body("[[rhythm, rhythm], [left1, right1], [left2, right2]]").layout().positions
    assert (at["R1"][0] + at["R2"][0]) / 2 == (at["left1.A"][0] + at["right1.A"][0]) / 2
    assert in_order(at, [["R"], ["left1"], ["left2"]], 1)


def test_copies_in_a_column_are_reflected_together() -> None:
    legs = [f"{side}{i}" for side in "LR" for i in (1, 2, 3)]
    text = (
        "neurovis: 1\nname: walker\nmodules:\n  leg:\n    neurons: {A: {bias: 1}, G: {bias: 1}, H: {}, S: {}, T: {}, "
        "P: {}, Q: {}, R: {}}\n    connections: {A -> H: 1, G -> S + T: 1, H -> S + T: 1, S -> S + T + P + Q: 1, "
        "T -> S + T + R: 1}\ninstances: {"
        + ", ".join(f"{leg}: {{module: leg}}" for leg in legs)
        + "}\nconnections:\n"
        + "".join(f"  {s}{i + 1}.S -> {s}{i}.H: 1\n  {s}{i}.T -> {s}{i + 1}.H: 1\n" for s in "LR" for i in (1, 2))
        + "".join(f"  L{i}.T -> R{i}.H: 1\n  R{i}.T -> L{i}.H: 1\n" for i in (1, 2, 3))
        + "layout: {mirror: [[L1, R1], [L2, R2], [L3, R3]], plan: [[L1, R1], [L2, R2], [L3, R3]]}\n"
    )
    at = nv.compile_text(text).layout().positions
    assert len({at[f"L{i}.A"][0] < at[f"L{i}.P"][0] for i in (1, 2, 3)}) == 1


MIRRORED = """
neurovis: 1
name: trunk
modules:
  segment:
    neurons: {L: {}, R: {}, I: {bias: 1}}
    connections: {I -> L: 1, I -> R: 1}
    layout: {mirror: [[L, R]], plan: [[L, I, R]]}
  pair: {instances: {a: {module: segment}, b: {module: segment}}, connections: {a.L -> b.L: 1}}
instances: {s: {module: KIND}}
neurons: {A: {}}
connections: {s.FIRST -> A: 1}
layout: {plan: [[s, A]], direction: DIRECTION}
"""


@pytest.mark.parametrize(("kind", "first"), [("segment", "L"), ("pair", "a.L")])
@pytest.mark.parametrize("direction", ["down", "up"])
def test_a_plan_with_a_mirror_is_not_laid_on_its_side(kind: str, first: str, direction: str) -> None:
    text = MIRRORED.replace("KIND", kind).replace("FIRST", first).replace("DIRECTION", direction)
    at = nv.compile_text(text).layout().positions
    inner = f"s.{first[:-1]}"
    assert at[f"{inner}L"][1] == at[f"{inner}R"][1]
    assert at[f"{inner}L"][0] + at[f"{inner}R"][0] == 2 * at[f"{inner}I"][0]


def test_pins_are_kept_and_take_their_copies_place() -> None:
    text = BODY.replace("PLAN", ROWS).replace("DIRECTION", "down") + "  positions: {R1: [3, 20]}\n"
    at = nv.compile_text(text).layout().positions
    assert at["R1"] == (3, 20)
    assert at["R2"][1] == 20


def test_groups_and_boxes_may_be_cells_of_a_network_without_instances() -> None:
    text = """\
neurovis: 1
name: sheet
neurons: {A: {count: 3, bias: 1}, B: {count: 3}, C: {count: 3}, D: {count: 3}}
connections: {A -> B: {pattern: all_to_all}, B -> C: {pattern: all_to_all}, C -> D: {pattern: all_to_all}}
layout: {boxes: {upper: [A]}, plan: [[upper, B], [D, C]]}
"""
    layout = nv.compile_text(text).layout()
    at = layout.positions
    assert in_order(at, [["A", "D"], ["B", "C"]], 0)
    assert in_order(at, [["A", "B"], ["D", "C"]], 1)
    assert layout.metrics()["overlaps"] == 0


def test_a_module_may_plan_the_frame_of_its_instances() -> None:
    text = (
        BODY.replace("PLAN", ROWS)
        .replace("DIRECTION", "down")
        .replace("C -> D: 1}", "C -> D: 1}\n    layout: {plan: [[A, B], [C, B]]}")
    )
    at = nv.compile_text(text).layout().positions
    for leg, sign in (("left1", 1), ("left2", 1), ("right1", -1), ("right2", -1)):
        own = {name.partition(".")[2]: point for name, point in at.items() if name.startswith(leg)}
        assert own["A"][1] < own["C"][1]
        side = {(own["B1"][0] > own["A"][0]), (own["B2"][0] > own["C"][0])}
        assert len(side) == 1
        assert side == {(at["left1.B1"][0] > at["left1.A"][0]) == (sign > 0)}


@pytest.mark.parametrize("network", ["body", "hexapod"])
def test_the_promises_of_the_engine_hold(network: str) -> None:
    compiled = body() if network == "body" else shipped(SPECS / "hexapod" / "hexapod.yaml")
    problem, layout = problem_of(compiled.network), compiled.drawn("layered").value
    suite.check_positions(problem, layout)
    suite.check_routes(problem, layout)
    assert not suite.frames_meet(layout, problem)
    assert suite.through_frames(layout, problem) == []


ENDS = ["left1.A", "left2.D", "right1.A", "right2.D", "R1", "R2", "T1", "T2", "Z", "V1", "V2"]
PAIRED = [("T1", "left1.A"), ("T2", "right1.A")]


@pytest.mark.parametrize("plan", [ROWS, "[[left, ~, right]]", "[[left1, T1, V, T2, right1]]", "[[T1, V, T2]]"])
@given(pairs=st.lists(st.tuples(st.sampled_from(ENDS), st.sampled_from(ENDS)), max_size=8, unique=True))
@settings(deadline=None, max_examples=5)
@example(pairs=[("T1", "right2.A")])  # images that change sides
@example(pairs=[*PAIRED, ("V1", "right1.A"), ("Z", "right2.D")])
@example(pairs=[("T1", "T2"), ("T2", "V1"), ("V1", "Z"), ("V1", "left1.A"), ("V1", "right1.A")])
def test_what_has_no_mirror_image_keeps_off_what_has_one(plan: str, pairs: list[tuple[str, str]]) -> None:
    more = "".join(f"  {one} -> {other}: 1\n" for one, other in pairs if (one, other) not in PAIRED)
    text = BODY.replace("PLAN", plan).replace("DIRECTION", "down").replace("Z: {}", "Z: {}, V: {count: 2}")
    text = text.replace("  T1 -> left1.B: 1\n", f"  T1 -> left1.B: 1\n{more}")
    problem = problem_of(nv.compile_text(text).network)
    layout = lay_out_problem(problem, "layered")
    suite.check_positions(problem, layout)
    found = metrics(layout, problem)
    assert (found["overlaps"], found["symmetry"]) == (0, 1)


@pytest.mark.parametrize(("width", "fits"), [(2, True), (3, False)])
def test_empty_cells_say_where_the_middle_of_the_page_is(width: int, fits: bool) -> None:
    plan = [("", [name], Seat(0, column, 1, 1, 1, width)) for column, name in enumerate("AB")]
    problem = NamedProblem("pair", ["A", "B"], plan=plan, mirrors=[("", [("A", "B")], [])]).canonical()
    if fits:
        (ax, ay), (bx, by) = lay_out_problem(problem, "layered").positions.values()
        assert ax < bx
        assert ay == by
    else:
        with pytest.raises(LayoutRefusalError, match="do not stand in cells of the plan that are mirror images"):
            lay_out_problem(problem, "layered")


def frames(layout: Layout, problem: LayoutProblem) -> dict[str, Rect]:
    """The frames of boxes as they are drawn, by title."""
    places = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    found = Frames(problem, layout.labels).rects(places, {})[len(problem.modules) :]
    return {name: rect for (name, _), rect in zip(problem.boxes, found, strict=True) if rect is not None}


def test_a_high_cell_takes_room_from_what_stands_above_and_below_it_alone() -> None:
    within = "A1 -> A2: 1, A2 -> A3: 1, B1 -> B2: 1, B1 -> B3: 1, B1 -> B4: 1, B1 -> B5: 1"
    across = "A3 -> P: 1, B3 -> Q: 1, B4 -> R: 1, B5 -> S: 1"
    text = f"""\
neurovis: 1
name: limb
neurons: {{A: {{count: 3, bias: 1}}, B: {{count: 5, bias: 1}}, P: {{bias: 1}}, Q: {{}}, R: {{}}, S: {{}}}}
connections: {{{within}, {across}}}
layout: {{boxes: {{above: [A], below: [B]}}, plan: [[above, P], [below, Q], [below, R], [below, S]]}}
"""
    compiled = nv.compile_text(text)
    problem = problem_of(compiled.network)
    layout = compiled.layout().value
    at, boxes = layout.positions, frames(layout, problem)
    assert 0 < boxes["below"][1] - boxes["above"][3] < 1.6, "a street, not the rest of the rows beside"
    assert max(b - a for a, b in pairwise(at[name][1] for name in "QRS")) < 1.5, "as close as single neurons may be"
    assert in_order(at, [["A", "P"], ["B", "Q", "R", "S"]], 1)


@pytest.mark.parametrize("spacing", [(0.8, 1.2), (0.9, 1.2), (1.0, 1.3), (1.1, 1.3)])
def test_whichever_the_spacing_few_routes_of_the_hexapod_cross(spacing: tuple[float, float]) -> None:
    network = nv.compile("specs/hexapod/hexapod.yaml").network
    problem = replace(problem_of(network), neuron_spacing=spacing[0], rank_spacing=spacing[1])
    layout = lay_out_problem(problem, "layered")
    assert metrics(layout, problem)["crossings"] <= 31, "dot has 38 with clusters"
    assert suite.through_frames(layout, problem) == []


def test_routes_of_a_cell_go_round_what_a_pin_puts_on_them() -> None:
    links = "A4 -> A2: 1, A1 -> A1: 1, B1 -> A2: 1, B3 -> A4: 1, B1 -> B1: 1, B2 -> B4: 1, B2 -> A3: 1, A3 -> B4: 1"
    network = nv.compile_text(f"""
neurovis: 1
name: cells
neurons: {{A: {{count: 4, bias: 1}}, B: {{count: 4}}}}
connections: {{{links}}}
layout: {{plan: [[A], [B]], positions: {{A2: [0, 0], B4: [-2, 0]}}}}
""")
    layout = network.layout()
    assert (layout.positions["A2"], layout.positions["B4"]) == ((0, 0), (-2, 0))
    assert layout.metrics()["edges_over_neurons"] == 0
