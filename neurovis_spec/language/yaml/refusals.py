"""What the language refuses though YAML allows it: the findings and their words.

In: an event invalid. Out: a finding at the very characters. Ends the reading where there are too many to be of use.
"""

from __future__ import annotations

import re
from typing import Final

from yaml.events import AliasEvent, DocumentStartEvent, Event, NodeEvent

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml import marks
from neurovis_spec.language.yaml.characters import FORBIDDEN, REPLACEMENT, Lines, character_name
from neurovis_spec.language.yaml.scalars import NumberRangeError
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, Sequence

DEEPEST: Final = 64
_MOST_FINDINGS: Final = 1000
_PROPERTY: Final = re.compile(r"!<[^>\s]*>|[!&][^\s,\[\]{}]*")
_GAP: Final = re.compile(r"(?:[ \t]+|#[^\r\n]*|\r\n|\n|\r)*")

_USE_NAMES = "a constant used in several places belongs in `parameters`, a part used in several places in `modules`"


class ComposingStoppedError(Exception):
    """A refusal after which it makes no sense to go on; the finding is reported already."""


class Refusals:
    """Notes refusals in one text."""

    def __init__(self, text: str, file: str, findings: Findings) -> None:
        self._text = text
        self._file = file
        self._findings = findings
        self._noted = 0

    def _error(self, code: str, span: Span, message: str, hint: str | None = None) -> None:
        self._findings.error(code, span, message, hint)

    def nothing_left(self, span: Span) -> None:
        """A mapping all of whose keys are refused: that it is empty follows from that."""
        self._findings.unread(span)
        self._noted += 1
        if self._noted >= _MOST_FINDINGS:
            raise ComposingStoppedError

    def _event_span(self, event: Event) -> Span:
        return marks.span(event, event, self._file)

    def properties(self, event: NodeEvent) -> tuple[int, int, int]:
        """Refuse a node's tag and anchor. Returns index, line and column (from 1) at which the node itself begins."""
        first = index = marks.begin(event).index
        line, column = marks.begin(event).line + 1, marks.begin(event).column + 1
        last = marks.end(event)
        while (match := _PROPERTY.match(self._text, index)) and index < max(last.index, first + 1):
            written = match.group()
            span = Span(self._file, line, column, line, column + len(written))
            if written.startswith("!"):
                self._error("tag", span, f"tags such as '{_short(written)}' are not allowed", "leave it out")
            else:
                self._error("anchor", span, f"anchors such as '{_short(written)}' are not allowed", _USE_NAMES)
            gap = _GAP.match(self._text, match.end())
            index = gap.end() if gap else match.end()
            lines, columns = Lines(self._text[first:index]).place(index - first)
            line = marks.begin(event).line + lines
            column = columns + (marks.begin(event).column if lines == 1 else 0)
        if index > last.index:  # a value that is not there does not begin behind the gap
            return last.index, last.line + 1, last.column + 1
        return index, line, column

    def alias(self, event: AliasEvent) -> Span:
        """Refuse an alias; returns its place."""
        span = self._event_span(event)
        self._error("alias", span, f"aliases such as '*{_short(str(event.anchor))}' are not allowed", _USE_NAMES)
        return span

    def second_document(self, event: DocumentStartEvent) -> None:
        """Refuse all that follows the first document."""
        message = "a file holds one document; a second one begins here"
        self._error("several-documents", self._event_span(event), message)

    def too_deep(self, event: Event) -> None:
        """Refuse a collection below the deepest level."""
        begin = marks.begin(event)
        span = Span(self._file, begin.line + 1, begin.column + 1, begin.line + 1, begin.column + 2)
        self._error("too-deep", span, f"lists and mappings are nested more than {DEEPEST} deep")

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
        self._error("key-not-text", key.span, message, "names begin with a letter or an underscore")

    def collection_key(self, key: Node) -> None:
        """Refuse a key that is a mapping or a list."""
        span = key.span
        if span.line != span.end_line:
            span = Span(span.file, span.line, span.column, span.line, span.column + 1)
        kind = "a mapping" if isinstance(key, Mapping) else "a list"
        hint = None
        if isinstance(key, Sequence) and all(isinstance(item, Scalar) for item in key.items):
            names = [str(item.value) for item in key.items if isinstance(item, Scalar)]
            hint = f"several neurons in one key are joined with '+': {_short(' + '.join(names))}" if names else None
        self._error("key-not-text", span, f"a key is a text, not {kind}", hint)

    def cut_text(self, whole: Scalar, first: str) -> None:
        """Refuse a text that commas have cut; ``first`` is what stands before the first of them."""
        message = f"inside brackets a comma ends a text: this is read as '{_short(first)}' and more"
        self._error("flow-comma", whole.span, message, f'put it in quotes: "{_short(str(whole.value))}"')

    def stray_text(self, value: Scalar, key: Scalar) -> None:
        """Refuse a key without a value behind a text: perhaps a comma that was part of the text."""
        begin, end = value.span, key.span
        span = Span(self._file, begin.line, begin.column, end.end_line, end.end_column)
        message = f"inside {{ }} a comma ends a text: '{_short(str(key.value))}' is read as a key without a value"
        hint = f'if the comma is part of the text, put it in quotes: "{_short(f"{value.value}, {key.value}")}"'
        self._error("flow-comma", span, message, hint)

    def decimal_comma(self, value: Scalar, key: Scalar, written: str) -> None:
        """Refuse a number with a decimal comma."""
        begin, end = value.span, key.span
        span = Span(self._file, begin.line, begin.column, end.end_line, end.end_column)
        message = f"a comma separates entries: '{_short(written)}' is not one number"
        self._error("flow-comma", span, message, f"numbers have a decimal point: {_short(written.replace(',', '.'))}")


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:58] + "…"
