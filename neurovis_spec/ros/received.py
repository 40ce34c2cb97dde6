"""What arrives as a source: the newest step, and back over those that came before.

In: activities and weights, by the thread that receives them. Out: a Source for the live page, by another one. It takes
the newest step and skips the others, so that no picture holds a message up; what came is kept as far as there is room.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from threading import Lock
from typing import Final, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.clock import FRAMES
from neurovis_spec.live.futures import Futures
from neurovis_spec.live.history import Ring
from neurovis_spec.live.source import NOTHING, Capabilities, Mask, Reach, Seen, Source, SourceError
from neurovis_spec.live.turns import Turn, Turned, opposite, taken
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.runtime.rows import After
from neurovis_spec.scene.fading import Fading

#: bytes of the steps that are kept
ROOM: Final = 128 << 20
_EACH: Final = 400
#: a step that is so much further on is of another publisher
_FARTHEST: Final = 1_000_000
#: steps back in which weights look for the activities of their step
_BESIDE: Final = 16
#: steps that are lost between two that are known, in a trace
_GAP: Final = 1000
#: turns that are listed
_MOST_TURNS: Final = 999
_FRAME_TIME: Final = 10**9 // FRAMES


class Steering(Protocol):
    """What turns the network whose steps arrive; any thread may call it. ``takes`` are the turns that it takes."""

    takes: frozenset[str]

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters that can be set, as they are now."""
        ...

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """What inputs are given by hand."""
        ...

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether the rules are carried out, by their connections; None where some are."""
        ...

    @property
    def touched(self) -> tuple[Mask, Mask, Mask]:
        """Which neurons and connections are lesioned, and which neurons are clamped."""
        ...

    def turn(self, what: Turn) -> None:
        """Take a turn, from the next step on. Raises SourceError."""
        ...


@dataclass(slots=True, eq=False)
class _Row:
    """A received step: ``seq`` is its publisher's number, ``time`` when it was received in nanoseconds, ``weights`` are
    those of the plastic connections, ``seen`` what a picture shows in place of the activity (traces that fade), and
    ``shown`` whether a picture of it was made."""

    step: int
    seq: int | None
    time: int
    activity: FloatArray
    weights: FloatArray
    seen: FloatArray | None
    shown: bool = False


class ReceivedSource:
    """The steps that have arrived; at first step 0, at rest."""

    def __init__(self, network: Network, room: int = ROOM) -> None:
        self.network, self._room = network, room
        self.capabilities = Capabilities(arrives=True)
        self.body, self.futures, self.name = NOTHING, Futures(), ""
        self._steering: Steering | None = None
        self._turned: tuple[Turned, ...] = ()
        self._changing = network.changing
        #: w[0] of all connections
        self._begins = network.connections.weights.whole()
        self._weights = self._begins[self._changing]
        self._lock = Lock()
        self._rows = [_Row(0, None, 0, np.zeros(len(network.neurons)), self._weights, None, True)]
        self._each = _EACH + 8 * len(network.neurons) + 8 * len(self._changing)
        self._fading = Fading(network)
        self._unknown = np.full(len(network.neurons), np.nan), np.full(len(network.connections), np.nan)
        self.history = Ring(len(network.neurons), len(network.connections))
        self._at, self._time = self._rows[0], 0
        self._offset, self._begun, self._following = 0, False, True
        #: messages that were shown, and all that there were
        self.shown = self.came = 0

    def steer(self, steering: Steering) -> None:
        """Make it accept turns, which ``steering`` applies to the network."""
        self._steering, self.capabilities = steering, Capabilities(steering.takes, arrives=True)

    # ---- what arrives, in the thread that receives it ----------------------------------------------------------

    def hear_activity(self, seq: int | None, time: int, activity: FloatArray) -> None:
        """The activities of a step."""
        with self._lock:
            step = self._next(seq)
            known = self._weights
            seen = self._fading.follow(np.array([step]), activity[None]) if self._fading else None
            row = _Row(step, seq, time, activity, known, seen)
            if not self._begun:
                self._rows, self._begun = [], True
            else:
                self._note(self._rows[-1], step)  # whose weights have come by now
            if len(self._rows) * self._each > self._room:
                del self._rows[: max(1, len(self._rows) // 8)]
            self._rows.append(row)
            self.came += 1

    def _note(self, row: _Row, following: int) -> None:
        """Keep a step for traces, and that those up to the next one are not known."""
        self.history.note(row.step, row.activity, self._all_weights(row))
        if following - row.step <= _GAP:
            for step in range(row.step + 1, following):
                self.history.note(step, *self._unknown)

    def hear_weights(self, seq: int | None, weights: FloatArray) -> None:
        """The weights of the plastic connections at a step, whose activities may have come already."""
        with self._lock:
            if self._begun and seq is not None:
                for row in reversed(self._rows[-_BESIDE:]):
                    if row.seq == seq:
                        row.weights = weights
            elif self._begun:
                self._rows[-1].weights = weights
            self._weights = weights

    def _next(self, seq: int | None) -> int:
        """The number of the step that has come: its publisher's, as long as that grows."""
        last = self._rows[-1].step if self._begun else -1
        step = last + 1 if seq is None else seq + self._offset
        if not last < step <= last + _FARTHEST:
            if not self._begun and seq is not None and seq < 1 << 53:
                return seq
            step = last + 1
            self._offset = 0 if seq is None else step - seq
        return step

    # ---- the newest, in any thread -----------------------------------------------------------------------------

    @property
    def begun(self) -> bool:
        """Whether a step has come."""
        return self._begun

    def newest(self) -> Snapshot:
        """The newest step, wherever the source stands."""
        with self._lock:
            row = self._rows[-1]
        return self._show(row)

    # ---- the source, in the thread of the run ------------------------------------------------------------------

    @property
    def step(self) -> int:
        """The current step."""
        return self._at.step

    @property
    def reach(self) -> Reach:
        """The steps that are kept."""
        with self._lock:
            return Reach(min(self._rows[0].step, self._at.step), self._rows[-1].step)

    @property
    def turned(self) -> tuple[Turned, ...]:
        """The turns taken here."""
        return self._turned

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters that can be set, as they are now; none where the network takes no turns."""
        return {} if self._steering is None else dict(self._steering.parameters)

    @property
    def fed(self) -> dict[str, tuple[float, ...]]:
        """What inputs are given by hand."""
        return {} if self._steering is None else dict(self._steering.fed)

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether connections learn, by the reference that names them; empty where the network accepts no turns."""
        return {} if self._steering is None else self._steering.learning

    @property
    def quantities(self) -> None:
        """States of models, rules and synapses are not received."""

    @property
    def backend(self) -> str:
        """What makes the steps elsewhere is not known."""
        return ""

    def seen(self) -> Seen:
        """What a picture of the current step is made from."""
        if self._steering is not None and self._following:
            return Seen(self._show(self._at), *self._steering.touched)
        return self._untouched(self._show(self._at))

    def after(self) -> After:
        """What is true after the current step, as far as it is known; weights of all connections (m,)."""
        given = {name: value for name, value in self.parameters.items() if value != self.network.parameters[name]}
        seen, row = self.seen(), self._at
        with self._lock:
            place = bisect_right(self._rows, row.step, key=attrgetter("step"))
            following = self._rows[place] if place < len(self._rows) else row
        weights = self._all_weights(following if following.step == row.step + 1 else row)
        lesioned = np.flatnonzero(seen.lesioned_neurons), np.flatnonzero(seen.lesioned_connections)
        return After(weights, row.step + 1, given, *lesioned)

    def _untouched(self, snapshot: Snapshot) -> Seen:
        """A step without lesions and clamps, as these are not known of it."""
        neurons, connections = (np.zeros(len(of), bool) for of in (self.network.neurons, self.network.connections))
        return Seen(snapshot, neurons, connections, neurons)

    def _show(self, row: _Row) -> Snapshot:
        """What is shown of a step."""
        with self._lock:
            if not row.shown:
                row.shown = True
                self.shown += 1
        return self._snapshot(row)

    def _snapshot(self, row: _Row) -> Snapshot:
        with self._lock:
            place = bisect_left(self._rows, row.step, key=attrgetter("step"))
            before = self._rows[place - 1] if place else None
        previous = None
        if before is not None and before.step == row.step - 1:
            previous = self._all_weights(before)
        return Snapshot(row.step, row.activity, self._all_weights(row), previous, row.seen)

    def _all_weights(self, row: _Row) -> FloatArray:
        weights: FloatArray = self._begins.copy()
        weights[self._changing] = row.weights
        return weights

    def advance(self) -> bool:
        """Go on to the newest step; where it was taken back, by the time of a frame. False where nothing is new."""
        with self._lock:
            newest = self._rows[-1]
            before = self._at
            if self._following:
                self._at = newest
            elif not self._begun or before.step < self._rows[0].step:
                self._at = self._rows[0]
                self._time = self._at.time
            else:
                self._time += _FRAME_TIME
                first = bisect_left(self._rows, before.step, key=attrgetter("step"))
                place = bisect_right(self._rows, self._time, first, key=attrgetter("time"))
                self._at = self._rows[max(first, place - 1)]
                if self._at is newest:
                    self._following = True
            return self._at is not before or (not self._following and self._at is not newest)

    def number_after(self, by: int) -> int:
        """The step so many further on, or back, of those that are kept."""
        with self._lock:
            place = bisect_left(self._rows, self._at.step, key=attrgetter("step")) + by
            return self._rows[min(max(place, 0), len(self._rows) - 1)].step

    def go(self, step: int) -> None:
        """Go to a step that is kept, or the next one that is. Raises SourceError."""
        with self._lock:
            first, last = self._rows[0].step, self._rows[-1].step
            if not first <= step <= last:
                raise SourceError(f"step {step} is out of reach: those from step {first} to {last} are kept")
            self._at = self._rows[bisect_left(self._rows, step, key=attrgetter("step"))]
            self._time, self._following = self._at.time, self._at is self._rows[-1]

    def restart(self) -> None:
        """Forget what came before."""
        with self._lock:
            del self._rows[:-1]
            self._at, self._following = self._rows[-1], True

    def recall(self, steps: int) -> list[Seen]:
        """What was seen of the last steps that have come."""
        with self._lock:
            place = bisect_left(self._rows, self._at.step, key=attrgetter("step"))
            rows = self._rows[max(0, place - steps + 1) : place]
        return [*(self._untouched(self._snapshot(row)) for row in rows), self.seen()]

    def branch(self) -> None:
        """Raises SourceError: what arrives goes on by itself."""
        raise SourceError("what arrives goes on by itself")

    def switch(self, number: int, step: int | None = None) -> None:
        """Raises SourceError: there is no other future."""
        raise SourceError("what arrives goes on by itself")

    def twin(self, number: int) -> Source:
        """Raises SourceError: there is no other future."""
        raise SourceError("what arrives goes on by itself")

    def take_back(self, number: int) -> None:
        """Raises SourceError: what has arrived stays as it is; the opposite of a turn is another turn."""
        raise SourceError("what arrives goes on by itself")

    def turn(self, turn: Turn) -> None:
        """Take a turn, from the network's next step on. Raises SourceError, also where the network takes none."""
        if self._steering is None:
            raise SourceError("the network runs elsewhere: it takes no turns")
        before = self._turned
        back = opposite(turn, before, self._steering.parameters, self._steering.fed)
        self._steering.turn(turn)
        one = Turned(self.reach.last, turn, 1 + max((entry.number for entry in before), default=-1), back)
        self._turned = tuple(taken(before[-_MOST_TURNS:], one))
