"""Environments of Gymnasium as bodies, by their ids.

In: an id, a step of the network. Out: a Body whose sensors are the observation and the reward, and whose actuators are
the action. What an environment is made of is its own affair: it is advanced, and copied where it can be.
"""

from __future__ import annotations

import copy
import warnings
import weakref
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from importlib import metadata, util
from pathlib import Path
from typing import Final, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces

from neurovis_bodies.steps import substeps_of
from neurovis_spec.body import Body, BodyError, BodyMissingError, FloatArray, Port, Skeleton

#: characters of an id
_LONGEST: Final = 200
#: steps by which a copy of an environment is compared with another
_TRIED: Final = 3


class GymnasiumKind:
    """Opens environments of Gymnasium."""

    takes_file = False

    def files(self, path: Path) -> Iterable[Path]:
        """None: an environment is installed."""
        return ()

    def open(self, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
        """Open an environment by its id. Raises BodyError, BodyMissingError where what it needs is not installed."""
        if len(given) > _LONGEST:
            raise BodyError(f"an id of {len(given):,} characters is that of no environment", key="gymnasium")
        module, colon, _ = given.rpartition(":")
        if colon and not _is_installed(module):
            message = f"'{given}' asks for the module '{module}', and no package of that name is installed"
            raise BodyError(message, "MODULE:ID is of an environment that an installed package brings", "gymnasium")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                env = gymnasium.make(given, disable_env_checker=True)
        except (gymnasium.error.DependencyNotInstalled, ImportError) as error:
            needed, _, how = " ".join(str(error).split()).partition(", ")
            hint = how or "packages of its kind come with pip install 'gymnasium[KIND]', as in 'gymnasium[mujoco]'"
            raise BodyMissingError(f"the environment '{given}' needs more: {needed}", hint, "gymnasium") from None
        except (gymnasium.error.UnregisteredEnv, gymnasium.error.Error) as error:
            close = get_close_matches(given, [*gymnasium.registry], 3)
            names = " or ".join(f"'{name}'" for name in close)
            message = f"Gymnasium has no environment '{given}': {' '.join(str(error).split())}"
            raise BodyError(message, f"did you mean {names}?" if close else None, "gymnasium") from None
        own = _step_of(env)
        count = 1 if substeps is None else substeps
        return GymnasiumBody(env, count if own is None else substeps_of(dt, substeps, own, "the environment"))


def _is_installed(module: str) -> bool:
    """Whether a name is that of a package that somebody has installed: nothing else is imported for a spec, be it
    beside the spec or a part of Python."""
    for name in metadata.packages_distributions().get(module, ()) if module.isidentifier() else ():
        found = util.find_spec(module)
        place = None if found is None else found.origin
        folder = Path(str(metadata.distribution(name).locate_file(""))).resolve()
        if place is not None and Path(place).resolve().is_relative_to(folder):
            return True
    return False


def _step_of(env: gymnasium.Env) -> float | None:
    """Seconds a step of an environment takes, where it says so."""
    for name in ("dt", "tau"):
        value = getattr(env.unwrapped, name, None)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
    return None


class _Kept(NamedTuple):
    """An environment as it was, never to be advanced, and what it said last."""

    env: gymnasium.Env
    sensed: FloatArray
    ended: bool


class GymnasiumBody:
    """An environment, and what it said last."""

    def __init__(self, env: gymnasium.Env, substeps: int) -> None:
        self._env, self._substeps = env, substeps
        observed, self._observe = _observed(env.observation_space)
        self.sensors: Sequence[Port] = (*observed, Port("reward", 1))
        action, self._act = _acted(env.action_space)
        self.actuators: Sequence[Port] = (action,)
        self._pose = _pose_of(env)
        self.skeleton: Skeleton | None = None if self._pose is None else self._pose[0]
        self._sensed: FloatArray = np.zeros(0)
        self._ended = False
        self._copies: bool | None = None
        self._close = weakref.finalize(self, _closed, env)
        self.reset(0)

    def reset(self, seed: int) -> None:
        """A new episode of the environment, drawn from the seed. There is no reward yet."""
        observation, _ = self._asked(lambda: self._env.reset(seed=seed))
        self._sensed, self._ended = self._said(observation, 0.0), False

    def sense(self) -> FloatArray:
        """The observation, then the reward for the steps that led to it."""
        return self._sensed.copy()

    def advance(self, dt: float, commands: FloatArray) -> None:
        """Go on by one step of the network; the rewards of several steps of the environment are added up. Raises
        BodyError."""
        if self._ended:
            raise BodyError("the episode of the environment has ended: only a reset goes on")
        if not np.isfinite(commands).all():
            raise BodyError(f"the action is {commands}, which is not finite")
        action, total = self._act(commands), 0.0
        for _ in range(self._substeps):
            observation, reward, terminated, truncated, _ = self._asked(lambda: self._env.step(action))
            total += float(reward)
            self._sensed, self._ended = self._said(observation, total), bool(terminated or truncated)
            if self._ended:
                break

    @property
    def ended(self) -> bool:
        """Whether the environment has terminated or truncated the episode."""
        return self._ended

    def pose(self) -> FloatArray:
        """Of environments made with MuJoCo, where the points of the skeleton are; else nothing."""
        return np.zeros(0) if self._pose is None else self._pose[1](self._env)

    def state(self) -> object:
        """A copy of the environment. Raises BodyError where it cannot be copied, or copies do not go on alike."""
        if self._copies is None:
            self._copies = self._try_copies()
        if not self._copies:
            raise BodyError("this environment cannot be copied: there is no way back to an earlier step of it")
        return _Kept(copy.deepcopy(self._env), self._sensed.copy(), self._ended)

    def restore(self, state: object) -> None:
        """Back to a state of this body. Raises BodyError where it is none."""
        if not isinstance(state, _Kept):
            raise BodyError("this is no state of this environment")
        self._env = copy.deepcopy(state.env)
        self._close.detach()
        self._close = weakref.finalize(self, _closed, self._env)
        self._sensed, self._ended = state.sensed.copy(), state.ended

    def _try_copies(self) -> bool:
        """Whether two copies of the environment go on alike, one after the other: then neither shares anything."""
        action = self._act(np.zeros(self.actuators[0].size))
        found = []
        try:
            for env in (copy.deepcopy(self._env), copy.deepcopy(self._env)):
                said = [] if self._ended else [env.step(action)[:2] for _ in range(_TRIED)]
                found.append([self._said(observation, float(reward)).tobytes() for observation, reward in said])
        except Exception:  # whatever an environment raises that was not made to be copied
            return False
        return found[0] == found[1]

    def _said(self, observation: object, reward: float) -> FloatArray:
        return np.concatenate([self._asked(lambda: self._observe(observation)), [reward]])

    def _asked(self, question: Callable[[], object]):  # type: ignore[no-untyped-def]
        """What an environment answers; what it raises is a BodyError."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return question()
        except Exception as error:
            message = f"the environment fails: {type(error).__name__}: {' '.join(str(error).split())}"
            raise BodyError(message[:400]) from error


def _closed(env: gymnasium.Env) -> None:
    """Let go of an environment; one that fails in it is gone as well."""
    try:
        env.close()
    except Exception:  # there is nobody to tell
        return


def _observed(space: spaces.Space[object]) -> tuple[tuple[Port, ...], Callable[[object], FloatArray]]:
    """The sensors of a space of observations, and how one becomes numbers. Raises BodyError."""
    if isinstance(space, spaces.Dict):
        parts = [(key, *_observed_part(inner, f"observation.{key}")) for key, inner in space.spaces.items()]
        return tuple(port for _, port, _ in parts), lambda said: np.concatenate(
            [read(said[key]) for key, _, read in parts]
        )
    port, read = _observed_part(space, "observation")
    return (port,), read


def _observed_part(space: spaces.Space[object], name: str) -> tuple[Port, Callable[[object], FloatArray]]:
    if isinstance(space, (spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary, spaces.Box)):
        size = int(np.prod(space.shape or ()))
        return Port(name, size), lambda said: np.asarray(said, dtype=np.float64).ravel()
    message = f"the {name.replace('.', ' ')} of this environment is a {type(space).__name__}"
    raise BodyError(message, "of numbers, and of a dictionary of such, sensors can be made", "gymnasium")


def _acted(space: spaces.Space[object]) -> tuple[Port, Callable[[FloatArray], object]]:
    """The actuator of a space of actions, and how commands become an action. Raises BodyError."""
    if isinstance(space, spaces.Discrete):
        first, last = int(space.start), int(space.start + space.n - 1)
        port = Port("action", 1, "", float(first), float(last))
        return port, lambda commands: space.dtype.type(np.clip(np.rint(commands[0]), first, last))
    if isinstance(space, spaces.Box):
        shape, dtype = space.shape, space.dtype
        low, high = (np.asarray(bound, dtype=np.float64).ravel() for bound in (space.low, space.high))
        port = _ranged(low, high)
        return port, lambda commands: np.clip(commands, low, high).astype(dtype).reshape(shape)
    if isinstance(space, (spaces.MultiDiscrete, spaces.MultiBinary)):
        shape, dtype = space.shape, space.dtype
        least = most = np.zeros(int(np.prod(shape)))
        if isinstance(space, spaces.MultiDiscrete):
            least = np.asarray(space.start, dtype=np.float64).ravel()
            most = least + np.asarray(space.nvec, dtype=np.float64).ravel() - 1
        else:
            most = most + 1
        port = _ranged(least, most)
        return port, lambda commands: np.clip(np.rint(commands), least, most).astype(dtype).reshape(shape)
    message = f"the action of this environment is a {type(space).__name__}"
    raise BodyError(message, "of numbers actuators can be made", "gymnasium")


def _ranged(low: FloatArray, high: FloatArray) -> Port:
    """The action by the lowest and the highest that each of its numbers may be."""
    return Port.ranged("action", "", list(zip(low.tolist(), high.tolist(), strict=True)))


def _pose_of(env: gymnasium.Env) -> tuple[Skeleton, Callable[[gymnasium.Env], FloatArray]] | None:
    """The skeleton of an environment that is made with MuJoCo, and how its pose is found; None for others."""
    model = getattr(env.unwrapped, "model", None)
    if model is None or not type(model).__module__.startswith("mujoco") or not hasattr(env.unwrapped, "data"):
        return None
    from neurovis_bodies.figure import Figure

    figure = Figure(model)
    skeleton = figure.moved_by(model, range(model.nu))
    if skeleton is None:
        return None
    return skeleton, lambda env: figure.pose(env.unwrapped.data)
