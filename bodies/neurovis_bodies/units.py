"""What the sensors and actuators of a model of MuJoCo are measured in.

In: a model and the number of a sensor or an actuator. Out: a unit, empty where there is none or it is not known.
"""

from __future__ import annotations

from typing import Final

import mujoco

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
