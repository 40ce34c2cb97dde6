from __future__ import annotations

import inspect
import math
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import layout_conformance as suite
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.formations import offsets
from neurovis_layouts.isotonic import spread
from neurovis_layouts.layered import LayeredEngine
from neurovis_layouts.layered.ranks import ranks_of
from neurovis_layouts.pins import fit

from neurovis_spec.layout import Arrangement, Direction, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import dump
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem


@pytest.mark.parametrize("engine", suite.DRAWING)
@examples(12)
@given(problem=suite.problems())
def test_every_engine_keeps_the_contract_or_refuses(engine: str, problem: LayoutProblem) -> None:
    layout = suite.check(problem, engine)
    if layout is not None:
        assert lay_out_problem(problem, engine) == layout


@pytest.mark.parametrize("engine", suite.ENGINES)
def test_every_engine_lays_out_nothing_and_one(engine: str) -> None:
    assert lay_out_problem(NamedProblem("none", []).canonical(), engine) == Layout("none", engine, {}, {})
    one = NamedProblem("one", ["A"], [("A", ["A"])], suite.named([("A", "A")]), {"A": (0.0, 0.0)}).canonical()
    layout = suite.check(one, engine)
    assert layout is not None
    assert layout.positions == {"A": (0.0, 0.0)}


@pytest.mark.parametrize("engine", suite.DRAWING)
@pytest.mark.parametrize("problem", suite.extremes(), ids=lambda problem: problem.network)
def test_every_engine_bears_extremes_or_refuses_by_what_it_declares(engine: str, problem: LayoutProblem) -> None:
    try:
        layout = lay_out_problem(problem, engine)
    except LayoutRefusalError as refusal:
        suite.check_refusal(engine, refusal)
    else:
        suite.check_positions(problem, layout)
        assert len(layout.routes) == len(problem.edges)


