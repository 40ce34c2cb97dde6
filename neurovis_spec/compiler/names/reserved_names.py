"""What the names that the language gives mean, in words for findings.

In: a name. Out: what it is where somebody else wanted to declare it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

#: Names that mean something in the expressions of a spec or of a definition.
MEANINGS: Final[Mapping[str, str]] = {
    "pi": "the constant π, 3.14159…",
    "e": "the constant e, 2.71828…",
    "dt": "the seconds a step takes",
    "t": "the seconds since step 0",
    "k": "the step",
    "i": "the index of a neuron in its group, from 0",
    "j": "the index of the target of a connection, from 0",
    "n": "the number of neurons of a group",
    "x": "the combined input",
    "drive": "the combined input",
    "pre": "the signal that reaches the synapse",
    "sent": "the activity of the source",
    "post": "the activity of the target",
    "weight": "the weight of the connection",
}
