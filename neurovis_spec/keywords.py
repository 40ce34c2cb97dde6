"""The keywords of the Python interface, each declared once, and what they make: the Course of a run, the Look of a
picture.

In: what a caller gives by name. Out: one value that says it all, checked; from here on it is passed as it is. Raises
TypeError and ValueError, which name the argument, rather than an error from deep within.
"""

from __future__ import annotations

import inspect
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypedDict, TypeVar, cast

import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arguments import callers_level
from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.drawing.drawing_settings import LEAST_SIDE, MOST_PIXELS, MOST_SIDE, Panel
from neurovis_spec.compiler.network import Network
from neurovis_spec.progress import Progress

if TYPE_CHECKING:
    from neurovis_spec.runtime.columns import Keep
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.until import Until
    from neurovis_spec.scene.look import Look
    from neurovis_spec.scene.panels import View

Given = TypeVar("Given", bound=Mapping[str, object])
Function = TypeVar("Function", bound=Callable[..., object])


class CompileKeywords(TypedDict, total=False):
    """How a spec is compiled."""

    parameters: Mapping[str, float | str] | None
    root: str | Path | None
    limit: int | None
    body: str | Path | bool


class KeepKeywords(TypedDict, total=False):
    """What of a run is recorded."""

    every: int
    states: str | Sequence[str]
    neurons: str | Sequence[str]
    weights: str | Sequence[str]
    signals: Literal["all", "none"]


class RunKeywords(KeepKeywords, total=False):
    """What a run is, besides its steps and inputs."""

    backend: str | None
    start: Recording | None
    only: Literal["weights"] | None
    until: str | Until | None
    progress: Progress | None
    checkpoint: str | Path | None
    body: str | Path | bool


class MemoryKeywords(RunKeywords, total=False):
    """What a run is whose recording is held in memory."""

    last: bool


class PictureKeywords(TypedDict, total=False):
    """What a picture is, of a step or of many."""

    recording: Recording | None
    inputs: Mapping[str, npt.ArrayLike] | None
    theme: str | None
    engine: str | None
    view: View | Sequence[View] | None
    progress: Progress | None
    collapse: str | Sequence[str]
    focus: str | None
    paths: str | None
    min_weight: float | None
    full: bool
    size: tuple[int, int] | None


class StillKeywords(PictureKeywords, total=False):
    """What a picture of one step is."""

    step: int | None
    effort: str | None
    window: int | None
    dpi: float | None


class FilmKeywords(PictureKeywords, total=False):
    """What a picture of many steps is."""

    steps: int | None
    start: int
    fps: float | None
    every: int | None
    frames: int | None


COMPILE: Final[CompileKeywords] = {"parameters": None, "root": None, "limit": None, "body": True}
KEEP: Final[KeepKeywords] = {"every": 1, "states": (), "neurons": (), "weights": "plastic", "signals": "all"}
RUN: Final[RunKeywords] = {
    "backend": None,
    "every": 1,
    "start": None,
    "only": None,
    "until": None,
    "progress": None,
    "states": (),
    "neurons": (),
    "weights": "plastic",
    "signals": "all",
    "checkpoint": None,
    "body": True,
}
MEMORY: Final[MemoryKeywords] = {**RUN, "last": False}
PICTURE: Final[PictureKeywords] = {
    "recording": None,
    "inputs": None,
    "theme": None,
    "engine": None,
    "view": None,
    "progress": None,
    "collapse": (),
    "focus": None,
    "paths": None,
    "min_weight": None,
    "full": False,
    "size": None,
}
STILL: Final[StillKeywords] = {"step": None, "effort": None, "window": None, "dpi": None, **PICTURE}
FILM: Final[FilmKeywords] = {"steps": None, "start": 0, "fps": None, "every": None, "frames": None, **PICTURE}


