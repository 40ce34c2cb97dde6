"""Use case 2 of the paper: a hexapod that stands, and a network that learns to walk with it from reward alone."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

FOLDER = Path(__file__).parents[1] / "specs" / "walk"
SPEC = FOLDER / "walk.yaml"
EPISODE = 63
LEGS = ("l1", "l2", "l3", "r1", "r2", "r3")
FEET = tuple(f"foot_{leg}" for leg in LEGS)


class Hexapod:
    """The model alone, under commands for a while."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(FOLDER / "hexapod.xml"))
        self.data = mujoco.MjData(self.model)

    def go(self, seconds: float, **commands: float) -> None:
        for name, value in commands.items():
            self.data.actuator(name).ctrl = value
        mujoco.mj_step(self.model, self.data, round(seconds / self.model.opt.timestep))

    def now(self, *names: str) -> npt.NDArray[np.float64]:
        return np.concatenate([self.data.sensor(name).data for name in names])


def way(recording: Recording) -> npt.NDArray[np.float64]:
    """How far the robot came in each episode."""
    assert recording.sensors is not None
    return recording.sensors[EPISODE - 1 :: EPISODE, list(recording.sensor_names).index("torso_x")]


def test_the_hexapod_has_eighteen_joints_each_with_a_servo_and_feet_that_feel() -> None:
    model = Hexapod().model
    servos = {model.actuator(i).name for i in range(model.nu)}
    assert servos == {f"{joint}_{leg}" for joint in ("bc", "cf", "ft") for leg in LEGS}
    sensors = {model.sensor(i).name for i in range(model.nsensor)}
    assert sensors >= {*FEET, *servos, *(f"torque_{servo}" for servo in servos), "torso_x", "torso_up"}
    assert model.opt.timestep == 0.002


def test_the_hexapod_stands_still() -> None:
    robot = Hexapod()
    robot.go(5)
    assert np.abs(robot.now("torso_x", "torso_y")).max() < 1e-6
    assert robot.now("torso_z") == pytest.approx(0.111, abs=0.001)
    assert robot.now("torso_up")[2] > 0.99999
    weight = -robot.model.opt.gravity[2] * robot.model.body_subtreemass[0]
    assert robot.now(*FEET).sum() == pytest.approx(weight, rel=0.01)
    assert robot.now(*FEET).min() > 3


def test_the_same_command_means_the_same_on_both_sides() -> None:
    """More is forward, lifted, stretched: a foot goes forward, up, out."""
    for joint, (axis, other) in {"bc": (0, 0), "cf": (2, 2), "ft": (1, -1)}.items():
        for leg in LEGS:
            robot = Hexapod()
            robot.model.opt.gravity[:] = 0
            mujoco.mj_forward(robot.model, robot.data)
            before = robot.data.geom(f"foot_{leg}").xpos.copy() - robot.data.geom("torso").xpos
            robot.go(0.5, **{f"{joint}_{leg}": 0.4})
            moved = robot.data.geom(f"foot_{leg}").xpos - robot.data.geom("torso").xpos - before
            sign = -1 if other == -1 and leg.startswith("r") else 1
            assert sign * moved[axis] > 0.02, (joint, leg)


def test_it_is_the_papers_network() -> None:
    network = nv.compile(SPEC).network
    assert (len(network.neurons), len(network.connections)) == (12, 28)


def test_it_learns_to_walk_within_a_hundred_episodes() -> None:
    """Ten seeds come 0.28 ± 0.07 m far by then, 0.49 ± 0.01 m after 250 (benchmarks/walk.py)."""
    found = way(nv.compile(SPEC, seed=7).run(100 * EPISODE))
    assert found[:10].mean() < 0.1
    assert found[-10:].mean() > 0.25


def test_what_was_learned_walks_without_the_noise_and_without_learning() -> None:
    learned = [0.96, 0.28, -1.17, -0.92, 0.11, 0.83, 1.33, 1.2]
    text = SPEC.read_text(encoding="utf-8").replace("weight: 0\n", f"matrix: {[[w] for w in learned]}\n")
    found = way(nv.compile_text(text, folder=FOLDER, parameters={"trial": 0, "eta": 0}).run(3 * EPISODE))
    assert found.min() > 0.4


def test_the_printed_rule_is_eq_15_of_a_policy_that_is_output_and_noise() -> None:
    """``as_printed`` here is the built-in ``reward_modulated``, with a neuron that adds N to O."""
    text = SPEC.read_text(encoding="utf-8")
    text = text[: text.index("\nbody:")] + "\n" + text[text.index("\nlayout:") :]
    here = text.replace("{policy_gradient:", "{as_printed:")
    built_in = text.replace("{policy_gradient:", "{reward_modulated:").replace("noise: N, reward", "policy: P, reward")
    built_in = built_in.replace("neurons:\n", "neurons:\n  P: {}\n").replace(
        "connections:\n", "connections:\n  O + N -> P: {delay: 0}\n"
    )
    given = {"way": np.sin(np.arange(10 * EPISODE) / 100)}
    one, other = (
        nv.compile_text(each, centre=1).run(10 * EPISODE, given).weight("K3 -> O") for each in (here, built_in)
    )
    assert np.abs(one[-1]) > 0.1
    np.testing.assert_allclose(one, other, rtol=1e-9)
