"""What a body is: sensors, actuators, a pose that can be drawn; how one is opened.

In: what a spec says of its body. Out: Port (a sensor or an actuator), Skeleton (how a pose is drawn, also as a text, in
recordings and on the wire), the Body that a run advances, and BodyKind, which opens one by the name or the file in the
spec, found through entry points: no kind is imported before somebody has a body of it. Metres, seconds, radians; x
points forward, y to the left, z up.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol, cast

from neurovis_spec import plugins
from neurovis_spec.arrays import FloatArray as FloatArray  # kinds of bodies see this module of ours alone

#: What our own kinds need besides, and what installs it.
_NEEDS: Final = {"mujoco": "MuJoCo", "gymnasium": "Gymnasium"}
#: points, links, feet and solids of a skeleton that is read, each
_MOST = 100_000


class BodyError(ValueError):
    """A body cannot be opened, or cannot do what is asked of it; ``hint``, which a traceback shows, says what would
    help. ``key`` is the key of the spec's ``body`` that the fault lies in (``mujoco``, ``substeps``), if it lies in
    one. Where the length of a step does not fit, ``fitting`` are the seconds and the substeps of one that does."""

    def __init__(
        self,
        message: str,
        hint: str | None = None,
        key: str | None = None,
        fitting: tuple[float, int] | None = None,
    ) -> None:
        super().__init__(message)
        self.hint, self.key, self.fitting = hint, key, fitting
        if hint is not None:
            self.add_note(hint)


@dataclass(frozen=True, slots=True)
class Port:
    """A sensor or an actuator: its name, how many numbers it is, and what they are measured in (may be empty). Of an
    actuator, the range that the body takes; commands beyond it are clipped by the body. ``each`` are the ranges of its
    numbers, where these have different ones."""

    name: str
    size: int
    unit: str = ""
    low: float = float("-inf")
    high: float = float("inf")
    each: tuple[tuple[float, float], ...] = ()

    @classmethod
    def ranged(cls, name: str, unit: str, each: Sequence[tuple[float, float]]) -> Port:
        """An actuator by the ranges of its numbers; its own is from the lowest to the highest of all."""
        low, high = min((low for low, _ in each), default=0.0), max((high for _, high in each), default=0.0)
        return cls(name, len(each), unit, low, high, tuple(each))

    @property
    def ranges(self) -> tuple[tuple[float, float], ...]:
        """The lowest and the highest that each of its numbers may be."""
        return self.each or ((self.low, self.high),) * self.size

    @property
    def numbers(self) -> tuple[str, ...]:
        """What each of its numbers is called: ``name[i]``; a single one by the name alone."""
        return (self.name,) if self.size == 1 else tuple(f"{self.name}[{i}]" for i in range(self.size))


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid part, drawn as a line with round ends between two points of the skeleton; the radius in metres. Where it
    has another shape, it is all that lies within the radius of the convex hull of several lines: ``beside`` are the
    ends of the others. So a box is four lines with no radius."""

    start: int
    end: int
    radius: float
    beside: tuple[tuple[int, int], ...] = ()

    @property
    def lines(self) -> tuple[tuple[int, int], ...]:
        """The ends of all its lines."""
        return ((self.start, self.end), *self.beside)

    @property
    def points(self) -> tuple[int, ...]:
        """The points of the skeleton that it lies between."""
        return tuple(point for line in self.lines for point in line)