def keywords(kinds: type, defaults: Mapping[str, object]) -> Callable[[Function], Function]:
    """Have ``inspect.signature``, and so ``help`` and completion, name the keys of a TypedDict, with their defaults, in
    place of the ``**options`` that a function takes."""

    def named(function: Function) -> Function:
        own = inspect.signature(function)
        *before, _ = own.parameters.values()
        more = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=default,
                annotation=getattr(kinds.__annotations__[name], "__forward_arg__", kinds.__annotations__[name]),
            )
            for name, default in defaults.items()
        ]
        function.__dict__["__signature__"] = own.replace(parameters=[*before, *more])
        return function

    return named


def completed(function: str, given: Given, defaults: Given) -> Given:
    """The keywords given to a function, and the defaults of the others. Raises TypeError, as Python does, for one that
    it does not have."""
    for name in given:
        if name not in defaults:
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'")
    return cast(Given, {**defaults, **given})


def keep_of(given: KeepKeywords, last: bool = False) -> Keep:
    """What of a step is recorded. Raises ValueError."""
    from neurovis_spec.runtime.columns import Keep

    connections = arguments.texts("weights", given["weights"])
    for one in ("plastic", "none"):
        if one in connections and len(connections) > 1:
            raise ValueError(f"weights are 'plastic', 'none' or references to connections, not '{one}' beside others")
    if given["signals"] not in ("all", "none"):
        raise ValueError(f"signals are 'all' or 'none', not {given['signals']!r}")
    neurons, states = arguments.texts("neurons", given["neurons"]), arguments.texts("states", given["states"])
    weights, some = connections != ("none",), () if connections in (("plastic",), ("none",)) else connections
    sent = given["signals"] == "all"
    return Keep(neurons, weights, some, states, last=arguments.truth("last", last), sent=sent)


def weights_alone(only: object) -> bool:
    """Whether nothing but weights is taken of a recording. Raises ValueError for what is no word for that."""
    if only not in (None, "weights"):
        raise ValueError(f"only is 'weights' or None, not {only!r}")
    return only is not None


def course_of(
    network: Network, steps: int | None, inputs: Mapping[str, npt.ArrayLike] | None, given: MemoryKeywords
) -> Course:
    """A run. Raises SpecError where ``until`` is invalid."""
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.runtime.until import Until

    check(backend=given["backend"], start=given["start"], progress=given["progress"], inputs=inputs)
    until, checkpoint = given["until"], given["checkpoint"]
    if isinstance(until, str):
        until = Until(until, network)
    elif until is not None:
        arguments.instance("until", until, Until, "a text or an Until")
    return Course(
        steps=None if steps is None else arguments.integer("steps", steps, 0, arguments.MOST_STEPS),
        every=arguments.integer("every", given["every"], 1, arguments.MOST_STEPS),
        inputs=inputs,
        backend=given["backend"],
        start=given["start"],
        weights_alone=weights_alone(given["only"]),
        until=until,
        keep=keep_of(given, given["last"]),
        checkpoint=None if checkpoint is None else arguments.path("checkpoint", checkpoint),
    )


def still_of(of: Compilation, path: Path, given: StillKeywords) -> Look:
    """A picture of one step in a file of this kind. Raises RendererError, KeyError for an unknown reference."""
    from neurovis_spec.runtime.inputs import InputError
    from neurovis_spec.scene.files import CSS
    from neurovis_spec.scene.renderers import renderer_for

    _check_picture(given)
    check(effort=given["effort"])
    step, window, dpi = given["step"], given["window"], given["dpi"]
    wanted = None if step is None else arguments.integer("step", step)
    renderer_for(path.suffix, moving=False)
    if dpi is not None and not (math.isfinite(arguments.number("dpi", dpi)) and dpi > 0):
        raise ValueError(f"dots an inch are above 0, not {dpi}")
    look = _look_of(of, path, given)
    if window is not None:
        look = replace(look, settings=replace(look.settings, window=arguments.integer("window", window, 1)))
    if wanted is not None and wanted < 0:
        raise InputError(f"step {wanted}: steps count from 0")
    return replace(look, first=wanted, effort=given["effort"], density=None if dpi is None else dpi / CSS)


