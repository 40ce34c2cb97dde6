"""The typed tree of an expression, and the one place that tells its kinds of nodes apart.

In: nothing; this is the data that the parser makes. Who reads it is a Visitor: values (``evaluate``), NumPy code and C
(``emit``, ``emit_c``), what is undefined (``undefined``), derivatives (``derivative``). Every node knows the characters
it came from, ``start`` to ``end`` (0-based, exclusive), in the text of its expression, and its ``parts``: its operands,
in the order written.

What is wrong with a text is an ExpressionError, which the caller turns into a finding at its place in the file. Behind
a mistake of the grammar all is guesswork; functions that are unknown, out of place or called wrongly are mistakes of
their own, of which there may be several.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Generic, Literal, TypeAlias, TypeVar

T = TypeVar("T")

UnaryOperator = Literal["-", "+", "not"]
BinaryOperator = Literal["^", "<", "<=", ">", ">=", "==", "!="]
ChainOperator = Literal["+", "-", "*", "/", "%", "and", "or"]

#: The cost of an expression: its operations and values.
MAX_COST = 600
#: How far down a tree goes, which every walk may do by recursion. A long sum is one node.
MAX_DEPTH = 200


class ExpressionError(Exception):
    """An expression is invalid from character ``start`` to ``end`` (0-based, exclusive) of its text. ``others`` are
    further mistakes in it; ``used`` its names, each with where it begins and ends, as far as these are known."""

    def __init__(self, code: str, message: str, start: int, end: int, hint: str | None = None) -> None:
        self.code = code
        self.message = message
        self.start = start
        self.end = end
        self.hint = hint
        self.others: tuple[ExpressionError, ...] = ()
        self.used: tuple[tuple[str, int, int], ...] = ()
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Number:
    """A literal."""

    value: float
    start: int = 0
    end: int = 0

    parts: ClassVar[tuple[Tree, ...]] = ()

    def having(self, parts: tuple[Tree, ...]) -> Number:
        """The node with other operands."""
        return self


@dataclass(frozen=True, slots=True)
class Name:
    """A value: a parameter, a constant, a state, ``x``, ``pre``, ``k``, …"""

    name: str
    start: int = 0
    end: int = 0

    parts: ClassVar[tuple[Tree, ...]] = ()

    def having(self, parts: tuple[Tree, ...]) -> Name:
        """The node with other operands."""
        return self


@dataclass(frozen=True, slots=True)
class Unary:
    """A sign or a negation. ``not`` gives 1 or 0."""

    operator: UnaryOperator
    operand: Tree
    start: int = 0
    end: int = 0

    @property
    def parts(self) -> tuple[Tree, ...]:
        """The operand."""
        return (self.operand,)

    def having(self, parts: tuple[Tree, ...]) -> Unary:
        """The node with other operands."""
        (operand,) = parts
        return Unary(self.operator, operand, self.start, self.end)


@dataclass(frozen=True, slots=True)
class Binary:
    """A power, or a comparison, which gives 1 or 0."""

    operator: BinaryOperator
    left: Tree
    right: Tree
    start: int = 0
    end: int = 0

    @property
    def parts(self) -> tuple[Tree, ...]:
        """Both operands."""
        return (self.left, self.right)

    def having(self, parts: tuple[Tree, ...]) -> Binary:
        """The node with other operands."""
        left, right = parts
        return Binary(self.operator, left, right, self.start, self.end)


@dataclass(frozen=True, slots=True)
class Chain:
    """``a + b - c``: operands joined from left to right by operators that bind equally tight, one fewer than there are
    operands. ``and`` and ``or`` give 1 or 0."""

    operators: tuple[ChainOperator, ...]
    operands: tuple[Tree, ...]
    start: int = 0
    end: int = 0

    @property
    def parts(self) -> tuple[Tree, ...]:
        """All operands."""
        return self.operands

    def having(self, parts: tuple[Tree, ...]) -> Chain:
        """The node with other operands."""
        return Chain(self.operators, parts, self.start, self.end)

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

    @property
    def parts(self) -> tuple[Tree, ...]:
        """Both values, and between them the condition."""
        return (self.then, self.condition, self.otherwise)

    def having(self, parts: tuple[Tree, ...]) -> Conditional:
        """The node with other operands."""
        then, condition, otherwise = parts
        return Conditional(condition, then, otherwise, self.start, self.end)


@dataclass(frozen=True, slots=True)
class Call:
    """A function of ``functions.FUNCTIONS`` on its arguments."""

    function: str
    arguments: tuple[Tree, ...]
    start: int = 0
    end: int = 0

    @property
    def parts(self) -> tuple[Tree, ...]:
        """The arguments."""
        return self.arguments

    def having(self, parts: tuple[Tree, ...]) -> Call:
        """The node with other operands."""
        return Call(self.function, parts, self.start, self.end)


#: What draws.
DrawKind: TypeAlias = Literal["normal", "uniform", "poisson"]


@dataclass(frozen=True, slots=True)
class Draw:
    """``normal(m, s)``, ``uniform(a, b)`` or ``poisson(m)``, which has 0 for the second; ``index`` numbers the draws of
    one expression from 0."""

    kind: DrawKind
    first: Tree
    second: Tree
    index: int
    start: int = 0
    end: int = 0

    @property
    def parts(self) -> tuple[Tree, ...]:
        """Both arguments."""
        return (self.first, self.second)

    def having(self, parts: tuple[Tree, ...]) -> Draw:
        """The node with other operands."""
        first, second = parts
        return Draw(self.kind, first, second, self.index, self.start, self.end)


Tree: TypeAlias = Number | Name | Unary | Binary | Chain | Conditional | Call | Draw


class Visitor(ABC, Generic[T]):
    """What is made of a tree: ``of`` tells what kind of node it is, and the method of that kind says what becomes of
    it, with ``of`` for those of its parts that count. ``+x`` is x to everybody, and ``x^y`` the call of ``pow``."""

    def of(self, tree: Tree) -> T:
        """What becomes of this tree."""
        match tree:
            case Name():
                return self.name(tree)
            case Number():
                return self.number(tree)
            case Chain():
                return self.logic(tree) if tree.operators[0] in ("and", "or") else self.arithmetic(tree)
            case Binary() | Call() if (base := is_square(tree)) is not None:
                return self.square(base)
            case Call():
                return self.call(tree)
            case Binary(operator="^"):
                return self.call(Call("pow", tree.parts, tree.start, tree.end))
            case Binary():
                return self.comparison(tree)
            case Unary(operator="-"):
                return self.negative(tree.operand)
            case Unary(operator="not"):
                return self.negation(tree.operand)
            case Unary():
                return self.of(tree.operand)
            case Conditional():
                return self.conditional(tree)
            case Draw():
                return self.draw(tree)

    @abstractmethod
    def number(self, node: Number) -> T:
        """A literal."""

    @abstractmethod
    def name(self, node: Name) -> T:
        """A value that has a name."""

    @abstractmethod
    def negative(self, operand: Tree) -> T:
        """``-x``."""

    @abstractmethod
    def negation(self, operand: Tree) -> T:
        """``not x``."""

    @abstractmethod
    def square(self, base: Tree) -> T:
        """``x^2``, or ``pow(x, 2)``, the exponent being written so."""

    @abstractmethod
    def comparison(self, node: Binary) -> T:
        """``a < b``."""

    @abstractmethod
    def arithmetic(self, node: Chain) -> T:
        """A sum or a product."""

    @abstractmethod
    def logic(self, node: Chain) -> T:
        """``a and b``, ``a or b``."""

    @abstractmethod
    def conditional(self, node: Conditional) -> T:
        """``a if c else b``."""

    @abstractmethod
    def call(self, node: Call) -> T:
        """A function, of the language or of the place (``f`` of a model)."""

    @abstractmethod
    def draw(self, node: Draw) -> T:
        """A random number."""


def walk(tree: Tree) -> Iterator[Tree]:
    """The node and all below it, depth first."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend(reversed(node.parts))


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


