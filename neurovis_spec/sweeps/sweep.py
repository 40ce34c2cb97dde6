"""``nv.sweep``: runs a spec at every point of a grid of parameters and seeds, and measures each run.

In: a spec, the values of each parameter, metrics. Out: a Table with a row for each point, and, if there is a path, a
file to which rows are added while the sweep runs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Final, Unpack

import numpy as np
import numpy.typing as npt

from neurovis_spec import api, arguments
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import Findings, SpecError
from neurovis_spec.interrupts import Ended
from neurovis_spec.keywords import COMPILE, CompileKeywords, check, completed, keywords
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST, read_text
from neurovis_spec.likeness import suggest
from neurovis_spec.plain import text_of
from neurovis_spec.progress import Progress
from neurovis_spec.real_paths import real_path
from neurovis_spec.runtime.backend import AUTO, BackendError, available, ready
from neurovis_spec.runtime.backend import load as load_backend
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import embodied
from neurovis_spec.runtime.inputs import check_names
from neurovis_spec.runtime.measures import parsed
from neurovis_spec.runtime.record import AS_IT_IS
from neurovis_spec.sweeps.grid import SEED, Axis, Over, Point, SweepError, axes, points
from neurovis_spec.sweeps.point import LABEL, Job, Source, compiled, measures
from neurovis_spec.sweeps.table import ERROR, Journal, Row, Table
from neurovis_spec.sweeps.workers import Runner, runner_of
from neurovis_spec.whole import whole_text

_NAMED = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*=(?!=)(.*)", re.DOTALL)


class SweepStoppedError(Ended):
    """A signal has ended a sweep; the rows until then are in the file."""


class SweepKeywords(CompileKeywords, total=False):
    """What a sweep is, besides its grid and its metrics."""

    steps: int | None
    inputs: Mapping[str, npt.ArrayLike] | None
    backend: str | None
    jobs: int
    scheduler: str | None
    path: str | Path | None
    progress: Progress | None


SWEEP: Final[SweepKeywords] = {
    "steps": None,
    "inputs": None,
    "parameters": None,
    "backend": None,
    "jobs": 1,
    "scheduler": None,
    "path": None,
    "root": None,
    "limit": None,
    "body": True,
    "progress": None,
}


@dataclass(frozen=True, eq=False)
class CheckedSweep:
    """A sweep whose first and last point have been compiled, as a check; ``network`` is that of one of them."""

    job: Job
    columns: tuple[str, ...]
    points: tuple[Point, ...]
    network: CompiledNetwork


@keywords(SweepKeywords, SWEEP)
def sweep(
    source: str | Path | Mapping[str, object],
    over: Over,
    metrics: str | Iterable[str] | Mapping[str, str],
    **options: Unpack[SweepKeywords],
) -> Table:
    """Run a spec at every point of a grid, and measure each run.

    ``over`` gives names their values, numbers or a range (``"0.001:0.1:log20"``, ``"0..9"``): ``seed`` is the seed, the
    others are parameters. ``metrics`` are measures (``"rms(T - O, last=514)"``), by themselves, as ``"name=…"`` or by
    name; what they are after the last step is a column. ``parameters`` are the same at every point, ``body`` is as in
    ``compile``. Points run in ``jobs`` processes (in a script, call this under ``if __name__ == "__main__":``), or on
    the cluster of a ``scheduler``. With ``path`` rows are in that file as soon as they are there, and those that are in
    it already are not run again. Raises SweepError, InputError, BackendError, OSError, BodyError where
    the body cannot be opened, and SpecError where the spec or
    a metric is invalid at both ends of the grid and without it; what is wrong with a single point is in its row.
    """
    given = completed("sweep", options, SWEEP)
    check(backend=given["backend"], scheduler=given["scheduler"])
    for name, place in (("root", given["root"]), ("path", given["path"])):
        if place is not None:
            arguments.path(name, place)
    steps, inputs, progress = given["steps"], given["inputs"], given["progress"]
    if steps is not None:
        steps = arguments.integer("steps", steps, least=1, most=arguments.MOST_STEPS)
    check(inputs=inputs, progress=progress)
    jobs = arguments.integer("jobs", given["jobs"], least=1)
    how: CompileKeywords = {
        "parameters": given["parameters"],
        "root": given["root"],
        "limit": given["limit"],
        "body": given["body"],
    }
    plan = planned(source, over, metrics, Course(steps, backend=given["backend"]), how)
    return carried_out(plan, inputs, jobs=jobs, scheduler=given["scheduler"], path=given["path"], progress=progress)


def planned(
    source: str | Path | Mapping[str, object] | Source,
    over: Over,
    metrics: str | Iterable[str] | Mapping[str, str],
    course: Course = AS_IT_IS,
    how: CompileKeywords = COMPILE,
) -> CheckedSweep:
    """A sweep before anything is run: of each point this ``course``, compiled so. Raises what ``sweep`` raises."""
    units = cache(partial(_units, source))  # read only where a value has a unit
    grid = axes(over, lambda name: units().get(name, ""))
    spec = _read(source)
    named = named_metrics(metrics)
    for one in named.values():
        parsed(one, LABEL)
    columns = (*(one.name for one in grid), *named, ERROR)
    _check_columns(columns)
    names, every = tuple(one.name for one in grid), tuple(points(grid))
    if course.backend == AUTO:
        course = replace(course, backend=None)
    job = Job(replace(spec, folder=real_path(spec.folder)), names, tuple(named.values()), _anywhere(how), course)
    return CheckedSweep(job, columns, every, _checked(job, grid, every))


def _anywhere(how: CompileKeywords) -> CompileKeywords:
    """How to compile, the same from whatever folder."""
    given = arguments.mapping("parameters", how["parameters"])
    root, body = how["root"], arguments.body(how["body"])
    return {
        "parameters": {name: api.setting(name, value) for name, value in given.items()},
        "root": None if root is None else str(real_path(root)),
        "limit": how["limit"],
        "body": body if isinstance(body, bool) else real_path(body),
    }


def carried_out(
    plan: CheckedSweep,
    inputs: Mapping[str, npt.ArrayLike] | None = None,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Table:
    """The table of a sweep. Raises what ``sweep`` raises."""
    check_names(plan.network.network, inputs or {})
    arrays = {name: np.asarray(value, dtype=np.float64) for name, value in (inputs or {}).items()}
    job = plan.job if scheduler is None else _by_itself(plan)
    job = replace(job, course=replace(job.course, inputs=arrays))
    width, run = len(plan.job.names), runner_of(jobs, scheduler)
    if path is None:
        rows: dict[Row, Row] = {}
        _run(plan, job, run, rows, lambda row: rows.__setitem__(row[:width], row), progress)
        return Table(plan.columns, tuple(rows[point] for point in plan.points))
    journal = Journal(Path(path), plan.columns, width)
    rows = journal.rows
    try:
        _run(plan, job, run, rows, journal.add, progress)
    except KeyboardInterrupt as error:
        journal.finish(plan.points)
        number = error.number if isinstance(error, Ended) else Ended().number
        held = sum(point in rows for point in plan.points)
        raise SweepStoppedError(number, f"stopped; {path} holds {held} of {len(plan.points)} rows") from None
    except BaseException:
        journal.finish(plan.points)
        raise
    journal.finish(plan.points)
    return Table(plan.columns, tuple(rows[point] for point in plan.points))


def _by_itself(plan: CheckedSweep) -> Job:
    """The job with all included and data files written into the text of its spec, since other machines need not have
    these files. Raises SweepError; SpecError where a file is missing by now."""
    made = plan.network
    if made.network.body is not None:
        raise SweepError(
            "a body is not sent to a cluster", "sweep in processes of this machine, or without it (--no-body)"
        )
    text = whole_text(made.spec, replace(made.request, parameters={}, seed=None), made.sources)
    job = plan.job
    if text == job.source.text:
        return job
    if len(text.encode()) > LARGEST:
        size = f"{len(text) >> 20} MiB, of {LARGEST >> 20} at most"
        raise SweepError(f"with the data that it reads the spec is too large to be sent to a cluster: {size}")
    source = replace(job.source, text=text, folder=".")
    return replace(job, source=source, how={**job.how, "root": None})


def named_metrics(metrics: str | Iterable[str] | Mapping[str, str]) -> dict[str, str]:
    """Metrics by name; one that has none is called as it is written. Raises SweepError."""
    if isinstance(metrics, Mapping):
        pairs = [(name, arguments.text(name, value)) for name, value in arguments.mapping("metrics", metrics).items()]
    else:
        pairs = [_pair(text) for text in arguments.texts("metrics", metrics, "a text, several, or a mapping")]
    if not pairs:
        raise SweepError("a sweep has one metric at least", 'as in "rms(O - T, last=100)"')
    result: dict[str, str] = {}
    for name, text in pairs:
        if name in result:
            raise SweepError(f"there are two metrics '{name}'", "give one of them a name, as in error=rms(O, last=100)")
        result[name] = text
    return result


def _pair(text: str) -> tuple[str, str]:
    match = _NAMED.fullmatch(text)
    return (match[1], match[2].strip()) if match else (" ".join(text.split()), text)


def _units(source: str | Path | Mapping[str, object] | Source) -> Mapping[str, str]:
    """The units of the parameters of a spec, as far as that can be read; "" for one that has none."""
    spec = _read(source)
    document = read_text(spec.text, spec.file, Findings())
    model = None if document is None else read_spec(document, Findings())
    return {} if model is None else {name: parameter.measure for name, parameter in model.parameters.items()}


def _read(source: str | Path | Mapping[str, object] | Source) -> Source:
    """A spec, read once, so that it is the same at every point."""
    if isinstance(source, Source):
        return source
    if isinstance(source, Mapping):
        return Source(text_of(source), "<mapping>", Path())
    path = arguments.path("source", source)
    data = read_bytes(path, LARGEST)
    with suppress(UnicodeDecodeError):
        if not isinstance(data, FileFault):
            return Source(data.decode("utf-8-sig"), str(source), path.parent)
    api.compile(source)
    raise SweepError(f"{source} cannot be read")  # and whoever compiled it said more


def _check_columns(columns: Sequence[str]) -> None:
    for place, name in enumerate(columns):
        if name in columns[:place]:
            raise SweepError(f"two columns of the table would be called '{name}'", "give the metric another name")


def _checked(job: Job, grid: Sequence[Axis], every: Sequence[Point]) -> CompiledNetwork:
    """Check a sweep on the first and the last point of its grid, before anything is run: raise if both are invalid, and
    the spec without a point, too. Gives the network of one that is valid."""
    networks: list[CompiledNetwork] = []
    errors: list[SpecError] = []
    for point in dict.fromkeys((every[0], every[-1], None)):
        if point is None and networks:
            break
        try:
            networks.append(compiled(job, point))
        except SpecError as error:
            errors.append(error)
    if not networks:
        raise errors[-1]
    known = networks[0].parameters
    for one in grid:
        if one.name != SEED and one.name not in known:
            hint = suggest(one.name, (*known, SEED), "there are")
            raise SweepError(f"there is no parameter '{one.name}'", hint)
    backend = job.course.backend
    if isinstance(backend, str):
        load_backend(backend)
        found = available(backend)
        if not found.available:
            raise BackendError(f"the backend '{backend}' is not available here: {found.note}")
    wrong: list[SpecError] = []
    for network in networks:
        try:
            measures(job, network.network)
        except SpecError as error:
            wrong.append(error)
    if len(wrong) == len(networks):
        raise wrong[0]
    return networks[0]


def _run(
    plan: CheckedSweep,
    job: Job,
    run: Runner,
    rows: Mapping[Row, Row],
    add: Callable[[Row], None],
    progress: Progress | None,
) -> None:
    """Run the points that have no row yet. Raises BodyError where no point could open its body, since no row is run
    again that says so."""
    missing = [point for point in plan.points if point not in rows]
    whole = len(plan.points)
    done = whole - len(missing)
    if progress is not None:
        progress(done, whole)
    if not missing:
        return
    embodied(plan.network.network)
    if job.course.backend is None:  # what has to be compiled is, before any process asks for it
        ready(plan.network.network)
    with closing(run(job, missing)) as results:
        for place, result in results:
            add((*missing[place], *result.values, result.error))
            done += 1
            if progress is not None:
                progress(done, whole)
