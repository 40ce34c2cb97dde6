"""The order in which neurons are read: what an author writes as a list is drawn in its order, else names decide."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise, permutations
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from neurovis_layouts.formations import offsets
from neurovis_layouts.layered.flips import Reading, reflected
from neurovis_layouts.layered.levels import Levels, Node
from neurovis_layouts.layered.order import Order, crossings
from small_specs import compiled
from test_layout_order import levels_by_hand, some_levels

from neurovis_spec.compiled import NetworkLayout
from neurovis_spec.layout import Layout
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


CHAINS = "connections: {R -> a1 + b1: 1, a1 -> z1: 1, b1 -> y1: 1, z1 -> z2: 1, y1 -> y2: 1, z2 + y2 -> S: 1}\n"
#: two strands whose neurons may stand either way round in all ranks at once, most of them in the order of their names
STRANDS = f"neurons: {{R: {{bias: 1}}, a1: {{}}, b1: {{}}, y1: {{}}, y2: {{}}, z1: {{}}, z2: {{}}, S: {{}}}}\n{CHAINS}"


@pytest.mark.parametrize(("direction", "axis"), [("down", 0), ("up", 0), ("right", 1), ("left", 1)])
def test_of_a_drawing_and_its_mirror_image_the_one_in_the_order_of_names_is_drawn(direction: str, axis: int) -> None:
    layout = layout_of(f"{STRANDS}layout: {{direction: {direction}}}")
    for names in (["y1", "z1"], ["y2", "z2"], ["b1", "a1"]):
        assert in_row(layout, names, axis) == names
    assert layout.metrics()["crossings"] == 0


def test_the_neurons_of_a_group_keep_its_order_whatever_stands_beside_them() -> None:
    listed = STRANDS.replace("a1: {}, b1: {}", "G: {names: [a1, b1]}")
    assert in_row(layout_of(listed), ["a1", "b1"]) == ["a1", "b1"]
    assert in_row(layout_of(listed.replace("[a1, b1]", "[b1, a1]")), ["a1", "b1"]) == ["b1", "a1"]


def test_signals_within_a_rank_run_on_where_they_may() -> None:
    layout = layout_of(
        "modules: {m: {neurons: {A: {}, B: {}}, connections: {A -> B: 1, B -> A: 1}}}\n"
        "neurons: {D: {bias: 1}}\ninstances: {knee: {module: m}, hip: {module: m}, foot: {module: m}}\n"
        "connections: {D -> knee.A + hip.A + foot.A: 1, knee.B -> hip.A: 1, hip.B -> foot.A: 1}\n"
        "layout: {align: [[knee.A, hip.A, foot.A]]}"
    )
    assert in_row(layout, ["foot.A", "hip.A", "knee.A"]) == ["knee.A", "hip.A", "foot.A"]


def mirrored(layout: Layout, axis: int) -> Layout:
    def image(point: Point) -> Point:
        return (-point[0], point[1]) if axis == 0 else (point[0], -point[1])

    positions = {name: image(point) for name, point in layout.positions.items()}
    routes = {name: tuple(map(image, route)) for name, route in layout.routes.items()}
    return Layout(layout.network, layout.engine, positions, routes)


@pytest.mark.parametrize(("direction", "axis"), [("down", 0), ("up", 0), ("right", 1), ("left", 1)])
def test_what_is_new_is_added_to_an_earlier_layout_the_way_round_that_that_is(direction: str, axis: int) -> None:
    text = f"{STRANDS}layout: {{direction: {direction}}}"
    before = mirrored(layout_of(text).value, axis)
    more = text.replace("S: {}", "S: {}, x: {}, w: {}").replace(
        "y1 -> y2: 1", "y1 -> y2: 1, R + y1 -> w: 1, z1 -> x: 1"
    )
    now = compiled(more).layout("layered", earlier=before)
    assert {name: now.positions[name] for name in before.positions} == before.positions
    assert now.metrics()["crossings"] == 0
    assert compiled(more).layout("layered", earlier=now.value).positions == now.positions


def test_pins_say_which_way_round_the_rest_is_drawn() -> None:
    layout = layout_of(f"{STRANDS}layout: {{positions: {{y1: [4, 4], z1: [0, 4]}}}}")
    assert in_row(layout, ["y2", "z2"]) == ["z2", "y2"]
    assert in_row(layout, ["a1", "b1"]) == ["a1", "b1"]
    assert layout.metrics()["crossings"] == 0


def one(neuron: int, rank: int, kin: int = -1, box: int = -1) -> Node:
    return Node(rank, ((neuron, 0.0, 0.0),), kin=kin, box=box)


def read(
    levels: Levels,
    order: Order,
    may: frozenset[int] = frozenset(),
    known: Mapping[int, float] | None = None,
    flow: Sequence[tuple[int, int]] = (),
    loose: frozenset[int] = frozenset(),
) -> tuple[Order, set[int]]:
    """The order that is drawn, neurons read by their numbers, and which frames are reflected."""
    neurons = {m: m for node in levels.nodes for m, _, _ in node.members}
    return reflected(levels, order, may, Reading(neurons, known or {}, flow, loose))[1:]


@given(some_levels(ports=False), st.randoms(use_true_random=False))
def test_the_better_read_of_two_mirror_images_is_drawn_whichever_was_found(levels: Levels, random: Random) -> None:
    numbers = list(range(len(levels.nodes)))
    random.shuffle(numbers)
    levels.nodes[:] = [replace(node, members=((m, 0.0, 0.0),)) for node, m in zip(levels.nodes, numbers, strict=True)]
    order = [random.sample(rank, len(rank)) for rank in levels.ranks]
    image = [rank[::-1] for rank in order]

    def in_order(order: Order) -> int:
        pairs = [pair for rank in order for pair in combinations(rank, 2)]
        return sum(numbers[a] < numbers[b] for a, b in pairs)

    drawn, _ = read(levels, order)
    assert drawn == (image if in_order(image) > in_order(order) else order)
    assert crossings(levels, drawn) == crossings(levels, order)


def test_where_neurons_stand_goes_before_groups_these_before_signals_and_signals_before_names() -> None:
    levels = levels_by_hand([[one(0, 0), one(1, 0), one(2, 0)]], [])
    back = [[2, 1, 0]]
    assert read(levels, back)[0] == [[0, 1, 2]]
    assert read(levels, back, flow=((1, 0),))[0] == back
    assert read(levels, back, known={0: 3.5, 2: 1.5})[0] == back
    group = levels_by_hand([[one(0, 0, kin=7), one(1, 0, kin=7), one(2, 0)]], [])
    assert read(group, back, flow=((1, 0), (2, 1)))[0] == [[0, 1, 2]]
    assert read(group, back, known={0: 3.5, 1: 1.5})[0] == back


def test_what_nothing_connects_stays_at_the_end_of_its_rank_or_box() -> None:
    levels = levels_by_hand([[one(2, 0), one(1, 0), one(0, 0)], [one(5, 1), one(4, 1, box=0), one(3, 1, box=0)]], [])
    assert read(levels, [[0, 1, 2], [3, 4, 5]], loose=frozenset({0, 3}))[0] == [[1, 0, 2], [4, 5, 3]]


def test_a_frame_turns_with_the_whole_and_what_may_not_turn_holds_it_as_it_is() -> None:
    """Two strands into a frame: to read them in order the whole has to turn round, and the frame with it."""
    frame = Node(2, ((4, -1.0, 0.0), (5, 1.0, 0.0)), (1.0, 0.0))
    pairs = [(0, 0.0, 0, 0.0), (1, 0.0, 1, 0.0)]
    levels = levels_by_hand(
        [[one(0, 0), one(1, 0)], [one(2, 1), one(3, 1)], [frame]], [pairs, [(0, 0.0, 0, 1.0), (1, 0.0, 0, -1.0)]]
    )
    found, image = [[1, 0], [3, 2], [4]], [[0, 1], [2, 3], [4]]
    assert read(levels, found) == (found, set())
    assert read(levels, found, may=frozenset({4})) == (image, {4})


def test_a_frame_that_crosses_no_more_as_it_is_drawn_does_not_turn() -> None:
    frame = Node(2, ((4, -1.0, 0.0), (5, 1.0, 0.0)), (1.0, 0.0))
    pairs = [(0, 0.0, 0, 0.0), (1, 0.0, 1, 0.0)]
    levels = levels_by_hand(
        [[one(0, 0), one(1, 0)], [one(2, 1), one(3, 1)], [frame]], [pairs, [(0, 0.0, 0, 1.0), (1, 0.0, 0, 1.0)]]
    )
    assert read(levels, [[1, 0], [3, 2], [4]], may=frozenset({4})) == ([[0, 1], [2, 3], [4]], set())
