"""The whole way, from a text to a picture, on one page.

Each function is one stage: it takes a value, gives a new one, and reaches back to none before it.

    text ─read─▶ SourceDocument ─shape─▶ Spec ─include─▶ Includes
    Spec + Includes ─build─▶ Network ─simulate─▶ Recording ─▶ Snapshot
                                └─pose─▶ LayoutProblem ─arrange─▶ Layout                │
    Network + Layout + Snapshot ─encode (Eqs. 2–5)─▶ Scene ─draw─▶ bytes of a picture
    Network + Layout + Snapshots ─film─▶ Film ─animate─▶ bytes of a moving one

``compile`` is the first four in their order. What they find invalid goes into Findings, all at once;
``Findings.check`` raises SpecError.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from neurovis_spec.compiler.compile import Request, compile_spec
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings, Panel, RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.gc_paused import uncollected
from neurovis_spec.language.includes import read_includes
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.yaml.reader import read_file, read_text
from neurovis_spec.language.yaml.source import SourceDocument
from neurovis_spec.progress import Progress

if TYPE_CHECKING:  # what only some stages need is imported there: a spec is validated without all of it
    from neurovis_spec.arrays import FloatArray
    from neurovis_spec.layout.model import Layout, LayoutProblem, LayoutRefusalError
    from neurovis_spec.runtime.record import Course
    from neurovis_spec.runtime.recording import Recording, Snapshot
    from neurovis_spec.scene import Film, Scene
    from neurovis_spec.scene.gains import Gains
    from neurovis_spec.scene.shots import Shots


def read(path: Path, name: str, findings: Findings) -> SourceDocument | None:
    """YAML becomes values that know their line."""
    return read_file(path, name, findings)


def read_string(text: str, name: str, findings: Findings) -> SourceDocument | None:
    """The same for a text in memory."""
    return read_text(text, name, findings)


def shape(document: SourceDocument, findings: Findings) -> Spec | None:
    """The shape as written: known keys, the right kind of value at each."""
    with uncollected():
        return read_spec(document, findings)


def include(spec: Spec, request: Request, findings: Findings) -> Request:
    """The request with the files whose modules and definitions the spec uses."""
    return replace(request, includes=read_includes(spec, request.base, request.root, findings, request.read))


def build(spec: Spec, request: Request, findings: Findings) -> Network | None:
    """Expand, connect, check, lower: frozen arrays and an update program."""
    with uncollected():
        return compile_spec(spec, request, findings)


class Outcome(NamedTuple):
    """What a text became, as far as it could be read; what is None is invalid, and the findings say why. ``memory`` is
    the earlier layout that the spec names."""

    spec: Spec | None
    request: Request
    network: Network | None
    memory: Layout | None = None


def compile(document: SourceDocument | None, request: Request, findings: Findings) -> Outcome:
    """All stages up to the network, in their order."""
    spec = None if document is None else shape(document, findings)
    network = memory = None
    if spec is not None:
        request = include(spec, request, findings)
        network = build(spec, request, findings)
        if network is not None:
            memory = remember(spec, request, network, findings)
            foresee(spec, network, findings)
        gather(spec, request, findings)
    explain(findings)
    allow(findings)
    return Outcome(spec, request, network, memory)


def gather(spec: Spec, request: Request, findings: Findings) -> None:
    """Of the uses of a name that is declared nowhere make one finding, at the declaration where one is misspelt."""
    if findings.failed:
        from neurovis_spec.compiler.checks.undeclared import gather_undeclared

        files = (included.model.source for included in request.includes.files)
        gather_undeclared((spec.source, *files), findings)


def explain(findings: Findings) -> None:
    """Name characters that look like others, or like nothing, in what is invalid."""
    if findings.failed and not all(map(str.isascii, findings.sources.values())):
        from neurovis_spec.language.strange import name_characters

        name_characters(findings)


def allow(findings: Findings) -> None:
    """Take out the warnings that comments allow on their lines."""
    if any("allow" in text for text in findings.sources.values()):
        from neurovis_spec.language.allow import silence

        silence(findings)


def simulate(
    network: Network,
    course: Course,
    start: Recording | None = None,
    progress: Progress | None = None,
    checkpoint: Path | None = None,
) -> Recording:
    """Run the update program, record activities and weights."""
    from neurovis_spec.runtime.record import record_course

    return record_course(network, course, start, progress, checkpoint)


def simulate_to(
    network: Network,
    path: Path,
    course: Course,
    start: Recording | None = None,
    progress: Progress | None = None,
    checkpoint: Path | None = None,
) -> str:
    """The same, written to a file while it runs; gives the name of the backend."""
    from neurovis_spec.runtime.stream import record_to

    return record_to(network, path, course, start, progress, checkpoint)


def gauge(network: Network, text: str, recording: Recording) -> FloatArray:
    """A measure after each step of a recording."""
    from neurovis_spec.runtime.gauge import over

    return over(text, network, recording)


def remember(spec: Spec, request: Request, network: Network, findings: Findings) -> Layout | None:
    """The earlier layout that the spec names, if it names one."""
    if spec.layout is None or spec.layout.file is None:
        return None
    from neurovis_spec.layout.remember import read_memory

    return read_memory(spec.layout.file, request.base, request.root, network, findings)


def foresee(spec: Spec, network: Network, findings: Findings) -> None:
    """What the layout will surely not be as it is meant."""
    if spec.layout is None or spec.layout.engine is None or not network.instances:
        return
    from neurovis_spec.layout.foreseen import foresee_frames

    foresee_frames(spec.layout.engine, network, findings)


def refusal(spec: Spec, request: Request, network: Network, problem: Callable[[], LayoutProblem]) -> Diagnostic | None:
    """What laying it out would refuse before the engine begins, and where the spec asks for it. The ``problem`` is
    asked for where the spec says anything of its layout."""
    if network.layout == LayoutSettings():
        return None
    from neurovis_spec.layout.foreseen import foreseen

    found = foreseen(network, problem)
    if found is None:
        return None
    span = locate(found, spec, request, network) or Span(*spec.name.span)
    return Diagnostic(found.code, str(found), span, "error", found.hint)


def pose(network: Network, memory: Layout | None = None) -> LayoutProblem:
    """What a layout engine is given: neurons, connections, what the spec asks for, an earlier layout (``memory``)."""
    from neurovis_spec.layout.problem import problem_of

    return problem_of(network, memory)


def arrange(problem: LayoutProblem, engine: str = "auto", progress: Progress | None = None) -> Layout:
    """A position for every neuron, a route for every connection."""
    from neurovis_spec.layout.arrange import lay_out_problem

    return lay_out_problem(problem, engine, progress)


def examine(
    layout: Layout,
    problem: LayoutProblem,
    spec: Spec,
    request: Request,
    network: Network,
    sources: Mapping[str, str],
) -> Findings:
    """What in a layout is surely not as it is meant: warnings, but for those that are allowed."""
    from neurovis_spec.layout.clashes import clashes

    findings = Findings(dict(sources))
    found = clashes(problem, layout)
    if found:
        from neurovis_spec.language.allow import drop_allowed
        from neurovis_spec.layout.where import note_clashes

        note_clashes(found, spec, request, network, findings)
        drop_allowed(findings)
    return findings


def locate(
    refusal: LayoutRefusalError, spec: Spec, request: Request, network: Network, engine: str | None = None
) -> Span | None:
    """Where the spec says what an engine refuses; ``engine`` is the one that was chosen in place of the spec's."""
    from neurovis_spec.layout.where import where

    return where(refusal, spec, request, network, engine)


