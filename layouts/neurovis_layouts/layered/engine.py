"""The layered engine: from a problem to a layout.

In: a LayoutProblem. Out: a Layout. After Sugiyama, Tagawa and Toda (1981), frame by frame from the inside out
(``compose``); in a frame units and blocks (``units``), what shares a rank (``bonds``), components, ranks, order, places
(``sheet``), pins (``settle``), routes (``links``). Every stage is deterministic and computes in plain IEEE arithmetic,
so the result is the same everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.layered.book import keys_of
from neurovis_layouts.layered.compose import Composer
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem, Point


class LayeredEngine:
    """Neurons in ranks along the direction, instances and boxes as frames."""

    name = "layered"
    capabilities = Capabilities(
        pins=True,
        arrange=True,
        boxes=True,
        direction=True,
        modules=True,
        mirrors=True,
        align=True,
        neurons=100_000,
        edges=1_000_000,
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place every neuron and route every connection. Raises LayoutRefusalError for what cannot be met, such as a
        neuron arranged twice or lines that a formation cannot keep."""
        if not problem.neurons:
            return Layout(problem.network, self.name, {}, {})
        drawing = Composer(_framed(problem)).whole()
        return Layout(
            problem.network,
            self.name,
            {
                name: to_picture(place, problem.direction)
                for name, place in zip(problem.neurons, drawing.places, strict=True)
            },
            {
                edge.name: tuple(to_picture(point, problem.direction) for point in drawing.routes[key])
                for edge, key in zip(problem.edges, keys_of(problem.edges), strict=True)
            },
        )


def _framed(problem: LayoutProblem) -> LayoutProblem:
    """Pins in the engine's frame: x across, y along."""

    def turned(pins: Mapping[int, Point]) -> dict[int, Point]:
        return {i: from_picture(point, problem.direction) for i, point in pins.items()}

    return replace(
        problem,
        pins=turned(problem.pins),
        modules=tuple(
            replace(
                m,
                pins=turned(m.pins),
                origin=None if m.origin is None else from_picture(m.origin, problem.direction),
            )
            for m in problem.modules
        ),
    )
