"""What inputs are given, by reference: ``push.given``, of one of several numbers ``touch[2].given``.

In: a reference, the inputs by their names. Out: places in the vector of all inputs; None for a reference to anything
else. Groups and inputs share their names, so that no state is meant.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from neurovis_spec.compiler.names.state_references import Refusal
from neurovis_spec.compiler.network import Input
from neurovis_spec.diagnostics import shorten

#: what is said of an input as a state is of a neuron
GIVEN: Final = "given"
_GIVEN: Final = re.compile(r"(?P<name>[\w.]+?)\s*(?:\[\s*(?P<number>\d{1,9})\s*\])?\s*\.\s*given", re.ASCII)


def given_of(reference: str, inputs: Mapping[str, Input]) -> range | Refusal | None:
    """The places of the numbers that a reference names, or why there is none; None where it names no input.

    >>> touch = {"touch": Input("touch", start=4, size=2)}
    >>> given_of("touch.given", touch), given_of("touch[1].given", touch), given_of("touch", touch)
    (range(4, 6), range(5, 6), None)
    """
    found = _GIVEN.fullmatch(reference.strip())
    entry = None if found is None else inputs.get(found["name"])
    if found is None or entry is None:
        return None
    if found["number"] is None:
        return range(entry.start, entry.start + entry.size)
    number = int(found["number"])
    if number < entry.size:
        return range(entry.start + number, entry.start + number + 1)
    has = "it is one number" if entry.size == 1 else f"it has {entry.name}[0] to {entry.name}[{entry.size - 1}]"
    return Refusal(f"the input '{shorten(entry.name)}' has no number {number}", has)
