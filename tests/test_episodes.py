"""Episodes (language reference §5, Eq. 15), from YAML to weights: use case 2 in small."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

SPEC = Path(__file__).parents[1] / "specs" / "reward.yaml"


@pytest.fixture(scope="module")
def run() -> Recording:
    return nv.compile(SPEC).run()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_leg_learns_to_walk_from_reward_alone(seed: int) -> None:
    distance = nv.compile(SPEC, seed=seed).run()["D"]
    ends = distance[62::63]
    assert np.abs(ends[:10]).mean() < 1
    assert 0.3 < ends[90:100].mean() < 1.9  # over ten seeds 1.1 ± 0.4
    assert ends[-30:].mean() > 2


def test_without_a_rate_it_learns_nothing() -> None:
    run = nv.compile(SPEC, eta=0).run(6300)
    assert (run.weights == 0).all()
    assert abs(run["D"][62::63].mean()) < 0.3


def test_weights_change_at_ends_of_episodes_alone(run: Recording) -> None:
    changed = np.flatnonzero((np.diff(run.weights, axis=0) != 0).any(axis=1))
    assert ((changed + 1) % 63 == 0).all()
    assert len(changed) > 300


def test_the_weights_are_those_of_equation_15(run: Recording) -> None:
    policy, output, kernels, distance = run["P"], run["O"], run["K"], run["D"]
    weights, mean = np.zeros(8), 0.0
    for end in range(63, 63 * 50, 63):
        episode = slice(end - 63, end)
        np.testing.assert_allclose(run.weights[episode], np.tile(weights, (63, 1)), rtol=1e-9, atol=1e-12)
        tried = policy[episode, None] * kernels[episode] * (policy[episode, None] - output[episode, None])
        reward = distance[end - 1]
        weights = np.clip(weights + 0.1 * (reward - mean) * tried.sum(axis=0), -1, 1)
        mean = 0.8 * mean + 0.2 * reward


def test_a_state_of_a_model_begins_anew_after_an_episode(run: Recording) -> None:
    forward, distance = run["F"], run["D"]
    ways = forward[: 63 * 100].reshape(100, 63).cumsum(axis=1).ravel()
    np.testing.assert_allclose(distance[: 63 * 100], ways, rtol=1e-12, atol=1e-12)


def test_backends_agree_through_episodes(run: Recording) -> None:
    plain = nv.compile(SPEC).run(300, backend="reference")
    np.testing.assert_allclose(plain.activity, run.activity[:300], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(plain.weights, run.weights[:300], rtol=1e-9, atol=1e-12)


ORDER = """
neurovis: 1
name: order
time: {episode: 4}
models:
  counter:
    let: {twice: 2 * n}
    state: {n: {each_step: n + 1, each_episode: twice}, seen: {each_episode: n}}
    activity: n + 100 * seen
neurons: {A: {model: counter}}
"""


def test_an_episodes_end_reads_what_its_last_step_gave_and_computes_let_anew() -> None:
    # n: 1 2 3 4, then 8 (let sees the new 4, as does 'seen'); 9 10 11 12, then 24
    for backend in ("reference", "numpy"):
        a = nv.compile_text(ORDER).run(9, backend=backend)["A"].tolist()
        assert a == [1, 2, 3, 4, 409, 410, 411, 412, 1225]


def test_without_episodes_each_episode_never_comes() -> None:
    a = nv.compile_text(ORDER.replace("time: {episode: 4}", "")).run(9)["A"].tolist()
    assert a == list(range(1, 10))


@pytest.mark.parametrize("activity", ["v", "f(v)", "+v"])
def test_the_activity_of_an_episodes_last_step_is_of_before_its_end(activity: str) -> None:
    """Also where it is a state that nothing but an episode's end changes in an update."""
    text = f"""
neurovis: 1
name: counted
time: {{dt: 0.5, episode: 3, integrate: euler}}
models:
  clock: {{state: {{v: {{derivative: 2, each_episode: 0}}}}, activity: {activity}}}
  rises: {{state: {{v: {{each_episode: v + 1}}}}, activity: {activity}}}
neurons: {{A: {{count: 2, model: clock}}, B: {{count: 2, model: rises}}}}
"""
    for backend in ("reference", "numpy"):
        run = nv.compile_text(text).run(7, backend=backend)
        assert run["A1"].tolist() == [0, 1, 2, 1, 2, 3, 1]
        assert run["B1"].tolist() == [0, 0, 0, 1, 1, 1, 2]


def test_states_that_take_each_others_place_do_so_by_an_activation_that_is_the_identity() -> None:
    """In the text of NumPy's step ``f(v)`` is then ``v``: the array that is about to change."""
    text = """
neurovis: 1
name: swap
models: {swap: {state: {u: {initial: 1, each_step: f(v)}, v: {each_step: f(u)}}, activity: u}}
neurons: {A: {count: 2, model: swap}}
"""
    for backend in ("reference", "numpy"):
        assert nv.compile_text(text).run(4, backend=backend)["A1"].tolist() == [0, 1, 0, 1]
