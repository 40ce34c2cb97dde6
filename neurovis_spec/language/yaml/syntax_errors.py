"""Syntax errors in an author's words.

In: what the YAML scanner or parser says. Out: a code, the invalid place (which often is not where the parser gave up)
and a sentence that says what to change. Both parsers, C and Python, are understood.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from yaml.error import MarkedYAMLError

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.characters import Lines

CODE = "yaml-syntax"
_TIGHT_COLON = re.compile(r"[A-Za-z_][\w.]*:(?=\S)")


class Syntax(NamedTuple):
    """A syntax error, worded; line and column count from 1."""

    message: str
    line: int
    column: int
    hint: str | None = None
    code: str = CODE

    def span(self, file: str, lines: Lines) -> Span:
        """One character, or none at the end of the text."""
        count = len(lines.starts)
        line = min(max(self.line, 1), count)
        width = len(lines.line(line))
        column = min(max(self.column, 1), width + 1) if line == self.line else width + 1
        return Span(file, line, column, line, column + 1 if column <= width else column)


def explain(error: Exception, lines: Lines, open_brackets: Sequence[tuple[int, int]]) -> Syntax:
    """Word an error that a parser raised; ``open_brackets`` are the places of those open then, outermost first."""
    if not isinstance(error, MarkedYAMLError) or error.problem_mark is None:
        return Syntax("this is no YAML that could be read", 1, 1)
    found = _Found(error, lines, open_brackets)
    for rule in _RULES:
        syntax = rule(found)
        if syntax is not None:
            return syntax
    return Syntax(_plain_words(found.problem), found.line, found.column)


class _Found:
    """What a parser reported, and the line it stands on."""

    def __init__(self, error: MarkedYAMLError, lines: Lines, open_brackets: Sequence[tuple[int, int]]) -> None:
        mark = error.problem_mark
        assert mark is not None
        self.problem = error.problem or ""
        self.context = error.context or ""
        self.lines = lines
        self.line, self.column = mark.line + 1, mark.column + 1
        context = error.context_mark
        self.context_line = context.line + 1 if context else self.line
        self.context_column = context.column + 1 if context else self.column
        self.text = lines.line(self.line)
        self.open_brackets = open_brackets

    @property
    def at_end(self) -> bool:
        """Whether nothing but blanks and comments comes after the place."""
        rest = self.lines.text[self.lines.starts[min(self.line, len(self.lines.starts)) - 1] :][self.column - 1 :]
        return re.fullmatch(r"(\s|#[^\r\n]*)*", rest[:10_000]) is not None and len(rest) <= 10_000

    @property
    def character(self) -> str:
        """The character at the place, empty at a line's end."""
        return self.text[self.column - 1 : self.column]


def _tab(found: _Found) -> Syntax | None:
    for number in (found.line, found.context_line):
        line = found.lines.line(number)
        indentation = line[: len(line) - len(line.lstrip())]
        tab = indentation.find("\t")
        if tab >= 0:
            return Syntax("a tab in the indentation", number, tab + 1, "indent with blanks: YAML allows no tabs there")
    return None


def _directive(found: _Found) -> Syntax | None:
    if "directive" in found.context or "directive" in found.problem or "%YAML" in found.problem:
        return Syntax("directives are not allowed", found.line, 1, "remove the line that begins with '%'", "directive")
    return None


def _tag(found: _Found) -> Syntax | None:
    if "tag" in found.context or "tag handle" in found.problem:
        place = found.context_line, found.context_column
        return Syntax("tags ('!…') are not allowed", *place, "a text that begins with '!' needs quotes", "tag")
    return None


def _anchor(found: _Found) -> Syntax | None:
    for word, sign in (("alias", "*"), ("anchor", "&")):
        if f"an {word}" in found.context:
            message = f"a text cannot begin with '{sign}'"
            return Syntax(message, found.context_line, found.context_column, "put it in quotes")
    return None


def _quote(found: _Found) -> Syntax | None:
    if "quoted scalar" not in found.context:
        return None
    if "end of stream" in found.problem or "document separator" in found.problem:
        quote = found.lines.line(found.context_line)[found.context_column - 1 : found.context_column]
        message = f"the text that begins here with {quote} has no closing {quote}"
        return Syntax(message, found.context_line, found.context_column)
    column = found.text.rfind("\\", 0, found.column) + 1 or found.column
    written = found.text[column - 1 : column + 1]
    hint = "a backslash is written twice in double quotes, once in single ones"
    return Syntax(f"'{written}' begins no escape that could be read", found.line, column, hint)


def _unclosed(found: _Found) -> Syntax | None:
    """A bracket that is not closed, or a comma that is missing inside one."""
    kind = "sequence" if "flow sequence" in found.context else "mapping" if "flow mapping" in found.context else None
    if kind is None:
        return None
    opening, closing = ("[", "]") if kind == "sequence" else ("{", "}")
    opener = found.lines.line(found.context_line)
    outside = _indent(found.text) <= _indent(opener) and found.line > found.context_line
    if found.character and found.character in "]}" and not (outside and found.character == closing):
        return Syntax(
            f"'{found.character}' closes what '{opening}' opened: '{closing}' is wanted", found.line, found.column
        )
    if outside or found.at_end:
        hint = f"a '{closing}' is missing" + ("" if found.at_end else f" before line {found.line}")
        return Syntax(f"'{opening}' is not closed", found.context_line, found.context_column, hint)
    message = f"',' or '{closing}' is missing before this"
    return Syntax(message, found.line, found.column, "a text with ': ', ',', brackets or quotes in it needs quotes")


