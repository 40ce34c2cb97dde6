"""What the language itself gives a name to, in a line each: functions, constants, indices, patterns.

In: a name. Out: how it is written and what it means, for completions and on hover.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.parser import DRAWS

#: Names that expressions have without declaring them.
GIVEN: Final[Mapping[str, str]] = {
    "pi": "3.14159…",
    "e": "2.71828…",
    "dt": "seconds a step",
    "k": "the step",
    "t": "seconds, k·dt",
    "i": "index from 0: of the neuron in its group, of the source in a connection",
    "j": "index of the target, from 0",
    "n": "how many neurons the group has",
    "n_from": "how many sources there are",
    "n_to": "how many targets there are",
    "distance": "between the positions of source and target",
    "x": "the combined input",
    "drive": "u[t], the combined input",
    "pre": "what reaches the synapse, a of the source when it was sent",
    "sent": "a of the source now",
    "post": "a of the target",
    "weight": "w[t], the weight",
}
PATTERNS: Final[Mapping[str, str]] = {
    "all_to_all": "every source with every target",
    "one_to_one": "the first with the first, and so on",
    "chain": "i to i + 1",
    "ring": "i to i + 1, and the last to the first",
    "random": "each pair with a probability",
    "fixed_indegree": "every target gets that many sources, drawn",
    "fixed_outdegree": "every source gets that many targets, drawn",
    "nearest": "every source with that many nearest targets",
    "small_world": "a ring of neighbours, some of them rewired",
    "band": "|i − j| of at most width",
}
PATTERN_SETTINGS: Final[Mapping[str, tuple[str, ...]]] = {
    "random": ("probability",),
    "fixed_indegree": ("count",),
    "fixed_outdegree": ("count",),
    "nearest": ("count",),
    "small_world": ("degree", "rewire"),
    "band": ("width",),
}
THEMES: Final[Mapping[str, str]] = {
    "default": "vermilion over grey to blue, on light",
    "dark": "the same on dark",
    "print": "for paper, readable without colour",
    "paper": "red, grey and green, as in the NeuroVis paper",
}
_DRAWS: Final[Mapping[str, str]] = {
    "normal": "a number drawn from the normal distribution",
    "uniform": "a number drawn evenly between two",
}


def functions(random: bool, here: tuple[str, ...]) -> Mapping[str, tuple[str, str]]:
    """Usage and meaning of the functions that an expression may call, by name."""
    result = {name: (function.usage, "") for name, function in FUNCTIONS.items()}
    if random:
        result |= {name: (usage, _DRAWS.get(name, "")) for name, usage in DRAWS.items()}
    return result | {name: (f"{name}(x)", "the activation of the neuron") for name in here}
