"""The excerpt: which steps and which neurons of a recording a measure is of.

In: what a Recording has of neurons, references of some, the first step and the one after the last. Out: an Excerpt:
names, activities, steps, and the seconds that a row stands for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.errors import RecordingError

#: No step is as late.
_NEVER = 1 << 62


class Activities(Protocol):
    """What an excerpt is taken of: the activities of a Recording, and who is called what in it."""

    @property
    def activity(self) -> FloatArray:
        """(rows, neurons)"""
        ...

    @property
    def columns(self) -> tuple[str, ...]:
        """The neurons of these columns."""
        ...

    @property
    def step(self) -> IntArray:
        """(rows,)"""
        ...

    @property
    def dt(self) -> float:
        """Seconds a step."""
        ...

    def names_of(self, reference: str) -> tuple[str, ...]:
        """The neurons that a reference names."""
        ...

    def __getitem__(self, name: str) -> FloatArray:
        """The activity of a neuron."""
        ...


@dataclass(frozen=True, eq=False)
class Excerpt:
    """``activity`` (rows, neurons) of the neurons called ``names`` at the ``step``s (rows,), ``dt`` seconds apart."""

    names: tuple[str, ...]
    activity: FloatArray
    step: IntArray
    dt: float

    @property
    def stride(self) -> float:
        """The steps that a row stands for: the usual distance of two, whatever is missing between others."""
        return float(np.median(np.diff(self.step))) if len(self.step) > 1 else 1.0

    @property
    def gaps(self) -> npt.NDArray[np.bool_]:
        """(rows − 1,): whether steps are missing between a row and the next one."""
        found: npt.NDArray[np.bool_] = np.diff(self.step) > self.stride
        return found

    @property
    def seconds(self) -> float:
        """The seconds that a row stands for."""
        return self.stride * self.dt


def rows_between(step: IntArray, start: int | None, stop: int | None) -> npt.NDArray[np.bool_] | None:
    """Which rows are of steps from ``start`` to before ``stop``; None for all. Raises RecordingError where there is no
    such row."""
    first = None if start is None else arguments.integer("start", start, 0)
    last = None if stop is None else arguments.integer("stop", stop, 0)
    if first is None and last is None and len(step):
        return None
    chosen = np.ones(len(step), dtype=np.bool_)
    if first is not None:
        chosen &= step >= min(first, _NEVER)
    if last is not None:
        chosen &= step < min(last, _NEVER)
    if not chosen.any():
        held = f"steps {step[0]} to {step[-1]}" if len(step) else "no steps"
        asked = f"from {first or 0}" + ("" if last is None else f" to before {last}")
        raise RecordingError(f"there is nothing to measure {asked}: the recording has {held}")
    return chosen


def excerpt(
    recording: Activities, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> Excerpt:
    """Some neurons (``K``, ``C + K``, ``["K1", "O"]``; default: all that were recorded) at some steps. Raises KeyError
    for an unknown name, RecordingError where there are no such steps."""
    rows = rows_between(recording.step, start, stop)
    names, activity = recording.columns, recording.activity
    if of is not None:
        names = chosen(recording, of)
        activity = np.stack([recording[name] for name in names], axis=1)
    if rows is None:
        return Excerpt(names, activity, recording.step, recording.dt)
    return Excerpt(names, activity[rows], recording.step[rows], recording.dt)


def chosen(recording: Activities, of: str | Sequence[str]) -> tuple[str, ...]:
    """The names of the neurons that references name, each once. Raises KeyError, ValueError where there is none."""
    references = arguments.texts("of", of)
    names = tuple(dict.fromkeys(name for reference in references for name in recording.names_of(reference)))
    if not names:
        raise ValueError("'of' names no neuron")
    return names
