from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.language.expressions.emit import emit, simplify
from neurovis_spec.language.expressions.evaluate import evaluate, evaluate_array
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import (
    Binary,
    BinaryOperator,
    Call,
    Chain,
    ChainOperator,
    Conditional,
    Name,
    Number,
    Tree,
    Unary,
    UnaryOperator,
)

NAMES = ("a", "b", "c")
CODES = {name: f"v_{name}" for name in NAMES}
COMPARISONS: tuple[BinaryOperator, ...] = ("<", "<=", ">", ">=", "==", "!=")
TRUTHS: tuple[ChainOperator, ...] = ("and", "or")
#: Every operator between a and b.
OPERATIONS: Mapping[str, Tree] = {
    **{sign: Chain((sign,), (Name("a"), Name("b"))) for sign in ("+", "-", "*", "/", "%", *TRUTHS)},
    **{sign: Binary(sign, Name("a"), Name("b")) for sign in ("^", *COMPARISONS)},
}
SIGNS: tuple[UnaryOperator, ...] = ("-", "+", "not")
#: Functions that IEEE 754 rounds exactly.
EXACT = tuple(name for name, row in FUNCTIONS.items() if row.agree != "rounding")
#: Functions that do not amplify errors.
SMOOTH = ("sin", "cos", "tanh", "sigmoid", "atan", "abs", "min", "max", "clip")


def calls(functions: tuple[str, ...], parts: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
    def of(name: str) -> st.SearchStrategy[Tree]:
        least, most = FUNCTIONS[name].least, FUNCTIONS[name].most or 7
        return st.lists(parts, min_size=least, max_size=most).map(lambda arguments: Call(name, tuple(arguments)))

    return st.sampled_from(functions).flatmap(of)


def chains(operators: tuple[ChainOperator, ...], parts: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
    """Of two to five operands."""

    def joined(first: Tree, rest: list[tuple[ChainOperator, Tree]]) -> Tree:
        return Chain(tuple(sign for sign, _ in rest), (first, *(operand for _, operand in rest)))

    rest = st.lists(st.tuples(st.sampled_from(operators), parts), min_size=1, max_size=4)
    return st.builds(joined, parts, rest)


def trees(
    numbers: tuple[float, ...], levels: tuple[tuple[ChainOperator, ...], ...], functions: tuple[str, ...]
) -> st.SearchStrategy[Tree]:
    leaves: st.SearchStrategy[Tree] = st.sampled_from(numbers).map(Number) | st.sampled_from(NAMES).map(Name)
    return st.recursive(
        leaves,
        lambda parts: (
            st.builds(Unary, st.sampled_from(SIGNS), parts)
            | st.builds(Binary, st.sampled_from(COMPARISONS), parts, parts)
            | st.sampled_from((*levels, ("and",), ("or",))).flatmap(lambda level: chains(level, parts))
            | st.builds(Conditional, parts, parts, parts)
            | st.builds(Binary, st.just("^"), parts, st.just(Number(2.0)))
            | calls(functions, parts)
        ),
        max_leaves=20,
    )


EXACT_TREES = trees((0.0, 1.0, 2.0, 0.5, 3.0, 1e300, -1.0), (("+", "-"), ("*",)), EXACT)
# denominators that are leaves: the sign of a zero that min or max picks is the platform's choice
DIVIDED = st.builds(
    lambda first, signs, names: Chain(tuple(signs), (first, *map(Name, names[: len(signs)]))),
    EXACT_TREES,
    st.lists(st.sampled_from(["/", "%", "*"]), min_size=1, max_size=3),
    st.permutations(NAMES),
)
SMOOTH_TREES = trees((0.0, 1.0, 0.25, 0.7, -0.3), (("+", "-"),), SMOOTH)
VALUES = st.lists(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e200, math.inf, -math.inf, math.nan]) | st.floats(-9, 9),
    min_size=3,
    max_size=3,
)

Run = Callable[..., float | npt.NDArray[np.float64]]


def compiled(code: str, arguments: Mapping[str, str] = CODES) -> Run:
    """Our own code as a function, as a backend would make it: with ``np`` and nothing else."""
    scope: dict[str, object] = {"np": np, "__builtins__": {}}
    exec(f"def run({', '.join(arguments.values())}):\n    return {code}", scope)
    run = scope["run"]
    assert callable(run)

    def quiet(*values: float | npt.NDArray[np.float64]) -> float | npt.NDArray[np.float64]:
        with np.errstate(all="ignore"):
            return np.asarray(run(*values), dtype=np.float64)

    return quiet


def four_ways(tree: Tree, values: list[list[float]]) -> list[list[float]]:
    """The values of a tree at several points: one by one, all at once, and by emitted code (floats, and arrays)."""
    points = [dict(zip(NAMES, point, strict=True)) for point in values]
    columns = {name: np.array([point[name] for point in points]) for name in NAMES}
    run = compiled(emit(tree, CODES))
    return [
        [evaluate(tree, point) for point in points],
        np.broadcast_to(evaluate_array(tree, columns), len(points)).tolist(),
        [float(run(*point.values())) for point in points],
        np.broadcast_to(run(*columns.values()), len(points)).tolist(),
    ]


