"""Texts with expressions in braces: ``CF{2*number}``; ``{{`` and ``}}`` are braces.

In: a text. Out: its pieces: texts, and where in it expressions stand.
"""

from __future__ import annotations

import re
from typing import NamedTuple

_BRACE = re.compile(r"\{\{|\}\}|\{")


class Hole(NamedTuple):
    """The characters of an expression, without its braces; ``closed`` says whether there is a second brace."""

    start: int
    end: int
    closed: bool = True


def pieces(text: str) -> list[str | Hole]:
    """The pieces in order.

    >>> pieces("d{number}"), pieces("{{x}"), pieces("a{b")
    (['d', Hole(start=2, end=8, closed=True)], ['{', 'x}'], ['a', Hole(start=2, end=3, closed=False)])
    """
    found: list[str | Hole] = []
    at = 0
    while (brace := _BRACE.search(text, at)) is not None:
        found.append(text[at : brace.start()])
        at = brace.end()
        if brace[0] == "{":
            end = text.find("}", at)
            found.append(Hole(at, len(text) if end < 0 else end, closed=end >= 0))
            at = len(text) if end < 0 else end + 1
        else:
            found.append(brace[0][0])
    found.append(text[at:])
    return [piece for piece in found if piece != ""]
