"""The SourceDocument: values that know where they stand.

In: what the reader found in a text. Out: scalars, lists and mappings, each with its span. Long lists of plain
numbers, and long lists of short flat rows (matrix rows, edges), are held packed: arrays of values and of places,
never a node each. Whoever does not care calls ``.items`` and gets nodes, made on the spot.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.texts import Written

ScalarValue: TypeAlias = bool | int | float | str | None


class Scalar(NamedTuple):
    """A null, truth value, number or text. ``inner`` is the offset of the value's first character in the span
    (1 behind a quote), or None where the value's characters do not stand one by one in the source (escapes,
    several lines); ``written`` is then how it stands there, as far as that is known."""

    value: ScalarValue
    span: Span
    inner: int | None = 0
    written: Written | None = None

    def at(self, start: int, end: int) -> Span:
        """The place of characters ``start`` to ``end`` of a text value; the whole where that cannot be told."""
        if self.written is not None and isinstance(self.value, str):
            return self._within(self.written, self.value, start, end)
        if self.inner is None or self.span.line != self.span.end_line:
            return self.span
        return self.span.within(self.inner + start, self.inner + end)

    def part(self, start: int, end: int) -> Scalar:
        """Characters ``start`` to ``end`` of a text value as a text of their own."""
        text = str(self.value)
        span = self.at(start, end)
        if self.written is not None:
            return Scalar(text[start:end], span, None, self.written.part(text, start, end))
        return Scalar(text[start:end], span, None if span == self.span else 0)

    def _within(self, written: Written, value: str, start: int, end: int) -> Span:
        places = written.places(value)
        if not places:
            return self.span
        file, line, column, _, _ = self.span
        last = min(max(start, end - 1), len(places) - 1)
        (first_line, first), (last_line, final) = places[min(start, last)], places[last]
        first += 0 if first_line else column - 1
        final += 0 if last_line else column - 1
        return Span(file, line + first_line, first + 1, line + last_line, final + 2)


class Entry(NamedTuple):
    """One ``key: value`` of a mapping. The key is a text: a key that YAML reads otherwise was refused."""

    key: Scalar
    value: Node

    @property
    def name(self) -> str:
        """The key as a text."""
        return str(self.key.value)


#: Mappings of more entries have a table of them; there may be very many small ones.
_FEW: Final = 8


@dataclass(frozen=True, slots=True)
class Mapping:
    """Entries in the order written, keys unique. Where lines of it could not be read it ``is_open``: nobody knows which
    other entries it has."""

    entries: tuple[Entry, ...]
    span: Span
    is_open: bool = False
    _table: dict[str, Entry] | None = field(default=None, init=False, repr=False, compare=False)

    def entry(self, name: str) -> Entry | None:
        """The entry of this key, or None."""
        if len(self.entries) <= _FEW:
            for entry in self.entries:
                if entry.key.value == name:
                    return entry
            return None
        if self._table is None:
            object.__setattr__(self, "_table", {entry.name: entry for entry in self.entries})
        assert self._table is not None
        return self._table.get(name)

    def get(self, name: str) -> Node | None:
        """The value of this key, or None."""
        entry = self.entry(name)
        return None if entry is None else entry.value


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list whose items are nodes."""

    items: tuple[Node, ...]
    span: Span

    def __len__(self) -> int:
        return len(self.items)


#: Kinds of a packed cell.
NULL, NUMBER, TEXT = 0, 1, 2


@dataclass(frozen=True)
class Packed:
    """A long list in arrays: flat scalars (``rows`` is None) or rows of flat scalars.

    Cell ``c`` has ``kinds[c]`` (NULL, NUMBER or TEXT), ``numbers[c]`` (a float; NaN for null; the index into ``texts``
    for a text), and stands on line ``lines[c]`` from column ``columns[c]`` to ``ends[c]`` (1-based, exclusive).
    ``integers`` says whether a number was written as an integer. Row ``r`` holds the cells from ``rows[r]`` up to
    ``rows[r + 1]``.
    """

    span: Span
    kinds: array[int] = field(default_factory=lambda: array("b"))
    numbers: array[float] = field(default_factory=lambda: array("d"))
    lines: array[int] = field(default_factory=lambda: array("i"))
    columns: array[int] = field(default_factory=lambda: array("i"))
    ends: array[int] = field(default_factory=lambda: array("i"))
    integers: array[int] = field(default_factory=lambda: array("b"))
    quoted: array[int] = field(default_factory=lambda: array("b"))
    texts: tuple[str, ...] = ()
    rows: array[int] | None = None

    def __len__(self) -> int:
        return len(self.kinds) if self.rows is None else len(self.rows) - 1

    def cell(self, index: int) -> Scalar:
        """One cell as a node."""
        line = self.lines[index]
        span = Span(self.span.file, line, self.columns[index], line, self.ends[index])
        kind = self.kinds[index]
        if kind == NULL:
            return Scalar(None, span)
        if kind == TEXT:
            return Scalar(self.texts[int(self.numbers[index])], span, 1 if self.quoted[index] else 0)
        number = self.numbers[index]
        return Scalar(int(number) if self.integers[index] else number, span)

    def row(self, index: int) -> Sequence:
        """One row as a node; only where there are rows."""
        assert self.rows is not None
        cells = tuple(self.cell(c) for c in range(self.rows[index], self.rows[index + 1]))
        if not cells:
            return Sequence((), self.span)
        first, last = cells[0].span, cells[-1].span
        return Sequence(cells, Span(first.file, first.line, first.column, last.end_line, last.end_column))

    def __iter__(self) -> Iterator[Node]:
        make = self.cell if self.rows is None else self.row
        return (make(index) for index in range(len(self)))

    @property
    def items(self) -> tuple[Node, ...]:
        """All items as nodes, made anew at each call."""
        return tuple(self)


#: A list, however it is kept.
AnyList: TypeAlias = Sequence | Packed
Node: TypeAlias = Scalar | Mapping | AnyList


def one_or_more(node: Node | None) -> tuple[Node, ...]:
    """The items of a list, or what stands there alone, if there is anything."""
    return node.items if isinstance(node, AnyList) else () if node is None else (node,)


class SourceDocument(NamedTuple):
    """One file, read: its root is a mapping."""

    file: str
    root: Mapping


def describe(node: Node) -> str:
    """What a node is, in an author's words.

    >>> describe(Scalar(True, Span("x", 1, 1, 1, 5)))
    'true'
    """
    match node:
        case Scalar(value=None, span=span):
            return "nothing" if span.column == span.end_column else "null"
        case Scalar(value=bool() as truth):
            return "true" if truth else "false"
        case Scalar(value=int() | float() as number):
            return f"the number {number}"
        case Scalar(value=value):
            text = str(value)
            return f"the text '{text if len(text) <= 40 else text[:37] + '…'}'"
        case Mapping():
            return "a mapping"
        case _:
            return "a list"
