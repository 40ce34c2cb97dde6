"""What is known of the usual message types of ROS: their fields, and which of these hold numbers.

In: a type, ``std_msgs/Float64`` or ``std_msgs/msg/Float64``, and a dotted path. Out: the Field there. The definitions
are those of the ``.msg`` files, as far as ROS 1 and ROS 2 have them in common. Of types that are not in the table
nothing is known, which is no mistake: there are thousands, and everybody may write some.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

from neurovis_spec.likeness import meant

_DIGITS: Final = re.compile("[0-9]+")
_STAMPED: Final = "Header header"
_COVARIANCE: Final = "float64[36] covariance"
_MULTI: Final = "MultiArrayLayout layout, {}[] data"
_INTEGERS: Final = ("8", "16", "32", "64")

#: package → name → fields, as a ``.msg`` file has them
MESSAGES: Final[Mapping[str, Mapping[str, str]]] = {
    "std_msgs": {
        "Bool": "bool data",
        "Byte": "byte data",
        "Char": "char data",
        "ColorRGBA": "float32 r, float32 g, float32 b, float32 a",
        "Duration": "duration data",
        "Empty": "",
        "Float32": "float32 data",
        "Float64": "float64 data",
        "Header": "time stamp, string frame_id",
        **{f"Int{bits}": f"int{bits} data" for bits in _INTEGERS},
        **{f"UInt{bits}": f"uint{bits} data" for bits in _INTEGERS},
        "String": "string data",
        "Time": "time data",
        "ByteMultiArray": _MULTI.format("byte"),
        "Float32MultiArray": _MULTI.format("float32"),
        "Float64MultiArray": _MULTI.format("float64"),
        **{f"Int{bits}MultiArray": _MULTI.format(f"int{bits}") for bits in _INTEGERS},
        **{f"UInt{bits}MultiArray": _MULTI.format(f"uint{bits}") for bits in _INTEGERS},
        "MultiArrayDimension": "string label, uint32 size, uint32 stride",
        "MultiArrayLayout": "MultiArrayDimension[] dim, uint32 data_offset",
    },
    "geometry_msgs": {
        "Vector3": "float64 x, float64 y, float64 z",
        "Vector3Stamped": f"{_STAMPED}, Vector3 vector",
        "Point": "float64 x, float64 y, float64 z",
        "Point32": "float32 x, float32 y, float32 z",
        "PointStamped": f"{_STAMPED}, Point point",
        "Quaternion": "float64 x, float64 y, float64 z, float64 w",
        "QuaternionStamped": f"{_STAMPED}, Quaternion quaternion",
        "Pose": "Point position, Quaternion orientation",
        "Pose2D": "float64 x, float64 y, float64 theta",
        "PoseStamped": f"{_STAMPED}, Pose pose",
        "PoseWithCovariance": f"Pose pose, {_COVARIANCE}",
        "PoseWithCovarianceStamped": f"{_STAMPED}, PoseWithCovariance pose",
        "Twist": "Vector3 linear, Vector3 angular",
        "TwistStamped": f"{_STAMPED}, Twist twist",
        "TwistWithCovariance": f"Twist twist, {_COVARIANCE}",
        "TwistWithCovarianceStamped": f"{_STAMPED}, TwistWithCovariance twist",
        "Accel": "Vector3 linear, Vector3 angular",
        "AccelStamped": f"{_STAMPED}, Accel accel",
        "Wrench": "Vector3 force, Vector3 torque",
        "WrenchStamped": f"{_STAMPED}, Wrench wrench",
        "Transform": "Vector3 translation, Quaternion rotation",
        "TransformStamped": f"{_STAMPED}, string child_frame_id, Transform transform",
    },
    "sensor_msgs": {
        "JointState": f"{_STAMPED}, string[] name, float64[] position, float64[] velocity, float64[] effort",
        "Imu": (
            f"{_STAMPED}, geometry_msgs/Quaternion orientation, float64[9] orientation_covariance, "
            "geometry_msgs/Vector3 angular_velocity, float64[9] angular_velocity_covariance, "
            "geometry_msgs/Vector3 linear_acceleration, float64[9] linear_acceleration_covariance"
        ),
        "MagneticField": (f"{_STAMPED}, geometry_msgs/Vector3 magnetic_field, float64[9] magnetic_field_covariance"),
        "Joy": f"{_STAMPED}, float32[] axes, int32[] buttons",
        "LaserScan": (
            f"{_STAMPED}, float32 angle_min, float32 angle_max, float32 angle_increment, float32 time_increment, "
            "float32 scan_time, float32 range_min, float32 range_max, float32[] ranges, float32[] intensities"
        ),
        "Temperature": f"{_STAMPED}, float64 temperature, float64 variance",
        "FluidPressure": f"{_STAMPED}, float64 fluid_pressure, float64 variance",
        "Illuminance": f"{_STAMPED}, float64 illuminance, float64 variance",
        "RelativeHumidity": f"{_STAMPED}, float64 relative_humidity, float64 variance",
    },
    "nav_msgs": {
        "Odometry": (
            f"{_STAMPED}, string child_frame_id, geometry_msgs/PoseWithCovariance pose, "
            "geometry_msgs/TwistWithCovariance twist"
        ),
    },
    "trajectory_msgs": {
        "JointTrajectoryPoint": (
            "float64[] positions, float64[] velocities, float64[] accelerations, float64[] effort, "
            "duration time_from_start"
        ),
    },
}
#: Packages of which the table has all types.
COMPLETE: Final = frozenset({"std_msgs"})
#: Other types of these packages, whose fields are no numbers to be taken, or differ between ROS 1 and ROS 2.
_OTHERS: Final[Mapping[str, str]] = {
    "geometry_msgs": (
        "AccelWithCovariance AccelWithCovarianceStamped Inertia InertiaStamped Polygon PolygonInstance "
        "PolygonInstanceStamped PolygonStamped PoseArray VelocityStamped"
    ),
    "sensor_msgs": (
        "BatteryState CameraInfo ChannelFloat32 CompressedImage Image JoyFeedback JoyFeedbackArray LaserEcho "
        "MultiDOFJointState MultiEchoLaserScan NavSatFix NavSatStatus PointCloud PointCloud2 PointField Range "
        "RegionOfInterest TimeReference"
    ),
    "nav_msgs": "Goals GridCells MapMetaData OccupancyGrid Path Trajectory TrajectoryPoint",
    "trajectory_msgs": "JointTrajectory MultiDOFJointTrajectory MultiDOFJointTrajectoryPoint",
}

_NUMBERS: Final = frozenset(
    ("bool", "byte", "char", "float32", "float64", *(f"{sign}int{bits}" for sign in ("", "u") for bits in _INTEGERS))
)
#: What ROS 1 and ROS 2 make of differently.
_OPAQUE: Final = frozenset(("time", "duration", "std_msgs/Header"))


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message. ``size`` is how many numbers it holds: None where a message may hold any number of them, 0
    where it holds none. ``several`` where it is an array."""

    kind: Literal["number", "text", "message", "opaque"]
    several: bool = False
    size: int | None = 0


