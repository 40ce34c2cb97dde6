"""PDF: a Scene as a page of vectors, with texts that can be searched and copied.

In: a Scene. Out: the bytes of a ``.pdf``, the same for the same scene. A user unit is 1/96 of an inch. The font is the
shipped one, of which the file holds the glyphs that it shows.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from neurovis_renderers.lettering import BOLD, FONTS, warn_of_letters
from neurovis_renderers.truetype import Font, read
from neurovis_spec.scene import (
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
    channels,
)

#: Points of a user unit.
_POINTS = 0.75
#: How far the handles of a quarter of a circle lie, in radii.
_HANDLE = 0.5523


class PdfRenderer:
    """Stills as PDF."""

    name = "pdf"
    capabilities = RendererCapabilities(stills=frozenset({".pdf"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as a file of one page."""
        warn_of_letters(scene)
        return _Page(scene).file()

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """Films are made by others. Raises ValueError."""
        raise ValueError("this renderer makes no films")


def _number(value: float) -> str:
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def _numbers(*values: float) -> str:
    return " ".join(_number(value) for value in values)


def _colour(colour: str, operator: str) -> str:
    return f"{_numbers(*(channel / 255 for channel in channels(colour)))} {operator}\n"


class _Page:
    """The objects of a file, and what its page shows."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._objects: list[bytes] = []
        self._fonts: tuple[Font, ...] = tuple(read(path) for path in FONTS)
        self._used = tuple(set[str]() for _ in FONTS)
        self._opacities: dict[float, str] = {}
        self._inner: list[tuple[str, int]] = []
        self._images: list[int] = []
        self._glyphs: tuple[dict[int, int], ...] = ()

    def file(self) -> bytes:
        """All of it."""
        scene = self._scene
        for font, used in zip(self._fonts, self._used, strict=True):
            used.update(_characters(scene, font is self._fonts[1]))
        subsets = [
            font.subset([font.glyph(character) for character in used])
            for font, used in zip(self._fonts, self._used, strict=True)
        ]
        self._glyphs = tuple(number for _, number in subsets)
        wide, high = scene.width * _POINTS, scene.height * _POINTS
        shown = f"{_numbers(_POINTS, 0, 0, -_POINTS, 0, high)} cm 1 j\n{_colour(scene.theme.background, 'rg')}"
        shown += f"{_numbers(0, 0, scene.width, scene.height)} re f\n"
        shown += "".join(self._group(group) for group in scene.groups)
        content = self._stream(shown.encode("ascii"))
        fonts = [self._font(place, data) for place, (data, _) in enumerate(subsets)]
        resources = self._resources(fonts)
        for body, number in self._inner:
            self._objects[number - 1] = self._form(body, resources)
        box = f"[0 0 {_numbers(wide, high)}]"
        kids = len(self._objects) + 2
        page = self._add(
            f"<< /Type /Page /Parent {kids} 0 R /MediaBox {box} /Resources {resources} 0 R /Contents {content} 0 R "
            f"/Group << /S /Transparency /CS /DeviceRGB >> >>"
        )
        pages = self._add(f"<< /Type /Pages /Kids [{page} 0 R] /Count 1 >>")
        catalog = self._add(f"<< /Type /Catalog /Pages {pages} 0 R >>")
        title = ("\ufeff" + scene.title).encode("utf-16-be", "replace").hex()
        info = self._add(f"<< /Title <{title}> /Producer (NeuroVis) >>")
        return self._written(catalog, info)

    def _written(self, catalog: int, info: int) -> bytes:
        result, places = b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n", []
        for number, body in enumerate(self._objects):
            places.append(len(result))
            result += b"%d 0 obj\n" % (number + 1) + body + b"\nendobj\n"
        start = len(result)
        result += b"xref\n0 %d\n0000000000 65535 f \n" % (len(places) + 1)
        result += b"".join(b"%010d 00000 n \n" % place for place in places)
        result += b"trailer\n<< /Size %d /Root %d 0 R /Info %d 0 R >>\n" % (len(places) + 1, catalog, info)
        return result + b"startxref\n%d\n%%%%EOF\n" % start

    def _add(self, body: str | bytes) -> int:
        self._objects.append(body.encode("ascii") if isinstance(body, str) else body)
        return len(self._objects)

    def _stream(self, data: bytes, more: str = "") -> int:
        packed = zlib.compress(data, 9)
        start = f"<< /Length {len(packed)} /Filter /FlateDecode {more}>>\nstream\n"
        return self._add(start.encode("ascii") + packed + b"\nendstream")

    def _resources(self, fonts: Sequence[int]) -> int:
        states = " ".join(
            f"/{name} << /ca {_number(value)} /CA {_number(value)} >>" for value, name in self._opacities.items()
        )
        letters = " ".join(f"/F{place} {number} 0 R" for place, number in enumerate(fonts))
        inner = " ".join(f"/X{number} {number} 0 R" for _, number in self._inner)
        images = " ".join(f"/I{number} {number} 0 R" for number in self._images)
        return self._add(f"<< /Font << {letters} >> /ExtGState << {states} >> /XObject << {inner} {images} >> >>")

    def _form(self, body: str, resources: int) -> bytes:
        """A form XObject with a transparency group: shapes that fade as one."""
        packed = zlib.compress(body.encode("ascii"), 9)
        box = _numbers(0, 0, self._scene.width, self._scene.height)
        start = (
            f"<< /Type /XObject /Subtype /Form /BBox [{box}] /Resources {resources} 0 R "
            f"/Group << /S /Transparency /CS /DeviceRGB >> /Length {len(packed)} /Filter /FlateDecode >>\nstream\n"
        )
        return start.encode("ascii") + packed + b"\nendstream"

    def _font(self, place: int, data: bytes) -> int:
        font, glyphs = self._fonts[place], self._glyphs[place]
        name = f"NVSUB{'AB'[place]}+DejaVuSans{'-Bold' * place}"
        file = self._stream(data, f"/Length1 {len(data)} ")
        box = " ".join(str(side) for side in font.box)
        described = self._add(
            f"<< /Type /FontDescriptor /FontName /{name} /Flags 4 /FontBBox [{box}] /ItalicAngle 0 /Ascent "
            f"{font.ascent} /Descent {font.descent} /CapHeight 729 /StemV {80 + 60 * place} /FontFile2 {file} 0 R >>"
        )
        widths = " ".join(_number(font.advance(glyph)) for glyph in glyphs)
        cid = self._add(
            f"<< /Type /Font /Subtype /CIDFontType2 /BaseFont /{name} /CIDSystemInfo << /Registry (Adobe) /Ordering "
            f"(Identity) /Supplement 0 >> /FontDescriptor {described} 0 R /W [0 [{widths}]] /CIDToGIDMap /Identity >>"
        )
        read_back = self._stream(_cmap({glyphs[font.glyph(c)]: c for c in sorted(self._used[place])}))
        return self._add(
            f"<< /Type /Font /Subtype /Type0 /BaseFont /{name} /Encoding /Identity-H /DescendantFonts [{cid} 0 R] "
            f"/ToUnicode {read_back} 0 R >>"
        )

    def _seen(self, opacity: float) -> str:
        return f"/{self._opacities.setdefault(opacity, f'O{len(self._opacities)}')} gs "

    def _group(self, group: Group) -> str:
        body = "".join(self._shape(shape) for shape in group.shapes)
        if group.opacity == 1:
            return body
        number = self._add("")
        self._inner.append((f"1 j\n{body}", number))
        return f"q {self._seen(group.opacity)}/X{number} Do Q\n"

    def _shape(self, shape: Shape) -> str:
        match shape:
            case Disc():
                (x, y), r = shape.centre, shape.radius
                return _painted(_rounded((x - r, y - r), 2 * r, 2 * r, r), shape.fill, shape.stroke, shape.stroke_width)
            case Rectangle():
                way = _rounded(shape.corner, shape.width, shape.height, shape.radius)
                return _painted(way, shape.fill, shape.stroke, shape.stroke_width)
            case Spline() | Polyline():
                return self._line(shape)
            case Polygon() if shape.margin:
                way, colours = _straight(shape.points), (_colour(shape.fill, kind) for kind in ("rg", "RG"))
                return f"q {''.join(colours)}{_number(2 * shape.margin)} w 1 j\n{way}b\nQ\n"
            case Polygon() | Arrowhead():
                return f"{_colour(shape.fill, 'rg')}{_straight(shape.points)}h f\n"
            case Ramp():
                return _ramp(shape)
            case Image():
                return self._image(shape)
            case Text():
                return self._text(shape)

    def _line(self, shape: Spline | Polyline) -> str:
        if isinstance(shape, Polyline):
            way = _straight(shape.points)
        else:
            points = shape.points
            way = f"{_numbers(*points[0])} m\n"
            for place in range(1, len(points) - 2, 3):
                way += f"{_numbers(*points[place], *points[place + 1], *points[place + 2])} c\n"
        style = f"{_number(shape.width)} w "
        if isinstance(shape, Spline) and shape.dash:
            caps = "" if shape.flat else "1 J "
            style += f"{caps}[{_numbers(*shape.dash)}] 0 d "
        if isinstance(shape, Polyline) and shape.round:
            style += "1 J "
        if shape.opacity != 1:
            style += self._seen(shape.opacity)
        drawn = f"{_colour(shape.stroke, 'RG')}{style}\n{way}S\n"
        return drawn if style.endswith("w ") else f"q {drawn}Q\n"

    def _image(self, shape: Image) -> str:
        more = (
            f"/Type /XObject /Subtype /Image /Width {shape.columns} /Height {shape.rows} /ColorSpace /DeviceRGB "
            f"/BitsPerComponent 8 /Interpolate false "
        )
        number = self._stream(shape.pixels, more)
        self._images.append(number)
        (x, y), high = shape.corner, shape.height
        return f"q {_numbers(shape.width, 0, 0, -high, x, y + high)} cm /I{number} Do Q\n"

    def _text(self, shape: Text) -> str:
        place = int(shape.weight >= BOLD)
        font = self._fonts[place]
        runs = [(shape.text, shape.size, 0.0)]
        if shape.subscript:
            runs.append((shape.subscript, SUBSCRIPT_SIZE * shape.size, SUBSCRIPT_DROP * shape.size))
        lengths = [font.width(words, size) for words, size, _ in runs]
        along = -{"start": 0.0, "middle": sum(lengths) / 2, "end": sum(lengths)}[shape.anchor]
        result, (x, y) = "", shape.point
        for (words, size, drop), length in zip(runs, lengths, strict=True):
            where = (0, -1, -1, 0, x + drop, y - along) if shape.upward else (1, 0, 0, -1, x + along, y + drop)
            code = "".join(f"{self._glyphs[place][font.glyph(character)]:04x}" for character in words)
            shown = f"/F{place} {_number(size)} Tf {_numbers(*where)} Tm <{code}> Tj ET\n"
            if shape.halo:
                style = f"{_colour(shape.halo, 'RG')}{_number(2 * HALO * shape.size)} w"
                result += f"q {style} BT 1 Tr {shown}Q\n"
            result += f"{_colour(shape.fill, 'rg')}BT {shown}"
            along += length
        return result


def _characters(scene: Scene, bold: bool) -> str:
    """The characters that a scene shows in one of the fonts."""
    texts = (shape for shape in scene.shapes() if isinstance(shape, Text) and (shape.weight >= BOLD) == bold)
    return "".join(text.text + text.subscript for text in texts)


def _straight(points: Sequence[Point]) -> str:
    first, *others = points
    return f"{_numbers(*first)} m\n" + "".join(f"{_numbers(*point)} l\n" for point in others)


def _painted(way: str, fill: str, stroke: str, width: float) -> str:
    if width <= 0:
        return f"{_colour(fill, 'rg')}{way}f\n"
    return f"{_colour(fill, 'rg')}{_colour(stroke, 'RG')}{_number(width)} w\n{way}B\n"


def _rounded(corner: Point, wide: float, high: float, radius: float) -> str:
    """The outline of a rectangle with round corners; where they meet, of an ellipse."""
    (x, y), r = corner, min(radius, wide / 2, high / 2)
    if r <= 0:
        return f"{_numbers(x, y, wide, high)} re\n"
    k, right, down = r * (1 - _HANDLE), x + wide, y + high
    return (
        f"{_numbers(x + r, y)} m\n{_numbers(right - r, y)} l\n"
        f"{_numbers(right - k, y, right, y + k, right, y + r)} c\n{_numbers(right, down - r)} l\n"
        f"{_numbers(right, down - k, right - k, down, right - r, down)} c\n{_numbers(x + r, down)} l\n"
        f"{_numbers(x + k, down, x, down - k, x, down - r)} c\n{_numbers(x, y + r)} l\n"
        f"{_numbers(x, y + k, x + k, y, x + r, y)} c h\n"
    )


def _ramp(shape: Ramp) -> str:
    """Stripes without seams: each is drawn to the end of the ramp, over the one before."""
    (x, y), step = shape.corner, shape.width / len(shape.colours)
    result = ""
    for place, colour in enumerate(shape.colours):
        rest = shape.width - place * step
        result += f"{_colour(colour, 'rg')}{_numbers(x + place * step, y, rest, shape.height)} re f\n"
    return result


def _cmap(characters: dict[int, str]) -> bytes:
    """Which character a glyph stands for, so that texts can be searched and copied."""
    rows = [
        f"<{glyph:04x}> <{character.encode('utf-16-be', 'replace').hex()}>" for glyph, character in characters.items()
    ]
    blocks = ""
    for start in range(0, len(rows), 100):
        some = rows[start : start + 100]
        blocks += f"{len(some)} beginbfchar\n" + "\n".join(some) + "\nendbfchar\n"
    return (
        "/CIDInit /ProcSet findresource begin 12 dict begin begincmap\n"
        "/CIDSystemInfo << /Registry (Adobe) /Ordering (UCS) /Supplement 0 >> def\n"
        "/CMapName /Adobe-Identity-UCS def /CMapType 2 def\n"
        "1 begincodespacerange <0000> <ffff> endcodespacerange\n"
        f"{blocks}endcmap CMapName currentdict /CMap defineresource pop end end\n"
    ).encode("ascii")
