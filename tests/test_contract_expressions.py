"""Expressions (§6): exactly the functions, operators and constants that are listed, each with its value."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from small_specs import answer, codes, compiled, network_of

from neurovis_spec.language.expressions.functions import CONSTANTS, FUNCTIONS

LISTED = """abs sign min max clip floor ceil round sqrt exp log log1p expm1 pow sin cos tan asin acos atan
atan2 sinh cosh tanh sigmoid step exprel"""
X = 0.7391
VALUES: dict[str, tuple[str, Callable[[], float]]] = {
    "abs": ("abs(-x)", lambda: X),
    "sign": ("sign(-x)", lambda: -1),
    "min": ("min(3, x, 2)", lambda: X),
    "max": ("max(-1, x, 0)", lambda: X),
    "clip": ("clip(5*x, -2, 2)", lambda: 2),
    "floor": ("floor(-x)", lambda: -1),
    "ceil": ("ceil(x)", lambda: 1),
    "round": ("round(10*x)", lambda: 7),
    "sqrt": ("sqrt(x)", lambda: math.sqrt(X)),
    "exp": ("exp(x)", lambda: math.exp(X)),
    "log": ("log(x)", lambda: math.log(X)),
    "log1p": ("log1p(x)", lambda: math.log1p(X)),
    "expm1": ("expm1(x)", lambda: math.expm1(X)),
    "exprel": ("exprel(x) + exprel(0)", lambda: math.expm1(X) / X + 1),
    "pow": ("pow(x, 3)", lambda: X**3),
    "sin": ("sin(x)", lambda: math.sin(X)),
    "cos": ("cos(x)", lambda: math.cos(X)),
    "tan": ("tan(x)", lambda: math.tan(X)),
    "asin": ("asin(x)", lambda: math.asin(X)),
    "acos": ("acos(x)", lambda: math.acos(X)),
    "atan": ("atan(x)", lambda: math.atan(X)),
    "atan2": ("atan2(x, -2)", lambda: math.atan2(X, -2)),
    "sinh": ("sinh(x)", lambda: math.sinh(X)),
    "cosh": ("cosh(x)", lambda: math.cosh(X)),
    "tanh": ("tanh(x)", lambda: math.tanh(X)),
    "sigmoid": ("sigmoid(x)", lambda: 1 / (1 + math.exp(-X))),
    "step": ("step(x) + step(-x)", lambda: 1),
}


def test_there_are_these_functions_and_constants_and_no_others() -> None:
    """In the contract's own lists."""
    assert set(FUNCTIONS) == set(LISTED.split()) == set(VALUES)
    assert set(CONSTANTS) == {"pi", "e"}  # and dt, which is the spec's


@pytest.mark.parametrize("name", VALUES)
def test_a_function_has_its_value(name: str) -> None:
    """In a constant, and as an activation in a run on every backend."""
    expression, value = VALUES[name]
    text = f"parameters: {{x: {X}}}\nneurons: {{A: {{bias: '{expression}'}}}}"
    assert network_of(text).neurons.bias[0] == pytest.approx(value(), rel=1e-15)
    text = f"activations: {{g: {{value: '{expression}'}}}}\nneurons: {{A: {{bias: {X}, activation: g}}}}"
    for backend in ("reference", "numpy"):
        assert compiled(text).run(1, backend=backend)["A"][0] == pytest.approx(value(), rel=1e-14)


