"""Editing a spec as an author would: values are put where keys lead, and every comment stays.

In: the text of a spec and values by their keys. Out: the text, canonically formatted, in which they stand. Stretches of
the text are replaced; where blanks and line breaks belong is the formatter's concern.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from collections.abc import Mapping as Values
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.canonical import format_read, with_line_feeds
from neurovis_spec.language.format.gaps import read_gap
from neurovis_spec.language.format.printer import Source, is_empty
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import AnyList, Entry, Mapping, Node, Scalar

#: The keys that lead to a value.
Path: TypeAlias = tuple[str, ...]
#: A value as it is written: a scalar, or the cells of a list.
Value: TypeAlias = "str | tuple[str, ...]"
#: Values by their keys, and by the keys below these.
_Tree: TypeAlias = "dict[str, _Tree | Value]"

_STEP: Final = 2
#: The comma behind an entry in braces, and comments before it.
_COMMA: Final = re.compile(r"(?:[ \n]|#[^\n]*\n)*,")


class _Edit(NamedTuple):
    """A text in place of the characters from one index to another."""

    start: int
    stop: int
    text: str


def put(text: str, values: Values[Path, Value]) -> str:
    r"""The text of a spec, which the reader has accepted, with these values in place of what stood there. Mappings on
    the way are made where there are none; of those in braces that hold no comment blocks are made.

    >>> print(put("a: 1\nlayout: {b: 2}  # why\n", {("layout", "positions", "O"): ("1", "0.5")}), end="")
    a: 1
    layout:  # why
      b: 2
      positions:
        O: [1, 0.5]
    """
    tree: _Tree = {}
    for path, value in values.items():
        below = tree
        for key in path[:-1]:
            inner = below.setdefault(key, {})
            assert isinstance(inner, dict)
            below = inner
        below[path[-1]] = value
    plain = with_line_feeds(text)
    document = read_text(plain, "", Findings())
    assert document is not None
    edits = sorted(_Editor(Source(plain)).edits(document.root, tree))
    for start, stop, written in reversed(edits):
        plain = plain[:start] + written + plain[stop:]
    return format_read(plain)


def without(text: str, path: Path) -> str:
    r"""The text of a spec, which the reader has accepted, without the entry to which keys lead, and what is said on its
    lines. Raises KeyError where there is none.

    >>> print(without("# all\na:\n  b: 2  # why\n  # of c\n  c: 3\n", ("a", "b")), end="")
    # all
    a:
      # of c
      c: 3
    """
    plain = with_line_feeds(text)
    source, node, entry = _found(plain, path)
    begin, end = source.begin(entry.key), source.end(entry.value)
    if source.is_block(node):
        return format_read(plain[: plain.rfind("\n", 0, begin) + 1] + plain[plain.index("\n", end) + 1 :])
    at = node.entries.index(entry)
    comma = _COMMA.match(plain, end) or (_COMMA.match(plain, source.end(node.entries[at - 1].value)) if at else None)
    cut = sorted([(begin, end), *([] if comma is None else [(comma.end() - 1, comma.end())])])
    for first, last in reversed(cut):
        plain = plain[:first] + plain[last:]
    return format_read(plain)


def recalled(text: str, path: Path, name: str) -> str:
    r"""The text of a spec, which the reader has accepted, with another ``name``, as it is written, in place of the last
    of the keys that lead to an entry. Raises KeyError where there is none.

    >>> print(recalled("a:\n  b: 2  # why\n", ("a", "b"), "c"), end="")
    a:
      c: 2  # why
    """
    plain = with_line_feeds(text)
    source, _, entry = _found(plain, path)
    return format_read(plain[: source.begin(entry.key)] + name + plain[source.end(entry.key) :])


def _found(plain: str, path: Path) -> tuple[Source, Mapping, Entry]:
    """The entry to which keys lead, and the mapping in which it stands."""
    document = read_text(plain, "", Findings())
    assert document is not None
    within = document.root
    for key in path[:-1]:
        node = within.get(key)
        if not isinstance(node, Mapping):
            raise KeyError(key)
        within = node
    entry = within.entry(path[-1])
    if entry is None:
        raise KeyError(path[-1])
    return Source(plain), within, entry


class _Editor:
    def __init__(self, source: Source) -> None:
        self._source = source
        self._text = source.text

    def edits(self, root: Mapping, tree: _Tree) -> Iterator[_Edit]:
        """What is to change in the text."""
        if self._source.is_block(root):
            yield from self._in_block(root, tree)
        else:
            yield from self._in_braces(root, tree)

    def _in_block(self, node: Mapping, tree: _Tree) -> Iterator[_Edit]:
        column = node.span.column - 1
        for name, value in tree.items():
            entry = node.entry(name)
            if entry is not None:
                yield from self._replaced(entry.value, value, column)
        new = {name: value for name, value in tree.items() if node.entry(name) is None}
        if new:
            apart = "\n" if column == 0 and self._has_blank_lines(node) else ""
            yield self._below(self._source.end(node), apart + _block(new, column))

    def _has_blank_lines(self, node: Mapping) -> bool:
        """Whether some entries stand apart from those above them."""
        ends = (self._source.end(entry.value) for entry in node.entries)
        begins = (self._source.begin(entry.key) for entry in node.entries[1:])
        return any(read_gap(self._text, end, begin).blank for end, begin in zip(ends, begins, strict=False))

    def _below(self, at: int, lines: str) -> _Edit:
        """Lines below that of an index."""
        end = self._text.index("\n", at) + 1
        return _Edit(end, end, lines)

    def _replaced(self, node: Node, value: _Tree | Value, column: int) -> Iterator[_Edit]:
        """A value in place of that of a key which stands in a column of a block."""
        begin, end = self._source.begin(node), self._source.end(node)
        if not isinstance(value, dict):
            yield from self._written(node, value)
        elif isinstance(node, Mapping) and self._source.is_block(node):
            yield from self._in_block(node, value)
        elif isinstance(node, Mapping) and self._commented(node):
            yield from self._in_braces(node, value)
        else:  # braces become a block; what is no mapping cannot be meant
            entries = _block_of(node, self._source, value, column + _STEP)
            while self._text[begin - 1] == " ":
                begin -= 1
            yield _Edit(begin, end, "")
            yield self._below(end, entries)

    def _written(self, node: Node, value: Value) -> Iterator[_Edit]:
        """A value that is written out; comments between the items of a list stay."""
        begin, end = self._source.begin(node), self._source.end(node)
        items = node.items if isinstance(node, AnyList) else ()
        if isinstance(value, tuple) and len(items) == len(value):
            for item, cell in zip(items, value, strict=True):
                yield _Edit(self._source.begin(item), self._source.end(item), cell)
        else:
            yield _Edit(begin, end, (" " if is_empty(node) else "") + _flow(value))

    def _in_braces(self, node: Mapping, tree: _Tree) -> Iterator[_Edit]:
        for name, value in tree.items():
            entry = node.entry(name)
            if entry is not None and isinstance(value, dict) and isinstance(entry.value, Mapping):
                yield from self._in_braces(entry.value, value)
            elif entry is not None and isinstance(value, dict):
                yield _Edit(self._source.begin(entry.value), self._source.end(entry.value), " " + _flow(value))
            elif entry is not None and not isinstance(value, dict):
                yield from self._written(entry.value, value)
        new = {name: value for name, value in tree.items() if node.entry(name) is None}
        items = self._source.flow(node).items
        if not new:
            return
        end = self._source.end(items[-1].value) if items else self._source.begin(node) + 1
        apart = ",\n" if items and items[-1].gap.broken else ", "
        parts = [f"{name}: {_flow(value)}" for name, value in new.items()]
        yield _Edit(end, end, (apart if items else "") + apart.join(parts))

    def _commented(self, node: Node) -> bool:
        """Whether a comment stands within brackets."""
        if isinstance(node, Scalar):
            return False
        flow = self._source.flow(node)
        return bool(flow.end.comments) or any(item.gap.comments or self._commented(item.value) for item in flow.items)


def _block(tree: _Tree, column: int) -> str:
    """Lines of a block that stands in a column."""
    lines = ""
    for name, value in tree.items():
        lines += " " * column + f"{name}:"
        lines += "\n" + _block(value, column + _STEP) if isinstance(value, dict) else f" {_flow(value)}\n"
    return lines


def _block_of(node: Node, source: Source, tree: _Tree, column: int) -> str:
    """What stands in braces, with the values, as a block."""
    rest, lines = dict(tree), ""
    for entry in node.entries if isinstance(node, Mapping) else ():
        key = source.written(entry.key)
        value = rest.pop(entry.name, None)
        lines += " " * column + f"{key}:"
        if isinstance(value, dict):
            lines += "\n" + _block_of(entry.value, source, value, column + _STEP)
        else:
            lines += f" {source.written(entry.value) if value is None else _flow(value)}\n"
    return lines + _block(rest, column)


def _flow(value: _Tree | Value) -> str:
    """A value in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_flow(inner)}" for name, inner in value.items()) + "}"
    return value if isinstance(value, str) else "[" + ", ".join(value) + "]"
