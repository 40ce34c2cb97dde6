"""Rows of a recording on their way to a file.

In: the numbers of some steps. Out: whatever a format makes of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.runtime.kinds import Rows
from neurovis_spec.runtime.recording import After


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
    """Where rows go, a stretch of the run at a time."""

    def begin(self, count: int) -> Rows:
        """Arrays for the next ``count`` rows."""
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
