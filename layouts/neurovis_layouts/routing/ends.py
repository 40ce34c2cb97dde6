"""Ends: connections that share both of theirs.

In: edges. Out: a key for each; by ends, in either direction, which they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from neurovis_spec.layout.model import LayoutEdge

#: A connection by its ends and its number among those that share them.
Key: TypeAlias = tuple[int, int, int]


def keys_of(edges: Iterable[LayoutEdge]) -> list[Key]:
    """The key of each edge."""
    times: dict[tuple[int, int], int] = {}
    result: list[Key] = []
    for edge in edges:
        ends = edge.source, edge.target
        times[ends] = number = times.get(ends, -1) + 1
        result.append((*ends, number))
    return result


def by_ends(edges: Iterable[tuple[int, LayoutEdge]]) -> dict[frozenset[int], list[int]]:
    """The numbers of edges by the neurons that they are between, whichever way they lead, in the order given."""
    found: dict[frozenset[int], list[int]] = {}
    for number, edge in edges:
        found.setdefault(frozenset((edge.source, edge.target)), []).append(number)
    return found
