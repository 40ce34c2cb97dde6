"""Layouts: the problem an engine is given, the Layout it gives back, layout files and metrics."""

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.model import (
    GRID,
    RADIUS,
    Arrangement,
    Capabilities,
    CheckingEngine,
    Direction,
    Layout,
    LayoutEdge,
    LayoutEngine,
    LayoutGroup,
    LayoutProblem,
    LayoutRefusalError,
    Point,
    ReportingEngine,
    Route,
    Side,
    SizingEngine,
)
from neurovis_spec.progress import Progress

__all__ = [
    "GRID",
    "RADIUS",
    "Arrangement",
    "BoolArray",
    "Capabilities",
    "CheckingEngine",
    "Direction",
    "FloatArray",
    "IntArray",
    "Layout",
    "LayoutEdge",
    "LayoutEngine",
    "LayoutGroup",
    "LayoutProblem",
    "LayoutRefusalError",
    "Point",
    "Progress",
    "ReportingEngine",
    "Route",
    "Side",
    "SizingEngine",
]
