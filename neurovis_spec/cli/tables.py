"""Plain tables: columns under each other, for people, whatever they are piped into.

In: rows of cells. Out: lines. Texts of the author's are made harmless for a terminal.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_spec.diagnostics import printable


def table(rows: Sequence[Sequence[str]], header: Sequence[str] = (), *, right: bool = False) -> str:
    """Rows with their columns aligned, indented by two; ``right`` aligns all but the first column to the right.

    >>> print(table([("C", "2"), ("Kernels", "8")], ("group", "size")))
      group    size
      C        2
      Kernels  8
    """
    cells = [[printable(cell) for cell in row] for row in ([header] if header else []) + list(rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))] if cells else []
    lines = []
    for row in cells:
        padded = [
            cell.rjust(width) if right and column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(padded).rstrip())
    return "\n".join(lines)


def number(value: float) -> str:
    """A number in few digits.

    >>> number(0.1 + 0.2), number(12000.0), number(-0.049)
    ('0.3', '12000', '-0.049')
    """
    return f"{value:.6g}"


def spread(values: Sequence[float]) -> str:
    """One number where all are equal, else the range.

    >>> spread([1.0, 1.0]), spread([0.5, -1.0])
    ('1', '-1 … 0.5')
    """
    low, high = min(values), max(values)
    return number(low) if low == high else f"{number(low)} … {number(high)}"
