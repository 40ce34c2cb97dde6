"""``nearest`` by position against the plain version, which compares every pair."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.connections.ends import Ends
from neurovis_spec.compiler.connections.patterns_near import nearest


def plain(ends: Ends, counts: IntArray) -> list[tuple[int, int]]:
    """Every source with its nearest targets, by squared distance, then by index."""
    found = []
    for i, (source, at) in enumerate(zip(ends.sources, ends.source_places, strict=True)):
        apart = (at[0] - ends.target_places[:, 0]) ** 2 + (at[1] - ends.target_places[:, 1]) ** 2
        order = [j for j in np.argsort(apart, kind="stable").tolist() if ends.loops or ends.targets[j] != source]
        found += [(i, j) for j in sorted(order[: counts[i]])]
    return found


def agree(ends: Ends, counts: IntArray) -> None:
    i, j = nearest(ends, counts)
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == plain(ends, counts)


def places_of(kind: str, n: int, random: np.random.Generator) -> FloatArray:
    """Positions that are spread, on a lattice (ties), in clusters, on a line, or all the same."""
    if kind == "lattice":
        return np.stack(np.divmod(np.arange(n), 17), axis=1).astype(np.float64)
    if kind == "clusters":
        centres = random.integers(-3, 3, (n, 2)) * 1e6
        return np.asarray(centres + random.normal(size=(n, 2)) * 1e-3)
    if kind == "line":
        return np.stack((random.integers(0, 40, n), np.zeros(n)), axis=1).astype(np.float64)
    return np.zeros((n, 2)) if kind == "same" else random.uniform(-1, 1, (n, 2))


@pytest.mark.parametrize("kind", ["spread", "lattice", "clusters", "line", "same"])
@pytest.mark.parametrize("loops", [True, None])
@pytest.mark.parametrize("count", [1, 5, 40])
def test_one_group_as_all_pairs_say(kind: str, loops: bool | None, count: int) -> None:
    places = places_of(kind, 700, np.random.default_rng(3))
    index = np.arange(700)
    agree(Ends(index, index, loops, places, places), np.full(700, count))


@given(st.integers(1, 90), st.integers(2, 300), st.integers(0, 99), st.data())
@settings(max_examples=40, deadline=None)
def test_two_ends_as_all_pairs_say(n: int, m: int, seed: int, data: st.DataObject) -> None:
    random = np.random.default_rng(seed)
    everywhere = random.integers(-6, 6, (n + m, 2)) / 2 if seed % 2 else random.normal(size=(n + m, 2))
    sources, targets = np.arange(n), random.permutation(n + m)[:m]
    ends = Ends(sources, targets, data.draw(st.sampled_from([True, None])), everywhere[sources], everywhere[targets])
    most = m - bool((ends.excluded() >= 0).any())
    agree(ends, random.integers(0, data.draw(st.integers(0, most)) + 1, n))


@given(st.integers(1, 40), st.integers(2, 40), st.integers(0, 99), st.sampled_from([True, None]))
@settings(max_examples=40, deadline=None)
def test_by_index_as_on_a_line(n: int, m: int, seed: int, loops: bool | None) -> None:
    """Where no neuron has a position, |i - j| is the distance."""
    random, nowhere = np.random.default_rng(seed), np.full((n + m, 2), np.nan)
    line = np.stack((np.arange(n + m), np.zeros(n + m)), axis=1).astype(np.float64)
    sources, targets = np.arange(n), random.permutation(n + m)[:m]
    ends = Ends(sources, targets, loops, nowhere[:n], nowhere[:m])
    most = m - bool((ends.excluded() >= 0).any())
    counts = random.integers(0, most + 1, n)
    i, j = nearest(ends, counts)
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == plain(
        Ends(sources, targets, loops, line[:n], line[:m]), counts
    )
