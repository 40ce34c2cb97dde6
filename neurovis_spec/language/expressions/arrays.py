"""The values of an expression on NumPy arrays: many at once.

In: a tree, and what its names mean: floats or arrays that broadcast. Out: a float or an array of float64, the same
values as ``evaluate`` gives one by one, to the last bit where the Library is ``PLAIN``. Both branches of a conditional
are computed, and np.where takes from them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.language.expressions.functions import NUMPY, Library
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

Value: TypeAlias = float | npt.NDArray[np.float64]
#: What a name may mean; integers (indices, steps) become floats.
Given: TypeAlias = Value | npt.NDArray[np.int64]
#: Makes the numbers of a draw from its two arguments.
Drawing: TypeAlias = Callable[[Draw, Value, Value], Value]
_Operation: TypeAlias = Callable[[Value, Value], Value]

_OPERATIONS: Mapping[str, _Operation] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
}
_NONE: Mapping[str, Callable[..., Value]] = MappingProxyType({})


def evaluate_array(
    tree: Tree,
    names: Mapping[str, Given],
    draw: Drawing | None = None,
    functions: Mapping[str, Callable[..., Value]] = _NONE,
    by: Library = NUMPY,
) -> Value:
    """The values of ``tree``, of the shape to which the names in it (and the draws) broadcast; a float for shape ().
    ``functions`` are those of the place, besides the elementary ones, which are computed ``by`` a library.

    Raises KeyError for a name or a function that is not given, ValueError for a draw without ``draw`` and for
    shapes that do not broadcast.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> evaluate_array(parse("1 / i if i > 1 else -i"), {"i": np.arange(4.0)})
    array([-0.        , -1.        ,  0.5       ,  0.33333333])
    """
    with np.errstate(all="ignore"):
        result = _Evaluation(names, draw, functions, by).value(tree)
    return float(result) if np.ndim(result) == 0 else np.asarray(result, dtype=np.float64)


class _Evaluation:
    """One evaluation, with the values of the names, the source of random numbers and the functions."""

    def __init__(
        self,
        names: Mapping[str, Given],
        draw: Drawing | None,
        functions: Mapping[str, Callable[..., Value]],
        by: Library,
    ) -> None:
        self.names = names
        self.draw = draw
        self.functions = functions
        self.calls = by.calls
        self.operations: Mapping[str, _Operation] = {**_OPERATIONS, "%": by.remainder, "^": by.power}

    def value(self, tree: Tree) -> Value:
        if (square := is_square(tree)) is not None:
            return np.square(self.value(square))
        match tree:
            case Number(value=value):
                return np.float64(value)
            case Name(name=name):
                return np.asarray(self.names[name], dtype=np.float64)
            case Unary(operator=sign, operand=operand):
                result = self.value(operand)
                if sign == "not":
                    return np.equal(result, 0).astype(np.float64)
                return np.negative(result) if sign == "-" else result
            case Binary(operator=symbol, left=left, right=right):
                return np.asarray(self.operations[symbol](self.value(left), self.value(right)), dtype=np.float64)
            case Chain(operands=operands):
                result = self.value(operands[0])
                for joined, operand in tree.steps:
                    result = np.asarray(self.operations[joined](result, self.value(operand)), dtype=np.float64)
                return result
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return np.where(np.not_equal(self.value(condition), 0), self.value(then), self.value(otherwise))
            case Call(function=function, arguments=arguments):
                called = self.functions[function] if function in self.functions else self.calls[function]
                return called(*map(self.value, arguments))
            case Draw(first=first, second=second):
                if self.draw is None:
                    raise ValueError("this expression draws, and nothing to draw from was given")
                return self.draw(tree, self.value(first), self.value(second))
