"""The typed tree of an expression.

In: nothing; this is the data that the parser makes and that ``evaluate`` (numbers), ``arrays`` (NumPy values) and
``emit`` (NumPy code) consume. Every node knows the characters it came from, ``start`` to ``end`` (0-based,
exclusive), in the text of its expression.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, TypeAlias

from neurovis_spec.language.expressions.errors import ExpressionError

UnaryOperator = Literal["-", "+", "not"]
BinaryOperator = Literal["^", "<", "<=", ">", ">=", "==", "!="]
ChainOperator = Literal["+", "-", "*", "/", "%", "and", "or"]

#: How tight the operators bind; ``not`` is between ``and`` and the comparisons, signs between ``%`` and ``^``.
LEVELS: Mapping[str, int] = {
    **dict.fromkeys(("or",), 1),
    **dict.fromkeys(("and",), 2),
    **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 4),
    **dict.fromkeys(("+", "-"), 5),
    **dict.fromkeys(("*", "/", "%"), 6),
    **dict.fromkeys(("^", "**"), 8),
}
#: The cost of an expression: its operations and values.
MAX_COST = 600
#: How far down a tree goes, which every walk may do by recursion. A long sum is one node.
MAX_DEPTH = 200


@dataclass(frozen=True, slots=True)
class Number:
    """A literal."""

    value: float
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Name:
    """A value: a parameter, a constant, a state, ``x``, ``pre``, ``k``, …"""

    name: str
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Unary:
    """A sign or a negation. ``not`` gives 1 or 0."""

    operator: UnaryOperator
    operand: Tree
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Binary:
    """A power, or a comparison, which gives 1 or 0."""

    operator: BinaryOperator
    left: Tree
    right: Tree
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Chain:
    """``a + b - c``: operands joined from left to right by operators that bind equally tight, one fewer than there are
    operands. ``and`` and ``or`` give 1 or 0."""

    operators: tuple[ChainOperator, ...]
    operands: tuple[Tree, ...]
    start: int = 0
    end: int = 0

    @property
    def steps(self) -> Iterator[tuple[ChainOperator, Tree]]:
        """Each operator with the operand behind it."""
        return zip(self.operators, self.operands[1:], strict=True)


@dataclass(frozen=True, slots=True)
class Conditional:
    """``then if condition else otherwise``; anything but 0 counts as true."""

    condition: Tree
    then: Tree
    otherwise: Tree
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Call:
    """A function of ``functions.FUNCTIONS`` on its arguments."""

    function: str
    arguments: tuple[Tree, ...]
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Draw:
    """``normal(m, s)`` or ``uniform(a, b)``; ``index`` numbers the draws of one expression from 0 (§4, Randomness)."""

    kind: Literal["normal", "uniform"]
    first: Tree
    second: Tree
    index: int
    start: int = 0
    end: int = 0


Tree: TypeAlias = Number | Name | Unary | Binary | Chain | Conditional | Call | Draw


def children(tree: Tree) -> tuple[Tree, ...]:
    """The operands of a node, in the order written."""
    match tree:
        case Unary(operand=operand):
            return (operand,)
        case Binary(left=left, right=right):
            return (left, right)
        case Chain(operands=operands):
            return operands
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return (then, condition, otherwise)
        case Call(arguments=arguments):
            return arguments
        case Draw(first=first, second=second):
            return (first, second)
        case _:
            return ()


def walk(tree: Tree) -> Iterator[Tree]:
    """The node and all below it, depth first."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend(reversed(children(node)))


def names(tree: Tree) -> frozenset[str]:
    """All names that occur (functions are no names)."""
    if isinstance(tree, Number):
        return _NONE
    return frozenset((tree.name,)) if isinstance(tree, Name) else _names(tree)


_NONE: frozenset[str] = frozenset()


@lru_cache(maxsize=4096)
def _names(tree: Tree) -> frozenset[str]:
    """The same; formulas of a module are checked in each of its instances."""
    return frozenset(node.name for node in walk(tree) if isinstance(node, Name))


def draws(tree: Tree) -> bool:
    """Whether a random number is drawn anywhere."""
    return any(isinstance(node, Draw) for node in walk(tree))


def is_square(tree: Tree) -> Tree | None:
    """The base, where the node is a power whose exponent is written as 2: then it is base·base, bit for bit."""
    match tree:
        case Binary(operator="^", left=base, right=Number(value=2.0)):
            return base
        case Call(function="pow", arguments=(base, Number(value=2.0))):
            return base
        case _:
            return None


def rebuild(tree: Tree, parts: tuple[Tree, ...]) -> Tree:
    """The node with other operands, in the order of ``children``."""
    match tree:
        case Unary():
            return replace(tree, operand=parts[0])
        case Binary():
            return replace(tree, left=parts[0], right=parts[1])
        case Chain():
            return replace(tree, operands=parts)
        case Conditional():
            return replace(tree, then=parts[0], condition=parts[1], otherwise=parts[2])
        case Call():
            return replace(tree, arguments=parts)
        case Draw():
            return replace(tree, first=parts[0], second=parts[1])
        case _:
            return tree


def substitute(tree: Tree, mapping: Mapping[str, Tree]) -> Tree:
    """The tree with the names in ``mapping`` replaced (at once, not again in what was put in).

    What is put in keeps its own places, which belong to another text. Raises ExpressionError at the whole of
    ``tree`` where the result is deeper or costs more than an expression may.

    >>> substitute(Binary("^", Name("u"), Name("x")), {"u": Number(2.0), "x": Name("u")})
    Binary(operator='^', left=Number(value=2.0, start=0, end=0), right=Name(name='u', start=0, end=0), start=0, end=0)
    """
    costs = {name: sum(map(_cost, walk(put))) for name, put in mapping.items()}
    cost = sum(costs.get(node.name, 1) if isinstance(node, Name) else _cost(node) for node in walk(tree))
    _check_cost(cost, tree)
    result = _substituted(tree, mapping)
    check_extent(result, tree)
    return result


def _substituted(tree: Tree, mapping: Mapping[str, Tree]) -> Tree:
    if isinstance(tree, Name):
        return mapping.get(tree.name, tree)
    return rebuild(tree, tuple(_substituted(part, mapping) for part in children(tree)))


def check_extent(tree: Tree, place: Tree | None = None) -> None:
    """Raise ExpressionError, at ``place``, where a tree has too many operations and values or goes too deep."""
    place = place or tree
    waiting = [(tree, 1)]
    cost = deepest = 0
    while waiting:
        node, depth = waiting.pop()
        cost += _cost(node)
        deepest = max(deepest, depth)
        waiting.extend((child, depth + 1) for child in children(node))
    _check_cost(cost, place)
    if deepest > MAX_DEPTH:
        message = f"this expression has more than {MAX_DEPTH} operations inside each other"
        raise ExpressionError("expression-too-deep", message, place.start, place.end, "divide it into parts with names")


def _cost(node: Tree) -> int:
    """The operations and values of a node alone."""
    return len(node.operators) if isinstance(node, Chain) else 1


def _check_cost(cost: int, place: Tree) -> None:
    if cost > MAX_COST:
        message = f"this expression takes {cost} operations and values; {MAX_COST} are the most"
        hint = "divide it into parts with names"
        raise ExpressionError("expression-too-costly", message, place.start, place.end, hint)
