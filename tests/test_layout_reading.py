"""The order in which neurons are read: what an author writes as a list is drawn in its order, else names decide."""

from __future__ import annotations

import math
from itertools import pairwise, permutations

import pytest
from neurovis_layouts.formations import offsets
from small_specs import compiled

from neurovis_spec.compiled import NetworkLayout
from neurovis_spec.layout.model import Arrangement, Point

LEG = ["hip", "knee", "ankle", "toe"]
NAMED = "neurons: {D: {bias: 1}, J: {names: [hip, knee, ankle, toe]}}\nconnections: {D -> J: 1}\n"


def layout_of(text: str, engine: str = "layered") -> NetworkLayout:
    return compiled(text).layout(engine)


def seen_from_first(layout: NetworkLayout, names: list[str]) -> list[Point]:
    x, y = layout.positions[names[0]]
    return [(layout.positions[name][0] - x, layout.positions[name][1] - y) for name in names]


def in_row(layout: NetworkLayout, names: list[str], axis: int = 0) -> list[str]:
    return sorted(names, key=lambda name: layout.positions[name][axis])


def clockwise(layout: NetworkLayout, names: list[str]) -> list[str]:
    """These neurons round their middle, from the first of them on."""
    at = [layout.positions[name] for name in names]
    x, y = math.fsum(x for x, _ in at) / len(at), math.fsum(y for _, y in at) / len(at)
    ordered = sorted(names, key=lambda name: math.atan2(layout.positions[name][1] - y, layout.positions[name][0] - x))
    start = ordered.index(names[0])
    return ordered[start:] + ordered[:start]


@pytest.mark.parametrize("how", ["row", "column", "grid", "ring", "arc"])
@pytest.mark.parametrize(
    "what", ["J", "hip + knee + ankle + toe", "toe + ankle + knee + hip", "knee + toe + hip + ankle"]
)
def test_what_is_arranged_stands_in_the_order_written(how: Arrangement, what: str) -> None:
    layout = layout_of(f"{NAMED}layout: {{arrange: {{{what}: {how}}}}}")
    written = LEG if what == "J" else what.split(" + ")
    points = offsets(how, 4, 1.0)
    first = points[0]
    assert seen_from_first(layout, written) == [(x - first[0], y - first[1]) for x, y in points]


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_an_arrangement_in_a_module_stands_in_the_order_written(direction: str) -> None:
    layout = layout_of(
        "modules:\n  leg:\n    neurons: {D: {}, J: {names: [hip, knee, ankle, toe]}}\n    connections: {D -> J: 1}\n"
        f"    layout: {{arrange: {{J: row}}}}\ninstances: {{leg: {{module: leg, count: 2}}}}\n"
        f"connections: {{leg1.D -> leg2.D: 1}}\nlayout: {{direction: {direction}}}"
    )
    for leg in ("leg1", "leg2"):
        names = [f"{leg}.{name}" for name in LEG]
        assert in_row(layout, names) == names


def test_a_row_of_mirror_images_has_the_first_sides_in_the_order_written() -> None:
    layout = layout_of(
        "neurons: {L: {names: [Lb, La]}, R: {names: [Rb, Ra]}, O: {}}\nconnections: {L + R -> O: 1}\n"
        "layout: {mirror: [[L, R]], arrange: {L + R: row}}"
    )
    assert in_row(layout, ["La", "Lb", "Ra", "Rb"]) == ["Lb", "La", "Ra", "Rb"]


def test_a_ring_and_a_chain_run_in_the_order_of_a_list() -> None:
    names = ["south", "east", "north", "west", "abdomen"]
    listed = ", ".join(names)
    ring = layout_of(f"neurons: {{S: {{names: [{listed}]}}}}\nconnections: {{S -> S: {{pattern: ring}}}}")
    assert clockwise(ring, names) == names
    chain = "\n".join(f"  {a} -> {b}: 1\n  {b} -> {a}: 1" for a, b in pairwise(names))
    row = layout_of(f"neurons: {{S: {{names: [{listed}]}}}}\nconnections:\n{chain}")
    assert in_row(row, names) == names


@pytest.mark.parametrize("engine", ["layered", "circular", "grid"])
def test_what_nothing_connects_stands_in_the_order_of_its_list(engine: str) -> None:
    layout = layout_of("neurons: {B: {count: 2}, J: {names: [hip, knee, ankle, toe]}}", engine)
    names = ["B1", "B2", *LEG]
    if engine == "layered":
        assert in_row(layout, names) == names
    elif engine == "grid":
        assert sorted(names, key=lambda name: layout.positions[name][::-1]) == names
    else:
        assert clockwise(layout, names) == names


def test_the_order_of_keys_shows_nowhere() -> None:
    groups = ["D: {bias: 1}", "J: {names: [hip, knee, ankle, toe]}", "C: {names: [b, a]}"]
    found = {
        repr(
            layout_of(
                f"neurons: {{{', '.join(order)}}}\nconnections: {{D -> J + C: 1}}\nlayout: {{arrange: {{J: row}}}}"
            ).positions
        )
        for order in permutations(groups)
    }
    assert len(found) == 1
