"""Scaling: shapes in other units, the same picture.

In: shapes, lines or labels in page units, how many user units each of these is. Out: the same in user units. Nothing is
drawn larger for it: a picture has as many pixels fewer for each unit. What is a length or a place is known by the name
of its field, as all of these call the same things alike.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from neurovis_spec.scene.model import Group

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Scaled = TypeVar("Scaled", bound="DataclassInstance")
#: A length, a place, or several of either.
_Extent: TypeAlias = "float | tuple[_Extent, ...]"

_LENGTHS = {"radius", "margin", "width", "height", "length", "half_width", "stroke_width", "size", "head", "dash"}
_MEASURED = _LENGTHS | {"centre", "corner", "point", "points", "tip", "tail"}


def scaled(thing: Scaled, by: float) -> Scaled:
    """A shape, a line or a label with all its lengths multiplied.

    >>> from neurovis_spec.scene.model import Disc
    >>> scaled(Disc((1.0, 2.0), 3.0, "#000000", "#ffffff", 0.5), 2.0)
    Disc(centre=(2.0, 4.0), radius=6.0, fill='#000000', stroke='#ffffff', stroke_width=1.0)
    """
    measured = (field.name for field in fields(thing) if field.name in _MEASURED)
    return replace(thing, **{name: _times(getattr(thing, name), by) for name in measured})


def scaled_group(group: Group, by: float) -> Group:
    """A group with all its lengths multiplied."""
    return replace(group, shapes=tuple(scaled(shape, by) for shape in group.shapes))


def _times(extent: _Extent, by: float) -> _Extent:
    """A length multiplied, or a place so many times as far from the origin."""
    return tuple(_times(part, by) for part in extent) if isinstance(extent, tuple) else by * extent
