"""What inputs are given is recorded by name (``push.given``), read back from every format, and drawn as traces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lsp_marks import marked
from toy_bodies import carted, registered

import neurovis_spec as nv
from neurovis_spec.lsp.rename import apply, rename
from neurovis_spec.runtime.errors import RecordingError

SPEC = """\
neurovis: 1
name: given
time: {dt: 0.01, steps: 50}
inputs:
  touch: {size: 3, expression: sin(10*t + i)}
  push: {}
  wave: {expression: cos(20*t)}
  pulses: {size: 2, poisson: 20}
models:
  leaky: {state: {v: {derivative: -v + drive}}, activity: v}
  cell:
    state: {v: {derivative: 10*drive}}
    spike: {when: v >= 1, set: {v: 0}}
    activity: v
modules: {leg: {inputs: {aim: {expression: 3*t}}, neurons: {K: {input: aim, activation: identity}}}}
instances: {left: {module: leg}}
neurons:
  A: {count: 3, input: touch, model: leaky}
  P: {input: push}
  W: {input: wave, activation: identity}
  S: {count: 2, input: pulses, activation: identity}
  F: {bias: 1, model: cell}
connections: {A -> P: 0.5, W -> P: {weight: 0.1, plasticity: {oja: {rate: 0.1}}}}
events: [{at: 10, feed: {push: 0.7}}, {at: 30, feed: {push: null}}]
render: {figure: [traces: [touch.given, push.given, P, left.aim.given]]}
"""
NAMES = ["touch.given", "push.given + A.v", "wave.given", "left.aim.given", "pulses.given"]
INPUTS = ("touch.given", "push.given", "wave.given", "left.aim.given", "pulses.given")


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC)


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
@pytest.mark.parametrize("every", [1, 3])
def test_each_backend_records_what_is_given(network: nv.CompiledNetwork, backend: str, every: int) -> None:
    recording = network.run(50, states=NAMES, backend=backend, every=every)
    steps, t = recording.step, recording.t
    assert recording.state_names[3:7] == ("touch[0].given", "touch[1].given", "touch[2].given", "push.given")
    np.testing.assert_allclose(recording["touch.given"], np.sin(10 * t[:, None] + np.arange(3)), rtol=1e-14)
    np.testing.assert_array_equal(recording["touch[1].given"], recording["touch.given"][:, 1])
    np.testing.assert_array_equal(recording["push.given"], np.where((steps >= 10) & (steps < 30), 0.7, 0))
    for given, neuron in (("wave.given", "W"), ("left.aim.given", "left.K"), ("pulses.given", "S")):
        np.testing.assert_array_equal(recording[given], recording[neuron])
    plain = network.run(50, states="A.v", backend=backend, every=every)
    np.testing.assert_array_equal(recording["A.v"], plain["A.v"])
    np.testing.assert_array_equal(recording.spike_steps, plain.spike_steps)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_run_that_ends_early_and_steps_by_hand_record_the_same(network: nv.CompiledNetwork, backend: str) -> None:
    whole = network.run(50, {"push": 0.25}, states=NAMES, backend=backend)
    until = network.run(50, {"push": 0.25}, states=NAMES, backend=backend, until="k > 20")
    with network.simulator(backend, record=True, states=NAMES) as simulation:
        for _ in range(50):
            simulation.step(push=0.25)
    for name in INPUTS:
        np.testing.assert_array_equal(until[name], whole[name][: len(until)])
        np.testing.assert_array_equal(simulation.recording[name], whole[name])
    assert (len(until), set(whole["push.given"])) == (22, {0.25})


@pytest.mark.parametrize("suffix", ["npz", "csv", "mcap"])
def test_files_hold_it(network: nv.CompiledNetwork, suffix: str, tmp_path: Path) -> None:
    made = network.run(states=NAMES)
    network.run_to(tmp_path / f"x.{suffix}", states=NAMES)
    read = nv.load(tmp_path / f"x.{suffix}")
    assert read.state_names == made.state_names
    for name in (*INPUTS, "touch[2].given", "A1.v"):
        np.testing.assert_array_equal(read[name], made[name])


def test_a_table_of_some_neurons_tells_inputs_from_states(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    network.run_to(tmp_path / "x.csv", states=NAMES, neurons="P", weights="none")
    header = (tmp_path / "x.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert header.startswith("step,t,P,state A1.v,state A2.v,state A3.v,input touch[0],")
    read = nv.load(tmp_path / "x.csv")
    assert read.neurons == ("P", "A1", "A2", "A3")
    np.testing.assert_array_equal(read["touch.given"], network.run(states=NAMES)["touch.given"])


def test_what_a_body_senses_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)
    recording = carted().run(30, states=["place.given", "arms.given"])
    assert len(set(recording["place.given"].tolist())) > 10
    np.testing.assert_array_equal(recording["place.given"], recording.sensor("x"))
    assert recording["arms.given"].shape == (30, 2)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("touch[3].given", "the input 'touch' has no number 3; it has touch[0] to touch[2]"),
        ("push[1].given", "the input 'push' has no number 1; it is one number"),
        ("psh.given", "no neuron, group or output 'psh'"),
    ],
)
def test_what_is_not_there_is_said(network: nv.CompiledNetwork, name: str, said: str) -> None:
    with pytest.raises(KeyError) as told:
        network.run(2, states=name)
    assert said in str(told.value)


def test_what_was_not_recorded_is_said(network: nv.CompiledNetwork) -> None:
    recording = network.run(2)
    with pytest.raises(KeyError, match=r"was not recorded: neurovis run --states 'push.given' records it"):
        recording["push.given"]
    with pytest.raises(RecordingError, match=r"does not hold 'touch\[0\].given', which the figure shows: record it"):
        network.render("x.svg", recording=recording)


def test_pictures_trace_what_is_given(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    network.render(tmp_path / "x.svg")
    text = (tmp_path / "x.svg").read_text(encoding="utf-8")
    for name in ("touch[0]", "touch[2]", "push", "left.aim"):
        assert f">{name}<" in text
    network.render(tmp_path / "y.svg", view="traces: wave.given, touch[1].given")
    text = (tmp_path / "y.svg").read_text(encoding="utf-8")
    assert ">wave<" in text
    assert ">touch[1]<" in text
    assert ">input<" in text


def test_renaming_an_input_reaches_its_traces() -> None:
    spec = SPEC.replace("[touch.given,", "[touch.given, 'touch[1].given',")
    for name, new in (("push", "shove"), ("touch", "skin")):
        document, place = marked(spec.replace(f"  {name}:", f"  {name}¦:"))
        assert apply(document, rename(document, place, new)).source == spec.replace(name, new)
