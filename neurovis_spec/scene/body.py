"""The body: its pose from above and from its right side, in metres, as it moves over the ground.

In: Poses. Out: a Part: two drawings of the same scale beside each other, forward to the right, that follow the body's
middle, over a grid of the ground with how far it has come and, from above, the way that it took; the outlines of links,
feet that touch something filled and others hollow, solids, a scale bar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, TypeVar

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import Solid
from neurovis_spec.scene import texts
from neurovis_spec.scene.model import Disc, Group, Point, Polygon, Polyline, Rectangle, Redrawn, Shape, Text, Theme
from neurovis_spec.scene.parts import Changes, Part
from neurovis_spec.scene.poses import Poses
from neurovis_spec.scene.strips import SMALL, TITLE, words
from neurovis_spec.scene.themes import channels

Side: TypeAlias = Literal["above", "side"]
Metres = TypeVar("Metres", float, FloatArray)

#: How high a drawing is where nothing else is asked for, and the line of numbers beneath it.
PLOT, NUMBERS = 210.0, 17.0
#: Between the two drawings, and around the body in its own sizes.
_GAP, _ROOM = 18.0, 1.12
#: User units between lines of the grid, at least, and of a scale bar.
_APART, _BAR = 46.0, 50.0
#: Lines around links, the least thickness of these; the radius of a foot in those of its links, at least and at most.
_CASING, _THIN = 1.3, 2.2
_FOOT, _LEAST, _LARGEST = 1.25, 3.4, 9.0
#: The way that a body took: how wide its line is, how much of its colour is left, how long its pieces are.
_WAY, _PALE, _PIECE = 2.0, 0.55, 4.0
#: Lines that lie on the ground, and how much of a link's colour is left on the far side.
_LINE, _FAR = 0.8, 0.45
#: A solid as high as the ground is the ground.
_FLAT = 1e-6


@dataclass(frozen=True)
class BodyPicture:
    """A body in the poses of frames."""

    poses: Poses

    @property
    def fixed(self) -> float:
        """How much of its height cannot change: the titles and the numbers beneath."""
        return TITLE + NUMBERS

    def part(self, left: float, right: float, plot: float, theme: Theme, prefix: str) -> Part:
        """Both drawings, so high, from ``left`` to ``right``."""
        wide = (right - left - _GAP) / 2
        reach = self.poses.reach
        scale = min(
            wide / (2 * _ROOM * reach.ahead),
            plot / (2 * _ROOM * reach.aside),
            plot / (_ROOM * (reach.high - reach.low) + 0.15 * reach.aside),
        )
        above = _Drawn(self.poses, "above", left, left + wide, TITLE, plot, scale, theme)
        beside = _Drawn(self.poses, "side", right - wide, right, TITLE, plot, scale, theme)
        groups: list[Group] = []
        redrawn: dict[str, Redrawn] = {}
        for drawn in (above, beside):
            name = f"{prefix}{drawn.side}"
            data = {"view": "body"} if drawn is above else {}
            groups.append(Group(tuple(_ground(drawn)), f"{name}:ground", data))
            moving: list[tuple[str, Redrawn, str]] = [("world", drawn.world, ""), ("links", drawn.links, drawn.said)]
            moving.append(("come", drawn.come, "") if drawn is beside else ("bar", drawn.bar, ""))
            if drawn is above:
                moving.insert(1, ("way", drawn.way, ""))
            for what, shapes, said in moving:
                redrawn[f"{name}:{what}"] = shapes
                groups.append(Group(shapes(0), f"{name}:{what}", {"body": what} if said else {}, said))
        return Part(tuple(groups), self.fixed + plot, Changes(redrawn=redrawn))


@dataclass(frozen=True)
class _Drawn:
    """A drawing: which side of the body it shows, where it stands, user units of a metre."""

    poses: Poses
    side: Side
    left: float
    right: float
    top: float
    plot: float
    scale: float
    theme: Theme

    @property
    def bottom(self) -> float:
        """Where the frame ends."""
        return self.top + self.plot

    @property
    def level(self) -> float:
        """Where the ground is, of the drawing from the side."""
        reach = self.poses.reach
        free = self.plot - self.scale * (reach.high - reach.low)
        return self.bottom - 0.4 * free + self.scale * reach.low

    @property
    def said(self) -> str:
        """What a pointer shows on the body."""
        feet = len(self.poses.skeleton.feet)
        more = f", {feet} feet, filled where they touch something" if feet else ""
        return f"the body {'from above' if self.side == 'above' else 'from its right side'}{more}"

    def across(self, ahead: Metres, frame: int) -> Metres:
        """Where something so far forward lies (metres from the origin of the world)."""
        middle = float(self.poses.middles[frame, 0])
        return (self.left + self.right) / 2 + self.scale * (ahead - middle)

    def down(self, far: Metres, frame: int) -> Metres:
        """Where something so far to the left of the origin, or of such a height, lies."""
        if self.side == "side":
            return self.level - self.scale * far
        return (self.top + self.bottom) / 2 - self.scale * (far - float(self.poses.middles[frame, 1]))

    def world(self, frame: int) -> tuple[Shape, ...]:
        """The ground with its grid and what stands on it; the lines of the grid say how far it is from the start."""
        theme, start = self.theme, self.poses.start
        step, half = round_above(_APART / self.scale), (self.right - self.left) / 2 / self.scale
        shapes: list[Shape] = [self._solid(solid, frame) for solid in self.poses.skeleton.solids]
        middle = float(self.poses.middles[frame, 0]) - start[0]
        count = math.floor(2 * half / step) + 1  # at most so many are seen, at times one less
        first = math.ceil((middle - half) / step)
        values = [step * (first + place) for place in range(count)]
        said = words([step, *values])[1:]
        if self.side == "side":
            shapes.append(Polyline(((self.left, self.level), (self.right, self.level)), theme.muted, 1.4))
        for value, word in zip(values, said, strict=True):
            x = self.across(start[0] + value, frame)
            seen, x = x <= self.right, min(x, self.right)
            begin, end = (self.top, self.bottom) if self.side == "above" else (self.level, self.level + 5.0)
            stroke, width = (theme.muted, 1.2) if self.side == "side" or value == 0 else (theme.box_line, _LINE)
            shapes.append(Polyline(((x, begin), (x, end)), stroke if seen else theme.box_line, width))
            label = f"{word} m" if seen and self._fits(x, word) else ""
            shapes.append(Text((x, self.bottom + 13.0), label, SMALL, theme.muted, "middle"))
        if self.side == "above":
            shapes += self._along(frame, step)
        return tuple(shapes)

    def _fits(self, x: float, word: str) -> bool:
        half = texts.width(f"{word} m", SMALL) / 2
        return self.left <= x - half and x + half <= self.right

    def _along(self, frame: int, step: float) -> list[Shape]:
        """The lines of the grid that lie along the way forward."""
        half, aside = self.plot / 2 / self.scale, float(self.poses.middles[frame, 1]) - self.poses.start[1]
        first = math.ceil((aside - half) / step)
        shapes: list[Shape] = []
        for place in range(math.floor(2 * half / step) + 1):
            value = step * (first + place)
            y = max(self.down(self.poses.start[1] + value, frame), self.top)
            shapes.append(Polyline(((self.left, y), (self.right, y)), self.theme.box_line, _LINE))
        return shapes

    def _solid(self, solid: Solid, frame: int) -> Rectangle:
        """What is seen of a box that stands in the world; of one that is not, nothing."""
        (x0, y0, z0), (x1, y1, z1) = solid.low, solid.high
        near, far = (y0, y1) if self.side == "above" else (z0, z1)
        left, right = (min(max(self.across(x, frame), self.left), self.right) for x in (x0, x1))
        above, beneath = (min(max(self.down(end, frame), self.top), self.bottom) for end in (far, near))
        wide, high = right - left, beneath - above
        if z1 <= _FLAT or not (wide > 0 and high > 0):
            wide = high = 0.0
        edge = 0.0 if wide == 0 or high == 0 else _LINE
        return Rectangle((left, above), wide, high, 0.0, self.theme.box_line, self.theme.muted, edge)

    def links(self, frame: int) -> tuple[Shape, ...]:
        """Links, the nearest last, then feet, those that touch something in front of those that do not, so that it is
        seen at any time which do, also of two sensors of a leg."""
        poses, skeleton, theme, colours = self.poses, self.poses.skeleton, self.theme, self._colours
        places, shapes = self._places(frame), list[Shape]()
        order = self._order(frame)
        far = (order < 0) & (self.side == "side")
        for number in np.argsort(order, kind="stable").tolist():
            link, colour = skeleton.links[number], colours[theme.zero][int(far[number])]
            if link.beside:
                corners, margin = outline([places[point] for point in link.points]), link.radius * self.scale
                shapes += [Polygon(corners, theme.box_fill, margin + _CASING), Polygon(corners, colour, margin)]
                continue
            line, thick = (places[link.start], places[link.end]), max(2 * link.radius * self.scale, _THIN)
            shapes.append(Polyline(line, theme.box_fill, thick + 2 * _CASING, round=True))
            shapes.append(Polyline(line, colour, thick, round=True))
        order = poses.layers(frame)[len(skeleton.links) :] * (self.side == "side")
        for number in np.lexsort((poses.touching[frame], order)).tolist():
            touches = poses.touching[frame, number]
            fill, edge = (theme.positive, theme.ink) if touches else (theme.box_fill, theme.muted)
            fill, edge = (colours[colour][int(order[number] < 0)] for colour in (fill, edge))
            shapes.append(Disc(places[skeleton.feet[number]], self._feet[number], fill, edge, 1.4))
        return tuple(shapes)

    def way(self, frame: int) -> tuple[Shape, ...]:
        """The way of the middle so far, from where it came into the frame for the last time, or began; nothing of it
        where the pose is not known."""
        poses, colour = self.poses, mixed(self.theme.positive, self.theme.box_fill, _PALE)
        if not poses.known[frame]:
            return (Polyline(((-1e4, -1e4),) * 2, colour, _WAY),)
        row = int(poses.rows[frame])
        first, last = np.searchsorted(self._marks, (poses.begun[row] + 1, row))
        passed = poses.way[[poses.begun[row], *self._marks[first:last], row]]
        seen = _last_within((passed - poses.way[row]) * (self.scale, -self.scale), self._half)
        points = seen + np.array([(self.left + self.right) / 2, (self.top + self.bottom) / 2])
        return (Polyline(tuple((x, y) for x, y in points.tolist()), colour, _WAY),)

    @property
    def _half(self) -> FloatArray:
        return np.array([(self.right - self.left) / 2, self.plot / 2])

    @cached_property
    def _marks(self) -> IntArray:
        """The rows of a run between which the way of the middle is drawn straight."""
        pieces = np.floor(np.cumsum(np.nan_to_num(self.poses.steps)) * self.scale / _PIECE)
        marks: IntArray = np.flatnonzero(np.diff(pieces, prepend=0.0) > 0)
        return marks

    @cached_property
    def _colours(self) -> dict[str, tuple[str, str]]:
        """Colours of links and of feet, each as it is and on the far side, where it is paler."""
        theme = self.theme
        some = (theme.zero, theme.positive, theme.ink, theme.box_fill, theme.muted)
        return {colour: (colour, mixed(colour, theme.box_fill, _FAR)) for colour in some}

    @cached_property
    def _feet(self) -> list[float]:
        """The radius of each foot: a little more than that of the links that end there."""
        skeleton = self.poses.skeleton
        thick = [
            max((link.radius for link in skeleton.links if foot in link.points), default=0.0) for foot in skeleton.feet
        ]
        return [min(max(_FOOT * radius * self.scale, _LEAST), _LARGEST) for radius in thick]

    def _places(self, frame: int) -> list[Point]:
        """Where the points are on the page; far outside of it where nobody knows."""
        if not self.poses.known[frame]:
            return [(-1e4, -1e4)] * len(self.poses.skeleton.points)
        deep = 1 if self.side == "above" else 2
        across, down = self.poses.points[frame][:, [0, deep]].T
        places = np.stack([self.across(across, frame), self.down(down, frame)], axis=1)
        return [(x, y) for x, y in places.tolist()]

    def _order(self, frame: int) -> FloatArray:
        """Links from back to front. From above, what reaches higher is in front, in the middle of all frames, so that
        it always is; from the side what is right of the body, and of what is in the middle the largest."""
        poses = self.poses
        if self.side == "above":
            return poses.tops
        layers = poses.layers(frame)[: len(poses.skeleton.links)]
        order: FloatArray = np.where(layers == 0, poses.thick, layers)
        return order

    def come(self, frame: int) -> tuple[Shape, ...]:
        """How far it has come, above the frame."""
        far = float(self.poses.forward[frame])
        way = "back" if far < -0.005 else "forward"
        said = f"from its right side · {abs(far):.2f} m {way}" if self.poses.known[frame] else "its pose is not known"
        said = texts.shorten(said, SMALL, self.right - self.left)
        return (Text((self.left, TITLE - 6.0), said, SMALL, self.theme.muted),)

    def bar(self, frame: int) -> tuple[Shape, ...]:
        """A length in metres, at the right beneath, in front of what moves."""
        theme, metres = self.theme, round_above(_BAR / self.scale)
        right, y = self.right - 10.0, self.bottom - 9.0
        left = right - metres * self.scale
        said = f"{words([metres])[0]} m"
        if left < self.left + 10.0 or self.plot < 2 * SMALL + 18.0:
            return ()
        line = ((left, y - 4.0), (left, y), (right, y), (right, y - 4.0))
        middle = ((left + right) / 2, y - 6.0)
        return Polyline(line, theme.ink, 1.4), Text(middle, said, SMALL, theme.ink, "middle", halo=theme.box_fill)


def _last_within(way: FloatArray, half: FloatArray) -> FloatArray:
    """The last stretch of a way (k, 2), which ends at the middle of a frame, that lies within so much of that, (2,).

    >>> _last_within(np.array([[-9.0, 0.0], [-3.0, 3.0], [0.0, 0.0]]), np.array([5.0, 5.0])).tolist()
    [[-5.0, 2.0], [-3.0, 3.0], [0.0, 0.0]]
    """
    outside = np.flatnonzero(~(np.abs(way) <= half).all(axis=1))
    if not len(outside):
        return way if len(way) > 1 else np.repeat(way, 2, axis=0)
    inner = way[outside[-1] + 1 :]
    back = way[outside[-1]] - inner[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nanmin((np.copysign(half, back) - inner[0]) / back)
    result: FloatArray = np.concatenate([inner[:1] + share * back, inner])
    return result


def outline(points: Sequence[Point]) -> tuple[Point, ...]:
    """The corners of the convex hull of points, in order.

    >>> outline([(0.0, 0.0), (2.0, 0.0), (1.0, 1.0), (2.0, 2.0), (0.0, 2.0)])
    ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    """
    some = sorted(set(points))
    if len(some) < 3:
        return tuple(some)
    return (*_chain(some), *_chain(some[::-1]))


def _chain(points: Sequence[Point]) -> list[Point]:
    """The corners on one side, from the first point up to the last, without that."""
    found: list[Point] = []
    for x, y in points:
        while len(found) > 1:
            (x0, y0), (x1, y1) = found[-2:]
            if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0:
                break
            found.pop()
        found.append((x, y))
    return found[:-1]


def _ground(drawn: _Drawn) -> list[Shape]:
    """The frame; above it what is seen, and what feet mean."""
    theme = drawn.theme
    extent = drawn.right - drawn.left, drawn.plot
    shapes: list[Shape] = [Rectangle((drawn.left, drawn.top), *extent, 0.0, theme.box_fill, theme.box_line, 1.0)]
    if drawn.side == "above":
        said = "from above, forward →"
        explained = _feet_explained(drawn) if drawn.poses.skeleton.feet else []
        begin = min((shape.centre[0] for shape in explained if isinstance(shape, Disc)), default=drawn.right) - 12.0
        if explained and drawn.left + texts.width(said, SMALL) > begin:
            explained = []
        said = texts.shorten(said, SMALL, extent[0])
        shapes += [Text((drawn.left, TITLE - 6.0), said, SMALL, theme.muted), *explained]
    else:
        beneath = drawn.bottom - drawn.level
        fill = mixed(theme.box_line, theme.box_fill, 0.5)
        shapes.append(Rectangle((drawn.left, drawn.level), extent[0], beneath, 0.0, fill, fill, 0.0))
    return shapes


def _feet_explained(drawn: _Drawn) -> list[Shape]:
    """What a filled foot is, and a hollow one, at the right above the frame."""
    theme, x = drawn.theme, drawn.right
    shapes: list[Shape] = []
    for said, fill, edge in (("in the air", theme.box_fill, theme.muted), ("touching", theme.positive, theme.ink)):
        shapes.append(Text((x, TITLE - 6.0), said, SMALL, theme.muted, "end"))
        x -= texts.width(said, SMALL) + 8.0
        shapes.append(Disc((x, TITLE - 9.8), 4.0, fill, edge, 1.4))
        x -= 14.0
    return shapes


def round_above(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is no less.

    >>> round_above(0.13), round_above(0.2), round_above(34)
    (0.2, 0.2, 50.0)
    """
    power = math.floor(math.log10(least))
    return next(float(f"{n}e{power}") for n in (1, 2, 5, 10, 20) if float(f"{n}e{power}") >= least * (1 - 1e-9))


def mixed(colour: str, other: str, share: float) -> str:
    """A colour of which so much is left in another one.

    >>> mixed("#000000", "#ffffff", 0.2)
    '#cccccc'
    """
    pairs = zip(channels(colour), channels(other), strict=True)
    return "#" + "".join(f"{round(share * one + (1 - share) * two):02x}" for one, two in pairs)
