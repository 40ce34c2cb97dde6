"""Mirrors: what runs across the axis is ordered as well, chains of instances face each other, and what has no image
stands on the axis."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import LayoutProblem
from neurovis_spec.layout.problem import problem_of


def crossings(problem: LayoutProblem) -> int:
    """Of the routes as ``layered`` draws them."""
    return int(metrics(lay_out_problem(problem, "layered"), problem)["crossings"])


#: Each segment's E drives C, L and M; C inhibits the other side. Nothing says which segments' neurons belong together.
SEGMENTS = range(4)
SPINAL = "\n".join(
    [
        "neurovis: 1",
        "name: spinal",
        "neurons: {D_L: {bias: 1}, D_R: {bias: 1}, "
        + ", ".join(f"{name}_{side}{i}: {{}}" for side in "LR" for i in SEGMENTS for name in "ECLM")
        + "}",
        "connections:",
        *(
            f"  {line}: 1"
            for side, other in ("LR", "RL")
            for i in SEGMENTS
            for line in (
                f"D_{side} -> E_{side}{i}",
                f"E_{side}{i} -> C_{side}{i} + L_{side}{i} + M_{side}{i}",
                f"L_{side}{i} -> C_{side}{i}",
                f"C_{side}{i} -> E_{other}{i} + C_{other}{i}",
                *([f"E_{side}{i} -> E_{side}{i + 1}"] if i + 1 in SEGMENTS else []),
            )
        ),
        "layout: {mirror: [[D_L, D_R], "
        + ", ".join(f"[{name}_L{i}, {name}_R{i}]" for i in SEGMENTS for name in "ECLM")
        + "]}",
    ]
)


def test_what_crosses_the_axis_stands_beside_it() -> None:
    problem = problem_of(nv.compile_text(SPINAL).network)
    layout = lay_out_problem(problem, "layered")
    found = metrics(layout, problem)
    assert found["symmetry"] == 1
    # without the mirror there are about twelve; a line from side to side crosses its own image, at least
    assert found["crossings"] <= 8
    axis = layout.positions["D_L"][0] + layout.positions["D_R"][0]
    for i in SEGMENTS:
        (x, y), others = layout.positions[f"C_L{i}"], layout.positions.values()
        assert not any(x < a < axis - x and b == y for a, b in others)


@pytest.mark.parametrize("name", ["b", "d"])
def test_names_say_nothing_of_who_stands_beside_the_axis(name: str) -> None:
    text = f"""
neurovis: 1
name: names
neurons: {{D: {{bias: 1}}, a_L: {{}}, {name}_L: {{}}, c_L: {{}}, a_R: {{}}, {name}_R: {{}}, c_R: {{}}}}
connections:
  D -> a_L + a_R: 1
  a_L -> {name}_L + c_L: 1
  a_R -> {name}_R + c_R: 1
  c_L -> a_R: -1
  c_R -> a_L: -1
layout: {{mirror: [[a_L, a_R], [{name}_L, {name}_R], [c_L, c_R]]}}
"""
    assert crossings(problem_of(nv.compile_text(text).network)) == 1


def test_mirror_images_move_to_the_ranks_in_which_they_cross_least() -> None:
    text = """
neurovis: 1
name: half_centre
neurons: {D: {bias: 1}, H_L: {}, H_R: {}, I_L: {}, I_R: {}, M_L: {}, M_R: {}, S_L: {bias: 1}, S_R: {bias: 1}}
connections:
  D -> H_L + H_R: 1
  H_L -> I_L + M_L: 1
  H_R -> I_R + M_R: 1
  I_L -> H_R: -1
  I_R -> H_L: -1
  S_L -> M_L + M_R: 1
  S_R -> M_L + M_R: 1
layout: {mirror: [[H_L, H_R], [I_L, I_R], [M_L, M_R], [S_L, S_R]]}
"""
    assert crossings(problem_of(nv.compile_text(text).network)) <= 6


SWIMMER = """
neurovis: 1
name: swimmer
modules:
  hemi:
    neurons: {E: {}, C: {}, L: {}, M: {}}
    connections: {E -> C + L + M: 1, L -> C: -1}
