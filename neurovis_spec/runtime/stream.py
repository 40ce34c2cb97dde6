"""Recordings that are written while the network runs: a stretch of rows at a time, so that no run is too long.

In: a Network, a path, how to run. Out: a file, which is there when the run has come to its end, or when Ctrl-C has
ended it, with the steps until then; after any other exception there is what was there before. A format that writes in
streams says so by having ``stream``; of the others the whole recording is saved.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.files import uninterrupted
from neurovis_spec.runtime.formats import for_path
from neurovis_spec.runtime.inputs import STRETCH
from neurovis_spec.runtime.memory import check_disk
from neurovis_spec.runtime.record import Course, after, checked_steps, go, record
from neurovis_spec.runtime.recording import After, Recording, recording_of
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.rows import RowWriter, Steps
from neurovis_spec.runtime.state import initial_state


@runtime_checkable
class StreamingFormat(Protocol):
    """A format that takes rows as they come."""

    def stream(self, path: Path, frame: Recording, steps: Steps) -> AbstractContextManager[RowWriter]:
        """A writer for the rows of these steps; ``frame`` is the recording without them. The file is there when the
        block ends, with as many rows as came, which are fewer where a run was stopped; after an exception nothing has
        changed. Raises OSError."""
        ...

    def size(self, frame: Recording, steps: Steps) -> int:
        """About how many bytes of the disk it takes."""
        ...


class StoppedError(KeyboardInterrupt):
    """Ctrl-C has ended a run; what was recorded by then is in the file. ``rows`` says how many steps these are."""

    def __init__(self, path: Path, step: int, rows: int, every: int) -> None:
        last = (rows - 1) * every
        held = "step 0" if rows == 1 else f"steps 0 to {last}{'' if every == 1 else f', one in {every}'}"
        super().__init__(f"stopped at step {max(step, last + 1)}; {path} holds {held}")
        self.rows = rows


def record_to(
    network: Network, path: Path, course: Course, start: Recording | None = None, progress: Progress | None = None
) -> None:
    """Run a network and write what ``record`` returns to a file. Raises what ``record`` and ``formats.save`` raise, and
    StoppedError after Ctrl-C, when the steps until then are in the file; KeyboardInterrupt where there are none."""
    format_ = for_path(path)
    if not isinstance(format_, StreamingFormat):
        format_.save(record(network, course.steps, course.inputs, course.backend, course.every, start, progress), path)
        return
    steps = Steps(checked_steps(network, course.steps, course.every), course.every)
    state = initial_state(network) if start is None else resumed_state(network, start)
    none = np.zeros((0, len(network.neurons))), np.zeros((0, len(network.changing)))
    frame = recording_of(network, np.zeros(0, dtype=np.int64), *none, state.weights, after(network, state, start))
    check_disk(path, steps.total, steps.every, format_.size(frame, steps))
    stopped = False
    with format_.stream(path, frame, steps) as writer:
        rows = _Handed(network, writer, lambda: after(network, state, start))
        try:
            go(network, state, course, rows, progress)
        except KeyboardInterrupt:
            if not rows.handed:
                raise
            stopped = True
        rows.close()
    if stopped:
        raise StoppedError(path, state.k - 1, rows.handed, steps.every)


class _Handed:
    """Rows that are handed on when a stretch is full; the arrays for them are used again."""

    def __init__(self, network: Network, writer: RowWriter, after: Callable[[], After]) -> None:
        self._activity = np.empty((STRETCH, len(network.neurons)))
        self._weights = np.empty((STRETCH, len(network.changing)))
        self._writer, self._after = writer, after
        self.handed = 0

    def begin(self, count: int) -> tuple[FloatArray, FloatArray]:
        return self._activity[:count], self._weights[:count]

    def end(self, count: int) -> None:
        if count:
            with uninterrupted():
                self._writer.write(self._activity[:count], self._weights[:count], self._after())
                self.handed += count

    def close(self) -> None:
        """Hand on what is true after the last step, which may lie behind the last row."""
        with uninterrupted():
            self._writer.write(self._activity[:0], self._weights[:0], self._after())
