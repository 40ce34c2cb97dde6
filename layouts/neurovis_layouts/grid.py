"""The grid engine: neurons in rows, in natural order.

In: a problem. Out: a grid, nearly square; connections go round the discs between their ends where they can.
"""

from __future__ import annotations

from neurovis_layouts.placed import place
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem


class GridEngine:
    """Neurons in rows and columns."""

    name = "grid"
    capabilities = Capabilities(
        pins=True, arrange=False, boxes=True, direction=True, modules=True, memory=True, neurons=100_000
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons row by row, members of a box one after the other, those of an instance in a
        grid of their own, and route the edges."""
        spacing = max(1.5 * problem.neuron_spacing, 0.65)
        return place(problem, self.name, "grid", spacing)
