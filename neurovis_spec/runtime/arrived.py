"""Rows as messages bring them: each kind of numbers in messages of its own, of one run or of several.

In: arrays in the order of a file, with the step that they say. Out: a Recording of one of the runs: a network that
began anew counts its steps anew. A step that one of the kinds lacks is left out of all.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial, reduce
from pathlib import Path

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.rows import KINDS, Rows
from neurovis_spec.runtime.wire import Encoding, label_of, step_of

#: runs that are listed
_LISTED = 5


@dataclass
class _Rows:
    """The rows of one kind in one run."""

    #: when the first and the last came
    first: int
    last: int = 0
    #: the step of each row, ascending
    steps: list[int] = field(default_factory=list)
    rows: list[FloatArray] = field(default_factory=list)

    def shared(self, other: _Rows) -> int:
        """How much of their time two have in common; negative: how far they are apart."""
        return min(self.last, other.last) - max(self.first, other.first)


class Arrived:
    """The rows of a network; ``frame`` is its recording without them."""

    def __init__(self, frame: Recording) -> None:
        self._frame, self._label = frame, label_of(frame.hash)
        #: of each kind the runs, in their order
        self._runs: tuple[list[_Rows], ...] = tuple([] for _ in KINDS)

    def take(self, kind: int, time: int, data: bytes, encoding: Encoding) -> None:
        """A message. Raises RecordingError where it is none of this network's arrays, and WireError."""
        step, numbers = step_of(data, encoding, self._label, self._frame.widths[kind])
        runs = self._runs[kind]
        # a step that is not behind the one before begins another run
        if not runs or (step is not None and step <= runs[-1].steps[-1]):
            runs.append(_Rows(time))
        run = runs[-1]
        run.steps.append(step if step is not None else run.steps[-1] + 1 if run.steps else 0)
        run.rows.append(numbers)
        run.last = time

    def recording(self, path: Path, number: int | None = None) -> Recording:
        """The run with a number, from 1, by default the last; where there are more, a warning says so. Raises
        RecordingError."""
        runs = self._runs[0]
        if number is None:
            number = max(1, len(runs))
            if len(runs) > 1:
                others = "render, animate, analyze and live read another by --run N"
                warnings.warn(f"{path} holds {_list_of_runs(runs)}: the last is read; {others}", stacklevel=5)
        elif not 1 <= number <= max(1, len(runs)):
            raise RecordingError(f"there is no run {number}: it holds {_list_of_runs(runs)}")
        run = runs[number - 1] if runs else _Rows(0)
        kinds = [kind for kind, width in enumerate(self._frame.widths) if width or kind == 0]
        # each topic comes in its own time: the rows of the other kinds are those that came beside these
        beside = [run, *(max(others, key=run.shared, default=_Rows(0)) for others in self._runs[1:])]
        steps = {kind: np.array(beside[kind].steps, dtype=np.int64) for kind in kinds}
        step = reduce(partial(np.intersect1d, assume_unique=True), steps.values())
        rows = Rows(*(
            np.array([beside[kind].rows[row] for row in np.searchsorted(steps[kind], step)] if kind in steps else [])
            .reshape(len(step), width)
            for kind, width in enumerate(self._frame.widths)
        ))  # fmt: skip
        return self._frame.having(step, rows)


def _list_of_runs(runs: Sequence[_Rows]) -> str:
    """Which runs there are, in words."""
    if len(runs) <= 1:
        return "one run"
    shown = range(max(0, len(runs) - _LISTED), len(runs))
    words = [f"run {at + 1}: steps {runs[at].steps[0]} to {runs[at].steps[-1]}" for at in shown]
    return f"{len(runs)} runs, for the network began anew ({'' if shown[0] == 0 else '…, '}{', '.join(words)})"
