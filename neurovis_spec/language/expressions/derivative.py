"""Derivatives of formulas, symbolic and exact: the chain rule over the table of functions.

In: a tree, and one of its names, or the derivatives of several. Out: a tree. What is constant between its jumps
(``floor``, comparisons, conditions) has the derivative 0; of a conditional it is that of the branch that is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from types import MappingProxyType

from neurovis_spec.language.expressions.emit import simplify
from neurovis_spec.language.expressions.functions import FUNCTIONS, OPERATORS, Operation
from neurovis_spec.language.expressions.parser import formula, parse
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Draw,
    ExpressionError,
    Name,
    Number,
    Tree,
    Unary,
    Visitor,
    check_extent,
    names,
    put,
)

_ZERO: Tree = Number(0.0)
_ONE: Tree = Number(1.0)


def derivative(tree: Tree, name: str) -> Tree:
    """The derivative of a formula by a name. Raises KeyError for a function of the place, ValueError for a draw of what
    depends on the name, ExpressionError where it costs more or goes deeper than an expression may.

    >>> from neurovis_spec.language.expressions.emit import emit
    >>> from neurovis_spec.language.expressions.parser import parse
    >>> emit(derivative(parse("a*tanh(x) + x^2"), "x"), {"a": "a", "x": "x"})
    'a*(1.0 - np.square(np.tanh(x))) + 2.0*x'
    """
    return slope(tree, {name: _ONE})


def slope(tree: Tree, slopes: Mapping[str, Tree], functions: Mapping[str, str] = MappingProxyType({})) -> Tree:
    """The derivative of a formula by something on which its names depend: ``slopes`` has the derivatives of those that
    do. ``functions`` gives, by functions of one argument of the place, those that are their derivatives. Raises as
    ``derivative``.

    >>> from neurovis_spec.language.expressions.emit import emit
    >>> from neurovis_spec.language.expressions.parser import parse
    >>> made = slope(parse("a*f(u)", extra_functions={"f": 1}), {"u": Name("du")}, {"f": "g"})
    >>> emit(made, {"a": "a", "u": "u", "du": "du"}, {"g": "g({})".format})
    'a*((g(u))*du)'
    """
    made = simplify(_By(slopes, functions).of(tree))
    check_extent(made, tree)
    return made


class _By(Visitor[Tree]):
    """The derivatives by one variable."""

    def __init__(self, slopes: Mapping[str, Tree], functions: Mapping[str, str]) -> None:
        self.slopes, self.functions = slopes, functions

    def of(self, tree: Tree) -> Tree:
        return _ZERO if self.slopes.keys().isdisjoint(names(tree)) else super().of(tree)

    def number(self, node: Number) -> Tree:
        return _ZERO

    def name(self, node: Name) -> Tree:
        return self.slopes[node.name]

    def negative(self, operand: Tree) -> Tree:
        return Unary("-", self.of(operand))

    def negation(self, operand: Tree) -> Tree:
        return _ZERO

    def square(self, base: Tree) -> Tree:
        return _product(_product(Number(2.0), base), self.of(base))

    def comparison(self, node: Binary) -> Tree:
        return _ZERO

    def logic(self, node: Chain) -> Tree:
        return _ZERO

    def arithmetic(self, node: Chain) -> Tree:
        base, count = node.operands[0], len(node.operands)
        if set(node.operators) == {"*"} and node.operands == (base,) * count:  # a power
            rest = base if count == 2 else Chain(node.operators[1:], node.operands[1:])
            return _product(_product(Number(float(count)), rest), self.of(base))
        made, slope = base, self.of(base)
        for place, (operator, operand) in enumerate(node.steps, start=1):
            slope = _chained(OPERATORS[operator], (made, operand), (slope, self.of(operand)))
            made = Chain(node.operators[:place], node.operands[: place + 1])
        return slope

    def conditional(self, node: Conditional) -> Tree:
        return Conditional(node.condition, self.of(node.then), self.of(node.otherwise))

    def call(self, node: Call) -> Tree:
        if node.function in self.functions:
            (argument,) = node.arguments
            return _product(Call(self.functions[node.function], node.arguments), self.of(argument))
        row = FUNCTIONS[node.function]
        first, *others = node.arguments
        if row.most is not None:
            return _chained(row, node.arguments, [self.of(argument) for argument in node.arguments])
        made, slope = first, self.of(first)
        for argument in others:
            slope = _chained(row, (made, argument), (slope, self.of(argument)))
            made = Call(node.function, (made, argument))
        return slope

    def draw(self, node: Draw) -> Tree:
        name = min(names(node) & self.slopes.keys())
        raise ValueError(f"a random number that depends on '{name}' has no derivative")


def _chained(row: Operation, arguments: Sequence[Tree], slopes: Sequence[Tree]) -> Tree:
    """The chain rule: the derivatives by each argument, times those of the arguments."""
    if row.derivative is None:
        return _ZERO
    given = dict(zip(row.names, arguments, strict=True))
    terms = [
        _product(put(formula(text), given), slope)
        for text, slope in zip(row.derivative, slopes, strict=True)
        if slope != _ZERO
    ]
    return reduce(_sum, terms, _ZERO)


def _product(a: Tree, b: Tree) -> Tree:
    return b if a == _ONE else a if b == _ONE else Chain(("*",), (a, b))


def _sum(a: Tree, b: Tree) -> Tree:
    """A long sum stays one node."""
    if a == _ZERO:
        return b
    if isinstance(a, Chain) and set(a.operators) <= {"+", "-"}:
        return Chain((*a.operators, "+"), (*a.operands, b))
    return Chain(("+",), (a, b))


def as_derivative(state: str, step: str) -> str | None:
    """The derivative of which a formula for ``each_step`` is a step of the Euler method; None where it is no such step.

    >>> as_derivative("v", "v + dt*(drive - v)/tau"), as_derivative("v", "(1 - leak)*v + leak*drive")
    ('(drive - v)/tau', '(drive - v)*leak/dt')
    >>> as_derivative("v", "v + dt/tau*(drive - v)"), as_derivative("v", "v + 2*drive")
    ('1/tau*(drive - v)', None)
    >>> as_derivative("g", "g + dt*(pre.v - g)/post.tau")
    '(pre.v - g)/post.tau'
    """
    try:
        tree = parse(step, extra_functions={"f": 1}, naming="ends")
    except ExpressionError:
        return None
    match tree:
        case Chain(
            operators=("+",),
            operands=(
                Name(name=own),
                Chain(operators=("*" | "/" as first, *_), operands=(Name(name="dt"), *_)) as rest,
            ),
        ) if own == state:
            of_dt = step[rest.operands[0].end : rest.end].lstrip()
            return of_dt.lstrip(" *") if first == "*" else f"1{of_dt}"
        case Chain(
            operators=("+",),
            operands=(
                Chain(
                    operators=("*",),
                    operands=(Chain(operators=("-",), operands=(Number(value=1.0), Name(name=lost))), Name(name=own)),
                ),
                Chain(operators=("*",), operands=(Name(name=taken), _)) as rest,
            ),
        ) if (own, lost) == (state, taken):
            share = "" if taken == "dt" else f"*{taken}/dt"
            return f"({step[rest.operands[0].end : rest.end].lstrip(' *')} - {state}){share}"
    return None