@pytest.mark.parametrize("engine", [name for name in suite.ENGINES if name != "manual"])
def test_every_engine_keeps_what_it_remembers(engine: str) -> None:
    names = suite.members("N", 12)
    pairs = suite.named([(a, b) for i, a in enumerate(names) for b in names[i + 1 : i + 3]])
    places = {name: (float(i % 4), float(i // 4)) for i, name in enumerate([*names, "Z"])}
    before = lay_out_problem(NamedProblem("x", names, edges=pairs, places=places).canonical(), engine)
    later = NamedProblem(
        "x", [*names, "Z"], edges=[*pairs, ("N1 -> Z", "N1", "Z", 1)], places=places, memory=before
    ).canonical()
    now = lay_out_problem(later, engine)
    assert all(now.positions[name] == before.positions[name] for name in names)
    assert suite.nearest(list(now.positions.values())) >= 0.6


@pytest.mark.parametrize("engine", ["layered", "organic", "circular", "grid"])
@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_use_case_one_in_every_direction(engine: str, direction: Direction) -> None:
    problem = suite.use_case_one(direction)
    layout = suite.check(problem, engine)
    assert layout is not None
    measured = metrics(layout, problem)
    assert measured["overlaps"] == 0
    if engine == "layered":
        assert measured["crossings"] == 28  # the least for 2 × 8 in two ranks
        assert measured["edges_over_neurons"] == 0
        assert measured["flow"] == 1


def test_use_case_one_is_centred_and_mirrored() -> None:
    places = lay_out_problem(suite.use_case_one(), "layered").positions
    axis = places["O"][0]
    for left, right in [("C1", "C2"), ("K1", "K8"), ("K2", "K7"), ("K3", "K6"), ("K4", "K5")]:
        assert places[left][0] + places[right][0] == 2 * axis
        assert places[left][1] == places[right][1]
    assert [places[f"K{i}"][0] for i in range(1, 9)] == [float(i) for i in range(8)]
    assert places["C1"][1] < places["K1"][1] < places["O"][1] == places["T"][1]
    assert places["T"][0] > places["O"][0]


def test_self_loops_turn_away_from_the_neighbour() -> None:
    layout = lay_out_problem(suite.use_case_one(), "layered")
    assert min(x for x, _ in layout.routes["C1 -> C1"]) < layout.positions["C1"][0] - 0.3
    assert max(x for x, _ in layout.routes["C2 -> C2"]) > layout.positions["C2"][0] + 0.3


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_a_self_loops_legs_keep_off_the_other_edges_of_its_neuron(direction: Direction) -> None:
    layout = lay_out_problem(suite.use_case_one(direction), "layered")
    for neuron in ("C1", "C2"):
        loop, place = layout.routes[f"{neuron} -> {neuron}"], layout.positions[neuron]
        legs = [_angle(place, loop[1]), _angle(place, loop[2])]
        others = [_angle(place, r[1]) for n, r in layout.routes.items() if n.startswith(neuron) and r is not loop]
        others += [_angle(place, r[-2]) for n, r in layout.routes.items() if n.endswith(neuron) and r is not loop]
        assert len(others) == 10
        gaps = [abs((leg - other + 180) % 360 - 180) for leg in legs for other in others]
        assert min(gaps) > 14  # at the rim of a disc, wider than an arrowhead


def _angle(centre: Point, towards: Point) -> float:
    return math.degrees(math.atan2(towards[1] - centre[1], towards[0] - centre[0]))


def test_arrivals_come_in_the_order_of_their_sources() -> None:
    layout = lay_out_problem(suite.use_case_one(), "layered")
    last = [layout.routes[f"K{i} -> O"][-2][0] for i in range(1, 9)]
    assert all(a < b for a, b in pairwise(last))


def test_straight_routes_keep_their_control_points_on_the_line() -> None:
    names = suite.members("N", 12)
    chain = NamedProblem("chain", names, [("N", names)], suite.named(pairwise(names))).canonical()
    layout = lay_out_problem(chain, "layered")
    assert [layout.positions[name] for name in names] == [(0.0, 2.0 * i) for i in range(12)]
    assert all(x == 0 for route in layout.routes.values() for x, _ in route)


def test_a_group_that_drives_itself_in_a_ring_is_drawn_as_one() -> None:
    names = suite.members("R", 16)
    around = [(a, b) for a, b in pairwise([*names, names[0]])]
    problem = NamedProblem(
        "ring", names, [("R", names)], suite.named([*around, *((b, a) for a, b in around)])
    ).canonical()
    layout = lay_out_problem(problem, "layered")
    middle = [sum(c) / 16 for c in zip(*layout.positions.values(), strict=True)]
    radii = [distance(point, (middle[0], middle[1])) for point in layout.positions.values()]
    assert max(radii) - min(radii) < 0.01
    assert metrics(layout, problem)["crossings"] == 0


def test_what_spans_ranks_goes_round_the_neurons_between() -> None:
    names = ["A", "B", "C"]
    problem = NamedProblem(
        "skip", names, [(n, [n]) for n in names], suite.named([("A", "B"), ("B", "C"), ("A", "C")])
    ).canonical()
    layout = lay_out_problem(problem, "layered")
    line = sampled(layout.routes["A -> C"])
    assert min(distance(point, layout.positions["B"]) for point in line) > 0.4


def test_feedback_stands_against_the_direction_and_apart() -> None:
    h, o = suite.members("H", 3), ["O"]
    pairs = suite.named([*suite.full(["I"], h), *suite.full(h, o)], 0) + suite.named(suite.full(o, h))
    problem = NamedProblem("fb", ["I", *h, *o], [("I", ["I"]), ("H", h), ("O", o)], pairs).canonical()
    layout = suite.check(problem, "layered")
    assert layout is not None
    heights = [layout.positions[name][1] for name in ("I", "H1", "H2", "H3", "O")]
    assert heights == [0.0, 2.0, 2.0, 2.0, 4.0]


def test_what_runs_within_a_step_decides_where_a_loop_is_cut() -> None:
    edges = suite.named([("B", "A")], 0) + suite.named([("A", "B")], 1)
    places = lay_out_problem(
        NamedProblem("cut", ["A", "B"], [("A", ["A"]), ("B", ["B"])], edges).canonical(), "layered"
    ).positions
    assert places["B"][1] < places["A"][1]


def test_members_of_a_box_stay_together() -> None:
    names = suite.members("N", 6)
    targets = suite.members("M", 6)
    pairs = [(names[i], targets[(3 * i) % 6]) for i in range(6)]
    groups = [(n, [n]) for n in names + targets]
    boxed = [names[0], names[3], names[5]]
    problem = NamedProblem("boxes", names + targets, groups, suite.named(pairs), boxes=[("frame", boxed)]).canonical()
    places = lay_out_problem(problem, "layered").positions
    rank = sorted((x, name) for name, (x, y) in places.items() if y == places[boxed[0]][1])
    at = [i for i, (_, name) in enumerate(rank) if name in boxed]
    assert len(at) == 3
    assert at[2] - at[0] == 2


def test_arranged_groups_keep_their_formation() -> None:
    kernels = suite.members("K", 8)
    layout = lay_out_problem(suite.use_case_one(arrange=((kernels, "grid"),)), "layered")
    places = [layout.positions[name] for name in kernels]
    origin = places[0]
    assert [(x - origin[0], y - origin[1]) for x, y in places] == [
        (0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0.5, 2), (1.5, 2)
    ]  # fmt: skip
    sideways = lay_out_problem(suite.use_case_one("right", arrange=((kernels, "row"),)), "layered")
    assert len({sideways.positions[name][1] for name in kernels}) == 1


def test_arranging_a_neuron_twice_is_refused() -> None:
    problem = NamedProblem("twice", ["A", "B"], arrange=[(["A", "B"], "row"), (["A"], "ring")]).canonical()
    with pytest.raises(LayoutRefusalError, match="'A' is arranged twice"):
        lay_out_problem(problem, "layered")


def test_pins_stay_and_push_others_off() -> None:
    problem = suite.use_case_one()
    free = lay_out_problem(problem, "layered").positions
    o = problem.neurons.index("O")
    t = problem.neurons.index("T")
    pins = {o: (5.0, 5.0), t: (5.0 + free["K3"][0] - free["O"][0] + 0.1, 3.0)}
    pinned = LayoutProblem("x", problem.neurons, problem.groups, problem.edges, pins)
    layout = suite.check(pinned, "layered")
    assert layout is not None
    assert layout.positions["O"] == (5.0, 5.0)


def test_one_pin_moves_the_whole() -> None:
    problem = suite.use_case_one()
    free = lay_out_problem(problem, "layered").positions
    o = problem.neurons.index("O")
    pinned = LayoutProblem("x", problem.neurons, problem.groups, problem.edges, {o: (10.0, -3.0)}, boxes=problem.boxes)
    places = lay_out_problem(pinned, "layered").positions
    shift = (10.0 - free["O"][0], -3.0 - free["O"][1])
    assert places == {name: (x + shift[0], y + shift[1]) for name, (x, y) in free.items()}


def test_a_long_chain_and_many_components_do_not_recurse() -> None:
    """In no more calls within calls than a network of half the size may take."""
    names, limit = suite.members("N", 300), sys.getrecursionlimit()
    chain = NamedProblem("long", names, [("N", names)], suite.named(pairwise(names))).canonical()
    paired = suite.named(zip(names[::2], names[1::2], strict=True))
    pairs = NamedProblem("pairs", names, [(n, [n]) for n in names], paired).canonical()
    sys.setrecursionlimit(len(inspect.stack()) + 150)
    try:
        for problem in (chain, pairs):
            assert len(set(LayeredEngine().lay_out(problem).positions.values())) == 300
    finally:
        sys.setrecursionlimit(limit)


def test_the_same_bytes_whatever_the_hash_seed() -> None:
    """In another process, where sets are in another order."""
    code = "from layout_conformance import tangle, use_case_one; from test_layout_engines import _made\n"
    code += "print(_made(tangle(), 'layered') + _made(use_case_one(), 'layered'), end='')"
    seed = "0" if os.environ.get("PYTHONHASHSEED") != "0" else "7"
    environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(Path(__file__).parent)}
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert run.stdout == _made(suite.tangle(), "layered") + _made(suite.use_case_one(), "layered")
    assert "C1 -> K1" in run.stdout


@examples(8)
@given(problem=suite.problems(), random=st.randoms(use_true_random=False))
def test_the_order_of_the_spec_does_not_show(problem: LayoutProblem, random: object) -> None:
    assert hasattr(random, "shuffle")
    names, groups = list(problem.neurons), [(g.name, [problem.neurons[m] for m in g.members]) for g in problem.groups]
    edges = [(e.name, problem.neurons[e.source], problem.neurons[e.target], e.delay) for e in problem.edges]
    pins = [(problem.neurons[i], point) for i, point in problem.pins.items()]
    boxes = [(name, [problem.neurons[m] for m in of]) for name, of in problem.boxes]
    places = list(zip(problem.neurons, problem.places, strict=False))
    for parts in (names, groups, edges, pins, boxes, places):
        random.shuffle(parts)
    shuffled = NamedProblem(
        problem.network, names, groups, edges, dict(pins), problem.direction, boxes=boxes, places=dict(places)
    ).canonical()
    assert shuffled == problem
    for engine in ("layered", "organic"):
        assert _made(shuffled, engine) == _made(problem, engine)


def _made(problem: LayoutProblem, engine: str) -> str:
    """The layout file, or why there is none: pins may put a neuron into a frame that is not its own."""
    try:
        return dump(lay_out_problem(problem, engine))
    except LayoutRefusalError as refusal:
        return str(refusal)


def test_the_same_network_under_other_names_in_the_same_order_lies_the_same() -> None:
    problem = suite.use_case_one()
    renamed = NamedProblem(
        "other",
        [f"x{name}" for name in problem.neurons],
        [(f"x{g.name}", [f"x{problem.neurons[m]}" for m in g.members]) for g in problem.groups],
        [
            (f"x{a} -> x{b}", f"x{a}", f"x{b}", e.delay)
            for e in problem.edges
            for a, b in [(problem.neurons[e.source], problem.neurons[e.target])]
        ],
        boxes=[(name, [f"x{problem.neurons[m]}" for m in of]) for name, of in problem.boxes],
    ).canonical()
    first, second = lay_out_problem(problem), lay_out_problem(renamed)
    assert list(first.positions.values()) == list(second.positions.values())
    assert list(first.routes.values()) == list(second.routes.values())


@given(
    st.lists(st.tuples(st.floats(-50, 50), st.floats(0.1, 9), st.floats(0, 3)), min_size=1, max_size=12),
)
def test_spread_keeps_distances_and_cannot_be_bettered(items: list[tuple[float, float, float]]) -> None:
    wishes, weights, gaps = (list(column) for column in zip(*items, strict=True))
    places = spread(wishes, weights, gaps)
    assert all(b - a >= gap - 1e-9 for (a, b), gap in zip(pairwise(places), gaps, strict=False))

    def cost(line: list[float]) -> float:
        return float(sum(w * (x - wish) * (x - wish) for w, x, wish in zip(weights, line, wishes, strict=True)))

    # convex: it is the best if no shift of a stretch that keeps the distances is better
    for i in range(len(places)):
        for j in range(i, len(places)):
            for step in (-1e-3, 1e-3):
                other = [x + step if i <= k <= j else x for k, x in enumerate(places)]
                if all(b - a >= gap - 1e-12 for (a, b), gap in zip(pairwise(other), gaps, strict=False)):
                    assert cost(other) >= cost(places) - 1e-9


def test_ranks_are_tight_and_loops_are_cut_once() -> None:
    arcs = {(0, 1): 1.0, (1, 2): 1.0, (3, 2): 1.0}
    assert ranks_of(4, arcs, frozenset(), frozenset()) == [0, 1, 2, 1]
    loop = {(0, 1): 1.0, (1, 2): 1.0, (2, 0): 1.0}
    assert ranks_of(3, loop, frozenset(), frozenset()) == [0, 1, 2]
    assert ranks_of(3, loop, frozenset({1}), frozenset()) == [2, 0, 1]


@pytest.mark.parametrize("how", ["row", "column", "grid", "ring", "arc"])
@given(count=st.integers(2, 40))
def test_formations_keep_their_spacing(how: Arrangement, count: int) -> None:
    points = offsets(how, count, 1.0)
    nearest = min(distance(a, b) for i, a in enumerate(points) for b in points[:i])
    assert abs(nearest - 1) < 0.005


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=4, max_size=20, unique=True))
def test_fitting_to_pins_leaves_no_overlap(cells: list[tuple[int, int]]) -> None:
    free: list[Point] = [(float(x), float(y)) for x, y in cells]
    pins = {0: (0.5, 0.5), 2: (3.3, 2.1)}
    places, shift, moved = fit(free, pins)
    assert places[0] == pins[0]
    assert places[2] == pins[2]
    for i, one in enumerate(places):
        assert all(distance(one, other) >= 0.6 for other in places[:i])
        if i not in moved:
            assert one == (free[i][0] + shift[0], free[i][1] + shift[1])
