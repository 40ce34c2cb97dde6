"""One point of a sweep: the spec compiled with its values, run, and measured while it runs.

In: a Job, which says all that the points share and can be sent to other processes and machines, and a Point. Out: a
Result: the metrics, or what is wrong with the point.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from neurovis_spec import api
from neurovis_spec.body import BodyError
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import SpecError, printable
from neurovis_spec.keywords import CompileKeywords
from neurovis_spec.plugins import PluginError
from neurovis_spec.runtime.backend import BackendError
from neurovis_spec.runtime.columns import Columns, Keep, columns_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.measures import Measure, Meter, parsed, resolved, sensed_columns
from neurovis_spec.runtime.record import run_steps
from neurovis_spec.runtime.rows import Rows
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.sweeps.grid import SEED, Point

LABEL = "<metric>"
#: What a run may raise, and the code that it has in a table.
_CODES: Mapping[type[Exception], str] = {
    BackendError: "backend",
    BodyError: "body",
    PluginError: "plug-in",
    InputError: "input",
    MemoryError: "memory",
    OSError: "system",
}


@dataclass(frozen=True)
class Source:
    """A spec as a text, called ``file``; its own files lie in ``folder``."""

    text: str
    file: str
    folder: str | Path


@dataclass(frozen=True)
class Job:
    """What all points of a sweep share: a spec, the ``names`` of the grid, the ``metrics``; how it is compiled, and the
    course of each run."""

    source: Source
    names: tuple[str, ...]
    metrics: tuple[str, ...]
    how: CompileKeywords
    course: Course


@dataclass(frozen=True)
class Result:
    """The metrics of a point, None for each where something is wrong, which ``error`` says: ``CODE: MESSAGE``."""

    values: tuple[float | None, ...]
    error: str | None = None


def compiled(job: Job, point: Point | None) -> CompiledNetwork:
    """The network of a point; of the spec as it is without one. Raises SpecError."""
    given = dict(zip(job.names, point, strict=True)) if point is not None else {}
    seed = given.pop(SEED, None)
    source, how = job.source, job.how
    values = {**(how["parameters"] or {}), **{name: float(value) for name, value in given.items()}}
    return api.compile_text(
        source.text,
        file=source.file,
        folder=source.folder,
        seed=None if seed is None else int(seed),
        **(how | {"parameters": values}),
    )


def measures(job: Job, network: Network) -> tuple[Measure, ...]:
    """The metrics for the runs of a network. Raises SpecError."""
    found = tuple(resolved(parsed(text, LABEL), network, LABEL) for text in job.metrics)
    for measure in found:
        measure.check_steps(job.course.length(network))
    return found


def run_point(job: Job, point: Point) -> Result:
    """Run a point. What is wrong with it becomes its result: one point more or less ends no sweep."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Result(_measured(job, compiled(job, point).network))
    except SpecError as error:
        first = next((one for one in error.diagnostics if one.severity == "error"), error.diagnostics[0])
        return failed(job, first.code, first.message)
    except Exception as error:
        code = next((code for kind, code in _CODES.items() if isinstance(error, kind)), None)
        return failed(job, code or "internal", str(error) if code else f"{type(error).__name__}: {error}")


def failed(job: Job, code: str, message: str) -> Result:
    """A result without metrics."""
    return Result((None,) * len(job.metrics), printable(f"{code}: {' '.join(message.split())}"))


def _measured(job: Job, network: Network) -> tuple[float, ...]:
    meters = tuple(Meter(measure) for measure in measures(job, network))
    state = initial_state(network)
    states = tuple(dict.fromkeys(name for meter in meters for name in meter.measure.probe.names))
    keep = Keep(states=states, sent=False)
    course = replace(job.course, keep=keep).embodied(network)
    rows = _Metered(network, state, meters, columns_of(network, keep, course.body))
    run_steps(network, state, course, rows)
    return tuple(rows.last)


class _Metered:
    """Rows that are measured and forgotten."""

    fired = None

    def __init__(self, network: Network, state: State, meters: Sequence[Meter], columns: Columns) -> None:
        self._rows = Rows.lent(columns.widths(network))
        self._state, self._meters = state, meters
        names = columns.probe.names
        self._places = [[names.index(name) for name in meter.measure.probe.names] for meter in meters]
        self._sensed = [sensed_columns(meter.measure, columns.sensors) for meter in meters]
        self.last = [float("nan")] * len(meters)

    def begin(self, count: int) -> Rows:
        return self._rows.part(slice(count))

    def end(self, count: int) -> None:
        if count:
            conditions = self._state.conditions
            activity, _, states, sensors, _ = self._rows.part(slice(count))
            self.last = [
                float(meter.rows(activity, conditions, np.concatenate((states[:, own], sensors[:, sensed]), 1))[-1])
                for meter, own, sensed in zip(self._meters, self._places, self._sensed, strict=True)
            ]

    def due(self) -> bool:
        return False

    def over(self) -> bool:
        return False
