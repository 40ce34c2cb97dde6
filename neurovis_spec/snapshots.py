"""Snapshots: the steps that are drawn, of a recording that is given or made for them.

In: a Network, the steps wanted, a Recording of it, or a function that runs so many steps. Out: Snapshots.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_spec.callers import callers_level
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.recording import Recording, Snapshot
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
        warnings.warn(f"the recording holds no more than {frames} from step {start} on", stacklevel=callers_level())
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
