from __future__ import annotations

import math
import re
import warnings
from dataclasses import replace
from itertools import pairwise
from typing import cast

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.layout import LayoutProblem, LayoutRefusalError, SizingEngine
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.choose import choose_engine
from neurovis_spec.layout.engines import engine_of
from neurovis_spec.layout.frames import Frames, entered
from neurovis_spec.layout.geometry import near_pairs, sampled
from neurovis_spec.layout.model import RADIUS
from neurovis_spec.layout.problem import NamedProblem

BODY = {"A": (0.0, 0.0), "B": (1e-6, 0.0), "C": (0.0, 2e-6), "D": (3e-6, 2e-6)}


def body(**changes: object) -> LayoutProblem:
    return NamedProblem("body", list(BODY), places=BODY, **changes).canonical()  # type: ignore[arg-type]


@pytest.mark.parametrize("direction", ["down", "right"])
def test_one_factor_scales_both_axes_whatever_the_direction(direction: str) -> None:
    places = lay_out_problem(body(direction=direction), "spatial").positions
    assert places["A"] == (0.0, 0.0)
    factor = places["B"][0]
    assert factor >= 0.6
    for name, (x, y) in BODY.items():
        assert places[name] == pytest.approx((x / 1e-6 * factor, y / 1e-6 * factor), abs=0.01)


