"""Twins: the connections back of an entry that is symmetric.

In: the pairs of such an entry, as they are written or as a pattern makes them. Out: each pair once, and what becomes of
arrays and parts when each connection is directly followed by its twin.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import Indices, IntArray
from neurovis_spec.compiler.events.settable import Part

T = TypeVar("T", bound=np.generic)


class Both(NamedTuple):
    """Pairs of which each is there in the other direction, too: the first of them, and how many there are."""

    first: int
    many: int


def one_of_each(i: Indices, j: Indices, counts: bool) -> tuple[Indices, Indices]:
    """The pairs of a pattern within a group, each once and as i < j, without a neuron's connection to itself, in the
    order of the pattern. Where a pair ``counts`` as it is made, as where each is drawn by itself, those of i > j are
    left out; else what is made in either direction is one pair."""
    if counts:
        return i[i < j], j[i < j]
    i, j = np.minimum(i, j).astype(np.int64), np.maximum(i, j).astype(np.int64)
    _, first = np.unique(i * (1 + j.max(initial=0)) + j, return_index=True)
    kept = np.sort(first)
    kept = kept[i[kept] != j[kept]]
    return i[kept], j[kept]


def both_ways(sources: Indices, targets: Indices) -> Both | None:
    """Of connections between these neurons those that lead back where others come from; None without any."""
    size = 1 + max(int(sources.max(initial=0)), int(targets.max(initial=0)))
    there, back = (one.astype(np.int64) * size + other for one, other in ((sources, targets), (targets, sources)))
    found = np.flatnonzero(np.isin(there, back))
    return Both(int(found[0]), len(found)) if len(found) else None


def in_turn(one: npt.NDArray[T], other: npt.NDArray[T]) -> npt.NDArray[T]:
    """The numbers of two arrays in turn: of each connection, and of its twin."""
    return np.stack([one, other], axis=1).ravel()


def doubled(part: Part, count: int) -> Part:
    """The part of an entry of so many connections when each of these is followed by its twin."""
    places = part.within(count)
    twice: IntArray = np.repeat(np.arange(len(places), dtype=np.int64), 2)
    return part.subset(twice)._replace(places=None if part.places is None else in_turn(2 * places, 2 * places + 1))
