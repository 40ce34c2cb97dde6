"""Frames: the rectangles that instances of modules and boxes are drawn as, in the picture's coordinates, and how far
their lines are from what they hold.

In: a problem, where its neurons stand, routes. Out: by number, those of the instances first, then those of the boxes,
who is in a frame, which frames hold which, and the rectangles of what is placed. A neuron is foreign to a frame that it
is not in.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect, bounds, padded, sampled, united
from neurovis_spec.layout.labels import BOX_WEIGHT, instance_titles, label_rect, title_room, widened
from neurovis_spec.layout.model import LayoutProblem, Point, Route, Side

#: From centres, routes and frames within to the line of an instance's frame, and room for its title on top.
PAD, PAD_ROUTE, PAD_FRAME, TITLE = 0.65, 0.2, 0.35, 0.35
#: The same for boxes: from centres, sideways and up and down; from loops, from frames.
BOX_ACROSS, BOX_DOWN, BOX_LOOP, BOX_FRAME = 0.62, 0.6, 0.15, 0.3
#: From labels to the line of any frame.
PAD_LABEL = 0.12
#: From centres and from frames where a box would touch another otherwise.
BOX_TIGHT, BOX_TIGHT_FRAME = 0.42, 0.15
#: Rounding to the grid of coordinates, and to points on routes: frames that share no more do not lie on each other.
SLACK = 1 / 32


class Frames:
    """Who is in which frame: ``members`` by number; an instance has its number among the problem's."""

    def __init__(
        self, problem: LayoutProblem, sides: Mapping[str, Side] | None = None, tight_boxes: bool = False
    ) -> None:
        """``sides`` are those on which labels stand for which there is room. With ``tight_boxes`` boxes hold neurons
        alone, as they are drawn where labels and titles have no room."""
        self._problem = problem
        beside = [(i, (sides or {}).get(problem.neurons[i])) for i in range(len(problem.labels))]
        self._sides = {i: side for i, side in beside if side is not None and problem.labels[i][0]}
        self._titles = instance_titles((module.path, module.module) for module in problem.modules)
        self._titles += [0.0 if tight_boxes else title_room(name, BOX_WEIGHT) for name, _ in problem.boxes]
        self.instances = len(problem.modules)
        self.members: list[frozenset[int]] = [frozenset(module.members) for module in problem.modules]
        self.members += [frozenset(own) for _, own in problem.boxes]
        self._labelled = self.instances if tight_boxes else len(self.members)
        self.around: dict[int, list[int]] = {}
        for number, own in enumerate(self.members):
            for neuron in own:
                self.around.setdefault(neuron, []).append(number)
        self._inner: dict[int, list[int]] = {}
        for i, edge in enumerate(problem.edges):
            for number in self.around.get(edge.source, ()):
                if edge.target in self.members[number] and (number < self.instances or edge.source == edge.target):
                    self._inner.setdefault(number, []).append(i)
        self._held: dict[int, list[int]] = {}
        for number, module in enumerate(problem.modules):
            if module.parent >= 0:
                self._held.setdefault(module.parent, []).append(number)
        for box in range(self.instances, len(self.members)):
            inside = {n for neuron in self.members[box] for n in self.around[neuron] if n < self.instances}
            self._held[box] = [n for n in sorted(inside) if self.members[n] <= self.members[box]]

    def rects(self, placed: Mapping[int, Point], routes: Mapping[int, Route]) -> list[Rect | None]:
        """The rectangles, titles included, around those members that are placed; None around none."""
        found: list[Rect | None] = [None] * len(self.members)
        order = [*reversed(range(self.instances)), *range(self.instances, len(self.members))]
        for number in order:
            instance = number < self.instances
            at = [placed[i] for i in self.members[number] if i in placed]
            if not at:
                continue
            lines = [p for i in self._inner.get(number, ()) if i in routes for p in sampled(routes[i], 0.1)]
            held = [rect for n in self._held.get(number, ()) if (rect := found[n]) is not None]
            labels = [
                padded(label_rect(placed[i], self._problem.labels[i], side), PAD_LABEL)
                for i, side in self._sides.items()
                if number < self._labelled and i in placed and i in self.members[number]
            ]
            around = bounds(lines) if lines else None
            rect = (enclosing if instance else boxed)(bounds(at), around, held, labels)
            rect = widened(rect, self._titles[number])
            found[number] = titled(rect) if instance else rect
        return found

    def grown(self, number: int, rect: Rect) -> Rect:
        """What a frame is at least when it holds this frame."""
        instance = number < self.instances
        wider = padded(rect, PAD_FRAME if instance else BOX_FRAME)
        return titled(wider) if instance else wider

    def single(self, number: int, point: Point) -> Rect:
        """What a frame is at least when it holds a neuron in no frame within it."""
        rect = (*point, *point)
        return titled(padded(rect, PAD)) if number < self.instances else boxed(rect, None, ())

    def related(self, one: int, other: int) -> bool:
        """Whether frames have neurons in common, so that they cannot keep off each other."""
        return not self.members[one].isdisjoint(self.members[other])


def entered(centres: FloatArray, rect: Rect, members: Collection[int]) -> bool:
    """Whether a neuron that is foreign to a frame stands in it: then it is not drawn."""
    x, y = centres.T
    inside = (x > rect[0]) & (y > rect[1]) & (x < rect[2]) & (y < rect[3])
    return bool(inside.sum() > inside[list(members)].sum())


def enclosing(centres: Rect, lines: Rect | None, held: Iterable[Rect], labels: Iterable[Rect] = ()) -> Rect:
    """The frame of an instance, but for its title: around centres, what lies on routes, frames in it, and labels with
    the room around these."""
    parts = [padded(centres, PAD), *(padded(rect, PAD_FRAME) for rect in held), *labels]
    return united(parts if lines is None else [*parts, padded(lines, PAD_ROUTE)])


def boxed(
    centres: Rect, loops: Rect | None, held: Iterable[Rect], labels: Iterable[Rect] = (), tight: bool = False
) -> Rect:
    """The frame of a box: around centres, self-loops, frames in it, and labels with the room around these; ``tight``
    where it would touch another otherwise."""
    across, down, gap = (BOX_TIGHT, BOX_TIGHT, BOX_TIGHT_FRAME) if tight else (BOX_ACROSS, BOX_DOWN, BOX_FRAME)
    x0, y0, x1, y1 = centres
    own = (x0 - across, y0 - down, x1 + across, y1 + down)
    parts = [own, *(padded(rect, gap) for rect in held), *labels]
    return united(parts if loops is None else [*parts, padded(loops, BOX_LOOP)])


def titled(rect: Rect) -> Rect:
    """With room for a title on top."""
    return rect[0], rect[1] - TITLE, rect[2], rect[3]


def untitled(rect: Rect) -> Rect:
    """Without the room for a title."""
    return rect[0], rect[1] + TITLE, rect[2], rect[3]
