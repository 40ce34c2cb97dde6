"""The organic engine: distances on paper like those in the network, for a few hundred neurons.

The modules: ``paths`` (how far neurons are from each other in the network), ``stress`` (places whose distances differ
least from these, with what runs one way running down), ``engine``.
"""

from neurovis_layouts.organic.engine import OrganicEngine

__all__ = ["OrganicEngine"]
