from __future__ import annotations

import ast
import doctest
import math
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.language.expressions import derivative, emit, evaluate, functions, lexer, parser, tree
from neurovis_spec.language.expressions.evaluate import evaluate as value_of
from neurovis_spec.language.expressions.evaluate import evaluate_array
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.parser import ExpressionError, parse, unknown_names
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
    substitute,
    walk,
)

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    "module", [derivative, emit, evaluate, functions, lexer, parser, tree], ids=lambda m: m.__name__
)
def test_doctests(module: ModuleType) -> None:
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0


def shown(node: Tree) -> str:
    """The structure of a tree, every operation in parentheses."""
    match node:
        case Number(value=value):
            return repr(value)
        case Name(name=name):
            return name
        case Unary(operator=operator, operand=operand):
            return f"({operator} {shown(operand)})"
        case Binary(operator=binary, left=left, right=right):
            return f"({shown(left)} {binary} {shown(right)})"
        case Chain(operands=operands):
            result = shown(operands[0])
            for joined, operand in node.steps:
                result = f"({result} {joined} {shown(operand)})"
            return result
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            return f"({shown(then)} if {shown(condition)} else {shown(otherwise)})"
        case Call(function=function, arguments=arguments):
            return f"{function}({', '.join(map(shown, arguments))})"
        case Draw(kind=kind, first=first, second=second, index=index):
            return f"{kind}#{index}({shown(first)}, {shown(second)})"


@pytest.mark.parametrize(
    ("text", "structure"),
    [
        ("-x^2", "(- (x ^ 2.0))"),
        ("2^-1", "(2.0 ^ (- 1.0))"),
        ("a ** b ^ c", "(a ^ (b ^ c))"),
        ("-x*y", "((- x) * y)"),
        ("a - b - c", "((a - b) - c)"),
        ("a / b * c % d", "(((a / b) * c) % d)"),
        ("not a == b and c", "((not (a == b)) and c)"),
        ("a or b and c < d + e", "(a or (b and (c < (d + e))))"),
        ("a if b else c if d else e", "(a if b else (c if d else e))"),
        ("a if (b if c else d) else e", "(a if (b if c else d) else e)"),
        ("max(a, min(b, c), 1)", "max(a, min(b, c), 1.0)"),
        ("sin", "sin"),
        ("01.5 + 1. + .5 + 1e-3 + 1E+2", "((((1.5 + 1.0) + 0.5) + 0.001) + 100.0)"),
        ("\n x\t+\r\n1 ", "(x + 1.0)"),
        ("- -+x", "(- (- (+ x)))"),
        ("iffy + orb - nothing", "((iffy + orb) - nothing)"),
    ],
)
def test_structure(text: str, structure: str) -> None:
    assert shown(parse(text)) == structure


def python_shown(node: ast.expr) -> str:
    """``shown`` for a tree of Python's own parser; raises KeyError for what is no part of the language."""
    symbols: dict[type, str] = {
        ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "^", ast.UAdd: "+",
        ast.USub: "-", ast.Not: "not", ast.And: "and", ast.Or: "or", ast.Lt: "<", ast.LtE: "<=", ast.Eq: "==",
    }  # fmt: skip
    match node:
        case ast.Constant(value=int() | float() as value):
            return repr(float(value))
        case ast.Name(id=name):
            return name
        case ast.UnaryOp(op=op, operand=operand):
            return f"({symbols[type(op)]} {python_shown(operand)})"
        case ast.BinOp(left=left, op=operation, right=right):
            return f"({python_shown(left)} {symbols[type(operation)]} {python_shown(right)})"
        case ast.BoolOp(op=junction, values=values):
            text = python_shown(values[0])
            for operand in values[1:]:
                text = f"({text} {symbols[type(junction)]} {python_shown(operand)})"
            return text
        case ast.Compare(left=left, ops=[comparison], comparators=[right]):
            return f"({python_shown(left)} {symbols[type(comparison)]} {python_shown(right)})"
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return f"({python_shown(body)} if {python_shown(test)} else {python_shown(orelse)})"
        case _:
            raise KeyError(type(node))


