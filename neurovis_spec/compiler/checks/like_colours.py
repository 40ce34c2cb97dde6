"""Themes of a spec's own in which two of the colours of −1, 0 and +1 cannot be told apart.

In: what a spec says of its theme. Out: a warning, at the colour that the author gave.
"""

from __future__ import annotations

from itertools import combinations

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.drawing import ThemeModel

#: Colours whose ΔE00 is less are hardly told apart in thin lines; our themes keep 20.
_LEAST = 10.0


def check_like_colours(theme: ThemeModel, findings: Findings) -> None:
    """Warn of two anchors that are alike, once, where the author gave one of them at least."""
    from neurovis_spec.themes import THEMES, changed
    from neurovis_spec.vision import VISIONS, difference

    given = {"negative": theme.negative, "zero": theme.zero, "positive": theme.positive}
    base = THEMES["default" if theme.base is None else theme.base.value]
    anchors = changed(base, {name: colour.value for name, colour in given.items() if colour is not None}).anchors
    for vision in VISIONS:
        for one, other in combinations(anchors, 2):
            place = given[other] or given[one]
            if place is None or (apart := difference(anchors[one], anchors[other], vision)) >= _LEAST:
                continue
            message = f"'{one}' and '{other}' look alike with {vision}: ΔE00 is {apart:.0f}"
            findings.warning("like-colours", place.span, message, "the themes of NeuroVis keep 20 and more")
            return
