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
from enum import IntEnum
from types import MappingProxyType
from typing import NamedTuple

from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    Name,
    Number,
    Tree,
    Unary,
    children,
    names,
)

_NONE: Mapping[str, Tree] = MappingProxyType({})


class Hidden(IntEnum):
    """What does not show in the value of the whole: more and more."""

    NOTHING = 0
    INFINITY = 1
    ALL = 2


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


#: Functions, and what their values hide of their arguments; of the others NaN gives NaN, an infinity either.
_HIDING = {
    **dict.fromkeys(("min", "max", "clip", "exp", "expm1", "sign", "step"), Hidden.INFINITY),
    **dict.fromkeys(("atan", "atan2", "tanh", "sigmoid"), Hidden.INFINITY),
}


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
    made = Hazards([], [], [])
    waiting = [(tree, hidden, where)]
    while waiting:
        node, hidden, where = waiting.pop()
        made.found.extend(
            Hazard(what, condition, where) for what, condition in _own(node, hidden) if _may_be(condition)
        )
        match node:
            case Name():
                made.names.append(Read(node.name, hidden, where))
            case Call(function=function, arguments=(argument,)) if function in functions:
                made.calls.append(Called(node, hidden, where))
                inside = together(read for read in hazards(functions[function], hidden).names if read.name == "x")
                waiting.append((argument, Hidden.ALL if inside is None else inside.hidden, where))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                waiting.append((condition, Hidden.ALL, where))
                waiting.append((then, hidden, both(where, condition)))
                waiting.append((otherwise, hidden, both(where, Unary("not", condition))))
            case Chain(operators=("and" | "or" as sign, *_), operands=operands):
                for operand in operands:  # each is guarded by those before it, as in x != 0 and 1/x > 2
                    waiting.append((operand, Hidden.ALL, where))
                    where = both(where, operand if sign == "and" else Unary("not", operand))
            case _:
                waiting.extend((child, max(hidden, own), where) for child, own in _operands(node))
    return made


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


def together(reads: Iterable[Read]) -> Read | None:
    """Several reads of one name as one: what all of them hide. None where there are none."""
    several = list(reads)
    if not several:
        return None
    always = [read for read in several if read.where is None]
    if always:
        return Read(always[0].name, min(read.hidden for read in always), None)
    where = either(read.where for read in several if read.where is not None)
    return Read(several[0].name, max(read.hidden for read in several), where)


def _operands(node: Tree) -> list[tuple[Tree, Hidden]]:
    """The operands of a node, and what of each does not show in its value."""
    match node:
        case Unary(operator="not"):
            return [(node.operand, Hidden.ALL)]
        case Binary(operator="^", left=base, right=exponent):
            return _of_power(base, exponent)
        case Call(function="pow", arguments=(base, exponent)):
            return _of_power(base, exponent)
        case Binary():
            return [(child, Hidden.ALL) for child in children(node)]
        case Chain(operands=operands):
            return [(operands[0], Hidden.NOTHING), *((operand, _BEHIND[sign]) for sign, operand in node.steps)]
        case Call(function=function):
            return [(child, _HIDING.get(function, Hidden.NOTHING)) for child in children(node)]
        case _:
            return [(child, Hidden.NOTHING) for child in children(node)]


#: What an operator hides of the operand behind it: x/∞ is 0.
_BEHIND = {**dict.fromkeys("/%", Hidden.INFINITY), **dict.fromkeys("+-*", Hidden.NOTHING)}


def _of_power(base: Tree, exponent: Tree) -> list[tuple[Tree, Hidden]]:
    """∞^−1 is 0, and NaN^0 is 1."""
    grows = isinstance(exponent, Number) and exponent.value > 0
    return [(base, Hidden.NOTHING if grows else Hidden.ALL), (exponent, Hidden.ALL)]


def _own(node: Tree, hidden: Hidden) -> list[tuple[str, Tree]]:
    """What is undefined in an operation itself, as far as that is hidden: words for it, and where it is so."""
    if hidden is Hidden.NOTHING:
        return []
    match node:
        case Chain():
            undefined = ("/", "%") if hidden is Hidden.ALL else ("/",)  # x % 0 is NaN, which shows
            divisors = [operand for operator, operand in node.steps if operator in undefined]
            return [("divides by 0", _is(divisor, 0.0)) for divisor in divisors]
        case Binary(operator="^", left=base, right=exponent):
            return _power(base, exponent, hidden)
        case Call(function="pow", arguments=(base, exponent)):
            return _power(base, exponent, hidden)
        case Call(function="log" | "log1p" as function, arguments=(x,)):
            pole = 0.0 if function == "log" else -1.0
            if hidden is Hidden.INFINITY:  # NaN, below the pole, shows
                return [("takes the logarithm of 0", _is(x, pole))]
            return [("takes the logarithm of a number that is not above 0", Binary("<=", x, Number(pole)))]
        case Call(function="sqrt", arguments=(x,)) if hidden is Hidden.ALL:
            return [("takes the square root of a number below 0", Binary("<", x, Number(0.0)))]
        case Call(function="asin" | "acos" as function, arguments=(x,)) if hidden is Hidden.ALL:
            outside = Binary(">", Call("abs", (x,)), Number(1.0))
            return [(f"takes {function} of a number beyond -1 to 1", outside)]
        case _:
            return []


def _power(base: Tree, exponent: Tree, hidden: Hidden) -> list[tuple[str, Tree]]:
    found = []
    fixed = exponent.value if isinstance(exponent, Number) else None
    if fixed is None or fixed < 0:
        pole = _is(base, 0.0)
        found.append(("divides by 0", pole if fixed is not None else both(pole, Binary("<", exponent, Number(0.0)))))
    if hidden is Hidden.ALL and (fixed is None or not fixed.is_integer()):
        below = Binary("<", base, Number(0.0))
        broken = Binary("!=", exponent, Call("floor", (exponent,)))
        what = "takes a broken power of a number below 0"
        found.append((what, below if fixed is not None else both(below, broken)))
    return found


def _is(tree: Tree, value: float) -> Tree:
    return Binary("==", tree, Number(value))


def _may_be(condition: Tree) -> bool:
    """Whether it depends on something, or is true: in ``x/2`` it is neither."""
    return bool(names(condition)) or evaluate(condition, {}) != 0
