"""The Source: what the live view shows, one small interface.

In: nothing; these are the types. A Source stands at a step and shows it; it goes on step by step, back
where it can, and takes turns where it can. ``simulated`` and ``recorded`` are two; ``ros.received`` is a third.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.live.history import History
from neurovis_spec.live.turns import Turn
from neurovis_spec.runtime.recording import Snapshot

Mask: TypeAlias = npt.NDArray[np.bool_]


class SourceError(ValueError):
    """What a source refuses: a step out of its reach, a turn that it cannot take."""


@dataclass(frozen=True, slots=True)
class Reach:
    """The steps that a source can go to, both included."""

    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a source can do besides showing and going on: ``takes``, the messages that change it which it takes (turns
    and ``branch``); ``ends`` (there is a last step) and ``arrives`` (its steps come from elsewhere: it goes on by the
    time of a frame, and waits at the last that there is)."""

    takes: frozenset[str] = frozenset()
    ends: bool = False
    arrives: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What is seen of a step: its snapshot, which neurons (n,) and connections (m,) are lesioned, and which neurons are
    clamped (n,)."""

    snapshot: Snapshot
    lesioned_neurons: Mask
    lesioned_connections: Mask
    clamped: Mask


@dataclass(frozen=True, slots=True)
class Turned:
    """A turn that was taken after ``step`` was shown: it has its effect from the next one on. Of values that were given
    to one thing at one step, or while it was dragged, the last is the turn."""

    step: int
    turn: Turn


class Source(Protocol):
    """What a live view shows. It stands at a step from the beginning on."""

    network: Network
    capabilities: Capabilities

    @property
    def step(self) -> int:
        """The step that it stands at."""
        ...

    @property
    def reach(self) -> Reach:
        """Where ``go`` can go."""
        ...

    @property
    def turned(self) -> tuple[Turned, ...]:
        """The turns taken on the way to the step that it stands at."""
        ...

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters that can be set, as they are now."""
        ...

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """What inputs are given by hand."""
        ...

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether the rules of the network are carried out, by their connections; None where some are."""
        ...

    @property
    def history(self) -> History:
        """What is known of its steps, for traces; another thread may read it."""
        ...

    def seen(self) -> Seen:
        """What is seen of the step that it stands at."""
        ...

    def advance(self) -> bool:
        """Go on by one step; False at the end, or where nothing has arrived: then nothing has changed."""
        ...

    def beside(self, by: int) -> int:
        """The step so many further on, or back, at most the first of its reach; there need not be one yet."""
        ...

    def go(self, step: int) -> None:
        """Go to a step within reach. Raises SourceError."""
        ...

    def restart(self) -> None:
        """Begin anew: nothing was turned, and the past is forgotten."""
        ...

    def recall(self, steps: int) -> list[Seen]:
        """What was seen of the last steps up to the one that it stands at, of those within reach; it stands afterwards
        where it stood."""
        ...

    def branch(self) -> None:
        """From here on differently: forget what came after the step that it stands at."""
        ...

    def turn(self, turn: Turn) -> None:
        """Take a turn; what came after the step that it stands at is forgotten. Raises SourceError."""
        ...


def recalled(source: Source, steps: int) -> list[Seen]:
    """What was seen of the last steps, of a source that makes its steps one after the other."""
    here = source.step
    source.go(max(source.reach.first, here - steps + 1))
    found = [source.seen()]
    while source.step < here and source.advance():
        found.append(source.seen())
    return found
