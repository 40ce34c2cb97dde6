"""The types of a network's arrays, which are read-only.

In: an array. Out: the same, which nobody can write to any more.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]


def frozen(array: npt.NDArray[np.generic]) -> None:
    """Make an array read-only."""
    array.flags.writeable = False
