"""The types of a network's arrays, which are read-only.

In: an array. Out: the same, which nobody can write to any more; or what reads the elements that it names.
"""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
#: integers of any width, to take elements by: nothing is computed with them
Indices: TypeAlias = npt.NDArray[np.integer]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
Array = TypeVar("Array", bound="npt.NDArray[Any]")


def frozen(array: Array) -> Array:
    """The same array, made read-only."""
    array.flags.writeable = False
    return array


def subscript(indices: IntArray) -> slice | IntArray | None:
    """A slice where the indices lie in a row, which is quicker; None without any."""
    if not len(indices):
        return None
    first, count = int(indices[0]), len(indices)
    return slice(first, first + count) if np.array_equal(indices, np.arange(first, first + count)) else indices
