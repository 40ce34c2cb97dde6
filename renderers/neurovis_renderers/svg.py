"""SVG: a Scene as one file, without script, link or style sheet.

In: a Scene, or shapes and groups of one. Out: the bytes of an ``.svg``, the same for the same scene; well-formed XML.
Colours and widths are attributes, so that programs can read them: lengths are rounded to hundredths of a unit; the
widths of lines, which state a value (Eq. 4), are written so that they read back exactly. Images within are PNGs by zlib
and NumPy, so that SVG needs no Pillow.
"""

from __future__ import annotations

import base64
import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from neurovis_spec.scene import (
    FAMILIES,
    HALO,
    SUBSCRIPT_DROP,
    SUBSCRIPT_SIZE,
    Arrowhead,
    Disc,
    Film,
    Group,
    Image,
    Point,
    Polygon,
    Polyline,
    Progress,
    Ramp,
    Rectangle,
    RendererCapabilities,
    Scene,
    Shape,
    Spline,
    Text,
)

# What XML 1.0 allows: a character outside cannot be written, not even as a reference.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_REFERENCES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"}
_BREAKS = {"\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOUR, _PALETTE = 2, 3


def escape(text: str) -> str:
    """Text as XML; what XML forbids becomes the replacement character.

    >>> escape('<a & b>\\x00')
    '&lt;a &amp; b&gt;\ufffd'
    """
    return "".join(_REFERENCES.get(c, c) for c in _FORBIDDEN.sub("\ufffd", text)).replace("\r", "&#13;")


def quoted(text: str) -> str:
    """Text as the value of an attribute, with its quotes."""
    return '"' + "".join(_BREAKS.get(c, c) for c in escape(text)) + '"'


def num(value: float) -> str:
    """A length, to hundredths, as short as it gets.

    >>> num(12.0), num(0.504), num(-0.001)
    ('12', '.5', '0')
    """
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    if text in ("-0", ""):
        return "0"
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def exact(value: float) -> str:
    """A number that reads back exactly."""
    return str(int(value)) if value == int(value) else repr(float(value))


def pairs(points: Sequence[Point]) -> str:
    """Coordinates, as short as a path allows."""
    result = ""
    for value in (v for point in points for v in point):
        text = num(value)
        result += text if not result or text.startswith("-") else " " + text
    return result


def path(points: Sequence[Point]) -> str:
    """A cubic spline as path data."""
    return f"M{pairs(points[:1])}C{pairs(points[1:])}"


def element(shape: Shape, attributes: str = "", content: str = "") -> str:
    """A shape; ``attributes`` (with a blank before) and ``content`` are added as they are."""
    match shape:
        case Disc():
            return _close(
                f'<circle cx="{num(shape.centre[0])}" cy="{num(shape.centre[1])}" r="{num(shape.radius)}" '
                f'fill="{shape.fill}" stroke="{shape.stroke}" stroke-width="{num(shape.stroke_width)}"{attributes}',
                "circle",
                content,
            )
        case Spline():
            return _close(f"<path{_spline(shape)}{attributes}", "path", content)
        case Polyline():
            return _close(f"<path{_polyline(shape)}{attributes}", "path", content)
        case Polygon():
            return _close(f"<polygon{_polygon(shape)}{attributes}", "polygon", content)
        case Arrowhead():
            kind = ' class="bar"' if shape.kind == "bar" and "class=" not in attributes else ""
            return _close(
                f'<polygon{kind} points="{pairs(shape.points)}" fill="{shape.fill}"{attributes}', "polygon", content
            )
        case Rectangle():
            return _close(
                f'<rect x="{num(shape.corner[0])}" y="{num(shape.corner[1])}" width="{num(shape.width)}" '
                f'height="{num(shape.height)}" rx="{num(shape.radius)}" fill="{shape.fill}" '
                f'stroke="{shape.stroke}" stroke-width="{num(shape.stroke_width)}"{attributes}',
                "rect",
                content,
            )
        case Ramp():
            return _ramp(shape)
        case Image():
            return _image(shape)
        case Text():
            return _text(shape, attributes, content)


def _close(start: str, name: str, content: str) -> str:
    return f"{start}>{content}</{name}>" if content else f"{start}/>"


def _spline(shape: Spline) -> str:
    kind = ' class="glow"' if shape.glow else ""
    dash = ""
    if shape.dash:
        caps = "" if shape.flat else ' stroke-linecap="round"'
        dash = f'{caps} stroke-dasharray="{" ".join(num(d) for d in shape.dash)}"'
    opacity = f' stroke-opacity="{num(shape.opacity)}"' if shape.opacity != 1 else ""
    width = exact(shape.width)
    return f'{kind} d="{path(shape.points)}" stroke="{shape.stroke}" stroke-width="{width}"{dash}{opacity}'


def _polygon(shape: Polygon) -> str:
    """Its margin is a stroke of the same colour."""
    margin = ""
    if shape.margin:
        margin = f' stroke="{shape.fill}" stroke-width="{exact(2 * shape.margin)}" stroke-linejoin="round"'
    return f' points="{pairs(shape.points)}" fill="{shape.fill}"{margin}'


def _polyline(shape: Polyline) -> str:
    """Each point as its distance from the one before, in tenths of a unit, which add up without error."""
    places = [(round(10 * x), round(10 * y)) for x, y in shape.points]
    steps = [(x - a, y - b) for (a, b), (x, y) in pairwise(places)]
    start = pairs([(places[0][0] / 10, places[0][1] / 10)])
    line = "l" + pairs([(x / 10, y / 10) for x, y in steps]) if steps else ""
    opacity = f' stroke-opacity="{num(shape.opacity)}"' if shape.opacity != 1 else ""
    width = exact(shape.width)
    caps = ' stroke-linecap="round"' if shape.round else ""
    return f' d="M{start}{line}" stroke="{shape.stroke}" stroke-width="{width}" stroke-linejoin="round"{caps}{opacity}'


def _ramp(shape: Ramp) -> str:
    """Stripes rather than a gradient: a gradient needs an id, and two pictures in one page would share it. Each stripe
    reaches a little beneath the next, and none has soft edges, so that there are no seams."""
    (x, y), step = shape.corner, shape.width / len(shape.colours)
    down = num(shape.height)
    result = '<g shape-rendering="crispEdges">'
    for place, fill in enumerate(shape.colours):
        across = step if place == len(shape.colours) - 1 else step + 0.75
        result += f'<path d="M{num(x + place * step)} {num(y)}h{num(across)}v{down}h{num(-across)}z" fill="{fill}"/>'
    return result + "</g>"


def _image(shape: Image) -> str:
    """Cells as a PNG within the file: thousands of them would be too many elements."""
    data = base64.b64encode(png(shape.columns, shape.rows, shape.pixels)).decode()
    return (
        f'<image x="{num(shape.corner[0])}" y="{num(shape.corner[1])}" width="{num(shape.width)}" '
        f'height="{num(shape.height)}" preserveAspectRatio="none" image-rendering="pixelated" '
        f'href="data:image/png;base64,{data}"/>'
    )


def _text(shape: Text, attributes: str, content: str) -> str:
    anchor = "" if shape.anchor == "start" else f' text-anchor="{shape.anchor}"'
    weight = "" if shape.weight == 400 else f' font-weight="{shape.weight}"'
    halo = ""
    if shape.halo:
        halo = (
            f' stroke="{shape.halo}" stroke-width="{num(2 * HALO * shape.size)}" stroke-linejoin="round" '
            f'paint-order="stroke"'
        )
    inner = escape(shape.text)
    if shape.subscript:
        drop, size = num(SUBSCRIPT_DROP * shape.size), num(SUBSCRIPT_SIZE * shape.size)
        inner += f'<tspan dy="{drop}" font-size="{size}">{escape(shape.subscript)}</tspan>'
    x, y = num(shape.point[0]), num(shape.point[1])
    turn = f' transform="rotate(-90 {x} {y})"' if shape.upward else ""
    return (
        f'<text x="{x}" y="{y}" font-size="{num(shape.size)}" '
        f'fill="{shape.fill}"{weight}{anchor}{halo}{turn}{attributes}>{inner}{content}</text>'
    )


def unchanging(group: Group, attributes: str = "") -> str:
    """A group as it is drawn where nothing of it changes; without what a group would say, its shapes alone. Each shape
    of one that has a class gets the ``attributes``."""
    shapes = "".join(element(shape, attributes if "class" in group.data else "") for shape in group.shapes)
    if not group.title and not group.data and group.opacity == 1:
        return shapes + "\n"
    return f"{open_group(group)}{shapes}</g>\n"


def open_group(group: Group, attributes: str = "") -> str:
    """The start of a group, with its data attributes and its title."""
    data = "".join(f" {key if key == 'class' else f'data-{key}'}={quoted(value)}" for key, value in group.data.items())
    title = f"<title>{escape(group.title)}</title>" if group.title else ""
    opacity = f' opacity="{num(group.opacity)}"' if group.opacity != 1 else ""
    return f"<g{data}{attributes}{opacity}>{title}"


def document(scene: Scene, body: str, style: str = "", attributes: Mapping[str, str] | None = None) -> bytes:
    """A whole file around ``body``."""
    width, height = num(scene.width), num(scene.height)
    across, down = scene.pixels
    families = ",".join(f"'{name}'" if " " in name else name for name in FAMILIES)
    more = "".join(f" {key}={quoted(value)}" for key, value in (attributes or {}).items())
    told = f"<desc>{escape(chr(10).join(scene.told))}</desc>\n" if scene.told else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{across}" height="{down}" '
        f'role="img" fill="none" font-family="{families}" text-rendering="geometricPrecision"{more}>\n'
        f"<title>{escape(scene.title)}</title>\n{told}{style}"
        f'<rect width="{width}" height="{height}" fill="{scene.theme.background}"/>\n{body}</svg>\n'
    ).encode()


