"""The engines whose neurons stand in a fixed formation, in the order in which they are read: circular, a ring wide
enough that neighbours keep their spacing, clockwise from where the direction begins; and grid, rows, nearly square.

In: a problem. Out: a Layout: members of a box side by side, instances as frames with a formation of their own, pins
kept, direction turned; edges go round the discs between their ends where they can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from neurovis_layouts.blocks import Blocks, routed
from neurovis_layouts.formations import offsets
from neurovis_layouts.frame import to_picture
from neurovis_layouts.incremental import kept
from neurovis_layouts.label_room import roomy
from neurovis_layouts.label_sides import sided
from neurovis_layouts.pins import with_origins
from neurovis_spec.layout.frames import BOX_ACROSS, PAD_LABEL
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import RADIUS, Arrangement, Capabilities, Layout, LayoutProblem, Point, Side

#: From labels to other discs: lines of boxes run between them.
_AIR = BOX_ACROSS - RADIUS + PAD_LABEL
#: Neighbours are no closer than this.
_LEAST = 0.65


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
    layout = routed(free, problem.edges).layout(problem, engine)
    return sided(problem, kept(problem, layout, pins))
