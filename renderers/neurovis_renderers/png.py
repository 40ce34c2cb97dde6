"""PNG: pixels as the bytes of a file, for the images within an SVG; by zlib and NumPy, so that SVG needs no Pillow.

In: red, green and blue of each pixel, row by row. Out: a ``.png``, with a palette where there are at most 256 colours.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOUR, _PALETTE = 2, 3


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
