"""Colours: a value in −1…1 between a theme's anchors, text that can be read on it, curves and boxes told apart.

In: what a spec says of its theme; values; names of boxes. Out: a Theme; colours as ``#rrggbb``. Of the colours for
curves each has a contrast of at least 3 to the background, and any two differ by a ΔE00 of at least 17 as seen with no
deficiency and with protanopia, deuteranopia and tritanopia. They mean nothing: what a value means is said by the
theme's own colours. Nor do those of boxes (as of the classes of a connectome), which are so pale that none can be taken
for a signal.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.themes import THEMES as THEMES
from neurovis_spec.themes import Theme, changed

_ON_LIGHT = ("#0072b2", "#aa2a55", "#808000", "#002a80", "#ff5580", "#552a00")
_ON_DARK = ("#58a6ff", "#ffaaaa", "#d5ff2a", "#008055", "#ff2aaa", "#80aa00")
#: How many there are.
MOST_DISTINCT = len(_ON_LIGHT)
#: Two boxes are told apart by where they are.
_FEWEST = 3
_HUES = ("#8250df", "#1a9e77", "#bf8700", "#bf3989", "#4d8f1a", "#0f8b9d", "#9a5b3c", "#6e5bd0")
#: How much of the hue there is in a fill and in a line.
_FILL, _LINE = 0.07, 0.4


def theme_of(settings: RenderSettings) -> Theme:
    """The theme of a picture: one of ours, or the spec's own. Raises KeyError for a name that none has."""
    base = THEMES[settings.theme]
    return changed(base, dict(settings.colours)) if settings.colours else base


def channels(colour: str) -> tuple[int, int, int]:
    """Red, green, blue of ``#rrggbb``, 0…255.

    >>> channels("#d55e00")
    (213, 94, 0)
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def blend(theme: Theme, values: FloatArray) -> npt.NDArray[np.uint8]:
    """Colours of values in −1…1, linear in sRGB between the anchors, rounded: (…, 3), 0…255. A NaN has the colour of
    texts, which is not between them."""
    negative, zero, positive = (np.array(channels(c), float) for c in (theme.negative, theme.zero, theme.positive))
    share = np.asarray(values, float)[..., None]
    mixed = np.where(share < 0, zero + (zero - negative) * share, zero + (positive - zero) * share)
    mixed = np.where(np.isnan(share), np.array(channels(theme.ink), float), mixed)
    rounded: npt.NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
    return rounded


def colours(theme: Theme, values: FloatArray | Sequence[float]) -> list[str]:
    """Colours of values in −1…1 (one dimension), as ``#rrggbb``.

    >>> colours(THEMES["default"], [-1.0, 0.0, 0.5, 1.0])
    ['#d55e00', '#969696', '#4b84a4', '#0072b2']
    """
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in blend(theme, np.asarray(values, float)).tolist()]


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2) of ``#rrggbb``, 0…1."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in channels(colour))]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """Contrast ratio (WCAG 2) of two colours, 1…21."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def readable(theme: Theme, fill: str) -> str:
    """The theme's text colour that is easier to read on ``fill``; light where that is good enough for bold text."""
    light = contrast(theme.light, fill)
    return theme.light if light >= 3.5 or light >= contrast(theme.dark, fill) else theme.dark


def distinct(theme: Theme) -> tuple[str, ...]:
    """``MOST_DISTINCT`` colours for curves on the theme's background."""
    return _ON_LIGHT if luminance(theme.background) > 0.18 else _ON_DARK


def tints_of(theme: Theme, names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """The fill and the line of each box; nothing where there are few. More boxes than hues begin anew with these."""
    if len(names) < _FEWEST:
        return {}
    return {
        name: (mixed(theme.box_fill, hue, _FILL), mixed(theme.box_line, hue, _LINE))
        for place, name in enumerate(names)
        for hue in [_HUES[place % len(_HUES)]]
    }


def mixed(one: str, other: str, share: float) -> str:
    """A colour with a share of another.

    >>> mixed("#000000", "#ffffff", 0.2)
    '#333333'
    """
    parts = [round(a + (b - a) * share) for a, b in zip(channels(one), channels(other), strict=True)]
    return "#" + "".join(f"{part:02x}" for part in parts)
