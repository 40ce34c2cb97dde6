"""How a model of MuJoCo is drawn: links, feet, what stands in the world.

In: a model. Out: a Figure: its Skeleton, and the pose of some data of it. A link is a part that moves, as large as it
is: a capsule as its middle line with its radius, what has another shape by points of its surface, between which it
lies. Where the parts of two bodies do not meet, a thin link leads from the origin of one to that of the other. Feet are
where there are touch sensors, and parts that are called feet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import product
from typing import Final, NamedTuple

import mujoco
import numpy as np

from neurovis_spec.body import FloatArray, Link, Skeleton, Solid

#: groups of geoms that MuJoCo's own viewer shows
_SHOWN: Final = 2
#: of a thin link, as a share of the thinnest other, or in metres
_THIN: Final = 0.4
_THINNEST: Final = 0.005


def _units(ways: Iterable[tuple[int, ...]]) -> FloatArray:
    """Vectors of length 1."""
    found = np.array(list(ways), dtype=np.float64)
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


#: how many points there are around a rim, and of an ellipsoid the share of its shortest half axis that is its radius
_RIM: Final = 16
_ROUNDED: Final = 0.7
#: the corners of a cube; ways along the axes, and between two and three of them; further ones, between two axes
_CORNERS: Final = np.array(list(product((-1.0, 1.0), repeat=3)))
_WAYS: Final = _units(way for way in product((-1, 0, 1), repeat=3) if any(way))
_FURTHER: Final = _units(way for way in product((-2, -1, 0, 1, 2), repeat=3) if sorted(map(abs, way)) == [0, 1, 2])
_ALL_WAYS: Final = np.concatenate([_WAYS, _FURTHER])


class _Part(NamedTuple):
    """A part of a body in the frame of the body: about all that lies within ``radius`` of a flat core, which reaches
    ``half`` to either side of its ``centre`` along the columns of ``turned`` (3, 3); exactly, all that lies within
    ``margin`` of the convex hull of ``points`` (k, 3) there, an even number of them."""

    centre: FloatArray
    turned: FloatArray
    half: FloatArray
    radius: float
    points: FloatArray
    margin: float

    def lines(self) -> list[tuple[FloatArray, FloatArray]]:
        """Lines that it lies between: their ends."""
        points = self.centre + self.points @ self.turned.T
        return list(zip(points[::2], points[1::2], strict=True))

    def distance(self, point: FloatArray) -> float:
        """How far a point is from the core."""
        local = self.turned.T @ (point - self.centre)
        return float(np.linalg.norm(local - np.clip(local, -self.half, self.half)))


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
        parts = {body: list(_parts(model, body)) for body in moving}
        bones = [body for body in moving if _is_apart(model, body, parts)]
        found = min((part.radius for several in parts.values() for part in several), default=_THINNEST / _THIN)
        middle = 0
        if moving:
            free = [int(model.jnt_bodyid[j]) for j in range(model.njnt) if int(model.jnt_type[j]) == _FREE]
            middle = self._point(model, (free or moving)[0], np.zeros(3))
        links = [self._link(model, body, part) for body in moving for part in parts[body]]
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
        self._points = {body: [at for at, one in enumerate(self._bodies) if one == body] for body in moving}
        self.skeleton: Skeleton | None = None
        if moving:
            self.skeleton = Skeleton(tuple(self._names), tuple(links), points, middle, tuple(_solids(model)))

    def moved_by(self, model: mujoco.MjModel, actuators: Iterable[int]) -> Skeleton | None:
        """The skeleton with the joints of these actuators: of each the point that is nearest to the joint that it
        moves, among those of the part that moves there."""
        if self.skeleton is None:
            return None
        return replace(self.skeleton, joints=tuple(self._joint(model, actuator) for actuator in actuators))

    def _joint(self, model: mujoco.MjModel, actuator: int) -> int:
        if int(model.actuator_trntype[actuator]) not in _OF_JOINTS:
            return -1
        joint = int(model.actuator_trnid[actuator][0])
        points = self._points.get(int(model.jnt_bodyid[joint]), [])
        place = model.jnt_pos[joint]
        return min(points, key=lambda at: float(np.linalg.norm(self._place[at] - place)), default=-1)

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

    def _link(self, model: mujoco.MjModel, body: int, part: _Part) -> Link:
        (start, end), *beside = [
            (self._point(model, body, start), self._point(model, body, end)) for start, end in part.lines()
        ]
        return Link(start, end, part.margin, tuple(beside))

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
_OF_JOINTS: Final = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_TOUCH: Final = int(mujoco.mjtSensor.mjSENS_TOUCH)
_SPHERE: Final = int(mujoco.mjtGeom.mjGEOM_SPHERE)
_CAPSULE: Final = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
_CYLINDER: Final = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_ELLIPSOID: Final = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
_MESH: Final = int(mujoco.mjtGeom.mjGEOM_MESH)
#: what is long along its own z
_LONG: Final = (_CAPSULE, _CYLINDER)
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


def _parts(model: mujoco.MjModel, body: int) -> Iterator[_Part]:
    """The parts of a body."""
    for geom in _shown(model, body):
        kind, size = int(model.geom_type[geom]), model.geom_size[geom]
        centre, turned = np.array(model.geom_pos[geom]), _turned(model.geom_quat[geom])
        if kind in _GROUND:
            continue
        off, box = model.geom_aabb[geom][:3], np.array(model.geom_aabb[geom][3:])  # in the frame of the geom
        if kind in _LONG:
            off, box = np.zeros(3), np.array([size[0], size[0], size[1]])
        radius, margin = float(box.min()), 0.0
        half = box - radius
        if kind == _SPHERE:
            half, radius, margin, points = np.zeros(3), float(size[0]), float(size[0]), np.zeros((2, 3))
        elif kind == _CAPSULE:
            half, radius, margin = np.array([0, 0, size[1]]), float(size[0]), float(size[0])
            points = np.array([-half, half])
        elif kind == _CYLINDER:
            points = _rims(*box[1:].tolist())
        elif kind == _ELLIPSOID:
            margin = _ROUNDED * radius
            points = _ALL_WAYS * (box - margin)
        else:
            points = _corners(model, geom) if kind == _MESH else _CORNERS * box
            points = points - off if kind == _MESH else points
        if np.isfinite([*centre, *half, radius, *points.ravel()]).all():
            yield _Part(centre + turned @ off, turned, half, radius, points, margin)


def _rims(radius: float, half: float) -> FloatArray:
    """Points of the rims of a cylinder along z, those at both ends of a line in turn."""
    angles = 2 * math.pi * np.arange(_RIM) / _RIM
    ends = [np.stack([radius * np.cos(angles), radius * np.sin(angles), 0 * angles + z], axis=1) for z in (-half, half)]
    return np.stack(ends, axis=1).reshape(-1, 3)


def _corners(model: mujoco.MjModel, geom: int) -> FloatArray:
    """The corners of a mesh that lie furthest out in many ways, in the frame of its geom, an even number of them."""
    mesh = int(model.geom_dataid[geom])
    start = int(model.mesh_vertadr[mesh])
    vertices = np.array(model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])], dtype=np.float64)
    furthest = np.unique((vertices @ _WAYS.T).argmax(axis=0))
    return vertices[[*furthest, *furthest[: len(furthest) % 2]]]


def _is_apart(model: mujoco.MjModel, body: int, parts: dict[int, list[_Part]]) -> bool:
    """Whether nothing that is drawn of its parent meets what is drawn at the origin of a body."""
    parent = int(model.body_parentid[body])
    if parent not in parts or not _is_drawn(model, body, parts):
        return False
    origin = np.array(model.body_pos[body])
    reach = max((part.radius for part in parts[body] if part.distance(np.zeros(3)) <= part.radius), default=0.0)
    return all(part.distance(origin) > (part.radius + reach) * 1.01 for part in parts[parent])


def _is_drawn(model: mujoco.MjModel, body: int, parts: dict[int, list[_Part]]) -> bool:
    """Whether there is something to be drawn of a body or of those that hang on it."""
    below = {body}
    for other in range(body, model.nbody):  # parents come first
        if other == body or int(model.body_parentid[other]) in below:
            below.add(other)
            if parts.get(other):
                return True
    return False


def _feet(model: mujoco.MjModel, moving: list[int]) -> Iterator[_Foot]:
    """Touch sensors, in their order, of a body that has several the one furthest from its joint (a shin may feel, too);
    then bodies without one that are called feet, or have geoms that are. Whether such a foot touches something say
    these geoms; where nothing can touch them (they are there to be seen), others of the body, or what is fixed to it.
    """
    felt: dict[int, _Foot] = {}
    for sensor in np.flatnonzero(np.asarray(model.sensor_type) == _TOUCH).tolist():
        site = int(model.sensor_objid[sensor])
        body = int(model.site_bodyid[site])
        foot = _Foot(body, np.array(model.site_pos[site]), int(model.sensor_adr[sensor]), ())
        if body not in felt or np.linalg.norm(foot.place) > np.linalg.norm(felt[body].place):
            felt[body] = foot
    yield from felt.values()
    for body in moving:
        own = _geoms(model, [body])
        called = [geom for geom in own if _is_foot(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom))]
        if not called and _is_foot(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)):
            called = own or _rigid(model, body)
        if called and body not in felt:
            solid = _solid(model, called) or _solid(model, own) or _rigid(model, body)
            yield _Foot(int(model.geom_bodyid[called[0]]), _tip(model, called[0]), -1, tuple(solid))


def _geoms(model: mujoco.MjModel, bodies: list[int]) -> list[int]:
    """The geoms of bodies."""
    return np.flatnonzero(np.isin(model.geom_bodyid, bodies)).tolist()


def _solid(model: mujoco.MjModel, geoms: list[int]) -> list[int]:
    """Those geoms that something can touch."""
    return [geom for geom in geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]


def _rigid(model: mujoco.MjModel, body: int) -> list[int]:
    """The geoms that something can touch of what is fixed to a body and hangs on it, else of what it hangs on."""
    below = [body]
    for other in range(body + 1, model.nbody):  # parents come first
        if model.body_weldid[other] == model.body_weldid[body] and int(model.body_parentid[other]) in below:
            below.append(other)
    above = [int(model.body_parentid[body])]
    return _solid(model, _geoms(model, below[1:])) or _solid(model, _geoms(model, above))


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
