"""The history: what neurons did and what connections weighed, step by step, in bounded memory, for traces.

In: the activities, weights and quantities (``runtime/quantities.py``, ``beside.py``) of each step. Out: of any of them,
and of the series that are followed, the least and the largest value in each of some bins of steps. One thread notes,
others read without waiting: what is read while it changes may be wrong for one picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from typing import Final, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.live.followed import APART, Followed
from neurovis_spec.live.series import Series, Steps
from neurovis_spec.runtime.recording import Recording

#: bytes
ROOM: Final = 64 << 20
#: The most steps of a ring, and how many of these are never read, since they are overwritten next.
_STEPS, _NEXT = 1 << 16, 16
#: The most numbers that are read for one trace; of more every second, third, … step is read.
_READ: Final = 1 << 20

Range: TypeAlias = npt.NDArray[np.float32]
Of: TypeAlias = Literal["neurons", "connections", "quantities"]
_NONE: Final = np.zeros(0, np.int64)
#: Series are worked out after so many steps at the latest, that none of these is forgotten before.
_LATEST: Final = 256


@dataclass(frozen=True, slots=True)
class Bins:
    """So many bins of ``every`` steps each, from step ``first`` on."""

    first: int
    every: int
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Members:
    """What a trace is of, by indices: activities of neurons, or the states that they show; weights of connections; or
    quantities; each ``less`` another, where there are such. Several are joined to their mean, their sum, as weights and
    signals are, or their root mean square. Or it is of a ``series`` that is followed."""

    of: Of
    indices: IntArray
    joined: Literal["mean", "sum", "rms"] = "mean"
    less: IntArray | None = None
    series: str = ""

    @classmethod
    def of_series(cls, name: str) -> Members:
        """Those of a series."""
        return cls("quantities", _NONE, series=name)

    @property
    def read(self) -> IntArray:
        """The indices of all that is read for it."""
        return self.indices if self.less is None else np.concatenate((self.indices, self.less))

    def join(self, values: FloatArray | Range) -> FloatArray | Range:
        """Values (rows, members) of what is read as those of what is drawn for them (rows,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            if self.less is not None:
                values = values[:, : len(self.indices)] - values[:, len(self.indices) :]
            if values.shape[1] == 1:
                return values[:, 0]
            if self.joined == "rms":
                mean: FloatArray = np.mean(np.square(values, dtype=np.float64), 1)
                return np.asarray(np.sqrt(mean))
            joined: FloatArray = (np.sum if self.joined == "sum" else np.mean)(values, 1, np.float64)
            return joined


class History(Protocol):
    """What can be read of the steps of a source."""

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin (bins, 2); NaN where nothing is known."""
        ...

    def follow(self, series: Mapping[str, Series]) -> None:
        """Work out these series up to the last step that is known, by their names, and no others; to be called by the
        thread of the run. Raises SpecError, BodyError, RecordingError for what a recording cannot tell."""
        ...


def _ranges(steps: IntArray, values: FloatArray | Range, bins: Bins) -> Range:
    """The least and the largest of the values at ascending steps in each bin."""
    result = _unknown(bins)
    edges = np.searchsorted(steps, bins.first + bins.every * np.arange(bins.count + 1))
    there = edges[1:] > edges[:-1]
    if there.any():
        starts, values = edges[:-1][there], values[: edges[-1]]
        with np.errstate(over="ignore", invalid="ignore"):
            result[there, 0] = np.fmin.reduceat(values, starts)
            result[there, 1] = np.fmax.reduceat(values, starts)
    return result


def _thinned(rows: IntArray, members: Members) -> IntArray:
    """Rows to be read, so that together with the members they are not too many."""
    return rows[:: max(1, -(-len(rows) * len(members.read) // _READ))]


def _unknown(bins: Bins) -> Range:
    """Nothing is known."""
    return np.full((bins.count, 2), np.nan, np.float32)


def _of_series(followed: Followed, bins: Bins) -> Range:
    """The least and the largest number of a series in each bin."""
    return _ranges(*followed.between(bins.first, bins.first + bins.every * bins.count - 1), bins)


class Ring:
    """The latest steps of a run of n neurons and m connections, with k quantities, where it is known what they are;
    where ``room`` (bytes) is full the oldest go."""

    def __init__(self, neurons: int, connections: int, quantities: int = 0, room: int = ROOM) -> None:
        self._starts: Mapping[Of, int] = {"neurons": 0, "connections": neurons, "quantities": neurons + connections}
        width = neurons + connections + quantities
        self._size = max(2 * _NEXT, min(_STEPS, room // (4 * max(1, width))))
        self._values = np.empty((self._size, width), np.float32)
        self._first, self._last = 0, -1
        self._followed: dict[str, Followed] = {}
        self._following = Lock()

    @property
    def steps(self) -> tuple[int, int]:
        """The first and the last step that are known; the last is the smaller where none is."""
        return self._first, self._last

    def note(self, step: int, activity: FloatArray, weights: FloatArray, quantities: FloatArray | None = None) -> None:
        """Keep a step; one that is known stays as it is."""
        if self._first <= step <= self._last:
            return
        if step != self._last + 1 or self._last < self._first:
            if step < self._last:  # longer ago than is known
                return
            self._first, self._last = step, step - 1
        self._first = max(self._first, step + 1 + _NEXT - self._size)
        row = self._values[step % self._size]
        with np.errstate(over="ignore"):
            n, known = self._starts["connections"], self._starts["quantities"]
            row[:n], row[n:known] = activity, weights
            row[known:] = np.nan if quantities is None else quantities
        self._last = step
        if self._followed and step % min(_LATEST, self._size // 4) == 0:
            self._work_out()

    def follow(self, series: Mapping[str, Series]) -> None:
        """Work out these series up to the last step, and no others."""
        before = self._followed
        if before.keys() != series.keys() or any(before[name].series is not one for name, one in series.items()):
            apart = max(1, min(APART, self._size // 4))
            kept = {name: one for name, one in before.items() if series.get(name) is one.series}
            self._followed = {name: kept.get(name) or Followed(one, apart) for name, one in series.items()}
        self._work_out()

    def _work_out(self) -> None:
        """Work out all series up to the last step."""
        if self._last < self._first or not self._following.acquire(blocking=False):
            return  # another thread does
        try:
            for one in self._followed.values():
                one.work_out(self._first, self._last, partial(self._known, one.series.reads))
        finally:
            self._following.release()

    def _known(self, reads: IntArray, first: int, last: int) -> Steps:
        """What is known of the steps from one to another, of quantities those that are read."""
        steps = np.arange(first, last + 1)
        rows, columns = steps % self._size, reads + self._starts["quantities"]
        quantities, there = np.full((len(rows), len(columns)), np.nan), columns < self._values.shape[1]
        quantities[:, there] = self._values[rows[:, None], columns[there]]
        return Steps(steps, self._values[rows, : self._starts["connections"]].astype(np.float64), quantities)

    @property
    def size(self) -> int:
        """The bytes that it takes."""
        return int(self._values.nbytes) + sum(one.size for one in self._followed.values())

    def copy(self) -> Ring:
        """The same, which goes on by itself."""
        made = copy(self)
        made._values, made._following = self._values.copy(), Lock()
        made._followed = {name: one.copy() for name, one in self._followed.items()}
        return made

    def after(self, step: int) -> Ring:
        """The steps after this one alone, in no more room than they take."""
        first = max(self._first, step + 1)
        steps, made = np.arange(first, self._last + 1), copy(self)
        made._size, made._first = max(1, len(steps)), first
        made._values = np.empty((made._size, self._values.shape[1]), np.float32)
        made._values[steps % made._size] = self._values[steps % self._size]
        self._work_out()
        made._followed, made._following = {name: one.after(step) for name, one in self._followed.items()}, Lock()
        return made

    def go_on(self, later: Ring) -> None:
        """Have these steps follow, in place of all that came after the step before the first of them."""
        steps = np.arange(max(later._first, later._last + 1 + _NEXT - self._size), later._last + 1)
        if not len(steps):
            return
        self.cut(int(steps[0]) - 1)
        if self._last != steps[0] - 1:  # what is between is not known
            self._first = int(steps[0])
        self._values[steps % self._size] = later._values[steps % later._size]
        self._last = int(steps[-1])
        self._first = max(self._first, self._last + 1 + _NEXT - self._size)
        for name, one in later._followed.items():
            if name in self._followed and self._followed[name].series is one.series:
                self._followed[name].go_on(one)

    def cut(self, step: int) -> None:
        """Forget what came after a step."""
        self._last = min(self._last, step)
        self._first = min(self._first, self._last + 1)
        for one in self._followed.values():
            one.cut(step)

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin."""
        if members.series:
            followed = self._followed.get(members.series)
            return _unknown(bins) if followed is None else _of_series(followed, bins)
        first, last = self._first, self._last
        end = min(last, bins.first + bins.every * bins.count - 1)
        steps = _thinned(np.arange(max(first, bins.first), end + 1), members)
        columns = members.read + self._starts[members.of]
        if len(columns) and columns.max() >= self._values.shape[1]:
            return _unknown(bins)
        if len(columns) > 1 or not len(steps):
            values = self._values[(steps % self._size)[:, None], columns]
        else:  # of one member all steps are read, of which the later may stand before the earlier
            (column,), begin, end = columns, steps[0] % self._size, steps[-1] % self._size + 1
            parts = [(begin, end)] if begin < end else [(begin, self._size), (0, end)]
            values = np.concatenate([self._values[one:other, column] for one, other in parts])[:, None]
        return _ranges(steps, members.join(values), bins)


@dataclass(frozen=True, slots=True, eq=False)
class Renamed:
    """What is known of a run of another network, by the ``places`` that things had there (−1: there were none)."""

    history: Ring | Renamed
    places: Mapping[Of, IntArray]

    @property
    def size(self) -> int:
        """The bytes that it takes."""
        return self.history.size

    def follow(self, series: Mapping[str, Series]) -> None:
        """Nothing is known of the series of another network."""

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin."""
        if members.series:
            return _unknown(bins)
        places = self.places[members.of]
        indices, less = places[members.indices], None if members.less is None else places[members.less]
        if (indices < 0).any() or (less is not None and (less < 0).any()):
            return _unknown(bins)
        return self.history.read(replace(members, indices=indices, less=less), bins)


@dataclass(frozen=True, slots=True)
class Spliced:
    """Histories that follow each other, each with the step at which the next one takes over."""

    parts: tuple[tuple[History, int], ...]

    def follow(self, series: Mapping[str, Series]) -> None:
        """Work out these series, and no others."""
        for history, _ in self.parts:
            history.follow(series)

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin; one in which a part takes over has what is known of the later
        one."""
        result = _unknown(bins)
        for history, end in self.parts:
            count = min(bins.count, (end - bins.first) // bins.every + 1)
            if count > 0:
                found = history.read(members, replace(bins, count=count))
                known = ~np.isnan(found[:, 0])
                result[:count][known] = found[known]
        return result


class Recorded:
    """The steps of a recording, which holds all activities and weights; ``told`` (rows, n) is what traces of neurons
    show, by default the activities; ``columns`` (k,) are those of the quantities, −1 of one that it does not hold;
    ``spiking`` (k,) says whose spike one is, −1 of what is none: these it has as events; ``sensors`` (k,) are the
    columns of those that are what a sensor has measured."""

    def __init__(
        self,
        recording: Recording,
        told: FloatArray | None = None,
        columns: IntArray | None = None,
        spiking: IntArray | None = None,
        sensors: IntArray | None = None,
    ) -> None:
        self._recording, self._told = recording, recording.activity if told is None else told
        self._quantities = np.zeros(0, np.int64) if columns is None else columns
        none = np.full(len(self._quantities), -1, np.int64)
        self._spiking, self._sensors = (none if given is None else given for given in (spiking, sensors))
        self._column = np.full(len(recording.sources), -1, np.int64)
        self._column[recording.plastic] = np.arange(len(recording.plastic))
        self._fixed = np.zeros(len(recording.sources))
        self._fixed[np.delete(np.arange(len(recording.sources)), recording.plastic)] = recording.weights_static
        self._followed: dict[str, tuple[Series, FloatArray]] = {}

    def follow(self, series: Mapping[str, Series]) -> None:
        """Work out these series, and no others. Raises SpecError, BodyError, RecordingError."""
        before, found = self._followed, dict[str, tuple[Series, FloatArray]]()
        rows = np.arange(len(self._recording))
        for name, one in series.items():
            if name in before and before[name][0] is one:
                found[name] = before[name]
            else:
                steps = Steps(self._recording.step, self._told, self._values(rows, one.reads))
                found[name] = one, one.recorded(self._recording, steps)
        self._followed = found

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin."""
        steps = self._recording.step
        ends = np.searchsorted(steps, [bins.first, bins.first + bins.every * bins.count])
        if members.series:
            _, numbers = self._followed.get(members.series, (None, np.full(len(steps), np.nan)))
            return _ranges(steps[slice(*ends)], numbers[slice(*ends)], bins)
        rows = _thinned(np.arange(*ends), members)
        if members.of == "neurons":
            values = self._told[rows[:, None], members.read]
        elif members.of == "quantities":
            values = self._values(rows, members.indices)
        else:
            column, values = self._column[members.indices], np.tile(self._fixed[members.indices], (len(rows), 1))
            values[:, column >= 0] = self._recording.weights[rows[:, None], column[column >= 0]]
        return _ranges(steps[rows], members.join(values), bins)

    def _values(self, rows: IntArray, indices: IntArray) -> FloatArray:
        """The quantities of these indices, (rows, indices), NaN where they are not known."""
        recording, values = self._recording, np.full((len(rows), len(indices)), np.nan)
        for columns, held in ((self._quantities, recording.states), (self._sensors, recording.sensors)):
            of = columns[indices] if len(columns) else np.full(len(indices), -1)
            if held is not None and (of >= 0).any():
                values[:, of >= 0] = held[rows[:, None], of[of >= 0]]
        if len(self._spiking):
            self._put_spikes(values, recording.step[rows], self._spiking[indices])
        return values

    def _put_spikes(self, values: FloatArray, steps: IntArray, neurons: IntArray) -> None:
        """Put the spikes of these neurons into the columns of values (rows, columns) where there are some, each into
        the row of its step, or into the one before it."""
        recording = self._recording
        if not len(steps) or (neurons < 0).all():
            return
        values[:, neurons >= 0] = 0.0
        column = np.full(len(recording.neurons), -1, np.int64)
        column[neurons[neurons >= 0]] = np.flatnonzero(neurons >= 0)
        first, last = np.searchsorted(recording.spike_steps, [steps[0], steps[-1] + 1])
        columns = column[recording.spike_neurons[first:last]]
        row = np.searchsorted(steps, recording.spike_steps[first:last], "right") - 1
        values[row[columns >= 0], columns[columns >= 0]] = 1.0
