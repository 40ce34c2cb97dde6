"""The drawing: a scene as a page gets it, once; and what moves in it while a neuron is dragged.

In: a Scene, its network; the plan that is shown, its layout and another. Out: JSON, compressed: the shapes as the
renderers get them, the theme, and the constants of what depends on a step (heads, halos), with lengths rounded to
hundredths of a unit, as in an SVG; the discs that stand elsewhere and the lines that run elsewhere before all is
arranged anew, in units of the picture, which stays as large as it is.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Layout
from neurovis_spec.live.room import network_rect
from neurovis_spec.scene import (
    FAMILIES,
    HALO,
    HEAD_MORE,
    HEAD_OF_LENGTH,
    HEAD_OF_WIDTH,
    SUBSCRIPT_DROP,
    SUBSCRIPT_SIZE,
    Arrowhead,
    Disc,
    Group,
    Image,
    Polygon,
    Polyline,
    Ramp,
    Rectangle,
    Scene,
    Shape,
    Spline,
    Text,
)
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.matrix import Order
from neurovis_spec.scene.plan import Plan, rerouted

#: How a line ends, as the page has it.
ENDS = {"arrow": 1, "none": 0, "bar": -1}
#: A line: its points one after the other, the tip of its head, and the direction of this; and where it leads both ways
#: the tip of the other one.
Run = tuple[list[float], ...]


def content(
    network: Network,
    scene: Scene,
    rows: Order,
    more: Mapping[str, float],
    declared: Mapping[str, object] = MappingProxyType({}),
) -> bytes:
    """The scene and what a page must know of its network, as JSON, compressed; ``rows`` are those of its matrix,
    ``more`` further constants, ``declared`` what can be turned."""
    time = network.shown_dt
    value = {
        "name": network.name,
        "title": scene.title,
        "width": scene.width,
        "height": scene.height,
        "density": scene.density,
        "network": [_short(value) for value in network_rect(scene)],
        "theme": asdict(scene.theme),
        "dt": network.dt if network.dt_given else None,
        "time": None if time is None else {"step": time.length, "unit": time.unit},
        "discs": len(network.neurons),
        "lines": len(network.connections),
        "order": rows.neurons.tolist(),
        "ends": [network.connections.sources.tolist(), network.connections.targets.tolist()],
        "bands": [[band.start, band.name, band.count] for band in (rows.levels or ((),))[0]],
        "told": list(scene.told),
        **declared,
        "constants": {
            "families": list(FAMILIES), "halo": HALO, "subscriptDrop": SUBSCRIPT_DROP, "subscriptSize": SUBSCRIPT_SIZE,
            "headOfLength": HEAD_OF_LENGTH, "headOfWidth": HEAD_OF_WIDTH, "headMore": HEAD_MORE,
            "notch": Arrowhead.NOTCH, "bar": Arrowhead.BAR, "lap": Arrowhead.LAP, "faint": FAINT,
            **more,
        },
        "groups": [group_as_json(group) for group in scene.groups],
    }  # fmt: skip
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return gzip.compress(text.encode("utf-8", "replace"), 6, mtime=0)


def group_as_json(group: Group) -> dict[str, object]:
    """A group as a page gets it."""
    shapes = [_shape(shape) for shape in group.shapes]
    return {"id": group.id, "data": dict(group.data), "title": group.title, "shapes": shapes}


def _shape(shape: Shape) -> dict[str, object]:
    match shape:
        case Disc():
            what = {"kind": "disc", "at": _points([shape.centre]), "radius": _short(shape.radius), "fill": shape.fill}
            return {**what, "stroke": shape.stroke, "width": _short(shape.stroke_width)}
        case Polyline():
            return _shape(shape.spline)
        case Spline():
            what = {"kind": "line", "points": _points(shape.points), "stroke": shape.stroke, "width": shape.width}
            flat = {"flat": True} if shape.flat else {}
            return {**what, "dash": list(shape.dash), **flat, "opacity": shape.opacity}
        case Polygon():
            return {"kind": "polygon", "points": _points(shape.points), "fill": shape.fill, "width": 2 * shape.margin}
        case Arrowhead():
            (dx, dy), what = shape.direction, {"kind": "head", "at": _points([shape.tip]), "fill": shape.fill}
            more = {
                "along": [round(dx, 5), round(dy, 5)],
                "length": _short(shape.length),
                "half": _short(shape.half_width),
            }
            return {**what, **more, "end": ENDS[shape.kind], "width": shape.width}
        case Rectangle():
            what = {"kind": "box", "at": _points([shape.corner]), "size": _points([(shape.width, shape.height)])}
            more = {"radius": _short(shape.radius), "fill": shape.fill, "stroke": shape.stroke}
            return {**what, **more, "width": _short(shape.stroke_width)}
        case Ramp():
            what = {"kind": "ramp", "at": _points([shape.corner]), "size": _points([(shape.width, shape.height)])}
            return {**what, "colours": list(shape.colours)}
        case Image():
            what = {"kind": "image", "at": _points([shape.corner]), "size": _points([(shape.width, shape.height)])}
            pixels = base64.b64encode(shape.pixels).decode()
            return {**what, "columns": shape.columns, "rows": shape.rows, "pixels": pixels}
        case Text():
            what = {"kind": "text", "at": _points([shape.point]), "text": shape.text, "font": _short(shape.size)}
            more = {"fill": shape.fill, "anchor": shape.anchor, "weight": shape.weight, "subscript": shape.subscript}
            return {**what, **more, "onDisc": shape.on_disc, "halo": shape.halo, "upward": shape.upward}


def _short(value: float) -> float:
    return round(value, 2)


def _points(points: Sequence[tuple[float, float]]) -> list[float]:
    """Coordinates one after the other, to hundredths of a unit, as in an SVG."""
    return [_short(value) for point in points for value in point]


@dataclass(frozen=True, slots=True)
class Moved:
    """Centres and lines by the ids of their groups."""

    discs: Mapping[str, tuple[float, float]]
    lines: Mapping[str, Run]


def moved(planned: Plan, before: Layout, after: Layout) -> Moved:
    """What differs between two layouts of the same network."""
    names = planned.network.neurons.names
    discs = {}
    for index, name in enumerate(names):
        if after.positions[name] != before.positions[name]:
            x, y = planned.frame.map(np.array(after.positions[name])).tolist()
            discs[f"n{index}"] = (round(x, 2), round(y, 2))
    other = [
        index
        for index, name in enumerate(planned.network.connection_names)
        if index in planned.lines and after.routes.get(name) != before.routes.get(name)
    ]
    lines = {}
    for index, line in zip(other, rerouted(planned, after, other), strict=True):
        points = [round(value, 2) for point in line.points for value in point]
        tip, along = ([round(value, 5) for value in point] for point in (line.tip, line.direction))
        lines[f"c{index}"] = points, tip, along, *([[round(value, 5) for value in line.tail]] if line.tail else [])
    return Moved(discs, lines)
