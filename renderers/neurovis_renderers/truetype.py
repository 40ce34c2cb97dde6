"""TrueType: the shipped font as a document needs it: which glyph a character has, how wide it is, and a font of some
glyphs alone.

In: the bytes of a ``.ttf``, characters. Out: numbers of glyphs, widths in thousandths of the size, the bytes of a
smaller font.
"""

from __future__ import annotations

import struct
from collections.abc import Collection
from functools import lru_cache
from pathlib import Path

#: tables that a font inside a document needs; those of hints are copied as they are
_HINTS = ("cvt ", "fpgm", "prep")
# flags of the parts of a composite glyph
_WORDS, _SCALE, _MORE, _TWO_SCALES, _MATRIX = 0x1, 0x8, 0x20, 0x40, 0x80


class Font:
    """A font file that has been read."""

    def __init__(self, data: bytes) -> None:
        (count,) = struct.unpack_from(">H", data, 4)
        self._tables = {}
        for number in range(count):
            tag, _, offset, length = struct.unpack_from(">4sIII", data, 12 + 16 * number)
            self._tables[tag.decode("latin-1")] = data[offset : offset + length]
        head = self._tables["head"]
        (self.units,) = struct.unpack_from(">H", head, 18)
        self.box = tuple(1000 * side // self.units for side in struct.unpack_from(">4h", head, 36))
        hhea = self._tables["hhea"]
        self.ascent, self.descent = (1000 * side // self.units for side in struct.unpack_from(">2h", hhea, 4))
        (measured,) = struct.unpack_from(">H", hhea, 34)
        (self.count,) = struct.unpack_from(">H", self._tables["maxp"], 4)
        numbers = struct.unpack_from(f">{2 * measured}H", self._tables["hmtx"])
        self._advances = [*numbers[::2], *[numbers[-2]] * (self.count - measured)]
        rest = struct.unpack_from(f">{self.count - measured}h", self._tables["hmtx"], 4 * measured)
        self._bearings = [*struct.unpack_from(f">{2 * measured}h", self._tables["hmtx"])[1::2], *rest]
        long = struct.unpack_from(">h", head, 50)[0] == 1
        places = struct.unpack_from(f">{self.count + 1}{'I' if long else 'H'}", self._tables["loca"])
        self._places = places if long else tuple(2 * place for place in places)
        self._glyphs = self._characters()

    def _characters(self) -> dict[int, int]:
        """Character to glyph, of the table of format 4 for Windows."""
        table = self._tables["cmap"]
        (count,) = struct.unpack_from(">H", table, 2)
        entries = [struct.unpack_from(">HHI", table, 4 + 8 * number) for number in range(count)]
        start = next(offset for platform, kind, offset in entries if (platform, kind) == (3, 1))
        (twice,) = struct.unpack_from(">H", table, start + 6)
        segments = twice // 2

        def column(number: int, form: str) -> tuple[int, ...]:
            return struct.unpack_from(f">{segments}{form}", table, start + 14 + number * twice + (2 if number else 0))

        result = {}
        ends, begins, deltas, offsets = column(0, "H"), column(1, "H"), column(2, "h"), column(3, "H")
        for segment, (end, begin, delta, offset) in enumerate(zip(ends, begins, deltas, offsets, strict=True)):
            for code in range(begin, end + 1 if end < 0xFFFF else end):
                glyph = code
                if offset:
                    at = start + 16 + 3 * twice + 2 * segment + offset + 2 * (code - begin)
                    (glyph,) = struct.unpack_from(">H", table, at)
                if glyph or not offset:
                    result[code] = (glyph + delta) & 0xFFFF
        return result

    def glyph(self, character: str) -> int:
        """The glyph of a character, 0 where there is none."""
        return self._glyphs.get(ord(character), 0)

    def advance(self, glyph: int) -> float:
        """How far the next glyph is, in thousandths of the size."""
        result: float = 1000 * self._advances[glyph] / self.units
        return result

    def width(self, text: str, size: float) -> float:
        """How long a text is."""
        return sum(self.advance(self.glyph(character)) for character in text) * size / 1000

    def _outline(self, glyph: int) -> bytes:
        return self._tables["glyf"][self._places[glyph] : self._places[glyph + 1]]

    def subset(self, glyphs: Collection[int]) -> tuple[bytes, dict[int, int]]:
        """A font of some glyphs and what they are made of; and the numbers that they have in it."""
        wanted = [0, *sorted(set(glyphs) - {0})]
        for glyph in wanted:  # grows while it is read
            wanted += [part for _, part in _parts(self._outline(glyph)) if part not in wanted]
        number = {glyph: place for place, glyph in enumerate(wanted)}
        outlines, places = b"", [0]
        for glyph in wanted:
            outline = bytearray(self._outline(glyph))
            for at, part in _parts(bytes(outline)):
                struct.pack_into(">H", outline, at, number[part])
            outlines += bytes(outline) + bytes(-len(outline) % 4)
            places.append(len(outlines))
        head, hhea, maxp = (bytearray(self._tables[name]) for name in ("head", "hhea", "maxp"))
        struct.pack_into(">I", head, 8, 0)
        struct.pack_into(">h", head, 50, 1)
        struct.pack_into(">H", hhea, 34, len(wanted))
        struct.pack_into(">H", maxp, 4, len(wanted))
        tables = {name: self._tables[name] for name in _HINTS if name in self._tables}
        tables |= {"head": bytes(head), "hhea": bytes(hhea), "maxp": bytes(maxp), "glyf": outlines}
        tables["loca"] = struct.pack(f">{len(places)}I", *places)
        tables["hmtx"] = b"".join(struct.pack(">Hh", self._advances[glyph], self._bearings[glyph]) for glyph in wanted)
        return _file(tables), number


def _parts(outline: bytes) -> list[tuple[int, int]]:
    """The glyphs of which a glyph is composed, and where their numbers stand in it."""
    if not outline or struct.unpack_from(">h", outline)[0] >= 0:
        return []
    result, at, more = [], 10, True
    while more:
        flags, glyph = struct.unpack_from(">HH", outline, at)
        result.append((at + 2, glyph))
        at += 8 if flags & _WORDS else 6
        at += 2 * bool(flags & _SCALE) + 4 * bool(flags & _TWO_SCALES) + 8 * bool(flags & _MATRIX)
        more = bool(flags & _MORE)
    return result


def _file(tables: dict[str, bytes]) -> bytes:
    """A font file of these tables."""
    power = len(tables).bit_length() - 1
    start = struct.pack(">IHHHH", 0x10000, len(tables), 16 << power, power, 16 * len(tables) - (16 << power))
    directory, body, offset = b"", b"", 12 + 16 * len(tables)
    for name in sorted(tables):
        table = tables[name]
        padded = table + bytes(-len(table) % 4)
        check = sum(struct.unpack(f">{len(padded) // 4}I", padded)) & 0xFFFFFFFF
        directory += struct.pack(">4sIII", name.encode(), check, offset + len(body), len(table))
        body += padded
    return start + directory + body


@lru_cache(maxsize=4)
def read(path: Path) -> Font:
    """The font in a file."""
    return Font(path.read_bytes())
