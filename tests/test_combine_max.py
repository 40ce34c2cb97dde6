"""combine: max: the greatest signal that arrives, with the same bits in every backend and in exported C."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import exported

import neurovis_spec as nv
from neurovis_spec.runtime.reference_seen import greatest

BY_HAND = """
neurovis: 1
name: greatest
neurons:
  A: {bias: 1}
  B: {bias: -2}
  M: {combine: max, bias: 0.5}
  N: {combine: max}
  L: {combine: max}
connections:
  A -> M: -3
  B -> M: {weight: 1, delay: 2}
  A -> N: -4
  B -> N: {weight: 0}
events:
  - {at: 4, lesion: B -> N}
  - {at: 6, lesion: A -> N}
  - {at: 8, mend: B -> N}
"""
#: many connections, few, none; from neurons, with delays and factors, of synapses, and at the stages of a derivative
EVERYTHING = """
neurovis: 1
name: everything
time: {dt: 0.1}
seed: 3
parameters: {g: 0.5}
inputs: {wave: {expression: k % 5 - 2}}
models:
  cell: {ports: {best: max}, state: {v: {derivative: best - v + drive/9}}, activity: "clip(v, -1, 1)", send: v}
synapses: {weak: {signal: "weight*clip(sent, -0.5, 0.5)"}}
neurons:
  S: {count: 40, bias: "normal(0, 1)", input: wave, activation: clip}
  F: {count: 3, combine: max, input: wave}
  W: {count: 9, combine: max, activation: clip, bias: g/9}
  C: {count: 5, model: cell, initial: {v: 0.1*i}}
connections:
  - S -> W: {weight: "normal(0, g)", pattern: {random: {probability: 0.6}}, delay: 2}
    S1..S3 -> F: {weight: 1 - 2*i, pattern: all_to_all, plasticity: {hebbian: {rate: 0.01}}}
    W -> C: {weight: g, pattern: {random: {probability: 0.7}}, port: {best: 0.5, drive: 1}}
    C -> C: {weight: -0.4, pattern: all_to_all, port: best}
    W -> F: {weight: 0.3, pattern: all_to_all, synapse: weak}
events:
  - {at: 5, set: {g: 0.9}}
  - {at: 9, lesion: [W -> F, S1, C2 -> C1]}
  - {at: 14, mend: [W -> F, C2 -> C1]}
"""


def test_the_greatest_signal_by_hand() -> None:
    activity = nv.compile_text(BY_HAND).run(steps=11, backend="reference").activity
    assert activity[:, 2].tolist() == [0.5, 0.5, *[-1.5] * 9]  # B's first signal comes at step 2: before, it is 0
    assert activity[:, 3].tolist() == [0, 0, 0, 0, -4, -4, 0, 0, 0, 0, 0]
    assert not np.signbit(activity[:, 3:]).any() or (activity[:, 3] < 0).any()
    assert activity[:, 4].tolist() == [0] * 11


def test_of_equal_ones_it_is_0_and_what_is_no_number_stays() -> None:
    assert str(greatest([-0.0, 0.0])) == str(greatest([0.0, -0.0])) == str(greatest([-0.0])) == "0.0"
    assert np.isnan(greatest([1.0, np.nan, 2.0]))


@pytest.mark.parametrize("text", [BY_HAND, EVERYTHING], ids=["by_hand", "everything"])
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_every_backend_gives_the_same_bits(text: str, backend: str) -> None:
    network = nv.compile_text(text)
    expected, found = (network.run(steps=20, backend=one) for one in ("reference", backend))
    np.testing.assert_array_equal(found.activity.view(np.int64), expected.activity.view(np.int64))


@pytest.mark.compiler
@pytest.mark.parametrize("text", [BY_HAND, EVERYTHING], ids=["by_hand", "everything"])
def test_exported_c_gives_the_same_bits(text: str, tmp_path: Path) -> None:
    network = nv.compile_text(text)
    expected, controller = network.run(steps=20, backend="reference").activity, exported(network, tmp_path)
    for row in expected:
        controller.step()
        np.testing.assert_array_equal(controller.activity.view(np.int64), row.view(np.int64))
