"""A compiled network, as users hold it: ``.run``, ``.layout``, ``.export``; what draws it is in ``pictures``.

In: what the compiler made of a spec. Out: recordings, layouts, files. What runs, lays out and draws is imported by who
does so: a spec is compiled, and thereby checked, without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments, pipeline
from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.limits import plural
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.spec import Spec
from neurovis_spec.pictures import Drawable, check, svg
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.files import replacing

if TYPE_CHECKING:
    from neurovis_spec.arrays import FloatArray
    from neurovis_spec.layout import Layout, LayoutProblem, Point, Route
    from neurovis_spec.notebook.widget import LiveWidget
    from neurovis_spec.runtime.columns import Keep
    from neurovis_spec.runtime.record import Course
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.simulation import Simulation
    from neurovis_spec.runtime.until import Until


def _keep(states: str | Sequence[str], neurons: str | Sequence[str], weights: str) -> Keep:
    """What of a step is recorded. Raises ValueError."""
    from neurovis_spec.runtime.columns import Keep

    if weights not in ("plastic", "none"):
        raise ValueError(f"weights are 'plastic' or 'none', not {weights!r}")
    return Keep(arguments.texts("neurons", neurons), weights == "plastic", arguments.texts("states", states))


@dataclass(frozen=True, eq=False)
class CompiledNetwork(Drawable):
    """A compiled network: run it, lay it out, draw it. ``network`` holds its arrays, ``warnings`` what was noticed."""

    spec: Spec
    request: Request
    warnings: tuple[Diagnostic, ...]
    sources: Mapping[str, str]
    #: the earlier layout that the spec names (``layout.file``)
    memory: Layout | None = None
    #: the files that the spec names, of data, included, and of the layout
    files: frozenset[Path] = frozenset()

    @property
    def layout_file(self) -> Path | None:
        """The file of the earlier layout that the spec names, which need not be there."""
        layout = self.spec.layout
        return None if layout is None or layout.file is None else self.request.base / layout.file.value

    @property
    def name(self) -> str:
        """The name that the spec gives it."""
        return self.network.name

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical network."""
        return self.network.hash

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

    def simulator(
        self,
        backend: str | None = None,
        *,
        start: Recording | None = None,
        record: str | Path | bool = False,
        every: int = 1,
        states: str | Sequence[str] = (),
        neurons: str | Sequence[str] = (),
        weights: Literal["plastic", "none"] = "plastic",
        body: str | Path | bool = True,
    ) -> Simulation:
        """Step by step, for a control loop; ``start`` is a recording to go on from, ``body`` as in ``run``.

        With ``record`` it leaves a recording (``sim.recording``), in memory or in a file that is there when the
        simulation is closed (``with network.simulator(record="walk.npz") as sim:``); what of it is recorded is chosen
        as in ``run``. Raises what ``run`` raises."""
        from neurovis_spec.runtime.simulation import Simulation

        check(backend=backend, start=start)
        made = Simulation(self.with_body(body).network, backend, start)
        if record is not False:
            target = None if record is True else arguments.path("record", record)
            made.record(target, every, self._kept_in(target, _keep(states, neurons, weights)))
        return made

    def run(
        self,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        *,
        backend: str | None = None,
        every: int = 1,
        start: Recording | None = None,
        until: str | Until | None = None,
        progress: Progress | None = None,
        states: str | Sequence[str] = (),
        neurons: str | Sequence[str] = (),
        weights: Literal["plastic", "none"] = "plastic",
        checkpoint: str | Path | None = None,
        last: bool = False,
        body: str | Path | bool = True,
    ) -> Recording:
        """Run ``steps`` steps (default ``time.steps``) and record every ``every``-th.

        ``inputs`` replace the sources of inputs: arrays of (steps,) or (steps, size). ``states`` are recorded as well
        (``K.v``, ``(K -> O).eligibility``), and so are those that outputs name; ``neurons`` (``O + K``) are the only
        ones that are recorded, ``weights="none"`` leaves the weights out. The run ends at the first step after which
        ``until`` is true (``"rms(O - T, last=129) < 0.01"``). ``checkpoint`` is a file from which the run goes on
        exactly, if it is there, and which holds its state at the end; ``steps`` are those to be made now. With ``last``
        the last of the steps that would be recorded is the only one, and memory does not grow with the steps. The
        network has the ``body`` of its spec; that of a YAML file in its place; none with ``body=False``. Raises
        InputError, BackendError, BodyError, RecordingError, KeyError for a name that there is not, SpecError where
        ``until`` or the file of a body is invalid.
        """
        check(backend=backend, start=start, progress=progress)
        keep = replace(_keep(states, neurons, weights), last=arguments.truth("last", last))
        course = self._course(steps, inputs, backend, every, until, keep)
        kept = None if checkpoint is None else arguments.path("checkpoint", checkpoint)
        from neurovis_spec.notebook.recording import played

        network = self.with_body(body).network
        return played(pipeline.simulate(network, course, start, progress, kept), self)

    def live(
        self,
        recording: Recording | None = None,
        *,
        start: Recording | None = None,
        theme: str | None = None,
        engine: str | None = None,
        backend: str | None = None,
        play: bool = True,
    ) -> LiveWidget:
        """A widget for a notebook: the network while it runs, in real time, or a ``recording`` of it that plays. Its
        parameters are traits: ``widget.mix = 0.4`` turns one, and one that is turned in the picture changes. ``start``
        is a recording to go on from; with ``play`` it plays as soon as it is shown. Raises ImportError without the
        extra ``jupyter``, and what ``layout``, ``run`` and ``simulator`` raise."""
        from neurovis_spec.notebook.widget import live

        check(recording=recording, start=start, theme=theme, engine=engine, backend=backend)
        if recording is not None and (start is not None or backend is not None):
            raise ValueError("'start' and 'backend' are for a run, and a 'recording' is played: give one of the two")
        return live(self, recording, start, theme, engine, backend, arguments.truth("play", play))

    def until(self, text: str) -> Until:
        """A measure that ends runs, ``rms(O - T, last=129) < 0.01``: its ``ending`` says how the last one ended. Raises
        SpecError."""
        from neurovis_spec.runtime.until import Until

        return Until(arguments.text("text", text), self.network)

    def measure(self, text: str, recording: Recording) -> FloatArray:
        """What a measure (``rms(O - T, last=129)``) is after each step of a recording of every step, (steps,): NaN
        while it has no value. Raises SpecError, RecordingError."""
        from neurovis_spec.runtime.recording import Recording

        arguments.instance("recording", recording, Recording, "a recording")
        return pipeline.gauge(self.network, arguments.text("text", text), recording)

    def run_to(
        self,
        path: str | Path,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        *,
        backend: str | None = None,
        every: int = 1,
        start: Recording | None = None,
        until: str | Until | None = None,
        progress: Progress | None = None,
        states: str | Sequence[str] = (),
        neurons: str | Sequence[str] = (),
        weights: Literal["plastic", "none"] = "plastic",
        checkpoint: str | Path | None = None,
        body: str | Path | bool = True,
    ) -> str:
        """Run as ``run`` does and write the recording to a file while it is made, in memory that does not grow with the
        steps; gives the name of the backend. What was there stays until the end. Raises what ``run`` and
        ``Recording.save`` raise, RecordingError where the disk has not the room, and after Ctrl-C a KeyboardInterrupt;
        the file holds the steps until then. After any other exception a part beside the file holds them, which is read
        where the file is not there."""
        check(backend=backend, start=start, progress=progress)
        target = arguments.path("path", path)
        keep = self._kept_in(target, _keep(states, neurons, weights))
        course = self._course(steps, inputs, backend, every, until, keep)
        kept = None if checkpoint is None else arguments.path("checkpoint", checkpoint)
        return pipeline.simulate_to(self.with_body(body).network, target, course, start, progress, kept)

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
        network = pipeline.build(self.spec, request, findings)
        findings.check()
        assert network is not None
        files, sources = self.files | findings.files, dict(findings.sources)
        return replace(self, request=request, network=network, sources=sources, files=files)

    def _course(
        self,
        steps: int | None,
        inputs: Mapping[str, npt.ArrayLike] | None,
        backend: str | None,
        every: int,
        until: str | Until | None,
        keep: Keep,
    ) -> Course:
        from neurovis_spec.runtime.record import Course

        ends = self.until(until) if isinstance(until, str) else until
        if ends is not None:
            from neurovis_spec.runtime.until import Until

            arguments.instance("until", ends, Until, "a text or an Until")
        if inputs is not None:
            arguments.mapping("inputs", inputs)
        whole = self.network.steps if steps is None else arguments.integer("steps", steps, 0, arguments.MOST_STEPS)
        return Course(whole, arguments.integer("every", every, 1, arguments.MOST_STEPS), inputs, backend, ends, keep)

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
        return NetworkLayout(self, self._arranged(engine, effort, earlier, progress))

    def _arranged(
        self,
        engine: str | None = None,
        effort: str | None = None,
        earlier: Layout | None = None,
        progress: Progress | None = None,
    ) -> Layout:
        from neurovis_spec.layout.model import LayoutRefusalError, effort_of

        try:
            problem = replace(self.problem, effort=effort_of(effort or "normal"))
            if earlier is not None:
                problem = replace(problem, memory=earlier)
            return pipeline.arrange(problem, engine or self.network.layout.engine, progress)
        except LayoutRefusalError as refusal:
            span = pipeline.locate(refusal, self.spec, self.request, self.network, engine)
            if span is not None:
                refusal.locate(span, self.sources)
            raise

    @cached_property
    def problem(self) -> LayoutProblem:
        """What a layout engine is given."""
        return pipeline.pose(self.network, self.memory)

    @cached_property
    def _layouts(self) -> dict[tuple[str | None, str], NetworkLayout]:
        return {}

    def drawn(self, engine: str | None = None, effort: str | None = None) -> NetworkLayout:
        """The layout that pictures are drawn in, by this engine or the spec's; computed once. Raises what ``layout``
        raises."""
        key = engine, effort or "normal"
        if key not in self._layouts:
            self._layouts[key] = self.layout(engine, effort=effort)
        return self._layouts[key]

    def placed(self, engine: str | None = None, effort: str | None = None) -> Layout:
        """The value of ``drawn``."""
        return self.drawn(engine, effort).value

    def export(
        self, folder: str | Path, to: str = "c", *, start: Recording | None = None, real: str = "double"
    ) -> tuple[list[Path], list[Path]]:
        """Write the network as source code into a folder: ``c`` is C99 that is C++17, too, with numbers of type
        ``real``, double or float. ``start`` is a recording whose last weights and activities it begins with. Gives the
        files written, and those that were there and stay. Raises ExportError, RecordingError, OSError, ValueError."""
        from neurovis_spec.language.expressions.functions import PLAIN
        from neurovis_spec.runtime.c_package import files, write
        from neurovis_spec.runtime.resume import resumed_state

        if to != "c" or real not in ("double", "float"):
            raise ValueError(f"a network is exported to c, of double or float, not to {to} of {real}")
        check(start=start)
        state = None if start is None else resumed_state(self.network, start, PLAIN)
        return write(arguments.path("folder", folder), files(self.network, state, real))

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
        own = self.compiled
        return pipeline.examine(self.value, own.problem, own.spec, own.request, own.network, own.sources).sorted()

    def metrics(self) -> dict[str, float | int]:
        """What ``neurovis layout --metrics`` prints, but for the seconds."""
        from neurovis_spec.layout.metrics import metrics

        return metrics(self.value, self.compiled.problem)

    def dump(self) -> str:
        """The layout file as a text."""
        from neurovis_spec.layout.file import dump

        return dump(self.value)

    def save(self, path: str | Path) -> None:
        """Write the layout file."""
        with replacing(arguments.path("path", path)) as file:
            file.write(self.dump().encode())

    def _repr_svg_(self) -> str:
        """The network in this layout, before anything happens, for a notebook."""
        from neurovis_spec.runtime.recording import Snapshot

        network = self.compiled.network
        snapshot = Snapshot(0, np.zeros(len(network.neurons)), network.connections.weights.whole(), None)
        return svg(network, self.value, snapshot, self.compiled.gains)
