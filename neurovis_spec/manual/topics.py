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
from neurovis_spec.manual.networks import Start, starts
from neurovis_spec.manual.words import Word, functions, names

Topic: TypeAlias = Builtin | Key | Pattern | Word | Start

_LONGEST: Final = 130  # a path of two names; what is longer is not compared with anything


@cache
def topics() -> dict[str, tuple[Topic, ...]]:
    """Every name and what it may mean: built-ins, then keys, patterns, functions and names of expressions, and
    networks to start from, which other words find, too."""
    found: dict[str, list[Topic]] = {}
    everything: tuple[Topic, ...] = (*builtins(), *keys(), *PATTERNS.values(), *functions(), *names(), *starts())
    for topic in everything:
        for name in (topic.name, *(topic.called if isinstance(topic, Start) else ())):
            found.setdefault(name, []).append(topic)
        if isinstance(topic, Key) and topic.path != topic.name:
            found.setdefault(topic.path, []).append(topic)
    return {name: tuple(several) for name, several in found.items()}


def find(name: str) -> tuple[Topic, ...]:
    """All that a name may mean, a section first, which is found by its singular, too; where there is nothing of this
    name, what has it in other letters (``FORCE``, ``least squares``). Empty for a name that nobody knows."""
    asked = name.strip().removesuffix(":").removesuffix("()")
    plural = tuple(
        topic for topic in topics().get(f"{asked}s", ()) if isinstance(topic, Key) and topic.path == topic.name
    )
    found = sorted(topics().get(asked, ()), key=lambda topic: not isinstance(topic, Key) or topic.path != asked)
    return (*found, *plural) or topics().get(_alike().get(_folded(asked), ""), ())


@cache
def _alike() -> dict[str, str]:
    """The first name of all that differ in nothing but capitals and what joins their words."""
    return {_folded(name): name for name in reversed(topics())}


def _folded(name: str) -> str:
    return name.casefold().replace(" ", "_").replace("-", "_")


def near(name: str) -> str:
    """A help line for a name that nobody knows."""
    asked = name.strip()
    if len(asked) <= _LONGEST:
        known = [*topics()]
        hint = suggest(asked, known) if nearest(asked, known) else None
        if hint is not None:
            return hint
    return "'neurovis docs' lists all names"
