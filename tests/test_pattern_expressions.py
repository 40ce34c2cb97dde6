"""Patterns by expressions: probabilities of pairs, counts of neurons, pairs that are drawn several times."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_patterns import ends_of, pairs

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.connections import pair_formulas
from neurovis_spec.compiler.connections.ends import Ends
from neurovis_spec.compiler.connections.patterns_drawn import fixed_indegree, fixed_outdegree, total
from neurovis_spec.compiler.values.draws import Stream, philox4x32

PLACED = "A: {count: 6, position: [[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [5, 0]]}"
CELLS = """
neurovis: 1
name: x
parameters: {g: 2}
models: {cell: {parameters: {tau: 1}, activity: drive}}
neurons: {A: {count: 3, bias: 1, model: {cell: {tau: "g + i"}}}, B: {count: 2, model: {cell: {tau: 5}}}}
connections: {A -> B: {weight: pre.tau*post.tau + j, pattern: all_to_all}}
"""


def uniform(stream: Stream, i: int, j: int) -> float:
    """What decides about a pair, in plain Python."""
    words = philox4x32(np.array([i, j // 16, 0, 0], dtype=np.uint32), stream.key)
    byte = int(words[j % 16 // 4]) >> 8 * (j % 4) & 255
    return (byte + float(stream.uniform(i, j, 0, 1))) / 256


def test_each_pair_is_decided_by_a_number_of_its_own() -> None:
    stream, n = Stream(1, "edges", "A -> A"), 40
    chances = np.random.default_rng(1).random((3, n))
    row, target = stream.chosen(np.array([4, 7, 9]), chances)
    found = set(zip(row.tolist(), target.tolist(), strict=True))
    for place, i in enumerate((4, 7, 9)):
        for j in range(n):
            assert ((place, j) in found) == (uniform(stream, i, j) < chances[place, j])


@pytest.mark.parametrize(("chance", "there"), [(0.0, 0), (1.0, 600), (2.0**-60, 0)])
def test_none_and_all(chance: float, there: int) -> None:
    assert len(Stream(1, "edges", "x").chosen(np.arange(3), np.full((3, 200), chance))[0]) == there


def test_as_often_as_the_probability_says() -> None:
    """Whether a byte decides or what is behind it."""
    for chance in (0.003, 0.3, 0.5, 0.9961):
        row, _ = Stream(3, "edges", "x").chosen(np.arange(200), np.full((200, 1000), chance))
        assert abs(len(row) - 200_000 * chance) < 4 * (200_000 * chance * (1 - chance)) ** 0.5


def test_a_probability_by_distance() -> None:
    stream = Stream(1, "edges", "A -> A")
    expected = [
        (i, j) for i in range(6) for j in range(6) if i != j and uniform(stream, i, j) < np.exp(-abs(i - j) / 2)
    ]
    assert pairs("{random: {probability: exp(-distance/2)}}", PLACED) == expected
    # whatever else there is in the network
    behind = pairs("{random: {probability: exp(-distance/2)}}", f"Z: {{count: 3}}, {PLACED}")
    assert [(i - 3, j - 3) for i, j in behind] == expected


@pytest.mark.parametrize("cells", [1, 7, 12, 1 << 20])
def test_no_pair_depends_on_how_many_are_made_at_once(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pair_formulas, "_CELLS", cells)
    assert pairs("{random: {probability: (1 + i + j)/12}}") == [
        (i, j)
        for i in range(6)
        for j in range(6)
        if i != j and uniform(Stream(1, "edges", "A -> A"), i, j) < (1 + i + j) / 12
    ]


def test_a_probability_that_is_a_number_is_drawn_by_gaps_as_ever() -> None:
    number = pairs("{random: {probability: 0.5}}")
    assert pairs("{random: {probability: 3/n_from}}") == number != pairs("{random: {probability: 0.5 + 0*i}}")


@pytest.mark.compiler
def test_weights_follow_parameters_of_both_ends() -> None:
    network = nv.compile_text(CELLS)
    assert network.network.connections.weights.whole().tolist() == [10, 11, 15, 16, 20, 21]
    for backend in ("reference", "numpy", "c"):
        sim = network.simulator(backend=backend)
        sim.set(g=3)
        sim.step()
        sim.step()
        assert sim.connection_weights.tolist() == [15, 16, 20, 21, 25, 26]
        assert sim.activity[3:].tolist() == [60, 63]


def test_what_a_probability_reads_is_structural() -> None:
    text = CELLS.replace("all_to_all", "{random: {probability: pre.tau/9}}")
    with pytest.raises(ValueError, match="'g'"):
        nv.compile_text(text).simulator(backend="numpy").set(g=3)


def test_counts_of_each_neuron() -> None:
    found = Counter(j for _, j in pairs("{fixed_indegree: {count: j}}", more=", self: true"))
    assert found == {j: j for j in range(1, 6)}
    found = Counter(i for i, _ in pairs("{fixed_outdegree: {count: 5 - i}}"))
    assert found == {i: 5 - i for i in range(5)}
    assert pairs("{nearest: {count: i % 3}}", PLACED) == [(1, 0), (2, 1), (2, 3), (4, 3), (5, 3), (5, 4)]
    drawn = Counter(i for i, _ in pairs('{fixed_outdegree: {count: "uniform(0, 5)"}}', "A: {count: 40}"))
    assert set(drawn.values()) == {1, 2, 3, 4, 5}


def test_who_has_more_has_what_who_has_fewer_has() -> None:
    """The choices come one behind the other, however many there are."""
    few = set(pairs("{fixed_outdegree: {count: 2}}"))
    assert few < set(pairs("{fixed_outdegree: {count: 2 + i % 3}}"))


@given(st.integers(1, 7), st.integers(1, 7), st.booleans(), st.booleans(), st.booleans(), st.data())
@settings(max_examples=60, deadline=None)
def test_laws_of_a_total(n: int, m: int, same: bool, loops: bool, multapses: bool, data: st.DataObject) -> None:
    ends = ends_of(n, m, same, loops)
    there = n * m - int((ends.excluded() >= 0).sum())
    count = data.draw(st.integers(0, (2 * there if multapses else there) if there else 0))
    i, j = total(ends, count, Stream(data.draw(st.integers(0, 5)), "edges", "A -> B"), multapses)
    found = list(zip(i.tolist(), j.tolist(), strict=True))
    assert len(found) == count
    assert found == sorted(found if multapses else set(found))
    assert loops or not (ends.sources[i] == ends.targets[j]).any()
    assert not count or (max(i) < n and max(j) < m)


def test_every_set_of_a_total_is_equally_likely() -> None:
    ends, sets = ends_of(2, 3, False), Counter[tuple[int, ...]]()
    for count, many in ((2, 15), (4, 15)):
        sets.clear()
        for seed in range(600):
            i, j = total(ends, count, Stream(seed, "edges", "x"))
            sets[tuple((3 * i + j).tolist())] += 1
        assert len(sets) == many
        assert sum((seen - 40) ** 2 / 40 for seen in sets.values()) < 36.1  # chi², 14 degrees of freedom, 0.1 %


def test_multapses_are_drawn_with_repetition() -> None:
    ends, stream = Ends(np.arange(1000), np.arange(1000, 1004)), Stream(1, "edges", "x")
    _, j = fixed_outdegree(ends, np.full(1000, 8), stream, multapses=True)
    assert sum((seen - 2000) ** 2 / 2000 for seen in np.bincount(j)) < 16.3  # 3 degrees of freedom, 0.1 %
    for make in (fixed_indegree, fixed_outdegree):
        own = Ends(np.arange(4), np.arange(4), False)
        i, j = make(own, np.full(4, 9), stream, multapses=True)
        assert len(i) == 36
        assert not (i == j).any()


def test_connections_of_one_pair_have_numbers_of_their_own() -> None:
    spec = """
