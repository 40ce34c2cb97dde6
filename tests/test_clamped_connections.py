"""States of synapses and rules that are held, by events and by hand: no derivative, no step changes them, all else goes
on; in every backend, in exported C, through a checkpoint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_export_c import runs_alike

import neurovis_spec as nv
from neurovis_spec.runtime import c_backend, c_export
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.errors import UnknownNameError
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """
neurovis: 1
name: gates
time: {dt: 0.1, episode: 5, integrate: METHOD}
parameters: {level: 0.7}
models:
  cell: {state: {v: {initial: 0.2, derivative: drive - v}}, activity: v}
synapses:
  gate:
    state:
      g: {initial: 0.1, derivative: pre.v - g}
      u: {initial: 1, each_step: 0.8*u + 0.1*pre.v, each_episode: 0.5*u}
    signal: weight*(g*u - 0.1*post.v)
rules:
  tracing:
    state:
      trace: {initial: 0.1, each_step: 0.9*trace + pre*post, each_episode: 0.2*trace}
      mean: {derivative: pre - mean}
    weight: {each_step: weight + 0.01*trace*mean}
  moving: {centre: {each_step: centre + 0.1*(pre - centre)}}
neurons:
  A: {count: 3, model: cell, bias: 0.5, initial: {v: 0.1*i}}
  B: {count: 2, model: cell}
  C: {count: 4}
  D: {count: 2, combine: distance}
connections:
  A -> B: {weight: 0.5, synapse: gate, pattern: all_to_all, plasticity: tracing}
  B -> A: {weight: -0.2, pattern: all_to_all, plasticity: tracing}
  B -> C: {weight: -0.2, pattern: all_to_all, plasticity: tracing, delay: 2}
  A -> D: {centre: 0.3, pattern: all_to_all, plasticity: moving}
events:
  - {from: 3, to: 9, clamp: {(A -> B).g: level, (A -> B1).u: 2}}
  - {at: 5, set: {level: -0.2}}
  - {at: 6, lesion: [A1 -> B1, A2 -> B2]}
  - {at: 12, mend: A1 -> B1}
  - {from: 4, to: 14, clamp: {(A2 -> B2).trace: 0.5, (B -> A).mean: 1, B.v: 0.1, (A -> D1).centre: 0.4}}
  - {at: 8, learning: {A -> B: false}}
  - {from: 0, to: 3, clamp: {(B -> C).trace: 0.3}}
