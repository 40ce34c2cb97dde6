"""Recordings that are written while the network runs: some rows at a time, so that no run is too long and none is lost.

In: a Network, a path, the Course of a run. Out: a file, which is there when the run has come to its end, or when a
signal has ended it (Ctrl-C, SIGTERM, SIGHUP, SIGQUIT), with the steps until then. After anything else there is what was
there before, and a part beside it with what was recorded. A format that writes in streams says so by having ``stream``;
of the others the whole recording is saved. A stream begins with an *empty recording*: all of a recording but its rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic

from neurovis_spec.compiler.network import Network
from neurovis_spec.interrupts import Asked, Ended, deferred
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.columns import Columns, columns_of, recording_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.formats import StreamingFormat, take_over_parts
from neurovis_spec.runtime.memory import check_disk
from neurovis_spec.runtime.record import InMemory, begin_run, end_values, keep_state, record, run_steps
from neurovis_spec.runtime.recording import Recording, for_path
from neurovis_spec.runtime.rows import After, Rows, RowWriter, Steps, Widths
from neurovis_spec.runtime.spikes import SpikeLog
from neurovis_spec.runtime.state import State

#: seconds after which rows are handed on: at most this much of a run, and one step, is lost
OFTEN = 0.1


class StoppedError(Ended):
    """A signal has ended a run; what was recorded by then is in the file. ``rows`` says how many steps these are. Like
    every ``Ended`` it is a KeyboardInterrupt: a caller that does not catch it ends."""

    def __init__(self, number: int, path: Path, step: int, rows: int, steps: Steps) -> None:
        first, every = steps.at(0), steps.every
        held = f"steps {first} to {steps.at(rows - 1)}{'' if every == 1 else f', one in {every}'}"
        held = f"step {first}" if rows == 1 else held
        super().__init__(number, f"stopped at step {step}; {path} holds {held}")
        self.rows = rows


def empty_recording(network: Network, columns: Columns, state: State) -> Recording:
    """A recording of a network without a step, which begins in this state."""
    no_rows = InMemory(columns.widths(network), 0, state.k).numbers(Steps(0))
    return recording_of(network, columns, no_rows, state.weights, end_values(network, state), state.backend)


def record_to(network: Network, path: Path, course: Course, progress: Progress | None = None) -> str:
    """Run a network and write what ``record`` returns to a file. Gives the name of the backend. Raises what it and
    ``Recording.save`` raise, StoppedError after a signal, when the steps until then are in the file; KeyboardInterrupt
    where there are none, and after a second signal, which ends everything at once."""
    format_ = for_path(path)
    if not isinstance(format_, StreamingFormat):
        recording = record(network, course, progress)
        format_.save(recording, path)
        return recording.backend
    course, state = begin_run(network, course)
    steps = Steps(course.length(network), course.every, state.k)
    columns = columns_of(network, course.keep, course.body)
    empty = empty_recording(network, columns, state)
    take_over_parts(path, format_)
    check_disk(path, steps.total, steps.every, format_.size(empty, steps))
    written = False
    try:
        with deferred() as signal_asked:  # its end raises KeyboardInterrupt after a signal
            with format_.stream(path, empty, steps) as writer:
                widths, first = columns.widths(network), state.k
                rows = _BufferedRows(widths, writer, lambda: end_values(network, state), signal_asked, first)
                run_steps(network, state, course, rows, progress)
                if signal_asked and not rows.handed:
                    keep_state(state, course)
                    raise Ended(signal_asked.number)  # no step was recorded: what was there before stays
                rows.close()
            written = True
            keep_state(state, course)
    except KeyboardInterrupt:
        if not written:  # no step, or a second signal: there is no file to speak of
            raise
    if signal_asked:
        raise StoppedError(signal_asked.number, path, state.k, rows.handed, steps)
    return state.backend


class _BufferedRows:
    """A RowSink: rows go on to a writer when their arrays, which are used again, are full or some time has passed."""

    def __init__(
        self, widths: Widths, writer: RowWriter, after: Callable[[], After], signal_asked: Asked, first: int
    ) -> None:
        self._rows = Rows.lent(widths)
        self._writer, self._after, self._signal_asked = writer, after, signal_asked
        self._due = monotonic() + OFTEN
        self.fired = SpikeLog(first)
        #: how many rows the writer has
        self.handed = 0

    def begin(self, count: int) -> Rows:
        """The first rows of the arrays: what they held has been handed on."""
        return self._rows.part(slice(count))

    def end(self, count: int) -> None:
        """Hand so many rows on, with what is true after the last step made."""
        if count:
            self._write(count)
            self.handed += count
        self._due = monotonic() + OFTEN

    def due(self) -> bool:
        """When some time has passed, or the run is to end."""
        return self.over() or monotonic() >= self._due

    def over(self) -> bool:
        """After a signal."""
        return bool(self._signal_asked)

    def close(self) -> None:
        """Hand on what is true after the last step, which may lie behind the last row, and what has fired since."""
        self._write(0)

    def _write(self, count: int) -> None:
        self._writer.write(self.begin(count), replace(self._after(), fired=self.fired.take()))
