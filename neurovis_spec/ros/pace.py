"""Pace: when a step begins, by a steady clock or by the simulated time of ``/clock``.

In: a rate. Out: step t begins at start + t/rate; none is left out, a late one is counted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final, Protocol

#: seconds of a sleep, so that an end is soon noticed; and between two looks at a simulated clock
_NAP, _LOOK = 0.05, 0.0005
#: seconds after which somebody should have sent a simulated clock, and what is told then
_PATIENCE: Final = 1.0
NO_CLOCK: Final = "waiting for /clock, on which nothing comes: the time is taken from it (--sim-time, use_sim_time)"
#: a clock that falls back by more seconds than this has begun anew
_BACK: Final = 1e-3


class Clock(Protocol):
    """Seconds that only grow; a simulated clock may begin anew."""

    def now(self) -> float:
        """Seconds; 0 before a simulated clock has begun."""
        ...

    def nap(self, seconds: float) -> None:
        """Let at most so many seconds of its time pass."""
        ...


class SteadyClock:
    """The machine's steady clock."""

    def now(self) -> float:
        """Seconds."""
        return time.monotonic()

    def nap(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(min(seconds, _NAP))


class SimulatedClock:
    """The time of ``/clock``, in nanoseconds."""

    def __init__(self, nanoseconds: Callable[[], int]) -> None:
        self._nanoseconds = nanoseconds

    def now(self) -> float:
        """Seconds."""
        return self._nanoseconds() / 1e9

    def nap(self, seconds: float) -> None:
        """Wait for the next message."""
        time.sleep(_LOOK)


def clock_begins(
    clock: Clock, stopped: Callable[[], bool], late: Callable[[], None], steady: Callable[[], float] = time.monotonic
) -> bool:
    """Wait until a clock has begun, as a steady one has; where that takes long, ``late`` is called once. False where it
    was stopped before."""
    due: float | None = steady() + _PATIENCE
    while not clock.now():
        if stopped():
            return False
        if due is not None and steady() >= due:
            due = None
            late()
        clock.nap(_NAP)
    return not stopped()


class Pace:
    """Steps at a rate. ``late`` counts those that began more than half a period late."""

    def __init__(self, clock: Clock, rate: float) -> None:
        self._clock, self._rate = clock, rate
        self._start, self._first, self._last = 0.0, 0, 0.0
        self.late = 0

    def begin(self, stopped: Callable[[], bool], late: Callable[[], None] = lambda: None) -> bool:
        """Step 0 is due now, with a simulated clock when that has begun; False where it was stopped before. See
        ``clock_begins``."""
        going = clock_begins(self._clock, stopped, late)
        self._start = self._last = self._clock.now()
        return going

    def wait(self, step: int, stopped: Callable[[], bool]) -> bool:
        """Wait until a step is due; False where it was stopped before."""
        while True:
            now = self._clock.now()
            if now < self._last - _BACK:  # a simulation that begins anew
                self._start, self._first = now, step
            self._last = now
            due = self._start + (step - self._first) / self._rate
            if stopped():
                return False
            if now >= due:
                self.late += now - due > 0.5 / self._rate
                return True
            self._clock.nap(due - now)
