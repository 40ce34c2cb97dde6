"""From text to tokens.

In: the text of an expression. Out: its tokens, the last of kind ``end``; or an ExpressionError at the first character
that no expression holds, with what to write instead. Habits from other languages (``&&``, ``a[i]``, ``−``, ``σ``) are
recognised here, so that they get an answer and not a shrug.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.expressions.habits import UNITS, ungrouped, ungrouped_hint, unit_hint, unit_of
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.language.yaml.characters import character_name

Kind = Literal["number", "name", "operator", "end"]

#: The longest expression, in characters.
MAX_LENGTH = 1000
#: Words that are operators, and so no names.
WORDS = frozenset({"and", "or", "not", "if", "else"})


class Token(NamedTuple):
    """A piece of the text, from ``start`` to ``end``; words that are operators are of kind ``operator``."""

    kind: Kind
    text: str
    start: int
    end: int


_BLANK = re.compile(r"[ \t\r\n]+")
_NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
#: In a measure also ``left1.K3`` and ``K1..K3``.
_REFERENCE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:\.{1,2}[A-Za-z_][A-Za-z0-9_]*)*")
#: And ``(K1 -> O).eligibility``, ``(A -> B (2)).x``: an arrow stands nowhere else.
_OF_RULE = re.compile(r"\([^()]*->[^()]*(?:\([0-9]+\)\s*)?\)\s*\.\s*[A-Za-z_][A-Za-z0-9_]*")
#: What a connection reads of an end, ``pre.v``, and of that the name behind the point.
OF_END = re.compile(r"(?<![\w.])(?:pre|post)\.([A-Za-z_]\w*)", re.ASCII)
#: One number of several: ``legs[3]``.
_SUBSCRIPT = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)\[(?:\s*([0-9]{1,9})\s*\])?")
_KEYWORD = re.compile(r"=(?!=)")
_TAIL = re.compile(r"[A-Za-z0-9_.]+")
#: An integer with zeros in front of it: a text in YAML, an octal number in other languages.
_ZEROS = re.compile(r"0+[0-9]+")
#: What stands before the last three digits of a number with commas between thousands.
_THOUSANDS = re.compile(r"(?<![\w.])[1-9][0-9]{0,2},(?:[0-9]{3},)*\Z")
_DATE = re.compile(r"\s*([0-9]{4}-[0-9]{1,2}-[0-9]{1,2})\s*")
_QUOTED = re.compile(r"(?P<quote>['\"`“”‘’]).*?(?:['\"`“”‘’]|$)", re.DOTALL)
#: A unit that begins with no letter of ASCII.
_UNIT = re.compile(r"[µμ°Ω]\w*")
_OPERATOR = re.compile(r"\*\*|<=|>=|==|!=|[-+*/%^<>(),]")

_FOREIGN: Mapping[str, str] = {
    "===": "write '==' for 'is equal to'",
    "!==": "write '!=' for 'is not equal to'",
    "&&": "write 'and'",
    "||": "write 'or'",
    "//": "write 'floor(a / b)' for a whole quotient",
    "<>": "write '!=' for 'is not equal to'",
    "=<": "write '<='",
    "=>": "write '>='",
    "<<": "multiply by a power of 2",
    ">>": "divide by a power of 2",
    ":=": "a value gets its name where it is declared, not in an expression",
    "&": "write 'and'",
    "|": "write 'or'; for a magnitude 'abs(x)'",
    "!": "write 'not'",
    "~": "write 'not'",
    "=": "write '==' for 'is equal to'",
    "?": "write 'a if condition else b' for a choice",
    ":": "write 'a if condition else b' for a choice",
}
_FOREIGN_OPERATOR = re.compile("|".join(re.escape(text) for text in _FOREIGN))

_LOOKALIKES: Mapping[str, str] = {
    "−": "-", "–": "-", "—": "-", "‐": "-", "‑": "-", "‒": "-", "×": "*", "·": "*", "⋅": "*", "∙": "*", "∗": "*",
    "÷": "/", "⁄": "/", "∕": "/", "≤": "<=", "≥": ">=", "⩽": "<=", "⩾": ">=", "≠": "!=", "∧": "and", "∨": "or",
    "¬": "not ", "√": "sqrt(…)", "²": "^2", "³": "^3", "¹": "^1", "⁻": "^-", "½": "0.5", "¼": "0.25", "¾": "0.75",
    "…": "each term", "∑": "each term", "ˆ": "^", "µ": "mu",
}  # fmt: skip


#: What names an expression may hold beside plain ones; "" are none.
#:
#: - ``references``: with points, or with a number behind them, and the state of a rule, ``(K -> O).e``; ``=`` stands
#:   behind the name of an argument;
#: - ``subscripts``: with a number behind them, as in ``legs[3]``;
#: - ``ends``: of what a connection reads of its ends, as in ``pre.v``.
Naming: TypeAlias = Literal["", "references", "subscripts", "ends"]


def tokens(text: str, naming: Naming = "") -> tuple[Token, ...]:
    """The tokens of an expression. Raises ExpressionError.

    >>> [token.text for token in tokens("-x^2 <= .5e-3")]
    ['-', 'x', '^', '2', '<=', '.5e-3', '']
    """
    if len(text) > MAX_LENGTH:
        message = f"this expression has {len(text)} characters; {MAX_LENGTH} are the most"
        hint = "give its parts names, as parameters or in 'let'"
        raise ExpressionError("expression-too-long", message, MAX_LENGTH, len(text), hint)
    if date := _DATE.fullmatch(text):
        hint = f"for the difference write {' - '.join(part.lstrip('0') or '0' for part in date[1].split('-'))}"
        raise ExpressionError("malformed-number", f"'{date[1]}' is a date, no number", *date.span(1), hint)
    _check_habits(text)
    found: list[Token] = []
    at = 0
    while at < len(text):
        if blank := _BLANK.match(text, at):
            at = blank.end()
            continue
        token = _special(text, at, naming, found) or _token(text, at, naming, after=found[-1] if found else None)
        found.append(token)
        at = token.end
    found.append(Token("end", "", len(text), len(text)))
    return tuple(found)


def _check_habits(text: str) -> None:
    """Refuse a text that is a number with thousands apart, or with a unit."""
    whole = len(text) - len(text.lstrip()), len(text.rstrip())
    shown = shorten(text.strip())
    if hint := ungrouped_hint(text):
        message = f"'{shown}' is no number: nothing stands between thousands"
        raise ExpressionError("malformed-number", message, *whole, hint)
    if (unit := unit_of(text)) and (hint := unit_hint(*unit)):
        raise ExpressionError("malformed-number", f"'{shown}' is no number: it has a unit", *whole, hint)


def is_operand(token: Token | None) -> bool:
    """Whether a value ends with this token, so that an operator may follow."""
    return token is not None and (token.kind in ("number", "name") or token.text == ")")


def _special(text: str, at: int, naming: Naming, found: Sequence[Token]) -> Token | None:
    """What only some expressions hold."""
    match naming:
        case "references":
            return _referring(text, at, found)
        case "subscripts":
            return _subscripted(text, at)
        case "ends":
            end = OF_END.match(text, at)
            return None if end is None else Token("name", end.group(), at, end.end())
    return None


def _referring(text: str, at: int, found: Sequence[Token]) -> Token | None:
    """What measures have besides: a reference with points, the state of a rule, one number of a sensor (``arm[0]``),
    the sign in ``last=N``."""
    name = _REFERENCE.match(text, at) or _OF_RULE.match(text, at)
    if name and "." in name.group():
        return Token("name", name.group(), at, name.end())
    if (one := _SUBSCRIPT.match(text, at)) and one[2] is not None:
        return _subscripted(text, at)
    if _KEYWORD.match(text, at) and len(found) > 2 and found[-1].kind == "name" and found[-2].text in ("(", ","):
        return Token("operator", "=", at, at + 1)
    return None


def _subscripted(text: str, at: int) -> Token | None:
    """A name with a number behind it, without blanks between."""
    name = _SUBSCRIPT.match(text, at)
    if name is None or name[1] in WORDS:
        return None
    if name[2] is None:
        message, hint = "behind a name stands a whole number in brackets, from 0 on", f"as in {shorten(name[1])}[0]"
        raise ExpressionError("no-subscripts", message, name.end(1), name.end(1) + 1, hint)
    return Token("name", f"{name[1]}[{int(name[2])}]", at, name.end())


def _token(text: str, at: int, naming: Naming, after: Token | None) -> Token:
    if number := _NUMBER.match(text, at):
        return _number(text, number)
    if name := _NAME.match(text, at):
        kind: Kind = "operator" if name.group() in WORDS else "name"
        return Token(kind, name.group(), at, name.end())
    operator = _OPERATOR.match(text, at)
    foreign = _FOREIGN_OPERATOR.match(text, at)
    if operator and not (foreign and foreign.end() > operator.end()):
        return Token("operator", operator.group(), at, operator.end())
    if foreign:
        message = f"'{foreign.group()}' is no operator here"
        raise ExpressionError("foreign-operator", message, at, foreign.end(), _FOREIGN[foreign.group()])
    raise _no_token(text, at, naming, after)


def _number(text: str, number: re.Match[str]) -> Token:
    start, end = number.span()
    tail = _TAIL.match(text, end)
    if tail:
        written = text[start : tail.end()]
        raise ExpressionError(
            "malformed-number",
            f"'{shorten(written)}' is no number",
            start,
            tail.end(),
            _number_hint(number.group(), tail.group()),
        )
    if _ZEROS.fullmatch(number.group()):
        message = f"'{shorten(number.group())}' is no number: a zero stands in front of it"
        raise ExpressionError("malformed-number", message, start, end, _zeros_hint(text, number))
    if math.isinf(float(number.group())):
        message = f"{shorten(number.group(), 20)} is beyond the range of numbers, which ends near 1.8e308"
        raise ExpressionError("number-overflow", message, start, end)
    return Token("number", number.group(), start, end)


def _zeros_hint(text: str, number: re.Match[str]) -> str | None:
    """What to write instead of such an integer, which may be the end of one with a comma between thousands."""
    hint, before = decimal_hint(number.group()), _THOUSANDS.search(text, 0, number.start())
    if before is not None and len(number.group()) == 3:
        whole = f"{before.group()}{number.group()}"
        return f"if {shorten(whole)} is one number, {ungrouped_hint(whole)}: nothing stands between thousands"
    if number.group() == "000":
        return f"{hint}; a comma before it that sets thousands apart is to be left out"
    return hint


def decimal_hint(text: str) -> str | None:
    """What to write instead of an integer with zeros in front of it; None where a text is none.

    >>> decimal_hint("010"), decimal_hint("10")
    ('numbers are decimal here: write 10', None)
    """
    digits = text.strip().lstrip("+-")
    if not _ZEROS.fullmatch(digits):
        return None
    return f"numbers are decimal here: write {shorten(digits.lstrip('0') or '0')}"


def _number_hint(number: str, tail: str) -> str | None:
    if tail.startswith("_"):
        return ungrouped_hint(number + tail) or "write the digits without underscores"
    if tail in UNITS:
        return unit_hint(number, tail)
    if (digits := ungrouped(number + tail)) is not None:
        return f"write {digits}"
    if number == "0" and re.fullmatch(r"[xXoObB][0-9a-fA-F]+", tail):
        return "numbers are decimal here"
    if re.fullmatch(r"[eE]", tail):
        return f"an exponent needs digits, as in {shorten(number)}e-3"
    if _NAME.fullmatch(tail):
        return f"for a product write {shorten(number)} * {shorten(tail)}"
    return None


def _unit_at(text: str, at: int) -> str:
    match = _UNIT.match(text, at)
    return "" if match is None else match[0]


def _no_token(text: str, at: int, naming: Naming, after: Token | None) -> ExpressionError:
    character = text[at]
    if quoted := _QUOTED.match(text, at):
        message, inside = "an expression holds no texts, only numbers", quoted.group().strip("'\"`“”‘’").strip()
        hint = f"leave the quotes out: write {shorten(inside)}" if _NUMBER.fullmatch(inside) else None
        if not character.isascii():
            message = f"'{character}' is {character_name(character)}: {message}"
        return ExpressionError("no-strings", message, at, quoted.end(), hint)
    if character == ".":
        end = at + 1 + len(name.group() if (name := _NAME.match(text, at + 1)) else "")
        hint = "refer to a value by its name alone"
        if naming == "ends":
            hint = (
                "what is at the ends of a connection is written pre.X and post.X, without blanks; all else has no point"
            )
        return ExpressionError("no-attributes", "there are no attributes in an expression", at, end, hint)
    if character in "[{" and re.search(r"\bfor\b", text[at:]):
        message = "there are no comprehensions in an expression"
        return ExpressionError("no-comprehensions", message, at, len(text), "write the terms one by one")
    if character in "[]" and (is_operand(after) or character == "]"):
        message = "there are no subscripts in an expression"
        hint = "a value that differs from neuron to neuron has one name; it means the one of each"
        return ExpressionError("no-subscripts", message, at, at + 1, hint)
    if character in "[]{}":
        message = "an expression is one number; there are no lists, sets and mappings in it"
        return ExpressionError("no-collections", message, at, at + 1, "use ( ) to group" if character in "[]" else None)
    if after is not None and after.kind == "number" and (unit := unit_hint(after.text, _unit_at(text, at))):
        return ExpressionError("malformed-number", f"a unit stands behind {after.text}", at, at + 1, unit)
    shown = f"'{character}'" if character.isprintable() else f"the character {character_name(character)}"
    return ExpressionError("unexpected-character", f"{shown} has no meaning here", at, at + 1, _lookalike(character))


def _lookalike(character: str) -> str | None:
    if character == "π":
        return "write 'pi'"
    if character in _LOOKALIKES:
        return f"write '{_LOOKALIKES[character]}'"
    if character == ";":
        return "nothing ends a value but its line"
    if character.isspace() or unicodedata.category(character) in ("Zs", "Cf"):
        return "an invisible character; leave it out, or put an ordinary blank"
    greek = re.fullmatch(r"GREEK (?:SMALL|CAPITAL) LETTER (?:FINAL )?([A-Z]+)", unicodedata.name(character, ""))
    if greek:
        return f"names have ASCII letters; write '{greek.group(1).lower().replace('lamda', 'lambda')}'"
    plain = unicodedata.normalize("NFKC", character)
    if plain != character and plain.isascii() and plain.isprintable():
        return f"write '{plain}'"
    if character.isalnum():
        return "names have ASCII letters, digits and underscores"
    return None
