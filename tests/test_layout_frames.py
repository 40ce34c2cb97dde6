"""Frames: one rule says how far their lines are from what they hold, for engines, memory and pictures alike."""

from __future__ import annotations

from dataclasses import replace

import layout_conformance as suite
import numpy as np
import pytest
from neurovis_layouts.frame import to_picture
from neurovis_layouts.layered.hierarchy import Composer

import neurovis_spec as nv
import neurovis_spec.scene.boxes
from neurovis_spec.layout import Direction, frames
from neurovis_spec.layout.geometry import bounds
from neurovis_spec.layout.problem import problem_of

LEGS = """
neurovis: 1
name: legs
modules:
  knee: {neurons: {E: {}, F: {}}, connections: {E -> F: 1, F -> E: 1}}
  leg:
    neurons: {S: {count: 3, bias: 1}, T: {}}
    instances: {knee: {module: knee}}
    connections: {S -> T: 1, T -> T: 1, T -> knee.E: 1, knee.F -> S1: 1}
instances: {left: {module: leg, count: 2}}
neurons: {C: {count: 2}, D: {}}
connections: {left1.T -> C: 1, C -> D: 1, D -> left2.S: 1}
layout: {boxes: {pair: [C]}}
"""


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_frames_are_drawn_where_engines_and_memory_keep_room_for_them(direction: Direction) -> None:
    network = nv.compile_text(LEGS.replace("{boxes", f"{{direction: {direction}, boxes"))
    problem = problem_of(network.network)
    layout = network.layout("layered").value
    placed = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
    remembered = frames.Frames(problem).rects(placed, routes)
    positions = np.array([layout.positions[name] for name in network.network.neurons.names])
    splines = [np.array(layout.routes[name]) for name in network.network.connection_names]
    drawn = {box.path: box.rect for box in neurovis_spec.scene.boxes.boxes_of(network.network, positions, splines)}
    free = Composer(problem).whole()
    first = to_picture(free.places[0], direction)
    shift = placed[0][0] - first[0], placed[0][1] - first[1]
    planned = {frozenset(own): rect for own, rect in (*free.frames, *free.boxes)}
    for number, path in enumerate([*(module.path for module in problem.modules), *(name for name, _ in problem.boxes)]):
        rect = remembered[number]
        assert rect is not None
        assert drawn[path] == pytest.approx(rect, abs=0.02), path  # routes are sampled, more or less finely
        x0, y0, x1, y1 = planned[frames.Frames(problem).members[number]]
        kept = bounds([to_picture(corner, direction) for corner in ((x0, y0), (x1, y1))])
        room = [side + shift[k % 2] for k, side in enumerate(kept)]
        if direction == "down":
            assert room == pytest.approx(rect, abs=0.03), path
        assert room[0] <= rect[0] + 0.03, path
        assert room[1] <= rect[1] + 0.03, path
        assert room[2] >= rect[2] - 0.03, path
        assert room[3] >= rect[3] - 0.03, path


def test_a_box_that_is_not_drawn_sends_no_connection_through_a_frame() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {G: {count: 3, bias: 1}}\n"
        "modules: {m: {neurons: {A: {}, B: {}, C: {}}, connections: {A -> B: 1, A -> C: 1}}}\n"
        "instances: {left: {module: m, count: 2}, right: {module: m, count: 2}}\n"
        "connections: {right2.A -> right1.C: 1, left1.C -> left2.C: 1, G3 -> right2.A: 1, right1.B -> right2.B: 1, "
        "right2.A -> left1.B: 1, right2.A -> left1.A: 1, G3 -> G2: 1, right1.B -> left2.B: 1}\n"
        "layout: {mirror: [[left, right]], boxes: {b: [left2, G, right1]}}\n"
    )
    layout = network.layout("layered").value
    instances = replace(network.problem, boxes=())
    assert suite.through_frames(layout, instances) == []
