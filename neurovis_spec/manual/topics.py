"""Looking things up: everything of the manual that a name may mean.

In: a name as an author knows it (``tanh``, ``delay``, ``connections.delay``, ``neurons``). Out: the topics it fits, or
the names that are nearest.
"""

from __future__ import annotations

from functools import cache
from typing import Final, TypeAlias

from neurovis_spec.language.patterns import PATTERNS, Pattern
from neurovis_spec.likeness import nearest, suggest
from neurovis_spec.manual.builtins import Builtin, builtins
from neurovis_spec.manual.keys import Key, keys
from neurovis_spec.manual.words import Word, functions, names

Topic: TypeAlias = Builtin | Key | Pattern | Word

_LONGEST: Final = 130  # a path of two names; what is longer is not compared with anything


@cache
def topics() -> dict[str, tuple[Topic, ...]]:
    """Every name and what it may mean: built-ins, then keys, patterns, functions and names of expressions."""
    found: dict[str, list[Topic]] = {}
    everything: tuple[Topic, ...] = (*builtins(), *keys(), *PATTERNS.values(), *functions(), *names())
    for topic in everything:
        found.setdefault(topic.name, []).append(topic)
        if isinstance(topic, Key) and topic.path != topic.name:
            found.setdefault(topic.path, []).append(topic)
    return {name: tuple(several) for name, several in found.items()}


def find(name: str) -> tuple[Topic, ...]:
    """All that a name may mean, a section first, which is found by its singular, too; empty for a name that nobody
    knows."""
    asked = name.strip().removesuffix(":").removesuffix("()")
    plural = tuple(
        topic for topic in topics().get(f"{asked}s", ()) if isinstance(topic, Key) and topic.path == topic.name
    )
    found = sorted(topics().get(asked, ()), key=lambda topic: not isinstance(topic, Key) or topic.path != asked)
    return (*found, *plural)


def near(name: str) -> str:
    """A help line for a name that nobody knows."""
    asked = name.strip()
    if len(asked) <= _LONGEST:
        known = [*topics()]
        hint = suggest(asked, known) if nearest(asked, known) else None
        if hint is not None:
            return hint
    return "'neurovis docs' lists all names"
