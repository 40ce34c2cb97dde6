"""Rules whose states and weights have derivatives, and that see states of both ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import exported

import neurovis_spec as nv

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """\
neurovis: 1
name: flowing
time: {dt: 0.1 ms, steps: 50, integrate: METHOD}
models:
  still: {time: ms, state: {v: {initial: 1, derivative: 0}, u: {each_step: u + 1}}, activity: v}
  growing: {time: ms, parameters: {tau: 4}, state: {v: {initial: 1, derivative: v/tau}}, activity: v}
rules:
  trace:
    time: ms
    state: {x: {derivative: pre.v}, y: {derivative: post.v}}
    weight: {each_step: weight}
  fill:
    time: ms
    parameters: {tau: 2, rate: 0.5}
    state:
      a: {derivative: (pre.v - a)/tau}
      count: {each_step: count + 1}
    weight: {derivative: rate*a*post.tau + 0*count}
  sample:
    state: {was: {each_step: pre.u}, now: {each_step: post.v}, here: {each_step: sent}}
    weight: {each_step: weight}
neurons: {K: {model: still}, O: {model: growing}, P: {model: growing}}
connections:
  K -> O: {weight: 0.25, delay: 1, port: drive, plasticity: [fill, sample], bounds: [0, 2]}
  O -> P: {weight: 0, delay: 3, plasticity: {trace: {}}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_state_flows_and_the_weight_goes_along_its_derivative(backend: str) -> None:
    """a' = (1 − a)/τ from the first step on; w moves by dt·f behind each step but the first, within its bounds."""
    recording = nv.compile_text(SPEC.replace("METHOD", "exponential")).run(backend=backend, states=["all"])
    steps = np.arange(50)
    # what was sent before step 0 was nothing, so that ``pre.v`` is 1 from step 1 on, as ``delay: 1`` has it
    a = 1 - np.exp(-np.maximum(steps, 0) * 0.1 / 2)
    np.testing.assert_allclose(recording["(K -> O).a"], a, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(recording["(K -> O).count"], steps + 1)
    weight = 0.25
    for k in steps:
        assert recording.weights[k, 0] == pytest.approx(weight, rel=1e-12)
        if k > 0:
            weight = min(weight + 0.1 * 0.5 * a[k] * 4, 2)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_read_of_both_ends_is_of_the_end_of_the_step(backend: str) -> None:
    recording = nv.compile_text(SPEC.replace("METHOD", "rk4")).run(backend=backend, states=["all"])
    u = recording["K.u"]
    np.testing.assert_array_equal(recording["(K -> O).was"], np.append(0, u[:-1]))
    np.testing.assert_array_equal(recording["(K -> O).now"], recording["O.v"])
    np.testing.assert_array_equal(recording["(K -> O).here"], recording["K.v"])


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("method", "error"), [("rk4", 1e-6), ("heun", 2e-3), ("euler", 0.25)])
def test_the_target_is_seen_at_each_stage_and_the_source_as_it_was_sent(
    method: str, error: float, backend: str
) -> None:
    """∫ e^(t/τ) of the target, which flows; of the source, which is held, the sum of its steps."""
    recording = nv.compile_text(SPEC.replace("METHOD", method)).run(backend=backend, states=["all"])
    t = 0.1 * np.arange(50)
    np.testing.assert_allclose(recording["(O -> P).y"], 4 * (np.exp(t / 4) - 1), atol=error)
    sent = np.concatenate([np.zeros(3), recording["O.v"][:-3]])
    expected = np.append(0, np.cumsum(sent[1:]) * 0.1)
    np.testing.assert_allclose(recording["(O -> P).x"], expected, rtol=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_connection_that_does_not_learn_stays_as_it_is(backend: str) -> None:
    simulation = nv.compile_text(SPEC.replace("METHOD", "rk4")).simulator(backend=backend)
    for _ in range(10):
        simulation.step()
    simulation.learning("K -> O", False)
    before = simulation.state().copy()
    for _ in range(5):
        simulation.step()
    state = simulation.state()
    assert state.weights[0] == before.weights[0]
    fill, _, trace = (owner for owner in state.cells if owner.kind == "rule")
    for name in ("a", "count"):
        np.testing.assert_array_equal(state.cells[fill][name], before.cells[fill][name])
    assert state.cells[trace]["y"][0] > before.cells[trace]["y"][0]
    simulation.learning("K -> O", True)
    simulation.step()
    assert simulation.state().cells[fill]["a"][0] > before.cells[fill]["a"][0]


@pytest.mark.compiler
@pytest.mark.parametrize("method", ["rk4", "semi_implicit"])
def test_rules_flow_in_exported_c(method: str, tmp_path: Path) -> None:
    """Strictly compiled: nothing is read that no formula uses, where lesions lose what was sent either."""
    events = "events: [{at: 20, learning: {K -> O: false}}, {at: 2.5 ms, learning: {K -> O: true}}, "
    events += "{at: 30, lesion: K -> O}, {at: 33, mend: K -> O}]\n"
    network = nv.compile_text(SPEC.replace("METHOD", method) + events)
    recording = network.run(backend="reference")
    controller = exported(network, tmp_path / "c")
    for k in range(49):
        controller.step()
        np.testing.assert_array_equal(controller.activity, recording.activity[k])
        np.testing.assert_array_equal(controller.weights, recording.weights[k + 1])
