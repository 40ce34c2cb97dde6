"""Folds of the layered engine: more instances than fit a rank come in rows, and what they are connected to fans out."""

from __future__ import annotations

from dataclasses import replace

import layout_conformance as suite
import pytest

import neurovis_spec as nv
from neurovis_spec.layout import Layout
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import LayoutEdge, LayoutModule, LayoutProblem
from neurovis_spec.layout.problem import problem_of

MODULE = "neurovis: 1\nname: rows\nmodules: {m: {neurons: {a: {bias: 1}, b: {}}, connections: {a -> b: 1}}}\n"
STAR = MODULE + "instances: {x: {module: m, count: 40}}\nneurons: {O: {}}\nconnections: {x.b -> O: 1}\n"
#: Driven from one neuron, and driving another.
BOTH = "neurons: {I: {bias: 1}, O: {}}\n"
BETWEEN = MODULE + BOTH + "instances: {x: {module: m, count: 40}}\nconnections: {I -> x.a: 1, x.b -> O: 1}\n"
MIRRORED = (
    MODULE
    + BOTH
    + "instances: {left: {module: m, count: 10}, right: {module: m, count: 10}}\n"
    + "connections: {I -> left.a: 1, I -> right.a: 1, left.b -> O: 1, right.b -> O: 1}\n"
    + "layout: {mirror: [[left, right]]}\n"
)
#: Five on each side, in two rows, each connected with its image.
COUPLED = """
neurovis: 1
name: coupled
modules: {m: {neurons: {E: {}, C: {}, L: {}, M: {}}, connections: {E -> C + L + M: 1, L -> C: -1}}}
instances: {left: {module: m, count: 5}, right: {module: m, count: 5}}
neurons: {D_left: {bias: 1}, D_right: {bias: 1}}
connections:
  - {D_left -> left.E: 1, D_right -> right.E: 1}
  - {left.C -> right.E: {pattern: one_to_one}, left.C -> right.C: {pattern: one_to_one}}
  - {right.C -> left.E: {pattern: one_to_one}, right.C -> left.C: {pattern: one_to_one}}
layout: {mirror: [[left, right], [D_left, D_right]]}
"""
PAIRS = (
    MODULE
    + "instances: {x: {module: m, count: 20}, y: {module: m, count: 20}}\nneurons: {O: {}}\nconnections: {y.b -> O: 1"
    + "".join(f", x{i}.b -> y{i}.a: 1" for i in range(1, 21))
    + "}\n"
)


def drawn(text: str) -> tuple[LayoutProblem, Layout]:
    problem = problem_of(nv.compile_text(text).network)
    return problem, lay_out_problem(problem, "layered")


def proportions(layout: Layout) -> float:
    xs, ys = [x for x, _ in layout.positions.values()], [y for _, y in layout.positions.values()]
    return (max(xs) - min(xs) + 1) / (max(ys) - min(ys) + 1)


def rows_of(layout: Layout, neurons: list[str]) -> list[list[str]]:
    """Neurons by rows, from the top, each row from left to right."""
    rows: dict[float, list[str]] = {}
    for name in sorted(neurons, key=lambda name: layout.positions[name]):
        rows.setdefault(layout.positions[name][1], []).append(name)
    return [rows[y] for y in sorted(rows)]


@pytest.mark.parametrize("text", [STAR, BETWEEN, MIRRORED, PAIRS], ids=["star", "between", "mirrored", "pairs"])
def test_what_needs_no_crossing_has_none_and_is_near_to_a_picture(text: str) -> None:
    problem, layout = drawn(text)
    found = metrics(layout, problem)
    assert (found["crossings"], found["edges_over_neurons"], found["overlaps"]) == (0, 0, 0)
    assert found["flow"] == 1
    assert 1 / 3 <= proportions(layout) <= 3


@pytest.mark.parametrize("count", [8, 12, 16, 24, 90])
def test_frames_come_in_so_many_rows_that_they_fill_a_page(count: int) -> None:
    for text in (STAR, f"{STAR}layout: {{direction: right}}\n"):
        _, layout = drawn(text.replace("40", str(count)))
        assert 1 / 2 <= proportions(layout) <= 2


def test_rows_are_read_like_a_page() -> None:
    _, layout = drawn(STAR)
    rows = rows_of(layout, [f"x{i}.a" for i in range(1, 41)])
    assert len(rows) > 1
    assert [name for row in rows for name in row] == [f"x{i}.a" for i in range(1, 41)]


