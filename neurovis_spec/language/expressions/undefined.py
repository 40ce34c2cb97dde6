"""Operations that may be undefined, such as the division in ``clip(1/x, -1, 1)`` where x is 0.

In: a formula, and what stands around it. Out: its Hazards: of each such operation a formula that is true where the
operation is undefined, and one that is true where it is computed at all (it may stand in a branch of a conditional);
and what the formula reads, in the same terms.

What is undefined gives an infinity or NaN (IEEE 754). Mostly one sees that in the value of the formula. Some operations
hide it: ``tanh`` and ``clip`` make a number of an infinity, a comparison one of NaN, too. Only hazards of which
something is hidden are given. That a number overflows is no hazard: what hides an infinity gives the right number then.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import FUNCTIONS, OPERATORS, Hidden, Operation
from neurovis_spec.language.expressions.parser import formula
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
    names,
    put,
)

_NONE: Mapping[str, Tree] = MappingProxyType({})


class Read(NamedTuple):
    """A name that a formula reads: what of its value is hidden, and where it is read (None: always)."""

    name: str
    hidden: Hidden
    where: Tree | None


class Called(NamedTuple):
    """A function of the place that a formula calls, in the same terms."""

    call: Call
    hidden: Hidden
    where: Tree | None


class Hazard(NamedTuple):
    """An operation that is undefined where ``condition`` is true, if it is computed: ``where`` (None: always).
    ``what`` says it of a definition: ``divides by 0``."""

    what: str
    condition: Tree
    where: Tree | None

    @property
    def formula(self) -> Tree:
        """True where an undefined operation is computed."""
        return both(self.where, self.condition)


class Hazards(NamedTuple):
    """What may be undefined in formulas, and hidden; the names that they read, and the functions of the place."""

    found: list[Hazard]
    names: list[Read]
    calls: list[Called]


def hazards(
    tree: Tree, hidden: Hidden = Hidden.NOTHING, where: Tree | None = None, functions: Mapping[str, Tree] = _NONE
) -> Hazards:
    """The hazards of a formula of whose value something is ``hidden``, and that is computed ``where`` (None: always).
    ``functions`` gives the formulas, of x, of the functions of the place.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> [hazard.what for hazard in hazards(parse("clip(1/x, -1, 1) + log(x)")).found]
    ['divides by 0']
    >>> hazards(parse("1/x if x > 0 else 0")).found, hazards(parse("tanh(x/2)")).found
    ([], [])
    """
    reading = _Reading(functions)
    waiting = [(tree, hidden, where)]
    while waiting:
        node, reading.hidden, reading.where = waiting.pop()
        waiting += reading.of(node)
    return reading.made


#: What is still to be read: a part, what of it is hidden, and where it is computed.
_Rest: TypeAlias = list[tuple[Tree, Hidden, Tree | None]]


class _Reading(Visitor[_Rest]):
    """Goes through a formula. Of a node of whose value something is ``hidden`` and that is computed ``where`` it notes
    what there is, and gives its parts."""

    def __init__(self, functions: Mapping[str, Tree]) -> None:
        self.functions = functions
        self.made = Hazards([], [], [])
        self.hidden = Hidden.NOTHING
        self.where: Tree | None = None

    def number(self, node: Number) -> _Rest:
        return []

    def name(self, node: Name) -> _Rest:
        self.made.names.append(Read(node.name, self.hidden, self.where))
        return []

    def negative(self, operand: Tree) -> _Rest:
        return [(operand, self.hidden, self.where)]

    def square(self, base: Tree) -> _Rest:
        return [(base, self.hidden, self.where)]

    def negation(self, operand: Tree) -> _Rest:
        return [(operand, Hidden.ALL, self.where)]

    def comparison(self, node: Binary) -> _Rest:
        return self.operation(OPERATORS[node.operator], node.parts)

    def arithmetic(self, node: Chain) -> _Rest:
        first = node.operands[0]
        rest: _Rest = [(first, self.hidden, self.where)]
        for operator, operand in node.steps:
            rest += self.operation(OPERATORS[operator], (first, operand))[1:]
        return rest

    def logic(self, node: Chain) -> _Rest:
        rest: _Rest = []
        where = self.where
        for operand in node.operands:  # each is guarded by those before it, as in x != 0 and 1/x > 2
            rest.append((operand, Hidden.ALL, where))
            where = both(where, operand if node.operators[0] == "and" else Unary("not", operand))
        return rest

    def conditional(self, node: Conditional) -> _Rest:
        return [
            (node.condition, Hidden.ALL, self.where),
            (node.then, self.hidden, both(self.where, node.condition)),
            (node.otherwise, self.hidden, both(self.where, Unary("not", node.condition))),
        ]

    def call(self, node: Call) -> _Rest:
        if node.function not in self.functions:
            return self.operation(FUNCTIONS[node.function], node.arguments)
        self.made.calls.append(Called(node, self.hidden, self.where))
        read = hazards(self.functions[node.function], self.hidden).names
        inside = together(read, "x")
        return [(node.arguments[0], Hidden.ALL if inside is None else inside.hidden, self.where)]

    def draw(self, node: Draw) -> _Rest:
        return [(part, self.hidden, self.where) for part in node.parts]

    def operation(self, row: Operation, arguments: tuple[Tree, ...]) -> _Rest:
        """Where an operation is undefined, as far as that is hidden; its arguments, of which it may hide more."""
        for what, where, further in ((), row.infinite, row.undefined)[self.hidden]:
            given = dict(zip(row.names, arguments, strict=True))
            condition = _put(where, given)
            if further:
                more = _put(further, given)
                if not any(isinstance(given[name], Number) for name in names(formula(further))):
                    condition = both(condition, more)
                elif evaluate(more, {}) == 0:
                    continue
            if names(condition) or evaluate(condition, {}) != 0:  # it depends on something, or is so: not in x/2
                self.made.found.append(Hazard(what, condition, self.where))
        own = row.hidden(arguments)
        return [(part, max(self.hidden, more), self.where) for part, more in zip(arguments, own, strict=True)]


def _put(condition: str, arguments: Mapping[str, Tree]) -> Tree:
    """A formula over arguments, of these."""
    return put(formula(condition), arguments)


def both(where: Tree | None, condition: Tree) -> Tree:
    """Where both are true; the first may be None, which is always."""
    match where:
        case None:
            return condition
        case Chain(operators=("and", *_), operands=operands):
            return Chain(tuple("and" for _ in operands), (*operands, condition))
        case _:
            return Chain(("and",), (where, condition))


def either(conditions: Iterable[Tree]) -> Tree:
    """Where one of them is true."""
    first, *others = dict.fromkeys(conditions)
    return Chain(tuple("or" for _ in others), (first, *others)) if others else first


def together(reads: Iterable[Read], name: str) -> Read | None:
    """Several reads of a name as one: what all of them hide. None where there are none."""
    several = [read for read in reads if read.name == name]
    if not several:
        return None
    always = [read for read in several if read.where is None]
    if always:
        return Read(name, min(read.hidden for read in always), None)
    where = either(read.where for read in several if read.where is not None)
    return Read(name, max(read.hidden for read in several), where)
