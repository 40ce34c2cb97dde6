"""The whole way, from a text to a picture, on one page.

Each stage takes a value, gives a new one, and reaches back to none before it.

    text ─read─▶ SourceDocument ─shape─▶ Spec ─include─▶ Request, with what it includes
    Spec + Request ─build─▶ Network                                              (``compile``)

    Network + Course ─record─▶ Recording
    Network ─arrange─▶ Layout
    Network + Recording ─measure─▶ gains of Eqs. 2–5
    Network + Layout + Look + Recording + gains ─figure─▶ Film                   (``film``)
    Film, or one frame of it ─animate, draw─▶ bytes ─▶ file                      (``draw``)

A *Look* says which views a picture has and of which steps; a *gain* is the factor by which an activity or a weight
becomes a colour.

What is invalid in a text goes into Findings, all at once; ``Findings.check`` raises SpecError. A picture raises what
its stages raise, before anything is run where that is known. What only one half needs is imported there: a spec is
validated without all that runs and draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.compile import Request, compile_spec
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.gc_paused import uncollected
from neurovis_spec.language.includes import read_includes
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.yaml.reader import read_file, read_text
from neurovis_spec.progress import Progress

if TYPE_CHECKING:
    from neurovis_spec.layout.model import Layout, LayoutProblem
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.runtime.recording import Recording, Snapshot
    from neurovis_spec.scene import Film
    from neurovis_spec.scene.figure import PageGains
    from neurovis_spec.scene.files import Filmed
    from neurovis_spec.scene.gains import Gains
    from neurovis_spec.scene.look import Look

    #: A run: one that was recorded, or one that is to be made.
    Run: TypeAlias = Recording | Course


#: Frames of a film that are in memory at once: as many as make so many numbers, within these two counts.
_FEWEST_AT_ONCE, _MOST_AT_ONCE, _NUMBERS_AT_ONCE = 16, 512, 4_000_000


class Outcome(NamedTuple):
    """What a text became, as far as it could be read; what is None is invalid, and the findings say why. ``memory`` is
    the earlier layout that the spec names."""

    spec: Spec | None
    request: Request
    network: Network | None
    memory: Layout | None = None


def compile(source: str | Path, name: str, request: Request, findings: Findings) -> Outcome:
    """A text, or the file at a path, which findings call ``name``: all stages up to the network, in their order."""
    document = read_file(source, name, findings) if isinstance(source, Path) else read_text(source, name, findings)
    spec, network, memory = None, None, None
    with uncollected():
        if document is not None:
            spec = read_spec(document, findings)
        if spec is not None:
            includes = read_includes(spec, request.base, request.root, findings, request.read)
            request = replace(request, includes=includes)
            network = compile_spec(spec, request, findings)
    if spec is not None and network is not None:
        memory = remember(spec, request, network, findings)
        foresee(spec, network, findings)
    if spec is not None:
        gather(spec, request, findings)
    explain(findings)
    allow(findings)
    return Outcome(spec, request, network, memory)


def remember(spec: Spec, request: Request, network: Network, findings: Findings) -> Layout | None:
    """The earlier layout that the spec names, if it names one."""
    if spec.layout is None or spec.layout.file is None:
        return None
    from neurovis_spec.layout.file import read_memory

    return read_memory(spec.layout.file, request.base, request.root, network, findings)


def foresee(spec: Spec, network: Network, findings: Findings) -> None:
    """Warn of what the engine that the spec asks for will surely not lay out as it is meant."""
    if spec.layout is None or spec.layout.engine is None or not network.instances:
        return
    from neurovis_spec.layout.foreseen import foresee_frames

    foresee_frames(spec.layout.engine, network, findings)


def gather(spec: Spec, request: Request, findings: Findings) -> None:
    """Make one finding of all uses of a name that is declared nowhere; where a declaration is misspelt, at that one."""
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


def refusal(spec: Spec, request: Request, network: Network, problem: Callable[[], LayoutProblem]) -> Diagnostic | None:
    """What an engine would refuse before it begins, as an error at the place of the spec that asks for it; None where
    it refuses nothing. ``problem`` makes what the engine is given, and is called only where the spec has a layout."""
    if network.layout == LayoutSettings():
        return None
    from neurovis_spec.layout.foreseen import foreseen

    refused = foreseen(network, problem)
    if refused is None:
        return None
    from neurovis_spec.layout.where import where

    span = where(refused, spec, request, network) or Span(*spec.name.span)
    return Diagnostic(refused.code, str(refused), span, "error", refused.hint)


def run_of(of: Compilation, look: Look, inputs: Mapping[str, npt.ArrayLike] | None) -> Course:
    """The run that a picture needs where no recording is given. A film needs its frames; a still its step, the whole
    default run where it has views over time, and the steps of its gains where these come from the same run."""
    from neurovis_spec.runtime.columns import Keep
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.scene.probe import probe_steps
    from neurovis_spec.scene.series import states_of

    network = of.network
    if look.moving:
        steps = (look.first or 0) + look.count
    else:
        steps = network.steps if look.first is None else look.first + 1
        steps = max(steps, network.steps if look.timed else 0)
        steps = max(steps, 0 if inputs is None and seen_by(of, look).measured else probe_steps(network))
    states = states_of(look.panels, network) if look.panels else ()
    return Course(steps, inputs=inputs, keep=Keep(states=states))


def draw(of: Compilation, look: Look, run: Run, path: Path, progress: Progress | None = None) -> None:
    """A picture of a run as a file. Warns of what it leaves out. Raises RendererError, and what ``filmed`` raises."""
    from neurovis_spec.runtime.files import replacing
    from neurovis_spec.scene.files import content_of, noting
    from neurovis_spec.scene.renderers import renderer_for, streaming_renderer

    renderer = renderer_for(look.suffix, moving=look.moving)
    if look.moving and look.suffix in renderer.capabilities.streams:
        films = films_of(of, look, run, progress)
        with replacing(path, "part") as file:
            streaming_renderer(look.suffix).stream(noting(films), look.frames, look.suffix, file, progress)
        return
    film = filmed(of, look, run, progress)
    with replacing(path) as file:
        file.write(content_of(film, look, renderer, progress))


def filmed(of: Compilation, look: Look, run: Run, progress: Progress | None = None) -> Filmed:
    """What makes the Film of a network, a Look and a run for given settings; a still is its only frame. Raises
    LayoutRefusalError, RecordingError, and what ``record`` raises."""
    from neurovis_spec.scene.figure import figure
    from neurovis_spec.scene.shots import shots_of

    network = of.network
    layout = of.placed(look.engine, look.effort, look.settings.size) if needs_layout(network, look) else None
    recording = recorded(network, run, progress)
    seen = with_body_if_any(look, recording)
    shots = shots_of(network, recording, seen)
    gains = page_gains(of, seen, run, recording)
    return lambda settings: figure(network, layout, replace(seen, settings=settings), shots, gains)


def needs_layout(network: Network, look: Look) -> bool:
    """Whether a picture needs the layout of the network: one of its pathways alone has its own."""
    from neurovis_spec.scene.gathered_layout import laid_out_alone

    return look.shows("matrix") or (look.shows("network") and not laid_out_alone(network, look.settings))


def films_of(of: Compilation, look: Look, run: Run, progress: Progress | None = None) -> Iterator[Film]:
    """The same film in parts, each made when it is asked for. Of a picture of the network alone the run is made
    meanwhile, so that there may be any number of frames; one with panels is made as a whole."""
    if look.panels:
        return map(filmed(of, look, run, progress), [look.settings])
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.simulation import Simulation
    from neurovis_spec.scene.film import films
    from neurovis_spec.scene.shots import in_parts, shots_of, snapshots_of_run

    network = of.network
    layout = of.placed(look.engine, look.effort, look.settings.size) if needs_layout(network, look) else None
    gains = gains_by(seen_by(of, look), look, run)
    snapshots: Iterable[Snapshot]
    if isinstance(run, Recording):
        snapshots = shots_of(network, run, look).snapshots(network)
    else:
        snapshots = snapshots_of_run(Simulation(network, inputs=run.inputs), look)
    numbers = len(network.neurons) + 3 * len(network.connections)  # of a frame, about
    frames = max(_FEWEST_AT_ONCE, min(_MOST_AT_ONCE, _NUMBERS_AT_ONCE // numbers))
    return films(network, layout, in_parts(snapshots, frames), gains, look.settings, look.fps or 1.0)


def recorded(network: Network, run: Run, progress: Progress | None = None) -> Recording:
    """The recording of a run: the run itself, or what it records when it is made."""
    from neurovis_spec.runtime.record import record
    from neurovis_spec.runtime.recording import Recording

    return run if isinstance(run, Recording) else record(network, run, progress)


def with_body_if_any(look: Look, recording: Recording) -> Look:
    """A look without the body where nobody asks for it and the run has shown that it has none that can be drawn."""
    from neurovis_spec.scene.poses import posed_of

    if look.asked or posed_of(recording) is not None:
        return look
    return replace(look, panels=tuple(panel for panel in look.panels if panel.view != "body"))


def seen_by(of: Compilation, look: Look) -> Compilation:
    """The same network, with what the picture collapses as its own setting: gains are of what is collapsed."""
    if not look.settings.pathways and look.settings.collapse == of.network.render.collapse:
        return of
    return replace(of, network=replace(of.network, render=look.settings))


def page_gains(of: Compilation, look: Look, run: Run, recording: Recording) -> PageGains:
    """The gains of each neuron, and those of the picture with what it collapses; None where no view needs any, so that
    a partial recording, which has none, serves for the other views."""
    from neurovis_spec.runtime.fitting import fitted
    from neurovis_spec.scene.figure import PageGains
    from neurovis_spec.scene.probe import gains_of

    if not look.shows("network", "matrix", "raster"):
        return PageGains(None, None)
    seen = seen_by(of, look)
    each = picture = gains_by(seen, look, run, recording)
    if (look.settings.collapse or look.settings.pathways) and look.shows("matrix", "raster"):
        whole = replace(seen.network, render=replace(seen.network.render, collapse=(), pathways=False))
        each = gains_of(whole, fitted(recording, whole))
    return PageGains(each, picture)


def gains_by(of: Compilation, look: Look, run: Run, made: Recording | None = None) -> Gains:
    """The gains of what a picture shows. Those of a recording are of all its steps; those of a still of the run that
    was ``made`` for it; those of a film are of a run of their own, with its inputs."""
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.runtime.record import record
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.scene.probe import probe, probe_steps

    if isinstance(run, Recording):
        return of.gains_for(run)
    still = None if look.moving else made
    if run.inputs is None:
        return of.gains if still is None else of.gains_by(still)
    if still is None:
        still = record(of.network, Course(probe_steps(of.network), inputs=run.inputs))
    return probe(of.network, still)


def svg(of: Compilation) -> str:
    """The network at the last step of its default run, for a notebook."""
    from neurovis_spec.scene.files import notebook_svg
    from neurovis_spec.scene.look import Look

    look = Look(of.network.render)
    return notebook_svg(filmed(of, look, run_of(of, look, None)), look.settings)


def svg_at_rest(of: Compilation, layout: Layout) -> str:
    """The network in a layout before anything happens, for a notebook."""
    from neurovis_spec.runtime.recording import Snapshot
    from neurovis_spec.scene.files import notebook_svg
    from neurovis_spec.scene.film import film

    network = of.network
    snapshot = Snapshot(0, np.zeros(len(network.neurons)), network.connections.weights.whole(), None)
    return notebook_svg(lambda settings: film(network, layout, [snapshot], of.gains, settings), network.render)
