"""Modules within modules, whatever each of them holds: one instance and nothing else, several, neurons beside them."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.problem import problem_of

HEAD = "neurovis: 1\nname: nested\ntime: {steps: 2}\n"


def nested(levels: tuple[tuple[int, bool], ...], engine: str = "layered") -> nv.CompiledNetwork:
    """A network of modules within modules, the innermost with two neurons; of each level above how many instances
    it holds, and whether there is a neuron beside them."""
    text = HEAD + "modules:\n  m0: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}}\n"
    for number, (count, beside) in enumerate(levels):
        neurons = "neurons: {H: {bias: 1}}, " if beside else ""
        text += f"  m{number + 1}: {{{neurons}instances: {{x: {{module: m{number}, count: {count}}}}}}}\n"
    return nv.compile_text(text + f"instances: {{top: {{module: m{len(levels)}}}}}\nlayout: {{engine: {engine}}}\n")


SHAPES = list(product(product((1, 2), (False, True)), repeat=3))


@pytest.mark.parametrize("levels", SHAPES[::2], ids=str)
def test_each_hierarchy_is_drawn_frame_in_frame(levels: tuple[tuple[int, bool], ...]) -> None:
    network = nested(levels)
    layout = network.layout()
    problem = problem_of(network.network)
    places = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
    rects = Frames(problem).rects(places, routes)
    for number, module in enumerate(problem.modules):
        inner, outer = rects[number], rects[module.parent] if module.parent >= 0 else None
        assert inner is not None
        if outer is not None:
            assert outer[0] < inner[0] < inner[2] < outer[2]
            assert outer[1] < inner[1] < inner[3] < outer[3]
    assert not layout.warnings


@pytest.mark.parametrize("engine", ["circular", "grid"])
def test_instances_alone_in_one_another_are_laid_out_however_deep(engine: str) -> None:
    assert len(nested(((1, False),) * 40, engine).layout().positions) == 2


def test_instances_alone_in_one_another_are_drawn_however_deep(tmp_path: Path) -> None:
    network = nested(((1, False),) * 40)
    assert len(network.layout().positions) == 2
    network.render(tmp_path / "x.svg")
    network.animate(tmp_path / "x_moving.svg", steps=2)
    assert (tmp_path / "x.svg").stat().st_size > 0
    assert (tmp_path / "x_moving.svg").stat().st_size > 0


def test_a_wrapped_pair_keeps_its_mirror_and_its_pins() -> None:
    text = (
        HEAD
        + "modules:\n  leg: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}, layout: {positions: "
        + "{S: [0, 0], K: [2, 1]}}}\n  wrap: {instances: {l: {module: leg}}}\n"
        + "instances: {left: {module: wrap}, right: {module: wrap}}\n"
        + "layout: {mirror: [[left, right]]}\n"
    )
    at = nv.compile_text(text).layout().positions
    assert at["left.l.K"][0] - at["left.l.S"][0] == at["right.l.S"][0] - at["right.l.K"][0] == 2
    assert at["left.l.K"][1] == at["right.l.K"][1] == at["left.l.S"][1] + 1
