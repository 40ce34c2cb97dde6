"""A compiled network, as users hold it: ``.run``, ``.layout``, ``.render``, ``.export``.

In: what the compiler made of a spec, and what a caller gives by name. Out: recordings, layouts, pictures, files; each
of these by one value, a Course or a Look (``keywords``). What runs, lays out and draws is imported by who does so: a
spec is compiled, and thereby checked, without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Unpack

import numpy.typing as npt

from neurovis_spec import arguments, pipeline
from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.compile import compile_spec
from neurovis_spec.compiler.limits import plural
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.gc_paused import uncollected
from neurovis_spec.keywords import (
    FILM,
    KEEP,
    MEMORY,
    RUN,
    STILL,
    FilmKeywords,
    KeepKeywords,
    MemoryKeywords,
    PictureKeywords,
    RunKeywords,
    StillKeywords,
    check,
    completed,
    course_of,
    film_of,
    keep_of,
    keywords,
    panels_of,
    size_of,
    still_of,
    weights_alone,
)
from neurovis_spec.progress import Progress

if TYPE_CHECKING:
    from neurovis_spec.arrays import FloatArray
    from neurovis_spec.layout import Layout, Point, Route
    from neurovis_spec.notebook.widget import LiveWidget
    from neurovis_spec.runtime.columns import Keep
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.simulation import Simulation
    from neurovis_spec.runtime.state import State
    from neurovis_spec.runtime.step_check import StepCheck
    from neurovis_spec.runtime.until import Until
    from neurovis_spec.scene.look import Look
    from neurovis_spec.scene.panels import View


@dataclass(frozen=True, eq=False)
class CompiledNetwork(Compilation):
    """A compiled network: run it, lay it out, draw it. ``network`` holds its arrays, ``warnings`` what was noticed."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The values of its parameters."""
        return self.network.parameters

    def __repr__(self) -> str:
        network = self.network
        return (
            f"<network {network.name}: {plural(len(network.neurons), 'neuron')}, "
            f"{plural(len(network.connections), 'connection')}, "
            f"{int((network.connections.rules.whole() >= 0).sum())} plastic>"
        )

    def text(self) -> str:
        """The spec as one text, with what it includes and the data that it reads inside, and with what was set: it
        compiles to the same network anywhere. Raises SpecError where a file that it names is gone."""
        from neurovis_spec.whole import whole_text

        return whole_text(self.spec, self.request, self.sources)

    @keywords(KeepKeywords, KEEP)
    def simulator(
        self,
        backend: str | None = None,
        *,
        start: Recording | None = None,
        only: Literal["weights"] | None = None,
        record: str | Path | bool = False,
        body: str | Path | bool = True,
        **kept: Unpack[KeepKeywords],
    ) -> Simulation:
        """Step by step, for a control loop; ``start`` is a recording to go on from, ``only`` and ``body`` as in
        ``run``.

        With ``record`` it leaves a recording (``sim.recording``), in memory or in a file that is there when the
        simulation is closed (``with network.simulator(record="walk.npz") as sim:``); what of it is recorded is chosen
        as in ``run``. Raises what ``run`` raises."""
        from neurovis_spec.runtime.simulation import Simulation

        given = completed("simulator", kept, KEEP)
        check(backend=backend, start=start)
        made = Simulation(self.with_body(body).network, backend, start, weights_alone=weights_alone(only))
        if record is not False:
            target = None if record is True else arguments.path("record", record)
            made.record(target, given["every"], self._kept_in(target, keep_of(given)))
        return made

    @keywords(MemoryKeywords, MEMORY)
    def run(
        self,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        **options: Unpack[MemoryKeywords],
    ) -> Recording:
        """Run ``steps`` steps (default ``time.steps``) and record every ``every``-th.

        ``inputs`` replace the sources of inputs: arrays of (steps,) or (steps, size). ``states`` are recorded as well
        (``K.v``, ``(K -> O).eligibility``), and so are those that outputs name; ``neurons`` (``O + K``) are the only
        ones that are recorded, ``weights="none"`` leaves the weights out, ``signals="none"`` what is sent in place of
        activities and the signals of synapses, by which pictures colour lines. The run ends at the first step after
        which ``until`` is true (``"rms(O - T, last=129) < 0.01"``). ``checkpoint`` is a file from which the run goes on
        exactly, if it is there, and which holds its state at the end; ``steps`` are those to be made now. With ``last``
        the last of the steps that would be recorded is the only one, and memory does not grow with the steps. The
        network has the ``body`` of its spec; that of a YAML file in its place; none with ``body=False``. Raises
        InputError, BackendError, BodyError, RecordingError, KeyError for a name that there is not, SpecError where
        ``until`` or the file of a body is invalid.
        """
        from neurovis_spec.notebook.recording import played
        from neurovis_spec.runtime.record import record

        given = completed("run", options, MEMORY)
        course = course_of(self.network, steps, inputs, given)
        of = self.with_body(given["body"])
        return played(record(of.network, course, given["progress"]), self)

    def check_step(
        self,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        *,
        backend: str | None = None,
        every: int = 1,
        progress: Progress | None = None,
    ) -> StepCheck:
        """Run with dt, dt/2 and dt/4 and compare activities and states that flow, of each group: its ``errors`` have
        the largest differences at common times, of one step in ``every``, and the order that they show, or why there is
        none. Delays, events and rows of inputs take as long as before. Raises InputError, also for a network with a
        body, and what ``run`` raises."""
        from neurovis_spec.runtime.step_check import check_step

        given: MemoryKeywords = {**MEMORY, "backend": backend, "every": every, "progress": progress}
        return check_step(self.network, course_of(self.network, steps, inputs, given), progress)

    def live(
        self,
        recording: Recording | None = None,
        *,
        start: Recording | None = None,
        only: Literal["weights"] | None = None,
        theme: str | None = None,
        engine: str | None = None,
        backend: str | None = None,
        play: bool = True,
    ) -> LiveWidget:
        """A widget for a notebook: the network while it runs, in real time, or a ``recording`` of it that plays. Its
        parameters are traits: ``widget.mix = 0.4`` turns one, and one that is turned in the picture changes. ``start``
        is a recording to go on from, ``only`` as in ``run``; with ``play`` it plays as soon as it is shown. Raises
        ImportError without the extra ``jupyter``, and what ``layout``, ``run`` and ``simulator`` raise."""
        from neurovis_spec.live.show import Beginning, Show
        from neurovis_spec.notebook.widget import LiveWidget

        check(recording=recording, start=start, theme=theme, engine=engine, backend=backend)
        if recording is not None and (start is not None or backend is not None):
            raise ValueError("'start' and 'backend' are for a run, and a 'recording' is played: give one of the two")
        begin = Beginning(start, weights_alone(only))
        return LiveWidget(self, Show(recording, begin, theme, engine, backend), arguments.truth("play", play))

    def until(self, text: str) -> Until:
        """A measure that ends runs, ``rms(O - T, last=129) < 0.01``: its ``ending`` says how the last one ended. Raises
        SpecError."""
        from neurovis_spec.runtime.until import Until

        return Until(arguments.text("text", text), self.network)

    def measure(self, text: str, recording: Recording) -> FloatArray:
        """What a measure (``rms(O - T, last=129)``) is after each step of a recording of every step, (steps,): NaN
        while it has no value. Raises SpecError, RecordingError."""
        from neurovis_spec.runtime.measures import over
        from neurovis_spec.runtime.recording import Recording

        arguments.instance("recording", recording, Recording, "a recording")
        return over(arguments.text("text", text), self.network, recording)

    @keywords(RunKeywords, RUN)
    def run_to(
        self,
        path: str | Path,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        **options: Unpack[RunKeywords],
    ) -> str:
        """Run as ``run`` does and write the recording to a file while it is made, in memory that does not grow with the
        steps; gives the name of the backend. What was there stays until the end. Raises what ``run`` and
        ``Recording.save`` raise, RecordingError where the disk has not the room, and after Ctrl-C a KeyboardInterrupt;
        the file holds the steps until then. After any other exception a part beside the file holds them, which is read
        where the file is not there."""
        from neurovis_spec.runtime.stream import record_to

        given = completed("run_to", options, RUN)
        target = arguments.path("path", path)
        course = course_of(self.network, steps, inputs, {**given, "last": False})
        course = replace(course, keep=self._kept_in(target, course.keep))
        return record_to(self.with_body(given["body"]).network, target, course, given["progress"])

    def _kept_in(self, path: Path | None, keep: Keep) -> Keep:
        """What of a step is recorded in a file of this format."""
        return replace(keep, spec=self.text()) if path is not None and path.suffix.lower() == ".mcap" else keep

    def with_body(self, body: str | Path | bool) -> CompiledNetwork:
        """The network with the body of a YAML file (``body: {…}``) in place of its own; without one (False), or as it
        is (True). Raises SpecError."""
        given = arguments.body(body)
        if given is True:
            return self
        request = replace(self.request, body=given)
        if given is False:
            return replace(self, request=request, network=replace(self.network, body=None))
        findings = Findings(dict(self.sources))
        with uncollected():
            network = compile_spec(self.spec, request, findings)
        findings.check()
        assert network is not None
        files, sources = {**self.files, **findings.files}, dict(findings.sources)
        return replace(self, request=request, network=network, sources=sources, files=files)

    def refusal(self) -> Diagnostic | None:
        """What ``layout`` and all that draws would refuse, as far as that is known before an engine begins; None where
        there is nothing of the kind."""
        return pipeline.refusal(self.spec, self.request, self.network, lambda: self.problem)

    def layout(
        self,
        engine: str | None = None,
        *,
        effort: str | None = None,
        earlier: Layout | None = None,
        progress: Progress | None = None,
    ) -> NetworkLayout:
        """Where everything is. What an ``earlier`` layout knew (default: that of ``layout.file``) stays where it was.
        ``effort`` says how long ``layered`` may look for fewer crossings: quick, normal (the default) or best. Raises
        LayoutRefusalError where an engine cannot do what is asked; its ``diagnostic`` says where the spec asks for
        it."""
        check(engine=engine, effort=effort, earlier=earlier, progress=progress)
        return NetworkLayout(self, self.arranged(engine, effort, earlier, progress))

    def drawn(
        self, engine: str | None = None, effort: str | None = None, size: tuple[int, int] | None = None
    ) -> NetworkLayout:
        """The layout that pictures of this ``size``, or the spec's, are drawn in, by this engine or the spec's;
        computed once. Raises what ``layout`` raises."""
        check(engine=engine, effort=effort)
        return NetworkLayout(self, self.placed(engine, effort, None if size is None else size_of(size)))

    @keywords(StillKeywords, STILL)
    def render(self, path: str | Path, **options: Unpack[StillKeywords]) -> None:
        """Draw one step into a file whose suffix says what kind.

        Without ``step`` it is the last of the recording, or of a default run. Without ``recording`` the network runs
        as far as the step; ``inputs`` replace the sources of inputs, as in ``run``, and the gains are those of this
        run. ``view`` says what is shown, from top to bottom: ``network``, or its ``pathways``, a group a glyph, told
        in sentences, too; ``matrix``, ``traces``, ``raster``, ``weights``, alone or with references (``traces: C1, C2``
        or {"traces": ["C1", "C2"]}), and ``body``; by default it is the spec's ``figure``, else the network, with its
        body where there is one. Views over time show the whole recording or run, or ``window`` steps around the one
        that is drawn. ``effort`` is that of ``layout``. ``dpi`` are the pixels of an inch, 96 of which are a picture's
        usual size on the screen.

        ``collapse`` names groups and instances that are one glyph each in the picture of the network, ``focus``
        neurons that are shown with all they are connected to, ``paths`` (``"A -> B"``) what the shortest paths are
        shown of; connections below ``min_weight`` are left out. Of very many connections, and of those that would make
        an SVG larger than 5 MB, the weakest are left out, with a warning, unless it is to be ``full``. ``size`` are its
        width and height in pixels, for which it is laid out, by default the spec's. Raises
        RendererError for a kind that nobody draws, for a view, a name to be shown and a path that there is not,
        KeyError for an unknown reference, before anything is run.
        """
        given = completed("render", options, STILL)
        place = arguments.path("path", path)
        look = still_of(self, place, given)
        pipeline.draw(self, look, self._run_of(look, given), place, given["progress"])

    @keywords(FilmKeywords, FILM)
    def animate(self, path: str | Path, **options: Unpack[FilmKeywords]) -> None:
        """Draw ``steps`` steps from step ``start`` on, one in ``every`` a frame, into a file whose suffix says what
        kind.

        ``fps`` defaults to 1/dt, at most 60, and to 25 where the spec writes no dt. Without ``every`` all steps are
        drawn, of more than 3,000 (or ``frames``) one in so many that no more frames come out; a warning says which.
        ``inputs``, ``view`` and what is shown as in ``render``; views over time show the steps. Raises RendererError
        for a kind that nobody makes, for a film that is too long and a view that there is not, KeyError for an unknown
        reference, before anything is run.
        """
        given = completed("animate", options, FILM)
        place = arguments.path("path", path)
        look = film_of(self, place, given)
        pipeline.draw(self, look, self._run_of(look, given), place, given["progress"])

    def _run_of(self, look: Look, given: PictureKeywords) -> pipeline.Run:
        """The run that is drawn: the recording that is given, or one of its own."""
        recording = given["recording"]
        return pipeline.run_of(self, look, given["inputs"]) if recording is None else recording

    def needs_layout(self, view: View | Sequence[View] | None = None) -> bool:
        """Whether a picture of these views (default: the spec's ``figure``) needs the layout."""
        return pipeline.needs_layout(self.network, self._look(view))

    def steps_to_draw(
        self,
        step: int | None = None,
        recording: Recording | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        view: View | Sequence[View] | None = None,
    ) -> int:
        """How many steps ``render`` will run: none with a recording, else those up to the step and those that the gains
        take, in one run; with a view over time the whole default run."""
        if recording is not None:
            return 0
        return pipeline.run_of(self, replace(self._look(view), first=step), inputs).length(self.network)

    def _look(self, view: View | Sequence[View] | None = None) -> Look:
        """A picture of these views, as the spec has it."""
        from neurovis_spec.scene.look import Look, with_views

        return with_views(Look(self.network.render), panels_of(self.network, view))

    def _repr_svg_(self) -> str:
        """The network at the last step of its default run, for a notebook."""
        return pipeline.svg(self)

    def export(
        self, folder: str | Path, to: str = "c", *, start: Recording | None = None, real: str = "double"
    ) -> tuple[list[Path], list[Path]]:
        """Write the network into a folder: ``c`` is source code, C99 that is C++17, too, with numbers of type ``real``,
        double or float; ``csv`` are tables of its neurons and edges. ``start`` is a recording whose last weights (and,
        in C, activities) it begins with. Gives the files written, and those that were there and stay. Raises
        ExportError, RecordingError, OSError, ValueError."""
        from neurovis_spec.language.expressions.functions import PLAIN
        from neurovis_spec.runtime.c_package import files, write
        from neurovis_spec.runtime.resume import resumed_state

        if to not in ("c", "csv") or real not in ("double", "float"):
            raise ValueError(f"a network is exported to c, of double or float, or to csv, not to {to} of {real}")
        check(start=start)
        state = None if start is None else resumed_state(self.network, start, PLAIN, own_signals=True)
        if to == "csv":
            return self._export_tables(arguments.path("folder", folder), state), []
        return write(arguments.path("folder", folder), files(self.network, state, real))

    def _export_tables(self, folder: Path, state: State | None) -> list[Path]:
        """Write tables of neurons and edges, none of them over a file that the spec reads. Raises ExportError,
        OSError."""
        from neurovis_spec.language.tables import EdgeFile
        from neurovis_spec.real_paths import real_path
        from neurovis_spec.runtime.c_settable import ExportError
        from neurovis_spec.runtime.csv_tables import EdgeNames, csv_tables
        from neurovis_spec.runtime.files import replacing

        bodies = [body for _, body in self.spec.connections]
        names = EdgeNames.of(body.edges for body in bodies if isinstance(body.edges, EdgeFile))
        weights = self.network.connections.weights.whole() if state is None else state.weights
        texts = csv_tables(self.network, weights, names)
        paths = {folder / name: text for name, text in texts.items()}
        read = {real_path(path) for path in self.files}
        for path in paths:
            if real_path(path) in read:
                raise ExportError(f"{path} is a file that the spec reads, which would be lost: name another folder")
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in paths.items():
            with replacing(path) as file:
                file.write(text.encode())
        return [*paths]

    def choose_engine(self) -> tuple[str, str]:
        """The layout engine, and why."""
        from neurovis_spec.layout.choose import choose_engine

        engine = self.network.layout.engine
        if engine != "auto":
            return engine, "the spec names it"
        return choose_engine(self.problem)

    def choose_backend(self) -> tuple[str, str]:
        """The backend that runs it by default, and why; C has been compiled then, so that it is true. Raises
        BackendError."""
        from neurovis_spec.runtime.backend import ready

        made = ready(self.network)
        return made.name, made.why

    def describe(self) -> dict[str, object]:
        """What ``neurovis inspect --format json`` prints."""
        from neurovis_spec.describe import describe

        return describe(self.network, self.choose_engine())

    def pathways(self) -> list[str]:
        """What runs from group to group, a sentence each, as ``neurovis inspect --pathways`` prints it."""
        from neurovis_spec.scene.pathway_words import sentences

        return sentences(self.network)


