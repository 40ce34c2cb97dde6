"""The Recording: activities and weights over a run; the Snapshot: those of one step.

In: arrays as a ``.npz`` holds them (``docs/language.md``, *Recordings*). Out: frozen values that answer by name. They
refer to their Network by its hash and hold as much of its structure as is needed to read them alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments, plugins
from neurovis_spec.arrays import FloatArray, IntArray, frozen
from neurovis_spec.body import Skeleton
from neurovis_spec.compiler.limits import plural
from neurovis_spec.diagnostics import listed
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.runtime import pairwise
from neurovis_spec.runtime.errors import RecordingError, UnknownNameError, unknown
from neurovis_spec.runtime.named_array import NamedArray
from neurovis_spec.runtime.names import Found, Names
from neurovis_spec.runtime.rows import After, Rows, Widths, no_indices
from neurovis_spec.runtime.spikes import Fired, Spikes
from neurovis_spec.runtime.traces import Traced, traces

if TYPE_CHECKING:
    from types import ModuleType

    import pandas as pd
    import xarray as xr


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One step: ``activity`` (n,) is a[t], ``weights`` (m,) w[t] of all connections.

    ``previous_weights`` (m,) is w[t−1], None at step 0 and where step t − 1 was not recorded. ``seen`` (n,) is what a
    picture shows in place of the activity, where neurons have a trace; ``shown`` (n,) has the states in place of the
    activities of the neurons that show one (``render: show``), None where none does. ``sent`` is what connections take
    beside activities (``Network.sent``), None where they take none, and where it is not known. ``ends`` (m,) is how
    lines end (``scene/ends.py``), None where that follows from the network and the weights alone.
    """

    step: int
    activity: FloatArray
    weights: FloatArray
    previous_weights: FloatArray | None
    seen: FloatArray | None = None
    #: the body at the beginning of the step, as a ``Skeleton`` is drawn from; None where there is none
    pose: FloatArray | None = None
    #: what the body sensed then, which the step was given
    sensors: FloatArray | None = None
    shown: FloatArray | None = None
    sent: FloatArray | None = None
    ends: npt.NDArray[np.int8] | None = None
    #: what the actuators of the body were told behind the step; None where that is not known
    commands: FloatArray | None = None

    @property
    def told(self) -> FloatArray:
        """What a picture says of each neuron, (n,): its activity, or the state that it shows."""
        return self.activity if self.shown is None else self.shown


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A run of a network with n neurons and m connections, p of which can change.

    ``step`` (rows,) are the steps recorded, ``activity`` (rows, n) is a[t], ``weights`` (rows, p) is w[t], before the
    step's update; ``plastic`` (p,) are the indices of the changing connections, ``weights_static`` (m − p,) the weights
    of the others, in their order. What is true after the last step made (``weights_after``, ``reached``,
    ``set_parameters``, ``lesioned_neurons`` and ``lesioned_connections``) is as in ``After``. All arrays are read-only.
    ``recording["O"]`` is the activity of a neuron (rows,), of a group, an output or any other reference of a
    spec (``K3..K5``, ``K1 + O``, ``left.K``) (rows, size); ``recording["K.v"]`` is a state of models or rules that was
    recorded: ``states`` (rows, states), after the step, whose columns ``state_names`` names.

    Where the network had a body, ``sensors`` (rows, sensors) are what it sensed at each step, in columns that
    ``sensor_names`` names, and ``pose`` (rows, ``skeleton.size``) is the body at the beginning of each step. They are
    None where there was no body, or nothing to draw.

    Where the network spikes, ``spikes("E")`` gives the spikes of a reference, also of steps that have no row.

    A partial recording holds the activities of some neurons alone, those that ``recorded`` lists (None: of all), so
    that ``activity`` has fewer columns, or no weights: then ``weights`` has no columns, or the weights of some changing
    connections alone, those that ``recorded_weights`` lists (None: of all, or of none).
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
    lesioned_neurons: IntArray = field(default_factory=no_indices)
    lesioned_connections: IntArray = field(default_factory=no_indices)
    #: names besides those of neurons: neuron indices, and whether a single neuron is meant
    views: Mapping[str, tuple[tuple[int, ...], bool]] = field(default_factory=dict)
    network: str = ""
    hash: str = ""
    #: how many instances a name stands for: ``left`` for ``left1``, ``left2``, …
    counted: Mapping[str, int] = field(default_factory=dict)
    states: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    state_names: tuple[str, ...] = ()
    #: outputs that name states: columns of ``states``, and whether a single one is meant
    state_views: Mapping[str, tuple[tuple[int, ...], bool]] = field(default_factory=dict)
    #: the groups among ``views`` whose neurons have names of their own
    named: tuple[str, ...] = ()
    recorded: IntArray | None = None
    recorded_weights: IntArray | None = None
    #: the spec as one text and the namespace of its topics, for formats that hold them
    spec: str = ""
    namespace: str = "/neurovis"
    #: the neurons whose activities such formats hold by name, too; None: all, where they are few
    by_name: tuple[int, ...] | None = None
    sensors: FloatArray | None = None
    sensor_names: tuple[str, ...] = ()
    pose: FloatArray | None = None
    skeleton: Skeleton | None = None
    #: the name of the backend that made it, "" where that is not known
    backend: str = ""
    #: the indices of the neurons whose spikes it holds, ascending; None where it holds none
    spiking: IntArray | None = None
    #: the spikes (spikes,), in the order of their steps, which need have no row: the steps, and the neurons
    spike_steps: IntArray = field(default_factory=no_indices)
    spike_neurons: IntArray = field(default_factory=no_indices)
    #: the first of the steps whose spikes it holds, and the step behind the last
    spike_range: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensor_names", tuple(self.sensor_names))
        object.__setattr__(self, "state_names", tuple(self.state_names))
        shape = len(self.step), len(self.state_names)
        object.__setattr__(self, "states", np.asarray(self.states, dtype=np.float64).reshape(shape))
        for name in ("recorded", "recorded_weights", "spiking"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(np.asarray(getattr(self, name), dtype=np.int64)))
        for name in ("spike_steps", "spike_neurons"):
            object.__setattr__(self, name, frozen(np.asarray(getattr(self, name), dtype=np.int64)))
        object.__setattr__(self, "spike_range", tuple(self.spike_range))
        for array in (self.activity, self.weights, self.weights_static, self.plastic, self.sources, self.targets,
                      self.delays, self.step, self.ranks, self.weights_after, self.lesioned_neurons,
                      self.lesioned_connections, self.states):  # fmt: skip
            frozen(array)
        for body in (self.sensors, self.pose):
            if body is not None:
                frozen(body)

    def __repr__(self) -> str:
        widths = self.widths
        more = f", {widths.states} states" if widths.states else ""
        more += f", {widths.sensors} sensors" if widths.sensors else ""
        more += "" if self.spiking is None else f", {plural(len(self.spike_steps), 'spike')}"
        return (
            f"<recording of {self.network or 'a network'}: {plural(len(self), 'step')} of "
            f"{plural(widths.activity, 'neuron')}, {widths.weights} changing weights{more}>"
        )

    def __len__(self) -> int:
        return len(self.step)

    def __getitem__(self, name: str) -> FloatArray:
        """Activities by the name of a neuron, a group or an output, or by another reference. Raises KeyError with the
        nearest names."""
        values, found = self._found(arguments.text("name", name))
        return values[:, found.neurons[0]] if found.single else values[:, list(found.neurons)]

    def __contains__(self, name: object) -> bool:
        try:
            return isinstance(name, str) and self._found(name) is not None
        except UnknownNameError:
            return False

    def names_of(self, reference: str) -> tuple[str, ...]:
        """The names of the neurons that a reference names (``K``, ``K3..K5``, ``left.K + O``). Raises KeyError with the
        nearest names."""
        return tuple(self.neurons[index] for index in self._neurons_of(arguments.text("reference", reference)))

    def spikes(self, reference: str) -> Spikes:
        """When the neurons of a reference have fired: times in seconds, and which of them it was, as indices into
        ``names_of(reference)``. Raises KeyError with the nearest names, or where they do not spike, RecordingError
        where the recording holds no spikes."""
        if self.spiking is None:
            raise RecordingError(
                "the recording holds no spikes: no model of the network spikes, or it was not read from a .npz"
            )
        found = self._names.find(arguments.text("reference", reference))
        if isinstance(found, str):
            raise UnknownNameError(found)
        silent = sorted(set(found.neurons) - set(self.spiking.tolist()))
        if silent:
            names = listed([self.neurons[index] for index in silent])
            was, does = ("was", "does") if len(silent) == 1 else ("were", "do")
            if self.recorded is not None and not np.isin(silent, self.recorded).any():
                raise UnknownNameError(f"{names} {was} not recorded")
            raise UnknownNameError(f"{names} {does} not spike")
        place = np.full(len(self.neurons), -1, dtype=np.int64)
        place[list(found.neurons)] = np.arange(len(found.neurons))
        places = place[self.spike_neurons]
        own = places >= 0
        return Spikes(np.asarray(self.spike_steps[own] * self.dt, np.float64), places[own])

    @property
    def fired(self) -> Fired:
        """All spikes it holds."""
        return Fired(self.spike_steps, self.spike_neurons, *self.spike_range)

    def with_fired(self, fired: Fired, spiking: IntArray | None = None) -> Recording:
        """A recording with these spikes in place of its own, of these neurons, where others ``spiking`` are given."""
        return replace(
            self,
            spiking=self.spiking if spiking is None else spiking,
            spike_steps=fired.steps,
            spike_neurons=fired.neurons,
            spike_range=(fired.first, fired.stop),
        )

    def _found(self, name: str) -> tuple[FloatArray, Found]:
        """Where the numbers of a reference are: an array, and its columns."""
        found = self._names.find(name)
        if isinstance(found, str):
            states = self._names.find_states(name)
            if not isinstance(states, Found):
                if states is None and "->" in name:
                    raise UnknownNameError(
                        f"'{name}' is no neuron, group or output: weight('A -> B') gives the weight of a connection, "
                        "'(A -> B).x' is the state x of its rule or its synapse"
                    )
                raise UnknownNameError(states or found)
            return self.states, states
        if self.recorded is None:
            return self.activity, found
        columns = self._columns
        missing = [self.neurons[index] for index in found.neurons if index not in columns]
        if missing:
            there = listed([self.neurons[index] for index in self.recorded.tolist()])
            was = "was" if len(missing) == 1 else "were"
            raise UnknownNameError(f"{listed(missing)} {was} not recorded: the recording is partial and holds {there}")
        return self.activity, Found(tuple(columns[index] for index in found.neurons), found.single)

    @cached_property
    def _columns(self) -> Mapping[int, int]:
        """Neuron index to column of ``activity``."""
        recorded = range(len(self.neurons)) if self.recorded is None else self.recorded.tolist()
        return {index: column for column, index in enumerate(recorded)}

    @cached_property
    def _names(self) -> Names:
        neurons = {name: index for index, name in enumerate(self.neurons)}
        states = {name: column for column, name in enumerate(self.state_names)}
        return Names(neurons, self.views, self.counted, states, self.state_views)

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the neurons whose activities it holds, a name a column of ``activity``."""
        if self.recorded is None:
            return self.neurons
        return tuple(self.neurons[index] for index in self.recorded.tolist())

    @property
    def widths(self) -> Widths:
        """How many numbers of each kind a row holds."""
        return Widths(*(array.shape[1] for array in self.rows))

    @property
    def rows(self) -> Rows:
        """All rows; of what there is not, no columns."""
        none = np.zeros((len(self), 0))
        sensors, pose = (none if array is None else array for array in (self.sensors, self.pose))
        return Rows(self.activity, self.weights, self.states, sensors, pose)

    def having(self, step: IntArray, rows: Rows) -> Recording:
        """A recording of the same run with these rows in place of its own."""
        return replace(
            self,
            step=step,
            activity=rows.activity,
            weights=rows.weights,
            states=rows.states,
            sensors=None if self.sensors is None else rows.sensors,
            pose=None if self.pose is None else rows.pose,
        )

    def part(self, rows: slice | npt.NDArray[np.bool_]) -> Recording:
        """A recording of some of the rows, and of the spikes from the first to the last of them; behind the last one of
        all up to the next, or to the end."""
        some = self.having(self.step[rows], Rows(*(array[rows] for array in self.rows)))
        if self.spiking is None:
            return some
        places = np.arange(len(self))[rows]
        first, stop = self.spike_range
        if not len(places):
            stop = first
        else:
            first = first if places[0] == 0 else int(self.step[places[0]])
            stop = stop if places[-1] == len(self) - 1 else int(self.step[places[-1] + 1])
        return some.with_fired(self.fired.between(first, stop))

    @property
    def missing(self) -> str | None:
        """What a partial recording lacks, in words; None where it is whole."""
        lacks = []
        if self.recorded is not None:
            there = set(self.recorded.tolist())
            names = [name for index, name in enumerate(self.neurons) if index not in there]
            lacks.append(f"the activities of {listed(names)}")
        if self.weights.shape[1] < len(self.plastic):
            lacks.append("the changing weights" if self.recorded_weights is None else "other changing weights")
        return " and ".join(lacks) or None

    def check_whole(self, what: str) -> None:
        """Refuse a partial recording for something that needs all of it. Raises RecordingError."""
        if self.missing is not None:
            raise RecordingError(f"{what} a partial recording: it lacks {self.missing}")

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

    @property
    def t(self) -> FloatArray:
        """The seconds of each row, (rows,)."""
        return np.asarray(self.step * self.dt, np.float64)

    def weight(self, name: str) -> FloatArray:
        """w[t] of a connection by name, (rows,), also of one that stays; or of all connections between two references
        (``K -> O``, ``K1..K3 -> O + P``) a matrix a row, (rows, sources, targets), in the order of ``names_of``, NaN
        where there is no connection. Raises KeyError with the nearest names, or where two connections share both
        ends."""
        index = self.connection_index.get(arguments.text("name", name))
        if index is None:
            return self._matrix(name)
        return self._weight_of(index, name)

    def _matrix(self, name: str) -> FloatArray:
        arrow = parse(name)
        if not isinstance(arrow, Arrow) or arrow.normal in self.connection_index:
            raise unknown("connection", name, self.connection_names)
        places = [np.full(len(self.neurons), -1, dtype=np.int64) for _ in range(2)]
        for end, place in zip((arrow.sources, arrow.targets), places, strict=True):
            members = self._neurons_of(end.text)
            place[list(members)] = np.arange(len(members))
        rows, columns = places[0][self.sources], places[1][self.targets]
        between = np.flatnonzero((rows >= 0) & (columns >= 0))
        if not len(between):
            raise unknown("connection", name, self.connection_names)
        if (self.ranks[between] > 1).any():
            several = self.connection_names[int(between[np.argmax(self.ranks[between] > 1)])]
            raise UnknownNameError(f"'{name}' has two connections with both ends in common: name them, as '{several}'")
        result = np.full((len(self), *(int(place.max()) + 1 for place in places)), np.nan)
        for index in between.tolist():
            result[:, rows[index], columns[index]] = self._weight_of(index, name)
        return result

    def _neurons_of(self, reference: str) -> tuple[int, ...]:
        found = self._names.find(reference)
        if isinstance(found, str):
            raise UnknownNameError(found)
        return found.neurons

    def _weight_of(self, index: int, name: str) -> FloatArray:
        before = int(np.searchsorted(self.plastic, index))  # so many of those that change come before it
        if before == len(self.plastic) or self.plastic[before] != index:
            return np.broadcast_to(self.weights_static[index - before], (len(self),))
        column = int(np.searchsorted(self.weight_columns, index))
        if column == len(self.weight_columns) or self.weight_columns[column] != index:
            raise UnknownNameError(f"the weight '{name}' was not recorded: the recording is partial")
        return self.weights[:, column]

    def all_weights(self, row: int) -> FloatArray:
        """w[t] of all connections (m,) in a row."""
        weights = np.empty(len(self.sources))
        weights[self._static] = self.weights_static
        weights[self.plastic] = self.weights[row]
        return weights

    @cached_property
    def _static(self) -> IntArray:
        return np.setdiff1d(np.arange(len(self.sources)), self.plastic, assume_unique=True)

    def sensor(self, name: str) -> FloatArray:
        """What a sensor of the body measured: (rows,), or (rows, size) of one that is several numbers. Raises KeyError
        with the nearest names."""
        wanted = arguments.text("name", name)
        if self.sensors is None:
            raise UnknownNameError(f"there is no sensor '{wanted}': the recording is of a network without a body")
        if wanted in self.sensor_names:
            return self.sensors[:, self.sensor_names.index(wanted)]
        columns = [column for column, own in enumerate(self.sensor_names) if own.rpartition("[")[0] == wanted]
        if not columns:
            raise unknown("sensor", wanted, self.sensor_names)
        return self.sensors[:, columns]

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
        self.check_whole("a picture cannot be drawn from")
        row = self.row(step)
        previous = self.all_weights(row - 1) if row > 0 and self.step[row - 1] == step - 1 else None
        pose, sensors = (None if array is None else array[row] for array in (self.pose, self.sensors))
        return Snapshot(step, self.activity[row], self.all_weights(row), previous, pose=pose, sensors=sensors)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file of the format that the suffix names. Raises RecordingError, OSError."""
        place = arguments.path("path", path)
        for_path(place).save(self, place)

    def to_xarray(self) -> xr.Dataset:
        """``activity`` (step, neuron), ``weight`` (step, connection), ``state`` (step, state_name), ``sensor`` (step,
        sensor_name), with the coordinates ``step``, ``seconds``, ``neuron``, ``connection`` (and its ``source``,
        ``target``, ``delay``), ``state_name`` and ``sensor_name``. Weights that stay are in ``weight_static`` (static).
        Raises ImportError without the extra ``xarray``."""
        xarray = _extra("xarray")
        plastic, static = self.weight_columns, self._static
        result: xr.Dataset = xarray.Dataset(
            {
                "activity": (("step", "neuron"), self.activity),
                "weight": (("step", "connection"), self.weights),
                "state": (("step", "state_name"), self.states),
                "sensor": (("step", "sensor_name"), self.rows.sensors),
                "weight_static": ("static", self.weights_static),
            },
            coords={
                "step": self.step,
                "seconds": ("step", self.step * self.dt),
                "neuron": list(self.columns),
                "connection": [self.connection_names[index] for index in plastic.tolist()],
                "source": ("connection", [self.neurons[index] for index in self.sources[plastic].tolist()]),
                "target": ("connection", [self.neurons[index] for index in self.targets[plastic].tolist()]),
                "delay": ("connection", self.delays[plastic]),
                "state_name": list(self.state_names),
                "sensor_name": list(self.sensor_names),
                "static": [self.connection_names[index] for index in static.tolist()],
            },
            attrs={"network": self.network, "hash": self.hash, "dt": self.dt},
        )
        return result

    def to_pandas(self) -> pd.DataFrame:
        """A row a step, indexed by ``step`` and ``seconds``; columns by ``quantity`` (activity, weight, state, sensor)
        and ``name`` (of the neuron, the connection, the state, the sensor): ``frame["activity"]["K1"]``. Raises
        ImportError without the extra ``pandas``."""
        pandas = _extra("pandas")
        columns = [(traced.quantity, name) for traced in self._traced for name in traced.names]
        steps = [self.step, self.step * self.dt]
        result: pd.DataFrame = pandas.DataFrame(
            np.hstack(self.rows[:4]),
            index=pandas.MultiIndex.from_arrays(steps, names=["step", "seconds"]),
            columns=pandas.MultiIndex.from_tuples(columns, names=["quantity", "name"]),
        )
        return result

    def cross_correlation(
        self, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
    ) -> NamedArray:
        """Eq. 12: the mean of x·y of each pair of neurons (see ``neurovis_spec.analysis``)."""
        return pairwise.cross_correlation(self, of, start, stop)

    def mutual_information(
        self,
        of: str | Sequence[str] | None = None,
        start: int | None = None,
        stop: int | None = None,
        bins: int = 20,
    ) -> NamedArray:
        """Eqs. 13 and 14: what each pair of neurons tells of each other, in bits."""
        return pairwise.mutual_information(self, of, start, stop, bins)

    def coactivation(
        self,
        of: str | Sequence[str] | None = None,
        start: int | None = None,
        stop: int | None = None,
        threshold: float = 0.05,
        per: Literal["period", "total"] = "period",
        period: float | None = None,
    ) -> NamedArray:
        """Fig. 6A: the seconds for which each pair of neurons is active together."""
        return pairwise.coactivation(self, of, start, stop, threshold, per, period)

    def _repr_svg_(self) -> str:
        """Its traces, for a notebook."""
        span = f"steps {self.step[0]} … {self.step[-1]}" if len(self) else "no steps"
        return traces(f"{self.network or 'recording'} · {span}", self._traced)

    @property
    def _traced(self) -> tuple[Traced, ...]:
        """What has a line over the steps, kind by kind; a pose is drawn, not traced."""
        weights = [self.connection_names[index] for index in self.weight_columns.tolist()]
        return (
            Traced("activity", self.columns, self.activity),
            Traced("weight", weights, self.weights),
            Traced("state", self.state_names, self.states),
            Traced("sensor", self.sensor_names, self.rows.sensors),
        )

    @property
    def weight_columns(self) -> IntArray:
        """The indices of the changing connections whose weights it holds, one a column of ``weights``."""
        if self.recorded_weights is not None:
            return self.recorded_weights
        return self.plastic if self.weights.shape[1] else self.plastic[:0]


