"""From a tree to code: to NumPy code, for backends that compile what they run, and what all code has in common.

In: a tree, and an identifier (or code of our own making) for each of its names. Out: one Python expression over ``np``.
Nothing of the author's text gets into it: names are replaced, numbers written by ``repr``, operators and functions
taken from tables. The code is meant to run under ``np.errstate(all="ignore")`` on float64 values (arrays, NumPy scalars
or Python floats), with no name but ``np`` and those given. A Writer of another language (``emit_c``) has other levels.
"""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import ClassVar, NamedTuple, TypeAlias

from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import FUNCTIONS, OPERATORS, Function, Operation
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
    Visitor,
    is_square,
)

#: Makes the code of a draw from the codes of its two arguments.
DrawCode: TypeAlias = Callable[[Draw, str, str], str]

_ANY, _COMPARE, _OR, _AND, _ADD, _MULTIPLY, _SIGN, _ATOM = range(8)
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*(?:\[[A-Za-z0-9_:, ]*\])?")
_NONE: Mapping[str, Callable[..., str]] = MappingProxyType({})


def emit(
    tree: Tree,
    names: Mapping[str, str],
    functions: Mapping[str, Callable[..., str]] = _NONE,
    draw: DrawCode | None = None,
) -> str:
    """NumPy code for ``tree``.

    ``names`` gives the code of each name, ``functions`` makes that of a call from the codes of the arguments (``%``
    among them, where it is not NumPy's), ``draw`` that of a draw. Raises KeyError for a name or a function
    that is not given, ValueError for a draw without ``draw``.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> emit(parse("w + rate * pre * (target - post)"), {n: n[0] for n in ("w", "rate", "pre", "target", "post")})
    'w + r*p*(t - p)'
    >>> emit(parse("x^2 if x < 0 or c else tanh(x)"), {"x": "a3", "c": "p0"})
    'np.where((a3 < 0.0) | (p0 != 0.0), a3*a3, np.tanh(a3))'
    """
    return _NumPy(names, functions, draw).loose(simplify(tree))


def simplify(tree: Tree) -> Tree:
    """The tree with its constant parts computed; never with another value.

    What is not finite stays as written, and so does an exponent that comes to 2 (written, it would be a square).

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> simplify(parse("2 * 3 + 1/0")).operands[0]
    Number(value=6.0, start=0, end=5)
    """
    parts = tuple(simplify(part) for part in tree.parts)
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
    made = tree.having(parts)
    if is_square(made) is not None and is_square(tree) is None:
        made = tree.having((parts[0], tree.parts[1]))
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


class Code(NamedTuple):
    """Code, and how tight its outermost operator binds. It is a number, or a ``truth`` (0 and 1 are none)."""

    text: str
    level: int
    truth: bool = False

    def within(self, level: int) -> str:
        """In parentheses where its operator binds less tight than is wanted."""
        return self.text if self.level >= level else f"({self.text})"


class Writer(Visitor[Code]):
    """Makes code of a language. ``levels`` says how tight an operator binds there, one before its operand as ``sign``;
    ``compared`` how tight the operands of a comparison have to, ``joined`` those of ``and`` and ``or``, ``signed`` that
    of a sign."""

    levels: ClassVar[Mapping[str, int]]
    compared: ClassVar[int]
    joined: ClassVar[Mapping[str, int]]
    signed: ClassVar[int]

    def value(self, tree: Tree) -> Code:
        """A tree as a number."""
        made = self.of(tree)
        return self.counted(made) if made.truth else made

    def truth(self, tree: Tree) -> Code:
        """A tree as a truth."""
        made = self.of(tree)
        if made.truth:
            return made
        zero = self.number(Number(0.0)).text
        return Code(f"{made.within(self.compared)} != {zero}", self.levels["!="], True)

    def loose(self, tree: Tree) -> str:
        """A number where everything may stand."""
        return self.value(tree).text

    def tight(self, tree: Tree, level: int) -> str:
        """A number as an operand of an operator that binds so tight."""
        return self.value(tree).within(level)

    @abstractmethod
    def counted(self, truth: Code) -> Code:
        """A truth as a number."""

    @abstractmethod
    def sign(self, row: Operation) -> str:
        """What an operator is written as."""

    def negative(self, operand: Tree) -> Code:
        """``-x``."""
        return Code(f"-{self.tight(operand, self.signed)}", self.levels["sign"])

    def comparison(self, node: Binary) -> Code:
        """``a < b``, a truth."""
        left, right = (self.tight(part, self.compared) for part in node.parts)
        return Code(f"{left} {self.sign(OPERATORS[node.operator])} {right}", self.levels[node.operator], True)

    def logic(self, node: Chain) -> Code:
        """``a and b``, a truth."""
        operator = node.operators[0]
        operands = [self.truth(operand).within(self.joined[operator]) for operand in node.operands]
        return Code(f" {self.sign(OPERATORS[operator])} ".join(operands), self.levels[operator], True)

    def infix(self, code: Code, operator: str, operand: Tree, level: int) -> Code:
        """An operand more, behind what is there."""
        own = self.levels[operator]
        sign = f" {operator} " if own == self.levels["+"] else operator
        return Code(f"{code.within(own)}{sign}{self.tight(operand, level)}", own)


