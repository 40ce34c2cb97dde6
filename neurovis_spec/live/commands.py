"""Commands: what a client asks of a live run, besides turns.

In: what ``protocol`` has checked. Out: frozen values that ``run`` carries out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from neurovis_spec.live.appearance import Appearance
from neurovis_spec.live.turns import Turn


@dataclass(frozen=True, slots=True)
class Play:
    """Go on at the speed that is set."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still."""


@dataclass(frozen=True, slots=True)
class Step:
    """A few steps on, or back; the run then stands still."""

    by: int


@dataclass(frozen=True, slots=True)
class Seek:
    """To a step; the run then stands still."""

    step: int


@dataclass(frozen=True, slots=True)
class Event:
    """To the next event of the spec (1), or the one before (−1); the run then stands still."""

    by: int


@dataclass(frozen=True, slots=True)
class Restart:
    """From the beginning; what was turned is undone."""


@dataclass(frozen=True, slots=True)
class Branch:
    """From here on differently: what came after is forgotten."""


@dataclass(frozen=True, slots=True)
class Speed:
    """How fast it plays; infinity is as fast as can be."""

    value: float


@dataclass(frozen=True, slots=True)
class Present:
    """Show the current step once more, for a client that has just connected."""


@dataclass(frozen=True, slots=True)
class Draw:
    """The picture is drawn otherwise, for all who look on."""

    appearance: Appearance


Command: TypeAlias = Present | Draw | Play | Pause | Step | Seek | Event | Restart | Branch | Speed | Turn
