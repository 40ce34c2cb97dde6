"""The engines whose neurons stand in a fixed formation, in the order in which they are read: circular, a ring wide
enough that neighbours keep their spacing, clockwise from where the direction begins; and grid, rows, nearly square.

In: a problem. Out: a Layout: members of a box side by side, pins kept, direction turned; edges go round the discs
between their ends where they can. Instances are frames: the neurons of one that are in none within it stand in a
formation of their own, beside the instances within it; each make is drawn once, routes included, and copied by steps of
the grid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from neurovis_layouts.formations import offsets
from neurovis_layouts.frame import to_picture
from neurovis_layouts.incremental import kept
from neurovis_layouts.label_room import roomy
from neurovis_layouts.layered.drawing import Drawing
from neurovis_layouts.packing import packed
from neurovis_layouts.pins import fit, with_origins
from neurovis_layouts.routing import Surroundings, route_all
from neurovis_layouts.routing.ends import Key, keys_of
from neurovis_spec.layout.frames import BOX_ACROSS, PAD_LABEL
from neurovis_spec.layout.geometry import Rect, shifted, snap, snapped
from neurovis_spec.layout.labels import instance_titles, label_rects
from neurovis_spec.layout.model import (
    RADIUS,
    Arrangement,
    Capabilities,
    Layout,
    LayoutEdge,
    LayoutProblem,
    Point,
    Route,
    Side,
)

#: From labels to other discs: lines of boxes run between them.
_AIR = BOX_ACROSS - RADIUS + PAD_LABEL
#: Neighbours are no closer than this.
_LEAST = 0.65
#: Places for these neurons, around (0, 0), and on which sides their labels stand that their discs cannot hold.
Formation: TypeAlias = Callable[[Sequence[int]], tuple[list[Point], list[Side | None]]]
#: Between frames.
_BETWEEN = 1.0


class GridEngine:
    """Neurons in rows and columns."""

    name = "grid"
    capabilities = Capabilities(
        pins=True, arrange=False, boxes=True, direction=True, modules=True, memory=True, neurons=100_000
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons row by row and route the edges."""
        return _placed(problem, self.name, "grid", max(1.5 * problem.neuron_spacing, _LEAST))


