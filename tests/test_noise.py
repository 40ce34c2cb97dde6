"""Noise: drawn anew at each step, from the seed, the group's name, the neuron and the step alone."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.draws import Stream

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
