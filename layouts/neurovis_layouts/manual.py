"""The manual engine: every neuron has a position; only the routes are found.

In: a problem in which everything is pinned. Out: the pins as they are, and routes.
"""

from __future__ import annotations

from neurovis_layouts.label_room import outward
from neurovis_layouts.routing import route_all
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem


class ManualEngine:
    """Positions as given, routes that avoid discs."""

    name = "manual"
    capabilities = Capabilities(
        pins=True, free=False, arrange=False, boxes=True, direction=True, memory=True, suits="pins"
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Keep every pin, route every edge."""
        centres = [problem.pins[i] for i in range(len(problem.neurons))]
        routes = route_all(problem.edges, centres)
        return Layout(
            problem.network,
            self.name,
            dict(zip(problem.neurons, centres, strict=True)),
            {edge.name: route for edge, route in zip(problem.edges, routes, strict=True)},
            outward(problem, centres),
        )
