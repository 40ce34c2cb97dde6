"""Environments of Gymnasium as bodies: spaces become sensors and actuators, episodes end, copies are exact."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium import spaces

import neurovis_spec as nv
from neurovis_spec.body import Body, BodyError, BodyMissingError, open_body

MODEL = """\
<mujoco><worldbody><body name="rod"><joint type="slide"/><geom type="capsule" fromto="0 0 0 0 0 1" size="0.1"/></body>
</worldbody></mujoco>
"""


class Counter(gymnasium.Env[dict[str, object], np.ndarray[Any, Any]]):
    """Counts steps; an episode has three. What was done last is observed."""

    observation_space: spaces.Space[Any] = spaces.Dict(
        {"count": spaces.Discrete(10), "done": spaces.Box(-9, 9, (2, 2)), "flags": spaces.MultiBinary(2)}
    )
    action_space: spaces.Space[Any] = spaces.MultiDiscrete([4, 2])

    def reset(self, *, seed: int | None = None, options: object = None) -> tuple[dict[str, object], dict[str, Any]]:
        super().reset(seed=seed)
        self.count, self.start = 0, int(self.np_random.integers(10))
        return self.observation((0, 0)), {}

    def observation(self, action: Any) -> dict[str, object]:
        done = np.array([[self.start, self.count], [*action]], dtype=np.float32)
        return {"count": self.count, "done": done, "flags": np.array([1, 0], dtype=np.int8)}

    def step(self, action: Any) -> tuple[dict[str, object], float, bool, bool, dict[str, Any]]:
        assert self.action_space.contains(action), action
        self.count += 1
        return self.observation(np.ravel(action)), 0.5, self.count == 3, False, {}


class Shared(Counter):
    """Cannot be copied."""

    lock = None

    def __init__(self) -> None:
        self.lock = threading.Lock()


class Failing(Counter):
    """Fails at its first step, and a step takes half a second."""

    dt = 0.5

    def step(self, action: Any) -> tuple[dict[str, object], float, bool, bool, dict[str, Any]]:
        raise RuntimeError("no\npower")


class Odd(Counter):
    """Is told texts."""

    action_space = spaces.Text(5)


class Missing(Counter):
    """Needs what is not there."""

    def __init__(self) -> None:
        raise gymnasium.error.DependencyNotInstalled('motors are not installed, run `pip install "gymnasium[motors]"`')


class Physical(Counter):
    """Is made with MuJoCo."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)


def _made(kind: type[Counter], **settings: object) -> Counter:
    return kind(**settings)


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    made = {"Counter": Counter, "Shared": Shared, "Failing": Failing, "Odd": Odd, "Missing": Missing, "Rod": Physical}
    for name, kind in made.items():
        gymnasium.register(f"test/{name}-v0", partial(_made, kind))
    yield
    for name in made:
        del gymnasium.registry[f"test/{name}-v0"]


def opened(name: str, dt: float = 1.0, substeps: int | None = None) -> Body:
    return open_body("gymnasium", name, None, dt, substeps)


def test_spaces_become_sensors_and_actuators() -> None:
    body = opened("test/Counter-v0")
    assert [(port.name, port.size) for port in body.sensors] == [
        ("observation.count", 1),
        ("observation.done", 4),
        ("observation.flags", 2),
        ("reward", 1),
    ]
    (action,) = body.actuators
    assert (action.name, action.size, action.low, action.high) == ("action", 2, 0, 3)
    assert action.ranges == ((0, 3), (0, 1))
    start = body.sense()[1]
    assert body.sense().tolist() == [0, start, 0, 0, 0, 1, 0, 0]
    body.advance(1.0, np.array([2.4, 7.0]))  # rounded, and within what there is
    assert body.sense().tolist() == [1, start, 1, 2, 1, 1, 0, 0.5]
    assert body.skeleton is None
    assert body.pose().shape == (0,)


def test_each_number_of_an_action_has_its_own_range(monkeypatch: pytest.MonkeyPatch) -> None:
    box = spaces.Box(np.array([-0.4, -2.0], np.float32), np.array([0.5, np.inf], np.float32))
    monkeypatch.setattr(Counter, "action_space", box)
    (action,) = opened("test/Counter-v0").actuators
    assert np.array(action.ranges) == pytest.approx(np.array([[-0.4, 0.5], [-2.0, np.inf]]))
    assert (action.low, action.high) == (-2.0, np.inf)


