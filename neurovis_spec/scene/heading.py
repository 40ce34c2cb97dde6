"""The heading of a picture: its title, and beneath it the line that says what step it is.

In: texts. Out: texts with their places, cut to the width of the picture.
"""

from __future__ import annotations

from neurovis_spec.scene import texts
from neurovis_spec.scene.frame import MARGIN
from neurovis_spec.scene.model import Text, Theme

TITLE, CAPTION = 17.0, 11.5
TITLE_Y, CAPTION_Y, HEADER = 35.0, 54.0, 58.0


def title_text(title: str, width: float, theme: Theme) -> Text:
    """The title of a picture of this width."""
    words = texts.shorten(title, TITLE, width - 2 * MARGIN, 600)
    return Text((MARGIN, TITLE_Y), words, TITLE, theme.ink, weight=600)


def caption_text(words: str, width: float, theme: Theme) -> Text:
    """The line under the title."""
    return Text((MARGIN, CAPTION_Y), texts.shorten(words, CAPTION, width - 2 * MARGIN), CAPTION, theme.muted)
