"""What a run has beside its network: inputs, sensors of the body and parameters, one number each a step, and what
episodes are told by.

In: a Network, a Simulation or a Recording of it. Out: where each of these numbers stands behind the quantities of a
step (``runtime/quantities.py``), and what they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import spiking_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation

#: ``lesioned`` are the neurons whose spikes are a state, 1 where they fire for nobody; ``ended`` is 1 at the last step
#: of an episode; ``place`` is where the middle of the body is, x and y in metres.
Kind: TypeAlias = Literal["inputs", "sensors", "parameters", "lesioned", "ended", "place"]


@dataclass(frozen=True, slots=True, eq=False)
class Before:
    """What held before a step: the values of slots, which neurons (n,) were lesioned, and where the middle of the body
    was, x and y in metres, NaN where there is none."""

    slots: FloatArray
    lesioned: BoolArray
    middle: FloatArray


@dataclass(frozen=True, eq=False)
class Beside:
    """What a run of a network has beside it, behind ``begin`` quantities."""

    network: Network
    begin: int

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """How the numbers of inputs are called."""
        each = (
            (entry.name,) if entry.size == 1 else tuple(f"{entry.name}[{at}]" for at in range(entry.size))
            for entry in self.network.inputs
        )
        return tuple(name for names in each for name in names)

    @cached_property
    def sensor_names(self) -> tuple[str, ...]:
        """How the numbers of sensors are called."""
        body = self.network.body
        return () if body is None else tuple(name for names in body.sensors.values() for name in names)

    @cached_property
    def _spiking(self) -> IntArray:
        return spiking_of(self.network).by_state

    @cached_property
    def _starts(self) -> dict[Kind, tuple[int, int]]:
        sizes: dict[Kind, int] = {
            "inputs": self.network.input_size,
            "sensors": len(self.sensor_names),
            "parameters": len(self.network.settable.slots),
            "lesioned": len(self._spiking),
            "ended": 1,
            "place": 2,
        }
        ends = np.cumsum([self.begin, *sizes.values()]).tolist()
        return {kind: (ends[at], ends[at + 1]) for at, kind in enumerate(sizes)}

    def __len__(self) -> int:
        return max(end for _, end in self._starts.values()) - self.begin

    def places(self, kind: Kind) -> IntArray:
        """Where the numbers of a kind stand among quantities and what is beside them."""
        return np.arange(*self._starts[kind])

    def lesioned(self, neurons: IntArray) -> IntArray:
        """Where it stands which of these neurons, whose spikes are a state, are lesioned."""
        return self.places("lesioned")[np.searchsorted(self._spiking, neurons)]

    def now(self, run: Simulation, before: Before) -> FloatArray:
        """What they are at the last step, (b,), in which these things held."""
        sensed = run.sensed
        if sensed is None or len(sensed) != len(self.sensor_names):
            sensed = np.full(len(self.sensor_names), np.nan)
        lesioned = before.lesioned[self._spiking].astype(np.float64)
        return np.concatenate([run.given, sensed, before.slots, lesioned, [run.ended_episode], before.middle])

    def columns(self, recording: Recording) -> tuple[IntArray, IntArray]:
        """Of each the column of the recording's states that it is, and that of its sensors, -1 where it is none."""
        states, sensors = (np.full(len(self), -1, np.int64) for _ in range(2))
        names = {name: column for column, name in enumerate(recording.state_names)}
        given = [names.get(name, -1) for name in self.network.given_names]
        states[self.places("inputs") - self.begin] = given
        if recording.sensors is not None:
            index = {name: column for column, name in enumerate(recording.sensor_names)}
            sensors[self.places("sensors") - self.begin] = [index.get(name, -1) for name in self.sensor_names]
        return states, sensors