def test_an_episode_ends_and_a_reset_begins_another() -> None:
    body = opened("test/Counter-v0", substeps=2)
    body.advance(1.0, np.zeros(2))
    assert (body.ended, body.sense()[-1]) == (False, 1.0)
    body.advance(1.0, np.zeros(2))
    assert (body.ended, body.sense()[0], body.sense()[-1]) == (True, 3, 0.5), "the last of two steps is not made"
    with pytest.raises(BodyError, match="only a reset goes on"):
        body.advance(1.0, np.zeros(2))
    starts = set()
    for seed in range(8):
        body.reset(seed)
        starts.add(body.sense()[1])
        assert (body.ended, body.sense()[-1]) == (False, 0)
    assert len(starts) > 2
    body.reset(0)
    assert body.sense().tolist() == opened("test/Counter-v0").sense().tolist()


@pytest.mark.parametrize(("name", "dt"), [("CartPole-v1", 0.02), ("Pendulum-v1", 0.05), ("FrozenLake-v1", 1.0)])
def test_a_state_is_restored_exactly(name: str, dt: float) -> None:
    body = opened(name, dt)
    body.advance(dt, np.array([1.0]))
    state = body.state()
    ahead = []
    for _ in range(2):
        for k in range(4):
            body.advance(dt, np.array([float(k % 2)]))
            ahead.append(body.sense().tolist())
        body.restore(state)
    assert ahead[:4] == ahead[4:]
    with pytest.raises(BodyError, match="no state of this environment"):
        body.restore(np.zeros(3))


def test_what_cannot_be_copied_says_so() -> None:
    with pytest.raises(BodyError, match="cannot be copied"):
        opened("test/Shared-v0").state()


def test_the_step_of_an_environment_that_has_one_is_checked() -> None:
    opened("CartPole-v1", 0.04)
    with pytest.raises(BodyError, match=r"a step of the environment is 0\.02 s") as caught:
        opened("CartPole-v1", 0.04, 3)
    assert (caught.value.hint, caught.value.key) == ("write substeps: 2", "substeps")


def test_what_an_environment_raises_is_reported_on_one_line() -> None:
    body = opened("test/Failing-v0", 0.5)
    with pytest.raises(BodyError, match="the environment fails: RuntimeError: no power"):
        body.advance(0.5, np.zeros(2))
    with pytest.raises(BodyError, match="not finite"):
        body.advance(0.5, np.array([np.nan, 0]))


@pytest.mark.parametrize(
    ("name", "words", "hint"),
    [
        ("CartPole-v7", "has no environment 'CartPole-v7'", "did you mean 'CartPole-v1'"),
        ("x" * 100_000, "an id of 100,000 characters", None),
        ("x y", "Malformed environment ID", None),
        ("os:Thing-v0", "no package of that name is installed", "MODULE:ID"),
        ("tests.test_body_gymnasium:Thing-v0", "no package of that name is installed", "MODULE:ID"),
        ("test/Odd-v0", "the action of this environment is a Text", "of numbers"),
    ],
)
def test_what_is_no_environment_is_reported(name: str, words: str, hint: str | None) -> None:
    with pytest.raises(BodyError, match=words) as caught:
        opened(name)
    assert (caught.value.hint or "").startswith(hint or "")


def test_what_an_environment_needs_besides_is_a_warning() -> None:
    with pytest.raises(BodyMissingError, match="motors are not installed"):
        opened("test/Missing-v0")
    text = (
        "neurovis: 1\nname: x\ninputs: {a: {}}\nneurons: {A: {input: a}}\n"
        "body: {gymnasium: test/Missing-v0, sensors: {a: anything}}"
    )
    (found,) = nv.compile_text(text).warnings
    assert (found.code, found.span.line, found.span.column) == ("body-unchecked", 5, 19)
    assert found.hint == 'run `pip install "gymnasium[motors]"`'


def test_an_environment_made_with_mujoco_can_be_drawn() -> None:
    body = opened("test/Rod-v0")
    assert body.skeleton is not None
    (link,) = body.skeleton.links
    assert sorted(body.pose().reshape(-1, 3)[[link.start, link.end]].round(9).tolist()) == [[0, 0, 0], [0, 0, 1]]


def test_a_network_balances_a_pole() -> None:
    network = nv.compile_text("""\
neurovis: 1
name: balance
time: {dt: 0.02, steps: 200}
inputs: {pole: {size: 4}, reward: {}}
neurons: {A: {count: 4, input: pole}, R: {input: reward}, O: {}}
connections:
  A -> O: {matrix: [[0.1], [0.5], [3], [1]], delay: 0}
outputs: {push: O}
body:
  gymnasium: CartPole-v1
  sensors: {pole: observation, reward: reward}
  actuators: {action: 1 if push > 0 else 0}
""")
    assert network.warnings == ()
    run = network.run()
    assert run["R"].sum() == 199, "a pole that stands is worth 1 a step"
