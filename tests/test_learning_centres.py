"""Centres that learn: what a target that combines by distance compares with what arrives is moved by a rule."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import exported

import neurovis_spec as nv

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """\
neurovis: 1
name: centres
time: {steps: 30, episode: 10, dt: 0.5}
parameters: {c: 0.75}
rules:
  move:
    parameters: {rate: 0.25}
    state: {moved: {each_step: moved + abs(pre - centre)}}
    centre: {each_step: centre + rate*post*(pre - centre), each_episode: centre + 0.5}
  drift: {centre: {derivative: -centre}}
inputs: {x: {expression: sin(k)}, y: {expression: cos(k)}}
neurons:
  X: {input: x}
  Y: {input: y}
  M: {count: 2, combine: distance, activation: {gaussian: {sigma: 2}}}
connections:
  X -> M: {centre: [[c, -0.5]], delay: 0, plasticity: [move, decay]}
  Y -> M: {centre: c, weight: 0.5, plasticity: drift}
  M1 -> M2: {centre: c/3, weight: 0.25}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_arrives_is_compared_with_what_a_rule_makes_of_the_centre(backend: str) -> None:
    recording = nv.compile_text(SPEC).run(backend=backend, states=["all"])
    x, y, m = np.sin(np.arange(30)), np.cos(np.arange(30)), recording.activity[:, 2:]
    centre, drift, weight = np.array([0.75, -0.5]), np.array([0.75, 0.75]), 1.0
    for k in range(30):
        arriving = (weight * x[k] - centre) ** 2
        arriving += ((0.5 * y[k - 1] if k else 0.0) - drift) ** 2
        arriving[1] += ((0.25 * m[k - 1, 0] if k else 0.0) - 0.25) ** 2
        np.testing.assert_allclose(m[k], np.exp(-2 * arriving), rtol=1e-12)
        centre, weight = centre + 0.25 * m[k] * (x[k] - centre), weight - 0.01 * weight
        if k:
            drift = drift + 0.5 * -drift
        if k % 10 == 9:
            centre = centre + 0.5
        for number, name in enumerate(("M1", "M2")):
            assert recording[f"(X -> {name}).centre"][k] == pytest.approx(centre[number], rel=1e-12)
            assert recording[f"(Y -> {name}).centre"][k] == pytest.approx(drift[number], rel=1e-12)
    # of the weights those of X alone learn
    assert [recording.neurons[2:], recording.plastic.tolist()] == [("M1", "M2"), [0, 1]]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_centre_that_learns_is_set_by_no_parameter_and_goes_on_from_a_checkpoint(
    backend: str, tmp_path: Path
) -> None:
    network = nv.compile_text(SPEC)
    simulation = network.simulator(backend=backend)
    simulation.step()
    owners = [owner for owner, own in simulation.state().cells.items() if "centre" in own]
    before = [simulation.state().cells[owner]["centre"].copy() for owner in owners]
    simulation.set({"c": 3})
    for owner, centres in zip(owners, before, strict=True):
        np.testing.assert_array_equal(simulation.state().cells[owner]["centre"], centres)
    simulation.save_state(tmp_path / "state")
    other = network.simulator(backend=backend)
    other.restore(tmp_path / "state")
    for one in (simulation, other):
        for _ in range(5):
            one.step()
    np.testing.assert_array_equal(other.activity, simulation.activity)
    untouched = network.simulator(backend=backend)
    for _ in range(6):
        untouched.step()
    assert untouched.activity[3] != simulation.activity[3]  # M1 -> M2 follows the parameter


def test_a_centre_is_recorded_by_name_where_its_rule_has_no_states() -> None:
    recording = nv.compile_text(SPEC).run(states=["(Y -> M).centre"])
    halved = 0.75 * 0.5 ** np.arange(30) + 0 * recording["(Y -> M).centre"].T  # dt is 0.5
    np.testing.assert_allclose(recording["(Y -> M).centre"], halved.T)


def test_an_output_may_be_a_centre() -> None:
    network = nv.compile_text(SPEC + "outputs: {place: (X -> M).centre}\n")
    assert network.run()["place"].shape == (30, 2)


@pytest.mark.compiler
def test_centres_learn_in_exported_c(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC)
    recording = network.run(backend="reference")
    controller = exported(network, tmp_path / "c")
    for k in range(30):
        controller.step()
        np.testing.assert_array_equal(controller.activity, recording.activity[k])
