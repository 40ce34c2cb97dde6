"""What stays of too many lines: every neuron and every pathway, what is most of what drives its target; and the bundles
are of what is missing."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.scene import teachers
from neurovis_spec.scene.shown import Shown, shown
from neurovis_spec.scene.teachers import guides_of, teachers_of

#: Two rings that two groups drive, each neuron all of them; the wires of the rings are the weak ones.
RING = """
neurovis: 1
name: rings
neurons: {V: {count: 16, bias: 1}, C: {count: 16, bias: 1}, L: {count: 64}, R: {count: 64}}
connections:
  L -> L: {pattern: ring, weight: 0.3}
  R -> R: {pattern: ring, weight: 0.3}
  V -> L + R: {pattern: all_to_all, weight: "uniform(-1, 1)"}
  C -> L: {pattern: all_to_all, weight: "uniform(-1, 1)"}
  C -> R: {pattern: all_to_all, weight: 1}
layout: {engine: grid}
"""
#: Cells that excite and inhibit each other by many weak connections, and strong single wires to and from them.
CELLS = """
neurovis: 1
name: cells
neurons: {S: {count: 60, bias: 1}, E: {count: 60}, I: {count: 30}, O: {count: 60}}
connections:
  S -> E: {pattern: one_to_one, weight: 1}
  E -> O: {pattern: one_to_one, weight: 1}
  E -> I: {pattern: all_to_all, weight: "0.05 + uniform(0, 0.02)"}
  I -> E: {pattern: all_to_all, weight: "-0.1 - uniform(0, 0.05)"}