def _missing_colon(found: _Found) -> Syntax | None:
    if "could not find expected ':'" not in found.problem:
        return None
    return _no_colon(found.lines.line(found.context_line), found.context_line, found.context_column)


def _no_node(found: _Found) -> Syntax | None:
    if "node content" not in found.problem:
        return None
    if found.character == ":":
        return Syntax("there is no key before ':'", found.line, found.column)
    if found.at_end and found.open_brackets:
        line, column = found.open_brackets[-1]
        return Syntax(f"'{found.lines.line(line)[column - 1]}' is not closed", line, column)
    return None


def _no_colon(line: str, number: int, column: int) -> Syntax:
    """A line that should hold 'key: value' from a column on, and does not."""
    written = line[column - 1 :].rstrip()
    if len(written) > 1000:
        return Syntax("a key is longer than 1,000 characters", number, column)
    tight = _TIGHT_COLON.match(written)
    if tight:
        return Syntax("a blank is missing after ':'", number, column + tight.end() - 1)
    shown = written if len(written) <= 40 else written[:38] + "…"
    return Syntax(f"':' is missing after '{shown}'", number, column, "an entry is written 'key: value'")


def _second_colon(found: _Found) -> Syntax | None:
    if "mapping values are not allowed" not in found.problem:
        return None
    if ": " in found.text[: found.column - 1]:
        return Syntax("a second ':' in one line", found.line, found.column, "a text with ': ' in it needs quotes")
    if found.column > 1000:
        return Syntax("a key is longer than 1,000 characters", found.line, _indent(found.text) + 1)
    here = _indent(found.text)
    number = found.line - 1
    while number > 1 and not found.lines.line(number).strip():
        number -= 1
    above = found.lines.line(number)
    if number >= 1 and not re.search(r":(\s|$)", above) and _indent(above) >= here:
        return _no_colon(above, number, _indent(above) + 1)
    message = "a key cannot stand here: the line above has a value already"
    return Syntax(message, found.line, here + 1, "is this line indented too far, or the text above without quotes?")


def _start_character(found: _Found) -> Syntax | None:
    if "cannot start any token" not in found.problem or not found.character:
        return None
    if found.character == "\t":
        return Syntax("a tab where a value begins", found.line, found.column, "use blanks")
    return Syntax(f"a text cannot begin with '{found.character}'", found.line, found.column, "put it in quotes")


def _block(found: _Found) -> Syntax | None:
    """Something at the wrong depth, or behind a value that is complete."""
    if not re.search("block (mapping|collection|sequence)", found.context):
        return None
    if found.character in ("]", "}"):
        return Syntax(f"'{found.character}' closes nothing", found.line, found.column)
    if found.column > _indent(found.text) + 1:
        return Syntax("unexpected text behind a value that is complete", found.line, found.column)
    if found.text.lstrip().startswith("- ") and "mapping" in found.context:
        return Syntax("a list item where a 'key: value' is wanted", found.line, found.column)
    if found.character == ":":
        return Syntax("there is no key before ':'", found.line, found.column)
    if found.column == found.context_column:
        return Syntax("this line does not fit the lines above", found.line, found.column, "an entry is 'key: value'")
    above = found.line - 1
    while above > found.context_line and not found.lines.line(above).strip():
        above -= 1
    columns = sorted({found.context_column, _indent(found.lines.line(above)) + 1})
    hint = "begin it in column " + " or ".join(str(column) for column in columns)
    return Syntax("this line's indentation fits none of the lines above", found.line, found.column, hint)


def _stray_bracket(found: _Found) -> Syntax | None:
    if found.character in ("]", "}"):
        return Syntax(f"'{found.character}' closes nothing", found.line, found.column)
    return None


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _plain_words(problem: str) -> str:
    """A parser's own words where no rule fits, for the commonest of them better ones."""
    for phrase, words in _PHRASES.items():
        if phrase in problem:
            return words
    words = re.sub(r",? but (got|found) .*", "", problem.replace("did not find expected", "expected"))
    return words or "this is no YAML"


_PHRASES = {
    "document start": "this belongs to nothing above it",
    "node content": "a value is wanted here",
    "comment or": "only a comment may follow here",
    "block sequence entries": "a list item cannot stand here",
    "unexpected ':'": "a blank is missing after ':'",
    "block entry": "a list item cannot stand here",
}
_RULES = (
    _tab,
    _directive,
    _quote,
    _tag,
    _anchor,
    _missing_colon,
    _second_colon,
    _start_character,
    _no_node,
    _unclosed,
    _block,
    _stray_bracket,
)
