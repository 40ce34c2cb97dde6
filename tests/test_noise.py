"""Noise: drawn anew at each step, from the seed, the group's name, the neuron and the step alone."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.runtime import inputs
from neurovis_spec.runtime.inputs import InputReader

SPEC = """
neurovis: 1
name: noisy
seed: 5
parameters: {level: 0.5}
inputs: {push: {expression: 0.1*k}}
neurons:
  A: {count: 3, noise: "normal(i, level) if k >= 2 else 0", bias: 10, input: push}
  B: {count: 2, noise: "uniform(0, 1) - uniform(0, 1)"}
  C: {}
"""


def test_it_is_the_stated_draw_added_to_the_drive() -> None:
    recording = nv.compile_text(SPEC).run(300)
    i, k = np.arange(3), np.arange(300).reshape(-1, 1)
    drawn = i + 0.5 * Stream(5, "noise", "A").normal(i, 0, k, 0)
    expected = (10 + 0.1 * k) + np.where(k >= 2, drawn, 0.0)
    np.testing.assert_allclose(recording["A"], expected, rtol=0, atol=1e-12)
    stream = Stream(5, "noise", "B")
    j = np.arange(2)
    np.testing.assert_array_equal(recording["B"], stream.uniform(j, 0, k, 0) - stream.uniform(j, 0, k, 1))
    assert (recording["C"] == 0).all()


def test_backends_and_ways_of_running_draw_the_same() -> None:
    network = nv.compile_text(SPEC)
    whole = network.run(260).activity
    np.testing.assert_array_equal(network.run(260, backend="reference").activity, whole)
    simulation = network.simulator()
    for k in range(260):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, whole[k])


def test_other_seeds_draw_other_numbers_and_other_groups_do_not_matter() -> None:
    network = nv.compile_text(SPEC)
    assert (nv.compile_text(SPEC, seed=6).run(9)["B"] != network.run(9)["B"]).all()
    without = nv.compile_text(SPEC.replace("  C: {}\n", ""))
    np.testing.assert_array_equal(without.run(9)["B"], network.run(9)["B"])
    assert nv.compile_text(SPEC, seed=6).hash != network.hash


def test_a_parameter_of_the_noise_can_be_set_in_a_run() -> None:
    simulation = nv.compile_text(SPEC).simulator()
    for _ in range(5):
        simulation.step()
    simulation.set(level=0)
    simulation.step()
    np.testing.assert_allclose(simulation.activity[:3], 10.5 + np.arange(3), rtol=0, atol=1e-12)


def test_noise_that_draws_nothing_is_a_finding() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {noise: 0.5}}")
    assert [(d.code, d.span.line, d.span.column) for d in caught.value.diagnostics] == [("no-draw", 3, 22)]


def test_noise_is_drawn_as_it_is_needed() -> None:
    """A step of 20,000 neurons takes the memory of some steps, not of hundreds: 256 of them would be 40 MB and more."""
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 20000, noise: 'normal(0, 1)'}}\ninputs: {s: {expression: sin(k)}}"
    ).network
    reader = InputReader(network)
    tracemalloc.start()
    reader.at(0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8 << 20


def test_how_many_steps_are_drawn_at_once_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 30, noise: 'exp(normal(0, 1)) * sin(k + i) + uniform(0, t)'}}\n"
        "inputs: {s: {expression: sin(k/7)*exp(-k)}, v: {values: [[1, 2], [3, 4]]}}"
    ).network
    whole = np.stack(list(InputReader(network).rows(200, 600)))
    assert whole.shape == (400, 33)
    for values in (1, 100, 1000, 1 << 20):
        monkeypatch.setattr(inputs, "_MOST_VALUES", values)
        reader = InputReader(network)
        assert np.array_equal(np.stack(list(reader.rows(200, 600))), whole)
        assert np.array_equal(reader.at(317), whole[117])


def test_normal_numbers_in_pieces_are_those_that_are_drawn_one_by_one() -> None:
    stream = Stream(3, "noise", "A")
    i, step = np.arange(9000).reshape(1, -1), np.array([[0], [7], [2**32 + 1]])
    drawn = stream.normal(i, 0, step, 2)
    assert drawn.shape == (3, 9000)
    for row, column in ((0, 0), (1, 8191), (1, 8192), (2, 8999)):
        assert drawn[row, column] == stream.normal(column, 0, int(step[row, 0]) % 2**32, 2)
    assert stream.uniform(np.zeros((0, 4), int), 0, 0, 0).shape == (0, 4)
