"""Expressions as C: what is compiled gives the same bits as the reference does."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from test_emit import DIVIDED, EXACT_TREES, LONG, NAMES, OPERATIONS, SMOOTH_TREES, VALUES

from neurovis_spec.language.expressions.emit_c import Emitter, known_in
from neurovis_spec.language.expressions.evaluate import evaluate, evaluate_array
from neurovis_spec.language.expressions.functions import FUNCTIONS, PLAIN
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import Call, Name, Number, Tree
from neurovis_spec.runtime import c_functions
from neurovis_spec.runtime.c_code import words_of
from neurovis_spec.runtime.c_library import load

pytestmark = pytest.mark.compiler

EDGES = [0.0, -0.0, 0.25, -0.75, 1.0, -1.0, 2.0, -3.0, 800.0, 1e308, -1e308, math.inf, -math.inf, math.nan]


def compiled(trees: Sequence[Tree]) -> list[Callable[[float, float, float], float]]:
    """A function of a, b and c for each tree."""
    emitter = Emitter()
    bodies = [f"return {emitter.text(emitter.value(tree, {name: name for name in NAMES}))};" for tree in trees]
    functions = [
        f"double f{number}(double a, double b, double c);\n"
        f"double f{number}(double a, double b, double c) {{ (void)a; (void)b; (void)c; {body} }}"
        for number, body in enumerate(bodies)
    ]
    library = load("\n".join(["#include <math.h>", emitter.helpers(words_of(bodies)), *functions]) + "\n")
    made = [getattr(library, f"f{number}") for number in range(len(trees))]
    for function in made:
        function.argtypes, function.restype = [ctypes.c_double] * 3, ctypes.c_double
    return made


def agree(trees: Sequence[Tree], points: Sequence[Sequence[float]]) -> None:
    for tree, function in zip(trees, compiled(trees), strict=True):
        for point in points:
            expected, found = evaluate(tree, dict(zip(NAMES, point, strict=True))), function(*point)
            assert np.array_equal([found], [expected], equal_nan=True), (tree, point, found, expected)
            assert math.isnan(expected) or math.copysign(1.0, found) == math.copysign(1.0, expected), (tree, point)


@settings(max_examples=4, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(
    st.lists(EXACT_TREES | DIVIDED | SMOOTH_TREES, min_size=60, max_size=60),
    st.lists(VALUES, min_size=6, max_size=6),
)
def test_random_trees_give_the_same_bits(trees: list[Tree], points: list[list[float]]) -> None:
    agree(trees, points)


def test_every_function_and_operator_at_the_edges() -> None:
    calls = [Call(name, tuple(Name(n) for n in NAMES[: function.least])) for name, function in FUNCTIONS.items()]
    several: list[Tree] = [Call(name, (Name("a"), Name("b"), Name("c"), Name("a"))) for name in ("min", "max")]
    agree([*calls, *several, *OPERATIONS.values()], [[a, b, 0.5] for a in EDGES for b in EDGES])


def test_a_long_sum_gives_the_same_bits() -> None:
    agree([parse(text) for text in LONG.values()], [[a, b, 1.3] for a in EDGES for b in EDGES])


def test_zero_minus_a_choice_of_zero_is_zero() -> None:
    """gcc makes -0 of it where it stands in one expression."""
    texts = (
        "0 - (a > 0)",
        "0 - (1 if a > 0 else 0)",
        "0^2 - (a or 0)",
        "0 - (2 if a else 0)",
        "b - (a > 0)",
        "-0 - (a > 0)",
        "-0 - b",
    )
    agree([parse(text) for text in texts], [[a, 0.0, 0.0] for a in (-1.0, 0.0, 1.0, math.nan)])


def test_what_is_known_is_worked_out_and_a_power_stays_one() -> None:
    """An exponent that comes to 2 is no square, whether written as a sum or known of a name."""
    emitter = Emitter()
    assert emitter.value(parse("a * b + 1"), {"a": 2.0, "b": 3.0}) == 7.0
    assert emitter.value(parse("a^2"), {"a": "x"}) == "nv_square(x)"
    assert emitter.value(parse("a^b"), {"a": "x", "b": 2.0}) == "nv_power(x, 2.0)"
    assert emitter.value(parse("a^(1 + 1)"), {"a": "x"}) == "nv_power(x, 2.0)"
    assert emitter.value(parse("a^b"), {"a": "x", "b": "y"}) == "pow(x, y)"
    assert known_in(parse("-b"), {"b": 2.0}) == Number(-2.0, 0, 2)
    agree([parse("a^(1 + 1)"), parse("a^-1"), parse("a^0.5"), parse("pow(a, 3)")], [[x, 0, 0] for x in EDGES])


def test_numbers_of_32_bits_have_their_own_functions() -> None:
    value = Emitter("float").value(parse("tanh(a) + 0.1*sigmoid(a) - 1/0"), {"a": "x"})
    assert value == "tanhf(x) + 0.1f*nv_sigmoid(x) - 1.0f/0.0f"


@settings(max_examples=8, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(
    st.lists(EXACT_TREES | DIVIDED | SMOOTH_TREES, min_size=20, max_size=20),
    st.lists(VALUES, min_size=6, max_size=6),
)
def test_a_library_gives_arrays_the_bits_of_the_reference(trees: list[Tree], values: list[list[float]]) -> None:
    """Python's functions, and those that are compiled: of trees, and of each function and operator at the edges."""
    calls = [Call(name, tuple(Name(n) for n in NAMES[: function.least])) for name, function in FUNCTIONS.items()]
    rows = [*values, *([a, b, 0.5] for a, b in zip(EDGES, EDGES[5:] + EDGES[:5], strict=True))]
    points = [dict(zip(NAMES, row, strict=True)) for row in rows]
    places = dict(zip(NAMES, np.array(rows).T, strict=True))
    for tree in [*trees, *calls, *OPERATIONS.values(), Call("max", (Name("a"), Name("b"), Name("c")))]:
        expected = np.array([evaluate(tree, point) for point in points])
        for library in (PLAIN, c_functions.library()):
            found = np.broadcast_to(evaluate_array(tree, places, by=library), expected.shape)
            scalar = [evaluate_array(tree, point, by=library) for point in points]
            for given_ in (found, np.array(scalar)):
                assert np.array_equal(given_, expected, equal_nan=True), tree
                signs = np.signbit(given_) == np.signbit(expected)
                assert (signs | np.isnan(expected)).all(), tree
