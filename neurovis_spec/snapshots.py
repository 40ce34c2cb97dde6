"""Snapshots: the steps that are drawn, of a recording that is given or made for them.

In: a Network, the steps wanted, a Recording of it, or a function that runs so many steps. Out: Snapshots.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.columns import columns_of
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.recording import After, Numbers, Recording, RecordingError, Snapshot, recording_of
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene.fading import Fading, snapshots_of


def snapshot_at(
    network: Network, step: int | None, recording: Recording | None, run: Callable[[int], Recording]
) -> Snapshot:
    """The snapshot of a step, by default of the last one. Raises InputError, RecordingError."""
    if step is not None and step < 0:
        raise InputError(f"step {step}: steps count from 0")
    if recording is None:
        recording = run(network.steps if step is None else step + 1)
    recording = fitted(recording, network)
    if not len(recording):
        raise RecordingError("the recording holds no step")
    return next(iter(Snapshots(network, recording, (int(recording.step[-1]) if step is None else step,))))


@dataclass(frozen=True)
class Snapshots(Collection[Snapshot]):
    """Snapshots of ascending steps of a recording, each made when it is its turn."""

    network: Network
    recording: Recording
    steps: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[Snapshot]:
        return snapshots_of(self.network, self.recording, self.steps)

    def __contains__(self, snapshot: object) -> bool:
        return isinstance(snapshot, Snapshot) and snapshot.step in self.steps


def steps_from(network: Network, start: int, steps: int | None, recording: Recording | None) -> int:
    """How many steps ``snapshots_from`` chooses from, known before a run. Raises InputError, RecordingError."""
    if start < 0 or (steps is not None and steps < 1):
        raise InputError(f"{steps} frames from step {start}: at least one frame from step 0 on is wanted")
    if recording is None:
        return max(1, network.steps - start) if steps is None else steps
    recording = fitted(recording, network)
    rows = int((recording.step >= start).sum())
    if not rows:
        raise RecordingError(f"the recording holds no step from {start} on")
    return rows if steps is None else min(rows, steps)


def snapshots_from(network: Network, start: int, steps: int | None, recording: Recording, every: int = 1) -> Snapshots:
    """The snapshots of ``steps`` steps of a recording from ``start`` on, by default of all that follow, of one in
    ``every``; warns where there are fewer. Raises InputError, RecordingError."""
    count = steps_from(network, start, steps, recording)
    recording = fitted(recording, network)
    rows = recording.step[recording.step >= start]
    if steps is not None and len(rows) < steps:
        frames = f"{len(rows):,} frame{'' if len(rows) == 1 else 's'} instead of {steps:,}"
        warnings.warn(f"the recording holds no more than {frames} from step {start} on", stacklevel=2)
    return Snapshots(network, recording, tuple(rows[:count:every].tolist()))


def snapshots_of_run(run: Simulation, start: int, steps: int, every: int) -> Iterator[Snapshot]:
    """The same of a run that is made while they are asked for, so that there may be any number of them."""
    network = run.network
    fading, seen = Fading(network), None
    before, weights = None, run.connection_weights
    for step in range(start + steps):
        pose = run.pose
        run.step()
        if fading:
            seen = fading.follow(np.array([step]), run.activity[None])
        if step >= start and (step - start) % every == 0:
            yield Snapshot(step, run.activity, weights, before, seen, pose, run.sensed)
        before, weights = weights, run.connection_weights if len(network.changing) else weights


def in_parts(snapshots: Iterable[Snapshot], many: int) -> Iterator[list[Snapshot]]:
    """So many at a time."""
    part = list[Snapshot]()
    for snapshot in snapshots:
        part.append(snapshot)
        if len(part) == many:
            yield part
            part = []
    if part:
        yield part


def fitted(recording: Recording, network: Network) -> Recording:
    """A recording with all connections of the network: a ``.csv`` holds the changing ones alone, and the others are the
    network's. Raises RecordingError for a recording of another network: its neurons and connections are not the same.
    """
    ends, own = network.connections, recording.neurons == network.neurons.names
    if own and np.array_equal(recording.sources, ends.sources) and np.array_equal(recording.targets, ends.targets):
        return recording
    changing = tuple(network.connection_names[index] for index in network.changing.tolist())
    if own and len(recording.plastic) == len(recording.sources) and recording.connection_names == changing:
        after = After(recording.weights_after, recording.reached)
        sensors = None if recording.sensors is None else recording.sensor_names
        columns = replace(columns_of(network), sensors=sensors)
        numbers = Numbers(recording.step, recording.rows)
        return recording_of(network, columns, numbers, network.connections.weights, after)
    whose = f"{recording.network or 'unnamed'}, {len(recording.neurons)} neurons"
    raise RecordingError(f"the recording is of another network ({whose})")
