"""Signals of rules: states and outputs of any group, one for all, one for each target, or one for each source."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.scene.teachers import teachers_of

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """\
neurovis: 1
name: signals
time: {steps: 10}
models:
  m:
    state: {v: {each_step: 0.5*v + drive}}
    outputs: {twice: 2*v}
    activity: tanh(v)
rules:
  three:
    signals: [error, gain, tell]
    state: {told: {each_step: tell}}
    weight: {each_step: weight - 0.1*error*gain + 0.001*told}
inputs: {s: {expression: sin(k)}, c: {expression: cos(k)}}
neurons:
  K: {count: 3, input: s, model: m, bias: [0, 0.5, 1]}
  O: {count: 2, bias: 0.3}
  E: {count: 2, input: c, model: m, bias: [0, 1]}
connections:
  K -> O: {pattern: all_to_all, weight: 0.2, plasticity: {three: ERROR}}
  E -> O: {pattern: one_to_one, weight: 0}
"""


def run(error: str, gain: str, tell: str, backend: str = "reference") -> tuple[nv.CompiledNetwork, FloatArray]:
    """The network, and by steps the weights from each of K to each of O."""
    network = nv.compile_text(SPEC.replace("ERROR", f"{{error: {error}, gain: {gain}, tell: {tell}}}"))
    return network, network.run(backend=backend).weights[:, :6].reshape(-1, 3, 2)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("error", "gain", "tell"),
    [
        ("E.v", "{from: K.twice}", "s"),
        ("E", "{from: [s, E2.v, K3]}", "E1.v"),
        ("E1.v + E2", "{from: c}", "[s, E1.twice]"),
        ("[E2.v, c]", "E2.twice", "{from: K}"),
    ],
)
def test_each_connection_has_the_value_of_its_source_or_target(error: str, gain: str, tell: str, backend: str) -> None:
    network, weights = run(error, gain, tell, backend)
    recording = network.run(backend="reference", states=["all"])
    wave = {"s": np.sin(np.arange(10.0)), "c": np.cos(np.arange(10.0))}

    def values(text: str) -> list[FloatArray]:
        """What a signal names, one after the other, over the steps."""
        found: list[FloatArray] = []
        for name in text.strip("[]").replace(" + ", ", ").split(", "):
            group, dot, state = name.partition(".")
            members = [f"{group}{i + 1}" for i in range({"K": 3, "E": 2}[group])] if group in "KE" else [group]
            found += [wave[one] if one in wave else recording[f"{one}.{state}" if dot else one] for one in members]
        return found

    told = np.zeros((3, 2))
    expected = np.full((3, 2), 0.2)
    for k in range(10):
        np.testing.assert_allclose(weights[k], expected, rtol=1e-12)
        seen = []
        for text in (error, gain, tell):
            by_source = text.startswith("{from: ")
            one = [values[k] for values in values(text.removeprefix("{from: ").rstrip("}"))]
            seen.append(np.broadcast_to(np.array(one)[:, None] if by_source else np.array(one)[None, :], (3, 2)))
        expected, told = expected - 0.1 * seen[0] * seen[1] + 0.001 * told, seen[2]


def test_what_it_is_called_and_who_teaches() -> None:
    network, _ = run("E.v", "{from: K.twice}", "s")
    assert network.network.connections.learns[0] == "three(error=E.v, gain={from: K.twice}, tell=s)"
    names = network.network.neurons.names
    found = {(names[one.source], names[one.target], one.signal) for one in teachers_of(network.network)}
    errors = {(f"E{i}", f"O{i}", "error") for i in (1, 2)}
    assert found == errors | {(f"K{i}", f"O{j}", "gain") for i in (1, 2, 3) for j in (1, 2)}


def test_the_content_is_what_is_read() -> None:
    """The hash sees which state of which neurons a signal is, and nothing else of it."""
    hashes = [run(error, "c", "s")[0].hash for error in ("E.v", "E.twice", "E", "[E1.v, E2.v]", "[E2.v, E1.v]")]
    assert hashes[0] == hashes[3]
    assert len({*hashes}) == 4


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_neuron_that_is_lesioned_tells_nothing(backend: str) -> None:
    network, _ = run("E.v", "K1", "c")
    simulation = network.simulator(backend=backend)
    simulation.lesion("E2")
    for _ in range(5):
        simulation.step()
    weights = simulation.state().weights[:6].reshape(3, 2)
    told = sum(0.001 * np.cos(k) for k in range(4))  # each step, what was told at the one before
    np.testing.assert_allclose(weights[:, 1], 0.2 + told, rtol=1e-12)
    assert not np.allclose(weights[:, 0], 0.2 + told)
