"""Spikes of a run as events: which neurons have fired at which steps, whatever rows are kept.

In: who has fired at a step. Out: Fired; of a recording Spikes, times and indices. Who does is Spiking
(``runtime/columns.py``).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray


class Spikes(NamedTuple):
    """Spikes in the order of their steps: ``times`` (spikes,) in seconds, and ``indices`` (spikes,) of the neurons that
    have fired, among those that were asked for."""

    times: FloatArray
    indices: IntArray


class Fired(NamedTuple):
    """Spikes in the order of their ``steps`` (spikes,), of the ``neurons`` (spikes,) of a network; all there are from
    step ``first`` to before ``stop``."""

    steps: IntArray
    neurons: IntArray
    first: int = 0
    stop: int = 0

    def between(self, first: int, stop: int) -> Fired:
        """Those of some of the steps."""
        first, stop = max(first, self.first), min(stop, self.stop)
        low, high = np.searchsorted(self.steps, [first, stop]).tolist()
        return Fired(self.steps[low:high], self.neurons[low:high], first, max(first, stop))


_NONE: IntArray = np.zeros(0, dtype=np.int64)
NONE_FIRED: Final = Fired(_NONE, _NONE)


class SpikeLog:
    """Collects what fires in a run, step by step."""

    def __init__(self, first: int = 0) -> None:
        self._first = self._stop = first
        self._parts: list[tuple[IntArray, IntArray]] = []

    def put(self, step: int, neurons: IntArray) -> None:
        """These have fired at the next step, which is this one."""
        if len(neurons):
            self._parts.append((np.full(len(neurons), step, np.int64), neurons))
        self._stop = step + 1

    def extend(self, fired: Fired) -> None:
        """These have, in some more steps."""
        if len(fired.steps):
            self._parts.append((fired.steps, fired.neurons))
        self._stop = fired.stop

    @property
    def all(self) -> Fired:
        """All that have fired since it was emptied."""
        if not self._parts:
            return Fired(_NONE, _NONE, self._first, self._stop)
        steps, neurons = (np.concatenate(parts) for parts in zip(*self._parts, strict=True))
        return Fired(steps, neurons, self._first, self._stop)

    def take(self) -> Fired:
        """The same; it is empty then."""
        taken = self.all
        self._first, self._parts = self._stop, []
        return taken