OPERATORS = ["+", "-", "*", "/", "%", "**", "<", "<=", "==", "and", "or", "if", "else", "+ -", "and not"]
OPERANDS = ["x", "y", "2", ".5", "( x", "y )", "- x", "not y", "( 3", "2 )", "- ( y"]
SENTENCES = st.lists(st.tuples(st.sampled_from(OPERANDS), st.sampled_from(OPERATORS)), max_size=7).flatmap(
    lambda pairs: st.sampled_from(OPERANDS).map(lambda last: " ".join([*(f"{a} {b}" for a, b in pairs), last]))
)


@given(SENTENCES)
@settings(max_examples=600)
def test_precedence_is_that_of_python(text: str) -> None:
    try:
        expected: str | None = python_shown(ast.parse(text, mode="eval").body)
    except (SyntaxError, KeyError):  # KeyError: a chained comparison
        expected = None
    try:
        actual = shown(parse(text))
    except ExpressionError:
        actual = None
    assert actual == expected


def test_places() -> None:
    node = parse("alpha * -cos( phi ) if x < 1 else 0")
    text = "alpha * -cos( phi ) if x < 1 else 0"
    pieces = {text[part.start : part.end] for part in walk(node)}
    assert pieces == {text, "alpha * -cos( phi )", "alpha", "-cos( phi )", "cos( phi )", "phi", "x < 1", "x", "1", "0"}


def test_draws_are_numbered_as_written() -> None:
    node = parse("normal(uniform(0, 1), 2) + uniform(-1, 1)", random=True)
    assert shown(node) == "(normal#0(uniform#1(0.0, 1.0), 2.0) + uniform#2((- 1.0), 1.0))"


def test_functions_of_the_place() -> None:
    assert shown(parse("f(v) + f(1)", extra_functions={"f": 1})) == "(f(v) + f(1.0))"
    with pytest.raises(ExpressionError, match="'f' takes 1 argument, here are 2"):
        parse("f(1, 2)", extra_functions={"f": 1})


def test_unknown_names() -> None:
    nodes = unknown_names(parse("sin + sin(pi) if b else a + b"), ["pi", "a"])
    assert [(node.name, node.start, node.end) for node in nodes] == [("sin", 0, 3), ("b", 17, 18), ("b", 28, 29)]


