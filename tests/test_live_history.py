"""Traces of the live view: what was noted is read as it was, in bins, in bounded memory, and after a branch anew."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.live.history import Bins, Members, Recorded, Ring
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Set
from neurovis_spec.live.view import view_of

SPEC = """neurovis: 1
name: live
time: {dt: 0.05, steps: 40}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
neurons:
  A: {count: 3, activation: tanh, bias: 0.4}
  B: {activation: tanh}
connections:
  A -> B: {weight: -0.5, plasticity: {hebbian: {rate: 0.05}}}
  B -> A: pull
"""
COMPILED = nv.compile_text(SPEC)
RECORDING = COMPILED.run(steps=40)


def neurons(*indices: int) -> Members:
    return Members(True, np.array(indices))


def connections(*indices: int) -> Members:
    return Members(False, np.array(indices))


@pytest.mark.parametrize("recorded", [False, True])
def test_a_trace_is_what_a_run_records(recorded: bool) -> None:
    source: RecordedSource | SimulatedSource
    source = RecordedSource(COMPILED.network, RECORDING) if recorded else SimulatedSource(COMPILED.simulator())
    while source.step < 39:
        source.advance()
    each = Bins(0, 1, 40)
    for index in range(4):
        read = source.history.read(neurons(index), each)
        assert np.array_equal(read[:, 0], read[:, 1])
        assert np.allclose(read[:, 0], RECORDING.activity[:, index], rtol=1e-6)
    weights = np.array([RECORDING.snapshot(step).weights for step in range(40)])
    for index in range(6):
        assert np.allclose(source.history.read(connections(index), each)[:, 0], weights[:, index], rtol=1e-6)
    least, most = source.history.read(neurons(3), Bins(8, 4, 3)).T
    rows = RECORDING.activity[8:20, 3].reshape(3, 4)
    assert np.allclose(least, rows.min(axis=1), rtol=1e-6)
    assert np.allclose(most, rows.max(axis=1), rtol=1e-6)


def test_several_are_joined_and_what_is_unknown_is_no_number() -> None:
    history = Recorded(RECORDING)
    joined = history.read(neurons(0, 3), Bins(30, 1, 12))[:, 0]
    assert np.allclose(joined[:10], RECORDING.activity[30:, [0, 3]].mean(axis=1), rtol=1e-6)
    assert np.isnan(joined[10:]).all()
    total = history.read(connections(0, 5), Bins(30, 1, 1))[0, 0]
    assert total == pytest.approx(RECORDING.snapshot(30).weights[[0, 5]].sum(), rel=1e-6)


def test_a_ring_holds_the_latest_steps_in_bounded_memory() -> None:
    ring = Ring(2, 1, room=100 * 12)
    for step in range(5, 1000):
        ring.note(step, np.array([step, -step]), np.array([2.0]))
    first, last = ring.steps
    assert last == 999
    assert 70 < last - first <= 100
    read = ring.read(neurons(1), Bins(0, 1, 1200))[:, 0]
    assert np.isnan(read[:first]).all()
    assert read[first:1000].tolist() == [-step for step in range(first, 1000)]
    assert np.isnan(read[1000:]).all()


def test_a_ring_forgets_another_future_and_steps_noted_again_stay() -> None:
    ring = Ring(1, 0)
    for step in range(50):
        ring.note(step, np.array([1.0]), np.zeros(0))
    ring.note(20, np.array([9.0]), np.zeros(0))
    ring.cut(30)
    assert ring.steps == (0, 30)
    ring.note(31, np.array([2.0]), np.zeros(0))
    assert ring.read(neurons(0), Bins(19, 1, 14))[:, 0].tolist()[:13] == [1.0] * 12 + [2.0]
    ring.cut(-1)
    assert np.isnan(ring.read(neurons(0), Bins(0, 1, 50))).all()
    ring.note(7, np.array([3.0]), np.zeros(0))
    assert ring.steps == (7, 7)


def test_what_is_huge_or_no_number_is_read_without_a_warning() -> None:
    ring = Ring(2, 0)
    ring.note(0, np.array([1e300, np.nan]), np.zeros(0))
    ring.note(1, np.array([-1e300, 1.0]), np.zeros(0))
    assert ring.read(neurons(0), Bins(0, 2, 1)).tolist() == [[-np.inf, np.inf]]
    assert ring.read(neurons(1), Bins(0, 2, 1)).tolist() == [[1.0, 1.0]]


def test_a_turn_makes_another_future_in_traces() -> None:
    source = SimulatedSource(COMPILED.simulator())
    while source.step < 30:
        source.advance()
    before = source.history.read(neurons(0), Bins(0, 1, 31))
    source.go(10)
    assert np.array_equal(source.history.read(neurons(0), Bins(0, 1, 31)), before), "looking back forgets nothing"
    source.turn(Set({"pull": 0.9}))
    assert np.isnan(source.history.read(neurons(0), Bins(11, 1, 20))).all()
    source.go(10)
    while source.step < 30:
        source.advance()
    after = source.history.read(neurons(0), Bins(0, 1, 31))
    assert np.array_equal(after[:11], before[:11])
    assert (after[12:] != before[12:]).all()


def test_items_of_a_view_stand_for_what_is_gathered() -> None:
    text = SPEC + "render: {collapse: [A]}\n"
    compiled = nv.compile_text(text)
    view = view_of(compiled, compiled.gains)
    found = [view.members(item) for item in ("n0", "n1", "c0", "c1", "n2", "c2")]
    assert [None if one is None else (one.neurons, one.indices.tolist()) for one in found] == [
        (True, [0, 1, 2]), (True, [3]), (False, [0, 1, 2]), (False, [3, 4, 5]), None, None,
    ]  # fmt: skip
