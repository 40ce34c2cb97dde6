"""Pins anywhere: in and of instances, carried over by mirrors; the rest gives way, and frames lie on no other."""

from __future__ import annotations

import layout_conformance as suite
import pytest

import neurovis_spec as nv
from neurovis_spec.layout import LayoutRefusalError
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import problem_of

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
        legs("{mirror: [[left, right]], positions: {left1.T: [0, 0], right2.S1: [-1, -2]}}").layout("layered")
    assert caught.value.code == "pin-in-frame"
    assert {name.partition(".")[0] for name in caught.value.about} == {"left1", "right2"}
