"""What the language itself gives a name to, as the manual tells it: functions, constants, indices, patterns, themes.

In: a name. Out: how it is written and what it means, for completions and on hover.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from neurovis_spec.language.expressions.parser import DRAWS
from neurovis_spec.manual import words as manual

THEMES: Final[Mapping[str, str]] = {
    "default": "vermilion over grey to blue, on light",
    "dark": "the same on dark",
    "print": "for paper, readable without colour",
    "paper": "red, grey and green, as in the NeuroVis paper",
}


def functions(random: bool, here: tuple[str, ...]) -> Mapping[str, tuple[str, str]]:
    """Usage and meaning of the functions that an expression may call, by name."""
    result = {word.name: (word.usage, word.about) for word in manual.functions()}
    if random:
        result |= {word.name: (word.usage, word.about) for word in manual.names() if word.name in DRAWS}
    return result | {name: (f"{name}(x)", "The neuron's activation.") for name in here}
