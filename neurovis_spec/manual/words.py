"""The words of expressions, with what they mean.

In: the table of functions. Out: Words.
"""

from __future__ import annotations

from dataclasses import dataclass

from neurovis_spec.language.expressions.functions import DRAWS, FUNCTIONS, GIVEN
from neurovis_spec.language.grammar import Role


@dataclass(frozen=True, slots=True)
class Word:
    """A function (``usage`` with its arguments) or a name of expressions."""

    name: str
    usage: str
    about: str


def functions() -> tuple[Word, ...]:
    """The functions of expressions, in the order of the language reference."""
    return tuple(Word(name, function.usage, function.about) for name, function in FUNCTIONS.items())


def functions_of(role: Role) -> dict[str, Word]:
    """The functions that a formula of this role may call, by name."""
    found = {word.name: word for word in functions()}
    found |= {word.name: word for word in names() if role.draws and word.name in DRAWS}
    return found | {name: Word(name, f"{name}(x)", GIVEN[name]) for name in role.functions}


def names() -> tuple[Word, ...]:
    """What expressions may name beside parameters, and the draws."""
    draws = tuple(Word(name, row.brief, row.about) for name, row in DRAWS.items())
    return (*(Word(name, name, about) for name, about in GIVEN.items()), *draws)