def test_what_coincides_stands_side_by_side() -> None:
    names = [f"N{i}" for i in range(40)]
    places = {name: (float(i // 4), 5.0) for i, name in enumerate(names)}
    layout = lay_out_problem(NamedProblem("x", names, places=places).canonical(), "spatial")
    xs = [layout.positions[name][0] for name in names]
    groups = [sum(xs[i : i + 4]) / 4 for i in range(0, 40, 4)]
    assert groups == sorted(groups)
    assert len(set(layout.positions.values())) == 40


def test_almost_one_place_does_not_make_the_picture_endless() -> None:
    places = {"A": (0.0, 0.0), "B": (0.0, 1.0), "C": (0.0, 1e-169)}
    layout = lay_out_problem(NamedProblem("x", list(places), places=places).canonical(), "spatial")
    assert max(y for _, y in layout.positions.values()) < 200


def test_pins_win_and_the_rest_goes_with_them() -> None:
    layout = lay_out_problem(body(pins={"A": (10.0, 10.0)}), "spatial")
    free = lay_out_problem(body(), "spatial")
    assert layout.positions["A"] == (10.0, 10.0)
    assert layout.positions["D"] == pytest.approx([c + 10 for c in free.positions["D"]], abs=0.01)


def test_without_any_position_the_engine_refuses_and_a_pin_will_do() -> None:
    with pytest.raises(LayoutRefusalError, match=r"'E', 'F' have none") as caught:
        lay_out_problem(NamedProblem("x", ["E", "F"]).canonical(), "spatial")
    assert caught.value.code == "position-missing"
    pinned = NamedProblem("x", [*BODY, "E"], places=BODY, pins={"E": (9.0, 9.0)}).canonical()
    assert lay_out_problem(pinned, "spatial").positions["E"] == (9.0, 9.0)


def test_neurons_without_a_position_stand_beside_what_they_are_connected_to() -> None:
    edges = [("A -> E", "A", "E", 1), ("C -> E", "C", "E", 1), ("E -> F", "E", "F", 1)]
    at = lay_out_problem(
        NamedProblem("x", [*BODY, "E", "F", "G", "H"], edges=edges, places=BODY).canonical(), "spatial"
    ).positions
    assert at["E"][0] < at["D"][0] / 2
    assert at["A"][1] < at["E"][1] < at["C"][1]
    assert abs(at["F"][1] - at["E"][1]) + abs(at["F"][0] - at["E"][0]) < 2
    assert at["G"][1] == at["H"][1] > max(at[name][1] for name in "ABCDEF")


def test_what_has_no_position_gives_way_to_what_has_one() -> None:
    places = {"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (4.0, 1.0)}
    edges = [(f"{name} -> {other}", name, other, 1) for name, other in ("AE", "BE", "CE", "EF")]
    alone = lay_out_problem(NamedProblem("x", [*"ABC"], places=places).canonical(), "spatial").positions
    among = lay_out_problem(NamedProblem("x", [*"ABCEF"], edges=edges, places=places).canonical(), "spatial").positions
    for axis in (0, 1):  # E would stand close to B, between all three
        assert len({alone[name][axis] - among[name][axis] for name in "ABC"}) == 1
    assert math.dist(among["E"], among["B"]) >= 2 * RADIUS


@pytest.mark.parametrize(("wide", "high", "times"), [(5, 5, 1.7), (40, 2, 3.1)])
def test_routes_do_not_make_the_picture_much_larger_than_what_it_shows(wide: int, high: int, times: float) -> None:
    names = [f"N{i}" for i in range(wide * high)]
    places = {name: (float(i % wide), float(i // wide)) for i, name in enumerate(names)}
    pairs = [(a, b) for k, a in enumerate(names) for b in names[:: 1 + k % 3] if a != b][:600]
    edges = [(f"{a} -> {b}", a, b, 1) for a, b in pairs]
    layout = lay_out_problem(NamedProblem("x", names, edges=edges, places=places).canonical(), "spatial")
    points = [point for route in layout.routes.values() for point in sampled(route, 0.2)]
    for axis in (0, 1):
        held = [point[axis] for point in layout.positions.values()]
        drawn = [point[axis] for point in points]
        assert max(drawn) - min(drawn) <= times * (max(held) - min(held))


def test_routes_are_straight_where_nothing_is_in_the_way() -> None:
    names = [f"N{i}" for i in range(30)]
    places = {name: ((i * 7919) % 101 / 5, (i * 104729) % 97 / 7) for i, name in enumerate(names)}
    pairs = sorted({tuple(sorted((names[(i * 11) % 30], names[(i * i + 3 * i + 5) % 30]))) for i in range(70)})
    edges = [(f"{a} -> {b}", a, b, 1) for a, b in pairs if a != b]
    layout = lay_out_problem(NamedProblem("x", names, edges=edges, places=places).canonical(), "spatial")
    straight = 0
    for name, a, b, _ in edges:
        (x, y), (u, v) = layout.positions[a], layout.positions[b]
        far = math.dist((x, y), (u, v))
        off = [
            math.dist(p, (x + t * (u - x), y + t * (v - y)))
            for p in (point for other, point in layout.positions.items() if other not in (a, b))
            for t in [max(0.0, min(1.0, ((p[0] - x) * (u - x) + (p[1] - y) * (v - y)) / far**2))]
        ]
        if min(off) >= 0.46:
            straight += 1
            for px, py in layout.routes[name]:
                assert abs((px - x) * (v - y) - (py - y) * (u - x)) / far < 0.01
    assert straight >= 10


def test_a_spec_draws_by_position() -> None:
    group = "{count: 3, position: [[0, 0], [10, 0], [0, 30]]}"
    network = nv.compile_text(f"neurovis: 1\nname: x\nneurons: {{L: {group}}}\nlayout: {{engine: spatial}}\n")
    places = network.layout().positions
    assert places["L1"] == (0.0, 0.0)
    assert places["L3"][1] == pytest.approx(3 * places["L2"][0], abs=0.01)


@pytest.mark.parametrize("unit", ["1e-300", "5e-324", "1e-160", "1e150"])
def test_the_unit_of_positions_is_free(unit: str) -> None:
    def places(value: str) -> dict[str, tuple[float, float]]:
        text = f"neurons: {{A: {{count: 4, position: ['{value}*i', '{value}*i*i']}}}}\nlayout: {{engine: spatial}}\n"
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return dict(nv.compile_text(f"neurovis: 1\nname: x\n{text}").layout().positions)

    assert places(unit) == places("1")


def test_auto_draws_by_position_where_every_neuron_has_one() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 3, position: [i, i*i]}MORE}\n"
    assert nv.compile_text(text.replace("MORE", "")).layout().engine == "spatial"
    assert nv.compile_text(text.replace("MORE", ", B: {}")).layout().engine == "layered"


LAYERS = {"L23": 0.0, "L4": 6.0, "L5": 9.0, "L6": 11.0}


def column(wide: float, high: float = 15.0) -> LayoutProblem:
    """Four layers of 60 neurons each, one below the other, each in a box."""
    ends = [*LAYERS.values(), 15.0]
    places = {
        f"{layer}_{i}": (
            wide * ((i * 0.7548776662466927) % 1),
            (top + (end - top) * ((i * 0.569840291) % 1)) * high / 15,
        )
        for (layer, top), end in zip(LAYERS.items(), ends[1:], strict=True)
        for i in range(60)
    }
    boxes = [(layer, [name for name in places if name.startswith(f"{layer}_")]) for layer in LAYERS]
    return NamedProblem("column", list(places), places=places, boxes=boxes).canonical()


def test_crowded_places_are_spread_and_neighbours_stay_neighbours() -> None:
    problem = column(4.0)
    layout = lay_out_problem(problem, "spatial")
    places = np.array([layout.positions[name] for name in problem.neurons])
    data = np.array(problem.places)
    assert near_pairs(places, 2 * RADIUS)[0].size == 0
    size = np.ptp(places, axis=0) + 2 * RADIUS
    assert problem.disc(tuple(size)) > 5.0  # at the scale that gives most discs room it would be 3.4
    for axis in (0, 1):
        assert np.corrcoef(places[:, axis], data[:, axis])[0, 1] > 0.99
    near, there = (np.argsort(np.hypot(*(at[:, None] - at[None]).T), axis=1)[:, 1:9] for at in (data, places))
    assert np.mean([len({*a} & {*b}) / 8 for a, b in zip(near.tolist(), there.tolist(), strict=True)]) > 0.7


def test_boxes_that_a_line_parts_are_spread_each_by_itself() -> None:
    problem = column(4.0)
    layout = lay_out_problem(problem, "spatial")
    frames = Frames(problem).rects({i: layout.positions[name] for i, name in enumerate(problem.neurons)}, {})
    for rect, (_, own) in zip(frames, problem.boxes, strict=True):
        assert rect is not None
        assert not entered(np.array(list(layout.positions.values())), rect, own)
    ordered = [rect for rect in (*frames[3:], *frames[:3]) if rect is not None]
    for upper, lower in pairwise(ordered):  # as the layers are, from L23 to L6
        assert upper[3] < lower[1]


def test_what_is_in_one_place_does_not_stand_among_what_is_in_the_next() -> None:
    names = [f"{group}{i}" for group in "ABC" for i in range(50)]
    places = {name: (float("ABC".index(name[0])), 0.0) for name in names}
    boxes = [(group, [name for name in names if name[0] == group]) for group in "ABC"]
    at = lay_out_problem(NamedProblem("x", names, places=places, boxes=boxes).canonical(), "spatial").positions
    for left, right in pairwise("ABC"):
        assert max(at[f"{left}{i}"][0] for i in range(50)) < min(at[f"{right}{i}"][0] for i in range(50))


def test_what_overlaps_nowhere_is_to_scale_however_large_it_is() -> None:
    names = [f"N{i}" for i in range(600)]
    places = {name: (float(i % 3), float(i // 3)) for i, name in enumerate(names)}
    at = lay_out_problem(NamedProblem("x", names, places=places).canonical(), "spatial").positions
    factor = at["N1"][0]
    for name, (x, y) in places.items():
        assert at[name] == pytest.approx((factor * x, factor * y), abs=0.005)


def test_auto_declines_positions_whose_discs_nobody_would_see() -> None:
    strip, page = column(0.4), column(8.0)
    engine, why = choose_engine(strip)
    assert engine == "layered"
    assert why == "where their 'position' says, as 'spatial' draws them, discs would have a radius of 1.7 pixels"
    assert choose_engine(page)[0] == "spatial"
    wide = lay_out_problem(page, "spatial").positions.values()
    size = cast(SizingEngine, engine_of("spatial")).size(page)
    for axis in (0, 1):
        assert size[axis] == pytest.approx(
            max(p[axis] for p in wide) - min(p[axis] for p in wide) + 2 * RADIUS, abs=0.01
        )
    # a page as slim as the strip has room for it
    assert choose_engine(replace(strip, aspect=0.1))[0] == "spatial"


def test_a_disc_is_never_smaller_than_a_line() -> None:
    at = ", ".join(f"[{(i * 0.7548) % 1:.3f}, {(i * 0.5698) % 15:.3f}]" for i in range(300))
    wired = "connections: {A1 -> A2: 1, A7 -> A30: 2, A9 -> A90: 5}"
    body = f"neurons: {{A: {{count: 300, position: [{at}]}}}}\n{wired}"
    svg = nv.compile_text(f"neurovis: 1\nname: x\n{body}\nlayout: {{engine: spatial}}\n").layout()._repr_svg_()
    least = min(float(r) for r in re.findall(r"<circle [^>]*\br=\"([\d.]+)\"", svg))
    lines = re.findall(r"<path [^>]*stroke-width=\"([\d.]+)\"", svg)
    assert max(map(float, lines)) <= 2 * least
