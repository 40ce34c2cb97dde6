"""Running and recording: many steps in one loop, into arrays taken beforehand.

In: a Network, inputs, a number of steps. Out: a Recording of steps 0 … steps − 1, or of every K-th of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.backend import Backend, prepare
from neurovis_spec.runtime.inputs import STRETCH, InputReader
from neurovis_spec.runtime.memory import check_room
from neurovis_spec.runtime.phases import go_over, segments
from neurovis_spec.runtime.recording import Recording, recording_of
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.state import initial_state
from neurovis_spec.runtime.watch import Watch


def record(
    network: Network,
    steps: int | None = None,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    backend: str | Backend | None = None,
    every: int = 1,
    start: Recording | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Run a network for ``steps`` steps (by default ``time.steps``) and record steps 0, ``every``, 2·``every``, …

    ``inputs`` as in ``InputReader``; ``start`` as in ``resume``. Warns once (RuntimeWarning) when something is no
    longer finite. Raises InputError, BackendError, RecordingError (also where there is not the memory), ValueError.
    """
    steps = network.steps if steps is None else steps
    if steps < 0 or every < 1:
        raise ValueError(f"{steps} steps, every {every}: at least 0 and at least 1 are needed")
    check_room(steps, every, len(network.neurons) + len(network.changing))
    watch = Watch(network)
    state = initial_state(network) if start is None else resumed_state(network, start)
    kept = np.arange(0, steps, every, dtype=np.int64)
    activity = np.empty((len(kept), len(network.neurons)))
    weights = np.empty((len(kept), len(network.changing)))
    changing = _subscript(network.changing)
    look, row, before = watch.look, 0, network
    with np.errstate(all="ignore"):
        for phase, begin, end in segments(network, steps):
            step, reader = prepare(phase, backend).step, InputReader(phase, inputs)
            go_over(state, before, phase)
            before = phase
            for first, stop in _stretches(begin, end):
                for k, vector in enumerate(reader.rows(first, stop), first):
                    keep = k % every == 0
                    if keep and changing is not None:
                        weights[row] = state.weights[changing]
                    step(state, vector)
                    look(state)
                    if keep:
                        activity[row] = state.activity
                        row += 1
                if progress is not None:
                    progress(stop, steps)
    return recording_of(network, kept, activity, weights, state.weights)


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
