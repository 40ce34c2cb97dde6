"""Engines whose neurons stand in a fixed formation, circular and grid: what they share.

In: a problem and a place for every neuron. Out: a Layout: pins kept, direction turned, edges routed.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_layouts.frame import to_picture
from neurovis_layouts.kept import kept
from neurovis_layouts.pins import fit
from neurovis_layouts.routing import route_all
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import Layout, LayoutProblem, Point


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


def place(problem: LayoutProblem, engine: str, order: Sequence[int], places: Sequence[Point]) -> Layout:
    """The layout in which neuron ``order[i]`` stands at ``places[i]`` (x across, y along)."""
    free: list[Point] = [(0.0, 0.0)] * len(problem.neurons)
    for neuron, (x, y) in zip(order, places, strict=True):
        free[neuron] = to_picture((snap(x), snap(y)), problem.direction)
    centres, _, _ = fit(free, problem.pins)
    routes = route_all(problem.edges, centres)
    fresh = Layout(
        problem.network,
        engine,
        dict(zip(problem.neurons, centres, strict=True)),
        {edge.name: route for edge, route in zip(problem.edges, routes, strict=True)},
    )
    return kept(problem, fresh)