def calls(tree: Tree, functions: Collection[str]) -> bool:
    """Whether any of these functions is called."""
    return bool(functions) and any(isinstance(node, Call) and node.function in functions for node in walk(tree))


def with_products(tree: Tree) -> Tree:
    """The tree with powers whose exponent is written as 3 or 4 as products: x·x·x, from left to right, which is quicker
    than ``pow`` and the same whoever computes it. Raises ExpressionError at the power where that becomes too much.

    >>> with_products(Binary("^", Name("x"), Number(3.0))).operands == (Name("x"),) * 3
    True
    """
    made = tree.having(tuple(with_products(part) for part in tree.parts))
    match made:
        case Binary(operator="^", left=base, right=Number(value=3.0 | 4.0 as times)):
            product = Chain(("*", "*") if times == 3.0 else ("*", "*", "*"), (base,) * int(times), made.start, made.end)
            check_extent(product, tree)
            return product
    return made


def substitute(tree: Tree, mapping: Mapping[str, Tree]) -> Tree:
    """The tree with the names in ``mapping`` replaced (at once, not again in what was put in).

    What is put in keeps its own places, which belong to another text. Raises ExpressionError at the whole of
    ``tree`` where the result is deeper or costs more than an expression may.

    >>> substitute(Binary("^", Name("u"), Name("x")), {"u": Number(2.0), "x": Name("u")})
    Binary(operator='^', left=Number(value=2.0, start=0, end=0), right=Name(name='u', start=0, end=0), start=0, end=0)
    """
    costs = {name: sum(map(_cost, walk(inner))) for name, inner in mapping.items()}
    cost = sum(costs.get(node.name, 1) if isinstance(node, Name) else _cost(node) for node in walk(tree))
    _check_cost(cost, tree)
    result = put(tree, mapping)
    check_extent(result, tree)
    return result


def put(tree: Tree, mapping: Mapping[str, Tree]) -> Tree:
    """The same, however much it costs."""
    if isinstance(tree, Name):
        return mapping.get(tree.name, tree)
    return tree.having(tuple(put(part, mapping) for part in tree.parts))


def check_extent(tree: Tree, place: Tree | None = None) -> None:
    """Raise ExpressionError, at ``place``, where a tree has too many operations and values or goes too deep."""
    place = place or tree
    waiting = [(tree, 1)]
    cost = deepest = 0
    while waiting:
        node, depth = waiting.pop()
        cost += _cost(node)
        deepest = max(deepest, depth)
        waiting.extend((child, depth + 1) for child in node.parts)
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
