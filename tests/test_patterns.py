"""Patterns that count, draw or measure: values by hand, laws and statistics."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiler.connections import patterns_drawn
from neurovis_spec.compiler.connections.ends import Ends
from neurovis_spec.compiler.values.draws import Stream

Edges = list[tuple[int, int]]


def pairs(pattern: str, neurons: str = "A: {count: 6}", ends: str = "A -> A", more: str = "", seed: int = 1) -> Edges:
    """The connections of one entry by the neurons' names' order in the spec."""
    spec = f"neurovis: 1\nname: x\nneurons: {{{neurons}}}\nconnections: {{{ends}: {{pattern: {pattern}{more}}}}}"
    made = nv.compile_text(spec, seed=seed).network.connections
    return list(zip(made.sources.tolist(), made.targets.tolist(), strict=True))


def ends_of(n: int, m: int, same: bool, loops: bool | None = None) -> Ends:
    start = 0 if same else n
    return Ends(np.arange(n), np.arange(start, start + m), loops)


def test_band_by_hand() -> None:
    assert pairs("{band: {width: 1}}", "A: {count: 3}") == [(0, 1), (1, 0), (1, 2), (2, 1)]
    with_self = pairs("{band: {width: 1}}", "A: {count: 3}", more=", self: true")
    assert with_self == [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 1), (2, 2)]
    unequal = pairs("{band: {width: 1}}", "A: {count: 5}, B: {count: 2}", "A -> B")
    assert unequal == [(0, 5), (0, 6), (1, 5), (1, 6), (2, 6)]
    assert pairs("{band: {width: 99}}", "A: {}, B: {count: 2}", "A -> B") == [(0, 1), (0, 2)]


def test_nearest_by_index() -> None:
    found = pairs("{nearest: {count: 2}}", "A: {count: 5}")
    assert found == [(0, 1), (0, 2), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2), (3, 4), (4, 2), (4, 3)]
    found = pairs("{nearest: {count: 2}}", "A: {count: 5}, B: {count: 3}", "A -> B")
    assert found == [(0, 5), (0, 6), (1, 5), (1, 6), (2, 6), (2, 7), (3, 6), (3, 7), (4, 6), (4, 7)]


def test_nearest_by_position_and_ties_by_index() -> None:
    places = "position: [[0, 0], [9, 0], [1, 0], [0, 1], [-1, 0]]"
    found = pairs("{nearest: {count: 2}}", f"A: {{count: 5, {places}}}")
    assert [j for i, j in found if i == 0] == [2, 3]
    assert [j for i, j in found if i == 1] == [0, 2]
    huge = "position: [[0, 0], [3.0e+300, 0], [1.0e+300, 0]]"
    assert pairs("{nearest: {count: 1}}", f"A: {{count: 3, {huge}}}") == [(0, 2), (1, 2), (2, 0)]


@given(st.integers(1, 9), st.integers(1, 9), st.booleans(), st.booleans(), st.data())
@settings(max_examples=60, deadline=None)
def test_laws_of_the_fixed_degrees(n: int, m: int, same: bool, loops: bool, data: st.DataObject) -> None:
    ends = ends_of(n, m, same, loops)
    stream = Stream(data.draw(st.integers(0, 5)), "edges", "A -> B")
    for make, own in ((patterns_drawn.fixed_outdegree, ends), (patterns_drawn.fixed_indegree, ends.reversed())):
        most = len(own.targets) - bool((own.excluded() >= 0).any())
        if not most:
            continue
        count = data.draw(st.integers(1, most))
        i, j = make(ends, np.full(len(own.sources), count), stream)
        found = list(zip(i.tolist(), j.tolist(), strict=True))
        assert found == sorted(set(found))
        assert set(Counter(i.tolist() if own is ends else j.tolist()).values()) == {count}
        assert len(found) == count * len(own.sources)
        assert loops or not (ends.sources[i] == ends.targets[j]).any()


@given(st.integers(3, 12), st.booleans(), st.sampled_from([0.0, 0.4, 1.0]), st.data())
@settings(max_examples=60, deadline=None)
def test_laws_of_the_small_world(n: int, loops: bool, rewire: float, data: st.DataObject) -> None:
    degree = 2 * data.draw(st.integers(1, (n - 1) // 2))
    ends = ends_of(n, n, data.draw(st.booleans()), loops)
    i, j = patterns_drawn.small_world(ends, degree, rewire, Stream(3, "edges", "A -> B"))
    found = list(zip(i.tolist(), j.tolist(), strict=True))
    assert found == sorted(set(found))
    assert np.bincount(i, minlength=n).tolist() == [degree] * n
    assert loops or not (ends.sources[i] == ends.targets[j]).any()
    around = np.minimum((i - j) % n, (j - i) % n)
    assert rewire or ((around >= 1) & (around <= degree // 2)).all()


@pytest.mark.parametrize("cells", [1, 40, 1 << 20])
def test_no_pair_depends_on_how_many_rows_are_made_at_once(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ends, stream = ends_of(13, 13, True), Stream(1, "edges", "A -> A")

    def made() -> list[list[int]]:
        parts = (
            patterns_drawn.fixed_outdegree(ends, np.full(13, 5), stream),
            patterns_drawn.fixed_indegree(ends, np.full(13, 5), stream),
            patterns_drawn.small_world(ends, 6, 0.5, stream),
        )
        return [array.tolist() for part in parts for array in part]

    expected = made()
    monkeypatch.setattr(patterns_drawn, "_CELLS", cells)
    assert made() == expected


def test_a_partial_shuffle_in_plain_python() -> None:
    stream = Stream(1, "edges", "A -> A")
    i, j = patterns_drawn.fixed_outdegree(ends_of(7, 7, True), np.full(7, 4), stream)
    for row in range(7):
        slots = [target for target in range(7) if target != row]
        for number in range(4):
            place = number + int(float(stream.uniform(row, 0, 0, number)) * (6 - number))
            slots[number], slots[place] = slots[place], slots[number]
        assert j[i == row].tolist() == sorted(slots[:4])


def test_a_small_world_in_plain_python() -> None:
    stream = Stream(1, "edges", "A -> A")
    i, j = patterns_drawn.small_world(ends_of(9, 9, True), 4, 0.6, stream)
    for row in range(9):
        free = [(row + ahead) % 9 for ahead in range(3, 7)]
        own = []
        for offset in (1, -1, 2, -2):
            old = new = (row + offset) % 9
            if float(stream.uniform(row, old, 0, 0)) < 0.6:
                place = int(float(stream.uniform(row, old, 0, 1)) * 4)
                new, free[place] = free[place], old
            own.append(new)
        assert j[i == row].tolist() == sorted(own)


def test_every_choice_is_equally_likely() -> None:
    ends = ends_of(6000, 5, False)
    i, j = patterns_drawn.fixed_outdegree(ends, np.full(6000, 2), Stream(1, "edges", "x"))
    sets = Counter(map(tuple, j.reshape(-1, 2).tolist()))
    assert len(sets) == 10
    assert sum((seen - 600) ** 2 / 600 for seen in sets.values()) < 27.9  # chi², 9 degrees of freedom, 0.1 %
    i, j = patterns_drawn.small_world(ends_of(2000, 2000, True), 10, 0.3, Stream(1, "edges", "x"))
    around = np.minimum((i - j) % 2000, (j - i) % 2000)
    assert abs(np.count_nonzero(around > 5) - 6000) < 4 * (20000 * 0.3 * 0.7) ** 0.5


@pytest.mark.parametrize("pattern", ["{fixed_indegree: {count: 2}}", "{small_world: {degree: 2, rewire: 0.5}}"])
def test_pairs_depend_on_seed_and_name_alone(pattern: str) -> None:
    alone = pairs(pattern)
    assert alone == pairs(pattern)
    assert alone != pairs(pattern, seed=2)
    assert alone != pairs(pattern, "B: {count: 6}", "B -> B")
    behind = pairs(pattern, "Z: {count: 3}, A: {count: 6}")
    assert [(i - 3, j - 3) for i, j in behind] == alone


def test_a_single_neuron_chooses_and_is_chosen() -> None:
    assert len(pairs("{fixed_outdegree: {count: 2}}", "A: {}, B: {count: 4}", "A -> B")) == 2
    assert pairs("{fixed_indegree: {count: 1}}", "A: {}, B: {count: 2}", "A -> B") == [(0, 1), (0, 2)]
    assert pairs("{nearest: {count: 1}}", "A: {}") == [(0, 0)]