# text, code, the characters at fault (between ‹ and ›), a part of the hint
ERRORS = [
    ("‹›", "empty-expression", None),
    ("‹  ›", "empty-expression", None),
    ("1 ‹+›", "missing-operand", None),
    ("‹*›3", "missing-operand", None),
    ("a * ‹/› b", "missing-operand", None),
    ("2 * ‹*› x", "missing-operand", "'*' once"),
    ("a <= ‹>› b", "missing-operand", None),
    ("‹(›", "missing-operand", None),
    ("(‹)›", "missing-operand", None),
    ("min(1, ‹)›", "missing-operand", None),
    ("1 + ‹not› x", "missing-operand", "parentheses"),
    ("2 ‹x›", "missing-operator", "2 * x"),
    ("(a)‹(›b)", "missing-operator", "*"),
    ("2‹(›b)", "missing-operator", "*"),
    ("a ‹not› b", "missing-operator", None),
    ("‹(›a + b", "unbalanced-parenthesis", None),
    ("sin‹(›a", "unbalanced-parenthesis", None),
    ("a‹)›", "unbalanced-parenthesis", None),
    ("a + ‹)›", "unbalanced-parenthesis", None),
    ("1‹,›5", "unexpected-comma", "0.5"),
    ("(1‹,› 5)", "unexpected-comma", "0.5"),
    ("1 + ‹tahn›(x)", "unknown-function", "'tanh'"),
    ("‹ln›(x)", "unknown-function", "'log(x)'"),
    ("‹arctan2›(x)", "unknown-function", "'atan2'"),
    ("‹stiffness›(x + 1)", "unknown-function", "stiffness * (…)"),
    ("‹q›(v)", "unknown-function", "q * (…)"),
    ("‹f›(v)", "unknown-function", "'activity' of a model"),
    ("‹eval›(x)", "unknown-function", "the functions are"),
    ("‹sin()›", "wrong-arguments", "sin(x)"),
    ("1 + ‹clip(x, 1)›", "wrong-arguments", "clip(x, low, high)"),
    ("‹max(1)›", "wrong-arguments", "max(a, b, …)"),
    ("‹pow(1, 2, 3)›", "wrong-arguments", "pow(x, exponent)"),
    ("‹normal›(0, 1)", "draw-not-allowed", "'noise'"),
    ("0 < x ‹<› 1", "chained-comparison", "and"),
    ("a == b ‹!=› c", "chained-comparison", "and"),
    ("a ‹if› b", "missing-else", "else"),
    ("(a ‹if› b)", "missing-else", "else"),
    ("a ‹else› b", "missing-if", "if"),
    ("a ‹&&› b", "foreign-operator", "'and'"),
    ("a ‹||› b", "foreign-operator", "'or'"),
    ("‹!›a", "foreign-operator", "'not'"),
    ("‹~›a", "foreign-operator", "'not'"),
    ("a ‹=› b", "foreign-operator", "'=='"),
    ("a ‹===› b", "foreign-operator", "'=='"),
    ("a ‹<>› b", "foreign-operator", "'!='"),
    ("a ‹=<› b", "foreign-operator", "'<='"),
    ("a ‹//› b", "foreign-operator", "floor"),
    ("a ‹?› b : c", "foreign-operator", "if"),
    ("a ‹:=› 3", "foreign-operator", "name"),
    ("x ‹in› y", "foreign-operator", "=="),
    ("x ‹mod› y", "foreign-operator", "%"),
    ("a‹.b›", "no-attributes", "alone"),
    ("(a)‹.›", "no-attributes", "alone"),
    ("w‹[›3]", "no-subscripts", "neuron"),
    ("‹[›1, 2]", "no-collections", "( )"),
    ("‹{›1}", "no-collections", None),
    ("‹[i for i in x]›", "no-comprehensions", "one by one"),
    ("max(i ‹for› i in x)", "no-comprehensions", "one by one"),
    ("x + ‹'abc'›", "no-strings", None),
    ('‹"abc›', "no-strings", None),
    ("‹0x1f›", "malformed-number", "decimal"),
    ("‹1_000›", "malformed-number", "write 1000"),
    ("2 * ‹010›", "malformed-number", "write 10"),
    ("‹00›", "malformed-number", "write 0"),
    ("‹2024-01-01›", "malformed-number", "2024 - 1 - 1"),
    ("‹2024-12-10› ", "malformed-number", "2024 - 12 - 10"),
    ("‹2x› + 1", "malformed-number", "2 * x"),
    ("‹1e›", "malformed-number", "exponent"),
    ("‹1.2.3›", "malformed-number", None),
    ("1 + ‹1e999›", "number-overflow", None),
    ("a ‹−› b", "unexpected-character", "'-'"),
    ("a ‹×› b", "unexpected-character", "'*'"),
    ("a ‹≤› b", "unexpected-character", "'<='"),
    ("x‹²›", "unexpected-character", "'^2'"),
    ("2*‹π›", "unexpected-character", "'pi'"),
    ("‹σ›*2", "unexpected-character", "'sigma'"),
    ("‹λ›", "unexpected-character", "'lambda'"),
    ("‹ａ›", "unexpected-character", "'a'"),
    ("größe".replace("ö", "‹ö›"), "unexpected-character", "ASCII"),
    ("a‹\u00a0›+ b", "unexpected-character", "blank"),
    ("a‹\u200b›", "unexpected-character", "invisible"),
    ("a ‹@› b", "unexpected-character", None),
    ("a‹;› b", "unexpected-character", "nothing ends a value but its line"),
    ("a‹\0›", "unexpected-character", None),
]


@pytest.mark.parametrize(("marked", "code", "hint"), ERRORS)
def test_errors(marked: str, code: str, hint: str | None) -> None:
    text = marked.replace("‹", "").replace("›", "")
    with pytest.raises(ExpressionError) as raised:
        parse(text)
    error = raised.value
    assert (error.code, error.start, error.end) == (code, marked.index("‹"), marked.index("›") - 1)
    assert error.message
    if hint is not None:
        assert hint in (error.hint or "")


