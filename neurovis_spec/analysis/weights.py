"""Weights and how they change over time (Figs. 4C and 7).

In: a Recording. Out: the weights that can change, step by step; what became of each; how much each changes at a step.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.analysis.excerpt import cut
from neurovis_spec.analysis.named import Axis, NamedArray
from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.recording import Recording, RecordingError

QUANTITIES = ("first", "last", "change", "travelled", "largest update", "at step")


def weights(recording: Recording, start: int | None = None, stop: int | None = None) -> NamedArray:
    """w[t] of each connection that can change, a row a step."""
    part = _with_weights(recording, start, stop)
    return NamedArray("weights", part.weights, _steps(part), _connections(part))


def updates(recording: Recording, start: int | None = None, stop: int | None = None) -> NamedArray:
    """w[t+1] − w[t] of each connection that can change, for each step but the last (where only every K-th step was
    recorded, the sum of K updates)."""
    part = _with_weights(recording, start, stop)
    rows = Axis("step", _steps(part).labels[:-1])
    return NamedArray("updates", _differences(part), rows, _connections(part))


def weight_changes(recording: Recording, start: int | None = None, stop: int | None = None) -> NamedArray:
    """A row for each connection that can change: its ``first`` and ``last`` weight, the ``change`` between them, the
    way that it has ``travelled`` (the sum of all |Δw|), its ``largest update`` and the step of that, NaN where it never
    changes."""
    part = _with_weights(recording, start, stop)
    with np.errstate(all="ignore"):
        each = _differences(part)
        size = np.nan_to_num(np.abs(each), nan=-1.0)
        count = part.weights.shape[1]
        if len(each):
            best = size.argmax(axis=0)
            largest = each[best, np.arange(count)]
            at = np.where(largest == 0, np.nan, part.step[best].astype(np.float64))
        else:
            largest, at = np.zeros(count), np.full(count, np.nan)
        first, last = part.weights[0], part.weights[-1]
        values = np.stack([first, last, last - first, np.abs(each).sum(axis=0), largest, at], axis=1)
    return NamedArray("weight changes", values, _connections(part), Axis("quantity", QUANTITIES))


def _with_weights(recording: Recording, start: int | None, stop: int | None) -> Recording:
    part = cut(recording, start, stop)
    if part.weights.shape[1] < len(part.plastic):
        raise RecordingError("the recording holds no weights: it is partial")
    return part


def _differences(part: Recording) -> FloatArray:
    with np.errstate(all="ignore"):
        return np.diff(part.weights, axis=0)


def _steps(part: Recording) -> Axis:
    return Axis("step", tuple(str(step) for step in part.step.tolist()))


def _connections(part: Recording) -> Axis:
    return Axis("connection", tuple(part.connection_names[index] for index in part.plastic.tolist()))
