"""Self-loops: several of one neuron are several lines; they keep off discs and frames."""

from __future__ import annotations

from itertools import combinations

import layout_conformance as suite
import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.layout import Layout, LayoutProblem
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.problem import NamedProblem, problem_of

NEIGHBOURS: tuple[tuple[tuple[str, str], ...], ...] = (
    (),
    (("A", "B"), ("B", "A")),
    (("A", "B"), ("C", "A"), ("D", "A"), ("A", "E")),
)


def least_between_loops(layout: Layout, problem: LayoutProblem) -> float:
    """How close two loops of one neuron come to each other, outside its disc."""
    loops = [layout.routes[edge.name] for edge in problem.edges if edge.source == edge.target]
    lines = [np.array([p for p in sampled(route, 0.03) if distance(p, route[0]) > 0.4]) for route in loops]
    return min(
        float(np.sqrt(((one[:, None] - other[None]) ** 2).sum(axis=2)).min())
        for (one, a), (other, b) in combinations(zip(lines, loops, strict=True), 2)
        if a[0] == b[0]
    )


@pytest.mark.parametrize("engine", ["layered", "organic", "circular", "grid"])
@pytest.mark.parametrize("others", NEIGHBOURS)
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_loops_of_one_neuron_are_apart(engine: str, others: tuple[tuple[str, str], ...], count: int) -> None:
    problem = NamedProblem("loops", [*"ABCDE"], edges=suite.named([*[("A", "A")] * count, *others])).canonical()
    assert least_between_loops(lay_out_problem(problem, engine), problem) >= 0.12


def test_loops_of_a_mirrored_pair_are_mirrored_however_many_they_are() -> None:
    text = """neurovis: 1
name: pair
neurons: {L: {}, R: {}, M: {bias: 1}}
connections:
  - {L -> L: 1, R -> R: 1, M -> L: 1, M -> R: 1}
  - {L -> L: {weight: 1, delay: 3}, R -> R: {weight: 1, delay: 3}}
layout: {engine: layered, mirror: [[L, R]]}
"""
    layout = nv.compile_text(text).layout()
    twice = layout.positions["L"][0] + layout.positions["R"][0]
    for number in ("", " (2)"):
        mirrored = tuple((twice - x, y) for x, y in layout.routes[f"L -> L{number}"])
        assert layout.routes[f"R -> R{number}"] == mirrored


def test_under_memory_a_loop_gives_way_to_the_frame_of_a_new_instance() -> None:
    """A frame reaches as far as what runs in it, which is known last."""

    def spec(count: int, more: str) -> str:
        ways = "C1 -> C1: 1, D1 -> right1.m1: 1, D2 -> right1.m0: 1, D3 -> D2: 1, left1.m0 -> D1: 1, right1.m0 -> D2: 1"
        across = "left1.m3 -> right1.m0: 1, left1.m3 -> right1.m1: 1, left1.m3 -> right1.m2: 1"
        return f"""neurovis: 1
name: more
modules:
  leg:
    neurons: {{m0: {{}}, m1: {{}}, m2: {{}}, m3: {{}}}}
    connections: {{m0 -> m1: 1, m0 -> m2: 1, m0 -> m3: 1, m1 -> m2: 1}}
instances: {{left: {{module: leg, count: {count}}}, right: {{module: leg, count: {count}}}}}
neurons: {{C: {{count: 2}}, D: {{count: 3}}}}
connections: {{{ways}, {across}, right1.m1 -> D1: 1, right1.m2 -> D3: 1{more}}}
layout: {{engine: layered, mirror: [[left, right], [C1, C2]], direction: right}}
"""

    earlier = nv.compile_text(spec(1, "")).layout()
    network = nv.compile_text(spec(2, ", C1 -> left2.m0: 1, C2 -> right2.m0: 1"))
    later = network.layout(earlier=earlier.value)
    assert suite.through_frames(later.value, problem_of(network.network)) == []
    assert later.positions["C1"] == earlier.positions["C1"]


def test_a_new_loop_keeps_off_the_old_one() -> None:
    text = "neurovis: 1\nname: more\nneurons: {A: {bias: 1}, B: {}}\nconnections:\n  - {A -> A: 0.5, A -> B: 1}\n"
    earlier = nv.compile_text(text).layout(engine="layered")
    network = nv.compile_text(text + "  - {A -> A: {weight: 1, delay: 4}, B -> A: 1}\n")
    later = network.layout(engine="layered", earlier=earlier.value)
    assert later.routes["A -> A"] == earlier.routes["A -> A"]
    assert least_between_loops(later.value, problem_of(network.network)) >= 0.12


COUPLED = """
neurovis: 1
name: coupled
modules:
  osc:
    neurons: {A: {bias: 0.1}, B: {}}
    connections: {A -> A: 1.5, B -> B: 1.5, A -> B: 0.4, B -> A: -0.4}
instances: {o: {module: osc, count: 3}}
connections: {COUPLINGS}
layout: {engine: layered, direction: DIRECTION}
"""
CHAIN = "o1.A -> o2.A: 0.1, o2.A -> o1.A: 0.1, o2.A -> o3.A: 0.1, o3.A -> o2.A: 0.1"
CROSSWISE = "o1.B -> o2.A: 0.1, o2.A -> o1.B: 0.1, o2.B -> o3.A: 0.1, o3.A -> o2.B: 0.1"


@pytest.mark.parametrize("direction", ["down", "right"])
@pytest.mark.parametrize("couplings", [CHAIN, CROSSWISE])
def test_couplings_between_instances_do_not_run_through_loops(couplings: str, direction: str) -> None:
    layout = nv.compile_text(COUPLED.replace("COUPLINGS", couplings).replace("DIRECTION", direction)).layout()
    loops = [route for route in layout.routes.values() if route[0] == route[-1]]
    others = [route for route in layout.routes.values() if route[0] != route[-1]]
    assert len(loops) == 6
    for loop in loops:
        seen = [p for p in sampled(loop, 0.03) if distance(p, loop[0]) > 0.3]
        assert all(min(distance(p, q) for q in sampled(route, 0.03)) > 0.03 for route in others for p in seen)
