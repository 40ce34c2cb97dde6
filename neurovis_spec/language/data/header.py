"""First rows of a ``.csv`` file that number its columns, as pandas writes them, and are no data.

In: the bytes of a file without a header of texts, and the numbers in it. Out: whether its first row is 0, 1, 2, … in
integers over numbers that all have a point or an exponent, and lies further from one of the columns than that is wide.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

#: what is said of such a file where its rows are steps, and what to do
NUMBERED = "the first row, 0, 1, …, seems to number the columns; it is read as step 0"
AS_TEXTS = "remove it, or give the columns names; in pandas, that is the argument header of to_csv"
_POINT = re.compile(rb"[.eE]")
#: rows without which nothing can be said: the first one and two others
_LEAST = 3


def numbers_columns(data: bytes, values: NDArray[np.float64]) -> bool:
    """Whether the first row numbers the columns.

    >>> values = np.array([[0, 1], [0.5, 0.25], [0.625, 0.125]])
    >>> [numbers_columns(first + b"\\n0.5,0.25\\n0.625,0.125", values) for first in (b"0,1", b"0.0,1.0")]
    [True, False]
    """
    rows, columns = values.shape
    if columns < 2 or rows < _LEAST or not np.array_equal(values[0], np.arange(columns)):
        return False
    first, _, rest = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").partition(b"\n")
    cells = [cell.strip(b' \t"') for cell in first.removeprefix(b"\xef\xbb\xbf").split(b",")]
    if cells != [b"%d" % column for column in range(columns)]:
        return False
    if not all(_POINT.search(cell) for cell in rest.rstrip(b"\n").replace(b"\n", b",").split(b",")):
        return False
    low, high = values[1:].min(axis=0), values[1:].max(axis=0)
    return bool((np.maximum(low - values[0], values[0] - high) > high - low).any())
