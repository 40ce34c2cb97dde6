"""Boxes in engines that place neurons anywhere: each by itself, whatever the network (layouts/boxed)."""

from itertools import combinations
from random import Random

import pytest

from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import distance, meet
from neurovis_spec.layout.model import LayoutProblem
from neurovis_spec.layout.problem import canonical


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
    return canonical("classes", names, [("N", names)], named, boxes=boxed)


@pytest.mark.parametrize("engine", ["organic", "large"])
@pytest.mark.parametrize(
    ("count", "edges", "boxes", "inside"),
    [(60, 300, 3, 0.8), (150, 1500, 5, 0.5), (120, 900, 12, 0.3), (90, 200, 4, 0)],
)
def test_frames_of_boxes_hold_nothing_foreign(engine: str, count: int, edges: int, boxes: int, inside: float) -> None:
    problem = classes(count, edges, boxes, count, inside)
    layout = lay_out_problem(problem, engine)
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
