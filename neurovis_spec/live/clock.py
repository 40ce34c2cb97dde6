"""The clock of a live run: how many steps are due, and when the next frame is.

In: the time, in seconds. Out: steps. A run that cannot keep up goes as fast as it can, and does not catch up later.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

#: Frames a second at most: what displays show.
FRAMES: Final = 60
#: The speeds there are, as factors of real time; ``max`` is as fast as can be.
SPEEDS: Final[Mapping[str, float]] = {
    "0.25": 0.25,
    "0.5": 0.5,
    "1": 1,
    "2": 2,
    "4": 4,
    "8": 8,
    "16": 16,
    "max": math.inf,
}
#: A run that is later than this has its time begin anew.
_LATE = 0.25


class Clock:
    """Counts steps of ``seconds`` each, at a speed, from when it was started on."""

    def __init__(self, seconds: float, speed: float = 1.0) -> None:
        self._seconds, self.speed = seconds, speed
        self.start(0.0)

    @classmethod
    def of(cls, dt: float, given: bool, speed: float = 1.0) -> Clock:
        """Real time, or where no dt is written, a step a frame."""
        return cls(dt if given else 1 / FRAMES, speed)

    def start(self, now: float) -> None:
        """Begin now; the first step is due after its time."""
        self._origin, self._made = now, 0

    def set_speed(self, speed: float, now: float) -> None:
        """Go on at another speed."""
        self.speed = speed
        self.start(now)

    def next(self) -> float:
        """When the next step is due."""
        return self._origin if math.isinf(self.speed) else self._origin + (self._made + 1) * self._seconds / self.speed

    def due(self, now: float) -> float:
        """How many steps are due; infinity where they are made as fast as can be."""
        if math.isinf(self.speed):
            return math.inf
        if now - self.next() > max(_LATE, self._seconds / self.speed):
            self.start(now - self._seconds / self.speed)
        return max(0, math.floor((now - self._origin) * self.speed / self._seconds + 1e-9) - self._made)

    def make(self, steps: int) -> None:
        """So many were made."""
        self._made += steps


class Pace:
    """When frames are due: each a sixtieth of a second after the one before was, or at once where that has passed."""

    def __init__(self) -> None:
        self.due = 0.0

    def begin(self, now: float) -> None:
        """A frame is begun."""
        self.due = max(self.due + 1 / FRAMES, now)