neurovis: 1
name: x
neurons: {A: {}, B: {}}
connections:
  A -> B: {weight: "uniform(0, 1)", delay: "uniform(0, 50)", pattern: {total: {count: 4, multapses: true}}}
"""
    made = nv.compile_text(spec).network.connections
    weights: FloatArray = made.weights.whole()
    assert len(set(weights.tolist())) == 4
    assert len(set(made.delays.whole().tolist())) > 1
    once = nv.compile_text(spec.replace("{total: {count: 4, multapses: true}}", "all_to_all")).network.connections
    assert weights[0] == once.weights.whole()[0]


def where(condition: str, neurons: str = "A: {count: 6}", more: str = "") -> list[tuple[int, int]]:
    spec = f"neurovis: 1\nname: x\nneurons: {{{neurons}}}\nconnections: {{A -> A: {{where: {condition}{more}}}}}"
    made = nv.compile_text(spec, seed=1).network.connections
    return list(zip(made.sources.tolist(), made.targets.tolist(), strict=True))


def test_where_makes_exactly_the_pairs_of_which_it_holds() -> None:
    assert where("floor(j/3) == i", more=", self: true") == [(0, 0), (0, 1), (0, 2), (1, 3), (1, 4), (1, 5)]
    assert where("floor(j/3) == i") == [(0, 1), (0, 2), (1, 3), (1, 4), (1, 5)]
    assert where("distance == 1", PLACED) == pairs("{band: {width: 1}}")
    assert where("i == j - 1, pattern: all_to_all") == pairs("chain")


@pytest.mark.parametrize("pattern", ["ring", "{band: {width: 2}}", "{random: {probability: 0.5}}", "all_to_all"])
def test_where_beside_a_pattern_leaves_out_what_it_does_not_hold_of(pattern: str) -> None:
    assert where(f"i < j, pattern: {pattern}") == [(i, j) for i, j in pairs(pattern) if i < j]


def test_of_a_symmetric_entry_where_may_hold_either_way() -> None:
    both = where("i == 0 or j == 0", more=", symmetric: true")
    assert both == where("i == 0", more=", symmetric: true")
    assert both == [pair for j in range(1, 6) for pair in ((0, j), (j, 0))]


def test_no_more_pairs_are_looked_at_than_may_be() -> None:
    spec = "neurovis: 1\nname: x\nneurons: {A: {count: 300000}}\nconnections: {A -> A: "
    for entry in ("{where: i == j}", "{pattern: {random: {probability: 0*i}}}"):
        with pytest.raises(nv.SpecError, match="looks at 90,000,000,000 pairs; the limit is 1,000,000,000"):
            nv.compile_text(f"{spec}{entry}}}")


def test_where_makes_no_more_than_there_is_room_for() -> None:
    spec = "neurovis: 1\nname: x\nneurons: {A: {count: 20}}\nconnections: {A -> A: {where: i + j < 3}}"
    assert len(nv.compile_text(spec, limit=10).network.connections) == 4
    with pytest.raises(nv.SpecError, match="4 connections; the limit is 3"):
        nv.compile_text(spec.replace("20", "15"), limit=3)
