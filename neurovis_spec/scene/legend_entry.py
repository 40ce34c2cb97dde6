"""An entry of the legend, and what all entries are made of.

In: words, lengths, a theme. Out: Shapes with their corner at the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

from neurovis_spec.scene.model import Shape, Spline, Text, Theme

HEADING, SMALL = 11.5, 11.0
#: the middle of the sample under the heading, and the baselines of the lines of text under it
SAMPLE_Y, FIRST_Y, SECOND_Y = 20.0, 41.0, 55.0
LINE = SECOND_Y - FIRST_Y


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """Shapes with their corner at the origin, and how wide and high they are."""

    shapes: tuple[Shape, ...]
    width: float
    height: float = SECOND_Y + 3.0


def high(lines: int) -> float:
    """How high an entry is with so many lines of text: two, at least."""
    return FIRST_Y + LINE * (max(lines, 2) - 1) + 3.0


def heading(words: str, theme: Theme) -> Text:
    """What an entry is called."""
    return Text((0, 9), words, HEADING, theme.ink, weight=600)


def stroke(x: float, length: float, colour: str, width: float, y: float = SAMPLE_Y) -> Spline:
    """A horizontal line."""
    return Spline(((x, y), (x + length / 3, y), (x + length * 2 / 3, y), (x + length, y)), colour, width)
