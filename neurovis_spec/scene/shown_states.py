"""Shown states: what colours neurons in place of their activity, as ``render: {show: {N: v}}`` says (Eq. 2).

In: a network, whose spec names states or outputs of models; a recording that holds these, or a run. Out: their values,
by neuron.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
    from neurovis_spec.runtime.recording import Recording, Snapshot
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
        return np.array([index for one in self._settings for index in one.members], np.int64)

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
        return probe_of(
            self.network, (StateOf(one.state, np.array(one.members, np.int64), _NONE) for one in self._settings)
        )

    def recorded(self, recording: Recording) -> FloatArray:
        """The values of all rows (rows, k). Raises RecordingError where they were not recorded."""
        columns = {name: column for column, name in enumerate(recording.state_names)}
        for name in self.probe.names:
            if name not in columns:
                hint = f"record it (neurovis run --states '{name}')"
                raise RecordingError(f"the recording does not hold the state '{name}', which the picture shows: {hint}")
        return recording.states[:, [columns[name] for name in self.probe.names]]

    def put(self, values: FloatArray, shown: FloatArray) -> FloatArray:
        """Values of all neurons (…, n), with the states that are ``shown`` (…, k) in their place."""
        result = values.copy()
        result[..., self.neurons] = shown
        return result

    def of_run(self, run: Simulation) -> FloatArray | None:
        """``Snapshot.shown`` of the last step of a run."""
        now = run.probed(self.probe) if self else None
        return None if now is None else self.put(run.activity, now)

    def of_row(self, recording: Recording, snapshot: Snapshot) -> Snapshot:
        """The snapshot of a step of a recording, with what it shows."""
        if not self:
            return snapshot
        now = self.recorded(recording)[recording.row(snapshot.step)]
        return replace(snapshot, shown=self.put(snapshot.activity, now))
