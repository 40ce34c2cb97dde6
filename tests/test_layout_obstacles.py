"""Routes that come too close to a disc: all at once the same as one by one."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_layouts.routing.bows import MANY_TRIES, BowSought, clear_bows
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles

from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.model import Point, Route

#: Centres stand on a lattice, so that no two discs overlap.
places = st.tuples(st.integers(-6, 6), st.integers(-6, 6)).map(lambda at: (0.75 * at[0], 1.25 * at[1]))
points = st.tuples(st.floats(-6, 6, allow_nan=False), st.floats(-8, 8, allow_nan=False))


@given(st.lists(places, min_size=2, max_size=25, unique=True), st.data())
@settings(deadline=None)
def test_what_runs_over_a_disc_has_too_small_a_clearance(centres: list[Point], data: st.DataObject) -> None:
    obstacles = Obstacles(centres)
    ends = st.tuples(st.integers(0, len(centres) - 1), st.integers(0, len(centres) - 1))
    own = data.draw(st.lists(ends, min_size=1, max_size=12))
    routes: list[Route] = []
    for source, target in own:
        between = data.draw(st.lists(points, min_size=2, max_size=2) | st.lists(points, min_size=5, max_size=5))
        routes.append((centres[source], *between, centres[target]))
    found = obstacles.run_over(routes, own)
    assert found == [obstacles.clearance(route, ends) < TOUCH for route, ends in zip(routes, own, strict=True)]


@pytest.mark.parametrize(("middle", "over"), [((5.0, 0.29), True), ((5.0, 0.31), False), ((5.0, -0.29), True)])
def test_a_line_runs_over_a_disc_beside_it_but_not_over_its_own_ends(middle: Point, over: bool) -> None:
    obstacles = Obstacles([(0.0, 0.0), (10.0, 0.0), middle])
    line = straight((0.0, 0.0), (10.0, 0.0))
    assert obstacles.run_over([line], [(0, 1)]) == [over]
    assert obstacles.run_over([line], [(0, 2)]) == [True]


def test_a_disc_between_two_points_of_a_line_is_not_overlooked() -> None:
    """However far apart the points are that are looked up."""
    for shift in range(20):
        obstacles = Obstacles([(0.0, 0.0), (10.0, 0.0), (5.0 + shift / 50, 0.2995)])
        assert obstacles.clearance(straight((0.0, 0.0), (10.0, 0.0)), (0, 1)) == pytest.approx(0.2995)


def test_nothing_is_run_over_where_there_is_nothing() -> None:
    assert Obstacles(()).run_over([straight((0.0, 0.0), (1.0, 0.0))], [(0, 1)]) == [False]
    assert Obstacles([(0.0, 0.0)]).run_over([], []) == []


@given(st.lists(places, min_size=2, max_size=20, unique=True), st.data())
@settings(deadline=None)
def test_bows_found_together_are_those_found_one_by_one(centres: list[Point], data: st.DataObject) -> None:
    obstacles = Obstacles(centres)
    ends = st.lists(st.integers(0, len(centres) - 1), min_size=2, max_size=2, unique=True)
    wishes = [
        BowSought(centres[a], centres[b], (a, b), least, sided)
        for (a, b), least, sided in data.draw(
            st.lists(st.tuples(ends, st.sampled_from([0.0, 0.2, -0.4]), st.booleans()), min_size=1, max_size=6)
        )
    ]
    together = clear_bows(wishes, obstacles, MANY_TRIES, None)
    assert together == [clear_bows([wish], obstacles, MANY_TRIES, None)[0] for wish in wishes]
    for wish, (route, clearance, height) in zip(wishes, together, strict=True):
        assert (route[0], route[-1]) == (wish.start, wish.end)
        assert clearance == obstacles.clearance(route, wish.own)
        assert not wish.sided or height * wish.least >= 0
        if clearance < REACH - 0.03:  # then the flattest, among others, is no better
            flat, _, _ = clear_bows([wish], Obstacles(()), MANY_TRIES, None)[0]
            assert obstacles.clearance(flat, wish.own) <= clearance


@pytest.mark.parametrize("along", [100.3 + 0.2 * k for k in range(8)])
def test_a_disc_beside_a_long_line_is_not_missed(along: float) -> None:
    """Its points are no farther apart than those of a short one."""
    line = straight((0.0, 0.0), (900.0, 120.0))
    assert Obstacles([(along, along * 120 / 900 + 0.2)]).clearance(line, (-1, -1)) == pytest.approx(0.2, abs=0.01)
