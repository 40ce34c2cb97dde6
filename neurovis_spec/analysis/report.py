"""The report: all measures of a run, as tables, pictures and a page, in a folder.

In: a compiled network, a Recording of it or none (then it is run), what is to be measured. Out: files. What cannot be
measured is left out, and the page says why.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from neurovis_spec.analysis import pictures
from neurovis_spec.analysis.catalogue import catalogue
from neurovis_spec.analysis.firing import around, correlogram, firing, group_firing, intervals, rates
from neurovis_spec.analysis.gait import gait, stretches
from neurovis_spec.analysis.page import PAGE, Shown, page_of
from neurovis_spec.analysis.pictures import Along
from neurovis_spec.analysis.recorded import (
    awake_at_once,
    connection_matrix,
    cut,
    matrix_around,
    topography,
    traces,
    updates,
    weight_changes,
    weights,
)
from neurovis_spec.analysis.trials import STEPS, Trials, importance_by, sensitivity_by
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.layout.model import LayoutRefusalError
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.excerpt import excerpt
from neurovis_spec.runtime.files import replacing
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.named_array import Axis, NamedArray, csv_of, json_of, plain_of
from neurovis_spec.runtime.pairwise import THRESHOLD, coactivation, cross_correlation, mutual_information
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.model import Scene, Theme
from neurovis_spec.scene.renderers import drawing
from neurovis_spec.scene.themes import theme_of

#: The most curves of a picture, bars of a ranking, rows of a table over time, and neurons of a gait diagram.
_CURVES, _BARS, _ROWS, _LEGS = 24, 30, 2_000, 40
#: Measures of spikes, which a report has where neurons spike, and the last one where there are episodes.
OF_SPIKES = ("firing", "intervals", "correlogram", "episodes")
#: Groups and neurons of a cross-correlogram: a column for each pair of these.
_GROUPS = 8
#: Pictures of activities over time show so many of the last rows, so that their shape is seen.
_SEEN = 600
#: Trials that take longer than so many updates of a neuron or a connection are left out.
_LONGEST = 5_000_000_000
#: A step of a body takes as long as about so many of them.
_BODY = 50_000


@dataclass(frozen=True)
class ReportOptions:
    """What is to be measured: which neurons (``of``, None for all), which steps, above which threshold a neuron is
    active, how many bins; whether further runs are made (``trials``); the theme of the pictures."""

    of: str | Sequence[str] | None = None
    start: int | None = None
    stop: int | None = None
    threshold: float = THRESHOLD
    bins: int = 20
    trials: bool = True
    theme: str | None = None
    inputs: Mapping[str, npt.ArrayLike] = field(default_factory=dict)


@dataclass(frozen=True)
class Reading:
    """What a measure found: tables and pictures by the names of their files, and what has to be said of them."""

    key: str
    tables: Mapping[str, NamedArray] = field(default_factory=dict)
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def file_names() -> tuple[str, ...]:
    """All files that a report may write."""
    stems = [*catalogue(), "coactivation_total", "active_at_once", "weight_changes", "raster", "group_firing", "rates"]
    return (PAGE, *(f"{stem}{suffix}" for stem in stems for suffix in (".csv", ".json", ".svg")))


@dataclass(frozen=True)
class Measured:
    """A report before it is written: of which network, what was measured, in words, what each measure found, and the
    page."""

    network: CompiledNetwork
    settings: Mapping[str, str]
    readings: tuple[Reading, ...]
    page: bytes

    @property
    def plain(self) -> dict[str, object]:
        """All but the pictures, as JSON has it: tables as in their files, of pictures the names."""
        entries = catalogue()
        measures = [
            {
                "measure": one.key,
                "title": entries[one.key].title,
                "notes": list(one.notes),
                "tables": {name: plain_of(table) for name, table in one.tables.items()},
                "pictures": list(one.pictures),
            }
            for one in self.readings
        ]
        about = {"network": self.network.name, "hash": self.network.hash, "measured": dict(self.settings)}
        return {**about, "measures": measures}

    def write(self, folder: str | Path) -> list[Path]:
        """Write it into a folder, which is made if it is not there; gives the files. Raises OSError."""
        files: dict[str, bytes] = {}
        for reading in self.readings:
            for name, table in reading.tables.items():
                files[f"{name}.csv"], files[f"{name}.json"] = csv_of(table).encode(), json_of(table).encode()
            files |= {f"{name}.svg": content for name, content in reading.pictures.items()}
        files[PAGE] = self.page
        place = Path(folder)
        place.mkdir(exist_ok=True)
        for name, content in files.items():
            with replacing(place / name) as file:
                file.write(content)
        return [place / name for name in files]


def measure(
    network: CompiledNetwork,
    recording: Recording | None = None,
    options: ReportOptions | None = None,
    progress: Progress | None = None,
) -> Measured:
    """Measure a recording, or a run as long as ``time.steps``. Raises what the measures raise, ImportError without the
    extra ``analyze``."""
    asked = ReportOptions() if options is None else options
    if recording is None:
        run = network.run(inputs=asked.inputs, progress=progress)
    else:
        run = fitted(recording, network.network)
    report = _Report(network, cut(run, asked.start, asked.stop), asked, recording is not None, progress)
    readings, settings = tuple(report.readings()), report.settings()
    page = page_of(_shown(readings), network, report.recording, report.theme, settings)
    return Measured(network, settings, readings, page)


def analyze(
    network: CompiledNetwork,
    folder: str | Path,
    recording: Recording | None = None,
    options: ReportOptions | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Write the report of a recording, or of a run as long as ``time.steps``, into a folder, which is made if it is not
    there; gives the files. Raises what the measures raise, ImportError without the extra ``analyze``, OSError."""
    return measure(network, recording, options, progress).write(folder)


