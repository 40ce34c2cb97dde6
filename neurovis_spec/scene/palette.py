"""Colours that tell curves apart: as many as can be told apart on a background, with any colour deficiency, too.

In: a theme. Out: colours. Each has a contrast of at least 3 to the background, and any two differ by a ΔE00 of at least
17 as seen with no deficiency and with protanopia, deuteranopia and tritanopia. They mean nothing: what a value means is
said by the theme's own colours.
"""

from __future__ import annotations

from neurovis_spec.scene.model import Theme
from neurovis_spec.scene.themes import luminance

_ON_LIGHT = ("#0072b2", "#aa2a55", "#808000", "#002a80", "#ff5580", "#552a00")
_ON_DARK = ("#58a6ff", "#ffaaaa", "#d5ff2a", "#008055", "#ff2aaa", "#80aa00")

#: How many there are.
MOST = len(_ON_LIGHT)


def distinct(theme: Theme) -> tuple[str, ...]:
    """``MOST`` colours for curves on the theme's background."""
    return _ON_LIGHT if luminance(theme.background) > 0.18 else _ON_DARK
