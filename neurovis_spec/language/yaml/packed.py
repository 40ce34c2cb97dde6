"""Long plain lists without a node an item: values and their places go straight into arrays.

In: values with their places, or the nodes of a list's first items. Out: a Packed. What an array cannot hold (truth
values, texts over several lines or with escapes, integers that a float would round) is not taken, and the list stays
one of nodes.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence as Many
from typing import Final

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.yaml.source import NULL, NUMBER, TEXT, Node, Packed, Scalar, ScalarValue, Sequence

#: Longer lists are packed.
PACK_FROM: Final = 64
_EXACT = 2**53  # beyond it a float skips integers
_NAN = float("nan")


class Packer:
    """Fills the arrays of one list, of scalars or of rows of scalars."""

    def __init__(self, file: str, in_rows: bool) -> None:
        self._file = file
        self._arrays = Packed(Span(file, 1, 1, 1, 1))
        self._texts: dict[str, int] = {}
        self.in_rows = in_rows
        self._closed = 1, 1
        self._row_ends = array("q", [0] if in_rows else [])

    @classmethod
    def of(cls, items: Many[Node], file: str) -> Packer | None:
        """A packer that holds these items already, or None where they do not fit."""
        packer = cls(file, not isinstance(items[0], Scalar))
        return packer if all(packer.add_node(item) for item in items) else None

    def __len__(self) -> int:
        """The number of cells."""
        return len(self._arrays.kinds)

    def add_node(self, node: Node) -> bool:
        """Take an item; False, and nothing taken, where it does not fit."""
        if isinstance(node, Scalar):
            return not self.in_rows and self._add_scalar(node)
        if not self.in_rows or not isinstance(node, Sequence | Packed) or len(node) == 0:
            return False
        first = len(self)
        if not all(isinstance(cell, Scalar) and self._add_scalar(cell) for cell in node.items):
            self._forget(first)
            return False
        self.end_row(node.span.end_line, node.span.end_column)
        return True

    def _add_scalar(self, scalar: Scalar) -> bool:
        span = scalar.span
        if scalar.inner is None or span.line != span.end_line:
            return False
        return self._put(scalar.value, span.line, span.column, span.end_column, scalar.inner)

    def add_cells(self, cells: Many[tuple[ScalarValue, int, int]], line: int) -> bool:
        """Take values that stand on a line, each with the columns at which it begins and ends; False where one does not
        fit, and the list cannot be packed."""
        return all(self._put(value, line, begin, end, 0) for value, begin, end in cells)

    def add_row(self, cells: Many[tuple[ScalarValue, int, int]], line: int, column: int) -> bool:
        """Take a row whose bracket closes before a column; False, and nothing taken, where it does not fit."""
        first = len(self)
        if not self.add_cells(cells, line):
            self._forget(first)
            return False
        self.end_row(line, column)
        return True

    def _put(self, value: ScalarValue, line: int, column: int, end: int, quoted: int) -> bool:
        arrays = self._arrays
        integer = 0
        if type(value) is str:
            if "(" in value and balance(value) > 0:  # perhaps a text that a comma has cut
                return False
            texts = self._texts
            kind, number = TEXT, float(texts.setdefault(value, len(texts)))
        elif type(value) is float:
            kind, number = NUMBER, value
        elif type(value) is int:
            if not -_EXACT <= value <= _EXACT:
                return False
            kind, number, integer = NUMBER, float(value), 1
        elif value is None:
            kind, number = NULL, _NAN
        else:
            return False
        arrays.kinds.append(kind)
        arrays.numbers.append(number)
        arrays.lines.append(line)
        arrays.columns.append(column)
        arrays.ends.append(end)
        arrays.integers.append(integer)
        arrays.quoted.append(quoted)
        return True

    def end_row(self, line: int, column: int) -> None:
        """The cells since the last row's end are a row, whose bracket closes before this place."""
        self._row_ends.append(len(self))
        self._closed = line, column

    def _forget(self, first: int) -> None:
        arrays = self._arrays
        for cells in (arrays.kinds, arrays.lines, arrays.columns, arrays.ends, arrays.integers, arrays.quoted):
            del cells[first:]
        del arrays.numbers[first:]

    def take_back_items(self) -> list[Node]:
        """All items, as nodes, for a list that has to go on without packing."""
        return list(self.finish(self._arrays.span).items)

    def end(self) -> tuple[int, int]:
        """Line and column behind the last item."""
        return self._closed if self.in_rows else (self._arrays.lines[-1], self._arrays.ends[-1])

    def finish(self, span: Span) -> Packed:
        """The list, which stands at ``span``."""
        a = self._arrays
        rows = self._row_ends if self.in_rows else None
        return Packed(
            span, a.kinds, a.numbers, a.lines, a.columns, a.ends, a.integers, a.quoted, tuple(self._texts), rows
        )


def balance(text: str) -> int:
    """How many parentheses of a text are not closed in it."""
    return text.count("(") - text.count(")")