@given(EXACT_TREES | DIVIDED, st.lists(VALUES, min_size=1, max_size=4))
@settings(max_examples=400, deadline=None)
def test_exact_operations_agree_bit_for_bit(tree: Tree, values: list[list[float]]) -> None:
    reference, *others = four_ways(tree, values)
    for other in others:
        np.testing.assert_array_equal(other, reference)


@given(SMOOTH_TREES, st.lists(st.lists(st.floats(-9, 9), min_size=3, max_size=3), min_size=1, max_size=4))
@settings(max_examples=300, deadline=None)
def test_elementary_functions_agree(tree: Tree, values: list[list[float]]) -> None:
    reference, *others = four_ways(without_jumps(tree), values)
    for other in others:
        np.testing.assert_allclose(other, reference, rtol=1e-12, atol=1e-12)


def without_jumps(tree: Tree) -> Tree:
    """The tree with comparisons, choices and squares of numbers replaced, which amplify the last bit."""
    match tree:
        case Unary(operator="not", operand=operand):
            return Unary("-", without_jumps(operand))
        case Unary(operator=sign, operand=operand):
            return Unary(sign, without_jumps(operand))
        case Binary(operator="^", left=left):
            return Binary("^", Call("sin", (without_jumps(left),)), Number(2.0))
        case Chain(operators=("+" | "-", *_) as operators, operands=operands):
            return Chain(operators, tuple(map(without_jumps, operands)))
        case Chain(operands=operands):
            times: ChainOperator = "*"
            return Chain((times,) * (len(operands) - 1), tuple(Call("cos", (without_jumps(one),)) for one in operands))
        case Binary(left=left, right=right):
            return Chain(("*",), (Call("cos", (without_jumps(left),)), Call("tanh", (without_jumps(right),))))
        case Conditional(then=then, condition=condition, otherwise=otherwise):
            chosen = Binary("<", Name("a"), Name("b"))
            choice = Conditional(chosen, without_jumps(then), without_jumps(otherwise))
            return Chain(("+",), (choice, without_jumps(condition)))
        case Call(function=function, arguments=arguments):
            return Call(function, tuple(map(without_jumps, arguments)))
        case _:
            return tree


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_every_function_has_its_code(name: str) -> None:
    call = Call(name, tuple(Name(n) for n in NAMES[: FUNCTIONS[name].least]))
    edges = [0.0, -0.0, 0.25, -0.75, 1.0, -1.0, 2.5, -3.0, 800.0, -800.0, math.inf, -math.inf, math.nan]
    values = [[a, b, 0.5] for a in edges for b in edges]
    reference, *others = four_ways(call, values)
    for other in others:
        np.testing.assert_allclose(other, reference, rtol=1e-12, atol=0)


@pytest.mark.parametrize("operator", OPERATIONS)
def test_every_operator_at_the_edges(operator: str) -> None:
    edges = [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -3.0, 1e308, -1e308, math.inf, -math.inf, math.nan]
    values = [[a, b, 0.0] for a in edges for b in edges]
    operation = OPERATIONS[operator]
    for tree in (operation, Chain(("/",), (Number(1.0), operation))):  # the second tells a zero from its negative
        reference, *others = four_ways(tree, values)
        for other in others:
            np.testing.assert_allclose(other, reference, rtol=1e-12, atol=0)


#: 240 operands, none inside another.
LONG = {
    "sum": "a" + "+b-c" * 119 + "+b",
    "product": "a" + "*b/c" * 119 + "*b",
    "quotient": "a" + "/b" * 239,
    "remainder": "a" + "%b" * 239,
    "truth": "a" + " or b" * 190,
}


