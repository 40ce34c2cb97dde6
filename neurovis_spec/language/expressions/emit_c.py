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
from typing import ClassVar, Final, TypeAlias

from neurovis_spec.language.expressions.emit import Code, Writer, called, simplify, with_values
from neurovis_spec.language.expressions.functions import FUNCTIONS, OPERATORS, Operation
from neurovis_spec.language.expressions.tree import Binary, Call, Chain, Conditional, Draw, Name, Number, Tree

#: What a name may be: a number, or code.
Value: TypeAlias = float | str
#: Makes the value of a call from the values of its arguments, that of a draw from its two.
Made: TypeAlias = Callable[..., Value]
Drawn: TypeAlias = Callable[[Draw, Value, Value], Value]

_CHOICE, _OR, _AND, _EQUAL, _COMPARE, _ADD, _MULTIPLY, _SIGN, _ATOM = range(9)
_NONE: Mapping[str, Made] = MappingProxyType({})

#: Operators that cost more than a jump.
_COSTLY: Final = frozenset(("/", "%", "^"))

#: Functions of C's library whose results a compiler must not work out itself: it rounds better than the library. The
#: arcs stand behind the others in the files that are exported.
INEXACT: tuple[str, ...] = tuple(
    sorted(
        dict.fromkeys(
            name for row in FUNCTIONS.values() if row.agree == "rounding" for name in re.findall(r"(\w+)\{s\}\(", row.c)
        ),
        key=lambda name: name.startswith("a"),
    )
)
#: What operators and the code around them need and C lacks, as the helpers of functions (``Function.helper``).
_OF_OPERATORS: Final = {
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
    # gcc makes -0 of the difference of 0 and a choice that comes to 0
    "nv_from_zero": """static {real} nv_from_zero({real} x)
{{
    return 0.0{s} - x;
}}""",
    "nv_square": """static {real} nv_square({real} x)
{{
    return x * x;
}}""",
    # whether 16 numbers are all 0 by their bits
    "nv_quiet": """static int nv_quiet(const {real} *values)
{{
    uint64_t any = 0;
    for (size_t at = 0; at < 16*sizeof(values[0]); at += 8) {{
        uint64_t bits;
        memcpy(&bits, (const char *)values + at, 8);
        any |= bits;
    }}
    return !any;
}}""",
    # of a ring of slots, that of so many steps before now, or of one more where q is below 0; and the next one
    "nv_slot": """static int32_t nv_slot(int32_t now, int32_t ago, int32_t length, {real} q)
{{
    ago += q < 0.0{s};
    return now < ago ? now - ago + length : now - ago;
}}""",
    "nv_next": """static int32_t nv_next(int32_t slot, int32_t length)
{{
    return slot + 1 == length ? 0 : slot + 1;
}}""",
    "nv_between": """static {real} nv_between({real} first, {real} next, {real} q)
{{
    return first + (q < 0.0{s} ? q + 1.0{s} : q)*(next - first);
}}""",
}
#: The order in which they stand in the files that are exported; what is not named here comes last.
_ORDER = ("mod", "sign", "step", "min", "max", "from_zero", "square", "sigmoid")


def _helpers() -> dict[str, str]:
    """What the language means and C lacks, by name: ``{real}`` is the type of numbers, ``{s}`` the suffix of functions
    and literals."""
    texts = [row.helper for row in FUNCTIONS.values() if row.helper]
    named = {text.partition("(")[0].split()[-1]: text for text in texts} | _OF_OPERATORS
    first = [f"nv_{name}" for name in _ORDER if f"nv_{name}" in named]
    return {name: named[name] for name in (*first, *named)}


