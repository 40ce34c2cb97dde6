"""The names that expressions have without declaring them, and what they mean.

In: nothing. Out: a table. Which formula sees which of them is said by its field (``language/grammar.py``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

#: What each name means, and where.
GIVEN: Final[Mapping[str, str]] = {
    "pi": "The constant π, 3.14159…",
    "e": "The constant e, 2.71828…",
    "dt": "The seconds a step takes (time.dt, by default 1).",
    "k": "The step of the run, from 0; in inputs, noise and definitions, which are worked out at each step.",
    "t": "The seconds of the run, k·dt; in inputs, noise and definitions, which are worked out at each step.",
    "i": "The index from 0: of a neuron in its group; in a connection, of the source in its reference.",
    "j": "In a connection, the index from 0 of the target in its reference.",
    "n": "The number of neurons of the group; a connection has n_from and n_to.",
    "number": "In a label within a module, the number of the instance: 1 of left1, and where there is only one.",
    "n_from": "In a connection, the number of sources.",
    "n_to": "In a connection, the number of targets.",
    "distance": "In a connection, how far apart the positions of both neurons are.",
    "x": "In an activation, the combined input.",
    "drive": "In a model, the combined input with bias, input and noise: u[t].",
    "f": "In the activity of a model, the neuron's activation: f(v).",
    "pre": "In a rule, the signal that reaches the synapse: the source's activity d steps ago, d being the delay.",
    "sent": "In a rule, the source's activity of this step.",
    "post": "In a rule, the target's activity of this step.",
    "weight": "In a rule, the weight before the step.",
}
#: Names that no parameter may have.
RESERVED: Final = ("t", "k", "dt", "i", "j", "n", "pi", "e")


def meaning(name: str) -> str:
    """What a name means, within a sentence.

    >>> meaning("n_to")
    'in a connection, the number of targets'
    """
    about = GIVEN[name].removesuffix(".")
    return about[0].lower() + about[1:]
