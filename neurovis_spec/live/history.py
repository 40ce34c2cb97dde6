"""The history: what neurons did and what connections weighed, step by step, in bounded memory, for traces.

In: the activities, weights and quantities (``runtime/quantities.py``) of each step. Out: of any of them the least and
the largest value in each of some bins of steps. One thread notes, others read without waiting: what is read while it
changes may be wrong for one picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from typing import Final, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.recording import Recording

#: bytes
ROOM: Final = 64 << 20
#: The most steps of a ring, and how many of these are never read, since they are overwritten next.
_STEPS, _NEXT = 1 << 16, 16
#: The most numbers that are read for one trace; of more every second, third, … step is read.
_READ: Final = 1 << 20

Range: TypeAlias = npt.NDArray[np.float32]
Of: TypeAlias = Literal["neurons", "connections", "quantities"]


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
    signals are, or their root mean square."""

    of: Of
    indices: IntArray
    joined: Literal["mean", "sum", "rms"] = "mean"
    less: IntArray | None = None

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


def _ranges(steps: IntArray, values: FloatArray | Range, bins: Bins) -> Range:
    """The least and the largest of the values at ascending steps in each bin."""
    result = np.full((bins.count, 2), np.nan, np.float32)
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


class Ring:
    """The latest steps of a run of n neurons and m connections, with k quantities, where it is known what they are;
    where ``room`` (bytes) is full the oldest go."""

    def __init__(self, neurons: int, connections: int, quantities: int = 0, room: int = ROOM) -> None:
        self._starts: Mapping[Of, int] = {"neurons": 0, "connections": neurons, "quantities": neurons + connections}
        width = neurons + connections + quantities
        self._size = max(2 * _NEXT, min(_STEPS, room // (4 * max(1, width))))
        self._values = np.empty((self._size, width), np.float32)
        self._first, self._last = 0, -1

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

    @property
    def size(self) -> int:
        """The bytes that it takes."""
        return int(self._values.nbytes)

    def copy(self) -> Ring:
        """The same, which goes on by itself."""
        made = copy(self)
        made._values = self._values.copy()
        return made

    def after(self, step: int) -> Ring:
        """The steps after this one alone, in no more room than they take."""
        first = max(self._first, step + 1)
        steps, made = np.arange(first, self._last + 1), copy(self)
        made._size, made._first = max(1, len(steps)), first
        made._values = np.empty((made._size, self._values.shape[1]), np.float32)
        made._values[steps % made._size] = self._values[steps % self._size]
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

    def cut(self, step: int) -> None:
        """Forget what came after a step."""
        self._last = min(self._last, step)
        self._first = min(self._first, self._last + 1)

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin."""
        first, last = self._first, self._last
        end = min(last, bins.first + bins.every * bins.count - 1)
        steps = _thinned(np.arange(max(first, bins.first), end + 1), members)
        columns = members.read + self._starts[members.of]
        if len(columns) and columns.max() >= self._values.shape[1]:
            return np.full((bins.count, 2), np.nan, np.float32)
        if len(columns) > 1 or not len(steps):
            values = self._values[(steps % self._size)[:, None], columns]
        else:  # of one member all steps are read, of which the later may stand before the earlier
            (column,), begin, end = columns, steps[0] % self._size, steps[-1] % self._size + 1
            parts = [(begin, end)] if begin < end else [(begin, self._size), (0, end)]
            values = np.concatenate([self._values[one:other, column] for one, other in parts])[:, None]
        return _ranges(steps, members.join(values), bins)


class Recorded:
    """The steps of a recording, which holds all activities and weights; ``told`` (rows, n) is what traces of neurons
    show, by default the activities; ``columns`` (k,) are those of the quantities, −1 of one that it does not hold;
    ``spiking`` (k,) says whose spike one is, −1 of what is none: these it has as events."""

    def __init__(
        self,
        recording: Recording,
        told: FloatArray | None = None,
        columns: IntArray | None = None,
        spiking: IntArray | None = None,
    ) -> None:
        self._recording, self._told = recording, recording.activity if told is None else told
        self._quantities = np.zeros(0, np.int64) if columns is None else columns
        self._spiking = np.full(len(self._quantities), -1, np.int64) if spiking is None else spiking
        self._column = np.full(len(recording.sources), -1, np.int64)
        self._column[recording.plastic] = np.arange(len(recording.plastic))
        self._fixed = np.zeros(len(recording.sources))
        self._fixed[np.delete(np.arange(len(recording.sources)), recording.plastic)] = recording.weights_static

    def read(self, members: Members, bins: Bins) -> Range:
        """The least and the largest value in each bin."""
        steps = self._recording.step
        ends = np.searchsorted(steps, [bins.first, bins.first + bins.every * bins.count])
        rows = _thinned(np.arange(*ends), members)
        if members.of == "neurons":
            values = self._told[rows[:, None], members.read]
        elif members.of == "quantities":
            columns = self._quantities[members.indices]
            values = np.full((len(rows), len(columns)), np.nan)
            values[:, columns >= 0] = self._recording.states[rows[:, None], columns[columns >= 0]]
            self._put_spikes(values, steps[rows], self._spiking[members.indices])
        else:
            column, values = self._column[members.indices], np.tile(self._fixed[members.indices], (len(rows), 1))
            values[:, column >= 0] = self._recording.weights[rows[:, None], column[column >= 0]]
        return _ranges(steps[rows], members.join(values), bins)

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
