"""What the language refuses though YAML allows it: the findings and their words; texts that are too crowded to be read.

In: what is refused, and where it stands. Out: findings at the very characters. Ends the reading where there are too
many to be of use. Of a crowded text (a mapping with more entries than a spec may have, a list of as many mappings),
where the first entry stands that is one too many, before a node is made of any of them. Lines are looked at by how they
begin alone, so this takes a part of the time that reading takes, and no memory; what stands within brackets the parser
counts itself.
"""

from __future__ import annotations

import re
from typing import Final

from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.expressions.habits import ungrouped_hint
from neurovis_spec.language.yaml.characters import FORBIDDEN, REPLACEMENT, character_name
from neurovis_spec.language.yaml.faults import CODE, Words
from neurovis_spec.language.yaml.scalars import NumberRangeError
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, Sequence

#: the most entries of a mapping, and mappings of a list: as many as there may be neurons, each a group by itself
MOST_ENTRIES: Final = 1_000_000
#: an entry has a name of a character, a colon and an end of the line at least
_SHORTEST = 3
#: the begin of a line that holds something: an item of a list (and whether a mapping), or a key with its colon
_KEY = r"(?![\[\]{}#\s])[^\n]*?:(?=[ \r\n])"
_BEGIN = re.compile(rf"^( *)(?:(-)(?=[ \r\n])((?: *\r?\n)? +(?:\{{|{_KEY}))?|{_KEY})", re.MULTILINE)

DEEPEST: Final = 64
_MOST_FINDINGS: Final = 1000
_USE_NAMES = "a constant used in several places belongs in `parameters`, a part used in several places in `modules`"
TOO_MANY: Final = f"a mapping has at most {MOST_ENTRIES:,} entries; this is one more"
TOO_LONG: Final = f"a list has at most {MOST_ENTRIES:,} mappings; this is one more"
ONE_GROUP: Final = "neurons that are alike are one group: K: {count: 1000}"
TABLE: Final = "very many connections are one entry, with 'edges' from a file"


def crowded(text: str, most: int = MOST_ENTRIES) -> int | None:
    """The offset of the first entry that its mapping is too large for, or mapping (its dash) that its list is; None
    where there is none.

    >>> crowded("a:\\n  b: 1\\n  c: 2\\nd:\\n  e: 3\\n", 2), crowded("a:\\n  b: 1\\n  c: 2\\n  d: 3\\n", 2)
    (None, 19)
    """
    if len(text) <= _SHORTEST * most:
        return None
    #: how many entries there are by now at a depth, outer ones first; a list may stand in the column of its key
    counts: list[tuple[int, int]] = []
    for begin in _BEGIN.finditer(text):
        depth = 2 * (begin.end(1) - begin.start()) + (begin[2] is not None)
        while counts and counts[-1][0] > depth:  # the mappings of another item are others
            counts.pop()
        if begin[2] is not None and begin[3] is None:  # long lists of numbers take little
            continue
        number = counts.pop()[1] + 1 if counts and counts[-1][0] == depth else 1
        if number > most:
            return begin.end(1)
        counts.append((depth, number))
    return None


class ReadingStoppedError(Exception):
    """A refusal after which it makes no sense to go on; the finding is reported already."""