HELPERS: Mapping[str, str] = MappingProxyType(_helpers())


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
    return with_values(tree, tuple(_put(part, names) for part in tree.parts))


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
        '((a < 0.0) | (p != 0.0)) ? nv_square(a) : tanh(a)'
        """
        if calls or drawn is not None:
            tree, names = self._called(tree, dict(names), calls, drawn)
        tree = known_in(tree, names)
        return tree.value if isinstance(tree, Number) else _C(self, names).loose(tree)

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
                names[name] = drawn(node, *(self.value(replaced(part), names) for part in node.parts))
                return Name(name, node.start, node.end)
            return node.having(tuple(map(replaced, node.parts)))

        return replaced(tree), names

    def text(self, value: Value) -> str:
        """A value as code; a number as the shortest literal that gives it back."""
        return value if isinstance(value, str) else self.literal(value).text

    def literal(self, value: float) -> Code:
        """A number as code."""
        if math.isnan(value):
            return Code("NAN", _ATOM)
        if math.isinf(value):
            huge = "HUGE_VALF" if self.suffix else "HUGE_VAL"
            return Code(huge, _ATOM) if value > 0 else Code(f"-{huge}", _SIGN)
        return Code(repr(float(value)) + self.suffix, _ATOM if math.copysign(1.0, value) > 0 else _SIGN)

    def helpers(self, used: Container[str]) -> str:
        """The text of these helpers."""
        return "\n\n".join(text.format(real=self.real, s=self.suffix) for name, text in HELPERS.items() if name in used)


class _C(Writer):
    """C; a truth is an int."""

    levels: ClassVar[Mapping[str, int]] = {
        **{"or": _OR, "and": _AND, "==": _EQUAL, "!=": _EQUAL},
        **dict.fromkeys(("<", "<=", ">", ">="), _COMPARE),
        **{"+": _ADD, "-": _ADD, "*": _MULTIPLY, "/": _MULTIPLY, "sign": _SIGN},
    }
    compared: ClassVar[int] = _ADD
    joined: ClassVar[Mapping[str, int]] = {"or": _EQUAL, "and": _EQUAL}  # compilers warn of && within ||
    both: ClassVar[Mapping[str, str]] = {"or": "|", "and": "&"}
    signed: ClassVar[int] = _ATOM

    def __init__(self, emitter: Emitter, names: Mapping[str, Value]) -> None:
        self.emitter, self.names = emitter, names

    def number(self, node: Number) -> Code:
        return self.emitter.literal(node.value)

    def name(self, node: Name) -> Code:
        known = self.names[node.name]
        if isinstance(known, float):
            return self.emitter.literal(known)
        return Code(known, _ATOM if re.fullmatch(r"[\w.>\[\]-]*", known.replace("->", ".")) else _CHOICE)

    def counted(self, truth: Code) -> Code:
        one, zero = (self.emitter.literal(value).text for value in (1.0, 0.0))
        return Code(f"{truth.within(_OR)} ? {one} : {zero}", _CHOICE)

    def sign(self, row: Operation) -> str:
        return row.c

    def negation(self, operand: Tree) -> Code:
        return Code(f"!{self.truth(operand).within(_ATOM)}", _SIGN, True)

    def logic(self, node: Chain) -> Code:
        """Of truths that cost no more than a jump all are worked out: of a jump compilers make no vectors."""
        if not all(map(_is_cheap, node.operands[1:])):
            return super().logic(node)
        operands = [self.truth(operand).within(_ATOM) for operand in node.operands]
        joined = f" {self.both[node.operators[0]]} ".join(operands)
        return Code(f"({joined})", _ATOM, True)  # compilers warn of & before ?

    def square(self, base: Tree) -> Code:
        return Code(f"nv_square({self.loose(base)})", _ATOM)

    def arithmetic(self, node: Chain) -> Code:
        """One operator after the other."""
        code = self.value(node.operands[0])
        for number, (operator, operand) in enumerate(node.steps):
            if number == 0 and operator == "-" and _is_zero(node.operands[0]):
                code = Code(f"nv_from_zero({self.loose(operand)})", _ATOM)
            elif operator in self.levels:
                code = self.infix(code, operator, operand, self.levels[operator] + 1)
            else:
                code = Code(OPERATORS[operator].c.format(code.text, self.loose(operand)), _ATOM)
        return code

    def conditional(self, node: Conditional) -> Code:
        test = self.truth(node.condition).within(_OR)
        return Code(f"{test} ? {self.tight(node.then, _OR)} : {self.tight(node.otherwise, _CHOICE)}", _CHOICE)

    def call(self, node: Call) -> Code:
        row = FUNCTIONS[node.function]
        if row.name == "pow" and isinstance(known := known_in(node.arguments[1], self.names), Number):
            return Code(f"nv_power({self.loose(node.arguments[0])}, {self.emitter.literal(known.value).text})", _ATOM)
        return Code(called(row, row.c, list(map(self.loose, node.arguments)), self.emitter.suffix), _ATOM)

    def draw(self, node: Draw) -> Code:
        raise ValueError("this expression draws, and no code to draw was given")


def _is_cheap(tree: Tree) -> bool:
    """Whether there are only names, numbers, comparisons, choices, sums and products in it."""
    if isinstance(tree, Chain):
        costs = not _COSTLY.isdisjoint(tree.operators)
    else:
        costs = isinstance(tree, Call | Draw) or (isinstance(tree, Binary) and tree.operator in _COSTLY)
    return not costs and all(map(_is_cheap, tree.parts))


def _is_zero(tree: Tree) -> bool:
    """Whether a tree is the number 0, not −0."""
    return isinstance(tree, Number) and tree.value == 0.0 and math.copysign(1.0, tree.value) > 0
