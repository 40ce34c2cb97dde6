"""The words for what the parser meets and no grammar has.

In: the token at which the parser stopped, and the one before it. Out: the ExpressionError that says what is wrong, at
the invalid characters, with what to write instead where a habit from another language shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.expressions.habits import unit_hint
from neurovis_spec.language.expressions.lexer import Token, is_operand
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.likeness import nearest

INSTEAD: Mapping[str, str] = {
    "ln": "write 'log(x)', the natural logarithm",
    "log10": "write 'log(x) / log(10)'",
    "log2": "write 'log(x) / log(2)'",
    "arcsin": "did you mean 'asin'?",
    "arccos": "did you mean 'acos'?",
    "arctan": "did you mean 'atan'?",
    "arctan2": "did you mean 'atan2'?",
    "fabs": "did you mean 'abs'?",
    "sgn": "did you mean 'sign'?",
    "heaviside": "did you mean 'step'?",
    "logistic": "did you mean 'sigmoid'?",
    "power": "did you mean 'pow'?",
    "mod": "write 'a % b'",
    "fmod": "write 'a % b'",
    "int": "write 'floor(x)'",
    "trunc": "write 'sign(x) * floor(abs(x))'",
    "square": "write 'x^2'",
    "cbrt": "write 'sign(x) * abs(x)^(1/3)'",
    "f": "f(x), the neuron's activation, is known in the 'activity' of a model, its outputs, 'let' and states, but not "
    "in 'initial', 'each_episode' and 'noise'; rules and synapses read what a model gives of it, as pre.rate of "
    "outputs: {rate: f(v)}",
    "spike": "spike is a name, 1 in the step in which a neuron fires: write it without parentheses",
    "relu": "write 'max(x, 0)'",
    "where": "write 'a if condition else b'",
    "sum": "write the terms one by one",
    "gauss": "did you mean 'normal(mean, deviation)'?",
    "random": "did you mean 'uniform(low, high)'?",
    "rand": "did you mean 'uniform(low, high)'?",
    "randn": "did you mean 'normal(mean, deviation)'?",
}
_WORDS: Mapping[str, tuple[str, str, str | None]] = {
    "for": ("no-comprehensions", "there are no comprehensions in an expression", "write the terms one by one"),
    "in": ("foreign-operator", "'in' is no operator here", "compare with '==' and 'or'"),
    "is": ("foreign-operator", "'is' is no operator here", "write '==' for 'is equal to'"),
    "mod": ("foreign-operator", "'mod' is no operator here", "write 'a % b'"),
    "xor": ("foreign-operator", "'xor' is no operator here", "write '(a != 0) != (b != 0)'"),
    "then": ("foreign-operator", "'then' is no operator here", "write 'a if condition else b'"),
}


def missing(previous: Token | None, token: Token, opened: bool) -> ExpressionError:
    """At ``token`` a value should stand; ``opened``: there is a parenthesis before it."""
    if token.text == ")" and not opened:
        return _closes_nothing(token)
    if previous is None:
        return _at("missing-operand", f"'{token.text}' has no value before it", token)
    if token.kind == "end" and previous.text == "%":
        return _at(
            "missing-operand", "a value is missing after '%'", previous, "a % b is the remainder; write 50% as 0.5"
        )
    if token.kind == "end":
        return _at("missing-operand", f"a value is missing after '{previous.text}'", previous)
    hint = f"write '{token.text}' once" if token.text == previous.text and token.text in "*^<>" else None
    return _at("missing-operand", f"a value is missing between '{previous.text}' and '{token.text}'", token, hint)


def loose_not(token: Token) -> ExpressionError:
    """``not`` after an operator that binds tighter."""
    message = "'not' binds looser than the operator before it"
    return _at("missing-operand", message, token, "put (not …) in parentheses")


def unexpected(previous: Token | None, token: Token) -> ExpressionError:
    """After a value stands what can follow none."""
    if token.kind == "name" and token.text in _WORDS:
        code, message, hint = _WORDS[token.text]
        return _at(code, message, token, hint)
    if token.text == ")":
        return _closes_nothing(token)
    if token.text == ",":
        message = "a comma stands only between the arguments of a function"
        return _at("unexpected-comma", message, token, "write decimals with a point, as in 0.5")
    if token.text == "else":
        return _at("missing-if", "'else' without 'if'", token, "write 'a if condition else b'")
    before = "" if previous is None else shorten(previous.text)
    unit = None if previous is None or previous.kind != "number" else unit_hint(previous.text, token.text)
    if unit is not None:
        return _at("missing-operator", f"a unit, '{token.text}', stands behind the number {before}", token, unit)
    product = f"{before} * {shorten(token.text)}" if is_operand(token) else "*"
    message = f"an operator is missing between '{before}' and '{shorten(token.text)}'"
    return _at("missing-operator", message, token, f"for a product write '{product}'")


def unknown_function(name: Token, functions: Sequence[str], fitting: Sequence[str]) -> ExpressionError:
    """A name before a parenthesis that is no function: misspelled, from another language, or a factor. ``fitting`` are
    the functions that take as many arguments as are there: they come first."""
    close = nearest(name.text, functions) if len(name.text) > 1 else ()
    close = tuple(sorted(close, key=lambda one: one not in fitting))
    if name.text in INSTEAD:
        hint = INSTEAD[name.text]
    elif close:
        hint = "did you mean " + " or ".join(f"'{other}'" for other in close) + "?"
    else:
        hint = f"for a product write '{shorten(name.text)} * (…)'; the functions are {', '.join(functions)}"
    return _at("unknown-function", f"unknown function '{shorten(name.text)}'", name, hint)


def wrong_arguments(
    name: Token, end: int, given: int, wanted: tuple[int, int | None], usage: str | None
) -> ExpressionError:
    """A call up to ``end`` with more or fewer arguments than wanted; ``usage`` shows how it is written."""
    least, most = wanted
    number = f"{least} or more" if most is None else f"{least}" if least == most else f"{least} to {most}"
    noun = "argument" if number == "1" else "arguments"
    message = f"'{name.text}' takes {number} {noun}, here {'is' if given == 1 else 'are'} {given}"
    return ExpressionError("wrong-arguments", message, name.start, end, None if usage is None else f"write '{usage}'")


def _closes_nothing(token: Token) -> ExpressionError:
    return _at("unbalanced-parenthesis", "this parenthesis closes nothing", token)


def _at(code: str, message: str, token: Token, hint: str | None = None) -> ExpressionError:
    return ExpressionError(code, message, token.start, token.end, hint)
