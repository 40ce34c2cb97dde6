"""The layered engine: ranks along the direction, few crossings, symmetric where the network is."""

from __future__ import annotations

from dataclasses import replace

from neurovis_layouts.kept import kept
from neurovis_layouts.layered.engine import LayeredEngine as FreshLayeredEngine
from neurovis_spec.layout.model import Layout, LayoutProblem

__all__ = ["LayeredEngine"]


class LayeredEngine(FreshLayeredEngine):
    """Neurons in ranks along the direction; those that an earlier layout knew stay where they were."""

    capabilities = replace(FreshLayeredEngine.capabilities, memory=True)

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place every neuron and route every connection. Raises LayoutRefusalError."""
        return kept(problem, super().lay_out(problem))
