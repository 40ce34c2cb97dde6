"""Recordings as ``.csv``: a row a step, a column a neuron and a changing weight.

In: a Recording and a path, or a path. Out: a file written row by row, or a Recording. The header is ``step``, ``t``,
the names of the neurons, then ``K1 -> O`` for each changing connection. Numbers read back exactly. What stays in a run
is not in the table, so a recording read from it knows the changing connections alone, with delay 1; nor is what is true
after the last step, for which the last row stands.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from neurovis_spec.compiler.arrays import FloatArray, IntArray
from neurovis_spec.runtime.files import regular_size, replacing
from neurovis_spec.runtime.recording import After, Recording, RecordingError, after_rows
from neurovis_spec.runtime.rows import RowWriter, Steps

_CONNECTION = re.compile(r"(?P<source>\S+) -> (?P<target>\S+)(?: \((?P<rank>[0-9]{1,9})\))?")


def write_csv(recording: Recording, path: Path) -> None:
    """Write a recording; what was there stays until all is written."""
    with _table_of(recording, path) as rows:
        rows(recording.step, recording.activity, recording.weights)


def csv_size(frame: Recording, steps: Steps) -> int:
    """About the bytes that a file takes: numbers have up to 24 characters, most of them fewer."""
    return len(steps) * 10 * (2 + len(frame.neurons) + len(frame.plastic))


@contextmanager
def stream_csv(path: Path, frame: Recording, steps: Steps) -> Iterator[RowWriter]:
    """A writer for rows as they come; what was there stays until all is written."""
    with _table_of(frame, path) as rows:
        yield _CsvRows(rows, steps)


class _CsvRows:
    """Writes rows, and knows of which steps they are."""

    def __init__(self, rows: Callable[[IntArray, FloatArray, FloatArray], None], steps: Steps) -> None:
        self._rows, self._steps = rows, steps
        self._written = 0

    def write(self, activity: FloatArray, weights: FloatArray, after: After) -> None:
        numbers = np.arange(self._written, self._written + len(activity)) * self._steps.every
        self._rows(numbers, activity, weights)
        self._written += len(activity)


@contextmanager
def _table_of(frame: Recording, path: Path) -> Iterator[Callable[[IntArray, FloatArray, FloatArray], None]]:
    """A file with the header of a recording, and what writes rows into it."""
    names = [frame.connection_names[index] for index in frame.plastic.tolist()]
    with replacing(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["step", "t", *frame.neurons, *names])

        def rows(steps: IntArray, activity: FloatArray, weights: FloatArray) -> None:
            for step, active, strong in zip(steps.tolist(), activity, weights, strict=True):
                writer.writerow([step, step * frame.dt, *active.tolist(), *strong.tolist()])

        try:
            yield rows
            text.flush()
        finally:
            text.detach()


def read_csv(path: Path) -> Recording:
    """Read a recording. Raises RecordingError, with the line at fault."""
    try:
        regular_size(path)
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            header = next(reader, [])
            return _recording(header, _table(reader, len(header)))
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}") from None
    except (csv.Error, UnicodeDecodeError, RecordingError) as error:
        raise RecordingError(f"{path}: {error}") from None


def _table(reader: Iterator[list[str]], columns: int) -> FloatArray:
    rows = []
    for line, row in enumerate(reader, 2):
        if len(row) != columns:
            raise RecordingError(f"line {line} has {len(row)} columns, the header {columns}")
        try:
            rows.append(np.array([float(cell) for cell in row]))
        except ValueError:
            raise RecordingError(f"line {line} holds something that is no number") from None
    return np.array(rows).reshape(len(rows), columns)


def _recording(header: list[str], table: FloatArray) -> Recording:
    if header[:2] != ["step", "t"]:
        raise RecordingError("not a recording: its first columns are not 'step' and 't'")
    neurons = tuple(name for name in header[2:] if " -> " not in name)
    index = {name: number for number, name in enumerate(neurons)}
    if header[2 : 2 + len(neurons)] != list(neurons) or len(index) != len(neurons):
        raise RecordingError("not a recording: neurons are mixed with weights, or named twice")
    ends = [_ends(name, index) for name in header[2 + len(neurons) :]]
    if len(set(ends)) != len(ends):
        raise RecordingError("a connection stands there twice")
    sources, targets, ranks = (np.array([e[i] for e in ends], dtype=np.int64) for i in range(3))
    steps = table[:, 0]
    whole = (steps == np.floor(steps)) & (np.abs(steps) < 2.0**53)
    if not (whole.all() and (np.diff(steps, prepend=-1.0) > 0).all()):
        raise RecordingError("the steps are no ascending whole numbers")
    weights = table[:, 2 + len(neurons) :].copy()
    after = after_rows(steps.astype(np.int64), weights)
    return Recording(
        activity=table[:, 2 : 2 + len(neurons)].copy(),
        neurons=neurons,
        weights=weights,
        weights_static=np.zeros(0),
        plastic=np.arange(len(ends)),
        sources=sources,
        targets=targets,
        delays=np.ones(len(ends), dtype=np.int64),
        dt=_dt(table),
        step=steps.astype(np.int64),
        ranks=ranks,
        weights_after=after.weights,
        reached=after.reached,
    )


def _dt(table: FloatArray) -> float:
    """Seconds a step, from the last row; 1 where there is only step 0."""
    if not len(table) or table[-1, 0] == 0:
        return 1.0
    dt = float(table[-1, 1] / table[-1, 0])
    if not (math.isfinite(dt) and dt > 0):
        raise RecordingError(f"the column 't' gives a step of {dt} s")
    return dt


def _ends(name: str, index: dict[str, int]) -> tuple[int, int, int]:
    match = _CONNECTION.fullmatch(name)
    if match is None or match["source"] not in index or match["target"] not in index:
        raise RecordingError(f"the column '{name}' is no connection of neurons in the table")
    return index[match["source"]], index[match["target"]], int(match["rank"] or 1)
