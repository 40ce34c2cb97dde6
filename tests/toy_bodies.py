"""A body for tests, as plain as a body can be: a cart on a rail, which is pushed, with an arm that is lifted.

In: the name of a variant, as the spec gives it. Out: a Body. ``registered`` puts its kind where those of packages are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec import plugins
from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import Body, BodyError, Link, Port, Skeleton, Solid
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.body_settings import BodySettings, Moved, Sensed
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.body import BodyModel
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import names

SKELETON = Skeleton(
    ("cart", "hand"), (Link(0, 1, 0.05),), feet=(1,), middle=0, solids=(Solid((1.0, -1.0, 0.0), (2.0, 1.0, 0.5)),)
)


class Cart:
    """``x`` metres from the middle at ``v`` metres a second; the arm has two angles. Where it begins is random."""

    sensors: Sequence[Port] = (Port("x", 1, "m"), Port("arm", 2, "rad"), Port("clock", 1, "s"))
    actuators: Sequence[Port] = (Port("push", 1, low=-1.0, high=1.0), Port("lift", 2))
    skeleton: Skeleton | None = SKELETON

    def __init__(self, ends_at: float = float("inf")) -> None:
        self._ends_at = ends_at
        self.seeds: list[int] = []
        self.commands: list[list[float]] = []
        self._numbers = np.zeros(5)
        self.reset(0)

    def reset(self, seed: int) -> None:
        self.seeds.append(seed)
        self._numbers = np.array([np.random.default_rng(seed).uniform(-0.1, 0.1), 0.0, 0.0, 0.0, 0.0])

    def sense(self) -> FloatArray:
        x, _, first, second, clock = self._numbers
        return np.array([x, first, second, clock])

    def advance(self, dt: float, commands: FloatArray) -> None:
        assert not self.ended
        self.commands.append(commands.tolist())
        x, v, first, second, clock = self._numbers
        v += dt * float(np.clip(commands[0], -1.0, 1.0))
        lifted = first + dt * commands[1], second + dt * commands[2]
        self._numbers = np.array([x + dt * v, v, *lifted, clock + dt])

    @property
    def ended(self) -> bool:
        return bool(abs(self._numbers[0]) > self._ends_at)

    def pose(self) -> FloatArray:
        x, _, first, second, _ = self._numbers
        return np.array([x, 0.0, 0.0, x + np.cos(first), 0.0, np.sin(first), float(second > 0)])

    def state(self) -> object:
        return self._numbers.copy()

    def restore(self, state: object) -> None:
        assert isinstance(state, np.ndarray)
        if state.shape != (5,):
            raise BodyError("this is no state of a cart")
        self._numbers = state.copy()


class Whole(Cart):
    """One whose state is no array."""

    def state(self) -> object:
        return tuple(self._numbers.tolist())

    def restore(self, state: object) -> None:
        self._numbers = np.array(state)


class Unkept(Cart):
    """One that cannot be kept."""

    def state(self) -> object:
        raise BodyError("this cart cannot be kept", "take another one")


class Bare(Cart):
    """One that cannot be drawn."""

    skeleton = None

    def pose(self) -> FloatArray:
        return np.zeros(0)


class Stuck(Cart):
    """One that fails after a second."""

    def advance(self, dt: float, commands: FloatArray) -> None:
        super().advance(dt, commands)
        if self._numbers[4] > 1.0:
            raise BodyError("the cart is stuck")


@dataclass
class CartKind:
    """Opens carts: ``short`` ends its episodes itself."""

    takes_file = False

    def files(self, path: Path) -> Iterable[Path]:
        return ()

    def open(self, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
        if given == "gone":
            raise BodyError("there is no such cart", "take 'plain'", "toy")
        if given == "short":
            return Cart(ends_at=0.12)
        variants: Mapping[str, type[Cart]] = {
            "plain": Cart, "whole": Whole, "unkept": Unkept, "bare": Bare, "stuck": Stuck
        }  # fmt: skip
        return variants[given]()


def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the kind ``toy`` among those that are installed."""
    before = plugins._points

    def points(group: str) -> Mapping[str, EntryPoint]:
        found = dict(before(group))
        if group == plugins.BODIES:
            found["toy"] = EntryPoint("toy", "toy_bodies:CartKind", group)
        return found

    monkeypatch.setattr(plugins, "_points", points)
    keys = BodyModel.__dict__["_fields"].__func__  # which keys there are is asked once, and kept
    monkeypatch.setattr(BodyModel, "_fields", classmethod(keys.__wrapped__))


SPEC = """
neurovis: 1
name: carted
seed: 4
time: {dt: 0.05, steps: 200, episode: 40}
parameters: {gain: 0.8}
inputs:
  place: {expression: 0.5}
  arms: {size: 2}
  wave: {expression: sin(t)}
neurons:
  P: {activation: tanh, input: place}
  A: {count: 2, activation: tanh, input: arms}
  W: {activation: identity, input: wave, noise: "normal(0, 0.01)"}
  O: {count: 2, activation: tanh}
connections:
  P -> O: {weight: -0.7}
  A -> O: {pattern: one_to_one, weight: -0.5}
  W -> O: {weight: 0.6, plasticity: hebbian}
outputs: {drive: O1, both: O}
"""
#: a cart for it
BODY = """
body:
  toy: plain
  sensors: {place: x, arms: ["arm[1]", "arm[0]"]}
  actuators: {push: gain * drive, "lift[1]": "both[1] - 2 * both[0] + pi * dt"}
  reset: each_episode
"""


def settings_for(network: Network, given: str = "plain", **more: object) -> BodySettings:
    """``place`` is x, ``arms`` the arm; the outputs push and lift."""
    index = {entry.name: place for place, entry in enumerate(network.inputs)}
    outputs = {entry.name: place for place, entry in enumerate(network.outputs)}
    slots = network.settable.index

    def moved(actuator: str, text: str, **places: tuple[int, int]) -> Moved:
        tree = parse(text)
        given = tuple((name, slots[name]) for name in sorted(names(tree)) if name in slots)
        return Moved(actuator, tree, tuple((name, *place) for name, place in places.items()), given)

    settings = BodySettings(
        kind="toy",
        given=given,
        path=None,
        substeps=None,
        sensed=(Sensed(index["place"], ("x",)), Sensed(index["arms"], ("arm[1]", "arm[0]"))),
        moved=(
            moved("push", "gain * drive", drive=(outputs["drive"], 0)),
            moved("lift[1]", "both1 - 2 * both0 + pi * dt", both0=(outputs["both"], 0), both1=(outputs["both"], 1)),
        ),
        each_episode=True,
        sensors={port.name: port.numbers for port in Cart.sensors},
    )
    return replace(settings, **more)  # type: ignore[arg-type]


def carted(given: str = "plain", spec: str = SPEC, **more: object) -> CompiledNetwork:
    """The network above with a cart."""
    compiled = nv.compile_text(spec)
    network = compiled.network
    return replace(compiled, network=replace(network, body=settings_for(network, given, **more)))