def png(columns: int, rows: int, pixels: bytes) -> bytes:
    """A picture of ``columns`` by ``rows`` pixels; the same pixels always give the same bytes."""
    cells = np.frombuffer(pixels, np.uint8).reshape(rows, columns, 3)
    wide = cells.astype(np.uint32)  # one number a cell: sorted far more quickly than three
    shades, which = np.unique(wide[:, :, 0] << 16 | wide[:, :, 1] << 8 | wide[:, :, 2], return_inverse=True)
    if len(shades) <= 256:
        colours = np.stack([shades >> 16, shades >> 8 & 255, shades & 255], axis=1).astype(np.uint8)
        kind, palette = _PALETTE, _chunk(b"PLTE", colours.tobytes())
        lines = which.astype(np.uint8).reshape(rows, columns)
    else:
        kind, palette, lines = _TRUE_COLOUR, b"", cells.reshape(rows, -1)
    filtered = np.concatenate([np.zeros((rows, 1), np.uint8), lines], axis=1)  # each line begins with its filter: none
    header = struct.pack(">IIBBBBB", columns, rows, 8, kind, 0, 0, 0)
    content = _chunk(b"IHDR", header) + palette + _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6))
    return _SIGNATURE + content + _chunk(b"IEND", b"")


def _chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


class SvgRenderer:
    """Stills as SVG."""

    name = "svg"
    capabilities = RendererCapabilities(stills=frozenset({".svg"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as an SVG file."""
        return document(scene, "".join(unchanging(group) for group in scene.groups))

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """Films are made by ``animated_svg``. Raises ValueError."""
        raise ValueError("this renderer makes no films")
