"""Runs of a network with a body: sensors, actuators, episodes, what is recorded, and going on exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from toy_bodies import Cart, carted, registered

from neurovis_spec.runtime.backend import available
from neurovis_spec.runtime.embodied import seed_of
from neurovis_spec.runtime.kinds import Rows
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


def same(one: Recording, other: Recording) -> bool:
    """Whether two recordings hold the same bits."""
    pairs = zip((one.step, *one.rows), (other.step, *other.rows), strict=True)
    return all(a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in pairs)


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
@pytest.mark.parametrize("backend", ["reference", "numpy", "c"])
def test_a_run_with_a_body_is_the_loop_that_one_would_write(given: str, backend: str) -> None:
    if not available(backend).available:
        pytest.fail("the tests need a compiler")
    assert same(carted(given).run(130, backend=backend), by_hand(130, given, backend))
