"""Rows of a recording: numbers of five kinds, each with columns of its own, and what is true after the last of them.

In: how many columns there are of each kind, the numbers of some steps. Out: arrays for rows; whatever a format makes of
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.spikes import NONE_FIRED, Fired, SpikeLog

#: in the order of Widths and Rows; in messages the last part of the topics
KINDS: Final = ("activity", "weights", "states", "sensors", "pose")


#: steps of a stretch, a power of two: what is computed beside the steps is computed a stretch at a time
STRETCH: Final = 1 << 8
#: numbers of rows that are well handed on together
_HANDED_ON: Final = 1 << 16


class Widths(NamedTuple):
    """How many numbers of a row are activities, changing weights, states of models and rules, sensors of a body, and
    its pose."""

    activity: int
    weights: int
    states: int
    sensors: int = 0
    pose: int = 0


class Rows(NamedTuple):
    """Rows, a kind an array: (rows, columns)."""

    activity: FloatArray
    weights: FloatArray
    states: FloatArray
    sensors: FloatArray
    pose: FloatArray

    @classmethod
    def room(cls, widths: Widths, count: int) -> Rows:
        """Room for so many rows."""
        return cls(*(np.empty((count, width)) for width in widths))

    @classmethod
    def lent(cls, widths: Widths) -> Rows:
        """Room for as many rows as are well handed on at once: some ten thousand numbers, and a stretch of steps
        at least."""
        return cls.room(widths, max(STRETCH, _HANDED_ON // max(1, sum(widths))))

    def part(self, rows: slice) -> Rows:
        """Some of the rows; no array is copied."""
        return Rows(*(array[rows] for array in self))


def no_indices() -> IntArray:
    """None of what indices tell."""
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
    lesioned_neurons: IntArray = field(default_factory=no_indices)
    lesioned_connections: IntArray = field(default_factory=no_indices)
    #: with rows that are written: the spikes of the steps since those before
    fired: Fired = field(default=NONE_FIRED, kw_only=True)


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps that are recorded: the multiples of ``every`` among the ``total`` steps from ``first`` on.

    >>> len(Steps(10, 4)), [part.tolist() for part in Steps(10, 4).parts(2)], list(Steps(10, 4, 5).parts())[0].tolist()
    (3, [[0, 4], [8]], [8, 12])
    """

    total: int
    every: int = 1
    first: int = 0

    def __len__(self) -> int:
        # the multiples before the end without those before ``first``: −(−a // b) is a/b rounded up
        return -(-(self.first + self.total) // self.every) + -self.first // self.every

    def at(self, row: int) -> int:
        """The step of a row."""
        return (row - -self.first // self.every) * self.every

    def parts(self, size: int = 1 << 16) -> Iterator[IntArray]:
        """Their numbers, some at a time."""
        for first in range(0, len(self), size):
            rows = np.arange(first, min(first + size, len(self)), dtype=np.int64)
            yield (rows - -self.first // self.every) * self.every


class RowSink(Protocol):
    """Where rows go, a stretch of the run at a time, and the spikes of all steps."""

    @property
    def fired(self) -> SpikeLog | None:
        """Where spikes go, before the rows that are handed on with them; None where nobody asks for them."""
        ...

    def begin(self, count: int) -> Rows:
        """Arrays for the next ``count`` rows, or for the first of these; for a stretch of steps always for all."""
        ...

    def end(self, count: int) -> None:
        """So many rows of the arrays are filled: all, or fewer where they are handed on early."""
        ...

    def due(self) -> bool:
        """Whether rows are to be handed on now, asked after each step."""
        ...

    def over(self) -> bool:
        """Whether the run is to end here."""
        ...


class RowWriter(Protocol):
    """Takes rows in the order of their steps."""

    def write(self, rows: Rows, after: After) -> None:
        """Some rows, which are only lent, with as many columns of each kind as the frame has; and what is true after
        the last step made, which the file holds if nothing follows. At the end there may be none (count 0)."""
        ...
