"""What formulas may say: functions, operators, given names. One table for all who parse, compute, check, explain.

In: floats. Out: floats, by IEEE 754: poles are infinities, undefined values NaN, overflow an infinity; nothing raises.
A row says all that is known of a function: on floats (the reference), on NumPy arrays, as NumPy code, in C; its
derivatives, what it hides, where it is undefined, how units go through it, and what the manual says of it. Adding one
is adding a row. A Library is what all of them are computed by on arrays: NumPy's own functions, which differ from those
of the C library in the last bit, or others.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.language.expressions.tree import Binary, Call, Chain, Number, Tree

Scalar: TypeAlias = Callable[..., float]
Vector: TypeAlias = Callable[..., FloatArray]

#: Names that mean the same everywhere; ``dt`` is known to whoever evaluates.
CONSTANTS: Mapping[str, float] = MappingProxyType({"pi": math.pi, "e": math.e})


#: What each name means, and where.
GIVEN: Final[Mapping[str, str]] = {
    "pi": "The constant π, 3.14159…",
    "e": "The constant e, 2.71828…",
    "dt": "The seconds a step takes (time.dt, by default 1).",
    "k": "The step of the run, from 0; in inputs, noise and definitions, which are worked out at each step.",
    "t": "The seconds of the run, k·dt; in inputs, noise and definitions, which are worked out at each step.",
    "i": "The index from 0: of a neuron in its group, of a number in its input; in a connection, of the source "
    "in its reference.",
    "j": "In a connection, the index from 0 of the target in its reference.",
    "n": "How many neurons the group, or numbers the input, has; a connection has n_from and n_to.",
    "number": "In a label within a module, the number of the instance: 1 of left1, and where there is only one.",
    "n_from": "In a connection, the number of sources.",
    "n_to": "In a connection, the number of targets.",
    "distance": "In a connection, how far apart the positions of both neurons are.",
    "x": "In an activation, the combined input.",
    "drive": "In a model, the combined input with bias, input and noise: u[t].",
    "f": "In a model, the neuron's activation: f(v).",
    "pre": "In a rule or a synapse, what the connection sends, d steps ago, d being the delay; pre.X is what X was of "
    "the source then: a state, an output, a parameter, or its activity.",
    "sent": "In a rule or a synapse, what the connection sends in this step.",
    "post": "In a rule or a synapse, the target's activity; post.X is X of the target.",
    "weight": "In a rule, the weight before the step; in a synapse, the weight.",
    "spike": "In a model with a spike block, 1 in the step in which the neuron fires, else 0; in a synapse, and in a "
    "rule with on_pre or on_post, 1 in the step in which a spike arrives.",
    "centre": "In a rule that changes the centre, that before the step.",
}
#: Names that no parameter may have.
RESERVED: Final = ("t", "k", "dt", "i", "j", "n", "pi", "e")


def meaning(name: str) -> str:
    """What a name means, within a sentence.

    >>> meaning("n_to")
    'in a connection, the number of targets'
    """
    about = GIVEN[name].removesuffix(".")
    return about[0].lower() + about[1:]


def divide(a: float, b: float) -> float:
    """a / b; a number by a zero is an infinity of the signs' product, 0 by 0 is NaN."""
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def modulo(a: float, b: float) -> float:
    """a − b·⌊a/b⌋, with the sign of the divisor; NaN for a zero divisor.

    >>> modulo(-1.0, 3.0), modulo(1.0, -3.0)
    (2.0, -2.0)
    """
    return a % b if b != 0 else math.nan


def power(a: float, b: float) -> float:
    """a to the b, as IEEE 754 has it (0 to a negative power is an infinity)."""
    try:
        return math.pow(a, b)
    except OverflowError:
        pole = math.inf
    except ValueError:
        if a != 0:
            return math.nan
        pole = math.inf
    odd = math.fmod(b, 2.0) in (1.0, -1.0)
    return math.copysign(pole, a) if odd else pole


def sign(x: float) -> float:
    """−1, 0 or 1; NaN for NaN."""
    return 1.0 if x > 0 else -1.0 if x < 0 else 0.0 if x == 0 else x


