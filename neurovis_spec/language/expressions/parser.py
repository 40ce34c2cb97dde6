"""From text to a typed tree, by precedence climbing.

In: the text of an expression and what its place allows. Out: a tree of ``tree.py``, or an ExpressionError at the
characters invalid. From loose to tight: ``a if c else b`` (to the right), ``or``, ``and``, ``not``, comparisons
(which do not chain), ``+ -``, ``* / %``, signs, ``^`` and ``**`` (to the right, so -x^2 is −(x²) and 2^-1 is a half).
Names are not looked up here: who parses knows which there are (``unknown_names``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import TypeAlias, cast

from neurovis_spec.language.expressions import mistakes
from neurovis_spec.language.expressions.functions import DRAWS, FUNCTIONS
from neurovis_spec.language.expressions.lexer import Naming, Token, tokens
from neurovis_spec.language.expressions.tree import (
    Binary,
    BinaryOperator,
    Call,
    Chain,
    ChainOperator,
    Conditional,
    Draw,
    DrawKind,
    ExpressionError,
    Name,
    Number,
    Tree,
    Unary,
    UnaryOperator,
    check_extent,
    walk,
)

__all__ = ["ExpressionError", "parse", "unknown_names"]

#: How many operators, parentheses and calls may stand inside each other; keeps every walk off the recursion limit.
MAX_NESTING = 64
#: The least and the most arguments of a function; None where there is no most.
Arity: TypeAlias = tuple[int, int | None]

#: How tight the operators bind; ``not`` is between ``and`` and the comparisons, signs between ``%`` and ``^``.
_OR, _AND, _NOT, _COMPARISON, _SUM, _PRODUCT, _SIGN, _POWER = range(1, 9)
_LEVELS: Mapping[str, int] = {
    **{"or": _OR, "and": _AND},
    **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), _COMPARISON),
    **dict.fromkeys(("+", "-"), _SUM),
    **dict.fromkeys(("*", "/", "%"), _PRODUCT),
    **dict.fromkeys(("^", "**"), _POWER),
}


def parse(
    text: str, *, random: bool = False, extra_functions: Mapping[str, int] | None = None, naming: Naming = ""
) -> Tree:
    """The tree of an expression. Raises ExpressionError.

    ``random`` allows ``normal(m, s)``, ``uniform(a, b)`` and ``poisson(m)``, which become Draws numbered from 0 as they
    are written; ``extra_functions`` are functions of this place besides those of all expressions, with their arities,
    which become Calls; ``naming`` says what names there may be beside plain ones, such as ``legs[3]`` or ``pre.v``.

    >>> parse("-x^2")
    Unary(operator='-', operand=Binary(operator='^', left=Name(name='x', start=1, end=2), \
right=Number(value=2.0, start=3, end=4), start=1, end=4), start=0, end=4)
    """
    return Parser(text, random, dict(extra_functions or {}), naming).whole()


@cache
def formula(text: str) -> Tree:
    """The tree of a formula of the table of functions, without places; a sign before a number belongs to it."""
    return _unplaced(parse(text))


def _unplaced(tree: Tree) -> Tree:
    if isinstance(tree, Unary) and isinstance(tree.operand, Number):
        return Number(-tree.operand.value)
    return replace(tree.having(tuple(map(_unplaced, tree.parts))), start=0, end=0)


def unknown_names(tree: Tree, known: Iterable[str]) -> list[Name]:
    """The names of a tree that are not known, in the order of the text.

    >>> [(node.name, node.start) for node in unknown_names(parse("alpha * cos(phy)"), ["alpha", "phi"])]
    [('phy', 12)]
    """
    allowed = frozenset(known)
    unknown = [node for node in walk(tree) if isinstance(node, Name) and node.name not in allowed]
    return sorted(unknown, key=lambda node: node.start)


def _takes(arity: Arity | None, given: int) -> bool:
    """Whether a function may have so many arguments."""
    return arity is not None and arity[0] <= given and (arity[1] is None or given <= arity[1])


class Parser:
    """Goes through the tokens once. Each method starts at the first token of what it is named after."""

    def __init__(self, text: str, random: bool, extra_functions: Mapping[str, int], naming: Naming = "") -> None:
        self.tokens = tokens(text, naming)
        self.at = 0
        self.nesting = 0
        self.draws = 0
        self.random = random
        self.extra_functions = extra_functions
        #: mistakes that do not keep one from going on
        self.faults: list[ExpressionError] = []

    @property
    def token(self) -> Token:
        return self.tokens[self.at]

    @property
    def previous(self) -> Token | None:
        return self.tokens[self.at - 1] if self.at else None

    @property
    def end(self) -> int:
        """Where what was read so far ends; closing parentheses belong to it."""
        return self.tokens[self.at - 1].end

    def at_end(self) -> bool:
        return self.token.kind == "end"

    def is_operator(self, *texts: str) -> bool:
        return self.token.kind == "operator" and self.token.text in texts

    def advance(self) -> Token:
        token = self.token
        self.at += 1
        return token

    @contextmanager
    def deeper(self, token: Token) -> Iterator[None]:
        if self.nesting >= MAX_NESTING:
            message = f"this expression is nested more than {MAX_NESTING} levels deep"
            raise ExpressionError("expression-too-deep", message, token.start, token.end, "give its parts names")
        self.nesting += 1
        yield
        self.nesting -= 1

    def whole(self) -> Tree:
        if self.at_end():
            raise ExpressionError("empty-expression", "an expression is missing here", 0, self.token.end)
        try:
            tree = self.conditional()
            if not self.at_end():
                raise mistakes.unexpected(self.previous, self.token)
            check_extent(tree)
        except ExpressionError as error:
            error.others = tuple(self.faults)
            raise
        if self.faults:
            first, *others = self.faults
            first.others = tuple(others)
            first.used = tuple((node.name, node.start, node.end) for node in walk(tree) if isinstance(node, Name))
            raise first
        return tree

    def conditional(self) -> Tree:
        start = self.token.start
        then = self.binary(0)
        if not self.is_operator("if"):
            return then
        word = self.advance()
        condition = self.binary(0)
        if not self.is_operator("else"):
            if not self.at_end() and not self.is_operator(")", ","):
                raise mistakes.unexpected(self.previous, self.token)
            message = "'if' without 'else': a choice needs both values"
            raise ExpressionError("missing-else", message, word.start, word.end, "write 'a if condition else b'")
        word = self.advance()
        with self.deeper(word):
            otherwise = self.conditional()
        return Conditional(condition, then, otherwise, start, self.end)

    def binary(self, level: int) -> Tree:
        """Operands joined by operators that bind at least as tight as ``level``."""
        start = self.token.start
        left = self.prefix(level)
        while self.level() >= level:
            own = self.level()
            if own not in (_POWER, _COMPARISON):
                left = self.chain(left, own, start)
                continue
            token = self.advance()
            with self.deeper(token):
                right = self.binary(own if own == _POWER else own + 1)
            operator = cast(BinaryOperator, "^" if token.text == "**" else token.text)
            left = Binary(operator, left, right, start, self.end)
            if own == self.level() == _COMPARISON:
                message = "comparisons do not chain"
                hint = "join two comparisons with 'and', as in 'a < b and b < c'"
                raise ExpressionError("chained-comparison", message, self.token.start, self.token.end, hint)
        return left

    def level(self) -> int:
        """How tight the operator binds that stands here; -1 where there is none."""
        return _LEVELS.get(self.token.text, -1) if self.token.kind == "operator" else -1

    def chain(self, first: Tree, own: int, start: int) -> Tree:
        """What is joined to ``first`` by operators that bind as tight as ``own``."""
        operators, operands = [], [first]
        while self.level() == own:
            token = self.advance()
            operators.append(cast(ChainOperator, token.text))
            with self.deeper(token):
                operands.append(self.binary(own + 1))
        return Chain(tuple(operators), tuple(operands), start, self.end)

    def prefix(self, level: int) -> Tree:
        """A sign or ``not`` with its operand, else an operand."""
        token = self.token
        if not self.is_operator("-", "+", "not"):
            return self.operand()
        if token.text == "not" and level > _NOT:
            raise mistakes.loose_not(token)
        self.advance()
        with self.deeper(token):
            operand = self.binary(_NOT if token.text == "not" else _SIGN)
        return Unary(cast(UnaryOperator, token.text), operand, token.start, self.end)

    def operand(self) -> Tree:
        token = self.token
        if token.kind == "number":
            self.advance()
            return Number(float(token.text), token.start, token.end)
        if token.kind == "name":
            self.advance()
            return self.call(token) if self.is_operator("(") else Name(token.text, token.start, token.end)
        if not self.is_operator("("):
            opened = any(other.text == "(" for other in self.tokens[: self.at])
            raise mistakes.missing(self.previous, token, opened)
        opening = self.advance()
        with self.deeper(opening):
            tree = self.conditional()
        self.close(opening)
        return tree

    def call(self, name: Token) -> Tree:
        arity = self.arity(name.text)
        index, drawn = self.draws, name.text in DRAWS and name.text not in self.extra_functions
        self.draws += drawn
        opening = self.advance()
        arguments: list[Tree] = []
        try:
            with self.deeper(opening):
                while not (self.is_operator(")") and not arguments):
                    arguments.append(self.conditional())
                    if not self.is_operator(","):
                        break
                    self.advance()
            end = self.close(opening).end
        except ExpressionError:
            self.check_call(name, arity, None, name.end)
            raise
        if not self.check_call(name, arity, len(arguments), end):
            return Call(name.text, tuple(arguments), name.start, end)
        if drawn:
            first, *others = arguments
            second = others[0] if others else Number(0.0, end, end)
            return Draw(cast(DrawKind, name.text), first, second, index, name.start, end)
        return Call(name.text, tuple(arguments), name.start, end)

    def arity(self, name: str) -> Arity | None:
        """The least and the most arguments of a function; None where there is no such function."""
        if name in self.extra_functions:
            return self.extra_functions[name], self.extra_functions[name]
        if name in FUNCTIONS:
            return FUNCTIONS[name].least, FUNCTIONS[name].most
        return (DRAWS[name].arity, DRAWS[name].arity) if name in DRAWS else None

    def check_call(self, name: Token, arity: Arity | None, given: int | None, end: int) -> bool:
        """Whether a function may be called here with so many arguments (None where that is not known); what is wrong is
        noted."""
        drawn = name.text in DRAWS and name.text not in self.extra_functions
        if arity is None:
            known = [*self.extra_functions, *FUNCTIONS, *(DRAWS if self.random else ())]
            fitting = [other for other in known if given is None or _takes(self.arity(other), given)]
            self.faults.append(mistakes.unknown_function(name, known, fitting))
        elif drawn and not self.random:
            message = f"'{name.text}' draws a random number, which this place does not allow"
            hint = "draw in 'weight', 'centre', 'bias', 'initial' (once) or in 'noise' (at every step)"
            self.faults.append(ExpressionError("draw-not-allowed", message, name.start, name.end, hint))
        elif given is not None and not _takes(arity, given):
            row = DRAWS[name.text] if drawn else FUNCTIONS.get(name.text)
            usage = None if row is None else row.usage
            self.faults.append(mistakes.wrong_arguments(name, end, given, arity, usage))
        else:
            return True
        return False

    def close(self, opening: Token) -> Token:
        if self.is_operator(")"):
            return self.advance()
        if not self.at_end():
            raise mistakes.unexpected(self.previous, self.token)
        message = "this parenthesis is never closed"
        raise ExpressionError("unbalanced-parenthesis", message, opening.start, opening.end)
