"""Film: the steps of a run as a scene whose colours and widths change; and each frame as a scene of its own.

In: a network, its layout, the snapshots of the frames, gains and settings. Out: a Film; ``still(film, f)``, the scene
of one frame; ``scene_of_step``, that of one alone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Layout
from neurovis_spec.scene import bundles
from neurovis_spec.scene.caption import caption
from neurovis_spec.scene.collapse import Gathered
from neurovis_spec.scene.encode import CAPTION, Looks, lesions_by_id, looks, paint, tooltips
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.gathered_layout import standing
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.model import (
    ENDS_OF,
    Arrowhead,
    Disc,
    Film,
    Group,
    Point,
    Rectangle,
    Scene,
    Shape,
    Spline,
    Text,
    ended,
    shifted,
)
from neurovis_spec.scene.pathway_words import told
from neurovis_spec.scene.plan import Plan, plan
from neurovis_spec.scene.themes import colours, readable

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Snapshot


def scene_of_step(
    network: Network, layout: Layout, snapshot: Snapshot, gains: Gains, settings: RenderSettings
) -> Scene:
    """One step as discs, splines and texts: the only frame of its film. Raises KeyError for an unknown theme, and for a
    neuron without a position."""
    return still(film(network, layout, [snapshot], gains, settings), 0)


def film(
    network: Network,
    layout: Layout | None,
    snapshots: Collection[Snapshot],
    gains: Gains,
    settings: RenderSettings,
    fps: float = 1.0,
    narrowest: float = 0.0,
) -> Film:
    """One frame a snapshot, ``fps`` frames a second, without a stated size at least ``narrowest`` wide (page units).
    Raises ValueError without a snapshot."""
    return next(films(network, layout, [snapshots], gains, settings, fps, narrowest))


def films(
    network: Network,
    layout: Layout | None,
    parts: Iterable[Collection[Snapshot]],
    gains: Gains,
    settings: RenderSettings,
    fps: float,
    narrowest: float = 0.0,
) -> Iterator[Film]:
    """The same for a film that comes in parts, each made when it is asked for. What stays the same is planned anew only
    where other weights are reached. Of pathways that are ``laid_out_alone`` the layout may be None. Raises ValueError
    for a part without a snapshot."""
    drawn, placed = standing(network, layout, settings)
    planned, reached, begin = None, np.zeros(0), None
    for snapshots in parts:
        if not len(snapshots):
            raise ValueError("a film has at least one frame")
        begin = next(iter(snapshots)) if begin is None else begin
        peaks = np.full(len(drawn.network.connections), np.nan)
        for snapshot in snapshots if len(network.changing) else islice(snapshots, 1):
            peaks = np.fmax(peaks, np.abs(drawn.snapshot(snapshot).weights))
        if planned is None or not np.array_equal(peaks, reached, equal_nan=True):
            planned, reached = plan(drawn, placed, gains, settings, peaks, narrowest, begin), peaks
        yield filmed(drawn, planned, snapshots, gains, fps)


def filmed(drawn: Gathered, planned: Plan, snapshots: Collection[Snapshot], gains: Gains, fps: float) -> Film:
    """Snapshots by a plan."""
    network, whole, frames = drawn.network, drawn.whole, len(snapshots)
    neurons, connections = len(network.neurons), len(network.connections)
    fill_values, line_values = np.empty((frames, neurons)), np.empty((frames, connections))
    widths, glows = np.empty((2, frames, connections))
    ends = np.empty((frames, connections), np.int8)
    following = bundles.following(network, planned.left, _changing(drawn), planned.unit)
    band_widths = np.empty((frames, len(following.names)))
    captions, titles, steps, low, high = list[str](), list[str](), list[int](), None, None
    for frame, step in enumerate(snapshots):
        snapshot = drawn.snapshot(step)
        own_ends = drawn.ends(step.weights, step.ends)
        seen = looks(network, snapshot, gains, planned.frame.widest, drawn.signals(step), own_ends)
        fill_values[frame], line_values[frame] = seen.discs, seen.lines
        widths[frame], glows[frame], ends[frame] = seen.widths, seen.glows, seen.ends
        band_widths[frame] = following.at(snapshot.weights, own_ends)
        steps.append(snapshot.step)
        words = caption(whole, step.step, step.activity)
        shape = planned.caption_shape(words)
        captions.append(shape.text if shape else words)
        titles.append(f"{planned.title}, {words}")
        now = (snapshot.told, snapshot.weights)
        low = now if low is None else (np.minimum(low[0], now[0]), np.minimum(low[1], now[1]))
        high = now if high is None else (np.maximum(high[0], now[0]), np.maximum(high[1], now[1]))
    assert low is not None
    assert high is not None
    glowing: npt.NDArray[np.bool_] = glows.max(axis=0) > 0
    first = Looks(fill_values[0], line_values[0], widths[0], glows[0], ends[0])
    tips = tooltips(network, gains, np.stack([low[0], high[0]]), np.stack([low[1], high[1]]))
    scene = paint(planned, first, glowing, captions[0], tips, steps[0])
    scene, bands, band_widths = _followed(scene, following.names, band_widths)
    return Film(
        scene=replace(scene, told=told(drawn, low[1], high[1], ends, steps[-1])),
        fps=fps,
        fills=tuple(f"n{index}" for index in range(len(network.neurons))),
        lines=tuple(f"c{index}" for index in range(len(network.connections))),
        fill_values=fill_values,
        line_values=line_values,
        line_widths=widths,
        glow_widths=glows,
        line_ends=planned.theme_ends(ends),
        caption=CAPTION,
        captions=tuple(captions),
        titles=tuple(titles),
        bands=bands,
        band_widths=band_widths,
        faint={
            name: next(frame for frame, step in enumerate(steps) if step >= since)
            for name, since in lesions_by_id(planned).items()
            if since <= steps[-1]
        },
        faintness=FAINT,
    )


def _changing(drawn: Gathered) -> IntArray:
    """The lines whose weight can change in a run."""
    lines = np.unique(drawn.bundle[drawn.whole.changing])
    return lines[lines >= 0]


def _followed(
    scene: Scene, names: tuple[tuple[str, int], ...], widths: FloatArray
) -> tuple[Scene, tuple[tuple[str, int], ...], FloatArray]:
    """Of bands with these widths (frames, bands) those that are not as wide all the time as the scene has them, and the
    scene in which they are as wide as they begin."""
    groups = {group.id: group for group in scene.groups} if names else {}
    shapes = [groups[name].shapes[place] for name, place in names]
    drawn = np.array([shape.width if isinstance(shape, Spline) else np.nan for shape in shapes])
    some = np.flatnonzero(~np.isclose(widths, drawn, rtol=1e-9, atol=0).all(axis=0))
    bands, widths = tuple(names[number] for number in some.tolist()), widths[:, some]
    begun = dict(zip(bands, widths[0].tolist(), strict=True))
    return (
        replace(scene, groups=tuple(widened(group, begun) for group in scene.groups)) if begun else scene,
        bands,
        widths,
    )


def widened(group: Group, bands: Mapping[tuple[str, int], float]) -> Group:
    """A group whose ``bands``, by its id and their place among its shapes, have these widths, and their heads."""
    shapes = list(group.shapes)
    for place, shape in enumerate(group.shapes[:-1]):
        width, head = bands.get((group.id, place)), shapes[place + 1]
        if width is not None and isinstance(shape, Spline) and isinstance(head, Arrowhead):
            shapes[place : place + 2] = replace(shape, width=width), ended(head, width, head.fill, ENDS_OF[head.kind])
    return replace(group, shapes=tuple(shapes)) if len(shapes) > 1 else group


def filled_shape(group: Group) -> int | None:
    """Which shape of a group has the colour of a film's ``fills``."""
    places = (place for place, shape in enumerate(group.shapes) if isinstance(shape, Disc | Rectangle))
    return next(places, None)


