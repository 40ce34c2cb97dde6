"""Engines whose neurons stand in a fixed formation, circular and grid: what they share.

In: a problem and a formation. Out: a Layout: instances as frames, pins kept, direction turned, edges routed.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_layouts.blocks import Blocks, routed
from neurovis_layouts.formations import offsets
from neurovis_layouts.frame import to_picture
from neurovis_layouts.incremental import kept
from neurovis_layouts.label_room import roomy
from neurovis_layouts.label_sides import sided
from neurovis_layouts.layered.drawing import Drawing
from neurovis_layouts.pins import with_origins
from neurovis_layouts.routing.ends import keys_of
from neurovis_spec.layout.frames import BOX_ACROSS, PAD_LABEL
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import RADIUS, Arrangement, Layout, LayoutProblem, Point, Side

#: From labels to other discs: lines of boxes run between them.
_AIR = BOX_ACROSS - RADIUS + PAD_LABEL


def boxes_together(problem: LayoutProblem) -> list[int]:
    """Neurons in natural order, but the members of a box follow its first member."""
    box_of: dict[int, int] = {}
    for number, (_, members) in enumerate(problem.boxes):
        for member in members:
            box_of.setdefault(member, number)
    order: list[int] = []
    seen = [False] * len(problem.neurons)
    mates: dict[int, list[int]] = {}
    for neuron, number in sorted(box_of.items()):
        mates.setdefault(number, []).append(neuron)
    for neuron in range(len(problem.neurons)):
        for member in mates[box_of[neuron]] if neuron in box_of else [neuron]:
            if not seen[member]:
                seen[member] = True
                order.append(member)
    return order


def place(problem: LayoutProblem, engine: str, how: Arrangement, spacing: float) -> Layout:
    """The layout in which all neurons stand in one formation, those of an instance in one of their own."""
    order = {neuron: i for i, neuron in enumerate(boxes_together(problem))}

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
    layout = _layout(problem, engine, routed(free, problem.edges))
    return sided(problem, kept(problem, layout, pins))


def _layout(problem: LayoutProblem, engine: str, drawing: Drawing) -> Layout:
    return Layout(
        problem.network,
        engine,
        dict(zip(problem.neurons, drawing.places, strict=True)),
        {edge.name: drawing.routes[key] for edge, key in zip(problem.edges, keys_of(problem.edges), strict=True)},
        {name: side for name, side in zip(problem.neurons, drawing.sides, strict=True) if side is not None},
    )