@dataclass(frozen=True, slots=True)
class Solid:
    """What stands in the world and never moves: a box along the axes, by its lowest and highest corner in metres."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Skeleton:
    """How a pose is drawn. A pose is ``size`` numbers: x, y, z of each point, in their order, then for each foot 1
    where it touches something and 0 where it does not.

    ``points`` are names; ``feet`` and ``middle`` are indices of points, the latter what the picture follows. ``joints``
    are the indices of the points at which the numbers of the actuators move the body, in their order, −1 where one
    moves it at no point; a recording, which holds no commands, has none.
    """

    points: tuple[str, ...]
    links: tuple[Link, ...]
    feet: tuple[int, ...] = ()
    middle: int = 0
    solids: tuple[Solid, ...] = ()
    joints: tuple[int, ...] = field(default=(), compare=False)

    @property
    def size(self) -> int:
        """How many numbers a pose is."""
        return 3 * len(self.points) + len(self.feet)


class Body(Protocol):
    """A body at a moment. It begins as ``reset(0)`` leaves it."""

    sensors: Sequence[Port]
    actuators: Sequence[Port]
    #: None where the body has no picture
    skeleton: Skeleton | None

    def reset(self, seed: int) -> None:
        """Begin an episode: the body as it is at the beginning, what is random in it drawn from the seed."""
        ...

    def sense(self) -> FloatArray:
        """What the sensors say now, one after the other, in their order."""
        ...

    def advance(self, dt: float, commands: FloatArray) -> None:
        """Go on by dt seconds under these commands, one number for each of the actuators, one after the other. Raises
        BodyError."""
        ...

    @property
    def ended(self) -> bool:
        """Whether the body itself ends the episode here: it fell, or arrived. Then only ``reset`` goes on."""
        ...

    def pose(self) -> FloatArray:
        """What the skeleton is drawn from, ``skeleton.size`` numbers; none without a skeleton."""
        ...

    def state(self) -> object:
        """All that the body carries from step to step, for ``restore``; an array of numbers where it can be put into
        a file. Raises BodyError where a body cannot be kept."""
        ...

    def restore(self, state: object) -> None:
        """Back to a state of this body, exactly."""
        ...


class BodyKind(Protocol):
    """What opens bodies of a kind: the class that an entry point in ``neurovis.bodies`` names, called without
    arguments. The entry point's name is the key under ``body`` in the spec."""

    #: whether what the spec gives is a file, found as other data files are
    takes_file: bool

    def files(self, path: Path) -> Iterable[Path]:
        """Where the files may lie that the one at a path names, of kinds that take files; none is opened before its
        place was given, so that the caller can make sure that it lies where a spec's data may lie. Raises BodyError."""
        ...

    def open(self, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
        """Open a body; ``given`` is what the spec says, ``path`` the file it names where the kind takes files. A step
        of the network is ``dt`` seconds, and ``substeps`` of the body's own. Raises BodyError."""
        ...


class BodyMissingError(BodyError):
    """What a kind of body needs is not installed."""


def load_kind(name: str) -> BodyKind:
    """A kind of bodies by its name. Raises BodyError, BodyMissingError where what it needs is not installed."""
    try:
        loaded = plugins.load(plugins.BODIES, name)
    except KeyError:
        raise BodyError(f"there is no kind of body '{name}'") from None
    except plugins.PluginError as error:
        if isinstance(error.__cause__, ImportError):
            message = f"a body of {_NEEDS.get(name, name)} needs what is not installed ({error.__cause__})"
            hint = "pip install 'neurovis-spec[sim]'" if name in _NEEDS else None
            raise BodyMissingError(message, hint, name) from None
        raise BodyError(str(error), key=name) from None
    if not all(hasattr(loaded, part) for part in ("takes_file", "files", "open")):
        raise BodyError(f"the plug-in '{name}' opens no bodies: it has not all that a BodyKind has", key=name)
    return cast(BodyKind, loaded)


def open_body(kind: str, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
    """A body of a kind, at its beginning. Raises BodyError, BodyMissingError where what it needs is not installed."""
    loaded = load_kind(kind)
    try:
        return loaded.open(given, path, dt, substeps)
    except BodyError:
        raise
    except Exception as error:  # whatever a body's own code raises
        raise BodyError(f"'{given}' cannot be opened: {type(error).__name__}: {error}", key=kind) from error


def text_of(skeleton: Skeleton) -> str:
    """A skeleton as a text."""
    return json.dumps(
        {
            "points": list(skeleton.points),
            "links": [[link.start, link.end, link.radius, *link.points[2:]] for link in skeleton.links],
            "feet": list(skeleton.feet),
            "middle": skeleton.middle,
            "solids": [[list(solid.low), list(solid.high)] for solid in skeleton.solids],
        }
    )


def skeleton_of(text: str) -> Skeleton:
    """The skeleton in a text. Raises BodyError for a text that is none.

    >>> one = Skeleton(("hip", "foot"), (Link(0, 1, 0.02),), feet=(1,))
    >>> skeleton_of(text_of(one)) == one
    True
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise BodyError("not a skeleton: no mapping in JSON")
    points = _list(found, "points")
    indices = range(len(points))
    names = tuple(name for name in points if isinstance(name, str))
    if len(names) < len(points):
        raise BodyError("not a skeleton: a point has no name")
    links = tuple(_link(values, indices) for values in _several(found, "links", 3, more=True))
    solids = tuple(Solid(_corner(low), _corner(high)) for low, high in _several(found, "solids", 2))
    feet = tuple(_index(foot, indices) for foot in _list(found, "feet"))
    middle = found.get("middle", 0)
    if points or middle != 0:
        middle = _index(middle, indices)
    return Skeleton(names, links, feet, middle, solids)


def _list(found: Mapping[str, object], key: str) -> list[object]:
    values = found.get(key, [])
    if not isinstance(values, list) or len(values) > _MOST:
        raise BodyError(f"not a skeleton: '{key}' is no list, or too long")
    return values


def _link(values: list[object], indices: range) -> Link:
    """Two ends, a radius, then the ends of further lines."""
    start, end, radius, *more = values
    ends = [_index(value, indices) for value in more]
    if len(ends) % 2:
        raise BodyError("not a skeleton: a line of a link has one end")
    beside = tuple(zip(ends[::2], ends[1::2], strict=True))
    return Link(_index(start, indices), _index(end, indices), _number(radius), beside)


def _several(found: Mapping[str, object], key: str, size: int, *, more: bool = False) -> list[list[object]]:
    """Lists of so many values, or of that many and ``more``."""
    result = []
    for value in _list(found, key):
        if not isinstance(value, list) or len(value) < size or (len(value) > size and not more):
            raise BodyError(f"not a skeleton: in '{key}' there are not {size} values each")
        result.append(value)
    return result


def _index(value: object, indices: range) -> int:
    if type(value) is not int or value not in indices:
        raise BodyError(f"not a skeleton: there is no point {value!r:.40}")
    return value


def _number(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise BodyError(f"not a skeleton: {value!r:.40} is no finite number")
    return float(value)


def _corner(value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise BodyError("not a skeleton: a corner has not three coordinates")
    x, y, z = (_number(one) for one in value)
    return x, y, z
