"""Skeletons as texts (JSON), in recordings and on the wire.

In: a Skeleton, or a text from anywhere, which is checked. Out: the other.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

from neurovis_spec.body.model import BodyError, Link, Skeleton, Solid

#: points, links, feet and solids of a skeleton that is read, each
_MOST = 100_000


def text_of(skeleton: Skeleton) -> str:
    """A skeleton as a text."""
    return json.dumps(
        {
            "points": list(skeleton.points),
            "links": [[link.start, link.end, link.radius, *link.points[2:]] for link in skeleton.links],
            "feet": list(skeleton.feet),
            "middle": skeleton.middle,
            "solids": [[list(solid.low), list(solid.high)] for solid in skeleton.solids],
        }
    )


def skeleton_of(text: str) -> Skeleton:
    """The skeleton in a text. Raises BodyError for a text that is none.

    >>> one = Skeleton(("hip", "foot"), (Link(0, 1, 0.02),), feet=(1,))
    >>> skeleton_of(text_of(one)) == one
    True
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise BodyError("not a skeleton: no mapping in JSON")
    points = _list(found, "points")
    indices = range(len(points))
    names = tuple(name for name in points if isinstance(name, str))
    if len(names) < len(points):
        raise BodyError("not a skeleton: a point has no name")
    links = tuple(_link(values, indices) for values in _several(found, "links", 3, more=True))
    solids = tuple(Solid(_corner(low), _corner(high)) for low, high in _several(found, "solids", 2))
    feet = tuple(_index(foot, indices) for foot in _list(found, "feet"))
    middle = found.get("middle", 0)
    if points or middle != 0:
        middle = _index(middle, indices)
    return Skeleton(names, links, feet, middle, solids)


def _list(found: Mapping[str, object], key: str) -> list[object]:
    values = found.get(key, [])
    if not isinstance(values, list) or len(values) > _MOST:
        raise BodyError(f"not a skeleton: '{key}' is no list, or too long")
    return values


def _link(values: list[object], indices: range) -> Link:
    """Two ends, a radius, then the ends of further lines."""
    start, end, radius, *more = values
    ends = [_index(value, indices) for value in more]
    if len(ends) % 2:
        raise BodyError("not a skeleton: a line of a link has one end")
    beside = tuple(zip(ends[::2], ends[1::2], strict=True))
    return Link(_index(start, indices), _index(end, indices), _number(radius), beside)


def _several(found: Mapping[str, object], key: str, size: int, *, more: bool = False) -> list[list[object]]:
    """Lists of so many values, or of that many and ``more``."""
    result = []
    for value in _list(found, key):
        if not isinstance(value, list) or len(value) < size or (len(value) > size and not more):
            raise BodyError(f"not a skeleton: in '{key}' there are not {size} values each")
        result.append(value)
    return result


def _index(value: object, indices: range) -> int:
    if type(value) is not int or value not in indices:
        raise BodyError(f"not a skeleton: there is no point {value!r:.40}")
    return value


def _number(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise BodyError(f"not a skeleton: {value!r:.40} is no finite number")
    return float(value)


def _corner(value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise BodyError("not a skeleton: a corner has not three coordinates")
    x, y, z = (_number(one) for one in value)
    return x, y, z