class _NumPy(Writer):
    """NumPy code; a truth is a bool of NumPy or Python."""

    levels: ClassVar[Mapping[str, int]] = {
        **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), _COMPARE),
        **{"or": _OR, "and": _AND, "+": _ADD, "-": _ADD, "*": _MULTIPLY, "/": _MULTIPLY, "%": _MULTIPLY, "sign": _SIGN},
    }
    compared: ClassVar[int] = _OR
    joined: ClassVar[Mapping[str, int]] = {"or": _OR + 1, "and": _AND + 1}
    signed: ClassVar[int] = _SIGN

    def __init__(
        self, names: Mapping[str, str], functions: Mapping[str, Callable[..., str]], drawn: DrawCode | None
    ) -> None:
        self.names = names
        self.functions = functions
        self.drawn = drawn

    def number(self, node: Number) -> Code:
        value = node.value
        if math.isnan(value):
            return Code("np.nan", _ATOM)
        if math.isinf(value):
            return Code("np.inf", _ATOM) if value > 0 else Code("-np.inf", _SIGN)
        return Code(repr(float(value)), _ATOM if math.copysign(1.0, value) > 0 else _SIGN)

    def name(self, node: Name) -> Code:
        code = self.names[node.name]
        return Code(code, _ATOM if _IDENTIFIER.fullmatch(code) else _ANY)

    def counted(self, truth: Code) -> Code:
        return Code(f"{truth.within(_ATOM)}*1.0", _MULTIPLY)

    def sign(self, row: Operation) -> str:
        return row.code

    def negation(self, operand: Tree) -> Code:
        return Code(f"np.logical_not({self.truth(operand).text})", _ATOM, True)

    def square(self, base: Tree) -> Code:
        code = self.value(base)
        if isinstance(base, Name) and code.level == _ATOM:
            return Code(f"{code.text}*{code.text}", _MULTIPLY)
        return Code(f"np.square({code.text})", _ATOM)

    def arithmetic(self, node: Chain) -> Code:
        """One operator after the other."""
        code, by_numpy = self.value(node.operands[0]), False
        for operator, operand in node.steps:
            if operator in ("+", "-", "*"):
                code = self.infix(code, operator, operand, self.levels[operator] + 1)
            elif (by_numpy and operator not in self.functions) or (operator == "/" and _divides(operand)):
                code = self.infix(code, operator, operand, _SIGN)
            else:
                # the operators of Python raise where both operands are Python floats; the functions of NumPy never do,
                # and what comes of them is no such float
                made = self.functions.get(operator, OPERATORS[operator].code.format)
                code, by_numpy = Code(made(code.text, self.loose(operand)), _ATOM), True
        return code

    def conditional(self, node: Conditional) -> Code:
        choice = f"{self.truth(node.condition).text}, {self.loose(node.then)}, {self.loose(node.otherwise)}"
        return Code(f"np.where({choice})", _ATOM)

    def call(self, node: Call) -> Code:
        made = self.functions.get(node.function)
        if made is not None:
            return Code(made(*map(self.loose, node.arguments)), _ANY)
        row = FUNCTIONS[node.function]
        tight = _SIGN if "-{" in row.code else _ANY
        return Code(called(row, row.code, [self.tight(argument, tight) for argument in node.arguments]), _ATOM)

    def draw(self, node: Draw) -> Code:
        if self.drawn is None:
            raise ValueError("this expression draws, and no code to draw was given")
        return Code(self.drawn(node, self.loose(node.first), self.loose(node.second)), _ANY)


def _divides(tree: Tree) -> bool:
    """Whether anything can be divided by it: a number, but not 0."""
    return isinstance(tree, Number) and tree.value != 0 and math.isfinite(tree.value)


def called(row: Function, template: str, arguments: list[str], suffix: str = "") -> str:
    """The code of a call. min and max of many are halved again and again: few parentheses inside each other, however
    many there are."""
    if row.most is not None or len(arguments) == row.least:
        return template.format(*arguments, s=suffix)
    if len(arguments) == 1:
        return arguments[0]
    middle = (len(arguments) + 1) // 2
    halves = (called(row, template, half, suffix) for half in (arguments[:middle], arguments[middle:]))
    return template.format(*halves, s=suffix)


def defined(name: str, lines: Iterable[str], about: str, namespace: dict[str, object]) -> object:
    """The function of this name that lines of code define; ``about`` stands for a file in tracebacks. The lines hold
    what ``emit`` gives and identifiers of our own, never a text of an author."""
    exec(compile("\n".join([*lines, ""]), f"<{about}>", "exec"), namespace)
    return namespace[name]
