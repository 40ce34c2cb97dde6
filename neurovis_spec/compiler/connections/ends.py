"""Ends of an entry: who may be connected with whom, before it is said which pairs are.

In: the neurons of both ends, by index, and their positions. Out: Ends, which every pattern works on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray, width

#: Positions within the two ends, one pair an index.
Pairs: TypeAlias = tuple[Indices, Indices]


def counted(n: int) -> Indices:
    """The positions in an end of n neurons, in the least width."""
    return np.arange(n, dtype=width(-1, n))


def _nowhere() -> FloatArray:
    return np.zeros((0, 2))


@dataclass(frozen=True)
class Ends:
    """The neurons of both ends, in the order of the reference, and whether a neuron may connect to itself, where the
    author says so. ``source_places`` and ``target_places`` are their positions, (n, 2), NaN where they have none."""

    sources: Indices
    targets: Indices
    loops: bool | None = None
    source_places: FloatArray = field(default_factory=_nowhere)
    target_places: FloatArray = field(default_factory=_nowhere)

    def pairs(self, i: Indices, j: Indices, loops: bool = False) -> Pairs:
        """The pairs, without a neuron's connection to itself unless that is allowed (by ``loops`` where nothing is
        said)."""
        if not (loops if self.loops is None else self.loops):
            keep = self.sources[i] != self.targets[j]
            i, j = (i, j) if keep.all() else (i[keep], j[keep])
        return i, j

    def excluded(self) -> IntArray:
        """For every source the one target that it must not have, which is itself; −1 where there is none."""
        if self.loops:
            return np.full(len(self.sources), -1, dtype=np.int64)
        order = np.argsort(self.targets, kind="stable")
        place = np.minimum(np.searchsorted(self.targets[order], self.sources), len(order) - 1)
        found = order[place]
        return np.where(self.targets[found] == self.sources, found, -1)

    def reversed(self) -> Ends:
        """Targets as sources."""
        return Ends(self.targets, self.sources, self.loops, self.target_places, self.source_places)
