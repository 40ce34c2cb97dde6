"""Shots: which steps of a recording a page shows: those of its frames, and those that views over time show beside them.

In: a Recording, a step and a window, or the steps of a film. Out: Shots, as rows of the recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.recording import Recording


@dataclass(frozen=True)
class Shots:
    """The rows of a recording that views over time show, and that of each frame."""

    recording: Recording
    rows: IntArray
    frames: IntArray


def shot_of(network: Network, recording: Recording, step: int | None, window: int | None) -> Shots:
    """One step, by default the last; around it at most ``window`` rows, or all. Raises RecordingError."""
    recording = fitted(recording, network)
    if not len(recording):
        raise RecordingError("the recording holds no step")
    row = len(recording) - 1 if step is None else recording.row(step)
    first, last = 0, len(recording)
    if window is not None:
        first = max(0, min(row - window // 2, last - window))
        last = min(last, first + window)
    return Shots(recording, np.arange(first, last), np.array([row]))


def shots_of(recording: Recording, steps: Sequence[int]) -> Shots:
    """The steps of a film; views over time show those between them, too: a film in which one step in many is a frame
    lacks no spike."""
    frames = np.array([recording.row(step) for step in steps], np.int64)
    return Shots(recording, np.arange(frames[0], frames[-1] + 1), frames)
