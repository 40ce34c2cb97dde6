"""From a text to the tree that formatting works on.

In: a text that the reader has accepted, with LF line ends and one at its end, and a parser's events over it. Out: a
Document. The events say what there is and where each scalar and bracket stands; what stands between them is read from
the text itself, so that no comment is lost. Linear in the text; as deep as the language allows.
"""

from __future__ import annotations

import re
from typing import Final

from yaml.events import (
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from neurovis_spec.language.format.between import NONE, Gap, joined, read_gap
from neurovis_spec.language.format.blocks import read_block, read_lines
from neurovis_spec.language.format.tree import (
    Dash,
    Document,
    Entry,
    Flow,
    Item,
    Lines,
    Listing,
    Mapping,
    Node,
    Row,
)
from neurovis_spec.language.yaml import marks
from neurovis_spec.language.yaml.composer import EventSource

_SKIP: Final = re.compile(r"(?:[ \t\n]+|#[^\n]*)*")
#: Inside brackets these can be texts, where no blank is behind them.
INDICATORS: Final = frozenset("-?:")
_COMMENT: Final = re.compile(r"#[^\n]*")

#: A node with the index of its first character and that behind its last.
_Placed = tuple[Node, int, int]


class TreeReader:
    """Reads one text; ``events`` gathers what YAML makes of it."""

    def __init__(self, text: str, parser: EventSource) -> None:
        self._text = text
        self._get = parser.get_event
        self._at = 0
        self.events: list[object] = []

    def document(self) -> Document:
        """The whole text."""
        self._next()
        start = self._next()
        prologue: Gap | None = None
        if isinstance(start, DocumentStartEvent) and start.explicit:
            self._at = marks.end(start).index
            prologue = read_gap(self._text, 0, self._at - 3, prologue=True)
        root = self._next()
        if isinstance(root, MappingStartEvent) and not root.flow_style:
            gap, node = NONE, self._block(root)
        else:
            gap, node = self._value(root, 0)
        end = read_gap(self._text, self._at, len(self._text))
        self._next()
        self._next()  # the document's end and the stream's
        return Document(prologue, gap, node, end)

    def _next(self) -> Event:
        event = self._get()
        assert event is not None
        self.events.append(signature(event))
        return event

    def _gap(self) -> Gap:
        """The gap up to the next token or indicator, which is passed."""
        match = _SKIP.match(self._text, self._at)
        assert match is not None
        start, self._at = self._at, match.end()
        return read_gap(self._text, start, self._at)

    def _sign(self, sign: str) -> bool:
        """Pass an indicator if it stands here, with a blank behind it."""
        found = self._text.startswith(sign, self._at) and self._text[self._at + 1] in " \t\n"
        self._at += found
        return found

    def _column(self) -> int:
        return self._at - self._text.rfind("\n", 0, self._at) - 1

    # Blocks

    def _block(self, start: Event) -> Node:
        return self._mapping() if isinstance(start, MappingStartEvent) else self._listing()

    def _value(self, event: Event, column: int) -> tuple[Gap, Node]:
        """A value in a block collection that stands in ``column``, and the gap before it."""
        if isinstance(event, ScalarEvent):
            start, stop = marks.begin(event).index, marks.end(event).index
            if start == stop:
                return NONE, ""
            gap = self._gap()
            return gap, self._scalar(event, column)
        assert isinstance(event, MappingStartEvent | SequenceStartEvent)
        if not event.flow_style:
            return NONE, self._block(event)
        gap = self._gap()
        node, _, self._at = self._flow(event)
        return gap, node

    def _scalar(self, event: ScalarEvent, column: int) -> Node:
        start, stop = marks.begin(event).index, marks.end(event).index
        if event.style in ("|", ">"):
            node, self._at = read_block(self._text, start, stop, column)
            return node
        self._at = stop
        return _written(self._text, start, stop)

    def _mapping(self) -> Mapping:
        entries: list[Entry] = []
        column = 0
        while not isinstance(event := self._next(), MappingEndEvent):
            assert isinstance(event, ScalarEvent)
            gap = self._gap()
            if not entries:
                column = self._column()
            if marks.begin(event).index > self._at and self._sign("?"):
                gap = joined(gap, self._gap())
            key = self._scalar(event, column)
            assert isinstance(key, str | Lines) or event.style in ("|", ">")
            behind_key = self._at
            before_colon = self._gap()
            if self._sign(":"):
                gap = joined(gap, before_colon)
            else:  # a key behind ? without a value: what follows belongs to the next
                self._at = behind_key
            inner, value = self._value(self._next(), column)
            assert not isinstance(key, Row | Flow | Mapping | Listing)
            entries.append(Entry(gap, key, inner, value))
        return Mapping(column, tuple(entries))

    def _listing(self) -> Listing:
        items: list[Dash] = []
        column = 0
        while not isinstance(event := self._next(), SequenceEndEvent):
            gap = self._gap()
            if not items:
                column = self._column()
            self._sign("-")
            items.append(Dash(gap, *self._value(event, column)))
        return Listing(column, tuple(items))

    # Flow collections: their gaps are read when all is known, since most hold no line break

    def _flow(self, start: Event) -> _Placed:
        return self._flow_list(start) if isinstance(start, SequenceStartEvent) else self._flow_mapping(start)

    def _flow_node(self, event: Event) -> _Placed:
        if not isinstance(event, ScalarEvent):
            return self._flow(event)
        start, stop = marks.begin(event).index, marks.end(event).index
        return _written(self._text, start, stop), start, stop

    def _flow_list(self, start: Event) -> _Placed:
        nodes: list[_Placed] = []
        while not isinstance(event := self._next(), SequenceEndEvent):
            nodes.append(self._flow_node(event))
        begin, stop = marks.begin(start).index, marks.end(event).index
        if self._text.find("\n", begin, stop) < 0:
            cells = tuple(node for node, _, _ in nodes if isinstance(node, str))
            if len(cells) == len(nodes):
                return Row(cells), begin, stop
            return Flow(("[", "]"), tuple(Item(NONE, None, False, node) for node, _, _ in nodes), NONE), begin, stop
        items: list[Item] = []
        at = begin + 1
        for node, first, last in nodes:
            gap, node = _outside(read_gap(self._text, at, first), node)
            items.append(Item(gap, None, False, node))
            at = last
        end = read_gap(self._text, at, stop - 1)
        cells = tuple(item.value for item in items if isinstance(item.value, str) and not item.gap.broken)
        if len(cells) == len(items) and not end.comments:
            return Row(cells), begin, stop
        return Flow(("[", "]"), tuple(items), end), begin, stop

    def _flow_mapping(self, start: Event) -> _Placed:
        begin = marks.begin(start).index
        braces = self._text[begin] == "{"
        items: list[Item] = []
        at = begin + braces
        while not isinstance(event := self._next(), MappingEndEvent):
            key, key_start, key_stop = self._flow_node(event)
            assert isinstance(key, str | Lines)
            gap = read_gap(self._text, at, key_start)
            gap = gap if braces else joined(NONE, gap)
            value_event = self._next()
            value, value_start, at = self._flow_node(value_event)
            if value:
                gap = joined(gap, read_gap(self._text, key_stop, value_start))
                colon = True
            else:
                colon = ":" in _COMMENT.sub("", self._text[key_stop:value_start])
                at = key_stop
            items.append(Item(gap, key, colon, value, not (colon or braces)))
        if not braces:
            return Flow(("", ""), tuple(items), NONE), begin, at
        stop = marks.end(event).index
        return Flow(("{", "}"), tuple(items), read_gap(self._text, at, stop - 1)), begin, stop


def _outside(gap: Gap, node: Node) -> tuple[Gap, Node]:
    """Move comments inside a pair without brackets, ``[a: 1]``, before it."""
    if isinstance(node, Flow) and node.brackets == ("", "") and (inner := node.items[0].gap).comments:
        return joined(gap, inner), node._replace(items=(node.items[0]._replace(gap=NONE),))
    return gap, node


def _written(text: str, start: int, stop: int) -> str | Lines:
    written = text[start:stop]
    if written in INDICATORS:
        return f"'{written}'"
    return read_lines(written) if "\n" in written else written


def signature(event: Event) -> object:
    """What an event says, its place left out: equal ones make equal values."""
    if isinstance(event, ScalarEvent):
        return (event.value, event.implicit[0])
    return type(event)
