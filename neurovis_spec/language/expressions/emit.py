"""From a tree to NumPy code, for backends that compile what they run.

In: a tree, and an identifier (or code of our own making) for each of its names. Out: one Python expression over ``np``.
Nothing of the author's text gets into it: names are replaced, numbers written by ``repr``, operators and functions
taken from tables. The code is meant to run under ``np.errstate(all="ignore")`` on float64 values (arrays, NumPy scalars
or Python floats), with no name but ``np`` and those given.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import FUNCTIONS
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
    children,
    is_square,
    rebuild,
)

#: Makes the code of a draw from the codes of its two arguments.
DrawCode: TypeAlias = Callable[[Draw, str, str], str]
#: Code, and how tight its outermost operator binds in Python.
_Code: TypeAlias = tuple[str, int]

_ANY, _COMPARE, _OR, _AND, _ADD, _MULTIPLY, _SIGN, _ATOM = range(8)
_ARITHMETIC: Mapping[str, int] = {"+": _ADD, "-": _ADD, "*": _MULTIPLY}
_COMPARISONS = frozenset({"<", "<=", ">", ">=", "==", "!="})
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*(?:\[[A-Za-z0-9_:, ]*\])?")
_NONE: Mapping[str, Callable[..., str]] = MappingProxyType({})


def emit(
    tree: Tree,
    names: Mapping[str, str],
    functions: Mapping[str, Callable[..., str]] = _NONE,
    draw: DrawCode | None = None,
) -> str:
    """NumPy code for ``tree``.

    ``names`` gives the code of each name, ``functions`` makes that of a call from the codes of the arguments (``%`` and
    ``^`` among them, where they are not NumPy's), ``draw`` that of a draw. Raises KeyError for a name or a function
    that is not given, ValueError for a draw without ``draw``.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> emit(parse("w + rate * pre * (target - post)"), {n: n[0] for n in ("w", "rate", "pre", "target", "post")})
    'w + r*p*(t - p)'
    >>> emit(parse("x^2 if x < 0 or c else tanh(x)"), {"x": "a3", "c": "p0"})
    'np.where((a3 < 0.0) | (p0 != 0.0), a3*a3, np.tanh(a3))'
    """
    return _Emitter(names, functions, draw).value(simplify(tree))[0]


def simplify(tree: Tree) -> Tree:
    """The tree with its constant parts computed; never with another value.

    What is not finite stays as written, and so does an exponent that comes to 2 (written, it would be a square).

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> simplify(parse("2 * 3 + 1/0")).operands[0]
    Number(value=6.0, start=0, end=5)
    """
    parts = tuple(simplify(part) for part in children(tree))
    tree = with_values(tree, parts)
    if isinstance(tree, Chain):
        return _folded_chain(tree)
    constant = isinstance(tree, Unary | Binary | Conditional) or (isinstance(tree, Call) and tree.function in FUNCTIONS)
    if not constant or not all(isinstance(part, Number) for part in parts):
        return tree
    value = evaluate(tree, {})
    return Number(value, tree.start, tree.end) if math.isfinite(value) else tree


def with_values(tree: Tree, parts: tuple[Tree, ...]) -> Tree:
    """The node with operands that have the same values; an exponent that only comes to 2 is a power, not a square: it
    stays as it is written."""
    made = rebuild(tree, parts)
    if is_square(made) is not None and is_square(tree) is None:
        made = rebuild(tree, (parts[0], children(tree)[1]))
    return made


def _folded_chain(tree: Chain) -> Tree:
    """A sum or a product with the numbers that it begins with made one."""
    first, *rest = tree.operands
    operators = [*tree.operators]
    while rest and isinstance(first, Number) and isinstance(rest[0], Number):
        value = evaluate(Chain((operators[0],), (first, rest[0])), {})
        if not math.isfinite(value):
            break
        first = Number(value, tree.start, rest.pop(0).end)
        del operators[0]
    return Chain(tuple(operators), (first, *rest), tree.start, tree.end) if rest else first


class _Emitter:
    """Makes code: as a value (float64), or as a truth (a NumPy or Python bool)."""

    def __init__(
        self, names: Mapping[str, str], functions: Mapping[str, Callable[..., str]], draw: DrawCode | None
    ) -> None:
        self.names = names
        self.functions = functions
        self.draw = draw

    def value(self, tree: Tree) -> _Code:
        if (square := is_square(tree)) is not None:
            return self.square(square)
        match tree:
            case Number(value=value):
                return _number(value)
            case Name(name=name):
                code = self.names[name]
                return code, _ATOM if _IDENTIFIER.fullmatch(code) else _ANY
            case Unary(operator="-", operand=operand):
                return f"-{self.tight(operand, _SIGN)}", _SIGN
            case Unary(operator="+", operand=operand):
                return self.value(operand)
            case Binary(operator="^", left=left, right=right):
                # the operator of Python raises where both operands are Python floats; the function of NumPy never does
                made = self.functions.get("^", "np.float_power({}, {})".format)
                return made(self.loose(left), self.loose(right)), _ATOM
            case Chain() if tree.operators[0] not in ("and", "or"):
                return self.arithmetic(tree)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                choice = f"{self.truth(condition)[0]}, {self.loose(then)}, {self.loose(otherwise)}"
                return f"np.where({choice})", _ATOM
            case Call(function=function, arguments=arguments):
                return self.call(function, arguments)
            case Draw(first=first, second=second):
                if self.draw is None:
                    raise ValueError("this expression draws, and no code to draw was given")
                return self.draw(tree, self.loose(first), self.loose(second)), _ANY
            case _:
                return f"{wrapped(self.truth(tree), _ATOM)}*1.0", _MULTIPLY

    def truth(self, tree: Tree) -> _Code:
        match tree:
            case Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
                return f"{self.tight(left, _OR)} {operator} {self.tight(right, _OR)}", _COMPARE
            case Chain(operators=("and", *_), operands=operands):
                return " & ".join(wrapped(self.truth(operand), _AND + 1) for operand in operands), _AND
            case Chain(operators=("or", *_), operands=operands):
                return " | ".join(wrapped(self.truth(operand), _OR + 1) for operand in operands), _OR
            case Unary(operator="not", operand=operand):
                return f"np.logical_not({self.truth(operand)[0]})", _ATOM
            case _:
                return f"{self.tight(tree, _OR)} != 0.0", _COMPARE

    def arithmetic(self, chain: Chain) -> _Code:
        """Sums and products: one operator after the other."""
        code, by_numpy = self.value(chain.operands[0]), False
        for operator, operand in chain.steps:
            if operator in _ARITHMETIC:
                level = _ARITHMETIC[operator]
                joined = f" {operator} " if level == _ADD else operator
                code = f"{wrapped(code, level)}{joined}{self.tight(operand, level + 1)}", level
            elif (by_numpy and operator not in self.functions) or (operator == "/" and _divides(operand)):
                code = f"{wrapped(code, _MULTIPLY)}{operator}{self.tight(operand, _SIGN)}", _MULTIPLY
            else:
                # the operators of Python raise where both operands are Python floats; the functions of NumPy never do,
                # and what comes of them is no such float
                name = {"/": "divide", "%": "remainder"}[operator]
                made = self.functions.get(operator, f"np.{name}({{}}, {{}})".format)
                code, by_numpy = (made(code[0], self.loose(operand)), _ATOM), True
        return code

    def square(self, base: Tree) -> _Code:
        code, level = self.value(base)
        if isinstance(base, Name) and level == _ATOM:
            return f"{code}*{code}", _MULTIPLY
        return f"np.square({code})", _ATOM

    def call(self, function: str, arguments: tuple[Tree, ...]) -> _Code:
        if function in self.functions:
            return self.functions[function](*map(self.loose, arguments)), _ANY
        entry = FUNCTIONS[function]
        codes = [self.tight(argument, _SIGN if entry.signed else _ANY) for argument in arguments]
        if entry.most is None:
            return folded(entry.code.format, codes), _ATOM
        return entry.code.format(*codes), _ATOM

    def loose(self, tree: Tree) -> str:
        return self.value(tree)[0]

    def tight(self, tree: Tree, level: int) -> str:
        return wrapped(self.value(tree), level)


def _divides(tree: Tree) -> bool:
    """Whether anything can be divided by it: a number, but not 0."""
    return isinstance(tree, Number) and tree.value != 0 and math.isfinite(tree.value)


def wrapped(code: _Code, level: int) -> str:
    """Code, in parentheses where its operator binds less tight than is wanted."""
    return code[0] if code[1] >= level else f"({code[0]})"


def _number(value: float) -> _Code:
    if math.isnan(value):
        return "np.nan", _ATOM
    if math.isinf(value):
        return ("np.inf", _ATOM) if value > 0 else ("-np.inf", _SIGN)
    return repr(float(value)), _ATOM if math.copysign(1.0, value) > 0 else _SIGN


def folded(join: Callable[[str, str], str], arguments: list[str]) -> str:
    """min and max of many, halved again and again: few parentheses inside each other, however many there are."""
    if len(arguments) == 1:
        return arguments[0]
    middle = (len(arguments) + 1) // 2
    return join(folded(join, arguments[:middle]), folded(join, arguments[middle:]))


def defined(name: str, lines: Iterable[str], about: str, namespace: dict[str, object]) -> object:
    """The function of this name that lines of code define; ``about`` stands for a file in tracebacks. The lines hold
    what ``emit`` gives and identifiers of our own, never a text of an author."""
    exec(compile("\n".join([*lines, ""]), f"<{about}>", "exec"), namespace)
    return namespace[name]
