"""Bodies: what a network senses and moves, as the core sees it."""

from neurovis_spec.arrays import FloatArray
from neurovis_spec.body.model import Body, BodyError, BodyKind, Link, Port, Skeleton, Solid

__all__ = ["Body", "BodyError", "BodyKind", "FloatArray", "Link", "Port", "Skeleton", "Solid"]
