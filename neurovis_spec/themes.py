"""Themes: the colours of a picture, as data; the four that have a name.

In: nothing; what a spec changes of one. Out: Themes. The anchors of ``default``, ``dark`` and ``print`` (−1, 0, +1) can
be told apart with any common colour deficiency. ``paper`` has the red and the green of the NeuroVis paper, which are
alike with deuteranopia. ``print`` is for white paper and survives greyscale: its lightness falls from −1 over 0 to +1,
and discs have dark rings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Literal, cast


@dataclass(frozen=True, slots=True)
class Theme:
    """A theme is data: the anchors of the colours (−1, 0, +1), the glow, an opaque background, ink."""

    name: str
    negative: str
    zero: str
    positive: str
    glow: str
    background: str
    ink: str
    #: second text, box and line colours
    muted: str
    box_fill: str
    box_line: str
    #: ring around a disc
    ring: str
    #: text on a disc: the one that is easier to read on the disc's colour
    light: str
    dark: str
    #: how lines end: as the sign of the weight says (an arrowhead for w ≥ 0, a bar for w < 0), or all with arrowheads
    ends: Literal["signs", "arrows"] = "signs"

    @property
    def anchors(self) -> dict[str, str]:
        """The colours of −1, 0 and +1."""
        return {"negative": self.negative, "zero": self.zero, "positive": self.positive}


#: What of a theme a spec may change: colours.
COLOURS: tuple[str, ...] = tuple(field.name for field in fields(Theme) if field.name not in ("name", "ends"))


def changed(base: Theme, changes: Mapping[str, str]) -> Theme:
    """A theme with other colours, or other ends of lines."""
    ends = cast(Literal["signs", "arrows"], changes.get("ends", base.ends))
    return replace(base, name="own", ends=ends, **{name: changes[name] for name in COLOURS if name in changes})


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
