"""Scaling: shapes in other units, the same picture.

In: shapes in page units, how many user units each of these is. Out: the same shapes in user units. Nothing is drawn
larger for it: a picture has as many pixels fewer for each unit.
"""

from __future__ import annotations

from dataclasses import replace

from neurovis_spec.layout.model import Point
from neurovis_spec.scene.labels import Label
from neurovis_spec.scene.lines import Line
from neurovis_spec.scene.model import Arrowhead, Disc, Group, Image, Polyline, Ramp, Rectangle, Shape, Spline, Text


def scaled(shape: Shape, by: float) -> Shape:
    """A shape with all its lengths multiplied."""
    match shape:
        case Disc():
            return replace(
                shape, centre=at(shape.centre, by), radius=by * shape.radius, stroke_width=by * shape.stroke_width
            )
        case Spline():
            points, dash = tuple(at(point, by) for point in shape.points), tuple(by * part for part in shape.dash)
            return replace(shape, points=points, width=by * shape.width, dash=dash)
        case Polyline():
            return replace(shape, points=tuple(at(point, by) for point in shape.points), width=by * shape.width)
        case Arrowhead():
            return replace(
                shape,
                tip=at(shape.tip, by),
                length=by * shape.length,
                half_width=by * shape.half_width,
                width=by * shape.width,
            )
        case Rectangle():
            return scaled_rectangle(shape, by)
        case Ramp() | Image():
            return replace(shape, corner=at(shape.corner, by), width=by * shape.width, height=by * shape.height)
        case Text():
            return scaled_text(shape, by)


def scaled_rectangle(shape: Rectangle, by: float) -> Rectangle:
    """A rectangle with all its lengths multiplied."""
    return replace(
        shape,
        corner=at(shape.corner, by),
        width=by * shape.width,
        height=by * shape.height,
        radius=by * shape.radius,
        stroke_width=by * shape.stroke_width,
    )


def scaled_text(text: Text, by: float) -> Text:
    """A text with all its lengths multiplied."""
    return replace(text, point=at(text.point, by), size=by * text.size)


def scaled_group(group: Group, by: float) -> Group:
    """A group with all its lengths multiplied."""
    return replace(group, shapes=tuple(scaled(shape, by) for shape in group.shapes))


def scaled_line(line: Line, by: float) -> Line:
    """A line with all its lengths multiplied."""
    return Line(tuple(at(point, by) for point in line.points), at(line.tip, by), line.direction, by * line.head)


def scaled_label(label: Label | None, by: float) -> Label | None:
    """A label with all its lengths multiplied."""
    return None if label is None else replace(label, point=at(label.point, by), size=by * label.size)


def at(point: Point, by: float) -> Point:
    """A point so many times as far from the origin."""
    return by * point[0], by * point[1]