instances: {left: {module: hemi, count: 5}, right: {module: hemi, count: 5}}
neurons: {D_left: {bias: 1}, D_right: {bias: 1}}
connections:
  D_left -> left.E: 1
  D_right -> right.E: 1
  left.C -> right.E: {pattern: one_to_one}
  left.C -> right.C: {pattern: one_to_one}
  right.C -> left.E: {pattern: one_to_one}
  right.C -> left.C: {pattern: one_to_one}
  left.E -> left.E: {pattern: chain}
  right.E -> right.E: {pattern: chain}
layout: {mirror: [[left, right], [D_left, D_right]]}
"""


def test_mirrored_chains_of_instances_are_columns_that_face_each_other() -> None:
    compiled = nv.compile_text(SWIMMER)
    layout = compiled.layout("layered")
    at = layout.value.positions
    assert [at[f"left{i}.E"][1] for i in range(1, 6)] == [at[f"right{i}.E"][1] for i in range(1, 6)]
    for name in "ECLM":
        rows = [at[f"left{i}.{name}"] for i in range(1, 6)]
        assert [y for _, y in rows] == sorted({y for _, y in rows})
        assert max(x for x, _ in rows) < min(at[f"right{i}.{name}"][0] for i in range(1, 6))
    assert layout.metrics()["crossings"] <= 10


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_what_has_no_image_stands_on_the_axis_beside_what_spans_it(direction: str) -> None:
    text = """
neurovis: 1
name: axis
neurons:
  Drive: {bias: 1}
  s_L: {bias: 1, box: sensors}
  s_R: {bias: 1, box: sensors}
  m_L: {box: muscles}
  m_R: {box: muscles}
  Load: {}
connections: {s_L -> m_L: 1, s_R -> m_R: 1, Drive -> m_L + m_R: 1, s_L + s_R -> Load: 1}
"""
    more = f"layout: {{direction: {direction}, mirror: [[s_L, s_R], [m_L, m_R]]}}\n"
    at = nv.compile_text(text + more).layout("layered").value.positions
    across, along = (0, 1) if direction in ("down", "up") else (1, 0)
    for name in ("Drive", "Load"):
        assert 2 * at[name][across] == at["s_L"][across] + at["s_R"][across] == at["m_L"][across] + at["m_R"][across]
    order = sorted(("s_L", "Drive", "m_L"), key=lambda name: at[name][along])
    assert order == ["s_L", "Drive", "m_L"][:: 1 if direction in ("down", "right") else -1]


def test_what_stands_about_the_axis_in_a_box_is_nobodys_image() -> None:
    text = """
neurovis: 1
name: about
neurons: {L: {}, R: {}, v0: {}, v1: {}, v2: {}, v3: {}}
connections: {v2 -> v1: 1, R -> v0: 1, R -> v1: 1, L -> v2: 1, R -> v3: 1, v3 -> L: 1}
layout: {mirror: [[L, R]], boxes: {inner: [L, R, v0, v1]}}
"""
    found = nv.compile_text(text).layout("layered").metrics()
    assert (found["symmetry"], found["overlaps"], found["edges_over_neurons"]) == (1, 0, 0)


def test_mirrored_legs_that_drive_each_other_around_a_body_stand_as_they_do_on_it() -> None:
    text = """
neurovis: 1
name: legs
modules: {leg: {neurons: {X: {}, Y: {}, M: {}}, connections: {X -> Y + M: 1, Y -> X: -1}}}
instances: {l: {module: leg, count: 3}, r: {module: leg, count: 3}}
connections: {l1.X -> l2.X: 1, l2.X -> l3.X: 1, l3.X -> r3.X: 1, r3.X -> r2.X: 1, r2.X -> r1.X: 1, r1.X -> l1.X: 1}
layout: {mirror: [[l, r]]}
"""
    layout = nv.compile_text(text).layout("layered")
    at = layout.value.positions
    assert layout.metrics()["crossings"] == 0
    for side in "lr":
        assert [at[f"{side}{k}.X"][1] for k in (1, 2, 3)] == sorted({at[f"{side}{k}.X"][1] for k in (1, 2, 3)})
    assert max(at[f"l{k}.X"][0] for k in (1, 2, 3)) < min(at[f"r{k}.X"][0] for k in (1, 2, 3))
