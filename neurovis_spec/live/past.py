"""The past: states of a run in bounded memory, from which any step since the first of them is made again, exactly.

In: states, at every so many steps and wherever somebody has turned something. Out: the latest state at or before a
step. A state costs what it holds; where the room is full the oldest go.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from neurovis_spec.runtime.state import BodyState, Conditions, State
from neurovis_spec.scene.fading import Fading

#: bytes
ROOM = 256 << 20
#: steps between two states: at most so many are run again to step back
EVERY = 64
#: what a state takes besides its numbers, in bytes
_OVERHEAD = 4096
#: what the state of a body is taken for that is no array, as nobody knows
_UNKNOWN = 1 << 20


@dataclass(frozen=True, slots=True)
class Kept:
    """All that a run needs to go on: its state, the inputs fed by hand, and the fading traces of earlier activities."""

    state: State
    fed: Mapping[str, tuple[float, ...]]
    #: the traces of what was active, for the eye
    fading: Fading

    @property
    def size(self) -> int:
        """About how many bytes it takes."""
        return _OVERHEAD + _bytes(self.state) + _bytes(self.state.conditions)


def _bytes(value: object) -> int:
    """The bytes of the arrays in a bundle of arrays, and of tuples and mappings of these."""
    if isinstance(value, np.ndarray):
        return int(value.nbytes)
    if isinstance(value, Mapping):
        return sum(_bytes(part) for part in value.values())
    if isinstance(value, tuple):
        return sum(_bytes(part) for part in value)
    if isinstance(value, BodyState):
        known = value.carried is None or isinstance(value.carried, np.ndarray)
        return _bytes(value.carried) if known else _UNKNOWN
    if isinstance(value, State | Conditions):
        return sum(_bytes(getattr(value, field.name)) for field in fields(value) if field.name != "conditions")
    return 0


class Past:
    """States by their step k, ascending; what they take together is at most ``room`` bytes, but for the newest."""

    def __init__(self, room: int = ROOM) -> None:
        self._room, self._taken = room, 0
        self._steps: list[int] = []
        self._kept: list[Kept] = []

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def first(self) -> int:
        """The k of the oldest state."""
        return self._steps[0]

    @property
    def taken(self) -> int:
        """The bytes that it takes."""
        return self._taken

    def keep(self, kept: Kept) -> None:
        """Keep a state, in place of another of the same step; there are none of later steps."""
        self.cut(kept.state.k - 1)
        self._steps.append(kept.state.k)
        self._kept.append(kept)
        self._taken += kept.size
        while self._taken > self._room and len(self._kept) > 1:
            self._taken -= self._kept.pop(0).size
            self._steps.pop(0)

    def copy(self) -> Past:
        """The same, which goes on by itself."""
        made = Past(self._room)
        made._taken, made._steps, made._kept = self._taken, self._steps.copy(), self._kept.copy()
        return made

    def cut(self, k: int) -> None:
        """Forget the states after step k."""
        while self._steps and self._steps[-1] > k:
            self._steps.pop()
            self._taken -= self._kept.pop().size

    def after(self, k: int) -> tuple[Kept, ...]:
        """The states of steps after k."""
        return tuple(self._kept[bisect_right(self._steps, k) :])

    def before(self, k: int) -> Kept | None:
        """The latest state at or before step k."""
        place = bisect_right(self._steps, k) - 1
        return self._kept[place] if place >= 0 else None

    def at(self, k: int) -> Kept | None:
        """The state of step k, if it is kept."""
        found = self.before(k)
        return found if found is not None and found.state.k == k else None
