"""Pictures of a network: stills, films, and the gains that they need.

In: what can be run and laid out. Out: files whose suffix says what kind, of scenes that are bounded in size; warnings
of what a picture leaves out.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Self
from weakref import WeakKeyDictionary

import numpy.typing as npt

from neurovis_spec import arguments, pipeline
from neurovis_spec.compiler.drawing.drawing_settings import Panel, RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.words import TIMED
from neurovis_spec.likeness import suggest
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.files import replacing

if TYPE_CHECKING:
    from neurovis_spec.layout import Layout
    from neurovis_spec.runtime.recording import Recording, Snapshot
    from neurovis_spec.scene import Film, Scene
    from neurovis_spec.scene.excerpt import Excerpt
    from neurovis_spec.scene.gains import Gains
    from neurovis_spec.scene.panels import View

#: Frames of a film that are held at once, and how many numbers they are about.
_FEWEST_AT_ONCE, _MOST_AT_ONCE, _NUMBERS_AT_ONCE = 16, 512, 4_000_000
#: The largest SVG, in bytes, with as many connections as there are.
_LARGEST_SVG = 5_000_000


@dataclass(frozen=True, eq=False)
class Drawable(ABC):
    """A network that can be drawn, since it can be run and laid out."""

    network: Network

    @abstractmethod
    def run(
        self,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        *,
        progress: Progress | None = None,
        states: str | Sequence[str] = (),
    ) -> Recording:
        """A run of its own."""

    @abstractmethod
    def placed(self, engine: str | None = None, effort: str | None = None) -> Layout:
        """The layout that pictures are drawn in."""

    @cached_property
    def gains(self) -> Gains:
        """The gains of Eqs. 2–5 for this network: the author's, else from the range of its default run."""
        return pipeline.measure(self.network)

    def render(
        self,
        path: str | Path,
        *,
        step: int | None = None,
        recording: Recording | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        theme: str | None = None,
        engine: str | None = None,
        effort: str | None = None,
        view: View | Sequence[View] | None = None,
        window: int | None = None,
        dpi: float | None = None,
        progress: Progress | None = None,
        collapse: str | Sequence[str] = (),
        focus: str | None = None,
        paths: str | None = None,
        min_weight: float | None = None,
        full: bool = False,
    ) -> None:
        """Draw one step into a file whose suffix says what kind.

        Without ``step`` it is the last of the recording, or of a default run. Without ``recording`` the network runs
        as far as the step; ``inputs`` replace the sources of inputs, as in ``run``, and the gains are those of this
        run. ``view`` says what is shown, from top to bottom: ``network``, ``matrix``, ``traces``, ``raster``,
        ``weights``, alone or with references (``traces: C1, C2`` or {"traces": ["C1", "C2"]}), and ``body``; by default
        it is the spec's ``figure``, else the network, with its body where there is one. Views over time show the whole
        recording or run, or ``window`` steps around the one that is drawn. ``effort`` is that of ``layout``. ``dpi``
        are the pixels of an inch, 96 of which are a picture's usual size on the screen.

        ``collapse`` names groups and instances that are one glyph each in the picture of the network, ``focus``
        neurons that are shown with all they are connected to, ``paths`` (``"A -> B"``) what the shortest paths are
        shown of; connections below ``min_weight`` are left out. Of very many connections, and of those that would make
        an SVG larger than 5 MB, the weakest are left out, with a warning, unless it is to be ``full``. Raises
        RendererError for a kind that nobody draws, for a view, a name to be shown and a path that there is not,
        KeyError for an unknown reference, before anything is run.
        """
        from neurovis_spec.scene.renderers import renderer_for

        check(recording=recording, inputs=inputs, theme=theme, engine=engine, effort=effort, progress=progress)
        place, wanted = arguments.path("path", path), None if step is None else arguments.integer("step", step)
        renderer_for(suffix := place.suffix, moving=False)
        density = None if dpi is None else _density(dpi)
        panels = self._panels(view, recording)
        seen, settings = self._seen(theme, _excerpt(collapse, focus, paths, min_weight, full), panels)
        if window is not None:
            settings = replace(settings, window=arguments.integer("window", window, 1))
        layout = self._placed(panels, engine, effort)
        picture: Callable[[RenderSettings], Scene]
        if panels:
            if recording is not None:
                shown, glyphs = recording, seen._gains_of(panels, recording)
            else:
                shown, glyphs = seen._ran(self._steps_of(panels, wanted), inputs, panels, progress)
            panels = self._posed(panels, view, shown)
            some = seen._whole_gains(panels, glyphs, shown)
            shots = pipeline.shot_of(self.network, shown, wanted, settings.window)

            def picture(settings: RenderSettings) -> Scene:
                return pipeline.frame(
                    pipeline.page(self.network, layout, panels, shots, some, settings, 1.0, glyphs), 0
                )
        else:
            assert layout is not None
            snapshot, gains = seen._snapshot(wanted, recording, progress, inputs)
            picture = partial(pipeline.picture, self.network, layout, snapshot, gains)

        def draw(settings: RenderSettings) -> tuple[Scene, bytes]:
            scene = picture(settings)
            return scene, pipeline.draw(scene if density is None else _denser(scene, density), suffix)

        content = _bounded(draw, settings, suffix)
        with replacing(place) as file:
            file.write(content)

    def animate(
        self,
        path: str | Path,
        *,
        steps: int | None = None,
        start: int = 0,
        fps: float | None = None,
        every: int | None = None,
        frames: int | None = None,
        recording: Recording | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        theme: str | None = None,
        engine: str | None = None,
        view: View | Sequence[View] | None = None,
        progress: Progress | None = None,
        collapse: str | Sequence[str] = (),
        focus: str | None = None,
        paths: str | None = None,
        min_weight: float | None = None,
        full: bool = False,
    ) -> None:
        """Draw ``steps`` steps from step ``start`` on, one in ``every`` a frame, into a file whose suffix says what
        kind.

        ``fps`` defaults to 1/dt, at most 60, and to 25 where the spec writes no dt. Without ``every`` all steps are
        drawn, of more than 3,000 (or ``frames``) one in so many that no more frames come out; a warning says which.
        ``inputs``, ``view`` and what is shown as in ``render``; views over time show the steps. Raises RendererError
        for a kind that nobody makes, for a film that is too long and a view that there is not, KeyError for an unknown
        reference, before anything is run.
        """
        from neurovis_spec.runtime.simulation import Simulation
        from neurovis_spec.scene.film_size import check_film, frames_a_second, thinned
        from neurovis_spec.scene.renderers import renderer_for
        from neurovis_spec.snapshots import in_parts, snapshots_from, snapshots_of_run, steps_from

        check(recording=recording, inputs=inputs, theme=theme, engine=engine, progress=progress)
        place, first = arguments.path("path", path), arguments.integer("start", start, most=arguments.MOST_STEPS)
        count = None if steps is None else arguments.integer("steps", steps, most=arguments.MOST_STEPS)
        each = None if every is None else arguments.integer("every", every, 1, arguments.MOST_STEPS)
        most = None if frames is None else arguments.integer("frames", frames, 1, arguments.MOST_STEPS)
        capabilities = renderer_for(suffix := place.suffix.lower(), moving=True).capabilities
        if fps is None:
            fps = frames_a_second(self.network)
        if not (math.isfinite(arguments.number("fps", fps)) and fps > 0):
            raise ValueError(f"frames a second are above 0, not {fps}")
        panels = self._panels(view, recording)
        seen, settings = self._seen(theme, _excerpt(collapse, focus, paths, min_weight, full), panels)
        span = steps_from(self.network, first, count, recording)
        stride = thinned(span, each, most)
        shown = -(-span // stride)
        check_film(self.network, shown, suffix, capabilities)
        if stride > 1 and each is None and most is None:
            warnings.warn(_thinned(span, stride, shown, fps), stacklevel=2)
        layout, streams = self._placed(panels, engine), suffix in capabilities.streams
        made = recording
        if recording is None and (panels or not streams):
            made = self.run(first + span, inputs, progress=progress, states=self._states(panels))
        film: Callable[[RenderSettings], Film]
        films: Iterator[Film]
        if panels:
            assert made is not None
            panels = self._posed(panels, view, made)
            chosen = snapshots_from(self.network, first, count, made, stride)
            shots = pipeline.shots_of(chosen.recording, chosen.steps)
            glyphs = seen._gains_of(panels, recording, inputs)
            some = seen._whole_gains(panels, glyphs, made)

            def film(settings: RenderSettings) -> Film:
                return pipeline.page(self.network, layout, panels, shots, some, settings, fps, glyphs)

            films = map(film, [settings])
        else:
            assert layout is not None
            gains = seen.gains_for(recording, inputs)
            if made is None:
                snapshots = snapshots_of_run(Simulation(self.network, inputs=inputs), first, span, stride)
            else:
                chosen = snapshots_from(self.network, first, count, made, stride)
                snapshots = iter(chosen)

                def film(settings: RenderSettings) -> Film:
                    return pipeline.moving(self.network, layout, chosen, gains, settings, fps)

            wide = len(self.network.neurons) + 3 * len(self.network.connections)
            many = max(_FEWEST_AT_ONCE, min(_MOST_AT_ONCE, _NUMBERS_AT_ONCE // wide))
            parts = in_parts(snapshots, many)
            films = pipeline.moving_in_parts(self.network, layout, parts, gains, settings, fps)

        def draw(settings: RenderSettings) -> tuple[Scene, bytes]:
            made = film(settings)
            return made.scene, pipeline.animate(made, suffix, progress)

        with replacing(place, "part" if streams else "neurovis-new") as file:
            if streams:
                pipeline.stream(_noting(films), shown, suffix, file, progress)
            else:
                file.write(_bounded(draw, settings, suffix))

    def _seen(self, theme: str | None, excerpt: Excerpt, panels: Sequence[Panel]) -> tuple[Self, RenderSettings]:
        """How it is to be drawn; and the same network, whose gains are those of what is collapsed."""
        from neurovis_spec.scene.excerpt import excerpted

        settings = excerpted(self.network, self.settings_for(theme), excerpt)
        if not _shows(panels, "network"):
            settings = replace(settings, collapse=())
        if settings.collapse == self.network.render.collapse:
            return self, settings
        return replace(self, network=replace(self.network, render=settings)), settings

    def settings_for(self, theme: str | None) -> RenderSettings:
        """How it is drawn, in a theme of this name. Raises RendererError for one that there is not."""
        from neurovis_spec.scene.renderers import RendererError
        from neurovis_spec.themes import THEMES

        if theme is not None and theme not in THEMES:
            raise RendererError(f"there is no theme '{theme}'", suggest(theme, THEMES, "there are"))
        return self.network.render if theme is None else replace(self.network.render, theme=theme, colours=())

    def _panels(self, view: View | Sequence[View] | None, recording: Recording | None = None) -> tuple[Panel, ...]:
        """The views of a picture; none where it is the network alone. By default the body stands below the network, of
        a recording where it holds its poses."""
        if view is None and not self.network.render.figure:
            embodied = self.network.body is not None if recording is None else _is_posed(recording)
            return (Panel("network"), Panel("body")) if embodied else ()
        from neurovis_spec.scene.panels import panels_of

        return panels_of(self.network, view)

    def _posed(
        self, panels: tuple[Panel, ...], view: View | Sequence[View] | None, shown: Recording
    ) -> tuple[Panel, ...]:
        """The views of a picture, without the body where nobody asks for it and the run has shown that it has none that
        can be drawn."""
        asked = view is not None or self.network.render.figure
        return panels if asked or _is_posed(shown) else tuple(panel for panel in panels if panel.view != "body")

    def _states(self, panels: Sequence[Panel]) -> tuple[str, ...]:
        """The states that views show."""
        if not panels:
            return ()
        from neurovis_spec.scene.series import states_of

        return states_of(panels, self.network)

    def needs_layout(self, view: View | Sequence[View] | None = None) -> bool:
        """Whether a picture of these views (default: the spec's ``figure``) needs the layout."""
        return _shows(self._panels(view), "network", "matrix")

    def _placed(self, panels: Sequence[Panel], engine: str | None, effort: str | None = None) -> Layout | None:
        """The layout, where one of the views needs it."""
        return self.placed(engine, effort) if _shows(panels, "network", "matrix") else None

    def _steps_of(self, panels: Sequence[Panel], step: int | None) -> int:
        """How many steps a picture of a step takes: views over time show the whole run."""
        wanted = self.network.steps if step is None else step + 1
        timed = any(panel.view in TIMED for panel in panels)
        return max(wanted, self.network.steps) if timed else wanted

    def _ran(
        self,
        steps: int,
        inputs: Mapping[str, npt.ArrayLike] | None,
        panels: Sequence[Panel],
        progress: Progress | None,
    ) -> tuple[Recording, Gains]:
        """One run of so many steps that serves a picture and its gains."""
        steps = max(steps, self._gain_steps if inputs is None else self._probe_steps)
        made = self.run(steps, inputs, progress=progress, states=self._states(panels))
        if inputs is not None:
            return made, pipeline.measure(self.network, made=made)
        if self._gain_steps:
            self.__dict__["gains"] = pipeline.measure(self.network, made=made)
        return made, self.gains

    def _snapshot(
        self,
        step: int | None = None,
        recording: Recording | None = None,
        progress: Progress | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
    ) -> tuple[Snapshot, Gains]:
        from neurovis_spec.snapshots import snapshot_at

        if recording is not None or (step is not None and step < 0):
            return snapshot_at(self.network, step, recording, self.run), self.gains_for(recording)
        wanted = self.network.steps if step is None else step + 1
        made, gains = self._ran(wanted, inputs, (), progress)
        return snapshot_at(self.network, wanted - 1, made, self.run), gains

    def _gains_of(
        self, panels: Sequence[Panel], recording: Recording | None, inputs: Mapping[str, npt.ArrayLike] | None = None
    ) -> Gains | None:
        """The gains, where one of the views needs them: what was recorded in part serves the others."""
        return self.gains_for(recording, inputs) if _shows(panels, "network", "matrix", "raster") else None

    def _whole_gains(self, panels: Sequence[Panel], glyphs: Gains | None, shown: Recording) -> Gains | None:
        """The gains of the views that show each neuron also where the picture of the network has ``glyphs``."""
        if not (self.network.render.collapse and _shows(panels, "matrix", "raster")):
            return glyphs
        from neurovis_spec.runtime.fitting import fitted

        whole = replace(self.network, render=replace(self.network.render, collapse=()))
        return pipeline.measure_recording(whole, fitted(shown, whole))

    def gains_for(self, recording: Recording | None, inputs: Mapping[str, npt.ArrayLike] | None = None) -> Gains:
        """The gains of pictures of a recording, or of runs of its own, perhaps with other inputs."""
        if inputs is not None:
            return pipeline.measure(self.network, made=self.run(self._probe_steps, inputs))
        if recording is None:
            return self.gains
        if recording not in self._recorded:
            from neurovis_spec.runtime.fitting import fitted

            self._recorded[recording] = pipeline.measure_recording(self.network, fitted(recording, self.network))
        return self._recorded[recording]

    @cached_property
    def _recorded(self) -> WeakKeyDictionary[Recording, Gains]:
        """The gains of the recordings that were drawn, while these are in use."""
        return WeakKeyDictionary()

    @property
    def _probe_steps(self) -> int:
        """The steps to run for gains."""
        from neurovis_spec.scene.probe import probe_steps

        return probe_steps(self.network)

    @property
    def _gain_steps(self) -> int:
        """The steps to run for the gains: 0 where these are known."""
        return 0 if "gains" in self.__dict__ else self._probe_steps

    def steps_to_draw(
        self,
        step: int | None = None,
        recording: Recording | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        view: View | Sequence[View] | None = None,
    ) -> int:
        """How many steps ``render`` will run: none with a recording, else those up to the step and those that the gains
        take, in one run; with a view over time the whole default run."""
        wanted = self._steps_of(self._panels(view), step)
        return 0 if recording is not None else max(wanted, self._gain_steps if inputs is None else self._probe_steps)

    def _repr_svg_(self) -> str:
        """The network at the last step of its default run, for a notebook."""
        snapshot, gains = self._snapshot()
        return svg(self.network, self.placed(), snapshot, gains)


#: How wide a picture is in a notebook at most, in pixels: JupyterLab cuts off what is wider than its column.
_CELL = 900.0
#: pixels of an inch where a user unit is one pixel, and the most that are drawn of a picture
_CSS, _MOST_PIXELS = 96.0, 1 << 28


def _density(dpi: float) -> float:
    """Pixels of a user unit for so many dots an inch. Raises ValueError."""
    if not (math.isfinite(arguments.number("dpi", dpi)) and dpi > 0):
        raise ValueError(f"dots an inch are above 0, not {dpi}")
    return dpi / _CSS


def _denser(scene: Scene, density: float) -> Scene:
    """A scene of another density. Raises RendererError for one that is too large."""
    from neurovis_spec.scene.renderers import RendererError

    result = replace(scene, density=density)
    wide, high = result.pixels
    if wide * high > _MOST_PIXELS:
        most = int(_CSS * math.sqrt(_MOST_PIXELS / (scene.width * scene.height)))
        raise RendererError(f"a picture of {wide:,} × {high:,} pixels is too large", f"take at most {most} an inch")
    return result


def _thinned(steps: int, every: int, frames: int, fps: float) -> str:
    return (
        f"of {steps:,} steps one in {every} is drawn: {frames:,} frames, {frames / fps:.4g} s at {fps:.4g} a second "
        f"(every=1, on the command line --every 1, draws all)"
    )


def _excerpt(
    collapse: str | Sequence[str], focus: str | None, paths: str | None, min_weight: float | None, full: bool
) -> Excerpt:
    """What is to be seen. Raises TypeError for what says nothing of the kind."""
    from neurovis_spec.scene.excerpt import Excerpt

    return Excerpt(
        arguments.texts("collapse", collapse),
        None if focus is None else arguments.text("focus", focus),
        None if paths is None else arguments.text("paths", paths),
        None if min_weight is None else arguments.number("min_weight", min_weight),
        arguments.truth("full", full),
    )


def _bounded(draw: Callable[[RenderSettings], tuple[Scene, bytes]], settings: RenderSettings, suffix: str) -> bytes:
    """The file of a picture, an SVG with so many connections as make it no larger than 5 MB, unless all are asked for,
    or it is larger without any; and a warning for each note in it."""
    scene, content = draw(settings)
    if suffix.lower() == ".svg" and not settings.full and len(content) > _LARGEST_SVG:
        lines = sum("connection" in group.data for group in scene.groups)
        bare = len(draw(replace(settings, most=0))[1]) if lines else len(content)
        for _ in range(3 if bare <= _LARGEST_SVG else 0):  # strong lines may take more room than weak ones
            if len(content) <= _LARGEST_SVG or not lines:
                break
            lines = max(0, int(0.98 * lines * (_LARGEST_SVG - bare) / max(len(content) - bare, 1)))
            scene, content = draw(replace(settings, most=lines))
    _note(scene)
    return content


def svg(network: Network, layout: Layout, snapshot: Snapshot, gains: Gains) -> str:
    """The picture of a step for a notebook: a pixel a unit, but no wider than a cell, and no larger than a file."""

    def draw(settings: RenderSettings) -> tuple[Scene, bytes]:
        scene = pipeline.picture(network, layout, snapshot, gains, settings)
        return scene, pipeline.draw(replace(scene, density=min(1.0, _CELL / scene.width)), ".svg")

    return _bounded(draw, network.render, ".svg").decode()


def _noting(films: Iterator[Film]) -> Iterator[Film]:
    """The parts of a film; of the first one the notes are warned of."""
    for place, film in enumerate(films):
        if place == 0:
            _note(film.scene)
        yield film


def _note(scene: Scene) -> None:
    from neurovis_spec.scene.shown import LeftOut

    for note in scene.notes:
        warnings.warn(note, LeftOut, stacklevel=4)


def _is_posed(recording: Recording) -> bool:
    """Whether a recording holds the poses of a body."""
    from neurovis_spec.scene.poses import posed_of

    return posed_of(recording) is not None


def _shows(panels: Sequence[Panel], *views: str) -> bool:
    """Whether one of these views is in a picture; without panels it is the network alone."""
    return not panels or any(panel.view in views for panel in panels)


def check(**given: object) -> None:
    """Refuse arguments of wrong types, by what they are called; None is the default of each. Raises TypeError, and
    ValueError for a recording with inputs: nothing is run that could take them."""
    if given.get("recording") is not None and given.get("inputs") is not None:
        raise ValueError("'inputs' are for a run, and with a 'recording' nothing is run: give one of the two")
    for name, value in given.items():
        if value is None:
            continue
        if name in ("recording", "start"):
            from neurovis_spec.runtime.recording import Recording

            arguments.instance(name, value, Recording, "a recording")
        elif name == "earlier":
            from neurovis_spec.layout import Layout

            arguments.instance(name, value, Layout, "a layout")
        elif name == "effort":
            from neurovis_spec.layout.model import effort_of

            effort_of(arguments.text(name, value))
        elif name == "progress":
            arguments.function(name, value)
        elif name == "inputs":
            arguments.mapping(name, value)
        else:
            arguments.text(name, value)
