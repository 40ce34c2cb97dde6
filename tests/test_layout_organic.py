from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from random import Random

import layout_conformance as suite
import numpy as np
import pytest
from hypothesis import given
from laws import examples

from neurovis_spec.layout import Direction, LayoutProblem, LayoutRefusalError
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import distance, meet
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem


def test_a_ring_becomes_a_ring() -> None:
    names = suite.members("N", 24)
    ring = NamedProblem(
        "ring", names, edges=suite.named((names[i], names[(i + 1) % 24]) for i in range(24))
    ).canonical()
    layout = lay_out_problem(ring, "organic")
    points = [layout.positions[name] for name in names]
    middle = (sum(x for x, _ in points) / 24, sum(y for _, y in points) / 24)
    radii = [distance(point, middle) for point in points]
    assert max(radii) < 1.1 * min(radii)
    assert metrics(layout, ring)["crossings"] == 0


def reservoir() -> LayoutProblem:
    units = suite.members("R", 60)
    pairs = [(units[i], units[(i * step + 7 * step) % 60]) for i in range(60) for step in (1, 3, 11)]
    pairs += [("I", unit) for unit in units[::6]] + [(unit, "O") for unit in units[3::6]]
    return NamedProblem("reservoir", [*units, "I", "O"], edges=suite.named(sorted(set(pairs)))).canonical()


def test_what_drives_a_loop_stands_above_and_what_reads_it_below() -> None:
    for direction in ("down", "right"):
        problem = reservoir()
        turned = LayoutProblem("x", problem.neurons, problem.groups, problem.edges, direction=direction)
        assert metrics(lay_out_problem(turned, "organic"), turned)["flow"] == 1


def test_who_drives_a_loop_stands_above_the_whole_of_it() -> None:
    layout = lay_out_problem(reservoir(), "organic")
    units = [y for name, (_, y) in layout.positions.items() if name.startswith("R")]
    assert layout.positions["I"][1] < min(units)
    assert layout.positions["O"][1] > max(units)


def test_boxes_are_compact_and_pins_stay() -> None:
    problem = reservoir()
    boxed = tuple(problem.neurons.index(f"R{i}") for i in (1, 20, 40))

    def spread(positions: list[tuple[float, float]]) -> float:
        return max(distance(a, b) for a in positions for b in positions)

    layouts = [
        lay_out_problem(
            LayoutProblem("x", problem.neurons, problem.groups, problem.edges, {5: (3.3, 4.4)}, boxes=boxes), "organic"
        )
        for boxes in ((), (("b", boxed),))
    ]
    loose, close = (spread([layout.positions[problem.neurons[i]] for i in boxed]) for layout in layouts)
    assert close < 0.7 * loose
    assert all(layout.positions[problem.neurons[5]] == (3.3, 4.4) for layout in layouts)


@examples(8)
@given(suite.problems())
def test_large_draws_what_organic_draws(problem: LayoutProblem) -> None:
    """So that it suffices to hold one of them to what an engine promises."""
    drawn: list[object] = []
    for engine in ("organic", "large"):
        try:
            drawn.append(replace(lay_out_problem(problem, engine), engine=""))
        except LayoutRefusalError as refusal:
            drawn.append(str(refusal).replace(engine, ""))
    assert drawn[0] == drawn[1]


def test_parts_do_not_overlap_however_small_the_spacing() -> None:
    names = suite.members("N", 12)
    edges = suite.named([("N1", "N2"), ("N3", "N4"), ("N4", "N5"), ("N5", "N3")])
    suite.check(NamedProblem("parts", names, edges=edges, spacing=(0.2, 0.5)).canonical(), "organic")


def two_sided(sides: int, middle: int, connections: int, *, seed: int, direction: Direction = "down") -> LayoutProblem:
    """Pairs of neurons and some in the middle; of most connections the mirror image is there, too."""
    random = Random(seed)
    left, right = suite.members("L", sides), suite.members("R", sides)
    image = {**dict(zip(left, right, strict=True)), **dict(zip(right, left, strict=True))}
    names = [*left, *right, *suite.members("M", middle)]
    pairs: dict[tuple[str, str], None] = {}
    while len(pairs) < connections:
        a, b = random.choice(names), random.choice(names)
        pairs[a, b] = None
        if random.random() < 0.7:
            pairs[image.get(a, a), image.get(b, b)] = None
    both = list(zip(left, right, strict=True))
    return NamedProblem(
        "two-sided", names, edges=suite.named(pairs), direction=direction, mirrors=[("", both, [])]
    ).canonical()


@pytest.mark.parametrize("direction", ["down", "left"])
@pytest.mark.parametrize(("sides", "middle", "connections"), [(3, 1, 8), (12, 5, 80), (25, 12, 160)])
def test_mirror_images_are_exact(sides: int, middle: int, connections: int, direction: Direction) -> None:
    problem = two_sided(sides, middle, connections, seed=sides, direction=direction)
    layout = suite.check(problem, "organic")
    assert layout is not None
    suite.check_mirror(layout, problem)
    assert metrics(layout, problem)["symmetry"] == 1


def test_mirror_images_are_exact_among_pins_and_in_boxes() -> None:
    problem = two_sided(12, 5, 80, seed=1)
    number = problem.neurons.index
    boxes = [
        ("both", tuple(number(f"{side}{i}") for side in "LR" for i in (1, 2, 3, 4))),
        ("one", tuple(number(f"L{i}") for i in (5, 6, 7))),
        ("other", tuple(number(f"R{i}") for i in (5, 6, 7))),
        ("middle", tuple(number(f"M{i}") for i in (1, 2, 3))),
    ]
    for pins in ({}, {"L1": (-2.5, 0.25)}, {"L2": (-3.1, 2.2), "R2": (3.1, 2.2), "M1": (0.3, 9.0)}):
        held = replace(problem, boxes=tuple(boxes), pins={number(name): point for name, point in pins.items()})
        layout = suite.check(held, "organic")
        assert layout is not None
        suite.check_mirror(layout, held)
        if not pins:
            rects = Frames(held).rects({i: layout.positions[name] for i, name in enumerate(held.neurons)}, {})
            assert not any(meet(*pair) for pair in combinations([rect for rect in rects if rect], 2))


def test_sides_of_a_tangle_do_not_mix() -> None:
    problem = two_sided(50, 0, 1200, seed=2)
    own = replace(problem, edges=tuple(e for e in problem.edges if (e.source < 50) == (e.target < 50)))
    layout = lay_out_problem(own, "auto")
    assert layout.engine == "organic"
    middle = np.mean([x for x, _ in layout.positions.values()])
    assert sum(x < middle for name, (x, _) in layout.positions.items() if name.startswith("L")) in (0, 50)


def test_mirror_images_within_an_instance_are_for_engines_with_frames() -> None:
    problem = NamedProblem("x", ["m.A", "m.B"], modules=[("m", "m")], mirrors=[("m", [("m.A", "m.B")], [])]).canonical()
    with pytest.raises(LayoutRefusalError) as found:
        lay_out_problem(problem, "organic")
    assert found.value.code == "layout-mirror-unsupported"
