"""The Scene: a flat drawing in plain units, and the Film: a scene whose colours and widths change.

In: nothing; these are the values that ``scene.encode`` makes and that renderers read. A renderer knows nothing of
networks: items are discs, splines, texts and rectangles, in groups that carry an opaque id, data
attributes and a tooltip. Lengths are user units (pixels at scale 1), x right, y down. Colours are ``#rrggbb``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

Point: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Theme:
    """A theme is data: the anchors of the colours (−1, 0, +1), the glow, an opaque background, ink."""

    name: str
    negative: str
    zero: str
    positive: str
    glow: str
    background: str
    ink: str
    #: second text, box and line colours
    muted: str
    box_fill: str
    box_line: str
    #: ring around a disc, and the text on it
    ring: str
    on_disc: str


@dataclass(frozen=True, slots=True)
class Disc:
    """A filled circle with a ring."""

    centre: Point
    radius: float
    fill: str
    stroke: str
    stroke_width: float


@dataclass(frozen=True, slots=True)
class Spline:
    """A cubic Bézier spline (1 + 3k points), stroked with round joins and butt caps."""

    points: tuple[Point, ...]
    stroke: str
    width: float
    #: lengths of dashes and gaps; empty: solid
    dash: tuple[float, ...] = ()
    #: a glow is drawn beneath all that is no glow; renderers mark it with the class ``glow``
    glow: bool = False
    opacity: float = 1.0


@dataclass(frozen=True, slots=True)
class Polygon:
    """A filled polygon: an arrowhead."""

    points: tuple[Point, ...]
    fill: str


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle with round corners."""

    corner: Point
    width: float
    height: float
    radius: float
    fill: str
    stroke: str
    stroke_width: float


@dataclass(frozen=True, slots=True)
class Ramp:
    """A rectangle filled from left to right through three colours (the legend)."""

    corner: Point
    width: float
    height: float
    radius: float
    colours: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text; ``subscript`` follows it smaller and lower (K₁). The point is on the baseline."""

    point: Point
    text: str
    size: float
    fill: str
    anchor: Literal["start", "middle", "end"] = "start"
    weight: int = 400
    subscript: str = ""


Shape: TypeAlias = Disc | Spline | Polygon | Rectangle | Ramp | Text


@dataclass(frozen=True, slots=True)
class Group:
    """Shapes that belong together. ``id`` is opaque and unique ('' for none); ``data`` becomes ``data-…`` attributes;
    ``title`` is what a pointer shows."""

    shapes: tuple[Shape, ...]
    id: str = ""
    data: Mapping[str, str] = field(default_factory=dict)
    title: str = ""


@dataclass(frozen=True, slots=True)
class Scene:
    """A picture: groups from back to front on a background."""

    width: float
    height: float
    theme: Theme
    title: str
    groups: tuple[Group, ...]

    def shapes(self) -> Iterator[Shape]:
        """All shapes from back to front."""
        for group in self.groups:
            yield from group.shapes


FloatArray: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Film:
    """A scene that changes: ``scene`` is frame 0, and the arrays say how groups differ, frame by frame.

    For group ``discs[i]`` (an id) the disc has the colour value ``disc_values[f, i]`` in −1…1 at frame f. For group
    ``lines[j]`` the line and its arrowhead have the colour value ``line_values[f, j]``, the width ``line_widths[f, j]``
    (user units) and a glow of the width ``glow_widths[f, j]`` (0 for none). ``captions[f]`` is the text of the shape in group ``caption``.
    Colours are linear in sRGB between the theme's anchors.
    """

    scene: Scene
    fps: float
    discs: tuple[str, ...]
    lines: tuple[str, ...]
    disc_values: FloatArray
    line_values: FloatArray
    line_widths: FloatArray
    glow_widths: FloatArray
    caption: str
    captions: tuple[str, ...]

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.disc_values)


@dataclass(frozen=True, slots=True)
class RendererCapabilities:
    """File suffixes (with the dot) of the stills and of the films that a renderer makes."""

    stills: frozenset[str] = frozenset()
    films: frozenset[str] = frozenset()


class Progress(Protocol):
    """Called now and then with what is done and what there is to do."""

    def __call__(self, done: int, total: int) -> None: ...  # noqa: D102


class Renderer(Protocol):
    """A renderer, found through the entry point group ``neurovis.renderers`` (the entry point names a class that is
    called without arguments). The method for which it declares no suffix is never called."""

    name: str
    capabilities: RendererCapabilities

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as the content of a file with this suffix."""
        ...

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as the content of a file with this suffix."""
        ...
