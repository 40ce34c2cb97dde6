"""The Source: the interface behind the live view, for a run, a recording, or a network that runs elsewhere.

In: nothing; these are the types. A Source has a current step. It says what a picture of that step shows, goes on
step by step, goes back as far as it remembers, and takes the user's changes (``turns``) if it can. There are three:
``simulated``, ``recorded`` and ``ros.received``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import Port, Skeleton
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.futures import Futures
from neurovis_spec.live.history import History
from neurovis_spec.live.turns import Turn, Turned
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.runtime.rows import After
from neurovis_spec.scene.poses import start_of

Mask: TypeAlias = npt.NDArray[np.bool_]


class SourceError(ValueError):
    """A source cannot do it: the step is out of its reach, or it does not take such a turn."""


@dataclass(frozen=True, slots=True)
class Reach:
    """The steps that a source can go to, both included."""

    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What kind of source it is. ``takes``: the names of the turns that it accepts, and of what is done with futures
    (``branch``, ``switch``, ``rename``, ``forget``, ``restore``, ``undo``) if it accepts that; ``ends``: there is a
    last step; ``arrives``: its steps are received from elsewhere, so it is advanced once a frame, not by dt, and waits
    at the newest."""

    takes: frozenset[str] = frozenset()
    ends: bool = False
    arrives: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What a picture of a step is made from: its snapshot, the lesioned neurons (n,) and connections (m,), and the
    clamped neurons (n,); and for a recording the states that outputs of the spec name, None where they are not known.
    """

    snapshot: Snapshot
    lesioned_neurons: Mask
    lesioned_connections: Mask
    clamped: Mask
    states: FloatArray | None = None


class Motor(NamedTuple):
    """A number of an actuator: the point of the skeleton that it moves, −1 for none; its name; its range."""

    point: int
    name: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Drawn:
    """The body of what is shown: how its pose is drawn, None where there is nothing to draw, and what its sensors are
    called; ``start`` is where its middle was when the view began, x and y in metres. ``motors`` are of each number of
    its actuators where it moves the body (a point of the skeleton), its name, the lowest and the highest command, where
    those are known. Those are equal that are drawn alike."""

    skeleton: Skeleton | None = None
    sensor_names: tuple[str, ...] = field(default=(), compare=False)
    start: tuple[float, float] = (0.0, 0.0)
    motors: tuple[Motor, ...] = ()


def drawn(
    skeleton: Skeleton | None,
    sensor_names: tuple[str, ...],
    pose: FloatArray | None,
    actuators: Sequence[Port] = (),
) -> Drawn:
    """The body of what is shown from this pose on, and what moves it."""
    if skeleton is None or pose is None or not skeleton.points:
        return Drawn(None, sensor_names)
    numbers = [one for port in actuators for one in zip(port.numbers, port.ranges, strict=True)]
    places = skeleton.joints if len(skeleton.joints) == len(numbers) else (-1,) * len(numbers)
    motors = tuple(Motor(at, name, *ends) for at, (name, ends) in zip(places, numbers, strict=True))
    return Drawn(skeleton, sensor_names, start_of(skeleton, pose), motors)


#: No body.
NOTHING = Drawn()


class Source(Protocol):
    """What a live view shows. It has a current step as soon as it is made. What raises, a SourceError or anything else,
    leaves it where it stood."""

    network: Network
    capabilities: Capabilities
    #: the body, whose pose at a step is in the step's snapshot
    body: Drawn
    #: what else the run has done behind steps of its past
    futures: Futures
    #: the name of what it does, where it is a future that was given one and gone to
    name: str

    @property
    def step(self) -> int:
        """The current step."""
        ...

    @property
    def reach(self) -> Reach:
        """The steps that ``go`` accepts."""
        ...

    @property
    def turned(self) -> tuple[Turned, ...]:
        """The turns that were taken up to the current step, in order."""
        ...

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters that can be set, as they are now."""
        ...

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """The values that inputs are fed by hand, by name."""
        ...

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether connections learn, by the reference that names them; None where only some of these do."""
        ...

    @property
    def history(self) -> History:
        """The past activities, weights and quantities, for traces; another thread may read it."""
        ...

    @property
    def quantities(self) -> FloatArray | None:
        """The quantities of the current step (``runtime/quantities.py``), (k,); None where they are not known."""
        ...

    @property
    def backend(self) -> str:
        """The name of the backend that makes its steps, "" where that is not known."""
        ...

    def seen(self) -> Seen:
        """What a picture of the current step is made from."""
        ...

    def after(self) -> After:
        """What is true after the current step, with what was turned at it; its weights are those of all connections
        (m,)."""
        ...

    def advance(self) -> bool:
        """Go on by one step; False, and no change, at the end or where the next step has not arrived. Raises
        SourceError."""
        ...

    def number_after(self, by: int) -> int:
        """The number of the step so many further on or (negative) back, not before the first that can be reached; it
        may be one that has not been computed yet."""
        ...

    def go(self, step: int) -> None:
        """Go to a step within reach. Raises SourceError."""
        ...

    def restart(self) -> None:
        """Begin anew: turns and past steps are forgotten. Raises SourceError."""
        ...

    def recall(self, steps: int) -> list[Seen]:
        """``seen`` of the last so many steps up to the current one, as far as they can be reached; the current step is
        the same afterwards."""
        ...

    def branch(self) -> None:
        """Have the run go on differently from here: what came after the current step is another future."""
        ...

    def turn(self, turn: Turn) -> None:
        """Apply a turn; what came after the current step is another future. Raises SourceError."""
        ...

    def take_back(self, number: int) -> None:
        """Take a turn back, by its number: at the step at which it was taken as though it had not been, later by its
        opposite. Raises SourceError."""
        ...

    def switch(self, number: int, step: int | None = None) -> None:
        """Go to another future, by its number, there to a step, by default that which is shown, or to the one that is
        nearest; the future that is left is another then. Raises SourceError."""
        ...

    def twin(self, number: int) -> Source:
        """Another source, which is in a future, by its number, and goes by itself. Raises SourceError."""
        ...


def recalled(source: Source, steps: int) -> list[Seen]:
    """``Source.recall`` for sources that can go back and then advance step by step."""
    here = source.step
    source.go(max(source.reach.first, here - steps + 1))
    found = [source.seen()]
    while source.step < here and source.advance():
        found.append(source.seen())
    return found
