"""Connections that learn by several rules: what comes in which order, what they are called, and what of them is set."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.program import Learn

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """\
neurovis: 1
name: several
time: {steps: 12, episode: 4}
parameters: {r: 0.25}
rules:
  grow:
    parameters: {rate: 0.3}
    state: {trace: {each_step: 0.5*trace + pre, each_episode: trace/4}}
    weight: {each_step: weight + rate*trace*post}
  shrink:
    parameters: {rate: 0.1}
    state: {seen: {each_step: seen + weight}}
    weight: {each_step: weight - rate*weight, each_episode: weight/2}
  push:
    signals: [by]
    weight: {each_step: weight + 0.1*by, each_episode: weight + 1}
inputs: {s: {expression: sin(k)}}
neurons: {K: {count: 2, input: s}, O: {count: 2, activation: tanh, bias: 0.5}}
connections:
  K -> O: {pattern: all_to_all, weight: 0.2, bounds: [-0.5, 0.5], plasticity: [grow, {shrink: {rate: r}}]}
  K1 -> K2: {weight: 0.3, plasticity: [{shrink: {rate: 2*r}}, grow, {push: {by: O1}}]}
  O1 -> O2: {weight: 0.1, plasticity: {shrink: {rate: r}}}
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_each_phase_of_all_rules_comes_before_the_next(backend: str) -> None:
    """Each rule sees the weight that the one before left; bounds hold behind each; then the episode's end of all."""
    recording = nv.compile_text(SPEC).run(backend=backend, states=["all"])
    pre, post = np.append(0.0, recording["K1"]), recording["O1"]
    weight, trace, seen = 0.2, 0.0, 0.0
    for k in range(12):
        assert recording.weights[k, 0] == pytest.approx(weight, rel=1e-12)
        weight, trace = min(max(weight + 0.3 * trace * post[k], -0.5), 0.5), 0.5 * trace + pre[k]
        weight, seen = min(max(weight - 0.25 * weight, -0.5), 0.5), seen + weight
        if k % 4 == 3:
            trace, weight = trace / 4, weight / 2
        assert recording["(K1 -> O1).trace"][k] == pytest.approx(trace, rel=1e-12)
        assert recording["(K1 -> O1).seen"][k] == pytest.approx(seen, rel=1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
def test_another_order_is_another_network(backend: str) -> None:
    turned = SPEC.replace("[grow, {shrink: {rate: r}}]", "[{shrink: {rate: r}}, grow]")
    made = [nv.compile_text(text) for text in (SPEC, turned)]
    one, other = (network.run(backend=backend) for network in made)
    assert made[0].hash != made[1].hash
    assert not np.allclose(one.weights, other.weights)


def test_rules_are_told_by_their_names_in_their_order() -> None:
    network = nv.compile_text(SPEC).network
    assert network.connections.learns == (
        "grow(rate=0.3) + shrink(rate=0.25)", "shrink(rate=0.5) + grow(rate=0.3) + push(by=O1)", "shrink(rate=0.25)",
    )  # fmt: skip
    rules = [one["rule"] for one in nv.compile_text(SPEC).describe()["connections"]]  # type: ignore[attr-defined]
    assert rules == ["grow + shrink"] * 4 + ["shrink + grow + push", "shrink"]
    # grow at the first place, shrink at the second; shrink at the first, grow at the second; push
    assert [(one.rule.definition.name, one.place) for one in network.projections] == [
        ("grow", 0), ("shrink", 1), ("shrink", 0), ("grow", 1), ("push", 2),
    ]  # fmt: skip
    assert network.connections.rules.tolist() == [0, 0, 0, 0, 2, 2]
    learning = [(one.projection, *one.phases) for one in network.program if isinstance(one, Learn)]
    steps, ends = learning[:5], learning[5:]
    assert steps == [(number, "each_step") for number in (0, 2, 1, 3, 4)]
    assert ends == [(number, "each_episode") for number in (0, 2, 1, 3, 4)]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_parameter_reaches_the_rule_that_it_is_of(backend: str) -> None:
    """``rate`` of two rules of a connection: the one follows a parameter, the other does not."""
    network = nv.compile_text(SPEC)
    set_later = network.simulator(backend=backend)
    set_later.set({"r": 0.1})
    for _ in range(12):
        set_later.step()
    given = nv.compile_text(SPEC.replace("r: 0.25", "r: 0.1")).simulator(backend=backend)
    for _ in range(12):
        given.step()
    np.testing.assert_array_equal(set_later.state().weights, given.state().weights)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_does_not_learn_has_no_rule_carried_out(backend: str) -> None:
    simulation = nv.compile_text(SPEC).simulator(backend=backend)
    simulation.learning("K1 -> K2", False)
    for _ in range(9):
        simulation.step()
    state, index = simulation.state(), simulation.network.connection_index["K1 -> K2"]
    assert state.weights[index] == 0.3
    (shrink, grow), owners = (2, 3), {owner.number: own for owner, own in state.cells.items() if owner.kind == "rule"}
    assert owners[grow]["trace"].tolist() == [0]
    assert owners[shrink]["seen"][0] == 0
    assert owners[shrink]["seen"][1] > 0
