"""The layered engine: ranks along the direction, few crossings, symmetric where the network is."""

from neurovis_layouts.layered.engine import LayeredEngine

__all__ = ["LayeredEngine"]
