"""Derivatives of formulas: those of differences, where a formula is smooth."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from test_emit import NAMES, chains, trees

from neurovis_spec.language.expressions.derivative import derivative
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import Binary, Call, ExpressionError, Name, Number, Tree

STEP = 1e-4
#: Sums, products and quotients of all functions, powers, comparisons and choices.
TREES = trees((0.0, 1.0, 2.0, -0.3, 0.7), (("+", "-"), ("*", "/"), ("%",)), tuple(FUNCTIONS))
FORMULAS = TREES | st.builds(Binary, st.just("^"), TREES, TREES) | chains(("*", "/"), TREES)

#: None of which is next to nothing: a remainder by that jumps between all differences.
NUMBERS = st.floats(-2.1, 2.1).filter(lambda number: number == 0 or abs(number) > 1e-3)


def by_difference(tree: Tree, point: dict[str, float], name: str) -> float | None:
    """The derivative by differences; None where a formula is not smooth, or too steep to say."""

    def at(step: float) -> float:
        return evaluate(tree, {**point, name: point[name] + step})

    values = [at(step) for step in (-STEP, -STEP / 2, 0.0, STEP / 2, STEP)]
    if not all(abs(value) < 1e4 for value in values):
        return None
    coarse, fine = (values[4] - values[0]) / (2 * STEP), (values[3] - values[1]) / STEP
    before, behind = (values[2] - values[0]) / STEP, (values[4] - values[2]) / STEP
    room = 1.0 + abs(fine)
    return fine if abs(coarse - fine) < 1e-5 * room and abs(behind - before) < 1e-2 * room else None


@given(FORMULAS, st.lists(NUMBERS, min_size=3, max_size=3))
@settings(max_examples=150, deadline=None)
def test_a_derivative_is_that_of_differences(tree: Tree, values: list[float]) -> None:
    point = dict(zip(NAMES, values, strict=True))
    expected = by_difference(tree, point, "a")
    try:
        made = derivative(tree, "a")
        found, beside = (evaluate(made, {**point, "a": point["a"] + step}) for step in (0.0, STEP / 4))
    except ExpressionError:  # longer than a formula may be
        assume(False)
    # one of a part may be infinite where the whole is smooth, as in sqrt(x)^2 at 0, and a branch be taken at one
    # point alone, as in (0 if a else a) at 0
    assume(expected is not None and math.isfinite(found) and math.isclose(found, beside, rel_tol=1e-2, abs_tol=1e-2))
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_function_has_a_derivative_by_each_argument(name: str) -> None:
    row = FUNCTIONS[name]
    arguments = NAMES if row.most is None else NAMES[: row.most]
    tree = Call(name, tuple(map(Name, arguments)))
    for values in ((0.37, 0.62, 0.11), (0.62, 0.37, 0.91), (0.12, 0.37, 0.62)):
        point = dict(zip(NAMES, values, strict=True))
        for argument in arguments:
            expected = by_difference(tree, point, argument)
            assert expected is not None
            assert evaluate(derivative(tree, argument), point) == pytest.approx(expected, abs=1e-6)
            assert (row.derivative is None) == (derivative(tree, argument) == Number(0.0))


def test_what_has_none() -> None:
    assert derivative(parse("floor(x) + (x > y) + (1 if x else 2)"), "y") == Number(0.0)
    with pytest.raises(ValueError, match="'x' has no derivative"):
        derivative(parse("normal(x, 1)", random=True), "x")
    assert derivative(parse("x + normal(y, 1)", random=True), "x") == Number(1.0)
    long = parse("*".join(["x"] * 60))
    with pytest.raises(ExpressionError, match="operations and values"):
        derivative(long, "x")