def test_length() -> None:
    assert shown(parse(" " * 999 + "1")) == "1.0"
    with pytest.raises(ExpressionError) as raised:
        parse(" " * 1000 + "1")
    assert (raised.value.code, raised.value.start, raised.value.end) == ("expression-too-long", 1000, 1001)


NESTS = [
    ("(", ")"), ("-", ""), ("not ", ""), ("x^", ""), ("(", ")^2"), ("sigmoid(", ")"), ("sigmoid(x+", ")"),
    ("max(x,x,x,x,", ")"), ("max(", ",x,x,x,x)"), ("clip(", ",0,1)"), ("x if x else ", ""), ("(", ") if x else x"),
    ("x if (", ") else x"), ("x<(", ")"), ("x and not (", ")"), ("1 or 1 and 1<1+1*(", ")"),
    ("(", ")*x+x<x and x or x"), ("x/(", ")"), ("x+", ""), ("x%", ""), ("x and ", ""), ("normal(0,", ")"),
]  # fmt: skip


def attempt(text: str) -> Tree | ExpressionError:
    """The tree or the mistake; anything else is raised."""
    try:
        return parse(text, random=True, extra_functions={"f": 1})
    except ExpressionError as error:
        return error


@pytest.mark.parametrize(("before", "after"), NESTS)
def test_depth_is_bounded_and_what_passes_works(before: str, after: str) -> None:
    results = [attempt(before * n + "x" + after * n) for n in (1, 10, 15, 25, 64, 65, 150, 250, 400)]
    codes = {result.code for result in results if isinstance(result, ExpressionError)}
    assert codes
    assert codes <= {"expression-too-long", "expression-too-deep", "expression-too-costly"}
    nodes = [result for result in results if not isinstance(result, ExpressionError)]
    assert len(nodes) >= 2
    for node in nodes:
        number = value_of(node, {"x": 0.5}, draw=lambda _, first, second: first + second)
        assert evaluate_array(node, {"x": 0.5}, draw=lambda _, first, second: first + second) == pytest.approx(number)
        code = emit.emit(node, {"x": "x"}, draw=lambda _, first, second: f"({first}) + ({second})")
        compile(code, "<code>", "eval")


def test_horner_of_degree_20() -> None:
    text = "1"
    for _ in range(20):
        text = f"1 + x*({text})"
    assert value_of(parse(text), {"x": 2.0}) == 2**21 - 1


def check_attempt(text: str) -> None:
    result = attempt(text)
    assert 0 <= result.start <= result.end <= len(text)
    assert result.start < result.end or not text


@given(st.text() | st.text("xyz019.eE+-*/%^<>=!&|()[],;:'\"_ \t\nπ²σ\u00a0", max_size=30))
@settings(max_examples=500)
def test_any_text_parses_or_is_an_expression_error(text: str) -> None:
    check_attempt(text)


PIECES = [*OPERATORS, *OPERANDS, "sin", "max", "normal", "for", "lambda", "f", "(", ")", ",", "^", ".", "'", "sin ("]


@given(st.lists(st.sampled_from(PIECES), max_size=25))
@settings(max_examples=500)
def test_any_tokens_parse_or_are_an_expression_error(pieces: list[str]) -> None:
    check_attempt(" ".join(pieces))


EDGES = [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 1.5, 2.5, -2.5, 3.0, 1e-300, 745.5, -745.5, 1e308, -1e308, INF, -INF, NAN]


def alike(a: float, b: float) -> bool:
    return (math.isnan(a) and math.isnan(b)) or a == b or abs(a - b) <= 1e-12 * max(abs(a), abs(b))


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_function_on_floats_and_on_arrays(name: str) -> None:
    arity = FUNCTIONS[name].least
    grid = np.array(np.meshgrid(*[EDGES] * arity, indexing="ij")).reshape(arity, -1)
    call = Call(name, tuple(Name(f"a{k}") for k in range(arity)))
    many = evaluate_array(call, {f"a{k}": column for k, column in enumerate(grid)})
    assert isinstance(many, np.ndarray)
    for arguments, result in zip(grid.T.tolist(), many.tolist(), strict=True):
        single = value_of(call, {f"a{k}": argument for k, argument in enumerate(arguments)})
        assert alike(single, result), (name, arguments, single, result)


