"""Sums: what the connections of bundles add up to at a step.

In: pathways, weights, how lines end, how many connections are lesioned. Out: of each pathway, and of what in it
excites, inhibits and does neither, the sum of the weights and how many there are; and how many of all are lesioned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.scene.ends import EndArray
from neurovis_spec.scene.pathways import Pathway

#: Of a pathway: three sums, by how lines end, three counts, and the lesioned.
NUMBERS: Final = 7
#: How lines end, in this order.
ENDS: Final = (1, -1, 0)

#: (pathways, NUMBERS)
SumArray = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """The members of pathways one after the other, where each begins, and how many connections each stands for."""

    members: IntArray
    starts: IntArray
    counts: IntArray

    @staticmethod
    def of(some: Sequence[Pathway], counts: IntArray) -> Sums:
        """Of some pathways, each of which has members; ``counts`` (m,) are those of all connections."""
        members = np.concatenate([np.zeros(0, np.int64), *(one.members for one in some)])
        sizes = np.array([len(one.members) for one in some], np.int64)
        return Sums(members, np.cumsum(sizes) - sizes, counts[members])

    def __len__(self) -> int:
        return len(self.starts)

    def at(self, weights: FloatArray, ends: EndArray, lost: npt.NDArray[np.bool_] | IntArray) -> SumArray:
        """The sums of a step: weights, ends and how many are lesioned of all connections (m,)."""
        if not len(self.starts):
            return np.zeros((0, NUMBERS), np.float32)
        own, end = weights[self.members], ends[self.members]
        rows = [np.where(end == one, own, 0.0) for one in ENDS]
        rows += [np.where(end == one, self.counts, 0) for one in ENDS]
        rows.append(lost[self.members])
        with np.errstate(over="ignore", invalid="ignore"):
            result: SumArray = np.add.reduceat(np.stack(rows), self.starts, axis=1).T.astype(np.float32)
        return result
