"""The large engine: forces over levels of detail, for thousands of connections.

The modules: ``levels`` (coarser and coarser networks), ``field`` (how all push each other off, on a grid), ``settle``
(forces, step by step, at one level), ``flow`` (what runs along the direction), ``spread`` (the levels from coarse to
fine), ``trees`` (parts that can be drawn without a crossing), ``engine``.
"""

from neurovis_layouts.large.engine import LargeEngine

__all__ = ["LargeEngine"]