class CircularEngine:
    """Neurons on a ring."""

    name = "circular"
    capabilities = replace(GridEngine.capabilities, suits="tangle")

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons round a circle and route the edges."""
        return _placed(problem, self.name, "ring", max(1.2 * problem.neuron_spacing, _LEAST))


def _boxes_together(problem: LayoutProblem) -> list[int]:
    """Neurons in the order in which they are read, but the members of a box follow its first member."""
    box_of: dict[int, int] = {}
    for number, (_, members) in enumerate(problem.boxes):
        for member in members:
            box_of.setdefault(member, number)
    reading = problem.reading()
    first: dict[int, int] = {}
    for neuron in sorted(box_of, key=reading.__getitem__):
        first.setdefault(box_of[neuron], reading[neuron])
    return sorted(range(len(reading)), key=lambda i: (first[box_of[i]] if i in box_of else reading[i], reading[i]))


def _placed(problem: LayoutProblem, engine: str, how: Arrangement, spacing: float) -> Layout:
    """The layout in which all neurons stand in one formation, those of an instance in one of their own."""
    order = {neuron: i for i, neuron in enumerate(_boxes_together(problem))}

    def formation(neurons: Sequence[int]) -> tuple[list[Point], list[Side | None]]:
        """Places for these, members of a box one after the other; labels outside of a ring, else to the right."""
        there: dict[int, Point] = {}
        sides: dict[int, Side | None] = dict.fromkeys(neurons)
        for neuron, point in zip(
            sorted(neurons, key=order.__getitem__), offsets(how, len(neurons), spacing), strict=True
        ):
            there[neuron] = to_picture(point, problem.direction)
            if problem.labels and problem.labels[neuron][0]:
                sides[neuron] = "left" if how == "ring" and there[neuron][0] < 0 else "right"
        found = roomy(problem.labels, there, sides, (True, how == "ring"), _AIR)
        return [(snap(found[neuron][0]), snap(found[neuron][1])) for neuron in neurons], [sides[n] for n in neurons]

    blocks = Blocks(problem, formation)
    free = blocks.whole() if problem.modules else blocks.formed(range(len(problem.neurons)))
    pins = with_origins(problem, dict(enumerate(free.places)))
    return kept(problem, routed(free, problem.edges).layout(problem, engine), pins)


@dataclass(frozen=True, slots=True)
class _Block:
    """Neurons that are drawn as a whole: those of an instance, by its number, or in none (−1)."""

    number: int
    members: Sequence[int]
    drawing: Drawing


class Blocks:
    """Draws a problem; each make of instance once."""

    def __init__(self, problem: LayoutProblem, formation: Formation) -> None:
        self._problem = problem
        self._formation = formation
        self._drawn: dict[str, Drawing] = {}
        self._titles = instance_titles((module.path, module.module) for module in problem.modules)
        self._within: dict[int, list[int]] = {}
        around: list[set[int]] = [set() for _ in problem.neurons]
        for number, module in enumerate(problem.modules):
            for member in module.members:
                around[member].add(number)
            if module.members:
                self._within.setdefault(module.parent, []).append(number)
        self._inside: dict[int, list[LayoutEdge]] = {}
        for edge in problem.edges:
            for number in around[edge.source] & around[edge.target]:
                self._inside.setdefault(number, []).append(edge)

    def whole(self) -> Drawing:
        """The drawing of all, as it is without pins, and without routes between frames."""
        return self._drawing(-1, range(len(self._problem.neurons)), (), {})

    def _instance(self, number: int) -> Drawing:
        module = self._problem.modules[number]
        if module.template not in self._drawn:
            self._drawn[module.template] = self._drawing(
                number, module.members, self._inside.get(number, ()), module.pins
            )
        return self._drawn[module.template]

    def _drawing(
        self, number: int, members: Sequence[int], edges: Sequence[LayoutEdge], pins: Mapping[int, Point]
    ) -> Drawing:
        """What is in an instance (−1: in none), its outermost instances as blocks; pins are relative to its origin."""
        place = {member: i for i, member in enumerate(members)}
        blocks = self._blocks(number, members)
        rects = [block.drawing.rect() for block in blocks]
        corners = packed([(r[2] - r[0], r[3] - r[1]) for r in rects], _BETWEEN) if blocks else []
        shifts = [(snap(x - r[0]), snap(y - r[1])) for (x, y), r in zip(corners, rects, strict=True)]
        free: list[Point] = [(0.0, 0.0)] * len(members)
        sides: list[Side | None] = [None] * len(members)
        for block, shift in zip(blocks, shifts, strict=True):
            for member, point, side in zip(block.members, block.drawing.places, block.drawing.sides, strict=True):
                free[place[member]] = _moved(point, shift)
                sides[place[member]] = side
        places, whole, bent = fit(free, {place[m]: point for m, point in pins.items()})
        routes: dict[Key, Route] = {}
        frames: list[tuple[tuple[int, ...], Rect]] = []
        for block, shift, rect in zip(blocks, shifts, rects, strict=True):
            here = [place[m] for m in block.members]
            if bent.intersection(here):
                routes.update(self._bent(block.number, here, places))
                continue
            by = _moved(shift, whole)
            for (a, b, k), route in block.drawing.routes.items():
                routes[here[a], here[b], k] = tuple(_moved(point, by) for point in route)
            around = [] if block.number < 0 else [(tuple(range(len(here))), rect)]
            frames += [
                (tuple(here[m] for m in inside), shifted(r, by)) for inside, r in (*around, *block.drawing.frames)
            ]
        local = [replace(e, source=place[e.source], target=place[e.target]) for e in edges]
        title = self._titles[number] if number >= 0 else 0.0
        labels = self._labels(members, places, sides)
        return routed(
            Drawing(tuple(places), routes, tuple(frames), sides=tuple(sides), labels=labels, title=title), local
        )

    def _blocks(self, number: int, members: Sequence[int]) -> list[_Block]:
        """What is placed as a whole in an instance: its neurons outside of others, and the outermost of these."""
        within = self._within.get(number, [])
        framed = {m for inner in within for m in self._problem.modules[inner].members}
        loose = [m for m in members if m not in framed]
        blocks = [_Block(inner, self._problem.modules[inner].members, self._instance(inner)) for inner in within]
        return [_Block(-1, loose, self.formed(loose)), *blocks] if loose else blocks

    def formed(self, neurons: Sequence[int]) -> Drawing:
        """Neurons in their formation."""
        places, sides = self._formation(neurons)
        return Drawing(tuple(places), {}, sides=tuple(sides), labels=self._labels(neurons, places, sides))

    def _labels(
        self, members: Sequence[int], places: Sequence[Point], sides: Sequence[Side | None]
    ) -> tuple[Rect, ...]:
        """What labels cover that stand beside their discs."""
        rooms = [self._problem.labels[member] for member in members] if self._problem.labels else []
        return tuple(rect for rect in label_rects(places, rooms, sides) if rect is not None)

    def _bent(self, number: int, here: Sequence[int], places: Sequence[Point]) -> dict[Key, Route]:
        """Routes within an instance that pins around it have bent: by themselves, so that others bent so are alike."""
        if number < 0:
            return {}
        at = {member: i for i, member in enumerate(self._problem.modules[number].members)}
        x, y = places[here[0]]
        there = tuple((places[i][0] - x, places[i][1] - y) for i in here)
        inside = [replace(e, source=at[e.source], target=at[e.target]) for e in self._inside.get(number, ())]
        return {
            (here[a], here[b], k): tuple((px + x, py + y) for px, py in route)
            for (a, b, k), route in routed(Drawing(there, {}), inside).routes.items()
        }


def routed(drawing: Drawing, edges: Sequence[LayoutEdge]) -> Drawing:
    """The drawing with routes for those of these edges that have none."""
    keys = keys_of(edges)
    new = [i for i, key in enumerate(keys) if key not in drawing.routes]
    walls = [(frozenset(own), rect) for own, rect in drawing.frames]
    around = Surroundings(walls, list(drawing.routes.values()))
    made = route_all([edges[i] for i in new], drawing.places, around=around)
    found = {keys[i]: snapped(route) for i, route in zip(new, made, strict=True)}
    return replace(drawing, routes={**drawing.routes, **found})


def _moved(point: Point, shift: Point) -> Point:
    return point[0] + shift[0], point[1] + shift[1]
