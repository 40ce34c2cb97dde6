"""Peers of the raster: skia-python, Pillow's own drawing, matplotlib with networkx.

In: a Scene. Out: the bytes of a PNG of its size. Each is written as somebody would who knows the library. ImportError
where it is not installed.
"""

from __future__ import annotations

import importlib
import io
import math
from typing import Any

import numpy as np
from neurovis_renderers import coverage
from neurovis_renderers.lettering import FONTS
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from neurovis_spec.scene import Arrowhead, Disc, Polyline, Ramp, Rectangle, Scene, Spline, Text, channels


def skia_still(scene: Scene) -> bytes:
    """Skia's raster backend, with antialiasing."""
    skia: Any = importlib.import_module("skia")
    wide, high = scene.pixels
    surface = skia.Surface(wide, high)
    canvas = surface.getCanvas()
    canvas.clear(skia.Color(*channels(scene.theme.background)))
    canvas.scale(scene.density, scene.density)
    faces = [skia.Typeface.MakeFromFile(str(path)) for path in FONTS]

    def ink(colour: str, width: float = 0.0, opacity: float = 1.0) -> Any:
        paint = skia.Paint(AntiAlias=True, Color=skia.Color(*channels(colour), round(255 * opacity)))
        if width:
            paint.setStyle(skia.Paint.kStroke_Style)
            paint.setStrokeWidth(width)
            paint.setStrokeJoin(skia.Paint.kRound_Join)
        return paint

    for shape in scene.shapes():
        match shape:
            case Spline():
                path = skia.Path()
                path.moveTo(*shape.points[0])
                for place in range(1, len(shape.points) - 2, 3):
                    path.cubicTo(*shape.points[place], *shape.points[place + 1], *shape.points[place + 2])
                canvas.drawPath(path, ink(shape.stroke, shape.width, shape.opacity))
            case Polyline() | Arrowhead():
                path = skia.Path()
                path.addPoly([skia.Point(*point) for point in shape.points], isinstance(shape, Arrowhead))
                canvas.drawPath(
                    path, ink(shape.fill) if isinstance(shape, Arrowhead) else ink(shape.stroke, shape.width)
                )
            case Disc():
                canvas.drawCircle(*shape.centre, shape.radius, ink(shape.fill))
                canvas.drawCircle(*shape.centre, shape.radius, ink(shape.stroke, shape.stroke_width))
            case Rectangle():
                box = skia.Rect.MakeXYWH(*shape.corner, shape.width, shape.height)
                canvas.drawRoundRect(box, shape.radius, shape.radius, ink(shape.fill))
                canvas.drawRoundRect(box, shape.radius, shape.radius, ink(shape.stroke, shape.stroke_width))
            case Ramp():
                step = shape.width / len(shape.colours)
                for place, colour in enumerate(shape.colours):
                    left = shape.corner[0] + place * step
                    canvas.drawRect(skia.Rect.MakeXYWH(left, shape.corner[1], step, shape.height), ink(colour))
            case Text():
                font = skia.Font(faces[shape.weight >= 600], shape.size)
                font.setSubpixel(True)
                length = font.measureText(shape.text)
                x = shape.point[0] - {"start": 0.0, "middle": length / 2, "end": length}[shape.anchor]
                canvas.drawString(shape.text, x, shape.point[1], font, ink(shape.fill))
    return bytes(surface.makeImageSnapshot().encodeToData())


def pillow_still(scene: Scene) -> bytes:
    """Pillow's own lines, polygons and ellipses, which have no soft edges."""
    density = scene.density
    picture = Pillow.new("RGB", scene.pixels, scene.theme.background)
    pen = ImageDraw.Draw(picture)

    def at(point: tuple[float, float]) -> tuple[float, float]:
        return point[0] * density, point[1] * density

    for shape in scene.shapes():
        match shape:
            case Spline():
                control = np.array(shape.points) * density
                pieces = coverage.flatten(control, np.array([0, len(control)]))
                way = [tuple(point) for point in (*pieces.starts.tolist(), *pieces.ends[-1:].tolist())]
                pen.line(way, shape.stroke, max(1, round(shape.width * density)), "curve")
            case Polyline():
                way = [at(point) for point in shape.points]
                pen.line(way, shape.stroke, max(1, round(shape.width * density)), "curve")
            case Arrowhead():
                pen.polygon([at(point) for point in shape.points], shape.fill)
            case Disc():
                (x, y), r = at(shape.centre), shape.radius * density
                pen.ellipse((x - r, y - r, x + r, y + r), shape.fill, shape.stroke, max(1, round(shape.stroke_width)))
            case Rectangle():
                x, y = at(shape.corner)
                box = (x, y, x + shape.width * density, y + shape.height * density)
                pen.rounded_rectangle(box, shape.radius * density, shape.fill, shape.stroke)
            case Text():
                font = ImageFont.truetype(FONTS[shape.weight >= 600], shape.size * density)
                anchor = {"start": "ls", "middle": "ms", "end": "rs"}[shape.anchor]
                pen.text(at(shape.point), shape.text, shape.fill, font, anchor)
    return _png(picture)


def matplotlib_still(scene: Scene) -> bytes:
    """networkx's drawing of the same graph, at the same places, without names."""
    networkx: Any = importlib.import_module("networkx")
    matplotlib: Any = importlib.import_module("matplotlib")
    matplotlib.use("Agg")
    plt: Any = importlib.import_module("matplotlib.pyplot")
    nodes, edges = {}, []
    for group in scene.groups:
        shape = next(iter(group.shapes), None)
        if "neuron" in group.data and isinstance(shape, Disc):
            nodes[group.data["neuron"]] = shape
        elif "connection" in group.data:
            line = next(one for one in group.shapes if isinstance(one, Spline) and not one.glow)
            edges.append((group.data["from"], group.data["to"], line))
    graph = networkx.DiGraph()
    graph.add_nodes_from(nodes)
    graph.add_edges_from((source, target) for source, target, _ in edges)
    drawn = {(source, target): line for source, target, line in edges}
    places = {name: (disc.centre[0], -disc.centre[1]) for name, disc in nodes.items()}
    wide, high = scene.pixels
    figure = plt.figure(figsize=(wide / 100, high / 100), dpi=100)
    radius = next(iter(nodes.values())).radius * scene.density * 0.72
    networkx.draw_networkx(
        graph,
        places,
        with_labels=False,
        node_size=math.pi * radius**2,
        node_color=[disc.fill for disc in nodes.values()],
        edge_color=[drawn[edge].stroke for edge in graph.edges],
        width=[drawn[edge].width for edge in graph.edges],
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    plt.close(figure)
    return buffer.getvalue()


def _png(picture: Pillow.Image) -> bytes:
    buffer = io.BytesIO()
    picture.save(buffer, "PNG")
    return buffer.getvalue()
