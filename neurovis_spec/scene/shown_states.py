"""Shown states: what colours neurons in place of their activity, as ``render: {show: {N: v}}`` says (Eq. 2).

In: a network, whose spec names states or outputs of models; a recording that holds these, or a run. Out: their values,
by neuron.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import ShownState
from neurovis_spec.compiler.names.state_references import StateOf
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import Probe, probe_of
from neurovis_spec.runtime.errors import RecordingError

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.simulation import Simulation

_NONE: IntArray = np.zeros(0, np.int64)


@dataclass(frozen=True, eq=False)
class ShownStates:
    """The states that neurons of a network show."""

    network: Network

    @property
    def _settings(self) -> tuple[ShownState, ...]:
        return self.network.render.show

    def __bool__(self) -> bool:
        """Whether a neuron shows any."""
        return bool(self._settings)

    @cached_property
    def neurons(self) -> IntArray:
        """The neurons (k,) that show a state, in the order of its values."""
        return np.concatenate([_NONE, *(one.indices for one in self._settings)])

    @cached_property
    def called(self) -> list[str]:
        """What each neuron (n,) shows: the name of a state, "" where it is the activity."""
        names = [""] * len(self.network.neurons)
        for one in self._settings:
            for index in one.members:
                names[index] = one.state
        return names

    @cached_property
    def probe(self) -> Probe:
        """What reads the values (k,) in a run."""
        return probe_of(self.network, (StateOf.of("neuron", one.state, one.indices) for one in self._settings))

    def columns(self, recording: Recording) -> IntArray:
        """The columns of its states in which the values are (k,). Raises RecordingError where they were not
        recorded."""
        known = {name: column for column, name in enumerate(recording.state_names)}
        names = self.probe.names if self else ()
        for name in names:
            if name not in known:
                hint = f"record it (neurovis run --states '{name}')"
                raise RecordingError(f"the recording does not hold the state '{name}', which the picture shows: {hint}")
        return np.array([known[name] for name in names], np.int64)

    def recorded(self, recording: Recording) -> FloatArray:
        """What a picture tells of neurons at all rows (rows, n): activities, and the states in their place."""
        if not self:
            return recording.activity
        return self.put(recording.activity, recording.states[:, self.columns(recording)])

    def put(self, values: FloatArray, shown: FloatArray) -> FloatArray:
        """Values of all neurons (…, n), with the states that are ``shown`` (…, k) in their place."""
        result = values.copy()
        result[..., self.neurons] = shown
        return result

    def of_run(self, run: Simulation) -> FloatArray | None:
        """``Snapshot.shown`` of the last step of a run."""
        now = run.probed(self.probe) if self else None
        return None if now is None else self.put(run.activity, now)
