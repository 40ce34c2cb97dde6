"""Runs of a network with a body: sensors, actuators, episodes, what is recorded, and going on exactly."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from toy_bodies import SPEC, Cart, carted, registered

import neurovis_spec as nv
from neurovis_spec.body import BodyError, open_body
from neurovis_spec.compiler.body_settings import Moved
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.runtime.backend import available
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import Embodied, seed_of
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.rows import Rows
from neurovis_spec.runtime.simulation import Simulation


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


def same(one: Recording, other: Recording) -> bool:
    """Whether two recordings hold the same bits."""
    pairs = zip((one.step, *one.rows), (other.step, *other.rows), strict=True)
    return all(a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in pairs)


def test_a_command_reads_no_signal_of_a_synapse() -> None:
    synapse = "synapses: {gap: {signal: weight*pre}}\n"
    joined = SPEC.replace("{weight: -0.7}", "{weight: -0.7, synapse: gap}")
    spec = joined.replace("drive: O1", "drive: (P -> O1).signal")
    with pytest.raises(BodyError, match="a command reads a signal of a synapse"):
        carted(spec=spec + synapse).run(3)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_command_reads_a_state_of_a_synapse_which_goes_on_where_it_was(backend: str, tmp_path: Path) -> None:
    synapse = "synapses: {gap: {state: {g: {each_step: 0.5*g + pre}}, signal: weight*g - 0.1*post}}\n"
    joined = SPEC.replace("{weight: -0.7}", "{weight: -0.7, synapse: gap, delay: 3}")
    compiled = carted(spec=joined.replace("drive: O1", "drive: (P -> O1).g") + synapse)
    whole = compiled.run(60, backend=backend)
    plain = compiled.run(60, backend="reference")
    np.testing.assert_allclose(whole.activity, plain.activity, rtol=1e-12)
    simulation, other = compiled.simulator(backend), compiled.simulator(backend)
    for _ in range(25):
        simulation.step()
    simulation.save_state(tmp_path / "state")
    other.restore(tmp_path / "state")
    for _ in range(35):
        other.step()
    np.testing.assert_array_equal(other.activity, whole.activity[-1])


def by_hand(steps: int, given: str, backend: str) -> Recording:
    """A run as a loop of one's own: the network without a body, and a cart beside it."""
    bare = replace(carted().network, body=None)
    simulation, cart = Simulation(bare, backend), Cart(0.12 if given == "short" else float("inf"))
    episode, gain = 0, 0.8
    cart.reset(seed_of(bare, episode))
    rows: list[tuple[npt.ArrayLike, ...]] = []
    for k in range(steps):
        x, first, second, clock = cart.sense()
        weights, pose = simulation.weights, cart.pose()
        simulation.step(place=x, arms=[second, first])
        rows.append((simulation.activity, weights, [], [x, first, second, clock], pose))
        if cart.ended or (k + 1) % 40 == 0:
            episode += 1
            cart.reset(seed_of(bare, episode))
        else:
            drive, other = simulation.activity[4:]
            cart.advance(0.05, np.array([gain * drive, 0.0, other - 2 * drive + np.pi * 0.05]))
    columns = (np.array(part) for part in zip(*rows, strict=True))
    return carted().run(steps).having(np.arange(steps), Rows(*columns))


@pytest.mark.parametrize("given", ["plain", "short"])
@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_run_with_a_body_is_the_loop_that_one_would_write(given: str, backend: str) -> None:
    if not available(backend).available:
        pytest.fail("the tests need a compiler")
    assert same(carted(given).run(130, backend=backend), by_hand(130, given, backend))


