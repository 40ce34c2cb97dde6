"""A recording as a source: its steps, forward and back, as they were recorded.

In: a Network and a Recording of it. Out: a Source in which nothing can be set, clamped or lesioned by hand. What is
lesioned is what the spec's events say.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import SPIKE
from neurovis_spec.live.beside import Beside
from neurovis_spec.live.futures import Futures
from neurovis_spec.live.history import Recorded
from neurovis_spec.live.source import Capabilities, Reach, Seen, Source, SourceError, drawn, recalled
from neurovis_spec.live.turns import Turn, Turned
from neurovis_spec.runtime.columns import columns_of
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.quantities import Quantities
from neurovis_spec.runtime.record import end_values
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.rows import After
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.scene.fading import snapshots_of
from neurovis_spec.scene.shown_states import ShownStates


class RecordedSource:
    """The steps of a recording; it stands at the first. Raises RecordingError for one of another network, a partial or
    an empty one."""

    capabilities = Capabilities(ends=True)
    futures = Futures()
    name = ""

    def __init__(self, network: Network, recording: Recording) -> None:
        self.network, self._recording = network, fitted(recording, network)
        self._recording.check_whole("a live view cannot show")
        if not len(recording):
            raise RecordingError("the recording holds no step")
        first = None if recording.pose is None else recording.pose[0]
        self.body = drawn(recording.skeleton, recording.sensor_names, first)
        self._steps: list[int] = recording.step.tolist()
        self._row = 0
        #: the columns of the states that outputs name; None where the recording has not all of them
        names = columns_of(network).probe.names
        known = {name: column for column, name in enumerate(recording.state_names)}
        self._states = [known[name] for name in names] if names and known.keys() >= set(names) else None
        self._controls, self._state, self._applied = Controls(network), initial_state(network), 0
        told = self._recording.spiking
        every = Quantities(network)
        names = every.names if known or told is not None else ()
        beside, self._sensors = Beside(network, len(every)).columns(self._recording)
        self._columns = np.concatenate([np.full(len(every), -1, np.int64), beside])
        self._columns[: len(names)] = [known.get(name, -1) for name in names]
        self._sensors = np.concatenate([np.full(len(every), -1, np.int64), self._sensors])
        spikes = {f"{network.neurons.names[index]}.{SPIKE}": index for index in ([] if told is None else told.tolist())}
        self._spiking = np.full(len(self._columns), -1, np.int64)
        self._spiking[: len(names)] = [spikes.get(name, -1) for name in names]
        shown = ShownStates(network).recorded(self._recording)
        self.history = Recorded(self._recording, shown, self._columns, self._spiking, self._sensors)

    @property
    def step(self) -> int:
        """The current step."""
        return self._steps[self._row]

    @property
    def reach(self) -> Reach:
        """The first and the last step."""
        return Reach(self._steps[0], self._steps[-1])

    @property
    def turned(self) -> tuple[Turned, ...]:
        """Nothing was changed by hand."""
        return ()

    @property
    def parameters(self) -> dict[str, float]:
        """Nothing can be set."""
        return {}

    @property
    def fed(self) -> dict[str, tuple[float, ...]]:
        """No input is given by hand."""
        return {}

    @property
    def learning(self) -> dict[str, bool | None]:
        """No rule can be stopped."""
        return {}

    @property
    def quantities(self) -> FloatArray | None:
        """Those of the current step, NaN where the recording does not hold one."""
        recording = self._recording
        now = recording.spike_neurons[recording.spike_steps == self.step]
        spikes = np.where(self._spiking < 0, np.nan, np.isin(self._spiking, now))
        states = recording.states[self._row]
        found = np.where(self._columns < 0, spikes, states[self._columns] if len(states) else np.nan)
        if recording.sensors is None:
            return found
        return np.where(self._sensors < 0, found, recording.sensors[self._row, self._sensors])

    @property
    def backend(self) -> str:
        """The name of the backend that made its steps, "" where that is not known."""
        return self._recording.backend

    def seen(self) -> Seen:
        """What a picture of the current step is made from."""
        (snapshot,) = snapshots_of(self.network, self._recording, [self.step])
        now = self._by_events().conditions
        states = None if self._states is None else self._recording.states[self._row, self._states]
        lesioned = now.lesioned_neurons.copy(), now.structure.cut.copy()
        return Seen(snapshot, *lesioned, now.held.order[: len(self.network.neurons)] >= 0, states)

    def after(self) -> After:
        """What is true after the current step, as far as the rows and the spec's events tell; weights of all
        connections (m,)."""
        recording, row, steps = self._recording, self._row, self._steps
        weights, state = recording.all_weights(row), self._by_events()
        if row == len(steps) - 1:
            weights[recording.plastic] = recording.weights_after
            lesioned = recording.lesioned_neurons, recording.lesioned_connections
            return After(weights, recording.reached, recording.set_parameters, *lesioned)
        if steps[row + 1] == steps[row] + 1:
            learn = self.network.connections.rules.whole() >= 0
            weights[learn] = recording.all_weights(row + 1)[learn]
        found = end_values(self.network, state)
        events = {slot for change in self.network.changes for slot, _ in change.parameters}
        slots = self.network.settable.index
        before = {name: value for name, value in recording.set_parameters.items() if slots.get(name) not in events}
        return replace(
            found,
            weights=weights,
            reached=recording.reached - (steps[-1] - steps[row]),
            set_parameters={**found.set_parameters, **before},
        )

    def _by_events(self) -> State:
        """What events have changed by the current step; what was done by hand is no part of a recording."""
        if self._applied and self.network.changes[self._applied - 1].at > self.step:
            self._state, self._applied = initial_state(self.network), 0
        for change in self.network.changes[self._applied :]:
            if change.at > self.step:
                break
            self._state.k = change.at
            with np.errstate(all="ignore"):
                self._controls.apply(self._state, change)
            self._applied += 1
        return self._state

    def advance(self) -> bool:
        """Go on by one row; False at the end."""
        if self._row == len(self._steps) - 1:
            return False
        self._row += 1
        return True

    def number_after(self, by: int) -> int:
        """The step so many rows further on, or back."""
        return self._steps[min(max(self._row + by, 0), len(self._steps) - 1)]

    def go(self, step: int) -> None:
        """Go to a step, or the next one that was recorded. Raises SourceError."""
        if not self._steps[0] <= step <= self._steps[-1]:
            raise SourceError(
                f"step {step} is not in the recording, which goes from {self._steps[0]} to {self._steps[-1]}"
            )
        self._row = bisect_left(self._steps, step)

    def restart(self) -> None:
        """Back to its first step."""
        self._row = 0

    def recall(self, steps: int) -> list[Seen]:
        """What was seen of the last steps."""
        return recalled(self, steps)

    def branch(self) -> None:
        """Raises SourceError: a recording stays as it is."""
        raise SourceError("a recording cannot go on differently: run the spec")

    def switch(self, number: int, step: int | None = None) -> None:
        """Raises SourceError: there is no other future."""
        raise SourceError("a recording has no other future: run the spec")

    def twin(self, number: int) -> Source:
        """Raises SourceError: there is no other future."""
        raise SourceError("a recording has no other future: run the spec")

    def take_back(self, number: int) -> None:
        """Raises SourceError: nothing was turned."""
        raise SourceError("a recording cannot be changed: run the spec")

    def turn(self, turn: Turn) -> None:
        """Raises SourceError: a recording stays as it is."""
        raise SourceError("a recording cannot be changed: run the spec")
