"""Rows of a recording on their way to a file.

In: activities and changing weights of some steps. Out: whatever a format makes of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray, IntArray


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

    def write(self, activity: FloatArray, weights: FloatArray) -> None:
        """Some rows: (count, n) and (count, p), which are only lent."""
        ...
