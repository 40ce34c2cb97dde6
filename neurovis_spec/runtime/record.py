"""Running and recording: many steps in one loop, into arrays taken beforehand.

In: a Network, inputs, a number of steps. Out: a Recording of steps 0 … steps − 1, or of every K-th of them. ``go``
hands the rows on while it runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.backend import Backend, prepare
from neurovis_spec.runtime.conditions import Controls
from neurovis_spec.runtime.inputs import STRETCH, InputReader
from neurovis_spec.runtime.memory import check_room
from neurovis_spec.runtime.recording import After, Recording, recording_of
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.runtime.until import Until
from neurovis_spec.runtime.watch import Watch


def record(
    network: Network,
    steps: int | None = None,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    backend: str | Backend | None = None,
    every: int = 1,
    start: Recording | None = None,
    progress: Progress | None = None,
    until: Until | None = None,
) -> Recording:
    """Run a network for ``steps`` steps (by default ``time.steps``) and record steps 0, ``every``, 2·``every``, …;
    ``until`` may end it earlier.

    ``inputs`` as in ``InputReader``; ``start`` as in ``resume``. Warns once (RuntimeWarning) when something is no
    longer finite. Raises InputError, BackendError, RecordingError (also where there is not the memory), ValueError.
    """
    steps = checked_steps(network, steps, every)
    check_room(steps, every, len(network.neurons) + len(network.changing))
    state = initial_state(network) if start is None else resumed_state(network, start)
    kept = np.arange(0, steps, every, dtype=np.int64)
    rows = _InMemory(network, len(kept))
    go(network, state, Course(steps, every, inputs, backend, until), rows, progress)
    made = rows.filled
    return recording_of(
        network, kept[:made], rows.activity[:made], rows.weights[:made], state.weights, after(network, state)
    )


def after(network: Network, state: State) -> After:
    """What is true in a state."""
    now, slots = state.conditions, network.settable
    given = {
        name: float(now.parameters[slots.index[name]])
        for name in network.parameters
        if now.chosen[slots.index[name]] or slots.slots[slots.index[name]].given
    }
    return After(
        state.weights[network.changing],
        state.drawn + state.k,
        given,
        np.flatnonzero(now.lesioned_neurons),
        np.flatnonzero(now.lesioned_connections),
    )


class Rows(Protocol):
    """Where rows go, a stretch of the run at a time."""

    def begin(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Arrays for the next ``count`` rows: activities (count, n), changing weights (count, p)."""
        ...

    def end(self, count: int) -> None:
        """So many rows of the arrays are filled: all, or fewer where they are handed on early."""
        ...

    def due(self) -> bool:
        """Whether rows are to be handed on now, asked after each step."""
        ...

    def over(self) -> bool:
        """Whether the run is to end here."""
        ...


class _InMemory:
    """All rows in two arrays."""

    def __init__(self, network: Network, rows: int) -> None:
        self.activity = np.empty((rows, len(network.neurons)))
        self.weights = np.empty((rows, len(network.changing)))
        self.filled = 0

    def begin(self, count: int) -> tuple[FloatArray, FloatArray]:
        first = self.filled
        return self.activity[first : first + count], self.weights[first : first + count]

    def end(self, count: int) -> None:
        self.filled += count

    def due(self) -> bool:
        return False

    def over(self) -> bool:
        return False


@dataclass(frozen=True)
class Course:
    """How long a run is, which steps of it are kept, and what it runs on."""

    steps: int
    every: int = 1
    inputs: Mapping[str, npt.ArrayLike] | None = None
    backend: str | Backend | None = None
    #: what may end it earlier
    until: Until | None = None


def checked_steps(network: Network, steps: int | None, every: int) -> int:
    """The steps of a run. Raises ValueError."""
    steps = network.steps if steps is None else steps
    if steps < 0 or every < 1:
        raise ValueError(f"{steps} steps, every {every}: at least 0 and at least 1 are needed")
    return steps


def go(network: Network, state: State, course: Course, rows: Rows, progress: Progress | None = None) -> None:
    """Run a network from a state, and hand on the rows that are kept."""
    every, steps = course.every, course.steps
    if course.until is not None:
        rows = course.until.watch(rows, state, steps)
    changing = _subscript(network.changing)
    watch, due, step = Watch(network), rows.due, prepare(network, course.backend).step
    look = watch.look
    reader = InputReader(network, course.inputs, watch.given)
    controls, changes = Controls(network), {change.at: change for change in network.changes}
    edges = [0, *(at for at in changes if 0 < at < steps), steps]
    with np.errstate(all="ignore"):
        for begin, end in pairwise(edges):
            if begin in changes:
                controls.apply(state.conditions, state.weights, state.signals, changes[begin])
            reader.use(state)
            for first, stop in _stretches(begin, end):
                if rows.over():
                    return
                wanted = (stop - 1) // every - (first - 1) // every
                activity, weights = rows.begin(wanted)
                row = 0
                for k, vector in enumerate(reader.rows(first, stop), first):
                    keep = k % every == 0
                    if keep and changing is not None:
                        weights[row] = state.weights[changing]
                    step(state, vector)
                    look(state)
                    if keep:
                        activity[row] = state.activity
                        row += 1
                    if due():
                        rows.end(row)
                        if rows.over():
                            return
                        wanted -= row
                        activity, weights = rows.begin(wanted)
                        row = 0
                rows.end(row)
                if progress is not None:
                    progress(stop, steps)


def _stretches(begin: int, end: int) -> Iterator[tuple[int, int]]:
    """The steps from ``begin`` to ``end`` in the stretches that an InputReader makes at a time."""
    first = begin
    while first < end:
        stop = min(first - first % STRETCH + STRETCH, end)
        yield first, stop
        first = stop


def _subscript(indices: npt.NDArray[np.int64]) -> slice | npt.NDArray[np.int64] | None:
    """A slice where the indices lie in a row, which is quicker; None without any."""
    if not len(indices):
        return None
    first, count = int(indices[0]), len(indices)
    return slice(first, first + count) if np.array_equal(indices, np.arange(first, first + count)) else indices
