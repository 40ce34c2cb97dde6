"""The outline of a document: every key and every text in it, with the keys that lead there.

In: a SourceDocument, or the text of one that cannot be read at this moment (``tolerant``). Out: Items in the order of
the document. Numbers in long packed lists are left out: nobody asks for their names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.source import TEXT, Mapping, Node, Packed, Scalar, Sequence

#: Keys and indices from the root.
Path: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Item:
    """A key or a value. ``path`` leads to it: that of a key ends with the key itself, and that of its value is equal.

    ``whole`` spans a key together with its value.
    """

    path: Path
    scalar: Scalar
    is_key: bool
    whole: Span

    @property
    def span(self) -> Span:
        """Where it stands."""
        return self.scalar.span

    @property
    def text(self) -> str:
        """The key, or the value as a text."""
        return "" if self.scalar.value is None else str(self.scalar.value)


def outline(node: Node, path: Path = ()) -> Iterator[Item]:
    """The items of a node, in the order written."""
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                below = (*path, entry.name)
                first, last = entry.key.span, entry.value.span
                end = max((first.end_line, first.end_column), (last.end_line, last.end_column))
                yield Item(below, entry.key, True, Span(first.file, first.line, first.column, *end))
                yield from outline(entry.value, below)
        case Sequence(items=items):
            for index, item in enumerate(items):
                yield from outline(item, (*path, index))
        case Packed():
            yield from _packed(node, path)
        case Scalar():
            yield Item(path, node, False, node.span)


def _packed(node: Packed, path: Path) -> Iterator[Item]:
    """The texts of a packed list."""
    rows, row = node.rows, 0
    for index, kind in enumerate(node.kinds):
        if kind != TEXT:
            continue
        if rows is None:
            below: Path = (*path, index)
        else:
            while rows[row + 1] <= index:
                row += 1
            below = (*path, row, index - rows[row])
        cell = node.cell(index)
        yield Item(below, cell, False, cell.span)
