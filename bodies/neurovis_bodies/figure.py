"""How a model of MuJoCo is drawn: links, feet, what stands in the world.

In: a model. Out: a Figure: its Skeleton, and the pose of some data of it. A link is the axis of a part that moves: of a
capsule its own, of a box or a mesh its longest. Where the parts of two bodies do not meet, a thin link leads from the
origin of one to that of the other. Feet are where there are touch sensors, and parts that are called feet.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import mujoco
import numpy as np

from neurovis_spec.body import FloatArray, Link, Skeleton, Solid

#: groups of geoms that MuJoCo's own viewer shows
_SHOWN: Final = 2
#: of a thin link, as a share of the thinnest other, or in metres
_THIN: Final = 0.4
_THINNEST: Final = 0.005


class _Axis(NamedTuple):
    """A part of a body in the frame of the body: two ends, and how thick it is."""

    start: FloatArray
    end: FloatArray
    radius: float


class _Foot(NamedTuple):
    """A foot in the frame of its body: by a touch sensor (the place of its number), or by geoms."""

    body: int
    place: FloatArray
    sensor: int
    geoms: tuple[int, ...]


class Figure:
    """A model as it is drawn."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._bodies: list[int] = []
        self._places: list[FloatArray] = []
        self._names: list[str] = []
        self._at: dict[tuple[object, ...], int] = {}
        moving = [body for body in range(1, model.nbody) if model.body_weldid[body] != 0]
        axes = {body: list(_axes(model, body)) for body in moving}
        bones = [body for body in moving if _is_apart(model, body, axes)]
        found = min((axis.radius for several in axes.values() for axis in several), default=_THINNEST / _THIN)
        middle = 0
        if moving:
            free = [int(model.jnt_bodyid[j]) for j in range(model.njnt) if int(model.jnt_type[j]) == _FREE]
            middle = self._point(model, (free or moving)[0], np.zeros(3))
        links = [
            Link(self._point(model, body, axis.start), self._point(model, body, axis.end), axis.radius)
            for body in moving
            for axis in axes[body]
        ]
        for body in bones:
            parent = int(model.body_parentid[body])
            ends = self._point(model, parent, np.zeros(3)), self._point(model, body, np.zeros(3))
            links.append(Link(*ends, _THIN * found))
        feet = tuple(_feet(model, moving))
        points = tuple(self._point(model, foot.body, foot.place) for foot in feet)
        self._body = np.array(self._bodies, dtype=np.int64)
        self._place = np.array(self._places, dtype=np.float64).reshape(-1, 3)
        self._touch = np.array([foot.sensor for foot in feet], dtype=np.int64)
        self._geoms = [np.array(foot.geoms, dtype=np.int64) for foot in feet]
        self.skeleton: Skeleton | None = None
        if moving:
            self.skeleton = Skeleton(tuple(self._names), tuple(links), points, middle, tuple(_solids(model)))

    def pose(self, data: mujoco.MjData) -> FloatArray:
        """What the skeleton is drawn from."""
        turned = np.einsum("nij,nj->ni", data.xmat.reshape(-1, 3, 3)[self._body], self._place)
        points = data.xpos[self._body] + turned
        return np.concatenate([points.ravel(), np.array(list(self._contacts(data)), dtype=np.float64)])

    def _contacts(self, data: mujoco.MjData) -> Iterator[float]:
        """Of each foot, 1 where it touches something."""
        touching = data.contact.geom[data.contact.dist <= 0]
        for sensor, geoms in zip(self._touch.tolist(), self._geoms, strict=True):
            if sensor >= 0:
                yield float(data.sensordata[sensor] > 0)
            else:
                yield float(np.isin(touching, geoms).any())

    def _point(self, model: mujoco.MjModel, body: int, place: FloatArray) -> int:
        """The index of a point of a body; those at one place are one."""
        mark = (body, *np.round(place, 9).tolist())
        if mark not in self._at:
            self._at[mark] = len(self._names)
            called = _name(model, mujoco.mjtObj.mjOBJ_BODY, body)
            number = self._bodies.count(body)
            self._names.append(called if number == 0 else f"{called}.{number}")
            self._bodies.append(body)
            self._places.append(np.array(place, dtype=np.float64))
        return self._at[mark]


_FREE: Final = int(mujoco.mjtJoint.mjJNT_FREE)
_TOUCH: Final = int(mujoco.mjtSensor.mjSENS_TOUCH)
_SPHERE: Final = int(mujoco.mjtGeom.mjGEOM_SPHERE)
#: what is long along its own z
_LONG: Final = (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))
_GROUND: Final = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))


def _name(model: mujoco.MjModel, kind: object, number: int) -> str:
    return mujoco.mj_id2name(model, kind, number) or f"body{number}"


