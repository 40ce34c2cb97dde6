"""The grid engine: neurons in rows, in natural order.

In: a problem. Out: a grid, nearly square; connections go round the discs between their ends where they can.
"""

from __future__ import annotations

from neurovis_layouts.formations import offsets
from neurovis_layouts.placed import boxes_together, place
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem


class GridEngine:
    """Neurons in rows and columns."""

    name = "grid"
    capabilities = Capabilities(pins=True, arrange=False, boxes=True, direction=True, memory=True, neurons=100_000)

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons row by row, members of a box one after the other, and route the edges."""
        spacing = max(1.5 * problem.neuron_spacing, 0.65)
        places = offsets("grid", len(problem.neurons), spacing)
        return place(problem, self.name, boxes_together(problem), places)
