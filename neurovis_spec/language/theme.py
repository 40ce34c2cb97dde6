"""The theme of a picture: a name, or a mapping of colours; the shape as written.

In: nodes. Out: a frozen model whose leaves know their places.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, ClassVar, Final

from pydantic import Field, ValidationInfo

from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.grammar import Plain
from neurovis_spec.language.located import Leaf, Located, as_text, findings_of, give_up, words
from neurovis_spec.language.model import Model, Short
from neurovis_spec.language.yaml.source import Node

_COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
THEMES: Final[Mapping[str, str]] = {
    "default": "vermilion over grey to blue, on light",
    "dark": "the same on dark",
    "print": "for paper, readable without colour",
    "paper": "red, grey and green, as in the NeuroVis paper",
}


def _colour(node: Node, info: ValidationInfo) -> Located[str]:
    """``#rrggbb``."""
    text = as_text(node, info)
    if not _COLOUR.fullmatch(text.value):
        message = f"'{shorten(text.value)}' is not a colour"
        findings_of(info).error("bad-colour", node.span, message, "write six hexadecimal digits, '#d55e00', in quotes")
        give_up()
    return Located(text.value.lower(), text.node)


ColourField = Annotated[Located[str], Leaf(_colour, Plain({"type": "string", "pattern": f"^{_COLOUR.pattern}$"}))]


class ThemeModel(Model):
    """A theme of one's own: another one with other colours."""

    PLACE: ClassVar[str] = "'render: theme'"
    UNSAID: ClassVar[str] = "leave the key out, or write a colour in quotes, '#d55e00': # begins a comment"

    base: Annotated[Located[str], words(*THEMES, abouts=THEMES)] | None = Field(
        None, description="The theme whose colours hold where no other is given: default, dark, print or paper."
    )
    negative: ColourField | None = Field(None, description="The colour of −1, in quotes: '#d55e00'.")
    zero: ColourField | None = Field(None, description="The colour of 0.")
    positive: ColourField | None = Field(None, description="The colour of 1.")
    glow: ColourField | None = Field(None, description="Around connections whose weight changes.")
    background: ColourField | None = Field(None, description="Behind all.")
    ink: ColourField | None = Field(None, description="Titles, and labels beside discs.")
    muted: ColourField | None = Field(None, description="Other texts, and the lines of the legend.")
    box_fill: ColourField | None = Field(None, description="Within boxes.")
    box_line: ColourField | None = Field(None, description="Around boxes.")
    ring: ColourField | None = Field(None, description="Around discs.")
    light: ColourField | None = Field(None, description="Texts on dark discs.")
    dark: ColourField | None = Field(None, description="Texts on light discs.")
    ends: Annotated[Located[str], words("signs", "arrows")] | None = Field(
        None,
        description="Lines end as the sign of their weight says, or all in arrowheads: signs, arrows (default signs).",
    )


ThemeField = Annotated[ThemeModel, Short("base", "the name of a theme, or a mapping of its colours")]
