"""The elementary functions: the one table that parser, evaluation and code emission share.

In: floats. Out: floats, by IEEE 754: poles are infinities, undefined values NaN, overflow an infinity; nothing raises.
Each function stands here three times, side by side: on floats (the reference), on NumPy arrays, and as NumPy code.
Adding one is adding a row. A Library is what all of them are computed by on arrays: NumPy's own functions, which differ
from those of the C library in the last bit, or others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import reduce
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray

Scalar: TypeAlias = Callable[..., float]
Vector: TypeAlias = Callable[..., FloatArray]

#: Names that mean the same everywhere; ``dt`` is known to whoever evaluates.
CONSTANTS: Mapping[str, float] = MappingProxyType({"pi": math.pi, "e": math.e})


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


class Function(NamedTuple):
    """A function: ``least`` to ``most`` arguments (None: as many as wanted), and what it is to each consumer.

    ``code`` is a template with ``{0}``, ``{1}``, … for the code of its arguments, and gives a call; of a function
    of any number of arguments it takes two, and the emitter folds. ``signed``: it puts a sign before its arguments.
    """

    usage: str
    scalar: Scalar
    array: Vector
    code: str
    least: int = 1
    most: int | None = 1
    signed: bool = False


def _clip(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    return np.minimum(np.maximum(x, low), high)


def _step(x: FloatArray) -> FloatArray:
    return np.heaviside(x, 1.0)


def _sigmoid(x: FloatArray) -> FloatArray:
    return np.reciprocal(1.0 + np.exp(np.negative(x)))


def _folded(function: np.ufunc) -> Vector:
    return lambda *values: reduce(function, values)


def _one(name: str, scalar: Scalar, array: np.ufunc) -> Function:
    return Function(f"{name}(x)", scalar, array, f"np.{array.__name__}({{0}})")


#: All functions of §6, in its order.
FUNCTIONS: Mapping[str, Function] = MappingProxyType(
    {
        "abs": _one("abs", math.fabs, np.absolute),
        "sign": _one("sign", sign, np.sign),
        "min": Function("min(a, b, …)", minimum, _folded(np.minimum), "np.minimum({0}, {1})", 2, None),
        "max": Function("max(a, b, …)", maximum, _folded(np.maximum), "np.maximum({0}, {1})", 2, None),
        "clip": Function("clip(x, low, high)", clip, _clip, "np.minimum(np.maximum({0}, {1}), {2})", 3, 3),
        "floor": _one("floor", _integral(math.floor), np.floor),
        "ceil": _one("ceil", _integral(math.ceil), np.ceil),
        "round": _one("round", _integral(round), np.rint),
        "sqrt": _one("sqrt", _defined(math.sqrt), np.sqrt),
        "exp": _one("exp", _exp, np.exp),
        "log": _one("log", _with_pole(math.log, 0.0), np.log),
        "log1p": _one("log1p", _with_pole(math.log1p, -1.0), np.log1p),
        "expm1": _one("expm1", _unbounded(math.expm1), np.expm1),
        "pow": Function("pow(x, exponent)", power, np.float_power, "np.float_power({0}, {1})", 2, 2),
        "sin": _one("sin", _defined(math.sin), np.sin),
        "cos": _one("cos", _defined(math.cos), np.cos),
        "tan": _one("tan", _defined(math.tan), np.tan),
        "asin": _one("asin", _defined(math.asin), np.arcsin),
        "acos": _one("acos", _defined(math.acos), np.arccos),
        "atan": _one("atan", math.atan, np.arctan),
        "atan2": Function("atan2(y, x)", math.atan2, np.arctan2, "np.arctan2({0}, {1})", 2, 2),
        "sinh": _one("sinh", _unbounded(math.sinh, odd=True), np.sinh),
        "cosh": _one("cosh", _unbounded(math.cosh), np.cosh),
        "tanh": _one("tanh", math.tanh, np.tanh),
        "sigmoid": Function("sigmoid(x)", sigmoid, _sigmoid, "np.reciprocal(1.0 + np.exp(-{0}))", signed=True),
        "step": Function("step(x)", step, _step, "np.heaviside({0}, 1.0)"),
    }
)


class Library(NamedTuple):
    """What computes the functions of formulas on arrays: ``calls`` by their names, and two operators, ``%`` and ``^``.
    What is left, sums, products and comparisons, is exact to rounding whoever computes it."""

    calls: Mapping[str, Vector]
    remainder: Vector
    power: Vector


def _each(scalar: Scalar, count: int) -> Vector:
    """A function on floats, for each number of arrays that broadcast."""
    called = np.frompyfunc(scalar, count, 1)
    return lambda *values: np.asarray(called(*values), dtype=np.float64)


def _of_numbers(function: Function) -> Vector:
    """The function on floats, for arrays."""
    if function.most is None:
        two = _each(function.scalar, function.least)
        return lambda *values: reduce(two, values)
    return _each(function.scalar, function.most)


#: NumPy's functions: quick, and their last bits depend on what the processor can do.
NUMPY = Library(
    {name: function.array for name, function in FUNCTIONS.items()},
    np.remainder,
    np.float_power,  # not np.power, which takes a root of −∞ where the exponent is a scalar 0.5
)
#: Python's functions, number by number: they are those of the C library, bit for bit.
PLAIN = Library(
    {name: _of_numbers(function) for name, function in FUNCTIONS.items()}, _each(modulo, 2), _each(power, 2)
)