"""


def gates(method: str = "rk4") -> nv.CompiledNetwork:
    return nv.compile_text(SPEC.replace("METHOD", method))


def run(backend: str, method: str) -> Recording:
    return record(gates(method).network, Course(20, backend=backend, keep=Keep(states=("all",))))


def test_states_of_connections_that_are_held_stay_while_all_else_goes_on() -> None:
    made = run("reference", "rk4")
    assert made["(A1 -> B2).g"][3:9].tolist() == [0.7, 0.7, *[-0.2] * 4]
    assert made["(A1 -> B1).u"][3:9].tolist() == [2] * 6
    assert 2 not in made["(A1 -> B2).u"]
    assert made["(A2 -> B2).trace"][4:14].tolist() == [0.5] * 10
    assert made["(A2 -> B2).trace"][14] == 0.5, "its neuron is lesioned, and so it does nothing"
    assert made["(B1 -> A3).mean"][4:14].tolist() == [1] * 10
    assert made["(B1 -> A3).mean"][14] < 1
    assert made["(B1 -> C1).trace"][:3].tolist() == [0.3] * 3
    assert made["(A1 -> D1).centre"][4:14].tolist() == [0.4] * 10
    assert made["(A1 -> D2).centre"][13] != made["(A1 -> D2).centre"][4]
    # of lesioned connections it is held, too, and stays behind that until they are mended
    assert made["(A1 -> B1).g"][6:12].tolist() == [-0.2] * 6
    assert made["(A1 -> B1).g"][12] != -0.2
    free = record(gates().network, Course(3, keep=Keep(states=("all",))))
    np.testing.assert_array_equal(made.states[:3], free.states)


def test_what_is_formed_of_a_state_that_is_held_sees_it_at_all_stages() -> None:
    """B is linear, its drive constant while the gates are held: the solution is in closed form."""
    text = SPEC[: SPEC.index("events:")].replace("METHOD", "rk4").replace("0.8*u + 0.1*pre.v, each_episode: 0.5*u", "u")
    clamped = f"{text}events: [{{from: 0, clamp: {{(A -> B).g: 2, (A -> B).trace: 0}}}}]\n"
    made = record(nv.compile_text(clamped).network, Course(30))
    t = made.step * 0.1
    drive, rate = 3 * 0.5 * 2, 1 + 3 * 0.5 * 0.1
    expected = drive / rate + (0.2 - drive / rate) * np.exp(-rate * t)
    np.testing.assert_allclose(made["B1"], expected, rtol=3e-6)


@pytest.mark.parametrize("method", ["euler", "heun", "{method: rk4, substeps: 2}", "semi_implicit", "exponential"])
@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_every_backend_holds_them_as_the_reference_does(backend: str, method: str) -> None:
    expected, made = (run(one, method) for one in ("reference", backend))
    for part in ("activity", "weights", "states"):
        np.testing.assert_array_equal(getattr(made, part), getattr(expected, part), part)


@pytest.mark.compiler
@pytest.mark.parametrize("small", [0, 600], ids=["loops", "written out"])
def test_c_holds_them_in_loops_and_exported(small: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (c_backend, c_export):
        monkeypatch.setattr(module, "SMALL", small)
    assert run("c", "rk4").states.tobytes() == run("reference", "rk4").states.tobytes()
    runs_alike(gates(), tmp_path, steps=19)
    assert "what neurons are held at, then states" in (tmp_path / "gates.h").read_text()


@pytest.mark.parametrize("backend", BACKENDS)
def test_by_hand_they_are_held_through_a_checkpoint_and_released(backend: str, tmp_path: Path) -> None:
    network = gates().network
    one, other = Simulation(network, backend), Simulation(network, backend)
    for _ in range(2):
        one.step()
    one.clamp("(A1 -> B1).g", 0.9)
    one.clamp("(B -> A).trace", 0.25)
    for _ in range(4):  # an event holds g, too: what is held by hand comes after events
        one.step()
    one.save_state(tmp_path / "state")
    other.restore(tmp_path / "state")
    for simulation in (one, other):
        simulation.release("(B -> A).trace")
        for _ in range(3):
            simulation.step()
    assert one.activity.tolist() == other.activity.tolist()
    cells = [
        {str(key): cell["g"].tolist() for key, cell in one.state().cells.items() if "g" in cell} for one in (one, other)
    ]
    assert cells[0] == cells[1]
    assert [values[0] for values in cells[0].values()] == [0.9]
    assert not one.held.any()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(A -> B).h", "no state 'h'"),
        ("(A -> C).g", "there is no connection"),
        ("(A -> B).signal", "no state 'signal'"),
        ("(A -> B).weight", "no state 'weight'"),
    ],
)
def test_what_no_connection_keeps_cannot_be_held(text: str, message: str) -> None:
    with pytest.raises(UnknownNameError, match=message):
        Simulation(gates().network, "reference").clamp(text, 1)


def test_exports_without_such_clamps_hold_as_much_as_before() -> None:
    """States of rules take no room in the struct where none of them is held."""
    text = SPEC[: SPEC.index("events:")].replace("METHOD", "rk4")
    network = nv.compile_text(f"{text}events: [{{from: 2, clamp: {{B.v: 1}}}}]\n").network
    assert c_export.Exported(network).clampable == len(network.neurons) + 5
    assert c_export.Exported(gates().network).clampable == gates().network.clampable
