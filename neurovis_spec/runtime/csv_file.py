"""Recordings as ``.csv``: a row a step, a column a neuron and a changing weight.

In: a Recording and a path, or a path. Out: a file written row by row, or a Recording. The header is ``step``, ``t``,
the names of the neurons, then ``K1 -> O`` for each changing connection, then the states (``K1.v``, ``(K1 -> O).e``),
then ``sensor NAME`` for each number that a body senses. In the table of a partial recording a state is ``state K1.v``,
as K1 need not have a column that tells it from a neuron v in an instance K1. Numbers read back exactly. What stays in a
run, and the pose of a body, is not in the table, so a recording read from it knows the changing connections alone, with
delay 1, and of the neurons that were not recorded those that its columns name; nor is what is true after the last step,
for which the last row stands. A *frame* is a recording without rows; a *part* is the file while it is written.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from typing import BinaryIO

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.names.given import GIVEN
from neurovis_spec.language.references import Sum, parse, state_of
from neurovis_spec.real_paths import reason_of
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.files import Part, move, part_of, regular_size, replacing
from neurovis_spec.runtime.recording import Recording, after_rows
from neurovis_spec.runtime.rows import After, Rows, RowWriter, Steps

#: before the names of sensors, which may be anything
_SENSOR = "sensor "
#: before the names of states in the table of a partial recording
_STATE = "state "
#: before the names of inputs, of what these are given
_INPUT = "input "
#: how many kinds of numbers a table has: all but the pose, the last one
_KINDS_KEPT = 4
_CONNECTION = re.compile(r"(?P<source>\S+) -> (?P<target>\S+)(?: \((?P<rank>[0-9]{1,9})\))?")

#: bytes that are read together
_BLOCK = 1 << 16
#: what a table begins with
_FIRST = b"step,t"


def write_csv(recording: Recording, path: Path) -> None:
    """Write a recording; what was there stays until all is written."""
    with replacing(path) as file:
        table = _Table(file, recording)
        table.write(recording.step, recording.rows)
        table.close()


def csv_size(frame: Recording, steps: Steps) -> int:
    """About the bytes that a file takes: numbers have up to 24 characters, most of them fewer."""
    return len(steps) * 10 * (2 + sum(frame.widths[:_KINDS_KEPT]))


@contextmanager
def stream_csv(path: Path, frame: Recording, steps: Steps) -> Iterator[RowWriter]:
    """A writer for rows as they come; what was there stays until all is written. After an exception there is a part
    that holds the rows until then."""
    with part_of(path) as part:
        rows = _CsvRows(part, frame, steps)
        yield rows
        rows.close()
        part.take_place()


class _CsvRows:
    """Writes rows, and knows of which steps they are."""

    def __init__(self, part: Part, frame: Recording, steps: Steps) -> None:
        self._buffered = io.BufferedRandom(part.file)
        self._table = _Table(self._buffered, frame)
        self._part, self._steps, self._rows = part, steps, 0

    def write(self, rows: Rows, after: After) -> None:
        numbers = self._steps.at(self._rows) + np.arange(len(rows.activity)) * self._steps.every
        try:
            self._table.write(numbers, rows)
        except OSError:  # the disk took some of them
            self._part.held = held_csv(self._part.file)
            raise
        self._rows += len(rows.activity)
        self._part.held = self._steps.at(self._rows - 1) if self._rows else None

    def close(self) -> None:
        """Leave the file to its owner."""
        self._table.close()
        self._buffered.detach()


class _Table:
    """A file with the header of a recording, into which rows are written."""

    def __init__(self, file: BinaryIO, frame: Recording) -> None:
        self._text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        self._writer, self._dt = csv.writer(self._text, lineterminator="\n"), frame.dt
        names = [frame.connection_names[index] for index in frame.weight_columns.tolist()]
        sensors = [_SENSOR + name for name in frame.sensor_names]
        neurons = frozenset(frame.neurons)
        states = [_written(name, neurons, frame.recorded is None) for name in frame.state_names]
        self._writer.writerow(["step", "t", *frame.columns, *names, *states, *sensors])

    def write(self, steps: IntArray, rows: Rows) -> None:
        """Further rows, which are with the system afterwards."""
        for step, *row in zip(steps.tolist(), *rows[:_KINDS_KEPT], strict=True):
            self._writer.writerow([step, step * self._dt, *(value for part in row for value in part.tolist())])
        self._text.flush()

    def close(self) -> None:
        """Leave the file to its owner, with all rows in it."""
        self._text.detach()


def held_csv(file: FileIO) -> int | None:
    """The last step that a part holds, None for none. Raises RecordingError for a file that is no part, OSError."""
    file.seek(0)
    if not _FIRST.startswith(file.read(len(_FIRST))):
        raise RecordingError("not a recording in progress")
    end = _end_of_last_line(file, file.seek(0, io.SEEK_END))
    # the last whole line: from behind the line break before it
    begin = _end_of_last_line(file, end - 1)
    file.seek(begin)
    match = re.match(rb"([0-9]{1,16}),", file.read(20))
    return int(match[1]) if match and begin else None


def finish_csv(file: FileIO, part: Path, path: Path) -> None:
    """Turn the part of a run that broke off into a recording. Raises OSError."""
    file.truncate(_end_of_last_line(file, file.seek(0, io.SEEK_END)))
    move(file, part, path)


def recover_csv(part: Path) -> Recording:
    """Read a part, up to its last whole line. Raises RecordingError."""
    return _read(part, lambda lines: (line for line in lines if line.endswith("\n")))


def _end_of_last_line(file: FileIO, end: int) -> int:
    """Where, up to ``end``, the last whole line ends; 0 where there is none."""
    while end > 0:
        begin = max(0, end - _BLOCK)
        file.seek(begin)
        found = file.read(end - begin).rfind(b"\n")
        if found >= 0:
            return begin + found + 1
        end = begin
    return 0


def read_csv(path: Path) -> Recording:
    """Read a recording. Raises RecordingError, with the invalid line."""
    return _read(path, lambda lines: lines)


def _read(path: Path, whole_lines: Callable[[Iterator[str]], Iterator[str]]) -> Recording:
    """Read those lines of a file that ``whole_lines`` lets through. Raises RecordingError."""
    try:
        regular_size(path)
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(whole_lines(file))
            header = next(reader, [])
            return _recording(header, _table(reader, len(header)))
    except OSError as error:
        raise RecordingError(f"{path}: {reason_of(error)}") from None
    except (csv.Error, UnicodeDecodeError, RecordingError) as error:
        raise RecordingError(f"{path}: {error}") from None


def _table(reader: Iterator[list[str]], columns: int) -> FloatArray:
    """The numbers below the header, (rows, columns). Raises RecordingError."""
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
    """The recording of a table. Raises RecordingError where its header is none of a recording."""
    if header[:2] != ["step", "t"]:
        raise RecordingError("not a recording: its first columns are not 'step' and 't'")
    sensors = [name for name in header if name.startswith(_SENSOR)]
    first_sensor = len(header) - len(sensors)
    if header[first_sensor:] != sensors or len(set(sensors)) != len(sensors):
        raise RecordingError("not a recording: sensors are mixed with others, or one is named twice")
    columns, connections, states = _columns(header[2:first_sensor])
    if len(set(columns)) != len(columns) or len(set(states)) != len(states):
        raise RecordingError("not a recording: a neuron or a state is named twice")
    pairs = [_ends(name) for name in connections]
    owners = _owners(states[: len(states) - sum(name.startswith(_INPUT) for name in header)])
    neurons = tuple(dict.fromkeys([*columns, *(name for pair in pairs for name in pair[:2]), *owners]))
    index = {name: number for number, name in enumerate(neurons)}
    ends = [(index[source], index[target], rank) for source, target, rank in pairs]
    if len(set(ends)) != len(ends):
        raise RecordingError("a connection stands there twice")
    sources, targets, ranks = (np.array([e[i] for e in ends], dtype=np.int64) for i in range(3))
    steps = table[:, 0]
    are_whole = (steps == np.floor(steps)) & (np.abs(steps) < 2.0**53)
    if not (are_whole.all() and (np.diff(steps, prepend=-1.0) > 0).all()):
        raise RecordingError("the steps are no ascending whole numbers")
    first_weight = 2 + len(columns)
    first_state, p = first_weight + len(connections), len(connections)
    weights = table[:, first_weight:first_state].copy()
    after = after_rows(steps.astype(np.int64), weights, p)
    return Recording(
        activity=table[:, 2:first_weight].copy(),
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
        states=table[:, first_state:first_sensor].copy(),
        state_names=tuple(states),
        recorded=None if len(columns) == len(neurons) else np.arange(len(columns)),
        sensors=table[:, first_sensor:].copy() if sensors else None,
        sensor_names=tuple(name.removeprefix(_SENSOR) for name in sensors),
    )


def _written(name: str, neurons: Collection[str], whole: bool) -> str:
    """The column of a state, or of what an input is given, in the table of a recording that is ``whole`` or partial."""
    owner, _, state = name.rpartition(".")
    if state == GIVEN and not owner.endswith(")") and owner not in neurons:
        return _INPUT + owner
    return name if whole else _STATE + name


def _columns(names: list[str]) -> tuple[list[str], list[str], list[str]]:
    """The columns of neurons, of connections, of states: ``state K1.v``, or, where they are not marked so, those of a
    rule (``(K1 -> O).e``), of the model of a neuron that has a column itself (``K1.v``), and what is behind others that
    are no neurons; ``input touch`` is what that is given. Raises RecordingError where they are mixed."""
    result: tuple[list[str], list[str], list[str]] = ([], [], [])
    seen: set[str] = set()
    last = 0
    for name in names:
        kind = _kind(name, seen, last)
        if kind < last:
            raise RecordingError("not a recording: neurons are mixed with weights or states")
        last = kind
        is_input = name.startswith(_INPUT)
        result[kind].append(f"{name.removeprefix(_INPUT)}.{GIVEN}" if is_input else name.removeprefix(_STATE))
        if kind == 0:
            seen.add(name)
    return result


def _kind(name: str, neurons: Collection[str], last: int) -> int:
    """Whether a column is of a neuron (0), a connection (1) or a state (2); ``last`` is what the one before it is."""
    if name.startswith((_STATE, _INPUT)):
        return 2
    written = parse(name)
    if not isinstance(written, Sum):
        return 1
    state = state_of(written.parts[0])
    return 2 if state is not None and (state.of_rule or state.owner.text in neurons or last) else 0


def _owners(states: Iterable[str]) -> Iterator[str]:
    """The neurons that have these states, or are the ends of connections whose rule has them. Raises RecordingError
    for what is no state."""
    for name in states:
        written = parse(name)
        state = state_of(written.parts[0]) if isinstance(written, Sum) and len(written.parts) == 1 else None
        if state is None:
            raise RecordingError(f"the column '{name}' is no state")
        if state.of_rule:
            yield from _ends(state.owner.text)[:2]
        else:
            yield state.owner.text


def _dt(table: FloatArray) -> float:
    """Seconds a step, as the column ``t`` gives it; 1 where there is only step 0."""
    if not len(table) or table[-1, 0] == 0:
        return 1.0
    steps, seconds = table[:, 0], table[:, 1]
    dt = float(seconds[-1] / steps[-1])
    if not (math.isfinite(dt) and dt > 0):
        raise RecordingError(f"the column 't' gives a step of {dt} s")
    # the quotient of two rounded numbers may be beside the number that was written down
    near = (float(f"{dt:.15g}"), dt, math.nextafter(dt, 0.0), math.nextafter(dt, math.inf))
    return next((one for one in near if np.array_equal(steps * one, seconds)), dt)


def _ends(name: str) -> tuple[str, str, int]:
    """The ends of a connection, and which of those it is that share them. Raises RecordingError."""
    match = _CONNECTION.fullmatch(name)
    if match is None:
        raise RecordingError(f"the column '{name}' is no connection of neurons")
    return match["source"], match["target"], int(match["rank"] or 1)
