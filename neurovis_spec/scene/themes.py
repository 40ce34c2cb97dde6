"""Colours: a value in −1…1 between a theme's anchors, and text that can be read on it.

In: what a spec says of its theme; values. Out: a Theme; colours as ``#rrggbb``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.themes import THEMES as THEMES
from neurovis_spec.themes import Theme, changed


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
