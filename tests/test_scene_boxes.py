"""The frames of boxes say who belongs to them: none is drawn where it would lie on another's."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.layout.geometry import meet
from neurovis_spec.scene.boxes import Box, boxes_of

RING = """
neurovis: 1
name: ring
neurons: {A: {count: 6, box: one}, B: {count: 6, box: two}, C: {count: 6, box: three}}
layout: {engine: ENGINE}
"""
LINES = """
neurovis: 1
name: lines
modules: {leg: {neurons: {K: {count: 2}}, layout: {positions: {K1: [0, 0], K2: [4, 4]}}}}
instances: {leg: {module: leg}}
neurons: {A: {count: 2}, B: {count: 2}, C: {count: 2}, D: {count: 2}, E: {count: 2}}
layout:
  engine: manual
  boxes: {alone: [A], wide: [B], high: [C], both: [A, D], crossing: [E]}
  positions:
    leg: [0, 0]
    A1: [20, 0]
    A2: [21, 0]
    D1: [20, 2]
    D2: [21, 2]
    B1: [10, 2]
    B2: [14, 2]
    C1: [12, 0]
    C2: [12, 4]
    E1: [-2, 2]
    E2: [6, 2]
"""


def drawn(text: str) -> list[Box]:
    network = nv.compile_text(text)
    layout = network.layout()
    positions = np.array([layout.positions[name] for name in network.network.neurons.names])
    routes = [np.array(layout.value.routes[name]) for name in network.network.connection_names]
    return boxes_of(network.network, positions, routes)


def test_a_box_that_would_lie_on_what_is_not_its_own_has_no_frame() -> None:
    """Neither of two boxes that cross; not the one that crosses an instance; what holds a box is drawn around it."""
    assert {box.path for box in drawn(LINES)} == {"leg", "alone", "both"}


@pytest.mark.parametrize("engine", ["circular", "grid", "layered", "organic", "large"])
@pytest.mark.parametrize("counts", [(6, 6, 6), (4, 5, 3), (9, 2, 2), (2, 12, 12)])
def test_no_two_frames_of_boxes_lie_on_each_other(engine: str, counts: tuple[int, int, int]) -> None:
    text = RING.replace("ENGINE", engine)
    for name, count in zip("ABC", counts, strict=True):
        text = text.replace(f"{name}: {{count: 6", f"{name}: {{count: {count}")
    boxes = drawn(text)
    assert not any(meet(one.rect, other.rect) for one, other in combinations(boxes, 2))
    if engine not in ("circular", "grid"):
        assert len(boxes) == len(counts)
