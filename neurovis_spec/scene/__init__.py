"""The Scene: what is drawn, in plain units; themes; and how a network becomes one (Eqs. 2–5)."""

from neurovis_spec.scene.model import (
    Disc,
    Film,
    Group,
    Point,
    Polygon,
    Progress,
    Ramp,
    Rectangle,
    Renderer,
    RendererCapabilities,
    Scene,
    Shape,
    Spline,
    Text,
    Theme,
)

__all__ = [
    "Disc",
    "Film",
    "Group",
    "Point",
    "Polygon",
    "Progress",
    "Ramp",
    "Rectangle",
    "Renderer",
    "RendererCapabilities",
    "Scene",
    "Shape",
    "Spline",
    "Text",
    "Theme",
]