@given(st.sampled_from([n for n in FUNCTIONS if FUNCTIONS[n].most == 1]), st.floats(-40, 40))
@settings(max_examples=300)
def test_function_of_one_on_floats_and_on_arrays(name: str, x: float) -> None:
    call = Call(name, (Name("x"),))
    assert alike(value_of(call, {"x": x}), float(evaluate_array(call, {"x": x})))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1/0", INF), ("-1/0", -INF), ("1/-0.0", -INF), ("0/0", NAN), ("1e308*10", INF), ("1e308/1e-9", INF),
        ("7 % 3", 1), ("-7 % 3", 2), ("7 % -3", -2), ("5 % 0", NAN), ("-5 % (1/0)", INF), ("(1/0) % 2", NAN),
        ("2^0.5", math.sqrt(2)), ("0^-1", INF), ("0^0", 1), ("(-8)^(1/3)", NAN), ("10^400", INF), ("(-10)^401", -INF),
        ("(-10)^400", INF), ("(-0.0)^-3", -INF), ("(-0.0)^-2", INF), ("1^(0/0)", 1), ("pow(3, 2)", 9), ("2**3", 8),
        ("log(0)", -INF), ("log(-1)", NAN), ("log1p(-1)", -INF), ("log1p(-2)", NAN), ("sqrt(-1)", NAN),
        ("exp(1000)", INF), ("exp(-1000)", 0), ("expm1(1000)", INF), ("sinh(-1000)", -INF), ("cosh(-1000)", INF),
        ("sin(1/0)", NAN), ("cos(-1/0)", NAN), ("tan(1/0)", NAN), ("asin(2)", NAN), ("acos(-2)", NAN),
        ("atan(1/0)", math.pi / 2), ("atan2(-1, -1)", -3 * math.pi / 4), ("tanh(1/0)", 1),
        ("round(0.5)", 0), ("round(1.5)", 2), ("round(2.5)", 2), ("round(-0.5)", 0), ("floor(-0.5)", -1),
        ("ceil(-0.5)", 0), ("floor(1/0)", INF), ("abs(-3)", 3), ("sign(-3)", -1), ("sign(0)", 0), ("sign(0/0)", NAN),
        ("min(3, 1, 2)", 1), ("max(3, 1, 5, 2)", 5), ("min(1, 0/0)", NAN), ("max(0/0, 1)", NAN),
        ("max(1, 0/0, 2)", NAN),
        ("clip(5, 0, 1)", 1), ("clip(-5, 0, 1)", 0), ("clip(0.5, 0, 1)", 0.5), ("clip(0.5, 1, 0)", 0),
        ("step(0)", 1), ("step(-0.0)", 1), ("step(-1e-300)", 0), ("step(2)", 1), ("step(0/0)", NAN),
        ("sigmoid(0)", 0.5), ("sigmoid(800)", 1), ("sigmoid(-800)", 0), ("sigmoid(-40)", math.exp(-40)),
        ("1 < 2", 1), ("2 <= 1", 0), ("0/0 == 0/0", 0), ("0/0 != 0/0", 1), ("3 and 2", 1), ("0 or -2", 1),
        ("0 or 0", 0),
        ("not 3", 0), ("not 0", 1), ("not (0/0)", 0), ("7 if 0/0 else 8", 7), ("7 if 0 else 8", 8), ("+-3", -3),
        ("1 and 0 or 1", 1), ("-2^2", -4), ("2^3^2", 512), ("2^-1", 0.5),
    ],
)  # fmt: skip
def test_values(text: str, value: float) -> None:
    node = parse(text)
    for result in (value_of(node, {}), evaluate_array(node, {})):
        assert isinstance(result, float)
        assert alike(result, value), result