layout: {engine: grid}
"""


def pathways(network: CompiledNetwork, lines: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Counter[tuple[str, str]]:
    """How many of these lines run from each group to each other."""
    whole = network.network
    group = [one.name for one in whole.neurons.groups for _ in one.indices]
    ends = zip(whole.connections.sources[lines].tolist(), whole.connections.targets[lines].tolist(), strict=True)
    return Counter((group[source], group[target]) for source, target in ends)


def seen_of(network: CompiledNetwork, most: int | None = None) -> Shown:
    """What a picture shows of a network whose lines are all as long as each other."""
    whole = network.network
    wanted = replace(whole.render, most=most)
    return shown(whole, wanted, np.abs(whole.connections.weights.whole()), np.ones(len(whole.connections)))


@pytest.mark.parametrize("text", [RING, CELLS.replace("count: 30", "count: 25")], ids=["rings", "cells"])
def test_no_pathway_is_gone_and_the_picture_says_of_which_some_are(text: str) -> None:
    network = nv.compile_text(text)
    scene = scene_of(network, network.run(1).snapshot(0))
    names = [group.data["connection"] for group in scene.groups if "connection" in group.data]
    drawn = Counter(tuple(re.sub(r"\d", "", end) for end in name.split(" -> ")) for name in names)
    there = pathways(network, np.ones(len(network.network.connections), bool))
    assert set(drawn) == set(there)
    assert len(names) == 1000
    bundles = {g.data["pathway"]: int(g.data["count"]) for g in scene.groups if "pathway" in g.data}
    assert bundles == {" -> ".join(ends): of - drawn[ends] for ends, of in there.items() if of > drawn[ends]}
    for single in (("L", "L"), ("R", "R"), ("S", "E"), ("E", "O")):
        assert drawn[single] == there[single], "a single wire is much of what drives its target"


def test_a_cell_that_drives_many_is_seen_to_drive_one() -> None:
    network = nv.compile_text(CELLS.replace("count: 30", "count: 25"))
    whole, lines = network.network, seen_of(network).lines
    group = [one.name for one in whole.neurons.groups for _ in one.indices]
    ends = zip(whole.connections.sources[lines].tolist(), whole.connections.targets[lines].tolist(), strict=True)
    assert len({source for source, target in ends if (group[source], group[target]) == ("E", "I")}) == 60


GROUPS = ("A", "B", "C", "D")
ENTRY = st.tuples(
    st.sampled_from(GROUPS),
    st.sampled_from(GROUPS),
    st.sampled_from(("all_to_all", "ring", "random")),
    st.sampled_from(("0", "0.5", "1", "-2", "normal(0, 1)")),
)


def network_of(counts: list[int], entries: list[tuple[str, str, str, str]]) -> CompiledNetwork:
    """A network of groups of so many neurons."""
    neurons = [f"  {name}: {{count: {count}}}" for name, count in zip(GROUPS, counts, strict=True)]
    lines = []
    for source, target, pattern, weight in entries:
        kind = "all_to_all" if pattern == "ring" and source != target else pattern
        kind = "random: {probability: 0.7}" if kind == "random" else kind
        kind = f"{{{kind}}}" if ":" in kind else kind
        lines.append(f'  {source} -> {target}: {{pattern: {kind}, weight: "{weight}"}}')
    return nv.compile_text("\n".join(["neurovis: 1", "name: x", "neurons:", *neurons, "connections:", *lines, ""]))


@given(
    st.lists(st.integers(1, 12), min_size=4, max_size=4),
    st.lists(ENTRY, min_size=1, max_size=6, unique_by=lambda entry: entry[:2]),
    st.floats(0, 1),
)
@settings(max_examples=30, deadline=None)
def test_neurons_and_pathways_keep_their_strongest_and_the_rest_is_left(
    counts: list[int], entries: list[tuple[str, str, str, str]], room: float
) -> None:
    network = network_of(counts, entries)
    whole, ends = network.network, network.network.connections
    every = np.ones(len(ends), bool)
    there, count = pathways(network, every), len(ends)
    touched = set(ends.sources.tolist()) | set(ends.targets.tolist())
    least = min(count, len(touched) + len(there))
    most = least + int(room * (count - least))
    seen = seen_of(network, most)
    lines, sizes = seen.lines, np.abs(ends.weights.whole())
    assert lines.sum() == min(most, count)
    drawn = pathways(network, lines)
    assert set(drawn) == set(there)
    assert set(ends.sources[lines].tolist()) | set(ends.targets[lines].tolist()) == touched
    for neuron in set(ends.targets.tolist()):
        own = ends.targets.whole() == neuron
        assert sizes[own & lines].max() == sizes[own].max()
    group = np.array([one.name for one in whole.neurons.groups for _ in one.indices])
    for source, target in there:
        own = (group[ends.sources.whole()] == source) & (group[ends.targets.whole()] == target)
        assert sizes[own & lines].max() == sizes[own].max()
    assert (seen.left == ~lines).all()
    if most < count:
        (note,) = seen.notes
        assert note.startswith(f"{count - most:,} of {count:,} connections are left out, the weakest that")
        assert " all of " not in note
    else:
        assert seen.notes == ()


@given(st.lists(ENTRY, min_size=2, max_size=4, unique_by=lambda entry: entry[:2]), st.data())
@settings(max_examples=12, deadline=None)
def test_the_order_of_a_spec_decides_nothing(entries: list[tuple[str, str, str, str]], data: st.DataObject) -> None:
    orders = [network_of([5, 6, 7, 4], list(one)) for one in permutations(entries)][:6]
    most = data.draw(st.integers(0, len(orders[0].network.connections)))
    drawn = [
        {name for name, kept in zip(one.network.connection_names, seen_of(one, most).lines, strict=True) if kept}
        for one in orders
    ]
    assert all(some == drawn[0] for some in drawn)


def test_where_nothing_is_kept_the_notes_say_so() -> None:
    network = network_of([3, 3, 3, 3], [("A", "B", "all_to_all", "1"), ("B", "C", "all_to_all", "1")])
    ends = network.network.connections
    assert ", and all of 9 neurons, to" in seen_of(network, 0).notes[0]
    for most in range(1, 18):
        seen = seen_of(network, most)
        gone = 9 - len(set(ends.sources[seen.lines].tolist()) | set(ends.targets[seen.lines].tolist()))
        said = re.search(r"all of (\d+) neuron", seen.notes[0])
        assert gone == (0 if said is None else int(said[1]))
        assert (gone > 0) == (most < 8), (
            "one to each of B and C, and one from each of the two of A that none of these is from"
        )


def test_of_many_dotted_lines_there_is_one_a_signal_from_group_to_group(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a one-to-one signal of many one from the middle to the middle; of few each; of too many one each."""
    network = nv.compile_text(
        "neurovis: 1\nname: taught\nneurons: {A: {bias: 1}, T: {count: 15}, B: {count: 15}, G: {}, D: {count: 9}}\n"
        "connections:\n"
        "  A -> B: {pattern: all_to_all, weight: 0.1, plasticity: {delta: {target: T}}}\n"
        "  A -> D: {pattern: all_to_all, weight: 0.1, plasticity: {delta: {target: G}}}\n"
        "render: {labels: false}\nlayout: {engine: grid}\n"
    )
    guides, said = guides_of(network.network, teachers_of(network.network))
    assert [one.count for one in guides] == [15, *(1,) * 9]
    assert not said
    scene = scene_of(network, network.run(1).snapshot(0))
    assert not scene.notes
    lines = {group.data["signal"]: group for group in scene.groups if "signal" in group.data}
    assert set(lines) == {"T -> B", *(f"G -> D{k}" for k in range(1, 10))}
    assert lines["T -> B"].title == "T ⇢ B · 15\nT is the target of delta"
    assert lines["T -> B"].data["count"] == "15"
    assert "count" not in lines["G -> D1"].data
    monkeypatch.setattr(teachers, "_MOST", 9)
    guides, said = guides_of(network.network, teachers_of(network.network))
    assert [(one.count, len(one.sources), len(one.targets)) for one in guides] == [(15, 15, 15), (9, 1, 9)]
    assert not said
    monkeypatch.setattr(teachers, "_MOST", 1)
    guides, said = guides_of(network.network, teachers_of(network.network))
    assert [one.count for one in guides] == [15]
    assert said == ("1 of 2 dotted lines of rules are left out",)
