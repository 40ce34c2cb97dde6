"""The organic engine: forces over levels of detail, for networks whose ranks say little, small or large.

The modules: ``levels`` (coarser and coarser networks), ``field`` (how all push each other off), ``settle`` (forces,
step by step, at one level), ``spread`` (the levels from coarse to fine), ``flow`` (what runs along the direction),
``trees`` (parts that can be drawn without a crossing), ``engine``.
"""

from neurovis_layouts.organic.engine import LargeEngine, OrganicEngine

__all__ = ["LargeEngine", "OrganicEngine"]