def step(x: float) -> float:
    """1 from 0 on, else 0; NaN for NaN."""
    return 1.0 if x >= 0 else 0.0 if x < 0 else x


def sigmoid(x: float) -> float:
    """1 / (1 + exp(−x)), exact to rounding on both sides; where exp(−x) overflows (x < −709.78) it is 0."""
    return divide(1.0, 1.0 + _exp(-x))


def exprel(x: float) -> float:
    """expm1(x)/x, which is 1 where x is 0."""
    return 1.0 if x == 0 else divide(_expm1(x), x)


def minimum(*values: float) -> float:
    """The least; NaN if any is."""
    return reduce(lambda a, b: a if a <= b or a != a else b, values)


def maximum(*values: float) -> float:
    """The greatest; NaN if any is."""
    return reduce(lambda a, b: a if a >= b or a != a else b, values)


def clip(x: float, low: float, high: float) -> float:
    """x, held between two bounds; where they cross, ``high`` wins."""
    return minimum(maximum(x, low), high)


def _integral(rounded: Callable[[float], int]) -> Scalar:
    """A rounding that keeps infinities, NaN and the sign of zero."""
    return lambda x: math.copysign(float(rounded(x)), x) if math.isfinite(x) else x


def _defined(function: Callable[[float], float]) -> Scalar:
    """A function that is NaN where it is not defined."""

    def total(x: float) -> float:
        try:
            return function(x)
        except ValueError:
            return math.nan

    return total


def _with_pole(function: Callable[[float], float], pole: float) -> Scalar:
    """A logarithm: −∞ at its pole."""
    total = _defined(function)
    return lambda x: -math.inf if x == pole else total(x)


def _unbounded(function: Callable[[float], float], odd: bool = False) -> Scalar:
    """A function that grows beyond all numbers: ∞ there, with the argument's sign where it is odd."""

    def total(x: float) -> float:
        try:
            return function(x)
        except OverflowError:
            return math.copysign(math.inf, x) if odd else math.inf

    return total


_exp = _unbounded(math.exp)
_expm1 = _unbounded(math.expm1)


class Hidden(IntEnum):
    """What does not show in the value of the whole: more and more."""

    NOTHING = 0
    INFINITY = 1
    ALL = 2


class Undefined(NamedTuple):
    """An operation is undefined ``where`` a formula over its arguments is true, and, unless the argument of that is a
    number, a ``further`` one. ``what`` says it of a definition: ``divides by 0``."""

    what: str
    where: str
    further: str = ""


#: How far all who compute a function agree: to the bit; but for the sign of a 0; up to rounding.
Agreement: TypeAlias = Literal["bits", "zeros", "rounding"]


#: How units go through an operation: its arguments and its value have the same one (``same``); its arguments have, and
#: the value is a number (``compared``); all of them are numbers (``number``); the arguments have any, and the value is
#: a number (``sign``); the others say how that of the value follows.
Passing: TypeAlias = Literal["same", "compared", "number", "sign", "product", "quotient", "root", "power"]


@dataclass(frozen=True, slots=True)
class Operation:
    """An operator between a and b, and what it is to each consumer.

    ``usage`` is how it is written. ``code`` and ``c`` are templates of calls with ``{0}``, ``{1}``, … for the code of
    its arguments (``-{0}`` where a sign stands before one), in C with ``{s}`` for the suffix of functions and literals;
    or the sign of an operator.
    ``derivative`` gives, by each argument, a formula over them; None: it jumps, and is constant in between.
    ``hides`` is what its value hides of its arguments, or gives that for each of them: mostly NaN gives NaN, and an
    infinity either. ``infinite`` says where it gives an infinity, ``undefined`` where an infinity or NaN; that a number
    overflows is neither.
    """

    usage: str
    scalar: Callable[..., float]
    array: Vector
    code: str
    c: str
    derivative: tuple[str, ...] | None
    hides: Hidden | Callable[..., tuple[Hidden, ...]] = Hidden.NOTHING
    infinite: tuple[Undefined, ...] = ()
    undefined: tuple[Undefined, ...] = ()
    agree: Agreement = "bits"
    units: Passing = "same"

    @property
    def names(self) -> tuple[str, ...]:
        """What its formulas call its arguments."""
        return ("a", "b")

    def hidden(self, arguments: tuple[Tree, ...]) -> tuple[Hidden, ...]:
        """What its value hides of each of these arguments."""
        hides = self.hides
        return (hides,) * len(arguments) if isinstance(hides, Hidden) else hides(*arguments)


