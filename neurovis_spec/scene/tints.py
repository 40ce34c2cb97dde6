"""Tints: boxes that can be told apart by their colour where there are many, as the classes of a connectome are.

In: a theme, the names of boxes. Out: a fill and a line for each, so pale that no tint can be taken for a signal.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_spec.scene.model import Theme
from neurovis_spec.scene.themes import channels

#: Two boxes are told apart by where they are.
_FEWEST = 3
_HUES = ("#8250df", "#1a9e77", "#bf8700", "#bf3989", "#4d8f1a", "#0f8b9d", "#9a5b3c", "#6e5bd0")
#: How much of the hue there is in a fill and in a line.
_FILL, _LINE = 0.07, 0.4


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
