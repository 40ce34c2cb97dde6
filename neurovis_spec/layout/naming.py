"""The natural order of names: K2 before K10, and connections by their ends.

In: names of neurons and of connections. Out: keys to sort them by, whatever order the spec was written in.
"""

from __future__ import annotations

import re

_DIGITS = re.compile(r"(\d+)")
NaturalKey = tuple[tuple[tuple[int, int, str], ...], str]


def natural_key(name: str) -> NaturalKey:
    """A sort key in which numbers count as numbers; the name itself decides between equals.

    >>> sorted(["K10", "K2", "K"], key=natural_key)
    ['K', 'K2', 'K10']
    """
    parts = (
        (0, int(part), "") if part.isascii() and part.isdigit() else (1, 0, part)
        for part in _DIGITS.split(name)
        if part
    )
    return tuple(parts), name


def edge_key(name: str) -> tuple[NaturalKey, ...]:
    """A sort key for the names of edges: source, target, then the number among equals.

    >>> sorted(["K2 -> O", "K -> O (2)", "K -> O"], key=edge_key)
    ['K -> O', 'K -> O (2)', 'K2 -> O']
    """
    return tuple(natural_key(part) for part in name.split(" "))