@dataclass(frozen=True)
class Function(Operation):
    """A function. Of one of any number of arguments the usage ends in an ellipsis; its code takes two, and is folded.

    ``about`` is the word of the manual; ``helper`` the C function that ``c`` calls and C lacks, with ``{real}`` for the
    type of numbers.
    """

    agree: Agreement = "rounding"
    units: Passing = "number"
    about: str = ""
    helper: str = ""

    @property
    def name(self) -> str:
        """What it is called."""
        return self.usage.partition("(")[0]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What its formulas call its arguments, as its usage does."""
        return tuple(name for name in self.usage.partition("(")[2].rstrip(")").split(", ") if name != "…")

    @property
    def least(self) -> int:
        """The least number of arguments."""
        return len(self.names)

    @property
    def most(self) -> int | None:
        """The greatest; None: as many as wanted."""
        return None if "…" in self.usage else len(self.names)


def _clip(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    return np.minimum(np.maximum(x, low), high)


def _step(x: FloatArray) -> FloatArray:
    return np.heaviside(x, 1.0)


def _sigmoid(x: FloatArray) -> FloatArray:
    return np.reciprocal(1.0 + np.exp(np.negative(x)))


def _exprel(x: FloatArray) -> FloatArray:
    return np.where(np.equal(x, 0), 1.0, np.divide(np.expm1(x), x))


def _folded(function: np.ufunc) -> Vector:
    return lambda *values: reduce(function, values)


def _of_power(base: Tree, exponent: Tree) -> tuple[Hidden, Hidden]:
    """∞^−1 is 0, and NaN^0 is 1."""
    grows = isinstance(exponent, Number) and exponent.value > 0
    return Hidden.NOTHING if grows else Hidden.ALL, Hidden.ALL


def _behind(a: Tree, b: Tree) -> tuple[Hidden, Hidden]:
    """x/∞ is 0."""
    return Hidden.NOTHING, Hidden.INFINITY


_BY_ZERO = (Undefined("divides by 0", "b == 0"),)
_POLE_OF_POWER = Undefined("divides by 0", "x == 0", "exponent < 0")
_BROKEN_POWER = Undefined("takes a broken power of a number below 0", "x < 0", "exponent != floor(exponent)")

#: The operators that join two operands; ``x^y`` is ``pow``.
OPERATORS: Mapping[str, Operation] = MappingProxyType({
    "+": Operation("a + b", operator.add, np.add, "+", "+", ("1", "1")),
    "-": Operation("a - b", operator.sub, np.subtract, "-", "-", ("1", "-1")),
    "*": Operation("a * b", operator.mul, np.multiply, "*", "*", ("b", "a"), units="product"),
    "/": Operation(
        "a / b", divide, np.divide, "np.divide({0}, {1})", "/", ("1/b", "-a/b^2"),
        hides=_behind, infinite=_BY_ZERO, undefined=_BY_ZERO, units="quotient",
    ),
    "%": Operation(
        "a % b", modulo, np.remainder, "np.remainder({0}, {1})", "nv_mod({0}, {1})", ("1", "-floor(a/b)"),
        hides=_behind, undefined=_BY_ZERO, agree="zeros",
    ),
    "<": Operation("a < b", operator.lt, np.less, "<", "<", None, Hidden.ALL, units="compared"),
    "<=": Operation("a <= b", operator.le, np.less_equal, "<=", "<=", None, Hidden.ALL, units="compared"),
    ">": Operation("a > b", operator.gt, np.greater, ">", ">", None, Hidden.ALL, units="compared"),
    ">=": Operation("a >= b", operator.ge, np.greater_equal, ">=", ">=", None, Hidden.ALL, units="compared"),
    "==": Operation("a == b", operator.eq, np.equal, "==", "==", None, Hidden.ALL, units="compared"),
    "!=": Operation("a != b", operator.ne, np.not_equal, "!=", "!=", None, Hidden.ALL, units="compared"),
    "and": Operation(
        "a and b", lambda a, b: a != 0 and b != 0, np.logical_and, "&", "&&", None, Hidden.ALL, units="sign",
    ),
    "or": Operation(
        "a or b", lambda a, b: a != 0 or b != 0, np.logical_or, "|", "||", None, Hidden.ALL, units="sign",
    ),
})  # fmt: skip

_ROWS = (
    Function(
        "abs(x)", math.fabs, np.absolute, "np.absolute({0})", "fabs{s}({0})", ("sign(x)",),
        units="same", about="The absolute value.", agree="bits",
    ),
    Function(
        "sign(x)", sign, np.sign, "np.sign({0})", "nv_sign({0})", None,
        units="sign", about="−1, 0 or 1.", agree="bits", hides=Hidden.INFINITY,
        helper="""static {real} nv_sign({real} x)
{{
    return x > 0.0{s} ? 1.0{s} : x < 0.0{s} ? -1.0{s} : x == 0.0{s} ? 0.0{s} : x;
}}""",
    ),
    Function(
        "min(a, b, …)", minimum, _folded(np.minimum), "np.minimum({0}, {1})", "nv_min({0}, {1})",
        ("1 if a <= b else 0", "0 if a <= b else 1"),
        units="same", about="The least of two or more.", agree="zeros", hides=Hidden.INFINITY,
        helper="""static {real} nv_min({real} a, {real} b)
{{
    return a <= b || a != a ? a : b;
}}""",
    ),
    Function(
        "max(a, b, …)", maximum, _folded(np.maximum), "np.maximum({0}, {1})", "nv_max({0}, {1})",
        ("1 if a >= b else 0", "0 if a >= b else 1"),
        units="same", about="The greatest of two or more.", agree="zeros", hides=Hidden.INFINITY,
        helper="""static {real} nv_max({real} a, {real} b)
{{
    return a >= b || a != a ? a : b;
}}""",
    ),
    Function(
        "clip(x, low, high)", clip, _clip,
        "np.minimum(np.maximum({0}, {1}), {2})", "nv_min(nv_max({0}, {1}), {2})",
        (
            "1 if low <= x and x <= high else 0",
            "1 if x < low and low <= high else 0",
            "1 if max(x, low) > high else 0",
        ),
        units="same", about="x, held between two bounds.", agree="zeros", hides=Hidden.INFINITY,
    ),
    Function(
        "floor(x)", _integral(math.floor), np.floor, "np.floor({0})", "floor{s}({0})", None,
        units="same", about="The integer below.", agree="bits",
    ),
    Function(
        "ceil(x)", _integral(math.ceil), np.ceil, "np.ceil({0})", "ceil{s}({0})", None,
        units="same", about="The integer above.", agree="bits",
    ),
    Function(
        "round(x)", _integral(round), np.rint, "np.rint({0})", "rint{s}({0})", None,
        units="same", about="The nearest integer; halves go to the even one.", agree="bits",
    ),
    Function(
        "sqrt(x)", _defined(math.sqrt), np.sqrt, "np.sqrt({0})", "sqrt{s}({0})", ("0.5/sqrt(x)",),
        units="root", about="The square root.", agree="bits",
        undefined=(Undefined("takes the square root of a number below 0", "x < 0"),),
    ),
    Function(
        "exp(x)", _exp, np.exp, "np.exp({0})", "exp{s}({0})", ("exp(x)",),
        about="e to the power of x.", hides=Hidden.INFINITY,
    ),
    Function(
        "log(x)", _with_pole(math.log, 0.0), np.log, "np.log({0})", "log{s}({0})", ("1/x",),
        about="The natural logarithm.",
        infinite=(Undefined("takes the logarithm of 0", "x == 0"),),
        undefined=(Undefined("takes the logarithm of a number that is not above 0", "x <= 0"),),
    ),
    Function(
        "log1p(x)", _with_pole(math.log1p, -1.0), np.log1p, "np.log1p({0})", "log1p{s}({0})", ("1/(1 + x)",),
        about="log(1 + x), exact for small x.",
        infinite=(Undefined("takes the logarithm of 0", "x == -1"),),
        undefined=(Undefined("takes the logarithm of a number that is not above 0", "x <= -1"),),
    ),
    Function(
        "expm1(x)", _expm1, np.expm1, "np.expm1({0})", "expm1{s}({0})", ("exp(x)",),
        about="exp(x) − 1, exact for small x.", hides=Hidden.INFINITY,
    ),
    Function(
        # the argument is computed once
        "exprel(x)", exprel, _exprel,
        "np.where(np.equal((_x := {0}), 0.0), 1.0, np.divide(np.expm1(_x), _x))", "nv_exprel({0})",
        ("0.5 + x/3 if abs(x) < 1e-5 else (exp(x) - exprel(x))/x",),
        about="(exp(x) − 1)/x, which is 1 where x is 0.", hides=Hidden.INFINITY,
        helper="""static {real} nv_exprel({real} x)
{{
    return x == 0.0{s} ? 1.0{s} : expm1{s}(x) / x;
}}""",
    ),
    Function(
        "pow(x, exponent)", power, np.float_power, "np.float_power({0}, {1})", "pow{s}({0}, {1})",
        ("exponent*x^(exponent - 1)", "x^exponent*log(x)"),
        units="power", about="x to the power of the exponent, as x^exponent.",
        hides=_of_power, infinite=(_POLE_OF_POWER,), undefined=(_POLE_OF_POWER, _BROKEN_POWER),
        # np.power takes a root of −∞ where the exponent is a scalar 0.5; of a power whose exponent it knows a compiler
        # makes a product, which is not what the library gives
        helper="""static {real} nv_power({real} x, {real} exponent)
{{
    volatile {real} e = exponent;
    return pow{s}(x, e);
}}""",
    ),
    Function(
        "sin(x)", _defined(math.sin), np.sin, "np.sin({0})", "sin{s}({0})", ("cos(x)",),
        about="The sine; angles are in radians.",
    ),
    Function(
        "cos(x)", _defined(math.cos), np.cos, "np.cos({0})", "cos{s}({0})", ("-sin(x)",),
        about="The cosine.",
    ),
    Function(
        "tan(x)", _defined(math.tan), np.tan, "np.tan({0})", "tan{s}({0})", ("1 + tan(x)^2",),
        about="The tangent.",
    ),
    Function(
        "asin(x)", _defined(math.asin), np.arcsin, "np.arcsin({0})", "asin{s}({0})", ("1/sqrt(1 - x^2)",),
        about="The angle with this sine, from −π/2 to π/2.",
        undefined=(Undefined("takes asin of a number beyond -1 to 1", "abs(x) > 1"),),
    ),
    Function(
        "acos(x)", _defined(math.acos), np.arccos, "np.arccos({0})", "acos{s}({0})", ("-1/sqrt(1 - x^2)",),
        about="The angle with this cosine, from 0 to π.",
        undefined=(Undefined("takes acos of a number beyond -1 to 1", "abs(x) > 1"),),
    ),
    Function(
        "atan(x)", math.atan, np.arctan, "np.arctan({0})", "atan{s}({0})", ("1/(1 + x^2)",),
        about="The angle with this tangent, from −π/2 to π/2.", hides=Hidden.INFINITY,
    ),
    Function(
        "atan2(y, x)", math.atan2, np.arctan2, "np.arctan2({0}, {1})", "atan2{s}({0}, {1})",
        ("x/(x^2 + y^2)", "-y/(x^2 + y^2)"),
        units="compared", about="The angle of the point (x, y), from −π to π.", hides=Hidden.INFINITY,
    ),
    Function(
        "sinh(x)", _unbounded(math.sinh, odd=True), np.sinh, "np.sinh({0})", "sinh{s}({0})", ("cosh(x)",),
        about="The hyperbolic sine.",
    ),
    Function(
        "cosh(x)", _unbounded(math.cosh), np.cosh, "np.cosh({0})", "cosh{s}({0})", ("sinh(x)",),
        about="The hyperbolic cosine.",
    ),
    Function(
        "tanh(x)", math.tanh, np.tanh, "np.tanh({0})", "tanh{s}({0})", ("1 - tanh(x)^2",),
        about="The hyperbolic tangent, from −1 to 1.", hides=Hidden.INFINITY,
    ),
    Function(
        "sigmoid(x)", sigmoid, _sigmoid, "np.reciprocal(1.0 + np.exp(-{0}))", "nv_sigmoid({0})",
        ("sigmoid(x)*(1 - sigmoid(x))",),
        about="1 / (1 + exp(−x)), from 0 to 1.", hides=Hidden.INFINITY,
        helper="""static {real} nv_sigmoid({real} x)
{{
    return 1.0{s} / (1.0{s} + exp{s}(-x));
}}""",
    ),
    Function(
        "step(x)", step, _step, "np.heaviside({0}, 1.0)", "nv_step({0})", None,
        units="sign", about="1 from 0 on, else 0.", agree="bits", hides=Hidden.INFINITY,
        helper="""static {real} nv_step({real} x)
{{
    return x >= 0.0{s} ? 1.0{s} : x < 0.0{s} ? 0.0{s} : x;
}}""",
    ),
)  # fmt: skip
#: All functions, in the order of ``docs/language.md``.
FUNCTIONS: Mapping[str, Function] = MappingProxyType({row.name: row for row in _ROWS})


def rows_of(node: Tree) -> Iterator[Operation]:
    """What a node computes itself; its parts are others' business, and so are signs."""
    match node:
        case Chain(operators=operators):
            yield from map(OPERATORS.__getitem__, operators)
        case Binary(operator=sign):
            yield FUNCTIONS["pow"] if sign == "^" else OPERATORS[sign]
        case Call(function=name):
            yield FUNCTIONS[name]


