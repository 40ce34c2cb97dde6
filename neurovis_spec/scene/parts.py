"""Parts of a page: what each view draws, from its own corner on, and how that changes; and the Film that they make.

In: Parts, one below the other. Out: a Film. Ids of groups are unique on the page: each view begins its own with what it
is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.scene.model import Film, Group, Point, Redrawn, Scene, Shape, Theme, shifted


@dataclass(frozen=True, slots=True)
class Changes:
    """How groups differ, frame by frame, as a Film has it; an array is None where nothing of its kind changes."""

    fills: tuple[str, ...] = ()
    fill_values: FloatArray | None = None
    shifts: tuple[str, ...] = ()
    shift_values: FloatArray | None = None
    redrawn: Mapping[str, Redrawn] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Part:
    """Groups with their corner at the origin, as high as ``height``."""

    groups: tuple[Group, ...]
    height: float
    changes: Changes = field(default_factory=Changes)


@dataclass(frozen=True, slots=True)
class _Elsewhere:
    """The shapes of a group that is redrawn, moved by so much in every frame."""

    redrawn: Redrawn
    by: Point

    def __call__(self, frame: int) -> tuple[Shape, ...]:
        return tuple(shifted(shape, self.by) for shape in self.redrawn(frame))


def moved(part: Part, by: Point) -> Part:
    """A part that stands elsewhere, by so much to the right and down."""
    groups = tuple(replace(group, shapes=tuple(shifted(shape, by) for shape in group.shapes)) for group in part.groups)
    redrawn = {name: _Elsewhere(shapes, by) for name, shapes in part.changes.redrawn.items()}
    return replace(part, groups=groups, changes=replace(part.changes, redrawn=redrawn))


@dataclass(frozen=True, slots=True)
class Page:
    """What a film has besides its parts. ``fps`` is that of the film, ``captions`` and ``titles`` are one a frame;
    ``title`` is that of the whole."""

    width: float
    height: float
    density: float
    theme: Theme
    title: str
    fps: float
    caption: str
    captions: tuple[str, ...]
    titles: tuple[str, ...]


def stacked(page: Page, parts: Sequence[tuple[float, Part]], network: Film | None) -> Film:
    """Parts on a page, each from a height (user units) on. The film of the ``network`` is among them, if there is one:
    it says how its lines change."""
    placed = [moved(part, (0.0, top)) if top else part for top, part in parts]
    groups = [group for part in placed for group in part.groups]
    changes, frames = [part.changes for part in placed], len(page.captions)
    base = _still(page) if network is None else network

    def side_by_side(values: Sequence[FloatArray | None], *more: int) -> FloatArray:
        known = [value for value in values if value is not None and value.shape[1]]
        return np.concatenate(known, axis=1) if known else np.zeros((frames, 0, *more))

    return replace(
        base,
        scene=replace(
            base.scene,
            width=page.width,
            height=page.height,
            theme=page.theme,
            title=page.title,
            groups=tuple(groups),
            density=page.density,
        ),
        fps=page.fps,
        fills=(*base.fills, *(name for one in changes for name in one.fills)),
        fill_values=side_by_side([base.fill_values, *(one.fill_values for one in changes)]),
        shifts=(*base.shifts, *(name for one in changes for name in one.shifts)),
        shift_values=side_by_side([base.shift_values, *(one.shift_values for one in changes)], 2),
        redrawn={name: shapes for one in changes for name, shapes in one.redrawn.items()},
        caption=page.caption,
        captions=page.captions,
        titles=page.titles,
    )


def _still(page: Page) -> Film:
    """A film in which nothing changes."""
    frames = len(page.captions)
    none = np.zeros((frames, 0))
    scene = Scene(page.width, page.height, page.theme, page.title, (), page.density)
    ends = np.zeros((frames, 0), np.int8)
    return Film(scene, page.fps, (), (), none, none, none, none, ends, page.caption, page.captions)