def test_the_walk_is_the_loop_of_its_network_and_its_model() -> None:
    """Commands by the evaluator that the others are tested against, for an episode and a half."""
    compiled = nv.compile(Path(__file__).parent.parent / "specs/walk/walk.yaml")
    network, settings = compiled.network, compiled.network.body
    assert settings is not None
    assert network.episode is not None
    body = open_body(settings.kind, settings.given, settings.path, network.dt, settings.substeps)
    simulation, names = compiled.simulator(body=False), [port.name for port in body.sensors]
    places = np.cumsum([0, *(port.size for port in body.sensors)])
    wanted = compiled.run(100)
    body.reset(seed_of(network, 0))
    for k in range(100):
        sensed = body.sense()
        given = {}
        for one in settings.sensed:
            parts = [sensed[places[names.index(name)] : places[names.index(name) + 1]] for name in one.sensors]
            given[network.inputs[one.input].name] = np.concatenate(parts)
        assert np.array_equal(body.pose(), wanted.pose[k])  # type: ignore[index]
        assert np.array_equal(sensed, wanted.sensors[k])  # type: ignore[index]
        simulation.step(given)
        assert np.array_equal(simulation.activity, wanted.activity[k])
        if (k + 1) % network.episode == 0:
            body.reset(seed_of(network, 1))
            continue
        commands = np.zeros(len(body.actuators))
        for move in settings.moved:
            known = {name: simulation.parameters[name] for name, _ in move.parameters}
            for name, output, number in move.outputs:
                known[name] = float(simulation.activity[network.outputs[output].neurons[number]])
            index = [port.name for port in body.actuators].index(move.actuator)
            commands[index] = evaluate(move.command, known)
        body.advance(network.dt, commands)


# ---- what is given wins over what is sensed ------------------------------------------------------------------------


def test_an_input_that_is_given_wins_over_its_sensor() -> None:
    run, told = carted().run(30), carted().run(30, {"place": np.full(30, 0.3)})
    assert np.array_equal(told["P"], np.full(30, np.tanh(0.3)))
    assert np.array_equal(told["A"], np.tanh(told.sensor("arm")[:, ::-1]))
    assert not np.array_equal(run["P"], told["P"])
    simulation = carted().simulator()
    for _ in range(30):
        simulation.step(place=0.3)
    assert np.array_equal(simulation.activity, told.activity[-1])
    simulation.step()
    assert simulation.sensed is not None
    assert simulation.activity[0] == np.tanh(simulation.sensed[0])


def test_a_source_that_a_sensor_replaces_is_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        carted(spec=SPEC.replace("place: {expression: 0.5}", "place: {expression: 1/k}")).run(3)
        carted(spec=SPEC.replace("place: {expression: 0.5}", "place: {expression: tanh(1/k)}")).run(3)


def test_what_the_formula_of_another_input_hides_is_warned_of() -> None:
    hiding = SPEC.replace("{expression: sin(t)}", "{expression: tanh(1/(k - 2))}")
    with pytest.warns(RuntimeWarning, match="the input 'wave' of W has an undefined operation at step 2"):
        carted(spec=hiding).run(5)
    simulation = carted(spec=hiding).simulator()
    simulation.step()
    simulation.step(place=0.1)
    with pytest.warns(RuntimeWarning, match="the input 'wave' of W has an undefined operation at step 2"):
        simulation.step(place=0.1)


def test_a_sensor_that_is_no_number_is_warned_of_by_its_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Cart, "sense", lambda self: np.array([np.nan, 0.0, 0.0, 0.0]))
    with pytest.warns(RuntimeWarning, match="the activity of P is nan at step 0"), pytest.raises(BodyError) as raised:
        carted().run(3)
    assert str(raised.value) == "at step 1: the command of 'push' is nan"


# ---- parameters, states and numbers in commands --------------------------------------------------------------------


def test_commands_follow_parameters_that_are_set_from_the_step_that_they_are_set_for() -> None:
    compiled, cart = carted(), Cart()
    simulation = Simulation(compiled.network, body=Embodied(compiled.network, cart))
    simulation.step()
    simulation.set(gain=0.0)
    simulation.step()
    simulation.set(gain=2.0)
    drive = float(simulation.step()["drive"])
    pushes = [push for push, _, _ in cart.commands]
    assert pushes[1] == 0.0
    assert pushes[2] == 2.0 * drive


