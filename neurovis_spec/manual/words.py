"""The words of expressions, with what they mean.

In: the table of functions. Out: Words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.given import GIVEN
from neurovis_spec.language.expressions.parser import DRAWS
from neurovis_spec.language.grammar import Role

FUNCTION_TEXTS: Mapping[str, str] = MappingProxyType(
    {
        "abs": "The absolute value.",
        "sign": "−1, 0 or 1.",
        "min": "The least of two or more.",
        "max": "The greatest of two or more.",
        "clip": "x, held between two bounds.",
        "floor": "The integer below.",
        "ceil": "The integer above.",
        "round": "The nearest integer; halves go to the even one.",
        "sqrt": "The square root.",
        "exp": "e to the power of x.",
        "log": "The natural logarithm.",
        "log1p": "log(1 + x), exact for small x.",
        "expm1": "exp(x) − 1, exact for small x.",
        "pow": "x to the power of the exponent, as x^exponent.",
        "sin": "The sine; angles are in radians.",
        "cos": "The cosine.",
        "tan": "The tangent.",
        "asin": "The angle with this sine, from −π/2 to π/2.",
        "acos": "The angle with this cosine, from 0 to π.",
        "atan": "The angle with this tangent, from −π/2 to π/2.",
        "atan2": "The angle of the point (x, y), from −π to π.",
        "sinh": "The hyperbolic sine.",
        "cosh": "The hyperbolic cosine.",
        "tanh": "The hyperbolic tangent, from −1 to 1.",
        "sigmoid": "1 / (1 + exp(−x)), from 0 to 1.",
        "step": "1 from 0 on, else 0.",
    }
)
DRAW_TEXTS: Mapping[str, str] = MappingProxyType(
    {
        "normal(mean, sd)": "A normally distributed random number.",
        "uniform(low, high)": "An evenly distributed random number.",
    }
)


@dataclass(frozen=True, slots=True)
class Word:
    """A function (``usage`` with its arguments) or a name of expressions."""

    name: str
    usage: str
    about: str


def functions() -> tuple[Word, ...]:
    """The functions of expressions, in the order of the language reference."""
    return tuple(Word(name, function.usage, FUNCTION_TEXTS[name]) for name, function in FUNCTIONS.items())


def functions_of(role: Role) -> dict[str, Word]:
    """The functions that a formula of this role may call, by name."""
    found = {word.name: word for word in functions()}
    found |= {word.name: word for word in names() if role.draws and word.name in DRAWS}
    return found | {name: Word(name, f"{name}(x)", GIVEN[name]) for name in role.functions}


def names() -> tuple[Word, ...]:
    """What expressions may name beside parameters, and the draws."""
    draws = tuple(Word(usage.partition("(")[0], usage, about) for usage, about in DRAW_TEXTS.items())
    return (*(Word(name, name, about) for name, about in GIVEN.items()), *draws)
