"""What the language itself gives a name to, as the manual tells it: functions, constants, indices, patterns, themes.

In: a name. Out: how it is written and what it means, for completions and on hover.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from neurovis_spec.language.expressions.parser import DRAWS
from neurovis_spec.manual import words as manual

#: Names that expressions have without declaring them.
GIVEN: Final[Mapping[str, str]] = manual.NAMES
#: The patterns that this version reads, and what they connect.
PATTERNS: Final[Mapping[str, str]] = {p.name: p.about for p in manual.ALL_PATTERNS}
#: The settings of those that have any, as the manual writes them: ``{random: {probability: 0.1}}``.
PATTERN_SETTINGS: Final[Mapping[str, tuple[str, ...]]] = {
    p.name: tuple(re.findall(r"(\w+):", p.use)[1:]) for p in manual.ALL_PATTERNS
}
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
