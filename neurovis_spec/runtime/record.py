"""Running and recording: many steps in one loop, into arrays taken beforehand.

In: a Network and the Course of a run. Out: a Recording of its steps, or of every K-th of them. ``run_steps`` hands the
rows on to a RowSink while it runs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from time import monotonic
from typing import Final, NamedTuple, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray, subscript
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.events.changes import Change
from neurovis_spec.compiler.events.patch import PatchError
from neurovis_spec.compiler.network import Network
from neurovis_spec.interrupts import Asked, deferred
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.backend import Noting, Probing, Runner, Stepper, ready
from neurovis_spec.runtime.checkpoint import load_state, save_state
from neurovis_spec.runtime.columns import Columns, Numbers, Spiking, columns_of, recording_of
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import Embodied
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.formed import Forming
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.memory import check_room
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.resume import learned_state, resumed_state
from neurovis_spec.runtime.rows import STRETCH, After, Rows, RowSink, Steps, Widths
from neurovis_spec.runtime.spikes import Fired, SpikeLog
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.runtime.until import Watched
from neurovis_spec.runtime.watch import Watch

#: A run as long as the spec says, of which everything is kept.
AS_IT_IS = Course()

#: seconds that a block of steps takes, behind which it is asked whether the run is to end
_BLOCK: Final = 0.1
#: neurons and connections times steps of the first block, and its steps at most: how long one takes is not known yet
_FIRST_SIZE, _FIRST_STEPS = 1 << 20, 1 << 12
#: numbers of rows that are looked at for spikes alone, where that is more than a stretch
_MOST_SEEN: Final = 1 << 21
#: how many times as long as the one before a block is at most
_GROWTH: Final = 16


def record(network: Network, course: Course = AS_IT_IS, progress: Progress | None = None) -> Recording:
    """Run a network and record steps 0, ``every``, 2·``every``, … of its course.

    After a signal the checkpoint of the course holds the state at which the run ended (then KeyboardInterrupt is
    raised). Warns once (RuntimeWarning) when something is no longer finite. Raises InputError, BackendError,
    RecordingError (also where there is not the memory), BodyError, KeyError for a name that there is not.
    """
    course, state = begin_run(network, course)
    columns = columns_of(network, course.keep, course.body)
    steps, widths = Steps(course.length(network), course.every, state.k), columns.widths(network)
    if not course.keep.last:
        check_room(steps.total, steps.every, sum(widths))
    rows: InMemory | Last = Last(widths) if course.keep.last else InMemory(widths, len(steps), state.k)
    if course.checkpoint is None:
        run_steps(network, state, course, rows, progress)
    else:
        with deferred() as rows.asked:
            run_steps(network, state, course, rows, progress)
            keep_state(state, course)
    return recording_of(network, columns, rows.numbers(steps), state.weights, end_values(network, state), state.backend)


def begin_run(network: Network, course: Course) -> tuple[Course, State]:
    """The course with its body opened and its backend made ready, and the state that the run begins in: that of a
    checkpoint, if there is one, after a recording, or the first. What goes on goes on with its backend. Raises
    RecordingError, BackendError, BodyError where a checkpoint is wanted and the body cannot be kept."""
    course = course.embodied(network)
    state = _checkpoint_state(network, course)
    before = state or course.start
    backend = ready(network, course.backend, "" if before is None else before.backend)
    if state is None and course.start is not None:
        resumed = learned_state if course.weights_alone else resumed_state
        state = resumed(network, course.start, backend.functions)
    state = state or initial_state(network)
    backend.take(state)
    return replace(course, backend=backend), state


def _checkpoint_state(network: Network, course: Course) -> State | None:
    """The state in the checkpoint of a course, None where there is none yet. Raises RecordingError, BodyError."""
    checkpoint = course.checkpoint
    if checkpoint is None:
        return None
    if course.body is not None:
        course.body.check_kept()
    if not checkpoint.exists():
        return None
    if course.start is not None:
        raise RecordingError(f"{checkpoint} is there: go on from a checkpoint or from a recording, not from both")
    return load_state(network, checkpoint)


def keep_state(state: State, course: Course) -> None:
    """Write the state at the end of a run to the checkpoint of its course, if it has one. Raises OSError."""
    if course.checkpoint is not None:
        if course.body is not None:
            course.body.put(state)
        save_state(state, course.checkpoint)


def end_values(network: Network, state: State) -> After:
    """What is true after the last step of a run, as its state says."""
    now, slots = state.conditions, network.settable
    set_parameters = {
        name: float(now.parameters[slots.index[name]])
        for name in network.parameters
        if now.was_set[slots.index[name]] or slots.slots[slots.index[name]].given
    }
    return After(
        weights=state.weights[network.changing],
        reached=state.drawn + state.k,
        set_parameters=set_parameters,
        lesioned_neurons=np.flatnonzero(now.lesioned_neurons),
        lesioned_connections=np.flatnonzero(now.lesioned_connections),
    )


class InMemory:
    """All rows in arrays of these widths, and the spikes from step ``first`` on."""

    def __init__(self, widths: Widths, rows: int, first: int = 0) -> None:
        self._rows = Rows.room(widths, rows)
        self._filled = 0
        self.fired = SpikeLog(first)
        self.asked: Asked | None = None

    def numbers(self, steps: Steps) -> Numbers:
        """All that has come, for the first of these steps."""
        filled = slice(self._filled)
        numbers = np.concatenate([np.zeros(0, dtype=np.int64), *steps.parts()])
        return Numbers(numbers[filled], self._rows.part(filled), self.fired.all)

    def begin(self, count: int) -> Rows:
        """The next rows of the arrays."""
        return self._rows.part(slice(self._filled, self._filled + count))

    def end(self, count: int) -> None:
        """So many are filled."""
        self._filled += count

    def due(self) -> bool:
        """Whether the rows are to be handed on now: only when the run is to end, as nothing reads them before."""
        return self.over()

    def over(self) -> bool:
        """After a signal, where somebody listens."""
        return bool(self.asked)


class Last:
    """The last row alone, of rows of these widths, and no spikes: memory does not grow with the steps."""

    fired = None

    def __init__(self, widths: Widths) -> None:
        self._widths, self._count = widths, 0
        self._rows = self._last = Rows.room(widths, 0)
        self.asked: Asked | None = None

    def numbers(self, steps: Steps) -> Numbers:
        """The last that has come, for one of these steps."""
        number = [steps.at(self._count - 1)] if self._count else []
        return Numbers(np.array(number, dtype=np.int64), self._last)

    def begin(self, count: int) -> Rows:
        """Room for the next rows."""
        self._rows = Rows.room(self._widths, count)
        return self._rows

    def end(self, count: int) -> None:
        """So many are filled."""
        if count:
            last = self._rows.part(slice(count - 1, count))
            self._last, self._count = Rows(*(array.copy() for array in last)), self._count + count

    def due(self) -> bool:
        """Only where the run is to end."""
        return self.over()

    def over(self) -> bool:
        """After a signal, where somebody listens."""
        return bool(self.asked)


def run_steps(network: Network, state: State, course: Course, rows: RowSink, progress: Progress | None = None) -> None:
    """Run a network from a state, and hand on the rows that are kept. Its body (``Course.embodied``) is taken to where
    the state says, and left where the run ends."""
    steps, body = course.length(network), course.body
    assert (body is None) == (network.body is None)
    if body is not None:
        body.take(state)
    watched = None if course.until is None else course.until.watch(rows, state, steps, body)
    rows = rows if watched is None else watched
    watch = Watch(network)
    columns = columns_of(network, course.keep, body)
    backend = ready(network, course.backend)
    reader, stepper = InputReader(network, course.inputs, watch.take_inputs, backend.functions), backend.stepper
    hands = _Hands(course.every, rows, reader, watch)
    forming = Forming(network, backend.functions) if columns.probe.forms else None
    make: _Make = _OneByOne(hands, columns, stepper, body, frozenset(course.inputs or ()), forming)
    pace = _Pace(STRETCH, STRETCH)
    spiking = columns.spiking if columns.spiking and rows.fired is not None else None
    if (
        isinstance(stepper, Runner)
        and _given_together(stepper, columns, network, spiking)
        and body is None
        and (course.until is None or course.until.measure.together)
    ):
        reader.leave(stepper)
        make = _Together(hands, stepper, columns, spiking, watched)
        size = len(network.neurons) + len(network.connections) + 1
        pace = _Pace(max(1, min(_FIRST_STEPS, _FIRST_SIZE // size)), None if watched is None else STRETCH)
    controls, origin, last = Controls(network, backend.functions), state.k, state.k + steps
    changes = [change for change in network.changes if origin <= change.at < last]
    _check_events(controls, state, changes)
    # events change something between two of these steps, never within
    edges = [origin, *(change.at for change in changes if change.at > origin), last]
    with np.errstate(all="ignore"):
        for begin, end in pairwise(edges):
            controls.begin(state)
            controls.rewind(state)
            reader.use(state)
            first = begin
            while first < end:
                stop = pace.stop(first, end)
                if rows.over() or not make.steps(state, first, stop):
                    return
                pace.made()
                if progress is not None:
                    progress(stop - origin, steps)
                first = stop


def _given_together(stepper: Stepper, columns: Columns, network: Network, spiking: Spiking | None) -> bool:
    """Whether a runner gives what is recorded: the activities of all neurons and all changing weights, or none of
    these; states, spikes that are one, and signals of synapses only where it is a probing one."""
    plain = columns.neurons is None and len(columns.weights) in (0, len(network.changing))
    probed = len(columns.probe.names) > 0 or (spiking is not None and len(spiking.by_state) > 0)
    return plain and (isinstance(stepper, Probing) or not probed)


class _Hands(NamedTuple):
    """What the steps of a run take from and give to: one row in ``every`` steps, inputs, and who looks at numbers."""

    every: int
    rows: RowSink
    reader: InputReader
    watch: Watch


class _Pace:
    """How many steps of a run are a block: ``first`` of the first one, then as many as take ``_BLOCK`` seconds by how
    long those before have taken, ``most`` at most. No number of a run depends on it. With ``most``, blocks end where
    stretches of so many steps do."""

    def __init__(self, first: int, most: int | None) -> None:
        self._count, self._most = first, most
        self._begun, self._going = 0.0, 0

    def stop(self, first: int, end: int) -> int:
        """Where a block ends that begins with this step now, ``end`` at most."""
        stop = min(first + self._count, end)
        if self._most is not None:
            stop = min(stop, first - first % self._most + self._most)
        self._begun, self._going = monotonic(), stop - first
        return stop

    def made(self) -> None:
        """The block is made."""
        fitting = _BLOCK / max(monotonic() - self._begun, 1e-6) * self._going
        self._count = max(1, min(int(fitting), _GROWTH * self._count))


class _Make(Protocol):
    """A way to make the steps of a block."""

    def steps(self, state: State, first: int, stop: int) -> bool:
        """Make the steps from ``first`` to ``stop``; False where the rows say that the run is over."""
        ...


@dataclass(frozen=True)
class _OneByOne:
    """Each step by a call."""

    hands: _Hands
    columns: Columns
    stepper: Stepper
    body: Embodied | None = None
    #: the inputs that are given, and not sensed
    given: frozenset[str] = frozenset()
    #: what forms the signals that are recorded, where any are
    forming: Forming | None = None

    def steps(self, state: State, first: int, stop: int) -> bool:
        every, rows, reader, watch = self.hands
        step, check, due, columns = self.stepper.step, watch.check, rows.due, self.columns
        changing, recorded = subscript(columns.weights), columns.neurons
        probe, forming = columns.probe if columns.probe.names else None, self.forming
        fired = rows.fired if columns.spiking else None
        before = np.zeros(0)
        rows_left = _rows_between(first, stop, every)
        activity, weights, states, sensors, poses = rows.begin(rows_left)
        row, body = 0, self.body
        for k, vector in enumerate(reader.rows(first, stop), first):
            keep = k % every == 0
            if keep and changing is not None:
                weights[row] = state.weights[changing]
            if keep and forming is not None:
                before = state.weights.copy()
            if body is not None:
                vector = body.sense(vector, self.given | reader.fed)
                watch.take_inputs_at(k, vector, body.inputs)
                if keep:
                    body.show(sensors[row], poses[row])
            step(state, vector)
            check(state)
            if fired is not None and columns.spiking is not None:
                fired.put(k, columns.spiking.now(state))
            if keep:
                activity[row] = state.activity if recorded is None else state.activity[recorded]
                if probe is not None:
                    probe.read(state, states[row], None if forming is None else forming.signals(state, before))
                if len(columns.given):
                    states[row, len(columns.probe.names) :] = vector[columns.given]
                row += 1
            if body is not None:
                try:
                    body.move(state)
                except BodyError:
                    rows.end(row)  # what was recorded until then
                    raise
            if due():
                rows.end(row)
                if rows.over():
                    return False
                rows_left -= row
                activity, weights, states, sensors, poses = rows.begin(rows_left)
                row = 0
        rows.end(row)
        return True


@dataclass(frozen=True)
class _Together:
    """Many steps by a call. What may end the run between them (``watched``) is asked behind them: where it ends before
    the last of them, the state of before is taken, and the steps up to there are made again."""

    hands: _Hands
    runner: Runner
    #: what is kept; no states where the runner is not a probing one
    columns: Columns
    #: whose spikes are noted, None where nobody spikes
    spiking: Spiking | None = None
    watched: Watched | None = None
    #: the last rows that were made for every step: new ones cost as much as what is put there
    _seen: list[Rows] = field(default_factory=list)

    def steps(self, state: State, first: int, stop: int) -> bool:
        every, rows = self.hands.every, self.hands.rows
        k = first
        while k < stop:
            room = rows.begin(_rows_between(k, stop, every))
            # as far as there is room for rows
            until = min(stop, -(-k // every) * every + len(room.activity) * every) if len(room.activity) else stop
            made = self._fill(state, k, until, room)
            rows.end(_rows_between(k, made, every))
            k = made
            if rows.over():
                return False
        return True

    def _fill(self, state: State, first: int, stop: int, room: Rows) -> int:
        """Make steps, until rows are to be handed on at the latest. Gives the step behind them."""
        every, rows, reader, watch = self.hands
        row, k, own = 0, first, room
        if len(self.columns.given):  # what is given stands beside the states, which a runner fills alone
            own = room._replace(states=np.empty((len(room.states), len(self.columns.probe.names))))
        for part in reader.parts(first, stop):
            begin = k
            while k < begin + len(part):
                until = min(watch.next_stop(k, begin + len(part)), k + self._most(every, room))
                vectors = part[k - begin : until - begin]
                made = self._run(state, vectors, own.part(slice(row, None)), every, not watch.warned)
                if own is not room:
                    self._put(vectors[-k % every : made : every], own, room, row)
                row += _rows_between(k, k + made, every)
                k += made
                if reader.left and not watch.warned:
                    watch.take_inputs_at(k - 1, vectors[made - 1], ())
                watch.check(state)
                if rows.due() if self.watched is None else self.watched.asked():
                    return k
        return k

    def _put(self, vectors: FloatArray, own: Rows, room: Rows, row: int) -> None:
        """Put the states of some rows, and what was given in their steps, where they are kept, from a ``row`` on."""
        rows, states = slice(row, row + len(vectors)), len(self.columns.probe.names)
        room.states[rows, :states] = own.states[rows]
        room.states[rows, states:] = vectors[:, self.columns.given]

    def _run(self, state: State, vectors: FloatArray, room: Rows, every: int, look: bool) -> int:
        """Steps, as the runner makes them, or fewer where the run is to end before."""
        if self._by_runner is not None or (self.watched is None and self.spiking is None):
            return self._noted(state, vectors, room, every, look)
        first, before = state.k, None if self.watched is None else state.copy()
        # the measure and spikes are of every step, the recording of one in ``every``
        seen = room if self._kept(every) else self._room_for(len(vectors), room)
        made = count = self._made(state, vectors, seen, 1, look)
        if self.watched is not None:
            count = self.watched.made(seen.activity[:made])
        if seen is not room:
            kept = slice(-first % every, count, every)
            wanted = _rows_between(first, first + count, every)
            for own, all_ in zip(room, seen, strict=True):
                own[:wanted] = all_[kept, : own.shape[1]]
        fired = self.hands.rows.fired
        if self.spiking is not None and fired is not None:
            activity = seen.activity[:count, self.spiking.activities]
            beside, lesioned = seen.states[:count, room.states.shape[1] :], state.conditions.lesioned_neurons
            fired.extend(self.spiking.of_rows(first, activity, beside, lesioned))
        if before is not None and count < made:  # too far: back to before, and up to the step that ends the run
            state.become(before)
            self._made(state, vectors[:count], seen, 1, False)
        return count

    @cached_property
    def _by_runner(self) -> range | None:
        """The neurons whose spikes the runner notes, where it can, and nothing else looks at each step; else None."""
        if self.spiking is None or self.watched is not None or not isinstance(self.runner, Noting):
            return None
        return self.spiking.together

    def _noted(self, state: State, vectors: FloatArray, room: Rows, every: int, look: bool) -> int:
        """Steps, and the spikes that the runner has noted."""
        first, fired, neurons = state.k, self.hands.rows.fired, self._by_runner
        if neurons is None or fired is None or not isinstance(self.runner, Noting):
            return self._made(state, vectors, room, every, look)
        self.runner.note(neurons)
        made = self._made(state, vectors, room, every, look)
        steps, which = self.runner.fired(made)
        fired.extend(Fired(steps + first, which + neurons.start, first, first + made))
        return made

    def _kept(self, every: int) -> bool:
        """Whether the rows that are kept are all that has to be seen."""
        return every == 1 and (self.spiking is None or not len(self.spiking.by_state))

    def _room_for(self, count: int, room: Rows) -> Rows:
        """Rows for every step, with the states that tell of spikes behind those that are kept."""
        if not self._seen or len(self._seen[0].activity) < count:
            more = 0 if self.spiking is None else len(self.spiking.by_state)
            states = np.empty((count, room.states.shape[1] + more))
            self._seen[:] = [Rows(*(np.empty((count, array.shape[1])) for array in room))._replace(states=states)]
        return self._seen[0].part(slice(count))

    def _most(self, every: int, room: Rows) -> int:
        """The most steps to be seen at once: where spikes are looked for in rows that are not kept, as many as there
        is always room for."""
        if self.spiking is None or self._kept(every) or self._by_runner is not None:
            return sys.maxsize
        width: int = sum(array.shape[1] for array in room) + len(self.spiking.by_state)
        return max(STRETCH, _MOST_SEEN // max(1, width))

    def _made(self, state: State, vectors: FloatArray, room: Rows, every: int, look: bool) -> int:
        probe = self.columns.probe
        if self.spiking is not None and room.states.shape[1] > len(probe.names):
            probe = probe.beside(self.spiking.probe)
        if probe.names and isinstance(self.runner, Probing):
            self.runner.probe(probe, room.states)
        return self.runner.run(state, vectors, room.activity, room.weights, every, look)


def _rows_between(first: int, stop: int, every: int) -> int:
    """How many of the steps from ``first`` to ``stop`` are recorded."""
    return (stop - 1) // every - (first - 1) // every


def _check_events(controls: Controls, state: State, changes: Sequence[Change]) -> None:
    """Refuse events that could not set what they say, now that a recording has set parameters before them; the compiler
    has tried them from the beginning. Raises RecordingError."""
    if not state.conditions.was_set.any():
        return
    now, weights = state.conditions.copy(), state.weights.copy()
    with np.errstate(all="ignore"):
        for change in changes:
            try:
                controls.set_parameters(now, weights, change)
            except PatchError as error:
                message = f"the parameters of the recording do not fit the events: from step {change.at} on {error}"
                raise RecordingError(message) from None
