"""What a body is: sensors, actuators, a pose that can be drawn.

In: nothing; these are the values of the seam. Out: Port (a sensor or an actuator), Skeleton (how a pose is drawn), the
Body that a run advances, and BodyKind, which opens one by the name or the file in the spec. Metres, seconds, radians;
x points forward, y to the left, z up.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from neurovis_spec.arrays import FloatArray


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
    actuator, the range that the body takes; commands beyond it are clipped by the body."""

    name: str
    size: int
    unit: str = ""
    low: float = float("-inf")
    high: float = float("inf")

    @property
    def numbers(self) -> tuple[str, ...]:
        """What each of its numbers is called: ``name[i]``; a single one by the name alone."""
        return (self.name,) if self.size == 1 else tuple(f"{self.name}[{i}]" for i in range(self.size))


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid part, drawn as a line with round ends between two points of the skeleton; the radius in metres. A part
    that is wide and flat is several such lines beside each other, and what lies between them: ``beside`` are the ends
    of the others, in their order."""

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

    ``points`` are names; ``feet`` and ``middle`` are indices of points, the latter what the picture follows.
    """

    points: tuple[str, ...]
    links: tuple[Link, ...]
    feet: tuple[int, ...] = ()
    middle: int = 0
    solids: tuple[Solid, ...] = ()

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
