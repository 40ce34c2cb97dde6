"""The Scene: a flat drawing in plain units, and the Film: a scene whose colours and widths change.

In: nothing; these are the values that ``scene.encode`` makes and that renderers read. A renderer knows nothing of
networks: items are discs, lines, texts, rectangles and images of cells, in groups that carry an opaque id, data
attributes and a tooltip. Lengths are user units (``Scene.density`` pixels), x right, y down. Colours are ``#rrggbb``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from typing import BinaryIO, ClassVar, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.progress import Progress
from neurovis_spec.themes import Theme as Theme

Point: TypeAlias = tuple[float, float]


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
    """A cubic Bézier spline (1 + 3k points), stroked with round joins, and caps that are butt, where dashed round."""

    points: tuple[Point, ...]
    stroke: str
    width: float
    #: lengths of dashes and gaps; empty: solid
    dash: tuple[float, ...] = ()
    #: drawn beneath the line of its group; renderers mark it with the class ``glow``
    glow: bool = False
    opacity: float = 1.0
    #: whether its dashes have butt caps
    flat: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class FlatSpline(Spline):
    """A spline whose dashes have butt caps; without dashes like any other."""

    flat: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Polyline:
    """Points joined by straight lines, stroked with round joins and butt caps, or round ones (what is opaque alone)."""

    points: tuple[Point, ...]
    stroke: str
    width: float
    opacity: float = 1.0
    round: bool = False

    @property
    def spline(self) -> Spline:
        """The same line as a spline, whose control points lie on it."""
        points = [self.points[0]]
        for (x0, y0), (x1, y1) in pairwise(self.points):
            a, b = (x1 - x0) / 3, (y1 - y0) / 3
            points += [(x0 + a, y0 + b), (x1 - a, y1 - b), (x1, y1)]
        return Spline(tuple(points), self.stroke, self.width, opacity=self.opacity)


@dataclass(frozen=True, slots=True)
class Arrowhead:
    """The filled end of a line at ``tip``, along the unit vector ``direction``: an arrow whose back is notched, or a
    bar across, with a stem that leads the line (``width`` wide) on to it, or nothing but that stem. The line ends in
    the notch of each."""

    tip: Point
    direction: Point
    length: float
    half_width: float
    fill: str
    kind: Literal["arrow", "bar", "none"] = "arrow"
    width: float = 0.0

    #: in its lengths: how far from the tip the notch lies, how thick a bar is, how far its stem laps over the line
    NOTCH: ClassVar[float] = 0.78
    BAR: ClassVar[float] = 0.3
    LAP: ClassVar[float] = 0.06

    @property
    def corners(self) -> tuple[Point, ...]:
        """The corners where the tip is the origin and points right: of an arrow tip, one barb, notch, the other; of
        what is neither arrow nor bar those of its stem."""
        half, notch = self.half_width, -self.NOTCH * self.length
        if self.kind == "arrow":
            return (0.0, 0.0), (-self.length, half), (notch, 0.0), (-self.length, -half)
        bar, stem, lap = -self.BAR * self.length, self.width / 2, notch - self.LAP * self.length
        if self.kind == "none":
            return (0.0, stem), (lap, stem), (lap, -stem), (0.0, -stem)
        one = ((0.0, half), (bar, half), (bar, stem), (lap, stem))
        return (*one, *((along, -across) for along, across in reversed(one)))

    @property
    def points(self) -> tuple[Point, ...]:
        """The corners where they are."""
        (x, y), (dx, dy) = self.tip, self.direction
        return tuple((x + along * dx - across * dy, y + along * dy + across * dx) for along, across in self.corners)

    @property
    def notch(self) -> Point:
        """Where the line ends."""
        (x, y), (dx, dy) = self.tip, self.direction
        return x - self.NOTCH * self.length * dx, y - self.NOTCH * self.length * dy


#: How far a halo reaches, in sizes of its text.
HALO = 0.2

#: How the half width of a head follows from its length and the width of its line.
HEAD_OF_LENGTH, HEAD_OF_WIDTH, HEAD_MORE = 0.3, 0.6, 0.6


def head_half_width(width: float, length: float) -> float:
    """Half the width of the head on a line of this width: it grows slower than the line, but always covers its end."""
    return max(HEAD_OF_LENGTH * length + HEAD_OF_WIDTH * width, 0.5 / Arrowhead.NOTCH * width + HEAD_MORE)


#: By what a line ends in how a Film has it.
ENDS_OF: Mapping[str, int] = MappingProxyType({"arrow": 1, "bar": -1, "none": 0})


def ended(head: Arrowhead, width: float, fill: str, end: int) -> Arrowhead:
    """The same end on a line of another width and colour: an arrow (1), a bar (−1), or neither (0)."""
    half = head_half_width(width, head.length) if end else width / 2
    kind: Literal["arrow", "bar", "none"] = "none" if not end else "arrow" if end > 0 else "bar"
    return Arrowhead(head.tip, head.direction, head.length, half, fill, kind, width)


@dataclass(frozen=True, slots=True)
class Polygon:
    """A filled convex polygon, by its corners in order, with all that lies within a margin of it: so its corners are
    round."""

    points: tuple[Point, ...]
    fill: str
    margin: float = 0.0


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
    """Stripes of equal width from left to right, without seams (the legend's scale of colours)."""

    corner: Point
    width: float
    height: float
    colours: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Image:
    """Coloured cells of equal size, ``rows`` of ``columns`` each, without seams. ``pixels``: red, green and blue of
    each cell (0…255), row by row from the top, from left to right."""

    corner: Point
    width: float
    height: float
    columns: int
    rows: int
    pixels: bytes = field(repr=False)


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
    #: it stands on the disc of its group: the colour is the theme's that can be read on the disc's
    on_disc: bool = False
    #: a colour around the letters, ``HALO`` wide, that keeps lines beneath away from them ('' for none)
    halo: str = ""
    #: it reads upward: turned by a quarter about its point
    upward: bool = False


def shifted(shape: Shape, by: Point) -> Shape:
    """The same shape, moved by so much to the right and down."""

    right, down = by

    def move(point: Point) -> Point:
        return point[0] + right, point[1] + down

    match shape:  # the kinds that bodies are drawn of at every frame first, and without ``replace``, which is slow
        case Polyline():
            points = tuple((x + right, y + down) for x, y in shape.points)
            return Polyline(points, shape.stroke, shape.width, shape.opacity, shape.round)
        case Polygon():
            return Polygon(tuple((x + right, y + down) for x, y in shape.points), shape.fill, shape.margin)
        case Disc():
            return Disc(move(shape.centre), shape.radius, shape.fill, shape.stroke, shape.stroke_width)
        case Spline():
            return replace(shape, points=tuple(move(point) for point in shape.points))
        case Arrowhead():
            return replace(shape, tip=move(shape.tip))
        case Rectangle() | Ramp() | Image():
            return replace(shape, corner=move(shape.corner))
        case Text():
            return replace(shape, point=move(shape.point))


Shape: TypeAlias = Disc | Spline | Polyline | Polygon | Arrowhead | Rectangle | Ramp | Image | Text


@dataclass(frozen=True, slots=True)
class Group:
    """Shapes that belong together. ``id`` is opaque and unique ('' for none); ``data`` becomes ``data-…`` attributes,
    but for a ``class``, which only what stays as it is in a film may have; ``title`` is what a pointer shows;
    ``opacity`` is that of the whole group, drawn by itself."""

    shapes: tuple[Shape, ...]
    id: str = ""
    data: Mapping[str, str] = field(default_factory=dict)
    title: str = ""
    opacity: float = 1.0


@dataclass(frozen=True, slots=True)
class Scene:
    """A picture: groups from back to front on a background. ``width`` and ``height`` are user units."""

    width: float
    height: float
    theme: Theme
    title: str
    groups: tuple[Group, ...]
    #: pixels for a user unit where the picture is shown in its own size
    density: float = 1.0
    #: what the picture leaves out, as it says itself
    notes: tuple[str, ...] = ()
    #: what it shows, in sentences, for those who do not see it
    told: tuple[str, ...] = ()

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the picture in its own size."""
        return max(1, round(self.width * self.density)), max(1, round(self.height * self.density))

    def shapes(self) -> Iterator[Shape]:
        """All shapes from back to front."""
        for group in self.groups:
            yield from group.shapes


#: The shapes of a group at a frame: in all frames as many, of the same kinds in the same order.
Redrawn: TypeAlias = Callable[[int], tuple[Shape, ...]]


@dataclass(frozen=True, slots=True)
class Film:
    """A scene that changes: ``scene`` is frame 0, and the arrays say how groups differ, frame by frame.

    For group ``fills[i]`` (an id) its first disc or rectangle has the colour value ``fill_values[f, i]`` in −1…1 at
    frame f. For group ``lines[j]`` the line and its arrowhead have the colour value ``line_values[f, j]``, the line the
    width ``line_widths[f, j]`` (user units; the head follows by ``head_half_width``), and its glow the width
    ``glow_widths[f, j]`` (0 for none; a group that glows at any time has a glow in ``scene``, of width 0 where it
    does not glow in frame 0). It ends in an arrow where ``line_ends[f, j]`` is 1, in a bar where that is −1, and in
    neither where it is 0. Group ``shifts[k]`` is moved from where it stands in ``scene`` by ``shift_values[f, k]`` (x
    and y, user units; 0 in frame 0). Line ``bands[l]`` (the id of its group, and which of its shapes; its head is the
    next one) keeps its colour and its end, and has the width ``band_widths[f, l]``. A group may be in one of the four
    at most. A group ``redrawn`` (an id) is in none
    of them: its shapes at frame f are ``redrawn[id](f)``, and nothing that stays as it is stands in front of them. From
    frame ``faint[id]`` on, a group that stands there has the opacity ``faintness``. ``captions[f]`` is the text in
    group ``caption``. Colours are linear in sRGB between the theme's anchors, of NaN that of texts; ``still(f)`` is
    frame f as a scene, and ``titles[f]`` its title, without which it is that of ``scene``.
    """

    scene: Scene
    fps: float
    fills: tuple[str, ...]
    lines: tuple[str, ...]
    fill_values: FloatArray
    line_values: FloatArray
    line_widths: FloatArray
    glow_widths: FloatArray
    line_ends: npt.NDArray[np.int8]
    caption: str
    captions: tuple[str, ...]
    shifts: tuple[str, ...] = ()
    shift_values: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 2)))
    bands: tuple[tuple[str, int], ...] = ()
    band_widths: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    faint: Mapping[str, int] = field(default_factory=dict)
    faintness: float = 1.0
    redrawn: Mapping[str, Redrawn] = field(default_factory=dict)
    titles: tuple[str, ...] = ()

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.captions)

    @property
    def changing(self) -> npt.NDArray[np.bool_]:
        """Which lines change their width, their glow or their end."""
        kept = (self.line_widths, self.glow_widths, self.line_ends)
        result: npt.NDArray[np.bool_] = np.any([(values != values[:1]).any(axis=0) for values in kept], axis=0)
        return result


@dataclass(frozen=True, slots=True)
class RendererCapabilities:
    """File suffixes (with the dot, in small letters) of the stills and of the films that a renderer makes; of which
    films it takes in parts (``StreamingRenderer``); of a film the most ``pixels``, those of all frames together, by
    suffix, where there is a most; and for suffixes that need what is not installed, what to do about it."""

    stills: frozenset[str] = frozenset()
    films: frozenset[str] = frozenset()
    streams: frozenset[str] = frozenset()
    pixels: Mapping[str, int] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)


class Renderer(Protocol):
    """A renderer, found through the entry point group ``neurovis.renderers`` (the entry point names a class that is
    called without arguments). The method for which it declares no suffix is never called; a suffix is given as it is
    declared, however the file's is written (``.PNG``)."""

    name: str
    capabilities: RendererCapabilities

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as the content of a file with this suffix."""
        ...

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as the content of a file with this suffix."""
        ...


@runtime_checkable
class StreamingRenderer(Renderer, Protocol):
    """A renderer that writes films while they are made, so that they may be of any length: they come in parts, the
    scenes of which differ only in what changes."""

    def stream(
        self, films: Iterator[Film], frames: int, suffix: str, file: BinaryIO, progress: Progress | None = None
    ) -> None:
        """Write a film of so many frames to a file."""
        ...
