"""Syntax errors in an author's words.

In: a place at which a text cannot go on, and what was being read there. Out: a sentence that says what to change, and
the place that has to change, which often is not where reading ended.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.characters import Lines

CODE: Final = "yaml-syntax"
_QUOTES: Final = "put it in quotes"
_TIGHT_COLON: Final = re.compile(r"[A-Za-z_][\w.]*:(?=\S)")


class Fault(NamedTuple):
    """A syntax error; line and column count from 1."""

    message: str
    line: int
    column: int
    hint: str | None = None
    code: str = CODE

    def span(self, file: str, lines: Lines) -> Span:
        """One character, or none at the end of a line."""
        width = len(lines.line(self.line))
        column = min(self.column, width + 1)
        return Span(file, self.line, column, self.line, column + (column <= width))


def start(character: str, line: int, column: int) -> Fault:
    """A character that begins no text."""
    if character == "\t":
        return Fault("a tab where a value begins", line, column, "use blanks")
    if character == ":":
        return Fault("there is no key before ':'", line, column)
    if character in "]}":
        return Fault(f"'{character}' closes nothing", line, column)
    if character in ",?-":
        return Fault("a value is wanted here", line, column, f"a text that is '{character}' alone needs quotes")
    return Fault(f"a text cannot begin with '{character}'", line, column, _QUOTES)


def tab(line: int, column: int) -> Fault:
    """A tab among the blanks that begin a line."""
    return Fault("a tab in the indentation", line, column, "indent with blanks: YAML allows no tabs there")


def quote(character: str, line: int, column: int) -> Fault:
    """A text in quotes that never ends."""
    return Fault(f"the text that begins here with {character} has no closing {character}", line, column)


def escape(written: str, line: int, column: int) -> Fault:
    """An escape that stands for nothing."""
    hint = "a backslash is written twice in double quotes, once in single ones"
    return Fault(f"'{written}' begins no escape that could be read", line, column, hint)


def wrong_bracket(character: str, opening: str, line: int, column: int) -> Fault:
    """A bracket that closes another than the last that was opened."""
    closing = "]" if opening == "[" else "}"
    return Fault(f"'{character}' closes what '{opening}' opened: '{closing}' is wanted", line, column)


def unclosed(opening: str, line: int, column: int, before: int | None) -> Fault:
    """A bracket that is not closed before a line; None where there is nothing more."""
    closing = "]" if opening == "[" else "}"
    hint = f"a '{closing}' is missing" + ("" if before is None else f" before line {before}")
    return Fault(f"'{opening}' is not closed", line, column, hint)


def no_comma(opening: str, line: int, column: int) -> Fault:
    """Two items of a list, or of a mapping in braces, with nothing between them."""
    closing = "]" if opening == "[" else "}"
    hint = "a text with ': ', ',', brackets or quotes in it needs quotes"
    return Fault(f"',' or '{closing}' is missing before this", line, column, hint)


def no_blank(line: int, column: int) -> Fault:
    """A colon right before a value."""
    return Fault("a blank is missing after ':'", line, column)


def no_colon(written: str, line: int, column: int) -> Fault:
    """A line that should hold 'key: value' from a column on, and does not."""
    written = written.rstrip()
    tight = _TIGHT_COLON.match(written)
    if tight:
        return no_blank(line, column + tight.end() - 1)
    shown = written if len(written) <= 40 else written[:38] + "…"
    return Fault(f"':' is missing after '{shown}'", line, column, "an entry is written 'key: value'")


def long_key(line: int, column: int) -> Fault:
    """A key that YAML takes for none."""
    return Fault("a key is longer than 1,000 characters", line, column)


def second_colon(line: int, column: int) -> Fault:
    """A colon behind a value on the same line."""
    return Fault("a second ':' in one line", line, column, "a text with ': ' in it needs quotes")


def late_key(line: int, column: int) -> Fault:
    """A key below a value that is complete."""
    hint = "is this line indented too far, or the text above without quotes?"
    return Fault("a key cannot stand here: the line above has a value already", line, column, hint)


def indentation(line: int, column: int, columns: set[int]) -> Fault:
    """A line that begins deeper than those it could belong to, which begin in ``columns``."""
    hint = "begin it in column " + " or ".join(map(str, sorted(columns - {column})))
    return Fault("this line's indentation fits none of the lines above", line, column, hint)


def item_in_mapping(line: int, column: int) -> Fault:
    """A dash among keys."""
    return Fault("a list item where a 'key: value' is wanted", line, column)


def key_in_list(line: int, column: int) -> Fault:
    """A key among dashes."""
    return Fault("this line does not fit the lines above", line, column, "an item of a list begins with '- '")


def behind_value(character: str, line: int, column: int) -> Fault:
    """Something behind a value that is complete."""
    if character in "]}":
        return Fault(f"'{character}' closes nothing", line, column)
    return Fault("unexpected text behind a value that is complete", line, column)


def no_start(line: int, column: int) -> Fault:
    """Something other than --- behind a directive."""
    return Fault("a line '---' is missing behind the directive", line, column)


def belongs_nowhere(line: int, column: int) -> Fault:
    """Something behind the whole document."""
    return Fault("this belongs to nothing above it", line, column)


def long_text_as_key(line: int, column: int) -> Fault:
    """A key over several lines."""
    return Fault("a key of several lines needs '? ' before it", line, column)


def block_header(sign: str, line: int, column: int) -> Fault:
    """Something other than a number and a sign behind | or >."""
    return Fault(
        f"the text behind '{sign}' begins on the next line",
        line,
        column,
        f"a text that begins with '{sign}' needs quotes",
    )