def film_of(of: Compilation, path: Path, given: FilmKeywords) -> Look:
    """A picture of many steps in a file of this kind. Warns where it is thinned because nobody asked for a long one.
    Raises RendererError, InputError, RecordingError, KeyError for an unknown reference."""
    from neurovis_spec.scene.film_size import check_film, frames_a_second, thinned
    from neurovis_spec.scene.renderers import renderer_for
    from neurovis_spec.scene.shots import steps_from

    _check_picture(given)
    first = arguments.integer("start", given["start"], most=arguments.MOST_STEPS)
    steps, every, most, fps = given["steps"], given["every"], given["frames"], given["fps"]
    count = None if steps is None else arguments.integer("steps", steps, most=arguments.MOST_STEPS)
    each = None if every is None else arguments.integer("every", every, 1, arguments.MOST_STEPS)
    frames = None if most is None else arguments.integer("frames", most, 1, arguments.MOST_STEPS)
    capabilities = renderer_for(path.suffix, moving=True).capabilities
    if fps is None:
        fps = frames_a_second(of.network)
    if not (math.isfinite(arguments.number("fps", fps)) and fps > 0):
        raise ValueError(f"frames a second are above 0, not {fps}")
    look = _look_of(of, path, given)
    span = steps_from(of.network, first, count, given["recording"])
    look = replace(look, first=first, count=span, every=thinned(span, each, frames), fps=fps)
    check_film(of.network, look.frames, look.suffix, capabilities)
    if look.every > 1 and each is None and frames is None:
        said = (
            f"of {span:,} steps one in {look.every} is drawn: {look.frames:,} frames, {look.frames / fps:.4g} s at "
            f"{fps:.4g} a second (every=1, on the command line --every 1, draws all)"
        )
        warnings.warn(said, stacklevel=callers_level())
    return look


def _check_picture(given: PictureKeywords) -> None:
    check(recording=given["recording"], inputs=given["inputs"])
    check(theme=given["theme"], engine=given["engine"], progress=given["progress"])


def _look_of(of: Compilation, path: Path, given: PictureKeywords) -> Look:
    """What stills and films have in common."""
    from neurovis_spec.scene.look import Excerpt, Look, excerpted, with_views

    recording, view, least = given["recording"], given["view"], given["min_weight"]
    panels = panels_of(of.network, view, recording)
    excerpt = Excerpt(
        arguments.texts("collapse", given["collapse"]),
        None if given["focus"] is None else arguments.text("focus", given["focus"]),
        None if given["paths"] is None else arguments.text("paths", given["paths"]),
        None if least is None else arguments.number("min_weight", least),
        arguments.truth("full", given["full"]),
    )
    settings, asked = of.settings_for(given["theme"]), view is not None or bool(of.network.render.figure)
    look = with_views(Look(settings, (), asked, engine=given["engine"], suffix=path.suffix.lower()), panels)
    settings = excerpted(of.network, look.settings, excerpt)
    if given["size"] is not None:
        settings = replace(settings, size=size_of(given["size"]))
    return replace(look, settings=settings if look.shows("network") else replace(settings, collapse=()))


def size_of(given: object) -> tuple[int, int]:
    """The sides of a picture in pixels. Raises TypeError, ValueError."""
    sides = arguments.pair("size", given)
    wide, high = (arguments.integer("size", side, LEAST_SIDE, MOST_SIDE) for side in sides)
    if wide * high > MOST_PIXELS:
        raise ValueError(f"a picture has at most {MOST_PIXELS:,} pixels, this one {wide * high:,}")
    return wide, high


def panels_of(
    network: Network, view: View | Sequence[View] | None, recording: Recording | None = None
) -> tuple[Panel, ...]:
    """The views of a picture; none where it is the network alone. By default the body stands below the network, of a
    recording where it holds its poses."""
    if view is None and not network.render.figure:
        if recording is None:
            return (Panel("network"), Panel("body")) if network.body is not None else ()
        from neurovis_spec.scene.poses import posed_of

        return (Panel("network"), Panel("body")) if posed_of(recording) is not None else ()
    from neurovis_spec.scene import panels

    return panels.panels_of(network, view)


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