@pytest.mark.parametrize("text", LONG.values(), ids=LONG)
def test_a_long_sum_is_one_operation_and_not_deep(text: str) -> None:
    tree = parse(text)
    assert isinstance(tree, Chain)
    assert all(isinstance(operand, Name) for operand in tree.operands)
    reference, *others = four_ways(tree, [[0.1, 0.7, 1.3], [3.7e5, -0.3, 0.9], [0.0, -0.0, math.inf]])
    for other in others:
        np.testing.assert_array_equal(other, reference)
    by_python = eval(text, {"a": 0.1, "b": 0.7, "c": 1.3})
    assert reference[0] == (1.0 if "or" in text else by_python)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a - (b - c)", "v_a - (v_b - v_c)"),
        ("(a - b) - c", "v_a - v_b - v_c"),
        ("(a + b) * -c", "(v_a + v_b)*-v_c"),
        ("-(a * b)", "-(v_a*v_b)"),
        ("+a", "v_a"),
        ("a^2", "v_a*v_a"),
        ("2*a^2", "2.0*(v_a*v_a)"),
        ("(a + b)**2", "np.square(v_a + v_b)"),
        ("a^3", "np.float_power(v_a, 3.0)"),
        ("a / 2", "v_a/2.0"),
        ("a / b", "np.divide(v_a, v_b)"),
        ("1 / 0", "np.divide(1.0, 0.0)"),
        ("a % b", "np.remainder(v_a, v_b)"),
        ("2*a / b / c * a % b", "np.divide(2.0*v_a, v_b)/v_c*v_a%v_b"),
        ("a < b", "(v_a < v_b)*1.0"),
        ("a < b and c", "((v_a < v_b) & (v_c != 0.0))*1.0"),
        ("a and (b or c)", "((v_a != 0.0) & ((v_b != 0.0) | (v_c != 0.0)))*1.0"),
        ("(a or b) and c", "(((v_a != 0.0) | (v_b != 0.0)) & (v_c != 0.0))*1.0"),
        ("a or (b or c)", "((v_a != 0.0) | ((v_b != 0.0) | (v_c != 0.0)))*1.0"),
        ("a or b and c", "((v_a != 0.0) | (v_b != 0.0) & (v_c != 0.0))*1.0"),
        ("(a < b) == (b < c)", "((v_a < v_b)*1.0 == (v_b < v_c)*1.0)*1.0"),
        ("not a", "np.logical_not(v_a != 0.0)*1.0"),
        ("1 if a else b", "np.where(v_a != 0.0, 1.0, v_b)"),
        ("1 if a < b else 0 if not (a or b) else c",
         "np.where(v_a < v_b, 1.0, np.where(np.logical_not((v_a != 0.0) | (v_b != 0.0)), 0.0, v_c))"),
        ("tanh(a + b)", "np.tanh(v_a + v_b)"),
        ("sigmoid(a + b)", "np.reciprocal(1.0 + np.exp(-(v_a + v_b)))"),
        ("step(a)", "np.heaviside(v_a, 1.0)"),
        ("max(a, b, c)", "np.maximum(np.maximum(v_a, v_b), v_c)"),
        ("clip(a, -1, 1)", "np.minimum(np.maximum(v_a, -1.0), 1.0)"),
        ("2 * 3 * a + 1e-3", "6.0*v_a + 0.001"),
    ],
)  # fmt: skip
def test_code(text: str, code: str) -> None:
    assert emit(parse(text), CODES) == code


def test_names_are_replaced_and_code_is_protected() -> None:
    tree = parse("x * exp(x) + x^2")
    assert emit(tree, {"x": "s.v[3]"}) == "s.v[3]*np.exp(s.v[3]) + s.v[3]*s.v[3]"
    assert emit(tree, {"x": "p + q"}) == "(p + q)*np.exp(p + q) + np.square(p + q)"
    with pytest.raises(KeyError):
        emit(tree, {"y": "y"})


def test_functions_and_draws_of_the_place() -> None:
    tree = parse("2 * f(v + 1)", extra_functions={"f": 1})
    assert emit(tree, {"v": "v0"}, {"f": lambda code: f"f3({code})"}) == "2.0*(f3(v0 + 1.0))"
    with pytest.raises(KeyError):
        emit(tree, {"v": "v0"})
    noise = parse("uniform(0, 1) + normal(m, 0.5)", random=True)
    code = emit(noise, {"m": "m0"}, draw=lambda node, a, b: f"{node.kind}{node.index}({a}, {b})")
    assert code == "(uniform0(0.0, 1.0)) + (normal1(m0, 0.5))"
    with pytest.raises(ValueError, match="draws"):
        emit(noise, {"m": "m0"})


def test_numbers_that_are_not_finite() -> None:
    tree = Chain(("-",), (Number(-math.inf), Chain(("*",), (Number(math.nan), Number(-0.0)))))
    assert emit(tree, {}) == "-np.inf - np.nan*-0.0"


@given(EXACT_TREES, VALUES)
@settings(max_examples=200, deadline=None)
def test_simplifying_changes_no_value(tree: Tree, values: list[float]) -> None:
    point = dict(zip(NAMES, values, strict=True))
    np.testing.assert_array_equal(evaluate(simplify(tree), point), evaluate(tree, point))
    assert simplify(simplify(tree)) == simplify(tree)


def test_simplifying() -> None:
    assert simplify(parse("sqrt(16) + 2 * 3 if 1 < 2 else 1")) == Number(10.0, 0, 32)
    assert emit(parse("log(0) + 1/0 * 0"), {}) == "np.log(0.0) + np.divide(1.0, 0.0)*0.0"
    # a written 2 is a square, an exponent that comes to 2 a power: it stays one
    assert emit(parse("a^(1 + 1)"), CODES) == "np.float_power(v_a, 1.0 + 1.0)"
    assert emit(parse("pow(a, 4/2)"), CODES) == "np.float_power(v_a, 4.0/2.0)"
    assert emit(parse("a^(1 + 2)"), CODES) == "np.float_power(v_a, 3.0)"
