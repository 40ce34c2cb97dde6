"""Expressions from the grammar of §6 and beyond it: most are right, some are broken afterwards.

In: a seed and a number. Out: always the same text for both.
"""

from __future__ import annotations

import random

from neurovis_spec.language.expressions.functions import FUNCTIONS

_NUMBERS = ("0", "1", "2", "3", "0.5", ".5", "2.", "1e3", "1e-300", "1e300", "01.", "1E+2", "1e308")
_OPERATORS = ("+", "-", "*", "/", "%", "^", "**", "<", "<=", ">", ">=", "==", "!=", "and", "or")
NAMES = ("x", "y", "z")
_BROKEN = (
    "(", ")", "((", "))", ",", ".", "..", "'", '"', "[", "]", "{", "}", ";", "=", ":=", "&&", "||", "!", "?",
    ":", "//", "<>", "===", "@", "if", "else", "for", "in", "lambda", "not", "is", "None", "True", "import",
    "nan", "inf", "0x1f", "010", "1_000", "1e", "1e999", "2x", "1.2.3", "π", "−", "×", "²", "σ", "\u00a0", "\u200b",
    "\0", "\x1b", "\ud800", "😀", "\n", "\t", "x.y", "x[0]", "__import__('os')", "9" * 400, "x(", "normal(0,1)",
    "uniform(0)", "f(x)", "sin", "sin()", "snh(x)", "max()", "clip(x)", "-" * 70, "(" * 70, "x^" * 40,
    "1+" * 400,
)  # fmt: skip


def make(seed: int, number: int) -> str:
    """Expression ``number`` of a run with this seed."""
    chooser = random.Random(f"{seed}/expression/{number}")
    text = _expression(chooser, chooser.choice((0, 1, 2, 3, 4, 6)))
    for _ in range(chooser.choice((0, 0, 0, 1, 1, 2, 5))):
        text = _spoilt(chooser, text)
    return text


def _expression(chooser: random.Random, depth: int) -> str:
    if depth == 0:
        return chooser.choice((*NAMES, *_NUMBERS, "pi", "e"))

    def part() -> str:
        return _expression(chooser, chooser.randint(0, depth - 1))

    match chooser.choice(("binary", "binary", "binary", "sign", "not", "call", "call", "group", "choice", "draw")):
        case "binary":
            blank = chooser.choice(("", " ", " "))
            operator = chooser.choice(_OPERATORS)
            blank = " " if operator.isalpha() else blank
            return f"{part()}{blank}{operator}{blank}{part()}"
        case "sign":
            return f"{chooser.choice('-+')}{part()}"
        case "not":
            return f"not {part()}"
        case "call":
            name = chooser.choice(list(FUNCTIONS))
            function = FUNCTIONS[name]
            most = function.least + 2 if function.most is None else function.most
            return f"{name}({', '.join(part() for _ in range(chooser.randint(function.least, most)))})"
        case "group":
            return f"({part()})"
        case "choice":
            return f"{part()} if {part()} else {part()}"
        case _:
            return f"{chooser.choice(('normal', 'uniform'))}({part()}, {part()})"


def _spoilt(chooser: random.Random, text: str) -> str:
    at = chooser.randint(0, len(text))
    end = min(len(text), at + chooser.randint(0, 6))
    match chooser.choice(("insert", "insert", "lose", "double", "swap", "cut")):
        case "insert":
            return text[:at] + chooser.choice(_BROKEN) + text[at:]
        case "lose":
            return text[:at] + text[end:]
        case "double":
            return text[:end] + text[at:end] + text[end:]
        case "swap":
            return text[end:] + text[:end]
        case _:
            return text[:at]
