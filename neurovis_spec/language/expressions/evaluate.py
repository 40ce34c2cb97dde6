"""The values of expressions: of one on floats, as plain as it can be, and of one on NumPy arrays, many at once.

In: a tree, and what its names mean. Out: a float (``evaluate``), the reference for everything that computes; or a float
or an array of float64 (``evaluate_array``), the same values, to the last bit where the Library is ``PLAIN``. IEEE
arithmetic throughout: nothing raises, overflow is an infinity, what is not defined is NaN. Comparisons, ``and``, ``or``
and ``not`` give 1 or 0; anything but 0 (NaN, too) is true.

A square is exact to rounding in every consumer: where the exponent is written as 2, ``x^2`` and ``pow(x, 2)`` are
x·x, bit for bit; any other power is the platform's ``pow``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.language.expressions.functions import FUNCTIONS, NUMPY, OPERATORS, Library, Vector
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Draw,
    Name,
    Number,
    Tree,
    Visitor,
)

Value: TypeAlias = float | npt.NDArray[np.float64]
#: What a name may mean; integers (indices, steps) become floats.
Given: TypeAlias = Value | npt.NDArray[np.int64]
#: Makes the number or the numbers of a draw from its two arguments.
DrawingOne: TypeAlias = Callable[[Draw, float, float], float]
Drawing: TypeAlias = Callable[[Draw, Value, Value], Value]

_NONE: Mapping[str, Callable[..., float]] = MappingProxyType({})
_NO_ARRAYS: Mapping[str, Callable[..., Value]] = MappingProxyType({})
_NOTHING_TO_DRAW = "this expression draws, and nothing to draw from was given"


def evaluate(
    tree: Tree,
    names: Mapping[str, float],
    functions: Mapping[str, Callable[..., float]] = _NONE,
    draw: DrawingOne | None = None,
) -> float:
    """The value of ``tree``. Only the branch of a conditional that is taken is computed.

    ``functions`` are those of the place, besides the elementary ones (``f`` of a model). Raises KeyError for a name
    or a function that is not given, ValueError for a draw without ``draw``.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> evaluate(parse("1 / x if x > 0 else -x^2"), {"x": -3})
    -9.0
    """
    return _OfFloats(names, functions, draw).of(tree)


def evaluate_array(
    tree: Tree,
    names: Mapping[str, Given],
    draw: Drawing | None = None,
    functions: Mapping[str, Callable[..., Value]] = _NO_ARRAYS,
    by: Library = NUMPY,
) -> Value:
    """The values of ``tree``, of the shape to which the names in it (and the draws) broadcast; a float for shape ().
    ``functions`` are those of the place, besides the elementary ones, which are computed ``by`` a library. Both
    branches of a conditional are computed, and np.where takes from them.

    Raises KeyError for a name or a function that is not given, ValueError for a draw without ``draw`` and for
    shapes that do not broadcast.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> evaluate_array(parse("1 / i if i > 1 else -i"), {"i": np.arange(4.0)})
    array([-0.        , -1.        ,  0.5       ,  0.33333333])
    """
    with np.errstate(all="ignore"):
        result = _OfArrays(names, draw, functions, by).of(tree)
    return float(result) if np.ndim(result) == 0 else np.asarray(result, dtype=np.float64)


@dataclass(slots=True)
class _OfFloats(Visitor[float]):
    """One evaluation on floats."""

    names: Mapping[str, float]
    functions: Mapping[str, Callable[..., float]]
    drawn: DrawingOne | None

    def number(self, node: Number) -> float:
        return float(node.value)

    def name(self, node: Name) -> float:
        return float(self.names[node.name])

    def negative(self, operand: Tree) -> float:
        return -self.of(operand)

    def negation(self, operand: Tree) -> float:
        return float(self.of(operand) == 0)

    def square(self, base: Tree) -> float:
        value = self.of(base)
        return value * value

    def comparison(self, node: Binary) -> float:
        return float(OPERATORS[node.operator].scalar(self.of(node.left), self.of(node.right)))

    def arithmetic(self, node: Chain) -> float:
        value = self.of(node.operands[0])
        for joined, operand in node.steps:
            value = float(OPERATORS[joined].scalar(value, self.of(operand)))
        return value

    logic = arithmetic

    def conditional(self, node: Conditional) -> float:
        return self.of(node.then if self.of(node.condition) != 0 else node.otherwise)

    def call(self, node: Call) -> float:
        called = self.functions.get(node.function) or FUNCTIONS[node.function].scalar
        return float(called(*map(self.of, node.arguments)))

    def draw(self, node: Draw) -> float:
        if self.drawn is None:
            raise ValueError(_NOTHING_TO_DRAW)
        return float(self.drawn(node, self.of(node.first), self.of(node.second)))


@dataclass(slots=True)
class _OfArrays(Visitor[Value]):
    """One evaluation on arrays."""

    names: Mapping[str, Given]
    drawn: Drawing | None
    functions: Mapping[str, Callable[..., Value]]
    by: Library

    def number(self, node: Number) -> Value:
        return np.float64(node.value)

    def name(self, node: Name) -> Value:
        return np.asarray(self.names[node.name], dtype=np.float64)

    def negative(self, operand: Tree) -> Value:
        return np.negative(self.of(operand))

    def negation(self, operand: Tree) -> Value:
        return np.equal(self.of(operand), 0).astype(np.float64)

    def square(self, base: Tree) -> Value:
        return np.square(self.of(base))

    def comparison(self, node: Binary) -> Value:
        made = OPERATORS[node.operator].array(self.of(node.left), self.of(node.right))
        return np.asarray(made, dtype=np.float64)

    def arithmetic(self, node: Chain) -> Value:
        result = self.of(node.operands[0])
        for joined, operand in node.steps:
            join: Vector = self.by.remainder if joined == "%" else OPERATORS[joined].array
            result = np.asarray(join(result, self.of(operand)), dtype=np.float64)
        return result

    logic = arithmetic

    def conditional(self, node: Conditional) -> Value:
        return np.where(np.not_equal(self.of(node.condition), 0), self.of(node.then), self.of(node.otherwise))

    def call(self, node: Call) -> Value:
        called = self.functions.get(node.function) or self.by.calls[node.function]
        return called(*map(self.of, node.arguments))

    def draw(self, node: Draw) -> Value:
        if self.drawn is None:
            raise ValueError(_NOTHING_TO_DRAW)
        return self.drawn(node, self.of(node.first), self.of(node.second))
