"""The Recording: activities and weights over a run; the Snapshot: those of one step.

In: arrays as a ``.npz`` holds them (language reference, §12). Out: frozen values that answer by name. They refer to
their Network by its hash and hold as much of its structure as is needed to read them alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from neurovis_spec import arguments
from neurovis_spec.compiler.arrays import FloatArray, IntArray, frozen
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.names import Names, names_of, unknown_text


class RecordingError(ValueError):
    """A recording that cannot be read, written, or used with this network."""


class UnknownNameError(KeyError):
    """A name that a recording or simulation does not know; the message offers the nearest."""

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One step: ``activity`` (n,) is a[t], ``weights`` (m,) w[t] of all connections.

    ``previous_weights`` (m,) is w[t−1], None at step 0 and where step t − 1 was not recorded.
    """

    step: int
    activity: FloatArray
    weights: FloatArray
    previous_weights: FloatArray | None


def _no_indices() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class After:
    """What is true after the last step that was made, which need not be one that was recorded.

    ``weights`` (p,) are those of the changing connections after that step's update; ``reached`` is how many steps were
    made, with those of the runs that were continued; ``set_parameters`` are the parameters whose values do not come
    from the spec, ``lesioned_neurons`` and ``lesioned_connections`` the indices of what lesions have taken out.
    """

    weights: FloatArray
    reached: int
    set_parameters: Mapping[str, float] = field(default_factory=dict)
    lesioned_neurons: IntArray = field(default_factory=_no_indices)
    lesioned_connections: IntArray = field(default_factory=_no_indices)


