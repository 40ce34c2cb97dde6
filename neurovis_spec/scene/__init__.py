"""The Scene: what is drawn, in plain units; themes; and how a network becomes one (Eqs. 2–5).

Renderers use what stands here; ``film`` is in the module of this name, ``choose_gains`` in ``gains``.
"""

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.progress import Progress
from neurovis_spec.scene.film import filled_shape, part, still
from neurovis_spec.scene.model import (
    HALO,
    HEAD_MORE,
    HEAD_OF_LENGTH,
    HEAD_OF_WIDTH,
    Arrowhead,
    Disc,
    Film,
    FlatSpline,
    Group,
    Image,
    Point,
    Polygon,
    Polyline,
    Ramp,
    Rectangle,
    Redrawn,
    Renderer,
    RendererCapabilities,
    Scene,
    Shape,
    Spline,
    Text,
    Theme,
    head_half_width,
    shifted,
)
from neurovis_spec.scene.texts import FAMILIES, SUBSCRIPT_DROP, SUBSCRIPT_SIZE
from neurovis_spec.scene.themes import THEMES, blend, channels, colours, readable

__all__ = [
    "FAMILIES",
    "HALO",
    "HEAD_MORE",
    "HEAD_OF_LENGTH",
    "HEAD_OF_WIDTH",
    "SUBSCRIPT_DROP",
    "SUBSCRIPT_SIZE",
    "THEMES",
    "Arrowhead",
    "Disc",
    "Film",
    "FlatSpline",
    "FloatArray",
    "Group",
    "Image",
    "IntArray",
    "Point",
    "Polygon",
    "Polyline",
    "Progress",
    "Ramp",
    "Rectangle",
    "Redrawn",
    "Renderer",
    "RendererCapabilities",
    "Scene",
    "Shape",
    "Spline",
    "Text",
    "Theme",
    "blend",
    "channels",
    "colours",
    "filled_shape",
    "head_half_width",
    "part",
    "readable",
    "shifted",
    "still",
]
