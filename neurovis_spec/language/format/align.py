"""Rows of a matrix, cell under cell.

In: rows of cells as written. Out: a text a row. Numbers stand with their decimal points below each other, names begin
below each other, expressions end below each other; a comma stands right behind its cell.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

_WIDEST: Final = 40  # a column with a wider cell is left as it is: one long text would push all others away
_NUMBER: Final = re.compile(r"([-+]?[0-9]*)((?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)|null|~")
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*")


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """The rows, each in its brackets.

    >>> print("\\n".join(aligned([["K1", "0.5", "-a"], ["K12", "-1.25", "3*b"]])))
    [K1,   0.5,   -a]
    [K12, -1.25, 3*b]
    """
    columns = max((len(row) for row in rows), default=0)
    padded: list[list[str]] = [[] for _ in rows]
    for column in range(columns):
        there = [index for index, row in enumerate(rows) if len(row) > column]
        pads = _pads([rows[index][column] for index in there])
        for index, (left, right) in zip(there, pads, strict=True):
            last = column == len(rows[index]) - 1
            cell = rows[index][column]
            padded[index].append(" " * left + cell + ("" if last else ", " + " " * right))
    return ["[" + "".join(row) + "]" for row in padded]


def _pads(cells: Sequence[str]) -> list[tuple[int, int]]:
    """The blanks before and behind each cell of a column."""
    if max(len(cell) for cell in cells) > _WIDEST:
        return [(0, 0)] * len(cells)
    matches = [_NUMBER.fullmatch(cell) for cell in cells]
    if all(match is not None for match in matches):
        before = [len(cell) - len((match and match.group(2)) or "") for cell, match in zip(cells, matches, strict=True)]
    elif all(_NAME.fullmatch(cell) for cell in cells):
        before = [0] * len(cells)
    else:
        before = [len(cell) for cell in cells]
    left = max(before)
    right = max(len(cell) - part for cell, part in zip(cells, before, strict=True))
    return [(left - part, right - (len(cell) - part)) for cell, part in zip(cells, before, strict=True)]
