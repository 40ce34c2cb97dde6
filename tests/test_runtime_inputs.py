"""Inputs that are expressions, as a part of the step that a backend compiles; blocks of steps as long as they take."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from networks_by_hand import cpg_rbf

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.backend import Ready, ready
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyStepper
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation

Made = TypeVar("Made")

SPEC = """
neurovis: 1
name: fed
time: {dt: 0.01, steps: 300}
parameters: {gain: 0.4, phase: 0.1}
inputs:
  wave: {expression: gain*sin(2*pi*(k + 24)/37.5 + phase)^3 + exp(-t)}
  step: {expression: 1 if k % 5 < 2 else tanh(t - phase)}
  pair: {size: 2}
  rows: {values: [[0.1], [0.2], [-0.3]]}
  hidden: {expression: "clip(1/(k - 250), -1, 1)"}
  torque: {}
neurons:
  A: {input: wave, activation: tanh}
  B: {count: 2, input: pair, NOISE}
  C: {input: rows}
  F: {input: step}
  D: {input: hidden}
  E: {input: torque, initial: 0.2}
connections:
  A -> B: {weight: 0.5, plasticity: {oja: {rate: 0.01}}}
  B -> E: 0.3
  D -> C: {weight: 0.1, delay: 2}
outputs: {signal: E, both: B}
events: [{at: 130, set: {gain: 0.7}}, {at: 200, lesion: [B1]}]
"""
NOISE = 'noise: "normal(0, 0.1*phase)"'
GIVEN = {"pair": np.linspace(0, 1, 600).reshape(300, 2), "torque": np.linspace(0, 1, 40), "wave": np.array([0.3])}


def fed(noise: bool = True) -> Network:
    return nv.compile_text(SPEC.replace(", NOISE", f", {NOISE}" if noise else "")).network


def quiet(work: Callable[[], Made]) -> Made:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return work()


def same(one: Recording, other: Recording) -> None:
    assert one.step.tolist() == other.step.tolist()
    for name in ("activity", "weights", "weights_after"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


@pytest.mark.compiler
@settings(max_examples=8, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(
    supplied=st.sets(st.sampled_from(sorted(GIVEN))),
    noise=st.booleans(),
    every=st.sampled_from([1, 3]),
    # inputs that are given at a step, and a parameter that is set behind it
    hands=st.dictionaries(
        st.integers(0, 30), st.sets(st.sampled_from(["wave", "torque", "rows", "hidden"])), max_size=4
    ),
    set_at=st.integers(0, 30),
)
def test_runs_and_steps_that_compute_their_inputs_are_the_references_bit_for_bit(
    supplied: set[str], noise: bool, every: int, hands: dict[int, set[str]], set_at: int
) -> None:
    network, given_inputs = fed(noise), {name: GIVEN[name] for name in supplied}
    runs = [
        quiet(lambda name=name: record(network, Course(every=every, inputs=given_inputs, backend=name)))  # type: ignore[misc]
        for name in ("reference", "c")
    ]
    same(*runs)
    simulations = [Simulation(network, name, inputs=given_inputs) for name in ("reference", "c")]
    for k in range(40):
        for simulation in simulations:
            simulation.step(dict.fromkeys(hands.get(k, ()), 0.25 * k))
            if k == set_at:
                simulation.set(phase=0.3)
        plain, fast = simulations
        assert plain.activity.tobytes() == fast.activity.tobytes(), k
        assert {name: np.asarray(value).tolist() for name, value in plain.outputs.items()} == {
            name: np.asarray(value).tolist() for name, value in fast.outputs.items()
        }


@pytest.mark.compiler
@pytest.mark.parametrize("expression", ["1/(k - 5)", "log(5 - k)", "clip(1/(k - 5), -1, 1)"])
@pytest.mark.parametrize("stepped", [False, True])
def test_an_input_that_is_not_finite_is_told_at_its_step(expression: str, stepped: bool) -> None:
    text = f"neurovis: 1\nname: x\ninputs: {{a: {{}}, s: {{expression: '{expression}'}}}}\n"
    network = nv.compile_text(text + "neurons: {A: {input: a}, B: {input: s, activation: tanh}}\n").network

    def told(backend: str) -> list[str]:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if stepped:
                simulation = Simulation(network, backend)
                for k in range(9):
                    simulation.step(a=0.1 * k)
            else:
                record(network, Course(300, backend=backend))
        return [str(one.message) for one in caught]

    assert told("c") == told("numpy") == told("reference")
    (message,) = told("c")
    assert "the input 's' of B" in message
    assert "at step 5" in message


@pytest.mark.compiler
def test_one_stepper_serves_simulations_that_are_given_different_inputs() -> None:
    network = fed()
    backend, plain = ready(network, "c"), ready(network, "reference")
    inputs: tuple[dict[str, FloatArray], ...] = ({}, {"wave": np.array([0.5])})
    ours, theirs = ([Simulation(network, one, inputs=given) for given in inputs] for one in (backend, plain))
    for _ in range(4):
        for one, other in zip(ours, theirs, strict=True):
            one.step()
            other.step()
            assert one.activity.tobytes() == other.activity.tobytes()
        same(*(record(network, Course(20, backend=one)) for one in (backend, plain)))


@pytest.mark.compiler
def test_an_input_that_flows_is_its_expression_again_after_a_step_for_which_it_was_given() -> None:
    text = """