@dataclass(frozen=True, eq=False)
class NetworkLayout:
    """The layout of a compiled network."""

    compiled: CompiledNetwork
    value: Layout

    def __repr__(self) -> str:
        return repr(self.value)

    @property
    def engine(self) -> str:
        """The engine that made it."""
        return self.value.engine

    @property
    def positions(self) -> Mapping[str, Point]:
        """Where each neuron is, by name, in units of the layout; x grows right, y grows down."""
        return self.value.positions

    @property
    def routes(self) -> Mapping[str, Route]:
        """How each connection runs, by name: a cubic Bézier spline of 1 + 3k points."""
        return self.value.routes

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What was noticed about it, such as frames that pins put on each other (``frames-overlap``)."""
        from neurovis_spec.layout.clashes import clashes

        own = self.compiled
        findings = Findings(dict(own.sources))
        found = clashes(own.problem, self.value)
        if found:
            from neurovis_spec.language.allow import drop_allowed
            from neurovis_spec.layout.where import note_clashes

            note_clashes(found, own.spec, own.request, own.network, findings)
            drop_allowed(findings)
        return findings.sorted()

    def metrics(self) -> dict[str, float | int]:
        """What ``neurovis layout --metrics`` prints, but for the seconds."""
        from neurovis_spec.layout.metrics import metrics

        problem = self.compiled.problem
        return metrics(self.value, replace(problem, direction=self.value.direction or problem.direction))

    def dump(self) -> str:
        """The layout file as a text."""
        from neurovis_spec.layout.file import dump

        return dump(self.value)

    def save(self, path: str | Path) -> None:
        """Write the layout file."""
        from neurovis_spec.runtime.files import replacing

        with replacing(arguments.path("path", path)) as file:
            file.write(self.dump().encode())

    def _repr_svg_(self) -> str:
        """The network in this layout, before anything happens, for a notebook."""
        return pipeline.svg_at_rest(self.compiled, self.value)
