"""The frames of boxes say who belongs to them: none is drawn where it would lie on another's."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.layout.geometry import meet, sampled
from neurovis_spec.layout.model import RADIUS, Point
from neurovis_spec.scene import Disc, Polygon, Spline, Text
from neurovis_spec.scene.boxes import Box, Sector, boxes_of, sector
from neurovis_spec.text_width import width

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


@pytest.mark.parametrize("engine", ["circular", "grid", "layered", "organic"])
@pytest.mark.parametrize("counts", [(6, 6, 6), (4, 5, 3), (9, 2, 2), (2, 12, 12)])
def test_no_two_frames_of_boxes_lie_on_each_other(engine: str, counts: tuple[int, int, int]) -> None:
    text = RING.replace("ENGINE", engine)
    for name, count in zip("ABC", counts, strict=True):
        text = text.replace(f"{name}: {{count: 6", f"{name}: {{count: {count}")
    boxes = drawn(text)
    assert len({box.sector is None for box in boxes}) <= 1
    for one, other in combinations(boxes, 2):
        if one.sector is None or other.sector is None:
            assert not meet(one.rect, other.rect)
        else:
            assert angles(one.sector).isdisjoint(angles(other.sector))
    if engine != "grid":
        assert len(boxes) == len(counts)


def angles(sector: Sector) -> set[int]:
    """The tenths of degrees that a sector covers."""
    first, last = (math.degrees(angle) * 10 for angle in (sector.first, sector.last))
    return {number % 3600 for number in range(math.ceil(first), math.floor(last) + 1)}


@pytest.mark.parametrize("direction", ["down", "left"])
def test_boxes_on_a_ring_are_sectors_that_hold_their_neurons_alone(direction: str) -> None:
    text = RING.replace("engine: ENGINE", f"engine: circular, direction: {direction}")
    network = nv.compile_text(text)
    positions = network.layout().positions
    boxes = drawn(text)
    assert {box.path for box in boxes} == {"one", "two", "three"}
    for box in boxes:
        assert box.sector is not None
        (x, y), covered = box.sector.centre, angles(box.sector)
        for number, name in enumerate(network.network.neurons.names):
            at = math.degrees(math.atan2(positions[name][1] - y, positions[name][0] - x)) * 10
            assert (round(at) % 3600 in covered) == (number in box.members)
        border = box.sector.border(0.1)
        rect = box.rect
        assert (border >= np.array(rect[:2]) - 1e-9).all()
        assert (border <= np.array(rect[2:]) + 1e-9).all()
        nearest = min(np.hypot(*(border - positions[name]).T).min() for name in network.network.neurons.names)
        assert nearest > RADIUS


def test_neurons_that_do_not_follow_each_other_on_a_ring_have_no_sector() -> None:
    turns = [math.tau * i / 8 for i in range(8)]
    ring = np.array([(5 * math.cos(turn), 5 * math.sin(turn)) for turn in turns])
    everybody = np.arange(8)
    assert sector(ring, everybody, np.array([7, 0, 1])) is not None
    assert sector(ring, everybody, np.array([0, 2])) is None
    assert sector(ring, everybody, everybody) is None
    assert sector(ring * (1.0, 1.1), everybody, np.array([0, 1])) is None


def test_sectors_are_filled_lines_around_their_neurons() -> None:
    network = nv.compile_text(RING.replace("ENGINE", "circular"))
    scene = scene_of(network, network.run(1).snapshot(0))
    groups = {group.id: group for group in scene.groups}
    fills = set()
    for name in ("one", "two", "three"):
        *filled, shape = groups[f"box:{name}"].shapes
        fills |= {piece.fill for piece in filled if isinstance(piece, Polygon)}
        assert isinstance(shape, Spline)
        assert shape.points[0] == shape.points[-1]
        (title,) = groups[f"title:{name}"].shapes
        assert isinstance(title, Text)
        (x, y), size = title.point, title.size
        where = np.array(sampled(shape.points, 1.0)) - (x, y)
        assert np.hypot(*where.T).min() < 8 * size
    assert len(fills) == 3


def test_boxes_on_a_ring_are_sectors_where_rectangles_would_have_room_too() -> None:
    """Of a quarter each, beside neurons in no box: rectangles around these arcs would meet nothing."""
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 4, box: a}, B: {count: 4, box: b}, D: {count: 12}}\n"
    boxes = drawn(text + "connections: {A -> B: {weight: 1, pattern: one_to_one}}\nlayout: {engine: circular}\n")
    assert [box.sector is None for box in boxes] == [False, False]


@pytest.mark.parametrize("names", ["N", "a_name_that_no_disc_holds"])
def test_names_and_titles_of_a_ring_stand_outside_of_it(names: str) -> None:
    count = 70 if names == "N" else 12
    group = f"{{count: {count}, box: all}}"
    if names != "N":
        listed = ", ".join(f"{names}_{chr(97 + i)}" for i in range(count))
        group = f"{{names: [{listed}], box: all}}"
    within, across = "{random: {probability: 0.05}}", "all_to_all"
    wired = f"connections: {{N -> N: {{weight: 1, pattern: {within}}}, N -> M: {{weight: 1, pattern: {across}}}}}"
    text = f"neurovis: 1\nname: x\nneurons: {{N: {group}, M: {{count: 5}}}}\n{wired}\nlayout: {{engine: circular}}\n"
    network = nv.compile_text(text)
    scene = scene_of(network, network.run(1).snapshot(0))
    groups = {group.data.get("neuron") or group.id: group.shapes for group in scene.groups}
    neurons = network.network.neurons.names
    discs = {name: shape for name in neurons for shape in groups[name] if isinstance(shape, Disc)}
    at = np.array([disc.centre for disc in discs.values()])
    middle = (at.min(axis=0) + at.max(axis=0)) / 2
    told = 0
    for name, disc in discs.items():
        for text_ in (shape for shape in groups[name] if isinstance(shape, Text) and not shape.on_disc):
            told += 1
            away = np.hypot(*(np.array(_middle(text_)) - middle))
            assert away > np.hypot(*(np.array(disc.centre) - middle))
    assert told >= count
    (title,) = groups["title:all"]
    assert isinstance(title, Text)
    assert np.hypot(*(np.array(_middle(title)) - middle)) > np.hypot(*(at - middle).T).min()


def test_a_title_is_wrapped_where_it_has_no_room_in_one_line_and_never_cut() -> None:
    names = [
        "descending interneurons of the left hemisphere and thorax",
        "photoreceptors_of_the_compound_eye_layer_four",
        "medulla intrinsic neurons of columns one to sixteen",
        "Purkinje cells",
    ]
    boxes = "".join(f"  g{k}: {{count: 4, box: {name}}}\n" for k, name in enumerate(names))
    lines = "".join(f"  g{k} -> g{(k + 1) % 4}: {{pattern: all_to_all}}\n" for k in range(4))
    drawn = "layout: {engine: organic}\nrender: {size: [400, 400]}\n"
    network = nv.compile_text(f"neurovis: 1\nname: x\nneurons:\n{boxes}connections:\n{lines}{drawn}")
    titles = {
        group.id.removeprefix("title:"): [shape.text for shape in group.shapes if isinstance(shape, Text)]
        for group in scene_of(network, network.run(2).snapshot(1)).groups
        if group.id.startswith("title:")
    }
    assert max(map(len, titles.values())) > 1
    for name, said in titles.items():
        assert "".join(said).replace(" ", "") == name.replace(" ", "")


def _middle(text: Text) -> Point:
    """The middle of what a text covers."""
    wide = width(text.text, text.size, text.weight, text.subscript)
    along = {"start": 0.5, "middle": 0.0, "end": -0.5}[text.anchor]
    return text.point[0] + along * wide, text.point[1] - 0.3 * text.size
