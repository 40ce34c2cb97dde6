"""Rows of a recording on their way to a file.

In: activities and changing weights of some steps. Out: whatever a format makes of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray, IntArray
from neurovis_spec.runtime.recording import After


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps that are recorded: 0, ``every``, 2·``every``, … of ``total``.

    >>> len(Steps(10, 4)), [part.tolist() for part in Steps(10, 4).parts(2)]
    (3, [[0, 4], [8]])
    """

    total: int
    every: int = 1

    def __len__(self) -> int:
        return -(-self.total // self.every)

    def parts(self, size: int = 1 << 16) -> Iterator[IntArray]:
        """Their numbers, some at a time."""
        for first in range(0, len(self), size):
            yield np.arange(first, min(first + size, len(self)), dtype=np.int64) * self.every


class RowWriter(Protocol):
    """Takes rows in the order of their steps."""

    def write(self, activity: FloatArray, weights: FloatArray, after: After) -> None:
        """Some rows, which are only lent: (count, n) and (count, p); and what is true after the last step made, which
        the file holds if nothing follows. At the end there may be none (count 0)."""
        ...
