"""The layered engine: ranks along the direction, few crossings, symmetric where the network is."""

from __future__ import annotations

from dataclasses import replace

from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem

__all__ = ["LayeredEngine"]


class LayeredEngine:
    """Neurons in ranks along the direction, instances and boxes as frames; neurons that an earlier layout knew stay
    where they were."""

    name = "layered"
    capabilities = Capabilities(
        pins=True,
        arrange=True,
        boxes=True,
        direction=True,
        modules=True,
        mirrors=True,
        align=True,
        plan=True,
        memory=True,
        neurons=100_000,
        edges=1_000_000,
        frames=True,
        checks=True,
        suits="flow",
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place every neuron and route every connection. Raises LayoutRefusalError for what cannot be met, such as
        lines that a formation cannot keep."""
        from neurovis_layouts.incremental import kept  # only here: who asks what it can do needs none of it
        from neurovis_layouts.layered.hierarchy import directed, drawn

        chosen = directed(problem)
        fresh = drawn(chosen, self.name)
        found = kept(chosen, fresh) if chosen.memory else fresh
        return found if chosen is problem else replace(found, direction=chosen.direction)

    def check(self, problem: LayoutProblem) -> None:
        """Raises the LayoutRefusalError that ``lay_out`` would."""
        from neurovis_layouts.layered.hierarchy import checked

        checked(problem)