def measure(network: Network, progress: Progress | None = None, made: Recording | None = None) -> Gains:
    """The gains of Eqs. 2–5: the author's, else such that the range of a default run shows, which may be ``made``."""
    from neurovis_spec.scene.probe import probe

    return probe(network, progress, made)


def measure_recording(network: Network, recording: Recording) -> Gains:
    """The same for a recording that is drawn: from all of its steps."""
    from neurovis_spec.scene.probe import gains_of

    return gains_of(network, recording)


def picture(network: Network, layout: Layout, snapshot: Snapshot, gains: Gains, settings: RenderSettings) -> Scene:
    """One step as discs, splines and texts."""
    from neurovis_spec.scene.encode import encode

    return encode(network, layout, snapshot, gains, settings)


def moving(
    network: Network,
    layout: Layout,
    snapshots: Collection[Snapshot],
    gains: Gains,
    settings: RenderSettings,
    fps: float,
) -> Film:
    """Several steps as a scene whose colours and widths change."""
    from neurovis_spec.scene.film import film

    return film(network, layout, snapshots, gains, settings, fps)


def moving_in_parts(
    network: Network,
    layout: Layout,
    parts: Iterable[Collection[Snapshot]],
    gains: Gains,
    settings: RenderSettings,
    fps: float,
) -> Iterator[Film]:
    """The same, each part made when it is asked for."""
    from neurovis_spec.scene.film import films

    return films(network, layout, parts, gains, settings, fps)


def shot_of(network: Network, recording: Recording, step: int | None, window: int | None) -> Shots:
    """A step, by default the last, and those around it that views over time show: ``window`` of them, or all."""
    from neurovis_spec.scene.shots import shot_of

    return shot_of(network, recording, step, window)


def shots_of(recording: Recording, steps: Sequence[int]) -> Shots:
    """The steps of a film, which views over time show."""
    from neurovis_spec.scene.shots import shots_of

    return shots_of(recording, steps)


def page(
    network: Network,
    layout: Layout | None,
    panels: Sequence[Panel],
    shots: Shots,
    gains: Gains | None,
    settings: RenderSettings,
    fps: float,
    glyphs: Gains | None = None,
) -> Film:
    """Several views on one page, as a film; of one step a film of one frame. ``glyphs`` are the gains of the picture of
    the network where something is collapsed in it."""
    from neurovis_spec.scene.figure import figure

    return figure(network, layout, panels, shots, gains, settings, fps, glyphs)


def frame(moving_scene: Film, number: int) -> Scene:
    """A frame of a film as a scene."""
    from neurovis_spec.scene.film import still

    return still(moving_scene, number)


def draw(scene: Scene, suffix: str) -> bytes:
    """A scene as the content of a file of this kind. Raises RendererError where nobody draws such files."""
    from neurovis_spec.scene.renderers import renderer_for

    return renderer_for(suffix, moving=False).draw(scene, suffix.lower())


def animate(moving_scene: Film, suffix: str, progress: Progress | None = None) -> bytes:
    """A film as the content of a file of this kind. Raises RendererError where nobody makes such films."""
    from neurovis_spec.scene.renderers import renderer_for

    return renderer_for(suffix, moving=True).animate(moving_scene, suffix.lower(), progress)


def stream(films: Iterator[Film], frames: int, suffix: str, file: BinaryIO, progress: Progress | None = None) -> None:
    """A film in parts as a file of this kind, written while it is made. Raises RendererError."""
    from neurovis_spec.scene.model import StreamingRenderer
    from neurovis_spec.scene.renderers import renderer_for

    renderer = renderer_for(suffix, moving=True)
    assert isinstance(renderer, StreamingRenderer)
    renderer.stream(films, frames, suffix.lower(), file, progress)
