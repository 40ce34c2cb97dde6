"""From a tree to C99: the same values as ``evaluate`` gives, bit for bit where the C library is the same.

In: a tree, and for each of its names a number or an identifier (or code of our own making). Out: a number where nothing
but numbers are in it, else one C expression. Nothing of the author's text gets into it. What C has no operator or
function for is one of ``HELPERS``; who emits says in front which of them are used.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Container, Mapping
from types import MappingProxyType
from typing import TypeAlias

from neurovis_spec.language.expressions.emit import folded, simplify, with_values, wrapped
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

#: What a name may be: a number, or code.
Value: TypeAlias = float | str
#: Makes the value of a call from the values of its arguments, that of a draw from its two.
Made: TypeAlias = Callable[..., Value]
Drawn: TypeAlias = Callable[[Draw, Value, Value], Value]
#: Code, and how tight its outermost operator binds in C.
_Code: TypeAlias = tuple[str, int]

_CHOICE, _OR, _AND, _EQUAL, _COMPARE, _ADD, _MULTIPLY, _SIGN, _ATOM = range(9)
_ARITHMETIC: Mapping[str, int] = {"+": _ADD, "-": _ADD, "*": _MULTIPLY, "/": _MULTIPLY}
_COMPARISONS: Mapping[str, int] = {
    "<": _COMPARE,
    "<=": _COMPARE,
    ">": _COMPARE,
    ">=": _COMPARE,
    "==": _EQUAL,
    "!=": _EQUAL,
}
_NONE: Mapping[str, Made] = MappingProxyType({})

#: Functions of C's library whose results a compiler must not work out itself: it rounds better than the library.
INEXACT: tuple[str, ...] = (
    *("exp", "log", "log1p", "expm1", "pow", "sin", "cos", "tan", "sinh", "cosh", "tanh"),
    *("asin", "acos", "atan", "atan2"),
)
#: Functions of C's library that are what the language means.
_LIBRARY: Mapping[str, str] = MappingProxyType(
    {name: name for name in (*INEXACT, "floor", "ceil", "sqrt")} | {"abs": "fabs", "round": "rint"}
)
#: What the language means and C lacks: ``{real}`` is the type of numbers, ``{s}`` the suffix of functions and literals.
HELPERS: Mapping[str, str] = MappingProxyType(
    {
        "nv_mod": """static {real} nv_mod({real} a, {real} b)
{{
    {real} m;
    if (b == 0.0{s})
        return NAN;
    m = fmod{s}(a, b);
    if (m == 0.0{s})
        return copysign{s}(0.0{s}, b);
    return (b < 0.0{s}) != (m < 0.0{s}) ? m + b : m;
}}""",
        "nv_sign": """static {real} nv_sign({real} x)
{{
    return x > 0.0{s} ? 1.0{s} : x < 0.0{s} ? -1.0{s} : x == 0.0{s} ? 0.0{s} : x;
}}""",
        "nv_step": """static {real} nv_step({real} x)
{{
    return x >= 0.0{s} ? 1.0{s} : x < 0.0{s} ? 0.0{s} : x;
}}""",
        "nv_min": """static {real} nv_min({real} a, {real} b)
{{
    return a <= b || a != a ? a : b;
}}""",
        "nv_max": """static {real} nv_max({real} a, {real} b)
{{
    return a >= b || a != a ? a : b;
}}""",
        # gcc makes -0 of the difference of 0 and a choice that comes to 0
        "nv_from_zero": """static {real} nv_from_zero({real} x)
{{
    return 0.0{s} - x;
}}""",
        "nv_square": """static {real} nv_square({real} x)
{{
    return x * x;
}}""",
        "nv_sigmoid": """static {real} nv_sigmoid({real} x)
{{
    return 1.0{s} / (1.0{s} + exp{s}(-x));
}}""",
        # of a power whose exponent it knows a compiler makes a product, which is not what the library gives
        "nv_power": """static {real} nv_power({real} x, {real} exponent)
{{
    volatile {real} e = exponent;
    return pow{s}(x, e);
}}""",
    }
)


def known_in(tree: Tree, names: Mapping[str, Value]) -> Tree:
    """The tree with the numbers that are known put in and all constant parts computed.

    >>> from neurovis_spec.language.expressions.parser import parse
    >>> known_in(parse("a * b + x"), {"a": 2.0, "b": 3.0, "x": "x1"}).operands[0].value
    6.0
    """
    return simplify(_put(tree, names))


def _put(tree: Tree, names: Mapping[str, Value]) -> Tree:
    if isinstance(tree, Name):
        value = names.get(tree.name)
        return Number(value, tree.start, tree.end) if isinstance(value, float) else tree
    return with_values(tree, tuple(_put(part, names) for part in children(tree)))


class Emitter:
    """Makes C for one type of numbers."""

    def __init__(self, real: str = "double") -> None:
        self.real = real
        self.suffix = "f" if real == "float" else ""

    def value(
        self,
        tree: Tree,
        names: Mapping[str, Value],
        calls: Mapping[str, Made] = _NONE,
        drawn: Drawn | None = None,
    ) -> Value:
        """The number, or the code of one. ``calls`` makes the values of functions of the place (``f`` of a model),
        ``drawn`` those of draws. Raises KeyError for a name or a function that is not given.

        >>> from neurovis_spec.language.expressions.parser import parse
        >>> c = Emitter()
        >>> names = {"rate": 0.5, "w": "w", "pre": "a[1]", "target": "s", "post": "y"}
        >>> c.value(parse("w + 2 * rate * pre * (target - post)"), names)
        'w + 1.0*a[1]*(s - y)'
        >>> c.value(parse("x^2 if x < 0 or c else tanh(x)"), {"x": "a", "c": "p"})
        'a < 0.0 || p != 0.0 ? nv_square(a) : tanh(a)'
        """
        if calls or drawn is not None:
            tree, names = self._called(tree, dict(names), calls, drawn)
        tree = known_in(tree, names)
        return tree.value if isinstance(tree, Number) else _Writer(self, names).value(tree)[0]

    def _called(
        self, tree: Tree, names: dict[str, Value], calls: Mapping[str, Made], drawn: Drawn | None
    ) -> tuple[Tree, dict[str, Value]]:
        """The tree with a name for each call of a function of the place and each draw, and what these names are."""

        def replaced(node: Tree) -> Tree:
            if isinstance(node, Call) and node.function in calls:
                arguments = [self.value(replaced(argument), names) for argument in node.arguments]
                name = f" {len(names)}"  # no name of an author
                names[name] = calls[node.function](*arguments)
                return Name(name, node.start, node.end)
            if isinstance(node, Draw) and drawn is not None:
                name = f" {len(names)}"
                names[name] = drawn(node, *(self.value(replaced(part), names) for part in children(node)))
                return Name(name, node.start, node.end)
            return rebuild(node, tuple(map(replaced, children(node))))

        return replaced(tree), names

    def text(self, value: Value) -> str:
        """A value as code; a number as the shortest literal that gives it back."""
        return value if isinstance(value, str) else self.literal(value)[0]

    def literal(self, value: float) -> _Code:
        """A number as code."""
        if math.isnan(value):
            return "NAN", _ATOM
        if math.isinf(value):
            huge = "HUGE_VALF" if self.suffix else "HUGE_VAL"
            return (huge, _ATOM) if value > 0 else (f"-{huge}", _SIGN)
        return repr(float(value)) + self.suffix, _ATOM if math.copysign(1.0, value) > 0 else _SIGN

    def helpers(self, used: Container[str]) -> str:
        """The text of these helpers."""
        return "\n\n".join(text.format(real=self.real, s=self.suffix) for name, text in HELPERS.items() if name in used)


class _Writer:
    """Makes code: as a number, or as a truth."""

    def __init__(self, emitter: Emitter, names: Mapping[str, Value]) -> None:
        self.emitter, self.names = emitter, names

    def value(self, tree: Tree) -> _Code:
        if (square := is_square(tree)) is not None:
            return f"nv_square({self.loose(square)})", _ATOM
        match tree:
            case Number(value=value):
                return self.emitter.literal(value)
            case Name(name=name):
                known = self.names[name]
                if isinstance(known, float):
                    return self.emitter.literal(known)
                return known, _ATOM if re.fullmatch(r"[\w.>\[\]-]*", known.replace("->", ".")) else _CHOICE
            case Unary(operator="-", operand=operand):
                return f"-{self.tight(operand, _ATOM)}", _SIGN
            case Unary(operator="+", operand=operand):
                return self.value(operand)
            case Chain() if tree.operators[0] not in ("and", "or"):
                return self.arithmetic(tree)
            case Binary(operator="^", left=left, right=right):
                return self.power(left, right)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                test = wrapped(self.truth(condition), _OR)
                return f"{test} ? {self.tight(then, _OR)} : {self.tight(otherwise, _CHOICE)}", _CHOICE
            case Call(function=function, arguments=arguments):
                return self.call(function, arguments)
            case _:
                return f"{wrapped(self.truth(tree), _OR)} ? {self.number(1.0)} : {self.number(0.0)}", _CHOICE

    def truth(self, tree: Tree) -> _Code:
        match tree:
            case Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
                level = _COMPARISONS[operator]
                return f"{self.tight(left, _ADD)} {operator} {self.tight(right, _ADD)}", level
            case Chain(operators=("and", *_), operands=operands):
                return " && ".join(wrapped(self.truth(operand), _EQUAL) for operand in operands), _AND
            case Chain(operators=("or", *_), operands=operands):
                # compilers warn of && within ||
                return " || ".join(wrapped(self.truth(operand), _EQUAL) for operand in operands), _OR
            case Unary(operator="not", operand=operand):
                return f"!{wrapped(self.truth(operand), _ATOM)}", _SIGN
            case _:
                return f"{self.tight(tree, _ADD)} != {self.number(0.0)}", _EQUAL

    def arithmetic(self, chain: Chain) -> _Code:
        """Sums and products: one operator after the other."""
        code = self.value(chain.operands[0])
        for number, (operator, operand) in enumerate(chain.steps):
            if number == 0 and operator == "-" and _is_zero(chain.operands[0]):
                code = f"nv_from_zero({self.loose(operand)})", _ATOM
            elif operator == "%":
                code = f"nv_mod({code[0]}, {self.loose(operand)})", _ATOM
            else:
                level = _ARITHMETIC[operator]
                joined = f" {operator} " if level == _ADD else operator
                code = f"{wrapped(code, level)}{joined}{self.tight(operand, level + 1)}", level
        return code

    def power(self, base: Tree, exponent: Tree) -> _Code:
        known = known_in(exponent, self.names)
        if isinstance(known, Number):
            return f"nv_power({self.loose(base)}, {self.number(known.value)})", _ATOM
        return f"pow{self.emitter.suffix}({self.loose(base)}, {self.loose(exponent)})", _ATOM

    def call(self, function: str, arguments: tuple[Tree, ...]) -> _Code:
        codes = [self.loose(argument) for argument in arguments]
        match function:
            case "pow":
                return self.power(*arguments)
            case "min" | "max":
                return folded(f"nv_{function}({{}}, {{}})".format, codes), _ATOM
            case "clip":
                greater = f"nv_max({codes[0]}, {codes[1]})"
                return f"nv_min({greater}, {codes[2]})", _ATOM
            case "sign" | "step" | "sigmoid":
                return f"nv_{function}({codes[0]})", _ATOM
            case _:
                return f"{_LIBRARY[function]}{self.emitter.suffix}({', '.join(codes)})", _ATOM

    def number(self, value: float) -> str:
        return self.emitter.literal(value)[0]

    def loose(self, tree: Tree) -> str:
        return self.value(tree)[0]

    def tight(self, tree: Tree, level: int) -> str:
        return wrapped(self.value(tree), level)


def _is_zero(tree: Tree) -> bool:
    """Whether a tree is the number 0, not −0."""
    return isinstance(tree, Number) and tree.value == 0.0 and math.copysign(1.0, tree.value) > 0
