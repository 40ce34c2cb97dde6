"""What a row of a recording holds: numbers of five kinds, each with columns of its own.

In: how many columns there are of each. Out: arrays for rows.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray

#: in the order of Widths and Rows; in messages the last part of the topics
KINDS: Final = ("activity", "weights", "states", "sensors", "pose")


class Widths(NamedTuple):
    """How many numbers of a row are activities, changing weights, states of models and rules, sensors of a body, and
    its pose."""

    activity: int
    weights: int
    states: int
    sensors: int = 0
    pose: int = 0


class Rows(NamedTuple):
    """Rows, a kind an array: (rows, columns)."""

    activity: FloatArray
    weights: FloatArray
    states: FloatArray
    sensors: FloatArray
    pose: FloatArray

    @classmethod
    def room(cls, widths: Widths, count: int) -> Rows:
        """Room for so many rows."""
        return cls(*(np.empty((count, width)) for width in widths))

    def part(self, rows: slice) -> Rows:
        """Some of the rows; no array is copied."""
        return Rows(*(array[rows] for array in self))
