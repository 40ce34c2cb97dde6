"""Lines that are drawn already, and ways that cross few of them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.routing.channel_routing import channels
from neurovis_layouts.routing.channel_search import way
from neurovis_layouts.routing.curves import Waypoint
from neurovis_layouts.routing.lines import CutLines, crossed
from neurovis_layouts.routing.rows import OccupiedRows

import neurovis_spec as nv
from neurovis_spec.layout import LayoutEdge
from neurovis_spec.layout.geometry import sampled

points = st.tuples(st.integers(-9, 9), st.integers(-9, 9)).map(lambda p: (float(p[0]), float(p[1])))


@given(st.lists(points, min_size=2, max_size=8), st.floats(-9, 9), st.floats(-9, 9))
def test_lines_pass_heights_where_they_are(line: list[tuple[float, float]], one: float, other: float) -> None:
    top, bottom = min(one, other), max(one, other)
    lines = CutLines()
    lines.add(line)
    above, below = lines.between(top, bottom)
    # by hand: the line as runs that go one way, each of which passes both heights or not
    runs: list[list[tuple[float, float]]] = [[line[0]]]
    for before, point in pairwise(line):
        rise = point[1] - before[1]
        if rise and runs[-1][-1][1] != runs[-1][0][1] and (rise > 0) != (runs[-1][-1][1] > runs[-1][0][1]):
            runs.append([before])
        runs[-1].append(point)
    heights = [sorted(y for _, y in run) for run in runs]
    assert len(above) == sum(ys[0] <= top and bottom <= ys[-1] and ys[0] < ys[-1] for ys in heights)
    xs = [x for x, _ in line]
    for x in (*above.tolist(), *below.tolist()):
        assert min(xs) <= x <= max(xs)


def test_a_step_crosses_what_changes_sides() -> None:
    lines = np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, 2.0])
    assert crossed(np.array([-1.0, 1.5]), np.array([-1.0, 2.5]), lines).tolist() == [[0, 2], [2, 2]]


def test_a_way_takes_the_longer_side_of_a_disc_rather_than_cross_a_line() -> None:
    centres = [(0.0, 0.0), (0.0, 8.0), (0.2, 4.0)]
    edge = {0: LayoutEdge("a", 0, 1, 1)}
    line = ((-3.0, -0.5), (-2.0, 1.0), (-1.0, 2.5), (-0.1, 4.0), (-1.0, 5.5), (-2.0, 7.0), (-3.0, 8.5))
    plain = channels(edge, centres, [], {})[0][0]
    wary = channels(edge, centres, [], {}, [line])[0][0]
    assert plain
    assert all(way.x < 0.2 for way in plain)
    assert wary
    assert all(way.x > 0.2 for way in wary)


def test_a_way_is_not_straight_before_and_behind_a_bend_for_longer_than_to_the_next() -> None:
    centres = [(0.0, 0.0), (0.0, 4.0), (-1.0, 1.4), (1.0, 1.2), (0.0, 1.0), (1.0, 1.0)]
    ways = channels({0: LayoutEdge("a", 0, 1, 1)}, centres, [], {})[0][0]
    assert len(ways) == 2
    assert all(way.half > 0 for way in ways)
    stops = [Waypoint(*centres[0]), *ways, Waypoint(*centres[1])]
    assert all(before.y + before.half < after.y - after.half for before, after in pairwise(stops))


@pytest.mark.parametrize(("sources", "targets"), [(4, 8), (3, 5), (5, 5), (8, 4)])
def test_full_layers_beside_a_frame_run_as_if_there_were_none(sources: int, targets: int) -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nmodules: {m: {neurons: {a: {}}}}\ninstances: {x: {module: m}}\n"
        f"neurons: {{I: {{count: {sources}, bias: 1}}, H: {{count: {targets}}}}}\n"
        "connections: {I -> H: {pattern: all_to_all, weight: 1}, H -> x.a: 1}\n"
    )
    layout = network.layout("layered")
    for name, route in layout.routes.items():
        if not name.endswith("x.a"):
            high, low = route[0][1], route[-1][1]
            assert all(high - 0.5 <= y <= low + 0.5 for _, y in sampled(route, 0.1)), name


@given(
    st.lists(points, min_size=2, max_size=12, unique=True),
    st.lists(st.lists(points, min_size=2, max_size=4), max_size=4),
    st.floats(0.5, 2.0),
)
@settings(deadline=None)
def test_a_way_is_given_up_only_where_it_costs_more_than_the_limit(
    centres: list[tuple[float, float]], drawn: list[list[tuple[float, float]]], share: float
) -> None:
    rows = OccupiedRows(centres, [], 1)
    for line in drawn:
        rows.lines.add(line)
        rows.use((x, y) for (x, _), y in zip(line, rows.between(-9, 9, frozenset()), strict=False))
    cost, path = way(rows, (0, 1))
    found = way(rows, (0, 1), limit=cost * share)
    assert found == (cost, path) if share >= 1 else found[0] in (cost, math.inf)


def test_a_search_ends_where_the_limit_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    """A way through twenty rows that may cost no more than the straight line sees few of them, where it has to go round
    the first neuron."""
    rows = OccupiedRows([(0.0, 0.0), (0.0, 20.0), *((0.0, float(y)) for y in range(1, 20))], [], 1)
    asked: list[float] = []
    free = rows.free

    def counted(y: float, own: frozenset[int]) -> list[tuple[float, float]]:
        asked.append(y)
        return free(y, own)

    monkeypatch.setattr(rows, "free", counted)
    assert math.isinf(way(rows, (0, 1), limit=20.0)[0])
    assert len(set(asked)) < 4
