"""Boxes in engines that place neurons anywhere: each by itself, whatever the network (layouts/boxed)."""

from dataclasses import replace
from itertools import combinations
from random import Random

import pytest
from layout_conformance import named

from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, distance, meet
from neurovis_spec.layout.model import LayoutProblem
from neurovis_spec.layout.problem import NamedProblem


def classes(count: int, edges: int, boxes: int, seed: int, inside: float) -> LayoutProblem:
    """Neurons of some classes, few of which have most connections, half or more of these within a class; one neuron in
    ten is in no box."""
    random = Random(seed)
    names = [f"N{i}" for i in range(count)]
    pairs: set[tuple[int, int]] = set()
    while len(pairs) < edges:
        a, b = (int(count * random.random() ** 2) for _ in "ab")
        if random.random() < inside:
            b += (a - b) % boxes
        if a != b and b < count:
            pairs.add((a, b))
    named = [(f"N{a} -> N{b}", f"N{a}", f"N{b}", 1) for a, b in sorted(pairs)]
    boxed = [(f"class{k}", [f"N{i}" for i in range(k, count, boxes) if i % 10]) for k in range(boxes)]
    return NamedProblem("classes", names, [("N", names)], named, boxes=boxed).canonical()


@pytest.mark.parametrize(
    ("count", "edges", "boxes", "inside"),
    [(60, 300, 3, 0.8), (150, 1500, 5, 0.5), (120, 900, 12, 0.3), (90, 200, 4, 0)],
)
def test_frames_of_boxes_hold_nothing_foreign(count: int, edges: int, boxes: int, inside: float) -> None:
    problem = classes(count, edges, boxes, count, inside)
    layout = lay_out_problem(problem, "organic")
    places = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    rects = Frames(problem).rects(places, {})
    for one, other in combinations(rects, 2):
        assert one is not None
        assert other is not None
        assert not meet(one, other)
    for (_, members), rect in zip(problem.boxes, rects, strict=True):
        assert rect is not None
        inside_it = {i for i, (x, y) in places.items() if rect[0] < x < rect[2] and rect[1] < y < rect[3]}
        assert inside_it == set(members)
    assert min(distance(a, b) for a, b in combinations(places.values(), 2)) >= 0.6


def assert_apart(problem: LayoutProblem) -> list[Rect]:
    """Frames hold their neurons alone, but for pinned ones; the frames."""
    layout = lay_out_problem(problem, "organic")
    places = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    rects = [rect for rect in Frames(problem).rects(places, {}) if rect is not None]
    for (name, members), rect in zip(problem.boxes, rects, strict=True):
        inside = {i for i, (x, y) in places.items() if rect[0] < x < rect[2] and rect[1] < y < rect[3]}
        assert inside - set(problem.pins) == set(members) - set(problem.pins), name
    assert all(layout.positions[problem.neurons[i]] == point for i, point in problem.pins.items())
    assert min(distance(a, b) for a, b in combinations(places.values(), 2)) >= 0.6
    return rects


def test_boxes_within_boxes_hold_nothing_foreign() -> None:
    problem = classes(60, 250, 1, 3, 0.5)
    boxes = (("outer", range(0, 40, 2)), ("first", range(0, 10, 2)), ("second", range(16, 32, 4)), ("other", (1, 41)))
    assert_apart(replace(problem, boxes=tuple((name, tuple(members)) for name, members in boxes)))


def test_a_box_is_as_large_as_its_neurons_need_wherever_else_they_would_be() -> None:
    chain = NamedProblem(
        "chain", [f"N{i}" for i in range(60)], edges=named((f"N{i}", f"N{i + 1}") for i in range(59))
    ).canonical()
    for members in ((0, 59), (0, 30, 59), tuple(range(0, 60, 12))):
        (x0, y0, x1, y1), *_ = assert_apart(replace(chain, boxes=(("far", members),)))
        assert (x1 - x0) * (y1 - y0) < 12 * len(members)


def test_boxes_are_kept_together_around_pins() -> None:
    problem = classes(36, 150, 3, 60, 0.5)
    first, second = problem.boxes[0][1], problem.boxes[1][1]
    pins = {first[0]: (0.0, 0.0), first[1]: (2.0, 1.0), second[0]: (40.0, 3.0)}
    for (_, members), (x0, y0, x1, y1) in zip(problem.boxes, assert_apart(replace(problem, pins=pins)), strict=True):
        assert (x1 - x0) * (y1 - y0) < 12 * len(members)