def constant(expression: str) -> float:
    """The value of an expression without names."""
    return float(network_of(f"time: {{dt: 0.25}}\nneurons: {{A: {{bias: '{expression}'}}}}").neurons.bias[0])


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("2 + 3*4 - 6/4 % 1", 13.5), ("2^3^2", 512), ("2**3**2", 512), ("2^3**2", 512), ("-2^2", -4), ("2^-2", 0.25),
        ("-7 % 3", 2), ("7 % -3", -2), ("-7.5 % 2", 0.5), ("1 < 2", 1), ("2 <= 1", 0), ("2 > 1", 1), ("1 >= 2", 0),
        ("1 == 1", 1), ("1 != 1", 0), ("3 and 4", 1), ("3 and 0", 0), ("0 or 5", 1), ("0 or 0", 0), ("not 7", 0),
        ("not 0", 1), ("5 if 1 < 2 else 6", 5), ("5 if 0 else 6", 6), ("(1 + 2)*3", 9), ("round(0.5)", 0),
        ("round(1.5)", 2), ("round(-2.5)", -2), ("step(0)", 1), ("step(-1e-9)", 0), ("pi", math.pi), ("e", math.e),
        ("4*dt", 1), ("1e3 + .5 + 1.", 1001.5), ("+3", 3),
    ],
)  # fmt: skip
def test_operators_and_constants(expression: str, value: float) -> None:
    """``^`` is ``**``, to the right; ``%`` has the divisor's sign; round goes to even."""
    assert constant(expression) == value


@pytest.mark.parametrize("operator", ["<", "<=", ">", ">=", "==", "!="])
def test_comparisons_do_not_chain(operator: str) -> None:
    """And the finding says how to write it."""
    code, _, hint = answer(f"neurons: {{A: {{bias: '1 {operator} 2 {operator} 3'}}}}")
    assert code == "chained-comparison"
    assert "and" in hint


def test_a_name_before_a_parenthesis_is_a_function_and_any_other_a_value() -> None:
    """So functions bar no names: of parameters, of a definition's parameters, of neurons."""
    names = [*FUNCTIONS, "normal", "uniform"]
    listed = ", ".join(f"{name}: {number}" for number, name in enumerate(names))
    text = f"parameters: {{{listed}}}\nneurons: {{A: {{bias: {' + '.join(names)} + abs(-1)}}, sin: {{}}, f: {{}}}}"
    assert network_of(text).neurons.bias[0] == sum(range(len(names))) + 1


@pytest.mark.parametrize(
    "text",
    [
        "a.__class__", "'a'", "(1, 2)", "[1]", "{1: 2}", "x[0]", "[i for i in n]", "lambda: 1", "f'{a}'", "a := 1",
        "__import__(1)", "open(1)", "exec(1)", "a()", "(a)(1)", "sin(1)(2)", "1 is 1", "1 in a", "~1", "1 & 1", "1 @ 1",
        "sum(1, 2)", "abs(x=1)", "abs(*a)", "a; a", "1j", "0b1", "1_0", "True", "None", "not", "a if a",
    ],
)  # fmt: skip
def test_nothing_else_is_an_expression(text: str) -> None:
    """No attributes, subscripts, calls of anything else, strings or comprehensions."""
    quoted = text.replace("'", "''")
    assert len(codes(f"parameters: {{a: 1}}\nneurons: {{A: {{bias: '{quoted}'}}}}")) == 1


def test_length_depth_and_cost_are_bounded() -> None:
    """A thousand characters are one expression, one more is none."""
    ones = "+".join("1" * 100)
    assert constant(ones + " " * (999 - len(ones))) == 100
    assert constant(" " * 999 + "7") == 7
    assert codes(f"neurons: {{A: {{bias: '{' ' * 1000}7'}}}}") == ["expression-too-long"]
    assert constant("+".join("1" * 240)) == 240
    assert codes(f"neurons: {{A: {{bias: '{'+'.join('1' * 500)}'}}}}") == ["expression-too-costly"]
    deep = "(" * 300 + "1" + ")" * 300
    assert codes(f"neurons: {{A: {{bias: '{deep}'}}}}") == ["expression-too-deep"]


def test_an_unknown_name_is_an_error_with_the_nearest_known_names() -> None:
    """At the very character."""
    code, message, hint = answer("parameters: {alpha: 1, beta: 2}\nneurons: {A: {bias: 2*alhpa}}")
    assert (code, hint) == ("unknown-name", "did you mean 'alpha'?")
    assert "'alhpa'" in message
    assert "sqrt" in answer("neurons: {A: {bias: sqr(2)}}")[2]
