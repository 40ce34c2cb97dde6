"""The circular engine: neurons on a ring, in natural order, clockwise from where the direction begins.

In: a problem. Out: a ring wide enough that neighbours keep their spacing; connections are its chords.
"""

from __future__ import annotations

from neurovis_layouts.placed import place
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem


class CircularEngine:
    """Neurons on a ring."""

    name = "circular"
    capabilities = Capabilities(
        pins=True, arrange=False, boxes=True, direction=True, modules=True, memory=True, neurons=100_000, suits="tangle"
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons round a circle, members of a box side by side, those of an instance round a circle
        of their own, and route the edges."""
        spacing = max(1.2 * problem.neuron_spacing, 0.65)
        return place(problem, self.name, "ring", spacing)