class Refusals:
    """What was found in one text; the last of it may be forgotten again, where it is read once more."""

    def __init__(self) -> None:
        self.found: list[Diagnostic] = []

    def report(self, findings: Findings) -> None:
        """Report all of it."""
        for item in self.found:
            findings.error(item.code, item.span, item.message, item.hint)

    def _error(self, code: str, span: Span, message: str, hint: str | None = None) -> None:
        self.found.append(Diagnostic(code, message, span, "error", hint))
        if len(self.found) >= _MOST_FINDINGS:
            raise ReadingStoppedError

    def syntax(self, words: Words, span: Span) -> None:
        """Report a syntax error."""
        self._error(CODE, span, *words)

    def directive(self, span: Span) -> None:
        """Refuse a directive."""
        self._error("directive", span, "the only directive that is allowed is '%YAML 1.2'", "remove this line")

    def property(self, written: str, span: Span) -> None:
        """Refuse a tag or an anchor."""
        if written.startswith("!"):
            self._error("tag", span, f"tags such as '{_short(written)}' are not allowed", "leave it out")
        else:
            self._error("anchor", span, f"anchors such as '{_short(written)}' are not allowed", _USE_NAMES)

    def alias(self, written: str, span: Span) -> None:
        """Refuse an alias."""
        self._error("alias", span, f"aliases such as '{_short(written)}' are not allowed", _USE_NAMES)

    def second_document(self, span: Span) -> None:
        """Refuse all that follows the first document."""
        self._error("several-documents", span, "a file holds one document; a second one begins here")

    def too_deep(self, span: Span) -> None:
        """Refuse a collection below the deepest level."""
        self._error("too-deep", span, f"lists and mappings are nested more than {DEEPEST} deep")

    def too_many(self, span: Span) -> None:
        """An entry that its mapping is too large for."""
        self._error("too-large", span, TOO_MANY, ONE_GROUP)

    def too_long(self, span: Span) -> None:
        """A mapping that the list around it is too long for."""
        self._error("too-large", span, TOO_LONG, TABLE)

    def number(self, error: NumberRangeError, span: Span) -> None:
        """Refuse a number that cannot be held."""
        self._error(error.code, span, str(error), "in quotes it is a text")

    def escaped_controls(self, text: str, span: Span) -> str:
        """Refuse control characters that an escape made; returns the text without them."""
        match = FORBIDDEN.search(text)
        if match is None:
            return text
        what = character_name(match.group())
        self._error("control-character", span, f"this text holds {what}, written as an escape")
        return FORBIDDEN.sub(REPLACEMENT, text)

    def indentation(self, character: str, span: Span) -> None:
        """Refuse a line that begins with a character that is no blank and not seen."""
        message = f"the line begins with {character_name(character)}, which is no indentation"
        self._error("control-character", span, message, "indent with ordinary blanks")

    def duplicate(self, key: Scalar, first: Entry) -> None:
        """Refuse a key that is there already."""
        here, there = key.span, first.key.span
        message = (
            f"the key '{_short(first.name)}' is there twice: "
            f"first at {there.line}:{there.column}, again at {here.line}:{here.column}"
        )
        hint = "give one of them another name, or remove it"
        if "->" in first.name:
            hint = "connections that share both ends are written as a list of mappings"
        self._error("duplicate-key", here, message, hint)

    def merge_key(self, span: Span) -> None:
        """Refuse ``<<``."""
        self._error("merge-key", span, "merge keys '<<' are not allowed", _USE_NAMES)

    def key_not_text(self, key: Scalar, written: str) -> None:
        """Refuse a key that YAML reads as null, a truth value or a number."""
        if key.value is None and not written:
            self._error("key-not-text", key.span, "there is no key before ':'")
            return
        kind = "null" if key.value is None else "true or false" if isinstance(key.value, bool) else "a number"
        message = f"a key is a text, but YAML reads '{_short(written)}' as {kind}"
        hint = "names begin with a letter or an underscore"
        if key.value is None or isinstance(key.value, bool):
            hint = "take another name, or put it in quotes"
        self._error("key-not-text", key.span, message, hint)

    def collection_key(self, key: Node) -> None:
        """Refuse a key that is a mapping or a list."""
        span = key.span
        if span.line != span.end_line:
            span = Span(span.file, span.line, span.column, span.line, span.column + 1)
        kind = "a mapping" if isinstance(key, Mapping) else "a list"
        hint = None
        items = key.items if isinstance(key, Sequence) else ()
        names = [item.value for item in items if isinstance(item, Scalar) and isinstance(item.value, str)]
        if names and len(names) == len(items):
            hint = f"several neurons in one key are joined with '+': {_short(' + '.join(names))}"
        self._error("key-not-text", span, f"a key is a text, not {kind}", hint)

    def cut_text(self, whole: Scalar, first: str) -> None:
        """Refuse a text that commas have cut; ``first`` is what stands before the first of them."""
        message = f"inside brackets a comma ends a text: this is read as '{_short(first)}' and more"
        self._error("flow-comma", whole.span, message, f'put it in quotes: "{_short(str(whole.value))}"')

    def stray_text(self, value: Scalar, key: Scalar) -> None:
        """Refuse a key without a value behind a text: perhaps a comma that was part of the text."""
        begin, end = value.span, key.span
        span = Span(begin.file, begin.line, begin.column, end.end_line, end.end_column)
        message = f"inside {{ }} a comma ends a text: '{_short(str(key.value))}' is read as a key without a value"
        hint = f'if the comma is part of the text, put it in quotes: "{_short(f"{value.value}, {key.value}")}"'
        self._error("flow-comma", span, message, hint)

    def number_with_commas(self, written: str, span: Span) -> None:
        """Refuse a number with a decimal comma, or with commas between thousands."""
        message = f"a comma separates entries: '{_short(written)}' is not one number"
        decimal = f"numbers have a decimal point: {_short(written.replace(',', '.'))}"
        self._error("flow-comma", span, message, ungrouped_hint(written) or decimal)


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:58] + "…"