neurovis: 1
name: x
time: {dt: 0.1}
models: {leaky: {state: {v: {derivative: drive - v}}, activity: v}}
inputs: {wave: {expression: sin(t)}}
neurons: {A: {model: leaky, input: wave}}
"""
    network = nv.compile_text(text).network
    plain, fast = (Simulation(network, name) for name in ("reference", "c"))
    for k in range(8):
        for one in (plain, fast):
            one.step({"wave": 2.0} if k in (2, 5) else None)
        assert plain.activity.tobytes() == fast.activity.tobytes(), k


@pytest.mark.compiler
@pytest.mark.parametrize("every", [1, 7])
def test_rows_are_handed_on_as_often_as_there_is_room(
    every: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The least room is that of a stretch: blocks of 300 steps go on in several parts."""
    monkeypatch.setattr("neurovis_spec.runtime.rows._HANDED_ON", 1)
    network = nv.compile_text(SPEC.replace(", NOISE", ""))
    quiet(lambda: network.run_to(tmp_path / "x.npz", every=every, backend="c"))
    same(nv.load(tmp_path / "x.npz"), quiet(lambda: network.run(every=every, backend="reference")))


@pytest.mark.parametrize(
    ("seconds", "blocks"),
    [(0.0625, [4096, 6553, 6553]), (0.0, [4096, 65536, 130368]), (4.0, [4096, 102, 102])],
    ids=["a second for 65,536", "quicker than the clock", "slower than hoped for"],
)
def test_a_block_is_as_long_as_a_tenth_of_a_second_takes(
    seconds: float, blocks: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that goes on by so many ``seconds`` in 4,096 steps; what is made does not depend on it."""
    clock = 0.0

    class Ticking(NumpyStepper):
        def run(self, state, vectors, activity, weights, every, look):  # type: ignore[no-untyped-def]
            nonlocal clock
            clock += seconds * len(vectors) / 4096
            state.k += len(vectors)
            return len(vectors)

    network, told = cpg_rbf(), [0]
    monkeypatch.setattr("neurovis_spec.runtime.record.monotonic", lambda: clock)
    backend = Ready("numpy", Ticking(network), ready(network, "numpy").functions)
    record(network, Course(200_000, backend=backend), lambda done, _: told.append(done))
    assert np.diff(told)[:3].tolist() == blocks
    assert told[-1] == 200_000


def test_a_reader_makes_all_that_is_not_left() -> None:
    """To a stepper that computes nothing nothing is left; of inputs that hide something undefined all is made."""
    network = fed()
    reader = InputReader(network, on_rows=lambda first, rows, hidden: None)
    reader.leave(ready(network, "numpy").stepper)
    assert not reader.left
    whole = np.concatenate([part.copy() for part in reader.parts(0, 300)])
    assert whole.tobytes() == np.stack([reader.at(k) for k in range(300)]).tobytes()
