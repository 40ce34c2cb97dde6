"""The frame in which engines think: x across, y along the direction.

In and out: points. Engines that know a direction work as if it were ``down``; this turns their result.
"""

from __future__ import annotations

from neurovis_spec.layout.geometry import Rect, bounds
from neurovis_spec.layout.model import Direction, Point


def to_picture(point: Point, direction: Direction) -> Point:
    """From (across, along) to x and y of the picture; exact.

    >>> to_picture((1.0, 2.0), "right"), to_picture((1.0, 2.0), "up")
    ((2.0, 1.0), (1.0, -2.0))
    """
    across, along = point
    match direction:
        case "down":
            return across, along
        case "up":
            return across, -along
        case "right":
            return along, across
        case "left":
            return -along, across


def from_picture(point: Point, direction: Direction) -> Point:
    """The inverse of ``to_picture``."""
    x, y = point
    match direction:
        case "down":
            return x, y
        case "up":
            return x, -y
        case "right":
            return y, x
        case "left":
            return y, -x


def turned(rect: Rect, direction: Direction) -> Rect:
    """A rectangle of the picture in the frame of an engine."""
    return bounds([from_picture(rect[:2], direction), from_picture(rect[2:], direction)])


def in_picture(rect: Rect, direction: Direction) -> Rect:
    """The inverse of ``turned``."""
    return bounds([to_picture(rect[:2], direction), to_picture(rect[2:], direction)])


def across_of(direction: Direction) -> int:
    """The coordinate of the picture that is across the direction."""
    return 0 if direction in ("down", "up") else 1
