"""Undefined operations that no number of a run shows: one warning, the same whatever computes the steps."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.program import Check
from neurovis_spec.compiler.run_checks import without_checks
from neurovis_spec.runtime.c_export import Exported
from neurovis_spec.runtime.record import record

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """
neurovis: 1
name: hiding
time: {{steps: 40, episode: 10}}
parameters: {{scale: 1, zero: 0}}
inputs:
  ramp: {{expression: k - 7}}
activations:
  steep: {{parameters: {{s: 1}}, value: "tanh(s/x)"}}
  split: {{parameters: {{s: 1}}, value: "clip(x/s, -1, 1)"}}
models:
  m: {{parameters: {{s: 1}}, {model}}}
rules:
  r: {{parameters: {{c: 1}}, {rule}}}
neurons:
  I: {{input: ramp}}
  A: {{count: 3, model: m, {neuron}}}
  B: {{}}
connections:
  I -> A: {{delay: 0}}
  A -> B: {{plasticity: r, delay: 0, bounds: [-1, 9]}}
{more}
"""
HIDDEN = ", which the rest of the formula hides, in 'hiding'"


def spec(
    model: str = "activity: f(drive)",
    neuron: str = "activation: identity",
    rule: str = "weight: {each_step: weight + c*pre*0}",
    more: str = "",
) -> nv.CompiledNetwork:
    return nv.compile_text(SPEC.format(model=model, neuron=neuron, rule=rule, more=more))


def told(network: nv.CompiledNetwork, backend: str) -> list[str]:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        network.run(backend=backend)
    return [str(one.message) for one in found]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"model": 'activity: "clip(1/drive, -1, 1)"'}, "the model 'm' divides by 0 for A1 at step 7"),
        ({"model": 'activity: "max(log(drive^2), 0)"'}, "the model 'm' takes the logarithm of 0 for A1 at step 7"),
        (
            {"model": 'let: {y: sqrt(drive)}, activity: "1 if y > 1 else 0"'},
            "the model 'm' takes the square root of a number below 0 for A1 at step 0",
        ),
        (
            {"model": 'let: {y: 1/drive}, activity: "tanh(y) + (1 if acos(drive/9) > 1 else 0)"'},
            "the model 'm' has an undefined operation for A1 at step 7",
        ),
        (
            {"model": "state: {v: {initial: 3, each_step: v - 1}}, activity: f(v)", "neuron": "activation: steep"},
            "the activation 'steep' divides by 0 for A1 at step 2",
        ),
        (
            {"model": 'activity: "1 if f(drive) > 0.5 else 0"', "neuron": "activation: steep"},
            "the activation 'steep' divides by 0 for A1 at step 7",
        ),
        (
            {"model": "state: {v: {initial: 0, each_step: v + 1, each_episode: exp(-1/(k - 19)^2)}}, activity: f(v)"},
            "the model 'm' divides by 0 for A1 at step 19",
        ),
        (
            {"rule": 'weight: {each_step: "weight + min(1/pre, 0.01)"}'},
            "the rule 'r' divides by 0 for A1 -> B after step 7",
        ),
        ({"rule": "weight: {each_step: weight + 1/pre}"}, "the rule 'r' divides by 0 for A1 -> B after step 7"),
        (
            {"neuron": 'noise: "clip(normal(0, 1)/(k - 5), -1, 1)"'},
            "the noise of A1 has an undefined operation at step 5",
        ),
        (
            {"neuron": "activation: {split: {s: scale}}", "more": "events: [{at: 9, set: {scale: 0}}]"},
            "the activation 'split' divides by 0 for A1 at step 9",
        ),
    ],
)
def test_what_is_undefined_and_hidden_is_told_once(parts: dict[str, str], message: str, backend: str) -> None:
    assert told(spec(**parts), backend) == [message + HIDDEN]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "parts",
    [
        {"model": 'activity: "clip(1/drive, -1, 1) if drive != 0 else 0"'},
        {"model": 'let: {y: 1/drive}, activity: "0 if drive == 0 else tanh(y)"'},
        {"model": 'activity: "1 if drive != 0 and 1/drive > 0.5 else 0"'},
        {"model": 'activity: "1/(1 + exp(-300*drive))"'},
        {"model": 'activity: "clip(exp(1000*drive), 0, 1)"'},
        {"model": 'activity: "tanh(drive/s) + clip(drive % 3, 0, 1) + exp(-drive^2)"'},
        {"rule": 'weight: {each_step: "weight + (min(1/pre, 0.01) if pre > 0 else 0)"}'},
        {"model": 'activity: "tanh(1/drive)"', "more": "events: [{at: 3, lesion: [A, A -> B]}]"},
    ],
)
def test_what_is_not_computed_and_what_only_overflows_is_not_told(parts: dict[str, str], backend: str) -> None:
    assert told(spec(**parts), backend) == []


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_input_that_hides_it_is_told_but_not_one_that_a_caller_replaces(backend: str) -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: t\ninputs: {wave: {expression: 'clip(1/(k - 3), -1, 1)'}}\nneurons: {A: {input: wave}}\n"
    )
    with pytest.warns(RuntimeWarning, match="the input 'wave' of A has an undefined operation at step 3") as found:
        network.run(steps=300, backend=backend)
    assert len(found) == 1
    simulation = network.simulator(backend=backend)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(10):
            simulation.step({"wave": 1.0} if k == 3 else {})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        network.run(steps=10, inputs={"wave": 0.5}, backend=backend)


def test_checks_change_no_number_and_nobody_sees_them() -> None:
    network = spec(model='state: {v: {initial: 0, each_step: v + 1}}, activity: "clip(f(v)/drive, -1, 1)"')
    plain = without_checks(network.network)
    assert len(plain.blocks[1].model.state) == 1
    assert len(network.network.blocks[1].model.state) == 2
    assert plain.hash == network.network.hash
    with pytest.warns(RuntimeWarning):
        found = network.run(states="A.v")
    np.testing.assert_array_equal(found.activity, record(plain, 40).activity)
    assert found.state_names == ("A1.v", "A2.v", "A3.v")
    assert Exported(network.network).header() == Exported(plain).header()


def test_only_what_is_hidden_is_checked() -> None:
    shown = spec(
        model="activity: 1/drive + log(drive)",
        rule="state: {q: {initial: 0, each_step: 1/pre}}, weight: {each_step: weight + c*q*0}",
    )
    settings = spec(model='activity: "clip(drive/s, -1, 1)"')
    for network in (shown.network, settings.network):
        states = [state for block in network.blocks for state in block.model.state]
        states += [state for one in network.plasticity for state in one.rule.state]
        assert not any(isinstance(state, Check) for state in states)