def still(film: Film, frame: int) -> Scene:
    """One frame as a scene; a connection that does not glow in it has no glow. Raises IndexError beyond the end."""
    theme = film.scene.theme
    fills = dict(zip(film.fills, colours(theme, film.fill_values[frame]), strict=True))
    bands = dict(zip(film.bands, film.band_widths[frame].tolist(), strict=True)) if film.bands else {}
    banded = {name for name, _ in bands}
    shifts: dict[str, Point] = {}
    if film.shifts:
        shifts = {name: (x, y) for name, (x, y) in zip(film.shifts, film.shift_values[frame].tolist(), strict=True)}
    lines = {
        name: (colour, width, glow, end)
        for name, colour, width, glow, end in zip(
            film.lines,
            colours(theme, film.line_values[frame]),
            film.line_widths[frame].tolist(),
            film.glow_widths[frame].tolist(),
            film.line_ends[frame].tolist(),
            strict=True,
        )
    }

    def repaint(group: Group) -> Group:
        if group.id in film.redrawn:
            return replace(group, shapes=film.redrawn[group.id](frame))
        if group.id in banded:
            return widened(group, bands)
        shapes: list[Shape] = []
        filled = filled_shape(group) if group.id in fills else None
        for place, shape in enumerate(group.shapes):
            match shape:
                case Disc() | Rectangle() if place == filled:
                    shapes.append(replace(shape, fill=fills[group.id]))
                case Text() if shape.on_disc and group.id in fills:
                    shapes.append(replace(shape, fill=readable(theme, fills[group.id])))
                case _ if group.id in shifts:
                    shapes.append(shifted(shape, shifts[group.id]))
                case Text() if group.id == film.caption:
                    shapes.append(replace(shape, text=film.captions[frame]))
                case Spline(glow=True) if group.id in lines:
                    if lines[group.id][2] > 0:
                        shapes.append(replace(shape, width=lines[group.id][2]))
                case Spline() if group.id in lines:
                    shapes.append(replace(shape, stroke=lines[group.id][0], width=lines[group.id][1]))
                case Arrowhead() if group.id in lines:
                    colour, width, _, end = lines[group.id]
                    shapes.append(ended(shape, width, colour, end))
                case _:
                    shapes.append(shape)
        faint = group.id in film.faint and frame >= film.faint[group.id]
        return replace(group, shapes=tuple(shapes), opacity=film.faintness if faint else group.opacity)

    title = film.titles[frame] if film.titles else film.scene.title
    return replace(film.scene, title=title, groups=tuple(repaint(group) for group in film.scene.groups))


def part(film: Film, names: Collection[str]) -> Film:
    """Some groups of a film, by their ids, and how they change."""
    scene = replace(film.scene, groups=tuple(group for group in film.scene.groups if group.id in names))
    fills, lines, shifts = (
        [number for number, name in enumerate(every) if name in names]
        for every in (film.fills, film.lines, film.shifts)
    )
    bands = [number for number, (name, _) in enumerate(film.bands) if name in names]
    return replace(
        film,
        scene=scene,
        fills=tuple(film.fills[number] for number in fills),
        fill_values=film.fill_values[:, fills],
        lines=tuple(film.lines[number] for number in lines),
        line_values=film.line_values[:, lines],
        line_widths=film.line_widths[:, lines],
        glow_widths=film.glow_widths[:, lines],
        line_ends=film.line_ends[:, lines],
        bands=tuple(film.bands[number] for number in bands),
        band_widths=film.band_widths[:, bands],
        shifts=tuple(film.shifts[number] for number in shifts),
        shift_values=film.shift_values[:, shifts] if shifts else film.shift_values[:, :0],
        redrawn={name: shapes for name, shapes in film.redrawn.items() if name in names},
    )
