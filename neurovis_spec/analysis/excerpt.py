"""The excerpt: which steps and which neurons of a recording a measure is of.

In: a Recording, references of neurons, the first step and the one after the last. Out: an Excerpt: names, activities,
steps, and the seconds that a row stands for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.runtime.recording import Recording, RecordingError

#: A measure of pairs is of at most so many neurons: its tables have the square of it.
MOST_NEURONS = 400


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


def cut(recording: Recording, start: int | None = None, stop: int | None = None) -> Recording:
    """The steps of a recording from ``start`` to before ``stop``. Raises RecordingError where there is none of them."""
    first = None if start is None else arguments.integer("start", start, 0)
    last = None if stop is None else arguments.integer("stop", stop, 0)
    if first is None and last is None and len(recording):
        return recording
    step = recording.step
    chosen = np.ones(len(step), dtype=np.bool_)
    if first is not None:
        chosen &= step >= min(first, _MOST)
    if last is not None:
        chosen &= step < min(last, _MOST)
    if not chosen.any():
        held = f"steps {step[0]} to {step[-1]}" if len(step) else "no steps"
        asked = f"from {first or 0}" + ("" if last is None else f" to before {last}")
        raise RecordingError(f"there is nothing to measure {asked}: the recording has {held}")
    values = {entry.name: getattr(recording, entry.name) for entry in fields(Recording)}
    return Recording(**values).part(chosen)


_MOST = 1 << 62


def excerpt(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> Excerpt:
    """Some neurons (``K``, ``C + K``, ``["K1", "O"]``; default: all that were recorded) at some steps. Raises KeyError
    for an unknown name, RecordingError where there are no such steps."""
    part = cut(recording, start, stop)
    if of is None:
        return Excerpt(part.columns, part.activity, part.step, part.dt)
    names = chosen(part, of)
    return Excerpt(names, np.stack([part[name] for name in names], axis=1), part.step, part.dt)


def chosen(recording: Recording, of: str | Sequence[str]) -> tuple[str, ...]:
    """The names of the neurons that references name, each once. Raises KeyError, ValueError where there is none."""
    references = arguments.texts("of", of)
    names = tuple(dict.fromkeys(name for reference in references for name in recording.names_of(reference)))
    if not names:
        raise ValueError("'of' names no neuron")
    return names


def paired(
    recording: Recording, of: str | Sequence[str] | None = None, start: int | None = None, stop: int | None = None
) -> Excerpt:
    """The same for a measure of pairs. Raises RecordingError where there are too many neurons."""
    part = excerpt(recording, of, start, stop)
    if len(part.names) > MOST_NEURONS:
        many = f"{len(part.names):,} neurons are too many for a measure of pairs, which takes {MOST_NEURONS}"
        raise RecordingError(f"{many}: choose some (of='K', --of K)")
    return part