def test_a_command_reads_the_states_that_outputs_name() -> None:
    spec = SPEC.replace(
        "A: {count: 2, activation: tanh", "A: {count: 2, model: leaky_integrator, activation: tanh"
    ).replace("both: O}", "both: O, held: A.v}")
    compiled = carted(spec=spec)
    body = compiled.network.body
    assert body is not None
    index = [output.name for output in compiled.network.outputs].index("held")
    moved = Moved("lift[0]", parse("-held"), (("held", index, 1),), ())
    network = replace(compiled.network, body=replace(body, moved=(moved, *body.moved)))
    cart = Cart()
    simulation = Simulation(network, body=Embodied(network, cart))
    for _ in range(5):
        held = simulation.step()["held"]
        assert cart.commands[-1][1] == -np.asarray(held)[1]


# ---- episodes ------------------------------------------------------------------------------------------------------


def test_an_episode_ends_with_its_last_step_and_the_next_begins_with_a_seed_of_its_own() -> None:
    compiled, cart = carted(), Cart()
    network = compiled.network
    simulation = Simulation(network, body=Embodied(network, cart))
    ended = []
    for k in range(90):
        assert simulation.episode == k // 40
        before = simulation.sensors["clock"]
        simulation.step()
        assert simulation.sensed is not None
        assert simulation.sensed[3] == before == pytest.approx(0.05 * (k % 40))
        ended.append(simulation.ended_episode)
    assert [k for k, yes in enumerate(ended) if yes] == [39, 79]
    assert cart.seeds[1:] == [seed_of(network, 0), seed_of(network, 1), seed_of(network, 2)]
    assert len(set(cart.seeds)) == 4
    assert seed_of(replace(network, seed=5), 0) != seed_of(network, 0)


def test_a_body_that_ends_an_episode_is_seen_at_its_end_and_reset_then() -> None:
    recording = carted("short").run(200)
    x, clock = recording.sensor("x"), recording.sensor("clock")
    over = np.abs(x) > 0.12
    assert over.any()
    assert not over[1:][over[:-1]].any()
    assert (clock[1:][over[:-1]] == 0).all()
    simulation = carted("short").simulator()
    for _ in range(200):
        simulation.step()
    ends = over | (np.arange(200) % 40 == 39)
    assert simulation.episode == ends.sum()
    assert simulation.ended_episode == ends[-1]


def test_without_reset_an_episode_of_the_network_ends_and_the_body_goes_on() -> None:
    compiled = carted(each_episode=False)
    simulation, recording = compiled.simulator(), compiled.run(90)
    assert np.allclose(recording.sensor("clock"), np.arange(90) * 0.05, rtol=1e-12)
    for _ in range(80):
        simulation.step()
    assert (simulation.episode, simulation.ended_episode) == (2, True)


def test_a_reward_that_is_sensed_belongs_to_the_episode_that_ends() -> None:
    """The rule adds up what it is given where an episode ends: the clock of the last step of it."""
    spec = SPEC.replace("plasticity: hebbian", "plasticity: {told: {reward: P}}").replace(
        "neurons:",
        "rules: {told: {signals: [reward], weight: {each_episode: weight + reward}}}\nneurons:",
        1,
    )
    compiled = carted(spec=spec)
    body = compiled.network.body
    assert body is not None
    clock = replace(body.sensed[0], sensors=("clock",))
    network = replace(compiled.network, body=replace(body, sensed=(clock, body.sensed[1])))
    recording = record(network, Course(90))
    weight = recording.weight("W -> O1")
    last = np.tanh(recording.sensor("clock")[39])
    assert last == pytest.approx(np.tanh(39 * 0.05))
    assert weight[40] - weight[39] == pytest.approx(last)
    assert weight[80] - weight[40] == pytest.approx(last)


def test_episodes_of_a_network_without_a_body_are_those_of_its_time() -> None:
    simulation = carted().with_body(False).simulator()
    assert (simulation.episode, simulation.ended_episode) == (0, False)
    for _ in range(40):
        simulation.step()
    assert (simulation.episode, simulation.ended_episode) == (1, True)
    assert simulation.sensors == {}
    assert simulation.pose is None
    assert simulation.skeleton is None
    assert simulation.sensed is None