def _turned(quaternion: FloatArray) -> FloatArray:
    """The rotation matrix of a quaternion."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _shown(model: mujoco.MjModel, body: int) -> list[int]:
    """The geoms of a body that are drawn: those that a viewer shows; where it shows none, all."""
    start = int(model.body_geomadr[body])
    own = [geom for geom in range(start, start + int(model.body_geomnum[body])) if start >= 0]
    seen = [geom for geom in own if model.geom_group[geom] <= _SHOWN and model.geom_rgba[geom][3] > 0]
    return seen or own


def _axes(model: mujoco.MjModel, body: int) -> Iterator[_Axis]:
    """The parts of a body."""
    for geom in _shown(model, body):
        kind, size = int(model.geom_type[geom]), model.geom_size[geom]
        centre, turned = np.array(model.geom_pos[geom]), _turned(model.geom_quat[geom])
        if kind in _GROUND:
            continue
        if kind == _SPHERE:
            half, radius = np.zeros(3), float(size[0])
        elif kind in _LONG:
            half, radius = turned[:, 2] * size[1], float(size[0])
        else:
            box = model.geom_aabb[geom]  # in the frame of the geom: its centre, and half of each edge
            longest = int(np.argmax(box[3:]))
            radius = float(np.sort(box[3:])[1])
            centre = centre + turned @ box[:3]
            half = turned[:, longest] * (box[3 + longest] - radius)
        if np.isfinite([*centre, *half, radius]).all():
            yield _Axis(centre - half, centre + half, radius)


def _is_apart(model: mujoco.MjModel, body: int, axes: dict[int, list[_Axis]]) -> bool:
    """Whether nothing that is drawn of its parent meets what is drawn at the origin of a body."""
    parent = int(model.body_parentid[body])
    if parent not in axes or not _is_drawn(model, body, axes):
        return False
    origin = np.array(model.body_pos[body])
    reach = max((axis.radius for axis in axes[body] if _distance(np.zeros(3), axis) <= axis.radius), default=0.0)
    return all(_distance(origin, axis) > (axis.radius + reach) * 1.01 for axis in axes[parent])


def _is_drawn(model: mujoco.MjModel, body: int, axes: dict[int, list[_Axis]]) -> bool:
    """Whether there is something to be drawn of a body or of those that hang on it."""
    below = {body}
    for other in range(body, model.nbody):  # parents come first
        if other == body or int(model.body_parentid[other]) in below:
            below.add(other)
            if axes.get(other):
                return True
    return False


def _distance(point: FloatArray, axis: _Axis) -> float:
    """How far a point is from the axis of a part."""
    along = axis.end - axis.start
    length = float(along @ along)
    share = 0.0 if length == 0 else float(np.clip((point - axis.start) @ along / length, 0, 1))
    return float(np.linalg.norm(point - axis.start - share * along))


def _feet(model: mujoco.MjModel, moving: list[int]) -> Iterator[_Foot]:
    """Touch sensors, in their order, of a body that has several the one furthest from its joint (a shin may feel, too);
    then bodies without one that are called feet, or have geoms that are."""
    felt: dict[int, _Foot] = {}
    for sensor in np.flatnonzero(np.asarray(model.sensor_type) == _TOUCH).tolist():
        site = int(model.sensor_objid[sensor])
        body = int(model.site_bodyid[site])
        foot = _Foot(body, np.array(model.site_pos[site]), int(model.sensor_adr[sensor]), ())
        if body not in felt or np.linalg.norm(foot.place) > np.linalg.norm(felt[body].place):
            felt[body] = foot
    yield from felt.values()
    for body in moving:
        start = int(model.body_geomadr[body])
        own = range(start, start + int(model.body_geomnum[body])) if start >= 0 else range(0)
        named = [geom for geom in own if _is_foot(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom))]
        if not named and _is_foot(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)):
            named = [*own]
        if named and body not in felt:
            yield _Foot(body, _tip(model, named[0]), -1, tuple(named))


def _is_foot(name: str | None) -> bool:
    return name is not None and any(word in name.casefold() for word in ("foot", "feet"))


def _tip(model: mujoco.MjModel, geom: int) -> FloatArray:
    """The end of a geom that is further from the origin of its body."""
    centre = np.array(model.geom_pos[geom])
    if int(model.geom_type[geom]) not in _LONG:
        return centre
    half = _turned(model.geom_quat[geom])[:, 2] * model.geom_size[geom][1]
    return np.asarray(max(centre - half, centre + half, key=lambda end: float(end @ end)))


def _solids(model: mujoco.MjModel) -> Iterator[Solid]:
    """What is fixed to the world, but for the ground: planes and height fields."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        fixed = model.body_weldid[model.geom_bodyid[geom]] == 0
        if not fixed or int(model.geom_type[geom]) in _GROUND:
            continue
        turned = data.geom_xmat[geom].reshape(3, 3)
        box = model.geom_aabb[geom]
        centre, half = data.geom_xpos[geom] + turned @ box[:3], np.abs(turned) @ box[3:]
        if not np.isfinite([*centre, *half]).all():
            continue
        low, high = (tuple(np.round(corner, 9).tolist()) for corner in (centre - half, centre + half))
        yield Solid((low[0], low[1], low[2]), (high[0], high[1], high[2]))