class Draws(NamedTuple):
    """What draws a random number from so many arguments: how it is written, in a finding and in the manual, and the
    words of this."""

    usage: str
    brief: str
    about: str
    arity: int = 2


#: The functions that draw.
DRAWS: Mapping[str, Draws] = MappingProxyType({
    "normal": Draws("normal(mean, deviation)", "normal(mean, sd)", "A normally distributed random number."),
    "uniform": Draws("uniform(low, high)", "uniform(low, high)", "An evenly distributed random number."),
    "poisson": Draws("poisson(mean)", "poisson(mean)", "A Poisson distributed random number.", 1),
})  # fmt: skip


class Library(NamedTuple):
    """What computes the functions of formulas on arrays: ``calls`` by their names, and the operator ``%``; ``^`` is
    ``pow``. What is left, sums, products and comparisons, is exact to rounding whoever computes it."""

    calls: Mapping[str, Vector]
    remainder: Vector


def _each(scalar: Scalar, count: int) -> Vector:
    """A function on floats, for each number of arrays that broadcast."""
    called = np.frompyfunc(scalar, count, 1)
    return lambda *values: np.asarray(called(*values), dtype=np.float64)


def _of_numbers(function: Function) -> Vector:
    """The function on floats, for arrays."""
    each = _each(function.scalar, function.least)
    return each if function.most is not None else lambda *values: reduce(each, values)


#: NumPy's functions: quick, and their last bits depend on what the processor can do.
NUMPY = Library({name: function.array for name, function in FUNCTIONS.items()}, np.remainder)
#: Python's functions, number by number: they are those of the C library, bit for bit.
PLAIN = Library({name: _of_numbers(function) for name, function in FUNCTIONS.items()}, _each(modulo, 2))
