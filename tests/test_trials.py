"""Importance and sensitivity against networks whose answers are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec import analysis
from neurovis_spec.analysis.trials import Trials

#: O = 2·A + gain·B + 0·D at each step; A is a wave, B a constant of 3.
LINEAR = """neurovis: 1
name: linear
time: {steps: 200}
parameters: {gain: 0.5, size: 2, level: {value: 0, min: 0, max: 1}}
inputs: {wave: {expression: sin(2*pi*k/20)}, level: {expression: "3"}}
neurons: {A: {input: wave}, B: {input: level}, D: {count: size, bias: level}, O: {}}
connections:
  A -> O: {weight: 2, delay: 0}
  B -> O: {weight: gain, delay: 0}
  D1 -> O: {weight: 0, delay: 0}
outputs: {signal: O}
"""


@pytest.fixture(scope="module")
def linear() -> nv.CompiledNetwork:
    return nv.compile_text(LINEAR)


def test_the_importance_of_the_parts_of_a_sum(linear: nv.CompiledNetwork) -> None:
    """Without A the output loses 2·sin, all that it varies by; without B it is 1.5 lower; B is at its mean anyway."""
    lost = analysis.importance(linear, start=100, steps=100)
    assert lost.rows.labels == ("wave", "level", "A", "B", "D1", "D2")
    root = math.sqrt(2)
    for name in ("A", "wave"):
        assert lost.row(name) == pytest.approx(
            {"lesion": root, "occlusion": root, "lesion share": 1, "occlusion share": 1}, abs=1e-9
        )
    for name in ("B", "level"):
        assert (lost[name, "lesion"], lost[name, "occlusion"]) == pytest.approx((1.5, 0), abs=1e-12)
    assert lost["D2", "lesion"] == 0


def test_the_sensitivity_of_a_sum(linear: nv.CompiledNetwork) -> None:
    slopes = analysis.sensitivity(linear, start=100, steps=100)
    assert slopes["A -> O", "rms"] == pytest.approx(math.sqrt(0.5), rel=1e-6)
    assert slopes["A -> O", "mean"] == pytest.approx(0, abs=1e-9)
    assert (slopes["B -> O", "mean"], slopes["B -> O", "elasticity"]) == pytest.approx((3, 1.5))
    assert slopes["parameter gain", "mean"] == pytest.approx(3)
    assert slopes["input wave", "mean"] == pytest.approx(2)
    assert slopes["input level", "rms"] == pytest.approx(0.5)
    assert slopes["D1 -> O", "rms"] == 0
    assert "parameter size" not in slopes.rows.labels  # the structure depends on it


def test_where_the_output_jumps_there_is_no_derivative() -> None:
    """S crosses its threshold at step 20 with any more of the bias, and with any less of the slope."""
    network = nv.compile_text(
        "neurovis: 1\nname: x\ntime: {steps: 40}\nparameters: {height: 3, level: 0, more: 1}\n"
        "inputs: {ramp: {expression: k - 20 + level}}\n"
        "neurons: {A: {input: ramp}, S: {activation: step}, O: {}}\n"
        "connections: {A -> S: {weight: 1, delay: 0}, S -> O: {weight: height, delay: 0}}\n"
    )
    slopes = analysis.sensitivity(network, of="O", steps=40)
    assert np.isnan(slopes["parameter level", "rms"])
    assert slopes["A -> S", "rms"] == 0
    assert slopes["S -> O", "mean"] == pytest.approx(20 / 40, abs=0.03)
    assert slopes["S -> O", "mean"] == slopes["parameter height", "mean"]


def test_a_trial_is_the_run_itself_where_nothing_changes(linear: nv.CompiledNetwork) -> None:
    """Also with noise and events, and whichever way its steps are made."""
    network = nv.compile_text(
        LINEAR.replace("D: {count: size, bias: level}", "D: {count: size, bias: level, noise: 'normal(0, 0.1)'}")
        + "events: [{at: 120, set: {gain: 0.75}}, {from: 150, clamp: {A: 0.3}}]\n"
    )
    recording = network.run()
    trials = Trials(network, 100, 100)
    np.testing.assert_array_equal(trials.activity, recording.activity[100:])
    np.testing.assert_array_equal(trials.changed(lambda _: None), trials.intact)
    np.testing.assert_array_equal(trials.with_weight(0, 0.0), trials.intact)
    np.testing.assert_array_equal(trials.with_input(network.network.inputs[0], lambda x: x), trials.intact)
    assert trials.changed(lambda simulation: simulation.lesion("A")).shape == (100, 1)
    np.testing.assert_array_equal(trials.changed(lambda _: None), trials.intact)


def test_outputs_are_those_of_the_spec_or_those_that_send_to_nobody() -> None:
    without = nv.compile_text(LINEAR.replace("outputs: {signal: O}", ""))
    assert analysis.importance(without)["A", "lesion"] > 1
    with pytest.raises(ValueError, match="no outputs"):
        analysis.importance(nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {bias: 1}}"))
    assert analysis.sensitivity(without, of="A")["A -> O", "rms"] == 0
    with pytest.raises(ValueError, match="'Z'"):
        analysis.importance(without, of="Z")


def test_what_grows_without_bound_gives_no_number() -> None:
    wild = nv.compile_text(
        "neurovis: 1\nname: x\ntime: {steps: 3000}\nneurons: {A: {initial: 1}, O: {}}\n"
        "connections: {A -> A: 3, A -> O: 1}\noutputs: {o: O}\n"
    )
    assert not np.isfinite(analysis.importance(wild)["A", "occlusion"])
    assert np.isnan(analysis.sensitivity(wild)["A -> O", "rms"])
