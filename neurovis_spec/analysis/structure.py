"""The connection matrix (Eq. 11): which neuron sends to which.

In: a Recording, which holds the ends of all connections. Out: a table, a row for each source, a column for each target.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurovis_spec.analysis.excerpt import chosen
from neurovis_spec.analysis.named import Axis, NamedArray
from neurovis_spec.runtime.recording import Recording


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
