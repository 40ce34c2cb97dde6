"""What is done to what flows in a run: clamps of activities and of states, lesions, parameters, going on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec.arguments import CodedWarning
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.turns import Hold, Release, Set, Turn
from neurovis_spec.runtime.backend import BackendError, Capabilities, load
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.errors import UnknownNameError
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import initial_state

BOTH = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
#: two cells that turn, each of which the other pulls at; the second is seen by a map without delay
PAIR = """
neurovis: 1
name: pair
time: {dt: 0.02}
parameters: {pull: 0.5, at: -0.3}
models:
  turning:
    parameters: {speed: 2}
    state:
      x: {initial: 1, derivative: "speed*y + drive", noise: NOISE}
      y: {derivative: "-speed*x", each_step: "clip(y, -2, 2)"}
      count: {each_step: count + 1}
    outputs: {size: x^2 + y^2}
    activity: x
neurons:
  A: {model: turning}
  B: {model: {turning: {speed: 3}}}
  M: {model: {leaky_integrator: {leak: 0.1}}}
connections:
  A -> B: {weight: pull}
  B -> A: {weight: -0.4, send: y}
  B -> M: {weight: 1, delay: 0, send: size}
EVENTS
"""


def pair(events: str = "", noise: str = "0") -> Network:
    text = PAIR.replace("NOISE", noise).replace("EVENTS", f"events: [{events}]" if events else "")
    return nv.compile_text(text).network


def run(events: str, steps: int, backend: str, noise: str = "0") -> Recording:
    return record(pair(events, noise), Course(steps, backend=backend, keep=Keep(states=("all",))))


@pytest.mark.parametrize("backend", BOTH)
def test_a_state_that_is_held_stays_while_the_others_go_on(backend: str) -> None:
    """Voltage clamp: no derivative, no noise; what reads it sees it at all stages."""
    made = run("{from: 5, to: 50, clamp: {A.x: at}}, {at: 20, set: {at: 0.8}}", 80, backend, "0.3")
    x, y = made["A.x"], made["A.y"]
    assert (x[5:20] == -0.3).all()
    assert (x[20:50] == 0.8).all()
    assert made.activity[20:50, 0].tolist() == x[20:50].tolist()
    np.testing.assert_allclose(np.diff(y[5:20]), 2 * 0.3 * 0.02, rtol=1e-9)  # exact, with x the same at all stages
    assert len(set(x[50:])) == 30
    free = run("", 5, backend, "0.3")
    np.testing.assert_array_equal(made.states[:5], free.states)


@pytest.mark.parametrize("backend", BOTH)
def test_an_activity_that_is_held_is_so_at_all_stages_and_states_go_on(backend: str) -> None:
    made = run("{from: 0, clamp: {A: 0.25}}", 60, backend)
    assert (made.activity[:, 0] == 0.25).all()
    assert made["A.x"].std() > 0.3
    # what A takes of B is as if nothing had happened, and B is a linear cell with a constant drive
    t, drive = made.step * 0.02, 0.5 * 0.25
    np.testing.assert_allclose(made["B.x"], np.cos(3 * t) + drive / 3 * np.sin(3 * t), atol=1e-6)


@pytest.mark.parametrize("backend", BOTH)
def test_what_is_lesioned_sends_nothing_and_its_states_go_on(backend: str) -> None:
    made = run("{at: 10, lesion: A}, {at: 40, mend: A}", 60, backend)
    assert (made.activity[10:40, 0] == 0).all()
    x, y = made["A.x"][10:40], made["A.y"][10:40]
    np.testing.assert_allclose(x**2 + y**2, x[0] ** 2 + y[0] ** 2, rtol=1e-7)  # nothing pulls at it
    assert made.activity[45, 0] == made["A.x"][45] != 0


@pytest.mark.parametrize("backend", BOTH)
def test_states_of_maps_are_held_too(backend: str) -> None:
    made = run("{from: 3, to: 9, clamp: {M.v: 2}}", 20, backend)
    assert (made["M.v"][3:9] == 2).all()
    assert (made.activity[3:9, 2] == 2).all()
    size = made["B.size"]
    np.testing.assert_allclose(made["M.v"][9], 0.9 * 2 + 0.1 * size[9], rtol=1e-12)


@pytest.mark.parametrize("backend", BOTH)
def test_what_is_held_by_hand_goes_through_a_checkpoint(backend: str, tmp_path: Path) -> None:
    network = pair("{from: 4, to: 30, clamp: {B.y: at}}", "0.1")
    one, other = Simulation(network, backend), Simulation(network, backend)
    for _ in range(6):
        one.step()
    one.clamp("A.x", 0.7)
    one.clamp("M", 1)
    one.step()
    one.save_state(tmp_path / "state")
    other.restore(tmp_path / "state")
    for _ in range(9):
        one.step()
        other.step()
    assert one.activity.tolist() == other.activity.tolist()
    assert one.activity[0] == 0.7
    assert one.held.tolist() == [False, False, True]
    for simulation in (one, other):
        simulation.release("A.x")
        simulation.step()
    assert one.activity.tolist() == other.activity.tolist()
    assert one.activity[0] != 0.7


def test_a_backend_that_holds_no_states_refuses_them() -> None:
    """By name, before the run, by hand, and where a state is gone on from."""

    class Plain(NumpyBackend):
        name = "plain"
        capabilities = Capabilities(noise=True, flows=True)

    with pytest.raises(BackendError, match=r"'plain' cannot run 'pair': no clamps of states"):
        Simulation(pair("{from: 3, clamp: {A.x: 1}}"), Plain())
    simulation, other = Simulation(pair(), Plain()), Simulation(pair(), "numpy")
    with pytest.raises(BackendError, match=r"'plain' cannot clamp the state 'A.x'; 'numpy' can"):
        simulation.clamp("A.x", 1)
    simulation.clamp("A", 1)
    other.clamp("A.x", 1)
    with pytest.warns(UserWarning, match="last bits"), pytest.raises(BackendError, match=r"cannot clamp a state"):
        simulation.restore(other.state())


def test_two_clamps_of_a_state_are_told_and_those_of_different_things_are_not() -> None:
    text = PAIR.replace("NOISE", "0").replace("EVENTS", "events: [EVENTS]")
    both = "{from: 1, to: 9, clamp: {A.x: 1}}, {from: 5, to: 12, clamp: {A.x: 2}}"
    (told,) = [one for one in nv.compile_text(text.replace("EVENTS]", f"{both}]")).warnings if "clamp" in one.code]
    assert told.code == "clamps-overlap"
    assert "clamp the same state at the steps 5 to 8" in told.message
    apart = "{from: 1, clamp: {A.x: 1, A.y: 2, A: 3, B.x: 0}}"
    assert not [one for one in nv.compile_text(text.replace("EVENTS]", f"{apart}]")).warnings if "clamp" in one.code]


def test_only_states_of_models_are_held() -> None:
    simulation = Simulation(pair(), "numpy")
    with pytest.raises(UnknownNameError, match=r"'B.size' is an output, made anew at each step"):
        simulation.clamp("B.size", 1)
    with pytest.raises(UnknownNameError, match=r"has no state 'z'"):
        simulation.clamp("B.z", 1)
    with pytest.raises(nv.SpecError, match=r"has no state 'size'"):
        pair("{from: 1, clamp: {B.size: 1}}")
    with pytest.raises(nv.SpecError, match=r"finite"):
        pair("{from: 1, clamp: {B.y: 1/0}}")


@pytest.mark.parametrize("backend", BOTH)
def test_a_run_goes_on_from_a_recording_with_all_states(backend: str) -> None:
    """Exactly; one without them says that they begin anew."""
    network, keep = pair(noise="0.1"), Keep(states=("all",))
    whole = record(network, Course(40, backend=backend, keep=keep))
    first = record(network, Course(25, backend=backend, keep=keep))
    rest = record(network, Course(15, backend=backend, keep=keep, start=first))
    np.testing.assert_array_equal(rest.states, whole.states[25:])
    np.testing.assert_array_equal(rest.activity, whole.activity[25:])
    with pytest.warns(CodedWarning, match=r"lacks states with a derivative, as of A, which begin anew") as told:
        anew = record(network, Course(3, backend=backend, start=record(network, Course(25, backend=backend))))
    assert [one.message.code for one in told] == ["states-begin-anew"]  # type: ignore[union-attr]
    assert abs(anew.activity[0, 0] - 1) < 0.1


def test_the_warning_of_states_that_begin_anew_has_its_code_on_the_command_line(tmp_path: Path) -> None:
    spec, first = tmp_path / "spec.yaml", str(tmp_path / "first.npz")
    spec.write_text("neurovis: 1\nname: x\ntime: {dt: 1 ms}\nneurons: {A: {model: hopf}}\n")
    for more, told in (("-o", ""), ("--from", "warning[states-begin-anew]: the recording lacks states")):
        result = CliRunner().invoke(neurovis, ["run", str(spec), "--steps", "3", more, first])
        assert result.exit_code == 0
        assert result.stderr.startswith(told)
        assert ("begin anew" in result.stderr) == bool(told)


@pytest.mark.parametrize("backend", BOTH)
def test_what_a_caller_gives_is_held_over_a_step_in_place_of_a_formula(backend: str) -> None:
    """A formula is evaluated at each stage; a value, at a step or for a whole run, is the same at all of them."""
    text = "neurovis: 1\nname: g\ntime: {dt: 0.5}\ninputs: {wave: {expression: 3*t^2}}\n"
    text += "models: {m: {state: {v: {derivative: drive}}, activity: v}}\nneurons: {N: {model: m, input: wave}}\n"
    network = nv.compile_text(text).network
    formula = record(network, Course(3, backend=backend)).activity[:, 0]
    np.testing.assert_allclose(formula, [0, 0.125, 1], atol=1e-6)  # t^3: rk4 is exact for it
    given = record(network, Course(3, backend=backend, inputs={"wave": [0, 2, 4]})).activity[:, 0]
    assert given.tolist() == [0, 1, 3]
    simulation = Simulation(network, backend)
    simulation.step()
    simulation.step(wave=2)
    assert simulation.activity[0] == 1
    simulation.step()
    np.testing.assert_allclose(simulation.activity[0], 1 + 0.875, atol=1e-6)


@pytest.mark.parametrize("backend", BOTH)
def test_what_is_not_finite_is_told_of_states_and_outputs(backend: str) -> None:
    text = "neurovis: 1\nname: g\ntime: {dt: 0.5, integrate: euler}\n"
    text += "models: {m: {state: {v: {initial: 2, derivative: v^2}}, activity: tanh(v), outputs: {o: exp(v)}}}\n"
    network = nv.compile_text(text + "neurons: {N: {model: m}}\n").network
    with pytest.warns(RuntimeWarning, match=r"the output 'o' of N is inf at step 4"):
        record(network, Course(12, backend=backend))


def test_noise_of_states_is_what_it_says() -> None:
    """An Ornstein-Uhlenbeck process: its deviation is that of theory, in milliseconds as in seconds."""
    for unit, tau, g in (("s", 0.02, 10), ("ms", 20, 10 / 1000**0.5)):
        text = f"neurovis: 1\nname: ou\ntime: {{dt: 0.001}}\nmodels: {{m: {{time: {unit}, state: {{v: {{derivative: "
        text += f"-v/{tau}, noise: {g}}}}}, activity: v}}}}\nneurons: {{N: {{count: 400, model: m}}}}\n"
        made = record(nv.compile_text(text).network, Course(400, backend="numpy")).activity[150:]
        assert abs(made.std() / (10 * (0.02 / 2) ** 0.5) - 1) < 0.05


def test_stepping_in_the_references_state_agrees_with_clamps_and_lesions() -> None:
    network = pair("{from: 2, to: 6, clamp: {A.x: at, B: 0.1}}, {at: 4, lesion: M}, {at: 5, set: {pull: 2}}", "0.1*y")
    state, reader, controls = initial_state(network), InputReader(network), Controls(network)
    steppers = [load(name).prepare(network) for name in ("reference", "numpy")]
    for k in range(9):
        controls.begin(state)
        states = [state.copy(), state.copy()]
        for stepper, own in zip(steppers, states, strict=True):
            stepper.step(own, reader.at(k))
        for owner, cells in states[0].cells.items():
            for name, values in cells.items():
                np.testing.assert_allclose(states[1].cells[owner][name], values, rtol=1e-13, atol=1e-15)
        state = states[0]


def test_the_live_view_goes_back_and_on_and_into_an_edited_network() -> None:
    """With a state held by hand on the way, exactly; and edited, a network goes on with the states that it has."""
    compiled = nv.compile_text(PAIR.replace("NOISE", "0.1").replace("EVENTS", ""))
    source = SimulatedSource(compiled.simulator(backend="numpy"))
    turns: dict[int, Turn] = {5: Hold("A.x", 0.5), 40: Release("A.x"), 50: Set({"pull": 2})}
    seen = {}
    for _ in range(80):
        source.advance()
        if source.step in turns:
            source.turn(turns[source.step])
        seen[source.step] = source.seen().snapshot.activity.copy()
    assert [seen[step][0] for step in (6, 40)] == [0.5, 0.5]
    for step in (79, 45, 20, 6, 60, 41):
        source.go(step)
        np.testing.assert_array_equal(source.seen().snapshot.activity, seen[step])
    source.go(79)
    edited = PAIR.replace("NOISE", "0.1").replace("EVENTS", "").replace("speed: 3", "speed: 2.5")
    other = carried(source, nv.compile_text(edited).simulator(backend="numpy"))
    assert other.step == 79
    np.testing.assert_allclose(other.seen().snapshot.activity, seen[79], atol=0.03)  # its last step made by the edited
    other.advance()
    np.testing.assert_allclose(other.seen().snapshot.activity, seen[80], atol=0.06)


def test_what_a_factor_of_a_port_reads_is_structural() -> None:
    """Set in a run it would have to reach the factor: it is refused by name, in events and by hand, and what it follows
    is, too."""
    text = """time: {dt: 0.1}
parameters: {g: 2, h: g/2}
models: {m: {ports: [a, b], state: {v: {derivative: a - 2*b - v}}, activity: v}}
neurons: {A: {bias: 1}, B: {model: m}}
connections: {A -> B: {port: {a: 1, b: h}}}
"""
    network = compiled(text)
    assert network.network.structural == {"g", "h"}
    for name in ("g", "h"):
        with pytest.raises(ParameterError, match=f"'{name}' cannot be set in a run: the structure"):
            network.simulator("numpy").set({name: 3})
    with pytest.raises(SpecError, match="'g' cannot be set in a run"):
        compiled(text + "events: [{at: 2, set: {g: 3}}]\n")
    other = compiled(text.replace("g: 2", "g: 5"))
    assert other.network.populations[1].ports[2].factors == pytest.approx([2.5])
