"""What a recording holds, as tables: activities (Figs. 4B, D, E), weights (Figs. 4C, 7), connections (Eq. 11).

In: a Recording; for a topography map, the positions of a layout. Out: named arrays: step by step, or a row for each
neuron or weight that says what became of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.excerpt import chosen, excerpt, rows_between
from neurovis_spec.runtime.named_array import Axis, NamedArray
from neurovis_spec.runtime.pairwise import THRESHOLD, awake
from neurovis_spec.runtime.recording import Recording

_OF_NEURONS = ("x", "y", "last", "mean", "rms", "lowest", "highest")
_OF_WEIGHTS = ("first", "last", "change", "travelled", "largest update", "at step")


def cut(recording: Recording, start: int | None = None, stop: int | None = None) -> Recording:
    """The steps of a recording from ``start`` to before ``stop``. Raises RecordingError where there is none of them."""
    rows = rows_between(recording.step, start, stop)
    if rows is None:
        return recording
    values = {entry.name: getattr(recording, entry.name) for entry in fields(Recording)}
    return Recording(**values).part(rows)


def traces(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> NamedArray:
    """a[t] of each neuron, a row a step."""
    part = excerpt(recording, of, start, stop)
    return NamedArray("traces", part.activity, _steps(part.step), Axis("neuron", part.names))


def topography(
    recording: Recording,
    positions: Mapping[str, tuple[float, float]],
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
) -> NamedArray:
    """A row for each neuron: where it stands (``network.layout().positions``), its ``last`` activity, the ``mean``, the
    root mean square, the ``lowest`` and the ``highest``."""
    part = excerpt(recording, of, start, stop)
    own = part.activity
    with np.errstate(all="ignore"):
        summed = [own[-1], own.mean(axis=0), np.sqrt((own**2).mean(axis=0)), own.min(axis=0), own.max(axis=0)]
    nowhere = (float("nan"), float("nan"))
    at = np.array([positions.get(name, nowhere) for name in part.names]).reshape(-1, 2)
    values = np.column_stack([at, *summed])
    return NamedArray("topography", values, Axis("neuron", part.names), Axis("quantity", _OF_NEURONS))


def awake_at_once(
    recording: Recording,
    of: str | Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    threshold: float = THRESHOLD,
) -> NamedArray:
    """For how many seconds so many of the neurons are active at once, and for what share of the time: a row for each
    number that occurs."""
    part = excerpt(recording, of, start, stop)
    counts = np.bincount(awake(part, threshold).sum(axis=1))
    there = np.flatnonzero(counts)
    rows = Axis("active at once", tuple(str(number) for number in there.tolist()))
    values = np.stack([counts[there] * part.seconds, counts[there] / len(part.step)], axis=1)
    return NamedArray("active at once", values, rows, Axis("quantity", ("seconds", "share")))


def weights(recording: Recording, start: int | None = None, stop: int | None = None) -> NamedArray:
    """w[t] of each connection that can change, a row a step."""
    part = _with_weights(recording, start, stop)
    return NamedArray("weights", part.weights, _steps(part.step), _connections(part))


def updates(recording: Recording, start: int | None = None, stop: int | None = None) -> NamedArray:
    """w[t+1] − w[t] of each connection that can change, for each step but the last (where only every K-th step was
    recorded, the sum of K updates)."""
    part = _with_weights(recording, start, stop)
    return NamedArray("updates", _differences(part), _steps(part.step[:-1]), _connections(part))


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
    return NamedArray("weight changes", values, _connections(part), Axis("quantity", _OF_WEIGHTS))


def _with_weights(recording: Recording, start: int | None, stop: int | None) -> Recording:
    part = cut(recording, start, stop)
    if part.weights.shape[1] < len(part.plastic):
        raise RecordingError("the recording holds no weights: it is partial")
    return part


def _differences(part: Recording) -> FloatArray:
    with np.errstate(all="ignore"):
        return np.diff(part.weights, axis=0)


def _steps(step: IntArray) -> Axis:
    return Axis("step", tuple(str(one) for one in step.tolist()))


def _connections(part: Recording) -> Axis:
    return Axis("connection", tuple(part.connection_names[index] for index in part.plastic.tolist()))


def connection_matrix(recording: Recording, of: str | Sequence[str] | None = None) -> NamedArray:
    """c_ij: 1 where there is a connection from neuron i (row) to neuron j (column), else 0."""
    return _matrix(recording, recording.neurons if of is None else chosen(recording, of))


def matrix_around(recording: Recording, of: str | Sequence[str]) -> NamedArray:
    """The same of these neurons and all that they are connected to, in the order of the network."""
    own = np.isin(np.array(recording.neurons), chosen(recording, of))
    touching = own[recording.sources] | own[recording.targets]
    own[recording.sources[touching]] = own[recording.targets[touching]] = True
    return _matrix(recording, tuple(recording.neurons[index] for index in np.flatnonzero(own).tolist()))


def _matrix(recording: Recording, names: Sequence[str]) -> NamedArray:
    place = {name: number for number, name in enumerate(names)}
    where = np.array([place.get(name, -1) for name in recording.neurons], dtype=np.int64)
    sources, targets = where[recording.sources], where[recording.targets]
    inside = (sources >= 0) & (targets >= 0)
    matrix = np.zeros((len(names), len(names)))
    matrix[sources[inside], targets[inside]] = 1.0
    return NamedArray("connection matrix", matrix, Axis("from", tuple(names)), Axis("to", tuple(names)))