def test_columns_stand_upright() -> None:
    _, layout = drawn(STAR)
    rows = rows_of(layout, [f"x{i}.a" for i in range(1, 41)])
    assert {len(row) for row in rows} == {len(rows[0])}
    for column in zip(*rows, strict=True):
        across = [layout.positions[name][0] for name in column]
        assert max(across) - min(across) < 0.2


def test_instances_in_rows_are_alike_and_mirror_images_exact() -> None:
    _, layout = drawn(MIRRORED)
    axis = 2 * layout.positions["O"][0]
    for i in range(1, 11):
        for name in "ab":
            x, y = layout.positions[f"left{i}.{name}"]
            assert layout.positions[f"right{i}.{name}"] == (axis - x, y)
        (ax, ay), (bx, by) = layout.positions[f"left{i}.a"], layout.positions[f"left{i}.b"]
        (cx, cy), (dx, dy) = layout.positions["left1.a"], layout.positions["left1.b"]
        assert (bx - ax, by - ay) == (dx - cx, dy - cy)
    for i in range(1, 11):
        there, image = layout.routes[f"left{i}.b -> O"], layout.routes[f"right{i}.b -> O"]
        assert tuple((axis - x, y) for x, y in there) == image


def test_what_drives_one_another_stays_together() -> None:
    _, layout = drawn(PAIRS)
    for i in range(1, 21):
        (ax, ay), (bx, by) = layout.positions[f"x{i}.b"], layout.positions[f"y{i}.a"]
        assert abs(ax - bx) < 0.2
        assert 0 < by - ay < 5


@pytest.mark.parametrize("direction", ["up", "left", "right"])
def test_ranks_are_folded_in_every_direction(direction: str) -> None:
    problem, layout = drawn(f"{STAR}layout: {{direction: {direction}}}\n")
    assert metrics(layout, problem)["crossings"] == 0
    assert 1 / 3 <= proportions(layout) <= 3


def test_what_runs_within_a_row_is_drawn_anew_beside_what_is_planned() -> None:
    problem, layout = drawn(COUPLED)
    assert metrics(layout, problem)["crossings"] <= 50


def test_few_instances_stay_in_one_row() -> None:
    _, layout = drawn(STAR.replace("40", "7"))
    assert len(rows_of(layout, [f"x{i}.a" for i in range(1, 8)])) == 1


def test_a_line_holds_a_family_in_its_row() -> None:
    _, layout = drawn(f"{STAR}layout: {{align: [[x1.a, x40.a]]}}\n")
    assert layout.positions["x1.a"][1] == layout.positions["x40.a"][1]
    assert len(rows_of(layout, [f"x{i}.a" for i in range(1, 41)])) == 1


def test_pins_hold_in_rows() -> None:
    _, layout = drawn(f"{STAR}layout: {{positions: {{x7.a: [3, 11], x30: [-9, 4]}}}}\n")
    assert layout.positions["x7.a"] == (3, 11)
    assert min(layout.positions[f"x30.{n}"][0] for n in "ab") == -9
    assert min(layout.positions[f"x30.{n}"][1] for n in "ab") == 4


def test_another_instance_leaves_the_others_where_they_are() -> None:
    _, before = drawn(STAR)
    problem = problem_of(nv.compile_text(STAR.replace("40", "41")).network)
    after = lay_out_problem(replace(problem, memory=before), "layered")
    moved = [name for name in before.positions if name != "O" and after.positions[name] != before.positions[name]]
    assert moved == []
    (ox, oy), (nx, ny) = before.positions["O"], after.positions["O"]
    assert abs(ox - nx) + abs(oy - ny) <= 0.3


def test_the_order_of_connections_does_not_show() -> None:
    names = [f"x{i}.b -> O: 1" for i in range(1, 41)]
    one, other = (drawn(STAR.replace("x.b -> O: 1", ", ".join(order)))[1] for order in (names, [*names[::-1]]))
    assert (one.positions, one.routes) == (other.positions, other.routes)


def test_a_row_that_is_less_deep_than_the_others_leaves_no_empty_rank() -> None:
    # seven strands, one of them two frames deep, the last row of single frames
    paths = [f"{side}{k}" for side in ("left", "right") for k in range(1, 5)]
    problem = LayoutProblem(
        "shallow",
        tuple(f"{path}.S{n}" for path in paths for n in (1, 2, 3)),
        (),
        (LayoutEdge("right1.S1 -> left1.S1", 12, 0, 0),),
        modules=tuple(
            LayoutModule(path, "leg", -1, tuple(range(3 * k, 3 * k + 3)), "leg", {}, None)
            for k, path in enumerate(paths)
        ),
    )
    layout = lay_out_problem(problem, "layered")
    assert metrics(layout, problem)["overlaps"] == 0
    assert not suite.frames_meet(layout, problem)