@given(st.floats(allow_nan=False))
def test_squares_are_exact(x: float) -> None:
    for text in ("x^2", "x**2.0", "pow(x, 2)"):
        assert value_of(parse(text), {"x": x}) == x * x
        assert evaluate_array(parse(text), {"x": np.array([x])}) == np.array([x * x])


def test_names_functions_and_draws() -> None:
    node = parse("f(x) + dt", extra_functions={"f": 1})
    assert value_of(node, {"x": 2, "dt": 0.5}, {"f": lambda v: 10 * v}) == 20.5
    values = evaluate_array(node, {"x": np.array([2.0, 3.0]), "dt": 0.5}, functions={"f": np.square})
    np.testing.assert_array_equal(values, [4.5, 9.5])
    noise = parse("uniform(0, 4) + normal(1, 2)", random=True)
    numbers = {0: 0.25, 1: -1.0}
    assert value_of(noise, {}, draw=lambda d, a, b: a + b * numbers[d.index]) == 1.0 + -1.0
    for evaluation in (value_of, evaluate_array):
        with pytest.raises(ValueError, match="draws"):
            evaluation(noise, {})
        with pytest.raises(KeyError):
            evaluation(node, {"x": 1.0})


def test_only_the_branch_taken_is_computed() -> None:
    assert value_of(parse("1 if x else missing"), {"x": 1}) == 1
    assert value_of(parse("missing if not x else 2"), {"x": 1}) == 2


def test_arrays_broadcast_in_silence() -> None:
    node = parse("w * (i - j) / i if i else -1")
    with np.errstate(all="raise"):
        table = evaluate_array(node, {"w": 2.0, "i": np.arange(3.0)[:, None], "j": np.arange(2)})
    assert isinstance(table, np.ndarray)
    assert table.dtype == np.float64
    assert table.tolist() == [[-1, -1], [2, 0], [2, 1]]


def test_integers_are_numbers() -> None:
    values = evaluate_array(parse("i^-1 + i*i"), {"i": np.array([2, 4], dtype=np.int64)})
    assert isinstance(values, np.ndarray)
    assert values.tolist() == [4.5, 16.25]


def test_substitution() -> None:
    node = substitute(parse("u * v + w"), {"u": parse("v + 1"), "v": parse("2")})
    assert shown(node) == "(((v + 1.0) * 2.0) + w)"
    every = parse("f(u) if not u else u^2 + normal(u, 1)", random=True, extra_functions={"f": 1})
    assert shown(substitute(every, {"u": Name("z")})) == "(f(z) if (not z) else ((z ^ 2.0) + normal#0(z, 1.0)))"


def test_substitution_does_not_explode() -> None:
    doubled = deep = parse("u")
    for _ in range(8):
        doubled = substitute(parse("u + u"), {"u": doubled})
    assert len(list(walk(doubled))) == 2**9 - 1
    with pytest.raises(ExpressionError, match="1023 operations and values"):
        substitute(parse("u + u"), {"u": doubled})
    for _ in range(199):
        deep = substitute(parse("-u"), {"u": deep})
    with pytest.raises(ExpressionError, match="more than 200 operations inside each other"):
        substitute(parse("-u"), {"u": deep})


#: Texts that parse.
WELL_FORMED = st.recursive(
    st.sampled_from(["x", "y1", "2", ".5"]),
    lambda parts: (
        st.builds("{} {} {}".format, parts, st.sampled_from(["+", "-", "*", "/", "%", "^", "and", "or"]), parts)
        | st.builds("(({}) {} ({}))".format, parts, st.sampled_from(["<", "=="]), parts)
        | st.builds("( {} )".format, parts)
        | st.builds("(not {})".format, parts)
        | st.builds("-{}".format, parts)
        | st.builds("(({}) if ({}) else {})".format, parts, parts, parts)
        | st.builds("max({}, ({}))".format, parts, parts)
    ),
    max_leaves=12,
)


@given(WELL_FORMED)
def test_the_text_of_a_part_is_the_part(text: str) -> None:
    for part in walk(parse(text)):
        assert shown(parse(text[part.start : part.end])) == shown(part)
