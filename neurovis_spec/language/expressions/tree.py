"""The typed tree of an expression.

In: nothing; this is the data that the parser makes and that ``evaluate`` (numbers), ``arrays`` (NumPy values) and
``emit`` (NumPy code) consume. Every node knows the characters it came from, ``start`` to ``end`` (0-based,
exclusive), in the text of its expression.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

UnaryOperator = Literal["-", "+", "not"]
BinaryOperator = Literal["+", "-", "*", "/", "%", "^", "<", "<=", ">", ">=", "==", "!=", "and", "or"]


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
    """Two operands. Comparisons, ``and`` and ``or`` give 1 or 0."""

    operator: BinaryOperator
    left: Tree
    right: Tree
    start: int = 0
    end: int = 0


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


Tree: TypeAlias = Number | Name | Unary | Binary | Conditional | Call | Draw


def children(tree: Tree) -> tuple[Tree, ...]:
    """The operands of a node, in the order written."""
    match tree:
        case Unary(operand=operand):
            return (operand,)
        case Binary(left=left, right=right):
            return (left, right)
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
    yield tree
    for child in children(tree):
        yield from walk(child)


def names(tree: Tree) -> frozenset[str]:
    """All names that occur (functions are no names)."""
    return frozenset(node.name for node in walk(tree) if isinstance(node, Name))


def draws(tree: Tree) -> bool:
    """Whether a random number is drawn anywhere."""
    return any(isinstance(node, Draw) for node in walk(tree))
