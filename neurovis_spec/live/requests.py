"""Requests: what the owner of a live view asks besides commands of the run: neurons put by hand, files.

In: what ``protocol`` has checked. Out: frozen values that ``desk`` carries out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from neurovis_spec.layout.model import Point
from neurovis_spec.live.pins import Into

#: What can be had as a file.
What: TypeAlias = Literal["svg", "film", "npz"]


@dataclass(frozen=True, slots=True)
class PlaceNeuron:
    """Put a neuron here (units of the layout); until ``done`` only the places and routes that follow are told."""

    neuron: str
    at: Point
    done: bool


@dataclass(frozen=True, slots=True)
class Unplace:
    """Undo the last placing."""


@dataclass(frozen=True, slots=True)
class Save:
    """Say what would be written."""

    into: Into


@dataclass(frozen=True, slots=True)
class Write:
    """Write what was said."""


@dataclass(frozen=True, slots=True)
class Fetch:
    """Have the picture, a film of the last ``seconds``, or the recording."""

    what: What
    seconds: float


Request: TypeAlias = PlaceNeuron | Unplace | Save | Write | Fetch
#: the messages that ask for them
REQUESTS: Final = frozenset(("place", "unplace", "save", "write", "fetch"))
