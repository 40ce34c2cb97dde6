"""The four themes, and colours: a value in −1…1 between a theme's anchors, and text that can be read on it.

In: a theme's name; values. Out: a Theme; colours as ``#rrggbb``. ``default`` can be told apart with any common colour
deficiency; ``paper`` has the anchors of the NeuroVis paper; ``print`` is for white paper and survives greyscale: its
lightness falls from −1 over 0 to +1, and discs have dark rings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from neurovis_spec.scene.model import Theme

FloatArray = npt.NDArray[np.float64]

_WHITE, _NIGHT = "#ffffff", "#15191e"

THEMES: dict[str, Theme] = {
    theme.name: theme
    for theme in (
        Theme(
            name="default",
            negative="#d55e00",
            zero="#969696",
            positive="#0072b2",
            glow="#f2c200",
            background="#ffffff",
            ink="#1f2328",
            muted="#59636e",
            box_fill="#f6f8fa",
            box_line="#d8dee4",
            ring="#ffffff",
            light=_WHITE,
            dark=_NIGHT,
        ),
        Theme(
            name="dark",
            negative="#ff8c42",
            zero="#6e7681",
            positive="#58a6ff",
            glow="#fff5cc",
            background="#0d1117",
            ink="#f0f6fc",
            muted="#9198a1",
            box_fill="#151b23",
            box_line="#30363d",
            ring="#0d1117",
            light=_WHITE,
            dark="#0d1117",
        ),
        Theme(
            name="print",
            negative="#e8a33d",
            zero="#868686",
            positive="#0a2a66",
            glow="#ecbfff",
            background="#ffffff",
            ink="#000000",
            muted="#444444",
            box_fill="#fafafa",
            box_line="#bdbdbd",
            ring="#222222",
            light=_WHITE,
            dark="#000000",
        ),
        Theme(
            name="paper",
            negative="#d62728",
            zero="#969696",
            positive="#2ca02c",
            glow="#f7d038",
            background="#ffffff",
            ink="#1f2328",
            muted="#59636e",
            box_fill="#f7f7f7",
            box_line="#dcdcdc",
            ring="#ffffff",
            light=_WHITE,
            dark=_NIGHT,
        ),
    )
}


def channels(colour: str) -> tuple[int, int, int]:
    """Red, green, blue of ``#rrggbb``, 0…255.

    >>> channels("#d55e00")
    (213, 94, 0)
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def blend(theme: Theme, values: FloatArray) -> npt.NDArray[np.uint8]:
    """Colours of values in −1…1, linear in sRGB between the anchors, rounded: (…, 3), 0…255. A NaN is drawn as 0."""
    negative, zero, positive = (np.array(channels(c), float) for c in (theme.negative, theme.zero, theme.positive))
    share = np.nan_to_num(np.asarray(values, float), nan=0.0)[..., None]
    mixed = np.where(share < 0, zero + (zero - negative) * share, zero + (positive - zero) * share)
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
