"""Pathways: all connections between two groups, added up, what excites apart from what inhibits."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from test_scene_thinned import ENTRY, network_of

import neurovis_spec as nv
from neurovis_spec.scene.pathways import pathways

SPEC = """
neurovis: 1
name: loop
time: {dt: 0.01}
neurons: {E: {count: 4, bias: 1}, I: {count: 2}, O: {}}
connections:
  E -> I: {pattern: all_to_all, weight: 0.5, delay: 2}
  E1 -> I: {weight: -0.25, plasticity: {hebbian: {rate: 0.01}}}
  I -> E: {pattern: all_to_all, weight: -1}
  I -> O: 2
"""


def test_a_pathway_has_its_strands_its_rules_and_its_delays() -> None:
    network = nv.compile_text(SPEC).network
    found = {one.name(network): one for one in pathways(network)}
    assert list(found) == ["E -> I", "I -> E", "I -> O"]
    mixed = found["E -> I"]
    assert [(one.end, one.count, one.total) for one in mixed.strands] == [(1, 8, 4.0), (-1, 2, -0.5)]
    assert (mixed.count, mixed.total, mixed.size, mixed.delays) == (10, 3.5, 4.5, (1, 2))
    assert [rule.partition("(")[0] for rule in mixed.rules] == ["hebbian"]
    assert [(one.end, one.count, one.total) for one in found["I -> E"].strands] == [(-1, 8, -8.0)]
    assert found["I -> O"].rules == ()


@given(
    st.lists(st.integers(1, 6), min_size=4, max_size=4),
    st.lists(ENTRY, min_size=1, max_size=5, unique_by=lambda entry: entry[:2]),
    st.data(),
)
@settings(max_examples=15, deadline=None)
def test_each_of_some_connections_is_in_one_strand(
    counts: list[int], entries: list[tuple[str, str, str, str]], data: st.DataObject
) -> None:
    network = network_of(counts, entries).network
    ends, group = network.connections, [one.name for one in network.neurons.groups for _ in one.indices]
    some = np.array(data.draw(st.lists(st.booleans(), min_size=len(ends), max_size=len(ends))), bool)
    weights = ends.weights.whole()
    seen: list[int] = []
    for one in pathways(network, some):
        seen += one.members.tolist()
        assert {f"{group[ends.sources[index]]} -> {group[ends.targets[index]]}" for index in one.members.tolist()} == {
            one.name(network)
        }
        for strand in one.strands:
            assert set((weights[strand.members] < 0).tolist()) == {strand.end < 0}
            assert strand.total == weights[strand.members].sum()
    assert sorted(seen) == np.flatnonzero(some).tolist()