@dataclass(frozen=True, eq=False)
class Recording:
    """A run of a network with n neurons and m connections, p of which can change.

    ``step`` (rows,) are the steps recorded, ``activity`` (rows, n) is a[t], ``weights`` (rows, p) is w[t], before the
    step's update; ``plastic`` (p,) are the indices of the changing connections, ``weights_static`` (m − p,) the weights
    of the others, in their order. ``weights_after`` and the four below it are what ``After`` says. All arrays are
    read-only. ``recording["O"]`` is the activity of a neuron (rows,), of a group, an output or any other reference of a
    spec (``K3..K5``, ``K1 + O``, ``left.K``) (rows, size).
    """

    activity: FloatArray
    neurons: tuple[str, ...]
    weights: FloatArray
    weights_static: FloatArray
    plastic: IntArray
    sources: IntArray
    targets: IntArray
    delays: IntArray
    dt: float
    step: IntArray
    #: 1, 2, … among connections that share both ends (``data-index``)
    ranks: IntArray
    weights_after: FloatArray
    reached: int
    set_parameters: Mapping[str, float] = field(default_factory=dict)
    lesioned_neurons: IntArray = field(default_factory=_no_indices)
    lesioned_connections: IntArray = field(default_factory=_no_indices)
    #: names besides those of neurons: neuron indices, and whether a single neuron is meant
    views: Mapping[str, tuple[tuple[int, ...], bool]] = field(default_factory=dict)
    network: str = ""
    hash: str = ""
    #: how many instances a name stands for: ``left`` for ``left1``, ``left2``, …
    counted: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for array in (self.activity, self.weights, self.weights_static, self.plastic, self.sources, self.targets,
                      self.delays, self.step, self.ranks, self.weights_after, self.lesioned_neurons,
                      self.lesioned_connections):  # fmt: skip
            frozen(array)

    def __len__(self) -> int:
        return len(self.step)

    def __getitem__(self, name: str) -> FloatArray:
        """Activities by the name of a neuron, a group or an output, or by another reference. Raises KeyError with the
        nearest names."""
        found = self._names.find(arguments.text("name", name))
        if isinstance(found, str):
            raise UnknownNameError(found)
        return self.activity[:, found.neurons[0]] if found.single else self.activity[:, list(found.neurons)]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and not isinstance(self._names.find(name), str)

    @cached_property
    def _names(self) -> Names:
        return Names({name: index for index, name in enumerate(self.neurons)}, self.views, self.counted)

    @cached_property
    def connection_names(self) -> tuple[str, ...]:
        """``C1 -> K1``, the second with the same ends ``C1 -> K1 (2)``, in the order of the connections."""
        return tuple(
            f"{self.neurons[s]} -> {self.neurons[t]}" + (f" ({rank})" if rank > 1 else "")
            for s, t, rank in zip(self.sources.tolist(), self.targets.tolist(), self.ranks.tolist(), strict=True)
        )

    @cached_property
    def connection_index(self) -> Mapping[str, int]:
        """Connection name to index."""
        return {name: index for index, name in enumerate(self.connection_names)}

    def weight(self, name: str) -> FloatArray:
        """w[t] of a connection by name, (rows,), also of one that stays. Raises KeyError with the nearest names."""
        index = self.connection_index.get(arguments.text("name", name))
        if index is None:
            raise unknown("connection", name, self.connection_names)
        column = int(np.searchsorted(self.plastic, index))
        if column < len(self.plastic) and self.plastic[column] == index:
            return self.weights[:, column]
        return np.broadcast_to(self.weights_static[index - column], (len(self),))

    def all_weights(self, row: int) -> FloatArray:
        """w[t] of all connections (m,) in a row."""
        weights = np.empty(len(self.sources))
        weights[self._static] = self.weights_static
        weights[self.plastic] = self.weights[row]
        return weights

    @cached_property
    def _static(self) -> IntArray:
        return np.setdiff1d(np.arange(len(self.sources)), self.plastic, assume_unique=True)

    def row(self, step: int) -> int:
        """The row that holds a step. Raises RecordingError where it was not recorded."""
        arguments.integer("step", step)
        row = int(np.searchsorted(self.step, step)) if abs(step) < 1 << 63 else len(self.step)
        if row == len(self.step) or self.step[row] != step:
            span = f"steps {self.step[0]} to {self.step[-1]}" if len(self.step) else "no steps"
            raise RecordingError(f"step {step} is not in the recording, which has {span} in {len(self.step)} rows")
        return row

    def snapshot(self, step: int) -> Snapshot:
        """Activities and all weights at a step. Raises RecordingError where it was not recorded."""
        row = self.row(step)
        before = self.all_weights(row - 1) if row > 0 and self.step[row - 1] == step - 1 else None
        return Snapshot(step, self.activity[row], self.all_weights(row), before)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file of the format that the suffix names. Raises RecordingError, OSError."""
        from neurovis_spec.runtime import formats

        formats.save(self, arguments.path("path", path))

    def _repr_svg_(self) -> str:
        """Its traces, for a notebook."""
        from neurovis_spec.runtime.traces import traces

        return traces(self)


def unknown(what: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """An error that offers the nearest known names."""
    return UnknownNameError(unknown_text(what, name, known))


def recording_of(
    network: Network, step: IntArray, activity: FloatArray, weights: FloatArray, all_weights: FloatArray, after: After
) -> Recording:
    """A recording with the structure of a network; ``all_weights`` (m,) gives those that stay."""
    connections = network.connections
    static = np.setdiff1d(np.arange(len(connections)), network.changing, assume_unique=True)
    names = names_of(network)
    return Recording(
        activity=activity,
        neurons=network.neurons.names,
        weights=weights,
        weights_static=all_weights[static],
        plastic=network.changing.copy(),
        sources=connections.sources.copy(),
        targets=connections.targets.copy(),
        delays=connections.delays.copy(),
        dt=network.dt,
        step=step,
        ranks=_ranks(network),
        weights_after=after.weights,
        reached=after.reached,
        set_parameters=after.set_parameters,
        lesioned_neurons=after.lesioned_neurons,
        lesioned_connections=after.lesioned_connections,
        views=names.views,
        network=network.name,
        hash=network.hash,
        counted=names.counted,
    )


def ended(recording: Recording, after: After) -> Recording:
    """The recording with what is true after its last step."""
    return replace(
        recording,
        weights_after=after.weights,
        reached=after.reached,
        set_parameters=after.set_parameters,
        lesioned_neurons=after.lesioned_neurons,
        lesioned_connections=after.lesioned_connections,
    )


def after_rows(step: IntArray, weights: FloatArray) -> After:
    """What the rows alone say of the time after them: the weights of the last one, before its update."""
    if not len(step):
        return After(np.full(weights.shape[1], np.nan), 0)
    return After(weights[-1].copy(), int(step[-1]) + 1)


def _ranks(network: Network) -> IntArray:
    """1 for each connection, 2, 3, … for the further ones that share both ends."""
    connections = network.connections
    ranks = np.ones(len(connections), dtype=np.int64)
    pairs = connections.sources * len(network.neurons) + connections.targets
    if len(np.unique(pairs)) < len(pairs):
        for index, name in enumerate(network.connection_names):
            if name.endswith(")"):
                ranks[index] = int(name[name.rindex("(") + 1 : -1])
    return ranks
