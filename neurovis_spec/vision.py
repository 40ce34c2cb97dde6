"""How well two colours can be told apart, with the common deficiencies of colour vision, too.

In: colours as ``#rrggbb``. Out: their difference ΔE00 (CIEDE2000: Sharma, Wu and Dalal 2005, Color Research and
Application 30:21-30), as seen without a deficiency or with one (Machado, Oliveira and Fernandes 2009, IEEE Transactions
on Visualization and Computer Graphics 15:1291-1298, severity 1). One of 1 is hardly seen, one of 20 at a glance.
"""

from __future__ import annotations

from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt
from typing import TypeAlias

Triple: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[Triple, Triple, Triple]

#: What is seen of linear red, green and blue.
VISIONS: dict[str, Matrix] = {
    "full colour vision": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
    "tritanopia": ((1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)),
}
_XYZ: Matrix = ((0.4124564, 0.3575761, 0.1804375), (0.2126729, 0.7151522, 0.0721750), (0.0193339, 0.1191920, 0.9503041))


def difference(one: str, other: str, vision: str) -> float:
    """ΔE00 of two colours as seen with one of ``VISIONS``.

    >>> [round(difference("#d62728", "#2ca02c", vision)) for vision in VISIONS]
    [72, 25, 5, 65]
    """
    return _difference(_lab(one, VISIONS[vision]), _lab(other, VISIONS[vision]))


def _lab(colour: str, vision: Matrix) -> Triple:
    """L*, a*, b* (D65)."""
    parts = (int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5))
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    seen = [min(max(sum(w * c for w, c in zip(row, (red, green, blue), strict=True)), 0.0), 1.0) for row in vision]
    x, y, z = (_cube_root(sum(w * c for w, c in zip(row, seen, strict=True)) / sum(row)) for row in _XYZ)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def _cube_root(share: float) -> float:
    """As CIE has it: linear near black."""
    return float(share ** (1 / 3)) if share > (6 / 29) ** 3 else share / (3 * (6 / 29) ** 2) + 4 / 29


def _difference(one: Triple, other: Triple) -> float:
    """CIEDE2000, by the names of the paper."""
    mean = (hypot(*one[1:]) + hypot(*other[1:])) / 2
    stretch = 1.5 - 0.5 * sqrt(mean**7 / (mean**7 + 25**7))
    (l1, c1, h1), (l2, c2, h2) = (_polar(colour, stretch) for colour in (one, other))
    grey = c1 * c2 == 0
    turn = 0.0 if grey else h2 - h1 - 360 * ((h2 - h1 > 180) - (h2 - h1 < -180))
    dl, dc, dh = l2 - l1, c2 - c1, 2 * sqrt(c1 * c2) * sin(radians(turn / 2))
    level, c, h = (l1 + l2) / 2, (c1 + c2) / 2, h1 + h2
    if not grey:
        h = h / 2 if abs(h1 - h2) <= 180 else (h + 360 if h < 360 else h - 360) / 2
    t = 1 - 0.17 * _cos(h - 30) + 0.24 * _cos(2 * h) + 0.32 * _cos(3 * h + 6) - 0.2 * _cos(4 * h - 63)
    sl = 1 + 0.015 * (level - 50) ** 2 / sqrt(20 + (level - 50) ** 2)
    x, y, z = dl / sl, dc / (1 + 0.045 * c), dh / (1 + 0.015 * c * t)
    rotation = -2 * sqrt(c**7 / (c**7 + 25**7)) * sin(radians(60 * exp(-(((h - 275) / 25) ** 2))))
    return sqrt(x * x + y * y + z * z + rotation * y * z)


def _polar(colour: Triple, stretch: float) -> Triple:
    """Lightness, chroma and hue in degrees; a* is stretched."""
    lightness, a, b = colour
    return lightness, hypot(stretch * a, b), degrees(atan2(b, stretch * a)) % 360


def _cos(angle: float) -> float:
    return cos(radians(angle))
