"""Models of MuJoCo as bodies: a file in MJCF beside the spec.

In: the path of a model, a step of the network. Out: a Body whose sensors and actuators are those of the model that have
names, in the units that they are measured in. A model that has keyframes begins in the first of them. Nothing is drawn
here, and no display is needed.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from neurovis_bodies.figure import Figure
from neurovis_bodies.mjcf import files_of
from neurovis_bodies.steps import substeps_of
from neurovis_bodies.trial import MEMORY, REFUSED, SECONDS
from neurovis_spec.body import Body, BodyError, FloatArray, Port

_SENSORS: Final = {
    "TOUCH": "N",
    "ACCELEROMETER": "m/s²",
    "VELOCIMETER": "m/s",
    "GYRO": "rad/s",
    "FORCE": "N",
    "TORQUE": "N·m",
    "MAGNETOMETER": "T",
    "RANGEFINDER": "m",
    "TENDONPOS": "m",
    "TENDONVEL": "m/s",
    "TENDONACTFRC": "N",
    "BALLANGVEL": "rad/s",
    "TENDONLIMITPOS": "m",
    "TENDONLIMITVEL": "m/s",
    "TENDONLIMITFRC": "N",
    "FRAMEPOS": "m",
    "FRAMELINVEL": "m/s",
    "FRAMEANGVEL": "rad/s",
    "FRAMELINACC": "m/s²",
    "FRAMEANGACC": "rad/s²",
    "SUBTREECOM": "m",
    "SUBTREELINVEL": "m/s",
    "SUBTREEANGMOM": "kg·m²/s",
    "GEOMDIST": "m",
    "GEOMFROMTO": "m",
    "E_POTENTIAL": "J",
    "E_KINETIC": "J",
    "CLOCK": "s",
}
#: of what turns, and of what slides
_TURNING: Final = {"POS": "rad", "VEL": "rad/s", "FRC": "N·m"}
_SLIDING: Final = {"POS": "m", "VEL": "m/s", "FRC": "N"}
_OF_JOINT: Final = ("JOINTPOS", "JOINTVEL", "JOINTACTFRC", "JOINTLIMITPOS", "JOINTLIMITVEL", "JOINTLIMITFRC")
_OF_ACTUATOR: Final = ("ACTUATORPOS", "ACTUATORVEL", "ACTUATORFRC")

#: all that MuJoCo carries from step to step, the solver's warm start included
_STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION
#: what is wrong with a simulation that MuJoCo would go on with
_UNSTABLE: Final = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")
_FULL: Final = ("mjWARN_CONTACTFULL", "mjWARN_CNSTRFULL")


def unit_of_sensor(model: mujoco.MjModel, sensor: int) -> str:
    """What a sensor's numbers are measured in."""
    kind = mujoco.mjtSensor(int(model.sensor_type[sensor])).name.removeprefix("mjSENS_")
    thing = int(model.sensor_objid[sensor])
    if kind in _OF_JOINT:
        return _units(model, thing)[kind[-3:]]
    if kind in _OF_ACTUATOR:
        joint = _joint_of(model, thing)
        return "" if joint is None else _units(model, joint)[kind[-3:]]
    return _SENSORS.get(kind, "")


def unit_of_actuator(model: mujoco.MjModel, actuator: int) -> str:
    """What the command of an actuator is measured in: a position, a speed or a force, by what it does with it."""
    joint = _joint_of(model, actuator)
    if joint is None:
        return ""
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    fixed = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    affine = int(model.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    if not fixed:
        return ""
    if affine and bias[1] != 0 and gain[0] == -bias[1]:
        return _units(model, joint)["POS"]
    if affine and bias[2] != 0 and gain[0] == -bias[2]:
        return _units(model, joint)["VEL"]
    plain = gain[0] == 1 and model.actuator_gear[actuator][0] == 1 and not affine
    return _units(model, joint)["FRC"] if plain else ""


def _joint_of(model: mujoco.MjModel, actuator: int) -> int | None:
    """The joint that an actuator moves; None where it moves something else."""
    joints = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trnid[actuator][0]) if int(model.actuator_trntype[actuator]) in joints else None