def _extra(name: str) -> ModuleType:
    """A package that an extra of the same name brings."""
    try:
        return import_module(name)
    except ImportError as error:
        message = f"{name} is not installed: pip install 'neurovis-spec[{name}]'"
        raise ImportError(message, name=name) from error


@runtime_checkable
class Readable(Protocol):
    """What can be read: ``load`` raises RecordingError for what is no such recording. The suffix of a folder is ''."""

    name: str
    suffixes: frozenset[str]

    def load(self, path: Path) -> Recording:
        """Read a recording."""
        ...


@runtime_checkable
class Format(Readable, Protocol):
    """A file format: ``save`` writes all or nothing."""

    def save(self, recording: Recording, path: Path) -> None:
        """Write a recording."""
        ...


_F = TypeVar("_F", bound=Readable)


def for_path(path: str | os.PathLike[str]) -> Format:
    """The format to write that the suffix names. Raises RecordingError where there is none."""
    return _of_suffix(path, (one for one in plugins.working(plugins.FORMATS) if isinstance(one, Format)))


def read_by(path: str | os.PathLike[str]) -> Readable:
    """The format to read that the suffix names. Raises RecordingError where there is none."""
    return _of_suffix(path, (one for one in plugins.working(plugins.FORMATS) if isinstance(one, Readable)))


def _of_suffix(path: str | os.PathLike[str], formats: Iterable[_F]) -> _F:
    suffix = Path(path).suffix.lower()
    known: set[str] = set()
    for format_ in formats:
        if suffix in format_.suffixes:
            return format_
        known |= format_.suffixes - {""}
    raise RecordingError(f"{os.fspath(path)}: no format has the suffix '{suffix}'; known: {', '.join(sorted(known))}")


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


def after_rows(step: IntArray, weights: FloatArray, changing: int | None = None) -> After:
    """What the rows alone say of the time after them: the weights of the last one, before its update; NaN where they
    hold none of the changing ones."""
    reached = int(step[-1]) + 1 if len(step) else 0
    changing = weights.shape[1] if changing is None else changing
    if not len(step) or weights.shape[1] < changing:
        return After(np.full(changing, np.nan), reached)
    return After(weights[-1].copy(), reached)
