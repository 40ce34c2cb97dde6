"""The organic engine: forces over levels of detail, for networks whose ranks say little, small or large.

The modules: ``field`` (forces, and where points come to rest at one level), ``levels`` (coarser and coarser networks,
spread from coarse to fine), ``flow`` (what runs along the direction), ``trees`` (parts that can be drawn without a
crossing), ``engine``.
"""

from neurovis_layouts.organic.engine import LargeEngine, OrganicEngine

__all__ = ["LargeEngine", "OrganicEngine"]
