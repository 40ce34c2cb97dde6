"""The value of an expression, as plain as it can be: the reference for everything that computes.

In: a tree, and what its names mean. Out: a float. IEEE arithmetic throughout: nothing raises, overflow is an infinity,
what is not defined is NaN. Comparisons, ``and``, ``or`` and ``not`` give 1 or 0; anything but 0 (NaN, too) is true.

A square is exact to rounding in every consumer: where the exponent is written as 2, ``x^2`` and ``pow(x, 2)`` are
x·x, bit for bit; any other power is the platform's ``pow``.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from neurovis_spec.language.expressions.functions import FUNCTIONS, divide, modulo, power
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Draw,
    Name,
    Number,
    Tree,
    Unary,
    is_square,
)

#: Makes the number of a draw from its two arguments.
Drawing: TypeAlias = Callable[[Draw, float, float], float]

_OPERATIONS: Mapping[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": divide,
    "%": modulo,
    "^": power,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
    "and": lambda a, b: a != 0 and b != 0,
    "or": lambda a, b: a != 0 or b != 0,
}
_NONE: Mapping[str, Callable[..., float]] = MappingProxyType({})


def evaluate(
    tree: Tree,
    names: Mapping[str, float],
    functions: Mapping[str, Callable[..., float]] = _NONE,
    draw: Drawing | None = None,
) -> float:
    """The value of ``tree``. Only the branch of a conditional that is taken is computed.

    ``functions`` are those of the place, besides the elementary ones (``f`` of a model). Raises KeyError for a name
    or a function that is not given, ValueError for a draw without ``draw``.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> evaluate(parse("1 / x if x > 0 else -x^2"), {"x": -3})
    -9.0
    """
    if (square := is_square(tree)) is not None:
        base = evaluate(square, names, functions, draw)
        return base * base
    match tree:
        case Number(value=value):
            return float(value)
        case Name(name=name):
            return float(names[name])
        case Unary(operator=sign, operand=operand):
            value = evaluate(operand, names, functions, draw)
            return float(value == 0) if sign == "not" else -value if sign == "-" else value
        case Binary(operator=symbol, left=left, right=right):
            first = evaluate(left, names, functions, draw)
            return float(_OPERATIONS[symbol](first, evaluate(right, names, functions, draw)))
        case Chain(operands=operands):
            value = evaluate(operands[0], names, functions, draw)
            for joined, operand in tree.steps:
                value = float(_OPERATIONS[joined](value, evaluate(operand, names, functions, draw)))
            return value
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            taken = then if evaluate(condition, names, functions, draw) != 0 else otherwise
            return evaluate(taken, names, functions, draw)
        case Call(function=function, arguments=arguments):
            values = [evaluate(argument, names, functions, draw) for argument in arguments]
            called = functions[function] if function in functions else FUNCTIONS[function].scalar
            return float(called(*values))
        case Draw(first=low, second=high):
            if draw is None:
                raise ValueError("this expression draws, and nothing to draw from was given")
            return float(draw(tree, evaluate(low, names, functions, draw), evaluate(high, names, functions, draw)))