def _units(model: mujoco.MjModel, joint: int) -> dict[str, str]:
    return _SLIDING if int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else _TURNING


class MujocoKind:
    """Opens models of MuJoCo."""

    takes_file = True

    def files(self, path: Path) -> Iterable[Path]:
        """Where the files may lie that a model names."""
        return files_of(path)

    def open(self, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
        """Open a model; a broken one is tried out by another process first. Raises BodyError."""
        assert path is not None
        if not path.is_file():
            raise BodyError(f"the file '{given}' does not exist", key="mujoco")
        fault = _tried(_whole(path))
        if fault is not None:
            raise BodyError(f"'{given}': {fault}", key="mujoco")
        model = mujoco.MjModel.from_xml_path(str(path))
        return MujocoBody(model, dt, substeps_of(dt, substeps, float(model.opt.timestep), "the model"))


@dataclass(frozen=True)
class _Whole:
    """A model with all that it is made of: the digests of its files by where they lie, seen from the first."""

    path: Path = field(compare=False)
    parts: tuple[tuple[str, bytes], ...]


def _whole(path: Path) -> _Whole:
    """A model and its files. Raises BodyError."""
    try:
        places = sorted({path, *(place for place in files_of(path) if place.is_file())})
        return _Whole(path, tuple((os.path.relpath(place, path.parent), _digest(place)) for place in places))
    except OSError as error:
        raise BodyError(f"'{path.name}': {error}") from None


def _digest(path: Path) -> bytes:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


@lru_cache(maxsize=64)
def _tried(model: _Whole) -> str | None:
    """What is wrong with a model; None where it can be opened."""
    script = Path(__file__).with_name("trial.py")
    around = {**os.environ, "MUJOCO_GL": "disable", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            [sys.executable, "-P", str(script), str(model.path), str(SECONDS)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=4 * SECONDS,
            env=around,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"MuJoCo has not made it within {4 * SECONDS} seconds"
    if done.returncode == 0:
        return None
    said = done.stdout.decode("utf-8", "replace").strip()
    if done.returncode == REFUSED and said:
        return said[:400]
    return f"MuJoCo cannot open it within {SECONDS} seconds and {MEMORY >> 30} GB of memory"


class MujocoBody:
    """A model and its data."""

    ended = False

    def __init__(self, model: mujoco.MjModel, dt: float, substeps: int) -> None:
        mujoco.set_mju_user_warning(_say_nothing)
        self._model, self._data = model, mujoco.MjData(model)
        self._dt, self._substeps = dt, substeps
        self._figure = Figure(model)
        self._kept = np.empty(mujoco.mj_stateSize(model, _STATE))
        self._sensed, self._moved = _numbers(_sensors(model)), _numbers(_actuators(model))
        self.sensors: Sequence[Port] = tuple(port for port, _ in _sensors(model))
        self.actuators: Sequence[Port] = tuple(port for port, _ in _actuators(model))
        self.skeleton = self._figure.moved_by(model, self._moved.tolist())
        self.reset(0)

    def reset(self, seed: int) -> None:
        """To the first keyframe of the model, else to its default; nothing in it is random."""
        if self._model.nkey:
            mujoco.mj_resetDataKeyframe(self._model, self._data, 0)
        else:
            mujoco.mj_resetData(self._model, self._data)
        self._settle()

    def sense(self) -> FloatArray:
        """What the sensors say now."""
        return np.asarray(self._data.sensordata[self._sensed], dtype=np.float64)

    def advance(self, dt: float, commands: FloatArray) -> None:
        """Go on by dt under these commands. Raises BodyError where a command is not finite, or the simulation fails."""
        wrong = np.flatnonzero(~np.isfinite(commands))
        if len(wrong):
            raise BodyError(f"the command of '{_owner(self.actuators, int(wrong[0]))}' is {commands[wrong[0]]}")
        count = self._substeps
        if dt != self._dt:
            count = substeps_of(dt, None, float(self._model.opt.timestep), "the model")
        self._data.ctrl[self._moved] = commands
        mujoco.mj_step(self._model, self._data, nstep=count)
        self._check()
        self._settle()

    def pose(self) -> FloatArray:
        """Where the points of the skeleton are, and which feet touch something."""
        return self._figure.pose(self._data) if self.skeleton is not None else np.zeros(0)

    def state(self) -> FloatArray:
        """All that MuJoCo carries from step to step. Raises BodyError where parts of the model may fall asleep."""
        if self._model.opt.enableflags & getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0):
            message = "parts of the model may fall asleep, and MuJoCo does not say how near to it they are"
            raise BodyError(message, 'remove sleep="enable" from the model')
        return self._kept.copy()

    def restore(self, state: object) -> None:
        """Back to a state of this body. Raises BodyError where it is of another one."""
        if not isinstance(state, np.ndarray) or state.shape != self._kept.shape:
            raise BodyError("this is no state of this model")
        mujoco.mj_setState(self._model, self._data, np.asarray(state, dtype=np.float64), _STATE)
        self._settle()

    def _settle(self) -> None:
        """Sensors and places for the state that was reached; the state is kept as it was before they are worked out."""
        mujoco.mj_getState(self._model, self._data, self._kept, _STATE)
        mujoco.mj_forward(self._model, self._data)

    def _check(self) -> None:
        """Whether MuJoCo could go on as it should. Raises BodyError."""
        warnings, kinds = self._data.warning, mujoco.mjtWarning
        if any(warnings[int(getattr(kinds, name))].number for name in _UNSTABLE):
            message = "the simulation of the model is unstable: its numbers have become huge or undefined"
            raise BodyError(message, "a smaller timestep of the model, more damping, or smaller commands may help")
        if any(warnings[int(getattr(kinds, name, 0))].number for name in _FULL):
            message = "there are more contacts than the model has memory for"
            raise BodyError(message, 'give it more: <size memory="64M"/>')


def _say_nothing(message: str) -> None:
    """MuJoCo writes its warnings into a file beside the caller otherwise; those that matter are reported."""


def _sensors(model: mujoco.MjModel) -> Iterator[tuple[Port, range]]:
    """The sensors that have names, each with where its numbers are."""
    for sensor in range(model.nsensor):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SENSOR, sensor)
        start, size = int(model.sensor_adr[sensor]), int(model.sensor_dim[sensor])
        if name:
            yield Port(name, size, unit_of_sensor(model, sensor)), range(start, start + size)


def _actuators(model: mujoco.MjModel) -> Iterator[tuple[Port, range]]:
    """The actuators that have names, each with where its commands are."""
    several = hasattr(model, "actuator_ctrladr")  # before version 4 each had one command
    for actuator in range(len(model.actuator_trntype)):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        start = int(model.actuator_ctrladr[actuator]) if several else actuator
        size = int(model.actuator_ctrlnum[actuator]) if several else 1
        if name and size:
            places = range(start, start + size)
            yield Port.ranged(name, unit_of_actuator(model, actuator), [_range(model, at) for at in places]), places


def _range(model: mujoco.MjModel, place: int) -> tuple[float, float]:
    """The lowest and the highest that a command may be."""
    low, high = model.actuator_ctrlrange[place] if model.actuator_ctrllimited[place] else (-np.inf, np.inf)
    return float(low), float(high)


def _numbers(ports: Iterable[tuple[Port, range]]) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Where the numbers of all ports are, one after the other."""
    return np.array([place for _, places in ports for place in places], dtype=np.int64)


def _owner(ports: Sequence[Port], place: int) -> str:
    """Which port a number belongs to."""
    return [name for port in ports for name in port.numbers][place]
