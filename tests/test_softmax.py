"""softmax: groups whose activities are shares of 1, in every backend and in exported C."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from exported import exported
from hypothesis import given
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.softmax import share, shared

ACTS = """
neurovis: 1
name: acts
time: {dt: 0.1}
inputs: {wave: {size: 3, expression: (k + 2*i) % 5 - 2}}
activations: {hot: {parameters: {beta: 3}, value: beta*x, softmax: true}}
models:
  slow: {state: {v: {each_step: v + 0.5*(drive - v)}}, activity: f(v)}
  cell: {state: {v: {derivative: drive - v}}, activity: v}
modules: {choice: {neurons: {P: {count: 2, bias: i, activation: softmax}}}}
instances: {m: {module: choice, count: 2}}
neurons:
  X: {count: 3, input: wave}
  Y: {count: 3, activation: softmax, initial: [0.2, 0.3, 0.5]}
  Z: {count: 4, activation: hot, model: slow, bias: 0.1*i}
  V: {count: 2, model: cell, bias: 0.5}
  W: {count: 2, activation: softmax}
  O: {}
connections:
  X -> Y: {pattern: one_to_one, delay: 0}
  Y -> Z: {weight: 1 - 0.3*j + 0.2*i, pattern: all_to_all, delay: 0, plasticity: {hebbian: {rate: 0.01}}}
  Z -> Y: {weight: -0.5, pattern: all_to_all}
  Y -> V: {weight: 1 + j, pattern: all_to_all, delay: 0}
  V -> W: {pattern: one_to_one, delay: 0}
  W -> V: {pattern: one_to_one, weight: -1}
  Z -> O: {weight: i, delay: 2}
events:
  - {at: 3, lesion: Y2}
  - {from: 5, to: 9, clamp: {Z1: 0.75}}
  - {from: 7, to: 8, clamp: {Z2: 0.5}}
  - {at: 10, mend: Y2}
"""


def close(found: FloatArray, expected: object) -> None:
    """As far as exp of NumPy may differ from that of the C library."""
    np.testing.assert_allclose(found, np.asarray(expected), rtol=1e-12, atol=1e-13)


def test_the_shares_by_hand() -> None:
    network = nv.compile_text(ACTS)
    activity = network.run(steps=12, backend="reference").activity
    at = {name: place for place, name in enumerate(network.network.neurons.names)}
    x, y, z = (
        [at[f"{group}{number + 1}"] for number in range(count)] for group, count in zip("XYZ", (3, 3, 4), strict=True)
    )
    assert activity[0, y].tolist() == [0.2, 0.3, 0.5]
    drive = activity[1, x] - 0.5 * activity[0, z].sum()
    np.testing.assert_allclose(activity[1, y], np.exp(drive) / np.exp(drive).sum(), rtol=1e-14)
    np.testing.assert_allclose(activity[1:, y].sum(axis=1), 1, rtol=1e-14)
    assert (activity[3:10, y[1]] == 0).all()
    assert (activity[5:9, z[0]] == 0.75).all()
    np.testing.assert_allclose(activity[:, z].sum(axis=1), [*[1] * 7, 1.25, *[1] * 4], rtol=1e-14)
    assert activity[7, z[2:]].tolist() == [0, 0]  # the others leave nothing
    np.testing.assert_allclose(activity[0, [at["m1.P1"], at["m1.P2"]]], [1 / (1 + math.e), math.e / (1 + math.e)])


@given(st.lists(st.tuples(st.floats(-800, 800), st.booleans(), st.integers(0, 3)), min_size=1, max_size=12))
def test_number_by_number_and_as_arrays(members: list[tuple[float, bool, int]]) -> None:
    members = sorted(members, key=lambda one: one[2])
    values, free = np.array([one[0] for one in members]), np.array([one[1] for one in members])
    groups = [one[2] for one in members]
    starts = np.array([place for place, one in enumerate(groups) if groups.index(one) == place] + [len(groups)])
    found = share(values, free, starts)
    for begin, end in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        expected = shared(values[begin:end].tolist(), free[begin:end].tolist())
        close(found[begin:end], expected)
        others = math.fsum(values[begin:end][~free[begin:end]])
        if free[begin:end].any() and others < 1:
            assert math.isclose(math.fsum(expected), 1, rel_tol=1e-9, abs_tol=1e-9 * max(1, abs(others)))


def test_numpy_and_c_share_alike() -> None:
    network = nv.compile_text(ACTS)
    expected, found = (network.run(steps=14, backend=one) for one in ("reference", "numpy"))
    close(found.activity, expected.activity)


@pytest.mark.compiler
def test_c_and_exported_c_give_the_same_bits(tmp_path: Path) -> None:
    network = nv.compile_text(ACTS)
    expected = network.run(steps=14, backend="reference").activity
    np.testing.assert_array_equal(network.run(steps=14, backend="c").activity, expected)
    controller = exported(network, tmp_path)
    for row in expected:
        controller.step()
        np.testing.assert_array_equal(controller.activity, row)


@pytest.mark.compiler
def test_a_large_group_in_c() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 700, bias: i % 7, activation: softmax}, B: {count: 9}}\n"
    text += "connections: {A -> B: {weight: i + j, pattern: all_to_all, delay: 0}}"
    network = nv.compile_text(text)
    expected, found = (network.run(steps=2, backend=one).activity for one in ("reference", "c"))
    np.testing.assert_array_equal(found, expected)


def test_the_hash_knows_which_neurons_share() -> None:
    one, other = (
        f"neurovis: 1\nname: x\nneurons: {{{groups}}}"
        for groups in (
            "A: {names: [A, B, C, D], bias: 1, activation: softmax}",
            "G: {names: [A, B], bias: 1, activation: softmax}, H: {names: [C, D], bias: 1, activation: softmax}",
        )
    )
    assert nv.compile_text(one).run(steps=1).activity[0].tolist() == [0.25] * 4
    assert nv.compile_text(other).run(steps=1).activity[0].tolist() == [0.5] * 4
    assert nv.compile_text(one).network.hash != nv.compile_text(other).network.hash
