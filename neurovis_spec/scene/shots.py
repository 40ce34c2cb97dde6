"""Shots: which steps a picture shows: those of its frames, and those that views over time show beside them.

In: a Recording and a Look, or a run in the making. Out: Shots, as rows of the recording; snapshots, each made when it
is its turn, so that there may be any number of them.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arguments import callers_level
from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.recording import Recording, Snapshot
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene.ends import SetEnds
from neurovis_spec.scene.fading import Fading, snapshots_of
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.signals import Signals


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


@dataclass(frozen=True)
class Shots:
    """The rows of a recording that views over time show, and that of each frame."""

    recording: Recording
    rows: IntArray
    frames: IntArray

    def snapshots(self, network: Network) -> Snapshots:
        """Those of the frames."""
        return Snapshots(network, self.recording, tuple(self.recording.step[self.frames].tolist()))


def shots_of(network: Network, recording: Recording, look: Look) -> Shots:
    """The steps of a picture. Of a still views over time show at most ``window`` rows around the step, or all; of a
    film the steps between its frames, too: one in which one step in many is a frame lacks no spike. Raises
    RecordingError."""
    recording = fitted(recording, network)
    if look.moving:
        rows = np.flatnonzero(recording.step >= (look.first or 0))[: look.count]
        frames = rows[:: look.every]
        return Shots(recording, np.arange(frames[0], frames[-1] + 1), frames)
    if not len(recording):
        raise RecordingError("the recording holds no step")
    row = len(recording) - 1 if look.first is None else recording.row(look.first)
    first, last, window = 0, len(recording), look.settings.window
    if window is not None:
        first = max(0, min(row - window // 2, last - window))
        last = min(last, first + window)
    return Shots(recording, np.arange(first, last), np.array([row]))


def steps_from(network: Network, start: int, steps: int | None, recording: Recording | None) -> int:
    """How many steps a film has that is to show so many from ``start`` on, by default all that follow; known before a
    run. Warns where a recording has fewer. Raises InputError, RecordingError."""
    if start < 0 or (steps is not None and steps < 1):
        raise InputError(f"{steps} frames from step {start}: at least one frame from step 0 on is wanted")
    if recording is None:
        return max(1, network.steps - start) if steps is None else steps
    rows = int((fitted(recording, network).step >= start).sum())
    if not rows:
        raise RecordingError(f"the recording holds no step from {start} on")
    if steps is None or steps <= rows:
        return rows if steps is None else steps
    frames = f"{rows:,} frame{'' if rows == 1 else 's'} instead of {steps:,}"
    warnings.warn(f"the recording holds no more than {frames} from step {start} on", stacklevel=callers_level())
    return rows


def snapshots_of_run(run: Simulation, look: Look) -> Iterator[Snapshot]:
    """Those of the frames of a film, of a run that is made while they are asked for."""
    network, start = run.network, look.first or 0
    fading, states, signals, seen = Fading(network), ShownStates(network), Signals(network), None
    set_ends = SetEnds(network)
    signals.follow(run)
    before, weights = None, run.connection_weights
    for step in range(start + look.count):
        pose, ends = run.pose, set_ends.of_run(run)
        run.step()
        wanted = step >= start and (step - start) % look.every == 0
        sent = signals.of_run(run) if wanted or fading.sends else None
        if fading:
            seen = fading.follow(np.array([step]), run.activity[None], None if sent is None else sent[None])
        if wanted:
            shown, sent = states.of_run(run), fading.sent if fading.sends else sent
            yield Snapshot(step, run.activity, weights, before, seen, pose, run.sensed, shown, sent, ends)
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
