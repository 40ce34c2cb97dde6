"""The outline of a document: every key and every text in it, with the keys that lead there.

In: what was read of a text. Out: Items in the order of the document. Numbers in long packed lists are left out: nobody
asks for their names.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.source import TEXT, Mapping, Node, Packed, Scalar, Sequence
from neurovis_spec.lsp.text import Place, holds

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


def outline(node: Node, path: Path = (), edges: bool = True) -> Iterator[Item]:
    """The items of a node, in the order written. Without ``edges`` lists of edges are left out, which may be long and
    declare nothing."""
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                below = (*path, entry.name)
                first, last = entry.key.span, entry.value.span
                end = max((first.end_line, first.end_column), (last.end_line, last.end_column))
                yield Item(below, entry.key, True, Span(first.file, first.line, first.column, *end))
                if edges or entry.name != "edges" or isinstance(entry.value, (Mapping, Scalar)):
                    yield from outline(entry.value, below, edges)
        case Sequence(items=items):
            for index, item in enumerate(items):
                yield from outline(item, (*path, index), edges)
        case Packed():
            yield from _packed(node, path)
        case Scalar():
            yield Item(path, node, False, node.span)


def nodes_at(node: Node, place: Place, path: Path = ()) -> list[tuple[Path, Node, bool]]:
    """The values around a place, from the outermost to the key or the text there, each with the keys that lead to it
    and whether it is a key; nothing where there is none. Only nodes around the place are visited."""
    here: tuple[Path, Node, bool] = path, node, False
    match node:
        case Mapping(entries=entries):
            for entry in entries:
                if holds(entry.key.span, place):
                    return [here, ((*path, entry.name), entry.key, True)]
            return _below(here, ((entry.value, entry.name) for entry in entries), place)
        case Sequence(items=items):
            return _below(here, ((item, index) for index, item in enumerate(items)), place)
        case Packed(lines=lines):
            for cell in range(bisect_left(lines, place.line), bisect_right(lines, place.line)):
                if node.columns[cell] <= place.column <= node.ends[cell]:
                    return [here, ((*path, *_indices(node, cell)), node.cell(cell), False)]
            return []
    return [here]


def _below(
    here: tuple[Path, Node, bool], parts: Iterable[tuple[Node, str | int]], place: Place
) -> list[tuple[Path, Node, bool]]:
    # A block ends where the next begins, so that a place may be in two.
    found = (nodes_at(part, place, (*here[0], name)) for part, name in parts if holds(part.span, place))
    return next(([here, *below] for below in found if below), [])


def item_at(root: Node, place: Place) -> Item | None:
    """The key or the text at a place."""
    found = nodes_at(root, place)
    if not found:
        return None
    path, node, is_key = found[-1]
    return Item(path, node, is_key, node.span) if isinstance(node, Scalar) else None


def _indices(node: Packed, cell: int) -> Path:
    """The index of a cell, or those of its row and of the cell in it."""
    if node.rows is None:
        return (cell,)
    row = bisect_right(node.rows, cell) - 1
    return (row, cell - node.rows[row])


def _packed(node: Packed, path: Path) -> Iterator[Item]:
    """The texts of a packed list."""
    for index, kind in enumerate(node.kinds):
        if kind == TEXT:
            cell = node.cell(index)
            yield Item((*path, *_indices(node, index)), cell, False, cell.span)
