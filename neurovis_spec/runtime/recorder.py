"""The recorder: what a simulation does, step by step, in memory or in a file that is written meanwhile.

In: the State before and after each step, and what was true after the last one. Out: a Recording at any time; a file
when it is closed. After an exception there is a part in its place, as after a run that broke off; Ctrl-C and
``sys.exit`` are ordinary ends of a loop.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from time import monotonic

import numpy as np

from neurovis_spec.arrays import FloatArray, subscript
from neurovis_spec.compiler.network import Network
from neurovis_spec.real_paths import real_path
from neurovis_spec.runtime.backend import ready
from neurovis_spec.runtime.columns import Numbers, columns_of, recording_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.formats import StreamingFormat, load, take_over_parts
from neurovis_spec.runtime.formed import Forming
from neurovis_spec.runtime.parts import files_beside
from neurovis_spec.runtime.recording import Recording, for_path
from neurovis_spec.runtime.rows import STRETCH, After, Rows, RowWriter, Steps
from neurovis_spec.runtime.spikes import SpikeLog
from neurovis_spec.runtime.state import State
from neurovis_spec.runtime.stream import OFTEN, empty_recording

#: more steps than are ever made
_ENDLESS = 1 << 53


class Recorder:
    """Records from a state on what a ``course`` keeps; into a file at ``path``, else in memory. ``end_values`` gives
    what is true after the last step, with the weights of all connections (m,). Raises KeyError for a name that
    there is not, RecordingError, OSError."""

    def __init__(
        self, network: Network, state: State, course: Course, path: Path | None, end_values: Callable[[], After]
    ) -> None:
        self._network, self._body, self._path, self._end_values = network, course.body, path, end_values
        self._columns = columns_of(network, course.keep, course.body)
        #: what forms the signals that are recorded, where any are, and the weights that they are formed of
        self._forming: Forming | None = None
        if self._columns.probe.forms:
            self._forming = Forming(network, ready(network, course.backend, state.backend).functions)
        self._weights = state.weights
        self._steps = Steps(_ENDLESS, course.every, state.k)
        self._changing = subscript(self._columns.weights)
        #: the state after the last step, and the row that the step going on fills, −1 for none
        self._last, self._row, self._closed = state, -1, False
        self._widths = self._columns.widths(network)
        #: room for rows and how many of it are filled; full ones, where they stay in memory
        self._spiking, self._fired = self._columns.spiking or None, SpikeLog(state.k)
        self._room, self._filled, self._before = Rows.room(self._widths, STRETCH), 0, list[Rows]()
        self._writer: RowWriter | None = None
        self._open, self._due = ExitStack(), monotonic() + OFTEN
        self._part: Path | None = None
        if path is not None:
            format_ = for_path(path)
            if isinstance(format_, StreamingFormat):
                self._stream(format_, path)

    def _stream(self, format_: StreamingFormat, path: Path) -> None:
        """Begin the file. Its part, which can be read meanwhile, is what is new beside it."""
        take_over_parts(path, format_)
        target = real_path(path)
        parts_before = set(files_beside(target, "part"))
        frame = empty_recording(self._network, self._columns, self._last)
        self._writer = self._open.enter_context(format_.stream(path, frame, self._steps))
        self._part = next(iter(set(files_beside(target, "part")) - parts_before), None)

    @property
    def going(self) -> bool:
        """Whether it is not closed yet."""
        return not self._closed

    def begin(self, state: State) -> None:
        """Before a step, when its inputs are known."""
        self._row = -1
        if state.k % self._steps.every:
            return
        if self._filled == STRETCH:
            self._hand_on()
        self._row = self._filled
        if self._changing is not None:
            self._room.weights[self._row] = state.weights[self._changing]
        if self._forming is not None:
            self._weights = state.weights.copy()
        if self._body is not None:
            self._body.show(self._room.sensors[self._row], self._room.pose[self._row])

    def end(self, state: State, inputs: FloatArray) -> None:
        """After a step, which was given these ``inputs``."""
        self._last = state
        if self._spiking is not None:
            self._fired.put(state.k - 1, self._spiking.now(state))
        if self._row >= 0:
            recorded = self._columns.neurons
            self._room.activity[self._row] = state.activity if recorded is None else state.activity[recorded]
            if self._columns.probe.names:
                signals = None if self._forming is None else self._forming.signals(state, self._weights)
                self._columns.probe.read(state, self._room.states[self._row], signals)
            self._room.states[self._row, len(self._columns.probe.names) :] = inputs[self._columns.given]
            self._filled += 1
        if self._writer is not None and monotonic() >= self._due:
            self._hand_on()

    def _hand_on(self) -> None:
        """Give the rows to the file, or put them to those before."""
        rows = self._room.part(slice(self._filled))
        if self._writer is not None:
            self._writer.write(rows, replace(self._after(self._end_values()), fired=self._fired.take()))
            self._due = monotonic() + OFTEN
        elif self._filled:
            self._before.append(rows)
            self._room = Rows.room(self._widths, STRETCH)
        self._filled = 0

    def recording(self) -> Recording:
        """What was recorded so far; of a file what this holds. Raises RecordingError where it was removed."""
        if self._writer is None:
            return self._in_memory()
        assert self._path is not None
        if self._closed:
            return load(self._path)
        self._hand_on()
        if self._part is None:
            raise RecordingError(f"{self._path} cannot be read while it is written")
        return load(self._part)

    def _in_memory(self) -> Recording:
        """The rows so far as a recording."""
        parts = [*self._before, self._room.part(slice(self._filled))]
        rows = Rows(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
        count = len(rows.activity)
        step = np.array([self._steps.at(row) for row in range(count)], dtype=np.int64)
        end_values, backend = self._end_values(), self._last.backend
        return recording_of(
            self._network,
            self._columns,
            Numbers(step, rows, self._fired.all),
            end_values.weights,
            self._after(end_values),
            backend,
        )

    def _after(self, end_values: After) -> After:
        """The same with the weights of those connections alone that can change."""
        return replace(end_values, weights=end_values.weights[self._network.changing])

    def close(self, error: BaseException | None = None) -> None:
        """End the recording, as that of a run that broke off where there is an ``error``, an Exception. Raises what
        ``Recording.save`` raises."""
        if self._closed:
            return
        self._closed = True
        broken = isinstance(error, Exception)
        if self._writer is not None:
            self._hand_on()
            found = error if broken else None
            self._open.__exit__(None if found is None else type(found), found, None)
        elif self._path is not None and not broken:
            for_path(self._path).save(self._in_memory(), self._path)
