"""Syntax errors in an author's words: what is wrong, and what to change.

In: nothing, or the characters that were met. Out: Words.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple


class Words(NamedTuple):
    """A message and, where there is something to do, a hint."""

    message: str
    hint: str | None = None


CODE: Final = "yaml-syntax"
#: How comments begin elsewhere.
COMMENTS: Final = ("//", "-- ", "/*", ";", "%")
_NAMES: Final = r"[A-Za-z_][\w.]*(?: *(?:->|\+) *[A-Za-z_][\w.]*)*"
#: A key and its value with no more than blanks between them; a longer text may be anything.
_ENTRY: Final = re.compile(rf"({_NAMES})[ \t]+((?:[^\s\[{{'\"+>-]|[-+](?=[\w.]))\S*|[\[{{'\"].*)", re.ASCII | re.DOTALL)
TAB: Final = Words("a tab in the indentation", "indent with blanks: YAML allows no tabs there")
TAB_BEFORE: Final = Words("a tab where a value begins", "use blanks")
NO_KEY: Final = Words("there is no key before ':'")
NO_BLANK: Final = Words("a blank is missing after ':'")
NO_START: Final = Words("a line '---' is missing behind the directive")
SECOND_COLON: Final = Words(
    "a second ':' in one line",
    "keys below a key stand in braces, A: {bias: 1}, or on lines of their own; a text with ': ' in it needs quotes",
)
LONG_KEY: Final = Words("a key is longer than 1,000 characters")
KEY_OF_LINES: Final = Words("a key of several lines needs '? ' before it")
LATE_KEY: Final = Words(
    "a key cannot stand here: the line above has a value already",
    "is this line indented too far, or the text above without quotes?",
)
ITEM_IN_MAPPING: Final = Words("a list item where a 'key: value' is wanted")
LATE_ITEM: Final = Words("a list item cannot stand here", "begin the list on a line of its own")
KEY_IN_LIST: Final = Words("this line does not fit the lines above", "an item of a list begins with '- '")
COMMENT: Final = Words("this is no comment", "a comment begins with '#'")
BEHIND_VALUE: Final = Words("unexpected text behind a value that is complete")
NOWHERE: Final = Words("this belongs to nothing above it")


def start(character: str) -> Words:
    """A character that begins no text."""
    if character == ":":
        return NO_KEY
    if character in "]}":
        return Words(f"'{character}' closes nothing")
    if character in ",?-":
        return Words("a value is wanted here", f"a text that begins with '{character}' needs quotes")
    return TAB_BEFORE if character == "\t" else Words(f"a text cannot begin with '{character}'", "put it in quotes")


def quote(character: str) -> Words:
    """A text in quotes that never ends."""
    return Words(f"the text that begins here with {character} has no closing {character}")


def escape(written: str) -> Words:
    """An escape that YAML does not know."""
    hint = "a backslash is written twice in double quotes, once in single ones"
    return Words(f"'{written}' begins no escape that could be read", hint)


def block_header(sign: str) -> Words:
    """Something other than a number and a sign behind | or >."""
    return Words(f"the text behind '{sign}' begins on the next line", f"a text that begins with '{sign}' needs quotes")


def wrong_bracket(character: str, opening: str, closing: str) -> Words:
    """A bracket that closes another than the last that was opened."""
    return Words(f"'{character}' closes what '{opening}' opened: '{closing}' is wanted")


def unclosed(opening: str, closing: str, line: int | None) -> Words:
    """A bracket that is not closed before a line; None where there is nothing more."""
    return Words(f"'{opening}' is not closed", f"a '{closing}' is missing" + (f" before line {line}" if line else ""))


def no_comma(closing: str) -> Words:
    """Two items in brackets with nothing between them."""
    hint = "a text with ': ', ',', brackets or quotes in it needs quotes"
    return Words(f"',' or '{closing}' is missing before this", hint)


def no_colon(written: str) -> Words:
    """Something that should be 'key: value', and has no colon."""
    if written.startswith(COMMENTS):
        return COMMENT
    entry = _ENTRY.fullmatch(written)
    if entry is None:
        return Words(f"':' is missing after '{_short(written)}'", "an entry is written 'key: value'")
    key, value = entry.groups()
    return Words(f"':' is missing after '{_short(key)}'", f"write {_short(f'{key}: {value}')}")


def bracket_in_key(written: str) -> Words:
    """A bracket in the place of a reference, or at the end of one."""
    if written.rstrip().endswith(("->", "+")):
        return Words("no bracket stands in a reference", "several references are joined with '+', as in A -> B + C")
    hint = f"a neuron of '{_short(written)}' has its number behind it, as in {_short(written)}1; several are a range"
    return Words("no bracket stands in a reference", hint)


def settings_apart(name: str) -> Words:
    """A value in brackets behind another one, that may be a name with its settings."""
    message = f"'{_short(name)}' is complete; ',' or a closing bracket is missing before this"
    return Words(message, f"a name with settings is written {{{_short(name)}: {{…}}}}")


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:38] + "…"


def indentation(columns: set[int]) -> Words:
    """A line that is indented further than those it could belong to, which begin in ``columns``."""
    hint = "begin it in column " + " or ".join(map(str, sorted(columns)))
    return Words("this line's indentation fits none of the lines above", hint)
