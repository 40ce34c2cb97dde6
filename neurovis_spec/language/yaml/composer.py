"""From the parser's events to nodes that know where they stand.

In: a text and a parser over it. Out: the root node of its one document. What the language refuses though YAML allows
it (tags, anchors, aliases, merge keys, duplicate keys, keys that are no texts) becomes a finding, and composing goes
on. One event at a time is held, and nothing deeper than the language allows; long plain lists go into arrays.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final, Protocol

from yaml.events import (
    AliasEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.yaml import marks
from neurovis_spec.language.yaml.cut_texts import FlowCommas, Run
from neurovis_spec.language.yaml.packed import Packer
from neurovis_spec.language.yaml.refusals import DEEPEST, ComposingStoppedError, Refusals
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, Sequence
from neurovis_spec.language.yaml.written_text import Written

_PACK_FROM: Final = 64
_COLON: Final = re.compile(r"[ \t]*:")


class EventSource(Protocol):
    """A parser: the C one or the pure Python one."""

    def get_event(self) -> Event | None:
        """The next event, None past the end. Raises yaml.YAMLError."""


class Composer:
    """Composes one document."""

    def __init__(
        self, text: str, file: str, findings: Findings, parser: EventSource, unread: Collection[int] = ()
    ) -> None:
        self._text = text
        self._file = file
        self._get = parser.get_event
        self._refuse = Refusals(text, file, findings)
        self._anchored: dict[str, Scalar] = {}
        #: where values begin that could not be read
        self._unread = unread
        #: Line and column of each bracket that is open right now, outermost first: for wording a syntax error.
        self.open_brackets: list[tuple[int, int]] = []

    def document(self) -> Node | None:
        """The root; None where there is no document. Raises yaml.YAMLError and ComposingStoppedError."""
        self._next()  # the stream's start
        if isinstance(self._next(), StreamEndEvent):
            return None
        root = self._node(self._next(), 1)
        self._next()  # the document's end
        after = self._next()
        if isinstance(after, DocumentStartEvent):
            self._refuse.second_document(after)
        return root

    def _next(self) -> Event:
        event = self._get()
        if event is None:  # past the stream's end, which no caller goes beyond
            raise ComposingStoppedError
        return event

    def _node(self, event: Event, depth: int) -> Node:
        if isinstance(event, ScalarEvent):
            return self._scalar(event)
        if isinstance(event, AliasEvent):
            # Only a scalar's value is taken over: copies of collections are how a small file becomes a huge one.
            known = self._anchored.get(str(event.anchor))
            return Scalar(None if known is None else known.value, self._refuse.alias(event), None)
        if depth > DEEPEST:
            self._refuse.too_deep(event)
            raise ComposingStoppedError
        if isinstance(event, SequenceStartEvent):
            return self._sequence(event, depth)
        assert isinstance(event, MappingStartEvent)
        return self._mapping(event, depth)

    # Scalars

    def _scalar(self, event: ScalarEvent) -> Scalar:
        begin, end = marks.begin(event), marks.end(event)
        if event.anchor is None and event.tag is None:
            index, line, column = begin.index, begin.line + 1, begin.column + 1
        else:
            index, line, column = self._refuse.properties(event)
        if event.style in ("|", ">"):
            scalar = self._block_scalar(event, index, line, column)
        else:
            span = Span(self._file, line, column, end.line + 1, end.column + 1)
            if self._unread and index in self._unread:
                scalar = Scalar(True, span, None)  # fits hardly anywhere
            elif event.style in ("'", '"'):
                scalar = self._quoted(event.value, span, index, end.index)
            else:
                scalar = self._plain(event.value, span, index, end.index)
        if event.anchor is not None:
            self._anchored[event.anchor] = scalar
        return scalar

    def _plain(self, text: str, span: Span, begin: int, end: int) -> Scalar:
        written = None if span.line == span.end_line else Written(self._text, begin, end)
        inner = 0 if written is None else None
        try:
            return Scalar(resolve(text), span, inner, written)
        except NumberRangeError as error:
            self._refuse.number(error, span)
            return Scalar(error.nearest, span, inner)

    def _quoted(self, text: str, span: Span, begin: int, end: int) -> Scalar:
        # Escapes are longer than what they stand for: equal lengths mean that there are none.
        if span.line == span.end_line and end - begin - 2 == len(text):
            return Scalar(text, span, 1)
        return Scalar(self._refuse.escaped_controls(text, span), span, None, Written(self._text, begin, end))

    def _block_scalar(self, event: ScalarEvent, index: int, line: int, column: int) -> Scalar:
        # Parsers differ in how much of the blank lines behind it belongs to a block scalar: none, we say.
        whole = self._text[index : marks.end(event).index].rstrip()
        lines = whole.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        end_column = len(lines[-1]) + (column if len(lines) == 1 else 1)
        span = Span(self._file, line, column, line + len(lines) - 1, end_column)
        return Scalar(event.value, span, None, Written(self._text, index, index + len(whole)))

    # Collections

    def _begin(self, start: CollectionStartEvent) -> tuple[int, int]:
        """Line and column at which a collection begins, behind its tag and anchor."""
        begin = marks.begin(start).line + 1, marks.begin(start).column + 1
        if start.anchor is not None or start.tag is not None:
            begin = self._refuse.properties(start)[1:]
        if start.flow_style:
            self.open_brackets.append(begin)
        return begin

    def _end(self, start: CollectionStartEvent, begin: tuple[int, int], end: Event, last: tuple[int, int]) -> Span:
        """The place of a collection: a flow one ends behind its bracket, a block one with its last part."""
        if start.flow_style:
            self.open_brackets.pop()
            return Span(self._file, *begin, marks.end(end).line + 1, marks.end(end).column + 1)
        return Span(self._file, *begin, *max(begin, last))

    def _sequence(
        self,
        start: SequenceStartEvent,
        depth: int,
        items: list[Node] | None = None,
        event: Event | None = None,
    ) -> Node:
        """A list. ``items`` and the ``event`` behind them are given for a row that no packed list would take."""
        begin = self._begin(start)
        items = items or []
        run: Run | None = None
        event = event or self._next()
        while not isinstance(event, SequenceEndEvent):
            if run is None or not run.take(event):
                self._close_run(run, items)
                items.append(self._node(event, depth + 1))
                run = Run.begin(event) if start.flow_style else None
            event = self._next()
            if len(items) == _PACK_FROM + 1 and run is None and (packer := Packer.of(items, self._file)):
                rest = self._pack(packer, event, depth)
                if isinstance(rest, SequenceEndEvent):
                    return packer.finish(self._end(start, begin, rest, packer.end()))
                items = packer.take_back_items()
                if isinstance(rest, Event):
                    event = rest
                else:
                    items.append(rest)
                    event = self._next()
        self._close_run(run, items)
        return Sequence(tuple(items), self._end(start, begin, event, _end_of(items[-1]) if items else begin))

    def _close_run(self, run: Run | None, items: list[Node]) -> None:
        if run is not None and run.joined:
            items[-1] = whole = run.scalar(self._text, self._file)
            self._refuse.cut_text(whole, run.first.value)

    def _pack(self, packer: Packer, event: Event, depth: int) -> Event | Node:
        """Fill a packed list. Returns the list's end, or the event or row that does not fit."""
        while True:
            if not packer.in_rows:
                if not isinstance(event, ScalarEvent) or not packer.add(event):
                    return event
            else:
                if not isinstance(event, SequenceStartEvent) or event.anchor is not None or event.tag is not None:
                    return event
                first = len(packer)
                cell = self._next()
                while isinstance(cell, ScalarEvent) and packer.add(cell):
                    cell = self._next()
                if not isinstance(cell, SequenceEndEvent) or len(packer) == first:
                    return self._sequence(event, depth + 1, packer.take_back(first), cell)
                bracket = marks.end(cell)
                packer.end_row(bracket.line + 1, bracket.column + 1)
            event = self._next()

    def _mapping(self, start: MappingStartEvent, depth: int) -> Mapping:
        begin = self._begin(start)
        entries: dict[str, Entry] = {}
        commas = FlowCommas(self._text, self._file, self._refuse, entries) if start.flow_style else None
        last = begin
        key_event = self._next()
        while not isinstance(key_event, MappingEndEvent):
            key_node = self._node(key_event, depth + 1)
            value_event = self._next()
            if commas is None or not commas.cut(key_event, key_node, value_event):
                key = self._key(key_event, key_node)
                value = self._node(value_event, depth + 1)
                if isinstance(value, Scalar):
                    if commas is not None:
                        value = self._behind_colon(key_event, value_event, value)
                    elif value.span.line > key_node.span.end_line:
                        value = self._behind_lone_key(key_node, value_event, value)
                last = _end_of(value)
                name = None if key is None else str(key.value)
                if key is not None and name is not None:
                    if name in entries:
                        self._refuse.duplicate(key, entries[name])
                        name = None
                    else:
                        entries[name] = Entry(key, value)
                if commas is not None:
                    commas.begin(name, value_event, value)
            key_event = self._next()
        if commas is not None:
            commas.close()
        span = self._end(start, begin, key_event, last)
        if not entries and last != begin:  # whatever was there has been refused
            self._refuse.nothing_left(span)
        return Mapping(tuple(entries.values()), span)

    def _behind_colon(self, key_event: Event, value_event: Event, value: Scalar) -> Scalar:
        """A value that is not there stands behind its colon; parsers differ about that."""
        key_end, mark = marks.end(key_event), marks.begin(value_event)
        between = self._text[key_end.index : mark.index] if mark.index == marks.end(value_event).index else ""
        match = _COLON.match(between)
        if match is None:
            return value
        line, column = key_end.line + 1, key_end.column + 1 + match.end()
        return Scalar(value.value, Span(self._file, line, column, line, column), value.inner)

    def _behind_lone_key(self, key: Node, value_event: Event, value: Scalar) -> Scalar:
        """A value that is not there, behind a ``? key`` without a colon, stands behind its key: where the parser says
        that it is may be past the end of the text."""
        end = marks.end(value_event).index
        if marks.begin(value_event).index < end or self._text[end - 1 : end] == ":":
            return value
        line, column = _end_of(key)
        return Scalar(value.value, Span(self._file, line, column, line, column), value.inner)

    def _key(self, event: Event, node: Node) -> Scalar | None:
        """The key as a text, refused where it is none; None where the entry has to be dropped."""
        if not isinstance(node, Scalar):
            self._refuse.collection_key(node)
            return None
        if not isinstance(event, ScalarEvent):
            return node if isinstance(node.value, str) else None
        if event.value == "<<" and event.style not in ("'", '"'):
            self._refuse.merge_key(node.span)
            return None
        if isinstance(node.value, str):
            return node
        self._refuse.key_not_text(node, event.value)
        return Scalar(event.value, node.span, node.inner) if event.value else None


def _end_of(node: Node) -> tuple[int, int]:
    return node.span.end_line, node.span.end_column