def plain(name: str) -> str:
    """A type as ROS 1 writes it: ``std_msgs/Float64`` for ``std_msgs/msg/Float64``.

    >>> plain("std_msgs/msg/Float64"), plain("msg/msg/Msg")
    ('std_msgs/Float64', 'msg/Msg')
    """
    package, _, message = name.partition("/")
    return f"{package}/{message.removeprefix('msg/')}"


def all_types() -> tuple[str, ...]:
    """The types of the table."""
    return tuple(f"{package}/{name}" for package, names in MESSAGES.items() for name in names)


def misspelt(name: str) -> bool:
    """Whether there is surely no such type: its package is known as a whole, or it can only be meant for another one.

    >>> misspelt("std_msgs/Flaot64"), misspelt("geometry_msgs/Twsit"), misspelt("sensor_msg/Imu")
    (True, True, True)
    >>> misspelt("geometry_msgs/Pose3D"), misspelt("geometry_msgs/Inertia"), misspelt("my_msgs/Twsit")
    (False, False, False)
    """
    package, _, message = plain(name).partition("/")
    if package not in MESSAGES:
        right = meant(package, tuple(MESSAGES))
        return right is not None and message in _known(right)
    if package in COMPLETE or message in _known(package):
        return message not in _known(package)
    right = meant(message, _known(package))
    return right is not None and _DIGITS.findall(right) == _DIGITS.findall(message)


def _known(package: str) -> tuple[str, ...]:
    return (*MESSAGES[package], *_OTHERS.get(package, "").split())


@cache
def fields_of(name: str) -> Mapping[str, Field] | None:
    """All fields of a type by their dotted paths, those of inner messages behind theirs; None where it is not known.

    >>> fields_of("geometry_msgs/msg/Pose2D")["theta"].size
    1
    >>> [path for path in fields_of("geometry_msgs/Twist") if path.endswith(".x")]
    ['linear.x', 'angular.x']
    """
    package, _, message = plain(name).partition("/")
    definition = MESSAGES.get(package, {}).get(message)
    return None if definition is None else dict(_fields(package, definition))


def _fields(package: str, definition: str) -> Iterator[tuple[str, Field]]:
    for line in filter(None, definition.split(", ")):
        type_, name = line.split()
        base, bracket, length = type_.partition("[")
        fixed = length.removesuffix("]")
        if base in _NUMBERS:
            size = 1 if not bracket else int(fixed) if fixed else None
            yield name, Field("number", bool(bracket), size)
            continue
        if base == "string":
            yield name, Field("text", bool(bracket))
            continue
        inner = base if "/" in base or base in _OPAQUE else f"{'std_msgs' if base == 'Header' else package}/{base}"
        if inner in _OPAQUE:
            yield name, Field("opaque", bool(bracket))
            continue
        yield name, Field("message", bool(bracket))
        if not bracket:
            yield from ((f"{name}.{path}", field) for path, field in (fields_of(inner) or {}).items())


def numbers_of(name: str) -> tuple[str, ...]:
    """The paths of a type at which numbers are."""
    return tuple(path for path, field in (fields_of(name) or {}).items() if field.kind == "number")