def _shown(readings: Sequence[Reading]) -> list[Shown]:
    entries = catalogue()
    return [Shown(entries[one.key], one.tables, one.pictures, one.notes) for one in readings]


class _Report:
    """The readings of one recording, each made when it is asked for."""

    def __init__(
        self,
        network: CompiledNetwork,
        recording: Recording,
        options: ReportOptions,
        given: bool,
        progress: Progress | None,
    ) -> None:
        self.network, self.recording, self.options, self._progress = network, recording, options, progress
        #: said of what is run, where the rest is of a recording that was given
        self._apart = ("These are runs of the spec, not of the recording.",) if given else ()
        self.theme: Theme = theme_of(network.settings_for(options.theme))
        self._part = excerpt(recording, options.of)
        self._late = cut(recording, int(recording.step[-_SEEN])) if len(recording) > _SEEN else recording
        self._dt = network.network.shown_dt

    def settings(self) -> dict[str, str]:
        """What was measured, in words."""
        step, names = self.recording.step, self._part.names
        return {
            "steps": f"{step[0]} to {step[-1]} ({len(step):,} rows)",
            "neurons": f"{len(names):,} of {len(self.recording.neurons):,}"
            if len(names) < len(self.recording.neurons)
            else f"all {len(names):,}",
            "active": f"above an absolute activity of {self.options.threshold:g}",
            "bins": str(self.options.bins),
        }

    def readings(self) -> Iterator[Reading]:
        """All measures, in the order of the catalogue."""
        makers: dict[str, Callable[[], Reading]] = {
            "connections": self._connections,
            "traces": self._traces,
            "topography": self._topography,
            "correlation": self._correlation,
            "information": self._information,
            "coactivation": self._coactivation,
            "weights": self._weights,
            "updates": self._updates,
            "gait": self._gait,
        }
        if self.recording.spiking is not None:
            of_spikes = self._firing, self._intervals, self._correlogram, self._episodes
            makers |= dict(zip(OF_SPIKES, of_spikes, strict=True))
            if self.network.network.episode is None:
                del makers["episodes"]
        for key, make in makers.items():
            yield _left_out(key, make)
        yield from self._trials()

    def _draw(self, scene: Scene) -> bytes:
        return drawing(scene, ".svg")

    def _view(self, view: str) -> bytes:
        """A view that the pictures of a network have as well."""
        with TemporaryDirectory() as folder:
            target = Path(folder) / "picture.svg"
            self.network.render(target, recording=self.recording, view=view, theme=self.options.theme, window=_SEEN)
            return target.read_bytes()

    def _pairs(self, table: NamedArray, caption: str) -> bytes:
        return self._draw(pictures.cells(table, catalogue_title(table.name), caption, self.theme))

    def _connections(self) -> Reading:
        made, of, notes = connection_matrix(self.recording, self.options.of), self.options.of, list[str]()
        if of is not None and not made.values.any():
            made = matrix_around(self.recording, of)
            if not made.values.any():
                raise RecordingError("nothing is connected to these neurons")
            notes = [
                "No connection runs from one of these neurons to another: they stand with all they are connected to."
            ]
        drawn = {"connections": self._pairs(made, "rows send, columns take in")} if len(made.rows.labels) else {}
        return Reading("connections", {"connections": made}, drawn, tuple(notes))

    def _traces(self) -> Reading:
        made, part = traces(self.recording, self.options.of), excerpt(self._late, self.options.of)
        drawn, notes = {}, self._late_only()
        if len(part.names) <= _CURVES:
            scene = pictures.curves(
                part.names, part.activity, Along(part.step, self._dt), "Traces", "activity", self.theme
            )
            drawn["traces"] = self._draw(scene)
        else:
            notes.append(f"{len(part.names):,} curves are too many for a picture: choose up to {_CURVES} with --of.")
        if self.recording.missing is None and self.options.of is None:
            drawn["raster"] = self._view("raster")
        thin, said = _thinned(made)
        return Reading("traces", {"traces": thin}, drawn, (*notes, *said))

    def _late_only(self) -> list[str]:
        if self._late is self.recording:
            return []
        rows, most = f"{len(self.recording):,}", f"{len(self._late):,}"
        return [f"Pictures have the last {most} of {rows} rows; --from and --to choose others."]

    def _topography(self) -> Reading:
        self.recording.check_whole("a map is not drawn of")
        made = topography(self.recording, self.network.drawn().value.positions, self.options.of)
        return Reading("topography", {"topography": made}, {"topography": self._view("network")})

    def _correlation(self) -> Reading:
        made = cross_correlation(self.recording, self.options.of)
        return Reading("correlation", {"correlation": made}, {"correlation": self._pairs(made, "E[x·y] of each pair")})

    def _information(self) -> Reading:
        made = mutual_information(self.recording, self.options.of, bins=self.options.bins)
        caption = f"bits, {self.options.bins} bins; the diagonal is the entropy"
        return Reading("information", {"information": made}, {"information": self._pairs(made, caption)})

    def _coactivation(self) -> Reading:
        threshold, of = self.options.threshold, self.options.of
        total = self._timed(coactivation(self.recording, of, threshold=threshold, per="total"))
        found = {"coactivation_total": total}
        unit = "steps" if self._dt is None else "seconds"
        drawn = {"coactivation_total": self._pairs(total, f"{unit} in total, |a| > {threshold:g}")}
        notes: tuple[str, ...] = ()
        try:
            each = self._timed(coactivation(self.recording, of, threshold=threshold))
            found = {"coactivation": each, **found}
            drawn = {"coactivation": self._pairs(each, f"{unit} a period, |a| > {threshold:g}"), **drawn}
        except RecordingError:
            notes = ("The activities have no period, so there is only the total.",)
        found["active_at_once"] = awake_at_once(self.recording, of, threshold=threshold)
        return Reading("coactivation", found, drawn, notes)

    def _timed(self, table: NamedArray) -> NamedArray:
        """A table of seconds, which are steps where the spec says nothing of the time."""
        return replace(table, unit="steps") if self._dt is None else table

    def _weights(self) -> Reading:
        made, changes = weights(self.recording), weight_changes(self.recording)
        if not changes.rows.labels:
            raise RecordingError("no weight can change")
        thin, said = _thinned(made)
        names, values, more = self._most_changed(made, changes)
        scene = pictures.curves(names, values, Along(self.recording.step, self._dt), "Weights", "weight", self.theme)
        return Reading("weights", {"weight_changes": changes, "weights": thin}, {"weights": self._draw(scene)},
                       (*more, *said))  # fmt: skip

    def _updates(self) -> Reading:
        made, changes = updates(self.recording), weight_changes(self.recording)
        if not changes.rows.labels:
            raise RecordingError("no weight can change")
        if len(self.recording) < 2:
            raise RecordingError("one step alone has no updates")
        thin, said = _thinned(made)
        names, values, more = self._most_changed(made, changes)
        scene = pictures.curves(
            names, values, Along(self.recording.step[:-1], self._dt), "Updates", "update", self.theme
        )
        return Reading("updates", {"updates": thin}, {"updates": self._draw(scene)}, (*more, *said))

    def _most_changed(
        self, made: NamedArray, changes: NamedArray
    ) -> tuple[tuple[str, ...], FloatArray, tuple[str, ...]]:
        """Of many connections those whose weights have changed most, summed over all steps."""
        names = made.columns.labels
        if len(names) <= _CURVES:
            return names, made.values, ()
        way = np.nan_to_num(changes.column("travelled"), nan=-1.0)
        order = np.sort(np.argsort(-way, kind="stable")[:_CURVES])
        chosen = tuple(names[place] for place in order.tolist())
        return (
            chosen,
            made.values[:, order],
            (f"The picture has the {_CURVES} of {len(names):,} that travel furthest.",),
        )

    def _gait(self) -> Reading:
        threshold, of = self.options.threshold, self.options.of
        made = gait(self.recording, of, threshold=threshold)
        if len(made.rows.labels) > _LEGS:
            note = f"{len(made.rows.labels):,} rows are too many for a picture: choose up to {_LEGS} with --of."
            return Reading("gait", {"gait": made}, {}, (note,))
        found = stretches(self._late, of, threshold=threshold)
        scene = pictures.diagram(found, made, self._late.step, self._dt, "Gait diagram", self.theme)
        return Reading("gait", {"gait": made}, {"gait": self._draw(scene)}, tuple(self._late_only()))

    def _firing(self) -> Reading:
        recording, of = self.recording, self.options.of
        tables = {"firing": firing(recording, of), "group_firing": group_firing(recording, of)}
        over_time = rates(recording, of)
        caption = f"the mean of each group in {len(over_time.rows.labels)} bins"
        drawn, notes = self._over(over_time, "Firing rates", "time", caption)
        return Reading("firing", {**tables, "rates": over_time}, {"rates": drawn}, notes)

    def _intervals(self) -> Reading:
        made = intervals(self.recording, self.options.of)
        drawn, notes = self._over(made, "Intervals", "interval", "shares of all intervals of a group")
        return Reading("intervals", {"intervals": made}, {"intervals": drawn}, notes)

    def _correlogram(self) -> Reading:
        count = len(group_firing(self.recording, self.options.of).rows.labels)
        if count > _GROUPS:
            raise RecordingError(f"{count:,} groups and neurons are too many pairs: choose up to {_GROUPS} with --of")
        made = correlogram(self.recording, self.options.of)
        drawn, notes = self._over(made, "Cross-correlogram", "lag", "the rate of the second around spikes of the first")
        return Reading("correlogram", {"correlogram": made}, {"correlogram": drawn}, notes)

    def _episodes(self) -> Reading:
        steps = self.network.network.episode
        assert steps is not None
        made = around(self.recording, steps, self.options.of)
        drawn, notes = self._over(made, "Rates in an episode", "time in the episode", "the mean of all whole episodes")
        return Reading("episodes", {"episodes": made}, {"episodes": drawn}, notes)

    def _over(self, table: NamedArray, title: str, what: str, caption: str) -> tuple[bytes, tuple[str, ...]]:
        """Curves of the columns of a table over its bins, of many the first."""
        names, steps = table.columns.labels[:_CURVES], np.array([int(one) for one in table.rows.labels], np.int64)
        more = len(table.columns.labels) - len(names)
        notes = (f"The picture has the first {_CURVES} of {len(names) + more:,}.",) if more else ()
        along = Along(steps, self._dt, what, caption)
        unit = table.unit or "share"
        return self._draw(pictures.curves(names, table.values[:, : len(names)], along, title, unit, self.theme)), notes

    def _trials(self) -> Iterator[Reading]:
        keys = ("importance", "sensitivity")
        if not self.options.trials:
            yield from (Reading(key, notes=("Left out: no further runs were asked for.",)) for key in keys)
            return
        network = self.network.network
        first = self.options.start
        last = network.steps if self.options.stop is None else self.options.stop
        count = min(STEPS, network.steps) if first is None else max(min(STEPS, last - first), 1)
        if self.options.stop is not None and first is None:
            first = max(last - count, 0)
        runs = {
            "importance": 2 * (len(network.neurons) + len(network.inputs)),
            "sensitivity": 4 * (len(network.inputs) + len(network.parameters) + len(network.connections)),
        }
        size = len(network.neurons) + len(network.connections) + (0 if network.body is None else _BODY)
        long = {key for key, number in runs.items() if number * count * size > _LONGEST}
        try:
            trials = Trials(self.network, first, count, self.options.inputs or None) if len(long) < len(runs) else None
        except ValueError as error:
            yield from (Reading(key, notes=(_why(error),)) for key in keys)
            return
        for key in keys:
            if key in long or trials is None:
                yield Reading(key, notes=(f"Left out: {runs[key]:,} runs of this network take too long.",))
            else:
                yield self._effects(key, trials)

    def _effects(self, key: str, trials: Trials) -> Reading:
        """What trials tell: what is lost without each part, or how the outputs follow it."""
        names = [self.recording.neurons[index] for index in trials.outputs.tolist()]
        what = f"runs of {trials.steps:,} steps from step {trials.start:,} on, by {_few(names)}"
        if key == "importance":
            lost = importance_by(trials, self._progress)
            by = "lesion share" if np.isfinite(lost.column("lesion share")).any() else "lesion"
            return self._ranked(key, lost, by, f"{by}, {what}")
        slopes = sensitivity_by(trials, self._progress)
        jumps = int(np.isnan(slopes.column("rms")).sum())
        note = (
            f"{jumps:,} of {len(slopes.rows.labels):,} have no derivative there: a little more makes the outputs jump."
        )
        return self._ranked(key, slopes, "elasticity", f"elasticity, {what}", (note,) if jumps else ())

    def _ranked(self, key: str, table: NamedArray, by: str, caption: str, said: tuple[str, ...] = ()) -> Reading:
        values, names = table.column(by), table.rows.labels
        order = np.argsort(-np.nan_to_num(values, nan=-1.0), kind="stable")[:_BARS]
        title = catalogue()[key].title
        scene = pictures.bars([names[p] for p in order.tolist()], values[order], title, caption, self.theme)
        notes = (f"The picture has the first {_BARS} of {len(names):,}.",) if len(names) > _BARS else ()
        return Reading(key, {key: table}, {key: self._draw(scene)}, (*self._apart, *said, *notes))


def catalogue_title(name: str) -> str:
    """A name as a title."""
    return name[:1].upper() + name[1:]


def _left_out(key: str, make: Callable[[], Reading]) -> Reading:
    """A reading, or why there is none."""
    try:
        return make()
    except (RecordingError, LayoutRefusalError) as error:
        return Reading(key, notes=(_why(error),))


def _why(error: Exception) -> str:
    """Why something is left out, and what would help."""
    notes: list[str] = getattr(error, "__notes__", [])
    return " ".join((f"Left out: {error}.", *(f"What helps: {note}." for note in notes)))


def _thinned(table: NamedArray) -> tuple[NamedArray, tuple[str, ...]]:
    """One in so many rows that the table is no longer than tables are; the recording has them all."""
    rows = len(table.rows.labels)
    if rows <= _ROWS:
        return table, ()
    every = -(-rows // _ROWS)
    kept = Axis(table.rows.name, table.rows.labels[::every])
    said = f"The table has one in {every} of {rows:,} rows; neurovis run -o x.csv writes all."
    return replace(table, values=table.values[::every], rows=kept), (said,)


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
